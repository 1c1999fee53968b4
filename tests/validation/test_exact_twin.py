"""The exact twin against closed forms and its own digits."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from make_reference import galperin, wall_trap
from scenes import EPSILON, gas, scene_of, trap_sums

from snooker_cli.containers import Box, Channel, PeriodicBox
from snooker_cli.engine import simulate
from snooker_cli.laws import Constant, Driven, Law, Sides, Thermal, Viscoelastic, WallLaw
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
    with pytest.raises(ValueError, match="a periodic box"):
        trajectory(scene, 1)


def test_a_thermal_wall_is_refused():
    scene = replace(gas("circle", 7, 0.1), wall_law=Thermal(20.0), wall_key=1)
    with pytest.raises(ValueError, match="the thermal law"):
        trajectory(scene, 1)


def test_images_in_a_channel():
    """Balls meet through both ends, and again through the other ends; see tests of the engine."""
    balls = [(0.0, 4.0, 0.0, 1.0, 0.5, 1.0), (0.0, -4.0, 0.0, -1.0, 0.5, 3.0)]
    scene = scene_of(balls, container=Channel(20.0, 12.0))
    truth = trajectory(replace(scene, pair_law=Constant(1.0)), 2)
    assert truth.events.time.tolist() == [1.5, 1.5 + 10 / 2]


DRIVEN, SOFT = Driven(0.9, 2.0), Viscoelastic(0.8, 3.0)


@pytest.mark.parametrize(
    ("shape", "pair_law", "wall_law"),
    [
        ("circle", Constant(0.9), DRIVEN),
        ("circle", SOFT, SOFT),
        ("channel", Constant(0.9), DRIVEN),
        ("channel", SOFT, Sides(DRIVEN, SOFT, SOFT, SOFT)),
        ("box", Constant(0.9), Sides(DRIVEN, Constant(0.8), SOFT, Constant(1.0))),
    ],
)
def test_the_engine_follows_other_laws(shape: str, pair_law: Law, wall_law: WallLaw):
    """The same 100 events, as exact as chaos lets a rounding at the start grow."""
    scene = replace(gas(shape, 8, 0.2), pair_law=pair_law, wall_law=wall_law)
    # With whole lengths a place at the wall is a double, which more digits do not change.
    lengths = (math.ceil(length) for length in scene.container.lengths.values())
    scene = replace(scene, container=type(scene.container)(*lengths))
    truth, events = trajectory(scene, 100), simulate(scene, collisions=100).events
    assert truth.certain == 100
    assert np.array_equal(events.i, truth.events.i)
    assert np.array_equal(events.j, truth.events.j)
    # A collision rounds a dozen times; all roundings of the first events count at the start.
    rounding = 16 * EPSILON * np.random.default_rng(1).normal(size=(2, 8, 2))
    moved = replace(
        scene,
        positions=scene.positions + rounding[0] * scene.container.size[0] / 2,
        velocities=scene.velocities + rounding[1] * 10.0,
    )
    other = trajectory(moved, 100).events
    for name in ("time", "impulse"):
        exact = getattr(truth.events, name)
        allowed = np.maximum.accumulate(abs(getattr(other, name) - exact)) + 64 * EPSILON * exact
        assert np.all(abs(getattr(events, name) - exact) <= 4 * allowed), name


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
