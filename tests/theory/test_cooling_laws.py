"""Cooling laws against simulation, direct quadrature and each other."""

import math

import numpy as np
import pytest
from source_scene import N, T, digits

from snooker_cli import theory
from snooker_cli.containers import PeriodicBox


@pytest.mark.parametrize(
    ("restitution", "mean_speed", "tau", "k"),
    [(0.8, 4.23, "3.55", "0.126"), (0.9, 5.43, "2.76", "0.076")],
)
def test_source_decay_constants(restitution, mean_speed, tau, k):
    assert digits(15.010 / mean_speed, tau)
    assert digits(theory.source_decay_constant(restitution, 15.010, mean_speed), k)


def test_elastic_balls_do_not_cool():
    assert math.copysign(1, theory.source_decay_constant(1.0, 1.5, 9.0)) == 1
    assert theory.source_decay_constant(1.0, 1.5, 9.0) == 0
    assert theory.cooling_rate(1.0, 13.0, 1.0, 1.6) == 0
    assert theory.haff_ratio(5.0, 0.0) == 1
    assert theory.energy_ratio_by_events(2 * N, 1.0, 400.0, 1.0, 100.0) == 1


def test_haff_solves_its_equation():
    zeta, step = 1.6, 1e-5
    alpha, t = theory.haff_rate(zeta), np.linspace(0.1, 9, 50)
    slope = (theory.haff_ratio(t + step, alpha) - theory.haff_ratio(t - step, alpha)) / (2 * step)
    # dT/dt = −ζ0 T^{3/2}; central differences err by step²·(third derivative ~ 24α³)/6.
    expected = -zeta * theory.haff_ratio(t, alpha) ** 1.5
    np.testing.assert_allclose(slope, expected, rtol=1e-8, atol=1e-10)


def collision_moments(restitution: float) -> tuple[float, float, float, float]:
    """μ2 and μ4 of disks with f = π⁻¹exp(−c²)[1 + a2 S2(c²)]: constant and linear parts in a2.

    Direct quadrature of −½∫∫f f (g·σ) Δ(c1^p + c2^p) with σ along x, exact for polynomials:
    c1,2 = G ± g/2 with weights exp(−2G² − g²/2), and g_x ≥ 0 enters only as u = g_x²/2.
    """
    nodes, weights = np.polynomial.hermite.hermgauss(10)
    u, u_weights = np.polynomial.laguerre.laggauss(8)
    gx, gy, tangential, half = np.meshgrid(
        nodes / math.sqrt(2), nodes / math.sqrt(2), nodes * math.sqrt(2), u, indexing="ij"
    )
    weight = np.einsum("i,j,k,l->ijkl", weights, weights, weights, u_weights) / math.sqrt(2)
    normal = np.sqrt(2 * half)

    def squares(relative: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (
            (gx + relative / 2) ** 2 + (gy + tangential / 2) ** 2,
            (gx - relative / 2) ** 2 + (gy - tangential / 2) ** 2,
        )

    before, after = squares(normal), squares(-restitution * normal)
    sonine = sum(c * c / 2 - 2 * c + 1 for c in before)
    loss2 = sum(before) - sum(after)
    loss4 = sum(c**2 for c in before) - sum(c**2 for c in after)
    mu2, mu4 = loss2 * weight / math.pi, loss4 * weight / math.pi
    return tuple(float(np.sum(x)) for x in (mu2, mu2 * sonine, mu4, mu4 * sonine))


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
def test_sonine_coefficient_from_the_collision_integral(restitution):
    mu2, mu2_slope, mu4, mu4_slope = collision_moments(restitution)
    # μ4/(1 + a2) = 4 μ2 to first order in a2.
    derived = (4 * mu2 - mu4) / (mu4_slope - mu4 - 4 * mu2_slope)
    assert theory.sonine_coefficient(restitution) == pytest.approx(derived, rel=1e-9, abs=1e-12)
    # The cooling rate's correction factor 1 + 3a2/16.
    assert mu2_slope / mu2 == pytest.approx(3 / 16, rel=1e-12)


def test_energy_by_events_agrees_with_haff_in_time():
    # Both ways of counting the same loss: events as a function of time, then energy.
    e, rate, t = 0.9, 240.0, np.linspace(0, 8, 30)
    alpha = -math.log1p(-(1 - e**2) / (N + 0.5)) * rate / 2
    events, none = rate / alpha * np.log1p(alpha * t), np.zeros_like(t)
    for found in (
        theory.energy_ratio_by_events(2 * N, e, events, 1.0, none),
        theory.energy_ratio_by_events(2 * N, 1.0, none, e, events),
    ):
        np.testing.assert_allclose(found, theory.haff_ratio(t, alpha), rtol=1e-12)


@pytest.mark.parametrize("components", [3, 74])
def test_share_of_a_collision_in_the_energy(components):
    """The mean of x with the weight √x, over random directions in as many dimensions."""
    draws = np.random.default_rng(components).standard_normal((100_000, components))
    x = draws[:, 0] ** 2 / np.sum(draws**2, axis=1)
    share = np.sum(x**1.5) / np.sum(np.sqrt(x))
    error = np.std((x - share) * np.sqrt(x)) / np.mean(np.sqrt(x)) / math.sqrt(len(x))
    assert share == pytest.approx(theory.share_in_collision(components), abs=4 * error)


def test_rotation_energy():
    # Balls that all circle at a with one speed have no other energy.
    speed, mass = 4.0, 3.0
    energy = N * mass * speed**2 / 2
    found = theory.rotation_energy(N * mass * 9.0 * speed, N * mass * 9.0**2)
    assert found == pytest.approx(energy, rel=1e-15)
    # Random directions: ⟨L²⟩ = I T, so the rotation has the energy of one component, E0/(2N).
    inertia = N * 9.0**2 / 2
    typical = math.sqrt(inertia * T)
    assert theory.rotation_energy(typical, inertia) == pytest.approx(T / 2, rel=1e-15)


@pytest.mark.parametrize("restitution", [0.99, 0.999, 0.9999])
def test_the_critical_length_of_a_dilute_gas(restitution):
    """10.03 λ/√(1 − e²) where density and a2 vanish; a2 is 3/16·16(1 − e)/32 of ζ for e → 1."""
    box = PeriodicBox(1e3, 1e3)
    path = theory.mean_free_path(100 / box.area, 1e-3)
    found = theory.critical_length(restitution, 100, 1e-3, box) / path
    leading = 4 * math.sqrt(2 * math.pi)
    assert round(leading, 2) == 10.03
    reduced = found * math.sqrt(1 - restitution**2)
    assert reduced == pytest.approx(leading, rel=0.1 * (1 - restitution))
    assert theory.critical_length(1.0, 100, 1e-3, box) == math.inf


@pytest.mark.parametrize("packing", [0.01, 0.2, 0.5])
def test_the_viscosity_of_the_critical_length_is_enskogs(packing):
    """Kinetic (1 + ηχ)²/χ and collisional part, half of the bulk viscosity (Enskog).

    The bulk viscosity is (π/2) n²d³χ √(mT/π): the pressure nT·2ηχ = (π/2) n²d²χ m⟨g_n²⟩, ⟨g_n²⟩ =
    T/m over approaching pairs, changes by 2⟨g_n⟩d ∇·u/2 = √(T/πm) d ∇·u in a dilation.
    """
    box, radius, e = PeriodicBox(10.0, 10.0), 0.1, 0.9
    number = packing * box.area / (math.pi * radius**2)
    density, chi, d = number / box.area, theory.contact_value(packing), 2 * radius
    dilute = 1 / (2 * d * math.sqrt(math.pi))
    bulk = math.pi / 2 * density**2 * d**3 * chi / math.sqrt(math.pi)
    viscosity = (dilute * (1 + packing * chi) ** 2 / chi + bulk / 2) / density
    rate = theory.cooling_rate(e, theory.ball_ball_rate(density, radius, 1.0, chi))
    wave = 2 * math.pi / theory.critical_length(e, number, radius, box)
    assert viscosity * wave**2 == pytest.approx(rate / 2, rel=1e-12)
