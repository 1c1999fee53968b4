"""Structure of states: against random places, lattices and known velocities."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import report_scene
from scipy.spatial import Delaunay

from snooker_cli import engine
from snooker_cli.analysis import observables, structure
from snooker_cli.analysis.time_series import series
from snooker_cli.containers import Box, Circle, Container, PeriodicBox
from snooker_cli.scene import Scene

Array = NDArray[np.float64]
SHAPES = (Circle(10.0), Box(20.0, 14.0), PeriodicBox(20.0, 14.0))
SPREADS = 200


def scene(
    container: Container, positions: Array, velocities: Any = 0.0, radii: Any = 0.3, masses: Any = 1
) -> Scene:
    number = len(positions)
    full = [np.array(np.broadcast_to(values, number), dtype=float) for values in (radii, masses)]
    speeds = np.array(np.broadcast_to(velocities, (number, 2)), dtype=float)
    rest = np.zeros(2)
    return Scene(positions, speeds, *full, container, math.inf, rest, rest, 1.0, 1.0)


def value(function: structure.Observable, at: Scene, *arguments: Any) -> Any:
    return function(at.positions, at.velocities, at, *arguments)


def random_places(container: Container, radii: Array, random: np.random.Generator) -> Array:
    """Independent places that centres can reach; balls may overlap."""
    places = (random.random((len(radii), 2)) - 0.5) * container.size
    while container.has_wall and np.any(out := container.wall_gaps(places, radii) < 0):
        places[out] = (random.random((int(out.sum()), 2)) - 0.5) * container.size
    return places


def lattice(container: Container, columns: int, rows: int) -> Array:
    """A triangular lattice, periodic in a box of the width 1 and height √3/2 of each place."""
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    places = np.column_stack([(column + row % 2 / 2).ravel(), (row * math.sqrt(3) / 2).ravel()])
    return np.asarray(places - (columns / 2 - 0.25, (rows - 1) * math.sqrt(3) / 4))


# Pair correlation


@pytest.mark.parametrize("container", SHAPES, ids=lambda shape: str(shape.name))
def test_random_places_have_no_pair_correlation(container: Container) -> None:
    """χ² of g = 1 over the bins has a mean of one and a spread of √(2/bins)."""
    random = np.random.default_rng(7)
    radii = np.where(np.arange(37) < 12, 2.5, 0.4)
    rows = []
    for _ in range(SPREADS):
        at = scene(container, random_places(container, radii, random), radii=radii)
        rows.append(value(structure.pair_correlation, at, np.linspace(0, 6.9, 24)))
    deviation = (np.mean(rows, axis=0) - 1) / observables.standard_errors(np.array(rows))
    assert abs(np.mean(deviation**2) - 1) < 4 * math.sqrt(2 / 23)
    assert abs(np.mean(deviation)) < 4 / math.sqrt(23)


def test_pairs_at_a_known_distance_are_in_its_bin() -> None:
    """Two balls 3 m apart: one pair each way, over the density of one ball in the ring's area."""
    at = scene(PeriodicBox(20.0, 14.0), np.array([[9.0, 0.0], [-8.0, 0.0]]))
    found = value(structure.pair_correlation, at, np.array([0.0, 2.5, 3.5, 6.0]))
    area = math.pi * (3.5**2 - 2.5**2)
    np.testing.assert_allclose(found, [0.0, 280.0 / area, 0.0], rtol=1e-12)


# Hexatic order


def test_a_triangular_lattice_is_hexatic() -> None:
    box = PeriodicBox(10.0, 10 * math.sqrt(3) / 2)
    at = scene(box, lattice(box, 10, 10))
    orders = value(structure.bond_order, at)
    np.testing.assert_allclose(orders, 1.0, atol=1e-9)
    assert value(structure.hexatic_order, at) == pytest.approx(1, abs=1e-9)


def test_between_walls_the_outermost_balls_do_not_count() -> None:
    places = lattice(SHAPES[1], 9, 10)
    at = scene(SHAPES[1], places)
    orders = value(structure.bond_order, at)
    assert 1 < np.count_nonzero(np.isnan(orders)) < 40
    assert value(structure.hexatic_order, at) == pytest.approx(1, abs=1e-9)


def test_balls_in_a_row_have_no_neighbours_around() -> None:
    row = np.column_stack([np.linspace(-5, 5, 6), np.zeros(6)])
    assert math.isnan(value(structure.hexatic_order, scene(SHAPES[1], row)))
    assert math.isnan(value(structure.hexatic_order, scene(SHAPES[1], row[:1])))


@pytest.mark.parametrize("hole", [0.0, 22.0], ids=["even", "cluster"])
def test_neighbours_are_those_among_all_images(
    hole: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Far images are left out where they cannot change a triangle; around a hole they can."""
    triangulated: list[int] = []

    def counted(points: Array) -> Delaunay:
        triangulated.append(len(points))
        return Delaunay(points)

    monkeypatch.setattr("scipy.spatial.Delaunay", counted)
    random, box, largest = np.random.default_rng(11), PeriodicBox(60.0, 40.0), 0
    for _ in range(20):
        places = random_places(box, np.zeros(900), random)
        places = places[np.hypot(*box.nearest_image(places - (25.0, 15.0)).T) >= hole]
        at = scene(box, places)
        found = value(structure.bond_order, at)
        images = [places + np.multiply((x, y), box.size) for x in (0, -1, 1) for y in (0, -1, 1)]
        full = Delaunay(np.concatenate(images))
        first, others = full.vertex_neighbor_vertices
        for ball in range(0, len(places), 7):
            x, y = (full.points[others[first[ball] : first[ball + 1]]] - places[ball]).T
            expected = np.mean(np.exp(6j * np.arctan2(y, x)))
            assert found[ball] == pytest.approx(expected, abs=1e-12)
        largest = max(largest, triangulated[-1] / len(places))
    # Around a hole, the images nearby are not enough.
    assert (largest < 4, len(triangulated)) == ((True, 20) if hole == 0 else (False, 40))


# Velocities


def test_a2_and_temperature_of_each_species() -> None:
    """±1, ±3 m/s: ⟨v²⟩ = 5, ⟨v⁴⟩ = 41. Equal speeds: −1/2."""
    speeds = np.array([[1.0, 0], [-3.0, 0], [0, 3.0], [0, -1.0], [2.0, 0], [0, 2.0]])
    at = scene(SHAPES[0], np.zeros((6, 2)), speeds, [0.5] * 4 + [0.2] * 2, [1.0] * 4 + [3.0] * 2)
    np.testing.assert_allclose(value(structure.a2, at), [41 / 50 - 1, -0.5], rtol=1e-14)
    np.testing.assert_allclose(value(structure.species_temperature, at), [2.5, 6.0], rtol=1e-14)
    rest = replace(at, velocities=np.zeros((6, 2)))
    assert np.all(np.isnan(value(structure.a2, rest)))
    one = replace(at, masses=np.append(at.masses[:5], 4.0))
    np.testing.assert_array_equal(np.isnan(value(structure.a2, one)), [False, True, True])


def test_local_energy_is_the_temperature_without_the_flow() -> None:
    """Maxwell's speeds at T = 2, at rest and in a flow that changes slowly: Σ ½mu² = N 50."""
    random, box, number = np.random.default_rng(5), PeriodicBox(60.0, 40.0), 5000
    places = random_places(box, np.zeros(number), random)
    masses = np.where(np.arange(number) % 2 == 0, 1.0, 4.0)
    heat = random.normal(size=(number, 2)) * np.sqrt(2.0 / masses)[:, None]
    found = value(structure.local_energy, scene(box, places, heat, masses=masses))
    assert found == pytest.approx(2.0, abs=4 * 2.0 / math.sqrt(0.8 * number))
    flow = np.column_stack([np.zeros(number), 10 * np.cos(2 * math.pi * places[:, 0] / 60)])
    found = value(structure.local_energy, scene(box, places, heat + flow))
    total = float(np.mean(np.sum((heat + flow) ** 2, axis=1)) / 2)
    assert total > 25
    # A cell of 1.55 m has a range of up to 1.6 m/s: 10²·(2π/60)²/2 · 1.55²/12 · ½ = 0.055 J.
    cold = np.sum(heat**2) / 2 / number
    assert found == pytest.approx(cold + 0.055, abs=0.1)


def test_local_energy_of_one_ball_in_each_cell_is_unknown() -> None:
    at = scene(SHAPES[0], np.zeros((1, 2)), 1.0)
    assert math.isnan(value(structure.local_energy, at))


# Over time


def test_an_observable_is_measured_at_each_time() -> None:
    """In a container that moves, places are those seen from its centre."""
    trace = engine.simulate(report_scene(container_mass=50.0), collisions=200)
    times = np.linspace(0, trace.stop.time, 7)
    seen = structure.over_time(lambda x, v, at: at.container_position, trace, times)
    assert np.ptp(seen, axis=0).min() > 0.01
    energies = structure.over_time(lambda x, v, at: at.kinetic_energy, trace, times)
    columns = series(trace)
    rows = np.searchsorted(columns.time, times, side="right") - 1
    np.testing.assert_allclose(energies, columns.kinetic_energy[rows], rtol=1e-12)
    a2 = structure.over_time(structure.a2, trace, times)
    moments = columns.energy_moment[rows]
    np.testing.assert_allclose(a2[:, 0], moments / 2 - 1, rtol=1e-12, atol=1e-12)
    g = structure.over_time(structure.pair_correlation, trace, times)
    assert g.shape == (7, len(structure.distance_edges(trace.start)) - 1)
    edges = structure.distance_edges(trace.start)[1:]
    assert np.all(g[:, edges < 1.99] == 0)
