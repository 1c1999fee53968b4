"""Compiles what most tests need, once and on two processors, before all do it at once."""

from __future__ import annotations

import gc
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from zlib import crc32

from scenes import EVERYONE, NEIGHBOURS, gas

from snooker_cli.analysis.measurement import measure
from snooker_cli.cli import COLLECT_AFTER
from snooker_cli.engine import replay, series, simulate
from snooker_cli.engine.jit import cache_folder
from snooker_cli.engine.simulation import Simulation

FREE, FIXED = 20.0, None
ALIKE, MIXED, SLIDING = "alike", "mixed", "sliding"

# Container, its mass, search, balls; tests of other types are ``long``. The slowest type is first:
# both processes then end at about the same time.
TYPES = (
    ("circle", FIXED, EVERYONE, SLIDING),
    ("circle", FREE, NEIGHBOURS, MIXED),
    ("circle", FREE, EVERYONE, ALIKE),
    ("circle", FREE, EVERYONE, MIXED),
    ("circle", FIXED, NEIGHBOURS, ALIKE),
    ("periodic", FIXED, NEIGHBOURS, ALIKE),
    ("box", FIXED, NEIGHBOURS, MIXED),
    ("circle", FIXED, EVERYONE, MIXED),
    ("circle", FIXED, EVERYONE, ALIKE),
    ("box", FIXED, NEIGHBOURS, ALIKE),
)


def compile_type(shape: str, mass: float | None, search: type[Simulation], balls: str) -> None:
    """Run a type of scene for a moment, and all that reads its trace."""
    free = {} if mass is None else {"container_mass": mass}
    scene = replace(gas(shape, 60, 0.3, mixed=balls == MIXED, **free), slides=balls == SLIDING)
    simulate(scene, collisions=2, summary=True, search=search)
    trace = simulate(scene, collisions=2, search=search)
    measure([trace])
    series(trace)
    replay(trace, [0.0])


def compile_ahead() -> None:
    """Compile all types, each process the next one, unless this engine's are in the cache."""
    folder = cache_folder()
    if folder is None:
        return
    # Numba's cache also depends on where the sources are.
    done = folder / f"compiled-ahead-{crc32(__file__.encode()):08x}"
    if done.exists():
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        2, mp_context=context, initializer=gc.set_threshold, initargs=(COLLECT_AFTER,)
    ) as pool:
        list(pool.map(compile_type, *zip(*TYPES, strict=True)))
    done.touch()
