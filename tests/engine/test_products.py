"""What WebAssembly has instead of a fused multiplication rounds once, as that does."""

from __future__ import annotations

import math

from hypothesis import example, given, settings
from hypothesis import strategies as st

from snooker_cli.engine import products
from snooker_cli.engine.bit_tricks import fused

plain = products.fused.function
numbers = st.floats(-1e9, 1e9)
powers = st.integers(-1074, 60)


@given(numbers, numbers, powers)
@example(3e-310, 0.7, 0)
@example(1 / 3, 7e-160, 0)
@example(5e-324, 5e-324, 0)
@example(1.0000000000000002, 1.0000000000000002, -1000)
@settings(max_examples=500, deadline=None)
def test_the_error_of_a_product(a: float, b: float, power: int) -> None:
    a = math.ldexp(a, power)
    assert plain(a, b, -(a * b)) == fused(a, b, -(a * b))


@given(numbers, st.floats(1e-9, 1e9), powers)
@example(3e-310, 0.7, 0)
@example(1e-313, 1e4 / 3, 0)
@settings(max_examples=500, deadline=None)
def test_the_remainder_of_a_division(a: float, b: float, power: int) -> None:
    a = math.ldexp(a, power)
    assert plain(-(a / b), b, a) == fused(-(a / b), b, a)
