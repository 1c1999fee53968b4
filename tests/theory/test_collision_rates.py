"""Collision rates and mean free paths against simulation, printed numbers and each other."""

import math

import numpy as np
import pytest
from source_scene import CIRCLE, DENSITY, SIMULATED, N, R, T, digits, packing

from snooker_cli import theory
from snooker_cli.containers import Box, PeriodicBox
from snooker_cli.theory import friction, wall_rate_from_pressure

PERIMETER = CIRCLE.wall_length


def test_mean_free_paths():
    assert digits(theory.mean_free_path(DENSITY, 1.0), "1.5010")
    contact = theory.contact_value(0.37)
    path = theory.mean_free_path(DENSITY, 1.0, contact)
    assert digits(path, "0.712")
    # λ ω = ⟨v⟩ relates the free path to the collision rate.
    rate = theory.ball_ball_rate(DENSITY, 1.0, T, contact)
    assert path * rate == pytest.approx(theory.maxwell_mean_speed(T), rel=1e-14)
    assert digits(rate, "12.45")
    slow = theory.ball_ball_rate(DENSITY, 1.0, T, contact, mass=4.0)
    assert slow == pytest.approx(rate / 2, rel=1e-15)
    # The source report prints λ = 15.010 m, which is Boltzmann's path of r = 0.1 m. Its own
    # σ = 2πr gives none of its printed values.
    assert digits(theory.mean_free_path(DENSITY, 0.1), "15.010")
    assert theory.source_mean_free_path(DENSITY, 1.0) == pytest.approx(0.9555, abs=5e-5)


def test_ideal_wall_rate_is_the_chord_rate():
    # The mean chord is π·area/edge of the accessible region, in a circle πa/2.
    rate = theory.wall_rate(5.0, CIRCLE.accessible(1.0))
    assert rate == pytest.approx(5.0 / (math.pi * 9 / 2), rel=1e-15)
    # In a box the mean of |u|/(w − 2r) + |v|/(h − 2r), with ⟨|u|⟩ = 2⟨v⟩/π for every direction.
    rate = theory.wall_rate(5.0, Box(20.0, 12.0).accessible(1.0))
    assert rate == pytest.approx(2 * 5.0 / math.pi * (1 / 18 + 1 / 10), rel=1e-15)
    assert theory.wall_rate(5.0, PeriodicBox(20.0, 12.0).accessible(1.0)) == 0


def test_wall_rate_without_ball_ball_collisions_is_the_chord_rate():
    pressure = theory.accessible_wall_pressure(N, T, 1.0, CIRCLE)
    speed = theory.fixed_energy_mean_speed(N, T)
    chords = theory.wall_rate(speed, CIRCLE.accessible(1.0))
    found = wall_rate_from_pressure(N, pressure, T, PERIMETER)
    assert found == pytest.approx(chords, rel=1e-13)


@pytest.mark.parametrize("radius", SIMULATED)
def test_collision_rates_of_the_source_scene(radius):
    found = theory.collision_rates(N, T, radius, CIRCLE)
    _, (between, _), (wall, _) = SIMULATED[radius]
    # Enskog's rate takes N for the N − 1 others of a ball, and the whole area for the accessible
    # one. The rate at the wall is as good as its pressure, to second orders of r/a and η/N, and as
    # the energy of rotation, see above.
    assert found.ball_ball == pytest.approx(2 * between / N, rel=1 / N + 2 * radius / R)
    left_out = (radius / (R - radius)) ** 2 + packing(radius) / N + 1 / (8 * N)
    assert found.wall == pytest.approx(wall / N, rel=left_out)
    assert found.mean_speed == theory.fixed_energy_mean_speed(N, T)
    path = theory.mean_free_path(DENSITY, radius, theory.contact_value(packing(radius)))
    assert found.mean_free_path == pytest.approx(path, rel=1e-14)
    heavy = theory.collision_rates(N, T, radius, CIRCLE, mass=4.0)
    assert heavy.ball_ball == pytest.approx(found.ball_ball / 2, rel=1e-14)
    assert heavy.wall == pytest.approx(found.wall / 2, rel=1e-14)


def test_friction_of_a_ball_like_all_others():
    """D = T/ζ = √(T/πm)/(2 n d χ), with Henderson's χ and N − 1 others."""
    number, temperature, radius, mass = 5000, 3.0, 0.1, 2.0
    box = PeriodicBox(30.0, 20.0)
    found = friction(7, np.full(number, mass), np.full(number, radius), temperature, box)
    packing = box.packing_fraction(number * radius**2)
    chi = (1 - 7 * packing / 16) / (1 - packing) ** 2
    density = (number - 1) / 600
    known = math.sqrt(temperature / (math.pi * mass)) / (2 * density * 2 * radius * chi)
    assert temperature / found == pytest.approx(known, rel=1e-12)


def test_friction_of_a_heavy_ball_is_the_mean_drag_of_collisions():
    """Force on a ball with a small drift by the integral over impulses, in a dilute gas."""
    mass, other, temperature, drift = 50.0, 2.0, 3.0, 1e-3
    masses, radii = np.array([mass, other]), np.array([1.0, 0.2])
    box = PeriodicBox(1e3, 1e3)
    reduced = mass * other / (mass + other)
    width = math.sqrt(temperature / reduced)
    speeds = np.linspace(0, 12 * width, 4001)
    angles = (np.arange(720) + 0.5) * (2 * math.pi / 720)
    normal = np.exp(-((speeds - drift * np.cos(angles)[:, None]) ** 2) / (2 * width**2))
    normal /= math.sqrt(2 * math.pi) * width
    impulses = np.trapezoid(2 * reduced * speeds**2 * normal, speeds, axis=1)
    force = 1.2 * np.sum(impulses * np.cos(angles)) * (2 * math.pi / 720) / 1e6
    assert friction(0, masses, radii, temperature, box) == pytest.approx(force / drift, rel=1e-4)


def test_a_light_container_meets_its_balls_more_often() -> None:
    assert theory.wall_speed_ratio(1.0, 1.0) == pytest.approx(math.sqrt(2))
    assert theory.wall_speed_ratio(1.0, math.inf) == 1
