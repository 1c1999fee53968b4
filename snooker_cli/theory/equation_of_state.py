"""The equation of state of the hard-disk fluid, in bulk and between walls."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray

from snooker_cli.containers import Container

Real = TypeVar("Real", float, NDArray[np.float64])  # a float, or an array of floats


def number_density(number: float, area: float) -> float:
    """Balls per area of the whole container (m⁻²): n = N/V."""
    return number / area


def ideal_gas_pressure(number: float, temperature: float, area: float) -> float:
    """Pressure of the ideal gas (N/m): P = N T/V, equation 10 of the source report."""
    return number * temperature / area


def van_der_waals_pressure(
    number: float, temperature: float, area: float, ball_radius: float
) -> float:
    """Pressure with the excluded area of pairs (N/m): P = N T/(V − N b).

    b = 2πr² is the second virial coefficient of hard disks, half the area πd² that one ball closes
    to the centre of another. The form is exact to first order in the density. It is inf where
    N b reaches V, at a packing fraction of one half.
    """
    free_area = area - number * 2 * math.pi * ball_radius**2
    return number * temperature / free_area if free_area > 0 else math.inf


def accessible_wall_pressure(
    number: float, temperature: float, ball_radius: float, container: Container
) -> float:
    """Pressure on the wall of balls that never collide with each other (N/m): N T L/(A W).

    A and L are the accessible area and its edge, W the length of the wall. By the virial theorem
    it is exact: in a circle a·F = 2 N T, so P = N T/(π a R). In a box (w − 2r)F_x = 2 N⟨m u²⟩, the
    same holds for y, and both directions have the same share on average.
    """
    region = container.accessible(ball_radius)
    return number * temperature * region.edge / region.area / container.wall_length


VIRIAL_RATIOS = (
    *(1.0, 1.0, 0.7820044, 0.5322318, 0.33355604),
    *(0.1988425, 0.1148728, 0.0649930, 0.0362193, 0.0199537),
)
"""B_k/B_2^(k−1) of hard disks for k = 1 … 10 (Clisby & McCoy 2006), so Z = Σ ratio_k (2η)^(k−1)."""


def _pade_coefficients() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Numerator of χ (degree 4) and denominator of χ and Z (degree 5) of the Padé [4/5] of Z."""
    series = np.array(VIRIAL_RATIOS)
    rows = np.arange(5, 10)
    denominator = np.ones(6)
    denominator[1:] = np.linalg.solve(series[rows[:, None] - np.arange(1, 6)], -series[rows])
    numerator = np.zeros(6)
    numerator[:5] = np.convolve(series, denominator)[:5]
    # Z − 1 = x χ: the constant terms are both exactly one, so x divides out and χ keeps every digit
    # in the dilute limit, where (Z − 1)/x would lose them.
    return (numerator - denominator)[1:], denominator


_PADE_CONTACT, _PADE_DENOMINATOR = _pade_coefficients()


DENSEST_FLUID = 0.65
"""Packing fraction above which disks begin to order, where no theory here holds."""


def contact_value(packing: Real) -> Real:
    """Pair distribution of hard disks at contact: χ = (Z − 1)/(2η), 1 in the dilute limit.

    `packing` is the packing fraction η. Z is the Padé [4/5] in 2η of ten virial coefficients
    (Clisby & McCoy 2006). It describes the fluid and fails above η ≈ 0.65, where disks begin to
    order: at η = 0.70 it is a tenth too high.
    """
    x = 2.0 * packing
    ratio: Any = polyval(x, _PADE_CONTACT) / polyval(x, _PADE_DENOMINATOR)
    value: Real = ratio
    return value


def compressibility(packing: Real) -> Real:
    """Compressibility factor of hard disks: Z = P/(n T) = 1 + 2ηχ (see `contact_value`)."""
    return 1.0 + 2.0 * packing * contact_value(packing)


@dataclass(frozen=True)
class FluidState:
    """Equilibrium of hard disks in a container.

    pressure : force on the wall over its length, N/m; without walls that of the bulk
    bulk_packing : packing fraction far from the walls; below N πr² over the accessible area,
        because walls attract balls
    virial_ratio : 1 + ΣJd/(2 N T t), with the impulses J of ball-ball collisions at their
        distances d; in bulk this is Z
    """

    pressure: float
    bulk_packing: float
    virial_ratio: float


def fluid_state(
    number: float, temperature: float, ball_radius: float, container: Container
) -> FluidState:
    """Pressure of hard disks in a container, with its walls by scaled particle theory.

    With the bulk density n_b = η/(πr²), scaled particle theory (Helfand, Frisch & Lebowitz 1961)
    gives a hard wall the line tension γ = −T n_b r η/(1 − η)² on the accessible edge L. By Gibbs,
    the adsorption is 2 n_b r η/(1 + η). The grand potential is −P_b A + γ L over the accessible
    area A. Its change with a motion of the walls gives the force on them, and its change with the
    scale of the container gives the virial. To first order in the curvature::

        N = n_b A + L n_b 2ηr/(1 + η)             (a quadratic equation for η)
        force = P_b L − γ dL/ds                   P_b = n_b T Z(η)
        1 + ΣJd/(2 N T t) = (P_b A − γ L/2)/(N T)

    dL/ds is the region's `spreading`: the curvature of a circle, the corners of a box. Z is that of
    `compressibility`, which is better in bulk than that of scaled particle theory.

    Raises ValueError when a fluid of N balls does not fit.
    """
    area, edge, spreading = container.accessible(ball_radius)
    covered = number * math.pi * ball_radius**2
    if ball_radius <= 0 or edge < 0 or covered >= area + edge * ball_radius:
        raise ValueError(
            f"{number:g} balls of radius {ball_radius:g} m are no fluid in {container.description}"
            "; choose a positive radius and fewer or smaller balls"
        )
    linear = area - covered
    quadratic = area + 2 * ball_radius * edge
    packing = 2 * covered / (linear + math.sqrt(linear**2 + 4 * quadratic * covered))
    density = packing / (math.pi * ball_radius**2)
    tension = -density * temperature * ball_radius * packing / (1 - packing) ** 2
    bulk = density * temperature * compressibility(packing)
    force = bulk * edge - tension * spreading
    return FluidState(
        pressure=force / container.wall_length if container.has_wall else bulk,
        bulk_packing=packing,
        virial_ratio=(bulk * area - tension * edge / 2) / (number * temperature),
    )


class PublishedRatio(NamedTuple):
    """A published Z = P V/(N T), simulated in a periodic box at a packing fraction."""

    packing: float
    ratio: float
    source: str


_CLOSE_PACKING = math.pi / (2 * math.sqrt(3))

# Areas over that of close packing, and Z; packing fractions, and P d²/T = 4ηZ/π of 1024² disks.
_ERPENBECK = ((2.0, 3.4243), (1.8, 4.1715), (1.6, 5.4963), (1.5, 6.6074))
_ENGEL = ((0.698, 9.169342), (0.7, 9.185405), (0.716, 9.18327), (0.72, 9.2308))

PUBLISHED_RATIOS = (
    *(PublishedRatio(_CLOSE_PACKING / v, z, "Erpenbeck & Luban 1985") for v, z in _ERPENBECK),
    *(PublishedRatio(x, math.pi * p / (4 * x), "Engel et al. 2013") for x, p in _ENGEL),
)


def published_ratio(packing: float) -> PublishedRatio | None:
    """The published ratio at a packing fraction, or None if none is within 10⁻⁵ of it.

    Such a difference changes Z by at most 4·10⁻⁴.
    """
    near = min(PUBLISHED_RATIOS, key=lambda one: abs(one.packing - packing))
    return near if abs(near.packing - packing) <= 1e-5 else None
