"""Scenes from arrays, and simulations of them without files."""

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from snooker_cli import config as configs
from snooker_cli import engine
from snooker_cli.api.repeats import Repeat
from snooker_cli.config.models import RULE_KEYS
from snooker_cli.containers import Container
from snooker_cli.errors import UserError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene


def new_scene(
    positions: ArrayLike,
    velocities: ArrayLike,
    radii: ArrayLike,
    masses: ArrayLike = 1.0,
    *,
    container: Container,
    container_mass: float = math.inf,
    spins: ArrayLike | None = None,
    cor: float = 1.0,
    **rules: Any,
) -> Scene:
    """A scene from arrays, checked.

    positions, velocities : (*N*, 2), m and m/s, from the container's centre
    radii, masses : (*N*,) or one number, m and kg
    container : ``Circle(radius)``, ``Box(width, height)``, ``Channel(width, height)`` or
        ``PeriodicBox(width, height)``, m
    container_mass : of a circle that moves, kg
    spins : (*N*,) or one number, rad/s, of rough balls; none by default
    cor, rules : what collisions do, by the keys of a config from ``cor`` to ``collapse``

    Raises ``ConfigError`` or ``SceneError``: balls that overlap or stick out, or a wrong value.
    """
    if not isinstance(container, Container):
        raise UserError(f"container={container!r}: give Circle, Box, Channel or PeriodicBox")
    if others := sorted(rules.keys() - set(RULE_KEYS)):
        raise UserError(f"new_scene has no {others[0]}", f"it has {', '.join(RULE_KEYS)}")
    given = [positions, velocities, radii, masses, *([] if spins is None else [spins])]
    try:
        columns = [np.asarray(values, dtype=np.float64) for values in given]
        number = len(columns[0])
        columns[2:] = [np.broadcast_to(column, number) for column in columns[2:]]
        fit = number > 0 and columns[0].shape == columns[1].shape == (number, 2)
    except (TypeError, ValueError):
        fit = False
    if not fit:
        shapes = "give positions and velocities of shape (N, 2), and N or one radius and mass"
        raise UserError("the arrays do not fit each other", shapes)
    names = ("position", "velocity", "radius", "mass", "spin")
    rows = zip(*(column.tolist() for column in columns), strict=True)
    data = {
        "container": {"shape": container.name, **container.lengths, "mass": container_mass},
        "balls": {"list": [dict(zip(names, row, strict=False)) for row in rows]},
        "cor": cor,
        **rules,
        "collisions": 1,
    }
    return starting_scene(configs.load(data).config, 0)


def simulate(
    scene: Scene,
    *,
    collisions: int | None = None,
    time: float | None = None,
    summary: bool = False,
    snapshots: Sequence[float] = (),
) -> Repeat:
    """Simulate a scene until a number of collisions or a time (s), whichever comes first.

    summary : record observables on a grid of times instead of all collisions
    snapshots : times (s, ascending) at which states are recorded, for a summary

    Few inelastic balls in a periodic box drift apart and may need hours for the next collision:
    give a ``time`` too. Raises ``UserError`` without a limit, for one that is not above 0, or for a
    scene that the engine cannot simulate.
    """
    for name, limit in (("collisions", collisions), ("time", time)):
        if limit is not None and not (isinstance(limit, Real) and 0 < limit < math.inf):
            raise UserError(f"{name}={limit!r}: give a number above 0")
    if scene.wall_law.is_random and scene.wall_key is None:
        problem = (
            "a wall with a temperature draws random numbers, and the scene has no key for them"
        )
        raise UserError(problem, "give wall_key=0 or another whole number to `replace`")
    whole = None if collisions is None else math.ceil(collisions)
    try:
        limits: dict[str, Any] = {"collisions": whole, "time": time, "summary": summary}
        return Repeat(engine.simulate(scene, **limits, snapshots=snapshots))
    except ValueError as error:
        raise UserError(str(error)) from None
