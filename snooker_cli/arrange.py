"""A point of an experiment and a repeat -> the scene it starts from, in the same bits everywhere.

The library's sin and cos differ by a rounding between machines, so angles of rings are taken
from 40-digit decimals and random directions from points in the unit disc.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.config import Experiment, Rings
from snooker_cli.scene import Scene, SceneError, check

if TYPE_CHECKING:
    from numpy.typing import NDArray

DIGITS = 40
PI = Decimal("3.1415926535897932384626433832795028841971693993751")


def arrange(experiment: Experiment, repeat: int) -> Scene:
    """The start of a repeat of a point.

    The same repeat has the same random directions at every point of a sweep (common random
    numbers). Raises ``SceneError`` if balls overlap or stick out of the container.
    """
    balls, container = experiment.balls, experiment.container
    if isinstance(balls, Rings):
        positions = ring_positions(balls.rings, balls.ring_extent * container.radius)
        number = len(positions)
        velocities = balls.speed * random_directions(number, experiment.seed, repeat)
        radii, masses = np.full(number, balls.radius), np.full(number, balls.mass)
        _check_rings(balls, container.radius)
    else:
        positions = np.array([ball.position for ball in balls.list])
        velocities = np.array([ball.velocity for ball in balls.list])
        radii = np.array([ball.radius for ball in balls.list])
        masses = np.array([ball.mass for ball in balls.list])
    scene = Scene(
        positions=positions,
        velocities=velocities,
        radii=radii,
        masses=masses,
        container_radius=container.radius,
        container_mass=container.mass,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=experiment.cor,
        wall_restitution=experiment.effective_wall_cor,
    )
    check(scene)
    return scene


def ring_positions(rings: int, extent: float) -> NDArray[np.float64]:
    """One ball at the centre and 6k on ring k of n, at k/n of ``extent``; (*N*, 2), m."""
    positions = [(0.0, 0.0)]
    for ring in range(1, rings + 1):
        radius = ring / rings * extent
        positions += [(radius * x, radius * y) for x, y in unit_polygon(6 * ring)]
    return np.array(positions)


@cache
def unit_polygon(corners: int) -> tuple[tuple[float, float], ...]:
    """The corners of a regular polygon on the unit circle, each coordinate correctly rounded."""
    with localcontext() as context:
        context.prec = DIGITS
        cosine, sine = _cosine_and_sine(2 * PI / corners)
        x, y = Decimal(1), Decimal(0)
        points = []
        for _ in range(corners):
            points.append((float(round(x, DIGITS - 5)), float(round(y, DIGITS - 5))))
            x, y = x * cosine - y * sine, x * sine + y * cosine
    return tuple(points)


def _cosine_and_sine(angle: Decimal) -> tuple[Decimal, Decimal]:
    """Their Taylor series, to the context's precision, for an angle up to 2 pi."""
    term, parts = Decimal(1), [Decimal(0), Decimal(0)]
    order = 0
    while order < 8 or abs(term) > Decimal(10) ** -(DIGITS + 5):
        sign = 1 if order % 4 < 2 else -1
        parts[order % 2] += sign * term
        order += 1
        term = term * angle / order
    return parts[0], parts[1]


def random_directions(number: int, seed: int, repeat: int) -> NDArray[np.float64]:
    """Random unit vectors, (*number*, 2): points in an annulus of the unit disc, normalised.

    Built on PCG64's raw 64-bit output, whose stream NumPy guarantees for ever.
    """
    generator = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(repeat,)))
    found: list[NDArray[np.float64]] = []
    missing = number
    while missing > 0:
        raw = generator.random_raw(2 * (missing + missing // 2 + 8))
        points = ((raw >> np.uint64(11)).astype(np.float64) * 2.0**-52 - 1.0).reshape(-1, 2)
        squares = points[:, 0] ** 2 + points[:, 1] ** 2
        inside = points[(squares > 0.0625) & (squares <= 1.0)][:missing]
        found.append(inside / np.sqrt(inside[:, :1] ** 2 + inside[:, 1:] ** 2))
        missing -= len(inside)
    return np.concatenate(found) if found else np.empty((0, 2))


def _check_rings(balls: Rings, container_radius: float) -> None:
    """Raise ``SceneError`` where the rings are too tight, with the radius that would fit."""
    if balls.rings == 0:
        return
    extent = balls.ring_extent * container_radius
    spacing = extent / balls.rings
    largest = min(spacing / 2, container_radius - extent)
    if balls.radius > largest * (1 + 1e-12):
        raise SceneError(
            "balls.radius",
            f"{balls.rings} rings within {balls.ring_extent:g} of the container's radius are "
            f"{spacing:.6g} m apart and leave {container_radius - extent:.6g} m to the wall, too "
            f"tight for balls of radius {balls.radius:.6g} m; the largest radius that fits is "
            f"{largest!r} m",
        )
