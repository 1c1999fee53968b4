"""Walls that give energy, restitution that depends on speed, and channels."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import EVERYONE, NEIGHBOURS, gas, lone_bouncer, scene_of
from test_bits import SIDES

from snooker_cli.containers import Box, Channel
from snooker_cli.engine import replay, series, simulate
from snooker_cli.engine.simulation import simulate_batch
from snooker_cli.laws import Constant, Driven, Thermal, Viscoelastic
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, StopReason

EPSILON = 2.0**-52


def driven_speeds(first: float, law: Driven, hits: int) -> np.ndarray:
    """Speeds before each hit, m/s: they approach V (1 + e)/(1 - e) as e^k."""
    last = (1 + law.cor) / (1 - law.cor) * law.speed
    return last + (first - last) * law.cor ** np.arange(hits)


# Driven walls


def test_a_ball_between_driven_walls():
    """Along a diameter; 18 m from hit to hit."""
    scene = scene_of([(0.0, 0.0, 10.0, 0.0, 1.0, 2.0)])
    trace = simulate(replace(scene, wall_law=Driven(0.9, 2.0)), collisions=200)
    speeds = driven_speeds(10.0, Driven(0.9, 2.0), 201)
    times = np.cumsum(np.append(9.0, np.full(199, 18.0)) / speeds[:-1])
    # Each hit rounds the speed by an epsilon or two, of which a part 0.9 is left after the next.
    assert trace.events.time == pytest.approx(times, rel=40 * EPSILON)
    assert trace.events.impulse == pytest.approx(2.0 * (speeds[1:] + speeds[:-1]), rel=40 * EPSILON)
    energy = series(trace).kinetic_energy
    assert energy[1:] == pytest.approx(speeds[1:] ** 2, rel=80 * EPSILON)


def test_a_driven_wall_leaves_no_traps():
    """The ball of a wall trap, with the same CoR; its tangential speed stays."""
    scene = replace(lone_bouncer(), wall_law=Driven(0.9, 0.01))
    trace = simulate(scene, collisions=20_000)
    assert trace.stop.reason is StopReason.COLLISIONS
    x, y = trace.finish.positions[0]
    u, v = trace.finish.velocities[0]
    assert x * v - y * u == pytest.approx(9.0 * 8.0, rel=1e-9)


def test_a_hit_at_the_end_of_a_short_chord_drives_inwards():
    """A ball that seems to move inwards by rounding leaves with e v + (1 + e) V."""
    from snooker_cli.engine.collision import change_at_circle
    from snooker_cli.engine.conversion import new_states

    scene = replace(scene_of([(9.0, 0.0, -1.0, 0.0, 1.0, 1.0)]), wall_law=Driven(0.5, 3.0))
    setup = new_states([scene]).setup
    for u, wanted in ((-1e-9, -(0.5e-9 + 4.5)), (1e-9, -(0.5e-9 + 4.5))):
        for elastic in (False, True):  # a rule of ``collapse`` does not change a driven wall
            change = change_at_circle(9.0, 0.0, u, 2.0, setup, elastic)
            assert u - 9.0 * change == pytest.approx(wanted, rel=4 * EPSILON)


# Restitution that depends on speed


@pytest.mark.parametrize("v0", [0.6, 600.0])
def test_a_trap_of_a_viscoelastic_wall_has_bounds(v0):
    """Above the sum of the chords and impulses, and near it if the ball is slow from the start."""
    law = Viscoelastic(0.9, v0)
    trace = simulate(replace(lone_bouncer(), pair_law=law, wall_law=law), collisions=10_000_000)
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert "at most" in trace.stop.message
    x, y = trace.finish.positions[0]
    u, v = trace.finish.velocities[0]
    a = math.hypot(x, y)
    normal, tangential = -(x * u + y * v) / a, abs(x * v - y * u) / a
    lasts = given = 0.0
    for _ in range(200_000):
        lasts += 2 * a * normal / (normal**2 + tangential**2)
        e = 1 - 0.1 * min(normal / v0, 1) ** 0.75
        given += (1 + e) * normal
        normal *= e
    # What is left falls as k^(-1/3).
    rest = 40 * v0**0.75 * normal**0.25
    lasts, given = lasts + 2 * a * rest / tangential**2, given + 2 * rest
    ratios = (
        (trace.stop.accumulation_time - trace.stop.time) / lasts,
        (trace.stop.impulse_to_come / given),
    )
    assert all(ratio >= 1 - 1e-9 for ratio in ratios)
    if v0 == 600.0:
        assert ratios == pytest.approx([1.0, 1.0], rel=0.15)


def test_a_ball_that_bounces_for_ever_among_others_ends_the_repeat():
    """Another ball, which flies along a diameter, comes too often for a certain trap."""
    law = Viscoelastic(0.5, 100.0)
    other = (0.0, 5.0, 0.1, 0.0, 0.5, 1.0)
    scene = replace(lone_bouncer(other), pair_law=law, wall_law=law)
    trace = simulate(scene, collisions=10_000_000, summary=True)
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert trace.collisions <= 1.1 * 2**20


# A wall with a temperature


def thermal(temperature: float, key: int) -> Scene:
    """Seven elastic balls, far from the wall's temperature."""
    scene = gas("circle", 7, 0.2)
    law = Viscoelastic(1.0, 1.0)
    return replace(scene, pair_law=law, wall_law=Thermal(temperature), wall_key=key)


def test_balls_leave_a_thermal_wall_with_maxwells_flux():
    """The first hit of many repeats: the mean of v_n^2 is 2 T/m, of v_t^2 it is T/m."""
    scenes = [thermal(20.0, key) for key in range(2000)]
    normal, along = [], []
    for trace in simulate_batch(scenes, time=1.0, collisions=100):
        first = int(np.flatnonzero(trace.events.j == CONTAINER)[0])
        ball, time = trace.events.i[first], trace.events.time[first]
        state = replay(trace, [time])
        x, velocity = state.positions[0, ball], state.velocities[0, ball]
        x = x / np.hypot(*x)
        normal.append(-x @ velocity)
        along.append(x[0] * velocity[1] - x[1] * velocity[0])
    squares, others = np.array(normal) ** 2 / 20.0, np.array(along) / math.sqrt(20.0)
    assert min(normal) > 0
    assert abs(np.mean(squares) - 2) < 4 * 2 / math.sqrt(2000)
    assert abs(np.mean(others)) < 4 / math.sqrt(2000)
    assert abs(np.mean(others**2) - 1) < 4 * math.sqrt(2 / 2000)


# Sides and channels

AT_REST = (-7.0, 4.0, 0.0, 0.0, 1.0, 1.0)
"""Nothing meets it. A single ball in cells would need a kernel of its own."""


def test_each_side_has_its_law():
    """A ball to the right, to the left, up and down, at 6 m/s."""
    speeds = {
        (6.0, 0.0): 0.5 * 6 + 1.5 * 2,  # right: driven
        (0.0, 6.0): 6 * (1 - 0.1 * (6 / 9) ** 0.75),  # top: viscoelastic
        (0.0, -6.0): 0.7 * 6,  # bottom: constant
    }
    for velocity, speed in speeds.items():
        scene = scene_of([(0.0, 0.0, *velocity, 1.0, 1.0), AT_REST], container=Box(20.0, 12.0))
        trace = simulate(replace(scene, wall_law=SIDES, wall_key=1), collisions=1)
        wanted = -speed * np.array(velocity) / 6
        assert trace.finish.velocities[0] == pytest.approx(wanted, rel=4 * EPSILON, abs=1e-300)
    scene = scene_of([(0.0, 0.0, -6.0, 0.0, 1.0, 1.0), AT_REST], container=Box(20.0, 12.0))
    trace = simulate(replace(scene, wall_law=SIDES, wall_key=1), collisions=1)
    u, v = trace.finish.velocities[0]
    assert u > 0  # left: thermal
    assert v != 0


def test_a_drift_along_a_channel():
    """It goes on for ever, and the place is that in the nearest image. Two balls keep abreast."""
    law = Driven(1.0, 1e-150)  # too slow to change a double
    balls = [(0.0, y, 3.0, 7.0, 1.0, 1.0) for y in (1.0, -4.0)]
    scene = scene_of(balls, container=Channel(20.0, 12.0))
    trace = simulate(replace(scene, wall_law=law), time=100.0, collisions=1000)
    assert trace.stop.reason is StopReason.TIME
    own = trace.events.time[trace.events.i == 0]
    assert own == pytest.approx(3.0 + 6.0 * np.arange(17), rel=20 * EPSILON)
    times = np.linspace(0.0, 100.0, 333)
    states = replay(trace, times)
    y = 1.0 + 7.0 * times
    assert states.positions[:, 0, 1] == pytest.approx(y - 12.0 * np.rint(y / 12.0), abs=1e-11)
    assert np.all(states.velocities[:, 0, 1] == 7.0)
    assert np.all(abs(states.positions[:, 0, 0]) <= 9.0 + 1e-12)


def test_nothing_happens_to_balls_side_by_side_in_a_channel():
    balls = [(-3.0, 0.0, 0.0, 1.0, 0.5, 1.0), (3.0, 1.0, 0.0, -2.0, 0.5, 1.0)]
    scene = scene_of(balls, container=Channel(20.0, 12.0))
    trace = simulate(replace(scene, wall_law=Driven(0.5, 1.0)), collisions=2)
    assert trace.stop.reason is StopReason.NOTHING_LEFT


# The energy account


@pytest.mark.parametrize(
    ("wall_law", "search"), [(Driven(0.8, 2.0), EVERYONE), (Thermal(20.0), NEIGHBOURS)]
)
def test_the_energy_is_that_at_the_start_and_what_walls_gave_less_what_collisions_took(
    wall_law, search
):
    """After each of 10^5 events, although 30 times the energy of the gas has come and gone."""
    pair_law = Viscoelastic(0.8, 3.0) if isinstance(wall_law, Thermal) else Constant(0.9)
    scene = replace(
        gas("circle", 40, 0.2, mixed=True), pair_law=pair_law, wall_law=wall_law, wall_key=3
    )
    trace = simulate(scene, collisions=100_000, search=search)
    for columns in (
        series(trace),
        simulate(scene, collisions=100_000, search=search, summary=True).summary.series,
    ):
        energy, given, lost = columns.kinetic_energy, columns.wall_energy, columns.lost_energy
        assert given[0] == lost[0] == 0.0
        assert given[-1] > 30 * energy.max()
        # Each event rounds what it changes, and the sum over the balls is rounded 40 times.
        rounding = EPSILON * (math.sqrt(100_000) + 40) * energy.max()
        assert np.max(np.abs(energy[0] + given - lost - energy)) < rounding


def test_an_account_is_the_same_in_batches_and_after_a_checkpoint():
    scene = replace(gas("circle", 20, 0.2, cor=0.9), wall_law=Thermal(20.0), wall_key=3)
    other = replace(scene, wall_key=4)
    whole = simulate(scene, collisions=3000, summary=True)
    batch = simulate_batch([other, scene], collisions=3000, summary=True)[1]
    stopped = simulate(scene, collisions=200_000, summary=True, watch=lambda *_: True)
    resumed = simulate(scene, collisions=70_000, summary=True, checkpoint=stopped.checkpoint)
    straight = simulate(scene, collisions=70_000, summary=True)
    for one, same in ((whole, batch), (resumed, straight)):
        assert one.summary.series.columns.keys() == same.summary.series.columns.keys()
        for name, column in one.summary.series.columns.items():
            assert np.array_equal(column, same.summary.series.columns[name])


def test_other_scenes_have_no_account():
    trace = simulate(gas("circle", 7, 0.2, cor=0.9), collisions=100, summary=True)
    assert trace.summary.series.wall_energy is None
    assert "lost_energy" not in series(trace).columns
