"""Showing how a run goes, on stderr, and stopping it on Ctrl-C or SIGTERM."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from pathlib import Path
from typing import Self, TypeVar

from snooker_cli.cli.exit_codes import STOPPING, answered, fault, leave, wants_traceback
from snooker_cli.errors import ExitCode
from snooker_cli.formatting import listed
from snooker_cli.runs import RepeatStatus
from snooker_cli.runs.execution import POLL_INTERVAL, Watcher
from snooker_cli.runs.repeat import RepeatResult

Result = TypeVar("Result")

MOST_LINES = 10
"""Failures that are told as they come; a full disk fails every repeat."""


def say(message: str) -> None:
    """A line of talk, on stderr."""
    print(f"snooker: {message}", file=sys.stderr, flush=True)


class _Notices(logging.Handler):
    """Prints log records on stderr."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        say(record.getMessage())


@contextmanager
def showing_notices() -> Iterator[None]:
    """While inside, notices of the package are printed on stderr."""
    logger, handler = logging.getLogger("snooker_cli"), _Notices()
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)


@contextmanager
def stopping_on_signals(cancelled: threading.Event) -> Iterator[None]:
    """While inside, Ctrl-C and SIGTERM set ``cancelled``; what is simulated is then saved."""

    def stop(_number: int, _frame: object) -> None:
        if not cancelled.is_set():
            say("stopping; saving what is under way")
        cancelled.set()

    with answered(stop, STOPPING):
        yield


def awaited(function: Callable[[], Result], cancelled: threading.Event) -> Result:
    """What a function gives that has nothing to save: once cancelled, the process ends."""
    future = ThreadPoolExecutor(1).submit(function)
    while not wait([future], POLL_INTERVAL).done:
        if cancelled.is_set():
            leave(ExitCode.INTERRUPTED)
    return future.result()


class Lines(Watcher):
    """Plain lines: only what is out of the ordinary."""

    def __init__(self, points: int, repeats: int) -> None:
        self.points, self.repeats = points, repeats
        self.compiling = 0.0
        self._began: float | None = None
        self._failures = self._unusable = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        """Nothing is left open."""

    @property
    def seconds(self) -> float:
        """Since simulating began; none if it never has."""
        return 0.0 if self._began is None else time.perf_counter() - self._began

    def unusable(self, status: RepeatStatus) -> None:
        self._unusable += 1
        if self._unusable <= MOST_LINES:
            say(f"{status.path}: {status.reason}; simulating it again")
        if self._unusable == MOST_LINES:
            say("further files that do not count are simulated again, but not told")

    def outdated(self, removed: list[Path], figures: bool) -> None:
        if removed:
            names, them = listed([path.name for path in removed]), "them" if removed[1:] else "it"
            say(f"removed {names}, made without all of the repeats; make {them} again later")
        if figures:
            say("figures were drawn without all of the repeats; draw them again later")

    def simulating(self, compiling: float) -> None:
        self.compiling, self._began = compiling, time.perf_counter()

    def finished(self, result: RepeatResult) -> None:
        if not result.error:
            return
        self._failures += 1
        if self._failures > MOST_LINES:
            return
        if result.traceback and wants_traceback():
            print(result.traceback, file=sys.stderr)
        error = fault(result.error) if result.traceback else result.error
        say(f"point {result.point}, repeat {result.repeat} failed: {error}")
        if self._failures == MOST_LINES:
            say("further failures are counted, but not told")


class Bar(Lines):
    """A progress bar with events per second and time left; lines if stderr is no terminal."""

    def __enter__(self) -> Self:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        self._lock = threading.Lock()
        self._events = 0
        self._done = 0
        self._left = [self.repeats] * self.points
        self._whole = 0
        self._progress = Progress(
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("repeats, {task.fields[points]} points {task.fields[rate]}"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            disable=not sys.stderr.isatty(),
            transient=True,
        )
        self._progress.start()
        self._task = self._progress.add_task(
            "", total=self.points * self.repeats, points=f"0/{self.points}", rate=""
        )
        return self

    def __exit__(self, *_error: object) -> None:
        self._progress.stop()

    def simulating(self, compiling: float) -> None:
        super().simulating(compiling)
        # The time left is that of simulating: what was found or compiled tells nothing of it.
        self._progress.reset(self._task, completed=self._done)

    def events(self, number: int) -> None:
        with self._lock:
            self._events += number
            if self.seconds > 0.2:
                rate = f"{self._events / self.seconds:,.0f} events/s"
                self._progress.update(self._task, rate=rate)

    def finished(self, result: RepeatResult) -> None:
        super().finished(result)
        self._done += 1
        self._left[result.point] -= 1
        self._whole += self._left[result.point] == 0
        points = f"{self._whole}/{self.points}"
        self._progress.update(self._task, advance=1, points=points)
