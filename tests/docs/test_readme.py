"""What the README shows is what the commands print, and its finding is the audit's."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from snooker_cli import __version__
from snooker_cli.config import digest, load, parse
from snooker_cli.engine.jit import NOTICE
from snooker_cli.report.setting_search import LIKELY, TARGETS, elastic_pressures, search
from snooker_cli.report.source_values import SOURCE_VALUES, source_value
from snooker_cli.report.supplements import accuracy_values
from snooker_cli.runs import Run, create
from snooker_cli.runs.execution import Watcher, execute

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```console\n(.*?)```", README, flags=re.DOTALL)
TIMING = re.compile(r" in [\d.]+ s \([\d,]+ events/s\)( after \d+ s of compiling)?")


Snooker = Callable[..., Any]
"""The fixture of that name: arguments in, code, out and err back."""


def printed(command: str, snooker: Snooker) -> str:
    """What a command prints, perhaps through grep; snooker's is called in this process."""
    own, _, others = command.partition(" | ")
    ended = snooker(*shlex.split(own.removeprefix("snooker ")))
    assert ended.code == 0, ended.err
    if not others:
        return str(ended.out)
    done = subprocess.run(
        shlex.split(others), input=ended.out, capture_output=True, encoding="utf-8", check=True
    )
    return done.stdout


def shell(command: str, folder: Path) -> str:
    """What a command prints, with this environment's snooker first on the path."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        command,
        shell=True,
        cwd=folder,
        env={**os.environ, "PATH": path, "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        text=True,
        check=True,
        encoding="utf-8",
    )
    return done.stdout


def done(name: str, folder: Path) -> Run:
    """A config's run, as the command makes it."""
    run = create(folder / "runs" / name, load(ROOT / "configs" / f"{name}.yaml").experiment)
    outcomes = execute(run, workers=1, watcher=Watcher(), cancelled=threading.Event())
    assert [outcome.error for outcome in outcomes if outcome.error] == []
    return run


def words(output: str) -> list[list[str]]:
    """A table's cells: not how long it took, nor how wide the columns are."""
    return [line.split() for line in TIMING.sub("", output).splitlines()]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the configs, as a user has it."""
    made = tmp_path_factory.mktemp("readme")
    shutil.copytree(ROOT / "configs", made / "configs")
    return made


def test_commands_print_what_the_readme_shows(
    folder: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first as a shell runs it, the others without Python's start."""
    monkeypatch.chdir(folder)
    shown = [block for block in BLOCKS if block.startswith("$ snooker")]
    assert len(shown) >= 4
    for number, block in enumerate(shown):
        command, _, output = block.removeprefix("$ ").partition("\n")
        found = printed(command, snooker) if number else shell(command, folder)
        assert words(found) == words(output), command


def test_the_two_commands_are_the_makefiles() -> None:
    targets = re.findall(r"\$ make (\w+)", README)
    assert targets == ["report", "test"]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in [*targets, *re.findall(r"`make (\w+)`", README)]:
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target


def test_the_config_shown_is_the_one_run() -> None:
    shown = re.search(r"```yaml\n(.*?)```", README, flags=re.DOTALL)
    assert shown is not None
    of_file = load(ROOT / "configs" / "decay.yaml").experiment
    of_readme = parse(shown.group(1)).experiment
    assert digest(of_file) == digest(of_readme)
    assert (of_file.sweep, of_file.repeats) == (of_readme.sweep, of_readme.repeats)


def test_schema_beside_the_configs_is_the_commands(snooker: Snooker) -> None:
    committed = (ROOT / "configs" / "schema.json").read_text(encoding="utf-8")
    assert committed == printed("snooker schema", snooker)


@pytest.mark.long
def test_finding(folder: Path) -> None:
    """The README's sentences on the audit, from a full search."""
    run, elastic = (done(name, folder) for name in ("audit", "temperature"))
    found = search(run, elastic_pressures(elastic, run.experiment.balls.speed))
    best = found.ranked[0]
    text = " ".join(README.split())
    assert f"Of {len(SOURCE_VALUES)} numbers that the report prints" in text
    assert f"Of {len(found.ranked)} settings ranked" in text
    setting = best.setting
    assert (setting.elastic_wall, setting.fixed_amplitude, setting.window) == (True, False, 500)
    assert (setting.radius, setting.slip.decay, setting.slip.speed) == (1.0, -1, 0)
    assert setting.slip.pressure == 0
    assert found.factor == 10.0
    assert f"rings to {setting.extent:g} of the container's radius" in text
    values = [best.our_value(source_value(name)).value for name in TARGETS[:4]]
    assert "It gives {:.3f}, {:.3f}, {:.3f} and {:.3f} /s".format(*values) in text
    assert best.score < LIKELY
    tiny = next(one for one in found.ranked if one.setting.radius < 1.0)
    for name in ("speed_0.8", "pressure"):
        assert not tiny.our_value(source_value(name)).agrees(source_value(name))


def test_errors_and_costs_are_the_saved_measurements() -> None:
    text = " ".join(README.split())
    found = accuracy_values()
    for method in ("ours", "source", "coarse", "fine"):
        assert f"{found[method]['error']} m" in text
        assert found[method]["rate"] in text
    for name in ("wrong_event", "overlap", "digits", "date", "machine"):
        assert str(found[name]) in text, name


def test_the_notice_and_the_readme_name_the_same_time() -> None:
    (told,) = re.findall(r"The\s+first\s+kind\s+takes\s+(\d+\s+to\s+\d+\s+s)", README)
    assert " ".join(told.split()) in NOTICE


def test_the_citation_is_of_this_version() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == __version__
    assert {"cff-version", "message", "title", "authors", "license"} <= set(cited)


def update() -> None:
    """Put into the README what the commands print now: ``python tests/test_readme.py``."""
    import tempfile

    text = README
    with tempfile.TemporaryDirectory() as made:
        shutil.copytree(ROOT / "configs", Path(made) / "configs")
        for block in BLOCKS:
            if block.startswith("$ snooker"):
                command = block.removeprefix("$ ").partition("\n")[0]
                # Whether this machine had to compile is not the reader's concern.
                printed = re.sub(r" after \d+ s of compiling", "", shell(command, Path(made)))
                text = text.replace(block, f"$ {command}\n{printed}")
    (ROOT / "README.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    update()
