"""a b + c, rounded once, on processors that have no instruction for it, as in WebAssembly.

It is ``bit_tricks.fused`` where c is -a b but for a rounding or two, as all callers have it.
"""

import numpy as np

from snooker_cli.engine.jit import helper, inlined, kernel

SPLITTER = 2.0**27 + 1.0

LEAST = 2.0**-960
"""Products from which on all parts of Dekker's product are doubles."""


STEP, UNIT = 2.0**256, 2.0**-1074
"""A factor that brings small numbers near 1, again and again; and the least double."""


@inlined
def halves(a: float) -> tuple[float, float]:
    """Two parts of a number with half of its digits each, which add up to it."""
    split = SPLITTER * a
    high = split - (split - a)
    return high, a - high


@inlined
def error_of_product(a: float, b: float, product: float) -> float:
    """What rounding has cut off from a b (Dekker, doi:10.1007/BF01397083)."""
    high_a, low_a = halves(a)
    high_b, low_b = halves(b)
    return low_a * low_b - (((product - high_a * high_b) - low_a * high_b) - high_a * low_b)


@kernel
def fused(a: float, b: float, c: float) -> float:
    """a b + c, rounded once."""
    product = a * b
    if abs(product) < LEAST and a != 0.0 and b != 0.0:
        return fused_scaled(a, b, c)
    return (c + product) + error_of_product(a, b, product)


@helper
def fused_scaled(a: float, b: float, c: float) -> float:
    """``fused`` of a small product: all numbers are scaled, and the sum is rounded as doubles are.

    Below 2^-1021 doubles are whole multiples of the least one.
    """
    unit, steps = UNIT, 0
    while abs(a) < 1.0 / STEP:
        a, c, unit, steps = a * STEP, c * STEP, unit * STEP, steps + 1
    while abs(b) < 1.0 / STEP:
        b, c, unit, steps = b * STEP, c * STEP, unit * STEP, steps + 1
    while abs(a) > STEP:
        a, c, unit, steps = a / STEP, c / STEP, unit / STEP, steps - 1
    while abs(b) > STEP:
        b, c, unit, steps = b / STEP, c / STEP, unit / STEP, steps - 1
    product = a * b
    rest, difference = error_of_product(a, b, product), product + c  # exact: they are near
    total = difference + rest
    added = total - difference
    rest = (difference - (total - added)) + (rest - added)  # TwoSum
    if abs(total) < 2.0**53 * unit:
        whole = np.rint(total / unit)
        above = total - whole * unit
        if rest > 0.5 * unit - above or (rest == 0.5 * unit - above and whole % 2.0 != 0.0):
            whole += 1.0
        elif rest < -0.5 * unit - above or (rest == -0.5 * unit - above and whole % 2.0 != 0.0):
            whole -= 1.0
        total = whole * unit
    for _ in range(steps):
        total /= STEP
    return total
