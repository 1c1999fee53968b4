"""Many balls: cells to find partners in, and a tournament tree for what comes next.

A ball looks for partners in its own and the eight cells around, and at a crossing in the three on
the far side (Rapaport, J. Comput. Phys. 34, 184 (1980)). A crossing changes neither position nor
clock: a replay needs no cells. For the rest see docs/how-it-works.md.
"""

from typing import Any, NamedTuple

import numpy as np

from snooker_cli.engine import cell_grid, clock, contact, prediction
from snooker_cli.engine import cell_memory as cm
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import lowest_bit, nonnegative
from snooker_cli.engine.cell_memory import Cells
from snooker_cli.engine.collision import collide, count, record
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.event_queue import first, update
from snooker_cli.engine.jit import by_class, inlined, kernel
from snooker_cli.engine.kernel_state import CLOCK, Floats, Indices, Recorded, State, U, V, X, Y
from snooker_cli.engine.prediction import BLOCK, delay_to_wall
from snooker_cli.engine.prefetch import LARGE, fetch_ahead, no_chains
from snooker_cli.engine.sampling import Grid, next_sample, sample_until

CROSSINGS_AT_ONCE = 1_000_000
"""Crossings after which the kernel returns, so that a repeat with few events can be stopped too."""

# Partners


@by_class
def same_image(boundary: Any, x: float, y: float, new_x: float, new_y: float) -> bool:
    """Whether two offsets of a ball have the same image of it as the nearest."""
    return True


@inlined
def parted_from(i: int, now: float, balls: Floats, tags: Indices, boundary: Any) -> int:
    """The ball that ball i parted from in the last event of both and cannot meet, or NO_PARTNER."""
    k = tags[cm.FORMER, i]
    if k < 0 or tags[cm.FORMER, k] != i:
        return ks.NO_PARTNER
    # Of two that part, other images may become the nearest, and these may meet.
    x, y = balls[X, k] - balls[X, i], balls[Y, k] - balls[Y, i]
    age = now - balls[CLOCK, i]  # and of ball k: they had their last event together
    xn, yn = x + (balls[U, k] - balls[U, i]) * age, y + (balls[V, k] - balls[V, i]) * age
    if not same_image(boundary, x, y, xn, yn):
        return ks.NO_PARTNER
    return int(k)


@inlined
def nearest(
    i: int, now: float, gathered: int, delay: float, partner: int, state: State, cells: Cells
) -> tuple[float, int]:
    """When ball i first touches one of those gathered near, and which, if before ``delay``."""
    balls, near, boundary = state.balls, cells.near, state.boundary
    parted = parted_from(i, now, balls, cells.tags, boundary)
    x, y = ks.position(i, now, balls)
    u, v = balls[U, i], balls[V, i]
    # As many as fill vectors: ball i, which never meets itself, makes up for what is missing.
    gathered = nonnegative(gathered)
    for place in range(3):
        near[gathered + place] = i
    gathered = (gathered + 3) & ~3
    for start in range(0, gathered, BLOCK):
        twice = 2.0 * delay
        mask = 0
        for place in range(start, min(start + BLOCK, gathered)):
            k = near[place]
            d = ks.contact_distance(state.sizes, i, k)
            xk, yk = ks.position(k, now, balls)
            xk, yk = ks.nearest_image(boundary, xk - x, yk - y)
            uk, vk = balls[U, k], balls[V, k]
            may = contact.may_touch(xk, yk, uk - u, vk - v, d * d, twice) & (k != parted)
            mask |= int(may) << (place - start)
        while mask != 0:
            k = near[start + lowest_bit(mask)]
            mask &= mask - 1
            d = ks.contact_distance(state.sizes, i, k)
            xk, yk = ks.position(k, now, balls)
            xk, yk = ks.nearest_image(boundary, xk - x, yk - y)
            uk, vk = balls[U, k], balls[V, k]
            its_delay = contact.pair_delay(xk, yk, uk - u, vk - v, d * d)
            if its_delay < delay:
                delay, partner = its_delay, k
    return delay, partner


# The wall


@by_class
def wall_contact(
    margin: Any, i: int, now: float, exact: bool, state: State, cells: Cells
) -> tuple[float, int]:
    """Time until ball i hits the wall, s, and NO_PARTNER; or SEARCH_AGAIN if that may be early."""
    left_wall = bool(cells.links[cm.BOUNCES, i] > 0)
    return delay_to_wall(state.boundary, i, now, left_wall, state), ks.NO_PARTNER


@by_class
def push(margin: Any, now: float, state: State, cells: Cells) -> None:
    """Predict again what the new velocity of a free container changes."""


@by_class
def before_renewal(margin: Any, time: float) -> float:
    """The time, or when a free container may leave its margin, if that is earlier; s."""
    return time


# Elements of ``Margin.place``.
CENTRE_X, CENTRE_Y, WIDTH, UNTIL = range(4)


class Margin(NamedTuple):
    """Where a free container may be until everything is predicted again.

    Predictions use its place at the last renewal, and a wall that is nearer by the margin. Such a
    hit comes too early, and is predicted exactly when it comes up. Only balls within the margin,
    which are at the brink, are predicted exactly at once, and again after each push.

    place : (4,), the centre's coordinates (m), how far it may be from there (m), until when (s)
    brink : (*N*,), the balls whose hit has been predicted exactly since the last push
    brinks : (1,), how many they are
    """

    place: Floats
    brink: Indices
    brinks: Indices

    def wall_contact(
        self, i: int, now: float, exact: bool, state: State, cells: Cells
    ) -> tuple[float, int]:
        links, place = cells.links, self.place
        x, y = ks.position(i, now, state.balls)
        x, y = x - place[CENTRE_X], y - place[CENTRE_Y]
        reach = state.boundary.radius - ks.radius_of(state.sizes, i)
        near = max(reach - place[WIDTH], 0.0)
        if not exact and x * x + y * y < near * near:
            u, v = state.balls[U, i], state.balls[V, i]
            return contact.wall_delay(x, y, u, v, near * near), ks.SEARCH_AGAIN
        if links[cm.BRINK, i] == 0:
            links[cm.BRINK, i] = 1
            self.brink[self.brinks[0]] = i
            self.brinks[0] += 1
        left_wall = bool(links[cm.BOUNCES, i] > 0)
        return delay_to_wall(state.boundary, i, now, left_wall, state), ks.NO_PARTNER

    def push(self, now: float, state: State, cells: Cells) -> None:
        place, motion = self.place, state.boundary.motion
        x, y = motion[X] - place[CENTRE_X], motion[Y] - place[CENTRE_Y]
        square = place[WIDTH] * place[WIDTH]
        place[UNTIL] = now + contact.wall_delay(x, y, motion[U], motion[V], square)
        for k in range(self.brinks[0]):
            i = self.brink[k]
            cells.links[cm.BRINK, i] = 0
            enter_contact(i, now, ks.SEARCH_AGAIN, state.balls, cells)
            enqueue(i, now, state.balls, cells)
        self.brinks[0] = 0

    def before_renewal(self, time: float) -> float:
        return float(min(time, self.place[UNTIL]))


def with_margin(cells: Cells, motion: Floats, now: float) -> Cells:
    """The cells round the place of a free container at a time (s), with a margin."""
    mesh, width = cells.mesh, cell_grid.MARGIN * cells.mesh.width
    x, y, u, v, clock = motion
    x, y = x + u * (now - clock), y + v * (now - clock)
    until = now + contact.wall_delay(0.0, 0.0, u, v, width * width)
    return cells._replace(
        mesh=mesh._replace(
            left=x - 0.5 * mesh.columns * mesh.width, bottom=y - 0.5 * mesh.rows * mesh.height
        ),
        margin=Margin(
            place=np.array([x, y, width, until]),
            brink=np.zeros(cells.links.shape[1], dtype=np.int32),
            brinks=np.zeros(1, dtype=np.int32),
        ),
    )


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
        delay, partner = wall_contact(cells.margin, i, now, exact, state, cells)
    column, row = cell_grid.column_and_row(cell, cells.mesh)
    gathered = 0
    for up in range(-1, 2):
        for right in range(-1, 2):
            gathered = cell_grid.collect(gathered, column + right, row + up, cells, state.boundary)
    delay, partner = nearest(i, now, gathered, delay, partner, state, cells)
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
    new = cell_grid.cell_at(column + right, row + up, mesh, state.boundary)
    if cells.occupancy[new] == cells.members.shape[1]:
        return False
    cell_grid.take_out(i, cells)
    cell_grid.put_into(i, new, cells)
    column, row = cell_grid.column_and_row(new, mesh)
    side = mesh.width if across else mesh.height
    balls[cm.CROSSING_TIME, i] = now + min(side / abs(w), upwards if across else sideways)
    before = balls[cm.CONTACT_TIME, i] - now
    delay, partner = before, ks.NO_PARTNER  # entered only if something is earlier
    if cells.at_wall[new]:
        wall, wall_partner = wall_contact(cells.margin, i, now, False, state, cells)
        if wall < delay:
            delay, partner = wall, wall_partner
    gathered = 0
    for along in range(-1, 2):
        x, y = (right, along) if across else (along, up)
        gathered = cell_grid.collect(gathered, column + x, row + y, cells, state.boundary)
    delay, partner = nearest(i, now, gathered, delay, partner, state, cells)
    if delay < before:
        enter_contact(i, now + delay, partner, balls, cells)
    return True


@kernel
def fill(now: float, state: State, cells: Cells) -> bool:
    """Sort all balls into cells, and have each predicted first of all; false if a cell is full."""
    balls, mesh = state.balls, cells.mesh
    cells.occupancy[:] = 0
    for i in range(balls.shape[1]):
        x, y = ks.position(i, now, balls)
        x, y = ks.nearest_image(state.boundary, x, y)
        column = min(max(int((x - mesh.left) / mesh.width), 0), mesh.columns - 1)
        row = min(max(int((y - mesh.bottom) / mesh.height), 0), mesh.rows - 1)
        cell = cell_grid.cell_at(column, row, mesh, state.boundary)
        if cells.occupancy[cell] == cells.members.shape[1]:
            return False
        cell_grid.put_into(i, cell, cells)
        predict_crossing(i, now, state, cells)
        enter_contact(i, now, ks.NOT_SEARCHED, balls, cells)
        enqueue(i, now, balls, cells)
    return True


# Events


@inlined
def is_stale(i: int, j: int, cells: Cells) -> bool:
    """Whether ball i has no contact now: its partner had an event since, or it found none."""
    if j >= 0:
        return bool(cells.links[cm.PARTNER_EVENTS, i] != cells.tags[cm.EVENTS, j])
    return j != ks.NO_PARTNER


@inlined
def after_hit(i: int, j: int, now: float, state: State, cells: Cells) -> bool:
    """Note a collision of ball i with j, or with the wall; whether i is trapped there for good."""
    links, tags, setup = cells.links, cells.tags, state.setup
    tags[cm.EVENTS, i] += 1
    tags[cm.FORMER, i] = j
    if j != ks.NO_PARTNER:
        tags[cm.EVENTS, j] += 1
        tags[cm.FORMER, j] = i
        links[cm.BOUNCES, i] = links[cm.BOUNCES, j] = 0
        return False
    links[cm.BOUNCES, i] += 1
    push(cells.margin, now, state, cells)
    bounces = links[cm.BOUNCES, i]
    often = bounces > 1 or prediction.may_stay(setup.wall_law)
    if prediction.is_endless(setup.wall_law, bounces):
        return True
    if setup.traps and often and bounces & (bounces - 1) == 0:  # after 2, 4, 8 … bounces
        lasts = prediction.bouncing_time(i, now, state)
        return prediction.is_trapped(i, now, lasts, False, state)
    return False


@inlined
def predict(i: int, j: int, happened: bool, now: float, state: State, cells: Cells) -> None:
    """Predict what ball i, and after a collision ball j, do next.

    The loop predicts here alone, because copies of this code cost time.
    """
    for turn in range(2 if happened and j != ks.NO_PARTNER else 1):
        k = nonnegative(i if turn == 0 else j)
        if happened:
            predict_crossing(k, now, state, cells)
        # SEARCH_AGAIN: a lower bound of a free wall's hit has come up; now find it exactly.
        predict_contact(k, now, j == ks.SEARCH_AGAIN, state, cells)
        enqueue(k, now, state.balls, cells)


# What the loop does, an event or a crossing in each turn:
#
#   i, now = the ball whose contact or crossing comes first: the root of the tournament tree
#   stop if there is none, or if the time limit comes first, or if a free container left its margin
#   a crossing: move i into the next cell, look for partners on the far side, take the next turn
#   j = the partner of i's contact, or the wall; j is stale if it has had another event since
#   unless j is stale: fill the rows of the summary up to now; bring i and j to now, change their
#       velocities; count and record the event; push a free container
#   predict the next crossing and contact of i and j; only the contact of i if j is stale
#   stop if i is trapped at the wall, or if the clock stands still
@kernel
def advance(state: State, cells: Cells, recorded: Recorded, grid: Grid | None, limit: int) -> int:
    """Simulate at most ``limit`` events; why it stopped. Ties go by time and ball."""
    balls, tree = state.balls, cells.tree
    large, chains = balls.shape[1] >= LARGE, no_chains(tree.bits)
    crossings = filled = 0
    sample_time = NEVER
    if grid is not None:
        sample_time = next_sample(grid, state.sums)
    while filled < limit:
        i = first(tree.bits)
        now = tree.times[1]
        valid_until = before_renewal(cells.margin, now)
        if valid_until == NEVER:
            return clock.NOTHING_LEFT
        if valid_until > state.sums[ks.TIME_LIMIT]:
            return clock.TIME
        if valid_until < now:
            return clock.OUT_OF_MARGIN
        if large:
            chains = fetch_ahead(now, chains, state, cells)
        if balls[cm.CONTACT_TIME, i] > now:
            if crossings == CROSSINGS_AT_ONCE:
                return clock.FULL
            crossings += 1
            if not cross(i, now, state, cells):
                return clock.CELL_FULL
            enqueue(i, now, balls, cells)
            continue
        j = cells.links[cm.PARTNER, i]
        trapped, happens = False, not is_stale(i, j, cells)
        if happens:
            if grid is not None and now > sample_time:
                sample_time = sample_until(now, grid, state)
            clock.begin_event(i, j, now, state)
            size = collide(state.account, i, j, now, state)
            count(i, j, size, state)
            if grid is None:
                record(recorded, filled, i, j, now, size, state.labels)
            filled += 1
            trapped = after_hit(i, j, now, state, cells)
        predict(i, j, happens, now, state, cells)
        if trapped:
            return clock.WALL_TRAP
        if clock.has_collapsed(state):
            return clock.COLLAPSE
    return clock.FULL
