"""Tricks with the bits of numbers, each with the reason why the plain way is slower.

In doubles that are not negative, the bits read as an integer have the order of the numbers. So
integers, whose minimum is one instruction, can stand for times.
"""

import math
from fractions import Fraction
from typing import Any

import numpy as np

from snooker_cli.engine.jit import inlined, instruction
from snooker_cli.engine.kernel_state import Floats

LANES = 16  # of times that ``soonest`` looks at: its array has a multiple of this length


@instruction
def fused(a: float, b: float, c: float) -> float:
    """a b + c, rounded once."""
    if not all(map(math.isfinite, (a, b, c))):
        return a * b + c
    return float(Fraction(a) * Fraction(b) + Fraction(c))


@instruction
def next_below(value: float) -> float:
    """The double before a positive one."""
    return math.nextafter(value, 0.0)


@instruction
def lowest_bit(mask: int) -> int:
    """Place of the lowest bit that is set, from 0."""
    return (int(mask) & -int(mask)).bit_length() - 1


@instruction
def fetch(array: Any, place: int) -> None:
    """Ask the processor to load an element into its cache; plain Python does nothing."""


@inlined
def nonnegative(index: int) -> int:
    """The same index; the compiler then knows that it does not count from the end."""
    return int(index) & ((1 << 62) - 1)


@inlined
def earlier(time: float, other: float) -> float:
    """The lesser of two times: one instruction, where ``min`` has branches for NaN."""
    return time if time < other else other


# The least of many times: a tree with one level. Ball k is in lane k mod LANES. A ball's new time
# changes the least of its lane; the least of all is then one of LANES.


@inlined
def enter_lane(i: int, times: Floats, lanes: Floats) -> None:
    """Enter the least of ball i's lane."""
    lane = nonnegative(i) % LANES
    least = times[lane]
    for k in range(lane + LANES, len(times), LANES):
        least = earlier(least, times[k])
    lanes[lane] = least


@inlined
def enter_lanes(times: Floats, lanes: Floats) -> None:
    """Enter the least of each lane, in vector registers."""
    for lane in range(LANES):
        lanes[lane] = times[lane]
    for start in range(LANES, len(times), LANES):
        for lane in range(LANES):
            lanes[lane] = earlier(lanes[lane], times[start + lane])


@inlined
def soonest(times: Floats, lanes: Floats) -> tuple[int, int, bool]:
    """A ball whose time is earliest; times are not negative, nor -0.0.

    Then come another with the same time, or -1 if there is none, and whether there are more.
    """
    bits, of_lanes = times.view(np.int64), lanes.view(np.int64)
    least, mask = of_lanes[0], 0
    for lane in range(LANES):
        least = min(least, of_lanes[lane])
    for lane in range(LANES):
        mask |= 1 << lane if of_lanes[lane] == least else 0
    first, second, more = -1, -1, False
    while mask != 0:
        for k in range(lowest_bit(mask), len(bits), LANES):
            if bits[k] == least:
                more = second >= 0
                second = k if first >= 0 and second < 0 else second
                first = k if first < 0 else first
        mask &= mask - 1
    return first, second, more
