"""Execute a run: check its files, compile, simulate what is missing, and store it."""

import logging
import shlex
import sys
import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from concurrent import futures
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import partial
from itertools import chain, groupby, islice, product
from multiprocessing import get_context
from operator import itemgetter
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from snooker_cli import store
from snooker_cli.errors import DeniedError, RunError
from snooker_cli.files import discard
from snooker_cli.formatting import counted
from snooker_cli.options import JOBS
from snooker_cli.runs.batch import (
    CHECKPOINT_INTERVAL,
    Batch,
    BatchResults,
    Begun,
    Job,
    Progress,
    RepeatResult,
    simulate_and_store,
    stored_result,
)
from snooker_cli.runs.folder import FAILURES, holds_manifest, manifest_number, record_failure
from snooker_cli.runs.plan import alike, batch_size
from snooker_cli.runs.processes import Processes, safe_path, using_shared_memory
from snooker_cli.runs.run import RepeatState, RepeatStatus, RunFolder
from snooker_cli.runs.warm_up import compile_for, compiling_beside

POLL_INTERVAL = 0.02  # seconds between two looks whether a run was cancelled
PROGRESS_INTERVAL = 1.0  # seconds after which another process reports again how far it is
LEAST_FOR_PROCESS = 6  # batches of short repeats for each process; its start takes a second
MOST_PROCESSES = 61  # that Windows can wait for

Result = TypeVar("Result")

_log = logging.getLogger(__name__)


class Watcher:
    """Callbacks of `execute`, which any thread may call."""

    def unusable(self, problem: str) -> None:
        """A file is damaged or of another run; its repeat is simulated again."""

    def simulating(self, compiling: float) -> None:
        """Simulating begins; ``compiling`` is the time that compiling took, s."""

    def reached(self, progress: Progress) -> None:
        """A batch in simulation is so far; perhaps it has ended since."""

    def finished(self, result: RepeatResult) -> None:
        """A repeat has ended."""


class Executor(AbstractContextManager["Executor"]):
    """Simulates repeats: threads or processes of this machine, or workers on other machines.

    at_once : items that are given to the pool at a time
    cancelled : once set, no further item is begun
    """

    def __init__(self, pool: futures.Executor, at_once: int, cancelled: threading.Event) -> None:
        self._pool, self._at_once, self._cancelled = pool, at_once, cancelled

    @abstractmethod
    def simulate(
        self, job: Job, missing: Sequence[Batch], watcher: Watcher
    ) -> Iterator[BatchResults]:
        """The results of the missing batches as they come; None for an abandoned one.

        watcher : its ``simulating`` and ``reached`` are called
        """

    def results(self, function: Callable[[Any], Result], items: Iterable[Any]) -> Iterator[Result]:
        """The results of a function as they come; once cancelled, only those that are stored."""
        pending: dict[Future[Result], Any] = {}
        ended: SimpleQueue[Future[Result]] = SimpleQueue()
        waiting = iter(items)
        # The pool gets a new item for each that has ended: items that wait can still be cancelled.
        while True:
            if not self._cancelled.is_set():
                for item in islice(waiting, self._at_once - len(pending)):
                    future = self._pool.submit(function, item)
                    pending[future] = item
                    future.add_done_callback(ended.put)
            elif not self._stop_and_ask(pending.values()):
                return
            if not pending:
                return
            try:
                future = ended.get(timeout=POLL_INTERVAL)
            except Empty:
                self._give_up(pending)
                continue
            yield self._result(future, pending.pop(future))

    def _give_up(self, pending: Iterable[Future[Any]]) -> None:
        """End the futures that can have no result any more."""

    @abstractmethod
    def _stop_and_ask(self, pending: Iterable[Any]) -> bool:
        """Stop a cancelled run. Whether one of the pending items may still be stored."""

    def _result(self, future: Future[Result], _item: Any) -> Result:
        return future.result()


class ThreadExecutor(Executor):
    """Threads of this process.

    A cancelled run waits only for long repeats that have events. It leaves threads alone that
    compile, place balls or simulate a batch of short repeats.
    """

    def __init__(self, workers: int, cancelled: threading.Event, processes: bool = False) -> None:
        super().__init__(ThreadPoolExecutor(workers), 2 * workers, cancelled)
        self._begun = Begun(cancelled)
        self._processes = min(workers, MOST_PROCESSES) if processes else 1

    def __exit__(self, *_error: object) -> None:
        self._pool.shutdown(wait=not self._cancelled.is_set(), cancel_futures=True)

    def simulate(
        self, job: Job, missing: Sequence[Batch], watcher: Watcher
    ) -> Iterator[BatchResults]:
        clock, run = time.perf_counter(), job.run
        points = [run.by_number[point] for point in sorted({point for point, _ in missing})]
        scenes = [same[0].config for same in alike(points).values()]
        beside = compiling_beside(scenes) if self._processes > 1 else nullcontext()
        with beside:
            for _ in self.results(compile_for, scenes):
                pass
            if not self._cancelled.is_set():
                watcher.simulating(time.perf_counter() - clock)
            yield from self._simulated(job, missing, watcher)

    def _simulated(
        self, job: Job, missing: Sequence[Batch], watcher: Watcher
    ) -> Iterator[BatchResults]:
        """The results of batches whose kernels are compiled."""
        short = sum(len(batch.repeats) > 1 for batch in missing)
        if self._processes > 1 and short >= LEAST_FOR_PROCESS * self._processes:
            try:
                others = ProcessExecutor(self._processes, job, self._cancelled)
            except RunError as error:
                _log.warning("%s; threads simulate instead, more slowly", error.problem)
            else:
                with others:
                    yield from others.simulate(job, missing, watcher)
                return
        simulated = partial(simulate_and_store, job, begun=self._begun, reached=watcher.reached)
        yield from self.results(simulated, missing)

    def _stop_and_ask(self, pending: Iterable[Any]) -> bool:
        return not self._begun.stop().isdisjoint(pending)


@contextmanager
def asking(news: Callable[[], Iterable[Progress]], watcher: Watcher) -> Iterator[None]:
    """Inside, a thread asks other processes how far they are, and passes it to the watcher."""
    ended = threading.Event()

    def keep_asking() -> None:
        while not ended.wait(PROGRESS_INTERVAL):
            with suppress(Exception):  # a lost process or scheduler is noticed by its results
                for progress in news():
                    watcher.reached(progress)

    threading.Thread(target=keep_asking, daemon=True).start()
    try:
        yield
    finally:
        ended.set()


class ProcessExecutor(Executor):
    """Processes of this machine, for many short repeats: of threads, one at a time runs Python."""

    _pool: Processes

    def __init__(self, workers: int, job: Job, cancelled: threading.Event) -> None:
        context = get_context("spawn")
        with using_shared_memory(), safe_path():
            self._stopped, self._reached = context.Event(), context.SimpleQueue()
        pool = Processes(workers, _take_job, job, self._stopped, self._reached)
        super().__init__(pool, 2 * workers, cancelled)

    def __exit__(self, *_error: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def simulate(
        self, job: Job, missing: Sequence[Batch], watcher: Watcher
    ) -> Iterator[BatchResults]:
        try:
            with asking(self._news, watcher):
                yield from self.results(_simulate_here, missing)
        except OSError as error:
            self._pool.kill()
            raise RunError(
                f"{job.run.directory}: no further process can begin ({error.strerror})",
                f"close other programs, or run the same command again with {JOBS} 1",
            ) from None
        except BrokenProcessPool:
            self._pool.kill()
            raise RunError(
                f"{job.run.directory}: the system ended a process of this run, perhaps for lack of "
                "memory",
                f"run the same command again, with fewer {JOBS}",
            ) from None

    def _news(self) -> Iterator[Progress]:
        """How far the processes are, as they sent it since the last call."""
        while not self._reached.empty():
            yield self._reached.get()

    def _stop_and_ask(self, pending: Iterable[Any]) -> bool:
        self._stopped.set()  # each process then ends its batch soon, stored or abandoned
        return True


_process: tuple[Job, Begun, Callable[[Progress], None]]
"""What a process of ``ProcessExecutor`` simulates, and what takes how far it is."""


def _take_job(job: Job, stopped: Any, sent: Any) -> None:
    global _process
    due = time.monotonic()

    def reached(progress: Progress) -> None:
        nonlocal due
        if time.monotonic() >= due:
            sent.put(progress)
            due = time.monotonic() + PROGRESS_INTERVAL

    _process = job, Begun(stopped), reached


def _simulate_here(batch: Batch) -> BatchResults:
    """The results of a batch in this process; None for an abandoned one."""
    job, begun, reached = _process
    return simulate_and_store(job, batch, begun, reached)


def execute(
    run: RunFolder,
    *,
    workers: int,
    watcher: Watcher,
    cancelled: threading.Event,
    executor: Executor | None = None,
    interval: float = CHECKPOINT_INTERVAL,
    command: str = "",
    part: Set[tuple[int, int]] | None = None,
    processes: bool = False,
) -> list[RepeatResult]:
    """Simulate what is missing of a run. Returns all results, by point and repeat.

    workers : threads; the bits of the results do not depend on it
    cancelled : once set, repeats in simulation are stored as interrupted, and no others begin
    executor : simulates instead of these threads, which then only check files
    interval : seconds after which a long repeat saves a checkpoint
    command : stored in each provenance [the command line of this process]
    part : of ``share_of``; does only this and deletes nothing, so that parts can run at the same
        time
    processes : whether processes may simulate many short repeats, instead of threads. A new process
        imports the main module again.

    An error in one repeat does not stop the others. The caller handles signals: it sets
    ``cancelled``. Raises ``RunError`` if the run's folder is gone or another one; ``cancelled`` is
    then set. Raises ``DeniedError`` for a file that cannot be read, before anything is simulated.
    """
    results: list[RepeatResult] = []
    manifest = manifest_number(run.directory)

    def is_lost() -> bool:  # another part may write the same manifest
        return manifest_number(run.directory) != manifest and not holds_manifest(run)

    def finish(result: RepeatResult) -> None:
        results.append(result)
        if result.error:
            record_failure(run, result.point, result.repeat, result.error)
        watcher.finished(result)

    with ThreadExecutor(workers, cancelled, processes) as threads:
        # Which repeats are stored, and which are missing?
        statuses = _best_statuses(run, threads, watcher, part)
        for result in filter(None, map(stored_result, statuses)):
            finish(result)
        kept = {status.path for status in statuses if status.state is RepeatState.DONE}
        missing = [
            (status.point, status.repeat)
            for status in statuses
            if status.state is not RepeatState.DONE
        ]
        # Simulate and store these.
        if part is None and not cancelled.is_set():
            discard(run.directory / FAILURES)
        if missing and not cancelled.is_set():
            batches = _batches(run, missing)
            kept |= {run.path(*batch) for batch in batches}
            job = Job(run, command or _command(), interval)
            for of_batch in (executor or threads).simulate(job, batches, watcher):
                for result in of_batch or ():
                    finish(result)
                if is_lost():
                    cancelled.set()  # nothing more can be stored
        # Delete the files that these replace.
        if is_lost():
            raise RunError(
                f"{run.directory}: was deleted, moved or replaced during the run",
                "run the same command again",
                code="lost",
            )
        failed = any(result.error for result in results)
        if part is None and not cancelled.is_set() and not failed:
            run.delete_all_but(kept)
    return sorted(results, key=lambda result: (result.point, result.repeat))


def _best_statuses(
    run: RunFolder, threads: Executor, watcher: Watcher, part: Set[tuple[int, int]] | None
) -> list[RepeatStatus]:
    """The best status of each repeat, or of those of a part; every file is read and checked.

    Raises ``DeniedError`` for a file that cannot be read.
    """
    of_points: dict[int, list[RepeatStatus]] = {point.index: [] for point in run.points}
    paths = chain.from_iterable(map(run.batches, of_points))
    for statuses in threads.results(partial(run.file_statuses, check=store.check), paths):
        for status in statuses:
            if isinstance(status.error, DeniedError):
                raise status.error
            of_points[status.point].append(status)
    best = [
        status
        for point, statuses in of_points.items()
        for status in run.best(point, statuses)
        if part is None or (point, status.repeat) in part
    ]
    unusable = {
        status.path: status.error for status in best if status.state is RepeatState.UNUSABLE
    }
    for error in filter(None, unusable.values()):
        watcher.unusable(error.problem)
    return best


def share_of(run: RunFolder, k: int, n: int) -> tuple[set[tuple[int, int]], str]:
    """The points and numbers of repeats of every n-th batch from the k-th; a sentence if none."""
    everything = product((point.index for point in run.points), range(run.config.repeats))
    batches = _batches(run, everything)
    idle = f"part {k} of {n} has nothing to do: the run has {counted(len(batches), 'batch')}"
    share = {(point, repeat) for point, repeats in batches[k - 1 :: n] for repeat in repeats}
    return share, "" if share else idle


def _batches(run: RunFolder, missing: Iterable[tuple[int, int]]) -> list[Batch]:
    """The missing repeats, in batches of consecutive ones."""
    batches: list[Batch] = []
    for point, pairs in groupby(missing, key=itemgetter(0)):
        size = batch_size(run.by_number[point].config)
        # Among consecutive numbers, the difference from their rank is the same.
        ranked = enumerate(repeat for _, repeat in pairs)
        for _, together in groupby(ranked, key=lambda pair: pair[1] - pair[0]):
            repeats = tuple(repeat for _, repeat in together)
            batches += [Batch(point, repeats[k : k + size]) for k in range(0, len(repeats), size)]
    return batches


def _command() -> str:
    """The command line of this process; after ``python -m``, it begins with the package's name."""
    program = Path(sys.argv[0])
    name = program.parent.name if program.name == "__main__.py" else program.name
    return shlex.join([name, *sys.argv[1:]])
