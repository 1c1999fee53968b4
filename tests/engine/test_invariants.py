"""What the dynamics must keep in every container, elastic or not.

Every event rounds what it changes, and the roundings of n events add up as a random walk does:
to sqrt(n) times one event's, in which six standard deviations never happen. ``WALK`` counts four
roundings per event. An error that is always to one side would grow as n: at a million events, a
thousand times more than the tolerance.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import EPSILON, energy_losses, gas, mixed_scene, report_scene

from snooker_cli.analysis.observables import (
    total_angular_momentum,
    total_energy,
    total_momentum,
)
from snooker_cli.containers import Circle
from snooker_cli.engine import replay, simulate
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace

MILLION = 1_000_000
WALK = 6 * math.sqrt(MILLION) * 4 * EPSILON

NEARLY_ELASTIC = 1 - 2.0**-20
"""So that 1 + e is a double: where it is rounded, the loss of a million events is off by 1e-10."""

SCENES = {
    "circle, elastic": lambda: report_scene(cor=1.0),
    "circle": lambda: gas("circle", 150, 0.4, cor=NEARLY_ELASTIC),
    "heavy circle": lambda: report_scene(cor=NEARLY_ELASTIC, container_mass=1e7),
    "light circle": lambda: mixed_scene(30.0, NEARLY_ELASTIC),
    "box": lambda: gas("box", 150, 0.3, mixed=True, cor=NEARLY_ELASTIC, aspect=2.0),
    "channel": lambda: gas("channel", 60, 0.3, cor=NEARLY_ELASTIC),
    "periodic": lambda: gas("periodic", 150, 0.4, cor=1.0),
}


@pytest.fixture(scope="module", params=SCENES)
def run(request) -> Trace:
    """A million events."""
    trace = simulate(SCENES[request.param](), collisions=MILLION)
    assert trace.stop.reason is StopReason.COLLISIONS
    assert trace.collisions == MILLION
    return trace


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
        assert 0.005 * energy < loss < 0.1 * energy
    of_a_ball = energy / run.start.number
    assert abs(left - (energy - loss)) < min(WALK * of_a_ball, 1e-12 * energy)


def test_momentum_and_angular_momentum(run):
    """Momentum with a free container or without walls; angular momentum about a fixed circle's
    centre, or with a free circle about the lab's origin. And the centre of mass of both."""
    start, finish = run.start, run.finish
    rounding = WALK * largest_momentum(finish)
    away = float(np.hypot(*finish.container_position))
    reach = max(start.container.size) / 2 + away
    if isinstance(start.container, Circle):
        turned = total_angular_momentum(finish) - total_angular_momentum(start)
        assert abs(turned) < rounding * reach
    if start.free or not start.container.has_wall:
        assert np.all(np.abs(total_momentum(finish) - total_momentum(start)) < rounding)
    if start.free:
        before, after = (
            scene.masses @ scene.positions + scene.container_mass * scene.container_position
            for scene in (start, finish)
        )
        travelled = total_momentum(start) * run.stop.time
        # The momentum's drift has all the time to act; and every move rounds a place.
        moves = WALK * (start.masses.max() * reach + start.container_mass * away)
        assert np.all(np.abs(after - before - travelled) < rounding * run.stop.time + moves)


def gaps_and_room(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Between balls, (N, N), inf for a ball and itself; and between each ball and the wall, m."""
    offsets = scene.container.nearest_image(scene.positions[:, np.newaxis] - scene.positions)
    gaps = np.hypot(*offsets.transpose(2, 0, 1)) - scene.radii[:, np.newaxis] - scene.radii
    np.fill_diagonal(gaps, math.inf)
    places = scene.positions - scene.container_position
    return gaps, scene.container.wall_gaps(places, scene.radii)


def slack(trace: Trace, velocities: np.ndarray) -> float:
    """What a contact is off by, m.

    The quadratics are of squared distances, up to the container's size squared, and rounded: that
    moves a contact by 8 epsilon times that over its own diameter. A clock that reads t is rounded
    by epsilon t / 2, as are the places of two bodies that move by it; and their coordinates, far
    from the origin.
    """
    size = max(trace.start.container.size)
    away = float(np.max(abs(trace.finish.container_position)))
    fastest = float(np.max(np.hypot(*velocities.T)))
    bound = 8 * EPSILON * size**2 / (2 * float(trace.start.radii.min()))
    return bound + 4 * EPSILON * (fastest * trace.stop.time + size + away)


def test_nothing_overlaps_or_escapes(run):
    """At 200 of a million events, just after them; the two of each event touch."""
    chosen = np.sort(np.random.default_rng(1).choice(MILLION, 200, replace=False))
    states = replay(run, run.events.time[chosen])
    assert np.all(np.diff(run.events.time, prepend=0.0) >= 0)
    assert np.all(run.events.impulse >= 0)
    for k, event in enumerate(chosen.tolist()):
        scene = replace(
            run.start,
            positions=states.positions[k],
            container_position=states.container_position[k],
        )
        bound = slack(run, states.velocities[k])
        gaps, room = gaps_and_room(scene)
        assert gaps.min() > -bound
        assert room.min() > -bound
        i, j = run.events.i[event], run.events.j[event]
        assert abs(room[i] if j < 0 else gaps[i, j]) < bound


@pytest.mark.parametrize("name", ["light circle", "box", "periodic", "tc"])
def test_twice_the_speed_is_the_same_run_in_half_the_time(name):
    """Bit for bit: a factor of two rounds nothing. The TC model has no time of its own."""
    tc = replace(report_scene(cor=0.5), contact_duration=0.1)
    once = simulate(tc if name == "tc" else SCENES[name](), collisions=20_000)
    twice = simulate(replace(once.start, velocities=2 * once.start.velocities), collisions=20_000)
    assert np.array_equal(once.events.i, twice.events.i)
    assert np.array_equal(once.events.j, twice.events.j)
    assert np.array_equal(once.events.time, 2 * twice.events.time)
    assert np.array_equal(2 * once.events.impulse, twice.events.impulse)
    assert np.array_equal(once.finish.positions, twice.finish.positions)
