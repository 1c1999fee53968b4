"""What then: the change of velocity in a collision.

Only the normal relative velocity g changes, to -e g; the impulse is J = (1 + e) mu g with mu the
reduced mass. The line of centres is the offset (x, y) as it is, never an angle and never the
nominal distance.

Roundings that err to one side would, over a million events, drain or feed a ball's energy by 2e-12
of itself or more. A contact's |x|^2 is always one of a few doubles round d^2, and so would be the
error of what is done with it. Therefore
- the normal is not normalised, nor is it taken to be as long as d;
- the rounding of |x|^2, and that of the division by it, are made good;
- the heavier body's share of the change is rounded and the lighter one takes the rest, so that the
  two shares add up to one whatever the rounding of the masses' ratio.
"""

from __future__ import annotations

from snooker_cli.engine.jit import fused, inlined


@inlined
def normal_part(x: float, y: float, u: float, v: float) -> float:
    """The part of (u, v) along (x, y), as a multiple of it; rounded, all in all, once."""
    across, up = x * x, y * y
    square = across + up
    # Knuth's TwoSum: what |x|^2 is more than the rounded one.
    added = square - across
    rest = (across - (square - added)) + (up - added)
    rest += fused(x, x, -across) + fused(y, y, -up)
    along = u * x + v * y
    normal = along / square
    return normal + (fused(-normal, square, along) - normal * rest) * (1.0 / square)


@inlined
def relative_change(x: float, y: float, u: float, v: float, restitution: float) -> float:
    """Change of relative velocity as a multiple of the offset (x, y), 1/s.

    (x, y) is from the first to the second, (u, v) the first's velocity less the second's.
    """
    return (1.0 + restitution) * normal_part(x, y, u, v)


@inlined
def is_slow(x: float, y: float, u: float, v: float, speed: float) -> bool:
    """Whether the normal part of a relative velocity (u, v) at an offset (x, y) is below a speed.

    Never so if the speed is zero.
    """
    normal = u * x + v * y
    return normal * normal < speed * speed * (x * x + y * y)


@inlined
def rebound(x: float, y: float, u: float, v: float, restitution: float) -> float:
    """``relative_change`` for a ball at (x, y) from the centre that hits the wall round it, 1/s.

    It hits the wall moving outwards. At the end of a chord that is shorter than the rounding of
    its place it may seem to move inwards: then, too, the normal velocity becomes -e times its size.
    """
    normal = normal_part(x, y, u, v)
    return (1.0 + restitution if normal > 0.0 else 1.0 - restitution) * normal


@inlined
def shares(change: float, m: float, n: float) -> tuple[float, float]:
    """The change divided between masses m and n, in proportion n to m; n may be infinite."""
    if m <= n:
        second = change * (m / (m + n))
        return change - second, second
    first = change * (n / (m + n))
    return first, change - first
