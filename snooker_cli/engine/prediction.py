"""When each ball will next touch another ball and the wall.

A ball's contacts matter only until its next hit of the wall, or a little longer if others can push
a free container. A search up to that horizon T has two passes, over BLOCK balls at a time:

1. ``candidates`` sets a bit in a mask for each ball that may come in time. ``may_touch`` needs no
   branch, root or division for it, so this loop runs in vector registers. Its rows are slices that
   are counted from 0: the loads are then contiguous, and not gathers, which are four times as slow
   on some processors.
2. ``earliest`` takes the few bits that are set, the lowest first, and computes exact times. Each
   time found shortens the horizon of the following blocks.
"""

import math
from typing import Any

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import lowest_bit
from snooker_cli.engine.collision import bounce_sums
from snooker_cli.engine.contact import NEVER, may_touch, pair_delay
from snooker_cli.engine.jit import by_class, helper, inlined
from snooker_cli.engine.kernel_state import CLOCK, Floats, State, U, V, X, Y
from snooker_cli.laws import Law

BLOCK = 48
"""Balls of a mask: fewer than the bits of a positive integer, a multiple of any vector's length."""


@inlined
def rows(balls: Floats, start: int, stop: int) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """The rows X, Y, U, V and CLOCK of some balls."""
    return (
        balls[X, start:stop],
        balls[Y, start:stop],
        balls[U, start:stop],
        balls[V, start:stop],
        balls[CLOCK, start:stop],
    )


@inlined
def candidates(i: int, now: float, horizon: float, state: State, start: int, stop: int) -> int:
    """The balls from ``start`` to ``stop`` that may touch ball i within ``horizon``, a bit each."""
    x, y = ks.position(i, now, state.balls)
    u, v = state.balls[U, i], state.balls[V, i]
    r = ks.radius_of(state.sizes, i)
    xs, ys, us, vs, clocks = rows(state.balls, start, stop)
    sizes = ks.sizes_between(state.sizes, start, stop)
    twice = 2.0 * horizon
    mask = 0
    for k in range(len(xs)):
        d = r + ks.radius_of(sizes, k)
        age = now - clocks[k]
        xk, yk = xs[k] + us[k] * age, ys[k] + vs[k] * age
        may = may_touch(xk - x, yk - y, us[k] - u, vs[k] - v, d * d, twice)
        mask |= 1 << k if may else 0
    return mask


@inlined
def candidates_of_two(
    i: int,
    j: int,
    now: float,
    horizon_i: float,
    horizon_j: float,
    state: State,
    start: int,
    stop: int,
) -> tuple[int, int]:
    """``candidates`` of two balls whose clocks are at ``now``, in one pass over the others."""
    balls = state.balls
    xi, yi, ui, vi = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    xj, yj, uj, vj = balls[X, j], balls[Y, j], balls[U, j], balls[V, j]
    ri, rj = ks.radius_of(state.sizes, i), ks.radius_of(state.sizes, j)
    xs, ys, us, vs, clocks = rows(balls, start, stop)
    sizes = ks.sizes_between(state.sizes, start, stop)
    twice_i, twice_j = 2.0 * horizon_i, 2.0 * horizon_j
    mask_i, mask_j = 0, 0
    for k in range(len(xs)):
        r = ks.radius_of(sizes, k)
        di, dj = ri + r, rj + r
        age = now - clocks[k]
        x, y = xs[k] + us[k] * age, ys[k] + vs[k] * age
        u, v = us[k], vs[k]
        may_i = may_touch(x - xi, y - yi, u - ui, v - vi, di * di, twice_i)
        may_j = may_touch(x - xj, y - yj, u - uj, v - vj, dj * dj, twice_j)
        mask_i |= 1 << k if may_i else 0
        mask_j |= 1 << k if may_j else 0
    return mask_i, mask_j


@inlined
def without(mask: int, start: int, k: int) -> int:
    """The mask of balls from ``start`` on, without ball k."""
    if start <= k < start + BLOCK:
        return mask & ~(1 << (k - start))
    return mask


@inlined
def earliest(
    mask: int, start: int, i: int, now: float, delay: float, partner: int, state: State
) -> tuple[float, int]:
    """When ball i first touches a ball of the mask, and which, if before ``delay``."""
    balls = state.balls
    x, y = ks.position(i, now, balls)
    u, v = balls[U, i], balls[V, i]
    while mask != 0:
        k = start + lowest_bit(mask)
        mask &= mask - 1
        d = ks.contact_distance(state.sizes, i, k)
        xk, yk = ks.position(k, now, balls)
        uk, vk = balls[U, k], balls[V, k]
        its_delay = pair_delay(xk - x, yk - y, uk - u, vk - v, d * d)
        if its_delay < delay:
            delay, partner = its_delay, k
    return delay, partner


@by_class
def delay_to_wall(boundary: Any, i: int, now: float, left_wall: bool, state: State) -> float:
    """Time until ball i hits the wall, s; never without walls.

    left_wall : whether it was exactly at the wall at its clock: after a hit or a slide
    """
    return NEVER


@by_class
def delay_to_next_hit(boundary: Any, i: int, state: State) -> float:
    """Time from the hit of the wall that ball i has just had to the next one, s."""
    return NEVER


# Wall traps: infinitely many hits of a circle in finite time


@inlined
def bouncing_time(i: int, now: float, state: State) -> float:
    """How long infinitely many hits of ball i, just off the wall, last at most, s; inf without.

    A chord lasts 2 a v_n / (v_n^2 + v_t^2), so all last at most the sum of 2 a v_n / v_t^2. Here a
    is the distance from the centre, v_n and v_t are the normal and the tangential speed.
    """
    balls = state.balls
    x, y, u, v = ks.relative(
        state.boundary, balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now
    )
    inward = max(-(x * u + y * v), 0.0)  # a v_n
    cross = x * v - y * u  # a v_t
    if cross == 0.0:
        return NEVER
    square = x * x + y * y
    loss, _ = bounce_sums(state.setup.wall_law, inward / square, math.sqrt(square))
    return float(2.0 * inward * square / (loss * cross * cross))


@by_class
def may_stay(law: Law) -> bool:
    """Whether a ball may stay at the wall after its first hit."""
    return law.cor == 0.0


@by_class
def is_endless(law: Law, bounces: int) -> bool:
    """Whether a repeat ends after this many bounces of a ball in a row, trapped or not."""
    return False


@by_class
def pushed_speed(boundary: Any, i: int, inward: float, state: State) -> float:
    """Largest speed (m/s) of a wall that ball i hits infinitely often; zero if it is fixed.

    Its bounces push a free container together by no more than its share of ``bounce_sums``.

    inward : v_n of the ball after its last hit, m/s
    """
    return 0.0


@by_class
def wall_comes_near(boundary: Any, k: int, x: float, y: float, way: float, state: State) -> bool:
    """Whether a wall may reach ball k at (x, y) if the two come nearer by a way, m."""
    return False


@inlined
def highest_speed(state: State) -> float:
    """The speed of the lightest ball if it had all the energy, m/s: none can become faster.

    The energy of a free container is not needed: meanwhile only the trapped ball touches it.
    """
    energy, lightest = 0.0, math.inf
    for k in range(state.balls.shape[1]):
        m, u, v = ks.mass_of(state.sizes, k), state.balls[U, k], state.balls[V, k]
        energy += m * (u * u + v * v)
        lightest = min(lightest, m)
    return math.sqrt(energy / lightest)


@helper
def is_trapped(i: int, now: float, lasts: float, undisturbed: bool, state: State) -> bool:
    """Whether ball i, just off the wall, will hit it infinitely often before anything else.

    It is trapped if the repeat does not end within that time and no other ball can come near.
    Nor may a free container, which the bounces push, reach another ball.

    lasts : ``bouncing_time``, s
    undisturbed : whether no other ball has an event in that time; else any may get all the energy
    """
    balls, boundary = state.balls, state.boundary
    if now + lasts > state.sums[ks.TIME_LIMIT] or lasts == NEVER:
        return False
    x, y, u, v = ks.relative(boundary, balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now)
    inward = max(-(x * u + y * v), 0.0) / math.sqrt(x * x + y * y)
    wall_speed = pushed_speed(boundary, i, inward, state)
    speed = math.sqrt(u * u + v * v) + wall_speed
    fastest = 0.0 if undisturbed else highest_speed(state)
    for k in range(balls.shape[1]):
        if k == i:
            continue
        u, v = balls[U, k], balls[V, k]
        its_speed = math.sqrt(u * u + v * v) if undisturbed else fastest
        xk, yk = ks.place(boundary, k, now, balls)
        x, y = xk - balls[X, i], yk - balls[Y, i]
        gap = math.sqrt(x * x + y * y) - ks.contact_distance(state.sizes, i, k)
        if gap <= (speed + its_speed) * lasts:
            return False
        if wall_comes_near(boundary, k, xk, yk, (wall_speed + its_speed) * lasts, state):
            return False
    return True
