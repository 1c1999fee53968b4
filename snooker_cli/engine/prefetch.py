"""Fetches the memory of coming events ahead of time: a large gas waits for memory.

An event needs a chain of places, each of which gives the next one: nodes of the tree, the ball, the
members of the cells around it, its partner, the members of the cells around that. To wait for them
takes longer than the event itself. So 64 nodes of the tree are watched. Once the event of one is
near, its chain begins, and the chains before it move on by a link. So the memory of a link has been
on its way for some events once it is needed.
"""

from snooker_cli.engine.bit_tricks import fetch, lowest_bit, nonnegative
from snooker_cli.engine.cell_grid import crossing_delays
from snooker_cli.engine.cell_memory import CELL, CONTACT_TIME, PARTNER, Cells
from snooker_cli.engine.event_queue import STEP, WATCHED, earliest_below
from snooker_cli.engine.jit import inlined
from snooker_cli.engine.kernel_state import Floats, Integers, State, U, V

LARGE, EVENTS_AHEAD = 1 << 14, 12
"""Balls from which on fetching saves time, and events to look ahead, by measurement."""

LINK, MEMBERS = 2, 2
"""Levels of the tree that one link of a chain goes down, and balls fetched of each cell."""


# Elements of ``Neighbours.progress``: crossings since the kernel was called; then how far the
# chains of coming events have come: events looked at; nodes of the tree four and two levels above
# its leaves; a ball whose line and cell have been fetched; a cell whose members have been fetched;
# the ball's partner, whose cell has been fetched; a cell round it, whose members have been fetched.
CROSSINGS, TURNS, UPPER, LOWER, BALL, AROUND, BEYOND, BESIDE, PROGRESS = range(9)


def no_chains(bits: Integers, progress: Integers) -> None:
    """Empty the chains: every entry is ball 0."""
    leaves = len(bits) // 2
    progress[:] = 0
    progress[UPPER], progress[LOWER] = leaves >> 2 * LINK * STEP, leaves >> LINK * STEP


@inlined
def fetch_ahead(now: float, progress: Integers, since: Floats, state: State, cells: Cells) -> None:
    """Follow each event that is now a few events away, and move the others on by a link."""
    balls, links = state.balls, cells.links
    times, bits, followed = cells.tree
    leaves = len(bits) // 2
    if progress[TURNS] == 0:
        since[0] = now
    progress[TURNS] += 1
    upper, lower, ball = progress[UPPER], progress[LOWER], progress[BALL]
    around, partner, beside = progress[AROUND], progress[BEYOND], progress[BESIDE]
    begun, turns = since[0], progress[TURNS]
    late = now + (now - begun) / turns * EVENTS_AHEAD
    nodes, mask = 1 << WATCHED * STEP, 0
    for place in range(1 << WATCHED * STEP):
        time = times[nodes + place]
        mask |= int((time < late) & (time != followed[place])) << place
    down = lowest_bit(leaves) // STEP - WATCHED - 2 * LINK
    while mask != 0:
        fetch_members(beside, balls, cells)
        beside = nonnegative(links[CELL, partner])
        fetch_cells(beside, cells)
        fetch_members(around, balls, cells)
        around = cell_to_search(ball, late, now, state, cells)
        fetch_cells(around, cells)
        partner = nonnegative(max(links[PARTNER, ball], 0))
        fetch_ball(partner, state, cells)
        for level in range(2 * LINK):  # the nodes that its new time climbs first
            fetch(bits, (leaves + partner) >> level * STEP)
        ball = nonnegative(earliest_below(lower, LINK, bits) - leaves)
        fetch_ball(ball, state, cells)
        lower = earliest_below(upper, LINK, bits)
        fetch_below(lower, bits)
        place = lowest_bit(mask)
        followed[place] = times[nodes + place]
        upper = earliest_below(nodes + place, down, bits)
        fetch_below(upper, bits)
        mask &= mask - 1
    progress[UPPER], progress[LOWER], progress[BALL] = upper, lower, ball
    progress[AROUND], progress[BEYOND], progress[BESIDE] = around, partner, beside


@inlined
def cell_to_search(i: int, late: float, now: float, state: State, cells: Cells) -> int:
    """The cell, not across a periodic box's side, round which ball i will look for partners."""
    cell = int(cells.links[CELL, i])
    if state.balls[CONTACT_TIME, i] > late:
        across, up = crossing_delays(i, now, state, cells)
        if across <= up:
            cell += 1 if state.balls[U, i] > 0.0 else -1
        else:
            cell += (1 if state.balls[V, i] > 0.0 else -1) << cells.mesh.shift
    return nonnegative(min(max(cell, 0), len(cells.occupancy) - 1))


@inlined
def fetch_ball(i: int, state: State, cells: Cells) -> None:
    fetch(state.balls, i * state.balls.shape[0])
    fetch(cells.links, i * cells.links.shape[0])


@inlined
def fetch_below(node: int, bits: Integers) -> None:
    """Fetch the nodes of two levels below one: four, and sixteen in two lines."""
    fetch(bits, node << STEP)
    fetch(bits, node << 2 * STEP)
    fetch(bits, (node << 2 * STEP) + 8)


@inlined
def fetch_cells(cell: int, cells: Cells) -> None:
    """Fetch the lists of members of a cell and of the eight around it."""
    members, occupancy = cells.members, cells.occupancy
    fetch(cells.at_wall, cell)
    for up in range(-1, 2):
        above = cell + (up << cells.mesh.shift)
        middle = nonnegative(min(max(above, 1), len(occupancy) - 2))
        fetch(members, (middle - 1) * members.shape[1])
        fetch(members, (middle + 2) * members.shape[1] - 1)
        fetch(occupancy, middle)


@inlined
def fetch_members(cell: int, balls: Floats, cells: Cells) -> None:
    """Fetch the balls of a cell and of the eight around it."""
    for up in range(-1, 2):
        for right in range(-1, 2):
            beside = cell + (up << cells.mesh.shift) + right
            beside = nonnegative(min(max(beside, 0), len(cells.occupancy) - 1))
            for place in range(MEMBERS):
                fetch(balls, nonnegative(cells.members[beside, place]) * balls.shape[0])
