"""What commands print: lines, tables and JSON on stdout, notices and progress on stderr."""

from __future__ import annotations

import json
import logging
import os
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Self

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)

from snooker_cli.cli.exit_codes import bug_message, wants_traceback
from snooker_cli.formatting import Column, table_lines
from snooker_cli.runs import RepeatStatus
from snooker_cli.runs.execution import Watcher
from snooker_cli.runs.repeat import RepeatResult

MOST_FAILURES = 10
"""Failures that are printed as they come; a full disk fails every repeat."""


@contextmanager
def until_the_reader_leaves() -> Iterator[None]:
    """Inside, a reader that goes away, as `| head` does, causes no error."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_line(line: str) -> None:
    """Print a line on stdout."""
    with until_the_reader_leaves():
        typer.echo(line)


def print_json(data: Any) -> None:
    """Print data as one line of JSON."""
    print_line(json.dumps(data, allow_nan=False))


def print_table(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> None:
    """Print rows under headings."""
    for line in table_lines(columns, rows):
        print_line(line)


def print_some(lines: Sequence[str], most: int, rest: str) -> None:
    """Print the first lines, and how many more there are: ``... and 7 more <rest>``."""
    for line in lines[:most]:
        print_line(line)
    if len(lines) > most:
        print_line(f"... and {len(lines) - most:,} more{rest}")


def point_label(parameters: Mapping[str, object]) -> str:
    """A point's swept keys and values, as in ``cor=0.8, balls.radius=1.0``."""
    values = {key: "null" if value is None else value for key, value in parameters.items()}
    return ", ".join(f"{key}={value}" for key, value in values.items()) or "all"


def notice(message: str) -> None:
    """Print a notice on stderr."""
    print(f"snooker: {message}", file=sys.stderr, flush=True)


class _Notices(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        notice(record.getMessage())


@contextmanager
def showing_notices() -> Iterator[None]:
    """Inside, the package's log records are printed on stderr."""
    logger, handler = logging.getLogger("snooker_cli"), _Notices()
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)


class Lines(Watcher):
    """Progress of a run as plain lines: only problems."""

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
        """Time since the simulation began, s; 0 if it never has."""
        return 0.0 if self._began is None else time.perf_counter() - self._began

    def unusable(self, status: RepeatStatus) -> None:
        self._unusable += 1
        if self._unusable <= MOST_FAILURES:
            notice(f"{status.path}: {status.reason}; simulating it again")
        if self._unusable == MOST_FAILURES:
            notice("more files like these are simulated again, without a message")

    def simulating(self, compiling: float) -> None:
        self.compiling, self._began = compiling, time.perf_counter()

    def finished(self, result: RepeatResult) -> None:
        if not result.error:
            return
        self._failures += 1
        if self._failures > MOST_FAILURES:
            return
        if result.traceback and wants_traceback():
            print(result.traceback, file=sys.stderr)
        error = bug_message(result.error) if result.traceback else result.error
        notice(f"point {result.point}, repeat {result.repeat} failed: {error}")
        if self._failures == MOST_FAILURES:
            notice("more failures are counted, without a message")


class Bar(Lines):
    """A progress bar with events per second and time left, if stderr is a terminal."""

    def __enter__(self) -> Self:
        self._lock = threading.Lock()
        self._events = 0
        self._done = 0
        self._left = [self.repeats] * self.points
        self._complete = 0
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
        # The estimate of the time left must not count stored repeats or compiling.
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
        self._complete += self._left[result.point] == 0
        points = f"{self._complete}/{self.points}"
        self._progress.update(self._task, advance=1, points=points)
