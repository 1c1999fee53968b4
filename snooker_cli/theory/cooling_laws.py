"""How inelastic balls cool: the report's exponential, Haff's law, and the pressures they imply."""

import math
from dataclasses import dataclass

import numpy as np

from snooker_cli.theory.equation_of_state import Real


def report_decay_constant(restitution: float, mean_free_path: float, mean_speed: float) -> float:
    """The source report's decay constant of the energy (s⁻¹): k = −2 ln(e)/τ, τ = λ/⟨v⟩ (eqs 6, 7).

    It takes all of the energy to fall to e² a collision, where only the relative normal part of
    the motion does; `restitution` is in (0, 1].
    """
    return (0.0 - 2.0 * math.log(restitution)) * mean_speed / mean_free_path


def report_pressure_decay_constant(energy_decay_constant: float) -> float:
    """The source report's decay constant of the pressure (s⁻¹): k/2 (eq. 9).

    The pressure itself follows the temperature; k/2 is the initial slope of its cumulative average.
    """
    return energy_decay_constant / 2


def haff_ratio(time: Real, haff_rate: float) -> Real:
    """Temperature over its start by Haff's law (Haff 1983): T/T0 = (1 + αt)⁻²."""
    return 1.0 / (1.0 + haff_rate * time) ** 2


def sonine_coefficient(restitution: float) -> float:
    """Second Sonine coefficient a2 of the homogeneous cooling state of inelastic disks.

    a2 = 16(1 − e)(1 − 2e²)/[73 − 41e − 2(1 − e)e²], where ⟨v⁴⟩/⟨v²⟩² = 2(1 + a2): the condition
    of van Noije & Ernst 1998, μ4 = 4(1 + a2)μ2 between the collisional moments, linearised as
    μ4/(1 + a2) = 4μ2 (after Montanero & Santos 2000; as it stands it gives the denominator
    57 − 25e + 30(1 − e)e²). Integrated over the collision, μ2 is in proportion to
    (1 − e²)(1 + 3a2/16), and μ4 to (1 + e)[(1 − e)(7 + 2e²)/2 + a2 (209 − 177e + 30e² − 30e³)/32].
    Both forms neglect a3 and beyond, which at e ≥ 0.5 leaves this one within 0.005 of direct
    simulation: below 0.001 of the cooling rate.
    """
    e = restitution
    return 16 * (1 - e) * (1 - 2 * e**2) / (73 - 41 * e - 2 * (1 - e) * e**2)


def cooling_rate(
    restitution: float,
    ball_ball_rate: float,
    wall_restitution: float = 1.0,
    wall_rate: float = 0.0,
) -> float:
    """Relative loss of temperature per second: ζ = (1 − e²)(ω/2)(1 + 3a2/16) + (1 − e_w²)ν_w.

    ω and ν_w are the collision rates of one ball (s⁻¹) at the temperature meant, for a Maxwellian.
    The ball-ball term is Haff's with the Sonine correction of van Noije & Ernst 1998; the wall
    term follows from the mean loss (1 − e_w²)T of a ball that arrives at the wall.
    """
    sonine = 1 + 3 * sonine_coefficient(restitution) / 16
    between_balls = (1 - restitution**2) * ball_ball_rate / 2 * sonine
    return between_balls + (1 - wall_restitution**2) * wall_rate


def haff_rate(cooling_rate: float) -> float:
    """Haff's rate (s⁻¹): α = ζ/2 with ζ at the start, since dT/dt = −ζ0 √(T/T0) T."""
    return cooling_rate / 2


def energy_ratio_by_events(
    number: float,
    restitution: float,
    ball_ball_events: Real,
    wall_restitution: float,
    wall_events: Real,
) -> Real:
    """Energy over its start after counted events: exp{−[(1 − e²)c_bb + (1 − e_w²)c_w]/N}.

    Each event takes the Maxwellian mean (1 − e²)T = (1 − e²)E/N, whatever density and time.
    """
    lost = (1 - restitution**2) * ball_ball_events + (1 - wall_restitution**2) * wall_events
    ratio: Real = np.exp(-lost / number)
    return ratio


# Where cooling ends: the angular-momentum floor and the wall trap.

_MOST_TERMS = 4_000_000


def angular_momentum_floor(
    angular_momentum: float, number: float, accessible_radius: float, mass: float = 1.0
) -> float:
    """Least energy that a smooth fixed circle leaves to N balls (J): E ≥ L²/(2 m N a²).

    The circle conserves the angular momentum L about its centre, and by Cauchy-Schwarz the
    cheapest way to carry it is for all balls to circle at radius a = R − r with one speed.
    """
    return angular_momentum**2 / (2 * mass * number * accessible_radius**2)


@dataclass(frozen=True)
class WallTrap:
    """Infinitely many bounces of one ball along a fixed circular wall, until it slides.

    Attributes
    ----------
    duration : float
        Time from the first impact until the ball slides (s); inf if it never turns along the wall.
    angle : float
        Angle that the ball covers around the centre meanwhile (rad).
    impulse : float
        Sum of the impulses of all later impacts (N·s); the first one is not in it.
    """

    duration: float
    angle: float
    impulse: float


def wall_trap(
    normal_speed: float,
    tangential_speed: float,
    restitution: float,
    accessible_radius: float,
    mass: float = 1.0,
) -> WallTrap:
    """Sums over the bounces of one ball inside a fixed smooth circle.

    `normal_speed` > 0 and `tangential_speed` ≥ 0 (m/s) are those just after the first impact. v_t
    stays, v_n,k = e^k v_n,0; a flight takes Δt_k = 2a v_n,k/(v_n,k² + v_t²) and covers
    Δφ_k = 2 atan(v_n,k/v_t); the impulses add up to m v_n,0 (1 + e)/(1 − e). The sums run until
    v_n² no longer counts beside v_t²; the geometric rest is added in closed form.

    Raises ValueError for a restitution outside [0, 1), or so near 1 that the sums have more than
    four million terms.
    """
    if not 0 <= restitution < 1:
        raise ValueError(f"A wall trap needs a restitution in [0, 1), not {restitution!r}.")
    impulse = mass * normal_speed * (1 + restitution) / (1 - restitution)
    if tangential_speed == 0:
        return WallTrap(math.inf, math.inf, impulse)
    slope = normal_speed / tangential_speed
    terms = 1
    if restitution > 0:
        # Beyond the last term v_n/v_t < 2⁻²⁷, so its square is below half a unit of rounding.
        terms += max(0, math.ceil(math.log(2.0**-27 / slope) / math.log(restitution)))
    if terms > _MOST_TERMS:
        raise ValueError(
            f"A restitution of {restitution!r} needs {terms} bounces to settle; "
            f"ask for one with at most {_MOST_TERMS}."
        )
    slopes = slope * restitution ** np.arange(terms)
    rest = float(slopes[-1]) * restitution / (1 - restitution)
    flights = math.fsum(slopes / (1 + slopes**2)) + rest
    duration = 2 * accessible_radius / tangential_speed * flights
    angle = 2 * (math.fsum(np.arctan(slopes)) + rest)
    return WallTrap(duration, angle, impulse)
