"""Runs for tests: made, done, and what is in their files."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from snooker_cli import runs, store
from snooker_cli.config import Config, parse, points
from snooker_cli.runs import RunFolder, execution
from snooker_cli.runs.batch import Batch, Progress, RepeatResult
from snooker_cli.runs.execution import Watcher, execute
from snooker_cli.store import Fingerprint
from snooker_cli.trace import Trace


class StopsAfter(Watcher):
    """Cancels the run that it watches after this many collisions."""

    def __init__(self, collisions: int) -> None:
        self.most = collisions
        self.reached_by: dict[Batch, int] = {}
        self.cancelled = threading.Event()

    def reached(self, progress: Progress) -> None:
        self.reached_by[progress.batch] = progress.collisions
        if sum(self.reached_by.values()) >= self.most:
            self.cancelled.set()


class StopsAtOnce(Watcher):
    """Cancels the run that it watches at the first news of a batch, and keeps all news."""

    def __init__(self) -> None:
        self.news: list[Progress] = []
        self.cancelled = threading.Event()

    def reached(self, progress: Progress) -> None:
        self.news.append(progress)
        self.cancelled.set()


@contextmanager
def batches_of(repeats: int) -> Iterator[None]:
    """Inside, this process cuts the repeats of every point into batches of this size."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(execution, "batch_size", lambda *_: repeats)
        yield


def done(
    run: RunFolder, *, workers: int = 1, watcher: Watcher | None = None, **how: Any
) -> list[RepeatResult]:
    """The outcomes of doing what is missing of a run."""
    cancelled = watcher.cancelled if isinstance(watcher, StopsAfter) else threading.Event()
    return execute(run, workers=workers, watcher=watcher or Watcher(), cancelled=cancelled, **how)


def stopped(run: RunFolder, collisions: int, **how: Any) -> list[RepeatResult]:
    """The outcomes of a run that is interrupted after this many collisions."""
    return done(run, watcher=StopsAfter(collisions), **how)


def run_of(directory: Path, text: str, *overrides: str) -> RunFolder:
    """The run of a config in a folder, which is left as it is."""
    config = parse(text, overrides=overrides).config
    return RunFolder(directory, config, points(config))


def created(directory: Path, config: Config) -> RunFolder:
    """A run's folder for an experiment."""
    run = RunFolder(directory, config, points(config))
    runs.create(run)
    return run


def made(directory: Path, text: str, *overrides: str) -> RunFolder:
    """A run's folder for a config."""
    return created(directory, parse(text, overrides=overrides).config)


def content_hash(trace: Trace) -> str:
    """SHA-256 of every array of a trace and of how it ended."""
    fingerprint = Fingerprint()
    if trace.events is not None:
        fingerprint.add(trace.events)
    return fingerprint.content(trace)


def contents(run: RunFolder) -> dict[tuple[int, int], str]:
    """The content hash of every repeat, each read and checked. Raises ``StoreError``."""
    return {
        (status.point, status.repeat): content_hash(trace)
        for point in run.points
        for status in run.statuses(point.index)
        for trace, _ in store.read(status.path, [status.repeat])
    }


def file_of(run: RunFolder, point: int, repeat: int) -> Path:
    """The file that has a repeat, or would have it alone."""
    return run.status_of(point, repeat).path


def bytes_of(directory: Path) -> dict[str, bytes]:
    """The files of all batches. A batch made again differs, by its provenance's seconds."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.glob("point-*/repeats-*")
    }
