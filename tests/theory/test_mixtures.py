"""Two species in a cooling gas: contact values, partial cooling rates and T₁/T₂."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from snooker_cli import theory, two_temperatures

Array = NDArray[np.float64]
MASSES, RADII = np.array([4.0, 1.0]), np.array([1.0, 0.5])
DILUTE = np.array([1e-9, 1e-9])
DENSE = np.array([0.06, 0.09])

SIMULATED = {0.9: 1.089, 0.8: 1.192}
"""T₁/T₂ by CoR as the docstring of ``species_ratio`` has it, each ± 0.002."""


def test_contact_values_of_equal_disks_are_hendersons() -> None:
    """(1 − 7η/16)/(1 − η)², for all pairs of a mixture of two equal species."""
    for packing in (1e-6, 0.1, 0.3, 0.5):
        halves = np.array([0.5, 0.5]) * packing / math.pi
        values = two_temperatures.mixture_contact_values(halves, np.ones(2))
        assert values == pytest.approx((1 - 7 * packing / 16) / (1 - packing) ** 2, rel=1e-12)
        near = 0.0005 if packing <= 0.3 else 0.0065
        assert values[0, 0] == pytest.approx(theory.contact_value(packing), rel=near)


def test_contact_values_of_a_small_disk_between_large_ones() -> None:
    """A point meets others as often as the free area has it: 1/(1 − η). Larger pairs more often."""
    values = two_temperatures.mixture_contact_values(np.array([0.1, 0.05]), np.array([1.0, 1e-9]))
    assert values[0, 1] == pytest.approx(1 / (1 - 0.1 * math.pi), rel=1e-7)
    assert values[1, 1] == pytest.approx(1 / (1 - 0.1 * math.pi), rel=1e-7)
    assert values[0, 0] > values[0, 1] == values[1, 0]


def test_rates_of_equal_balls_are_haffs() -> None:
    """(1 − e²) ω/2 with Enskog's rate of collisions, however the balls are named."""
    density, radius, mass, heat = 0.05, 0.7, 2.0, 3.0
    parts, both = np.array([0.3, 0.7]) * density, np.ones(2)
    contact = two_temperatures.mixture_contact_values(parts, radius * both)[0, 0]
    rate = theory.ball_ball_rate(density, radius, heat, contact, mass)
    rates = two_temperatures.partial_cooling_rates(
        heat * both, parts, mass * both, radius * both, 0.8
    )
    assert rates == pytest.approx((1 - 0.8**2) * rate / 2, rel=1e-12)


def test_rates_are_those_of_random_collisions() -> None:
    """Energy that collisions of random pairs with Maxwell's velocities take, within 5 errors."""
    random, temperatures, e = np.random.default_rng(46), np.array([1.5, 0.7]), 0.6
    contact = two_temperatures.mixture_contact_values(DENSE, RADII)
    expected = two_temperatures.partial_cooling_rates(temperatures, DENSE, MASSES, RADII, e)
    for i in range(2):
        total, variance = 0.0, 0.0
        for j in range(2):
            first, second = (
                random.normal(size=(4_000_000, 2)) * math.sqrt(temperatures[k] / MASSES[k])
                for k in (i, j)
            )
            normal = (first - second)[:, 0]  # any direction of the line of centres
            change = (1 + e) * normal * MASSES[j] / (MASSES[i] + MASSES[j])
            lost = MASSES[i] / 2 * (first[:, 0] ** 2 - (first[:, 0] - change) ** 2)
            flux = 2 * math.pi * np.where(normal > 0, normal, 0.0) * lost / temperatures[i]
            factor = DENSE[j] * (RADII[i] + RADII[j]) * contact[i, j]
            total += factor * flux.mean()
            variance += factor**2 * flux.var() / len(flux)
        assert abs(total - expected[i]) < 5 * math.sqrt(variance)
        assert 5 * math.sqrt(variance) < 0.03 * expected[i]


@pytest.mark.parametrize("densities", [DILUTE, DENSE])
def test_known_limits(densities: Array) -> None:
    """Elastic balls, and balls that differ in their names alone, have one temperature."""
    assert two_temperatures.species_ratio(densities, MASSES, RADII, 1.0) == 1.0
    equal = two_temperatures.species_ratio(densities, np.ones(2), np.ones(2), 0.5)
    assert equal == pytest.approx(1.0, rel=1e-12)
    nearly = two_temperatures.species_ratio(densities, MASSES, RADII, 0.9999)
    assert nearly == pytest.approx(1.0, abs=2e-4)
    assert nearly != 1.0


def test_the_names_of_the_species_change_nothing() -> None:
    ratio = two_temperatures.species_ratio(DENSE, MASSES, RADII, 0.7)
    turned = two_temperatures.species_ratio(DENSE[::-1], MASSES[::-1], RADII[::-1], 0.7)
    assert ratio == pytest.approx(1 / turned, rel=1e-12)
    temperatures = np.array([ratio, 1.0])
    first, second = two_temperatures.partial_cooling_rates(temperatures, DENSE, MASSES, RADII, 0.7)
    assert first == pytest.approx(second, rel=1e-12)
    assert first > 0


@pytest.mark.parametrize(("mass", "e"), [(0.1, 0.5), (1.0, 0.8), (20.0, 0.9)])
def test_a_single_ball_in_a_warm_gas_has_the_temperature_of_martin_and_piasecki(
    mass: float, e: float
) -> None:
    """T₁/T₂ = (1 + e)/(2 + (1 − e) m₂/m₁) in an elastic gas (Europhys. Lett. 46, 613 (1999))."""
    known = (1 + e) / (2 + (1 - e) / mass)
    of_ball, _ = two_temperatures.partial_cooling_rates(
        np.array([known, 1.0]), np.array([0.0, 0.1]), np.array([mass, 1.0]), RADII, e
    )
    hotter, _ = two_temperatures.partial_cooling_rates(
        np.array([1.1 * known, 1.0]), np.array([0.0, 0.1]), np.array([mass, 1.0]), RADII, e
    )
    assert abs(of_ball) < 1e-12 * hotter


def test_temperatures_at_rest_are_those_of_velocities_without_their_mean() -> None:
    random, numbers = np.random.default_rng(46), np.array([3.0, 2.0])
    scale = np.sqrt(np.repeat([2.0, 1.0], [3, 2]) / np.repeat(MASSES, [3, 2]))
    own = np.repeat(MASSES, [3, 2])
    velocities = random.normal(size=(400_000, 5, 2)) * scale[:, np.newaxis]
    velocities -= (own @ velocities / own.sum())[:, np.newaxis]
    energies = own / 2 * np.sum(velocities**2, axis=2)
    expected = two_temperatures.temperatures_at_rest(np.array([2.0, 1.0]), numbers, MASSES)
    for balls, value in zip((slice(0, 3), slice(3, 5)), expected, strict=True):
        means = energies[:, balls].mean(axis=1)
        assert abs(means.mean() - value) < 5 * means.std() / math.sqrt(len(means))
    equilibrium = two_temperatures.temperatures_at_rest(np.ones(2), numbers, MASSES)
    assert equilibrium == pytest.approx(1 - MASSES / (numbers @ MASSES), rel=1e-12)


def boltzmann(e: float, steps: int = 1500, number: int = 20_000) -> tuple[float, float]:
    """T₁/T₂ and its standard error by direct simulation of Boltzmann's equation, χ = 1.

    Half of the balls of a species of ``number`` balls meet in each step; the probability of a
    collision goes as the speed along a random line of centres. Momentum and energy are restored.
    """
    random = np.random.default_rng(46)
    masses, radii = np.repeat(MASSES, number), np.repeat(RADII, number)
    velocities = random.normal(size=(2 * number, 2)) / np.sqrt(masses)[:, np.newaxis]
    found, most = [], 14.0
    for step in range(steps):
        one, two = random.permutation(2 * number).reshape(2, number)
        angle = random.uniform(0, 2 * math.pi, number)
        line = np.column_stack([np.cos(angle), np.sin(angle)])
        normal = np.sum((velocities[one] - velocities[two]) * line, axis=1)
        meets = random.random(number) * most < normal * (radii[one] + radii[two])
        one, two, line, normal = one[meets], two[meets], line[meets], normal[meets]
        impulse = (1 + e) * normal / (1 / masses[one] + 1 / masses[two])
        velocities[one] -= (impulse / masses[one])[:, np.newaxis] * line
        velocities[two] += (impulse / masses[two])[:, np.newaxis] * line
        velocities -= masses @ velocities / masses.sum()
        energies = masses / 2 * np.sum(velocities**2, axis=1)
        velocities /= math.sqrt(energies.mean())
        if step >= steps // 3:
            found.append(energies[:number].mean() / energies[number:].mean())
    parts = np.array(found)[: len(found) // 10 * 10].reshape(10, -1).mean(axis=1)
    return float(parts.mean()), float(parts.std(ddof=1) / math.sqrt(10))


@pytest.mark.parametrize("e", SIMULATED)
def test_direct_simulation_is_as_near_as_the_docstring_says(e: float) -> None:
    value, error = boltzmann(e)
    assert error < 0.005
    assert abs(value - SIMULATED[e]) < 4 * math.hypot(error, 0.002)
    predicted = two_temperatures.species_ratio(DILUTE, MASSES, RADII, e)
    assert round(predicted, 3) == {0.9: 1.1, 0.8: 1.212}[e]
    assert value + 4 * error > predicted - 0.025
