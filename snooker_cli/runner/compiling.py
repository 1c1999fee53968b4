"""Compiling what a scene needs before threads simulate it."""

from __future__ import annotations

from dataclasses import replace

from snooker_cli.engine import simulate, specialisation
from snooker_cli.scene import Scene

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
