"""The order of events for many balls: a tournament tree over one time per ball.

As in a tournament, each node is the winner of the nodes below it. Node k holds the earliest time of
its children 4k to 4k + 3, which lie in one line of the processor's cache. Ball i is the leaf
``leaves + i``, and node 1 the earliest of all:

    node 1                        1
    nodes 4 to 7      4           5       6       7
    nodes 16 to 31  16 17 18 19   20 …                    leaves of balls 0, 1, 2 … with 16 leaves

A ball's new time goes into its leaf. From there the minimum of four children climbs, as far as it
changes anything: a few nodes. The first ball is found from node 1 down, by the child that is equal.
Nodes 2, 3 and 8 to 15 are not used. Which times are equal, integers show (``bit_tricks``).
"""

import numpy as np

from snooker_cli.engine.bit_tricks import earlier, lowest_bit, nonnegative
from snooker_cli.engine.cell_memory import Tree, aligned_zeros
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.jit import inlined
from snooker_cli.engine.kernel_state import Integers

STEP = 2  # binary digits of a place that a level decides

CHILDREN = 1 << STEP

WATCHED = 3  # the level, from the top, whose nodes are watched for coming events


def new_tree(number: int) -> Tree:
    """A tree with a leaf per ball; all times are infinite."""
    leaves = CHILDREN
    while leaves < number:
        leaves *= CHILDREN
    times = aligned_zeros(2 * leaves)
    times[:] = NEVER
    return Tree(times, times.view(np.int64), np.zeros(1 << WATCHED * STEP))


@inlined
def update(i: int, time: float, tree: Tree) -> None:
    """Give ball i another time."""
    times = tree.times
    k = nonnegative(len(times) // 2 + int(i))
    times[k] = time
    while k > 1:
        k >>= STEP
        child = k << STEP
        least = earlier(
            earlier(times[child], times[child + 1]), earlier(times[child + 2], times[child + 3])
        )
        if times[k] == least:
            break
        times[k] = least


@inlined
def first(bits: Integers) -> tuple[int, int, bool]:
    """The ball whose time is earliest; if several have that time, a second, and whether more do.

    The second is -1 if there is none.
    """
    leaves, least = len(bits) // 2, bits[1]
    k, other, more = 1, 0, False
    for _ in range(lowest_bit(leaves) // STEP):
        k, rest = equal_below(k, least, bits)
        if rest != 0:
            more |= (other != 0) | (rest & (rest - 1) != 0)
            other = nonnegative((k & ~(CHILDREN - 1)) + lowest_bit(rest))
    second = -1
    if other != 0:
        while other < leaves:
            other, rest = equal_below(other, least, bits)
            more |= rest != 0
        second = other - leaves
    return nonnegative(k - leaves), second, more


@inlined
def equal_below(node: int, least: int, bits: Integers) -> tuple[int, int]:
    """The first child of a node with a time, and a mask of the places of others with it."""
    children, mask = nonnegative(node << STEP), 0
    for place in range(CHILDREN):
        mask |= int(bits[children + place] == least) << place
    return children + lowest_bit(mask), mask & (mask - 1)


@inlined
def next_equal(i: int, bits: Integers) -> int:
    """The next ball after ball i whose time is the earliest of all, or -1."""
    leaves, least = len(bits) // 2, bits[1]
    k = nonnegative(leaves + i)
    while k > 1:
        k += 1
        if k & (CHILDREN - 1) == 0:  # the last child of its parent
            k = (k - 1) >> STEP
        elif bits[k] == least:
            while k < leaves:
                k <<= STEP
                while bits[k] != least:
                    k += 1
            return int(k - leaves)
    return -1


@inlined
def earliest_below(node: int, levels: int, bits: Integers) -> int:
    """Of the nodes this many levels below one, that with the earliest time."""
    least = bits[node]
    k = node
    for _ in range(levels):
        k = nonnegative(k << STEP)
        mask = 0
        for place in range(CHILDREN):
            mask |= int(bits[k + place] == least) << place
        k += lowest_bit(mask)
    return nonnegative(k)
