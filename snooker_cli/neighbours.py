"""Pairs of disks near each other, found with cells, in the plane or in a periodic box."""

import math
from collections.abc import Iterator
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
    if period is not None:
        others, index = _with_images(others, reach, period)
    low = [min(float(np.min(each[:, axis])) for each in (points, others)) for axis in (0, 1)]
    high = [max(float(np.max(each[:, axis])) for each in (points, others)) for axis in (0, 1)]
    extent = high[0] - low[0], high[1] - low[1]
    columns, rows = _cells(extent, reach, len(others))
    # A margin of empty cells gives every cell eight neighbours.
    stride = columns + 2

    def cell_of(places: Floats) -> Indices:
        x, y = places[:, 0] - low[0], places[:, 1] - low[1]
        column = np.fmin(x / (extent[0] or 1.0) * columns, columns - 1).astype(np.int64)
        row = np.fmin(y / (extent[1] or 1.0) * rows, rows - 1).astype(np.int64)
        return np.asarray((row + 1) * stride + column + 1)

    # In the order of cells, near points are also near in memory.
    centre, by_centre = _sorted(cell_of(points))
    cell, by_cell = _sorted(cell_of(others))
    first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=stride * (rows + 2)))])
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


def _cells(extent: tuple[float, float], reach: float, number: int) -> tuple[int, int]:
    """Numbers of columns and rows, each at least the reach wide, in total a few for each point."""
    most = 4.0 * number
    across, up = (min(max(each / (reach * WIDER), 1.0), most) for each in extent)
    excess = math.sqrt(max(across * up / most, 1.0))
    return int(max(across / excess, 1.0)), int(max(up / excess, 1.0))


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


def _with_images(
    points: Floats, reach: float, period: tuple[float, float]
) -> tuple[Floats, Indices]:
    """Points of a periodic box with the images near its edges, and the point of each by index."""
    index = np.arange(len(points))
    for axis in (0, 1):
        at = points[:, axis]
        parts, indices = [points], [index]
        for side in (-1.0, 1.0):
            edge = np.flatnonzero(side * at >= period[axis] / 2 - reach * WIDER)
            images = points[edge].copy()
            images[:, axis] -= side * period[axis]
            parts.append(images)
            indices.append(index[edge])
        points, index = np.concatenate(parts), np.concatenate(indices)
    return points, index
