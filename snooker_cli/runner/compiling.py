"""Compiling what a scene needs before it is simulated: once in a process, once on a machine."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace

from snooker_cli.engine import simulate, specialisation
from snooker_cli.engine.compiling import CACHE
from snooker_cli.scene import Scene

if sys.platform != "win32":
    import fcntl

MANY = 8192
"""Balls that are enough to compile for any number of them."""

_compiled: set[tuple[str | None, frozenset[tuple[str, bool]]]] = set()
"""What this process has compiled or loaded, by the forced engine and what is modelled."""


def compile_for(scene: Scene, engine: str | None, *, alone: bool = False) -> None:
    """Compile, or load from the cache on the disk, what simulating a scene needs.

    alone : while no other process that shares the cache does. Of many workers that begin at once,
        one then compiles and the others find it done.
    """
    models = specialisation(scene, engine=engine)
    what = engine, frozenset(models.items())
    if what in _compiled:
        return
    few = _first(MANY, scene)
    if specialisation(few, engine=engine) == models:
        scene = few
    with _alone() if alone else nullcontext():
        simulate(scene, collisions=1, summary=True, engine=engine)
    _compiled.add(what)


def _first(number: int, scene: Scene) -> Scene:
    """A scene of the first balls of another."""
    columns = ("positions", "velocities", "radii", "masses")
    return replace(scene, **{name: getattr(scene, name)[:number].copy() for name in columns})


@contextmanager
def _alone() -> Iterator[None]:
    """Wait until no other process is in here; nobody is kept out where the disk has no locks."""
    if CACHE is None or sys.platform == "win32":
        yield
        return
    descriptor = -1
    with suppress(OSError):
        CACHE.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(CACHE / "compiling.lock", os.O_RDWR | os.O_CREAT, 0o666)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if descriptor >= 0:
            os.close(descriptor)
