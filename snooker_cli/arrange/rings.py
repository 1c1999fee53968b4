"""Rings of balls: their places, from regular polygons whose corners are correctly rounded.

The library's sin and cos differ by a rounding between machines, so angles are taken from 40-digit
decimals.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.scene import SceneError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.config import Rings

DIGITS = 40
PI = Decimal("3.1415926535897932384626433832795028841971693993751")


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
        cosine, sine = cosine_and_sine(2 * PI / corners)
        x, y = Decimal(1), Decimal(0)
        points = []
        for _ in range(corners):
            points.append((float(round(x, DIGITS - 5)), float(round(y, DIGITS - 5))))
            x, y = x * cosine - y * sine, x * sine + y * cosine
    return tuple(points)


def cosine_and_sine(angle: Decimal) -> tuple[Decimal, Decimal]:
    """Their Taylor series, to the context's precision, for an angle up to 2 pi."""
    term, parts = Decimal(1), [Decimal(0), Decimal(0)]
    order = 0
    while order < 8 or abs(term) > Decimal(10) ** -(DIGITS + 5):
        sign = 1 if order % 4 < 2 else -1
        parts[order % 2] += sign * term
        order += 1
        term = term * angle / order
    return parts[0], parts[1]


def check_rings(balls: Rings, container_radius: float) -> None:
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
