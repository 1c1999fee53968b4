"""How runs end, what is kept of them, and that looking on changes nothing."""

import importlib
import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import (
    EPSILON,
    digest,
    gas,
    is_wall,
    report_scene,
    same_events,
    scene_of,
    twin_collisions,
)

from snooker_cli.containers import Box
from snooker_cli.engine import clock, simulate, specialisation
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, StopReason

CHUNK = clock.LEAST_EVENTS  # of few balls a chunk is an epoch


def one_ball(**changes: float) -> Scene:
    return scene_of([(0.0, 0.0, 3.0, 1.0, 1.0, 1.0)], **changes)


def lone_bouncer() -> Scene:
    """A ball that is in a wall trap from its first hit, at 0.5 s, until 14.78 s."""
    inwards = 6.0 / 0.9
    ball = (9.0 - 0.5 * inwards, -4.0, inwards, 8.0, 1.0, 1.0)
    return scene_of([ball], wall_restitution=0.9)


# --- what was asked for ---------------------------------------------------------------------


def test_collisions():
    trace = simulate(report_scene(cor=0.9), collisions=500)
    assert trace.stop.reason is StopReason.COLLISIONS
    assert trace.stop.reason.complete
    assert trace.collisions == len(trace.events) == 500
    assert trace.wall_events == is_wall(trace.events).sum()
    assert trace.pair_events == 500 - trace.wall_events
    assert trace.stop.time == trace.events.time[-1]
    assert trace.stop.balls == ()
    assert "500" in trace.stop.message


def test_time():
    trace = simulate(report_scene(cor=0.9), time=1.25)
    assert trace.stop.reason is StopReason.TIME
    assert trace.stop.reason.complete
    assert trace.stop.time == 1.25
    assert trace.events.time[-1] <= 1.25
    longer = simulate(report_scene(cor=0.9), collisions=len(trace.events) + 1)
    assert longer.events.time[-1] > 1.25
    # From there on, the same collisions follow; 30 of them let rounding grow by e^1.2 only.
    rest = simulate(replace(trace.finish, restitution=0.9), collisions=30).events
    whole = simulate(report_scene(cor=0.9), collisions=len(trace.events) + 30).events
    after = slice(len(trace.events), None)
    assert np.array_equal(rest.i, whole.i[after])
    assert np.allclose(1.25 + rest.time, whole.time[after], rtol=0, atol=1e-11)


def test_a_collision_at_the_very_end_is_in():
    """9 m at 4.5 m/s take 2 s."""
    scene = scene_of([(0.0, 0.0, 4.5, 0.0, 1.0, 1.0)])
    trace = simulate(scene, time=2.0)
    assert trace.stop.reason is StopReason.TIME
    assert trace.events.time.tolist() == [2.0]
    assert trace.finish.velocities.tolist() == [[-4.5, 0.0]]


def test_whichever_comes_first():
    scene = report_scene()
    by_collisions = simulate(scene, collisions=10, time=1.0)
    assert by_collisions.stop.reason is StopReason.COLLISIONS
    by_time = simulate(scene, collisions=10_000, time=1.0)
    assert by_time.stop.reason is StopReason.TIME
    assert same_events(by_time.events, simulate(scene, time=1.0).events)


def test_one_of_the_limits_is_needed():
    with pytest.raises(ValueError, match="collisions or a time"):
        simulate(report_scene())


def test_events_are_in_order_and_well_formed():
    events = simulate(report_scene(cor=0.8, wall_cor=1.0), collisions=20_000).events
    assert np.all(np.diff(events.time) >= 0)
    assert np.all((events.j > events.i) | (events.j == CONTAINER))
    assert np.all((events.i >= 0) & (events.j < 37))
    assert np.all(events.impulse >= 0)


@pytest.mark.parametrize(("cor", "radius"), [(0.9, 1.0), (0.1, 0.3), (0.0, 0.1)])
def test_a_pair_that_has_parted_does_not_meet_again_by_itself(cor, radius):
    """Straight ways cross once: one of the two must have met something else since.

    Without any rebound the two stay side by side, and rounding must not let them collide.
    """
    trace = simulate(report_scene(radius=radius, cor=cor, wall_cor=1.0), collisions=5000)
    last: dict[int, int] = {}
    for i, j in zip(trace.events.i.tolist(), trace.events.j.tolist(), strict=True):
        if j == CONTAINER:
            last[i] = CONTAINER
        else:
            assert not (last.get(i) == j and last.get(j) == i)
            last[i], last[j] = j, i


def test_the_start_stays_as_it_was():
    scene = report_scene()
    before = scene.positions.copy(), scene.velocities.copy()
    trace = simulate(scene, collisions=100)
    assert trace.start is scene
    assert np.array_equal(scene.positions, before[0])
    assert np.array_equal(scene.velocities, before[1])


# --- nothing left ---------------------------------------------------------------------------


def test_nothing_left_at_rest():
    scene = scene_of([(0.0, 0.0, 0.0, 0.0, 1.0, 1.0), (3.0, 0.0, 0.0, 0.0, 1.0, 1.0)])
    trace = simulate(scene, collisions=10)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.stop.reason.complete
    assert trace.collisions == len(trace.events) == 0
    assert trace.stop.time == 0.0
    assert np.array_equal(trace.finish.positions, scene.positions)


def test_nothing_left_after_two_balls_have_stopped_each_other():
    balls = [(-3.0, 0.0, 1.0, 0.0, 1.0, 1.0), (3.0, 0.0, -1.0, 0.0, 1.0, 1.0)]
    trace = simulate(scene_of(balls, restitution=0.0), collisions=10)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.events.time.tolist() == [2.0]
    assert trace.events.impulse.tolist() == [1.0]
    assert np.all(trace.finish.velocities == 0)


def test_nothing_left_of_a_ball_that_sticks_to_the_wall():
    scene = scene_of([(0.0, 0.0, 4.5, 0.0, 1.0, 1.0)], wall_restitution=0.0)
    trace = simulate(scene, collisions=10)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.events.time.tolist() == [2.0]


def test_nothing_left_before_the_time_is_up():
    """The state at the time that was asked for is known: nothing moves."""
    trace = simulate(scene_of([(0.0, 0.0, 0.0, 0.0, 1.0, 1.0)]), time=5.0)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.stop.time == 5.0


# --- wall trap ------------------------------------------------------------------------------


def test_a_wall_that_swallows_the_rebound_traps_at_once():
    scene = scene_of([(0.0, -5.0, 4.5, 1.0, 1.0, 1.0)], wall_restitution=0.0)
    trace = simulate(scene, collisions=10)
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert not trace.stop.reason.complete
    assert len(trace.events) == 1
    x, y = trace.finish.positions[0]
    u, v = trace.finish.velocities[0]
    assert x * u + y * v == pytest.approx(0.0, abs=1e-14)


def test_no_trap_on_a_diameter():
    """Without a tangential speed there is no end to how long the bounces take."""
    scene = scene_of([(0.0, 0.0, 4.5, 0.0, 1.0, 1.0)], wall_restitution=0.5)
    trace = simulate(scene, collisions=40)
    assert trace.stop.reason is StopReason.COLLISIONS
    expected = 2.0 + np.concatenate([[0.0], np.cumsum(18.0 / (4.5 * 0.5 ** np.arange(1, 40)))])
    assert np.allclose(trace.events.time, expected, rtol=40 * EPSILON, atol=0)


def test_no_trap_at_an_elastic_wall():
    trace = simulate(replace(lone_bouncer(), wall_restitution=1.0), collisions=1000)
    assert trace.stop.reason is StopReason.COLLISIONS


def test_a_trap_that_begins_with_the_last_wanted_collision_takes_nothing_away():
    """Both wanted collisions are there: the run is complete."""
    trace = simulate(lone_bouncer(), collisions=2)
    assert len(trace.events) == 2
    assert trace.stop.reason is StopReason.COLLISIONS


def test_a_trap_does_not_end_a_run_whose_time_is_up_before_the_last_bounce():
    """Until 5 s there are but five bounces, of the infinitely many until 14.8 s."""
    trace = simulate(lone_bouncer(), time=5.0)
    assert trace.stop.reason is StopReason.TIME
    assert len(trace.events) == 5


def test_two_balls_that_are_trapped_together_end_the_run():
    """Opposite each other they bounce in step, ever more weakly, until 14.78 s: it must not go on
    with impulses that are nothing but rounding while the clock creeps."""
    one = lone_bouncer()
    scene = replace(
        one,
        positions=np.vstack([one.positions, -one.positions]),
        velocities=np.vstack([one.velocities, -one.velocities]),
        radii=np.ones(2),
        masses=np.ones(2),
    )
    trace = simulate(scene, collisions=3000)
    assert trace.stop.reason in (StopReason.WALL_TRAP, StopReason.COLLAPSE)
    assert trace.stop.time < 0.5 + 14.284783441 + 1e-9


def test_a_light_container_carries_the_wall_to_another_ball():
    """The ball that bounces along the wall pushes the container into the one at rest, before it
    has bounced infinitely often: it is not trapped."""
    balls = [(7.0, -4.0, 2.0, 4.0, 1.0, 1.0), (-7.546, -6.331, 0.0, 0.0, 0.1, 1.0)]
    scene = scene_of(balls, container_mass=0.5, wall_restitution=0.8)
    truth = [(event.i, event.j) for event in twin_collisions(scene, 10)]
    assert truth[2:] == [*[(0, CONTAINER)] * 7, (1, CONTAINER)]
    trace = simulate(scene, collisions=10)
    assert list(zip(trace.events.i.tolist(), trace.events.j.tolist(), strict=True)) == truth
    assert trace.stop.reason is StopReason.COLLISIONS


# --- the clock stands still -----------------------------------------------------------------


@pytest.mark.parametrize("engine", ["allpairs", "cells"])
@pytest.mark.parametrize(("mass", "radius"), [(math.inf, 1.0), (1e7, 0.5)])
def test_a_ball_along_an_elastic_wall_is_no_inelastic_collapse(engine, mass, radius):
    """It touches the wall at every moment, and nothing is lost."""
    balls = [(9.0, 0.0, 0.0, 10.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0, radius, 1.0)]
    scene = scene_of(balls, container_mass=mass)
    trace = simulate(scene, collisions=1000, engine=engine)
    assert trace.stop.reason is StopReason.COLLAPSE
    assert trace.stop.message == (
        "ball 0 moves along the wall and touches it at every moment: the clock stands at 0 s while "
        f"collisions go on, the last of ball 0 and the wall; {len(trace.events)} collisions are "
        "kept"
    )
    assert math.fsum(trace.events.impulse) == 0.0
    assert trace.finish.kinetic_energy == scene.kinetic_energy


@pytest.mark.parametrize("cor", [1.0, 0.5])
def test_only_losses_are_called_inelastic(cor):
    """A ball in a channel as wide as itself hits both of its walls in no time."""
    balls = [(0.0, 0.0, 3.0, 0.1, 1.0, 1.0), (-5.0, 0.0, 0.0, 0.0, 0.5, 1.0)]
    scene = scene_of(balls, container=Box(12.0, 2.0), restitution=cor)
    trace = simulate(scene, collisions=1000)
    assert trace.stop.reason is StopReason.COLLAPSE
    said = "collisions without end" if cor == 1.0 else "inelastic collapse"
    assert trace.stop.message.startswith(f"{said}: the clock stands at 0 s while collisions go on")


def test_a_container_of_next_to_no_mass_does_not_hang():
    """Its ratio to a ball's mass is no double: 1e300 kg over 5e-324 kg."""
    light = gas("circle", 7, 0.07, cor=0.85, wall_cor=1e-20, container_mass=5e-324)
    trace = simulate(replace(light, masses=np.full(7, 1e300)), collisions=40)
    assert trace.stop.reason in (StopReason.WALL_TRAP, StopReason.COLLAPSE)
    assert trace.collisions > 0
    assert np.all(np.isfinite(trace.finish.velocities))


# --- interruption ---------------------------------------------------------------------------


def test_watch_counts_the_events_and_changes_no_bit():
    scene = report_scene(cor=0.95, wall_cor=1.0)
    count = 2 * CHUNK + 1000
    seen: list[int] = []
    watched = simulate(scene, collisions=count, watch=lambda new: seen.append(new) or False)
    assert seen == [CHUNK, CHUNK, 1000]
    assert same_events(watched.events, simulate(scene, collisions=count).events)


def test_interrupted():
    scene = report_scene()
    trace = simulate(scene, collisions=10 * CHUNK, watch=lambda new: True)
    assert trace.stop.reason is StopReason.INTERRUPTED
    assert not trace.stop.reason.complete
    assert trace.stop.time == trace.events.time[-1]
    assert same_events(trace.events, simulate(scene, collisions=CHUNK).events)


def test_the_size_of_chunks_changes_no_bit(monkeypatch):
    scene = report_scene(cor=0.9, wall_cor=1.0, container_mass=100.0)
    whole = simulate(scene, collisions=5000)
    module = importlib.import_module("snooker_cli.engine.simulation")
    for size in (1, 777):
        monkeypatch.setattr(module, "CHUNK", size)
        parts = simulate(scene, collisions=5000)
        assert same_events(parts.events, whole.events)
        assert np.array_equal(parts.finish.positions, whole.finish.positions)
        assert parts.stop == whole.stop


def test_a_shorter_run_is_the_beginning_of_a_longer_one():
    scene = report_scene(cor=0.9)
    short, long = simulate(scene, collisions=500).events, simulate(scene, collisions=1000).events
    first = type(long)(long.time[:500], long.i[:500], long.j[:500], long.impulse[:500])
    assert same_events(short, first)
    assert digest(short) != digest(long)


def test_no_collisions_wanted():
    """The run ends at once; the watch is there to end the test."""
    looks: list[int] = []
    trace = simulate(
        report_scene(), collisions=0, watch=lambda new: looks.append(new) or len(looks) > 9
    )
    assert trace.stop.reason is StopReason.COLLISIONS
    assert trace.collisions == 0
    assert len(looks) == 1


def test_a_watch_that_stops_a_run_that_is_just_over_takes_nothing_away():
    trace = simulate(report_scene(), collisions=CHUNK, watch=lambda new: True)
    assert trace.collisions == CHUNK
    assert trace.stop.reason is StopReason.COLLISIONS


# --- what is modelled -----------------------------------------------------------------------


def test_specialisation():
    same = {
        "cells": False,
        "balls sorted by cells": False,
        "straight walls": False,
        "periodic images": False,
        "moving container": False,
        "unequal balls": False,
        "sliding along the wall": False,
    }
    assert specialisation(one_ball()) == same
    assert specialisation(one_ball(container_mass=5.0))["moving container"]
    assert specialisation(one_ball(), engine="cells")["cells"]
    mixed = scene_of([(0, 0, 1, 0, 1, 1), (4, 0, 1, 0, 2, 3)], container_mass=math.inf)
    assert specialisation(mixed) == {**same, "unequal balls": True}


def test_a_fixed_container_may_stand_anywhere():
    """By multiples of a power of two, so that the coordinates are as good there."""
    here = report_scene()
    shift = np.array([16.0, -8.0])
    there = replace(here, positions=here.positions + shift, container_position=shift)
    a, b = simulate(here, collisions=60).events, simulate(there, collisions=60).events
    assert np.array_equal(a.i, b.i)
    assert np.array_equal(a.j, b.j)
    assert np.allclose(a.time, b.time, rtol=0, atol=1e-10)


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (2.0, -1.0)])
def test_a_free_container_may_stand_and_drift_anywhere(velocity):
    """Galileo: everything displaced and carried along meets the same way."""
    here = report_scene(container_mass=50.0)
    shift = np.array([16.0, -8.0])
    there = replace(
        here,
        positions=here.positions + shift,
        velocities=here.velocities + velocity,
        container_position=shift,
        container_velocity=np.array(velocity),
    )
    a, b = simulate(here, collisions=60).events, simulate(there, collisions=60).events
    assert np.array_equal(a.i, b.i)
    assert np.array_equal(a.j, b.j)
    assert np.allclose(a.time, b.time, rtol=0, atol=1e-10)
    assert np.allclose(a.impulse, b.impulse, rtol=0, atol=1e-8)
