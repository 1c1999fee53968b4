"""Closed formulas to compare simulations with, each with its source.

In two dimensions with k_B = 1, otherwise SI units: temperature in J, pressure in N/m (force over
the length of the wall, "Pa·m"), number density in m⁻², rates in s⁻¹.

========  ==========================================================================
symbol    meaning
========  ==========================================================================
N, m, r   number of balls, mass and radius of a ball; d = 2r
R, a      radius of a circular container, accessible radius a = R − r
w, h      width and height of a box
V         area of the container: πR², or w h
T         temperature, the mean kinetic energy of a ball; E = N T
n, η      number density N/V, packing fraction N πr²/V
Z, χ      compressibility factor P/(n T), contact value of the pair distribution
e, e_w    coefficient of restitution between balls, and at the wall
λ, ω, ν_w mean free path, ball-ball and wall collision rate of one ball
α, ζ, k   Haff's rate, cooling rate of the temperature, decay constant of the source report
========  ==========================================================================
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import leggauss
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray

from snooker_cli.containers import AccessibleRegion, Container
from snooker_cli.laws import Constant, Driven, Law, PackageLaw, Thermal, Viscoelastic
from snooker_cli.scene import Scene

Real = TypeVar("Real", float, NDArray[np.float64])  # a float, or an array of floats


# The equation of state of the hard-disk fluid, in bulk and between walls.


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


PADE_CONTACT, PADE_DENOMINATOR = _pade_coefficients()

# f, g and s = f'g − f g', where 2P = f/g with P = η Z, as polynomials of x = 2η.
_PADE_BELOW = Polynomial(PADE_DENOMINATOR)
_PADE_ABOVE = Polynomial((0, 1)) * _PADE_BELOW + Polynomial((0, 0, *PADE_CONTACT))
_PADE_SLOPE = _PADE_ABOVE.deriv() * _PADE_BELOW - _PADE_ABOVE * _PADE_BELOW.deriv()
PADE_SLOPE, PADE_BEND = _PADE_SLOPE.coef, _PADE_SLOPE.deriv().coef
PADE_GROWTH = _PADE_BELOW.deriv().coef

DENSEST_FLUID = 0.65
"""Packing fraction above which disks begin to order, where no theory here holds."""


def contact_value(packing: Real) -> Real:
    """Pair distribution of hard disks at contact: χ = (Z − 1)/(2η), 1 in the dilute limit.

    `packing` is the packing fraction η. Z is the Padé [4/5] in 2η of ten virial coefficients
    (Clisby & McCoy 2006). It describes the fluid and fails above η ≈ 0.65, where disks begin to
    order: at η = 0.70 it is a tenth too high.
    """
    x = 2.0 * packing
    ratio: Any = polyval(x, PADE_CONTACT) / polyval(x, PADE_DENOMINATOR)
    value: Real = ratio
    return value


def compressibility(packing: Real) -> Real:
    """Compressibility factor of hard disks: Z = P/(n T) = 1 + 2ηχ (see `contact_value`)."""
    return 1.0 + 2.0 * packing * contact_value(packing)


def structure_at_zero(packing: float) -> float:
    """S(k → 0) of hard disks, 1/P' of P = η Z(η): n T times the isothermal compressibility.

    It is also variance over mean of the number of disks in a large part of the fluid (Hansen &
    McDonald, Theory of Simple Liquids, eqs. 2.6.11 and 4.1.7). Z is that of `contact_value`.
    """
    x = 2 * packing
    return float(polyval(x, PADE_DENOMINATOR) ** 2 / polyval(x, PADE_SLOPE))


def missing_ratio(packing: float, number: float) -> float:
    """What Z lacks with exactly N balls in a periodic box: η P''/(2 N P') with P = η Z(η).

    Z is that of a mean number of balls with variance N/P'. This is the first order in 1/N of
    keeping the number, see `fluid_state`. In a dilute gas it is 2η/N: a ball meets N − 1 others.
    """
    return packing * _bending(packing) / (2 * number)


def _bending(packing: float) -> float:
    """P''/P' of P = η Z(η): with P' = 2s/g² in x = 2η it is 2(s'/s − 2g'/g)."""
    x = 2 * packing
    below = polyval(x, PADE_GROWTH) / polyval(x, PADE_DENOMINATOR)
    return float(2 * (polyval(x, PADE_BEND) / polyval(x, PADE_SLOPE) - 2 * below))


IDEAL, INFINITE, FINITE = "ideal gas law", "hard disks, N → ∞", "hard disks, finite N"
"""Names of theories of the pressure: `ideal_gas_pressure`, `granular_compressibility`, and
`fluid_state` with `FluidState.inelastic`; FINITE also of rates and of Haff's α from that state."""


@dataclass(frozen=True)
class FluidState:
    """Equilibrium of N hard disks in a container.

    pressure : force on the wall over its length, N/m; without walls that of the gas
    kinetic_pressure : its part without collisions between balls, N/m (`accessible_wall_pressure`)
    bulk_packing : packing fraction far from the walls; below N πr² over the accessible area,
        because walls attract balls
    virial_ratio : 1 + ΣJd/(2 N T t), with the impulses J of ball-ball collisions at their
        distances d; in bulk this is Z
    """

    pressure: float
    kinetic_pressure: float
    bulk_packing: float
    virial_ratio: float

    def inelastic(self, restitution: float) -> "FluidState":
        """The same places and Maxwell's speeds, with a coefficient of restitution between balls.

        An impulse between balls is (1 + e)/2 of that of elastic ones (Jenkins & Richman 1985). So
        is what collisions add to the pressure and to the virial.
        """
        weaker = (1 + restitution) / 2
        added = self.pressure - self.kinetic_pressure
        return replace(
            self,
            pressure=self.kinetic_pressure + weaker * added,
            virial_ratio=1 + weaker * (self.virial_ratio - 1),
        )


@lru_cache(maxsize=16)  # the repeats of a point have one state
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

    So far N is the mean of a fluctuating number. For exactly N balls the free energy is larger by
    T/2 ln⟨δN²⟩, where ⟨δN²⟩ is T n_b dN/dn_b over dP_b/dn_b (Lebowitz & Percus 1961). This lowers
    the force and the virial; in a dilute gas they lose 1/N of what collisions add.

    The virial of simulations is within 1 % for 37 disks in a circle at η = 0.37, 2.5 % for 19 at
    0.43, and 4.5 % for 40 in a box of 8:1 at 0.4. The pressure on elastic walls of a box is 0.4 %
    above theory for 37 disks at 0.2, and 0.6 % for 7 (``snooker bench physics``). A circle also
    keeps the balls' angular momentum: the state is an average over those of an equilibrium gas.

    Raises ValueError when a fluid of N balls does not fit.
    """
    region = container.accessible(ball_radius)
    area, edge, spreading = region.area, region.edge, region.spreading
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
    adsorbed = 2 * ball_radius * packing**2 / (1 + packing)  # over the edge, times πr²
    slope = 2 * ball_radius * packing * (2 + packing) / (1 + packing) ** 2
    room = area + slope * edge  # dN/dn_b
    bend = 4 * ball_radius / (1 + packing) ** 3 * edge / room - _bending(packing) + 1 / packing

    def of_variance(growth: float, lengthening: float) -> float:
        """Change of T/2 ln⟨δN²⟩ as the area and the edge grow, at fixed N; J."""
        thinning = (packing * growth + adsorbed * lengthening) / room
        return temperature / 2 * ((growth + slope * lengthening) / room - bend * thinning)

    force = bulk * edge - tension * spreading - of_variance(edge, spreading)
    work = 2 * bulk * area - tension * edge - of_variance(2 * area, edge)
    virial_ratio = work / (2 * number * temperature)
    ideal = ideal_gas_pressure(number, temperature, container.area)
    walls = (number, temperature, ball_radius, container)
    return FluidState(
        pressure=force / container.wall_length if container.has_wall else ideal * virial_ratio,
        kinetic_pressure=accessible_wall_pressure(*walls) if container.has_wall else ideal,
        bulk_packing=packing,
        virial_ratio=virial_ratio,
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
    near = min(PUBLISHED_RATIOS, key=lambda ratio: abs(ratio.packing - packing))
    return near if abs(near.packing - packing) <= 1e-5 else None


# Distributions of speed: Maxwell-Boltzmann, a cooling gas, and N balls at fixed energy.
#
# With walls and a fixed total energy E = N T, the 2N velocity components are uniform on a sphere,
# so v²/(2NT/m) ~ Beta(1, N − 1) for each ball, exactly. The limit of N → ∞ is Maxwell-Boltzmann. In
# a periodic box with zero total momentum, N − 1 velocities are free. Equal balls then have the law
# of N − 1 balls at the same T = E/N, because v is √(1 − 1/N) times a direction among those N − 1.


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


def maxwell_component_density(c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Maxwell's probability density of c = v_x √(m/2T)."""
    return np.asarray(np.exp(-(c**2)) / math.sqrt(math.pi))


def maxwell_component_share(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """The share of |c| between edges (*n* + 1,) by `maxwell_component_density`; (*n*,)."""
    return np.diff([math.erf(edge) for edge in edges.tolist()])


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
    scale = mass / (2 * number * temperature)
    rest = 1.0 - scale * speed * speed
    power = np.maximum(rest, 0.0) ** (number - 2)
    density: Real = 2 * (number - 1) * scale * speed * power * (rest >= 0)
    return density


def fixed_energy_speed_cdf(speed: Real, number: int, temperature: float, mass: float = 1.0) -> Real:
    """Probability of a speed below `speed` (m/s ≥ 0) for one of N ≥ 2 balls that share N T.

    1 − (1 − m v²/(2NT))^(N−1), and 1 beyond v = √(2NT/m).
    """
    fraction = np.minimum(mass * speed * speed / (2 * number * temperature), 1.0)
    with np.errstate(divide="ignore"):
        # log1p(−1) = −inf at the largest speed, where the probability is exactly one.
        probability: Real = -np.expm1((number - 1) * np.log1p(-fraction))
    return probability


def fixed_energy_component_density(c: NDArray[np.float64], number: int) -> NDArray[np.float64]:
    """Exact density of c = v_x √(m/2T) of one of N ≥ 2 balls that share the energy N T.

    c² over N is one of 2N squares with the sum 1: Γ(N)/(Γ(N − ½) √(πN)) (1 − c²/N)^(N − 3/2).
    """
    norm = math.exp(math.lgamma(number) - math.lgamma(number - 0.5)) / math.sqrt(math.pi * number)
    return np.asarray(norm * np.maximum(1 - c**2 / number, 0.0) ** (number - 1.5))


def fixed_energy_component_share(edges: NDArray[np.float64], number: int) -> NDArray[np.float64]:
    """The share of |c| between edges (*n* + 1,) by `fixed_energy_component_density`; (*n*,)."""
    from scipy import special  # takes a while to load

    below = special.betainc(0.5, number - 0.5, np.minimum(edges**2 / number, 1.0))
    return np.asarray(np.diff(below))


def fixed_energy_kurtosis(number: int) -> float:
    """⟨v⁴⟩/⟨v²⟩² of N balls at fixed energy, exact: 2N/(N + 1); 2 for Maxwell-Boltzmann."""
    return 2 * number / (number + 1)


# Rates of collisions between balls and at the wall, and mean free paths.


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


def wall_rate(mean_speed: Real, region: AccessibleRegion) -> Real:
    """Wall collisions of one ball per second in an ideal gas: ⟨v⟩ over the mean chord πA/L."""
    return mean_speed * region.edge / (math.pi * region.area)


def wall_speed_ratio(mass: float, container_mass: float) -> float:
    """Relative normal speed of a ball and a free wall over that with a fixed wall: √(1 + m/M).

    In equilibrium the normal velocity of a container of mass M has the variance T/M, that of a ball
    T/m. The balls hit the wall more often by this factor. The pressure is the same, because the
    impulse of a hit is smaller by it. It is 1 for an infinite mass.
    """
    return math.sqrt(1 + mass / container_mass)


def wall_rate_from_pressure(
    number: int, pressure: float, temperature: float, wall_length: float, mass: float = 1.0
) -> float:
    """Wall collisions of one ball per second that a pressure implies, for e_w = 1.

    ν_w = c_N W P/(N √(2π m T)): the force W·P on a wall of length W is the rate N ν_w times the
    mean impulse 2m⟨v_n²⟩/⟨v_n⟩ = √(2π m T)/c_N at fixed energy. It is exact at any density (in a
    circle on average over the angular momenta of an equilibrium gas), because in equilibrium
    positions and velocities are independent. The wall is fixed, see `wall_speed_ratio`.
    """
    force = wall_length * pressure
    impulse = math.sqrt(2 * math.pi * mass * temperature) / fixed_energy_factor(number)
    return force / (number * impulse)


def ball_ball_rate_from_virial(
    virial_ratio: float, temperature: float, ball_radius: float, free: int, mass: float = 1.0
) -> float:
    """Ball-ball collisions of one ball per second that a virial ratio Z implies, elastic.

    ω = c 4(Z − 1)√(T/(πm))/d: the impulses add ΣJd/(2 N T t) = Z − 1, and their mean is √(πmT)/c at
    fixed energy. c is the `fixed_energy_factor` of the number of free velocities, N with walls and
    N − 1 without. Like `wall_rate_from_pressure` it is exact at any density.
    """
    factor = fixed_energy_factor(free)
    thermal = math.sqrt(temperature / (math.pi * mass))
    return factor * 4 * (virial_ratio - 1) * thermal / (2 * ball_radius)


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
    √(T/πm)/(2 n d χ). For each other ball, σ is the sum of both radii, μ the reduced mass and A the
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
    terms = 2 * distance * contact * np.sqrt(2 * math.pi * reduced * temperature) / areas
    return float(np.sum(terms))


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
    number: int,
    temperature: float,
    ball_radius: float,
    container: Container,
    mass: float = 1.0,
    container_mass: float = math.inf,
) -> CollisionRates:
    """Rates of N balls at the container's mean density, and at the wall of `fluid_state`.

    Raises ValueError when a fluid of N balls does not fit.
    """
    density = number / container.area
    contact = contact_value(container.packing_fraction(number * ball_radius**2))
    wall = fluid_wall_rate(number, temperature, ball_radius, container, mass, container_mass)
    return CollisionRates(
        mean_free_path=mean_free_path(density, ball_radius, contact),
        mean_speed=fixed_energy_mean_speed(number, temperature, mass),
        ball_ball=ball_ball_rate(density, ball_radius, temperature, contact, mass),
        wall=wall,
    )


def fluid_wall_rate(
    number: int,
    temperature: float,
    ball_radius: float,
    container: Container,
    mass: float = 1.0,
    container_mass: float = math.inf,
) -> float:
    """Hits of the wall by one of N balls per second, by the pressure of `fluid_state`.

    Raises ValueError when a fluid of N balls does not fit.
    """
    pressure = fluid_state(number, temperature, ball_radius, container).pressure
    wall = wall_rate_from_pressure(number, pressure, temperature, container.wall_length, mass)
    return wall * wall_speed_ratio(mass, container_mass)


def starting_rates(scene: Scene) -> tuple[float, float]:
    """Collisions of one ball with others and with the wall at the start, 1/s, by kinetic theory.

    Unequal balls count with the means of their radii and squared speeds.
    """
    number, radius = scene.number, float(np.mean(scene.radii))
    temperature = float(np.sum(scene.velocities**2)) / (2 * number)  # of balls of 1 kg
    packing = min(float(scene.packing_fraction), DENSEST_FLUID)
    density, contact = (number - 1) / scene.container.area, contact_value(packing)
    wall = wall_rate(maxwell_mean_speed(temperature), scene.container.accessible(0))
    pairs = ball_ball_rate(density, radius, temperature, float(contact))
    return pairs, wall * float(compressibility(packing))


# Cooling of inelastic balls. Balls with Maxwell's speeds lose on average (1 − e²)T in a ball-ball
# collision and (1 − e_w²)T at the wall; at fixed energy they lose less, see `share_in_collision`.


def source_decay_constant(restitution: float, mean_free_path: float, mean_speed: Real) -> Real:
    """Decay constant of the energy by the source report (s⁻¹): k = −2 ln(e) ⟨v⟩/λ (eqs 6, 7).

    It assumes that a collision leaves e² of all energy; only the relative normal part of the motion
    loses that much. The pressure's is k/2 (eq. 9), from CoRⁿ for the momentum after n collisions.
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


CRITICAL = "container over critical length; vortices, then clusters grow above 1"
"""What a reader of L/L_c has to know."""


def critical_ratio(scene: Scene, restitution: float) -> float:
    """L/L_c: vortices and clusters grow above 1.

    L is the container's `longest_wave`, L_c is the `critical_length`.
    """
    size = scene.number, float(scene.radii[0]), scene.container
    return scene.container.longest_wave / critical_length(restitution, *size)


def haff_rate(cooling_rate: float) -> float:
    """Haff's rate (s⁻¹): α = ζ/2 with ζ at the start, because dT/dt = −ζ0 √(T/T0) T."""
    return cooling_rate / 2


def time_without_cooling(time: float, haff_rate: float) -> float:
    """Time (s) in which a gas that stays as hot as at the start has as many collisions: ln(1+αt)/α.

    A gas with Haff's rate α slows down as 1/(1 + αt).
    """
    return math.log1p(haff_rate * time) / haff_rate if haff_rate else time


def share_in_collision(components: int) -> float:
    """Mean share of the energy in the relative normal motion of a collision: 2/(n + 1).

    At fixed energy the n components of the velocities, each times √m, are uniform on a sphere. The
    relative normal motion of two balls, or of a ball and the wall, is one component in a rotated
    frame. Its energy x E has the density of Beta(½, (n − 1)/2), and collisions choose it with the
    weight √x. N balls with walls have n = 2N, so the mean is E/(N + ½); without walls n = 2N − 2.
    At a known angular momentum in a circle one component less is free: E/N of the energy above that
    of the rotation, which takes no part in collisions.
    """
    return 2 / (components + 1)


def energy_ratio_by_events(
    components: int,
    restitution: float,
    ball_ball_events: Real,
    wall_restitution: float,
    wall_events: Real,
) -> Real:
    """Energy over its start after c collisions between balls and c' with the wall.

    It is [1 − (1 − e²)s]^c [1 − (1 − e_w²)s]^c' with the `share_in_collision` s of this number of
    velocity components: the mean of collisions that do not depend on each other, at any density.
    """
    share, logarithm = share_in_collision(components), 0.0 * ball_ball_events
    for e, events in ((restitution, ball_ball_events), (wall_restitution, wall_events)):
        logarithm = logarithm + events * math.log1p(-(1 - e**2) * share)
    ratio: Real = np.exp(logarithm)
    return ratio


def has_mean_loss(law: Law) -> bool:
    """Whether `mean_loss` knows a law."""
    usable = isinstance(law, PackageLaw) and not law.problem
    return usable or isinstance(law, Constant | Viscoelastic)


def mean_loss(law: Law, temperature: Real, mass: float = 1.0, a2: float = 0.0) -> Real:
    """Mean energy that a collision of balls takes, over T: 1 − e² for one e and Maxwell's speeds.

    The normal relative speed v has the density of a flux, so that x = m v²/(4T) has e^(−x), and a
    collision has the energy x T: ∫ x e^(−x) [1 + a2 (4x² − 12x + 3)/16] [1 − e(v)²] dx. The
    polynomial is the first order in the Sonine coefficient a2; with one e it gives the 1 + 3a2/16
    of `cooling_rate`.

    Raises ValueError for a law that `has_mean_loss` does not know.
    """
    if not has_mean_loss(law):
        raise ValueError(f"no theory has the mean loss of the {law.name} law")
    loss = 1 - law.cor
    if isinstance(law, Constant):
        one: Real = loss * (2 - loss) * (1 + 3 * a2 / 16) + 0 * temperature
        return one
    # Over √x = v/unit.
    unit = 2 * np.sqrt(np.asarray(temperature) / mass)[..., np.newaxis]
    total: Any = np.zeros(np.shape(temperature))
    edges: Sequence[Any] = range(9)  # a law of a package may bend anywhere
    if isinstance(law, Viscoelastic):  # up to where e(v) becomes constant and beyond, it is smooth
        edges = 0.0, np.minimum(law.cor_speed / unit, 8.0), 8.0
    for low, high in pairwise(edges):
        roots = low + (high - low) * (_NODES + 1) / 2
        x = roots**2
        if isinstance(law, Viscoelastic):
            share = loss * np.minimum(roots * unit / law.cor_speed, 1.0) ** 0.75
        else:
            assert isinstance(law, PackageLaw)
            share = 1 - np.vectorize(law.cor_at, [float])(roots * unit)
        density = x * np.exp(-x) * (1 + a2 * (4 * x**2 - 12 * x + 3) / 16) * 2 * roots
        total += np.sum(_WEIGHTS * density * share * (2 - share) * (high - low) / 2, axis=-1)
    mean: Real = total[()]  # a number for one temperature
    return mean


_NODES, _WEIGHTS = leggauss(64)  # of integrals from −1 to 1


def cooled_temperature(
    first: NDArray[np.float64],
    time: NDArray[np.float64],
    cooling_rate: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> NDArray[np.float64]:
    """Temperatures (J) some times (s) after the first ones (J), by d ln T/dt = −ζ(T).

    cooling_rate : ζ at temperatures, 1/s
    """
    from scipy.integrate import solve_ivp  # takes time to load

    def change(_share: float, logarithms: NDArray[np.float64]) -> NDArray[np.float64]:
        """Over the share of each one's own time."""
        return -time * cooling_rate(np.exp(logarithms))

    solution = solve_ivp(change, (0.0, 1.0), np.log(first), rtol=1e-8, atol=1e-8)
    return np.asarray(np.exp(solution.y[:, -1]))


def rotation_energy(angular_momentum: float, moment_of_inertia: float) -> float:
    """Energy of a rigid rotation: L²/2I (J), the least energy of balls at these places.

    A smooth fixed circle conserves the angular momentum L about its centre, kg m²/s. I = Σmρ² is of
    the balls' centres, kg m². By Cauchy-Schwarz L² ≤ 2IE. The rotation has no normal velocities
    between balls or at the wall, so collisions do not take its energy.
    """
    return angular_momentum**2 / (2 * moment_of_inertia)


# Warm gases: balls between walls that give energy.


BALANCED = Thermal, Driven, Constant
"""Laws of walls that `balance_temperature` knows."""


def balance_temperature(
    number: int,
    ball_radius: float,
    mass: float,
    restitution: float,
    container: Container,
    walls: Sequence[tuple[Law, float]],
) -> float:
    """T of a uniform gas at which walls give as much energy as collisions take, J.

    walls : the law and the length (m) of each, as the centres of balls see them; one gives energy

    By the virial theorem the force on a wall of length L is N T Z L/A, with the accessible area A.
    A hit by a ball of Maxwell's flux, ⟨v⟩ = √(πT/2m) and ⟨v²⟩ = 2T/m, gives on average::

                  energy                                       impulse
        driven    ½m (1+e)² V² + e (1+e) m V ⟨v⟩ − (1−e²) T    (1+e) m (⟨v⟩ + V)
        thermal   3/2 (T_w − T)                                √(πm/2) (√T_w + √T)

    So a wall gives the force times energy over impulse; at e = 1 that is the force times V.
    Collisions take (1 − e²) T each, ω/2 for each ball a second (Kumaran, J. Fluid Mech. 364, 163
    (1998)). Z − 1 is (1 + e)/2 of that of elastic balls, and ω is theirs (`fluid_state`,
    `ball_ball_rate_from_virial`). T is proportional to m V², and in a dilute gas that loses little
    to [L V/((1 − e²) N d)]².

    Within 0.6 % of simulations at CoR 0.99 and 0.995 and packings of 0.01 or less (``snooker bench
    physics``). Where balls lose much of their energy on the way across, the gas is dense and cold
    in the middle, and T is too high: at CoR 0.9, for 37 balls in a circle, by 5.5 % at packing
    0.0037 and by 11.6 % at 0.059. A wall CoR of 0.8 leaves speeds far from Maxwell's (22 %).

    Raises ValueError for other laws, and when a fluid of N balls does not fit.
    """
    from scipy.optimize import brentq  # takes time to load

    if not all(isinstance(law, BALANCED) for law, _ in walls):
        raise ValueError("there is no balance of energy with this law of a wall")
    if restitution == 1 and all(law.cor == 1 for law, _ in walls):
        return math.inf
    state = fluid_state(number, 1.0, ball_radius, container)
    ratio = state.inelastic(restitution).virial_ratio
    pressure = ratio / container.accessible(ball_radius).area
    rate = ball_ball_rate_from_virial(state.virial_ratio, 1.0, ball_radius, number, mass)
    taken = (1 - restitution**2) * rate / 2

    def surplus(root: float) -> float:
        """What walls give less what collisions take, over N T, 1/s, at √T; it falls with T."""
        given = sum(length * _energy_over_impulse(law, root, mass) for law, length in walls)
        return pressure * given - taken * root

    high = 1.0
    while surplus(high) > 0:
        high *= 2
    while surplus(high / 2) < 0:
        high /= 2
    return float(brentq(surplus, high / 2, high, xtol=1e-15 * high)) ** 2


def _energy_over_impulse(law: Law, root: float, mass: float) -> float:
    """Mean energy over mean impulse of a hit in a gas of √T, m/s; see `balance_temperature`."""
    mean = root * math.sqrt(math.pi / (2 * mass))
    if isinstance(law, Thermal):
        wall = math.sqrt(law.temperature)
        return 1.5 * (wall - root) / math.sqrt(math.pi * mass / 2)
    e, speed = law.cor, law.speed if isinstance(law, Driven) else 0.0
    energy = mass * ((1 + e) * speed**2 / 2 + e * speed * mean) - (1 - e) * root**2
    return energy / (mass * (mean + speed))


def granular_compressibility(packing: Real, restitution: float) -> Real:
    """P/(n T) of a gas of inelastic disks: 1 + (1 + e) η χ.

    An impulse is (1 + e)/2 of that of elastic balls with the same velocities (Jenkins & Richman,
    Phys. Fluids 28 (1985) 3485); Z of elastic disks at e = 1.
    """
    return 1.0 + (1.0 + restitution) * packing * contact_value(packing)


SONINE_CONDUCTIVITY = 1.0296
"""Conductivity of a dilute gas of disks over its first Sonine approximation.

By the expansion to fourth order; Gass 1971 has 1.029.
"""


def thermal_conductivity(
    packing: Real, ball_radius: float, temperature: Real, mass: float = 1.0
) -> Real:
    """Conductivity of elastic disks after Enskog, 1/s with k_B = 1 (Gass 1971).

    λ = (2/d)√(T/(πm)) [s (1 + 3ηχ/2)²/χ + (4/π) η² χ], where s = `SONINE_CONDUCTIVITY` corrects
    the first Sonine approximation (J. Chem. Phys. 54, 1898). The last term is the direct transfer
    of energy between the centres of balls that collide.
    """
    contact = contact_value(packing)
    moving = SONINE_CONDUCTIVITY * (1 + 1.5 * packing * contact) ** 2 / contact
    transferred = 4 / math.pi * packing**2 * contact
    both = moving + transferred
    conductivity: Real = np.sqrt(temperature / (math.pi * mass)) / ball_radius * both
    return conductivity


def temperature_jump(
    packing: float, ball_radius: float, temperature: float, mass: float = 1.0
) -> float:
    """Jump of temperature at a thermal wall over the gradient there, m, after Maxwell.

    Balls leave the wall of T_w with 3T_w/2 each. Those that arrive bring 3T/2 of the gas, and half
    of the flux of heat q. So q = Φ 3(T_w − T)/2 + q/2 with Φ = P/√(2πmT) hits, and the jump over
    the gradient is λ √(2πmT)/(3P): 8/3 of the mean free path in a dilute gas. Solutions of the
    kinetic equation for monatomic gases have 10 to 20 % more (Loyalka 1971, for spheres).
    """
    pressure = packing / (math.pi * ball_radius**2) * temperature * float(compressibility(packing))
    conductivity = thermal_conductivity(packing, ball_radius, temperature, mass)
    return conductivity * math.sqrt(2 * math.pi * mass * temperature) / (3 * pressure)
