"""The arrays of a repeat, and the names of their rows.

Compiled loops over a row of a C-contiguous array run in vector registers.

What differs between types of scenes has a class for each: boundary, sizes, surface and frame of
``State``. Kernels call their methods. A base class, such as ``edge.Edge``, says what each method
does, and has what it does for most scenes.
"""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine.jit import called_by_kernels, inlined
from snooker_cli.trace import CONTAINER

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Indices: TypeAlias = NDArray[np.int32]
Flags: TypeAlias = NDArray[np.bool_]
Records: TypeAlias = NDArray[np.void]
"""Events, with their columns as ``fields.EVENT_COLUMNS`` names them."""

NO_PARTNER = CONTAINER  # the wall
SEARCH_AGAIN = -2  # no ball, or no certain wall, up to a time; never recorded, as SLIDE is
NOT_SEARCHED = -3  # nothing has been searched yet

# Rows of ``balls``, one column per ball: position (m), velocity (m/s) and the ball's own clock (s).
# A ball moves only in its own events. A free container's ``motion`` has the same five as elements.
X, Y, U, V, CLOCK, BALL_ROWS = range(6)

# Rows of ``history``: how many events a ball has had; and the ball that it last collided with, or
# NO_PARTNER less the hits of the wall that it has had since, and not more than MOST_HITS of them.
EVENTS, FORMER, HISTORY_ROWS = range(3)
MOST_HITS = 2**30

# Elements of ``sums``: how long a contact lasts, the time at which clocks show zero, the clock at
# the last event, at the last event that moved it, and at the end of the repeat (s); the impulse on
# the wall (kg m/s), the virial of the ball-ball collisions (kg m^2/s), and what rounding has cut
# off from these two.
CONTACT_LASTS, EPOCH, NOW, STILL_SINCE, TIME_LIMIT = range(5)
WALL_IMPULSE, PAIR_VIRIAL, WALL_IMPULSE_REST, PAIR_VIRIAL_REST, SUMS = range(5, 10)
REST = WALL_IMPULSE_REST - WALL_IMPULSE

# Elements of ``account``: the energy that walls have given, and that collisions between balls have
# taken, J, and what rounding has cut off from these two.
FROM_WALLS, LOST, FROM_WALLS_REST, LOST_REST, ACCOUNT = range(5)
ACCOUNT_REST = FROM_WALLS_REST - FROM_WALLS

# Elements of ``counts``: events at the wall and between balls; the balls of the last event; events
# in a row that did not move the clock, and the balls that collided since it last moved. With a
# thermal wall one more: the key of its random numbers.
WALL_EVENTS, PAIR_EVENTS, FIRST, SECOND, STALLED, INVOLVED, COUNTS = range(7)
KEY = COUNTS

# Rows of ``Everyone.times``, s, which a boundary that moves enters too: a ball's earliest contact
# with another, or when it searches again; its hit of the wall; the earlier of the two; and of each
# lane of balls the least of these, see ``soonest``.
PAIR_TIME, WALL_TIME, NEXT_TIME, LANE_TIME, TIME_ROWS = range(5)

NO_LIMIT = 2**62  # as good as no limit for a number of events


@called_by_kernels
class Part:
    """Of a state, or beside it; stacked for many repeats."""

    def of_repeat(self, repeat: int) -> Any:
        """The part of one of many stacked repeats: the same if it has no arrays."""
        return self

    def set_back(self, shift: float) -> None:
        """Set the part's clocks back by a shift, s: most have none."""


class Setup(NamedTuple):
    """What collisions do in a repeat, in SI units.

    laws : (restitution.LAWS, restitution.COLUMNS), what hits do to the normal speed
    contact_path : m, what a ball flies while a contact lasts in the TC model; zero without it
    elastic_below : m/s, relative normal speed below which collisions are elastic; zero for never
    traps : whether every hit of a circle loses its share, so that infinitely many may follow
    package_laws : laws of installed packages, a ``package_laws.PackageLaws``
    settling : how many more collisions balls that touch may need in an instant than equal ones, see
        ``clock.has_collapsed``
    """

    laws: Floats
    contact_path: float
    elastic_below: float
    traps: bool
    package_laws: Any
    settling: float


class State(NamedTuple):
    """The state of a repeat, as the event loop and a replay have it.

    It decides how the repeat goes on; ``Everyone`` and ``Cells`` only find out quickly.

    The states of many repeats of one point are one state too, with stacked arrays: balls, history,
    sums, counts, account, scratch and the arrays of the boundary have one axis more, the first.

    balls : (BALL_ROWS or more, *N*), seen from ``origin_of``
    history : (HISTORY_ROWS, *N*); a replay leaves it as it is
    boundary : the container's, an ``edge.Edge`` of ``boundaries`` or ``sliding``
    sizes : radii and masses, ``EqualBalls`` or ``UnequalBalls``
    surface : of the balls, a ``surfaces.BallSurface``
    frame : in which places and velocities of balls, and of a free container, are, a
        ``frames.Frame``
    labels : (*N*,), the scene's number of each column; (0,) if columns are in the scene's order
    sums, counts : (SUMS,) and (COUNTS,)
    account : (ACCOUNT,); (0,) unless walls give energy
    scratch : memory for sums over balls in the scene's order, and for balls that slide
    """

    setup: Setup
    balls: Floats
    history: Indices
    boundary: Any
    sizes: "Sizes"
    surface: Any
    frame: Any
    labels: Indices
    sums: Floats
    counts: Integers
    account: Floats
    scratch: Floats

    @property
    def collisions(self) -> int:
        return int(self.counts[WALL_EVENTS] + self.counts[PAIR_EVENTS])


@inlined
def state_of(states: State, repeat: int) -> State:
    """The state of a repeat, in the memory of the stacked states."""
    return State(
        states.setup,
        states.balls[repeat],
        states.history[repeat],
        states.boundary.of_repeat(repeat),
        states.sizes,
        states.surface.of_repeat(repeat),
        states.frame.of_repeat(repeat),
        states.labels,
        states.sums[repeat],
        states.counts[repeat],
        states.account[repeat],
        states.scratch[repeat],
    )


# Radii and masses


@called_by_kernels
class Sizes:
    """Radii and masses of balls."""

    def radius_of(self, i: int) -> float:
        """Radius of ball i, m."""
        raise NotImplementedError

    def mass_of(self, i: int) -> float:
        """Mass of ball i, kg."""
        raise NotImplementedError

    def sizes_between(self, start: int, stop: int) -> "Sizes":
        """The sizes of some balls, counted from 0."""
        raise NotImplementedError


class EqualBalls(Sizes, NamedTuple("EqualBalls", [("radius", float), ("mass", float)])):
    """The radius (m) and the mass (kg) of every ball."""

    def radius_of(self, _i: int) -> float:
        return self.radius

    def mass_of(self, _i: int) -> float:
        return self.mass

    def sizes_between(self, _start: int, _stop: int) -> "EqualBalls":
        return self


class UnequalBalls(Sizes, NamedTuple("UnequalBalls", [("radii", Floats), ("masses", Floats)])):
    """The radius (m) and the mass (kg) of each ball, (*N*,)."""

    def radius_of(self, i: int) -> float:
        return float(self.radii[i])

    def mass_of(self, i: int) -> float:
        return float(self.masses[i])

    def sizes_between(self, start: int, stop: int) -> "UnequalBalls":
        return UnequalBalls(self.radii[start:stop], self.masses[start:stop])


@inlined
def contact_distance(sizes: Sizes, i: int, k: int) -> float:
    """Distance of the centres of two balls that touch, m."""
    return sizes.radius_of(i) + sizes.radius_of(k)


# Places


@inlined
def position(i: int, now: float, balls: Floats) -> tuple[float, float]:
    """Where ball i is at a time on a straight way, m."""
    age = now - balls[CLOCK, i]
    return balls[X, i] + balls[U, i] * age, balls[Y, i] + balls[V, i] * age


@inlined
def begin_epoch(state: State, epoch: float, shift: float) -> None:
    """Set all clocks back by a shift, s; the epoch is the time at which they then show zero."""
    sums, clocks = state.sums, state.balls[CLOCK]
    clocks -= shift
    state.boundary.set_back(shift)
    state.frame.set_back(shift)
    sums[NOW] -= shift
    sums[STILL_SINCE] -= shift
    sums[TIME_LIMIT] -= shift
    sums[EPOCH] = epoch


@inlined
def label_of(i: int, labels: Indices) -> int:
    """The scene's number of a column, or of the wall, which has its own."""
    return int(labels[i]) if len(labels) > 0 and i >= 0 else i


@inlined
def in_order(i: int, j: int, labels: Indices) -> tuple[int, int]:
    """Ball i and its partner, of two balls that with the lesser number in the scene first."""
    if j < 0:
        return i, j
    if len(labels) > 0:
        return (i, j) if labels[i] < labels[j] else (j, i)
    return min(i, j), max(i, j)


# History


@inlined
def hits_in_a_row(i: int, state: State) -> int:
    """How often ball i has hit the wall since it last collided with another."""
    return max(NO_PARTNER - int(state.history[FORMER, i]), 0)


@inlined
def parted_from(i: int, state: State) -> int:
    """The ball that ball i parted from in the last event of both; negative if there is none."""
    k = int(state.history[FORMER, i])
    return k if k >= 0 and state.history[FORMER, k] == i else NO_PARTNER


@inlined
def note_collision(i: int, j: int, state: State) -> None:
    """Note a collision of balls i and j, or of ball i with the wall, in their histories."""
    history = state.history
    history[EVENTS, i] += 1
    if j < 0:
        history[FORMER, i] = NO_PARTNER - min(hits_in_a_row(i, state) + 1, MOST_HITS)
        return
    history[EVENTS, j] += 1
    history[FORMER, i] = j
    history[FORMER, j] = i


@inlined
def note_slide(i: int, state: State) -> None:
    """Note in its history that ball i begins to slide along the wall."""
    state.history[EVENTS, i] += 1
    state.history[FORMER, i] = NO_PARTNER
