"""Observables of scenes and states against naive sums; speeds; the end of a collapse."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import gas, report_scene

from snooker_cli.analysis import observables
from snooker_cli.analysis.measurement import measure
from snooker_cli.analysis.time_series import series
from snooker_cli.engine import replay, simulate
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import (
    SPEED_BIN,
    SPEED_BINS,
    StopReason,
    Trace,
)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Nineteen balls in a container that they move."""
    return gas("circle", 19, 0.19, cor=0.95, container_mass=50.0)


@pytest.fixture(scope="module")
def simulated(scene: Scene) -> Trace:
    return simulate(scene, collisions=400)


@pytest.fixture(scope="module")
def summarised(scene: Scene) -> Trace:
    return simulate(scene, collisions=400, summary=True)


def test_series_is_what_the_states_say(simulated: Trace) -> None:
    """Means of N numbers differ by their order of summing: at most N epsilon of the value."""
    found, start = series(simulated), simulated.start
    states = replay(simulated, found.time)
    speeds = np.hypot(states.velocities[..., 0], states.velocities[..., 1])
    energies = 0.5 * start.masses * speeds**2
    drift = np.sum(states.container_velocity**2, axis=1)
    for value, expected in (
        (found.kinetic_energy, energies.sum(axis=1)),
        (found.container_energy, 0.5 * start.container_mass * drift),
        (found.mean_speed, speeds.mean(axis=1)),
        (found.energy_moment, (energies**2).mean(axis=1) / energies.mean(axis=1) ** 2),
    ):
        np.testing.assert_allclose(value, expected, rtol=4 * start.number * EPSILON, atol=0)
    # Each collision rounds the two momenta that it changes, by some epsilon of the largest.
    total = observables.momentum(states.velocities, states.container_velocity, start)
    assert total[0] == pytest.approx(observables.total_momentum(start), abs=1e-12)
    assert np.max(np.abs(total - total[0])) <= 8 * EPSILON * speeds.sum(axis=1).max() * 400
    assert np.max(np.abs(states.container_velocity)) * 50 > 1, "the container takes part"


@pytest.mark.parametrize("shape", ["circle", "periodic"])
def test_distances_are_those_of_the_states(shape: str) -> None:
    """In a periodic box they are those of the nearest images."""
    trace = simulate(gas(shape, 20, 0.2), collisions=200)
    container, states = trace.start.container, observables.at_collisions(trace, 5)
    images = itertools.product((-1, 0, 1) if shape == "periodic" else (0,), repeat=2)
    steps = [np.array(image) * container.size for image in images]
    expected = [
        min(math.dist(a, b + step) for step in steps)
        for positions in states.positions
        for a, b in itertools.combinations(positions, 2)
    ]
    found = observables.pair_distances(states, trace.start)
    np.testing.assert_allclose(found, expected, rtol=64 * EPSILON)
    assert found.min() >= 2 * (1 - 64 * EPSILON * 10)  # nothing overlaps
    expected = [math.hypot(x, y) for x, y in states.positions.reshape(-1, 2)]
    np.testing.assert_allclose(observables.central_distances(states), expected, rtol=4 * EPSILON)


@pytest.mark.parametrize("most", [7, 402])
def test_states_are_thinned_evenly(
    most: int, simulated: Trace, summarised: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    states = observables.at_collisions(simulated, most)
    rows = np.searchsorted(series(simulated).time, states.time)
    assert (len(rows), rows[0], rows[-1]) == (min(most, 401), 0, 400)
    assert np.ptp(np.diff(rows)) <= 1
    monkeypatch.setattr(observables, "MOST_BALLS", 2 * 19)  # the states in memory
    assert len(observables.at_collisions(simulated, most).time) == 2
    with pytest.raises(ValueError, match="recorded as a summary"):
        observables.at_collisions(summarised)


@pytest.mark.parametrize("since", [0.0, 0.5])
def test_speeds_are_counted_every_few_collisions(
    since: float, simulated: Trace, summarised: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At fixed times; a summary has a row before each."""
    monkeypatch.setattr(observables, "COLLISIONS_BETWEEN", 2.0)
    found, since = series(simulated), since * simulated.stop.time
    a_ball = 2 / 19 * (simulated.pair_events - found.pair_events[found.time <= since][-1])
    times = observables.sampling_times(simulated, since)
    assert len(times) == int(a_ball / 2) > 2
    step = 2 / a_ball * (simulated.stop.time - since)
    np.testing.assert_allclose(times, since + step * np.arange(1, len(times) + 1), rtol=1e-12)
    grid = series(summarised).time
    samples = observables.sampling_times(summarised, since)
    for trace, at in ((simulated, times), (summarised, grid[np.searchsorted(grid, samples) - 1])):
        speeds = np.hypot(*np.moveaxis(replay(simulated, at).velocities, -1, 0))
        reduced = speeds / np.sqrt(np.mean(speeds**2, axis=1, keepdims=True))
        bins = np.histogram(np.minimum(reduced, 3.99), SPEED_BINS, (0, SPEED_BINS * SPEED_BIN))[0]
        assert observables.reduced_speed_counts(trace, since).tolist() == bins.tolist()


def test_where_no_speeds_are_counted(simulated: Trace) -> None:
    alone = replace(simulated, events=simulated.events[simulated.events.at_wall], pair_events=0)
    still = replace(simulated, stop=simulated.stop._replace(time=0.0))
    for trace in (alone, still):
        assert observables.sampling_times(trace).tolist() == []
        assert observables.reduced_speed_counts(trace).sum() == 0


@pytest.mark.parametrize("summary", [False, True])
def test_a_collapse_is_one_instant(summary: bool) -> None:
    """At a CoR of 0.05 the clock comes to stand still, and thousands of collisions go on."""
    scene = report_scene(cor=0.05, wall_cor=1.0, container_mass=1e7)
    trace = simulate(scene, collisions=5000, summary=summary)
    assert trace.stop.reason is StopReason.COLLAPSE
    curve = measure([trace]).curve
    assert curve.weight.sum() < trace.collisions / 4
    assert curve.events[0, -1] == trace.collisions
    calm = observables.before_collapse(trace)
    assert 0 < calm.collisions < trace.collisions / 4
    counted = series(calm)
    assert counted.wall_events[-1] + counted.pair_events[-1] == calm.collisions
    assert counted.time[-1] < trace.stop.time
    other = replace(trace, stop=trace.stop._replace(reason=StopReason.COLLISIONS))
    assert observables.before_collapse(other) is other
