"""Cooling of inelastic balls: Haff's law, the exponential of the source report, the energy floor.

Balls with Maxwell's speeds lose (1 − e²)T in a ball-ball collision and (1 − e_w²)T at the wall, on
average.
"""

import math
from typing import NamedTuple

import numpy as np

from snooker_cli.containers import Container
from snooker_cli.theory.collision_rates import ball_ball_rate
from snooker_cli.theory.equation_of_state import Real, contact_value


def source_decay_constant(restitution: float, mean_free_path: float, mean_speed: float) -> float:
    """Decay constant of the energy by the source report (s⁻¹): k = −2 ln(e) ⟨v⟩/λ (eqs 6, 7).

    It assumes that a collision leaves e² of all energy; only the relative normal part of the motion
    loses that much. The pressure's is k/2 (eq. 9), the first slope of its mean since the start.
    `restitution` is in (0, 1].
    """
    return (0.0 - 2.0 * math.log(restitution)) * mean_speed / mean_free_path


def haff_ratio(time: Real, haff_rate: float) -> Real:
    """Temperature over its start by Haff's law (Haff 1983): T/T0 = (1 + αt)⁻²."""
    return 1.0 / (1.0 + haff_rate * time) ** 2


def sonine_coefficient(restitution: float) -> float:
    """Second Sonine coefficient a2 of the homogeneous cooling state of inelastic disks.

    a2 = 16(1 − e)(1 − 2e²)/[73 − 41e − 2(1 − e)e²], where ⟨v⁴⟩/⟨v²⟩² = 2(1 + a2). The collisional
    moments obey μ4 = 4(1 + a2)μ2 (van Noije & Ernst 1998), here linearised as μ4/(1 + a2) = 4μ2
    (Montanero & Santos 2000). a3 and beyond are neglected: at e ≥ 0.5 the result is within 0.005 of
    direct simulation, which is below 0.001 of the cooling rate.
    """
    e = restitution
    return 16 * (1 - e) * (1 - 2 * e**2) / (73 - 41 * e - 2 * (1 - e) * e**2)


def cooling_rate(
    restitution: float, ball_ball_rate: float, wall_restitution: float = 1.0, wall_rate: float = 0.0
) -> float:
    """Relative loss of temperature per second: ζ = (1 − e²)(ω/2)(1 + 3a2/16) + (1 − e_w²)ν_w.

    ω and ν_w are the collision rates of one ball with Maxwell's speeds (s⁻¹). The ball-ball term is
    Haff's with the Sonine correction of van Noije & Ernst 1998. The wall term is the mean loss
    (1 − e_w²)T of a ball at the wall.
    """
    sonine = 1 + 3 * sonine_coefficient(restitution) / 16
    between_balls = (1 - restitution**2) * ball_ball_rate / 2 * sonine
    return between_balls + (1 - wall_restitution**2) * wall_rate


def critical_length(
    restitution: float, number: float, ball_radius: float, container: Container
) -> float:
    """Wavelength L_c above which vortices grow in a gas of inelastic disks, m; inf at CoR 1.

    A flow that varies as sin(kx) across its direction decays at the rate ν k², the thermal speed at
    ζ/2. So the flow grows relative to it if ν k² < ζ/2, and L_c = 2π/k = 2π√(2ν/ζ), at any
    temperature. Clusters follow where vortices have grown. ζ is that of `cooling_rate` without a
    wall. ν is Enskog's kinematic viscosity of elastic disks in the first Sonine approximation, so
    that the result holds to leading order in 1 − e² (Brito & Ernst 1998,
    doi:10.1209/epl/i1998-00388-9; viscosity: Gass, J. Chem. Phys. 54 (1971) 1898)::

        ν = √(T/(πm))/(2 n d) · [1/χ + 2η + (1 + 8/π) η² χ]

    In a dilute gas, with ζ = (1 − e²)√(πT/m) n d and λ = 1/(2√2 n d), L_c is 4√(2π) λ/√(1 − e²) =
    10.03 λ/√(1 − e²).
    """
    density, packing = number / container.area, container.packing_fraction(number * ball_radius**2)
    contact = contact_value(packing)
    dense = 1 / contact + 2 * packing + (1 + 8 / math.pi) * packing**2 * contact
    viscosity = dense / (4 * math.sqrt(math.pi) * density * ball_radius)
    cooling = cooling_rate(restitution, ball_ball_rate(density, ball_radius, 1.0, contact))
    return 2 * math.pi * math.sqrt(2 * viscosity / cooling) if cooling else math.inf


def haff_rate(cooling_rate: float) -> float:
    """Haff's rate (s⁻¹): α = ζ/2 with ζ at the start, because dT/dt = −ζ0 √(T/T0) T."""
    return cooling_rate / 2


def energy_ratio_by_events(
    number: float,
    restitution: float,
    ball_ball_events: Real,
    wall_restitution: float,
    wall_events: Real,
) -> Real:
    """Energy over its start after c_bb and c_w collisions: exp{−[(1 − e²)c_bb + (1 − e_w²)c_w]/N}.

    Each collision loses the mean of Maxwell's speeds, (1 − e²)T = (1 − e²)E/N, at any density.
    """
    lost = (1 - restitution**2) * ball_ball_events + (1 - wall_restitution**2) * wall_events
    ratio: Real = np.exp(-lost / number)
    return ratio


class SourceFactors(NamedTuple):
    """Factors by which the mistakes of the source report change its decay constant; 1 for none.

    loss : all energy falls to e² in a collision; only the normal part of the relative motion loses
    section : the cross-section is 2πr instead of the 4r of disks
    density : the finite size of the balls, which makes collisions χ times as frequent, is ignored
    wall : losses at the wall are ignored
    """

    loss: float
    section: float
    density: float
    wall: float


def source_factors(
    restitution: float,
    contact_value: float,
    ball_ball_rate: float,
    wall_restitution: float,
    wall_rate: float,
) -> SourceFactors:
    """The mistakes of equations 6 and 7 of the source report, as factors.

    Their product is −2 ln(e)⟨v⟩ √2 n 2πr over ζ of `cooling_rate`, ⟨v⟩ = √(πT/2m) for Maxwell's
    law: a ball loses −ln(e²) instead of (1 − e²)(1 + 3a2/16)/2 in a collision, and has
    ω = √2 n 4r χ⟨v⟩ of them per second. χ is the contact value; the rates are `cooling_rate`'s.
    """
    pairs = cooling_rate(restitution, ball_ball_rate)
    both = cooling_rate(restitution, ball_ball_rate, wall_restitution, wall_rate)
    loss = -2 * math.log(restitution) * ball_ball_rate / pairs
    return SourceFactors(loss, math.pi / 2, 1 / contact_value, pairs / both)


def angular_momentum_floor(
    angular_momentum: float, number: float, accessible_radius: float, mass: float = 1.0
) -> float:
    """Least energy that a smooth fixed circle leaves to N balls (J): E ≥ L²/(2 m N a²).

    The circle conserves the angular momentum L about its centre. By Cauchy-Schwarz the energy is
    least if all balls circle at radius a = R − r with one speed.
    """
    return angular_momentum**2 / (2 * mass * number * accessible_radius**2)
