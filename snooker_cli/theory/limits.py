"""Where cooling ends: the angular-momentum floor and the wall trap."""

import math
from dataclasses import dataclass

import numpy as np

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
