"""Three functions for which the compiler has an instruction; here as plain Python."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any


def fused(a: float, b: float, c: float) -> float:
    """a b + c, rounded once."""
    if not all(map(math.isfinite, (a, b, c))):
        return a * b + c
    return float(Fraction(a) * Fraction(b) + Fraction(c))


def lowest_bit(mask: int) -> int:
    """Place of the lowest bit that is set, from 0."""
    return (int(mask) & -int(mask)).bit_length() - 1


def fetch(array: Any, place: int) -> None:
    """Have an element on its way from memory; only for time's sake, so here nothing."""
