"""Balls that slide along a fixed wall after infinitely many bounces."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import EPSILON, NEIGHBOURS, lone_bouncer, report_scene, scene_of, trap_sums

from snooker_cli.analysis.measurement import measure
from snooker_cli.analysis.observables import total_angular_momentum
from snooker_cli.engine import replay, series, simulate
from snooker_cli.laws import Constant
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, SLIDE, Events, StopReason, Trace

TRAP = trap_sums(6.0, 8.0, 0.9, 9.0)

FORCE = 8.0**2 / 9.0
"""Force on the wall of a ball of 1 kg that slides, m v_t^2/a, N."""


def slider() -> Scene:
    """``lone_bouncer``, which slides from 14.78 s on."""
    return replace(lone_bouncer(), slides=True)


def gas_that_slides(**changes: float) -> Scene:
    return replace(report_scene(**{"radius": 0.1, "cor": 0.8, **changes}), slides=True)


@pytest.fixture(scope="module")
def lone() -> Trace:
    return simulate(slider(), time=30.0)


# --- one ball, in closed form ---------------------------------------------------------------


def test_the_last_row_of_a_trap_stands_for_all_bounces(lone):
    """It ends when their sum says, has their impulse, and the ball is where they took it."""
    events = lone.events
    assert events.j.tolist() == [CONTAINER, CONTAINER, SLIDE]
    assert events.at_wall.all()
    assert events.time[-1] - events.time[0] == pytest.approx(TRAP.duration, rel=1e-14)
    assert events.impulse[1:].sum() == pytest.approx(TRAP.impulse, rel=1e-14)
    first, last = replay(lone, events.time[[0, 2]]).positions[:, 0]
    turned = math.atan2(first[0] * last[1] - first[1] * last[0], first @ last)
    assert turned == pytest.approx(math.remainder(TRAP.angle, 2 * math.pi), abs=1e-13)


def test_a_trap_reports_what_the_last_row_of_a_slide_stores(lone):
    stop, (_, second, last) = simulate(lone_bouncer(), collisions=9).stop, lone.events.time
    assert stop.reason is StopReason.WALL_TRAP
    assert stop.time == second
    assert stop.accumulation_time == pytest.approx(last, rel=1e-14)
    assert stop.impulse_to_come == pytest.approx(lone.events.impulse[2], rel=1e-14)


def test_it_slides_at_constant_speed_on_its_circle(lone):
    time = np.linspace(lone.events.time[-1], 30.0, 50)
    states = replay(lone, time)
    assert np.hypot(*states.positions[:, 0].T) == pytest.approx(np.full(50, 9.0), rel=4 * EPSILON)
    assert np.hypot(*states.velocities[:, 0].T) == pytest.approx(np.full(50, 8.0), rel=1e-14)
    angle = np.unwrap(np.arctan2(*states.positions[:, 0].T[::-1]))
    assert np.diff(angle) == pytest.approx(np.diff(time) * 8.0 / 9.0, rel=1e-12)


def test_it_presses(lone):
    """The wall takes the bounces' impulse and then m v_t^2/a a second, up to the very end."""
    columns = series(lone)
    slid = 30.0 - lone.events.time[-1]
    pressing = FORCE * slid
    expected = lone.events.impulse.sum() + pressing
    assert columns.time[-1] == 30.0
    assert columns.wall_impulse[-1] == pytest.approx(expected, rel=1e-13)
    pressure = measure([lone]).whole.pressure(lone.start)
    assert pressure[0] == pytest.approx(expected / (2 * math.pi * 10.0 * 30.0), rel=1e-13)


def test_how_it_ends(lone):
    assert lone.stop.reason is StopReason.NOTHING_LEFT
    assert lone.stop.time == 30.0
    assert lone.finish.kinetic_energy == pytest.approx(8.0**2 / 2, rel=1e-14)
    drift = total_angular_momentum(lone.finish) - total_angular_momentum(lone.start)
    assert abs(drift) < 1e-14 * 9.0 * 8.0 * 4
    assert np.array_equal(replay(lone, [30.0]).positions[0], lone.finish.positions)


@pytest.fixture(scope="module")
def bounced() -> Trace:
    """Every bounce, until they are too slow for losses."""
    return simulate(replace(lone_bouncer(), elastic_below=1e-9), time=14.0)


def test_while_it_bounces_unseen_it_is_where_the_bounces_take_it(lone, bounced):
    time = np.linspace(0.0, 14.0, 113)
    mine, other = replay(lone, time), replay(bounced, time)
    assert np.allclose(mine.positions, other.positions, rtol=0, atol=1e-11)
    assert np.allclose(mine.velocities, other.velocities, rtol=0, atol=1e-11)


def test_a_summary_sees_the_bounces_and_the_pressing(lone, bounced):
    summary = simulate(slider(), time=30.0, summary=True).summary.series
    assert summary.wall_impulse[-1] == pytest.approx(series(lone).wall_impulse[-1], rel=1e-13)
    columns = series(bounced)
    before = summary.time < 14.0
    row = np.searchsorted(columns.time, summary.time[before], side="right") - 1
    for name in ("wall_impulse", "kinetic_energy", "mean_speed"):
        column, other = getattr(summary, name)[before], getattr(columns, name)[row]
        assert np.allclose(column, other, rtol=1e-11, atol=0)
    late = summary.time > 15.0
    force = np.diff(summary.wall_impulse[late]) / np.diff(summary.time[late])
    assert force == pytest.approx(np.full(len(force), FORCE), rel=1e-9)


# --- which balls a sliding ball meets ---------------------------------------------------------


def at_angle(angle: float, speed: float) -> tuple[float, float, float, float, float, float]:
    """A ball of 1 m on the wall that moves along it, and a little outwards."""
    c, s = math.cos(angle), math.sin(angle)
    return 9 * c, 9 * s, -speed * s + 1e-3 * c, speed * c + 1e-3 * s, 1.0, 1.0


def test_a_sliding_ball_catches_another():
    """At an angle of 2 asin(r/a) between them; with no rebound from the wall both slide at once."""
    scene = scene_of([at_angle(0.0, 8.0), at_angle(2.0, 3.0)], restitution=0.5)
    trace = simulate(replace(scene, wall_law=Constant(0.0), slides=True), time=20.0)
    k = int(np.flatnonzero(trace.events.j >= 0)[0])
    touching = 2 * math.asin(1 / 9)
    assert trace.events.time[k] == pytest.approx((2.0 - touching) * 9 / 5.0, rel=1e-6)
    places = replay(trace, [trace.events.time[k]]).positions[0]
    assert math.dist(*places) == pytest.approx(2.0, rel=1e-13)


def pairs(events: Events, count: int) -> list[np.ndarray]:
    between = np.flatnonzero(events.j >= 0)[:count]
    return [column[between] for column in (events.i, events.j, events.time, events.impulse)]


@pytest.mark.parametrize(("cor", "time", "sliding"), [(0.8, 22.0, 15), (0.5, 7.0, 10)])
def test_a_gas_meets_as_if_it_hopped_along_the_wall(cor, time, sliding):
    """The same gas, in which bounces under 1e-4 m/s go on without loss, on straight ways.

    Hops are 1e-9 m high; what they change grows with each of some 20 later collisions.
    """
    slides = gas_that_slides(cor=cor)
    sliding_trace = simulate(slides, time=time)
    hops = replace(slides, slides=False, elastic_below=1e-4)
    other = simulate(hops, time=time, collisions=3_000_000)
    assert other.stop.reason is StopReason.TIME
    first = sliding_trace.events.time[sliding_trace.events.j == SLIDE][0]
    count = int((sliding_trace.events.j >= 0).sum())
    assert (pairs(sliding_trace.events, count)[2] > first).sum() >= sliding
    mine, its = pairs(sliding_trace.events, count), pairs(other.events, count)
    assert np.array_equal(mine[0], its[0])
    assert np.array_equal(mine[1], its[1])
    assert np.allclose(mine[2], its[2], rtol=0, atol=1e-4)
    a, b = series(sliding_trace), series(other)
    assert a.wall_impulse[-1] == pytest.approx(b.wall_impulse[-1], rel=1e-4)
    assert a.kinetic_energy[-1] == pytest.approx(b.kinetic_energy[-1], rel=1e-4)


# --- what it must keep, and that it goes on -------------------------------------------------


def test_nothing_overlaps_and_nothing_is_gained():
    scene = gas_that_slides(radius=0.5)
    trace = simulate(scene, collisions=5000)
    states = replay(trace, np.linspace(0.0, trace.stop.time, 1500))
    offsets = states.positions[:, :, None] - states.positions[:, None]
    gaps = np.hypot(offsets[..., 0], offsets[..., 1]) + 2 * np.eye(37)
    assert gaps.min() > 1.0 - 1e-11
    assert np.hypot(states.positions[..., 0], states.positions[..., 1]).max() < 9.5 + 1e-11
    energy = series(trace).kinetic_energy
    assert np.all(np.diff(energy) <= 64 * EPSILON * energy[0])
    momentum = [total_angular_momentum(scene) for scene in (trace.start, trace.finish)]
    assert momentum[1] == pytest.approx(momentum[0], abs=5000 * 64 * EPSILON * 95.0)
    assert np.array_equal(states.positions[-1], trace.finish.positions)
    assert np.array_equal(states.velocities[-1], trace.finish.velocities)


def test_it_is_for_one_search_in_a_fixed_circle():
    scene = gas_that_slides()
    with pytest.raises(ValueError, match="slide"):
        simulate(scene, collisions=1, search=NEIGHBOURS)
    with pytest.raises(ValueError, match="fixed wall of a circle"):
        simulate(replace(scene, container_mass=10.0), collisions=1)
