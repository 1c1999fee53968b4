"""Theory of gases with two temperatures: mixtures of two species, and balls that spin.

Units and symbols are those of ``theory``.
"""

import math

import numpy as np
from numpy.typing import NDArray

# Mixtures. Arrays have a value for each species.


def mixture_contact_values(
    densities: NDArray[np.float64], radii: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Pair distributions χ_ij of a mixture of hard disks at contact; (*s*, *s*).

    densities, radii : (*s*,) number densities n_i, m⁻², and radii r_i, m

    Jenkins & Mancini (J. Appl. Mech. 54, 27 (1987), doi:10.1115/1.3172990)::

        χ_ij = 1/(1 − η) + 9/8 · r_i r_j/(r_i + r_j) · π Σ n_k r_k/(1 − η)²        η = π Σ n_k r_k²

    For equal disks it is Henderson's (1 − 7η/16)/(1 − η)², which is within 0.05 % of
    `contact_value` up to η = 0.3, and 0.6 % above it at 0.5.
    """
    free = 1.0 - math.pi * float(densities @ radii**2)
    reduced = np.multiply.outer(radii, radii) / np.add.outer(radii, radii)
    edge = math.pi * float(densities @ radii)
    return np.asarray(1 / free + 9 / 8 * reduced * edge / free**2)


def partial_cooling_rates(
    temperatures: NDArray[np.float64],
    densities: NDArray[np.float64],
    masses: NDArray[np.float64],
    radii: NDArray[np.float64],
    restitution: float,
) -> NDArray[np.float64]:
    """Cooling rates ζ_i = −(dT_i/dt)/T_i of the species of a uniform mixture, 1/s; (*s*,).

    temperatures : (*s*,) mean kinetic energies T_i, J
    densities, masses, radii : (*s*,) number densities, m⁻²; kg; m

    A ball of species i changes its velocity by μ_ji (1 + e)(σ·g)σ in a collision with relative
    velocity g, μ_ji = m_j/(m_i + m_j). With Maxwell's velocities at T_i and T_j, σ·g has the
    variance θ² = T_i/m_i + T_j/m_j. The mean change of energy over Enskog's collisions is (Garzó &
    Dufty, Phys. Rev. E 60, 5706 (1999), doi:10.1103/PhysRevE.60.5706, equation for d dimensions in
    Garzó, Dufty & Hrenya, Phys. Rev. E 76, 031303 (2007), doi:10.1103/PhysRevE.76.031303)::

        ζ_i = 2√(2π) Σ_j n_j (r_i + r_j) χ_ij θ_ij μ_ji (1 + e)
              · [1 − (1 + e)/2 · μ_ji (1 + m_i T_j/(m_j T_i))]

    For equal balls it is `cooling_rate` without the Sonine correction, (1 − e²) ω/2. A rate may be
    negative: a species is then heated by the other.
    """
    warm = temperatures / masses
    theta = np.sqrt(np.add.outer(warm, warm))
    share = masses / np.add.outer(masses, masses)  # μ_ji in row i
    sizes = np.add.outer(radii, radii) * mixture_contact_values(densities, radii)
    left = 1 - (1 + restitution) / 2 * share * (1 + np.multiply.outer(1 / warm, warm))
    each = sizes * theta * share * (1 + restitution) * left
    return np.asarray(2 * math.sqrt(2 * math.pi) * each @ densities)


EQUAL_RATES = "equal cooling rates"
"""The name of the theory of T₁/T₂: `species_ratio`."""


def species_ratio(
    densities: NDArray[np.float64],
    masses: NDArray[np.float64],
    radii: NDArray[np.float64],
    restitution: float,
) -> float:
    """T₁/T₂ of two species in the homogeneous cooling state, where it no longer changes.

    densities, masses, radii : (2,), as of `partial_cooling_rates`

    It is where both rates are equal, ζ₁ = ζ₂ (Garzó & Dufty 1999): 1 at CoR 1, or for balls that
    differ in nothing that counts. The rate of a species rises with its own temperature, so there is
    one solution. The gas is uniform and very large, and velocities are Maxwell's, which is not
    exact: for equal numbers, masses of 4:1, radii of 2:1 and low density, direct simulation of
    Boltzmann's equation has 1.089 ± 0.002 at CoR 0.9 and 1.192 ± 0.002 at 0.8, where this gives
    1.100 and 1.212. Temperatures are relative to the flow: with the energy of vortices and
    clusters, which goes as the mass, T₁/T₂ would rise towards m₁/m₂.
    """
    from scipy.optimize import brentq  # takes time to load

    if restitution == 1:
        return 1.0

    def surplus(logarithm: float) -> float:
        """ζ₁ − ζ₂ at ln T₁/T₂, 1/s."""
        temperatures = np.array([math.exp(logarithm), 1.0])
        first, second = partial_cooling_rates(temperatures, densities, masses, radii, restitution)
        return float(first - second)

    width = 1.0
    while surplus(-width) > 0 or surplus(width) < 0:
        width *= 2
    return math.exp(brentq(surplus, -width, width, xtol=1e-14))


def temperatures_at_rest(
    temperatures: NDArray[np.float64], numbers: NDArray[np.float64], masses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Temperatures of species relative to the centre of mass of all balls, J; (*s*,).

    Independent velocities at T_i have a centre of mass that moves. Without its motion, with
    M = Σ N_k m_k, a ball of species i has T_i (1 − 2m_i/M) + m_i Σ N_k m_k T_k/M². In equilibrium
    this is T (1 − m_i/M), so that T₁/T₂ is not 1 if few balls keep their momentum.
    """
    total = float(numbers @ masses)
    common = float(numbers @ (masses * temperatures)) / total
    return np.asarray(temperatures * (1 - 2 * masses / total) + masses / total * common)


# Rough disks


MEAN_FIELD = "mean field"
"""The name of the theory of T_rot/T_tr: `rough_temperatures`."""


def rough_cooling(cor: float, tangential_cor: float, inertia: float) -> NDArray[np.float64]:
    """How collisions change both temperatures of rough disks, without friction; (2, 2).

    d(T_tr, T_rot)/dτ = M (T_tr, T_rot) over the collisions τ of a ball, with T_tr the mean energy
    of translation and T_rot twice that of rotation. With η = q(1 + β)/(2(1 + q))::

        M = ( −(1 − e²)/2 − η(1 − η)   η²/q              )
            ( 2η²/q                    −2(η/q)(1 − η/q)  )

    Velocities and spins are Maxwell's, and independent: Huthmann & Zippelius, Phys. Rev. E 56,
    R6275 (1997); Luding, Huthmann, McNamara & Zippelius, Phys. Rev. E 58, 3416 (1998), in two
    dimensions.
    """
    eta = inertia * (1 + tangential_cor) / (2 * (1 + inertia))
    given = eta * eta / inertia
    kept = eta / inertia * (1 - eta / inertia)
    lost = (1 - cor * cor) / 2 + eta * (1 - eta)
    return np.array([[-lost, given], [2 * given, -2 * kept]])


def rough_temperatures(
    collisions: NDArray[np.float64],
    start: NDArray[np.float64],
    cor: float,
    tangential_cor: float,
    inertia: float,
) -> NDArray[np.float64]:
    """T_tr and T_rot after numbers of collisions of a ball (*t*,), see `rough_cooling`; (2, *t*).

    start : (2,) both at the start, J
    """
    values, vectors = np.linalg.eig(rough_cooling(cor, tangential_cor, inertia))
    parts = np.linalg.solve(vectors, start)
    return np.asarray(vectors @ (parts[:, np.newaxis] * np.exp(np.outer(values, collisions))))


def rough_ratio(cor: float, tangential_cor: float, inertia: float) -> float:
    """T_rot/T_tr that a cooling gas of rough disks tends to, see `rough_cooling`."""
    values, vectors = np.linalg.eig(rough_cooling(cor, tangential_cor, inertia))
    slowest = vectors[:, int(np.argmax(values.real))].real
    return float(slowest[1] / slowest[0])


def heated_ratio(tangential_cor: float, inertia: float) -> float:
    """T_rot/T_tr of rough disks whose motion alone is heated, where spins gain what they lose.

    The second row of `rough_cooling` is zero at η/(1 − η/q), at any CoR.
    """
    eta = inertia * (1 + tangential_cor) / (2 * (1 + inertia))
    return eta / (1 - eta / inertia)


def sliding_tangential_cor(
    slope: NDArray[np.float64], cor: float, tangential_cor: float, friction: float, inertia: float
) -> NDArray[np.float64]:
    """The tangential CoR of two balls by friction: at most `tangential_cor`, less in oblique hits.

    slope : cot γ of the angle γ between the line of centres and the relative velocity of the
        surfaces: the approach along this line over the slip

    −1 + μ(1 + e)(1 + 1/q) cot γ: Foerster, Louge, Chang & Allia, Phys. Fluids 6, 1108 (1994).
    """
    slides = -1 + friction * (1 + cor) * (1 + 1 / inertia) * slope
    return np.minimum(tangential_cor, slides)
