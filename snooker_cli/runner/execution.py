"""Doing what is missing of a run: checked, compiled for, simulated and stored, in threads."""

from __future__ import annotations

import json
import platform
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path

from snooker_cli import store
from snooker_cli.config import to_json
from snooker_cli.engine import ENGINE_VERSION, simulate, specialisation
from snooker_cli.results import Run, State, forget_failures, note_failure
from snooker_cli.runner.kinds import alike, arranged
from snooker_cli.runner.ledger import Job, entry, jobs
from snooker_cli.runner.threads import Threads
from snooker_cli.scene import Scene, SceneError
from snooker_cli.store import Told
from snooker_cli.trace import Stop, StopReason, Trace, Work

MANY = 8192
"""Balls that are enough to compile for any number of them."""


@dataclass(frozen=True)
class Outcome:
    """What became of a repeat: how it ended, or the error that kept it from ending.

    cached : it was there already, and has been checked instead of simulated
    traceback : where an error arose that no user can have made
    work : what simulating it took
    """

    point: int
    repeat: int
    stop: Stop | None
    collisions: int
    cached: bool = False
    error: str | None = None
    traceback: str = ""
    work: Work | None = None


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
    run: Run, *, workers: int, watcher: Watcher, cancelled: threading.Event
) -> list[Outcome]:
    """Do what is missing of a run; every outcome, in order of point and repeat.

    workers : threads; the results' bits do not depend on it
    cancelled : once set, what is simulated is saved as interrupted; nothing else is waited for

    An error in one repeat does not stop the others. Raises ``KeyboardInterrupt`` never: the
    caller turns signals into ``cancelled``.
    """
    outcomes: list[Outcome] = []
    there: list[Job] = []
    missing: list[Job] = []
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
            _discard_analyses(run, watcher)
            clock = time.perf_counter()
            for _ in threads.each(lambda what, _: _warm_up(what, run.engine), [missing]):
                watcher.simulating(time.perf_counter() - clock)

        def do(job: Job, keep: Callable[[], bool]) -> Outcome | None:
            return _do(run, job, watcher, cancelled, keep)

        for outcome in threads.each(do, missing):
            if outcome is not None:
                if outcome.error:
                    note_failure(run, outcome.point, outcome.repeat, outcome.error)
                outcomes.append(outcome)
                watcher.finished(outcome)
    return sorted(outcomes, key=lambda outcome: (outcome.point, outcome.repeat))


def _cached(job: Job, told: Told) -> Outcome:
    """The outcome of a repeat that is there."""
    return Outcome(job.point.index, job.repeat, told.stop, told.collisions, cached=True)


def _discard_analyses(run: Run, watcher: Watcher) -> None:
    """Remove what has been fitted and compared without the repeats that are to come."""
    removed = run.analyses()
    for path in removed:
        path.unlink(missing_ok=True)
    figures = bool(run.figures())
    if removed or figures:
        watcher.outdated(removed, figures)


def _warm_up(missing: list[Job], engine: str | None) -> None:
    """Compile, before any repeat starts, what the jobs' scenes need."""
    seen = []
    for same in alike(job.point for job in missing).values():
        scene = arranged(same[0].experiment, 0)
        models = specialisation(scene, engine=engine)
        if models in seen:
            continue
        seen.append(models)
        few = _first(MANY, scene)
        if specialisation(few, engine=engine) == models:
            scene = few
        simulate(scene, collisions=1, summary=True, engine=engine)


def _first(number: int, scene: Scene) -> Scene:
    """A scene of the first balls of another."""
    columns = ("positions", "velocities", "radii", "masses")
    return replace(scene, **{name: getattr(scene, name)[:number].copy() for name in columns})


class _LeftError(Exception):
    """Nobody waits for a repeat any more."""


def _do(
    run: Run,
    job: Job,
    watcher: Watcher,
    cancelled: threading.Event,
    keep: Callable[[], bool],
) -> Outcome | None:
    """Simulate and store one repeat; None if the run was cancelled before it began.

    keep : tells that there is something to save; false if nobody waits for it any more
    """
    if cancelled.is_set():
        return None

    def watch(events: int) -> bool:
        if not keep():
            raise _LeftError
        watcher.events(events)
        return cancelled.is_set()

    started, clock = datetime.now(UTC), time.perf_counter()
    experiment = job.point.experiment
    try:
        scene = arranged(experiment, job.repeat)
        path = run.path(job.point.index, job.repeat)
        with store.Recorder(path, scene) as recorder:
            trace = simulate(
                scene,
                collisions=experiment.collisions,
                time=experiment.time,
                summary=experiment.record == "summary",
                watch=watch,
                sink=recorder.add,
                engine=run.engine,
            )
            provenance = store.Provenance(
                config=to_json(experiment),
                digest=job.digest,
                parameters=json.dumps(job.point.as_json()),
                point=job.point.index,
                repeat=job.repeat,
                engine_version=ENGINE_VERSION,
                versions=versions(),
                machine=f"{platform.machine()} {platform.processor()}".strip(),
                command=" ".join([Path(sys.argv[0]).name, *sys.argv[1:]]),
                started=started.isoformat(timespec="milliseconds"),
                seconds=time.perf_counter() - clock,
                engine=run.engine,
            )
            if not _keeps_what_is_there(run, job, trace):
                recorder.finish(trace, provenance)
    except _LeftError:
        return None
    except (store.StoreError, SceneError) as error:
        return Outcome(job.point.index, job.repeat, None, 0, error=str(error))
    except Exception as error:  # one repeat's failure must not end the others
        said, where = f"{type(error).__name__}: {error}", traceback.format_exc()
        return Outcome(job.point.index, job.repeat, None, 0, error=said, traceback=where)
    return Outcome(job.point.index, job.repeat, trace.stop, trace.collisions, work=trace.work)


def _keeps_what_is_there(run: Run, job: Job, trace: Trace) -> bool:
    """Whether a repeat that was interrupted is in its place already, and as far or further."""
    if trace.stop.reason is not StopReason.INTERRUPTED:
        return False
    there = entry(run, job, store.glance)
    longer = there.told is not None and there.told.collisions >= trace.collisions
    return longer and there.state in (State.SHORTER, State.INTERRUPTED)


@cache
def versions() -> str:
    """The versions of what made the numbers, as JSON."""
    names = ("snooker", "numpy", "numba", "h5py")
    return json.dumps({"python": platform.python_version(), **{n: version(n) for n in names}})
