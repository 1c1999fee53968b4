"""Times to contact against 60-digit arithmetic, and the rules that need no arithmetic.

The bounds follow the roundings of b, c and the discriminant through t = c/(-b + sqrt(D)), to
first order, twice over.
"""

import math
from collections.abc import Iterator
from decimal import Decimal, localcontext

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scenes import EPSILON

from snooker_cli.engine.contact import NEVER, chord_delay, pair_delay, wall_delay

STEADY = settings(derandomize=True, deadline=None, max_examples=300)
PLACE = st.floats(-20.0, 20.0)
SPEED = st.floats(-20.0, 20.0).filter(lambda u: u == 0 or abs(u) > 1e-6)


@pytest.fixture(autouse=True, scope="module")
def sixty_digits() -> Iterator[None]:
    with localcontext() as context:
        context.prec = 60
        yield


def exact(*values: float) -> tuple[Decimal, ...]:
    return tuple(map(Decimal, values))


# --- two balls ------------------------------------------------------------------------------


@STEADY
@given(x=PLACE, y=PLACE, u=SPEED, v=SPEED, d=st.floats(0.1, 4.0))
@example(x=3.0, y=0.0, u=-1.0, v=0.0, d=2.0)
@example(x=1e-3, y=15.0, u=0.0, v=-1e-6, d=2.0)
def test_pair_delay_is_the_first_root(x, y, u, v, d):
    xx, yy, uu, vv, dd = exact(x, y, u, v, d * d)
    b, w2, c, cross = (
        xx * uu + yy * vv,
        uu * uu + vv * vv,
        xx * xx + yy * yy - dd,
        xx * vv - yy * uu,
    )
    discriminant = w2 * dd - cross * cross
    b_error = EPSILON * (abs(x * u) + abs(y * v))
    c_error = 2 * EPSILON * (x * x + y * y + d * d)
    cross_error = EPSILON * (abs(x * v) + abs(y * u))
    d_error = 2 * EPSILON * float(w2 * dd + cross * cross) + 2 * abs(float(cross)) * cross_error
    # Whether they approach, touch and meet at all must not be a matter of rounding.
    assume(abs(b) > b_error)
    assume(abs(c) > c_error)
    assume(abs(discriminant) > 2 * d_error)

    delay = pair_delay(x, y, u, v, d * d)
    if b >= 0:
        assert delay == NEVER
    elif c <= 0:
        assert delay == 0.0
    elif discriminant <= 0:
        assert delay == NEVER
    else:
        root = discriminant.sqrt()
        expected = c / (root - b)
        error = c_error + float(expected) * (b_error + d_error / (2 * float(root)))
        bound = 2 * (error / float(root - b) + 4 * EPSILON * float(expected))
        assert abs(Decimal(delay) - expected) <= bound


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
    """Of two balls with radii of 1 m, on any axis."""
    assert pair_delay(x, 0.0, u, 0.0, 4.0) == delay
    assert pair_delay(0.0, -x, 0.0, -u, 4.0) == delay


def test_pair_delay_of_balls_that_only_graze():
    """Past each other at the contact distance they do not collide; a rounding less, they do."""
    assert pair_delay(5.0, 2.0, -1.0, 0.0, 4.0) == NEVER
    assert pair_delay(5.0, math.nextafter(2.0, 3.0), -1.0, 0.0, 4.0) == NEVER
    assert pair_delay(5.0, math.nextafter(2.0, 0.0), -1.0, 0.0, 4.0) == pytest.approx(5.0, abs=1e-7)


@STEADY
@given(x=PLACE, y=PLACE, u=SPEED, v=SPEED, power=st.integers(-20, 20))
def test_pair_delay_scales_exactly(x, y, u, v, power):
    """Speeds times a power of two, the time over it; and neither ball is the first."""
    factor = 2.0**power
    delay = pair_delay(x, y, u, v, 4.0)
    assert pair_delay(x, y, factor * u, factor * v, 4.0) == delay / factor
    assert pair_delay(-x, -y, -u, -v, 4.0) == delay


# --- ball and wall --------------------------------------------------------------------------


@STEADY
@given(
    part=st.floats(0.0, 0.999),
    turn=st.floats(0.0, 2 * math.pi),
    u=SPEED,
    v=SPEED,
    reach=st.floats(0.5, 20.0),
)
def test_wall_delay_is_the_second_root(part, turn, u, v, reach):
    assume(u or v)
    x, y = part * reach * math.cos(turn), part * reach * math.sin(turn)
    xx, yy, uu, vv, square = exact(x, y, u, v, reach * reach)
    b, w2, c = xx * uu + yy * vv, uu * uu + vv * vv, xx * xx + yy * yy - square
    root = (b * b - w2 * c).sqrt()
    expected = (root - b) / w2
    b_error = EPSILON * (abs(x * u) + abs(y * v))
    c_error = 2 * EPSILON * (x * x + y * y + reach * reach)
    root_error = (abs(float(b)) * b_error + float(w2) * c_error / 2) / float(root)
    root_error += 3 * EPSILON * float(root)
    if b > 0:  # t = -c/(root + b)
        error = (c_error + float(expected) * (root_error + b_error)) / float(root + b)
    else:  # t = (root - b)/w2
        error = (root_error + b_error) / float(w2)
    bound = 2 * (error + 4 * EPSILON * float(expected))
    assert abs(Decimal(wall_delay(x, y, u, v, reach * reach)) - expected) <= bound


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
@given(
    turn=st.floats(0.0, 2 * math.pi),
    angle=st.floats(1e-9, math.pi / 2),
    speed=st.floats(1e-3, 1e3),
)
def test_chord_delay_keeps_its_precision_however_short_the_chord(turn, angle, speed):
    """2 |x.w| / w^2: as good as the scalar product, even where the chord is below rounding."""
    x, y = 9.0 * math.cos(turn), 9.0 * math.sin(turn)
    u, v = -speed * math.sin(turn + angle), speed * math.cos(turn + angle)
    xx, yy, uu, vv = exact(x, y, u, v)
    b, w2 = xx * uu + yy * vv, uu * uu + vv * vv
    b_error = EPSILON * (abs(x * u) + abs(y * v))
    assume(b < -b_error)
    bound = 2 * b_error / float(w2) + 4 * EPSILON * float(-2 * b / w2)
    assert abs(Decimal(chord_delay(x, y, u, v)) - -2 * b / w2) <= bound


def test_chord_delay_decides_by_physics():
    assert chord_delay(9.0, 0.0, -3.0, 0.0) == 6.0
    assert chord_delay(9.0, 0.0, 3.0, 4.0) == 0.0  # still outwards: now
    assert chord_delay(9.0, 0.0, 0.0, 4.0) == 0.0  # sliding
    assert chord_delay(9.0, 0.0, 0.0, 0.0) == NEVER
