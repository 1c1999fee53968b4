"""Geometry of a container in numbers, for a shape that has no formulas: ``Container`` uses it.

All follows from where the walls are (``wall_gaps``), from the polygon that is drawn, and from
images.
"""

import math
from functools import lru_cache
from typing import ClassVar, Protocol

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from snooker_cli.neighbours import Floats

ANGLES = 720  # at which a ring is tried: a share is exact to about 1/360 for each end of an arc
POINTS = 3000  # places: 4.5 million distances between them, or the points of an integral of flows
DISTANCE_BINS = 100  # of these distances
ORDER = 12  # of the polynomials of a flow, along an axis with walls
WAVES = 2  # of a flow, along an axis that repeats
WALL_PLACES = 360  # places of the outline, at which no flow goes through the wall
PUSHES = 8  # of balls that stick out, away from the nearest wall; in a corner from two
PENALTY = 1e6  # of the square of what flows through the wall, over that of the flow
STILL = 0.01  # of k² over the size of the container: flows with less are rigid motions
SMALL = 1e-9  # share of the largest flow: with less, a flow is a sum of others
AT_WALL = 1e-3  # of the size: a place of the outline so near to a wall is at it
STEPS = 0.7548776662466927, 0.5698402909980532
"""Of an even sequence of places in a square (Roberts 2018, from the plastic number)."""


class Region(Protocol):
    """What is asked of a ``Container``."""

    has_wall: ClassVar[bool]
    periodic: ClassVar[tuple[bool, bool]]

    @property
    def size(self) -> tuple[float, float]: ...

    @property
    def outline(self) -> Floats: ...

    def wall_gaps(self, places: Floats, radii: Floats) -> Floats: ...

    def wall_directions(self, places: Floats) -> Floats: ...

    def nearest_image(self, offsets: Floats) -> Floats: ...


def reached(region: Region, places: Floats, radius: float) -> NDArray[np.bool_]:
    """Whether centres of balls of a radius (m) can be at places (*n*, 2), m."""
    if not region.has_wall:
        return np.ones(len(places), dtype=np.bool_)
    return np.asarray(region.wall_gaps(places, np.array([radius])) >= 0)


def ring_shares(region: Region, places: Floats, ring_radii: Floats, radius: float) -> Floats:
    """``Container.ring_shares`` by trying ``ANGLES`` places of each ring."""
    angles = (np.arange(ANGLES) + 0.5) * (2 * math.pi / ANGLES)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    shares = np.empty((len(places), len(ring_radii)))
    for k, size in enumerate(ring_radii):
        tried = (places[:, None] + size * ring).reshape(-1, 2)
        shares[:, k] = reached(region, tried, radius).reshape(len(places), ANGLES).mean(axis=1)
    return shares


def even_places(region: Region, radius: float) -> Floats:
    """``POINTS`` even places or more that centres of balls of a radius can reach, (*n*, 2), m."""
    tried = POINTS
    while True:
        places = (np.arange(1, tried + 1)[:, None] * np.array(STEPS) % 1.0 - 0.5) * region.size
        inside: Floats = places[reached(region, places, radius)]
        if len(inside) >= POINTS or tried > 1000 * POINTS:
            return inside
        tried *= 2


def distance_density(region: Region, distances: Floats, radius: float) -> Floats:
    """``Container.distance_density`` by the distances between `even_places`; to about 2 %."""
    places = even_places(region, radius)[:POINTS]
    i, j = np.triu_indices(len(places), 1)
    apart = np.hypot(*region.nearest_image(places[i] - places[j]).T)
    counts, edges = np.histogram(apart, DISTANCE_BINS, (0.0, float(apart.max()) * (1 + 1e-9)))
    # Over the distance, which the density is in proportion to at first, so that lines join it.
    middles = (edges[1:] + edges[:-1]) / 2
    over = counts / (len(apart) * np.diff(edges)) / middles
    return np.asarray(distances * np.interp(distances, middles, over, right=0.0))


def longest_distance(region: Region, radius: float) -> float:
    """``Container.longest_distance`` between places at the walls of the outline, or in it."""
    corners = along_outline(region)
    for _ in range(PUSHES * region.has_wall):
        towards = region.wall_directions((1 - AT_WALL) * corners)
        out = np.minimum(region.wall_gaps(corners, np.array([radius])), 0.0)
        corners = corners + (out / np.hypot(*towards.T))[:, None] * towards
    inside = np.concatenate([corners, even_places(region, radius)[:WALL_PLACES]])
    offsets = region.nearest_image((inside[:, None] - inside).reshape(-1, 2))
    return float(np.max(np.hypot(*offsets.T)))


def along_outline(region: Region) -> Floats:
    """``WALL_PLACES`` even places of the polygon that is drawn, (*n*, 2), m."""
    corners = np.concatenate([region.outline, region.outline[:1]])
    ways = np.append(0.0, np.cumsum(np.hypot(*np.diff(corners, axis=0).T)))
    at = (np.arange(WALL_PLACES) + 0.5) * (ways[-1] / WALL_PLACES)
    return np.column_stack([np.interp(at, ways, column) for column in corners.T])


@lru_cache(maxsize=64)
def longest_wave(region: Region) -> float:
    """``Container.longest_wave``: 2π/k of the flow without sources that decays most slowly.

    Viscosity ν takes 2 k² ν of the energy of a mode each second, so that k² is the least ratio of
    ∫ 2 e:e to ∫ u², e the rate of strain (Ritz's method; a wall without shear stress is its natural
    condition). A large penalty on what flows through the walls keeps this small. Rigid motions have
    k = 0 and are left out. It is within 1 % for the shapes that have a formula.
    """
    size, places = max(region.size), even_places(region, 0.0)
    flow, strain = _flows(region, *places.T)
    edges = along_outline(region)
    edges = edges[abs(region.wall_gaps(edges, np.zeros(1))) < AT_WALL * size * region.has_wall]
    normals = region.wall_directions((1 - AT_WALL) * edges)
    normals = normals / np.hypot(*normals.T)[:, None]
    through = np.einsum("pc,cpf->pf", normals, _flows(region, *edges.T)[0])
    scale = math.sqrt(PENALTY * len(places) / max(len(edges), 1))
    # In an orthonormal basis of flows ∫ u² is 1.
    _, sizes, basis = np.linalg.svd(np.concatenate(flow), full_matrices=False)
    kept = sizes > SMALL * sizes[0]
    rates = np.concatenate([*(size * strain), scale * through]) @ (basis[kept].T / sizes[kept])
    squares = np.linalg.svd(rates, compute_uv=False) ** 2
    return float(2 * math.pi * size / math.sqrt(squares[squares > STILL].min()))


def _flows(region: Region, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """u = (∂ψ/∂y, −∂ψ/∂x) and 2 ∂u/∂x, ∂u/∂y + ∂v/∂x of many flows at places; (2, *n*, *flows*).

    Each ψ is a Chebyshev polynomial along an axis with walls, and a wave along one that repeats.
    """
    axes = zip((x, y), region.size, region.periodic, strict=True)
    (f, f1, f2), (g, g1, g2) = (_along(*axis) for axis in axes)

    def product(along_x: Floats, along_y: Floats) -> Floats:
        both = along_x[:, :, None] * along_y[:, None]
        return np.asarray(both.reshape(len(x), both.shape[1] * both.shape[2]))

    flow = np.stack([product(f, g1), -product(f1, g)])
    return flow, np.stack([2 * product(f1, g1), product(f, g2) - product(f2, g)])


def _along(places: Floats, side: float, repeats: bool) -> Floats:
    """Functions along an axis and their first and second derivatives; (3, *n*, *functions*)."""
    if repeats:
        k = 2 * math.pi / side * np.arange(1, WAVES + 1)
        sine, cosine = np.sin(places[:, None] * k), np.cos(places[:, None] * k)
        constant = np.ones((len(places), 1))
        values = np.hstack([constant, sine, cosine])
        slopes = np.hstack([0 * constant, k * cosine, -k * sine])
        bends = np.hstack([0 * constant, -k * k * sine, -k * k * cosine])
        return np.stack([values, slopes, bends])
    series = np.eye(ORDER + 1)
    parts = [chebyshev.chebval(2 * places / side, series)]
    for times in (1, 2):
        rows = chebyshev.chebder(series, times)
        parts.append(chebyshev.chebval(2 * places / side, rows) * (2 / side) ** times)
    return np.stack([part.T for part in parts])
