"""The order of events for many balls: a tournament tree over one time per ball.

Node k holds the earliest of its children 4k to 4k + 3, which lie in one line of the processor's
cache. Ball i is leaf ``leaves + i``, and node 1 the winner. An update climbs only as far as it
changes anything. Nonnegative times sort like their bits read as integers, which compare faster.
"""

from typing import TypeAlias

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.cell_grid import CELL, CONTACT_TIME, PARTNER, Cells, Tree, crossing_delays
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.jit import fetch, inlined, lowest_bit
from snooker_cli.engine.kernel_state import Floats, Integers, State, U, V

STEP = 2  # binary digits of a place that a level decides

CHILDREN = 1 << STEP

WATCHED = 3  # the level, from the top, whose nodes are watched for coming events


def new_tree(number: int) -> Tree:
    """A tree with a leaf per ball; all times are infinite."""
    leaves = CHILDREN
    while leaves < number:
        leaves *= CHILDREN
    times = ks.aligned_zeros(2 * leaves)
    times[:] = NEVER
    return Tree(times, times.view(np.int64), np.zeros(1 << WATCHED * STEP))


@inlined
def lesser(a: int, b: int) -> int:
    """The lesser of two that are not negative, without a branch that would often be mistaken."""
    over = b - a
    return a + (over & (over >> 63))


@inlined
def update(i: int, time: float, tree: Tree) -> None:
    """Give ball i another time."""
    bits = tree.bits
    k = ks.nonnegative(len(bits) // 2 + int(i))
    tree.times[k] = time
    while k > 1:
        k >>= STEP
        child = k << STEP
        least = lesser(
            lesser(bits[child], bits[child + 1]), lesser(bits[child + 2], bits[child + 3])
        )
        if bits[k] == least:
            break
        bits[k] = least


@inlined
def first(bits: Integers) -> int:
    """The ball whose time is earliest; of several, the first."""
    leaves = len(bits) // 2
    return ks.nonnegative(earliest_below(1, lowest_bit(leaves) // STEP, bits) - leaves)


@inlined
def earliest_below(node: int, levels: int, bits: Integers) -> int:
    """Of the nodes this many levels below one, that with the earliest time."""
    least = bits[node]
    k = node
    for _ in range(levels):
        k = ks.nonnegative(k << STEP)
        mask = 0
        for place in range(CHILDREN):
            mask |= int(bits[k + place] == least) << place
        k += lowest_bit(mask)
    return ks.nonnegative(k)


# A large gas waits for memory. So the kernel fetches the memory of coming events ahead of time.

LARGE, EVENTS_AHEAD = 1 << 14, 12
"""Balls from which on fetching saves time, and events to look ahead, by measurement."""

LINK, MEMBERS = 2, 2
"""Levels of the tree that one link of a chain goes down, and balls fetched of each cell."""


Chains: TypeAlias = tuple[int, float, int, int, int, int, int, int]
"""How far the fetching of memory for coming events has come.

First the events since the chain began, and when that was (s). Then two nodes of the tree, four and
two levels above its leaves; a ball whose line and cell are fetched; a cell whose members are; the
ball's partner, whose cell is fetched; and a cell round it whose members are.
"""


@inlined
def no_chains(bits: Integers) -> Chains:
    """Empty chains: every entry is ball 0."""
    leaves = len(bits) // 2
    return 0, 0.0, leaves >> 2 * LINK * STEP, leaves >> LINK * STEP, 0, 0, 0, 0


@inlined
def fetch_ahead(now: float, chains: Chains, state: State, cells: Cells) -> Chains:
    """Follow each event that is now a few events away, and move the others on by a link."""
    balls, links = state.balls, cells.links
    times, bits, followed = cells.tree
    leaves = len(bits) // 2
    turns, begun, upper, lower, ball, around, partner, beside = chains
    begun = now if turns == 0 else begun
    turns += 1
    late = now + (now - begun) / turns * EVENTS_AHEAD
    nodes, mask = 1 << WATCHED * STEP, 0
    for place in range(1 << WATCHED * STEP):
        time = times[nodes + place]
        mask |= int((time < late) & (time != followed[place])) << place
    down = lowest_bit(leaves) // STEP - WATCHED - 2 * LINK
    while mask != 0:
        fetch_members(beside, balls, cells)
        beside = ks.nonnegative(links[CELL, partner])
        fetch_cells(beside, cells)
        fetch_members(around, balls, cells)
        around = cell_to_search(ball, late, now, state, cells)
        fetch_cells(around, cells)
        partner = ks.nonnegative(max(links[PARTNER, ball], 0))
        fetch_ball(partner, state, cells)
        for level in range(2 * LINK):  # the nodes that its new time climbs first
            fetch(bits, (leaves + partner) >> level * STEP)
        ball = ks.nonnegative(earliest_below(lower, LINK, bits) - leaves)
        fetch_ball(ball, state, cells)
        lower = earliest_below(upper, LINK, bits)
        fetch_below(lower, bits)
        place = lowest_bit(mask)
        followed[place] = times[nodes + place]
        upper = earliest_below(nodes + place, down, bits)
        fetch_below(upper, bits)
        mask &= mask - 1
    return turns, begun, upper, lower, ball, around, partner, beside


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
    return ks.nonnegative(min(max(cell, 0), len(cells.occupancy) - 1))


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
        middle = ks.nonnegative(min(max(above, 1), len(occupancy) - 2))
        fetch(members, (middle - 1) * members.shape[1])
        fetch(members, (middle + 2) * members.shape[1] - 1)
        fetch(occupancy, middle)


@inlined
def fetch_members(cell: int, balls: Floats, cells: Cells) -> None:
    """Fetch the balls of a cell and of the eight around it."""
    for up in range(-1, 2):
        for right in range(-1, 2):
            beside = cell + (up << cells.mesh.shift) + right
            beside = ks.nonnegative(min(max(beside, 0), len(cells.occupancy) - 1))
            for place in range(MEMBERS):
                fetch(balls, ks.nonnegative(cells.members[beside, place]) * balls.shape[0])
