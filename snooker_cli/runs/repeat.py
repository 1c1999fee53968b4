"""One repeat: arranged, simulated, watched and stored, on this machine or on another."""

from __future__ import annotations

import json
import platform
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version

from snooker_cli import errors, store
from snooker_cli.config import to_json
from snooker_cli.engine import ENGINE_VERSION, simulate, specialisation
from snooker_cli.errors import SceneError
from snooker_cli.runs.plan import arranged
from snooker_cli.runs.run import Run, State
from snooker_cli.runs.status import Job, entry
from snooker_cli.scene import Scene
from snooker_cli.trace import Stop, StopReason, Trace, Work

# Compiling what a scene needs before threads simulate it.

MANY = 8192
"""Balls that are enough to compile for any number of them."""

_compiled: set[tuple[str | None, frozenset[tuple[str, bool]]]] = set()
"""What this process has compiled or loaded, by the forced engine and what is modelled."""


def compile_for(scene: Scene, engine: str | None) -> None:
    """Compile what simulating a scene needs, or load it from the cache, once in a process."""
    models = specialisation(scene, engine=engine)
    what = engine, frozenset(models.items())
    if what in _compiled:
        return
    few = _first(MANY, scene)
    if specialisation(few, engine=engine) == models:
        scene = few
    simulate(scene, collisions=1, summary=True, engine=engine)
    _compiled.add(what)


def _first(number: int, scene: Scene) -> Scene:
    """A scene of the first balls of another."""
    columns = ("positions", "velocities", "radii", "masses")
    return replace(scene, **{name: getattr(scene, name)[:number].copy() for name in columns})


@dataclass(frozen=True)
class Outcome:
    """What became of a repeat: how it ended, or the error that kept it from ending.

    cached : it was there already, and has been checked instead of simulated
    traceback : where an error arose that no user can have made
    work : what simulating it took
    unstored : it was interrupted, and its file stays as it was, which goes as far or further
    """

    point: int
    repeat: int
    stop: Stop | None
    collisions: int
    cached: bool = False
    error: str | None = None
    traceback: str = ""
    work: Work | None = None
    unstored: bool = False


class LeftError(Exception):
    """Nobody waits for a repeat any more; it writes nothing."""


def do(run: Run, job: Job, watch: Callable[[int], bool], command: str) -> Outcome | None:
    """Simulate and store one repeat; None if it was left.

    watch : called with the number of new collisions; a true answer saves what there is of it as
        interrupted, and ``LeftError`` leaves it
    command : what the file says that it was made by
    """
    started, clock = datetime.now(UTC), time.perf_counter()
    point, repeat, experiment = job.point.index, job.repeat, job.point.experiment
    try:
        scene = arranged(experiment, repeat)
        with store.Recorder(run.path(point, repeat), scene) as recorder:
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
                point=point,
                repeat=repeat,
                engine_version=ENGINE_VERSION,
                versions=versions(),
                machine=f"{platform.machine()} {platform.processor()}".strip(),
                command=command,
                started=started.isoformat(timespec="milliseconds"),
                seconds=time.perf_counter() - clock,
                engine=run.engine,
            )
            unstored = _keeps_what_is_there(run, job, trace)
            if not unstored:
                recorder.finish(trace, provenance)
    except LeftError:
        return None
    except (errors.StoreError, SceneError) as error:
        return Outcome(point, repeat, None, 0, error=str(error))
    except Exception as error:  # one repeat's failure must not end the others
        return unforeseen(point, repeat, error)
    stop, collisions = trace.stop, trace.collisions
    return Outcome(point, repeat, stop, collisions, work=trace.work, unstored=unstored)


def unforeseen(point: int, repeat: int, error: BaseException) -> Outcome:
    """The outcome of a repeat with an error that no user can have made."""
    said, where = f"{type(error).__name__}: {error}", "".join(traceback.format_exception(error))
    return Outcome(point, repeat, None, 0, error=said, traceback=where)


def _keeps_what_is_there(run: Run, job: Job, trace: Trace) -> bool:
    """Whether a repeat that was interrupted is in its place already, and as far or further."""
    if trace.stop.reason is not StopReason.INTERRUPTED:
        return False
    there = entry(run, job, store.read_header)
    longer = there.told is not None and there.told.collisions >= trace.collisions
    return longer and there.state in (State.DONE, State.SHORTER, State.INTERRUPTED)


@cache
def versions() -> str:
    """The versions of what made the numbers, as JSON."""
    names = ("snooker", "numpy", "numba", "h5py")
    return json.dumps({"python": platform.python_version(), **{n: version(n) for n in names}})
