"""Compiles what most tests need, once and on two processors, before all do it at once."""

from __future__ import annotations

import gc
import subprocess
import sys
from pathlib import Path

from scenes import gas

from snooker_cli.engine import replay, series, simulate
from snooker_cli.engine.compiling import COMPILED

RARELY = 100_000
"""Objects after which to look for garbage: a compiler and a test framework make many that stay."""

FREE, FIXED = 20.0, None
ALIKE, MIXED = False, True

# By process: container, engine, balls. What they have in common is compiled first by one of them.
SHARES = (
    [
        ("circle", FREE, "allpairs", ALIKE),
        ("circle", FREE, "allpairs", MIXED),
        ("circle", FREE, "cells", ALIKE),
        ("circle", FREE, "cells", MIXED),
        ("box", FIXED, "cells", ALIKE),
        ("box", FIXED, "cells", MIXED),
        ("periodic", FIXED, "cells", MIXED),
    ],
    [
        ("circle", FIXED, "allpairs", ALIKE),
        ("circle", FIXED, "allpairs", MIXED),
        ("circle", FIXED, "cells", ALIKE),
        ("circle", FIXED, "cells", MIXED),
        ("periodic", FIXED, "cells", ALIKE),
    ],
)


def compile_share(share: int) -> None:
    """Run each kind of scene of a share for a moment."""
    for shape, mass, engine, mixed in SHARES[share]:
        free = {} if mass is None else {"container_mass": mass}
        scene = gas(shape, 60, 0.3, mixed=mixed, **free)
        simulate(scene, collisions=2, summary=True, engine=engine)
        trace = simulate(scene, collisions=2, engine=engine)
        series(trace)
        replay(trace, [0.0])


def compile_ahead() -> None:
    """Compile all shares, each in a process of its own, unless this engine's are in the cache."""
    if not COMPILED:
        return
    from numba import config

    done = Path(str(config.CACHE_DIR)) / "compiled-ahead"
    if done.exists():
        return
    processes = [
        subprocess.Popen([sys.executable, __file__, str(share)]) for share in range(len(SHARES))
    ]
    if {process.wait() for process in processes} == {0}:
        done.touch()


if __name__ == "__main__":
    gc.set_threshold(RARELY)
    compile_share(int(sys.argv[1]))
