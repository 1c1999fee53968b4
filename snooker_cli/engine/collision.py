"""Moving balls to an event and colliding them there; the replay of a trace does just this."""

from __future__ import annotations

import math

from snooker_cli.engine.contact import nearest_image
from snooker_cli.engine.jit import fused, inlined, kernel
from snooker_cli.engine.kernel_state import CLOCK, REST, SUMS, Floats, Indices, Setup, U, V, X, Y

# What then: the change of velocity in a collision.


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


@inlined
def mass_of(setup: Setup, masses: Floats | None, i: int) -> float:
    """Mass of ball i, kg."""
    if masses is None:
        return setup.mass
    return float(masses[i])


@inlined
def radius_of(setup: Setup, radii: Floats | None, i: int) -> float:
    """Radius of ball i, m."""
    if radii is None:
        return setup.radius
    return float(radii[i])


@inlined
def add_up(sums: Floats, which: int, size: float) -> None:
    """Add what is not negative to a sum, and what that rounds off to its rest.

    What is rounded off is exact if the sum was no less than what is added (Dekker's Fast2Sum).
    """
    before = sums[which]
    after = before + size
    sums[which] = after
    sums[which + REST] += size - (after - before)


@inlined
def move(i: int, now: float, balls: Floats) -> None:
    """Bring ball i to the present."""
    age = now - balls[CLOCK, i]
    balls[X, i] += balls[U, i] * age
    balls[Y, i] += balls[V, i] * age
    balls[CLOCK, i] = now


@inlined
def wrap(i: int, balls: Floats, period: Floats) -> None:
    """Bring ball i back into the periodic box."""
    balls[X, i], balls[Y, i] = nearest_image(balls[X, i], balls[Y, i], period)


@kernel
def contact_lasts(
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    labels: Indices | None,
    sums: Floats,
) -> float:
    """How long a contact lasts in the TC model at the balls' present speeds, s.

    That is a part of the mean free time, the mean free path over the root of the mean square of
    speeds relative to the container (Luding & McNamara, Granular Matter 1, 113 (1998)).

    labels : whose row is whose, if not in order; so that a sum has the same bits in any order
    """
    number = balls.shape[1]
    squares = sums[SUMS:]
    for k in range(number):
        u, v = balls[U, k], balls[V, k]
        if container is not None:
            u, v = u - container[U], v - container[V]
        place = k
        if labels is not None and len(labels) > 0:
            place = labels[k]
        squares[place] = u * u + v * v
    total = 0.0
    for k in range(number):
        total += squares[k]
    return setup.contact_path / math.sqrt(total / number) if total > 0.0 else 0.0


@inlined
def touched(i: int, now: float, balls: Floats, epoch: float, lasts: float) -> bool:
    """Whether ball i, not yet moved to the present, still has its last contact, if it had one.

    In the first epoch a clock at zero is one that has not been moved.
    """
    moved = balls[CLOCK, i] > 0.0 or epoch > 0.0
    return bool(moved and now - balls[CLOCK, i] < lasts)


@inlined
def hit_pair(
    i: int,
    j: int,
    balls: Floats,
    setup: Setup,
    masses: Floats | None,
    period: Floats | None,
    elastic: bool,
) -> float:
    """Collide balls i and j, both at the present; the impulse, kg m/s.

    elastic : without loss, however fast they are
    """
    x, y = balls[X, j] - balls[X, i], balls[Y, j] - balls[Y, i]
    if period is not None:
        x, y = nearest_image(x, y, period)
    u, v = balls[U, i] - balls[U, j], balls[V, i] - balls[V, j]
    elastic = elastic or is_slow(x, y, u, v, setup.elastic_below)
    change = relative_change(x, y, u, v, 1.0 if elastic else setup.restitution)
    m = mass_of(setup, masses, i)
    first, second = shares(change, m, mass_of(setup, masses, j))
    balls[U, i] -= first * x
    balls[V, i] -= first * y
    balls[U, j] += second * x
    balls[V, j] += second * y
    return m * first * math.sqrt(x * x + y * y)


@inlined
def hit_side(
    i: int,
    balls: Floats,
    box: Floats,
    setup: Setup,
    radii: Floats | None,
    masses: Floats | None,
    elastic: bool,
) -> float:
    """Collide ball i with the side of the box that it moves to and is nearest; the impulse.

    elastic : without loss, however fast it is
    """
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    r = radius_of(setup, radii, i)
    across = box[0] - r - (x if u > 0.0 else -x) if u != 0.0 else math.inf
    along = box[1] - r - (y if v > 0.0 else -y) if v != 0.0 else math.inf
    elastic = elastic or abs(u if across <= along else v) < setup.elastic_below
    restitution = 1.0 if elastic else setup.wall_restitution
    if across <= along:
        change = (1.0 + restitution) * u
        balls[U, i] -= change
    else:
        change = (1.0 + restitution) * v
        balls[V, i] -= change
    return float(mass_of(setup, masses, i) * abs(change))


@inlined
def hit_wall(
    i: int,
    now: float,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    elastic: bool,
) -> float:
    """Collide ball i, at the present, with the wall; the impulse, kg m/s.

    elastic : without loss, however fast it is
    """
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    m = mass_of(setup, masses, i)
    if container is None:
        elastic = elastic or is_slow(x, y, u, v, setup.elastic_below)
        first = rebound(x, y, u, v, 1.0 if elastic else setup.wall_restitution)
    else:
        age = now - container[CLOCK]
        container[X] += container[U] * age
        container[Y] += container[V] * age
        container[CLOCK] = now
        x, y, u, v = x - container[X], y - container[Y], u - container[U], v - container[V]
        elastic = elastic or is_slow(x, y, u, v, setup.elastic_below)
        change = rebound(x, y, u, v, 1.0 if elastic else setup.wall_restitution)
        first, second = shares(change, m, setup.container_mass)
        container[U] += second * x
        container[V] += second * y
    balls[U, i] -= first * x
    balls[V, i] -= first * y
    return abs(m * first * math.sqrt(x * x + y * y))
