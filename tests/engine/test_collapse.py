"""Collisions that become elastic where infinitely many would follow each other, and a run goes on.

Slow ones (``elastic_below``), or those of a ball whose last contact still lasts (``tc``).
"""

import importlib
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import (
    EPSILON,
    digest,
    gas,
    is_wall,
    lone_bouncer,
    mixed_scene,
    reduced_masses,
    report_scene,
    scene_of,
    trap_sums,
)
from test_twin import compared

from snooker_cli.engine import replay, series, simulate
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace

SOFT = [{"elastic_below": 4.0}, {"contact_duration": 0.3}]
"""So that a part of the collisions, not all and not few, is elastic in a gas at 10 m/s."""

ENGINES = ["allpairs", "cells"]

RARE = pytest.mark.long
"""Of a kind that would be compiled for this alone."""


def soft(scene: Scene, **changes: float) -> Scene:
    return replace(scene, **changes)


# --- which collisions are elastic -----------------------------------------------------------


def elastic_events(trace: Trace) -> np.ndarray:
    """Which events took nothing; every other one took its share."""
    found = series(trace)
    taken = -np.diff(found.kinetic_energy + found.container_energy)
    start, events = trace.start, trace.events
    e = np.where(is_wall(events), start.wall_restitution, start.restitution)
    # J^2/(2 mu) is (1 + e)^2/(1 - e^2) of a loss, and of an elastic one's J a part (1 + e)^2/4.
    shares = (1 - e) / (1 + e) * events.impulse**2 / (2 * reduced_masses(trace))
    rounding = 16 * EPSILON * trace.start.number * found.kinetic_energy[0]
    free = abs(taken) <= rounding
    assert np.all(abs(taken - shares)[~free] <= rounding)
    return free


@pytest.mark.parametrize(
    ("mass", "engine"),
    [
        (math.inf, "allpairs"),
        (math.inf, "cells"),
        (20.0, "allpairs"),
        pytest.param(20.0, "cells", marks=RARE),
    ],
)
def test_slow_collisions_are_elastic_and_no_others(mass, engine):
    """The normal speed is J/((1 + e) mu), with an e of 1 where nothing is lost."""
    scene = soft(report_scene(cor=0.9, container_mass=mass), elastic_below=4.0)
    trace = simulate(scene, collisions=600, engine=engine)
    free = elastic_events(trace)
    assert 100 < free.sum() < 500
    normal = trace.events.impulse / (np.where(free, 2.0, 1.9) * reduced_masses(trace))
    assert normal[free].max() < 4.0 <= normal[~free].min()


@pytest.mark.parametrize("engine", ENGINES)
def test_collisions_of_who_is_still_in_contact_are_elastic_and_no_others(engine):
    scene = soft(report_scene(cor=0.9), contact_duration=0.3)
    trace = simulate(scene, collisions=600, engine=engine)
    free, events = elastic_events(trace), trace.events
    assert 100 < free.sum() < 500
    speed = np.sqrt(2 * series(trace).kinetic_energy / scene.number)
    # Balls of mass 1 kg; renewed at each 37th collision.
    lasts = 0.3 * scene.mean_free_path / speed[np.arange(len(events)) // 37 * 37]
    last = np.full(scene.number + 1, -math.inf)
    for k, (now, i, j) in enumerate(zip(events.time, events.i, events.j, strict=True)):
        since = now - max(last[i], last[j])
        if abs(since - lasts[k]) > 1e-12:
            assert free[k] == (since < lasts[k])
        last[[i, j]] = now
        last[-1] = -math.inf  # the wall is no ball


def test_mean_free_path():
    """Boltzmann's 1.501 m for the report's balls, and 15.708 m between hits of the wall."""
    between = 10**2 * math.pi / (2 * math.sqrt(2) * 37 * 2.0)
    expected = 1 / (1 / between + 2 / (math.pi * 10.0))
    assert report_scene().mean_free_path == pytest.approx(expected, rel=4 * EPSILON)
    assert between == pytest.approx(1.5010, abs=5e-5)
    alone = scene_of([(0.0, 0.0, 1.0, 0.0, 1.0, 1.0)])
    assert alone.mean_free_path == pytest.approx(math.pi * 10.0 / 2, rel=4 * EPSILON)
    periodic = gas("periodic", 30, 0.1)
    density = 30 / periodic.container.area
    assert periodic.mean_free_path == pytest.approx(1 / (math.sqrt(8) * density * 2.0))


# --- event by event -------------------------------------------------------------------------


@pytest.mark.parametrize("change", SOFT, ids=str)
@pytest.mark.parametrize(("engine", "mass"), [("allpairs", math.inf), ("cells", 20.0)])
def test_the_twins_collisions_in_a_circle(change, engine, mass):
    scene = soft(mixed_scene(mass, 0.6), **change)
    result = compared(scene, 80, engine=engine)
    assert result.events == 80
    assert result.time < 1e-6


@pytest.mark.parametrize(("change", "shape"), [(SOFT[0], "box"), (SOFT[1], "periodic")])
def test_the_twins_collisions_in_a_box(change, shape):
    scene = soft(gas(shape, 24, 0.3, cor=0.6), **change)
    result = compared(scene, 60)
    assert result.events == 60
    assert result.time < 1e-6


@pytest.mark.parametrize("change", SOFT, ids=str)
def test_without_it_the_collisions_are_others(change):
    """What the comparisons above could miss."""
    scene = report_scene(cor=0.6)
    with_it, without = (
        simulate(each, collisions=40).events for each in (soft(scene, **change), scene)
    )
    assert not np.array_equal(with_it.i, without.i)


# --- the same bits --------------------------------------------------------------------------


def assert_replayed(trace: Trace) -> None:
    """The states at the ends are those of the run, bit for bit."""
    states = replay(trace, [0.0, trace.stop.time])
    for k, end in enumerate((trace.start, trace.finish)):
        assert np.array_equal(states.positions[k], end.positions)
        assert np.array_equal(states.velocities[k], end.velocities)
        assert np.array_equal(states.container_positions[k], end.container_position)


@pytest.mark.parametrize("change", SOFT, ids=str)
@pytest.mark.parametrize(
    ("mass", "engine"),
    [
        (math.inf, "allpairs"),
        pytest.param(math.inf, "cells", marks=RARE),
        (20.0, "allpairs"),
        (20.0, "cells"),
    ],
)
def test_a_replay_has_the_runs_bits(change, engine, mass):
    scene = soft(mixed_scene(mass, 0.8), **change)
    trace = simulate(scene, collisions=2000, engine=engine)
    assert trace.stop.reason is StopReason.COLLISIONS
    assert_replayed(trace)


@pytest.mark.parametrize("change", SOFT, ids=str)
@pytest.mark.parametrize("shape", ["box", "periodic"])
def test_a_replay_has_the_runs_bits_in_a_box(change, shape):
    trace = simulate(soft(gas(shape, 60, 0.3, cor=0.8), **change), collisions=2000)
    assert_replayed(trace)


@pytest.mark.parametrize("change", SOFT, ids=str)
def test_a_replay_has_the_bits_of_sorted_balls(change, monkeypatch):
    """A sum over balls, which the TC model needs, is made in the scene's order."""
    engines = importlib.import_module("snooker_cli.engine.simulation")
    monkeypatch.setattr(engines, "REORDERED", 2)
    monkeypatch.setattr(engines, "REORDER_AFTER", 1)
    monkeypatch.setattr(
        importlib.import_module("snooker_cli.engine.simulation"), "SMALL_CHUNK", 100
    )
    scene = soft(gas("circle", 200, 0.4, cor=0.8), **change)
    assert_replayed(simulate(scene, collisions=3000, engine="cells"))


def test_a_gas_twice_as_fast_does_the_same_in_half_the_time():
    """The TC model has no time of its own: its contacts last a part of the mean free time."""
    slow = soft(report_scene(cor=0.5), contact_duration=0.1)
    fast = replace(slow, velocities=2 * slow.velocities)
    a, b = (simulate(scene, collisions=3000).events for scene in (slow, fast))
    assert np.array_equal(a.i, b.i)
    assert np.array_equal(a.j, b.j)
    assert np.array_equal(a.time, 2 * b.time)
    assert np.array_equal(2 * a.impulse, b.impulse)


def test_an_elastic_gas_knows_no_difference():
    plain = digest(simulate(report_scene(), collisions=1000).events)
    for change in SOFT:
        assert digest(simulate(soft(report_scene(), **change), collisions=1000).events) == plain


# --- what would stop goes on ----------------------------------------------------------------


def three_in_a_line(restitution: float) -> Scene:
    """Two balls that drive a third one between them from both sides."""
    balls = [
        (-4.0, 0.0, 1.0, 0.0, 1.0, 1.0),
        (0.0, 0.0, 0.0, 0.0, 1.0, 1.0),
        (5.0, 0.0, -1.0, 0.0, 1.0, 1.0),
    ]
    return scene_of(balls, restitution=restitution)


LINE_COLLAPSE = 7 - 4 * 3**0.5
"""Three balls in a line collapse below this restitution, 0.0718 (McNamara & Young 1992)."""

STOPPING = {
    "three balls": (lambda: three_in_a_line(LINE_COLLAPSE / 2), StopReason.COLLAPSE),
    "cluster": (lambda: report_scene(cor=0.1, wall_cor=1.0), StopReason.COLLAPSE),
    "wall trap": (lone_bouncer, StopReason.WALL_TRAP),
}


@pytest.mark.parametrize("change", [{"elastic_below": 1e-3}, {"contact_duration": 0.01}], ids=str)
@pytest.mark.parametrize(
    ("name", "engine"),
    [
        *itertools.product(["three balls", "cluster"], ENGINES),
        ("wall trap", "allpairs"),
        pytest.param("wall trap", "cells", marks=RARE),
    ],
)
def test_what_would_stop_goes_on(name, change, engine):
    make, reason = STOPPING[name]
    scene = make()
    without = simulate(scene, collisions=20_000, time=20.0, engine=engine)
    assert without.stop.reason is reason
    trace = simulate(soft(scene, **change), collisions=20_000, time=20.0, engine=engine)
    assert trace.stop.reason in (StopReason.TIME, StopReason.COLLISIONS)
    assert trace.stop.time > 2 * min(without.stop.time, 10.0)
    assert trace.finish.kinetic_energy < scene.kinetic_energy


def test_a_trapped_ball_ends_at_the_energy_of_its_slide():
    """1/2 m v_t^2, and what a normal speed below 1e-3 m/s adds; the wall's force is m v_t^2/a."""
    trace = simulate(soft(lone_bouncer(), elastic_below=1e-3), time=16.0)
    left = trace.finish.kinetic_energy - 0.5 * 8.0**2
    assert -1e-12 < left < 0.5e-6
    found = series(trace)
    late = found.time > 15.0
    force = np.polyfit(found.time[late], found.wall_impulse[late], 1)[0]
    assert force == pytest.approx(8.0**2 / 9.0, rel=1e-3)
    # Until it would slide the wall has taken nearly all that it takes of infinitely many hits.
    trap = trap_sums(6.0, 8.0, 0.9, 9.0)
    before = found.wall_impulse[np.searchsorted(found.time, 0.5 + trap.duration)]
    assert before == pytest.approx(6.0 / 0.9 * 1.9 + trap.impulse, abs=0.1)
