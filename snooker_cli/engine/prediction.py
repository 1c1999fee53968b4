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

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import lowest_bit
from snooker_cli.engine.contact import may_touch, pair_delay, wall_delay
from snooker_cli.engine.jit import helper, inlined
from snooker_cli.engine.kernel_state import CLOCK, Floats, Integers, State, U, V, X, Y
from snooker_cli.engine.sliding import place

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
    r = ks.radius_of(i, state.setup, state.radii)
    xs, ys, us, vs, clocks = rows(state.balls, start, stop)
    radii = ks.part_of(state.radii, slice(start, stop))
    twice = 2.0 * horizon
    mask = 0
    for k in range(len(xs)):
        d = r + ks.radius_of(k, state.setup, radii)
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
    ri = ks.radius_of(i, state.setup, state.radii)
    rj = ks.radius_of(j, state.setup, state.radii)
    xs, ys, us, vs, clocks = rows(balls, start, stop)
    radii = ks.part_of(state.radii, slice(start, stop))
    twice_i, twice_j = 2.0 * horizon_i, 2.0 * horizon_j
    mask_i, mask_j = 0, 0
    for k in range(len(xs)):
        r = ks.radius_of(k, state.setup, radii)
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
        d = ks.contact_distance(i, k, state.setup, state.radii)
        xk, yk = ks.position(k, now, balls)
        uk, vk = balls[U, k], balls[V, k]
        its_delay = pair_delay(xk - x, yk - y, uk - u, vk - v, d * d)
        if its_delay < delay:
            delay, partner = its_delay, k
    return delay, partner


@inlined
def time_to_wall(i: int, now: float, state: State, container: Floats | None) -> float:
    """Time until ball i hits the wall of the circle, s."""
    x, y = ks.position(i, now, state.balls)
    u, v = state.balls[U, i], state.balls[V, i]
    x, y, u, v = ks.seen_from_container(x, y, u, v, now, container)
    reach = ks.wall_reach(i, state.setup, state.radii)
    return wall_delay(x, y, u, v, reach * reach)


@helper
def is_trapped(
    i: int,
    now: float,
    state: State,
    container: Floats | None,
    slides: Integers | None,
    next_time: Floats | None,
    patient: bool,
) -> bool:
    """Whether ball i, just off the wall, will hit it infinitely often before anything else.

    The chords last 2 a e^k v_n / (e^2k v_n^2 + v_t^2), together at most 2 a v_n / ((1 - e) v_t^2).
    The ball is trapped if the repeat does not end within that time, no other event happens and no
    ball can come near. The bounces push a free container, together by no more than its share of
    (1 + e) v_n / (1 - e), and its wall must not reach the others either.

    next_time : of each ball's next event, s, if known
    patient : whether other balls must not have events; if they may, each may get the energy of all
    """
    balls, setup = state.balls, state.setup
    x, y, u, v = ks.seen_from_container(
        balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now, container
    )
    inward = max(-(x * u + y * v), 0.0)  # a v_n
    cross = x * v - y * u  # a v_t
    if cross == 0.0:
        return False
    left = 2.0 * inward * (x * x + y * y) / ((1.0 - setup.wall_law.cor) * cross * cross)
    end = now + left
    if end > state.sums[ks.TIME_LIMIT]:
        return False
    wall_speed = 0.0
    if container is not None:
        m = ks.mass_of(i, state.setup, state.masses)
        pushes = (1.0 + setup.wall_law.cor) / (1.0 - setup.wall_law.cor)
        pushes *= inward / math.sqrt(x * x + y * y) * (m / (m + setup.container_mass))
        wall_speed = pushes + math.sqrt(container[U] * container[U] + container[V] * container[V])
    speed = math.sqrt(u * u + v * v) + wall_speed
    fastest = 0.0
    if not patient:  # the lightest ball's speed if it had all the energy: none can become faster
        energy, lightest = 0.0, math.inf
        for k in range(balls.shape[1]):
            m, u, v = ks.mass_of(k, setup, state.masses), balls[U, k], balls[V, k]
            energy += m * (u * u + v * v)
            lightest = min(lightest, m)
        fastest = math.sqrt(energy / lightest)
    for k in range(balls.shape[1]):
        if k != i:
            if next_time is not None and patient and next_time[k] <= end:
                return False
            xk, yk = place(k, now, balls, slides)
            uk, vk = balls[U, k], balls[V, k]
            its_speed = math.sqrt(uk * uk + vk * vk) if patient else fastest
            x, y = xk - balls[X, i], yk - balls[Y, i]
            gap = math.sqrt(x * x + y * y) - ks.contact_distance(i, k, state.setup, state.radii)
            if gap <= (speed + its_speed) * left:
                return False
            if container is not None:
                x, y = xk - container[X], yk - container[Y]
                gap = ks.wall_reach(k, state.setup, state.radii) - math.sqrt(x * x + y * y)
                if gap <= (wall_speed + its_speed) * left:
                    return False
    return True
