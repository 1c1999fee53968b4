"""The exact twin against closed forms, other precisions and the engine."""

import math
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from typing import Any

import numpy as np
import pytest
from scenes import EPSILON, gas, scene_of, trap_sums

from snooker_cli.containers import Box, Channel, PeriodicBox
from snooker_cli.laws import Constant, Thermal
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER
from snooker_cli.validation.exact_twin import (
    SLACK,
    Twin,
    UndecidedError,
    follow,
    trajectory,
)
from snooker_cli.validation.methods import rings


def box(*balls: tuple[float, float, float, float, float, float], restitution: float = 1.0) -> Scene:
    """Balls in a box of 8 m by 6 m."""
    return scene_of(balls, container=Box(8.0, 6.0), wall_restitution=restitution)


def test_galperin():
    """Masses 1 and 100^2 and a wall: 314 collisions, and then only the far wall is left."""
    balls = [(-9.4, 0.0, 0.0, 0.0, 0.1, 1.0), (-8.7, 0.0, -1.0, 0.0, 0.1, 1e4)]
    truth, states = trajectory(scene_of(balls), 315)
    i, j = truth.i, truth.j
    assert len(truth) == 315
    assert set(zip(i[:314].tolist(), j[:314].tolist(), strict=True)) == {(0, 1), (0, CONTAINER)}
    assert (i[314], j[314]) == (1, CONTAINER)
    heavy, light = states[314, 1], states[314, 0]
    assert heavy[2] >= light[2] > 0
    assert truth.time[314] - truth.time[313] > 10  # the way across, at 1 m/s


def test_wall_trap():
    """Infinitely many bounces in finite time: after 300 the rest is below a rounding."""
    ball = (9.0, 0.0, -6.0, 8.0, 1.0, 1.0)
    truth, _ = trajectory(scene_of([ball], wall_restitution=0.9), 300)
    expected = trap_sums(6.0, 8.0, 0.9, 9.0)
    rest = 2 * 9 * 6 / 8**2 * 0.9**300 / (1 - 0.9)
    assert len(truth) == 300
    assert expected.duration - truth.time[-1] == pytest.approx(rest, abs=20 * EPSILON * 14)
    assert math.fsum(truth.impulse) == pytest.approx(expected.impulse, rel=300 * EPSILON)


def test_box():
    """One ball in a box: the sides across and along are hit at their own even intervals."""
    across = [Fraction(32, 30) + Fraction(7, 3) * k for k in range(6)]
    along = [Fraction(27, 20) + Fraction(5, 2) * k for k in range(5)]
    truth, _ = trajectory(box((0.3, -0.2, 3.0, 2.0, 0.5, 2.0)), 11)
    # 0.3 and 0.2 are not doubles, by an epsilon.
    expected = [float(time) for time in sorted(across + along)]
    assert truth.time == pytest.approx(expected, rel=2 * EPSILON)
    assert truth.j.tolist() == [CONTAINER] * 11
    impulses = sorted(zip(across + along, [12.0] * 6 + [8.0] * 5, strict=True))
    assert truth.impulse.tolist() == [impulse for _, impulse in impulses]


def test_a_periodic_box():
    """Two balls meet through both sides at once, again and again, and then across a corner."""
    balls = [(-3.0, 0.0, -1.0, 0.0, 0.5, 1.0), (3.0, 0.0, 1.0, 0.0, 0.5, 1.0)]
    truth, _ = trajectory(scene_of(balls, container=PeriodicBox(8.0, 6.0)), 4)
    assert truth.time.tolist() == [0.5, 3.5, 6.5, 9.5]
    corner = [(-3.0, -2.0, -1.5, -1.0, 0.5, 1.0), (3.0, 2.0, 0.0, 0.0, 0.5, 1.0)]
    meeting, _ = trajectory(scene_of(corner, container=PeriodicBox(8.0, 6.0)), 1)
    (time,) = meeting.time
    x, y = 2 - 1.5 * time, 2 - time
    assert math.hypot(x, y) == pytest.approx(1.0, abs=4 * EPSILON)


def test_a_scene_without_a_twin_is_refused():
    with pytest.raises(ValueError, match="wall_temp"):
        trajectory(replace(gas("circle", 7, 0.1), wall_law=Thermal(20.0), wall_key=1), 1)


def test_images_in_a_channel():
    """Balls meet through both ends, and again through the other ends; see tests of the engine."""
    balls = [(0.0, 4.0, 0.0, 1.0, 0.5, 1.0), (0.0, -4.0, 0.0, -1.0, 0.5, 3.0)]
    scene = scene_of(balls, container=Channel(20.0, 12.0))
    truth, _ = trajectory(replace(scene, pair_law=Constant(1.0)), 2)
    assert truth.time.tolist() == [1.5, 1.5 + 10 / 2]


def test_more_bits_only_narrow_the_intervals():
    """The events of two precisions overlap, as long as the lower one decides what happens."""
    scene = rings(number=1, container_mass=5.0)
    rough, numbers = Twin(scene, 128).collisions(), set()
    with suppress(UndecidedError):
        for number, sharp in enumerate(Twin(scene, 1024).collisions()):
            event = next(rough)
            assert event[1:3] == sharp[1:3]
            assert event.time.contains(sharp.time)
            assert event.impulse.contains(sharp.impulse)
            numbers.add(number)
    assert 10 < len(numbers) < 100


class Unfiltered(Twin):
    """Computes all contacts after each event, however far apart two bodies are."""

    def bounds(self, i: int) -> Any:
        bounds = super().bounds(i)
        bounds[np.isfinite(bounds)] = float(self.now) * (1 - SLACK)
        return bounds


@pytest.mark.parametrize("shape", ["circle", "box", "periodic"])
@pytest.mark.parametrize("packing", [0.01, 0.3])
def test_no_contact_is_left_out(shape: str, packing: float):
    """Doubles that show that two bodies are too far apart save time only."""
    scene = gas(shape, 8, packing, mixed=True, cor=0.9)
    quick, slow = Twin(scene).collisions(), Unfiltered(scene).collisions()
    for event, other in islice(zip(quick, slow, strict=True), 60):
        assert event[1:3] == other[1:3]
        assert event.time.overlaps(other.time)


BALL = (0.0, 0.0, 0.0, 0.0, 1.0, 1.0)


def test_contacts_at_the_same_time_are_not_decided():
    """A ball at rest in the middle between two that come, to the last bit and to any other."""
    left, right = (-4.0, 0.0, 1.0, 0.0, 1.0, 1.0), (4.0, 0.0, -1.0, 0.0, 1.0, 1.0)
    with pytest.raises(UndecidedError, match=r"balls 0 and \d touch at the same time"):
        next(follow(scene_of([BALL, left, right])))


def test_balls_that_pass_very_many_images_are_not_decided():
    """In a channel of 10 m, 10⁴⁰ m wide, before they reach the walls."""
    channel, other = Channel(1e40, 10.0), (5.0, 1.0, 2.0, -0.3, 1.0, 1.0)
    scene = scene_of([(0.0, 0.0, 1.0, 1.3, 1.0, 1.0), other], container=channel)
    with pytest.raises(UndecidedError, match="balls 0 and 1 do not touch for very long") as refused:
        next(follow(scene))
    assert refused.value.final


@pytest.mark.parametrize(("offset", "meet"), [(2.0, False), (2.0 - 2.0**-52, True)])
def test_a_grazing_contact_is_decided(offset: float, meet: bool):
    """A ball passes another one at the distance of contact, or a rounding nearer."""
    truth, _ = trajectory(scene_of([BALL, (-4.0, offset, 1.0, 0.0, 1.0, 1.0)]), 1)
    assert truth.j.tolist() == [1 if meet else CONTAINER]
