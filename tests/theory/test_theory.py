"""Gas and fluid of `snooker_cli.theory` against published numbers, simulation and each other."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import optimize

from snooker_cli import containers, theory
from snooker_cli.theory import equation_of_state

STEADY = settings(derandomize=True, deadline=None)

# The scene of the source report: 37 balls, unit mass, 10 m/s in a circle of 10 m.
N, T, R = 37, 50.0, 10.0
AREA = math.pi * R**2
DENSITY = theory.number_density(N, AREA)

# Pressure over 2πR and its error at e = 1, of an independent simulation, keyed by the ball radius.
SIMULATED = {1.0: (17.18, 0.03), 0.1: (5.9917, 0.0002)}


def digits(value: float, text: str) -> bool:
    """Whether `value` rounds to the printed number, to all of its digits."""
    return f"{value:.{len(text.partition('.')[2])}f}" == text


def in_circle(number: float, radius: float) -> theory.FluidState:
    return theory.fluid_state(number, T, radius, containers.Circle(R))


def test_ideal_gas_numbers_and_round_trip():
    area = math.pi * R**2
    pressure = theory.ideal_gas_pressure(N, T, area)
    assert digits(pressure, "5.89")
    assert theory.ideal_gas_temperature(pressure, area, N) == pytest.approx(T, rel=1e-15)
    assert digits(DENSITY, "0.118")
    assert theory.packing_fraction(N, 1.0, AREA) == pytest.approx(0.37, rel=1e-15)


def test_wall_pressure_of_one_ball_is_its_momentum_flux():
    # A ball bouncing along a diameter at v: impulse 2 m v every 2a/v, over the perimeter 2πR.
    speed, radius = 3.0, 1.5
    accessible = R - radius
    circle = containers.Circle(R)
    flux = 2 * speed * speed / (2 * accessible) / (2 * math.pi * R)
    assert theory.accessible_wall_pressure(1, speed**2 / 2, radius, circle) == pytest.approx(flux)


def test_van_der_waals_is_ideal_for_points_and_infinite_at_half_packing():
    area = math.pi * R**2
    assert theory.van_der_waals_pressure(N, T, area, 0.0) == theory.ideal_gas_pressure(N, T, area)
    half = math.sqrt(0.5 * R**2 / N)
    assert theory.van_der_waals_pressure(N, T, area, 0.999 * half) > 0
    assert theory.van_der_waals_pressure(N, T, area, 1.001 * half) == math.inf


def test_van_der_waals_has_the_second_virial_coefficient():
    area, radius = math.pi * R**2, 1e-3
    eta = theory.packing_fraction(N, radius, AREA)
    z = theory.van_der_waals_pressure(N, T, area, radius) * area / (N * T)
    # Z = 1/(1 − 2η): to first order the bulk fluid's, to second 4η² against 4·0.78η².
    assert z - theory.compressibility(eta) == pytest.approx(
        4 * (1 - 0.7820044) * eta**2, rel=1e-3, abs=4e-16
    )


def test_known_virial_ratios_have_their_closed_forms():
    b3 = 4 / 3 - math.sqrt(3) / math.pi
    b4 = 2 - 9 * math.sqrt(3) / (2 * math.pi) + 10 / math.pi**2
    assert digits(b3, f"{equation_of_state.VIRIAL_RATIOS[2]:.7f}")
    assert digits(b4, f"{equation_of_state.VIRIAL_RATIOS[3]:.7f}")


@pytest.mark.parametrize(
    ("eta", "printed"),
    [
        (0.1, "1.23614"),
        (0.2, "1.57037"),
        (0.3, "2.06326"),
        (0.4, "2.82932"),
        (0.5, "4.1062"),
        (0.6, "6.456"),
    ],
)
def test_pade_values(eta, printed):
    assert digits(theory.compressibility(eta), printed)


def test_pade_reproduces_every_virial_ratio():
    # Taylor coefficients by the trapezoidal rule on a circle |x| = ρ inside the nearest pole
    # (|x| = 0.886): exact but for aliasing ρ^64 and rounding ε/ρ^9.
    rho, points = 0.5, 64
    x = rho * np.exp(2j * np.pi * np.arange(points) / points)
    p = np.polynomial.polynomial.polyval(x, equation_of_state._PADE_CONTACT)
    q = np.polynomial.polynomial.polyval(x, equation_of_state._PADE_DENOMINATOR)
    taylor = (np.fft.fft(1 + x * p / q) / points).real / rho ** np.arange(points)
    # The ratio of neighbouring Taylor coefficients aliased: (ρ/0.886)^64 < 2e-16.
    np.testing.assert_allclose(taylor[:10], equation_of_state.VIRIAL_RATIOS, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("dilution", "published"), [(2.0, 3.4243), (1.8, 4.1715), (1.6, 5.4963), (1.5, 6.6074)]
)
def test_pade_against_molecular_dynamics(dilution, published):
    # Erpenbeck & Luban 1985, V over the close-packed V0. The published Z carry a relative error of
    # about 1e-4 and the Padé's last coefficients about as much, hence 2e-4 and four digits.
    z = theory.compressibility(math.pi * math.sqrt(3) / 6 / dilution)
    assert z == pytest.approx(published, rel=2e-4)


def test_smooth_forms_fail_where_disks_order():
    # Engel et al. 2013: βPd² = 9.185405 at η = 0.700, so Z = 10.306; the docstring says "a tenth".
    published = math.pi * 9.185405 / (4 * 0.7)
    assert 1.05 < theory.compressibility(0.7) / published < 1.15


def test_contact_value_keeps_its_digits_in_a_dilute_gas():
    # χ = 1 + 2·0.782 η: no digits are lost at the smallest packing, where Z − 1 would have three.
    assert theory.contact_value(0.0) == 1
    assert theory.contact_value(1e-12) - 1 == pytest.approx(2 * 0.7820044e-12, abs=4e-16)
    eta = np.array([1e-6, 1e-3, 1e-2])
    # The next term of χ is 4·0.532 η².
    left = theory.contact_value(eta) - 1 - 2 * 0.7820044 * eta
    assert np.all(np.abs(left) <= 4 * 0.55 * eta**2 + 4e-16)


def test_pade_agrees_with_hendersons_form():
    # Henderson 1975, Z = (1 + η²/8)/(1 − η)², is within 1 % of simulations up to η = 0.6.
    eta = np.linspace(0.01, 0.6, 60)
    henderson = (1 + eta**2 / 8) / (1 - eta) ** 2
    np.testing.assert_allclose(theory.compressibility(eta), henderson, rtol=0.012)


def test_floats_give_floats_and_arrays_give_arrays():
    assert isinstance(theory.compressibility(0.3), float)
    assert theory.compressibility(np.array([0.1, 0.3])).shape == (2,)
    assert theory.contact_value(np.zeros((2, 3))).shape == (2, 3)


def test_circle_pressure_numbers():
    assert digits(in_circle(N, 1.0).pressure, "17.43")
    assert digits(in_circle(N, 0.1).pressure, "5.9927")
    # Left out are second orders in the curvature r/a, here 1/9 and 1/99, and at fixed energy 1/N of
    # the non-ideal part, which is η.
    for radius, measured in SIMULATED.items():
        eta = theory.packing_fraction(N, radius, AREA)
        left_out = (radius / (R - radius)) ** 2 + eta / N
        found = in_circle(N, radius).pressure
        assert found == pytest.approx(measured[0], rel=left_out + 2 * measured[1] / measured[0])


@STEADY
@given(
    number=st.integers(1, 10_000),
    radius=st.floats(1e-4, 5.0),
)
def test_circle_state_solves_its_own_equations(number, radius):
    accessible = R - radius
    assume(number * radius**2 < 0.99 * (R**2 - radius**2))
    found = in_circle(number, radius)

    def surplus(eta: float) -> float:
        density = eta / (math.pi * radius**2)
        wall = 2 * math.pi * accessible * density * 2 * eta * radius / (1 + eta)
        return density * math.pi * accessible**2 + wall - number

    eta = optimize.brentq(surplus, 0.0, 1.0, xtol=1e-300, rtol=1e-14)
    assert found.bulk_packing == pytest.approx(eta, rel=1e-11)
    density = eta / (math.pi * radius**2)
    wall = radius * density * eta / ((1 - eta) ** 2 * accessible)
    contact = density * theory.compressibility(eta) + wall
    assert found.accessible_pressure == pytest.approx(T * contact, rel=1e-8)
    assert found.pressure * R == pytest.approx(found.accessible_pressure * accessible, rel=1e-14)
    # The wall attracts: the bulk is emptier than the mean over the accessible area.
    assert found.bulk_packing <= number * (radius / accessible) ** 2 * (1 + 1e-14)


def test_circle_state_of_tiny_balls_is_the_ideal_one():
    ideal = theory.accessible_wall_pressure(N, T, 1e-7, containers.Circle(R))
    assert in_circle(N, 1e-7).pressure == pytest.approx(ideal, rel=1e-12)


def test_circle_line_tension_obeys_gibbs():
    # Adsorption = −dγ/dμ with dμ = dP/n and P = nT/(1 − η)², by numerical differentiation.
    radius, eta, step = 1.0, 0.3, 1e-5

    def tension(x: float) -> float:
        return -x * x / (math.pi * radius * (1 - x) ** 2)

    def pressure(x: float) -> float:
        return x / (math.pi * radius**2 * (1 - x) ** 2)

    density = eta / (math.pi * radius**2)
    slope = (tension(eta + step) - tension(eta - step)) / (
        (pressure(eta + step) - pressure(eta - step)) / density
    )
    # Central differences err by step² relative to the scale of the functions.
    assert -slope == pytest.approx(2 * density * eta * radius / (1 + eta), rel=1e-8)


@pytest.mark.parametrize(("number", "radius"), [(99, 1.0), (5, 0.0), (5, -1.0), (1, 10.0)])
def test_circle_without_room_is_refused(number, radius):
    with pytest.raises(ValueError, match="no fluid"):
        in_circle(number, radius)


def test_a_circle_s_virial_is_its_wall_s():
    """The virial theorem in a fixed circle: N T + ΣJd/2t = a F/2, with the force F on its wall."""
    for radius in (0.1, 1.0):
        found = in_circle(N, radius)
        force = found.pressure * 2 * math.pi * R
        assert found.virial_ratio * N * T == pytest.approx((R - radius) * force / 2, rel=1e-14)


@pytest.mark.parametrize("radius", [0.1, 1.0])
def test_box_forces_are_the_derivative_of_the_grand_potential(radius):
    """The work of moving one wall, and of scaling the box, at one bulk density, numerically."""
    width, height, step = 30.0, 18.0, 1e-5
    found = theory.fluid_state(N, T, radius, containers.Box(width, height))
    eta = found.bulk_packing
    density = eta / (math.pi * radius**2)
    bulk = density * T * theory.compressibility(eta)
    tension = -density * T * radius * eta / (1 - eta) ** 2

    def work(wide: float, high: float) -> float:
        across, along = wide - 2 * radius, high - 2 * radius
        return bulk * across * along - tension * 2 * (across + along)

    assert density * containers.Box(width, height).accessible(radius).area < N
    right = (work(width + step, height) - work(width - step, height)) / (2 * step)
    top = (work(width, height + step) - work(width, height - step)) / (2 * step)
    # Central differences of a form of second degree are exact but for rounding, ε·work/step.
    exact = 4e-16 * abs(work(width, height)) / step / min(right, top)
    force = 2 * (right + top)
    assert found.pressure * 2 * (width + height) == pytest.approx(force, rel=10 * exact)
    # Σ x·F of the walls: each is (w − 2r)/2 or (h − 2r)/2 from the centre.
    virial = ((width - 2 * radius) * right + (height - 2 * radius) * top) / 2
    assert found.virial_ratio * N * T == pytest.approx(virial, rel=10 * exact)


def test_tiny_balls_in_a_box_are_an_ideal_gas():
    box = containers.Box(20.0, 12.0)
    found = theory.fluid_state(N, T, 1e-7, box)
    ideal = theory.accessible_wall_pressure(N, T, 1e-7, box)
    assert found.pressure == pytest.approx(ideal, rel=1e-12)
    assert found.virial_ratio == pytest.approx(1.0, rel=1e-12)
    # One ball that flies along x at v hits each of two walls every 2(w − 2r)/v.
    along_x, along_y = 2 * 3.0**2 / 18.0, 2 * 3.0**2 / 10.0
    mean = (along_x + along_y) / 2 / box.wall_length
    assert theory.accessible_wall_pressure(1, 3.0**2 / 2, 1.0, box) == pytest.approx(
        mean, rel=1e-15
    )


@pytest.mark.parametrize("eta", [1e-6, 0.2, 0.4, 0.64])
def test_a_periodic_box_is_bulk(eta):
    width, height = 30.0, 18.0
    radius = math.sqrt(eta * width * height / (math.pi * N))
    found = theory.fluid_state(N, T, radius, containers.PeriodicBox(width, height))
    z = theory.compressibility(eta)
    assert found.bulk_packing == pytest.approx(eta, rel=1e-14)
    assert found.virial_ratio == pytest.approx(z, rel=1e-13)
    assert found.pressure == pytest.approx(N * T * z / (width * height), rel=1e-13)


def test_published_ratios_are_found_by_their_packing():
    half_of_close = math.pi / (2 * math.sqrt(3)) / 2
    assert theory.published_ratio(half_of_close).ratio == 3.4243
    found = theory.published_ratio(0.7)
    assert found.source == "Engel et al. 2013"
    assert digits(found.ratio, "10.306")
    assert theory.published_ratio(0.7 + 2e-5) is None
    assert theory.published_ratio(0.4) is None


def test_bulk_pressure_is_n_t_z():
    z = theory.compressibility(0.37)
    assert theory.bulk_pressure(N, T, 1.0, AREA) == pytest.approx(
        N * T / (math.pi * R**2) * z, rel=1e-14
    )


def test_every_public_name_exists_and_is_documented():
    for name in theory.__all__:
        value = getattr(theory, name)
        if callable(value):
            assert value.__doc__, name


def test_import_is_light():
    code = (
        "import sys, snooker_cli.theory as t; "
        "print([m for m in ('scipy', 'numba', 'matplotlib', 'h5py') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
