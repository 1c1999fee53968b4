"""Velocity correlations of pairs: slow loops, exact references, and an exact flow."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import gas
from scipy.special import jv

from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.analysis.quantities import NEIGHBOURS
from snooker_cli.analysis.structure import over_time
from snooker_cli.analysis.theories import FIXED_MOMENTUM, INDEPENDENT, values_of
from snooker_cli.analysis.velocity_correlations import (
    LONGITUDINAL,
    MOST_PAIRS,
    PAIRS,
    TRANSVERSE,
    correlations,
    distance_edges,
    pair_sums,
)
from snooker_cli.containers import Box, PeriodicBox
from snooker_cli.engine.simulation import simulate_batch
from snooker_cli.scene import Scene


def placed(scene: Scene, seed: int, number: int = 0) -> Scene:
    """A scene with points at random places of its container, and random velocities."""
    rng = np.random.default_rng(seed)
    number = number or scene.number
    width, height = scene.container.size
    places = rng.uniform(-0.5, 0.5, (number, 2)) * (width, height)
    if scene.container.across == "radius":
        places *= 0.6
    radii = np.full(number, 0.01)
    velocities = rng.normal(size=(number, 2))
    return replace(
        scene, positions=places, velocities=velocities, radii=radii, masses=np.ones(number)
    )


@pytest.mark.parametrize("shape", ["periodic", "circle", "box"])
def test_sums_are_those_of_slow_loops(shape: str) -> None:
    scene = placed(gas(shape, 30, 0.1, aspect=1.0), 5)
    edges = np.linspace(0.02, min(scene.container.size) / 2 * 0.999, 6)
    found = pair_sums(scene.positions, scene.velocities, scene, edges)
    velocities = scene.velocities
    if shape == "periodic":
        velocities = velocities - velocities.mean(axis=0)
    velocities = velocities / math.sqrt(np.mean(velocities**2))
    expected = np.zeros((5, 5))
    for i in range(30):
        torque, inertia = np.zeros(5), np.zeros(5)
        for j in range(30):
            way = scene.positions[j] - scene.positions[i]
            if shape == "periodic":
                size = np.array(scene.container.size)
                way -= size * np.round(way / size)
            distance = math.hypot(*way)
            if i == j or distance > edges[-1]:
                continue
            along = way / distance
            across = np.array([-along[1], along[0]])
            place = int(np.argmax(distance < edges)) - 1
            both = velocities[[i, j]]
            expected[0, place] += np.prod(both @ along)
            expected[1, place] += np.prod(both @ across)
            expected[2, place] += 1
            torque[place:] += distance * (velocities[j] @ across)
            inertia[place:] += distance**2
        known = inertia > 0
        expected[3, known] += torque[known] ** 2 / inertia[known]
        expected[4] += known
    assert found == pytest.approx(expected)


def test_a_transverse_wave_has_its_bessel_functions() -> None:
    """u = (sin ky, 0): 2 J₁(kr)/(kr) along the line of centres, 2 (J₀ − J₁/(kr)) across it."""
    scene = placed(replace(gas("periodic", 30, 0.1), container=PeriodicBox(50.0, 50.0)), 1, 4000)
    wave = 2 * math.pi / 50
    flow = np.column_stack([np.sin(wave * scene.positions[:, 1]), np.zeros(4000)])
    edges = np.linspace(1.0, 24.9, 25)
    sums = pair_sums(scene.positions, flow, scene, edges)
    along, across, turning = correlations(sums)
    x = wave * (edges[1:] + edges[:-1]) / 2
    # 2 sin² of 100 centres: 4 errors of a mean whose values have a deviation of 1/√2.
    assert along == pytest.approx(2 * jv(1, x) / x, abs=0.28)
    assert across == pytest.approx(2 * (jv(0, x) - jv(1, x) / x), abs=0.28)
    assert across[-1] < -0.5 < 0.9 < across[0]
    assert np.sum(sums[PAIRS]) == pytest.approx(MOST_PAIRS * math.pi / 4, rel=0.02)
    assert turning.max() > 100


def test_independent_velocities_have_a_vorticity_of_one() -> None:
    scene, rng = placed(gas("box", 150, 0.1), 3), np.random.default_rng(4)
    edges = np.linspace(0.5, min(scene.container.size) / 2, 6)
    rows = np.array(
        [
            correlations(pair_sums(scene.positions, rng.normal(size=(150, 2)), scene, edges))
            for _ in range(400)
        ]
    )
    for values in rows[:, 2].T:
        mean, error = mean_and_error(values)
        assert abs(mean - 1) < 4 * error < 0.2
    for values in np.moveaxis(rows[:, :2], 0, 2).reshape(-1, 400):
        mean, error = mean_and_error(values)
        assert abs(mean) < 4 * error


@pytest.mark.parametrize(
    ("shape", "model", "expected"),
    [("periodic", FIXED_MOMENTUM, -1 / 7), ("box", INDEPENDENT, 0.0)],
)
def test_elastic_balls_have_the_reference(shape: str, model: str, expected: float) -> None:
    """Eight balls: those of a periodic box keep their momentum, walls take it."""
    scenes = [gas(shape, 8, 0.1, seed=seed) for seed in range(40)]
    assert values_of(scenes[0], NEIGHBOURS, FIXED_MOMENTUM, INDEPENDENT) == {
        model: pytest.approx(expected)
    }
    edges = distance_edges(scenes[0])
    both = []
    for trace in simulate_batch(scenes, collisions=4000):
        times = np.linspace(0.3, 1.0, 60) * trace.stop.time
        sums = over_time(lambda *state: pair_sums(*state, edges), trace, times).sum(axis=0)
        both.append(sums[[LONGITUDINAL, TRANSVERSE]].sum(axis=1) / sums[PAIRS].sum())
    for values in np.array(both).T:
        mean, error = mean_and_error(values)
        assert abs(mean - expected) < 4 * error
        assert 4 * error < 1 / 14  # so that the other reference is refused


def test_a_drift_is_no_correlation() -> None:
    """Without walls velocities are seen from the centre of mass; between walls they are not."""
    scene = placed(gas("periodic", 50, 0.1), 2)
    edges = np.linspace(0.02, 10.0, 5)
    drifting = scene.velocities + np.array([30.0, -5.0])
    still = pair_sums(scene.positions, scene.velocities, scene, edges)
    assert pair_sums(scene.positions, drifting, scene, edges) == pytest.approx(still)
    walled = replace(scene, container=Box(*scene.container.size))
    along = correlations(pair_sums(scene.positions, drifting, walled, edges))[0]
    assert along.min() > 0.8


def test_bins_reach_from_contact_to_half_of_the_container() -> None:
    scene = gas("periodic", 200, 0.1)
    edges = distance_edges(scene)
    assert edges[0] == 2.0
    assert edges[-1] == pytest.approx(scene.container.size[0] / 2)
    assert len(distance_edges(gas("periodic", 4, 0.3))) >= 2
    # In a large container the first are narrow, and widths grow.
    widths = np.diff(distance_edges(gas("periodic", 5000, 0.1)))
    assert np.all(np.diff(widths) > 0)
    assert widths[0] == pytest.approx(widths.mean() / 5, rel=0.15)
    sums = np.zeros((5, 3))
    assert np.isnan(correlations(sums)).all()
