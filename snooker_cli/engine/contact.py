"""Times until two balls, or a ball and the wall, touch.

Symbols: x, y relative position; u, v relative velocity w; b = x.w (negative when approaching);
w2 = |w|^2; c = |x|^2 - (contact distance)^2. The roots are written so that nothing cancels, and the
physics decides each case (docs/how-it-works.md). So overlaps by rounding never deepen (Bannerman,
Strobl, Formella & Poschel, Comput. Part. Mech. 1, 191 (2014)).
"""

import math
from collections.abc import Sequence
from fractions import Fraction

from snooker_cli.engine.jit import inlined

NEVER = math.inf


@inlined
def pair_delay(x: float, y: float, u: float, v: float, contact_squared: float) -> float:
    """Time until two balls at relative (x, y), moving at relative (u, v), touch; s, or inf."""
    b = x * u + y * v
    w2 = u * u + v * v
    c = x * x + y * y - contact_squared
    cross = x * v - y * u
    discriminant = w2 * contact_squared - cross * cross
    meets = (b < 0.0) & ((discriminant > 0.0) | (c <= 0.0))
    gap = c if c > 0.0 else 0.0
    root = math.sqrt(discriminant if discriminant > 0.0 else 1.0) - b
    delay = gap / (root if meets else 1.0)
    return delay if meets else NEVER


@inlined
def may_touch(
    x: float, y: float, u: float, v: float, padded_squared: float, twice_horizon: float
) -> bool:
    """Whether ``pair_delay`` can be up to a horizon: a cheap, necessary condition.

    padded_squared : of the contact distance, and a little more for rounding, so that D >= 0 if the
        balls meet or touch, and c <= 0 if they touch, whatever the rounding of b

    For c > 0 the delay is c / (-b + sqrt(D)) with sqrt(D) <= -b, so it is at least c / (-2b).
    Without branch, root and division, a loop over partners runs in vector registers.
    """
    b = x * u + y * v
    w2 = u * u + v * v
    c = x * x + y * y - padded_squared
    cross = x * v - y * u
    closes = b if b < 0.0 else 0.0
    return (w2 * padded_squared >= cross * cross) & (c + closes * twice_horizon <= 0.0)


@inlined
def wall_delay(x: float, y: float, u: float, v: float, reach_squared: float) -> float:
    """Time until a ball at (x, y) from the container's centre hits the wall; s, or inf at rest.

    ``reach_squared`` is (R - r)^2. A ball at the wall, or by rounding beyond it, hits now if it
    moves outwards, else it crosses a chord.
    """
    b = x * u + y * v
    w2 = u * u + v * v
    c = x * x + y * y - reach_squared
    c = c if c < 0.0 else 0.0
    root = math.sqrt(b * b - w2 * c)
    numerator = -c if b > 0.0 else root - b
    denominator = root + b if b > 0.0 else w2
    return numerator / denominator if w2 > 0.0 else NEVER


@inlined
def chord_delay(x: float, y: float, u: float, v: float) -> float:
    """Time until a ball that has just left the wall at (x, y) is back at it; s, or inf at rest."""
    b = x * u + y * v
    w2 = u * u + v * v
    inward = -b if b < 0.0 else 0.0
    return 2.0 * inward / w2 if w2 > 0.0 else NEVER


@inlined
def side_delay(
    x: float, y: float, u: float, v: float, half_width: float, half_height: float
) -> float:
    """Time until a ball at (x, y) from a box's centre hits a side; s, or inf at rest.

    The half sides are less the ball's radius. A ball at a side, or beyond it, hits it now.
    """
    across = ((half_width if u > 0.0 else -half_width) - x) / u
    along = ((half_height if v > 0.0 else -half_height) - y) / v
    across = across if u != 0.0 else NEVER
    along = along if v != 0.0 else NEVER
    earlier = across if across < along else along
    return earlier if earlier > 0.0 else 0.0


# Whether two balls ever meet: exact, for scenes in which nothing happens


def never_meet(
    ball: Sequence[float], other: Sequence[float], distance: float, period: Sequence[float]
) -> bool:
    """Whether two balls never come within a distance (m) of each other, in any image.

    ball, other : place (m), velocity (m/s) and clock (s), as a column of ``State.balls``

    Doubles are fractions, so the relative path is closed: it winds round the box a and b times.
    The images of the other ball lie on parallel lines, width height/√((a width)² + (b height)²)
    apart. The path must have the distance from the nearest two.
    """
    (xi, yi, ui, vi, ti), (xk, yk, uk, vk, tk) = (map(Fraction, row) for row in (ball, other))
    x, y, u, v = xk - uk * tk - xi + ui * ti, yk - vk * tk - yi + vi * ti, uk - ui, vk - vi
    width, height = map(Fraction, period)
    if u == v == 0:
        return True
    a, b = (u * height / (v * width)).as_integer_ratio() if v else (1, 0)
    offset, apart = x * b * height - y * a * width, width * height
    nearest = min(offset % apart, -offset % apart)
    return nearest**2 >= Fraction(distance) ** 2 * ((a * width) ** 2 + (b * height) ** 2)
