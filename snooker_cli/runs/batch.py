"""Simulate a batch of repeats and store it, on this machine or on another."""

import json
import logging
import platform
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from typing import NamedTuple, TypeAlias

from snooker_cli import __version__, store
from snooker_cli.config import to_json
from snooker_cli.engine import ENGINE_VERSION, CheckpointError, share_done, simulate, simulate_batch
from snooker_cli.errors import SceneError, StoreError, UnsoundError, described
from snooker_cli.placement.starting_scene import starting_scenes
from snooker_cli.runs.out_of_range import (
    Limits,
    ended_before,
    refusal,
    sound_collisions,
    sound_part,
)
from snooker_cli.runs.plan import first_scene, snapshot_times
from snooker_cli.runs.run import RepeatState, RepeatStatus, RunFolder
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Simultaneous, Stop, StopReason, Trace

CHECKPOINT_INTERVAL = 600.0  # seconds after which a long repeat saves a checkpoint, by default
SAVING_SHARE = 20  # times as long as saving one took, until the next checkpoint

_log = logging.getLogger(__name__)


class Batch(NamedTuple):
    """Consecutive repeats of a point, which are simulated and stored together."""

    point: int
    repeats: tuple[int, ...]


@dataclass(frozen=True)
class RepeatResult:
    """How a repeat ended: its stop, or the error that prevented it.

    cached : its file existed and was checked instead
    simultaneous : its new events that have exactly the time of another of the same ball; none for a
        summary, and none are counted in a collapse, where all are at one time
    traceback : of an internal error
    continued : its collisions before the checkpoint from which it was continued now
    unstored : it was interrupted, and its older file, which is as long or longer, was kept
    """

    point: int
    repeat: int
    stop: Stop | None = None
    collisions: int = 0
    cached: bool = False
    simultaneous: int = 0
    error: str | None = None
    traceback: str = ""
    continued: int = 0
    unstored: bool = False


BatchResults: TypeAlias = list[RepeatResult] | None  # of a batch; None for an abandoned one


class Progress(NamedTuple):
    """How far a batch in simulation is.

    collisions : simulated now, without those before a checkpoint
    share : of its repeats on average, from 0 at the start to 1 at their limits
    given : that share at the checkpoint from which it continues
    """

    batch: Batch
    collisions: int
    share: float
    given: float


class AbandonedError(Exception):
    """The run no longer waits for a batch; the batch stores nothing."""


class Begun:
    """Batches of this process that are worth waiting for: they are or will be stored.

    These are single repeats that have events, and batches whose file is being written.

    stopped : once set, such a single repeat is stored as interrupted, and others are abandoned
    """

    def __init__(self, stopped: threading.Event) -> None:
        self.stopped = stopped
        self._batches: set[Batch] = set()
        self._lock = threading.Lock()

    def add(self, batch: Batch, *, stores: bool) -> None:
        """Note that a batch has events. Raises ``AbandonedError`` if it comes too late.

        stores : whether it will be stored even if the run is stopped now
        """
        with self._lock:
            if self.stopped.is_set() and batch not in self._batches:
                raise AbandonedError
            if stores:
                self._batches.add(batch)

    def go_on(self, *_: object) -> bool:
        """False, as a ``watch`` that never stops. Raises ``AbandonedError`` in a stopped run."""
        if self.stopped.is_set():
            raise AbandonedError
        return False

    def stop(self) -> set[Batch]:
        """Stop the run here. Returns the batches that are or will be stored."""
        with self._lock:
            self.stopped.set()
            return set(self._batches)


@dataclass(frozen=True)
class Job:
    """What all batches of one `snooker run` have in common.

    command : stored in each provenance
    interval : seconds after which a long repeat saves a checkpoint
    """

    run: RunFolder
    command: str
    interval: float = CHECKPOINT_INTERVAL

    def provenance(self, point: int, started: datetime, seconds: float) -> store.Provenance:
        """Where a batch that is stored now comes from."""
        given = self.run.by_number[point]
        return store.Provenance(
            config=to_json(given.config),
            digest=self.run.digests[point],
            parameters=json.dumps(given.as_json()),
            point=point,
            engine_version=ENGINE_VERSION,
            versions=versions(),
            machine=f"{platform.machine()} {platform.processor()}".strip(),
            command=self.command,
            started=started.isoformat(timespec="milliseconds"),
            seconds=seconds,
        )

    def limits(self, point: int, scene: Scene) -> Limits:
        """How a point's repeats are simulated and recorded.

        scene : a start of the point
        """
        config = self.run.by_number[point].config
        return Limits(
            config.collisions,
            config.time,
            not config.keeps_events,
            snapshot_times(config, scene),
        )


def simulate_and_store(
    job: Job, batch: Batch, begun: Begun, reached: Callable[[Progress], object] = lambda _: None
) -> BatchResults:
    """Simulate and store a batch; None if it was abandoned.

    begun : of the run in this process
    reached : called now and then with how far it is
    """
    if begun.stopped.is_set():
        return None
    collisions = 0

    def watch(number: int, share: float, given: float = 0.0) -> None:
        nonlocal collisions
        begun.add(batch, stores=len(batch.repeats) == 1)
        collisions += number
        reached(Progress(batch, collisions, share, given))

    scenes: dict[int, Scene] = {}
    failed: list[RepeatResult] = []
    try:
        scenes, failed = _scenes(job.run, batch)
        if len(scenes) == 1:
            ((repeat, scene),) = scenes.items()
            return [*failed, _simulated_long(job, batch, repeat, scene, begun, watch)]
        started, clock, point = datetime.now(UTC), time.perf_counter(), batch.point
        if not scenes:
            return failed
        limits = job.limits(point, next(iter(scenes.values())))
        traces = simulate_batch(
            [*scenes.values()],
            collisions=limits.collisions,
            time=limits.time,
            summary=limits.summary,
            watch=watch,
        )
        simulated = list(zip(scenes, traces, strict=True))
        begun.add(batch, stores=True)
        provenance = job.provenance(point, started, time.perf_counter() - clock)
        try:
            store.write(job.run.path(*batch), simulated, provenance)
        except UnsoundError:  # not often, so each repeat is checked only then
            simulated, unsound = _sound_parts(point, simulated, limits, begun)
            failed += unsound
            if simulated:
                store.write(job.run.path(*batch), simulated, provenance)
        return failed + [
            RepeatResult(
                point, repeat, trace.stop, trace.collisions, simultaneous=_simultaneous(trace)
            )
            for repeat, trace in simulated
        ]
    except AbandonedError:
        return None
    except (StoreError, UnsoundError) as error:
        text = refusal(error) if isinstance(error, UnsoundError) else str(error)
        return failed + [RepeatResult(batch.point, repeat, error=text) for repeat in scenes]
    except Exception as error:  # the failure of one batch does not stop the others
        return unexpected(batch, error)


def _sound_parts(
    point: int, simulated: Sequence[tuple[int, Trace]], limits: Limits, begun: Begun
) -> tuple[list[tuple[int, Trace]], list[RepeatResult]]:
    """The repeats of a batch as they can be stored, and the results of those that cannot."""
    sound, failed = [], []
    for repeat, trace in simulated:
        try:
            sound.append((repeat, sound_part(trace, limits, begun.go_on)))
        except UnsoundError as error:
            failed.append(RepeatResult(point, repeat, error=refusal(error)))
    return sound, failed


def _simulated_long(
    job: Job,
    batch: Batch,
    repeat: int,
    scene: Scene,
    begun: Begun,
    watch: Callable[[int, float, float], object],
) -> RepeatResult:
    """Simulate one repeat from its checkpoint, if there is one, and store it as it goes on.

    A checkpoint is the file of a repeat that was interrupted, with the engine's arrays. It does not
    replace an older file of this run that has more collisions. If it is damaged, or another user's,
    the repeat begins again.

    watch : called with new collisions, and what ``Progress`` has as share and given
    """
    run, point = job.run, batch.point
    path, older = run.path(*batch), run.status_of(point, repeat)
    started, seconds, checkpoint = datetime.now(UTC), 0.0, None
    if older.state is RepeatState.INTERRUPTED and older.header is not None and older.path == path:
        try:
            checkpoint = store.read_checkpoint(path)
        except StoreError as error:
            _log.warning("%s; the repeat begins again", error.problem)
    least = max(older.collisions, 0)
    reached, interval, begins = 0, job.interval, time.perf_counter()
    continued, given, limits, fault = 0, 0.0, job.limits(point, scene), ""
    if checkpoint is not None and older.header is not None:
        reached, seconds, continued = least, older.header.provenance.seconds, least
        last = older.header.stop.time
        given = float(share_done(least, last, limits.collisions, limits.time))
    due = time.monotonic() + interval
    ties = Simultaneous()

    def stops(number: int, share: float) -> bool:
        nonlocal reached
        watch(number, share, given)
        reached += number
        return begun.stopped.is_set() or (time.monotonic() >= due and reached > least)

    # Each round simulates up to a checkpoint, whose file then replaces the one before. The last
    # round ends the repeat, or stores it as interrupted. A repeat that cannot be stored begins
    # again, and ends before what is wrong.
    while True:
        with store.Recorder(path, continues=checkpoint is not None) as recorder:

            def sink(
                events: Events,
                recorder: store.Recorder = recorder,
                ties: Simultaneous = ties,
            ) -> None:
                recorder.add(events)
                ties.add(events)

            try:
                recorder.begin(scene)
                trace = simulate(
                    scene,
                    collisions=limits.collisions,
                    time=limits.time,
                    summary=limits.summary,
                    snapshots=limits.snapshots,
                    sink=sink,
                    states=recorder.add_snapshot,
                    watch=stops,
                    checkpoint=checkpoint,
                )
                interrupted = trace.stop.reason is StopReason.INTERRUPTED
                if fault and not interrupted:
                    trace = ended_before(trace, fault)
                unstored = interrupted and trace.collisions <= least
                if not unstored:
                    clock = time.monotonic()
                    recorder.end(repeat, trace)
                    now = seconds + time.perf_counter() - begins
                    recorder.finish(job.provenance(point, started, now))
                    # Saving takes a small part of the time, however long the file is.
                    interval = max(interval, SAVING_SHARE * (time.monotonic() - clock))
            except CheckpointError as error:
                _log.warning("%s; the repeat begins again", error)
            except UnsoundError as error:
                if fault:  # also in the part that was found to be sound
                    raise
                most = sound_collisions(scene, limits, begun.go_on)
                fault, limits = error.problem, replace(limits, collisions=most, time=None)
            else:
                if not interrupted or begun.stopped.is_set():
                    number = 0 if trace.stop.reason is StopReason.COLLAPSE else ties.number
                    return RepeatResult(
                        point,
                        repeat,
                        trace.stop,
                        trace.collisions,
                        simultaneous=number,
                        continued=continued,
                        unstored=unstored,
                    )
                checkpoint, due = trace.checkpoint, time.monotonic() + interval
                continue
        # It begins again.
        checkpoint, reached, seconds = None, 0, 0.0
        continued, given, ties = 0, 0.0, Simultaneous()


def _simultaneous(trace: Trace) -> int:
    """``RepeatResult.simultaneous`` of a repeat."""
    if trace.events is None or trace.stop.reason is StopReason.COLLAPSE:
        return 0
    ties = Simultaneous()
    ties.add(trace.events)
    return ties.number


def _scenes(run: RunFolder, batch: Batch) -> tuple[dict[int, Scene], list[RepeatResult]]:
    """The scenes of a batch by their repeats, and the results of those that have none."""
    point, repeats = batch
    config = run.by_number[point].config
    if len(repeats) > 1:
        with suppress(SceneError):
            return dict(zip(repeats, starting_scenes(config, repeats), strict=True)), []
    scenes, failed = {}, []
    for repeat in repeats:
        try:
            scenes[repeat] = first_scene(config, repeat)
        except SceneError as error:
            failed.append(RepeatResult(point, repeat, error=str(error)))
    return scenes, failed


def stored_result(status: RepeatStatus) -> RepeatResult | None:
    """The result of a repeat that is done already; None if it is not."""
    header = status.header
    if status.state is not RepeatState.DONE or header is None:
        return None
    return RepeatResult(status.point, status.repeat, header.stop, header.collisions, cached=True)


def unexpected(batch: Batch, error: BaseException) -> list[RepeatResult]:
    """The results of a batch with an internal error."""
    where = "".join(traceback.format_exception(error))
    text = described(error)
    return [
        RepeatResult(batch.point, repeat, error=text, traceback=where) for repeat in batch.repeats
    ]


@cache
def versions() -> str:
    """The versions of Python and the libraries that decide the numbers, as JSON."""
    libraries = {name: version(name) for name in ("numpy", "numba", "h5py")}
    own = {"python": platform.python_version(), "snooker": __version__}
    return json.dumps(own | libraries)
