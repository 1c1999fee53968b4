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

from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.jit import inlined, lowest_bit
from snooker_cli.engine.layout import Floats, Integers, ahead, lines

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
