"""What a ball among the cells does next: it leaves its cell, touches a ball or hits the wall.

A free container is taken to be where it was, with a wall that is nearer by a margin: what that
predicts comes too early, and is predicted exactly when it comes up. So a push of the container
costs nothing until it has moved by the margin. The few balls within the margin are predicted
exactly, and again after each push.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from snooker_cli.engine.cell_grid import Mesh, cell_at, column_of, crossing_delays, row_of
from snooker_cli.engine.collision import radius_of
from snooker_cli.engine.contact import (
    NEVER,
    chord_delay,
    may_touch,
    nearest_image,
    pair_delay,
    side_delay,
    wall_delay,
)
from snooker_cli.engine.event_queue import update
from snooker_cli.engine.jit import inlined, lowest_bit
from snooker_cli.engine.kernel_state import (
    BOUNCES,
    BRINK,
    CELL,
    CLOCK,
    CONTACT_TIME,
    CROSSING_TIME,
    EVENTS,
    FORMER,
    LOOK_AGAIN,
    NOBODY,
    PARTNER,
    PARTNER_COUNT,
    PREDICTIONS,
    Flags,
    Floats,
    Indices,
    Integers,
    Setup,
    U,
    V,
    X,
    Y,
    ahead,
)
from snooker_cli.engine.prediction import BLOCK, contact_distance, wall_reach

# Whom a ball touches next, among the balls of its own cell and of those around it.


@inlined
def collect(
    near: Indices,
    found: int,
    column: int,
    row: int,
    mesh: Mesh,
    members: Indices,
    occupancy: Indices,
    period: Floats | None,
) -> int:
    """Append the balls of a cell to ``near``; how many there are then.

    Four are copied whatever their number: that is cheaper than to ask.
    """
    if period is not None:
        column += mesh.columns if column < 0 else 0
        column -= mesh.columns if column >= mesh.columns else 0
        row += mesh.rows if row < 0 else 0
        row -= mesh.rows if row >= mesh.rows else 0
    cell = cell_at(mesh, column, row)
    number = int(occupancy[cell])
    found = ahead(found)
    for place in range(4):
        near[found + place] = members[cell, place]
    for place in range(4, number):
        near[found + place] = members[cell, place]
    return found + number


@inlined
def collect_around(
    near: Indices,
    column: int,
    row: int,
    mesh: Mesh,
    members: Indices,
    occupancy: Indices,
    period: Floats | None,
) -> int:
    """Put the balls of a cell and of the eight around it into ``near``; how many."""
    found = 0
    for up in range(-1, 2):
        for right in range(-1, 2):
            found = collect(near, found, column + right, row + up, mesh, members, occupancy, period)
    return found


@inlined
def nearest(
    i: int,
    now: float,
    near: Indices,
    found: int,
    horizon: float,
    whom: int,
    apart: int,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
    period: Floats | None,
) -> tuple[float, int]:
    """When ball i first touches one of ``near``, and which, if within a horizon; else those given.

    ``apart`` is a ball that it has just parted from.
    """
    age = now - balls[CLOCK, i]
    u, v = balls[U, i], balls[V, i]
    x, y = balls[X, i] + u * age, balls[Y, i] + v * age
    # As many as fill vectors: ball i, which never meets itself, makes up for what is missing.
    found = ahead(found)
    for place in range(3):
        near[found + place] = i
    found = (found + 3) & ~3
    for start in range(0, found, BLOCK):
        twice = 2.0 * horizon
        mask = 0
        for place in range(start, min(start + BLOCK, found)):
            k = near[place]
            d = contact_distance(setup, radii, i, k)
            age = now - balls[CLOCK, k]
            uk, vk = balls[U, k], balls[V, k]
            xk, yk = balls[X, k] + uk * age - x, balls[Y, k] + vk * age - y
            if period is not None:
                xk, yk = nearest_image(xk, yk, period)
            may = may_touch(xk, yk, uk - u, vk - v, d * d, twice) & (k != apart)
            mask |= int(may) << (place - start)
        while mask != 0:
            k = near[start + lowest_bit(mask)]
            mask &= mask - 1
            d = contact_distance(setup, radii, i, k)
            age = now - balls[CLOCK, k]
            uk, vk = balls[U, k], balls[V, k]
            xk, yk = balls[X, k] + uk * age - x, balls[Y, k] + vk * age - y
            if period is not None:
                xk, yk = nearest_image(xk, yk, period)
            delay = pair_delay(xk, yk, uk - u, vk - v, d * d)
            if delay < horizon:
                horizon, whom = delay, k
    return horizon, whom


# Elements of a margin's place.
CENTRE_X, CENTRE_Y, WIDTH, UNTIL = range(4)


class Margin(NamedTuple):
    """Where a free container may be until everything is predicted again.

    place : (4,), the centre's coordinates (m), how far it may be from there (m), until when (s)
    brink : (*N*,) ``numpy.int32``, the balls whose hit has been predicted exactly since the last
    brinks : (1,), how many they are
    """

    place: Floats
    brink: Indices
    brinks: Indices


def new_margin(container: Floats, width: float, now: float, number: int) -> Margin:
    """A margin round where a free container is at a time (s)."""
    age = now - container[CLOCK]
    x, y = container[X] + container[U] * age, container[Y] + container[V] * age
    until = now + wall_delay(0.0, 0.0, container[U], container[V], width * width)
    return Margin(
        place=np.array([x, y, width, until]),
        brink=np.zeros(number, dtype=np.int32),
        brinks=np.zeros(1, dtype=np.int32),
    )


@inlined
def predict_crossing(
    i: int, now: float, balls: Floats, period: Floats | None, links: Indices, mesh: Mesh
) -> None:
    """Enter when ball i leaves its cell."""
    across, up = crossing_delays(i, now, balls, period, links, mesh)
    balls[CROSSING_TIME, i] = now + min(across, up)


@inlined
def enqueue(i: int, now: float, balls: Floats, times: Floats, bits: Integers) -> None:
    """Queue ball i's earliest event: its contact or a crossing; none is in the past."""
    update(times, bits, i, max(min(balls[CONTACT_TIME, i], balls[CROSSING_TIME, i]), now))


@inlined
def time_at_wall(
    i: int,
    now: float,
    exact: bool,
    balls: Floats,
    container: Floats | None,
    margin: Margin | None,
    box: Floats | None,
    setup: Setup,
    radii: Floats | None,
    links: Indices,
) -> tuple[float, bool]:
    """Time until ball i hits the wall, and whether that is exact or only not too late; s.

    A ball whose last event was at the wall is back at it after a chord, however short.
    """
    age = now - balls[CLOCK, i]
    u, v = balls[U, i], balls[V, i]
    x, y = balls[X, i] + u * age, balls[Y, i] + v * age
    if box is not None:
        r = radius_of(setup, radii, i)
        return side_delay(x, y, u, v, box[0] - r, box[1] - r), True
    reach = wall_reach(setup, radii, i)
    if container is None or margin is None:
        if links[BOUNCES, i] > 0:
            return chord_delay(balls[X, i], balls[Y, i], u, v) - age, True
        return wall_delay(x, y, u, v, reach * reach), True
    near = max(reach - margin.place[WIDTH], 0.0)
    xm, ym = x - margin.place[CENTRE_X], y - margin.place[CENTRE_Y]
    if not exact and xm * xm + ym * ym < near * near:
        return wall_delay(xm, ym, u, v, near * near), False
    if links[BRINK, i] == 0:
        links[BRINK, i] = 1
        margin.brink[margin.brinks[0]] = i
        margin.brinks[0] += 1
    if links[BOUNCES, i] > 0 and container[CLOCK] == balls[CLOCK, i]:
        x, y = balls[X, i] - container[X], balls[Y, i] - container[Y]
        return chord_delay(x, y, u - container[U], v - container[V]) - age, True
    age = now - container[CLOCK]
    x -= container[X] + container[U] * age
    y -= container[Y] + container[V] * age
    return wall_delay(x, y, u - container[U], v - container[V], reach * reach), True


@inlined
def parted_from(i: int, now: float, balls: Floats, period: Floats | None, tags: Indices) -> int:
    """The ball that ball i has parted from in the last event of both, and cannot meet; or nobody.

    They may meet again through a side of a periodic box: when other images of them are the nearest.
    """
    k = tags[FORMER, i]
    if k < 0 or tags[FORMER, k] != i:
        return NOBODY
    if period is not None:
        x, y = balls[X, k] - balls[X, i], balls[Y, k] - balls[Y, i]
        age = now - balls[CLOCK, i]  # and of ball k: they had their last event together
        xn, yn = x + (balls[U, k] - balls[U, i]) * age, y + (balls[V, k] - balls[V, i]) * age
        across = np.rint(x / period[0]) != np.rint(xn / period[0])
        if across or np.rint(y / period[1]) != np.rint(yn / period[1]):
            return NOBODY
    return int(k)


@inlined
def predict(
    i: int,
    now: float,
    exact: bool,
    balls: Floats,
    container: Floats | None,
    margin: Margin | None,
    box: Floats | None,
    period: Floats | None,
    setup: Setup,
    radii: Floats | None,
    links: Indices,
    tags: Indices,
    mesh: Mesh,
    members: Indices,
    occupancy: Indices,
    at_wall: Flags,
    near: Indices,
    counts: Integers,
) -> None:
    """Enter ball i's earliest contact, with a ball or with the wall."""
    cell = ahead(links[CELL, i])
    delay, whom = NEVER, LOOK_AGAIN
    if at_wall[cell]:
        delay, known = time_at_wall(
            i, now, exact, balls, container, margin, box, setup, radii, links
        )
        whom = NOBODY if known else LOOK_AGAIN
    column, row = column_of(mesh, cell), row_of(mesh, cell)
    found = collect_around(near, column, row, mesh, members, occupancy, period)
    apart = parted_from(i, now, balls, period, tags)
    delay, whom = nearest(i, now, near, found, delay, whom, apart, balls, setup, radii, period)
    counts[PREDICTIONS] += found
    enter_contact(i, now + delay, whom, balls, links, tags)


@inlined
def enter_contact(
    i: int, time: float, whom: int, balls: Floats, links: Indices, tags: Indices
) -> None:
    """Note ball i's earliest contact."""
    balls[CONTACT_TIME, i] = time
    links[PARTNER, i] = whom
    if whom >= 0:
        links[PARTNER_COUNT, i] = tags[EVENTS, whom]


@inlined
def push(
    now: float,
    container: Floats,
    margin: Margin,
    links: Indices,
    tags: Indices,
    balls: Floats,
    times: Floats,
    bits: Integers,
) -> None:
    """The container has another velocity: renew the margin's end; who is near looks again."""
    place = margin.place
    x, y = container[X] - place[CENTRE_X], container[Y] - place[CENTRE_Y]
    place[UNTIL] = now + wall_delay(x, y, container[U], container[V], place[WIDTH] * place[WIDTH])
    for k in range(margin.brinks[0]):
        i = margin.brink[k]
        links[BRINK, i] = 0
        enter_contact(i, now, LOOK_AGAIN, balls, links, tags)
        enqueue(i, now, balls, times, bits)
    margin.brinks[0] = 0
