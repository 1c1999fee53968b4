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

LANES = 8  # times that ``soonest`` looks at together: its array has a multiple of this length


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
def lesser(a: int, b: int) -> int:
    """The lesser of two that are not negative, without a branch that would often be mistaken."""
    over = b - a
    return a + (over & (over >> 63))


@inlined
def soonest(times: Floats) -> tuple[int, int, bool]:
    """The ball whose time is earliest; times are not negative, nor -0.0.

    Of equal ones it is the first. Then come the second, or -1 if there is none, and whether there
    are more. The minimum runs in vector registers; then a mask of LANES times at once shows where.
    """
    bits = times.view(np.int64)
    least = bits[0]
    for k in range(len(bits)):
        least = min(least, bits[k])
    first, second, more = -1, -1, False
    for start in range(0, len(bits), LANES):
        mask = 0
        for k in range(LANES):
            mask |= 1 << k if bits[start + k] == least else 0
        while mask != 0:
            k = int(start + lowest_bit(mask))
            mask &= mask - 1
            more = second >= 0
            second = k if first >= 0 and second < 0 else second
            first = k if first < 0 else first
    return first, second, more
