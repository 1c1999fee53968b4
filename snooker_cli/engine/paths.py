"""Whether two balls in a periodic box can ever meet: exact, for scenes in which nothing happens."""

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeAlias

Path: TypeAlias = tuple[Fraction, Fraction, Fraction, Fraction]
"""Where a ball is when clocks show zero (m), and its velocity (m/s)."""


def straight_path(x: float, y: float, u: float, v: float, clock: float) -> Path:
    """The path of a ball that is at (x, y) when clocks show a time, s."""
    (xt, yt, right, up), time = map(Fraction, (x, y, u, v)), Fraction(clock)
    return xt - right * time, yt - up * time, right, up


def never_meet(one: Path, other: Path, distance: float, period: Sequence[float]) -> bool:
    """Whether two balls never come within a distance (m) of each other, in any image.

    Doubles are fractions, so the relative path is closed: it winds round the box a and b times.
    The images of the other ball lie on parallel lines, width height/√((a width)² + (b height)²)
    apart. The path must have the distance from the nearest two.
    """
    x, y, u, v = (theirs - ours for ours, theirs in zip(one, other, strict=True))
    width, height = map(Fraction, period)
    if u == v == 0:
        return True
    a, b = (u * height / (v * width)).as_integer_ratio() if v else (1, 0)
    offset, apart = x * b * height - y * a * width, width * height
    nearest = min(offset % apart, -offset % apart)
    return nearest**2 >= Fraction(distance) ** 2 * ((a * width) ** 2 + (b * height) ** 2)
