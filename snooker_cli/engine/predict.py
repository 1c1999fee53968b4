"""When each ball will next touch another ball and the wall, for all partners in vector form."""

from __future__ import annotations

import math

from snooker_cli.engine.collide import mass_of
from snooker_cli.engine.compiling import compiled
from snooker_cli.engine.contact import chord_delay, pair_delay, wall_delay
from snooker_cli.engine.layout import (
    CLOCK,
    PAIR_TIME,
    WALL_TIME,
    Floats,
    Setup,
    U,
    V,
    X,
    Y,
)


@compiled
def contact_distance(setup: Setup, radii: Floats | None, i: int, k: int) -> float:
    """Distance of the centres of two balls that touch, m."""
    if radii is None:
        return 2.0 * setup.radius
    return float(radii[i] + radii[k])


@compiled
def wall_reach(setup: Setup, radii: Floats | None, i: int) -> float:
    """Largest distance of a ball's centre from the container's, m."""
    if radii is None:
        return setup.container_radius - setup.radius
    return setup.container_radius - float(radii[i])


@compiled
def predict_row(
    i: int, now: float, balls: Floats, setup: Setup, radii: Floats | None, row: Floats
) -> None:
    """Write into ``row`` when ball i will touch each other ball."""
    age = now - balls[CLOCK, i]
    u, v = balls[U, i], balls[V, i]
    x, y = balls[X, i] + u * age, balls[Y, i] + v * age
    for k in range(balls.shape[1]):
        d = contact_distance(setup, radii, i, k)
        age = now - balls[CLOCK, k]
        row[k] = now + pair_delay(
            balls[X, k] + balls[U, k] * age - x,
            balls[Y, k] + balls[V, k] * age - y,
            balls[U, k] - u,
            balls[V, k] - v,
            d * d,
        )


@compiled
def predict_two_rows(
    i: int,
    j: int,
    now: float,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
    row: Floats,
    other_row: Floats,
) -> None:
    """``predict_row`` for two balls whose clocks are at ``now``, in one pass over the others."""
    xi, yi, ui, vi = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    xj, yj, uj, vj = balls[X, j], balls[Y, j], balls[U, j], balls[V, j]
    for k in range(balls.shape[1]):
        age = now - balls[CLOCK, k]
        u, v = balls[U, k], balls[V, k]
        x, y = balls[X, k] + u * age, balls[Y, k] + v * age
        di = contact_distance(setup, radii, i, k)
        dj = contact_distance(setup, radii, j, k)
        row[k] = now + pair_delay(x - xi, y - yi, u - ui, v - vi, di * di)
        other_row[k] = now + pair_delay(x - xj, y - yj, u - uj, v - vj, dj * dj)


@compiled
def predict_wall(
    i: int,
    now: float,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
) -> None:
    """Write into the agenda when ball i will hit the wall."""
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
    agenda[WALL_TIME, i] = now + wall_delay(x, y, u, v, reach * reach)


@compiled
def predict_row_and_walls(
    i: int,
    now: float,
    balls: Floats,
    container: Floats,
    setup: Setup,
    radii: Floats | None,
    row: Floats,
    wall_time: Floats,
) -> None:
    """``predict_row`` for ball i, and for all balls when they will hit the wall, in one pass.

    For a container that has just been hit by ball i and has changed its velocity.
    """
    xi, yi, ui, vi = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    xc, yc, uc, vc = container[X], container[Y], container[U], container[V]
    for k in range(balls.shape[1]):
        age = now - balls[CLOCK, k]
        u, v = balls[U, k], balls[V, k]
        x, y = balls[X, k] + u * age, balls[Y, k] + v * age
        d, reach = contact_distance(setup, radii, i, k), wall_reach(setup, radii, k)
        row[k] = now + pair_delay(x - xi, y - yi, u - ui, v - vi, d * d)
        wall_time[k] = now + wall_delay(x - xc, y - yc, u - uc, v - vc, reach * reach)


@compiled
def predict_return(
    i: int, now: float, balls: Floats, container: Floats | None, agenda: Floats
) -> None:
    """Write into the agenda when ball i, which has just hit the wall, will hit it again."""
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    if container is not None:
        x, y, u, v = x - container[X], y - container[Y], u - container[U], v - container[V]
    agenda[WALL_TIME, i] = now + chord_delay(x, y, u, v)


@compiled
def top_speed(balls: Floats, setup: Setup, masses: Floats | None) -> float:
    """The speed of the lightest ball if it had all the energy, m/s: none can become faster."""
    energy, lightest = 0.0, math.inf
    for k in range(balls.shape[1]):
        m = mass_of(setup, masses, k)
        energy += m * (balls[U, k] * balls[U, k] + balls[V, k] * balls[V, k])
        lightest = min(lightest, m)
    return math.sqrt(energy / lightest)


@compiled
def is_trapped(
    i: int,
    now: float,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    radii: Floats | None,
    masses: Floats | None,
    agenda: Floats,
    patient: bool,
) -> bool:
    """Whether ball i, just off the wall, will hit it infinitely often before anything else.

    Each bounce keeps the tangential speed v_t and multiplies the normal one v_n by the wall's
    restitution e, so that the chords last 2 a e^k v_n / (e^2k v_n^2 + v_t^2); without the first
    term below, their sum is geometric: 2 a v_n / ((1 - e) v_t^2) is an upper bound of the time
    left. The ball is trapped if within it the run does not end, no other event is due and no ball
    can come near: the others move straight, and ball i is never faster than now.

    All this is relative to the container. A free one is pushed by the bounces, by no more than
    its share of (1 + e) v_n / (1 - e) together, and the others must not reach its wall either.

    Without patience, others may have events; none of them is then faster than all the energy in
    one ball, which in a fixed container never grows.
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
    if end > setup.time_limit or agenda[PAIR_TIME, i] <= end:
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
            if patient and (agenda[PAIR_TIME, k] <= end or agenda[WALL_TIME, k] <= end):
                return False
            age = now - balls[CLOCK, k]
            xk, yk = balls[X, k] + balls[U, k] * age, balls[Y, k] + balls[V, k] * age
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
