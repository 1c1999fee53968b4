"""Showing how a run goes, on stderr, and stopping it on Ctrl-C or SIGTERM."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

from snooker_cli.runner import Outcome, Watcher

COMPILING = "compiling the engine for this kind of scene, once on this machine (up to 15 s)"


def say(message: str) -> None:
    """A line of talk, on stderr."""
    print(f"snooker: {message}", file=sys.stderr, flush=True)


@contextmanager
def stopping_on_signals(cancelled: threading.Event) -> Iterator[None]:
    """While inside, Ctrl-C and SIGTERM set ``cancelled``; what is under way is then saved."""

    def stop(_number: int, _frame: object) -> None:
        if not cancelled.is_set():
            say("stopping; saving what is under way")
        cancelled.set()

    previous = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


class Lines(Watcher):
    """Plain lines: only what is out of the ordinary."""

    def __init__(self, points: int, repeats: int) -> None:
        self.points, self.repeats = points, repeats

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        """Nothing is left open."""

    def compiling(self) -> None:
        say(COMPILING)

    def finished(self, outcome: Outcome) -> None:
        if outcome.error:
            say(f"point {outcome.point}, repeat {outcome.repeat} failed: {outcome.error}")


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
        self._done = [0] * self.points
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

    def events(self, number: int) -> None:
        with self._lock:
            self._events += number
            elapsed = self._progress.tasks[0].elapsed or 0.0
            if elapsed > 0.2:
                rate = f"{self._events / elapsed:,.0f} events/s"
                self._progress.update(self._task, rate=rate)

    def finished(self, outcome: Outcome) -> None:
        super().finished(outcome)
        self._done[outcome.point] += 1
        whole = sum(done == self.repeats for done in self._done)
        self._progress.update(self._task, advance=1, points=f"{whole}/{self.points}")
