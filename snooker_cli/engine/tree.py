"""The order of events for many balls: a tournament tree over one time a ball.

Node k holds the earlier of its children 2k and 2k + 1; ball i is leaf ``leaves + i``, and node 1
the winner. Nothing is inserted or removed, so that the queue never grows, and an update climbs
only as far as it changes anything.

Times are not negative, and such doubles are in the order of their bits taken as integers: integers
are compared three times as fast, and that is what an event waits for first.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from snooker_cli.engine.compiling import inlined
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.layout import Floats, Integers


class Tree(NamedTuple):
    """The nodes' times (s), and the same memory as integers."""

    times: Floats
    bits: Integers


def new_tree(number: int) -> Tree:
    """A tree of a leaf a ball, all of them never."""
    times = np.full(2 * (1 << max(number - 1, 1).bit_length()), NEVER)
    return Tree(times, times.view(np.int64))


@inlined
def update(times: Floats, bits: Integers, i: int, time: float) -> None:
    """Give ball i another time."""
    k = len(times) // 2 + i
    times[k] = time
    earlier = bits[k]
    while k > 1:
        other = bits[k ^ 1]
        earlier = other if other < earlier else earlier
        k >>= 1
        if bits[k] == earlier:
            break
        bits[k] = earlier


@inlined
def first(bits: Integers) -> int:
    """The ball whose time is earliest; of several, the first."""
    leaves = len(bits) // 2
    k = 1
    while k < leaves:
        k *= 2
        k += 1 if bits[k] != bits[1] else 0
    return k - leaves
