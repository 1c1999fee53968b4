"""Collision rates and cooling of `snooker_cli.theory` against simulation and direct quadrature."""

import math

import numpy as np
import pytest
from hypothesis import settings

from snooker_cli import containers, theory

STEADY = settings(derandomize=True, deadline=None)

# The scene of the source report: 37 balls, unit mass, 10 m/s in a circle of 10 m.
N, T, R = 37, 50.0, 10.0
AREA, PERIMETER = math.pi * R**2, 2 * math.pi * R
DENSITY = theory.number_density(N, AREA)

# Measured at e = 1 by an independent event-driven simulation: pressure over 2πR and its error,
# ball-ball and wall events per second and their errors; keyed by the ball radius.
SIMULATED = {
    1.0: ((17.18, 0.03), (240.8, 0.4), (61.11, 0.03)),
    0.1: ((5.9917, 0.0002), (10.81, 0.005), (21.30, 0.005)),
}


def digits(value: float, text: str) -> bool:
    """Whether `value` rounds to the printed number, to all of its digits."""
    return f"{value:.{len(text.partition('.')[2])}f}" == text


def test_mean_free_paths():
    assert digits(theory.boltzmann_mean_free_path(DENSITY, 1.0), "1.5010")
    chi = theory.contact_value(0.37)
    assert digits(theory.enskog_mean_free_path(DENSITY, 1.0, chi), "0.712")
    # λ ω = ⟨v⟩ ties the free path to the collision rate.
    rate = theory.ball_ball_rate(DENSITY, 1.0, T, chi)
    assert theory.enskog_mean_free_path(DENSITY, 1.0, chi) * rate == pytest.approx(
        theory.maxwell_mean_speed(T), rel=1e-14
    )
    # The report prints λ = 15.010 m, which is the Boltzmann path of r = 0.1 m …
    assert digits(theory.boltzmann_mean_free_path(DENSITY, 0.1), "15.010")
    # … while its own σ = 2πr gives neither that nor any other printed value.
    assert theory.report_mean_free_path(DENSITY, 1.0) == pytest.approx(0.9555, abs=5e-5)


def test_ball_ball_rate_of_the_report_scene():
    rate = theory.ball_ball_rate(DENSITY, 1.0, T, theory.contact_value(0.37))
    assert digits(rate, "12.45")
    assert theory.ball_ball_rate(DENSITY, 1.0, T, mass=4.0) == pytest.approx(
        theory.ball_ball_rate(DENSITY, 1.0, T) / 2
    )


def test_ideal_wall_rate_is_the_chord_rate():
    # A ball of the ideal gas flies mean chords π·area/perimeter of the accessible disk.
    assert theory.wall_rate(5.0, containers.Circle(R).accessible(1.0)) == pytest.approx(
        5.0 / (math.pi * (math.pi * 81) / (2 * math.pi * 9)), rel=1e-15
    )
    # In a box the mean of |u|/(w − 2r) + |v|/(h − 2r), with ⟨|u|⟩ = 2⟨v⟩/π for every direction.
    assert theory.wall_rate(5.0, containers.Box(20.0, 12.0).accessible(1.0)) == pytest.approx(
        2 * 5.0 / math.pi * (1 / 18 + 1 / 10), rel=1e-15
    )
    assert theory.wall_rate(5.0, containers.PeriodicBox(20.0, 12.0).accessible(1.0)) == 0


@pytest.mark.parametrize("radius", SIMULATED)
def test_wall_rate_follows_from_the_simulated_pressure(radius):
    # Rotation holds 1/(4N) of the energy on average, and how much a start has depends on its rings:
    # the mean impulse, as √T, is sure to half of that. Beside it, two standard errors.
    (pressure, pressure_error), _, (wall, wall_error) = SIMULATED[radius]
    rate = N * theory.wall_rate_from_pressure(N, pressure, T, PERIMETER)
    error = 2 * math.hypot(wall_error, rate * pressure_error / pressure)
    assert abs(rate - wall) < error + wall / (8 * N)


@pytest.mark.parametrize("radius", SIMULATED)
def test_collision_rates_of_the_report_scene(radius):
    found = theory.collision_rates(N, T, radius, containers.Circle(R))
    _, (between, _), (wall, _) = SIMULATED[radius]
    # Enskog's rate takes N for the N − 1 others of a ball, and the whole area for that which the
    # centres can reach. The wall's is as good as its pressure, to second orders of r/a and η/N, and
    # as the energy of rotation lets it be, see above.
    packing = theory.packing_fraction(N, radius, AREA)
    assert found.ball_ball == pytest.approx(2 * between / N, rel=1 / N + 2 * radius / R)
    left_out = (radius / (R - radius)) ** 2 + packing / N + 1 / (8 * N)
    assert found.wall == pytest.approx(wall / N, rel=left_out)
    assert found.mean_speed == theory.fixed_energy_mean_speed(N, T)
    contact = theory.contact_value(packing)
    assert found.mean_free_path == theory.enskog_mean_free_path(DENSITY, radius, contact)
    heavy = theory.collision_rates(N, T, radius, containers.Circle(R), mass=4.0)
    assert heavy.ball_ball == pytest.approx(found.ball_ball / 2)
    assert heavy.wall == pytest.approx(found.wall / 2)


def test_collision_rates_without_a_fluid_are_refused():
    with pytest.raises(ValueError, match="no fluid"):
        theory.collision_rates(99, T, 1.0, containers.Circle(R))


def test_wall_rates_against_simulation():
    # Simulated 1.653 /s and 0.576 /s a ball, good to a few units of the last digit.
    assert theory.wall_rate_from_pressure(N, 17.18, T, PERIMETER) == pytest.approx(1.653, abs=0.003)
    assert digits(theory.wall_rate_from_pressure(N, 5.9917, T, PERIMETER), "0.576")


def test_rates_without_ball_ball_collisions():
    # The exact wall pressure of balls that never meet gives the chord rate, and no ball-ball rate.
    pressure = theory.accessible_wall_pressure(N, T, 1.0, containers.Circle(R))
    mean_speed = theory.fixed_energy_mean_speed(N, T)
    assert theory.wall_rate_from_pressure(N, pressure, T, PERIMETER) == pytest.approx(
        theory.wall_rate(mean_speed, containers.Circle(R).accessible(1.0)), rel=1e-13
    )


def test_two_balls_have_the_impulses_of_the_four_sphere():
    # The four velocity components of two balls lie on a sphere of radius ρ = 2√T, where one
    # component has ⟨|s|⟩ = 4ρ/(3π) and ⟨s²⟩ = T; a relative one is √2 as large. Then
    # rate × impulse = force.
    mean = 8 * math.sqrt(T) / (3 * math.pi)
    force = 2 * math.pi * R * 17.0
    assert theory.wall_rate_from_pressure(2, 17.0, T, PERIMETER) == pytest.approx(
        force / (2 * 2 * T / mean), rel=1e-14
    )


def test_rates_scale_with_mass():
    light = theory.wall_rate_from_pressure(N, 17.0, T, PERIMETER)
    assert theory.wall_rate_from_pressure(N, 17.0, T, PERIMETER, mass=4.0) == pytest.approx(
        light / 2
    )


@pytest.mark.parametrize(
    ("restitution", "mean_speed", "tau", "k"),
    [(0.8, 4.23, "3.55", "0.126"), (0.9, 5.43, "2.76", "0.076")],
)
def test_report_decay_constants(restitution, mean_speed, tau, k):
    assert digits(15.010 / mean_speed, tau)
    found = theory.report_decay_constant(restitution, 15.010, mean_speed)
    assert digits(found, k)
    assert theory.report_pressure_decay_constant(found) == found / 2


def test_elastic_balls_do_not_cool():
    assert math.copysign(1, theory.report_decay_constant(1.0, 1.5, 9.0)) == 1
    assert theory.report_decay_constant(1.0, 1.5, 9.0) == 0
    assert theory.cooling_rate(1.0, 13.0, 1.0, 1.6) == 0
    assert theory.haff_ratio(5.0, 0.0) == 1
    assert theory.energy_ratio_by_events(N, 1.0, 400.0, 1.0, 100.0) == 1


def test_haff_solves_its_equation_and_starts_as_an_exponential():
    zeta = 1.6
    alpha = theory.haff_rate(zeta)
    t, step = np.linspace(0.1, 9, 50), 1e-5
    slope = (theory.haff_ratio(t + step, alpha) - theory.haff_ratio(t - step, alpha)) / (2 * step)
    # dT/dt = −ζ0 T^{3/2}; central differences err by step²·(third derivative ~ 24α³)/6.
    np.testing.assert_allclose(
        slope, -zeta * theory.haff_ratio(t, alpha) ** 1.5, rtol=1e-8, atol=1e-10
    )
    small = 1e-6
    assert theory.haff_ratio(small, alpha) == pytest.approx(
        math.exp(-zeta * small), abs=(zeta * small) ** 2
    )


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


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.99])
def test_sonine_coefficient_from_the_collision_integral(restitution):
    mu2, mu2_slope, mu4, mu4_slope = collision_moments(restitution)
    # μ4/(1 + a2) = 4 μ2 to first order in a2.
    derived = (4 * mu2 - mu4) / (mu4_slope - mu4 - 4 * mu2_slope)
    assert theory.sonine_coefficient(restitution) == pytest.approx(derived, rel=1e-9, abs=1e-12)
    # μ4 = 4 (1 + a2) μ2 to first order, as van Noije and Ernst have it, has another denominator.
    e = restitution
    theirs = 16 * (1 - e) * (1 - 2 * e**2) / (57 - 25 * e + 30 * (1 - e) * e**2)
    derived = (4 * mu2 - mu4) / (mu4_slope - 4 * mu2 - 4 * mu2_slope)
    assert theirs == pytest.approx(derived, rel=1e-9, abs=1e-12)
    # The cooling rate's correction factor 1 + 3a2/16.
    assert mu2_slope / mu2 == pytest.approx(3 / 16, rel=1e-12)


@pytest.mark.parametrize(
    ("restitution", "simulated"),
    [(0.5, 0.0729), (0.7, -0.0017), (0.8, -0.0263), (0.9, -0.0298), (0.95, -0.0211)],
)
def test_sonine_coefficient_against_direct_simulation(restitution, simulated):
    # The first approximation neglects a3: the bound is the one its docstring states.
    assert theory.sonine_coefficient(restitution) == pytest.approx(simulated, abs=0.005)


def test_sonine_coefficient_vanishes_for_elastic_disks_and_at_its_zero():
    assert theory.sonine_coefficient(1.0) == 0
    assert theory.sonine_coefficient(math.sqrt(0.5)) == pytest.approx(0, abs=1e-16)


def test_cooling_rate_by_hand():
    e, wall = 0.8, 0.9
    a2 = theory.sonine_coefficient(e)
    expected = 0.36 * 6.0 * (1 + 3 * a2 / 16) + 0.19 * 1.65
    assert theory.cooling_rate(e, 12.0, wall, 1.65) == pytest.approx(expected, rel=1e-14)
    assert theory.cooling_rate(e, 12.0) == pytest.approx(0.36 * 6.0 * (1 + 3 * a2 / 16), rel=1e-14)


@pytest.mark.parametrize(
    ("restitution", "wall", "measured", "time", "spread"),
    [
        (0.9, 0.9, 0.717, 3.38, 0.17),
        (0.9, 1.0, 0.582, 2.93, 0.15),
        (0.8, 0.8, 1.300, 6.6, 0.8),
        (0.8, 1.0, 1.067, 5.11, 0.43),
    ],
)
def test_haff_predicts_the_simulated_cooling(restitution, wall, measured, time, spread):
    between, at_wall = SIMULATED[1.0][1][0], SIMULATED[1.0][2][0]
    zeta = theory.cooling_rate(restitution, 2 * between / N, wall, at_wall / N)
    alpha = theory.haff_rate(zeta)
    # The ensembles start at equal speeds, which dissipate 8/9 and 2/3 of the Maxwellian loss at
    # first, so the fitted rate lies between that share and the full rate.
    slow = (
        8 / 9 * theory.haff_rate(theory.cooling_rate(restitution, 2 * between / N))
        + 2 / 3 * (1 - wall**2) * at_wall / N / 2
    )
    assert slow < measured < 1.01 * alpha
    # Mean over seeds of the time of event 500, within one spread of a single seed.
    # Events until t: (Γ/α) ln(1 + αt), with Γ of them per second at the start.
    predicted = math.expm1(alpha * 500.0 / (between + at_wall)) / alpha
    assert predicted == pytest.approx(time, abs=spread)


def test_energy_by_events_agrees_with_haff_in_time():
    # Both ways of counting the same Maxwellian loss: events as a function of time, then energy.
    e, alpha_rate, t = 0.9, 240.0, np.linspace(0, 8, 30)
    alpha = (1 - e**2) * alpha_rate / N / 2
    events = alpha_rate / alpha * np.log1p(alpha * t)
    by_events = theory.energy_ratio_by_events(N, e, events, 1.0, np.zeros_like(t))
    np.testing.assert_allclose(by_events, theory.haff_ratio(t, alpha), rtol=1e-13)
    # The wall's events weigh by its own restitution.
    np.testing.assert_allclose(
        theory.energy_ratio_by_events(N, 1.0, events, e, events), by_events, rtol=1e-13
    )
