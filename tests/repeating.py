"""Runs for tests: made, done, and what is in their files."""

from __future__ import annotations

import threading
from pathlib import Path

from snooker_cli import runs, store
from snooker_cli.config import Experiment, parse, points
from snooker_cli.runs import Run
from snooker_cli.runs.execution import Watcher, execute
from snooker_cli.runs.repeat import RepeatResult


class StopsAfter(Watcher):
    """Cancels the run after this many collisions."""

    def __init__(self, collisions: int, cancelled: threading.Event) -> None:
        self.left = collisions
        self.cancelled = cancelled

    def events(self, number: int) -> None:
        self.left -= number
        if self.left <= 0:
            self.cancelled.set()


def done(run: Run, *, workers: int = 1, watcher: Watcher | None = None) -> list[RepeatResult]:
    """The outcomes of doing what is missing of a run."""
    return execute(run, workers=workers, watcher=watcher or Watcher(), cancelled=threading.Event())


def run_of(directory: Path, text: str, *overrides: str, engine: str | None = None) -> Run:
    """The run of a config in a folder, which is left as it is."""
    experiment = parse(text, overrides=overrides).experiment
    return Run(directory, experiment, points(experiment), engine)


def created(directory: Path, experiment: Experiment, engine: str | None = None) -> Run:
    """A run's folder for an experiment."""
    run = Run(directory, experiment, points(experiment), engine)
    runs.create(run)
    return run


def made(directory: Path, text: str, *overrides: str) -> Run:
    """A run's folder for a config."""
    return created(directory, parse(text, overrides=overrides).experiment)


def contents(run: Run) -> dict[tuple[int, int], str]:
    """The content hash of every repeat; each file is read and checked for it."""
    return {
        (point.index, repeat): store.content_hash(store.read(run.path(point.index, repeat))[0])
        for point in run.points
        for repeat in range(run.experiment.repeats)
    }


def bytes_of(directory: Path) -> dict[str, bytes]:
    """The files of all repeats. A repeat made again differs, by its provenance's seconds."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.glob("point-*/repeat-*")
    }
