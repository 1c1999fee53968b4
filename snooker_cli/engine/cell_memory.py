"""The memory of the cells: what is where, and why it is read in two ways.

A large gas waits for memory. So all that others need of a ball is one line of the processor's
cache: 64 bytes that begin at a multiple of 64. Each column of ``State.balls`` is such a line:

    bytes    0    8   16   24   32     40            48             56      60
    floats   X    Y    U    V   CLOCK  CONTACT_TIME  CROSSING_TIME  (history)
    int32                                                           EVENTS  FORMER

The last eight bytes are no double but two integers of 32 bits: ``State.history``. ``Tree.bits`` are
the tree's times read as integers of 64 bits, which have the same order (``bit_tricks``). Both are
views: writing one changes the other. ``Cells.links``, half a line for each ball, has what only the
ball itself needs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.jit import called_by_kernels
from snooker_cli.engine.kernel_state import Flags, Floats, Indices, Integers, State
from snooker_cli.engine.prediction import next_hit

LEAST_MEMBERS = 4  # balls that every cell has room for, at least
LINE = 64  # bytes of a line of the processor's cache

# Further rows of ``State.balls``: when the ball next touches a ball or the wall, and when it leaves
# its cell, s.
CONTACT_TIME, CROSSING_TIME, CELL_BALL_ROWS = 5, 6, 8

# Rows of ``Cells.links``, half a line per ball: the partner of a ball's earliest contact, and its
# number of events when the contact was found; the ball's cell, and its place among the members; and
# whether it is listed in ``Margin.brink``.
PARTNER, PARTNER_EVENTS, CELL, PLACE, BRINK, LINK_ROWS = 0, 1, 2, 3, 4, 8


class Mesh(NamedTuple):
    """Where the cells are: their sides (m), the lower left corner of the first (m), how many."""

    width: float
    height: float
    left: float
    bottom: float
    columns: int
    rows: int
    shift: int


class Tree(NamedTuple):
    """The nodes' times (s), and the same memory as integers; see ``event_queue``.

    followed : (CHILDREN**WATCHED,), s, of those watched nodes whose events are being fetched ahead
    """

    times: Floats
    bits: Integers
    followed: Floats


@called_by_kernels
class Margin:
    """Where a container may be until all is predicted again. It stays, unless a method says so."""

    def wall_contact(
        self, i: int, now: float, exact: bool, state: State, cells: "Cells"
    ) -> tuple[float, int]:
        """When ball i hits the wall, s, and NO_PARTNER; or SEARCH_AGAIN, and a time before that."""
        return next_hit(i, state), ks.NO_PARTNER

    def push(self, now: float, state: State, cells: "Cells") -> None:
        """Predict again what the new velocity of a free container changes."""

    def before_renewal(self, time: float) -> float:
        """The time, or when a free container may leave its margin, if that is earlier; s."""
        return time


class NoMargin(Margin, NamedTuple("NoMargin", [("region", None)])):
    """Of a fixed container."""


class Cells(NamedTuple):
    """The balls in their cells, and what each does next.

    members : (*c*, *k*), the balls of each cell, in no order
    occupancy : (*c*,), how many they are
    at_wall : (*c*,), whether a ball can touch the wall from this cell
    near : memory for the balls of nine cells
    links : (LINK_ROWS, *N*)
    margin : a ``cells.Margin``
    """

    mesh: Mesh
    members: Indices
    occupancy: Indices
    at_wall: Flags
    near: NDArray[np.uint32]
    links: Indices
    tree: Tree
    margin: Margin


def aligned_zeros(number: int) -> Floats:
    """This many zeros, from the beginning of a line of the cache on."""
    memory = np.zeros(number + LINE // 8)
    begin = -memory.ctypes.data % LINE // memory.itemsize
    return memory[begin : begin + number]


def ball_memory(number: int) -> tuple[Floats, Indices]:
    """(CELL_BALL_ROWS, *number*) ``State.balls`` in which each ball is a line of the cache.

    The second array is the ``State.history`` in it. Its further rows are those of the next ball:
    so both arrays have a contiguous axis.
    """
    memory = aligned_zeros(CELL_BALL_ROWS * (number + 1))
    lines, ends = memory[:-CELL_BALL_ROWS], memory[CELL_BALL_ROWS - 1 : -1]
    history = ends.view(np.int32).reshape(number, 2 * CELL_BALL_ROWS)
    return lines.reshape(number, -1).T, history.T


def room_for(capacity: int, number: int) -> tuple[Indices, NDArray[np.uint32]]:
    """Memory for the members of a number of cells, and for those of nine."""
    members = np.zeros((number, capacity), dtype=np.int32)
    return members, np.zeros(9 * capacity + 4, dtype=np.uint32)
