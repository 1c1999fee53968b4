"""How velocities of two balls go together by their distance, and how balls turn around each other.

Balls that collide without molecular chaos move alike: vortices show as a longitudinal correlation
that reaches far, and a transverse one that becomes negative at their size.
"""

import math

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.structure import Array
from snooker_cli.neighbours import near
from snooker_cli.scene import Scene

BINS = 30  # of distances at most
FINER = 5.0  # the mean width of a bin in a large container over that of the first
BINS_OF_DIAMETER = 2  # at most, so that each has some pairs
MOST_PAIRS, FEWEST_CENTRES, MOST_CENTRES = 400_000, 20, 400
"""Pairs of a state about; balls around which others count, of many an even choice."""

LONGITUDINAL, TRANSVERSE, PAIRS, TURNING, CENTRES = range(5)
"""Rows of `pair_sums`."""


def distance_edges(scene: Scene) -> Array:
    """Edges of the bins of distance, m, from the least to half of the container's shorter side."""
    least = 2 * float(np.min(scene.radii))
    half = min(scene.container.size) / 2 * (1 - 1e-9)  # images are apart
    bins = math.floor((half - least) / least * BINS_OF_DIAMETER)
    if bins <= BINS:
        return np.linspace(least, half, max(bins, 1) + 1)

    # Widths grow evenly. The first bin has enough pairs, and is near a contact.
    first, steps = max(least / BINS_OF_DIAMETER, (half - least) / BINS / FINER), np.arange(BINS)
    growth = ((half - least) - first * BINS) / BINS**2
    return np.append(least + first * steps + growth * steps**2, half)


def pair_sums(positions: Array, velocities: Array, scene: Scene, edges: Array) -> Array:
    """Sums over pairs in bins of their distance; (5, *k*). `correlations` makes means of them.

    edges : (*k* + 1,), m

    The rows are u_i u_j along the line of centres, and across it, both over the mean of u² of a
    component; pairs; and over balls i for the balls j nearer than the upper edge of a bin
    (Σ r_ij × u_j)²/Σ r_ij² over the same mean, and these balls i. Without walls u is seen from the
    centre of mass. Balls have one mass.
    """
    container, places = scene.container, positions - scene.container_position
    moving = velocities - velocities.mean(axis=0) * (not container.has_wall)
    moving = moving / math.sqrt(float(np.mean(moving**2)) or 1.0)
    centres = _centres(len(places))
    sums, turns = np.zeros((5, len(edges) - 1)), np.zeros((2, len(centres), len(edges)))
    for k, j, distances in near(places[centres], places, float(edges[-1]), container.period):
        apart = (centres[k] != j) & (distances > 0)
        k, j, distances = k[apart], j[apart], distances[apart]
        x, y = container.nearest_image(places[j] - places[centres[k]]).T / distances
        own, other = moving[centres[k]].T, moving[j].T
        along = (own[0] * x + own[1] * y) * (other[0] * x + other[1] * y)
        turning = other[1] * x - other[0] * y
        across = (own[1] * x - own[0] * y) * turning
        bins = np.clip(np.searchsorted(edges, distances, side="right"), 1, len(edges) - 1)
        for row, values in ((LONGITUDINAL, along), (TRANSVERSE, across), (PAIRS, None)):
            sums[row] += np.bincount(bins - 1, values, len(edges) - 1)
        cell = k * len(edges) + bins
        for moment, values in enumerate((distances * turning, distances**2)):
            turns[moment] += np.bincount(cell, values, turns[0].size).reshape(turns[0].shape)
    torque, inertia = np.cumsum(turns, axis=2)[:, :, 1:]
    known = inertia > 0
    sums[TURNING] = np.sum(torque**2 / np.where(known, inertia, 1.0), axis=0)
    sums[CENTRES] = known.sum(axis=0)
    return sums


def _centres(number: int) -> NDArray[np.int64]:
    """The balls around which others count: all of few, else a choice that is always the same."""
    most = min(max(MOST_PAIRS // number, FEWEST_CENTRES), MOST_CENTRES)
    if number <= most:
        return np.arange(number)
    return np.sort(np.random.default_rng(0).choice(number, most, replace=False))


def correlations(sums: Array) -> tuple[Array, Array, Array]:
    """Longitudinal and transverse correlation, and the vorticity; each (..., *k*).

    sums : (..., 5, *k*), of one or more states, added up

    The vorticity is the mean square of Σ r_ij × u_j over that of independent velocities: 1 without
    vortices. nan in bins without pairs.
    """
    rows = np.moveaxis(sums, -2, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        along, across = (rows[row] / rows[PAIRS] for row in (LONGITUDINAL, TRANSVERSE))
        return along, across, rows[TURNING] / rows[CENTRES]
