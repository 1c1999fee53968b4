"""Distributions of speed: Maxwell-Boltzmann, a cooling gas, and N balls at fixed energy.

With walls and a fixed total energy E = N T, the 2N velocity components are uniform on a sphere, so
v²/(2NT/m) ~ Beta(1, N − 1) for each ball, exactly. The limit of N → ∞ is Maxwell-Boltzmann. In a
periodic box with zero total momentum, N − 1 velocities are free. Equal balls then have the law of
N − 1 balls at the same T = E/N, because v is √(1 − 1/N) times a direction among those N − 1.
"""

import math

import numpy as np

from snooker_cli.theory.equation_of_state import Real


def maxwell_mean_speed(temperature: float, mass: float = 1.0) -> float:
    """Mean speed of a two-dimensional Maxwell-Boltzmann gas (m/s): √(πT/2m)."""
    return math.sqrt(math.pi * temperature / (2 * mass))


def fixed_energy_factor(number: int) -> float:
    """Mean speed of N balls at fixed energy over Maxwell's: c_N = √N Γ(N)/Γ(N + ½), above 1.

    By symmetry the mean magnitude of one velocity component has the same factor. It is
    1 + 1/(8N) + O(N⁻²). lgamma gives ten digits up to 10⁵ balls.
    """
    return math.sqrt(number) * math.exp(math.lgamma(number) - math.lgamma(number + 0.5))


def fixed_energy_mean_speed(number: int, temperature: float, mass: float = 1.0) -> float:
    """Mean speed of N balls that share the energy N T (m/s), exact: c_N √(πT/2m)."""
    return fixed_energy_factor(number) * maxwell_mean_speed(temperature, mass)


def maxwell_speed_density(speed: Real, temperature: float, mass: float = 1.0) -> Real:
    """Maxwell-Boltzmann density of the speed in 2D (s/m): (m v/T) exp(−m v²/2T) at v ≥ 0 (m/s)."""
    scaled = mass * speed / temperature
    density: Real = scaled * np.exp(-0.5 * scaled * speed)
    return density


def maxwell_speed_cdf(speed: Real, temperature: float, mass: float = 1.0) -> Real:
    """Probability of a speed below `speed` (m/s ≥ 0) in the Maxwell-Boltzmann gas."""
    probability: Real = -np.expm1(-0.5 * mass * speed * speed / temperature)
    return probability


def sonine_speed_cdf(speed: Real, temperature: float, a2: float, mass: float = 1.0) -> Real:
    """Probability of a speed below `speed` (m/s ≥ 0) in the homogeneous cooling state.

    Maxwell's density times 1 + a2 (x²/2 − 2x + 1), x = m v²/2T, the Sonine polynomial of van Noije
    & Ernst 1998 in two dimensions with the a2 of `sonine_coefficient`; integrated,
    1 − e^(−x)[1 + a2 (x²/2 − x)].
    """
    x = 0.5 * mass * speed * speed / temperature
    probability: Real = -np.expm1(-x) - a2 * (0.5 * x * x - x) * np.exp(-x)
    return probability


def fixed_energy_speed_density(
    speed: Real, number: int, temperature: float, mass: float = 1.0
) -> Real:
    """Exact density of the speed of one of N ≥ 2 balls that share the energy N T (s/m).

    p(v) = 2(N − 1) v/V² (1 − v²/V²)^(N−2) up to V = √(2NT/m), the speed of a ball with all of
    the energy; zero above. `speed` is v ≥ 0 in m/s.
    """
    _require_two(number)
    scale = mass / (2 * number * temperature)
    rest = 1.0 - scale * speed * speed
    power = np.maximum(rest, 0.0) ** (number - 2)
    density: Real = 2 * (number - 1) * scale * speed * power * (rest >= 0)
    return density


def fixed_energy_speed_cdf(speed: Real, number: int, temperature: float, mass: float = 1.0) -> Real:
    """Probability of a speed below `speed` (m/s ≥ 0) for one of N ≥ 2 balls that share N T.

    1 − (1 − m v²/(2NT))^(N−1), and 1 beyond v = √(2NT/m).
    """
    _require_two(number)
    fraction = np.minimum(mass * speed * speed / (2 * number * temperature), 1.0)
    with np.errstate(divide="ignore"):
        # log1p(−1) = −inf at the largest speed, where the probability is exactly one.
        probability: Real = -np.expm1((number - 1) * np.log1p(-fraction))
    return probability


def fixed_energy_kurtosis(number: int) -> float:
    """⟨v⁴⟩/⟨v²⟩² of N balls at fixed energy, exact: 2N/(N + 1); 2 for Maxwell-Boltzmann."""
    return 2 * number / (number + 1)


def _require_two(number: int) -> None:
    if number < 2:
        raise ValueError(f"{number} ball at fixed energy has one speed; choose at least 2 balls")
