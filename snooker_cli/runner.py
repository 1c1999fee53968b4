"""Points x repeats -> threads over the engine -> files; resumes, and tells how it goes."""

from __future__ import annotations

import json
import platform
import sys
import threading
import time
import traceback
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from snooker_cli import store
from snooker_cli.arrange import arrange
from snooker_cli.config import Experiment, Point, Rings, digest, to_json
from snooker_cli.engine import ENGINE_VERSION, simulate, specialisation
from snooker_cli.results import Run
from snooker_cli.scene import SceneError
from snooker_cli.trace import Stop, StopReason


@dataclass(frozen=True)
class Outcome:
    """What became of a repeat: how it ended, or the error that kept it from ending.

    cached : it was there already, and has been checked instead of simulated
    traceback : where an error arose that no user can have made
    """

    point: int
    repeat: int
    stop: Stop | None
    collisions: int
    cached: bool = False
    error: str | None = None
    traceback: str = ""


@dataclass(frozen=True)
class Job:
    """A repeat to do, and its point's digest."""

    point: Point
    repeat: int
    digest: str


class Watcher:
    """What a run tells of itself; all methods may be called from any thread."""

    def outdated(self, removed: list[Path], figures: bool) -> None:
        """Analyses of fewer repeats are removed; figures of them are still there or not."""

    def simulating(self, compiling: float) -> None:
        """The engine is ready, after so many seconds; simulating begins."""

    def events(self, number: int) -> None:
        """So many more collisions are simulated."""

    def finished(self, outcome: Outcome) -> None:
        """A repeat has ended."""


def check_scenes(points: tuple[Point, ...]) -> set[int]:
    """Build every scene that differs; the numbers of balls in them.

    Raises ``SceneError``, telling the point, for one that cannot exist or be repeated.
    """
    numbers = set()
    for point in _distinct(points):
        try:
            _check_repeats(point.experiment)
            numbers.add(arrange(point.experiment, 0).number)
        except SceneError as error:
            setting = ", ".join(f"{key}={value}" for key, value in point.parameters)
            where = f" (at the point {setting})" if setting else ""
            raise SceneError(error.key, f"{error}{where}") from None
    return numbers


def _check_repeats(experiment: Experiment) -> None:
    """Raise ``SceneError`` for repeats that would all be the same bits."""
    if experiment.repeats > 1 and not isinstance(experiment.balls, Rings):
        raise SceneError(
            "repeats",
            f"{experiment.repeats} repeats of balls.list would be {experiment.repeats} copies of "
            "the same bits, since its velocities are given; set repeats: 1, or give balls.rings, "
            "whose directions are random",
        )


def _distinct(points: Iterable[Point]) -> list[Point]:
    """The first of all points whose balls and container are the same and recorded alike."""
    found: dict[Any, Point] = {}
    for point in points:
        one = point.experiment
        found.setdefault((one.balls, one.container, one.record), point)
    return list(found.values())


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
        if cancelled.is_set():
            return outcomes
        found = _present(run, job)
        if found is None:
            jobs.append(job)
        else:
            outcomes.append(found)
            watcher.finished(found)
    if jobs:
        _discard_analyses(run, watcher)
        clock = time.perf_counter()
        _warm_up(jobs)
        watcher.simulating(time.perf_counter() - clock)
        outcomes += _pooled(run, jobs, workers, watcher, cancelled)
    return sorted(outcomes, key=lambda outcome: (outcome.point, outcome.repeat))


def _jobs(run: Run) -> Iterator[Job]:
    """Every repeat of every point."""
    for point in run.points:
        identity = digest(point.experiment)
        for repeat in range(run.experiment.repeats):
            yield Job(point, repeat, identity)


def _present(run: Run, job: Job) -> Outcome | None:
    """The outcome of a repeat whose file is there, whole, and of this config and engine."""
    path = run.path(job.point.index, job.repeat)
    if not path.exists():
        return None
    try:
        found = store.check(path)
    except store.StoreError:
        return None
    known = (found.provenance.digest, found.provenance.engine_version, found.provenance.repeat)
    if known != (job.digest, ENGINE_VERSION, job.repeat):
        return None
    if found.stop.reason is StopReason.INTERRUPTED:
        return None
    return Outcome(job.point.index, job.repeat, found.stop, found.collisions, cached=True)


def _discard_analyses(run: Run, watcher: Watcher) -> None:
    """Remove what has been fitted and compared without the repeats that are to come."""
    removed = run.analyses()
    for path in removed:
        path.unlink(missing_ok=True)
    figures = bool(run.figures())
    if removed or figures:
        watcher.outdated(removed, figures)


def _warm_up(jobs: list[Job]) -> None:
    """Compile, before any thread starts, what the jobs' scenes need."""
    seen = []
    for point in _distinct(job.point for job in jobs):
        scene = arrange(point.experiment, 0)
        summary = point.experiment.record == "summary"
        kind = specialisation(scene, summary=summary)
        if kind not in seen:
            seen.append(kind)
            simulate(scene, collisions=1, summary=summary)


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
        scene = arrange(experiment, job.repeat)
        path = run.path(job.point.index, job.repeat)
        with store.Recorder(path, scene) as recorder:
            trace = simulate(
                scene,
                collisions=experiment.collisions,
                time=experiment.time,
                summary=experiment.record == "summary",
                watch=watch,
                sink=recorder.add,
            )
            provenance = store.Provenance(
                config=to_json(experiment),
                digest=job.digest,
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
            recorder.finish(trace, provenance)
    except (store.StoreError, SceneError) as error:
        return Outcome(job.point.index, job.repeat, None, 0, error=str(error))
    except Exception as error:  # one repeat's failure must not end the others
        said, where = f"{type(error).__name__}: {error}", traceback.format_exc()
        return Outcome(job.point.index, job.repeat, None, 0, error=said, traceback=where)
    return Outcome(job.point.index, job.repeat, trace.stop, trace.collisions)


@cache
def _versions() -> str:
    """The versions of what made the numbers, as JSON."""
    names = ("snooker", "numpy", "numba", "h5py")
    return json.dumps({"python": platform.python_version(), **{n: version(n) for n in names}})
