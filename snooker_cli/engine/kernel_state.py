"""How the kernel's state lies in memory, and the names of its rows.

The state is a few plain arrays instead of objects: a compiled loop over one row of a C-contiguous
array runs in vector registers, and passing an array costs nothing. ``None`` stands for what a
scene lacks, and is compiled away.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Box, Circle
from snooker_cli.engine.jit import inlined

if TYPE_CHECKING:
    from snooker_cli.scene import Scene


Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Indices: TypeAlias = NDArray[np.int32]
Flags: TypeAlias = NDArray[np.bool_]

NOBODY, LOOK_AGAIN, LOOK = -1, -2, -3

# In an event instead of the wall: all bounces before a ball slides, or its pressing as it slid.
SLIDE = -2

# Rows of ``balls``, a column a ball: position (m), velocity (m/s) and the ball's own clock (s).
# A ball moves only in its own events. ``container`` has the same five as elements.
X, Y, U, V, CLOCK, BALL_ROWS = range(6)

# Among cells a ball's column is one line of a cache. When it next touches a ball or the wall, and
# when it leaves its cell (s), come next, and then two numbers that other balls ask for. These are
# the rows of ``tags``, the same memory as 32-bit integers: how many events the ball has had, and
# which it last collided with.
CONTACT_TIME, CROSSING_TIME, CELL_BALL_ROWS = 5, 6, 8
EVENTS, FORMER = 14, 15

# Rows of ``agenda``, s: the earliest contact of a ball with another, the one with the wall, and the
# earlier of the two.
PAIR_TIME, WALL_TIME, NEXT_TIME, AGENDA_ROWS = range(4)

# Rows of ``links``: the partner of the earliest contact (``LOOK`` if it has not been searched,
# ``LOOK_AGAIN`` if none was found before PAIR_TIME, up to which was searched), how many events it
# had had when the contact was predicted, the ball's own number of events, the ball it last collided
# with, and how often it has hit the wall since.
PARTNER, PARTNER_COUNT, COUNT, LAST, BOUNCES, LINK_ROWS = range(6)

# Among cells ``links`` are half a line for each ball. PARTNER, PARTNER_COUNT and BOUNCES are where
# they are without, and beside them the ball's cell, its place among the members, and whether it is
# on the brink of a free container's wall.
CELL, PLACE, BRINK, CELL_LINK_ROWS = 2, 3, 5, 8

# Elements of ``sums``: how long a contact lasts (s), when clocks are at zero (s), the clock of the
# last event (s), the impulse on the wall (kg m/s), the virial of the ball-ball collisions
# (kg m^2/s), and what rounding has left out of these two. Behind is room to
# keep the balls' states in where some slide, and the squares of their speeds where contacts last.
(
    CONTACT_LASTS,
    EPOCH,
    NOW,
    WALL_IMPULSE,
    PAIR_VIRIAL,
    WALL_IMPULSE_REST,
    PAIR_VIRIAL_REST,
    SUMS,
) = range(8)
REST = WALL_IMPULSE_REST - WALL_IMPULSE

# Elements of ``counts``: events at the wall and between balls; pairs that were looked at; events in
# a row that did not move the clock; the balls of the last event; crossings into another cell; and
# entries that came up stale.
(
    WALL_EVENTS,
    PAIR_EVENTS,
    PREDICTIONS,
    STALLED,
    FIRST,
    SECOND,
    CROSSINGS,
    STALE,
    COUNTS,
) = range(9)


@inlined
def ahead(index: int) -> int:
    """The same index, which the compiler then knows not to count from the end."""
    return int(index) & ((1 << 62) - 1)


class Setup(NamedTuple):
    """What does not change: sizes and masses (where they are equal), restitutions, limits.

    contact_path : m, what a ball flies while a contact lasts in the TC model; zero without it
    elastic_below : m/s, relative normal speed under which collisions are elastic; zero if none are
    """

    radius: float
    mass: float
    container_radius: float
    container_mass: float
    restitution: float
    wall_restitution: float
    contact_path: float
    elastic_below: float
    time_limit: float
    collision_limit: int

    @classmethod
    def of(cls, scene: Scene, time_limit: float = math.inf, collision_limit: int = 2**62) -> Setup:
        """The constants of a scene; of different radii or masses, the first."""
        container = scene.container
        return cls(
            radius=float(scene.radii[0]),
            mass=float(scene.masses[0]),
            container_radius=float(container.radius) if isinstance(container, Circle) else math.nan,
            container_mass=float(scene.container_mass),
            restitution=float(scene.restitution),
            wall_restitution=float(scene.wall_restitution),
            contact_path=(
                float(scene.contact_duration * scene.mean_free_path)
                if scene.contact_duration
                else 0.0
            ),
            elastic_below=float(scene.elastic_below),
            time_limit=float(time_limit),
            collision_limit=int(collision_limit),
        )


LINE = 64
"""Bytes of a line of a cache."""


def lines(number: int) -> Floats:
    """So many numbers, all zero, from the beginning of a line of the cache on."""
    room = np.zeros(number + LINE // 8)
    begin = -room.ctypes.data % LINE // room.itemsize
    return room[begin : begin + number]


def balls_of(scene: Scene) -> Floats:
    """The balls' state at the scene's instant, all clocks at zero, seen from ``origin_of``."""
    balls = np.zeros((BALL_ROWS, scene.number))
    balls[[X, Y]] = (scene.positions - origin_of(scene)).T
    balls[[U, V]] = scene.velocities.T
    return balls


def origin_of(scene: Scene) -> Floats:
    """Where the kernel's coordinates begin: at the centre of a fixed container, m."""
    return np.zeros(2) if scene.free else np.asarray(scene.container_position)


def container_of(scene: Scene) -> Floats | None:
    """The container's state, or ``None`` if it is fixed."""
    if not scene.free:
        return None
    return np.array([*scene.container_position, *scene.container_velocity, 0.0])


def slides_of(scene: Scene) -> Integers | None:
    """What each ball does, see ``slide``, none yet; or ``None`` if no ball may slide."""
    return np.zeros(scene.number, dtype=np.int64) if scene.slides else None


def half_sides_of(scene: Scene) -> Floats | None:
    """Half of the width and height of a box with walls, m."""
    return np.array(scene.container.size) / 2 if isinstance(scene.container, Box) else None


def period_of(scene: Scene) -> Floats | None:
    """Width and height of a periodic box, m."""
    period = scene.container.period
    return None if period is None else np.array(period)


def new_sums(scene: Scene) -> Floats:
    """Sums of a simulation that has not begun."""
    rows = BALL_ROWS if scene.slides else 1 if scene.contact_duration else 0
    return np.zeros(SUMS + rows * scene.number)


def new_counts() -> Integers:
    """Counts of a simulation that has not begun."""
    counts = np.zeros(COUNTS, dtype=np.int64)
    counts[[FIRST, SECOND]] = NOBODY
    return counts


def unlike(scene: Scene) -> tuple[Floats | None, Floats | None]:
    """Radii and masses ball by ball, or ``None`` if all are alike: then ``Setup`` has them."""
    if np.all(scene.radii == scene.radii[0]) and np.all(scene.masses == scene.masses[0]):
        return None, None
    return np.array(scene.radii), np.array(scene.masses)


class Recorded(NamedTuple):
    """A chunk of events, filled by the kernel: s, ball, ball or -1, kg m/s."""

    time: Floats
    i: NDArray[np.int32]
    j: NDArray[np.int32]
    impulse: Floats

    def after(self, filled: int) -> Recorded:
        """What is left of the chunk when so many events are in it."""
        return Recorded(self.time[filled:], self.i[filled:], self.j[filled:], self.impulse[filled:])


def room_for(events: int) -> Recorded:
    """Empty columns for so many events; for none, none are recorded."""
    return Recorded(
        np.empty(events),
        np.empty(events, dtype=np.int32),
        np.empty(events, dtype=np.int32),
        np.empty(events),
    )
