"""Changes of velocity against exact rational arithmetic, from the same doubles."""

import math
from fractions import Fraction

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scenes import EPSILON

from snooker_cli.engine.collision import normal_part, relative_change, shares
from snooker_cli.engine.jit import fused

STEADY = settings(derandomize=True, deadline=None, max_examples=200)
PLACE = st.floats(-20.0, 20.0).filter(lambda x: x == 0 or abs(x) > 1e-6)
SPEED = st.floats(-20.0, 20.0).filter(lambda u: u == 0 or abs(u) > 1e-6)
RESTITUTION = st.floats(0.0, 1.0)
MASS = st.floats(1e-3, 1e7)


@STEADY
@given(x=PLACE, y=PLACE, u=SPEED, v=SPEED, e=RESTITUTION)
def test_normal_velocity_is_reversed_and_multiplied_by_the_restitution(x, y, u, v, e):
    """g -> -e g; the change is along (x, y), so that the tangential velocity is left alone."""
    assume(x or y)
    xx, yy, uu, vv = map(Fraction, (x, y, u, v))
    change = Fraction(relative_change(x, y, u, v, e))
    normal = uu * xx + vv * yy
    uu, vv = uu - change * xx, vv - change * yy
    # Of the scalar product, whose terms may cancel, and of the six operations after it.
    rounding = (1 + e) * EPSILON * (abs(x * u) + abs(y * v)) + 6 * EPSILON * abs(float(normal))
    assert abs(uu * xx + vv * yy + Fraction(e) * normal) <= rounding


@STEADY
@given(x=PLACE, y=PLACE, u=SPEED, v=SPEED)
def test_the_normal_part_is_rounded_once(x, y, u, v):
    """The quotient of the scalar product and of the exact square, to half a unit in the last place.

    The correction is itself rounded, to an epsilon of what it corrects: an epsilon or two.
    """
    assume(x or y)
    along = u * x + v * y
    exact = Fraction(along) / (Fraction(x) ** 2 + Fraction(y) ** 2)
    found = normal_part(x, y, u, v)
    assert abs(Fraction(found) - exact) <= Fraction(math.ulp(found)) * (
        Fraction(1, 2) + 8 * Fraction(EPSILON)
    )


@given(a=SPEED, b=PLACE, c=st.floats(-400.0, 400.0))
@settings(derandomize=True, deadline=None)
def test_fused_is_rounded_once(a, b, c):
    assert fused(a, b, c) == float(Fraction(a) * Fraction(b) + Fraction(c))
    assert fused(math.inf, b, c) == math.inf * b + c or b == 0


@STEADY
@given(change=st.floats(-1e3, 1e3), m=MASS, n=MASS)
def test_shares_keep_the_momentum(change, m, n):
    """m first = n second, and together they are the change."""
    assume(change == 0 or abs(change) > 1e-6)
    first, second = shares(change, m, n)
    whole = float(abs(Fraction(change)))
    for share, other in ((first, n), (second, m)):
        part = Fraction(change) * Fraction(other) / (Fraction(m) + Fraction(n))
        # The lighter one takes the rest: its error is that of the heavier one's, and a rounding.
        heavier = float(abs(Fraction(change)) * Fraction(min(m, n)) / (Fraction(m) + Fraction(n)))
        bound = EPSILON * (2 * heavier + (whole if other == max(m, n) else 0))
        assert abs(Fraction(share) - part) <= bound
    assert abs(Fraction(first) + Fraction(second) - Fraction(change)) <= EPSILON / 2 * abs(change)


@pytest.mark.parametrize("m", [0.5, 1.0, 3e6])
def test_shares_of_equal_and_of_infinite_masses(m):
    assert shares(3.0, m, m) == (1.5, 1.5)
    assert shares(3.0, m, math.inf) == (3.0, 0.0)


@STEADY
@given(u=SPEED, v=SPEED, e=RESTITUTION, m=MASS, n=MASS)
def test_energy_lost_is_half_mu_one_minus_e_squared_g_squared(u, v, e, m, n):
    """Along x, in exact arithmetic but for the engine's two answers."""
    g = Fraction(u) - Fraction(v)
    assume(g > 0)
    change = relative_change(1.0, 0.0, u - v, 0.0, e)
    first, second = shares(change, m, n)
    before = Fraction(m) * Fraction(u) ** 2 + Fraction(n) * Fraction(v) ** 2
    after = Fraction(m) * (Fraction(u) - Fraction(first)) ** 2
    after += Fraction(n) * (Fraction(v) + Fraction(second)) ** 2
    reduced = 1 / (1 / Fraction(m) + 1 / Fraction(n))
    lost = reduced * (1 - Fraction(e) ** 2) * g**2
    # Each share is off by some epsilon; to first order that costs momentum times the share.
    momentum = max(m * abs(u), n * abs(v), float(reduced * g))
    assert abs(before - after - lost) <= 16 * EPSILON * momentum * abs(change)
