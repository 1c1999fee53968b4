"""Scenes whose course is known in closed form, for longer than the exact twin can follow."""

import math

import numpy as np
import pytest
from scenes import EPSILON, NEIGHBOURS, scene_of

from snooker_cli.containers import Box
from snooker_cli.engine import replay, simulate
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


# --- all at once ----------------------------------------------------------------------------


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
