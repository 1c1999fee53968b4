"""The cells that many balls are sorted into: a ball can only touch balls of its own and next cells.

Cells are squares at least as wide as the largest ball. Rows of them are a power of two apart, so
a cell's column and row are a mask and a shift. In a circle or a box, a margin of empty cells goes
round; a periodic box has none, and its columns and rows wrap.
"""

import math
from typing import Any

import numpy as np

from snooker_cli.containers import PERIODIC_DIAMETERS
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import nonnegative
from snooker_cli.engine.cell_memory import (
    CELL,
    LEAST_MEMBERS,
    LINK_ROWS,
    PLACE,
    Cells,
    Mesh,
    NoMargin,
    Tree,
    room_for,
)
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.jit import inlined
from snooker_cli.engine.kernel_state import Flags, State, U, V
from snooker_cli.scene import Scene

CELL_OVER_BALL = 1.0 + 1e-9
"""A cell is this much wider than a ball: crossings are timed with a rounding or two."""

MOST_IN_ROW = 64
"""Cells in a row at most, for each ball: a slender box does not need more."""

MARGIN = 0.1
"""Way of a free container, in cells, until all is predicted again."""


def new_cells(scene: Scene, side: float, tree: Tree) -> Cells:
    """Cells of about a side (m), with room for LEAST_MEMBERS balls each and without members."""
    mesh = new_mesh(scene, side)
    at_wall = cells_at_wall(scene, mesh, MARGIN * mesh.width if scene.free else 0.0)
    members, near = room_for(LEAST_MEMBERS, len(at_wall))
    return Cells(
        mesh=mesh,
        members=members,
        occupancy=np.zeros(len(at_wall), dtype=np.int32),
        at_wall=at_wall,
        near=near,
        links=np.zeros((LINK_ROWS, scene.number), dtype=np.int32, order="F"),
        tree=tree,
        margin=NoMargin(None),
    )


def new_mesh(scene: Scene, side: float) -> Mesh:
    """Cells of about a side (m), at least a ball wide, over the whole container.

    Raises ``SceneError`` if a periodic box is too small: a ball that enters a cell looks as far as
    two cells, which must be less than half of the box.
    """
    width, height = scene.container.size
    slender = max(width, height) / (MOST_IN_ROW * scene.number)
    side = max(side, slender, 2.0 * float(np.max(scene.radii)) * CELL_OVER_BALL)
    scene.container.check_radii(scene.radii)
    # One more for a free container, which may be off their middle by less than half a cell.
    around = 3 if scene.free else 2

    def along(length: float, repeats: bool) -> tuple[float, float, int]:
        """The side of the cells along an axis (m), where they begin (m), and how many they are."""
        if repeats:
            number = max(int(length / side), PERIODIC_DIAMETERS)
            return length / number, -0.5 * length, number
        number = math.ceil(length / side) + around
        return side, -0.5 * number * side, number

    across, up = map(along, (width, height), scene.container.periodic)
    shift = (across[2] - 1).bit_length()
    return Mesh(across[0], up[0], across[1], up[1], across[2], up[2], shift)


def cells_at_wall(scene: Scene, mesh: Mesh, margin: float) -> Flags:
    """Whether a ball with its centre in a cell can touch the wall, if that moves by a margin, m."""
    at_wall = np.zeros((mesh.rows, 1 << mesh.shift), dtype=np.bool_)
    if scene.container.has_wall:
        largest = np.max(scene.radii, keepdims=True)
        left = mesh.width * (np.arange(1 << mesh.shift) - 0.5 * mesh.columns)
        bottom = mesh.height * (np.arange(mesh.rows) - 0.5 * mesh.rows)
        for x in (left, left + mesh.width):
            for y in (bottom, bottom + mesh.height):
                corners = CELL_OVER_BALL * np.stack(np.meshgrid(x, y), axis=-1)
                at_wall |= scene.container.wall_gaps(corners, largest) <= margin
    return np.ravel(at_wall)


@inlined
def column_and_row(cell: int, mesh: Mesh) -> tuple[int, int]:
    return cell & ((1 << mesh.shift) - 1), cell >> mesh.shift


@inlined
def cell_at(column: int, row: int, mesh: Mesh, boundary: Any) -> int:
    """The cell in a column and a row."""
    column, row = boundary.wrapped(column, row, mesh.columns, mesh.rows)
    return nonnegative((row << mesh.shift) + column)


@inlined
def put_into(i: int, cell: int, cells: Cells) -> None:
    place = nonnegative(cells.occupancy[cell])
    cells.members[cell, place] = i
    cells.occupancy[cell] = place + 1
    cells.links[CELL, i] = cell
    cells.links[PLACE, i] = place


@inlined
def take_out(i: int, cells: Cells) -> None:
    """Take ball i out of its cell; the last member takes its place."""
    links, members = cells.links, cells.members
    cell, place = nonnegative(links[CELL, i]), nonnegative(links[PLACE, i])
    last = nonnegative(cells.occupancy[cell] - 1)
    cells.occupancy[cell] = last
    moved = nonnegative(members[cell, last])
    members[cell, place] = moved
    links[PLACE, moved] = place


@inlined
def collect(gathered: int, column: int, row: int, cells: Cells, boundary: Any) -> int:
    """Append the balls of a cell to ``near``, always four or more; how many there are then."""
    near, members = cells.near, cells.members
    cell = cell_at(column, row, cells.mesh, boundary)
    number = int(cells.occupancy[cell])
    gathered = nonnegative(gathered)
    for place in range(LEAST_MEMBERS):
        near[gathered + place] = members[cell, place]
    for place in range(LEAST_MEMBERS, number):
        near[gathered + place] = members[cell, place]
    return gathered + number


@inlined
def crossing_delay(p: float, w: float, side: float) -> float:
    """Time until a ball at p from its cell's middle, moving at w along an axis, leaves it; s."""
    delay = ((0.5 * side if w > 0.0 else -0.5 * side) - p) / w
    return delay if w != 0.0 else NEVER


@inlined
def crossing_delays(i: int, now: float, state: State, cells: Cells) -> tuple[float, float]:
    """Time until ball i leaves its cell across, and up or down; s."""
    mesh = cells.mesh
    cell = nonnegative(cells.links[CELL, i])
    column, row = column_and_row(cell, mesh)
    x, y = ks.position(i, now, state.balls)
    u, v = state.balls[U, i], state.balls[V, i]
    x -= mesh.left + mesh.width * (column + 0.5)
    y -= mesh.bottom + mesh.height * (row + 0.5)
    x, y = state.boundary.nearest_image(x, y)
    return crossing_delay(x, u, mesh.width), crossing_delay(y, v, mesh.height)
