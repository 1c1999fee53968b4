"""When balls touch each other and the wall, and how a search leaves out what comes later.

The time of a contact is a function of the states of its two balls, whose clocks show their last
events: ``contact_time`` brings both to the later of the two and adds the delay from there. The time
of a hit of the wall is a function of the ball and the container, ``time_at_wall``. So it does not
matter when, how often and by whom a contact is searched: it has one time, to the last bit.

A search of ball i among many has two passes, over BLOCK balls at a time:

1. ``candidates`` sets a bit in a mask for each ball that may touch i up to a time. ``may_touch``
   needs no branch, root or division for it, so this loop runs in vector registers. Its rows are
   slices that are counted from 0: the loads are then contiguous, and not gathers, which are four
   times as slow on some processors.
2. ``earliest`` takes the few bits that are set, the lowest first, and computes exact times. Each
   time found shortens the search of the following blocks.
"""

import math

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import lowest_bit
from snooker_cli.engine.contact import NEVER, may_touch, pair_delay
from snooker_cli.engine.jit import helper, inlined
from snooker_cli.engine.kernel_state import CLOCK, Floats, State, U, V, X, Y
from snooker_cli.engine.restitution import WALL, bounce_sums, is_endless, may_stay

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
def contact_time(i: int, k: int, now: float, state: State) -> float:
    """When balls i and k touch next, s; inf if never. The same of k and i, to the bit.

    now : at which the nearest image of k is that which is asked for; without images of no effect

    Both are brought to their last event, so the time has one value for each image at any ``now``.
    It is not before the epoch: after clocks were set back it could be, by a rounding.
    """
    balls = state.balls
    own, its = balls[CLOCK, i], balls[CLOCK, k]
    since = own if own > its else its
    x, y = ks.position(i, since, balls)
    xk, yk = ks.position(k, since, balls)
    u, v = balls[U, k] - balls[U, i], balls[V, k] - balls[V, i]
    later = now - since
    x, y = state.boundary.image_nearest_at(xk - x, yk - y, u * later, v * later)
    d = ks.contact_distance(state.sizes, i, k)
    time = since + pair_delay(x, y, u, v, d * d)
    return time if time > 0.0 else 0.0


@inlined
def next_hit(i: int, state: State) -> float:
    """``time_at_wall``, and not before the epoch."""
    time = state.boundary.time_at_wall(i, state)
    return time if time > 0.0 else 0.0


# Searches


@inlined
def twice_ahead(until: float, since: float) -> float:
    """Twice the time (s) that ``may_touch`` looks ahead of ``since``, so that none is missed.

    A contact up to ``until`` has a delay of at most until - since, but for half a unit in the last
    place of the sum, which is below 2^-52 until. The delay is at least c/(-2b) but for some 2^-51
    of it, which 2^-40 exceeds. So no ball that ``contact_time`` gives up to ``until`` is left out.
    """
    return (2.0 + 2.0**-39) * (until - since) + 2.0**-50 * until


@inlined
def padded_square(distance: float, reach: float) -> float:
    """The square of a distance, m, and a little more for places up to a reach (m) from the centre.

    It is the ``filter_square`` of contact distances d. Why it is enough:

    Within fixed walls at most L from the centre, a ball flies 2 L at most between its events. So
    the offset of two balls at one time, computed from now and from the later clock, differs by less
    than 2^-47 L: there are eight sums and products, each rounded by 2^-53 of 2 L at most. A square
    of about d^2 then differs by less than 2^-45 L d. ``contact_time`` itself is rounded as if the
    square were 2^-50 (d + L) d off. The sum is below 2^-40 (d + L) d.
    """
    return distance * (distance + 2.0**-40 * (distance + reach))


@inlined
def candidates_from(
    just_moved: bool, i: int, now: float, until: float, state: State, start: int, stop: int
) -> int:
    """``candidates`` of a ball whose clock may be known to be at ``now``."""
    balls = state.balls
    x, y, u, v, own = balls[X, i], balls[Y, i], balls[U, i], balls[V, i], balls[CLOCK, i]
    r = state.sizes.radius_of(i)
    xs, ys, us, vs, clocks = rows(balls, start, stop)
    sizes = state.sizes.sizes_between(start, stop)
    mask = 0
    for k in range(len(xs)):
        d, its = r + sizes.radius_of(k), clocks[k]
        since = state.boundary.filter_time(now, own if own > its else its)
        if just_moved:
            since = now
        age, own_age, later = since - its, since - own, now - since
        if just_moved:
            own_age = later = 0.0
        xk, yk = xs[k] + us[k] * age, ys[k] + vs[k] * age
        uk, vk = us[k] - u, vs[k] - v
        xk, yk = state.boundary.image_nearest_at(
            xk - (x + u * own_age), yk - (y + v * own_age), uk * later, vk * later
        )
        square = state.boundary.filter_square(d)
        may = may_touch(xk, yk, uk, vk, square, twice_ahead(until, since))
        mask |= 1 << k if may else 0
    return mask


@inlined
def candidates_of_two(
    i: int,
    j: int,
    now: float,
    until_i: float,
    until_j: float,
    state: State,
    start: int,
    stop: int,
) -> tuple[int, int]:
    """``candidates`` of two balls that have just collided, in one pass over the others."""
    balls, boundary = state.balls, state.boundary
    xi, yi, ui, vi = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    xj, yj, uj, vj = balls[X, j], balls[Y, j], balls[U, j], balls[V, j]
    ri, rj = state.sizes.radius_of(i), state.sizes.radius_of(j)
    xs, ys, us, vs, clocks = rows(balls, start, stop)
    sizes = state.sizes.sizes_between(start, stop)
    twice_i, twice_j = twice_ahead(until_i, now), twice_ahead(until_j, now)
    mask_i, mask_j = 0, 0
    for k in range(len(xs)):
        r = sizes.radius_of(k)
        di, dj = ri + r, rj + r
        age = now - clocks[k]
        x, y = xs[k] + us[k] * age, ys[k] + vs[k] * age
        u, v = us[k], vs[k]
        x_i, y_i = boundary.nearest_image(x - xi, y - yi)
        x_j, y_j = boundary.nearest_image(x - xj, y - yj)
        square_i, square_j = boundary.filter_square(di), boundary.filter_square(dj)
        may_i = may_touch(x_i, y_i, u - ui, v - vi, square_i, twice_i)
        may_j = may_touch(x_j, y_j, u - uj, v - vj, square_j, twice_j)
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
    mask: int, start: int, i: int, now: float, time: float, partner: int, state: State
) -> tuple[float, int]:
    """When ball i first touches a ball of the mask, s, and which, if before ``time``."""
    while mask != 0:
        k = start + lowest_bit(mask)
        mask &= mask - 1
        its_time = contact_time(i, k, now, state)
        if its_time < time:
            time, partner = its_time, k
    return time, partner


@inlined
def earliest_now(
    mask: int, start: int, i: int, now: float, time: float, partner: int, state: State
) -> tuple[float, int]:
    """``earliest`` for a ball i that has just had an event: the later clock is now."""
    balls, boundary = state.balls, state.boundary
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    while mask != 0:
        k = start + lowest_bit(mask)
        mask &= mask - 1
        xk, yk = ks.position(k, now, balls)
        xk, yk = boundary.nearest_image(xk - x, yk - y)
        d = ks.contact_distance(state.sizes, i, k)
        its_time = now + pair_delay(xk, yk, balls[U, k] - u, balls[V, k] - v, d * d)
        if its_time < time:
            time, partner = its_time, k
    return time, partner


@inlined
def cannot_meet(i: int, now: float, state: State) -> int:
    """The ball that ball i parted from in the last event of both and cannot meet, or NO_PARTNER.

    Of two that part, other images may become the nearest, and these may meet.
    """
    k = ks.parted_from(i, state)
    if k < 0:
        return ks.NO_PARTNER
    balls = state.balls
    x, y = balls[X, k] - balls[X, i], balls[Y, k] - balls[Y, i]
    age = now - balls[CLOCK, i]  # and of ball k: they had their last event together
    xn, yn = x + (balls[U, k] - balls[U, i]) * age, y + (balls[V, k] - balls[V, i]) * age
    return k if state.boundary.same_image(x, y, xn, yn) else ks.NO_PARTNER


# Wall traps: infinitely many hits of a circle in finite time


@inlined
def bouncing_time(i: int, now: float, state: State) -> float:
    """How long infinitely many hits of ball i, just off the wall, last at most, s; inf without.

    A chord lasts 2 a v_n / (v_n^2 + v_t^2), so all last at most the sum of 2 a v_n / v_t^2. Here a
    is the distance from the centre, v_n and v_t are the normal and the tangential speed.
    """
    balls = state.balls
    x, y, u, v = state.boundary.relative(balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now)
    inward = max(-(x * u + y * v), 0.0)  # a v_n
    cross = x * v - y * u  # a v_t
    if cross == 0.0:
        return NEVER
    square = x * x + y * y
    length = math.sqrt(square)
    loss, share = bounce_sums(state.setup.laws[WALL], inward / square, length)
    if state.surface.rubs_wall():
        mass = state.boundary.bouncing_mass(float(state.sizes.mass_of(i)))
        changes = share * (inward / length)
        cross = length * state.surface.slowest_along(i, cross / length, changes, mass, state)
        if cross == 0.0:
            return NEVER
    return float(2.0 * inward * square / (loss * cross * cross))


@inlined
def highest_speed(state: State) -> float:
    """The speed of the lightest ball if it had all the energy, m/s: none can become faster.

    The energy of a free container is not needed: meanwhile only the trapped ball touches it.
    """
    lightest, energies = math.inf, state.scratch[0]
    for k in range(state.balls.shape[1]):
        m, u, v = state.sizes.mass_of(k), state.balls[U, k], state.balls[V, k]
        spin = state.surface.twice_spin_energy(k, state)
        energies[ks.label_of(k, state.labels)] = m * (u * u + v * v + spin)
        lightest = min(lightest, m)
    energy = 0.0
    for k in range(len(energies)):
        energy += energies[k]
    return math.sqrt(energy / lightest)


@inlined
def is_trapped(i: int, now: float, state: State) -> bool:
    """Whether ball i, which has just hit the wall, will hit it infinitely often before all else.

    Looked at after 2, 4, 8 … hits in a row, or after the first one if a ball may stay at the wall;
    and after each that does not move the clock, before these are a collapse.
    """
    law, hits = state.setup.laws[WALL], ks.hits_in_a_row(i, state)
    if is_endless(law, hits):
        return True
    if not state.setup.traps or (hits == 1 and not may_stay(law)):
        return False
    if hits & (hits - 1) != 0 and state.counts[ks.STALLED] == 0:
        return False
    return stays_alone(i, now, bouncing_time(i, now, state), state)


@helper
def stays_alone(i: int, now: float, lasts: float, state: State) -> bool:
    """Whether nothing can reach ball i, just off the wall, while it hits that infinitely often.

    The repeat does not end within that time and no other ball can come near, with whatever speed.
    Nor may a free container, which the bounces push, reach another ball.

    lasts : ``bouncing_time``, s
    """
    balls, boundary = state.balls, state.boundary
    if now + lasts > state.sums[ks.TIME_LIMIT] or lasts == NEVER:
        return False
    x, y, u, v = boundary.relative(balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now)
    inward = max(-(x * u + y * v), 0.0) / math.sqrt(x * x + y * y)
    wall_speed, speed = boundary.pushed_speed(i, inward, state), math.sqrt(u * u + v * v)
    if state.surface.rubs_wall():
        # A spin may make the ball faster, but each chord is 2 a v_n over its speed: all together
        # are at most the time times the speed now. A free wall has the rest of the momentum.
        m = float(state.sizes.mass_of(i))
        wall_speed += 2.0 * (1.0 - boundary.bouncing_mass(m) / m) * speed
    speed += wall_speed
    fastest = highest_speed(state)
    for k in range(balls.shape[1]):
        if k == i:
            continue
        xk, yk = boundary.place(k, now, balls)
        x, y = xk - balls[X, i], yk - balls[Y, i]
        gap = math.sqrt(x * x + y * y) - ks.contact_distance(state.sizes, i, k)
        if gap <= (speed + fastest) * lasts:
            return False
        if boundary.wall_comes_near(k, xk, yk, (wall_speed + fastest) * lasts, state):
            return False
    return True
