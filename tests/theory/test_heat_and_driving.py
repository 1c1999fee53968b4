"""Heat, walls that give energy, restitution by speed: limits, and integrals done again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial.hermite import hermgauss
from numpy.polynomial.legendre import leggauss
from scipy.special import eval_genlaguerre, roots_genlaguerre

from snooker_cli import theory
from snooker_cli.containers import Box, Channel, Circle
from snooker_cli.laws import Constant, Driven, Thermal, Viscoelastic


@pytest.mark.parametrize(
    ("e", "v0", "warm", "mass", "a2"), [(0.7, 3.0, 5.0, 2.0, 0.0), (0.2, 40.0, 5.0, 1.0, -0.03)]
)
def test_the_loss_of_a_viscoelastic_collision(
    e: float, v0: float, warm: float, mass: float, a2: float
) -> None:
    """The mean over relative normal speeds of collisions, by the midpoint rule."""
    speed = (np.arange(200_000) + 0.5) * 4e-4
    x = mass * speed**2 / (4 * warm)
    flux = mass * speed / (2 * warm) * np.exp(-x) * (1 + a2 * (4 * x**2 - 12 * x + 3) / 16)
    cor = 1 - (1 - e) * np.minimum(speed / v0, 1) ** 0.75
    lost = float(np.sum(flux * mass / 4 * speed**2 * (1 - cor**2)) * 4e-4)
    loss = theory.mean_loss(Viscoelastic(e, v0), np.array([warm, 9.0]), mass, a2)
    assert loss[0] * warm == pytest.approx(lost, rel=1e-7)
    assert loss[1] == theory.mean_loss(Viscoelastic(e, v0), 9.0, mass, a2)


def test_the_loss_has_its_limits() -> None:
    assert theory.mean_loss(Constant(0.8), 5.0) == pytest.approx(0.36)
    # Slow collisions: 2 (1 - e) Gamma(2 + 3/8) (4 T/(m v0^2))^(3/8).
    slow = 0.4 * math.gamma(2.375) * (4e-8) ** 0.375
    assert theory.mean_loss(Viscoelastic(0.8, 1.0), 1e-8) == pytest.approx(slow, rel=1e-3)


def test_a_gas_cools_by_the_integral_of_its_rate() -> None:
    """Haff's law for a rate as √T, and T0 e^(−kt) for a constant one, from several T0 at once."""
    first, time = np.array([5.0, 3.0, 5.0, 0.2]), np.array([7.0, 0.0, 100.0, 11.0])
    haff = theory.cooled_temperature(first, time, lambda warm: 0.3 * np.sqrt(warm))
    assert haff == pytest.approx(first / (1 + 0.15 * np.sqrt(first) * time) ** 2, rel=1e-6)
    even = theory.cooled_temperature(first, time, lambda warm: np.full_like(warm, 0.3))
    assert even == pytest.approx(first * np.exp(-0.3 * time), rel=1e-6)


def test_the_balance_of_energy() -> None:
    """At its T the means over random hits and collisions give what they take."""
    number, radius, mass, e, gas = 50, 0.3, 2.0, 0.95, Box(12.0, 9.0)
    walls = [(Driven(0.9, 2.0), 16.8), (Constant(0.8), 11.4), (Thermal(60.0), 11.4)]
    warm = theory.balance_temperature(number, radius, mass, e, gas, walls)
    rng = np.random.default_rng(7)
    speed = np.sqrt(2 * warm / mass * rng.exponential(size=400_000))  # of hits of a wall
    left = np.sqrt(2 * 60.0 / mass * rng.exponential(size=400_000))  # of a thermal wall
    along = 60.0 * rng.normal(size=400_000) ** 2 / 2 - warm / 2
    leaving = (0.9 * speed + 1.9 * 2.0, 0.8 * speed, left)
    state = theory.fluid_state(number, 1.0, radius, gas)
    force = number * warm * (1 + 0.975 * (state.virial_ratio - 1)) / (11.4 * 8.4)  # of a metre
    given, variance = 0.0, 0.0
    for (law, length), after in zip(walls, leaving, strict=True):
        energy = mass / 2 * (after**2 - speed**2) + along * isinstance(law, Thermal)
        impulse = mass * (after + speed)
        power = force * length * energy.mean() / impulse.mean()
        given += power
        variance += (energy - energy.mean() / impulse.mean() * impulse).var() * (
            force * length / impulse.mean()
        ) ** 2
    rate = theory.ball_ball_rate_from_virial(state.virial_ratio, warm, radius, number, mass)
    taken = number * rate / 2 * (1 - e**2) * warm
    error = math.sqrt(variance / 400_000)
    assert abs(given - taken) < 4 * error
    assert error < 0.01 * taken


def test_the_balance_scales_with_the_square_of_the_speed() -> None:
    """As m V²/[(1 − e²) N]² at a given size; the mass of the balls enters as a factor."""

    def warm(speed: float, e: float = 0.99, mass: float = 1.0) -> float:
        walls = [(Driven(1.0, speed), 20 * math.pi)]
        return theory.balance_temperature(100, 1e-4, mass, e, Circle(10.0), walls)

    assert warm(4.0) == pytest.approx(16 * warm(1.0), rel=1e-12)
    assert warm(1.0, mass=3.0) == pytest.approx(3 * warm(1.0), rel=1e-12)
    assert warm(1.0, e=1.0) == math.inf
    # By hand, V L √(πm) / [4 N χ r (1 − e²)] in a channel of length L: the walls are 2L of edge.
    channel, walls = Channel(7.0, 10.0), [(Driven(1.0, 2.0), 20.0)]
    dilute = theory.balance_temperature(10_000, 1e-5, 1.0, 0.99, channel, walls)
    by_hand = 2.0 * 2 * 10.0 / ((1 - 0.99**2) * 10_000 * 2e-5) / math.sqrt(math.pi)
    assert dilute == pytest.approx(by_hand**2, rel=1e-3)


def test_other_walls_have_their_balance() -> None:
    state = 100, 0.1, 3.0, 1.0, Circle(10.0)
    assert theory.balance_temperature(*state, [(Thermal(7.0), 60.0)]) == pytest.approx(7.0)
    with pytest.raises(ValueError, match="no balance"):
        theory.balance_temperature(*state, [(Viscoelastic(0.9, 1.0), 60.0)])


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
