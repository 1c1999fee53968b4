"""A run on a real scheduler with worker processes, through the real command line."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from command_line import Snooker
from hostile import plant_modules
from repeating import StopsAtOnce, bytes_of, contents, done, made

from snooker_cli import runs, store
from snooker_cli.runs import dask_executor
from snooker_cli.runs.batch import Batch
from snooker_cli.runs.dask_executor import RemoteRun, simulate_remotely, software
from snooker_cli.runs.execution import execute
from snooker_cli.runs.folder import failures
from snooker_cli.trace import StopReason

distributed = pytest.importorskip("distributed")

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform == "win32", reason="processes are stopped by signals"),
]

FIRST = Batch(0, (0, 1, 2))
"""The repeats of the first point of the finished run."""

LONG = """\
container: {radius: 10.0}
balls: {rings: 1, radius: 1.0, speed: 10.0}
cor: 1
collisions: 400000
repeats: 5
"""
"""Batches of one repeat, written as it comes, so that a worker that has begun one can be seen."""


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[distributed.LocalCluster]:
    """A scheduler with two workers, processes of one thread each; a killed one is replaced."""
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        dashboard_address=":0",
        silence_logs=logging.CRITICAL,
        local_directory=str(tmp_path_factory.mktemp("workers")),
    ) as started:
        yield started


@pytest.fixture(scope="module")
def client(scheduler: distributed.LocalCluster) -> Iterator[distributed.Client]:
    """Looks at the workers and changes them."""
    with distributed.Client(scheduler.scheduler_address, set_as_default=False) as connected:
        yield connected


@pytest.fixture
def executor(scheduler: distributed.LocalCluster, client: distributed.Client) -> str:
    """What ``--executor`` is given; both workers are there, and equally quick to begin."""

    def compile_first() -> None:
        from snooker_cli.config import parse
        from snooker_cli.runs.warm_up import compile_for

        compile_for(parse(LONG).config)

    client.wait_for_workers(2, timeout=60)
    client.run(compile_first)
    return f"dask={scheduler.scheduler_address}"


def test_no_module_of_the_current_folder_is_run(executor: str, here: Path) -> None:
    plant_modules(here)
    command = [sys.executable, "-m", "snooker_cli", "run", "small.yaml", "--executor", executor]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "of the current folder" not in done.stderr


# The same bits


@pytest.mark.parametrize(
    "overrides", [(), ("record=summary", "container.mass=.inf,1e7", "cor=1.0")]
)
def test_a_cluster_gives_the_bits_of_threads(
    overrides: tuple[str, ...], snooker: Snooker, here: Path, executor: str, small_config: str
) -> None:
    """And files that differ in the moment alone; that they are there is seen the next time."""
    local = made(here / "local", small_config, *overrides)
    done(local)
    options = [word for override in overrides for word in ("-o", override)]
    command = ["run", "small.yaml", "--out", "far", "--no-progress", "--executor", executor]
    ended = snooker(*command, *options)
    assert (ended.code, ended.err) == (0, "")
    far = runs.open_run(here / "far")
    assert contents(far) == contents(local)
    assert bytes_of(far.directory).keys() == bytes_of(local.directory).keys()
    for path in far.directory.glob("point-*/*.h5"):
        there = store.check(path)[0].provenance
        mine = store.check(local.directory / path.relative_to(far.directory))[0].provenance
        moment = {"started": there.started, "seconds": there.seconds, "command": there.command}
        assert replace(mine, **moment) == there
        assert there.command == " ".join(["snooker", *command, *options])
    before = bytes_of(far.directory)
    again = snooker(*command, *options)
    assert again.code == 0
    assert f"{len(contents(far))} repeats were already stored" in again.out
    assert bytes_of(far.directory) == before


# Interrupts


@pytest.fixture
def long_config(here: Path) -> list[str]:
    """Arguments of a run whose repeats take a while."""
    (here / "long.yaml").write_text(LONG)
    return ["run", "long.yaml", "--out", "long", "--no-progress"]


def test_an_interrupt_keeps_what_is_done_and_what_is_under_way(
    here: Path, executor: str, long_config: list[str]
) -> None:
    command = [sys.executable, "-m", "snooker_cli", *long_config, "-o", "repeats=10000", "--yes"]
    process = subprocess.Popen(
        [*command, "--executor", executor],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    point = here / "long" / "point-0000"
    while not (list(point.glob("*.h5")) and list(point.glob("*.part"))):
        assert process.poll() is None, process.communicate()
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate()
    assert process.returncode == 130
    assert stderr.startswith("snooker: stopping; saving the current repeats\n")
    there = {path: store.check(path)[0].stop.reason for path in point.glob("*.h5")}
    assert set(there.values()) <= {StopReason.COLLISIONS, StopReason.INTERRUPTED}
    whole = [reason for reason in there.values() if reason is StopReason.COLLISIONS]
    assert f"interrupted: {len(whole)} of 10,000 repeats done" in stderr
    assert len(there) - len(whole) <= 2
    before = bytes_of(here / "long")
    assert not [name for name in before if name.endswith(".part")]


# Progress


def test_workers_report_how_far_their_repeats_are(here: Path, executor: str) -> None:
    """The first news ends a run that would take minutes."""
    run = made(here / "long", LONG.replace("400000", "50000000"))
    stops = StopsAtOnce()
    cancelled, news = stops.cancelled, stops.news
    timer = threading.Timer(60.0, cancelled.set)
    timer.start()
    with dask_executor.DaskExecutor(executor.partition("=")[2], None, cancelled) as cluster:
        results = execute(run, workers=1, watcher=stops, cancelled=cancelled, executor=cluster)
    timer.cancel()
    assert news
    assert [of_batch.share for of_batch in news] == pytest.approx(
        [of_batch.collisions / 5e7 for of_batch in news]
    )
    reasons = [result.stop.reason for result in results if result.stop]
    assert set(reasons) == {StopReason.INTERRUPTED}


# What cannot be


@pytest.mark.parametrize(
    ("executor", "sentence"),
    [
        ("dask=tcp://host:65536", "--executor dask=tcp://host:65536: no address of a scheduler"),
        ("dask=tls://127.0.0.1:9", "--executor dask=tls://127.0.0.1:9: dask's configuration names"),
        ("dask=tcp://127.0.0.1:9", "no dask scheduler answers at tcp://127.0.0.1:9 ("),
    ],
)
def test_what_is_no_scheduler_is_a_usage_error(
    executor: str, sentence: str, snooker: Snooker, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_executor, "ANSWER_TIMEOUT", 0.2)
    ended = snooker("run", "small.yaml", "--executor", executor)
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith(f"snooker: {sentence}")
    assert ended.err.count("\n") == 1
    assert not (here / "runs").exists()


def test_without_dask_its_extra_is_named(
    snooker: Snooker, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    ended = snooker("run", "small.yaml", "--executor", "dask=tcp://127.0.0.1:8786")
    assert (ended.code, ended.out) == (2, "")
    assert "pip install 'dask[distributed]>=" in ended.err


def test_workers_with_another_engine_are_refused(
    snooker: Snooker, here: Path, executor: str, client: distributed.Client
) -> None:
    def version(number: int | None) -> int:
        from snooker_cli.runs import dask_executor

        before = dask_executor.ENGINE_VERSION
        dask_executor.ENGINE_VERSION = number or before
        return before

    worker, *_ = client.run(version, None)
    (mine,) = client.run(version, 99, workers=[worker]).values()
    try:
        ended = snooker("run", "small.yaml", "--executor", executor)
    finally:
        client.run(version, mine, workers=[worker])
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith(f"snooker: the worker at {worker} has snooker ")
    assert "with engine version 99, files of schema" in ended.err
    assert not (here / "runs").exists()


# What a worker does, in this process


@pytest.fixture
def remote(finished: Path) -> RemoteRun:
    """The finished run, as a worker gets it."""
    run = runs.open_run(finished)
    name, directory = str(finished), finished.absolute()
    return RemoteRun(name, software(), directory, run.identity, "snooker", 600.0)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"directory": Path("elsewhere").absolute()}, "elsewhere: there is no run here"),
        ({"identity": "0" * 8}, "holds another run as the worker on "),
        ({"software": "snooker 99"}, "not snooker 99; install the same versions everywhere"),
    ],
)
def test_a_worker_refuses_what_it_must_not_simulate(
    change: dict[str, Any], problem: str, remote: RemoteRun
) -> None:
    results = simulate_remotely(replace(remote, **change), FIRST)
    assert results is not None
    assert [result.repeat for result in results] == [0, 1, 2]
    assert all(problem in str(result.error) for result in results)


# Workers that die


class Killer(threading.Thread):
    """Kills one of two workers as soon as both are writing a repeat.

    Both are halted first, so that none can end its repeat between a look and the kill.
    """

    def __init__(self, directory: Path, pids: list[int]) -> None:
        super().__init__()
        self.directory, self.pids = directory, pids
        self.under_way: set[int] = set()
        self.over = threading.Event()

    def run(self) -> None:
        while not self.over.wait(0.001):
            if len(self._begun()) < 2:
                continue
            try:
                for pid in self.pids:
                    os.kill(pid, signal.SIGSTOP)
                    os.waitpid(pid, os.WUNTRACED)
                self.under_way = self._begun()
                if len(self.under_way) == 2:
                    os.kill(self.pids[0], signal.SIGKILL)
                    return
            finally:
                for pid in self.pids:
                    with suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGCONT)

    def _begun(self) -> set[int]:
        """The repeats whose files are being written."""
        parts = self.directory.glob("point-0000/*.part")
        return {int(path.name.split("-")[1]) for path in parts}


@pytest.mark.parametrize("allowed_failures", [0, 3])
def test_a_killed_worker_costs_at_most_the_repeat_that_it_was_at(
    allowed_failures: int,
    snooker: Snooker,
    here: Path,
    executor: str,
    scheduler: distributed.LocalCluster,
    client: distributed.Client,
    long_config: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """That repeat fails, where the scheduler tries each task with one worker only."""
    monkeypatch.setattr(scheduler.scheduler, "allowed_failures", allowed_failures)
    killer = Killer(here / "long", list(client.run(os.getpid).values()))
    killer.start()
    try:
        # One repeat for each worker, so that none is given to it that it has not begun.
        ended = snooker(*long_config, "--executor", executor, "-j", "2")
    finally:
        killer.over.set()
        killer.join()
    run = runs.open_run(here / "long")
    assert len(killer.under_way) == 2
    failed = [repeat for repeat in range(5) if not run.path(0, [repeat]).exists()]
    assert list(failures(run)) == [(0, repeat) for repeat in failed]
    if allowed_failures:
        assert (ended.code, ended.err, failed) == (0, "", [])
        assert not list(run.directory.rglob("*.part"))
        local = made(here / "local", LONG)
        done(local, workers=2)
        assert contents(run) == contents(local)
    else:
        assert ended.code == 4
        assert len(failed) == 1
        assert failed[0] in killer.under_way
        assert ended.err.startswith(f"snooker: point 0, repeat {failed[0]} failed: "), ended.err
