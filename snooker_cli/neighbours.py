"""Pairs of disks near each other, found with cells, in the plane or in a periodic box."""

import math
from collections.abc import Iterator
from itertools import product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.int64]

CHUNK = 1 << 16  # pairs that are compared at once, which limits the memory

WIDER = 1.0 + 1e-9
"""Width of a cell over the reach: allows for the rounding of positions in a column."""


def near_pairs(
    positions: Floats, radii: Floats, gap: float, period: tuple[float, float] | None = None
) -> Iterator[tuple[Indices, Indices, Floats]]:
    """Pairs of disks with surfaces at most ``gap`` (m) apart, each pair once, in batches.

    positions, radii : (*N*, 2) and (*N*,), m
    period : width and height of a periodic box, m, more than twice the reach of any pair

    A batch has the indices of both disks of each pair and the distance of their centres, m. Disks
    of similar size are compared with all that are not larger, so that few large ones cost little.
    """
    left = np.arange(len(radii))
    while len(left):
        largest = float(np.max(radii[left]))
        is_large = radii[left] > largest / 2
        large = left[is_large]
        reach = 2 * largest + gap
        for a, b, distances in near(positions[large], positions[left], reach, period):
            i, j = large[a], left[b]
            once = (distances <= radii[i] + radii[j] + gap) & (~is_large[b] | (i < j))
            yield i[once], j[once], distances[once]
        left = left[~is_large]


def near(
    points: Floats, others: Floats, reach: float, period: tuple[float, float] | None = None
) -> Iterator[tuple[Indices, Indices, Floats]]:
    """Pairs of a point and another one within ``reach`` (m), in batches as `near_pairs`.

    points, others : (*n*, 2) and (*m*, 2), m; in a periodic box all are inside
    """
    if len(points) == 0 or len(others) == 0:
        return
    index = np.arange(len(others))
    if period is not None:  # add the images near its edges
        size, parts, indices = np.array(period), [], []
        for side in product((0, 1, -1), repeat=2):
            shift = np.array(side[::-1])
            at_edge = (shift == 0) | (-shift * others >= size / 2 - reach * WIDER)
            indices.append(np.flatnonzero(np.all(at_edge, axis=1)))
            parts.append(others[indices[-1]] + shift * size)
        others, index = np.concatenate(parts), np.concatenate(indices)
    low = np.minimum(np.min(points, axis=0), np.min(others, axis=0))
    extent = np.maximum(np.max(points, axis=0), np.max(others, axis=0)) - low
    # Each at least the reach wide, in total a few for each point.
    most = 4.0 * len(others)
    cells = np.clip(extent / (reach * WIDER), 1.0, most)
    cells = np.floor(np.maximum(cells / math.sqrt(max(cells.prod() / most, 1.0)), 1.0))
    # A margin of empty cells gives every cell eight neighbours.
    stride, rows = int(cells[0]) + 2, int(cells[1]) + 2

    def cell_of(places: Floats) -> Indices:
        inside = np.fmin((places - low) / np.where(extent, extent, 1.0) * cells, cells - 1)
        column, row = inside.astype(np.int64).T
        return np.asarray((row + 1) * stride + column + 1)

    # In the order of cells, near points are also near in memory.
    centre, by_centre = _sorted(cell_of(points))
    cell, by_cell = _sorted(cell_of(others))
    first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=stride * rows))])
    x_points, y_points = points[by_centre].T.copy()
    x_others, y_others = others[by_cell].T.copy()
    for row in (-stride, 0, stride):
        # The three cells of a row are consecutive.
        for a, b in _ranges(first[centre + row - 1], first[centre + row + 2]):
            x, y = x_points[a] - x_others[b], y_points[a] - y_others[b]
            distances = np.sqrt(x * x + y * y)
            close = np.flatnonzero(distances <= reach)
            yield by_centre[a[close]], index[by_cell[b[close]]], distances[close]


def _sorted(cells: Indices) -> tuple[Indices, Indices]:
    """Cells in ascending order, and the point of each; much faster than a stable argsort."""
    bits = len(cells).bit_length()
    both = np.sort((cells << bits) | np.arange(len(cells)))
    return both >> bits, both & ((1 << bits) - 1)


def _ranges(begin: Indices, end: Indices) -> Iterator[tuple[Indices, Indices]]:
    """Pairs of k and every integer from begin[k] to below end[k], in batches."""
    counts = end - begin
    totals = np.cumsum(counts)
    start, done = 0, 0
    while done < totals[-1]:
        stop = max(int(np.searchsorted(totals, done + CHUNK, side="right")), start + 1)
        part = counts[start:stop]
        which = np.repeat(np.arange(start, stop), part)
        shift = begin[start:stop] - (totals[start:stop] - part - done)
        yield which, np.arange(len(which)) + np.repeat(shift, part)
        start, done = stop, int(totals[stop - 1])
