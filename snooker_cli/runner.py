"""Points x repeats -> threads over the engine -> files; resumes, and tells how it goes."""

from __future__ import annotations

import json
import platform
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path

from snooker_cli import store
from snooker_cli.arrange import arrange
from snooker_cli.config import Point, digest, to_json
from snooker_cli.engine import ENGINE_VERSION, simulate, specialisation
from snooker_cli.results import Run
from snooker_cli.scene import Scene, SceneError
from snooker_cli.trace import Stop, StopReason

SLOW_START = 0.7
"""Seconds after which a first call is taken to be compiling."""


@dataclass(frozen=True)
class Outcome:
    """What became of a repeat: how it ended, or the error that kept it from ending.

    cached : it was there already, and has been checked instead of simulated
    """

    point: int
    repeat: int
    stop: Stop | None
    collisions: int
    cached: bool = False
    error: str | None = None


@dataclass(frozen=True)
class Job:
    """A repeat to do."""

    point: Point
    repeat: int


class Watcher:
    """What a run tells of itself; all methods may be called from any thread."""

    def compiling(self) -> None:
        """The engine is being compiled, once on this machine for this kind of scene."""

    def events(self, number: int) -> None:
        """So many more collisions are simulated."""

    def finished(self, outcome: Outcome) -> None:
        """A repeat has ended."""


def check_scenes(points: tuple[Point, ...]) -> None:
    """Build every point's scene once. Raises ``SceneError``, telling the point, for a bad one."""
    for point in points:
        try:
            arrange(point.experiment, 0)
        except SceneError as error:
            setting = ", ".join(f"{key}={value}" for key, value in point.parameters)
            where = f" (at the point {setting})" if setting else ""
            raise SceneError(error.key, f"{error}{where}") from None


def execute(
    run: Run, *, workers: int, watcher: Watcher, cancelled: threading.Event
) -> list[Outcome]:
    """Do what is missing of a run; every outcome, in order of point and repeat.

    workers : threads; the results' bits do not depend on it
    cancelled : once set, what is under way is saved as interrupted and nothing new begins

    An error in one repeat does not stop the others. Raises ``KeyboardInterrupt`` never: the
    caller turns signals into ``cancelled``.
    """
    outcomes: list[Outcome] = []
    jobs = []
    for job in _jobs(run):
        found = _present(run, job)
        if found is None:
            jobs.append(job)
        else:
            outcomes.append(found)
            watcher.finished(found)
    if jobs and not cancelled.is_set():
        _warm_up(jobs, watcher)
        outcomes += _pooled(run, jobs, workers, watcher, cancelled)
    return sorted(outcomes, key=lambda outcome: (outcome.point, outcome.repeat))


def _jobs(run: Run) -> Iterator[Job]:
    """Every repeat of every point."""
    for point in run.points:
        for repeat in range(run.experiment.repeats):
            yield Job(point, repeat)


def _present(run: Run, job: Job) -> Outcome | None:
    """The outcome of a repeat whose file is there, whole, and of this config and engine."""
    path = run.path(job.point.index, job.repeat)
    if not path.exists():
        return None
    try:
        stored = store.read(path)
    except store.StoreError:
        return None
    known = (stored.provenance.digest, stored.provenance.engine_version, stored.provenance.repeat)
    if known != (digest(job.point.experiment), ENGINE_VERSION, job.repeat):
        return None
    if stored.trace.stop.reason is StopReason.INTERRUPTED:
        return None
    trace = stored.trace
    return Outcome(job.point.index, job.repeat, trace.stop, trace.collisions, cached=True)


def _warm_up(jobs: list[Job], watcher: Watcher) -> None:
    """Compile, before any thread starts, what the jobs' scenes need."""
    timer = threading.Timer(SLOW_START, watcher.compiling)
    timer.start()
    seen = []
    try:
        for point in {job.point.index: job.point for job in jobs}.values():
            scene = arrange(point.experiment, 0)
            summary = point.experiment.record == "summary"
            kind = specialisation(scene, summary=summary)
            if kind not in seen:
                seen.append(kind)
                simulate(scene, collisions=1, summary=summary)
    finally:
        timer.cancel()


def _pooled(
    run: Run, jobs: list[Job], workers: int, watcher: Watcher, cancelled: threading.Event
) -> list[Outcome]:
    """The outcomes of jobs done by a pool of threads."""
    outcomes: list[Outcome] = []
    with ThreadPoolExecutor(workers) as pool:
        waiting: set[Future[Outcome | None]] = set()
        todo = iter(jobs)
        while True:
            while len(waiting) < 2 * workers and (job := next(todo, None)) is not None:
                waiting.add(pool.submit(_do, run, job, watcher, cancelled))
            if not waiting:
                return outcomes
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                outcome = future.result()
                if outcome is not None:
                    outcomes.append(outcome)
                    watcher.finished(outcome)


def _do(run: Run, job: Job, watcher: Watcher, cancelled: threading.Event) -> Outcome | None:
    """Simulate and store one repeat; None if the run was cancelled before it began."""
    if cancelled.is_set():
        return None

    def watch(events: int) -> bool:
        watcher.events(events)
        return cancelled.is_set()

    started, clock = datetime.now(UTC), time.perf_counter()
    experiment = job.point.experiment
    try:
        scene: Scene = arrange(experiment, job.repeat)
        trace = simulate(
            scene,
            collisions=experiment.collisions,
            time=experiment.time,
            summary=experiment.record == "summary",
            watch=watch,
        )
        provenance = store.Provenance(
            config=to_json(experiment),
            digest=digest(experiment),
            parameters=json.dumps(job.point.as_json()),
            point=job.point.index,
            repeat=job.repeat,
            engine_version=ENGINE_VERSION,
            versions=_versions(),
            machine=f"{platform.machine()} {platform.processor()}".strip(),
            command=" ".join([Path(sys.argv[0]).name, *sys.argv[1:]]),
            started=started.isoformat(timespec="milliseconds"),
            seconds=time.perf_counter() - clock,
        )
        store.write(run.path(job.point.index, job.repeat), trace, provenance)
    except Exception as error:  # one repeat's failure must not end the others
        return Outcome(job.point.index, job.repeat, None, 0, error=_said(error))
    return Outcome(job.point.index, job.repeat, trace.stop, trace.collisions)


def _said(error: Exception) -> str:
    """An error in a sentence: ours speak for themselves, others with their kind."""
    ours = isinstance(error, store.StoreError | SceneError)
    return str(error) if ours else f"{type(error).__name__}: {error}"


@cache
def _versions() -> str:
    """The versions of what made the numbers, as JSON."""
    names = ("snooker", "numpy", "numba", "h5py")
    return json.dumps({"python": platform.python_version(), **{n: version(n) for n in names}})
