"""Scenes whose course is known in closed form, for longer than the exact twin can follow."""

import math

import numpy as np
import pytest
from scenes import EPSILON, NEIGHBOURS, energy_losses, scene_of

from snooker_cli.analysis.observables import (
    total_angular_momentum,
    total_energy,
    total_momentum,
)
from snooker_cli.containers import Box
from snooker_cli.engine import replay, simulate
from snooker_cli.placement.places import unit_polygon
from snooker_cli.scene import Scene

A = 9.0  # accessible radius of a ball of 1 m in the container of 10 m
SPEED = 10.0


def launched_along_the_wall(angle: float) -> Scene:
    """One ball at the wall, moving inwards at an angle to the tangent."""
    velocity = -SPEED * math.sin(angle), SPEED * math.cos(angle)
    return scene_of([(A, 0.0, *velocity, 1.0, 1.0)])


# --- one elastic ball -----------------------------------------------------------------------


def test_star_polygon():
    """{5/2}: chords of 2a sin(2 pi/5) that touch the circle of radius a cos(2 pi/5)."""
    corners, turns = 5, 2
    angle = math.pi * turns / corners
    trace = simulate(launched_along_the_wall(angle), collisions=100 * corners)
    time = trace.events.time
    interval = 2 * A * math.sin(angle) / SPEED
    # A chord knows its angle to the rounding of places and velocities, a few epsilon a bounce.
    off = EPSILON * np.arange(4, len(time) + 4)
    # A hit's time is rounded, and the ball goes on from a place that is as much too far out or in:
    # six standard deviations of a walk with steps of up to half a unit of the clock's last place.
    walk = 6 / math.sqrt(12) * math.sin(angle) ** 2 * np.sqrt(np.cumsum(np.spacing(time) ** 2))
    bound = interval * off + np.spacing(time) + walk
    assert np.all(abs(np.diff(time, prepend=0.0) - interval) < bound)
    assert time[4] == pytest.approx(8.559508647, abs=5e-10)

    places = replay(trace, time).positions[:, 0]
    closed = np.hypot(*(places[corners - 1 :: corners] - [A, 0.0]).T)
    # Each bounce may turn the ball by a few epsilon, and the turns add up on the way around.
    assert np.all(closed < A * 4 * EPSILON * np.arange(corners, len(time) + 1, corners) ** 2)

    caustic = replay(trace, time - interval / 2).positions[:, 0]
    assert np.allclose(np.hypot(*caustic.T), A * math.cos(angle), rtol=0, atol=A * off[-1])


def test_whispering_gallery():
    """At an angle of 1e-6 a chord takes 2a sin(angle)/v = 1.8e-6 s, and none is missed."""
    angle, bounces = 1e-6, 20_000
    ball = (A, 0.0, -SPEED * math.sin(angle), SPEED * math.cos(angle), 1.0, 1.0)
    scene = scene_of([ball, (0.0, 0.0, 0.0, 0.0, 1.0, 1.0)])
    trace = simulate(scene, collisions=bounces, search=NEIGHBOURS)
    interval = 2 * A * math.sin(angle) / SPEED
    # A bounce rounds the direction by some epsilon; in the angle, they add up as a walk.
    walk = 6 * math.sqrt(bounces) * 2 * EPSILON / angle
    assert trace.stop.time == pytest.approx(bounces * interval, rel=walk)
    assert np.allclose(np.diff(trace.events.time), interval, rtol=walk, atol=0)
    assert np.allclose(trace.events.impulse, 2 * SPEED * math.sin(angle), rtol=walk, atol=0)
    assert math.hypot(*trace.finish.positions[0]) == pytest.approx(A, rel=100 * EPSILON)


# --- all at once ----------------------------------------------------------------------------


@pytest.mark.parametrize("cor", [1.0, 0.5])
@pytest.mark.parametrize("number", [2, 3, 36])
def test_ring_that_closes_in(number, cor):
    """All touch at once, when the ring's radius is r/sin(pi/n); E, L and p come through."""
    radius, speed, start = 0.5, 3.0, 8.0
    ring = [
        (start * x, start * y, -speed * x, -speed * y, radius, 1.0) for x, y in unit_polygon(number)
    ]
    trace = simulate(scene_of(ring, restitution=cor), collisions=3 * number, time=3.0)
    contact = (start - radius / math.sin(math.pi / number)) / speed
    events = trace.events
    assert not events.at_wall.any()
    assert len(events) >= number // 2
    rounding = 8 * EPSILON * start * speed * number
    assert np.all(abs(events.time[: number // 2] - contact) < rounding)
    loss = math.fsum(energy_losses(trace))
    assert total_energy(trace.finish) == pytest.approx(4.5 * number - loss, abs=8 * rounding)
    assert abs(total_angular_momentum(trace.finish)) < start * rounding
    assert np.all(abs(total_momentum(trace.finish)) < rounding)


# --- boxes ----------------------------------------------------------------------------------

# A single ball in cells would need a kernel of its own. Nothing meets this one.
AT_REST = (0.0, 0.0, 0.0, 0.0, 0.5, 1.0)


def test_a_billiard_in_a_box():
    """The place is the straight way, folded at the walls; and each wall is hit when it is due.

    The clock is rounded, and a ball turns round so much before or after the wall. The way is a
    parallelogram, round a ball at rest in the middle.
    """
    start, velocity, end = np.array([-2.0, 2.0]), np.array([10.0, 6.0]), 1000.0
    scene = scene_of([(*start, *velocity, 1.0, 1.0), AT_REST], container=Box(12.0, 8.0))
    trace = simulate(scene, time=end, search=NEIGHBOURS)
    sides = np.array([10.0, 6.0])  # of the box that the centre is in
    due = (sides * np.arange(1, 1010)[:, np.newaxis] - start - sides / 2) / velocity
    expected = np.sort(due[due <= end])
    assert len(trace.events) == len(expected)
    off = 6 * math.sqrt(len(expected)) * 2 * EPSILON * (velocity.max() * end + sides.max())
    assert np.allclose(trace.events.time, expected, rtol=0, atol=off / velocity.min())

    moments = np.linspace(0.0, end, 777)
    way = start + sides / 2 + velocity * moments[:, np.newaxis]
    folded = sides / 2 - abs(way % (2 * sides) - sides)
    assert np.allclose(replay(trace, moments).positions[:, 0], folded, rtol=0, atol=off)


def test_a_ball_in_a_corner_hits_both_walls():
    balls = [(0.0, 0.0, 3.0, 3.0, 1.0, 1.0), (2.5, -2.5, 0.0, 0.0, 0.5, 1.0)]
    scene = scene_of(balls, container=Box(8.0, 8.0))
    trace = simulate(scene, collisions=40, search=NEIGHBOURS)
    expected = np.repeat(1.0 + 2.0 * np.arange(20), 2)
    assert trace.events.time == pytest.approx(expected, rel=40 * EPSILON)
    assert np.all(trace.events.impulse == 6.0)
