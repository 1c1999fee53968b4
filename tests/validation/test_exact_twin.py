"""The exact twin against closed forms and its own digits."""

import math
from fractions import Fraction

import numpy as np
import pytest
from make_reference import galperin, wall_trap
from scenes import EPSILON, scene_of, trap_sums

from snooker_cli.containers import Box, PeriodicBox
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER
from snooker_cli.validation.exact_twin import trajectory
from snooker_cli.validation.methods import rings


def box(*balls: tuple[float, float, float, float, float, float], restitution: float = 1.0) -> Scene:
    """Balls in a box of 8 m by 6 m."""
    return scene_of(balls, container=Box(8.0, 6.0), wall_restitution=restitution)


def test_galperin():
    """Masses 1 and 100^2 and a wall: 314 collisions, and then only the far wall is left."""
    truth = trajectory(galperin(), 315)
    i, j = truth.events.i, truth.events.j
    assert truth.certain == 315
    assert set(zip(i[:314].tolist(), j[:314].tolist(), strict=True)) == {(0, 1), (0, CONTAINER)}
    assert (i[314], j[314]) == (1, CONTAINER)
    heavy, light = truth.states[314, 1], truth.states[314, 0]
    assert heavy[2] >= light[2] > 0
    assert truth.events.time[314] - truth.events.time[313] > 10  # the way across, at 1 m/s


def test_wall_trap():
    """Infinitely many bounces in finite time: after 300 the rest is below a rounding."""
    truth = trajectory(wall_trap(), 300)
    expected = trap_sums(6.0, 8.0, 0.9, 9.0)
    rest = 2 * 9 * 6 / 8**2 * 0.9**300 / (1 - 0.9)
    assert truth.certain == 300
    assert expected.duration - truth.events.time[-1] == pytest.approx(rest, abs=20 * EPSILON * 14)
    assert math.fsum(truth.events.impulse) == pytest.approx(expected.impulse, rel=300 * EPSILON)


def test_box():
    """One ball in a box: the sides across and along are hit at their own even intervals."""
    across = [Fraction(32, 30) + Fraction(7, 3) * k for k in range(6)]
    along = [Fraction(27, 20) + Fraction(5, 2) * k for k in range(5)]
    truth = trajectory(box((0.3, -0.2, 3.0, 2.0, 0.5, 2.0)), 11)
    # 0.3 and 0.2 are not doubles, by an epsilon.
    expected = [float(time) for time in sorted(across + along)]
    assert truth.events.time == pytest.approx(expected, rel=2 * EPSILON)
    assert truth.events.j.tolist() == [CONTAINER] * 11
    impulses = sorted(zip(across + along, [12.0] * 6 + [8.0] * 5, strict=True))
    assert truth.events.impulse.tolist() == [impulse for _, impulse in impulses]


def test_a_periodic_box_is_refused():
    scene = scene_of([(0.0, 0.0, 1.0, 0.0, 0.5, 1.0)], container=PeriodicBox(8.0, 6.0))
    with pytest.raises(ValueError, match="not a periodic box"):
        trajectory(scene, 1)


def test_it_says_how_many_events_are_certain():
    """Few digits make few events certain; these are the truth, to all digits of a double."""
    scene = rings(number=1, container_mass=5.0)
    few, many = trajectory(scene, 100, digits=22), trajectory(scene, 100)
    assert 0 < few.certain < 100
    assert many.certain == 100
    here = slice(few.certain)
    for column in ("time", "i", "j", "impulse"):
        assert np.array_equal(getattr(few.events, column)[here], getattr(many.events, column)[here])
    here = slice(few.certain + 1)
    assert np.array_equal(few.states[here], many.states[here])
    assert (few.check_digits, many.check_digits) == (33, math.ceil(1.5 * many.digits))
