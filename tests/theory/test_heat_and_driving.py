"""Heat, driven walls and restitution that depends on speed: limits, and integrals done again."""

import math

import numpy as np
import pytest
from numpy.polynomial.hermite import hermgauss
from numpy.polynomial.legendre import leggauss
from scipy.special import eval_genlaguerre, roots_genlaguerre

from snooker_cli import theory
from snooker_cli.containers import Channel, Circle


def conductivity_brackets(order: int) -> np.ndarray:
    """[p, q] of the collision integral between Sonine polynomials L_p(c²) c, c = v √(m/2T).

    The mean over collisions of two balls of ¼ times the changes of their sums, over the relative
    speed times d. Quadratures are exact: C of the centre, r of the relative velocity, angle s.
    """
    at, weights = hermgauss(2 * order + 4)
    squares, square_weights = roots_genlaguerre(2 * order + 6, 0.5)
    sines, sine_weights = leggauss(4 * order + 8)
    across, up, square, sine = np.meshgrid(at, at, squares, sines, indexing="ij")
    weight = weights[:, None, None, None] * weights[:, None, None] / math.pi
    weight = weight * square_weights[:, None] * sine_weights
    before = np.array([np.sqrt(square), np.zeros_like(square)])
    normal = np.array([np.sqrt(1 - sine**2), sine])
    after = before - 2 * np.sum(before * normal, axis=0) * normal

    def change(p: int) -> np.ndarray:
        total = 0.0
        for relative, sign in ((before, 1), (-before, 1), (after, -1), (-after, -1)):
            velocity = (np.array([across, up]) + relative) / math.sqrt(2)
            total += sign * eval_genlaguerre(p, 1, np.sum(velocity**2, axis=0)) * velocity
        return total

    changes = [change(p) for p in range(1, order + 1)]
    return np.array([[np.sum(weight * a * b) / 2 for b in changes] for a in changes])


def test_dilute_conductivity_is_that_of_chapman_and_enskog():
    """First Sonine approximation: λ = 4w/(√2 d B), w = √(2T/m); then three polynomials more."""
    brackets = conductivity_brackets(4)
    first = 4 * math.sqrt(2 * 50.0) / (math.sqrt(2) * 2.0 * brackets[0, 0])
    assert first == pytest.approx(math.sqrt(50.0 / math.pi), rel=1e-12)
    higher = brackets[0, 0] * np.linalg.inv(brackets)[0, 0]
    assert higher == pytest.approx(theory.SONINE_CONDUCTIVITY, abs=5e-5)
    dilute = theory.thermal_conductivity(1e-9, 1.0, 50.0)
    assert dilute == pytest.approx(first * higher, rel=1e-4)


def test_dense_conductivity_is_that_of_gass():
    """Gass 1971: λ/λ0 = bρ (1/y + 3/2 + 0.8718 y) with y = bρχ = Z − 1."""
    for packing in (0.1, 0.3, 0.5):
        y = float(theory.compressibility(packing)) - 1
        bracket = 2 * packing * (1 / y + 1.5 + 0.8718 * y)
        dilute = theory.thermal_conductivity(1e-12, 1.0, 50.0)
        value = theory.thermal_conductivity(packing, 1.0, 50.0)
        assert value == pytest.approx(dilute * bracket, rel=1e-4)


def test_the_jump_at_a_wall_is_some_mean_free_paths_of_a_dilute_gas():
    path = theory.mean_free_path(1e-6 / math.pi, 1.0)
    jump = theory.temperature_jump(1e-6, 1.0, 50.0)
    assert jump == pytest.approx(8 / 3 * theory.SONINE_CONDUCTIVITY * path, rel=1e-5)


@pytest.mark.parametrize(("v0", "loss"), [(1e-6, 1 - 0.8**2), (1e9, 0.0)])
def test_e_of_v_has_the_limits_of_one_cor(v0, loss):
    assert theory.viscoelastic_loss(0.8, v0, 50.0) == pytest.approx(loss, abs=1e-5)


def test_the_loss_with_e_of_v_is_a_mean_over_collisions():
    """Random collisions, with an a2 by weights; and 3 a2/16 at one CoR."""
    x = np.random.default_rng(1).exponential(size=400_000)
    e = 1 - 0.4 * np.minimum(2 * np.sqrt(50 * x) / 20.0, 1.0) ** 0.75
    for a2 in (0.0, -0.03):
        values = x * (1 + a2 * (4 * x**2 - 12 * x + 3) / 16) * (1 - e**2)
        error = values.std() / math.sqrt(len(values))
        assert theory.viscoelastic_loss(0.6, 20.0, 50.0, a2=a2) == pytest.approx(
            values.mean(), abs=4 * error
        )
    one = 0.6, 1e-6, 50.0
    ratio = theory.viscoelastic_loss(*one, a2=0.1) / theory.viscoelastic_loss(*one)
    assert ratio == pytest.approx(1 + 3 * 0.1 / 16, rel=1e-5)


def test_the_temperature_of_a_dilute_driven_gas_scales():
    """As m V²/[(1 − e²) N]² at a given size; the mass of the balls enters as a factor."""
    state = 0.99, 2.0, 1e-4, Circle(10.0)
    one = theory.driven_temperature(100, *state)
    assert theory.driven_temperature(200, *state) == pytest.approx(one / 4, rel=0.02)
    assert theory.driven_temperature(100, *state, mass=3.0) == pytest.approx(3 * one, rel=1e-12)
    faster = theory.driven_temperature(100, 0.99, 4.0, *state[2:])
    assert faster == pytest.approx(4 * one, rel=1e-12)
    # By hand, V L √(πm) / [4 N χ r (1 − e²)] in a channel of length L: the walls are 2L of edge.
    dilute = theory.driven_temperature(10_000, 0.99, 2.0, 1e-5, Channel(7.0, 10.0))
    by_hand = 2.0 * 2 * 10.0 / ((1 - 0.99**2) * 10_000 * 2e-5) / math.sqrt(math.pi)
    assert dilute == pytest.approx(by_hand**2, rel=1e-3)
