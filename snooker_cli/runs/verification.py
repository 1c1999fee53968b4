"""Verify a run: read every file, check its hash and origin, and simulate it again on request."""

import json
import math
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from snooker_cli import store
from snooker_cli.config import Config, validated
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.engine.simulation import Sink, StateSink, Watch
from snooker_cli.errors import RunError, StoreError
from snooker_cli.formatting import listed
from snooker_cli.options import REPLAY
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs.execution import ThreadExecutor
from snooker_cli.runs.out_of_range import Limits, fault_of
from snooker_cli.runs.plan import snapshot_times
from snooker_cli.runs.run import RepeatState, RepeatStatus, RunFolder
from snooker_cli.trace import StopReason, Trace

if sys.platform != "win32":
    import resource

READING_MEMORY, MEMORY_PER_BYTE = 10**9, 8
"""Bytes that reading a file may take, and more for each of its bytes."""

ADVICE = "delete it and run again"


def verify(run: RunFolder, *, replay: bool, workers: int) -> Iterator[RepeatStatus]:
    """The status of each repeat, as they come; every file is read and checked, and its scene too.

    replay : simulate each repeat again, with the same limits, and compare all bits of
        start, events or summary, finish and ending, in bounded memory
    workers : threads that simulate

    Raises ``RunError`` for a replay of another engine version's results.
    """
    if replay and not run.can_be_replayed:
        raise RunError(
            f"{run.directory}: holds results of engine version {run.engine_version}, which this "
            f"snooker, of version {ENGINE_VERSION}, cannot simulate again",
            f"verify it without {REPLAY}",
        )
    if not replay:
        for point in run.points:
            yield from run.best(point.index, _checked_statuses(run, point.index))
        return
    # All files are read first: simulations need no limit of memory.
    of_points = [[*_checked_statuses(run, point.index)] for point in run.points]
    cancelled = threading.Event()
    with ThreadExecutor(workers, cancelled) as threads:
        try:
            for point, statuses in zip(run.points, of_points, strict=True):
                again = threads.results(partial(_replayed, run, cancelled), statuses)
                yield from run.best(point.index, again)
        finally:
            cancelled.set()


def _checked_statuses(run: RunFolder, point: int) -> Iterator[RepeatStatus]:
    """The status of each repeat in each file of a point: unusable if it is not of the config."""
    for path in run.batches(point):
        for status in run.file_statuses(path, check=check):
            header = _usable(status)
            yield _refused(status, origin_fault(run, header)) if header else status


def check(path: Path) -> list[store.RepeatHeader]:
    """As ``store.check``, but a file may not fill the memory. Raises ``StoreError``."""
    size = (store.file_info(path) or (0, 0))[0]
    with limited_memory(READING_MEMORY + MEMORY_PER_BYTE * size):
        return store.check(path)


@contextmanager
def limited_memory(more: int) -> Iterator[None]:
    """Inside, this process may take this many bytes more, else ``MemoryError``. On Linux only."""
    statistics = Path("/proc/self/statm")
    if sys.platform == "win32" or not statistics.exists():
        yield
        return
    data = int(statistics.read_text().split()[5]) * resource.getpagesize()
    before, most = resource.getrlimit(resource.RLIMIT_DATA)
    limits = [limit for limit in (before, most) if limit != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_DATA, (min([data + more, *limits]), most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (before, most))


def _usable(status: RepeatStatus) -> store.RepeatHeader | None:
    """The header of a repeat, unless its file cannot be used."""
    return None if status.state is RepeatState.UNUSABLE else status.header


def _refused(status: RepeatStatus, reason: str) -> RepeatStatus:
    """The status, unusable if there is a reason."""
    if not reason:
        return status
    error = StoreError(status.path, reason, ADVICE)
    return status._replace(state=RepeatState.UNUSABLE, error=error)


def _replayed(run: RunFolder, cancelled: threading.Event, status: RepeatStatus) -> RepeatStatus:
    """The status: unusable if simulating the repeat again gives other bits."""
    header = _usable(status)
    if header is None or _is_repeatable(run, header, cancelled):
        return status
    return _refused(status, f"simulating repeat {status.repeat} again gives other bits")


def origin_fault(run: RunFolder, header: store.RepeatHeader) -> str:
    """Why a stored repeat is not of the config: its rules, limit or start; empty if it may be.

    The start of another engine version is not known.
    """
    config, repeat = run.by_number[header.provenance.point].config, header.repeat
    wanted, rules = vars(config.collision_rules), vars(header.rules)
    names = [name for name in wanted if wanted[name] != rules[name]]
    if names:
        return f"repeat {repeat} was simulated with another {listed(names)} than the config's"
    limits = config_of(run, header.provenance)
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
        start = starting_scene(config, repeat)
        if header.start != store.scene_hash(start):
            return f"repeat {repeat} starts from another scene than the config's"
    return ""


def config_of(run: RunFolder, source: store.Provenance) -> Config:
    """The config whose limits a stored repeat has, perhaps from before an extension of the run."""
    config = run.by_number[source.point].config
    if source.digest == run.digests[source.point]:
        return config
    return validated(json.loads(source.config))


def _is_repeatable(run: RunFolder, header: store.RepeatHeader, cancelled: threading.Event) -> bool:
    """Whether simulating a repeat again gives the same bits, or is cancelled."""
    fingerprint = store.Fingerprint()
    again = simulated_again(
        run,
        header,
        watch=lambda *_: cancelled.is_set(),
        sink=fingerprint.add,
        states=fingerprint.add_snapshot,
    )
    return fingerprint.content(again) == header.fingerprint or cancelled.is_set()


def simulated_again(
    run: RunFolder, header: store.RepeatHeader, *, watch: Watch, sink: Sink, states: StateSink
) -> Trace:
    """A stored repeat, simulated with the same limits.

    It has the ending that is stored, if that is true; its words may differ.

    watch, sink, states : as of ``simulate``
    """
    source, stored = header.provenance, header.stop
    valid_config, config = run.by_number[source.point].config, config_of(run, source)
    start = starting_scene(valid_config, header.repeat)
    limits = Limits(config.collisions, config.time, header.summary, snapshot_times(config, start))
    # These ended at a collision for a reason that is not in the simulation.
    cut = stored.reason in (StopReason.INTERRUPTED, StopReason.OUT_OF_RANGE)
    most = limits.collisions
    if cut:
        most = min(header.collisions, most or header.collisions)
    again = simulate(
        start,
        collisions=most,
        time=limits.time,
        summary=limits.summary,
        snapshots=limits.snapshots,
        watch=watch,
        sink=sink,
        states=states,
    )
    if stored.reason is StopReason.OUT_OF_RANGE:
        further = min(header.collisions + 1, limits.collisions or math.inf)
        cut = bool(fault_of(start, replace(limits, collisions=int(further)), watch))
    if cut:
        return replace(again, stop=stored._replace(time=again.stop.time, balls=()))
    if (again.stop.reason, again.stop.balls) == (stored.reason, stored.balls):
        return replace(again, stop=again.stop._replace(message=stored.message))
    return again
