"""Whether two balls in a periodic box can ever meet: exact, for scenes in which nothing happens."""

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeAlias

Numbers: TypeAlias = Sequence[float]


def never_meet(one: Numbers, other: Numbers, distance: float, period: Numbers) -> bool:
    """Whether two balls never come within a distance (m) of each other, in any image.

    one, other : place (m), velocity (m/s) and clock (s), as a column of ``State.balls``

    Doubles are fractions, so the relative path is closed: it winds round the box a and b times.
    The images of the other ball lie on parallel lines, width height/√((a width)² + (b height)²)
    apart. The path must have the distance from the nearest two.
    """
    (xi, yi, ui, vi, ti), (xk, yk, uk, vk, tk) = (map(Fraction, ball) for ball in (one, other))
    x, y, u, v = xk - uk * tk - xi + ui * ti, yk - vk * tk - yi + vi * ti, uk - ui, vk - vi
    width, height = map(Fraction, period)
    if u == v == 0:
        return True
    a, b = (u * height / (v * width)).as_integer_ratio() if v else (1, 0)
    offset, apart = x * b * height - y * a * width, width * height
    nearest = min(offset % apart, -offset % apart)
    return nearest**2 >= Fraction(distance) ** 2 * ((a * width) ** 2 + (b * height) ** 2)
