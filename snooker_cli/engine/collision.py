"""What happens in a collision: two balls, or a ball and the wall, exchange an impulse.

The event loop and the replay of a trace use ``collide``, so a replay has the same bits.
"""

import math
from typing import Any

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import fused
from snooker_cli.engine.jit import helper, inlined
from snooker_cli.engine.kernel_state import CLOCK, Floats, Setup, State, U, V, X, Y
from snooker_cli.engine.restitution import (
    BOTTOM,
    KIND,
    LEFT,
    PAIR,
    RIGHT,
    TEMPERATURE,
    THERMAL,
    TOP,
    WALL,
    kick,
    leave,
)

# The change of velocity


@inlined
def normal_part(x: float, y: float, u: float, v: float) -> float:
    """The part of (u, v) along (x, y), as a multiple of (x, y); rounded once in effect."""
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
def is_slow(x: float, y: float, u: float, v: float, speed: float) -> bool:
    """Whether the part of (u, v) along (x, y) is below a speed; never if that is zero."""
    normal = u * x + v * y
    return normal * normal < speed * speed * (x * x + y * y)


@inlined
def shares(change: float, m: float, n: float) -> tuple[float, float]:
    """The change divided between masses m and n, in proportion n to m; n may be infinite."""
    if m <= n:
        second = change * (m / (m + n))
        return change - second, second
    first = change * (n / (m + n))
    return first, change - first


@inlined
def hit_pair(i: int, j: int, state: State, elastic: bool) -> float:
    """Collide balls i and j, both at the present; the impulse (1 + e) mu |v_n|, kg m/s."""
    balls, setup = state.balls, state.setup
    x, y = balls[X, j] - balls[X, i], balls[Y, j] - balls[Y, i]
    x, y = state.boundary.nearest_image(x, y)
    u, v = balls[U, i] - balls[U, j], balls[V, i] - balls[V, j]
    elastic = elastic or is_slow(x, y, u, v, setup.elastic_below)
    length, normal = math.sqrt(x * x + y * y), normal_part(x, y, u, v)
    # Of velocity, over (x, y).
    change = kick(PAIR, normal, length, elastic, setup)
    m = state.sizes.mass_of(i)
    first, second = shares(change, m, state.sizes.mass_of(j))
    balls[U, i] -= first * x
    balls[V, i] -= first * y
    balls[U, j] += second * x
    balls[V, j] += second * y
    impulse = m * first * length
    state.surface.rub_pair(i, j, x, y, u, v, impulse, state)
    return impulse


@inlined
def change_at_circle(x: float, y: float, u: float, v: float, setup: Setup, elastic: bool) -> float:
    """The change of a relative velocity (u, v) in a hit of a circle at (x, y), over (x, y).

    A chord may be shorter than the rounding of its place. Then a ball seems to move inwards at its
    end. It leaves inwards as after the opposite speed.
    """
    elastic = elastic or is_slow(x, y, u, v, setup.elastic_below)
    normal, length = normal_part(x, y, u, v), math.sqrt(x * x + y * y)
    change = kick(WALL, abs(normal), length, elastic, setup)
    return change if normal > 0.0 else 2.0 * normal + change


@inlined
def hit_circle(i: int, state: State, elastic: bool) -> float:
    """Collide ball i with a fixed circular wall; the impulse (1 + e) m |v_n|, kg m/s."""
    balls = state.balls
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    if state.setup.laws[WALL, KIND] == THERMAL:
        return leave(i, x, y, state.setup.laws[WALL, TEMPERATURE], state)
    change = change_at_circle(x, y, u, v, state.setup, elastic)
    balls[U, i] -= change * x
    balls[V, i] -= change * y
    impulse = float(abs(state.sizes.mass_of(i) * change * math.sqrt(x * x + y * y)))
    state.surface.rub_wall(i, x, y, u, v, impulse, state)
    return impulse


@inlined
def hit_side(i: int, across: bool, state: State, elastic: bool) -> float:
    """Collide ball i with the straight wall ahead of it; the impulse (1 + e) m |v_n|, kg m/s.

    across : whether this is the left or the right one
    """
    balls, row = state.balls, U if across else V
    normal = balls[row, i]
    first, second = (LEFT, RIGHT) if across else (BOTTOM, TOP)
    which = second if normal > 0.0 else first
    law = state.setup.laws[which]
    if law[KIND] == THERMAL:
        ahead = math.copysign(1.0, normal)
        x, y = (ahead, 0.0) if across else (0.0, ahead)
        return leave(i, x, y, law[TEMPERATURE], state)
    elastic = elastic or abs(normal) < state.setup.elastic_below
    change = kick(which, abs(normal), 1.0, elastic, state.setup)
    u, v, ahead = balls[U, i], balls[V, i], math.copysign(1.0, normal)
    balls[row, i] -= math.copysign(change, normal)
    impulse = float(state.sizes.mass_of(i) * change)
    x, y = (ahead, 0.0) if across else (0.0, ahead)
    state.surface.rub_wall(i, x, y, u, v, impulse, state)
    return impulse


# The collision step


@helper
def contact_lasts(now: float, state: State) -> float:
    """How long a contact lasts in the TC model at the balls' present speeds, s.

    It is a part of the mean free time: the mean free path over the root mean square of speeds
    relative to the container (Luding & McNamara, Granular Matter 1, 113 (1998)).
    """
    balls, labels, number = state.balls, state.labels, state.balls.shape[1]
    for k in range(number):
        u, v = state.boundary.relative(0.0, 0.0, balls[U, k], balls[V, k], now)[2:]
        # In the scene's order, so that the sum has the same bits in any order of the columns.
        state.scratch[0, labels[k] if len(labels) > 0 else k] = u * u + v * v
    total = 0.0
    for k in range(number):
        total += state.scratch[0, k]
    return state.setup.contact_path / math.sqrt(total / number) if total > 0.0 else 0.0


@inlined
def in_contact(i: int, now: float, balls: Floats, sums: Floats) -> bool:
    """Whether ball i, not yet moved to the present, still has its last contact."""
    # In the first epoch a clock at zero has not been moved: there was no contact.
    moved = balls[CLOCK, i] > 0.0 or sums[ks.EPOCH] > 0.0
    return bool(moved and now - balls[CLOCK, i] < sums[ks.CONTACT_LASTS])


@inlined
def move(i: int, now: float, state: State) -> None:
    """Bring ball i to the present, in a periodic box to its image inside."""
    balls = state.balls
    x, y = ks.position(i, now, balls)
    balls[X, i], balls[Y, i] = state.boundary.nearest_image(x, y)
    balls[CLOCK, i] = now


@inlined
def collide(i: int, j: int, now: float, state: State) -> float:
    """Bring balls i and j to the present and collide them; the impulse, kg m/s.

    j : NO_PARTNER for a collision with the wall
    """
    balls, k = state.balls, max(j, 0)
    u_i, v_i, u_k, v_k = balls[U, i], balls[V, i], balls[U, k], balls[V, k]
    of_i, of_k = (
        state.surface.twice_spin_energy(i, state),
        state.surface.twice_spin_energy(k, state),
    )
    impulse = exchange(i, j, now, state)
    if len(state.account) > 0:
        note_gain(i, j < 0, u_i, v_i, of_i, state)
        if j >= 0:
            note_gain(k, False, u_k, v_k, of_k, state)
    return impulse


@inlined
def exchange(i: int, j: int, now: float, state: State) -> float:
    """``collide``, without an account of the energy."""
    balls, sums, counts = state.balls, state.sums, state.counts
    done = counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS]
    if state.setup.contact_path > 0.0 and done % balls.shape[1] == 0:
        sums[ks.CONTACT_LASTS] = contact_lasts(now, state)
    elastic = in_contact(i, now, balls, sums)
    move(i, now, state)
    if j == ks.NO_PARTNER:
        return float(state.boundary.hit_wall(i, now, state, elastic))
    elastic = elastic or in_contact(j, now, balls, sums)
    move(j, now, state)
    return hit_pair(i, j, state, elastic)


# Sums


@helper
def note_gain(i: int, by_wall: bool, u: float, v: float, spin: float, state: State) -> None:
    """Add to the account what ball i, which had the velocity (u, v), gained in a collision.

    spin : its ``twice_spin_energy`` before

    With the energy at the start, the account gives the balls' energy at any time, but for rounding.
    """
    account, balls = state.account, state.balls
    now_u, now_v = balls[U, i], balls[V, i]
    twice = (now_u - u) * (now_u + u) + (now_v - v) * (now_v + v)
    twice += state.surface.twice_spin_energy(i, state) - spin
    gained = 0.5 * state.sizes.mass_of(i) * twice
    row, size = (ks.FROM_WALLS, gained) if by_wall else (ks.LOST, -gained)
    before = account[row]
    after = before + size
    added = after - before
    account[row] = after
    account[row + ks.ACCOUNT_REST] += (before - (after - added)) + (size - added)  # TwoSum


@inlined
def add_up(sums: Floats, which: int, size: float) -> None:
    """Add a nonnegative number to a sum, and the rounding error to the sum's rest (Fast2Sum)."""
    before = sums[which]
    after = before + size
    sums[which] = after
    sums[which + ks.REST] += size - (after - before)


@inlined
def count(i: int, j: int, impulse: float, state: State) -> None:
    """Count an event and add up its impulse; a negative j is one at the wall."""
    if j < 0:
        state.counts[ks.WALL_EVENTS] += 1
        add_up(state.sums, ks.WALL_IMPULSE, impulse)
    else:
        state.counts[ks.PAIR_EVENTS] += 1
        distance = ks.contact_distance(state.sizes, i, j)
        add_up(state.sums, ks.PAIR_VIRIAL, impulse * distance)


@inlined
def record(event: Any, i: int, j: int, now: float, impulse: float, state: State) -> None:
    """Write an event into its record; of two balls, the lesser first."""
    labels = state.labels
    if len(labels) > 0:
        i, j = labels[i], labels[j] if j >= 0 else j
    event["time"], event["impulse"] = now, impulse
    event["i"] = i if j < 0 else min(i, j)
    event["j"] = max(i, j) if j >= 0 else j
