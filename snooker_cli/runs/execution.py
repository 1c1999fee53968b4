"""Execute a run: check its files, compile, simulate what is missing, and store it."""

from __future__ import annotations

import shlex
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent import futures
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Self, TypeVar

from snooker_cli.config import Point
from snooker_cli.runs.folder import forget_failures, note_failure
from snooker_cli.runs.plan import alike, first_scene
from snooker_cli.runs.repeat import (
    AbandonedError,
    RepeatResult,
    cached,
    compile_for,
    simulate_repeat,
)
from snooker_cli.runs.run import RepeatStatus, Run, State

POLL_INTERVAL = 0.02
"""Seconds between two looks whether a run was cancelled."""

Item = TypeVar("Item")
Result = TypeVar("Result")


class Watcher:
    """Callbacks of `execute`, which any thread may call."""

    def unusable(self, status: RepeatStatus) -> None:
        """A file is damaged or of another run; its repeat is simulated again."""

    def outdated(self, removed: list[Path], figures: bool) -> None:
        """Analyses of fewer repeats were deleted; ``figures`` of fewer repeats are still there."""

    def simulating(self, compiling: float) -> None:
        """Simulating begins; ``compiling`` is the time that compiling took, s."""

    def events(self, number: int) -> None:
        """``number`` more collisions are simulated."""

    def finished(self, result: RepeatResult) -> None:
        """A repeat has ended."""


class Executor(ABC):
    """Simulates repeats: threads of this process, or workers on other machines.

    at_once : items that are given to the pool at a time
    cancelled : once set, no further item is begun
    """

    def __init__(self, pool: futures.Executor, at_once: int, cancelled: threading.Event) -> None:
        self._pool, self._at_once, self._cancelled = pool, at_once, cancelled

    @abstractmethod
    def simulate(
        self, run: Run, missing: Sequence[tuple[int, int]], watcher: Watcher, command: str
    ) -> Iterator[RepeatResult | None]:
        """The results of the missing repeats as they come; None for an abandoned one.

        missing : numbers of point and repeat
        watcher : its ``simulating`` and ``events`` are called
        command : stored in each provenance
        """

    def each(self, function: Callable[..., Result], items: Iterable[Item]) -> Iterator[Result]:
        """The results of a function as they come; once cancelled, only those that are kept."""
        pending: dict[Future[Result], Item] = {}
        ended: SimpleQueue[Future[Result]] = SimpleQueue()
        todo = iter(items)
        while not (self._cancelled.is_set() and self._abandons(pending)):
            while len(pending) < self._at_once and not self._cancelled.is_set():
                item = next(todo, None)
                if item is None:
                    break
                future = self._submit(function, item)
                pending[future] = item
                future.add_done_callback(ended.put)
            if not pending:
                return
            try:
                future = ended.get(timeout=POLL_INTERVAL)
            except Empty:
                continue
            yield self._result(future, pending.pop(future))

    @abstractmethod
    def _submit(self, function: Callable[..., Result], item: Any) -> Future[Result]:
        """Give an item to the pool."""

    @abstractmethod
    def _abandons(self, pending: Mapping[Future[Any], Any]) -> bool:
        """Whether a cancelled run need not wait for any of these."""

    @abstractmethod
    def _result(self, future: Future[Result], item: Any) -> Result:
        """The result of an item that has ended."""


class ThreadExecutor(Executor):
    """Threads of this process.

    Functions are called with an item and with ``keep``. They call ``keep`` once they have
    something to store; if it returns False, they must end without storing. A cancelled run waits
    only for threads that called it. It leaves the others alone, which compile or place balls.
    """

    def __init__(self, workers: int, cancelled: threading.Event) -> None:
        super().__init__(ThreadPoolExecutor(workers), 2 * workers, cancelled)
        self._keeps: dict[Future[Any], threading.Event] = {}
        self._lock = threading.Lock()
        self._abandoned = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._pool.shutdown(wait=not self._cancelled.is_set(), cancel_futures=True)

    def simulate(
        self, run: Run, missing: Sequence[tuple[int, int]], watcher: Watcher, command: str
    ) -> Iterator[RepeatResult | None]:
        clock = time.perf_counter()
        points = [run.points[point] for point in sorted({point for point, _ in missing})]
        for _ in self.each(lambda each, _: _compile_all(run, each), [points]):
            pass
        if self._cancelled.is_set():
            return
        watcher.simulating(time.perf_counter() - clock)

        def one(item: tuple[int, int], keep: Callable[[], bool]) -> RepeatResult | None:
            if self._cancelled.is_set():
                return None

            def watch(events: int) -> bool:
                if not keep():
                    raise AbandonedError
                watcher.events(events)
                return self._cancelled.is_set()

            return simulate_repeat(run, *item, watch, command)

        yield from self.each(one, missing)

    def _submit(self, function: Callable[..., Result], item: Any) -> Future[Result]:
        keeps = threading.Event()
        future = self._pool.submit(function, item, partial(self._keep, keeps))
        self._keeps[future] = keeps
        return future

    def _keep(self, keeps: threading.Event) -> bool:
        """Note that a thread has something to store; False if it was abandoned."""
        with self._lock:
            if not self._abandoned:
                keeps.set()
            return not self._abandoned

    def _abandons(self, pending: Mapping[Future[Any], Any]) -> bool:
        with self._lock:
            self._abandoned = not any(self._keeps[future].is_set() for future in pending)
            return self._abandoned

    def _result(self, future: Future[Result], _item: Any) -> Result:
        del self._keeps[future]
        return future.result()


def _compile_all(run: Run, points: Sequence[Point]) -> None:
    """Compile what simulating these points needs."""
    for same in alike(points).values():
        compile_for(first_scene(same[0].experiment, 0), run.engine)


def execute(
    run: Run,
    *,
    workers: int,
    watcher: Watcher,
    cancelled: threading.Event,
    executor: Executor | None = None,
) -> list[RepeatResult]:
    """Simulate what is missing of a run. Returns all results, by point and repeat.

    workers : threads; the bits of the results do not depend on it
    cancelled : once set, repeats in simulation are stored as interrupted, and no others begin
    executor : simulates instead of these threads, which then only check files

    An error in one repeat does not stop the others. Interrupts are the caller's: it turns signals
    into ``cancelled``.
    """
    results: list[RepeatResult] = []
    missing: list[tuple[int, int]] = []
    unusable: list[RepeatStatus] = []
    unnoted: list[tuple[int, int, str]] = []
    figures_reported = False
    command = shlex.join([_program(), *sys.argv[1:]])

    def finish(result: RepeatResult) -> None:
        results.append(result)
        watcher.finished(result)

    with ThreadExecutor(workers, cancelled) as threads:
        present: list[tuple[int, int]] = []
        for item in run.repeats():
            (present if run.path(*item).exists() else missing).append(item)
        for status in threads.each(lambda item, _: run.repeat_status(*item), present):
            if result := cached(status):
                finish(result)
                continue
            missing.append((status.point, status.repeat))
            if status.state is State.UNUSABLE:
                unusable.append(status)
        for status in sorted(unusable, key=lambda status: status.path):
            watcher.unusable(status)
        forget_failures(run)
        missing.sort()
        simulated: Iterable[RepeatResult | None] = ()
        if missing and not cancelled.is_set():
            figures_reported = _remove_analyses(run, watcher)
            simulated = (executor or threads).simulate(run, missing, watcher, command)
        for result in simulated:
            if result is None:
                continue
            if result.error:
                failure = result.point, result.repeat, result.error
                if not note_failure(run, *failure):
                    unnoted.append(failure)
            finish(result)
    if any(not result.cached for result in results):
        _remove_analyses(run, watcher, figures_reported)  # those made meanwhile
    for failure in unnoted:  # temporary files have left the disk by now
        note_failure(run, *failure)
    return sorted(results, key=lambda result: (result.point, result.repeat))


def _remove_analyses(run: Run, watcher: Watcher, figures_reported: bool = False) -> bool:
    """Delete fits and comparisons of fewer repeats. Returns whether there are figures."""
    removed = run.analyses()
    for path in removed:
        path.unlink(missing_ok=True)
    figures = bool(run.figures())
    if removed or (figures and not figures_reported):
        watcher.outdated(removed, figures and not figures_reported)
    return figures


def _program() -> str:
    """The program of this process: a script's name, or a package's after ``python -m``."""
    started = Path(sys.argv[0])
    return started.parent.name if started.name == "__main__.py" else started.name
