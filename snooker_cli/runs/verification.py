"""Verify a run: read every file, check its hash and origin, and simulate it again on request."""

import json
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from itertools import chain
from pathlib import Path
from queue import SimpleQueue

from snooker_cli import store
from snooker_cli.config import validated
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.errors import RunError, StoreError
from snooker_cli.formatting import listed
from snooker_cli.placement.starting_scene import collision_rules, starting_scene
from snooker_cli.runs.execution import ThreadExecutor
from snooker_cli.runs.run import RepeatStatus, Run, State
from snooker_cli.trace import StopReason


def verify(run: Run, *, replay: bool, workers: int) -> Iterator[RepeatStatus]:
    """The status of each repeat, as they come; every file is read and checked.

    Child processes read the files, because a stranger's file may crash or fill what reads it.

    replay : simulate each repeat again, with the same limits and engine, and compare all bits of
        start, events or summary, finish and ending, in bounded memory
    workers : threads

    Raises ``RunError`` for a replay of another engine version's results.
    """
    if replay and run.engine_version != ENGINE_VERSION:
        raise RunError(
            f"{run.directory}: holds results of engine version {run.engine_version}, which this "
            f"snooker, of version {ENGINE_VERSION}, cannot simulate again",
            "verify it without --replay",
        )
    cancelled = threading.Event()
    idle: SimpleQueue[store.IsolatedChecker] = SimpleQueue()

    def verified(path: Path) -> list[RepeatStatus]:
        checker = idle.get()
        try:
            found = run.file_statuses(path, check=checker.check)
        finally:
            idle.put(checker)
        found = [_by_the_rules(run, each) for each in found]
        return [_repeated(run, each, cancelled) for each in found] if replay else found

    with ThreadExecutor(workers, cancelled) as threads, ExitStack() as checkers:
        for _ in range(workers):
            idle.put(checkers.enter_context(store.IsolatedChecker()))
        try:
            for point in run.points:
                found = threads.each(verified, run.batches(point.index))
                yield from run.best(point.index, chain.from_iterable(found))
        finally:
            cancelled.set()


def _by_the_rules(run: Run, status: RepeatStatus) -> RepeatStatus:
    """A repeat's status: unusable if its collisions follow other rules than the config's."""
    if status.header is None or status.state is State.UNUSABLE:
        return status
    wanted = store.written_rules(collision_rules(run.points[status.point].experiment))
    rules = status.header.rules  # zero and false are as good as absent
    names = [
        name for name in {**wanted, **rules} if (wanted.get(name) or 0) != (rules.get(name) or 0)
    ]
    if not names:
        return status
    reason = f"repeat {status.repeat} was simulated with another {listed(names)} than the config's"
    error = StoreError(status.path, reason, "delete it and run again")
    return replace(status, state=State.UNUSABLE, error=error)


def _repeated(run: Run, status: RepeatStatus, cancelled: threading.Event) -> RepeatStatus:
    """A repeat's status after it is simulated again: unusable if that gives other bits."""
    header = status.header
    if header is None or status.state is State.UNUSABLE:
        return status
    source = header.provenance
    experiment = run.points[source.point].experiment
    limits = experiment
    if source.digest != run.digests[source.point]:  # of a shorter run, which this one extends
        limits = validated(json.loads(source.config))
    most = limits.collisions or header.collisions
    interrupted = header.stop.reason is StopReason.INTERRUPTED
    fingerprint = store.Fingerprint()
    again = simulate(
        starting_scene(experiment, header.repeat),
        collisions=min(header.collisions, most) if interrupted else limits.collisions,
        time=limits.time,
        summary=limits.record == "summary",
        watch=lambda _: cancelled.is_set(),
        sink=fingerprint.add,
        engine=run.engine,
    )
    # One that was interrupted now stops at that collision for another reason. Words may differ.
    ends = [(stop.reason, stop.time, stop.balls) for stop in (again.stop, header.stop)]
    if interrupted or ends[0] == ends[1]:
        again = replace(again, stop=header.stop)
    if fingerprint.content(again) == header.fingerprint or cancelled.is_set():
        return status
    reason = f"simulating repeat {status.repeat} again gives other bits"
    error = StoreError(status.path, reason, "delete it and run again")
    return replace(status, state=State.UNUSABLE, error=error)
