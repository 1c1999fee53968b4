"""Execute a run with its folder locked, notices and a progress bar on stderr, and Ctrl-C."""

import logging
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any, TypeVar

import rich.progress
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from snooker_cli.engine.jit import check_current_folder
from snooker_cli.errors import bug_message, notice
from snooker_cli.formatting import counted
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.runs.execution import Watcher, execute
from snooker_cli.runs.folder import create, locked, locked_for_part
from snooker_cli.runs.plan import batch_size
from snooker_cli.runs.run import Run
from snooker_cli.signals import STOPPING, handling
from snooker_cli.trace import StopReason

Item = TypeVar("Item")

MOST_FAILURES = 10  # failures that are printed as they come; a full disk fails every repeat


class _Notices(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        notice(record.getMessage())


@contextmanager
def showing_notices() -> Iterator[None]:
    """Inside, the package's log records are printed on stderr."""
    logger, handler = logging.getLogger("snooker_cli"), _Notices()
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


class RunProgress(Watcher):
    """Problems of a run as lines, and on a terminal a bar with events per second and time left.

    repeats : of all points
    collisions : where a repeat ends; the bar of a single repeat counts them
    compiling : time that it took, s
    simulated : collisions, without those before a checkpoint
    """

    def __init__(self, repeats: int, bar: bool, collisions: int | None) -> None:
        self._alone = repeats == 1 and collisions is not None
        self.compiling = 0.0
        self.simulated = 0
        self._began: float | None = None
        self._failures = self._unusable = 0
        self._lock = threading.Lock()
        console = Console(stderr=True)
        # Without ipywidgets, rich cannot move a bar in a notebook.
        shown = find_spec("ipywidgets") is not None if console.is_jupyter else sys.stderr.isatty()
        self.bar = Progress(
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn(("collisions" if self._alone else "repeats") + " {task.fields[rate]}"),
            TimeRemainingColumn(),
            console=console,
            disable=not (bar and shown),
            transient=True,
        )
        total = collisions if self._alone else repeats
        self._task = self.bar.add_task("", total=total, rate="")

    @property
    def seconds(self) -> float:
        """Time since the simulation began, s; 0 if it never has."""
        return 0.0 if self._began is None else time.perf_counter() - self._began

    def unusable(self, problem: str) -> None:
        self._unusable += 1
        if self._unusable <= MOST_FAILURES:
            notice(f"{problem}; simulating it again")
        if self._unusable == MOST_FAILURES:
            notice("more files like these are simulated again, without a message")

    def simulating(self, compiling: float) -> None:
        self.compiling, self._began = compiling, time.perf_counter()
        # The estimate of the time left must not count stored repeats or compiling.
        self.bar.reset(self._task, completed=int(self.bar.tasks[0].completed))

    def events(self, number: int) -> None:
        with self._lock:
            self.simulated += number
            if self._alone:
                self.bar.update(self._task, advance=number)
            if self.seconds > 0.2:
                rate = f"{self.simulated / self.seconds:,.0f} events/s"
                self.bar.update(self._task, rate=rate)

    def finished(self, result: RepeatResult) -> None:
        if not self._alone:
            self.bar.update(self._task, advance=1)
        self._failures += result.error is not None
        if result.error is None or self._failures > MOST_FAILURES:
            return
        trace = result.traceback
        less = "use fewer balls, or a smaller --jobs"
        error = bug_message(result.error, trace, less) if trace else result.error
        notice(f"point {result.point}, repeat {result.repeat} failed: {error}")
        if self._failures == MOST_FAILURES:
            notice("more failures are counted, without a message")


def counting(repeats: Iterable[Item], label: str, total: int) -> Iterator[Item]:
    """The repeats in order; a terminal shows how many have been read."""
    console, hidden = Console(stderr=True), not sys.stderr.isatty()
    yield from rich.progress.track(
        repeats, label, total, console=console, transient=True, disable=hidden
    )


@contextmanager
def reporting() -> Iterator[Callable[[str], None]]:
    """Inside, a terminal shows the last text that the given function got."""
    if not sys.stderr.isatty():
        yield lambda _text: None
        return
    with Console(stderr=True).status("") as status:
        yield lambda text: status.update(Text(text))


def share_done(outcomes: Sequence[RepeatResult], wanted: int) -> str:
    """How many of the repeats are done: ``3 of 6 repeats done``."""
    stops = [result.stop for result in outcomes if result.stop is not None]
    number = sum(stop.reason is not StopReason.INTERRUPTED for stop in stops)
    return f"{number:,} of {counted(wanted, 'repeat')} done"


def run_summary(run: Run, results: Sequence[RepeatResult], progress: RunProgress) -> dict[str, Any]:
    """What ``run --json`` prints: of each point the repeats, how they ended, and the time."""
    by_point: dict[int, list[RepeatResult]] = {point.index: [] for point in run.points}
    for result in results:
        by_point[result.point].append(result)
    points = [
        {
            "parameters": point.as_json(),
            "repeats": len(repeats),
            "cached": sum(repeat.cached for repeat in repeats),
            "collisions": sum(repeat.collisions for repeat in repeats),
            "ended": Counter(
                str(repeat.stop.reason) if repeat.stop else "failed" for repeat in repeats
            ),
            "stops": [
                {"repeat": repeat.repeat, **repeat.stop.known()}
                for repeat in repeats
                if repeat.stop and not repeat.stop.reason.complete
            ],
            "errors": [repeat.error for repeat in repeats if repeat.error],
        }
        for point, repeats in zip(run.points, by_point.values(), strict=True)
    ]
    seconds = progress.seconds
    return {
        "run": str(run.directory),
        "events": progress.simulated,
        "seconds": round(seconds, 3),
        "compiling_seconds": round(progress.compiling, 3),
        "events_per_second": round(progress.simulated / seconds) if seconds > 0 else 0,
        "simultaneous": sum(result.simultaneous for result in results),
        "points": points,
    }


def execute_watched(
    run: Run,
    *,
    fresh: bool,
    bar: bool,
    cancelled: threading.Event,
    part: Set[tuple[int, int]] | None = None,
    **how: Any,
) -> tuple[list[RepeatResult], RunProgress]:
    """Lock and make a run's folder and execute what is missing. Returns all results and counts.

    fresh : delete what the folder holds
    part : of ``execute``; parts share the lock
    cancelled : set by Ctrl-C and SIGTERM; finished batches and long repeats are then saved
    bar : whether a terminal or a notebook shows a progress bar
    how : further arguments of ``execute``

    Raises ``RunError`` as ``create`` and ``execute`` do, and ``UserError`` where Numba is not safe.
    """
    check_current_folder()  # before a folder is deleted or made
    saving = "saving the current repeats"
    if run.experiment.repeats > 1 and batch_size(run.points[0].experiment) > 1:
        saving = "unfinished batches of short repeats are not saved"

    def stop(_number: int, _frame: object) -> None:
        if not cancelled.is_set():
            notice(f"stopping; {saving}")
        cancelled.set()

    main = threading.current_thread() is threading.main_thread()  # which gets all signals
    lock = locked(run.directory) if part is None else locked_for_part(run)
    with handling(stop, STOPPING if main else ()), lock:
        if change := create(run, fresh=fresh) if part is None else "":
            notice(change)
        collisions = run.points[0].experiment.collisions
        repeats = len(run.points) * run.experiment.repeats
        watcher = RunProgress(repeats, bar, collisions)
        with watcher.bar:
            how |= {"watcher": watcher, "cancelled": cancelled, "part": part}
            return execute(run, **how), watcher
