"""Compiles what most tests need, once and on two processors, before all do it at once."""

from __future__ import annotations

import gc
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

from scenes import gas

from snooker_cli.cli import RARELY
from snooker_cli.engine import replay, series, simulate
from snooker_cli.engine.compiling import COMPILED

FREE, FIXED = 20.0, None
ALIKE, MIXED, SLIDING = "alike", "mixed", "sliding"

# Container, its mass, engine, balls. Cells in a free circle are compiled for balls that differ
# only: what takes those that are all alike is marked ``long``, as is a lone ball in cells.
KINDS = (
    ("circle", FREE, "allpairs", ALIKE),
    ("circle", FIXED, "allpairs", ALIKE),
    ("circle", FREE, "allpairs", MIXED),
    ("circle", FIXED, "allpairs", MIXED),
    ("circle", FREE, "cells", MIXED),
    ("circle", FIXED, "cells", ALIKE),
    ("circle", FIXED, "allpairs", SLIDING),
    ("box", FIXED, "cells", ALIKE),
    ("periodic", FIXED, "cells", ALIKE),
    ("box", FIXED, "cells", MIXED),
    ("periodic", FIXED, "cells", MIXED),
)


def compile_kind(shape: str, mass: float | None, engine: str, balls: str) -> None:
    """Run a kind of scene for a moment, and all that reads its trace."""
    free = {} if mass is None else {"container_mass": mass}
    scene = replace(gas(shape, 60, 0.3, mixed=balls == MIXED, **free), slides=balls == SLIDING)
    simulate(scene, collisions=2, summary=True, engine=engine)
    trace = simulate(scene, collisions=2, engine=engine)
    series(trace)
    replay(trace, [0.0])


def compile_ahead() -> None:
    """Compile all kinds, each process the next one, unless this engine's are in the cache."""
    if not COMPILED:
        return
    from numba import config

    done = Path(str(config.CACHE_DIR)) / "compiled-ahead"
    if done.exists():
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        2, mp_context=context, initializer=gc.set_threshold, initargs=(RARELY,)
    ) as pool:
        list(pool.map(compile_kind, *zip(*KINDS, strict=True)))
    done.touch()
