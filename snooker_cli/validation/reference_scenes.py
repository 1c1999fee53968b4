"""Scenes with a known exact solution: the source report's, light containers, classic problems."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.config import parse
from snooker_cli.containers import Circle
from snooker_cli.placement.places import DIGITS, cosine_and_sine
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import EPSILON, Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

RADIUS = 10.0
"""Radius of every container here, m."""


@dataclass(frozen=True)
class ReferenceScene:
    """A scene for the exact twin.

    collisions : as many are followed
    start : the scene of a repeat, or the only one
    exponent : its Lyapunov exponent, 1/event, from pairs of runs that start one rounding apart
    """

    name: str
    description: str
    collisions: int
    start: Callable[..., Scene]
    exponent: float | None = None

    @property
    def horizon(self) -> float:
        """Events until an error of one rounding is as large as its quantity, ln(1/ε)/λ."""
        return math.log(1 / EPSILON) / self.exponent if self.exponent else math.inf


def rings(
    repeat: int = 0,
    *,
    radius: float = 1.0,
    restitution: float = 1.0,
    wall_restitution: float | None = None,
    container_mass: float = 1e7,
    number: int = 3,
) -> Scene:
    """The source report's balls: on rings, at 10 m/s in random directions of each repeat."""
    experiment = parse(
        f"""
        container: {{radius: {RADIUS}, mass: {str(container_mass).replace("inf", ".inf")}}}
        balls: {{rings: {number}, radius: {radius}, speed: 10.0, ring_extent: 0.8}}
        cor: {restitution}
        wall_cor: {"null" if wall_restitution is None else wall_restitution}
        collisions: 500
        seed: 1
        """
    ).experiment
    return starting_scene(experiment, repeat)


def mixture() -> Scene:
    """The source report's balls with radii of 0.4 to 1 m, masses of 0.2 to 5 kg, and cor 0.9."""
    scene = rings(restitution=0.9, container_mass=20.0)
    return replace(
        scene,
        radii=np.linspace(1.0, 0.4, scene.number),
        masses=geometric(0.2, 5.0, scene.number),
    )


def geometric(first: float, last: float, number: int) -> NDArray[np.float64]:
    """A geometric sequence of ``number`` values from first to last, each correctly rounded.

    NumPy's ``geomspace`` rounds differently on different processors.
    """
    with localcontext() as context:
        context.prec = DIGITS
        start, ratio = Decimal(first), Decimal(last) / Decimal(first)
        powers = (ratio ** (Decimal(k) / max(number - 1, 1)) for k in range(number))
        return np.array([float(start * power) for power in powers])


Ball = tuple[float, float, float, float, float, float]
"""x, y (m), u, v (m/s), radius (m), mass (kg)."""


def fixed(balls: Sequence[Ball], restitution: float = 1.0, wall_restitution: float = 1.0) -> Scene:
    """The given balls in a fixed container."""
    table = np.array(balls, dtype=np.float64)
    return Scene(
        positions=table[:, 0:2].copy(),
        velocities=table[:, 2:4].copy(),
        radii=table[:, 4].copy(),
        masses=table[:, 5].copy(),
        container=Circle(RADIUS),
        container_mass=math.inf,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=restitution,
        wall_restitution=wall_restitution,
    )


def row() -> Scene:
    """Newton's row of five with gaps, along a diameter; the first ball moves."""
    balls = [(1.5 * k - 6.5, 0.0, 0.0 if k else 10.0, 0.0, 0.5, 1.0) for k in range(5)]
    return fixed(balls, restitution=0.9)


def galperin() -> Scene:
    """A light ball at rest between the wall and a ball 10,000 times heavier that approaches it."""
    return fixed([(-9.4, 0.0, 0.0, 0.0, 0.1, 1.0), (-8.7, 0.0, -1.0, 0.0, 0.1, 1e4)])


def along_the_wall(angle: float) -> Scene:
    """One ball of 1 m at the wall; it moves inwards at an angle to the wall, rad."""
    with localcontext() as context:
        context.prec = DIGITS
        cosine, sine = cosine_and_sine(Decimal(angle))
    return fixed([(RADIUS - 1.0, 0.0, -10.0 * float(sine), 10.0 * float(cosine), 1.0, 1.0)])


def wall_trap() -> Scene:
    """One ball that leaves a wall of restitution 0.9 at 6 m/s, and at 8 m/s along it."""
    return fixed([(RADIUS - 1.0, 0.0, -6.0, 8.0, 1.0, 1.0)], wall_restitution=0.9)


SCENES = {
    scene.name: scene
    for scene in (
        ReferenceScene("report", "the source report's scene, elastic", 500, rings, 0.041),
        ReferenceScene(
            "report-cor-0.8",
            "the source report's scene, cor 0.8",
            500,
            partial(rings, restitution=0.8),
        ),
        ReferenceScene(
            "report-fixed",
            "the source report's balls, elastic, in a fixed container",
            500,
            partial(rings, 1, container_mass=math.inf),
        ),
        ReferenceScene(
            "dilute",
            "the source report's balls with a radius of 0.1 m",
            150,
            partial(rings, radius=0.1),
            0.196,
        ),
        ReferenceScene(
            "dilute-fixed-cor-0.8",
            "balls of 0.1 m, cor 0.8, in a fixed container with an elastic wall",
            150,
            partial(
                rings, 1, radius=0.1, restitution=0.8, wall_restitution=1.0, container_mass=math.inf
            ),
        ),
        ReferenceScene(
            "mixture", "unequal radii and masses, cor 0.9, container of 20 kg", 300, mixture
        ),
        ReferenceScene(
            "light-container",
            "seven balls of 1 kg, elastic, in a container of 5 kg",
            300,
            partial(rings, number=1, container_mass=5.0),
        ),
        ReferenceScene(
            "row", "Newton's row of five, cor 0.9, and back from the elastic wall", 60, row
        ),
        ReferenceScene(
            "galperin", "Galperin's billiard with a mass ratio of 10,000", 314, galperin
        ),
        ReferenceScene(
            "whispering-gallery",
            "one elastic ball along the wall, at 0.001 rad to it",
            500,
            partial(along_the_wall, 1e-3),
        ),
        ReferenceScene(
            "star",
            "one elastic ball on a star of five corners",
            500,
            partial(along_the_wall, 0.4 * math.pi),
        ),
        ReferenceScene("wall-trap", "one ball into a wall trap, wall cor 0.9", 300, wall_trap),
    )
}
