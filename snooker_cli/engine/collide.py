"""Moving balls to an event and colliding them there; the replay of a trace does just this."""

from __future__ import annotations

import math

from snooker_cli.engine.compiling import inlined
from snooker_cli.engine.contact import nearest_image
from snooker_cli.engine.impact import rebound, relative_change, shares
from snooker_cli.engine.layout import CLOCK, Floats, Setup, U, V, X, Y


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


@inlined
def hit_pair(
    i: int, j: int, balls: Floats, setup: Setup, masses: Floats | None, period: Floats | None
) -> float:
    """Collide balls i and j, both at the present; the impulse, kg m/s."""
    x, y = balls[X, j] - balls[X, i], balls[Y, j] - balls[Y, i]
    if period is not None:
        x, y = nearest_image(x, y, period)
    u, v = balls[U, i] - balls[U, j], balls[V, i] - balls[V, j]
    change = relative_change(x, y, u, v, setup.restitution)
    m = mass_of(setup, masses, i)
    first, second = shares(change, m, mass_of(setup, masses, j))
    balls[U, i] -= first * x
    balls[V, i] -= first * y
    balls[U, j] += second * x
    balls[V, j] += second * y
    return m * first * math.sqrt(x * x + y * y)


@inlined
def hit_side(
    i: int, balls: Floats, box: Floats, setup: Setup, radii: Floats | None, masses: Floats | None
) -> float:
    """Collide ball i with the side of the box that it moves to and is nearest; the impulse."""
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    r = radius_of(setup, radii, i)
    across = box[0] - r - (x if u > 0.0 else -x) if u != 0.0 else math.inf
    along = box[1] - r - (y if v > 0.0 else -y) if v != 0.0 else math.inf
    if across <= along:
        change = (1.0 + setup.wall_restitution) * u
        balls[U, i] -= change
    else:
        change = (1.0 + setup.wall_restitution) * v
        balls[V, i] -= change
    return float(mass_of(setup, masses, i) * abs(change))


@inlined
def hit_wall(
    i: int, now: float, balls: Floats, container: Floats | None, setup: Setup, masses: Floats | None
) -> float:
    """Collide ball i, at the present, with the wall; the impulse, kg m/s."""
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    m = mass_of(setup, masses, i)
    if container is None:
        first = rebound(x, y, u, v, setup.wall_restitution)
    else:
        age = now - container[CLOCK]
        container[X] += container[U] * age
        container[Y] += container[V] * age
        container[CLOCK] = now
        x, y, u, v = x - container[X], y - container[Y], u - container[U], v - container[V]
        change = rebound(x, y, u, v, setup.wall_restitution)
        first, second = shares(change, m, setup.container_mass)
        container[U] += second * x
        container[V] += second * y
    balls[U, i] -= first * x
    balls[V, i] -= first * y
    return abs(m * first * math.sqrt(x * x + y * y))
