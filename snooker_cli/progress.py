"""What a run prints on stderr while it is executed: notices and a progress bar."""

import logging
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any, Self

import rich.progress
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from snooker_cli.exit_codes import STOPPING, bug_message, handling, wants_traceback
from snooker_cli.formatting import counted, printable
from snooker_cli.runs import RepeatStatus, Run, create, locked, locked_for_part
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.runs.execution import Watcher, execute
from snooker_cli.trace import StopReason, Trace

MOST_FAILURES = 10  # failures that are printed as they come; a full disk fails every repeat


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
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)


class RunProgress(Watcher):
    """Problems of a run as lines, and on a terminal a bar with events per second and time left.

    collisions : where a repeat ends; the bar of a single repeat counts them
    """

    def __init__(self, points: int, repeats: int, bar: bool, collisions: int | None) -> None:
        self._alone = points * repeats == 1 and collisions is not None
        self.compiling = 0.0
        self._began: float | None = None
        self._failures = self._unusable = self._events = self._done = self._complete = 0
        self._points, self._left = points, [repeats] * points
        self._lock = threading.Lock()
        console = Console(stderr=True)
        # Without ipywidgets, rich cannot move a bar in a notebook.
        shown = find_spec("ipywidgets") is not None if console.is_jupyter else sys.stderr.isatty()
        self._bar = Progress(
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[unit]} {task.fields[rate]}"),
            TimeRemainingColumn(),
            console=console,
            disable=not (bar and shown),
            transient=True,
        )
        unit = "collisions" if self._alone else f"repeats, 0/{points} points"
        total = collisions if self._alone else points * repeats
        self._task = self._bar.add_task("", total=total, unit=unit, rate="")

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
            if self._alone:
                self._bar.update(self._task, advance=number)
            if self.seconds > 0.2:
                rate = f"{self._events / self.seconds:,.0f} events/s"
                self._bar.update(self._task, rate=rate)

    def finished(self, result: RepeatResult) -> None:
        self._done += 1
        self._left[result.point] -= 1
        self._complete += self._left[result.point] == 0
        if not self._alone:
            unit = f"repeats, {self._complete}/{self._points} points"
            self._bar.update(self._task, advance=1, unit=unit)
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


def counting(traces: Iterable[Trace], label: str, total: int) -> Iterator[Trace]:
    """The repeats in order; a terminal shows how many have been read."""
    console, hidden = Console(stderr=True), not sys.stderr.isatty()
    yield from rich.progress.track(
        traces, label, total, console=console, transient=True, disable=hidden
    )


@contextmanager
def stopping_on_signals(cancelled: threading.Event) -> Iterator[None]:
    """Inside, Ctrl-C and SIGTERM set ``cancelled``; the simulated part is then saved.

    In another thread than the main one, which gets all signals, nothing changes.
    """

    def stop(_number: int, _frame: object) -> None:
        if not cancelled.is_set():
            notice("stopping; saving the current repeats")
        cancelled.set()

    main = threading.current_thread() is threading.main_thread()
    with handling(stop, STOPPING if main else ()):
        yield


def complete(outcomes: Sequence[RepeatResult], wanted: int) -> str:
    """How many of the repeats are complete: ``3 of 6 repeats complete``."""
    stops = [each.stop for each in outcomes if each.stop is not None]
    number = sum(stop.reason is not StopReason.INTERRUPTED for stop in stops)
    return f"{number:,} of {counted(wanted, 'repeat')} complete"


def execute_watched(
    run: Run,
    *,
    fresh: bool,
    bar: bool,
    cancelled: threading.Event,
    part: tuple[int, int] | None = None,
    **how: Any,
) -> tuple[list[RepeatResult], RunProgress]:
    """Lock and make a run's folder and execute what is missing. Returns all results and counts.

    fresh : delete what the folder holds
    part : of ``execute``; parts share the lock
    bar : whether a terminal or a notebook shows a progress bar
    how : further arguments of ``execute``

    Raises ``RunError`` as ``create`` and ``execute`` do.
    """
    with locked_for_part(run) if part else locked(run.directory):
        if change := "" if part else create(run, fresh=fresh):
            notice(change)
        collisions = run.points[0].experiment.collisions
        with RunProgress(len(run.points), run.experiment.repeats, bar, collisions) as watcher:
            how |= {"watcher": watcher, "cancelled": cancelled, "part": part}
            return execute(run, **how), watcher
