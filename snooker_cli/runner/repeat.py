"""One repeat: arranged, simulated, watched and stored, on this machine or on another."""

from __future__ import annotations

import json
import platform
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version

from snooker_cli import store
from snooker_cli.config import to_json
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.results import Run, State
from snooker_cli.runner.kinds import arranged
from snooker_cli.runner.ledger import Job, entry
from snooker_cli.scene import SceneError
from snooker_cli.trace import Stop, StopReason, Trace, Work


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
    except (store.StoreError, SceneError) as error:
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
    there = entry(run, job, store.glance)
    longer = there.told is not None and there.told.collisions >= trace.collisions
    return longer and there.state in (State.DONE, State.SHORTER, State.INTERRUPTED)


@cache
def versions() -> str:
    """The versions of what made the numbers, as JSON."""
    names = ("snooker", "numpy", "numba", "h5py")
    return json.dumps({"python": platform.python_version(), **{n: version(n) for n in names}})
