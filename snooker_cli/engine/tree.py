"""The order of events for many balls: a tournament tree over one time a ball.

Node k holds the earlier of its children 2k and 2k + 1; ball i is leaf ``leaves + i``, and node 1
the winner. Nothing is inserted or removed, so that the queue never grows, and an update climbs
only as far as it changes anything.
"""

from __future__ import annotations

import numpy as np

from snooker_cli.engine.compiling import compiled, inlined
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.layout import Floats


def new_tree(number: int) -> Floats:
    """A tree of a leaf a ball, all of them never."""
    return np.full(2 * (1 << max(number - 1, 1).bit_length()), NEVER)


@inlined
def update(tree: Floats, i: int, time: float) -> None:
    """Give ball i another time."""
    k = len(tree) // 2 + i
    tree[k] = time
    k >>= 1
    while k >= 1:
        one, other = tree[2 * k], tree[2 * k + 1]
        earlier = one if one < other else other
        if tree[k] == earlier:
            break
        tree[k] = earlier
        k >>= 1


@inlined
def first(tree: Floats) -> int:
    """The ball whose time is earliest; of several, the first."""
    leaves = len(tree) // 2
    k = 1
    while k < leaves:
        k *= 2
        k += 1 if tree[k] != tree[1] else 0
    return k - leaves


@compiled
def rebuild(tree: Floats) -> None:
    """Make every node agree with the leaves."""
    for k in range(len(tree) // 2 - 1, 0, -1):
        tree[k] = min(tree[2 * k], tree[2 * k + 1])
