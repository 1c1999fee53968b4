"""Observables and theory of boxes and periodic boxes: by hand, by identities, of many balls."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import report_scene

from snooker_cli import theory
from snooker_cli.analysis import observables, predictions
from snooker_cli.config import parse
from snooker_cli.containers import SHAPES, Box
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import CONTAINER, SPEED_BIN, Trace

GAS = """\
container: {shape: periodic, packing: 0.3}
balls: {count: 64, radius: 1.0, speed: 10.0, speeds: maxwell}
cor: 0.9
collisions: 2000
"""


def head_on(shape: str) -> Scene:
    """Two balls of 2 kg and radius 1 m, 6 m apart, that fly at each other at 1 m/s; CoR 1/2.

    In a square of 16 m, off its centre. Every number is a dyadic fraction: sums are exact.
    """
    return Scene(
        positions=np.array([[-2.75, 1.0], [3.25, 1.0]]),
        velocities=np.array([[1.0, 0.0], [-1.0, 0.0]]),
        radii=np.ones(2),
        masses=np.full(2, 2.0),
        container=SHAPES[shape](16.0, 16.0),
        container_mass=math.inf,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=0.5,
        wall_restitution=0.5,
    )


def gas(*overrides: str, repeat: int = 0) -> Scene:
    return starting_scene(parse(GAS, overrides=overrides).experiment, repeat)


@pytest.fixture(scope="module")
def cooling() -> Trace:
    return simulate(gas(), collisions=2000)


# Pressure


def test_periodic_pressure_by_hand() -> None:
    """The balls meet after 2 s, part at half their speed, and meet 12 s later at the other side.

    Impulses of 3 and 1.5 kg m/s at 2 m: 6 and 9 kg m²/s; kinetic energies of 2, 0.5 and 0.125 J.
    """
    trace = simulate(head_on("periodic"), time=20.0)
    found = observables.series(trace)
    assert found.time.tolist() == [0, 2, 14]
    assert found.pair_virial.tolist() == [0, 6, 9]
    assert found.wall_impulse.tolist() == [0, 0, 0]
    assert found.kinetic_energy.tolist() == [2, 0.5, 0.125]
    kinetic_to = {2: 4.0, 14: 10.0, 20: 10.75}
    time, values = observables.cumulative_pressure(trace, found)
    assert time.tolist() == [2, 14]
    expected = [(kinetic_to[2] + 6 / 2) / (256 * 2), (kinetic_to[14] + 9 / 2) / (256 * 14)]
    assert values == pytest.approx(expected, rel=4 * EPSILON)
    whole = kinetic_to[20] + 9 / 2
    assert observables.mean_pressure(trace) == pytest.approx(whole / (256 * 20), rel=4 * EPSILON)
    late = kinetic_to[20] - 4 - 2 * 0.5 + 3 / 2  # after 4 s
    assert observables.mean_pressure(trace, 4.0) == pytest.approx(
        late / (256 * 16), rel=8 * EPSILON
    )
    windows = observables.pressures(trace, observables.windows(trace, 5))
    sums = [4 + 1 + 3, 2, 2, 1 + 0.25 + 1.5, 0.5]
    assert windows == pytest.approx([each / (256 * 4) for each in sums], rel=16 * EPSILON)
    ratio = whole / kinetic_to[20]
    assert observables.ideal_gas_ratio(trace) == pytest.approx(ratio, rel=8 * EPSILON)
    assert observables.virial_ratio(trace) == pytest.approx(ratio, rel=8 * EPSILON)


def test_box_pressure_by_hand() -> None:
    """After 2 s the balls fly 5.75 and 6.25 m to the walls at 0.5 m/s, and give 1.5 kg m/s."""
    trace = simulate(head_on("box"), time=20.0)
    assert observables.series(trace).wall_impulse.tolist() == [0, 0, 1.5, 3]
    _, values = observables.cumulative_pressure(trace, observables.series(trace))
    assert values == pytest.approx([0, 1.5 / (64 * 13.5), 3 / (64 * 14.5)], rel=4 * EPSILON)
    assert observables.mean_pressure(trace) == pytest.approx(3 / (64 * 20), rel=4 * EPSILON)
    assert observables.virial_ratio(trace) == pytest.approx(1 + 3 / 10.75, rel=8 * EPSILON)


@pytest.mark.parametrize("shape", ["circle", "box"])
def test_virial_and_wall_pressure_obey_the_virial_theorem(shape: str) -> None:
    """Σ m x·v changes by 2∫K + ΣJd of the balls, less each wall hit's J times its distance."""
    overrides = "container={shape: box, width: 30, height: 22}", "balls.radius=0.7", "cor=1"
    scene = report_scene() if shape == "circle" else gas(*overrides)
    trace = simulate(scene, collisions=3000)
    assert trace.events is not None
    end, finish = trace.stop.time, trace.finish
    change = sum(
        (1 if state is finish else -1)
        * float(np.sum(state.masses[:, None] * state.positions * state.velocities))
        for state in (trace.start, finish)
    )
    moving = trace.start.number * observables.mean_temperature(trace) * end
    virial = 2 * moving * observables.virial_ratio(trace)
    if shape == "circle":
        arm = scene.container.radius - float(scene.radii[0])
        walls = arm * observables.mean_pressure(trace) * scene.container.wall_length * end
    else:
        hits = np.flatnonzero(trace.events.j == CONTAINER)
        states = observables.engine.replay(trace, trace.events.time[hits])
        rooms = np.array(scene.container.size) / 2 - scene.radii[0]
        walls = 0.0
        for row, hit in enumerate(hits):
            place = np.abs(states.positions[row, trace.events.i[hit]])
            walls += trace.events.impulse[hit] * rooms[np.argmin(np.abs(rooms - place))]
    # Some thousand terms with their roundings.
    assert virial - walls == pytest.approx(change, abs=3000 * 8 * EPSILON * virial)


def test_summaries_have_the_pressure_of_events() -> None:
    scene = gas("cor=1")
    full, grid = (simulate(scene, collisions=2000, summary=each) for each in (False, True))
    # The energy does not change, and the virial at the end is the same sum.
    pressure = observables.mean_pressure(full)
    assert observables.mean_pressure(grid) == pytest.approx(pressure, rel=2000 * EPSILON)
    for trace in (full, grid):
        found = observables.after_collisions(trace)
        time, values = observables.cumulative_pressure(trace, found)
        # A summary's last collision is taken to be before the end, by 1/400 of it at most.
        assert time[-1] == pytest.approx(trace.stop.time, rel=1 / 400)
        assert values[-1] * time[-1] == pytest.approx(pressure * trace.stop.time, rel=1 / 400)


# Distances and temperature


def test_pair_distances_are_those_of_the_nearest_images(cooling: Trace) -> None:
    states, scene = observables.at_collisions(cooling, 3), cooling.start
    found = observables.pair_distances(states, scene).reshape(3, -1)
    steps = [
        np.array(each) * scene.container.size for each in itertools.product((-1, 0, 1), repeat=2)
    ]
    for positions, row in zip(states.positions, found, strict=True):
        pairs = list(itertools.combinations(positions, 2))
        nearest = [min(math.dist(a, b + step) for step in steps) for a, b in pairs]
        np.testing.assert_allclose(row, nearest, rtol=64 * EPSILON)
    assert found.max() <= math.hypot(*scene.container.size) / 2


def test_the_temperature_at_which_balls_meet_leaves_out_what_they_share() -> None:
    scene = gas()
    assert predictions.at_rest(scene)
    drift = np.array([3.0, -4.0])
    moving = replace(scene, velocities=scene.velocities + drift)
    assert not predictions.at_rest(moving)
    assert observables.drift_energy(moving) == pytest.approx(64 * 25 / 2, rel=1e-12)
    met = observables.meeting_temperature(scene.kinetic_energy, scene)
    assert met == pytest.approx(scene.kinetic_energy / 63, rel=1e-12)
    assert observables.meeting_temperature(moving.kinetic_energy, moving) == pytest.approx(met)
    box = replace(moving, container=Box(*moving.container.size))
    assert observables.meeting_temperature(box.kinetic_energy, box) == box.kinetic_energy / 64


# What is conserved


def test_floors_are_of_what_the_shape_conserves() -> None:
    scene = gas()
    assert predictions.floor(scene) == pytest.approx(0, abs=1e-12)
    moving = replace(scene, velocities=scene.velocities + np.array([3.0, -4.0]))
    share = 64 * 25 / 2 / moving.kinetic_energy
    assert predictions.floor(moving) == pytest.approx(share, rel=1e-12)
    assert math.isnan(predictions.floor(replace(moving, container=Box(*moving.container.size))))


def test_a_cooling_periodic_gas_keeps_its_momentum_s_energy() -> None:
    """Of the relative motion some thousandths are left, of the common one everything."""
    scene = gas("cor=0.8", "container.packing=0.05")
    scene = replace(scene, velocities=scene.velocities + np.array([5.0, 0.0]))
    last = observables.energy_ratio(observables.series(simulate(scene, collisions=1000)))[-1]
    floor = predictions.floor(scene)
    left = theory.energy_ratio_by_events(64, 0.8, 1000, 1.0, 0)
    assert floor < last < floor + 10 * left


def test_free_velocities() -> None:
    scene = gas()
    assert predictions.free_velocities(scene) == 63
    assert predictions.free_velocities(replace(scene, container=Box(*scene.container.size))) == 64
    moving = replace(scene, velocities=scene.velocities + 1.0)
    assert predictions.free_velocities(moving) is None
    masses = np.linspace(1.0, 2.0, 64)
    still = scene.velocities - masses @ scene.velocities / masses.sum()
    assert predictions.free_velocities(replace(scene, masses=masses, velocities=still)) is None


def test_speeds_without_total_momentum_have_the_law_of_one_ball_less() -> None:
    """Of few balls the laws differ a lot: kurtosis 4/3 for two of three, 3/2 for three."""
    scene = gas("balls.count=3", "container.packing=0.05", "cor=1")
    counts = sum(
        observables.reduced_speed_counts(simulate(gas_of, collisions=6000))
        for gas_of in (scene, replace(scene, velocities=scene.velocities[::-1].copy()))
    )
    samples = int(counts.sum())
    edges = np.arange(1, len(counts) + 1) * SPEED_BIN
    shares = np.cumsum(counts) / samples

    def distance(number: int) -> float:
        law = theory.fixed_energy_speed_cdf(edges, number, 0.5)
        return float(np.max(np.abs(shares - law)[:-1]))

    # Kolmogorov and Smirnov: 1.95/√n is exceeded once in a thousand times by independent samples;
    # three speeds at one time are not, and count as one.
    assert distance(2) < 1.95 / math.sqrt(samples / 3) < distance(3)


# Many balls


def test_long_traces_of_many_balls_are_measured_every_few_collisions(
    cooling: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = observables.series(cooling)
    pressures = observables.mean_pressure(cooling), observables.mean_pressure(cooling, 1.0)
    windows = observables.pressures(cooling, observables.windows(cooling, 4))
    monkeypatch.setattr(observables, "MOST_MEASURED", 101 * 64)
    again = replace(cooling)
    thin = observables.series(again)
    rows = np.arange(101) * 20
    for name, column in vars(thin).items():
        assert column.tolist() == getattr(full, name)[rows].tolist(), name
    assert observables.series(again) is thin
    # Between rows all is taken to be straight: a fraction of what 20 of 2000 collisions change.
    assert observables.mean_pressure(again) == pytest.approx(pressures[0], rel=2e-3)
    assert observables.mean_pressure(again, 1.0) == pytest.approx(pressures[1], rel=1e-2)
    edges = observables.windows(again, 4)
    assert observables.pressures(again, edges) == pytest.approx(windows, rel=2e-2)
    assert len(observables.after_collisions(again).time) == 101


def test_states_of_many_balls_fit_in_memory(
    cooling: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(observables, "MOST_BALLS", 10 * 64)
    assert len(observables.at_collisions(cooling).time) == 10
