"""The equation of state of the hard-disk fluid, in bulk and inside a circular wall."""

import math
from dataclasses import dataclass

import numpy as np

from snooker_cli.theory.real import Real

VIRIAL_RATIOS = (
    1.0,
    1.0,
    0.7820044,
    0.5322318,
    0.33355604,
    0.1988425,
    0.1148728,
    0.0649930,
    0.0362193,
    0.0199537,
)
"""B_k/B_2^(k−1) of hard disks for k = 1 … 10 (Clisby & McCoy 2006), so Z = Σ ratio_k (2η)^(k−1)."""


def _polynomial(coefficients: tuple[float, ...], x: Real) -> Real:
    """Σ coefficients[i] x^i, by Horner's rule."""
    value = coefficients[-1] + 0.0 * x
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value


def _pade_coefficients() -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Numerator of χ (degree 4) and denominator of χ and Z (degree 5) of the Padé [4/5] of Z."""
    series = np.array(VIRIAL_RATIOS)
    rows = np.arange(5, 10)
    denominator = np.ones(6)
    denominator[1:] = np.linalg.solve(series[rows[:, None] - np.arange(1, 6)], -series[rows])
    numerator = np.zeros(6)
    numerator[:5] = np.convolve(series, denominator)[:5]
    # Z − 1 = x χ: the constant terms are both exactly one, so x divides out and χ keeps every digit
    # in the dilute limit, where (Z − 1)/x would lose them.
    contact = (numerator - denominator)[1:]
    return tuple(contact.tolist()), tuple(denominator.tolist())


_PADE_CONTACT, _PADE_DENOMINATOR = _pade_coefficients()


def contact_value(packing: Real) -> Real:
    """Pair distribution of hard disks at contact: χ = (Z − 1)/(2η), 1 in the dilute limit.

    `packing` is the packing fraction η (float or array); Z is the Padé [4/5] in 2η of ten virial
    coefficients (Clisby & McCoy 2006). It describes the fluid and fails above η ≈ 0.65, where disks
    begin to order (at η = 0.70 it is a tenth too high).
    """
    x = 2.0 * packing
    return _polynomial(_PADE_CONTACT, x) / _polynomial(_PADE_DENOMINATOR, x)


def compressibility(packing: Real) -> Real:
    """Compressibility factor of hard disks: Z = P/(n T) = 1 + 2ηχ (see `contact_value`)."""
    return 1.0 + 2.0 * packing * contact_value(packing)


def bulk_pressure(
    number: float, temperature: float, ball_radius: float, container_radius: float
) -> float:
    """Pressure of the bulk fluid at the container's mean density (N/m): P = Z(η) N T/(πR²).

    It leaves out the wall; `circle_state` has it.
    """
    packing = number * (ball_radius / container_radius) ** 2
    area = math.pi * container_radius**2
    return number * temperature / area * compressibility(packing)


@dataclass(frozen=True)
class CircleState:
    """Equilibrium of hard disks inside a circular wall.

    Attributes
    ----------
    pressure : float
        Force on the wall over the container's perimeter 2πR (N/m).
    accessible_pressure : float
        The same force over the perimeter 2πa of the accessible area (N/m).
    bulk_packing : float
        Packing fraction far from the wall; below N r²/a², because the wall attracts balls.
    """

    pressure: float
    accessible_pressure: float
    bulk_packing: float


def circle_state(
    number: float, temperature: float, ball_radius: float, container_radius: float
) -> CircleState:
    """Pressure of hard disks in a circle, with the wall by scaled particle theory.

    With n_b = η/(πr²) the bulk density, scaled particle theory (Helfand, Frisch & Lebowitz 1961)
    gives a hard wall the line tension γ = −T n_b r η/(1 − η)² on the accessible perimeter, and so,
    by Gibbs, the adsorption 2 n_b r η/(1 + η). To first order in the curvature 1/a::

        N = n_b πa² + 2πa n_b 2ηr/(1 + η)         (a quadratic equation for η)
        P_acc = n_b T Z(η) − γ/a                  P = P_acc a/R

    Z is the Padé's of `compressibility`, which is better in bulk than scaled particle theory's own.

    Raises ValueError when no fluid of that many balls fits.
    """
    accessible_radius = container_radius - ball_radius
    covered = number * ball_radius**2
    if ball_radius <= 0 or covered >= container_radius**2 - ball_radius**2:
        raise ValueError(
            f"{number:g} balls of radius {ball_radius:g} m are no fluid in a container of radius "
            f"{container_radius:g} m; choose a positive radius and fewer or smaller balls."
        )
    linear = accessible_radius**2 - covered
    quadratic = accessible_radius * (accessible_radius + 4 * ball_radius)
    packing = 2 * covered / (linear + math.sqrt(linear**2 + 4 * quadratic * covered))
    density = packing / (math.pi * ball_radius**2)
    tension = -density * temperature * ball_radius * packing / (1 - packing) ** 2
    bulk = density * temperature * compressibility(packing)
    accessible_pressure = bulk - tension / accessible_radius
    pressure = accessible_pressure * accessible_radius / container_radius
    return CircleState(pressure, accessible_pressure, packing)
