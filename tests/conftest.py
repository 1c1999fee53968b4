"""What several test files start from: a small finished run, and the command line in-process."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from snooker_cli import results
from snooker_cli.cli import main
from snooker_cli.config import parse
from snooker_cli.results import Run
from snooker_cli.runner import Watcher, execute

SMALL = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 1, radius: 1.0, speed: 10.0}
cor: 0.85
collisions: 150
repeats: 3
sweep: {cor: [0.85, 1.0]}
"""


@dataclass(frozen=True)
class Ended:
    """How a command ended and what it said."""

    code: int
    out: str
    err: str


@pytest.fixture(scope="session")
def small_config() -> str:
    """A config of two points with three repeats of seven balls; some end in a wall trap."""
    return SMALL


@pytest.fixture(scope="session")
def finished_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """That config, run. Copy it before changing it."""
    directory = tmp_path_factory.mktemp("finished") / "small"
    run = results.create(directory, parse(SMALL).experiment)
    outcomes = execute(run, workers=1, watcher=Watcher(), cancelled=threading.Event())
    assert [outcome.error for outcome in outcomes] == [None] * 6
    return run


@pytest.fixture
def snooker(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., Ended]:
    """The console script's entry, called with arguments."""

    def call(*arguments: str | Path) -> Ended:
        monkeypatch.setattr(sys, "argv", ["snooker", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            main()
        said = capsys.readouterr()
        code = end.value.code
        assert isinstance(code, int)
        return Ended(code, said.out, said.err)

    return call
