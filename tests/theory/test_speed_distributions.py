"""Distributions of speed against their integrals and limits."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy import integrate
from source_scene import N, T, digits

from snooker_cli import theory


def test_mean_speeds():
    assert digits(theory.fixed_energy_mean_speed(N, T), "8.892")
    assert theory.maxwell_mean_speed(T) == pytest.approx(math.sqrt(25 * math.pi), rel=1e-15)
    # One ball has exactly one speed.
    assert theory.fixed_energy_mean_speed(1, T, 2.0) == pytest.approx(math.sqrt(T), rel=1e-14)
    # c_N = 1 + 1/(8N) + 1/(128N²) + …; lgamma of 10⁵ has 10⁶ as its size, so ε·10⁶ ≈ 1e-10.
    assert theory.fixed_energy_factor(100_000) == pytest.approx(1 + 1 / 800_000, abs=1e-9)


def moments(density: Callable[[float], float], top: float, mass: float) -> list[float]:
    """Of order 0, 1, 2 and 4; split at some thermal speeds, so that no peak is missed."""
    points = [x * math.sqrt(T / mass) for x in (1, 2, 4) if x * math.sqrt(T / mass) < top]
    options = {"points": points, "epsabs": 0, "epsrel": 1e-12}
    return [
        integrate.quad(lambda v, k: v**k * density(v), 0, top, args=(power,), **options)[0]
        for power in (0, 1, 2, 4)
    ]


@pytest.mark.parametrize("number", [2, 3, 37, 1000])
def test_fixed_energy_moments(number):
    mass = 1.7
    top = math.sqrt(2 * number * T / mass)
    norm, mean, square, fourth = moments(
        lambda v: theory.fixed_energy_speed_density(v, number, T, mass), top, mass
    )
    assert norm == pytest.approx(1, rel=1e-10)
    assert mean == pytest.approx(theory.fixed_energy_mean_speed(number, T, mass), rel=1e-10)
    assert square == pytest.approx(2 * T / mass, rel=1e-10)
    assert fourth / square**2 == pytest.approx(theory.fixed_energy_kurtosis(number), rel=1e-9)


@pytest.mark.parametrize("a2", [-0.03, 0.0, 0.0729])
def test_moments_of_maxwell_and_of_a_cooling_gas(a2):
    """The kurtosis defines a2. Beyond 20 thermal speeds, exp(−200) is left out."""
    mass = 1.7

    def density(v: float) -> float:
        x = mass * v * v / (2 * T)
        return theory.maxwell_speed_density(v, T, mass) * (1 + a2 * (x * x / 2 - 2 * x + 1))

    norm, mean, square, fourth = moments(density, 20 * math.sqrt(T / mass), mass)
    assert norm == pytest.approx(1, rel=1e-12)
    if a2 == 0:
        assert mean == pytest.approx(theory.maxwell_mean_speed(T, mass), rel=1e-12)
    assert square == pytest.approx(2 * T / mass, rel=1e-12)
    assert fourth / square**2 == pytest.approx(2 * (1 + a2), rel=1e-9)
    for v in (0.5, 5.0, 12.0):
        below = integrate.quad(density, 0, v, epsabs=0, epsrel=1e-12)[0]
        assert theory.sonine_speed_cdf(v, T, a2, mass) == pytest.approx(below, rel=1e-11)


@pytest.mark.parametrize("number", [2, 3, 37])
def test_densities_are_slopes_of_their_cdf(number):
    v, step = np.linspace(0.1, 13.5, 40), 1e-5
    for density, below in (
        (
            theory.fixed_energy_speed_density(v, number, T),
            [theory.fixed_energy_speed_cdf(v + s, number, T) for s in (step, -step)],
        ),
        (
            theory.maxwell_speed_density(v, T),
            [theory.maxwell_speed_cdf(v + s, T) for s in (step, -step)],
        ),
    ):
        slope = (below[0] - below[1]) / (2 * step)
        np.testing.assert_allclose(slope, density, rtol=1e-7, atol=1e-10)


def test_no_ball_has_more_than_all_of_the_energy():
    top = math.sqrt(2 * N * T)
    speeds = np.array([0.0, top * (1 + 1e-12), 2 * top])
    assert theory.fixed_energy_speed_density(speeds, N, T).tolist() == [0, 0, 0]
    assert theory.fixed_energy_speed_cdf(speeds, N, T).tolist() == [0, 1, 1]
    assert theory.fixed_energy_speed_density(1.5 * top, N, T) == 0
