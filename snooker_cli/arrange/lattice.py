"""Places on a hexagonal lattice that is fitted into a circle, a box or a periodic box."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from snooker_cli.scene import EPSILON

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Shape

    Floats = NDArray[np.float64]
    Integers = NDArray[np.int64]

HALVINGS = 60
"""Steps to a diameter that is as exact as doubles are."""

ROUNDINGS = 4
"""By how many, each of the container's size, places may be nearer than without any rounding."""


class Lattice(NamedTuple):
    """Places for the centres of balls, (*N*, 2), and the largest diameter that fits there, m."""

    positions: Floats
    diameter: float


def lattice(shape: Shape, size: tuple[float, float], number: int) -> Lattice:
    """The places for so many balls, as far from one another and from the wall as may be.

    size : width and height, m, of the container or of the square round a circle
    """
    if shape == "circle":
        found = _in_circle(size[0] / 2, number)
    else:
        layout = _in_periodic if shape == "periodic" else _in_box
        found, lying = layout(*size, number), layout(*size[::-1], number)
        if lying.diameter > found.diameter:
            found = Lattice(np.ascontiguousarray(lying.positions[:, ::-1]), lying.diameter)
    return Lattice(found.positions, found.diameter - ROUNDINGS * EPSILON * max(size))


def _in_circle(radius: float, number: int) -> Lattice:
    """The places of a lattice nearest to the middle, which is a place, or between two or three.

    With neighbours at a distance of 6, a place is at (u + v/2, v sqrt(3)/2) for whole numbers u
    and v that leave a fixed rest by 6, and u^2 + uv + v^2 is its exact squared distance.
    """
    # N places fill a disc of radius sqrt(N sqrt(3) / (2 pi)), where |v| is up to 2 / sqrt(3) times
    # as large: 0.607 sqrt(N).
    reach = int(0.607 * math.sqrt(number)) + 2
    steps = 6 * np.arange(-reach, reach + 1)
    best: tuple[float, Floats] | None = None
    for rest in ((0, 0), (3, 0), (2, 2)):
        u, v = (axis.ravel() for axis in np.meshgrid(steps + rest[0], steps + rest[1]))
        squares = u * u + u * v + v * v
        nearest = np.argsort(squares, kind="stable")[:number]
        farthest = math.sqrt(int(squares[nearest[-1]])) / 6
        spacing = radius / (farthest + 0.5)
        if best is None or spacing > best[0]:
            x, y = u[nearest] + v[nearest] / 2, v[nearest] * (math.sqrt(3) / 2)
            best = spacing, np.column_stack([x, y]) * (spacing / 6)
    assert best is not None
    return Lattice(best[1], best[0])


def _in_periodic(width: float, height: float, number: int) -> Lattice:
    """Rows along x, each half a spacing beside the last; an even number of them, so they close."""
    rows = 2 * _numbers_of_rows(width, height, number)
    columns = -(-number // rows)
    across, up = width / columns, height / rows
    aslant = np.sqrt((across / 2) * (across / 2) + up * up)
    diameters = np.minimum(np.minimum(across, 2 * up), aslant)
    best = int(np.argmax(diameters))
    column, row = _kept(number, int(columns[best]), int(rows[best]), 0)
    x = ((column + row % 2 / 2 + 0.25) / columns[best] - 0.5) * width
    y = ((row + 0.5) / rows[best] - 0.5) * height
    return Lattice(np.column_stack([x, y]), float(diameters[best]))


def _in_box(width: float, height: float, number: int) -> Lattice:
    """Rows from wall to wall along x; every other one is half a spacing further in, and has as
    many places or one less."""
    rows = _numbers_of_rows(width, height, number)
    layouts = []
    for fewer in (0, 1):
        columns = -(-(number + fewer * (rows // 2)) // rows)
        # Of a row's length in spacings, half a one is for the rows that are further in.
        length = np.where(rows > 1, columns - (1 + fewer) / 2, columns - 1.0)
        diameters = _diameters_in_box(width, height, columns, rows, length)
        k = int(np.argmax(diameters))
        layouts.append(
            (float(diameters[k]), int(columns[k]), int(rows[k]), float(length[k]), fewer)
        )
    diameter, columns_, rows_, length_, fewer = max(layouts)
    column, row = _kept(number, columns_, rows_, fewer)
    x = (column + row % 2 / 2 - length_ / 2) * ((width - diameter) / (length_ or 1.0))
    y = (row - (rows_ - 1) / 2) * ((height - diameter) / ((rows_ - 1) or 1))
    return Lattice(np.column_stack([x, y]), diameter)


def _diameters_in_box(
    width: float, height: float, columns: Integers, rows: Integers, length: Floats
) -> Floats:
    """The largest diameter for each number of rows, by halving, m."""
    low, high = np.zeros(len(rows)), np.full(len(rows), min(width, height))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        across = (width - middle) / np.where(length > 0, length, math.inf)
        up = (height - middle) / np.maximum(rows - 1, 1)
        aslant = np.sqrt((across / 2) * (across / 2) + up * up)
        fits = (
            ((columns == 1) | (across >= middle))
            & ((rows == 1) | (aslant >= middle))
            & ((rows <= 2) | (2 * up >= middle))
        )
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return low


def _numbers_of_rows(width: float, height: float, number: int) -> Integers:
    """Numbers of rows, the best among them: up to twice that of equal triangles."""
    ideal = math.sqrt(2 / math.sqrt(3) * number * min(height / width, float(number)))
    return np.arange(1, min(number, int(2 * ideal) + 3) + 1)


def _kept(number: int, columns: int, rows: int, fewer: int) -> tuple[Integers, Integers]:
    """Column and row of so many places, evenly taken from all; odd rows may have one fewer."""
    of_two_rows = 2 * columns - fewer
    places = rows // 2 * of_two_rows + rows % 2 * columns
    pair, rest = np.divmod(np.arange(number) * places // number, of_two_rows)
    odd = rest >= columns
    return rest - columns * odd, 2 * pair + odd
