"""What several test files start from: finished runs and traces, the command line in-process."""

from __future__ import annotations

import gc
import os
import shutil
import sys
from collections.abc import Callable, Generator, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line has it; before NumPy

import figure_runs
import moving_pictures
import pytest
import repeating
import typer.main
from browser import CHROMIUM, Browser
from command_line import SMALL, Ended
from compile_ahead import compile_ahead
from scene_types import CompiledTypes
from xdist.scheduler import WorkStealingScheduling

from snooker_cli.animation import Film
from snooker_cli.cli import COLLECT_AFTER, main
from snooker_cli.config import parse
from snooker_cli.engine import jit, simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import RunFolder, warm_up
from snooker_cli.signals import end_interrupted, handling
from snooker_cli.store import Provenance
from snooker_cli.trace import Trace

# A command line's parser is made once, not at each of a thousand calls: that takes 30 ms.
typer.main.get_command = cache(typer.main.get_command)


COMPILED = CompiledTypes()

CANNOT_RUN = {
    *("it has no such permissions", "it has other locks", "it cannot lock folders"),
    *("processes are stopped by signals", "signals of POSIX", "there are no such files"),
    *("memory is limited on Linux only", "there is no full device here"),
    "NumPy has one code for this processor",
}
"""Reasons to skip a test that a machine or its system cannot run, whatever one installs."""

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)


def checked_skip(report: Report) -> Report:
    """A report; with CI=true a test is a failure if it is skipped for another reason."""
    is_skip = report.skipped and not hasattr(report, "wasxfail")
    if not is_skip or os.environ.get("CI") != "true":
        return report
    assert isinstance(report.longrepr, tuple)
    reason = report.longrepr[2].removeprefix("Skipped: ")
    if reason not in CANNOT_RUN:
        report.outcome = "failed"
        report.longrepr = f"skipped in CI: {reason}; install what is missing, as .ci/run does"
    return report


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    return checked_skip((yield))


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return checked_skip((yield))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--write-goldens",
        action="store_true",
        help="Write what is printed now to tests/golden, or with tests/docs to the documents.",
    )


def pytest_sessionstart(session: pytest.Session) -> None:
    """Before processes start that would each compile the same."""
    gc.set_threshold(COLLECT_AFTER)
    jit.set_up_numba()  # before a module of tests that compiles functions of its own
    COMPILED.watch()
    warm_up.BESIDE = False  # tests that want a second process ask for it
    works = hasattr(session.config, "workerinput")
    if session.config.getoption("numprocesses", None) and not works:
        compile_ahead()


@pytest.fixture(scope="session", autouse=True)
def _kept_results(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Analyses and certificates that tests make are not kept among those of the user."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("SNOOKER_CACHE_DIR", str(tmp_path_factory.mktemp("kept")))
        yield


@pytest.fixture(autouse=True)
def _types_of_scenes(request: pytest.FixtureRequest) -> Iterator[None]:
    """A test that compiles a type of scene which is in no list fails, see scene_types.py.

    Long tests have time for others.
    """
    yield
    unlisted = dict.fromkeys(COMPILED.unlisted)
    COMPILED.unlisted.clear()
    assert not unlisted or request.node.get_closest_marker("long"), (
        f"{', '.join(unlisted)}: no test has scenes of this type yet; take "
        "one of the types in tests/scene_types.py, or add this one there"
    )


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> WorkStealingScheduling:
    """Neighbours stay together, so that hardly a module's runs are made by two processes."""
    return WorkStealingScheduling(config, log)


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser without a window."""
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here")
    with Browser(tmp_path_factory.mktemp("profile")) as started:
        yield started


@pytest.fixture(scope="session")
def small_config() -> str:
    """A config of two points with three repeats of seven balls; some end in a wall trap."""
    return SMALL


@pytest.fixture(scope="session")
def one_point() -> str:
    """The same at a CoR of 1, where every repeat reaches its last collision."""
    return SMALL.replace("sweep: {cor: [0.85, 1.0]}\n", "").replace("cor: 0.85", "cor: 1")


@pytest.fixture(scope="session")
def finished_run(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """That config, run. Copy it before changing it."""
    return figure_runs.made(tmp_path_factory.mktemp("finished") / "small", text=SMALL)


@pytest.fixture(scope="session")
def finished_one_each(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """The same run in batches of one repeat: one file for each. Copy it before changing it."""
    with repeating.batches_of(1):
        return figure_runs.made(tmp_path_factory.mktemp("one-each") / "small", text=SMALL)


@pytest.fixture
def one_each() -> Iterator[None]:
    """Batches of one repeat, for tests of files whose subject is not the batch."""
    with repeating.batches_of(1):
        yield


@pytest.fixture(scope="session")
def decaying(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """Nineteen balls at three CoR, every collision recorded. Copy it before changing it."""
    return figure_runs.made(tmp_path_factory.mktemp("decaying") / "run", *figure_runs.DECAYING)


@pytest.fixture(scope="session")
def warm(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """Elastic balls of two sizes at three speeds, as summaries. Copy it before changing it."""
    return figure_runs.made(tmp_path_factory.mktemp("warm") / "run", *figure_runs.WARM)


@pytest.fixture(scope="session")
def shown() -> dict[str, Trace]:
    """Two hundred collisions in each type of container."""
    return moving_pictures.shown()


@pytest.fixture(scope="session")
def films() -> dict[str, Film]:
    """A film of each type of container."""
    return moving_pictures.films()


@pytest.fixture(scope="session")
def traces() -> dict[str, Trace]:
    """Three hundred collisions of nineteen balls, recorded both ways; as files have them."""
    scene = starting_scene(parse(SMALL, overrides=["balls.rings=2", "cor=0.95"]).config, 0)
    return {
        kind: simulate(scene, collisions=300, summary=kind == "summary")
        for kind in ("events", "summary")
    }


@pytest.fixture(scope="session")
def provenance() -> Provenance:
    """The same on every machine and at any time."""
    return Provenance(
        config='{"title": "Stöße", "container": {"mass": null}}',
        digest="0" * 64,
        parameters='{"cor": 0.9}',
        point=3,
        engine_version=1,
        versions='{"python": "3.11.9"}',
        machine="x86_64",
        command="snooker run µ.yaml -o cor=0.9",
        started="2024-02-29T12:00:00.000+00:00",
        seconds=0.1 + 0.2,
    )


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with the small config, ``small.yaml``; no analysis is kept."""
    monkeypatch.setenv("SNOOKER_CACHE_DIR", str(tmp_path.with_name(f"{tmp_path.name}-kept")))
    (tmp_path / "small.yaml").write_text(SMALL)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def finished(here: Path, finished_run: RunFolder) -> Path:
    """That directory with the config's run in it, ``runs/small``."""
    return Path(shutil.copytree(finished_run.directory, here / "runs" / "small"))


@pytest.fixture
def separate(here: Path, finished_one_each: RunFolder) -> Path:
    """The same, with one file for each repeat."""
    return Path(shutil.copytree(finished_one_each.directory, here / "runs" / "small"))


@pytest.fixture
def snooker(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., Ended]:
    """The console script's entry, called with arguments."""

    def call(*arguments: str | Path) -> Ended:
        monkeypatch.setattr(sys, "argv", ["snooker", *map(str, arguments)])
        capsys.readouterr()
        with handling(end_interrupted), pytest.raises(SystemExit) as end:
            main()
        printed = capsys.readouterr()
        code = end.value.code
        assert isinstance(code, int)
        return Ended(code, printed.out, printed.err)

    return call
