"""What commands print: lines, tables and JSON on stdout, notices and progress on stderr."""

import json
import logging
import os
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Self

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from snooker_cli.cli.exit_codes import bug_message, wants_traceback
from snooker_cli.formatting import printable, text_table
from snooker_cli.runs import RepeatStatus
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.runs.execution import Watcher

MOST_ROWS = 200
"""Points in a table that is printed; a terminal keeps about as many lines."""

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
        typer.echo(printable(line, "\n"))


def print_json(data: Any) -> None:
    """Print data as one line of JSON."""
    print_line(json.dumps(data, allow_nan=False))


def print_result(content: Any, as_json: bool, lines: Iterable[str]) -> None:
    """Print a command's result: the content as JSON, or lines of text."""
    if as_json:
        print_json(content)
    else:
        for line in lines:
            print_line(line)


def table(headings: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows under headings: ``name | >number``, where > aligns a column on the right."""
    return text_table(headings.split(" | "), rows)


def first(lines: Sequence[str], most: int, rest: str) -> list[str]:
    """The first lines, and how many more there are: ``... and 7 more <rest>``."""
    more = len(lines) - most
    return [*lines[:most], *([f"... and {more:,} more{rest}"] if more > 0 else [])]


def point_table(headings: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """A table with a row for each of the first points."""
    heading, *lines = table(headings, rows)
    return [heading, *first(lines, MOST_ROWS, " points; --json prints all")]


def notice(message: str) -> None:
    """Print a notice on stderr."""
    print(printable(f"snooker: {message}", "\n"), file=sys.stderr, flush=True)


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


class RunProgress(Watcher):
    """Problems of a run as lines, and on a terminal a bar with events per second and time left."""

    def __init__(self, points: int, repeats: int, bar: bool) -> None:
        self.compiling = 0.0
        self._began: float | None = None
        self._failures = self._unusable = self._events = self._done = self._complete = 0
        self._points, self._left = points, [repeats] * points
        self._lock = threading.Lock()
        self._bar = Progress(
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("repeats, {task.fields[points]} points {task.fields[rate]}"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            disable=not (bar and sys.stderr.isatty()),
            transient=True,
        )
        self._task = self._bar.add_task("", total=points * repeats, points=f"0/{points}", rate="")

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._bar.stop()

    @property
    def seconds(self) -> float:
        """Time since the simulation began, s; 0 if it never has."""
        return 0.0 if self._began is None else time.perf_counter() - self._began

    @property
    def simulated(self) -> int:
        """Collisions that were simulated, without those before a checkpoint."""
        return self._events

    def unusable(self, status: RepeatStatus) -> None:
        self._unusable += 1
        if self._unusable <= MOST_FAILURES:
            notice(f"{status.path}: {status.reason}; simulating it again")
        if self._unusable == MOST_FAILURES:
            notice("more files like these are simulated again, without a message")

    def simulating(self, compiling: float) -> None:
        self.compiling, self._began = compiling, time.perf_counter()
        # The estimate of the time left must not count stored repeats or compiling.
        self._bar.reset(self._task, completed=self._done)

    def events(self, number: int) -> None:
        with self._lock:
            self._events += number
            if self.seconds > 0.2:
                rate = f"{self._events / self.seconds:,.0f} events/s"
                self._bar.update(self._task, rate=rate)

    def finished(self, result: RepeatResult) -> None:
        self._done += 1
        self._left[result.point] -= 1
        self._complete += self._left[result.point] == 0
        self._bar.update(self._task, advance=1, points=f"{self._complete}/{self._points}")
        if result.error:
            self._failures += 1
            if self._failures <= MOST_FAILURES:
                self._print_failure(result)
            if self._failures == MOST_FAILURES:
                notice("more failures are counted, without a message")

    def _print_failure(self, result: RepeatResult) -> None:
        if result.traceback and wants_traceback():
            print(result.traceback, file=sys.stderr)
        error = bug_message(result.error or "") if result.traceback else result.error
        notice(f"point {result.point}, repeat {result.repeat} failed: {error}")
