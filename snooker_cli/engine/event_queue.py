"""The order of events for many balls: a tournament tree over one time a ball.

Node k holds the earliest of its children 4k to 4k + 3; ball i is leaf ``leaves + i``, and node 1
the winner. Nothing is inserted or removed, so that the queue never grows, and an update climbs
only as far as it changes anything. Four children lie in one line of a cache: of a tree of two, half
of whose steps wait for memory when it is large, it has half the steps.

Times are not negative, and such doubles are in the order of their bits taken as integers: integers
are compared three times as fast, and that is what an event waits for first.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from snooker_cli.engine.cell_grid import Mesh, crossing_delays
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.jit import fetch, inlined, lowest_bit
from snooker_cli.engine.kernel_state import (
    CELL,
    CONTACT_TIME,
    PARTNER,
    Flags,
    Floats,
    Indices,
    Integers,
    U,
    V,
    ahead,
    lines,
)

STEP = 2
"""Binary digits of a place that a level decides."""

CHILDREN = 1 << STEP


WATCHED = 3
"""The level, from the top, whose nodes tell what comes next: each has a bit of a mask."""


class Tree(NamedTuple):
    """The nodes' times (s), and the same memory as integers; and what of a level is followed.

    followed : the times (s) of those of a level's nodes whose events are being fetched ahead
    """

    times: Floats
    bits: Integers
    followed: Floats


def new_tree(number: int) -> Tree:
    """A tree of a leaf a ball, all of them never."""
    leaves = CHILDREN
    while leaves < number:
        leaves *= CHILDREN
    times = lines(2 * leaves)
    times[:] = NEVER
    return Tree(times, times.view(np.int64), np.zeros(1 << WATCHED * STEP))


@inlined
def lesser(a: int, b: int) -> int:
    """The lesser of two that are not negative: without a branch, for it would often be mistaken."""
    over = b - a
    return a + (over & (over >> 63))


@inlined
def update(times: Floats, bits: Integers, i: int, time: float) -> None:
    """Give ball i another time."""
    k = ahead(len(times) // 2 + int(i))
    times[k] = time
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
    return ahead(earliest_below(1, lowest_bit(leaves) // STEP, bits) - leaves)


@inlined
def earliest_below(node: int, levels: int, bits: Integers) -> int:
    """The node whose time is earliest of those that are so many levels below one."""
    least = bits[node]
    k = node
    for _ in range(levels):
        k = ahead(k << STEP)
        mask = 0
        for place in range(CHILDREN):
            mask |= int(bits[k + place] == least) << place
        k += lowest_bit(mask)
    return ahead(k)


# A large gas waits for memory: so what coming events need is fetched while others are worked on.

LARGE = 1 << 14
"""Balls from which on to fetch ahead is worth its time, by measurement."""

EVENTS_AHEAD = 12
"""How far ahead to look, by measurement: a chain has five links, and some are followed in vain."""

LINK = 2
"""Levels of the tree that one link goes down: what is below a node then lies in three lines."""

MEMBERS = 2
"""Balls fetched of each cell: few have more."""


class Chains(NamedTuple):
    """The events that are followed: a place in each link of the chain, and the time they are due.

    turns, begun : events since it began, and when that was (s)
    upper, lower : nodes of the tree, four and two levels above its leaves
    ball : one whose line and cell have been asked for
    around, beside : cells of which the members have been asked for, round a ball and its partner
    partner : a ball's partner whose cell has been asked for
    """

    turns: int
    begun: float
    upper: int
    lower: int
    ball: int
    around: int
    partner: int
    beside: int


@inlined
def no_chains(bits: Integers) -> Chains:
    """None yet: ball 0 stands for all."""
    leaves = len(bits) // 2
    return Chains(0, 0.0, leaves >> 2 * LINK * STEP, leaves >> LINK * STEP, 0, 0, 0, 0)


@inlined
def fetch_ahead(
    now: float,
    chains: Chains,
    balls: Floats,
    period: Floats | None,
    links: Indices,
    mesh: Mesh,
    members: Indices,
    occupancy: Indices,
    at_wall: Flags,
    times: Floats,
    bits: Integers,
    followed: Floats,
) -> Chains:
    """Follow each event that is now a few events away, and with it the others by a link."""
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
        fetch_members(beside, balls, mesh, members, occupancy)
        beside = ahead(links[CELL, partner])
        fetch_cells(beside, mesh, members, occupancy, at_wall)
        fetch_members(around, balls, mesh, members, occupancy)
        around = looks_around(ball, late, now, balls, period, links, mesh, occupancy)
        fetch_cells(around, mesh, members, occupancy, at_wall)
        partner = ahead(max(links[PARTNER, ball], 0))
        fetch_ball(partner, balls, links)
        fetch_path(partner, bits)
        ball = ahead(earliest_below(lower, LINK, bits) - leaves)
        fetch_ball(ball, balls, links)
        lower = earliest_below(upper, LINK, bits)
        fetch_below(lower, bits)
        place = lowest_bit(mask)
        followed[place] = times[nodes + place]
        upper = earliest_below(nodes + place, down, bits)
        fetch_below(upper, bits)
        mask &= mask - 1
    return Chains(turns, begun, upper, lower, ball, around, partner, beside)


@inlined
def looks_around(
    i: int,
    late: float,
    now: float,
    balls: Floats,
    period: Floats | None,
    links: Indices,
    mesh: Mesh,
    occupancy: Indices,
) -> int:
    """The cell round which ball i will look for partners: its own, or the one it goes into.

    At a periodic box's side it is some other.
    """
    cell = int(links[CELL, i])
    if balls[CONTACT_TIME, i] > late:
        across, up = crossing_delays(i, now, balls, period, links, mesh)
        if across <= up:
            cell += 1 if balls[U, i] > 0.0 else -1
        else:
            cell += (1 if balls[V, i] > 0.0 else -1) << mesh.shift
    return ahead(min(max(cell, 0), len(occupancy) - 1))


@inlined
def fetch_ball(i: int, balls: Floats, links: Indices) -> None:
    """Have a ball's line and its links fetched."""
    fetch(balls, i * balls.shape[0])
    fetch(links, i * links.shape[0])


@inlined
def fetch_path(i: int, bits: Integers) -> None:
    """Have those nodes fetched that a ball's new time climbs first."""
    leaf = len(bits) // 2 + i
    for level in range(2 * LINK):
        fetch(bits, leaf >> level * STEP)


@inlined
def fetch_below(node: int, bits: Integers) -> None:
    """Have the nodes of two levels below one fetched: four, and sixteen in two lines."""
    fetch(bits, node << STEP)
    fetch(bits, node << 2 * STEP)
    fetch(bits, (node << 2 * STEP) + 8)


@inlined
def fetch_cells(
    cell: int, mesh: Mesh, members: Indices, occupancy: Indices, at_wall: Flags
) -> None:
    """Have fetched who is in a cell and in the eight around it."""
    fetch(at_wall, cell)
    for up in range(-1, 2):
        middle = ahead(min(max(cell + (up << mesh.shift), 1), len(occupancy) - 2))
        fetch(members, (middle - 1) * members.shape[1])
        fetch(members, (middle + 2) * members.shape[1] - 1)
        fetch(occupancy, middle)


@inlined
def fetch_members(
    cell: int, balls: Floats, mesh: Mesh, members: Indices, occupancy: Indices
) -> None:
    """Have the balls of a cell and of the eight around it fetched."""
    for up in range(-1, 2):
        for right in range(-1, 2):
            beside = cell + (up << mesh.shift) + right
            beside = ahead(min(max(beside, 0), len(occupancy) - 1))
            for place in range(MEMBERS):
                fetch(balls, ahead(members[beside, place]) * balls.shape[0])
