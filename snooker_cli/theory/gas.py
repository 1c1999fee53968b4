"""The ideal gas of the report, its excluded-area corrections, and how full a container is."""

import math

from snooker_cli.theory.container import Container


def number_density(number: float, area: float) -> float:
    """Balls per area of the whole container (m⁻²): n = N/V."""
    return number / area


def packing_fraction(number: float, ball_radius: float, area: float) -> float:
    """Fraction of the container's area that balls cover: η = N πr²/V."""
    return number * math.pi * ball_radius**2 / area


def ideal_gas_pressure(number: float, temperature: float, area: float) -> float:
    """Pressure of the ideal gas (N/m): P = N T/V, the report's equation 10 with V an area in m²."""
    return number * temperature / area


def ideal_gas_temperature(pressure: float, area: float, number: float) -> float:
    """Temperature that the ideal gas law gives to a pressure (J): T = P V/N."""
    return pressure * area / number


def van_der_waals_pressure(
    number: float, temperature: float, area: float, ball_radius: float
) -> float:
    """Pressure with the excluded area of pairs (N/m): P = N T/(V − N b).

    b = 2πr² is the second virial coefficient of hard disks (half the area πd² that a ball denies
    to another's centre), so the form is exact to first order in the density and no further: it
    is inf where N b reaches V, at a packing fraction of one half.
    """
    free_area = area - number * 2 * math.pi * ball_radius**2
    return number * temperature / free_area if free_area > 0 else math.inf


def accessible_wall_pressure(number: float, temperature: float, container: Container) -> float:
    """Force of balls that do not meet each other over the wall's length (N/m): N T L/(A W).

    A and L are the accessible area and its edge, W the wall. The virial theorem makes it exact
    without ball-ball collisions: in a circle a·F = 2 N T, so that P = N T/(π a R); in a box
    (w − 2r)F_x = 2 N⟨m u²⟩ and so in y, and both directions have the same share on average.
    """
    force = number * temperature * container.accessible_wall / container.accessible_area
    return force / container.wall
