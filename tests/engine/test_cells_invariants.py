"""What cells must keep in every container: energy, momentum, room, order, and a few closed forms.

Tolerances are ``test_invariants``'s: the roundings of n events add up as a random walk does.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import EPSILON, energy_losses, gas, is_wall, scene_of
from test_invariants import MILLION, NEARLY_ELASTIC, WALK, largest_momentum

from snooker_cli.analysis.observables import (
    total_angular_momentum,
    total_energy,
    total_momentum,
)
from snooker_cli.containers import Box, PeriodicBox
from snooker_cli.engine import replay, simulate
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace

SCENES = {
    "circle": lambda: gas("circle", 150, 0.4, cor=NEARLY_ELASTIC),
    "light circle, mixed": lambda: gas(
        "circle", 150, 0.3, mixed=True, cor=NEARLY_ELASTIC, container_mass=100.0
    ),
    "box, mixed": lambda: gas("box", 150, 0.3, mixed=True, cor=NEARLY_ELASTIC, aspect=2.0),
    "periodic": lambda: gas("periodic", 150, 0.4, cor=1.0),
    "periodic, mixed": lambda: gas("periodic", 150, 0.3, mixed=True, cor=NEARLY_ELASTIC),
}
RARE = pytest.param("periodic, mixed", marks=pytest.mark.long)
"""Of a kind that would be compiled for this alone."""

NAMES = [*list(SCENES)[:-1], RARE]


@pytest.fixture(scope="module", params=NAMES)
def run(request) -> Trace:
    """A million events."""
    trace = simulate(SCENES[request.param](), collisions=MILLION, engine="cells")
    assert trace.stop.reason is StopReason.COLLISIONS
    assert trace.collisions == MILLION
    return trace


def test_energy_ledger(run):
    """dE = -sum (1 - e)/(1 + e) J^2/(2 mu), to a part of 1e-12 of the energy or better."""
    loss = math.fsum(energy_losses(run))
    energy, left = total_energy(run.start), total_energy(run.finish)
    if run.start.restitution < 1:
        assert 0.005 * energy < loss < 0.1 * energy
    of_a_ball = energy / run.start.number
    assert abs(left - (energy - loss)) < min(WALK * of_a_ball, 1e-12 * energy)


@pytest.mark.parametrize("run", ["light circle, mixed", "periodic", RARE], indirect=True)
def test_momentum(run):
    drift = total_momentum(run.finish) - total_momentum(run.start)
    assert np.all(abs(drift) < WALK * largest_momentum(run.finish))


@pytest.mark.parametrize("run", ["circle", "light circle, mixed"], indirect=True)
def test_angular_momentum(run):
    reach = run.start.container.radius + float(np.hypot(*run.finish.container_position))
    drift = total_angular_momentum(run.finish) - total_angular_momentum(run.start)
    assert abs(drift) < WALK * largest_momentum(run.finish) * reach


def test_times_never_decrease(run):
    assert np.all(np.diff(run.events.time, prepend=0.0) >= 0)
    assert np.all(run.events.impulse >= 0)


def test_nothing_overlaps_or_escapes(run):
    """At 50 of a million events, just after them; the two of each event touch."""
    chosen = np.sort(np.random.default_rng(1).choice(MILLION, 50, replace=False))
    states = replay(run, run.events.time[chosen])
    for k, event in enumerate(chosen.tolist()):
        scene = replace(
            run.start,
            positions=states.positions[k],
            container_position=states.container_positions[k],
        )
        bound = slack(run, states.velocities[k])
        gaps, room = gaps_and_room(scene)
        assert gaps.min() > -bound
        assert room.min() > -bound
        i, j = run.events.i[event], run.events.j[event]
        assert abs(room[i] if j < 0 else gaps[i, j]) < bound


def gaps_and_room(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Between balls, (N, N), inf for a ball and itself; and between each ball and the wall, m."""
    x, y = (scene.positions[:, np.newaxis] - scene.positions).transpose(2, 0, 1)
    off = abs(scene.positions - scene.container_position)
    if not scene.container.has_wall:
        x -= scene.container.width * np.rint(x / scene.container.width)
        y -= scene.container.height * np.rint(y / scene.container.height)
        room = np.min(np.array(scene.container.size) / 2 - off, axis=1)
    elif isinstance(scene.container, Box):
        room = np.min(np.array(scene.container.size) / 2 - off, axis=1) - scene.radii
    else:
        room = scene.container.radius - scene.radii - np.hypot(*off.T)
    gaps = np.hypot(x, y) - scene.radii[:, np.newaxis] - scene.radii
    np.fill_diagonal(gaps, math.inf)
    return gaps, room


def slack(trace: Trace, velocities: np.ndarray) -> float:
    """As in ``test_invariants``: quadratics of squared distances, clocks, places, by rounding."""
    size = max(trace.start.container.size)
    away = float(np.max(abs(trace.finish.container_position)))
    fastest = float(np.max(np.hypot(*velocities.T)))
    bound = 8 * EPSILON * size**2 / (2 * float(trace.start.radii.min()))
    return bound + 4 * EPSILON * (fastest * trace.stop.time + size + away)


@pytest.mark.parametrize(
    ("shape", "mixed"), [("circle", False), ("box", True), ("periodic", False)]
)
@pytest.mark.parametrize(
    "number",
    [
        pytest.param(1, marks=pytest.mark.long),
        *(2, 3, 10, 100, 1000),
        pytest.param(3000, marks=pytest.mark.long),  # as 1000, but for the time that it takes
    ],
)
def test_from_one_ball_to_thousands(shape, mixed, number):
    """A fifth of the container is covered, or so little that four balls fit side by side."""
    packing = 0.2 if number >= 10 else 0.02 * number
    scene = gas(shape, number, packing, mixed=mixed, cor=0.99)
    limit = {"time": 100.0} if number == 1 else {"collisions": 10 * number}
    trace = simulate(scene, **limit, engine="cells")
    assert trace.stop.reason.complete
    assert np.all(np.diff(trace.events.time, prepend=0.0) >= 0)
    gaps, room = gaps_and_room(trace.finish)
    bound = slack(trace, trace.finish.velocities)
    assert gaps.min() > -bound
    assert room.min() > -bound
    loss = math.fsum(energy_losses(trace))
    energy, left = scene.kinetic_energy, trace.finish.kinetic_energy
    assert left == pytest.approx(energy - loss, rel=4 * EPSILON * math.sqrt(number * 10 + 36) * 6)


@pytest.mark.parametrize("name", NAMES)
def test_twice_the_speed_is_the_same_run_in_half_the_time(name):
    """Bit for bit: a factor of two rounds nothing."""
    scene = SCENES[name]()
    once = simulate(scene, collisions=20_000, engine="cells")
    faster = replace(scene, velocities=2 * scene.velocities)
    twice = simulate(faster, collisions=20_000, engine="cells")
    assert np.array_equal(once.events.i, twice.events.i)
    assert np.array_equal(once.events.j, twice.events.j)
    assert np.array_equal(once.events.time, 2 * twice.events.time)
    assert np.array_equal(2 * once.events.impulse, twice.events.impulse)
    assert np.array_equal(once.finish.positions, twice.finish.positions)


def test_virial_identity_in_a_square_box():
    """d(sum m x.v) = int 2K dt - sum (L/2 - r) J_wall + sum (r + r') J_pair."""
    scene = gas("box", 100, 0.4, cor=0.99)
    trace = simulate(scene, collisions=20_000, engine="cells")
    events = trace.events
    energies = scene.kinetic_energy - np.concatenate([[0.0], np.cumsum(energy_losses(trace))])
    spans = np.diff(events.time, prepend=0.0, append=trace.stop.time)
    hits = np.where(is_wall(events), 1.0 - scene.container.width / 2, 2.0) * events.impulse
    before, after = (
        np.sum(one.masses[:, np.newaxis] * one.positions * one.velocities)
        for one in (scene, trace.finish)
    )
    change = math.fsum(hits) + 2 * math.fsum(energies * spans)
    # As in ``test_invariants``: contacts are off by the clock, the energy by its own walk.
    walk = 6 * math.sqrt(len(events)) * 4 * EPSILON
    speed = float(np.max(np.hypot(*scene.velocities.T)))
    contacts = walk * events.impulse.max() * (speed * trace.stop.time + scene.container.width)
    ledger = walk * scene.kinetic_energy / scene.number * 2 * trace.stop.time
    assert abs(after - before - change) < contacts + ledger
    assert contacts + ledger < 1e-8 * math.fsum(abs(hits))


# --- closed forms -----------------------------------------------------------------------------

# A lone ball would have a kernel compiled for itself; nothing meets this one.
AT_REST = (0.0, 0.0, 0.0, 0.0, 0.5, 1.0)


def test_a_billiard_in_a_box():
    """The place is the straight way, folded at the walls; and each wall is hit when it is due.

    The clock is rounded, and a ball turns round so much before or after the wall. The way is a
    parallelogram, round a ball at rest in the middle.
    """
    start, velocity, end = np.array([-2.0, 2.0]), np.array([10.0, 6.0]), 1000.0
    scene = scene_of([(*start, *velocity, 1.0, 1.0), AT_REST], container=Box(12.0, 8.0))
    trace = simulate(scene, time=end, engine="cells")
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


@pytest.mark.parametrize("container_mass", [math.inf, 1e12])
def test_whispering_gallery(container_mass):
    """As in ``test_exact_scenes``: a chord at an angle of 1e-6 takes 2a sin(angle)/v, none is
    missed. A thousand thousand million times as heavy, the container is as good as fixed."""
    angle, speed, reach, bounces = 1e-6, 10.0, 9.0, 20_000
    velocity = -speed * math.sin(angle), speed * math.cos(angle)
    # Alike in the fixed one only: of that kind there are others.
    company = (*AT_REST[:4], 1.0, 1.0) if math.isinf(container_mass) else AT_REST
    scene = scene_of([(reach, 0.0, *velocity, 1.0, 1.0), company], container_mass=container_mass)
    trace = simulate(scene, collisions=bounces, engine="cells")
    interval = 2 * reach * math.sin(angle) / speed
    walk = 6 * math.sqrt(bounces) * 2 * EPSILON / angle
    assert np.allclose(np.diff(trace.events.time), interval, rtol=walk, atol=0)
    assert np.allclose(trace.events.impulse, 2 * speed * math.sin(angle), rtol=walk, atol=0)


def test_a_ball_in_a_corner_hits_both_walls():
    balls = [(0.0, 0.0, 3.0, 3.0, 1.0, 1.0), (2.5, -2.5, 0.0, 0.0, 0.5, 1.0)]
    scene = scene_of(balls, container=Box(8.0, 8.0))
    trace = simulate(scene, collisions=40, engine="cells")
    expected = np.repeat(1.0 + 2.0 * np.arange(20), 2)
    assert trace.events.time == pytest.approx(expected, rel=40 * EPSILON)
    assert np.all(trace.events.impulse == 6.0)


@pytest.mark.parametrize("along", [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8)])
def test_balls_that_meet_through_the_sides_of_a_periodic_box(along):
    """They start near the middle and fly apart, half of the box's diagonal or side."""
    x, y = along
    balls = [(x, y, 2 * x, 2 * y, 0.5, 1.0), (-x, -y, -2 * x, -2 * y, 0.5, 1.0)]
    scene = scene_of(balls, container=PeriodicBox(10.0, 10.0))
    trace = simulate(scene, collisions=1, engine="cells")
    way = trace.stop.time * 2.0
    at = np.array([[x, y], [-x, -y]]) * (1.0 + way)
    gaps = [
        math.hypot(*(at[0] - at[1] - 10.0 * np.array(image)))
        for image in itertools.product(range(-9, 10), repeat=2)
    ]
    assert min(gaps) == pytest.approx(1.0, rel=16 * EPSILON * (1 + way))
    if along != (0.6, 0.8):
        assert trace.stop.time == pytest.approx((9.0 - 2.0) / 4.0, rel=8 * EPSILON)
        assert trace.events.impulse.tolist() == [4.0]
