"""Rates of collisions between balls and at the wall, and mean free paths."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import AccessibleRegion, Container
from snooker_cli.theory.equation_of_state import contact_value, fluid_state, number_density
from snooker_cli.theory.speed_distributions import fixed_energy_factor, fixed_energy_mean_speed


def mean_free_path(number_density: float, ball_radius: float, contact_value: float = 1.0) -> float:
    """Mean free path of disks (m): λ = 1/(2√2 n d χ) = ⟨v⟩/ω.

    The cross-section of disks is the length 2d, and √2 is the mean relative speed over ⟨v⟩. χ = 1
    gives Boltzmann's path in a dilute gas, the contact value χ Enskog's in a dense one.
    """
    return 1 / (2 * math.sqrt(2) * number_density * 2 * ball_radius) / contact_value


def source_mean_free_path(number_density: float, ball_radius: float) -> float:
    """Mean free path by equation 7 of the source report (m): 1/(√2 n σ) with its σ = 2πr."""
    return 1 / (math.sqrt(2) * number_density * 2 * math.pi * ball_radius)


def ball_ball_rate(
    number_density: float,
    ball_radius: float,
    temperature: float,
    contact_value: float = 1.0,
    mass: float = 1.0,
) -> float:
    """Ball-ball collisions of one ball per second after Enskog: ω = 2 d n χ √(πT/m).

    This is n·2d·χ·⟨g⟩ with the mean relative speed ⟨g⟩ = √(πT/m) of a Maxwellian.
    """
    thermal = math.sqrt(math.pi * temperature / mass)
    return 4 * ball_radius * number_density * contact_value * thermal


def wall_rate(mean_speed: float, region: AccessibleRegion) -> float:
    """Wall collisions of one ball per second in an ideal gas: ⟨v⟩ over the mean chord πA/L."""
    return mean_speed * region.edge / (math.pi * region.area)


def wall_rate_from_pressure(
    number: int, pressure: float, temperature: float, wall_length: float, mass: float = 1.0
) -> float:
    """Wall collisions of one ball per second that a pressure implies, for e_w = 1.

    ν_w = c_N W P/(N √(2π m T)): the force W·P on a wall of length W is the rate N ν_w times the
    mean impulse 2m⟨v_n²⟩/⟨v_n⟩ = √(2π m T)/c_N at fixed energy. It is exact at any density (in a
    circle on average over the angular momentum), because in equilibrium positions and velocities
    are independent.
    """
    force = wall_length * pressure
    impulse = math.sqrt(2 * math.pi * mass * temperature) / fixed_energy_factor(number)
    return force / (number * impulse)


def friction(
    ball: int,
    masses: NDArray[np.float64],
    radii: NDArray[np.float64],
    temperature: float,
    container: Container,
) -> float:
    """Friction of a ball among all others after Enskog (kg/s): ζ = Σ 2 σ χ √(2πμT)/A.

    A slow ball with drift u feels the force −ζu. Its coefficient of diffusion is D = T/ζ, the first
    Sonine approximation (Chapman & Cowling 1970, for disks); for a ball like all others that is
    √(T/πm)/(2 n d χ). Of each other ball, σ is the sum of both radii, μ the reduced mass and A the
    area that its centre reaches. χ of a mixture is that of Jenkins & Mancini 1987,
    1/(1 − η) + 9/16 · (Σ πr/2V)/(1 − η)² · 4 r r'/(r + r').

    masses, radii : (*N*,) of all balls, kg and m
    temperature : J
    """
    others = np.arange(len(radii)) != ball
    packing = container.packing_fraction(float(np.sum(radii**2)))
    edge = math.pi / 2 * float(np.sum(radii)) / container.area
    distance = radii[ball] + radii[others]
    means = 4 * radii[ball] * radii[others] / distance
    contact = 1 / (1 - packing) + 9 / 16 * edge / (1 - packing) ** 2 * means
    reduced = masses[ball] * masses[others] / (masses[ball] + masses[others])
    sizes, which = np.unique(radii[others], return_inverse=True)
    areas = np.array([container.accessible(float(size)).area for size in sizes])[which]
    each = 2 * distance * contact * np.sqrt(2 * math.pi * reduced * temperature) / areas
    return float(np.sum(each))


@dataclass(frozen=True)
class CollisionRates:
    """Collisions of one ball among equal hard disks in a container, after Enskog.

    mean_free_path : λ/χ, between collisions with other balls, m
    mean_speed : at fixed energy, m/s
    ball_ball, wall : collisions with other balls and with the wall, 1/s; 0 without a wall
    """

    mean_free_path: float
    mean_speed: float
    ball_ball: float
    wall: float


def collision_rates(
    number: int, temperature: float, ball_radius: float, container: Container, mass: float = 1.0
) -> CollisionRates:
    """Rates of N balls at the container's mean density, and at the wall of `fluid_state`.

    Raises ValueError when a fluid of N balls does not fit.
    """
    density = number_density(number, container.area)
    contact = contact_value(container.packing_fraction(number * ball_radius**2))
    pressure = fluid_state(number, temperature, ball_radius, container).pressure
    return CollisionRates(
        mean_free_path=mean_free_path(density, ball_radius, contact),
        mean_speed=fixed_energy_mean_speed(number, temperature, mass),
        ball_ball=ball_ball_rate(density, ball_radius, temperature, contact, mass),
        wall=wall_rate_from_pressure(number, pressure, temperature, container.wall_length, mass),
    )
