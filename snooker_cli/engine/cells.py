"""The search for many balls: in cells, and in the order of a tournament tree.

A ball looks for partners in its own and the eight cells around, and at a crossing in the three on
the far side (Rapaport, J. Comput. Phys. 34, 184 (1980)). A crossing changes neither position nor
clock. For the rest see docs/how-it-works.md.
"""

from typing import NamedTuple

import numpy as np

from snooker_cli.engine import cell_grid, clock, contact, prediction
from snooker_cli.engine import cell_memory as cm
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import earlier, lowest_bit, nonnegative
from snooker_cli.engine.cell_memory import Cells, Margin
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.event_loop import STOPS, Search
from snooker_cli.engine.event_queue import first, next_equal, update
from snooker_cli.engine.everyone import first_comes
from snooker_cli.engine.jit import helper, inlined, kernel
from snooker_cli.engine.kernel_state import (
    CLOCK,
    EVENTS,
    Floats,
    Indices,
    Integers,
    State,
    U,
    V,
    X,
    Y,
)
from snooker_cli.engine.prediction import BLOCK, next_hit
from snooker_cli.engine.prefetch import CROSSINGS, LARGE, fetch_ahead

CROSSINGS_AT_ONCE = 1_000_000
"""Crossings after which the kernel returns, so that a repeat with few events can be stopped too."""


class Neighbours(
    Search, NamedTuple("Neighbours", [("cells", Cells), ("progress", Integers), ("begun", Floats)])
):
    """What each ball does next. The event loop calls its methods, as those of ``Everyone``.

    progress : (PROGRESS,), crossings since the kernel was called, and how far ``prefetch`` is
    begun : (1,), s, since when that looks ahead
    """

    def next_entry(self, state: State) -> tuple[int, int, float]:
        balls, cells, tree = state.balls, self.cells, self.cells.tree
        while True:
            i, second, more = first(tree.bits)
            now = tree.times[1]
            valid_until = cells.margin.before_renewal(now)
            if valid_until == NEVER or valid_until > state.sums[ks.TIME_LIMIT]:
                return i, ks.SEARCH_AGAIN, valid_until
            if valid_until < now:
                return i, STOPS - clock.OUT_OF_MARGIN, now
            if second >= 0 and (more or not is_same_contact(i, second, now, state, cells)):
                i = first_of_equal(i, now, state, cells)
            if balls.shape[1] >= LARGE:
                fetch_ahead(now, self.progress, self.begun, state, cells)
            if balls[cm.CONTACT_TIME, i] <= now:
                return i, certain_partner(i, state, cells), now
            if self.progress[CROSSINGS] == CROSSINGS_AT_ONCE:
                return i, STOPS - clock.FULL, now
            self.progress[CROSSINGS] += 1
            if not cross(i, now, state, cells):
                return i, STOPS - clock.CELL_FULL, now
            enqueue(i, balls, cells)

    def predict(self, i: int, j: int, happened: bool, now: float, state: State) -> None:
        cells = self.cells
        # A lower bound of a free wall's hit has come up; now find it exactly.
        exact = not happened and cells.links[cm.PARTNER, i] == ks.SEARCH_AGAIN
        if happened and j == ks.NO_PARTNER:
            cells.margin.push(now, state, cells)
        # One loop, because copies of this code cost time.
        for turn in range(2 if happened and j >= 0 else 1):
            k = nonnegative(i if turn == 0 else j)
            if happened:
                predict_crossing(k, now, state, cells)
            predict_contact(k, now, exact, state, cells)
            enqueue(k, state.balls, cells)


# Partners


@inlined
def nearest(
    i: int, now: float, gathered: int, time: float, partner: int, state: State, cells: Cells
) -> tuple[float, int]:
    """When ball i first touches one of those gathered near, s, and which, if before ``time``.

    Of contacts at one time, that with the lesser ball in the scene's numbers is first.
    """
    balls, near, boundary = state.balls, cells.near, state.boundary
    parted = prediction.cannot_meet(i, now, state)
    x, y, u, v, own = balls[X, i], balls[Y, i], balls[U, i], balls[V, i], balls[CLOCK, i]
    # As many as fill vectors; bits of what is too many are cleared.
    gathered = nonnegative(gathered)
    for place in range(3):
        near[gathered + place] = i
    filled = (gathered + 3) & ~3
    several = False
    for start in range(0, filled, BLOCK):
        mask = 0
        for place in range(start, min(start + BLOCK, filled)):
            k = near[place]
            d, its = ks.contact_distance(state.sizes, i, k), balls[CLOCK, k]
            since = boundary.filter_time(now, own if own > its else its)
            own_age, later = since - own, now - since
            xk, yk = ks.position(k, since, balls)
            uk, vk = balls[U, k] - u, balls[V, k] - v
            xk, yk = boundary.image_nearest_at(
                xk - (x + u * own_age), yk - (y + v * own_age), uk * later, vk * later
            )
            twice = prediction.twice_ahead(time, since)
            square = boundary.filter_square(d)
            may = contact.may_touch(xk, yk, uk, vk, square, twice) & (k != parted)
            mask |= int(may) << (place - start)
        mask &= (1 << min(gathered - start, BLOCK)) - 1
        while mask != 0:
            k = near[start + lowest_bit(mask)]
            mask &= mask - 1
            its_time = prediction.contact_time(i, k, now, state)
            several |= its_time == time
            if its_time < time:
                time, partner = its_time, int(k)
        if several and partner >= 0:
            partner = least_of_equal(i, now, gathered, time, partner, state, cells)
    return time, partner


@helper
def least_of_equal(
    i: int, now: float, gathered: int, time: float, partner: int, state: State, cells: Cells
) -> int:
    """Of a partner and gathered balls that touch ball i at a time, s, the least by number."""
    labels, parted = state.labels, prediction.cannot_meet(i, now, state)
    for place in range(gathered):
        k = int(cells.near[place])
        is_less = k != parted and ks.label_of(k, labels) < ks.label_of(partner, labels)
        if is_less and prediction.contact_time(i, k, now, state) == time:
            partner = k
    return partner


# The wall


# Elements of ``MovingMargin.region``.
CENTRE_X, CENTRE_Y, WIDTH, UNTIL = range(4)


class MovingMargin(
    Margin,
    NamedTuple("MovingMargin", [("region", Floats), ("brink", Indices), ("brinks", Indices)]),
):
    """Where a free container may be until everything is predicted again.

    Predictions use its place at the last renewal, and a wall that is nearer by the margin, and a
    little more for rounding. Such a hit comes too early, and is predicted exactly when it comes up.
    Only balls within the margin, which are at the brink, are predicted exactly at once, and again
    after each push.

    region : (4,), the centre's coordinates (m), how far it may be from there (m), until when (s)
    brink : (*N*,), the balls whose hit has been predicted exactly since the last push
    brinks : (1,), how many they are
    """

    def wall_contact(
        self, i: int, now: float, exact: bool, state: State, cells: Cells
    ) -> tuple[float, int]:
        links, region = cells.links, self.region
        x, y = ks.position(i, now, state.balls)
        x, y = x - region[CENTRE_X], y - region[CENTRE_Y]
        reach = state.boundary.radius - state.sizes.radius_of(i)
        near = max(reach - region[WIDTH] * (1.0 + 2.0**-20), 0.0)
        if not exact and x * x + y * y < near * near:
            u, v = state.balls[U, i], state.balls[V, i]
            return now + contact.wall_delay(x, y, u, v, near * near), ks.SEARCH_AGAIN
        if links[cm.BRINK, i] == 0:
            links[cm.BRINK, i] = 1
            self.brink[self.brinks[0]] = i
            self.brinks[0] += 1
        return next_hit(i, state), ks.NO_PARTNER

    def push(self, now: float, state: State, cells: Cells) -> None:
        region, motion = self.region, state.boundary.motion
        x, y = motion[X] - region[CENTRE_X], motion[Y] - region[CENTRE_Y]
        square = region[WIDTH] * region[WIDTH]
        region[UNTIL] = now + contact.wall_delay(x, y, motion[U], motion[V], square)
        for k in range(self.brinks[0]):
            i = self.brink[k]
            cells.links[cm.BRINK, i] = 0
            enter_contact(i, now, ks.SEARCH_AGAIN, state, cells)
            enqueue(i, state.balls, cells)
        self.brinks[0] = 0

    def before_renewal(self, time: float) -> float:
        return float(min(time, self.region[UNTIL]))


def with_margin(cells: Cells, motion: Floats, now: float) -> Cells:
    """The cells round the place of a free container at a time (s), with a margin."""
    mesh, width = cells.mesh, cell_grid.MARGIN * cells.mesh.width
    x, y, u, v, clock = motion[: ks.BALL_ROWS]
    x, y = x + u * (now - clock), y + v * (now - clock)
    until = now + contact.wall_delay(0.0, 0.0, u, v, width * width)
    return cells._replace(
        mesh=mesh._replace(
            left=x - 0.5 * mesh.columns * mesh.width, bottom=y - 0.5 * mesh.rows * mesh.height
        ),
        margin=MovingMargin(
            region=np.array([x, y, width, until]),
            brink=np.zeros(cells.links.shape[1], dtype=np.int32),
            brinks=np.zeros(1, dtype=np.int32),
        ),
    )


# Entries


@inlined
def enter_contact(i: int, time: float, partner: int, state: State, cells: Cells) -> None:
    state.balls[cm.CONTACT_TIME, i] = time
    cells.links[cm.PARTNER, i] = partner
    if partner >= 0:
        cells.links[cm.PARTNER_EVENTS, i] = state.history[EVENTS, partner]


@inlined
def certain_partner(i: int, state: State, cells: Cells) -> int:
    """The ball or the wall of ball i's contact; SEARCH_AGAIN if it had an event, or is unknown."""
    j = int(cells.links[cm.PARTNER, i])
    if j >= 0:
        is_fresh = cells.links[cm.PARTNER_EVENTS, i] == state.history[EVENTS, j]
        return j if is_fresh else ks.SEARCH_AGAIN
    return max(j, ks.SEARCH_AGAIN)


@inlined
def enqueue(i: int, balls: Floats, cells: Cells) -> None:
    """Queue ball i's earliest event: its contact or a crossing."""
    update(i, earlier(balls[cm.CONTACT_TIME, i], balls[cm.CROSSING_TIME, i]), cells.tree)


@inlined
def is_same_contact(i: int, k: int, now: float, state: State, cells: Cells) -> bool:
    """Whether balls i and k, whose entries have one time, have each other as partners."""
    balls, links = state.balls, cells.links
    both = links[cm.PARTNER, i] == k and links[cm.PARTNER, k] == i
    return bool(both and balls[cm.CONTACT_TIME, i] <= now and balls[cm.CONTACT_TIME, k] <= now)


@helper
def first_of_equal(i: int, now: float, state: State, cells: Cells) -> int:
    """Of the balls with the earliest time, of which ball i is the first, that which is first.

    That is one which crosses, or has to search again, if there is any. Else ties go by: the wall,
    the lesser ball, the greater ball, in the scene's numbers.
    """
    labels, bits = state.labels, cells.tree.bits
    best, lesser, greater, k = i, ks.NO_LIMIT, ks.NO_LIMIT, i
    while k >= 0:
        if state.balls[cm.CONTACT_TIME, k] > now:
            return k
        partner = certain_partner(k, state, cells)
        if partner == ks.SEARCH_AGAIN:
            return k
        a, b = ks.label_of(k, labels), ks.label_of(partner, labels)
        if b >= 0:
            a, b = min(a, b), max(a, b)
        if first_comes(a, b, lesser, greater):
            best, lesser, greater = k, a, b
        k = next_equal(k, bits)
    return best


@inlined
def predict_crossing(i: int, now: float, state: State, cells: Cells) -> None:
    """Enter when ball i leaves its cell; not before now."""
    across, up = cell_grid.crossing_delays(i, now, state, cells)
    state.balls[cm.CROSSING_TIME, i] = now + max(min(across, up), 0.0)


@inlined
def predict_contact(i: int, now: float, exact: bool, state: State, cells: Cells) -> None:
    """Enter ball i's earliest contact, with a ball or with the wall."""
    cell = nonnegative(cells.links[cm.CELL, i])
    time, partner = NEVER, ks.SEARCH_AGAIN
    if cells.at_wall[cell]:
        time, partner = cells.margin.wall_contact(i, now, exact, state, cells)
    column, row = cell_grid.column_and_row(cell, cells.mesh)
    gathered, own = 0, 0
    for up in range(-1, 2):
        for right in range(-1, 2):
            if up == 0 and right == 0:
                own = gathered + cells.links[cm.PLACE, i]
            gathered = cell_grid.collect(gathered, column + right, row + up, cells, state.boundary)
    # All but ball i itself.
    gathered -= 1
    cells.near[nonnegative(own)] = cells.near[nonnegative(gathered)]
    time, partner = nearest(i, now, gathered, time, partner, state, cells)
    enter_contact(i, time, partner, state, cells)


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
    delay = min(side / abs(w), upwards if across else sideways)
    balls[cm.CROSSING_TIME, i] = now + max(delay, 0.0)
    former_time, former = balls[cm.CONTACT_TIME, i], int(cells.links[cm.PARTNER, i])
    time, partner = former_time, former  # entered only if something else is first
    if cells.at_wall[new]:
        wall, wall_partner = cells.margin.wall_contact(i, now, False, state, cells)
        if wall <= time:
            time, partner = wall, wall_partner
    gathered = 0
    for along in range(-1, 2):
        x, y = (right, along) if across else (along, up)
        gathered = cell_grid.collect(gathered, column + x, row + y, cells, state.boundary)
    time, partner = nearest(i, now, gathered, time, partner, state, cells)
    if time < former_time or partner != former:
        enter_contact(i, time, partner, state, cells)
    return True


@kernel
def fill(now: float, state: State, cells: Cells) -> bool:
    """Sort all balls into cells, and have each predicted first of all; false if a cell is full."""
    balls, mesh = state.balls, cells.mesh
    cells.occupancy[:] = 0
    for i in range(balls.shape[1]):
        x, y = ks.position(i, now, balls)
        x, y = state.boundary.nearest_image(x, y)
        column = min(max(int((x - mesh.left) / mesh.width), 0), mesh.columns - 1)
        row = min(max(int((y - mesh.bottom) / mesh.height), 0), mesh.rows - 1)
        cell = cell_grid.cell_at(column, row, mesh, state.boundary)
        if cells.occupancy[cell] == cells.members.shape[1]:
            return False
        cell_grid.put_into(i, cell, cells)
        predict_crossing(i, now, state, cells)
        enter_contact(i, now, ks.NOT_SEARCHED, state, cells)
        enqueue(i, balls, cells)
    return True
