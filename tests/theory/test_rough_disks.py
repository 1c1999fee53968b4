"""Rough disks: how their collisions change both temperatures, and friction."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snooker_cli import two_temperatures
from snooker_cli.validation.spinning_gases import DIRECT_ROUGH, cooled_after


@pytest.mark.parametrize(("cor", "beta", "q"), [(0.9, 0.4, 0.5), (0.6, -0.5, 1.0), (1, 1, 0.5)])
def test_rates_are_those_of_random_collisions(cor: float, beta: float, q: float) -> None:
    """Pairs with Maxwell's velocities and spins, weighted by their speed of approach."""
    rng, number, warm = np.random.default_rng(5), 1_000_000, np.array([1.0, 0.3])
    u = rng.normal(0, math.sqrt(warm[0]), (2, number, 2))  # along the line of centres, and across
    w = rng.normal(0, math.sqrt(warm[1] / q), (2, number))  # times the radius, for m = 1
    weight = np.maximum(u[0, :, 0] - u[1, :, 0], 0.0)
    along = (1 + cor) / 2 * (u[0] - u[1])[:, 0]
    across = q / (1 + q) * (1 + beta) / 2 * ((u[0] - u[1])[:, 1] + w[0] + w[1])
    kicks = np.stack([along, across], axis=1)
    after, spins = (u[0] - kicks, u[1] + kicks), (w[0] - across / q, w[1] - across / q)
    moving = sum(0.5 * np.sum(a**2 - b**2, axis=1) for a, b in zip(after, u, strict=True)) / 2
    turning = sum(q * (a**2 - b**2) for a, b in zip(spins, w, strict=True)) / 2
    changes = np.stack([moving, turning])
    # Each of the two balls has one collision.
    rates = changes @ weight / weight.sum()
    errors = np.sqrt((changes - rates[:, None]) ** 2 @ weight**2) / weight.sum()
    expected = two_temperatures.rough_cooling(cor, beta, q) @ warm
    assert np.all(np.abs(rates - expected) < 4 * errors)
    assert np.all(errors < 0.002)


def test_energy_is_kept_where_no_contact_takes_any() -> None:
    """T_tr + T_rot/2 is the energy of a ball."""
    for beta in (-1.0, 1.0):
        changes = two_temperatures.rough_cooling(1.0, beta, 0.5)
        assert np.array([1.0, 0.5]) @ changes == pytest.approx([0.0, 0.0], abs=1e-15)
    assert two_temperatures.rough_ratio(1.0, 1.0, 0.5) == pytest.approx(1.0)


def test_temperatures_follow_the_rates() -> None:
    start, step = np.array([1.0, 0.2]), 1e-6
    values = 0.8, 0.3, 0.5
    times = np.array([0.0, 2.0, 2.0 + step, 400.0])
    both = two_temperatures.rough_temperatures(times, start, *values)
    assert both[:, 0] == pytest.approx(start)
    slope = (both[:, 2] - both[:, 1]) / step
    assert slope == pytest.approx(two_temperatures.rough_cooling(*values) @ both[:, 1], rel=1e-5)
    assert both[1, 3] / both[0, 3] == pytest.approx(two_temperatures.rough_ratio(*values))


def test_where_the_theory_fails_is_as_docs_accuracy_has_it() -> None:
    """Percent above direct simulation, and the largest deviation of both temperatures."""
    sides, worst = [], 0.0
    for beta, direct in DIRECT_ROUGH.items():
        ratio = two_temperatures.rough_ratio(0.9, beta, 0.5)
        sides.append(round(100 * (ratio / direct["ratio"][0] - 1), 1))
        after = np.array([cooled_after(0.9, beta)])
        both = two_temperatures.rough_temperatures(after, np.array([1.0, 0.0]), 0.9, beta, 0.5)
        found = [direct[name][0] for name in ("T_tr", "T_rot")]
        worst = max(worst, float(np.max(np.abs(found / both[:, 0] - 1))))
    assert sides == [4.4, 5.7, 5.8, 2.5, -0.1]
    assert round(100 * worst, 1) == 4.1


def test_friction_leaves_less_of_an_oblique_slip() -> None:
    slopes = np.array([0.0, 0.1, 10.0])
    found = two_temperatures.sliding_tangential_cor(slopes, 0.9, 0.4, 0.2, 0.5)
    assert found.tolist() == pytest.approx([-1.0, -1 + 0.2 * 1.9 * 3 * 0.1, 0.4])
