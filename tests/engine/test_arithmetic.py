"""Times of contact and changes of velocity against exact arithmetic on the same doubles."""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scenes import EPSILON

from snooker_cli.engine.bit_tricks import fused
from snooker_cli.engine.collision import normal_part, shares
from snooker_cli.engine.contact import NEVER, chord_delay, pair_delay, wall_delay
from snooker_cli.engine.sliding import cosine_and_sine

STEADY = settings(derandomize=True, deadline=None, max_examples=300)
NUMBER = st.floats(-20.0, 20.0).filter(lambda x: x == 0 or abs(x) > 1e-6)
ANGLE = st.floats(0.0, 2 * math.pi)
MASS = st.floats(1e-3, 1e7)

# --- times of contact -----------------------------------------------------------------------


class Path(NamedTuple):
    """A straight path, exactly: at time zero, x² − d², x·w and w²."""

    c: Fraction
    b: Fraction
    w2: Fraction

    @classmethod
    def of(cls, x: float, y: float, u: float, v: float, square: float) -> "Path":
        x, y, u, v = map(Fraction, (x, y, u, v))
        return cls(x * x + y * y - Fraction(square), x * u + y * v, u * u + v * v)

    def gap(self, t: float) -> Fraction:
        """|x + w t|² − d²."""
        return self.c + 2 * self.b * Fraction(t) + self.w2 * Fraction(t) ** 2

    def slope(self, t: float) -> float:
        """(x + w t)·w, negative when approaching."""
        return float(self.b + self.w2 * Fraction(t))


def rounding(x: float, y: float, u: float, v: float, square: float, t: float = 0.0) -> float:
    """Of |x + w t|² − d², m²: b, c, the discriminant and t each have a few half epsilons."""
    way = abs(x) + abs(y)
    return 16 * EPSILON * (way * way + square + way * (abs(u) + abs(v)) * t)


@STEADY
@given(x=NUMBER, y=NUMBER, u=NUMBER, v=NUMBER, d=st.floats(0.1, 4.0))
@example(x=3.0, y=0.0, u=-1.0, v=0.0, d=2.0)
@example(x=1e-3, y=15.0, u=0.0, v=-1e-6, d=2.0)
def test_pair_delay_is_the_first_root(x, y, u, v, d):
    given = x, y, u, v, d * d
    path, delay = Path.of(*given), pair_delay(*given)
    bound = rounding(*given, 0.0 if delay == NEVER else delay)
    speed = math.sqrt(path.w2)
    if delay == NEVER:
        parting = float(path.b) >= -EPSILON * (abs(x * u) + abs(y * v))
        assert parting or path.c - path.b**2 / path.w2 >= -bound  # the least distance
    elif delay == 0.0:
        assert path.c <= bound
        assert path.b <= EPSILON * (abs(x * u) + abs(y * v))
    else:
        assert abs(path.gap(delay)) <= bound
        assert path.slope(delay) <= math.sqrt(bound) * speed


@pytest.mark.parametrize(
    ("x", "u", "delay"),
    [
        (3.0, 1.0, NEVER),  # parting
        (2.0, 1.0, NEVER),  # touching and parting
        (1.9, 1.0, NEVER),  # overlapping and parting
        (3.0, 0.0, NEVER),  # at rest
        (2.0, 0.0, NEVER),
        (3.0, -1.0, 1.0),  # approaching
        (2.0, -1.0, 0.0),  # touching and approaching
        (1.9, -1.0, 0.0),  # overlapping and approaching
        (math.nextafter(2.0, 0.0), -1e-12, 0.0),
    ],
)
def test_pair_delay_decides_by_physics(x, u, delay):
    """Of two balls with radii of 1 m, on any axis, at any speed."""
    assert pair_delay(x, 0.0, u, 0.0, 4.0) == delay
    assert pair_delay(0.0, -x, 0.0, -u, 4.0) == delay
    assert pair_delay(x, 0.0, 2.0**20 * u, 0.0, 4.0) == delay / 2.0**20


@STEADY
@given(part=st.floats(0.0, 0.999), turn=ANGLE, u=NUMBER, v=NUMBER, reach=st.floats(0.5, 20.0))
def test_wall_delay_is_the_second_root(part, turn, u, v, reach):
    assume(u or v)
    x, y = part * reach * math.cos(turn), part * reach * math.sin(turn)
    given = x, y, u, v, reach * reach
    path, delay = Path.of(*given), wall_delay(*given)
    assert abs(path.gap(delay)) <= rounding(*given, delay)
    assert path.slope(delay) >= 0


@pytest.mark.parametrize(
    ("x", "u", "delay"),
    [
        (0.0, 3.0, 3.0),  # from the centre
        (9.0, 3.0, 0.0),  # at the wall, outwards
        (9.5, 3.0, 0.0),  # beyond it by rounding, outwards
        (9.0, -3.0, 6.0),  # at the wall, inwards: a diameter
        (math.nextafter(9.0, 10.0), -3.0, 6.0),
        (0.0, 0.0, NEVER),  # at rest
        (9.0, 0.0, NEVER),
    ],
)
def test_wall_delay_decides_by_physics(x, u, delay):
    assert wall_delay(x, 0.0, u, 0.0, 81.0) == pytest.approx(delay, rel=4 * EPSILON)
    assert wall_delay(0.0, -x, 0.0, -u, 81.0) == pytest.approx(delay, rel=4 * EPSILON)


@STEADY
@given(turn=ANGLE, angle=st.floats(1e-9, math.pi / 2), speed=st.floats(1e-3, 1e3))
def test_chord_delay_keeps_its_precision_however_short_the_chord(turn, angle, speed):
    """2 |x.w| / w^2: as good as the scalar product, even where the chord is below rounding."""
    x, y = 9.0 * math.cos(turn), 9.0 * math.sin(turn)
    u, v = -speed * math.sin(turn + angle), speed * math.cos(turn + angle)
    path = Path.of(x, y, u, v, 81.0)
    b_error = EPSILON * (abs(x * u) + abs(y * v))
    assume(path.b < -b_error)
    exact = -2 * path.b / path.w2
    bound = 2 * b_error / float(path.w2) + 4 * EPSILON * float(exact)
    assert abs(Fraction(chord_delay(x, y, u, v)) - exact) <= bound


def test_chord_delay_decides_by_physics():
    assert chord_delay(9.0, 0.0, -3.0, 0.0) == 6.0
    assert chord_delay(9.0, 0.0, 3.0, 4.0) == 0.0  # still outwards: now
    assert chord_delay(9.0, 0.0, 0.0, 4.0) == 0.0  # sliding
    assert chord_delay(9.0, 0.0, 0.0, 0.0) == NEVER


# --- changes of velocity --------------------------------------------------------------------


@STEADY
@given(x=NUMBER, y=NUMBER, u=NUMBER, v=NUMBER)
def test_the_normal_part_is_rounded_once(x, y, u, v):
    """The quotient of the scalar product and of the exact square, to half a unit in the last place.

    The correction is itself rounded, to an epsilon of what it corrects: an epsilon or two.
    """
    assume(x or y)
    exact = Fraction(u * x + v * y) / (Fraction(x) ** 2 + Fraction(y) ** 2)
    rounded = normal_part(x, y, u, v)
    half = Fraction(1, 2) + 8 * Fraction(EPSILON)
    assert abs(Fraction(rounded) - exact) <= Fraction(math.ulp(rounded)) * half


@STEADY
@given(a=NUMBER, b=NUMBER, c=st.floats(-400.0, 400.0))
def test_fused_is_rounded_once(a, b, c):
    assert fused(a, b, c) == float(Fraction(a) * Fraction(b) + Fraction(c))
    assert fused(math.inf, b, c) == math.inf * b + c or b == 0


@STEADY
@given(change=NUMBER, m=MASS, n=MASS)
def test_shares_keep_the_momentum(change, m, n):
    """m first = n second, and together they are the change."""
    first, second = map(Fraction, shares(change, m, n))
    for share, other in ((first, n), (second, m)):
        part = Fraction(change) * Fraction(other) / (Fraction(m) + Fraction(n))
        # The lighter one takes the rest: its error is that of the heavier one's, and a rounding.
        heavier = abs(Fraction(change)) * Fraction(min(m, n)) / (Fraction(m) + Fraction(n))
        bound = EPSILON * (2 * float(heavier) + (abs(change) if other == max(m, n) else 0))
        assert abs(share - part) <= bound
    assert abs(first + second - Fraction(change)) <= EPSILON / 2 * abs(change)
    assert shares(change, m, m) == (change / 2, change / 2)
    assert shares(change, m, math.inf) == (change, 0.0)


def test_cosine_and_sine():
    angles = np.concatenate([np.linspace(-20, 20, 4001), np.geomspace(1e-12, 1e5, 4001)])
    for angle in angles.tolist():
        cosine, sine = cosine_and_sine(angle)
        assert abs(cosine - math.cos(angle)) <= EPSILON
        assert abs(sine - math.sin(angle)) <= EPSILON
