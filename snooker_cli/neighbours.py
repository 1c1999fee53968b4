"""Which disks are near which: pairs found by sorting points into cells, in a plane or a torus."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Indices = NDArray[np.int64]


CHUNK = 1 << 16
"""Pairs looked at together, which bounds the memory."""

WIDER = 1.0 + 1e-9
"""A cell is this much wider than the reach, as columns are counted with a rounding or two."""


def near_pairs(
    positions: Floats, radii: Floats, gap: float, period: tuple[float, float] | None = None
) -> Iterator[tuple[Indices, Indices, Floats]]:
    """All pairs of disks whose surfaces are at most ``gap`` (m) apart, each once, in pieces.

    positions, radii : (*N*, 2) and (*N*,), m
    period : width and height of a periodic box, m, more than twice the reach of any pair

    A piece is the two disks of each pair and the distance of their centres, m. Disks of one size,
    to a factor of two, are looked for among all that are no larger, so that a large one among many
    small ones costs no more than its own neighbours.
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
    """All pairs of a point and another that are within ``reach`` (m), in pieces.

    points, others : (*n*, 2) and (*m*, 2), m; in a periodic box all inside it
    """
    if len(points) == 0 or len(others) == 0:
        return
    whose = np.arange(len(others))
    if period is not None:
        others, whose = _with_images(others, reach, period)
    low = [min(float(np.min(each[:, axis])) for each in (points, others)) for axis in (0, 1)]
    high = [max(float(np.max(each[:, axis])) for each in (points, others)) for axis in (0, 1)]
    extent = high[0] - low[0], high[1] - low[1]
    columns, rows = _cells(extent, reach, len(others))
    # One column and row of empty cells all round, so that every cell has eight others.
    stride = columns + 2

    def cell_of(places: Floats) -> Indices:
        x, y = places[:, 0] - low[0], places[:, 1] - low[1]
        column = np.minimum((x / (extent[0] or 1.0) * columns).astype(np.int64), columns - 1)
        row = np.minimum((y / (extent[1] or 1.0) * rows).astype(np.int64), rows - 1)
        return np.asarray((row + 1) * stride + column + 1)

    # In the order of their cells what is near is near in memory too.
    centre, by_centre = _sorted(cell_of(points))
    cell, by_cell = _sorted(cell_of(others))
    first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=stride * (rows + 2)))])
    x_points, y_points = points[by_centre].T.copy()
    x_others, y_others = others[by_cell].T.copy()
    for row in (-stride, 0, stride):
        # Three cells of a row stand one after the other.
        for a, b in _ranges(first[centre + row - 1], first[centre + row + 2]):
            x, y = x_points[a] - x_others[b], y_points[a] - y_others[b]
            distances = np.sqrt(x * x + y * y)
            close = np.flatnonzero(distances <= reach)
            yield by_centre[a[close]], whose[by_cell[b[close]]], distances[close]


def _sorted(cells: Indices) -> tuple[Indices, Indices]:
    """Cells in ascending order, and whose they are; much faster than a stable argsort."""
    bits = len(cells).bit_length()
    both = np.sort((cells << bits) | np.arange(len(cells)))
    return both >> bits, both & ((1 << bits) - 1)


def _cells(extent: tuple[float, float], reach: float, number: int) -> tuple[int, int]:
    """Columns and rows over an extent (m), as wide as the reach or wider, a few to each point."""
    most = 4.0 * number
    across, up = (min(max(each / (reach * WIDER), 1.0), most) for each in extent)
    excess = math.sqrt(max(across * up / most, 1.0))
    return int(max(across / excess, 1.0)), int(max(up / excess, 1.0))


def _ranges(begin: Indices, end: Indices) -> Iterator[tuple[Indices, Indices]]:
    """Pairs of k and every whole number from begin[k] to below end[k], in pieces."""
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
    """Points of a periodic box and their images within reach of its edges, and whose they are."""
    whose = np.arange(len(points))
    for axis in (0, 1):
        at = points[:, axis]
        parts, owners = [points], [whose]
        for side in (-1.0, 1.0):
            edge = np.flatnonzero(side * at >= period[axis] / 2 - reach * WIDER)
            images = points[edge].copy()
            images[:, axis] -= side * period[axis]
            parts.append(images)
            owners.append(whose[edge])
        points, whose = np.concatenate(parts), np.concatenate(owners)
    return points, whose
