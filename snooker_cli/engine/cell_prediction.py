"""What a ball among the cells does next: it leaves its cell, touches a ball or hits the wall.

A free container is taken to be where it was, with a wall that is nearer by a margin. What that
predicts comes too early, and is predicted exactly when it comes up. So a push of the container
costs nothing until it has moved by the margin. The few balls within the margin are predicted
exactly, and again after each push.
"""

from __future__ import annotations

import numpy as np

from snooker_cli.engine.cell_grid import (
    BOUNCES,
    BRINK,
    CELL,
    CENTRE_X,
    CENTRE_Y,
    CONTACT_TIME,
    CROSSING_TIME,
    EVENTS,
    FORMER,
    PARTNER,
    PARTNER_EVENTS,
    UNTIL,
    WIDTH,
    Cells,
    Margin,
    cell_at,
    collect,
    column_of,
    crossing_delays,
    put_into,
    row_of,
    take_out,
)
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
from snooker_cli.engine.jit import inlined, kernel, lowest_bit
from snooker_cli.engine.kernel_state import (
    CLOCK,
    NO_PARTNER,
    NOT_SEARCHED,
    PREDICTIONS,
    SEARCH_AGAIN,
    Floats,
    Indices,
    State,
    U,
    V,
    X,
    Y,
    contact_distance,
    nonnegative,
    position,
    radius_of,
    wall_reach,
)
from snooker_cli.engine.prediction import BLOCK

# Partners


@inlined
def parted_from(i: int, now: float, balls: Floats, tags: Indices, period: Floats | None) -> int:
    """The ball that ball i parted from in the last event of both and cannot meet, or NO_PARTNER.

    In a periodic box the two may meet through a side, once other images of them are the nearest.
    """
    k = tags[FORMER, i]
    if k < 0 or tags[FORMER, k] != i:
        return NO_PARTNER
    if period is not None:
        x, y = balls[X, k] - balls[X, i], balls[Y, k] - balls[Y, i]
        age = now - balls[CLOCK, i]  # and of ball k: they had their last event together
        xn, yn = x + (balls[U, k] - balls[U, i]) * age, y + (balls[V, k] - balls[V, i]) * age
        across = np.rint(x / period[0]) != np.rint(xn / period[0])
        if across or np.rint(y / period[1]) != np.rint(yn / period[1]):
            return NO_PARTNER
    return int(k)


@inlined
def offset(
    k: int, now: float, x: float, y: float, balls: Floats, period: Floats | None
) -> tuple[float, float]:
    """From (x, y) to ball k at a time (s), or to its nearest image, m."""
    xk, yk = position(k, now, balls)
    return nearest_image(xk - x, yk - y, period)


@inlined
def nearest(
    i: int, now: float, found: int, delay: float, partner: int, state: State, cells: Cells
) -> tuple[float, int]:
    """When ball i first touches one of those found near, and which, if before ``delay``."""
    balls, near, period = state.balls, cells.near, state.period
    parted = parted_from(i, now, balls, cells.tags, period)
    x, y = position(i, now, balls)
    u, v = balls[U, i], balls[V, i]
    state.counts[PREDICTIONS] += found
    # As many as fill vectors: ball i, which never meets itself, makes up for what is missing.
    found = nonnegative(found)
    for place in range(3):
        near[found + place] = i
    found = (found + 3) & ~3
    for start in range(0, found, BLOCK):
        twice = 2.0 * delay
        mask = 0
        for place in range(start, min(start + BLOCK, found)):
            k = near[place]
            d = contact_distance(i, k, state.setup, state.radii)
            xk, yk = offset(k, now, x, y, balls, period)
            uk, vk = balls[U, k], balls[V, k]
            may = may_touch(xk, yk, uk - u, vk - v, d * d, twice) & (k != parted)
            mask |= int(may) << (place - start)
        while mask != 0:
            k = near[start + lowest_bit(mask)]
            mask &= mask - 1
            d = contact_distance(i, k, state.setup, state.radii)
            xk, yk = offset(k, now, x, y, balls, period)
            uk, vk = balls[U, k], balls[V, k]
            its_delay = pair_delay(xk, yk, uk - u, vk - v, d * d)
            if its_delay < delay:
                delay, partner = its_delay, k
    return delay, partner


# The wall


@inlined
def wall_contact(
    i: int,
    now: float,
    exact: bool,
    state: State,
    cells: Cells,
    box: Floats | None,
    container: Floats | None,
    margin: Margin | None,
) -> tuple[float, int]:
    """Time until ball i hits the wall, s, and its partner: SEARCH_AGAIN if that may be too early.

    A ball whose last event was at the wall is back at it after a chord, however short.
    """
    balls, links = state.balls, cells.links
    age = now - balls[CLOCK, i]
    x, y = position(i, now, balls)
    u, v = balls[U, i], balls[V, i]
    if box is not None:
        r = radius_of(i, state.setup, state.radii)
        return side_delay(x, y, u, v, box[0] - r, box[1] - r), NO_PARTNER
    reach = wall_reach(i, state.setup, state.radii)
    if container is None or margin is None:
        if links[BOUNCES, i] > 0:
            return chord_delay(balls[X, i], balls[Y, i], u, v) - age, NO_PARTNER
        return wall_delay(x, y, u, v, reach * reach), NO_PARTNER
    near = max(reach - margin.place[WIDTH], 0.0)
    xm, ym = x - margin.place[CENTRE_X], y - margin.place[CENTRE_Y]
    if not exact and xm * xm + ym * ym < near * near:
        return wall_delay(xm, ym, u, v, near * near), SEARCH_AGAIN
    if links[BRINK, i] == 0:
        links[BRINK, i] = 1
        margin.brink[margin.brinks[0]] = i
        margin.brinks[0] += 1
    if links[BOUNCES, i] > 0 and container[CLOCK] == balls[CLOCK, i]:
        x, y = balls[X, i] - container[X], balls[Y, i] - container[Y]
        return chord_delay(x, y, u - container[U], v - container[V]) - age, NO_PARTNER
    age = now - container[CLOCK]
    x -= container[X] + container[U] * age
    y -= container[Y] + container[V] * age
    return wall_delay(x, y, u - container[U], v - container[V], reach * reach), NO_PARTNER


# Entries


@inlined
def enter_contact(i: int, time: float, partner: int, balls: Floats, cells: Cells) -> None:
    """Note ball i's earliest contact."""
    balls[CONTACT_TIME, i] = time
    cells.links[PARTNER, i] = partner
    if partner >= 0:
        cells.links[PARTNER_EVENTS, i] = cells.tags[EVENTS, partner]


@inlined
def enqueue(i: int, now: float, balls: Floats, cells: Cells) -> None:
    """Queue ball i's earliest event: its contact or a crossing; none is in the past."""
    update(i, max(min(balls[CONTACT_TIME, i], balls[CROSSING_TIME, i]), now), cells.tree)


@inlined
def predict_crossing(i: int, now: float, state: State, cells: Cells) -> None:
    """Enter when ball i leaves its cell."""
    across, up = crossing_delays(i, now, state, cells)
    state.balls[CROSSING_TIME, i] = now + min(across, up)


@inlined
def predict_contact(i: int, now: float, exact: bool, state: State, cells: Cells) -> None:
    """Enter ball i's earliest contact, with a ball or with the wall."""
    cell = nonnegative(cells.links[CELL, i])
    delay, partner = NEVER, SEARCH_AGAIN
    if cells.at_wall[cell]:
        delay, partner = wall_contact(
            i, now, exact, state, cells, state.box, state.container, cells.margin
        )
    column, row = column_of(cell, cells.mesh), row_of(cell, cells.mesh)
    found = 0
    for up in range(-1, 2):
        for right in range(-1, 2):
            found = collect(found, column + right, row + up, cells, state.period)
    delay, partner = nearest(i, now, found, delay, partner, state, cells)
    enter_contact(i, now + delay, partner, state.balls, cells)


@inlined
def cross(i: int, now: float, state: State, cells: Cells) -> bool:
    """Move ball i into the next cell and look at the far side; false if that cell is full."""
    balls, mesh = state.balls, cells.mesh
    sideways, upwards = crossing_delays(i, now, state, cells)
    across = sideways <= upwards
    old = cells.links[CELL, i]
    w = balls[U, i] if across else balls[V, i]
    step = 1 if w > 0.0 else -1
    right, up = (step, 0) if across else (0, step)
    column, row = column_of(old, mesh) + right, row_of(old, mesh) + up
    new = cell_at(column, row, mesh, state.period)
    if cells.occupancy[new] == cells.members.shape[1]:
        return False
    take_out(i, cells)
    put_into(i, new, cells)
    column, row = column_of(new, mesh), row_of(new, mesh)
    side = mesh.width if across else mesh.height
    balls[CROSSING_TIME, i] = now + min(side / abs(w), upwards if across else sideways)
    before = balls[CONTACT_TIME, i] - now
    delay, partner = before, NO_PARTNER
    if cells.at_wall[new]:
        wall, wall_partner = wall_contact(
            i, now, False, state, cells, state.box, state.container, cells.margin
        )
        if wall < delay:
            delay, partner = wall, wall_partner
    found = 0
    for along in range(-1, 2):
        x, y = (right, along) if across else (along, up)
        found = collect(found, column + x, row + y, cells, state.period)
    delay, partner = nearest(i, now, found, delay, partner, state, cells)
    if delay < before:
        enter_contact(i, now + delay, partner, balls, cells)
    return True


@inlined
def push(
    now: float, state: State, cells: Cells, container: Floats | None, margin: Margin | None
) -> None:
    """Renew the end of the margin of a free container with a new velocity.

    Balls whose hit was predicted exactly search again.
    """
    if container is None or margin is None:
        return
    place = margin.place
    x, y = container[X] - place[CENTRE_X], container[Y] - place[CENTRE_Y]
    place[UNTIL] = now + wall_delay(x, y, container[U], container[V], place[WIDTH] * place[WIDTH])
    for k in range(margin.brinks[0]):
        i = margin.brink[k]
        cells.links[BRINK, i] = 0
        enter_contact(i, now, SEARCH_AGAIN, state.balls, cells)
        enqueue(i, now, state.balls, cells)
    margin.brinks[0] = 0


@inlined
def before_renewal(time: float, margin: Margin | None) -> float:
    """The time, or when a free container may leave its margin, if that is earlier; s."""
    if margin is None:
        return time
    return float(min(time, margin.place[UNTIL]))


@kernel
def fill(now: float, state: State, cells: Cells) -> bool:
    """Sort all balls into cells, and have each predicted first of all; false if a cell is full."""
    balls, mesh = state.balls, cells.mesh
    cells.occupancy[:] = 0
    for i in range(balls.shape[1]):
        x, y = position(i, now, balls)
        x, y = nearest_image(x, y, state.period)
        column = min(max(int((x - mesh.left) / mesh.width), 0), mesh.columns - 1)
        row = min(max(int((y - mesh.bottom) / mesh.height), 0), mesh.rows - 1)
        cell = cell_at(column, row, mesh, None)
        if cells.occupancy[cell] == cells.members.shape[1]:
            return False
        put_into(i, cell, cells)
        predict_crossing(i, now, state, cells)
        enter_contact(i, now, NOT_SEARCHED, balls, cells)
        enqueue(i, now, balls, cells)
    return True
