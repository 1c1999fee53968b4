"""Positions and velocities at one time -> pair and density structure, clusters, a2, local energy.

An observable is a function of (positions, velocities, scene): (*N*, 2) arrays, m and m/s, and the
scene at that time. `over_time` follows one. Positions are those of the scene's container,
in a periodic box of the images inside it.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import facts, two_temperatures
from snooker_cli.engine import States, replayed
from snooker_cli.neighbours import near, near_pairs
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

if TYPE_CHECKING:
    from scipy.spatial import Delaunay  # takes half a second to load

Array: TypeAlias = NDArray[np.float64]
Observable: TypeAlias = Callable[[Array, Array, Scene], Any]

BINS_OF_DIAMETER, DIAMETERS = 20, 6.0
"""Bins of the pair correlation for each diameter at most, and the diameters that it reaches."""

BINS_OF_AREA = 10.0
"""Such bins are at most this times the balls' number and packing, so that each has some pairs."""

BALLS_IN_CELL = 5.0  # balls of a cell on average, over which the flow is averaged
FEWEST_OF_SPECIES = 25
"""Balls of each species from which on their temperatures are relative to cells: the error of a few
balls would be larger than what the flow adds."""

NEARBY = 4.0  # mean spacings from a periodic box, up to which images are triangulated at first
ROWS = 1024  # balls whose rings are computed at once, which limits the memory

CLUSTER_GAP = 0.1  # mean diameters between balls of a cluster, at most, unless another gap is given

DENSITY_BALLS = 20.0  # balls of a cell on average, over which the density is measured
SAMPLES = 8  # points along each side of a cell that decide how much of it is in the container

LARGEST_WAVE_NUMBER = 20.0  # over the mean diameter; the first peak of a fluid is near 2π
WAVE_NUMBERS, WAVES = 60, 24  # bins of wave numbers, and waves of each at most
MOST_TERMS, FEWEST_WAVES = 100_000_000, 3  # balls times waves of a state, which take a second


def over_time(function: Observable, trace: Trace, times: Array) -> Array:
    """An observable at times (*t*,), s; (*t*, ...). Raises ``ValueError`` as ``replay`` does."""
    found = (of_states(function, trace.start, states) for states in replayed(trace, times))
    return np.array(list(chain.from_iterable(found)), dtype=np.float64)


def of_states(function: Observable, start: Scene, states: States) -> Iterator[Any]:
    """An observable of each state of a repeat that began with ``start``."""
    columns = states.positions, states.velocities
    centres = states.container_position, states.container_velocity
    for x, v, centre, speed in zip(*columns, *centres, strict=True):
        moved = {"container_position": centre, "container_velocity": speed}
        yield function(x, v, replace(start, positions=x, velocities=v, **moved))


def distance_edges(scene: Scene) -> Array:
    """Edges of the bins of `pair_correlation`, m, from 0; contact of mean balls is an edge.

    They reach to half of the container's shorter side at most. Fewer and wider bins in a thin gas.
    """
    diameter = 2 * float(np.mean(scene.radii))
    half = min(scene.container.size) / 2 * (1 - 1e-9)  # images are apart
    reach = min(DIAMETERS * diameter, half)
    parts = int(BINS_OF_AREA * scene.number * scene.packing_fraction)
    parts = min(max(parts, 1), BINS_OF_DIAMETER)
    return np.arange(int(reach * parts / diameter) + 1, dtype=np.float64) * (diameter / parts)


def pair_correlation(
    positions: Array, velocities: Array, scene: Scene, edges: Array | None = None
) -> Array:
    """Pair correlation g(r) in bins of the distance; (*k*,), 1 for balls at random places.

    edges : (*k* + 1,), m, within half of the shorter side of a periodic box [`distance_edges`]

    Pairs over those expected at random places: for each ball the others' mean density times the
    area of its ring that their centres can reach. nan in bins that no pair can reach. A density
    that varies in space, as near a wall, also changes g.
    """
    edges = distance_edges(scene) if edges is None else edges
    container, places = scene.container, positions - scene.container_position
    counts = np.zeros(len(edges) - 1)
    for i, j, distances in near(places, places, float(edges[-1]), container.period):
        counts += np.histogram(distances[i != j], edges)[0]
    # Gauss's rule integrates each bin's rings, 2πr dr.
    nodes, weights = np.polynomial.legendre.leggauss(3)
    rings = np.add.outer((edges[1:] + edges[:-1]) / 2, np.zeros(3))
    rings = rings + np.outer(np.diff(edges) / 2, nodes)
    areas = 2 * math.pi * rings * np.outer(np.diff(edges) / 2, weights)
    expected = np.zeros_like(counts)
    for radius in np.unique(scene.radii):
        alike = scene.radii == radius
        density = (np.count_nonzero(alike) - alike) / container.accessible(float(radius)).area
        for k in range(0, len(places), ROWS):
            shares = container.ring_shares(places[k : k + ROWS], rings.ravel(), float(radius))
            reached = (density[k : k + ROWS] @ shares).reshape(rings.shape)
            expected += np.sum(reached * areas, axis=1)
    return np.asarray(counts / np.where(expected > 0, expected, math.nan))


def bond_order(positions: Array, velocities: Array, scene: Scene) -> NDArray[np.complex128]:
    """ψ6 of each ball: the mean of exp(6iθ) over the directions θ of its neighbours; (*N*,).

    Neighbours share an edge of the Delaunay triangulation (Nelson & Halperin 1979). nan for balls
    on the convex hull between walls, which have neighbours on one side only, and for all balls of a
    scene without a triangle.
    """
    from scipy.spatial import Delaunay, QhullError

    number, period = scene.number, scene.container.period
    orders = np.full(number, complex(math.nan, math.nan))
    try:
        triangles = Delaunay(positions) if period is None else _triangles(positions, scene)
    except (QhullError, ValueError):
        return orders
    places = triangles.points
    first, others = triangles.vertex_neighbor_vertices
    counts, bonds = np.diff(first[: number + 1]), others[: first[number]]
    x, y = (places[bonds] - np.repeat(places[:number], counts, axis=0)).T
    if np.all(counts > 0):
        orders = np.add.reduceat(np.exp(6j * np.arctan2(y, x)), first[:number]) / counts
    if period is None:
        orders[np.unique(triangles.convex_hull)] = complex(math.nan, math.nan)
    return orders


def _triangles(positions: Array, scene: Scene) -> "Delaunay":
    """The triangulation of a periodic box and of the images around it; the box comes first.

    Images nearby are enough if those beyond cannot change a triangle of the box: its circumcircle
    lies where all images are. Else they reach as far as half a box.
    """
    from scipy.spatial import Delaunay

    size = np.array(scene.container.size)
    shifts = np.array([(x, y) for x in (0, -1, 1) for y in (0, -1, 1)]) * size
    images = (positions - scene.container_position + shifts[:, None]).reshape(-1, 2)
    reach = NEARBY * math.sqrt(scene.container.area / scene.number)
    for edge in (np.minimum(size / 2 + reach, size), size):
        triangles = Delaunay(images[np.all(np.abs(images) <= edge, axis=1)])
        own = np.any(triangles.simplices < scene.number, axis=1)
        # Triangles are faces of a hull on the paraboloid z = s|x|² + t, with normals (-2sx, 1).
        normals = triangles.equations[own, :3]
        centres = normals[:, :2] / normals[:, 2:] / (-2 * triangles.paraboloid_scale)
        radii = np.hypot(*(triangles.points[triangles.simplices[own, 0]] - centres).T)[:, None]
        if np.all(np.abs(centres) + radii <= edge) and np.all(triangles.neighbors[own] >= 0):
            break
    return triangles


def hexatic_orders(positions: Array, velocities: Array, scene: Scene) -> Array:
    """|mean of ψ6| over the balls, and the mean of |ψ6|, see `bond_order`; (2,).

    Both are 1 in a triangular lattice. Independent directions give about 1/√N for the first; the
    second is that of a ball and its neighbours, whatever the other balls do. nan if no ball has
    neighbours all around.
    """
    orders = bond_order(positions, velocities, scene)
    orders = orders[np.isfinite(orders)]
    if not len(orders):
        return np.full(2, math.nan)
    return np.array([abs(orders.mean()), np.abs(orders).mean()])


def hexatic_order(positions: Array, velocities: Array, scene: Scene) -> float:
    """|mean of ψ6| over the balls: the first of `hexatic_orders`."""
    return float(hexatic_orders(positions, velocities, scene)[0])


def species(scene: Scene) -> list[NDArray[np.intp]]:
    """The balls of each species, which have one radius and one mass, in order of their first."""
    sizes = np.column_stack([scene.radii, scene.masses])
    _, first, group = np.unique(sizes, axis=0, return_index=True, return_inverse=True)
    return [np.flatnonzero(group.ravel() == k) for k in np.argsort(first)]


def species_names(scene: Scene) -> list[str]:
    """The radius and the mass of the balls of each species in words."""
    firsts = [balls[0] for balls in species(scene)]
    return [f"r = {scene.radii[k]:g} m, m = {scene.masses[k]:g} kg" for k in firsts]


def species_temperature(
    positions: Array, velocities: Array, scene: Scene, walls: bool | None = None
) -> Array:
    """Mean kinetic energy of a ball of each species relative to the flow, J; as `species` orders.

    walls : whether the scene has any [its facts], which takes longer to ask than all else

    The flow is that of cells with ``BALLS_IN_CELL`` balls on average. It takes a part of the heat:
    of independent velocities at T_k, a ball of the mass m in a cell with the mass M = Σ m_k keeps
    T (1 − 2m/M) + m Σ m_k T_k/M². The result are the temperatures that leave what is measured. So
    it is the mean energy in a gas without a flow; without walls that of balls whose momentum is
    zero, see `two_temperatures.temperatures_at_rest`. The energy of a flow goes as the mass: with
    it, the ratio of two species would rise to that of their masses where vortices grow. If a
    species has fewer balls than ``FEWEST_OF_SPECIES``, nothing but a common drift is taken off.
    """
    groups, masses = species(scene), scene.masses
    walls = facts.hold(scene, "walls") if walls is None else walls
    if min(map(len, groups)) < FEWEST_OF_SPECIES:
        drift = masses @ velocities / np.sum(masses)
        return _mean_energies(groups, masses, velocities - drift * (not walls))
    cell, _ = _cells(positions, scene, BALLS_IN_CELL)
    in_cell = np.bincount(cell, masses)[cell]
    part, flow = masses / in_cell, np.zeros_like(velocities)
    for axis in range(2):
        flow[:, axis] = np.bincount(cell, masses * velocities[:, axis])[cell] / in_cell
    own = np.array([masses[balls[0]] for balls in groups])
    numbers = np.array([float(len(balls)) for balls in groups])
    others = [np.bincount(cell[balls], part[balls], cell.max() + 1)[cell] for balls in groups]
    left = np.array([[np.mean(part[balls] * of[balls]) for of in others] for balls in groups])
    left += np.diag([np.mean(1 - 2 * part[balls]) for balls in groups])
    found = np.linalg.solve(left, _mean_energies(groups, masses, velocities - flow))
    if walls:
        return np.asarray(found)
    return two_temperatures.temperatures_at_rest(found, numbers, own)


def _mean_energies(
    groups: Sequence[NDArray[np.intp]], masses: Array, velocities: Array
) -> NDArray[np.float64]:
    """Mean kinetic energy of the balls of each group, J."""
    energies = masses * np.sum(velocities**2, axis=1) / 2
    return np.array([energies[balls].mean() for balls in groups])


def a2(positions: Array, velocities: Array, scene: Scene) -> Array:
    """Second Sonine coefficient of each species: ⟨v⁴⟩/(2⟨v²⟩²) − 1, 0 for Maxwell's law.

    In the order of `species`; nan at rest and for one ball. N balls at fixed energy have −1/(N + 1)
    on average. For balls of one mass it is ``energy_moment``/2 − 1 of the series.
    """
    squares = [np.sum(velocities[balls] ** 2, axis=1) for balls in species(scene)]
    with np.errstate(invalid="ignore"):
        coefficients = [np.mean(square**2) / (2 * np.mean(square) ** 2) - 1 for square in squares]
    return np.where([len(square) > 1 for square in squares], coefficients, math.nan)


def local_energy(positions: Array, velocities: Array, scene: Scene) -> float:
    """Kinetic energy per ball relative to the local mean flow, J: the local temperature.

    The flow u is the momentum over the mass of each cell of an even grid with ``BALLS_IN_CELL``
    balls a cell on average. The result is Σ m|v − u|²/2 over N less the number of cells with balls,
    because the flow of n balls takes a share 1/n of their heat. So it is T in equilibrium, and
    below T where neighbours move together. It depends on the cells' size, as each such temperature
    does (Goldhirsch, Powder Technology 182 (2008) 130). nan if no two balls share a cell.
    """
    cell, _ = _cells(positions, scene, BALLS_IN_CELL)
    masses = np.bincount(cell, scene.masses)
    occupied = masses > 0
    momenta = (scene.masses * component for component in velocities.T)
    flow = sum(np.bincount(cell, momentum)[occupied] ** 2 for momentum in momenta)
    heat = np.sum(scene.masses * np.sum(velocities**2, axis=1)) - np.sum(flow / masses[occupied])
    free = scene.number - np.count_nonzero(occupied)
    return float(heat / 2 / free) if free else math.nan


# Cells


def _cells(
    positions: Array, scene: Scene, balls_in_cell: float
) -> tuple[NDArray[np.int64], tuple[int, int]]:
    """The cell of each ball, (*N*,), in an even grid, row after row; its columns and rows."""
    size = np.array(scene.container.size)
    wanted = np.sqrt(scene.number / balls_in_cell * size / size[::-1])
    columns, rows = np.maximum(np.rint(wanted), 1).astype(int).tolist()
    parts = (positions - scene.container_position) / size + 0.5
    column, row = np.clip((parts * (columns, rows)).astype(int), 0, (columns - 1, rows - 1)).T
    return row * columns + column, (columns, rows)


def _shares_inside(scene: Scene, columns: int, rows: int) -> Array:
    """The part of each cell of a grid that is in the container, from points in it; 0 to 1."""
    width, height = scene.container.size
    x, y = (
        ((np.arange(number * SAMPLES) + 0.5) / (number * SAMPLES) - 0.5) * side
        for number, side in ((columns, width), (rows, height))
    )
    points = np.stack(np.broadcast_arrays(x, y[:, np.newaxis]), axis=-1).reshape(-1, 2)
    inside = scene.container.wall_gaps(points, np.zeros(len(points))) >= 0
    parts = inside.reshape(rows, SAMPLES, columns, SAMPLES).mean(axis=(1, 3))
    return np.asarray(parts.ravel())


def local_packing(positions: Array, velocities: Array, scene: Scene) -> Array:
    """The packing fraction around each ball, (*N*,): that of its cell; see `cell_packing`."""
    cell, _ = _cells(positions, scene, BALLS_IN_CELL)
    return np.asarray(cell_packing(positions, scene).ravel()[cell])


def cell_packing(positions: Array, scene: Scene) -> Array:
    """The packing fraction in an even grid, (*rows*, *columns*), of ``BALLS_IN_CELL`` balls a cell.

    The first cell is at the least x and y. A ball belongs to the cell of its centre.
    """
    cell, (columns, rows) = _cells(positions, scene, BALLS_IN_CELL)
    shares = np.maximum(_shares_inside(scene, columns, rows), SAMPLES**-2.0)
    areas = np.bincount(cell, math.pi * scene.radii**2, minlength=columns * rows)
    cell_area = math.prod(scene.container.size) / (columns * rows)
    return np.asarray(areas / (shares * cell_area)).reshape(rows, columns)


def density_fluctuation(
    positions: Array, velocities: Array, scene: Scene, balls_in_cell: float = DENSITY_BALLS
) -> float:
    """Variance over mean of the number of balls in cells that are whole in the container.

    balls_in_cell : on average; the cells are those of an even grid

    Independent points have 1 − 1/M with M cells (Poisson, at a fixed total). Very large cells of a
    fluid have S(0), those of 25 disks 31 % more at a packing of 0.4. Clusters have more than 1. nan
    for fewer than two cells.
    """
    cell, (columns, rows) = _cells(positions, scene, balls_in_cell)
    counts = np.bincount(cell, minlength=columns * rows)
    whole = counts[_shares_inside(scene, columns, rows) == 1]
    if len(whole) < 2 or not whole.any():
        return math.nan
    return float(whole.var() / whole.mean())


# Clusters


def cluster_labels(positions: Array, scene: Scene, gap: float | None = None) -> NDArray[np.int64]:
    """The number of each ball's cluster, (*N*,), from 0.

    gap : m, at most, between the surfaces of two balls of a cluster [``CLUSTER_GAP`` diameters]

    Two balls whose gap is at most this are in one cluster, and so are all that are linked by such
    pairs (Luding & Herrmann, Chaos 9, 673 (1999), by distance alone; clusters of dissipative disks
    were found by Goldhirsch & Zanetti, Phys. Rev. Lett. 70, 1619 (1993)). Raises ``ValueError``
    for a gap below 0, or beyond a quarter of a side that repeats.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    container, number = scene.container, scene.number
    gap = CLUSTER_GAP * 2 * float(np.mean(scene.radii)) if gap is None else gap
    reach = 2 * float(np.max(scene.radii)) + gap
    if not gap >= 0 or (container.period is not None and not reach < min(container.period) / 2):
        raise ValueError(f"gap={gap!r}: give a length from 0 m on, small beside the container")
    places = positions - scene.container_position
    pairs = [(i, j) for i, j, _ in near_pairs(places, scene.radii, gap, container.period)]
    empty = np.zeros(0, dtype=np.int64)
    i, j = (np.concatenate([empty, *(pair[side] for pair in pairs)]) for side in (0, 1))
    linked = coo_matrix((np.ones(len(i), dtype=np.int8), (i, j)), shape=(number, number))
    return np.asarray(connected_components(linked, directed=False)[1], dtype=np.int64)


def cluster_sizes(
    positions: Array, velocities: Array, scene: Scene, gap: float | None = None
) -> NDArray[np.int64]:
    """Balls of each cluster, the largest first; a ball alone is a cluster of one.

    gap : as of `cluster_labels`, which has the rule. Raises ``ValueError`` as that does.
    """
    return np.sort(np.bincount(cluster_labels(positions, scene, gap)))[::-1]


def mean_cluster(
    positions: Array, velocities: Array, scene: Scene, gap: float | None = None
) -> Array:
    """Mean size of the cluster that a ball is in, Σs²/N, and the size of the largest; (2,), balls.

    gap : as of `cluster_labels`. Raises ``ValueError`` as that does.
    """
    sizes = cluster_sizes(positions, velocities, scene, gap)
    return np.array([float(np.sum(sizes**2)) / scene.number, float(sizes[0])])


# Structure factor


class Waves(NamedTuple):
    """Waves that fit the sides of a container that repeat.

    vectors : (*m*, 2), 1/m
    bins : (*m*,), the bin of each
    numbers : (*b*,), mean wave number of each bin, 1/m, ascending
    """

    vectors: Array
    bins: NDArray[np.int64]
    numbers: Array


def waves(scene: Scene) -> Waves:
    """Waves for `structure_factor`: up to ``WAVES`` directions of about ``WAVE_NUMBERS`` lengths.

    Raises ``ValueError`` for a container that does not repeat: its walls alone have a structure.
    """
    periodic = np.array(scene.container.periodic)
    if not periodic.any():
        raise ValueError("the structure factor needs a container that repeats; walls change it")
    units = 2 * math.pi / np.array(scene.container.size)
    largest = LARGEST_WAVE_NUMBER / (2 * float(np.mean(scene.radii)))
    least = float(units[periodic].min())
    lengths = np.geomspace(least, max(largest, least), WAVE_NUMBERS)
    most = MOST_TERMS // (scene.number * WAVE_NUMBERS)
    directions = min(max(most, FEWEST_WAVES), WAVES)
    angles = (np.arange(directions) + 0.5) * (math.pi / directions)
    wanted = np.multiply.outer(lengths, np.column_stack([np.cos(angles), np.sin(angles)]))
    orders = np.where(periodic, np.rint(wanted / units), 0.0).reshape(-1, 2)
    # A wave and its opposite are the same.
    opposite = (orders[:, 1] < 0) | ((orders[:, 1] == 0) & (orders[:, 0] < 0))
    orders = np.unique(np.where(opposite[:, np.newaxis], -orders, orders), axis=0)
    vectors = orders[np.any(orders != 0, axis=1)] * units
    numbers = np.hypot(*vectors.T)
    edges = np.sqrt(lengths[1:] * lengths[:-1])
    _, bins = np.unique(np.searchsorted(edges, numbers), return_inverse=True)
    return Waves(vectors, bins, np.bincount(bins, numbers) / np.bincount(bins))


def structure_factor(
    positions: Array, velocities: Array, scene: Scene, chosen: Waves | None = None
) -> Array:
    """S(k) = |Σ exp(−i k·r)|²/N, averaged over the waves of each bin; (*b*,).

    chosen : of the scene [`waves`]

    1 on average for independent points; in a fluid S(k → 0) is the compressibility, see
    ``theory.structure_at_zero``. Raises ``ValueError`` as `waves` does.
    """
    chosen = waves(scene) if chosen is None else chosen
    places = positions - scene.container_position
    powers = np.empty(len(chosen.vectors))
    for row, vector in enumerate(chosen.vectors):
        phases = places @ vector
        powers[row] = np.sum(np.cos(phases)) ** 2 + np.sum(np.sin(phases)) ** 2
    counts = np.bincount(chosen.bins)
    return np.asarray(np.bincount(chosen.bins, powers) / counts / scene.number)
