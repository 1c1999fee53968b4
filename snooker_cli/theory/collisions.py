"""How often balls meet each other and the wall, and how far they fly between.

A Maxwellian loses (1 − e²)T a ball-ball event and (1 − e_w²)T a wall event, on average; balls that
all have the same speed lose the fractions below of that.
"""

import math

from snooker_cli.theory.speeds import fixed_energy_factor

EQUAL_SPEED_BALL_BALL_LOSS = 8 / 9
"""Energy a ball-ball event takes from equal-speed balls, over a Maxwellian's: ⟨g_n²⟩ = 32T/9 m."""

EQUAL_SPEED_WALL_LOSS = 2 / 3
"""Energy a wall event takes from equal-speed balls, over a Maxwellian's: ⟨v_n²⟩ = 4T/3 m."""


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


def total_ball_ball_rate(number: float, ball_ball_rate: float) -> float:
    """Ball-ball events of all balls per second: N ω/2, since each event has two balls."""
    return number * ball_ball_rate / 2


def ball_ball_rate_from_pressure(
    number: int,
    pressure: float,
    temperature: float,
    ball_radius: float,
    container_radius: float,
    mass: float = 1.0,
) -> float:
    """Ball-ball collisions of one ball per second that a pressure implies in the circle, for e = 1.

    The virial theorem, time-averaged, is a·2πR·P = 2 N T + d·ΣJ_bb/t, and at fixed energy the mean
    impulse of a ball-ball event is √(π m T)/c_N (`fixed_energy_factor`), exact on average over the
    angular momentum. `pressure` is the force over the perimeter 2πR (N/m). As r → 0 the virial is a
    small difference of large numbers, and any error of the pressure is amplified.
    """
    force = 2 * math.pi * container_radius * pressure
    virial = (container_radius - ball_radius) * force - 2 * number * temperature
    impulse = math.sqrt(math.pi * mass * temperature) / fixed_energy_factor(number)
    return 2 * virial / (2 * ball_radius * impulse * number)


def wall_rate(mean_speed: float, accessible_radius: float) -> float:
    """Wall collisions of one ball per second in an ideal gas: ⟨v⟩ over the mean chord πa/2."""
    return mean_speed / (math.pi * accessible_radius / 2)


def wall_rate_from_pressure(
    number: int,
    pressure: float,
    temperature: float,
    container_radius: float,
    mass: float = 1.0,
) -> float:
    """Wall collisions of one ball per second that a pressure implies, for e_w = 1.

    ν_w = c_N 2πR P/(N √(2π m T)): the force 2πR·P is the rate N ν_w times the mean impulse of the
    balls that arrive, 2m⟨v_n²⟩/⟨v_n⟩ = √(2π m T)/c_N at fixed energy. This is exact at any density,
    on average over the angular momentum: in equilibrium positions tell nothing of velocities.
    """
    force = 2 * math.pi * container_radius * pressure
    impulse = math.sqrt(2 * math.pi * mass * temperature) / fixed_energy_factor(number)
    return force / (number * impulse)
