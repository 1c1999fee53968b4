"""Doing what is missing of a run: checked, compiled for, simulated and stored by workers."""

from __future__ import annotations

import shlex
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from snooker_cli.results import Run, State, forget_failures, note_failure
from snooker_cli.runner.compiling import compile_for
from snooker_cli.runner.kinds import alike, arranged
from snooker_cli.runner.ledger import Job, entry, jobs
from snooker_cli.runner.repeat import LeftError, Outcome, do
from snooker_cli.runner.threads import Threads
from snooker_cli.store import Told

if TYPE_CHECKING:
    from snooker_cli.runner.cluster import Cluster


class Watcher:
    """What a run tells of itself; all methods may be called from any thread."""

    def unusable(self, sentence: str) -> None:
        """A file that is there is damaged or of another run; its repeat is done anew."""

    def outdated(self, removed: list[Path], figures: bool) -> None:
        """Analyses of fewer repeats are removed; figures of them are still there or not."""

    def simulating(self, compiling: float) -> None:
        """The engine is ready, after so many seconds; simulating begins."""

    def events(self, number: int) -> None:
        """So many more collisions are simulated."""

    def finished(self, outcome: Outcome) -> None:
        """A repeat has ended."""


def execute(
    run: Run,
    *,
    workers: int,
    watcher: Watcher,
    cancelled: threading.Event,
    cluster: Cluster | None = None,
) -> list[Outcome]:
    """Do what is missing of a run; every outcome, in order of point and repeat.

    workers : threads; the results' bits do not depend on it
    cancelled : once set, what is simulated is saved as interrupted; nothing else is waited for
    cluster : simulates instead of the threads, which then only check what is there; it tells of
        collisions when their repeat has ended

    An error in one repeat does not stop the others. Raises ``KeyboardInterrupt`` never: the
    caller turns signals into ``cancelled``.
    """
    outcomes: list[Outcome] = []
    not_noted: list[tuple[int, int, str]] = []
    there: list[Job] = []
    missing: list[Job] = []
    outdated = False
    command = shlex.join([_program(), *sys.argv[1:]])
    for job in jobs(run):
        exists = run.path(job.point.index, job.repeat).exists()
        (there if exists else missing).append(job)
    unusable: list[tuple[Path, str]] = []
    with Threads(workers, cancelled) as threads:
        for found in threads.each(lambda job, _: entry(run, job), there):
            if found.state is State.DONE and found.told is not None:
                outcomes.append(_cached(found.job, found.told))
                watcher.finished(outcomes[-1])
                continue
            missing.append(found.job)
            if found.state is State.UNUSABLE:
                unusable.append((found.path, found.sentence))
        for _, sentence in sorted(unusable):
            watcher.unusable(sentence)
        forget_failures(run)
        if missing and not cancelled.is_set():
            missing.sort(key=lambda job: (job.point.index, job.repeat))
            outdated = _discard_analyses(run, watcher)
            clock = time.perf_counter()
            to_compile = [missing] if cluster is None else []
            for _ in threads.each(lambda what, _: _warm_up(what, run.engine), to_compile):
                pass
            if not cancelled.is_set():
                watcher.simulating(time.perf_counter() - clock)

        def here(job: Job, keep: Callable[[], bool]) -> Outcome | None:
            return _do_here(run, job, watcher, cancelled, keep, command)

        doing = (
            threads.each(here, missing)
            if cluster is None
            else cluster.repeats(run, missing, command)
        )
        for outcome in doing:
            if outcome is None:
                continue
            if outcome.error:
                failure = outcome.point, outcome.repeat, outcome.error
                if not note_failure(run, *failure):
                    not_noted.append(failure)
            if cluster is not None:
                watcher.events(outcome.collisions)
            outcomes.append(outcome)
            watcher.finished(outcome)
    if any(not outcome.cached for outcome in outcomes):
        _discard_analyses(run, watcher, outdated)  # those made meanwhile
    for failure in not_noted:  # what was under way has left the disk by now
        note_failure(run, *failure)
    return sorted(outcomes, key=lambda outcome: (outcome.point, outcome.repeat))


def _cached(job: Job, told: Told) -> Outcome:
    """The outcome of a repeat that is there."""
    return Outcome(job.point.index, job.repeat, told.stop, told.collisions, cached=True)


def _discard_analyses(run: Run, watcher: Watcher, told: bool = False) -> bool:
    """Remove what has been fitted and compared while repeats are to come.

    Figures stay; whether there are any, of which the user is told once.
    """
    removed = run.analyses()
    for path in removed:
        path.unlink(missing_ok=True)
    figures = bool(run.figures())
    if removed or (figures and not told):
        watcher.outdated(removed, figures and not told)
    return figures


def _warm_up(missing: list[Job], engine: str | None) -> None:
    """Compile, before any repeat starts, what the jobs' scenes need."""
    for same in alike(job.point for job in missing).values():
        compile_for(arranged(same[0].experiment, 0), engine)


def _do_here(
    run: Run,
    job: Job,
    watcher: Watcher,
    cancelled: threading.Event,
    keep: Callable[[], bool],
    command: str,
) -> Outcome | None:
    """Do one repeat in a thread; None if the run was cancelled before it began.

    keep : tells that there is something to save; false if nobody waits for it any more
    """
    if cancelled.is_set():
        return None

    def watch(events: int) -> bool:
        if not keep():
            raise LeftError
        watcher.events(events)
        return cancelled.is_set()

    return do(run, job, watch, command)


def _program() -> str:
    """What this process was begun with: a script's name, or a package's after ``python -m``."""
    started = Path(sys.argv[0])
    return started.parent.name if started.name == "__main__.py" else started.name
