"""When each ball will next touch another ball and the wall.

Most pairs cannot meet before the ball hits the wall, and that is seen without a root or a division:
a first pass over all partners, in vector form, leaves a mask of the few that can, a bit each, and
only for those the time of contact is computed.
"""

from __future__ import annotations

import math

from snooker_cli.engine.collision import mass_of, radius_of
from snooker_cli.engine.contact import chord_delay, may_touch, pair_delay, wall_delay
from snooker_cli.engine.jit import inlined, kernel, lowest_bit
from snooker_cli.engine.kernel_state import (
    CLOCK,
    NEXT_TIME,
    PAIR_TIME,
    WALL_TIME,
    Floats,
    Integers,
    Setup,
    U,
    V,
    X,
    Y,
)
from snooker_cli.engine.sliding import place

# Balls of a mask: below the sign bit of an integer, and a multiple of any vector's length.
BLOCK = 48


@inlined
def contact_distance(setup: Setup, radii: Floats | None, i: int, k: int) -> float:
    """Distance of the centres of two balls that touch, m."""
    if radii is None:
        return 2.0 * setup.radius
    return float(radii[i] + radii[k])


@inlined
def wall_reach(setup: Setup, radii: Floats | None, i: int) -> float:
    """Largest distance of a ball's centre from the container's, m."""
    return setup.container_radius - radius_of(setup, radii, i)


@inlined
def candidates(
    i: int,
    now: float,
    horizon: float,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
    start: int,
    stop: int,
) -> int:
    """The balls from ``start`` to ``stop`` that may touch ball i within ``horizon``, a bit each."""
    age = now - balls[CLOCK, i]
    u, v = balls[U, i], balls[V, i]
    x, y = balls[X, i] + u * age, balls[Y, i] + v * age
    twice = 2.0 * horizon
    mask = 0
    for k in range(start, stop):
        d = contact_distance(setup, radii, i, k)
        age = now - balls[CLOCK, k]
        uk, vk = balls[U, k], balls[V, k]
        xk, yk = balls[X, k] + uk * age, balls[Y, k] + vk * age
        may = may_touch(xk - x, yk - y, uk - u, vk - v, d * d, twice)
        mask |= 1 << (k - start) if may else 0
    return mask


@inlined
def candidates_of_two(
    i: int,
    j: int,
    now: float,
    horizon_i: float,
    horizon_j: float,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
    start: int,
    stop: int,
) -> tuple[int, int]:
    """``candidates`` of two balls whose clocks are at ``now``, in one pass over the others."""
    xi, yi, ui, vi = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    xj, yj, uj, vj = balls[X, j], balls[Y, j], balls[U, j], balls[V, j]
    twice_i, twice_j = 2.0 * horizon_i, 2.0 * horizon_j
    mask_i, mask_j = 0, 0
    for k in range(start, stop):
        di = contact_distance(setup, radii, i, k)
        dj = contact_distance(setup, radii, j, k)
        age = now - balls[CLOCK, k]
        u, v = balls[U, k], balls[V, k]
        x, y = balls[X, k] + u * age, balls[Y, k] + v * age
        may_i = may_touch(x - xi, y - yi, u - ui, v - vi, di * di, twice_i)
        may_j = may_touch(x - xj, y - yj, u - uj, v - vj, dj * dj, twice_j)
        bit = 1 << (k - start)
        mask_i |= bit if may_i else 0
        mask_j |= bit if may_j else 0
    return mask_i, mask_j


@inlined
def without(mask: int, start: int, k: int) -> int:
    """The mask of balls from ``start`` on, less ball k."""
    if start <= k < start + BLOCK:
        return mask & ~(1 << (k - start))
    return mask


@inlined
def earliest(
    mask: int,
    start: int,
    i: int,
    now: float,
    delay: float,
    whom: int,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
) -> tuple[float, int]:
    """Of the balls in the mask the one that ball i touches first, if before ``delay``, and when."""
    age = now - balls[CLOCK, i]
    u, v = balls[U, i], balls[V, i]
    x, y = balls[X, i] + u * age, balls[Y, i] + v * age
    while mask != 0:
        k = start + lowest_bit(mask)
        mask &= mask - 1
        d = contact_distance(setup, radii, i, k)
        age = now - balls[CLOCK, k]
        its_delay = pair_delay(
            balls[X, k] + balls[U, k] * age - x,
            balls[Y, k] + balls[V, k] * age - y,
            balls[U, k] - u,
            balls[V, k] - v,
            d * d,
        )
        if its_delay < delay:
            delay, whom = its_delay, k
    return delay, whom


@inlined
def predict_wall(
    i: int,
    now: float,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
) -> float:
    """Time until ball i will hit the wall, s; when that is goes into the agenda."""
    reach = wall_reach(setup, radii, i)
    age = now - balls[CLOCK, i]
    u, v = balls[U, i], balls[V, i]
    x, y = balls[X, i] + u * age, balls[Y, i] + v * age
    if container is not None:
        age = now - container[CLOCK]
        x -= container[X] + container[U] * age
        y -= container[Y] + container[V] * age
        u -= container[U]
        v -= container[V]
    delay = wall_delay(x, y, u, v, reach * reach)
    agenda[WALL_TIME, i] = now + delay
    return delay


@inlined
def predict_walls(
    now: float,
    balls: Floats,
    container: Floats,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
) -> None:
    """``predict_wall`` for all balls: the container's clock is at ``now``, its velocity is new."""
    xc, yc, uc, vc = container[X], container[Y], container[U], container[V]
    for k in range(balls.shape[1]):
        age = now - balls[CLOCK, k]
        u, v = balls[U, k], balls[V, k]
        x, y = balls[X, k] + u * age, balls[Y, k] + v * age
        reach = wall_reach(setup, radii, k)
        time = now + wall_delay(x - xc, y - yc, u - uc, v - vc, reach * reach)
        agenda[WALL_TIME, k] = time
        agenda[NEXT_TIME, k] = min(time, agenda[PAIR_TIME, k])


@inlined
def predict_return(
    i: int, now: float, balls: Floats, container: Floats | None, agenda: Floats
) -> float:
    """``predict_wall`` for a ball that has just hit the wall."""
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    if container is not None:
        x, y, u, v = x - container[X], y - container[Y], u - container[U], v - container[V]
    delay = chord_delay(x, y, u, v)
    agenda[WALL_TIME, i] = now + delay
    return delay


@kernel
def top_speed(balls: Floats, setup: Setup, masses: Floats | None) -> float:
    """The speed of the lightest ball if it had all the energy, m/s: none can become faster."""
    energy, lightest = 0.0, math.inf
    for k in range(balls.shape[1]):
        m = mass_of(setup, masses, k)
        energy += m * (balls[U, k] * balls[U, k] + balls[V, k] * balls[V, k])
        lightest = min(lightest, m)
    return math.sqrt(energy / lightest)


@inlined
def never_elastic(setup: Setup) -> bool:
    """Whether every collision loses its share, so that infinitely many may follow each other."""
    return setup.contact_path == 0.0 and setup.elastic_below == 0.0


@kernel
def is_trapped(
    i: int,
    now: float,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    radii: Floats | None,
    masses: Floats | None,
    next_time: Floats | None,
    patient: bool,
    slides: Integers | None,
) -> bool:
    """Whether ball i, just off the wall, will hit it infinitely often before anything else.

    Each bounce keeps the tangential speed v_t and multiplies the normal one v_n by the wall's
    restitution e, so that the chords last 2 a e^k v_n / (e^2k v_n^2 + v_t^2); without the first
    term below, their sum is geometric: 2 a v_n / ((1 - e) v_t^2) is an upper bound of the time
    left. The ball is trapped if within it the run does not end, no other event is due and no ball
    can come near: the others move straight, or slide, and ball i is never faster than now.

    All this is relative to the container. A free one is pushed by the bounces, by no more than
    its share of (1 + e) v_n / (1 - e) together, and the others must not reach its wall either.

    Without patience, or knowledge of the others' next events, they may have some; none is then
    faster than all the energy in one ball, which in a fixed container never grows.
    """
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    if container is not None:
        x, y, u, v = x - container[X], y - container[Y], u - container[U], v - container[V]
    inward = max(-(x * u + y * v), 0.0)  # a v_n
    cross = x * v - y * u  # a v_t
    if cross == 0.0:
        return False
    left = 2.0 * inward * (x * x + y * y) / ((1.0 - setup.wall_restitution) * cross * cross)
    end = now + left
    if end > setup.time_limit:
        return False
    wall_speed = 0.0
    if container is not None:
        m = mass_of(setup, masses, i)
        pushes = (1.0 + setup.wall_restitution) / (1.0 - setup.wall_restitution)
        pushes *= inward / math.sqrt(x * x + y * y) * (m / (m + setup.container_mass))
        wall_speed = pushes + math.sqrt(container[U] * container[U] + container[V] * container[V])
    speed = math.sqrt(u * u + v * v) + wall_speed
    fastest = 0.0 if patient else top_speed(balls, setup, masses)
    for k in range(balls.shape[1]):
        if k != i:
            if next_time is not None:
                due = next_time[k] <= end
                if patient and due:
                    return False
            xk, yk = place(k, now, balls, slides)
            its_speed = fastest
            if patient:
                its_speed = math.sqrt(balls[U, k] * balls[U, k] + balls[V, k] * balls[V, k])
            x, y = xk - balls[X, i], yk - balls[Y, i]
            gap = math.sqrt(x * x + y * y) - contact_distance(setup, radii, i, k)
            if gap <= (speed + its_speed) * left:
                return False
            if container is not None:
                x, y = xk - container[X], yk - container[Y]
                gap = wall_reach(setup, radii, k) - math.sqrt(x * x + y * y)
                if gap <= (wall_speed + its_speed) * left:
                    return False
    return True
