"""Execute a run with its folder locked, its progress shown on stderr, and Ctrl-C."""

import threading
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from typing import Any

from snooker_cli.config import Point
from snooker_cli.engine.jit import check_current_folder
from snooker_cli.errors import bug_message, notice
from snooker_cli.formatting import counted, duration
from snooker_cli.options import JOBS
from snooker_cli.runs.batch import Progress, RepeatResult
from snooker_cli.runs.execution import Watcher, execute
from snooker_cli.runs.folder import create, locked, locked_for_part
from snooker_cli.runs.plan import batch_size
from snooker_cli.runs.progress import SOON, Bar
from snooker_cli.runs.run import RunFolder
from snooker_cli.signals import STOPPING, handling
from snooker_cli.trace import StopReason

MOST_FAILURES = 10  # failures that are printed as they come; a full disk fails every repeat
FIRST_LINE, MOST_BETWEEN_LINES = 60.0, 3600.0  # of progress in a log, s


class RunProgress(Watcher):
    """How far a run is, and its problems as lines.

    A terminal shows a bar; a log gets a line after 1, 2, 4 … minutes, then every hour. Both count
    within repeats: collisions, or the simulated time, whichever ends the repeats of all points. If
    both do, repeats are counted. The time left is that at the mean speed since the start.

    wanted : the number of repeats of each point, by the point's number
    shown : whether to show this at all

    compiling : time that it took, s
    """

    def __init__(self, points: Sequence[Point], wanted: Mapping[int, int], shown: bool) -> None:
        self._unit, self._limits = _measure(points)
        self._repeats = sum(wanted.values())
        self._total = float(sum(self._limits[index] * number for index, number in wanted.items()))
        self._done = self._given = 0.0  # of repeats that have ended; and before this run
        self._ended: set[tuple[int, int]] = set()
        self._finished = self._simulated = self._failures = self._unusable = 0
        self._running: dict[tuple[int, int], Progress] = {}  # by the first repeat of the batch
        self.compiling = 0.0
        self._began: float | None = None
        self._drawn, self._due = 0.0, FIRST_LINE
        self._lock = threading.Lock()
        self.bar = Bar(shown)
        self._logs = shown and not self.bar.moves
        self._task = self.bar.add_task("", total=self._total)

    @property
    def seconds(self) -> float:
        """Time since the simulation began, s; 0 if it never has."""
        return 0.0 if self._began is None else time.perf_counter() - self._began

    @property
    def simulated(self) -> int:
        """Collisions that are simulated, without those before a checkpoint."""
        return self._simulated + sum(running.collisions for running in self._running.values())

    def unusable(self, problem: str) -> None:
        self._unusable += 1
        if self._unusable <= MOST_FAILURES:
            notice(f"{problem}; simulating it again")
        if self._unusable == MOST_FAILURES:
            notice("more files like these are simulated again, without a message")

    def simulating(self, compiling: float) -> None:
        self.compiling, self._began = compiling, time.perf_counter()

    def reached(self, progress: Progress) -> None:
        with self._lock:
            key = progress.batch.point, progress.batch.repeats[0]
            if key not in self._ended:
                self._running[key] = progress
        self._show()

    def finished(self, result: RepeatResult) -> None:
        with self._lock:
            self._end(result)
        self._show(at_once=result.cached)
        self._failures += result.error is not None
        if result.error is None or self._failures > MOST_FAILURES:
            return
        trace = result.traceback
        less = f"use fewer balls, or a smaller {JOBS}"
        error = bug_message(result.error, trace, less) if trace else result.error
        notice(f"point {result.point}, repeat {result.repeat} failed: {error}")
        if self._failures == MOST_FAILURES:
            notice("more failures are counted, without a message")

    def _end(self, result: RepeatResult) -> None:
        """Count a repeat that has ended, as long as it is."""
        key = result.point, result.repeat
        self._ended.add(key)
        limit = self._limits[result.point]
        if running := self._running.pop(key, None):
            self._given += running.given * limit * len(running.batch.repeats)
            if result.error:  # it was simulated, but not stored
                self._simulated += running.collisions
        reached = 0.0
        if stop := result.stop:
            reached = {"collisions": result.collisions, "s": stop.time}.get(self._unit, limit)
        self._done += reached
        if stop is None or stop.reason is not StopReason.INTERRUPTED:
            self._total += reached - limit
            self._finished += stop is not None
        if result.cached:
            self._given += reached
        else:
            self._simulated += result.collisions - result.continued

    def now(self, seconds: float) -> tuple[float, float, str]:
        """What is done and what is wanted in all, and both as a text with speed and time left.

        seconds : since the simulation began
        """
        with self._lock:
            done, given, simulated = self._done, self._given, self.simulated
            for running in self._running.values():
                whole = self._limits[running.batch.point] * len(running.batch.repeats)
                done, given = done + running.share * whole, given + running.given * whole
        total, repeats = self._total, f"{self._finished:,}/{self._repeats:,} repeats"
        parts = {
            "collisions": [f"{done:,.0f}/{total:,.0f} collisions", repeats],
            "s": [f"{done:.4g}/{total:.4g} s of simulated time", repeats],
            "repeats": [f"{done:,.1f}/{total:,.0f} repeats"],
        }[self._unit]
        if self._repeats == 1:
            parts = parts[:1]
        if seconds > SOON:
            parts.append(f"{simulated / seconds:,.0f} events/s")
            if given < done < total:
                left = duration(seconds * (total - done) / (done - given))
                parts.append(f"{left} left")
        return done, total, ", ".join(parts)

    def _show(self, *, at_once: bool = False) -> None:
        """Draw the bar anew if it is some time ago; write a line if it is time for one."""
        seconds = self.seconds
        if self._logs and seconds >= self._due:
            self._due = seconds + min(seconds, MOST_BETWEEN_LINES)
            notice(self.now(seconds)[2])
        if not self.bar.disable and (at_once or seconds >= self._drawn + SOON):
            self._drawn = seconds
            done, total, text = self.now(seconds)
            self.bar.update(self._task, completed=done, total=total, description=text)


def _measure(points: Iterable[Point]) -> tuple[str, dict[int, float]]:
    """What the progress of a run counts, and how much of it a repeat of each point has at most."""
    limits = [(point.index, point.config.collisions, point.config.time) for point in points]
    if all(time is None and collisions for _, collisions, time in limits):
        return "collisions", {index: float(collisions or 0) for index, collisions, _ in limits}
    if all(collisions is None and time for _, collisions, time in limits):
        return "s", {index: time or 0.0 for index, _, time in limits}
    return "repeats", {index: 1.0 for index, *_ in limits}


def share_done(outcomes: Sequence[RepeatResult], wanted: int) -> str:
    """How many of the repeats are done: ``3 of 6 repeats done``."""
    stops = [result.stop for result in outcomes if result.stop is not None]
    number = sum(stop.reason is not StopReason.INTERRUPTED for stop in stops)
    return f"{number:,} of {counted(wanted, 'repeat')} done"


def run_summary(
    run: RunFolder, results: Sequence[RepeatResult], progress: RunProgress
) -> dict[str, Any]:
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
    run: RunFolder,
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
    bar : whether a terminal or a notebook shows a progress bar, and a log gets lines of progress
    how : further arguments of ``execute``

    Raises ``RunError`` as ``create`` and ``execute`` do, and ``UserError`` where Numba is not safe.
    """
    check_current_folder()  # before a folder is deleted or made
    saving = "saving the current repeats"
    if run.config.repeats > 1 and batch_size(run.points[0].config) > 1:
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
        wanted = Counter({point.index: run.config.repeats for point in run.points})
        if part is not None:
            wanted = Counter(index for index, _ in part)
        watcher = RunProgress(run.points, wanted, bar)
        with watcher.bar:
            how |= {"watcher": watcher, "cancelled": cancelled, "part": part}
            return execute(run, **how), watcher
