"""Losses of collisions that depend on speed, and the balance of energy of a heated gas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snooker_cli import theory
from snooker_cli.laws import Constant, Driven, Thermal, Viscoelastic


@pytest.mark.parametrize(("e", "v0", "warm", "mass"), [(0.7, 3.0, 5.0, 2.0), (0.2, 40.0, 5.0, 1.0)])
def test_the_loss_of_a_viscoelastic_collision(
    e: float, v0: float, warm: float, mass: float
) -> None:
    """The mean over relative normal speeds of collisions, by the midpoint rule."""
    speed = (np.arange(200_000) + 0.5) * 4e-4
    flux = mass * speed / (2 * warm) * np.exp(-mass * speed**2 / (4 * warm))
    cor = 1 - (1 - e) * np.minimum(speed / v0, 1) ** 0.75
    lost = float(np.sum(flux * mass / 4 * speed**2 * (1 - cor**2)) * 4e-4)
    assert theory.mean_loss(Viscoelastic(e, v0), warm, mass) * warm == pytest.approx(lost, rel=1e-7)


def test_the_loss_has_its_limits() -> None:
    assert theory.mean_loss(Constant(0.8), 5.0) == pytest.approx(0.36)
    assert theory.mean_loss(Viscoelastic(0.8, 1e-4), 5.0) == pytest.approx(0.36, rel=1e-4)
    assert theory.mean_loss(Viscoelastic(1.0, 1.0), 5.0) == 0.0
    # Slow collisions: 2 (1 - e) Gamma(2 + 3/8) (4 T/(m v0^2))^(3/8).
    slow = 0.4 * math.gamma(2.375) * (4e-8) ** 0.375
    assert theory.mean_loss(Viscoelastic(0.8, 1.0), 1e-8) == pytest.approx(slow, rel=1e-3)


def test_a_gas_cools_by_the_integral_of_its_rate() -> None:
    """Haff's law for a rate as √T, and T0 e^(−kt) for a constant one, from several T0 at once."""
    first, time = np.array([5.0, 3.0, 5.0, 0.2]), np.array([7.0, 0.0, 100.0, 11.0])
    haff = theory.cooled_temperature(first, time, lambda warm: 0.3 * math.sqrt(warm))
    assert haff == pytest.approx(first / (1 + 0.15 * np.sqrt(first) * time) ** 2, rel=2e-4)
    even = theory.cooled_temperature(first, time, lambda _: 0.3)
    assert even == pytest.approx(first * np.exp(-0.3 * time), rel=1e-9)


def test_the_balance_of_energy() -> None:
    """At its T the means over random hits and collisions give what they take."""
    number, radius, mass, e, area = 50, 0.1, 2.0, 0.95, 100.0
    walls = [(Driven(0.9, 2.0), 30.0), (Constant(0.8), 10.0), (Thermal(60.0), 5.0)]
    warm = theory.balance_temperature(number, radius, mass, e, area, walls)
    rng = np.random.default_rng(7)
    speed = np.sqrt(2 * warm / mass * rng.exponential(size=400_000))  # of hits of a wall
    hits = math.sqrt(warm / (2 * math.pi * mass)) / area  # of a ball, for each metre of wall
    driven = mass / 2 * ((0.9 * speed + 1.9 * 2.0) ** 2 - speed**2)
    thermal = 60.0 * (rng.exponential(size=400_000) + rng.normal(size=400_000) ** 2 / 2)
    thermal -= mass / 2 * speed**2 + warm / 2  # of what leaves, and of what comes
    given = hits * (30 * driven - 10 * 0.36 * mass / 2 * speed**2 + 5 * thermal)
    rate = theory.ball_ball_rate((number - 1) / area, radius, warm, mass=mass)
    taken = rate / 2 * (1 - e**2) * warm
    error = given.std() / math.sqrt(400_000)
    assert abs(given.mean() - taken) < 4 * error
    assert error < 0.01 * taken


def test_the_balance_scales_with_the_square_of_the_speed() -> None:
    def warm(speed: float, e: float = 0.99) -> float:
        return theory.balance_temperature(100, 0.1, 3.0, e, 200.0, [(Driven(1.0, speed), 40.0)])

    assert warm(4.0) == pytest.approx(16 * warm(1.0), rel=1e-12)
    # For small losses as (1 - e^2)^-2.
    shares = [warm(1.0, math.sqrt(1 - loss)) for loss in (1e-6, 2e-6)]
    assert shares[0] == pytest.approx(4 * shares[1], rel=1e-3)
    assert warm(1.0, 1.0) == math.inf
    alone = theory.balance_temperature(100, 0.1, 3.0, 1.0, 200.0, [(Thermal(7.0), 40.0)])
    assert alone == pytest.approx(7.0)
    with pytest.raises(ValueError, match="no balance"):
        theory.balance_temperature(100, 0.1, 3.0, 1.0, 200.0, [(Viscoelastic(0.9, 1.0), 40.0)])
