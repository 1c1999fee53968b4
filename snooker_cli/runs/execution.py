"""Doing what is missing of a run: checked, compiled for, simulated and stored by workers."""

from __future__ import annotations

import shlex
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Self, TypeVar

from snooker_cli.runs.folder import forget_failures, note_failure
from snooker_cli.runs.plan import alike, arranged
from snooker_cli.runs.repeat import LeftError, Outcome, compile_for, do
from snooker_cli.runs.run import Run, State
from snooker_cli.runs.status import Job, entry, jobs
from snooker_cli.store import RepeatHeader

if TYPE_CHECKING:
    from snooker_cli.runs.dask_executor import DaskExecutor


# The one seam to whoever works: an executor, given so much at a time until a run is cancelled.

LOOK = 0.02
"""Seconds after which whoever waits for workers looks whether the run is cancelled."""

Item = TypeVar("Item")
Result = TypeVar("Result")


class RepeatExecutor(ABC):
    """What threads of this process have in common with workers on other machines.

    at_once : items that the executor has at a time; the others are kept back
    """

    def __init__(self, executor: Executor, at_once: int, cancelled: threading.Event) -> None:
        self._executor, self._at_once, self._cancelled = executor, at_once, cancelled

    def each(self, function: Callable[..., Result], items: Iterable[Item]) -> Iterator[Result]:
        """Results for items as they come; the first ones only, once the run is cancelled."""
        under_way: dict[Future[Result], Item] = {}
        ended: SimpleQueue[Future[Result]] = SimpleQueue()
        todo = iter(items)
        while not (self._cancelled.is_set() and self._leaves(under_way)):
            while len(under_way) < self._at_once and not self._cancelled.is_set():
                item = next(todo, None)
                if item is None:
                    break
                future = self._submit(function, item)
                under_way[future] = item
                future.add_done_callback(ended.put)
            if not under_way:
                return
            try:
                future = ended.get(timeout=LOOK)
            except Empty:
                continue
            yield self._result(future, under_way.pop(future))

    @abstractmethod
    def _submit(self, function: Callable[..., Result], item: Any) -> Future[Result]:
        """Give an item to the executor."""

    @abstractmethod
    def _leaves(self, under_way: Mapping[Future[Any], Any]) -> bool:
        """Whether a cancelled run waits for nothing any more of what is under way."""

    @abstractmethod
    def _result(self, future: Future[Result], item: Any) -> Result:
        """What has become of an item."""


# Threads that an interrupt need not wait for, unless they have something to keep.


class ThreadExecutor(RepeatExecutor):
    """Threads for all that takes long, so that an interrupt is answered meanwhile.

    What they do is given an item, and what to call when it has something to keep: false means that
    nobody waits for it any more. After an interrupt, only threads are waited for that have
    something to keep. The others, which compile or arrange a million balls, are left behind; they
    write nothing.
    """

    def __init__(self, workers: int, cancelled: threading.Event) -> None:
        super().__init__(ThreadPoolExecutor(workers), 2 * workers, cancelled)
        self._keeps: dict[Future[Any], threading.Event] = {}
        self._lock = threading.Lock()
        self._left = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._executor.shutdown(wait=not self._cancelled.is_set(), cancel_futures=True)

    def _submit(self, function: Callable[..., Result], item: Any) -> Future[Result]:
        keeps = threading.Event()
        future = self._executor.submit(function, item, partial(self._keep, keeps))
        self._keeps[future] = keeps
        return future

    def _keep(self, keeps: threading.Event) -> bool:
        """Note that a thread has something to keep, unless nobody waits any more."""
        with self._lock:
            if not self._left:
                keeps.set()
            return not self._left

    def _leaves(self, under_way: Mapping[Future[Any], Any]) -> bool:
        with self._lock:
            self._left = not any(self._keeps[future].is_set() for future in under_way)
            return self._left

    def _result(self, future: Future[Result], _item: Any) -> Result:
        del self._keeps[future]
        return future.result()


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
    cluster: DaskExecutor | None = None,
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
    with ThreadExecutor(workers, cancelled) as threads:
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


def _cached(job: Job, told: RepeatHeader) -> Outcome:
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
