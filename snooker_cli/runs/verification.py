"""Verify a run: read every file, check its hash and origin, and simulate it again on request."""

import json
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import replace
from itertools import chain
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from snooker_cli import store
from snooker_cli.config import Experiment, validated
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.errors import RunError, StoreError
from snooker_cli.formatting import listed
from snooker_cli.placement.starting_scene import collision_rules, starting_scene
from snooker_cli.runs.execution import ThreadExecutor
from snooker_cli.runs.run import RepeatState, RepeatStatus, Run
from snooker_cli.trace import StopReason

if sys.platform != "win32":
    import resource

SECONDS, BYTES_PER_SECOND = 20, 1e6  # processor time for a file; most take a hundredth of it
MEMORY, MEMORY_PER_BYTE = 1.2e9, 8  # bytes for a process and a file; the libraries take 2e8

NO_CRASH = ("SIGHUP", "SIGINT", "SIGKILL", "SIGTERM")  # ends of a process that no file causes

ADVICE = "delete it and run again"


def verify(run: Run, *, replay: bool, workers: int) -> Iterator[RepeatStatus]:
    """The status of each repeat, as they come; every file is read and checked, and its scene too.

    Child processes read the files, because a stranger's file may crash or fill what reads it.

    replay : simulate each repeat again, with the same limits, and compare all bits of
        start, events or summary, finish and ending, in bounded memory
    workers : threads

    Raises ``RunError`` for a replay of another engine version's results.
    """
    if replay and not run.can_be_replayed:
        raise RunError(
            f"{run.directory}: holds results of engine version {run.engine_version}, which this "
            f"snooker, of version {ENGINE_VERSION}, cannot simulate again",
            "verify it without --replay",
        )
    cancelled = threading.Event()
    # Each thread takes an idle checker for one file, so there are never more than ``workers``.
    idle: SimpleQueue[IsolatedChecker] = SimpleQueue()

    def verified(path: Path) -> list[RepeatStatus]:
        checker = idle.get()
        try:
            statuses = run.file_statuses(path, check=checker.check)
        finally:
            idle.put(checker)
        return [_verified(run, status, replay, cancelled) for status in statuses]

    with ThreadExecutor(workers, cancelled) as threads, ExitStack() as checkers:
        for _ in range(workers):
            idle.put(checkers.enter_context(IsolatedChecker()))
        try:
            for point in run.points:
                statuses = threads.results(verified, run.batches(point.index))
                yield from run.best(point.index, chain.from_iterable(statuses))
        finally:
            cancelled.set()


def _verified(
    run: Run, status: RepeatStatus, replay: bool, cancelled: threading.Event
) -> RepeatStatus:
    """A repeat's status: unusable if its rules are not the config's, or a replay differs."""
    header = status.header
    if header is None or status.state is RepeatState.UNUSABLE:
        return status
    reason = origin_fault(run, header)
    if not reason and replay and not _is_repeatable(run, header, cancelled):
        reason = f"simulating repeat {status.repeat} again gives other bits"
    if not reason:
        return status
    error = StoreError(status.path, reason, ADVICE)
    return status._replace(state=RepeatState.UNUSABLE, error=error)


def origin_fault(run: Run, header: store.RepeatHeader) -> str:
    """Why a stored repeat is not of the config: its rules, limit or start; empty if it may be.

    The start of another engine version is not known.
    """
    experiment, repeat = run.points[header.provenance.point].experiment, header.repeat
    wanted = store.written_rules(collision_rules(experiment))
    rules = header.rules  # zero and false are as good as absent
    names = [
        name for name in {**wanted, **rules} if (wanted.get(name) or 0) != (rules.get(name) or 0)
    ]
    if names:
        return f"repeat {repeat} was simulated with another {listed(names)} than the config's"
    limits = limits_of(run, header.provenance)
    at_time = header.stop.time, limits.time
    ends = {
        StopReason.COLLISIONS: (header.collisions, limits.collisions),
        StopReason.TIME: at_time,
        StopReason.NOTHING_LEFT: at_time if limits.time else (None, None),
    }
    end, limit = ends.get(header.stop.reason, (None, None))
    if end != limit:
        return f"repeat {repeat} ends at another limit than the config's"
    if run.can_be_replayed:
        start = starting_scene(experiment, repeat)
        if header.start != store.scene_hash(start):
            return f"repeat {repeat} starts from another scene than the config's"
    return ""


def limits_of(run: Run, source: store.Provenance) -> Experiment:
    """The config whose limits a stored repeat has, perhaps from before an extension of the run."""
    experiment = run.points[source.point].experiment
    if source.digest == run.digests[source.point]:
        return experiment
    return validated(json.loads(source.config))


def _is_repeatable(run: Run, header: store.RepeatHeader, cancelled: threading.Event) -> bool:
    """Whether simulating a repeat again gives the same bits, or is cancelled."""
    source = header.provenance
    experiment, limits = run.points[source.point].experiment, limits_of(run, source)
    most = limits.collisions or header.collisions
    interrupted = header.stop.reason is StopReason.INTERRUPTED
    fingerprint = store.Fingerprint()
    again = simulate(
        starting_scene(experiment, header.repeat),
        collisions=min(header.collisions, most) if interrupted else limits.collisions,
        time=limits.time,
        summary=header.summary,
        watch=lambda _: cancelled.is_set(),
        sink=fingerprint.add,
    )
    # One that was interrupted now stops at that collision for another reason. Words may differ.
    ends = [(stop.reason, stop.time, stop.balls) for stop in (again.stop, header.stop)]
    if interrupted or ends[0] == ends[1]:
        again = replace(again, stop=header.stop)
    return fingerprint.content(again) == header.fingerprint or cancelled.is_set()


class IsolatedChecker(AbstractContextManager["IsolatedChecker"]):
    """Checks files one after the other in a child process; a new one begins after a crash."""

    _process: Any = None

    def __exit__(self, *_error: object) -> None:
        if self._process is not None:
            self._process.kill()

    def check(self, path: Path) -> list[store.RepeatHeader]:
        """As ``store.check``. Raises ``StoreError`` also for a file that ends the process.

        Raises ``RunError`` if no process can begin.
        """
        if self._process is None:
            context = get_context("spawn")  # a fork would copy locks that other threads hold
            self._files, there = context.Pipe()
            process = context.Process(target=_check_files, args=(there,), daemon=True)
            problem = "no process to check files can begin", "close other programs"
            try:
                process.start()
            except OSError:
                raise RunError(*problem) from None
            self._process = process
            there.close()
            if self._answer() is not None:
                raise RunError(*problem)
        size = (store.file_info(path) or (0, 0))[0]
        seconds = int(SECONDS + size / BYTES_PER_SECOND)
        with suppress(OSError):
            self._files.send((path, seconds, int(MEMORY + MEMORY_PER_BYTE * size)))
        answer = self._answer()
        if isinstance(answer, int):
            how = f"ends its process (exit code {answer})"
            if answer < 0:
                name = signal.Signals(-answer).name
                if name in NO_CRASH:
                    raise RunError(
                        f"{path}: the system ended the process that read this file, perhaps for "
                        "lack of memory",
                        "run the same command again, with fewer --jobs",
                    )
                how = f"takes longer than {seconds} s" if name == "SIGXCPU" else f"crashes ({name})"
            answer = StoreError(path, f"reading it {how}", ADVICE)
        if isinstance(answer, StoreError):
            raise answer
        return list(answer)

    def _answer(self) -> Any:
        """What the process sends, or its exit code after it has ended."""
        try:
            return self._files.recv()
        except (EOFError, OSError):
            self._process.join()
            code, self._process = self._process.exitcode, None
            return code


def _check_files(files: Connection) -> None:
    """Answer each path with the headers of its file or an error, until the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    files.send(None)
    with suppress(EOFError, OSError):
        while True:
            path, seconds, memory = files.recv()
            if sys.platform != "win32":
                _limit(resource.RLIMIT_CPU, int(time.process_time()) + seconds)
                _limit(resource.RLIMIT_DATA, memory)
                _limit(resource.RLIMIT_CORE, 0)
            try:
                files.send(store.check(path))
            except StoreError as error:
                files.send(error)


def _limit(name: int, limit: int) -> None:
    """Give this process at most so much of a resource, or what the system allows."""
    if sys.platform != "win32":
        _, most = resource.getrlimit(name)
        limit = limit if most == resource.RLIM_INFINITY else min(limit, most)
        resource.setrlimit(name, (limit, most))
