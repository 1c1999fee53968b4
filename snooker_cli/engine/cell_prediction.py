"""What a ball among the cells does next: it leaves its cell, touches a ball or hits the wall.

Predictions use a free container's last place, and a wall that is nearer by a margin. Such a hit
comes too early, and is predicted exactly when it comes up. Only balls within the margin are
predicted exactly, and again after each push.
"""

import numpy as np

from snooker_cli.engine import cell_grid, contact
from snooker_cli.engine import cell_memory as cm
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import lowest_bit, nonnegative
from snooker_cli.engine.cell_memory import Cells, Margin
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.event_queue import update
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.kernel_state import CLOCK, Floats, Indices, State, U, V, X, Y
from snooker_cli.engine.prediction import BLOCK, time_to_wall

# Partners


@inlined
def parted_from(i: int, now: float, balls: Floats, tags: Indices, period: Floats | None) -> int:
    """The ball that ball i parted from in the last event of both and cannot meet, or NO_PARTNER."""
    k = tags[cm.FORMER, i]
    if k < 0 or tags[cm.FORMER, k] != i:
        return ks.NO_PARTNER
    if period is not None:  # they may meet through a side, once other images are the nearest
        x, y = balls[X, k] - balls[X, i], balls[Y, k] - balls[Y, i]
        age = now - balls[CLOCK, i]  # and of ball k: they had their last event together
        xn, yn = x + (balls[U, k] - balls[U, i]) * age, y + (balls[V, k] - balls[V, i]) * age
        across = np.rint(x / period[0]) != np.rint(xn / period[0])
        if across or np.rint(y / period[1]) != np.rint(yn / period[1]):
            return ks.NO_PARTNER
    return int(k)


@inlined
def nearest(
    i: int, now: float, found: int, delay: float, partner: int, state: State, cells: Cells
) -> tuple[float, int]:
    """When ball i first touches one of those found near, and which, if before ``delay``."""
    balls, near, period = state.balls, cells.near, state.period
    parted = parted_from(i, now, balls, cells.tags, period)
    x, y = ks.position(i, now, balls)
    u, v = balls[U, i], balls[V, i]
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
            d = ks.contact_distance(i, k, state.setup, state.radii)
            xk, yk = ks.position(k, now, balls)
            xk, yk = contact.nearest_image(xk - x, yk - y, period)
            uk, vk = balls[U, k], balls[V, k]
            may = contact.may_touch(xk, yk, uk - u, vk - v, d * d, twice) & (k != parted)
            mask |= int(may) << (place - start)
        while mask != 0:
            k = near[start + lowest_bit(mask)]
            mask &= mask - 1
            d = ks.contact_distance(i, k, state.setup, state.radii)
            xk, yk = ks.position(k, now, balls)
            xk, yk = contact.nearest_image(xk - x, yk - y, period)
            uk, vk = balls[U, k], balls[V, k]
            its_delay = contact.pair_delay(xk, yk, uk - u, vk - v, d * d)
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
    """Time until ball i hits the wall, s, and NO_PARTNER; or SEARCH_AGAIN if that may be early."""
    balls, links = state.balls, cells.links
    age = now - balls[CLOCK, i]
    x, y = ks.position(i, now, balls)
    u, v = balls[U, i], balls[V, i]
    if box is not None:
        r = ks.radius_of(i, state.setup, state.radii)
        return contact.side_delay(x, y, u, v, box[0] - r, box[1] - r), ks.NO_PARTNER
    at_wall = links[cm.BOUNCES, i] > 0
    if container is not None and margin is not None:
        reach = ks.wall_reach(i, state.setup, state.radii)
        near = max(reach - margin.place[cm.WIDTH], 0.0)
        xm, ym = x - margin.place[cm.CENTRE_X], y - margin.place[cm.CENTRE_Y]
        if not exact and xm * xm + ym * ym < near * near:
            return contact.wall_delay(xm, ym, u, v, near * near), ks.SEARCH_AGAIN
        if links[cm.BRINK, i] == 0:
            links[cm.BRINK, i] = 1
            margin.brink[margin.brinks[0]] = i
            margin.brinks[0] += 1
        at_wall = at_wall and container[CLOCK] == balls[CLOCK, i]
    if not at_wall:
        return time_to_wall(i, now, state, container), ks.NO_PARTNER
    x, y, u, v = ks.seen_from_container(balls[X, i], balls[Y, i], u, v, balls[CLOCK, i], container)
    return contact.chord_delay(x, y, u, v) - age, ks.NO_PARTNER


# Entries


@inlined
def enter_contact(i: int, time: float, partner: int, balls: Floats, cells: Cells) -> None:
    balls[cm.CONTACT_TIME, i] = time
    cells.links[cm.PARTNER, i] = partner
    if partner >= 0:
        cells.links[cm.PARTNER_EVENTS, i] = cells.tags[cm.EVENTS, partner]


@inlined
def enqueue(i: int, now: float, balls: Floats, cells: Cells) -> None:
    """Queue ball i's earliest event: its contact or a crossing; none is in the past."""
    time = min(balls[cm.CONTACT_TIME, i], balls[cm.CROSSING_TIME, i])
    update(i, max(time, now), cells.tree)


@inlined
def predict_crossing(i: int, now: float, state: State, cells: Cells) -> None:
    """Enter when ball i leaves its cell."""
    across, up = cell_grid.crossing_delays(i, now, state, cells)
    state.balls[cm.CROSSING_TIME, i] = now + min(across, up)


@inlined
def predict_contact(i: int, now: float, exact: bool, state: State, cells: Cells) -> None:
    """Enter ball i's earliest contact, with a ball or with the wall."""
    cell = nonnegative(cells.links[cm.CELL, i])
    delay, partner = NEVER, ks.SEARCH_AGAIN
    if cells.at_wall[cell]:
        delay, partner = wall_contact(
            i, now, exact, state, cells, state.box, state.container, cells.margin
        )
    column, row = cell_grid.column_and_row(cell, cells.mesh)
    found = 0
    for up in range(-1, 2):
        for right in range(-1, 2):
            found = cell_grid.collect(found, column + right, row + up, cells, state.period)
    delay, partner = nearest(i, now, found, delay, partner, state, cells)
    enter_contact(i, now + delay, partner, state.balls, cells)


@inlined
def cross(i: int, now: float, state: State, cells: Cells) -> bool:
    """Move ball i into the next cell and look at the far side; false if that cell is full."""
    balls, mesh = state.balls, cells.mesh
    sideways, upwards = cell_grid.crossing_delays(i, now, state, cells)
    across = sideways <= upwards
    w = balls[U, i] if across else balls[V, i]
    step = 1 if w > 0.0 else -1
    right, up = (step, 0) if across else (0, step)
    column, row = cell_grid.column_and_row(cells.links[cm.CELL, i], mesh)
    new = cell_grid.cell_at(column + right, row + up, mesh, state.period)
    if cells.occupancy[new] == cells.members.shape[1]:
        return False
    cell_grid.take_out(i, cells)
    cell_grid.put_into(i, new, cells)
    column, row = cell_grid.column_and_row(new, mesh)
    side = mesh.width if across else mesh.height
    balls[cm.CROSSING_TIME, i] = now + min(side / abs(w), upwards if across else sideways)
    before = balls[cm.CONTACT_TIME, i] - now
    delay, partner = before, ks.NO_PARTNER
    if cells.at_wall[new]:
        wall, wall_partner = wall_contact(
            i, now, False, state, cells, state.box, state.container, cells.margin
        )
        if wall < delay:
            delay, partner = wall, wall_partner
    found = 0
    for along in range(-1, 2):
        x, y = (right, along) if across else (along, up)
        found = cell_grid.collect(found, column + x, row + y, cells, state.period)
    delay, partner = nearest(i, now, found, delay, partner, state, cells)
    if delay < before:
        enter_contact(i, now + delay, partner, balls, cells)
    return True


@inlined
def push(
    now: float, state: State, cells: Cells, container: Floats | None, margin: Margin | None
) -> None:
    """Renew the margin's end of a free container with a new velocity; its brink searches again."""
    if container is None or margin is None:
        return
    place = margin.place
    x, y = container[X] - place[cm.CENTRE_X], container[Y] - place[cm.CENTRE_Y]
    square = place[cm.WIDTH] * place[cm.WIDTH]
    delay = contact.wall_delay(x, y, container[U], container[V], square)
    place[cm.UNTIL] = now + delay
    for k in range(margin.brinks[0]):
        i = margin.brink[k]
        cells.links[cm.BRINK, i] = 0
        enter_contact(i, now, ks.SEARCH_AGAIN, state.balls, cells)
        enqueue(i, now, state.balls, cells)
    margin.brinks[0] = 0


@inlined
def before_renewal(time: float, margin: Margin | None) -> float:
    """The time, or when a free container may leave its margin, if that is earlier; s."""
    if margin is None:
        return time
    return float(min(time, margin.place[cm.UNTIL]))


@kernel
def fill(now: float, state: State, cells: Cells) -> bool:
    """Sort all balls into cells, and have each predicted first of all; false if a cell is full."""
    balls, mesh = state.balls, cells.mesh
    cells.occupancy[:] = 0
    for i in range(balls.shape[1]):
        x, y = ks.position(i, now, balls)
        x, y = contact.nearest_image(x, y, state.period)
        column = min(max(int((x - mesh.left) / mesh.width), 0), mesh.columns - 1)
        row = min(max(int((y - mesh.bottom) / mesh.height), 0), mesh.rows - 1)
        cell = cell_grid.cell_at(column, row, mesh, None)
        if cells.occupancy[cell] == cells.members.shape[1]:
            return False
        cell_grid.put_into(i, cell, cells)
        predict_crossing(i, now, state, cells)
        enter_contact(i, now, ks.NOT_SEARCHED, balls, cells)
        enqueue(i, now, balls, cells)
    return True
