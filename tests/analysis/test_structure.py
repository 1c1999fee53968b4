"""Structure of states: against random places, lattices and known velocities."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import gas, report_scene
from scipy.spatial import Delaunay

from snooker_cli import engine, theory
from snooker_cli.analysis import observables, structure
from snooker_cli.analysis.time_series import series
from snooker_cli.containers import Box, Channel, Circle, Container, PeriodicBox
from snooker_cli.laws import Constant
from snooker_cli.scene import Scene

Array = NDArray[np.float64]
SHAPES = (Circle(10.0), Box(20.0, 14.0), PeriodicBox(20.0, 14.0))
SPREADS = 200

ELASTIC = Constant(1.0)


def scene(
    container: Container, positions: Array, velocities: Any = 0.0, radii: Any = 0.3, masses: Any = 1
) -> Scene:
    number = len(positions)
    full = [np.array(np.broadcast_to(values, number), dtype=float) for values in (radii, masses)]
    speeds = np.array(np.broadcast_to(velocities, (number, 2)), dtype=float)
    rest = np.zeros(2)
    return Scene(positions, speeds, *full, container, math.inf, rest, rest, ELASTIC, ELASTIC)


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
    """±1, ±3 m/s: ⟨v²⟩ = 5, ⟨v⁴⟩ = 41. Equal speeds: −1/2. In one cell without walls is no flow."""
    speeds = np.array([[1.0, 0], [-1.0, 0], [0, 3.0], [0, -3.0], [2.0, 0], [-2.0, 0]])
    at = scene(SHAPES[2], np.zeros((6, 2)), speeds, [0.5] * 4 + [0.2] * 2, [1.0] * 4 + [3.0] * 2)
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


@pytest.mark.parametrize("box", [PeriodicBox(60.0, 40.0), Box(60.0, 40.0)])
@pytest.mark.parametrize("speed", [0.0, 6.0])
def test_temperatures_of_species_are_without_the_flow(box: Container, speed: float) -> None:
    """T = 2 and 3 J of balls of 4 and 1 kg, at rest and in a flow that changes slowly."""
    random, number = np.random.default_rng(3), 6000
    masses = np.where(np.arange(number) % 2 == 0, 4.0, 1.0)
    radii, heats = np.where(masses == 4.0, 0.2, 0.1), np.where(masses == 4.0, 2.0, 3.0)
    places = random_places(box, radii, random)
    heat = random.normal(size=(number, 2)) * np.sqrt(heats / masses)[:, None]
    flow = np.column_stack([np.zeros(number), speed * np.cos(math.pi * places[:, 0] / 30)])
    at = scene(box, places, heat + flow, radii, masses)
    found = value(structure.species_temperature, at)
    # The mean of n balls' energies has the error T/√n; a cell of 1.55 m has a range of the flow,
    # whose energy is 6²·(2π/60)²/2 · 1.55²/12 · ½ = 0.02 J/kg.
    assert found == pytest.approx([2.0, 3.0], abs=4 * 3.0 / math.sqrt(number / 2) + 4 * 0.02)
    energies = masses * np.sum((heat + flow) ** 2, axis=1) / 2
    assert (energies[::2].mean() > 20) == (speed > 0)


def test_a_flow_of_one_species_changes_the_temperature_of_none() -> None:
    """Heavy balls at rest on the left, light ones that stream upwards on the right."""
    random, number, box = np.random.default_rng(6), 4000, Box(60.0, 40.0)
    masses = np.where(np.arange(number) % 2 == 0, 4.0, 1.0)
    places = random_places(box, np.full(number, 0.1), random)
    places[:, 0] = np.where(masses == 4.0, -1, 1) * np.abs(places[:, 0])
    heats = np.where(masses == 4.0, 2.0, 3.0)
    speeds = random.normal(size=(number, 2)) * np.sqrt(heats / masses)[:, None]
    speeds[:, 1] += np.where(masses == 4.0, 0.0, 20.0)
    at = scene(box, places, speeds, 0.1, masses)
    # Both share the column of cells in the middle, one of 39, with up to 20²/8 J for each kg.
    found = value(structure.species_temperature, at)
    expected, error = [2.0, 3.0], 4 * 3.0 / math.sqrt(number / 2)
    assert np.all(found > 0)
    assert found == pytest.approx(expected, abs=error + 4 * 50 / 39)


def test_the_temperature_of_one_ball_is_its_energy() -> None:
    """Relative to the few balls of its cell it would be a difference, and often negative."""
    random, masses = np.random.default_rng(7), np.repeat([10.0, 1.0], [1, 300])
    box, radii = Box(60.0, 40.0), np.repeat([1.0, 0.1], [1, 300])
    at = scene(box, random_places(box, radii, random), random.normal(size=(301, 2)), radii, masses)
    heavy, light = value(structure.species_temperature, at)
    energies = masses * np.sum(at.velocities**2, axis=1) / 2
    assert heavy == pytest.approx(energies[0], rel=1e-14)
    assert light == pytest.approx(energies[1:].mean(), rel=1e-14)


def test_a_common_drift_is_no_temperature_of_species() -> None:
    """A gas with a common velocity is the same gas."""
    random, masses = np.random.default_rng(4), np.repeat([4.0, 1.0], 100)
    box, radii = PeriodicBox(30.0, 20.0), np.repeat([0.3, 0.2], 100)
    places, speeds = random_places(box, radii, random), random.normal(size=(200, 2))
    at_rest, adrift = (scene(box, places, speeds + v, radii, masses) for v in (0.0, 1000.0))
    pair = [value(structure.species_temperature, at) for at in (at_rest, adrift)]
    np.testing.assert_allclose(*pair, rtol=1e-9)


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


# --- density in cells -------------------------------------------------------------------------


def test_independent_points_are_poisson() -> None:
    """At a fixed number of points variance over mean is 1 − 1/M; its error is √(2/M)."""
    places = np.random.default_rng(5).uniform(-50, 50, (40_000, 2))
    found = value(structure.density_fluctuation, scene(PeriodicBox(100, 100), places))
    cells = 45**2  # of 20 balls: √2000 a side
    assert abs(found - (1 - 1 / cells)) < 4 * math.sqrt(2 / cells)
    circle = places[np.hypot(*places.T) < 50]
    found = value(structure.density_fluctuation, scene(Circle(50), circle))
    assert abs(found - 1) < 4 * math.sqrt(2 / (len(circle) / 20 * 0.9))


def test_cells_of_25_balls_are_not_large() -> None:
    """At a packing of 0.4 Monte Carlo gives 0.195, 31 % above S(0). Errors are of 20 parts."""
    trace = engine.simulate(gas("periodic", 900, 0.4), collisions=120_000)
    times = np.linspace(0.05, 1.0, 400) * trace.stop.time
    counts = partial(structure.density_fluctuation, balls_in_cell=25.0)
    parts = structure.over_time(counts, trace, times).reshape(20, -1).mean(axis=1)
    mean, error = observables.mean_and_error(parts)
    limit = theory.structure_at_zero(0.4)
    assert mean > limit + 4 * error
    assert abs(mean - 1.31 * limit) < 4 * error


def test_fluctuation_of_known_cells() -> None:
    """Cells with 3, 1, 0 and 0 balls: the mean is 1, and the variance 6/4."""
    places = np.array([(-1.0, -1.0), (-0.5, -1.5), (-1.5, -0.5), (1.0, 1.0)])
    at = scene(PeriodicBox(4, 4), places)
    assert value(structure.density_fluctuation, at, 1.0) == 1.5
    assert math.isnan(value(structure.density_fluctuation, at, 4.0))


@pytest.mark.parametrize(
    ("container", "error"), [(PeriodicBox(20, 14), 0.006), (Circle(10), 0.016)]
)
def test_local_packings_share_out_the_container(container: Container, error: float) -> None:
    """Each cell has its balls' area over its packing; e⁻⁵ of cells of 5 balls are empty.

    The errors are four deviations of this number; those of cells at a curved wall add 1 %.
    """
    places = np.random.default_rng(3).uniform(-10, 10, (20_000, 2))
    inside = places[container.wall_gaps(places, np.zeros(len(places))) >= 0]
    at = scene(container, inside, radii=0.01)
    packing = value(structure.local_packing, at)
    areas = math.pi * at.radii**2 / packing
    assert math.isclose(float(areas.sum()), container.area * (1 - math.exp(-5)), rel_tol=error)
    x = inside[:, 0]
    halves = scene(container, inside[(x < 0) | (np.arange(len(x)) % 2 == 0)], radii=0.01)
    dense = value(structure.local_packing, halves)
    left, right = (
        dense[side].mean() for side in (halves.positions[:, 0] < -1, halves.positions[:, 0] > 1)
    )
    assert 1.5 < left / right < 2.0


# --- clusters ---------------------------------------------------------------------------------


def test_clusters_are_linked_by_gaps_across_the_edge_too() -> None:
    """Gaps of 0.1 m, and of 0.3 m to the last ball; one pair is at both ends of the box."""
    places = np.array([(-9.8, 0.0), (9.1, 0.0), (0.0, 0.0), (1.1, 0.0), (2.2, 0.0), (3.5, 0.0)])
    for container, sizes in ((PeriodicBox(20, 20), [3, 2, 1]), (Box(20, 20), [3, 1, 1, 1])):
        at = scene(container, places, radii=0.5)
        assert value(structure.cluster_sizes, at, 0.101).tolist() == sizes
        mean, largest = value(structure.mean_cluster, at, 0.101)
        assert (mean, largest) == (sum(size**2 for size in sizes) / 6, 3)
        assert value(structure.cluster_sizes, at, 0.0).tolist() == [1] * 6
    assert value(structure.cluster_sizes, at, 0.31).tolist() == [4, 1, 1]
    with pytest.raises(ValueError, match="gap"):
        value(structure.cluster_sizes, at, -0.1)


def test_clusters_of_independent_points() -> None:
    """Σs²/N is 1 + q + q² 3√3/(4π) with q = N π d²/A links of a point, up to q³.

    Over two links a point reaches q² others, and a share 1 − 3√3/(4π) of these directly too.
    """
    number, side, gap = 40_000, 1000.0, 1.0
    q = number * math.pi * gap**2 / side**2
    places = np.random.default_rng(8).uniform(-side / 2, side / 2, (number, 2))
    mean, _ = value(
        structure.mean_cluster, scene(PeriodicBox(side, side), places, radii=0.25), gap / 2
    )
    expected = 1 + q + q**2 * 3 * math.sqrt(3) / (4 * math.pi)
    pairs = number * q / 2
    assert abs(mean - expected) < 4 * 2 * math.sqrt(pairs) / number * 1.5 + q**3


# --- structure factor -------------------------------------------------------------------------


def test_independent_points_have_a_structure_factor_of_one() -> None:
    """|Σ exp(−ik·r)|²/N of a wave is exponential: its deviation is 1."""
    places = np.random.default_rng(2).uniform(-10, 10, (5000, 2))
    at = scene(PeriodicBox(20, 20), places, radii=0.05)
    chosen = structure.waves(at)
    s, waves = value(structure.structure_factor, at, chosen), np.bincount(chosen.bins)
    assert np.all(np.abs(s - 1) < 5 / np.sqrt(waves) + 10 / waves)
    whole = (s * waves).sum() / waves.sum()
    assert abs(whole - 1) < 4 / math.sqrt(waves.sum())


def test_a_lattice_has_peaks_of_n_balls() -> None:
    x, y = np.meshgrid(np.arange(10.0), np.arange(10.0))
    at = scene(PeriodicBox(10, 10), np.column_stack([x.ravel(), y.ravel()]) - 4.9, radii=0.3)
    peak = np.array([[2 * math.pi, 0.0], [0.2 * math.pi, 0.0], [2 * math.pi, 2 * math.pi]])
    chosen = structure.Waves(peak, np.arange(3), np.hypot(*peak.T))
    assert np.allclose(value(structure.structure_factor, at, chosen), [100, 0, 100])


def test_waves_fit_the_sides_that_repeat() -> None:
    balls = np.array([(0.0, 0.0), (3.0, 3.0)])
    channel = structure.waves(scene(Channel(10, 20), balls, radii=0.5))
    assert not channel.vectors[:, 0].any()
    turns = channel.vectors[:, 1] * 20 / (2 * math.pi)
    assert np.allclose(turns, np.rint(turns))
    assert len(np.unique(turns)) == len(turns)
    with pytest.raises(ValueError, match="walls"):
        structure.waves(scene(Circle(10), balls, radii=0.5))


@pytest.mark.parametrize("packing", [0.1, 0.4])
def test_long_waves_of_a_fluid_have_the_compressibility(packing: float) -> None:
    """S(k → 0) = 1/P' of the equation of state; at kd < 0.3 the next term of k² is below 3 %."""
    at = gas("periodic", 900, packing)
    fastest = math.sqrt(2 * 50.0)
    times = (50 + np.arange(200)) * at.container.size[0] / fastest
    trace = engine.simulate(at, time=float(times[-1]), summary=True, snapshots=times)
    chosen = structure.waves(at)
    rows = structure.over_time(
        partial(structure.structure_factor, chosen=chosen), trace, trace.snapshots.time
    )
    long = chosen.numbers * 2.0 < 0.3
    waves = np.bincount(chosen.bins)[long]
    each = rows[:, long] @ waves / waves.sum()
    error = each.std(ddof=1) / math.sqrt(len(each))
    expected = theory.structure_at_zero(packing)
    assert abs(each.mean() - expected) < 4 * error + 0.03 * expected
