"""How often balls meet each other and the wall, and how far they fly between.

A Maxwellian loses (1 − e²)T a ball-ball event and (1 − e_w²)T a wall event, on average; balls that
all have the same speed lose the fractions below of that.
"""

import math
from dataclasses import dataclass

from snooker_cli.containers import AccessibleRegion, Container
from snooker_cli.theory.equation_of_state import (
    contact_value,
    fluid_state,
    number_density,
    packing_fraction,
)
from snooker_cli.theory.speed_distributions import fixed_energy_factor, fixed_energy_mean_speed


def boltzmann_mean_free_path(number_density: float, ball_radius: float) -> float:
    """Mean free path of a dilute gas of disks (m): λ = 1/(2√2 n d) = ⟨v⟩/ω at χ = 1.

    The cross-section of disks is the length 2d, and √2 is the mean relative speed over ⟨v⟩.
    """
    return 1 / (2 * math.sqrt(2) * number_density * 2 * ball_radius)


def enskog_mean_free_path(number_density: float, ball_radius: float, contact_value: float) -> float:
    """Mean free path of a dense gas of disks after Enskog (m): λ/χ."""
    return boltzmann_mean_free_path(number_density, ball_radius) / contact_value


def report_mean_free_path(number_density: float, ball_radius: float) -> float:
    """Mean free path by the source report's equation 7 (m): 1/(√2 n σ) with its σ = 2πr."""
    return 1 / (math.sqrt(2) * number_density * 2 * math.pi * ball_radius)


def ball_ball_rate(
    number_density: float,
    ball_radius: float,
    temperature: float,
    contact_value: float = 1.0,
    mass: float = 1.0,
) -> float:
    """Ball-ball collisions of one ball per second after Enskog: ω = 2 d n χ √(πT/m).

    Derived as n·2d·χ·⟨g⟩ with the mean relative speed ⟨g⟩ = √(πT/m) of a Maxwellian.
    """
    thermal = math.sqrt(math.pi * temperature / mass)
    return 4 * ball_radius * number_density * contact_value * thermal


def wall_rate(mean_speed: float, region: AccessibleRegion) -> float:
    """Wall collisions of one ball per second in an ideal gas: ⟨v⟩ over the mean chord πA/L.

    A and L are the accessible area and its edge; the chord is πa/2 in a circle.
    """
    return mean_speed * region.edge / (math.pi * region.area)


def wall_rate_from_pressure(
    number: int,
    pressure: float,
    temperature: float,
    wall_length: float,
    mass: float = 1.0,
) -> float:
    """Wall collisions of one ball per second that a pressure implies, for e_w = 1.

    ν_w = c_N W P/(N √(2π m T)): the force W·P on a wall of length W is the rate N ν_w times the
    mean impulse of the balls that arrive, 2m⟨v_n²⟩/⟨v_n⟩ = √(2π m T)/c_N at fixed energy. This is
    exact at any density, in a circle on average over the angular momentum: in equilibrium positions
    tell nothing of velocities.
    """
    force = wall_length * pressure
    impulse = math.sqrt(2 * math.pi * mass * temperature) / fixed_energy_factor(number)
    return force / (number * impulse)


@dataclass(frozen=True)
class CollisionRates:
    """How far and how often a ball flies among equal hard disks in a container, after Enskog.

    Attributes
    ----------
    mean_free_path : float
        λ/χ, between collisions with other balls (m).
    mean_speed : float
        At fixed energy (m/s).
    ball_ball, wall : float
        Collisions of one ball with others and with the wall (s⁻¹), 0 where there is none.
    """

    mean_free_path: float
    mean_speed: float
    ball_ball: float
    wall: float


def collision_rates(
    number: int,
    temperature: float,
    ball_radius: float,
    container: Container,
    mass: float = 1.0,
) -> CollisionRates:
    """Rates of N balls at a temperature, at the container's mean density and `fluid_state`'s wall.

    Raises ValueError when no fluid of that many balls fits.
    """
    density = number_density(number, container.area)
    contact = contact_value(packing_fraction(number, ball_radius, container.area))
    pressure = fluid_state(number, temperature, ball_radius, container).pressure
    return CollisionRates(
        mean_free_path=enskog_mean_free_path(density, ball_radius, contact),
        mean_speed=fixed_energy_mean_speed(number, temperature, mass),
        ball_ball=ball_ball_rate(density, ball_radius, temperature, contact, mass),
        wall=wall_rate_from_pressure(number, pressure, temperature, container.wall_length, mass),
    )
