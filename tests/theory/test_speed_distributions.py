"""Distributions of speed against their integrals and limits."""

import math

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


@pytest.mark.parametrize("number", [2, 3, 37, 1000])
def test_fixed_energy_moments(number):
    mass = 1.7
    top = math.sqrt(2 * number * T / mass)

    def moment(power: int) -> float:
        # Weighted on the scale of the thermal speed, so that a sharp peak is not missed.
        points = [x * math.sqrt(T / mass) for x in (1, 2, 4) if x**2 * T / mass < top**2]
        return integrate.quad(
            lambda v: v**power * theory.fixed_energy_speed_density(v, number, T, mass),
            0,
            top,
            points=points,
            epsabs=0,
            epsrel=1e-12,
        )[0]

    assert moment(0) == pytest.approx(1, rel=1e-10)
    assert moment(1) == pytest.approx(theory.fixed_energy_mean_speed(number, T, mass), rel=1e-10)
    assert moment(2) == pytest.approx(2 * T / mass, rel=1e-10)
    assert moment(4) / moment(2) ** 2 == pytest.approx(
        theory.fixed_energy_kurtosis(number), rel=1e-9
    )


def test_maxwell_moments():
    mass, top = 2.0, 100.0  # 20 thermal speeds: exp(−200) is left out

    def moment(power: int) -> float:
        return integrate.quad(
            lambda v: v**power * theory.maxwell_speed_density(v, T, mass), 0, top, points=[5, 20]
        )[0]

    assert moment(0) == pytest.approx(1, rel=1e-12)
    assert moment(1) == pytest.approx(theory.maxwell_mean_speed(T, mass), rel=1e-12)
    assert moment(2) == pytest.approx(2 * T / mass, rel=1e-12)
    assert moment(4) / moment(2) ** 2 == pytest.approx(2, rel=1e-12)


@pytest.mark.parametrize("number", [2, 3, 37])
def test_densities_are_slopes_of_their_cdf(number):
    v, step = np.linspace(0.1, 13.5, 40), 1e-5
    density = theory.fixed_energy_speed_density(v, number, T)
    up, down = (theory.fixed_energy_speed_cdf(v + s, number, T) for s in (step, -step))
    np.testing.assert_allclose((up - down) / (2 * step), density, rtol=1e-7, atol=1e-10)
    up, down = (theory.maxwell_speed_cdf(v + s, T) for s in (step, -step))
    np.testing.assert_allclose(
        (up - down) / (2 * step), theory.maxwell_speed_density(v, T), rtol=1e-7, atol=1e-10
    )


@pytest.mark.parametrize("a2", [-0.03, 0.0, 0.0729])
def test_speeds_of_a_cooling_gas(a2):
    mass = 1.7

    def density(v: float) -> float:
        x = mass * v * v / (2 * T)
        return theory.maxwell_speed_density(v, T, mass) * (1 + a2 * (x * x / 2 - 2 * x + 1))

    for v in (0.5, 5.0, 12.0):
        below = integrate.quad(density, 0, v, epsabs=0, epsrel=1e-12)[0]
        assert theory.sonine_speed_cdf(v, T, a2, mass) == pytest.approx(below, rel=1e-11)
    # 20 thermal speeds: exp(−200) is left out. The kurtosis defines a2.

    def moment(power: int) -> float:
        return integrate.quad(lambda v: v**power * density(v), 0, 120, points=[5, 20])[0]

    assert moment(4) / moment(2) ** 2 == pytest.approx(2 * (1 + a2), rel=1e-9)
    assert theory.sonine_speed_cdf(1e3, T, a2, mass) == pytest.approx(1, rel=1e-14)


def test_no_ball_has_more_than_all_of_the_energy():
    top = math.sqrt(2 * N * T)
    speeds = np.array([0.0, top * (1 + 1e-12), 2 * top])
    assert theory.fixed_energy_speed_density(speeds, N, T).tolist() == [0, 0, 0]
    assert theory.fixed_energy_speed_cdf(speeds, N, T).tolist() == [0, 1, 1]
    assert theory.fixed_energy_speed_density(1.5 * top, N, T) == 0


def test_fixed_energy_tends_to_maxwell():
    v = np.linspace(0, 40, 50)
    many = 10**6
    # (1 − x/N)^(N−2) differs from e^(−x) by (2x + x²/2)/N at most, times a density below 0.1.
    x = v**2 / (2 * T)
    bound = 0.1 * (2 * x + x**2 + 1) / many
    difference = theory.fixed_energy_speed_density(v, many, T) - theory.maxwell_speed_density(v, T)
    assert np.all(np.abs(difference) <= bound)
    assert theory.fixed_energy_kurtosis(many) == pytest.approx(2, rel=2 / many)
    assert theory.fixed_energy_kurtosis(1) == 1


def test_one_ball_has_no_speed_distribution():
    with pytest.raises(ValueError, match="at least 2"):
        theory.fixed_energy_speed_density(1.0, 1, T)
    with pytest.raises(ValueError, match="at least 2"):
        theory.fixed_energy_speed_cdf(1.0, 1, T)
