"""Simulate one repeat and store it, on this machine or on another."""

from __future__ import annotations

import json
import platform
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version

from snooker_cli import __version__, store
from snooker_cli.config import to_json
from snooker_cli.engine import ENGINE_VERSION, simulate, specialisation
from snooker_cli.errors import SceneError, StoreError
from snooker_cli.runs.plan import first_scene
from snooker_cli.runs.run import RepeatStatus, Run, State
from snooker_cli.scene import Scene
from snooker_cli.trace import Stop, StopReason, Work

_compiled: set[tuple[str | None, frozenset[tuple[str, bool]]]] = set()
"""What this process has compiled or loaded, by the chosen engine and what is modelled."""


def compile_for(scene: Scene, engine: str | None) -> None:
    """Compile what simulating a scene needs, or load it from the cache, once in a process."""
    models = specialisation(scene, engine=engine)
    key = engine, frozenset(models.items())
    if key in _compiled:
        return
    simulate(scene, collisions=1, summary=True, engine=engine)
    _compiled.add(key)


@dataclass(frozen=True)
class RepeatResult:
    """How a repeat ended: its stop, or the error that prevented it.

    point, repeat : their numbers
    cached : its file existed and was checked instead
    traceback : of an internal error
    work : what simulating it took
    unstored : it was interrupted, and its older file, which is as long or longer, was kept
    """

    point: int
    repeat: int
    stop: Stop | None = None
    collisions: int = 0
    cached: bool = False
    error: str | None = None
    traceback: str = ""
    work: Work | None = None
    unstored: bool = False


class AbandonedError(Exception):
    """The run no longer waits for a repeat; the repeat stores nothing."""


class Begun:
    """The repeats of a run that have events in this process, so that they are worth storing.

    stopped : once set, they are stored as interrupted, and all others are abandoned
    """

    def __init__(self, stopped: threading.Event) -> None:
        self.stopped = stopped
        self._items: set[tuple[int, int]] = set()
        self._lock = threading.Lock()

    def add(self, item: tuple[int, int]) -> None:
        """Note that a repeat has events. Raises ``AbandonedError`` if it comes too late."""
        with self._lock:
            if self.stopped.is_set() and item not in self._items:
                raise AbandonedError
            self._items.add(item)

    def stop(self) -> set[tuple[int, int]]:
        """Stop the run here. Returns the repeats that are or will be stored."""
        with self._lock:
            self.stopped.set()
            return set(self._items)


def simulate_repeat(
    run: Run,
    item: tuple[int, int],
    begun: Begun,
    command: str,
    events: Callable[[int], object] = lambda _: None,
) -> RepeatResult | None:
    """Simulate and store one repeat; None if it was abandoned.

    item : numbers of point and repeat
    begun : of the run in this process
    command : stored in its provenance
    events : called with the number of new collisions
    """
    if begun.stopped.is_set():
        return None

    def watch(number: int) -> bool:
        begun.add(item)
        events(number)
        return begun.stopped.is_set()

    point, repeat = item
    started, clock = datetime.now(UTC), time.perf_counter()
    experiment = run.points[point].experiment
    try:
        scene = first_scene(experiment, repeat)
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
                digest=run.digests[point],
                parameters=json.dumps(run.points[point].as_json()),
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
            interrupted = trace.stop.reason is StopReason.INTERRUPTED
            unstored = interrupted and _holds_longer(run, point, repeat, trace.collisions)
            if not unstored:
                recorder.finish(trace, provenance)
    except AbandonedError:
        return None
    except (StoreError, SceneError) as error:
        return RepeatResult(point, repeat, error=str(error))
    except Exception as error:  # the failure of one repeat does not stop the others
        return unexpected(point, repeat, error)
    return RepeatResult(
        point, repeat, trace.stop, trace.collisions, work=trace.work, unstored=unstored
    )


def cached(status: RepeatStatus) -> RepeatResult | None:
    """The result of a repeat that is done already; None if it is not."""
    header = status.header
    if status.state is not State.DONE or header is None:
        return None
    return RepeatResult(status.point, status.repeat, header.stop, header.collisions, cached=True)


def unexpected(point: int, repeat: int, error: BaseException) -> RepeatResult:
    """The result of a repeat with an internal error."""
    where = "".join(traceback.format_exception(error))
    return RepeatResult(point, repeat, error=f"{type(error).__name__}: {error}", traceback=where)


def _holds_longer(run: Run, point: int, repeat: int, collisions: int) -> bool:
    """Whether a repeat's file is of this run and as long or longer."""
    status = run.repeat_status(point, repeat, store.read_header)
    usable = status.state in (State.DONE, State.SHORTER, State.INTERRUPTED)
    return usable and status.header is not None and status.header.collisions >= collisions


@cache
def versions() -> str:
    """The versions of Python and the libraries that decide the numbers, as JSON."""
    libraries = {name: version(name) for name in ("numpy", "numba", "h5py")}
    own = {"python": platform.python_version(), "snooker": __version__}
    return json.dumps(own | libraries)
