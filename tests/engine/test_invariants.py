"""What the dynamics must keep, at any coefficient of restitution, over up to a million events.

Every event rounds what it changes, and the roundings of n events add up as a random walk does:
to sqrt(n) times one event's, in which six standard deviations never happen. ``WALK`` counts four
roundings an event. An error that is always to one side would grow as n: at a million events, a
thousand times more than what is let pass.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import EPSILON, energy_losses, is_wall, mixed_scene, report_scene

from snooker_cli.analysis.observables import (
    total_angular_momentum,
    total_energy,
    total_momentum,
)
from snooker_cli.engine import replay, simulate
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

MILLION = 1_000_000
WALK = 6 * math.sqrt(MILLION) * 4 * EPSILON

NEARLY_ELASTIC = 1 - 2.0**-20
"""So that 1 + e is a double: where it is rounded, the loss of a million events is off by 1e-10."""

SCENES = {
    "elastic, fixed": lambda: report_scene(cor=1.0),
    "elastic, free": lambda: report_scene(cor=1.0, container_mass=1e7),
    "lossy, fixed": lambda: report_scene(cor=NEARLY_ELASTIC),
    "lossy, free": lambda: report_scene(cor=NEARLY_ELASTIC, container_mass=1e7),
    "mixed, fixed": lambda: mixed_scene(math.inf, NEARLY_ELASTIC),
    "mixed, light": lambda: mixed_scene(30.0, NEARLY_ELASTIC),
}


@pytest.fixture(scope="module", params=SCENES)
def run(request) -> Trace:
    """A million events."""
    trace = simulate(SCENES[request.param](), collisions=MILLION)
    assert trace.collisions == MILLION
    return trace


def reach(scene: Scene) -> float:
    """How far from the origin anything is, m."""
    return scene.container.radius + float(np.hypot(*scene.container_position))


def largest_momentum(scene: Scene) -> float:
    """Of a ball, or of the container if it moves, kg m/s."""
    of_balls = float(np.max(scene.masses * np.hypot(*scene.velocities.T)))
    if not scene.free:
        return of_balls
    return max(of_balls, scene.container_mass * float(np.hypot(*scene.container_velocity)))


def test_energy_ledger(run):
    """dE = -sum (1 - e)/(1 + e) J^2/(2 mu), to a part of 1e-12 of the energy or better."""
    loss = math.fsum(energy_losses(run))
    energy, left = total_energy(run.start), total_energy(run.finish)
    if run.start.restitution < 1:
        assert 0.02 * energy < loss < 0.1 * energy
    of_a_ball = energy / run.start.number
    assert abs(left - (energy - loss)) < min(WALK * of_a_ball, 1e-12 * energy)


def test_angular_momentum(run):
    """About the centre of a fixed circle; about the lab's origin with a free one."""
    drift = total_angular_momentum(run.finish) - total_angular_momentum(run.start)
    assert abs(drift) < WALK * largest_momentum(run.finish) * reach(run.finish)


@pytest.mark.parametrize("run", [name for name in SCENES if "fixed" not in name], indirect=True)
def test_momentum_and_centre_of_mass_of_a_free_container(run):
    start, finish = run.start, run.finish
    rounding = WALK * largest_momentum(finish)
    assert np.all(np.abs(total_momentum(finish) - total_momentum(start)) < rounding)

    before, after = (
        scene.masses @ scene.positions + scene.container_mass * scene.container_position
        for scene in (start, finish)
    )
    travelled = total_momentum(start) * run.stop.time
    # The momentum's drift has all the time to act; and every move rounds a place.
    moves = WALK * (start.masses.max() * reach(finish))
    moves += WALK * start.container_mass * float(np.hypot(*finish.container_position))
    assert np.all(np.abs(after - before - travelled) < rounding * run.stop.time + moves)


@pytest.mark.parametrize(("cor", "collisions"), [(1.0, 500_000), (0.95, 3000)])
@pytest.mark.parametrize("mixed", [False, True])
def test_virial_identity(cor, collisions, mixed):
    """d(sum m x.v) = int 2K dt - sum (R - r) J_wall + sum (r + r') J_pair, in a fixed circle."""
    scene = mixed_scene(restitution=cor) if mixed else report_scene(cor=cor)
    trace = simulate(scene, collisions=collisions)
    start, events = trace.start, trace.events
    assert len(events) == collisions
    energies = start.kinetic_energy - np.concatenate([[0.0], np.cumsum(energy_losses(trace))])
    spans = np.diff(events.time, prepend=0.0, append=trace.stop.time)
    radii = np.append(start.radii, -start.container.radius)
    contact_distances = radii[events.i] + radii[events.j]  # at the wall minus (R - r)
    hits = contact_distances * events.impulse
    before, after = (
        np.sum(scene.masses[:, np.newaxis] * scene.positions * scene.velocities)
        for scene in (start, trace.finish)
    )
    change = math.fsum(hits) + 2 * math.fsum(energies * spans)
    # A contact is off by the clock's rounding times the speed; the energy by its own walk.
    walk = 6 * math.sqrt(collisions) * 4 * EPSILON
    speed = float(np.max(np.hypot(*start.velocities.T)))
    contacts = walk * events.impulse.max() * (speed * trace.stop.time + start.container.radius)
    ledger = walk * start.kinetic_energy / start.number * 2 * trace.stop.time
    assert abs(after - before - change) < contacts + ledger
    assert contacts + ledger < 1e-8 * math.fsum(abs(hits))


@pytest.mark.parametrize("container_mass", [30.0, math.inf])
def test_every_impulse_is_along_the_line_of_centres_and_opposite(container_mass):
    """Balls i and j get -J n and +J n, n from i to j; at the wall the container gets +J n."""
    scene = replace(mixed_scene(container_mass, 0.9), wall_restitution=0.8)
    trace = simulate(scene, collisions=400)
    events = trace.events
    states = replay(trace, events.time)
    bodies = np.concatenate([states.positions, states.container_positions[:, np.newaxis]], axis=1)
    speeds = np.concatenate([states.velocities, states.container_velocities[:, np.newaxis]], axis=1)
    first = np.concatenate([scene.velocities, scene.container_velocity[np.newaxis]])
    kicks = np.diff(speeds, axis=0, prepend=first[np.newaxis])
    row = np.arange(len(events))
    # j = -1 is the last row: the container. Its line of centres runs from its own to the ball's.
    lines = bodies[row, events.j] - bodies[row, events.i]
    lines[is_wall(events)] *= -1
    normals = lines / np.hypot(*lines.T)[:, np.newaxis]
    expected = np.zeros_like(kicks)
    masses = np.append(scene.masses, container_mass)[:, np.newaxis]
    impulses = events.impulse[:, np.newaxis] * normals
    expected[row, events.i] = -impulses / masses[events.i]
    expected[row, events.j] = impulses / masses[events.j]
    rounding = 8 * EPSILON * np.max(np.hypot(*speeds.T))
    assert np.max(abs(kicks - expected)) < rounding
    assert np.all(events.impulse > 0)
    others = np.ones(kicks.shape[:2], dtype=bool)
    others[row, events.i] = others[row, events.j] = False
    assert np.all(kicks[others] == 0)


@pytest.mark.parametrize("name", SCENES)
def test_twice_the_speed_is_the_same_run_in_half_the_time(name):
    """Bit for bit: a factor of two rounds nothing."""
    scene = SCENES[name]()
    once = simulate(scene, collisions=20_000)
    twice = simulate(replace(scene, velocities=2 * scene.velocities), collisions=20_000)
    assert np.array_equal(once.events.i, twice.events.i)
    assert np.array_equal(once.events.j, twice.events.j)
    assert np.array_equal(once.events.time, 2 * twice.events.time)
    assert np.array_equal(2 * once.events.impulse, twice.events.impulse)
    assert np.array_equal(once.finish.positions, twice.finish.positions)


@pytest.mark.parametrize("container_mass", [30.0, math.inf])
def test_reversed_velocities_retrace_an_elastic_run(container_mass):
    """150 events there and back. Errors grow by e^(0.041 · 300) = 2e5 (the scene's Lyapunov
    exponent per event), from some 1e-14 s; 1e-6 s leaves the exponent's spread room."""
    there = simulate(report_scene(container_mass=container_mass), collisions=151)
    events = there.events
    middle = 0.5 * (events.time[149] + events.time[150])
    states = replay(there, [middle])
    turned = replace(
        there.start,
        positions=states.positions[0].copy(),
        velocities=-states.velocities[0],
        container_position=states.container_positions[0],
        container_velocity=-states.container_velocities[0],
    )
    back = simulate(turned, collisions=150).events
    assert np.array_equal(back.i, events.i[149::-1])
    assert np.array_equal(back.j, events.j[149::-1])
    assert np.allclose(middle - back.time, events.time[149::-1], rtol=0, atol=1e-6)


def test_nothing_overlaps_or_escapes(run):
    """At 500 of a million events, by more than rounding.

    The quadratics are of squared distances, up to (2R)^2, and rounded: that moves a contact by
    8 epsilon (2R)^2 over its own diameter. A clock that reads t is rounded by epsilon t / 2, as
    are the places of two bodies that move by it; and their coordinates, far from the origin.
    """
    start, events = run.start, run.events
    chosen = np.sort(np.random.default_rng(1).choice(len(events), 500, replace=False))
    states = replay(run, events.time[chosen])
    fastest = np.max(np.hypot(*states.velocities.T))
    diameters = start.radii[:, np.newaxis] + start.radii
    bound = 8 * EPSILON * (2 * start.container.radius) ** 2 / diameters.min()
    bound += 4 * EPSILON * (fastest * run.stop.time + reach(run.finish))
    offsets = states.positions - states.container_positions[:, np.newaxis]
    room = start.container.radius - start.radii - np.hypot(offsets[..., 0], offsets[..., 1])
    assert room.min() > -bound
    x, y = (offsets[:, :, np.newaxis] - offsets[:, np.newaxis]).transpose(3, 0, 1, 2)
    gaps = np.hypot(x, y) - diameters
    gaps[:, np.arange(start.number), np.arange(start.number)] = math.inf
    assert gaps.min() > -bound
    # They are contacts: the two of each event touch.
    pairs = ~is_wall(events)[chosen]
    touching = gaps[np.flatnonzero(pairs), events.i[chosen][pairs], events.j[chosen][pairs]]
    assert np.max(abs(touching)) < bound
