"""The cells that many balls are sorted into: a ball can only touch balls of its own and next cells.

Cells are squares at least as wide as the largest ball. Rows of them are a power of two apart, so
that a cell's column and row are a mask and a shift. In a circle or a box a margin of empty cells
goes round; a periodic box has none, and its columns and rows wrap.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle
from snooker_cli.engine.contact import NEVER, nearest_image
from snooker_cli.engine.jit import inlined
from snooker_cli.engine.kernel_state import (
    CELL,
    CLOCK,
    PLACE,
    Floats,
    Indices,
    U,
    V,
    X,
    Y,
    ahead,
)

if TYPE_CHECKING:
    from snooker_cli.scene import Scene


# A cell is this much wider than a ball: crossings are timed with a rounding or two.
ROUNDING = 1.0 + 1e-9

# A ball that enters a cell looks as far as two cells: less than half of a periodic box.
LEAST_CELLS = 5


class Mesh(NamedTuple):
    """Where the cells are: their sides (m), the lower left corner of the first (m), how many."""

    width: float
    height: float
    left: float
    bottom: float
    columns: int
    rows: int
    shift: int


class Cells(NamedTuple):
    """What is in the cells, and which of them a ball can touch the wall from.

    members : (*c*, *k*) ``numpy.int32``, balls in no order
    occupancy : (*c*,) ``numpy.int32``
    at_wall : (*c*,) ``numpy.bool_``
    """

    members: NDArray[np.int32]
    occupancy: NDArray[np.int32]
    at_wall: NDArray[np.bool_]


@inlined
def column_of(mesh: Mesh, cell: int) -> int:
    """The column that a cell is in."""
    return cell & ((1 << mesh.shift) - 1)


@inlined
def row_of(mesh: Mesh, cell: int) -> int:
    """The row that a cell is in."""
    return cell >> mesh.shift


@inlined
def cell_at(mesh: Mesh, column: int, row: int) -> int:
    """The cell in a column and a row."""
    return ahead((row << mesh.shift) + column)


@inlined
def put_into(i: int, cell: int, links: Indices, members: Indices, occupancy: Indices) -> None:
    """Make ball i a member of a cell."""
    place = ahead(occupancy[cell])
    members[cell, place] = i
    occupancy[cell] = place + 1
    links[CELL, i] = cell
    links[PLACE, i] = place


@inlined
def put_out(i: int, links: Indices, members: Indices, occupancy: Indices) -> None:
    """Take ball i out of its cell; the last member takes its place."""
    cell, place = ahead(links[CELL, i]), ahead(links[PLACE, i])
    last = ahead(occupancy[cell] - 1)
    occupancy[cell] = last
    moved = ahead(members[cell, last])
    members[cell, place] = moved
    links[PLACE, moved] = place


def new_mesh(scene: Scene, side: float) -> Mesh:
    """Cells of about a side (m), at least a ball wide, over the whole container.

    Raises ``ValueError`` if a periodic box is too small for five cells each way: of two balls that
    are two cells apart the nearest image would be the other one.
    """
    least = 2.0 * float(np.max(scene.radii)) * ROUNDING
    side = max(side, least)
    width, height = scene.container.size
    if scene.container.period is not None:
        columns = max(int(width / side), min(LEAST_CELLS, int(width / least)))
        rows = max(int(height / side), min(LEAST_CELLS, int(height / least)))
        if min(columns, rows) < LEAST_CELLS:
            raise ValueError("a periodic box has to be five diameters of its largest ball wide")
        return Mesh(
            width=width / columns,
            height=height / rows,
            left=-0.5 * width,
            bottom=-0.5 * height,
            columns=columns,
            rows=rows,
            shift=(columns - 1).bit_length(),
        )
    # One more for a free container, which may be off their middle by less than half a cell.
    around = 3 if scene.free else 2
    columns, rows = math.ceil(width / side) + around, math.ceil(height / side) + around
    return Mesh(
        width=side,
        height=side,
        left=-0.5 * columns * side,
        bottom=-0.5 * rows * side,
        columns=columns,
        rows=rows,
        shift=(columns - 1).bit_length(),
    )


def centred(mesh: Mesh, x: float, y: float) -> Mesh:
    """The same cells round another point, m."""
    return mesh._replace(
        left=x - 0.5 * mesh.columns * mesh.width, bottom=y - 0.5 * mesh.rows * mesh.height
    )


def new_cells(scene: Scene, mesh: Mesh, capacity: int, margin: float) -> Cells:
    """Empty cells with room for so many balls each; the container may move by a margin (m)."""
    number = mesh.rows << mesh.shift
    return Cells(
        members=np.zeros((number, capacity), dtype=np.int32),
        occupancy=np.zeros(number, dtype=np.int32),
        at_wall=np.ravel(_at_wall(scene, mesh, margin)),
    )


def _at_wall(scene: Scene, mesh: Mesh, margin: float) -> NDArray[np.bool_]:
    """Whether a ball with its centre in the cell can touch the wall; (rows, stride)."""
    left = mesh.width * (np.arange(1 << mesh.shift) - 0.5 * mesh.columns)
    bottom = mesh.height * (np.arange(mesh.rows) - 0.5 * mesh.rows)
    far_x = np.maximum(-left, left + mesh.width)[None, :]
    far_y = np.maximum(-bottom, bottom + mesh.height)[:, None]
    largest = float(np.max(scene.radii))
    if not scene.container.has_wall:
        return np.zeros((mesh.rows, 1 << mesh.shift), dtype=np.bool_)
    if isinstance(scene.container, Circle):
        reach = scene.container.radius - largest - margin
        return np.asarray(np.hypot(far_x, far_y) * ROUNDING >= reach)
    width, height = scene.container.size
    return np.asarray(
        (far_x * ROUNDING >= 0.5 * width - largest) | (far_y * ROUNDING >= 0.5 * height - largest)
    )


@inlined
def crossing_delay(p: float, w: float, side: float) -> float:
    """Time until a ball at p from its cell's middle, moving at w along an axis, leaves it; s."""
    delay = ((0.5 * side if w > 0.0 else -0.5 * side) - p) / w
    return delay if w != 0.0 else NEVER


@inlined
def crossing_delays(
    i: int, now: float, balls: Floats, period: Floats | None, links: Indices, mesh: Mesh
) -> tuple[float, float]:
    """Time until ball i leaves its cell across, and up or down; s."""
    cell = ahead(links[CELL, i])
    age = now - balls[CLOCK, i]
    u, v = balls[U, i], balls[V, i]
    x = balls[X, i] + u * age - (mesh.left + mesh.width * (column_of(mesh, cell) + 0.5))
    y = balls[Y, i] + v * age - (mesh.bottom + mesh.height * (row_of(mesh, cell) + 0.5))
    if period is not None:
        x, y = nearest_image(x, y, period)
    return crossing_delay(x, u, mesh.width), crossing_delay(y, v, mesh.height)
