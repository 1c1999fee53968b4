"""Compile what types of scenes need: before a run, beside it, or for all of some configs."""

import logging
import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from functools import lru_cache

import numpy as np

from snooker_cli.config import Config
from snooker_cli.engine import replay, series, simulate
from snooker_cli.engine.compilation import COMPILATION
from snooker_cli.engine.jit import cache_folder
from snooker_cli.errors import RunError, SceneError, UserError
from snooker_cli.runs.plan import first_scene
from snooker_cli.runs.processes import Processes, processors
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Stop, StopReason, Trace

BESIDE = True
"""Whether a run compiles the kernels of analyses beside its own."""

LOW_PRIORITY = 10


@lru_cache(maxsize=1024)
def compile_for(config: Config) -> None:
    """Compile what simulating a point needs, or load it from the cache, once in a process.

    If its balls have no place, nothing is compiled: the simulation will report that.
    """
    with suppress(SceneError):
        summary = not config.keeps_events
        simulate(first_scene(config, 0), collisions=1, summary=summary)


def compile_for_analyses(config: Config) -> None:
    """Compile what `fit` and `compare` need of a point, without the kernel that simulates it."""
    if not config.keeps_events:
        return
    with suppress(SceneError):
        series(without_events(first_scene(config, 0)))


def compile_for_states(config: Config) -> None:
    """Compile what figures, films and exports need for states between collisions."""
    if not config.keeps_events:
        return
    with suppress(SceneError):
        replay(without_events(first_scene(config, 0)), [0.0])


def without_events(scene: Scene) -> Trace:
    """A repeat that ended at its start: the types of its arrays are those of any other."""
    indices = np.zeros(0, dtype=np.int32)
    spins = None if scene.surface is None else np.zeros(0)
    events = Events(np.zeros(0), indices, indices, np.zeros(0), spins)
    return Trace(scene, scene, Stop(StopReason.TIME, 0.0, (), ""), 0, 0, events, None)


STEPS = (compile_for, compile_for_analyses, compile_for_states)


def compiled_steps(scenes: Sequence[Config]) -> Iterator[int]:
    """Compile all that runs and their analyses need, on all processors.

    scenes : of each type of scene an experiment

    Gives the number of steps first, and then a number for each step that is done. Raises
    ``UserError`` if there is no cache of kernels, and ``RunError`` if processes cannot work.
    """
    if cache_folder() is None:
        raise UserError(
            "compiled code cannot be stored",
            "set NUMBA_CACHE_DIR to a folder with space that only you can write to",
        )
    calls = [(step, scene) for step in STEPS for scene in scenes]
    yield len(calls)
    pool = Processes(min(processors(), len(calls)))
    try:
        waiting = [pool.submit(step, scene) for step, scene in calls]
        for number, future in enumerate(waiting, 1):
            future.result()
            yield number
    except BrokenProcessPool:
        raise RunError(
            "the system ended a process that compiles, perhaps for lack of memory",
            "close other programs, and run the same command again",
        ) from None
    finally:
        _end(pool)


@contextmanager
def compiling_beside(scenes: Iterable[Config]) -> Iterator[None]:
    """Inside, a second process compiles the kernels of `fit` and `compare` for some scenes.

    It begins when this process begins to compile, at low priority, and ends with the block: no
    command leaves a process behind. It says nothing; what it cannot do, `fit` will do.
    """
    kept = [scene for scene in scenes if scene.keeps_events]
    pools: list[Processes] = []

    def begin(done: int, _total: int) -> bool:
        if done == 0 and not pools:
            with suppress(RunError, OSError):
                pools.append(Processes(1, _begin_beside))
                for scene in kept:
                    pools[0].submit(compile_for_analyses, scene)
        return False

    wanted = BESIDE and processors() > 1 and kept
    if wanted:
        COMPILATION.watchers.append(begin)
    try:
        yield
    finally:
        if wanted:
            COMPILATION.watchers.remove(begin)
        while pools:
            _end(pools.pop())


def _end(pool: Processes) -> None:
    """End processes, and wait until what they share is gone: an exit would warn of it."""
    pool.kill()
    pool.shutdown(cancel_futures=True)


def _begin_beside() -> None:
    logging.disable()
    if hasattr(os, "nice"):
        os.nice(LOW_PRIORITY)
