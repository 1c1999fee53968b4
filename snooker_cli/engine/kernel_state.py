"""The arrays of a repeat, and the names of their rows.

Compiled loops over a row of a C-contiguous array run in vector registers.

What differs between types of scenes has a class for each: ``State.boundary`` and ``State.sizes``.
A function ``by_class``, such as ``nearest_image``, is compiled as the method of its name of that
class. Without such a method it is compiled as it stands here, for all others.
"""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine.jit import by_class, inlined
from snooker_cli.laws import Law
from snooker_cli.trace import CONTAINER

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Indices: TypeAlias = NDArray[np.int32]
Flags: TypeAlias = NDArray[np.bool_]

NO_PARTNER = CONTAINER  # the wall
SEARCH_AGAIN = -2  # no ball, or no certain wall, up to a time; never recorded, as SLIDE is
NOT_SEARCHED = -3  # nothing has been searched yet

# Rows of ``balls``, one column per ball: position (m), velocity (m/s) and the ball's own clock (s).
# A ball moves only in its own events. A free container's ``motion`` has the same five as elements.
X, Y, U, V, CLOCK, BALL_ROWS = range(6)

# Elements of ``sums``: how long a contact lasts, the time at which clocks show zero, the clock at
# the last event, at the last event that moved it, and at the end of the repeat (s); the impulse on
# the wall (kg m/s), the virial of the ball-ball collisions (kg m^2/s), and what rounding has cut
# off from these two.
CONTACT_LASTS, EPOCH, NOW, STILL_SINCE, TIME_LIMIT = range(5)
WALL_IMPULSE, PAIR_VIRIAL, WALL_IMPULSE_REST, PAIR_VIRIAL_REST, SUMS = range(5, 10)
REST = WALL_IMPULSE_REST - WALL_IMPULSE

# Elements of ``counts``: events at the wall and between balls; the balls of the last event; events
# in a row that did not move the clock, and the balls that collided since it last moved. With a
# thermal wall one more: the key of its random numbers.
WALL_EVENTS, PAIR_EVENTS, FIRST, SECOND, STALLED, INVOLVED, COUNTS = range(7)
KEY = COUNTS

# Rows of all pairs' ``Agenda.times``, s: a ball's earliest contact with another, that with the
# wall, and the earlier of the two.
PAIR_TIME, WALL_TIME, NEXT_TIME, TIME_ROWS = range(4)

NO_LIMIT = 2**62  # as good as no limit for a number of events


class Setup(NamedTuple):
    """What collisions do in a repeat, in SI units.

    wall_law : a law, ``SideLaws`` or ``ThermalWall``
    contact_path : m, what a ball flies while a contact lasts in the TC model; zero without it
    elastic_below : m/s, relative normal speed below which collisions are elastic; zero for never
    traps : whether every hit of a circle loses its share, so that infinitely many may follow
    patience : bounces in a row after which a ball that no other can reach counts as trapped
    settling : how many more collisions balls that touch may need in an instant than equal ones, see
        ``clock.has_collapsed``
    """

    pair_law: Law
    wall_law: Any
    contact_path: float
    elastic_below: float
    traps: bool
    patience: int
    settling: float


class State(NamedTuple):
    """The state of a repeat, as both engines and a replay have it.

    The states of many repeats of one point are one state too, with stacked arrays: balls, sums,
    counts, scratch and the arrays of the boundary have one axis more, the first.

    balls : (BALL_ROWS or more, *N*), seen from ``origin_of``
    boundary : the edge of the container, of a class of ``boundaries`` or ``sliding``
    sizes : radii and masses, ``EqualBalls`` or ``UnequalBalls``
    labels : (*N*,), the scene's number of each column; (0,) if columns are in the scene's order
    sums, counts : (SUMS,) and (COUNTS,)
    account : ``sampling.EnergyAccount``; ``None`` unless walls give energy
    scratch : memory for sums over balls in the scene's order, and for balls that slide
    """

    setup: Setup
    balls: Floats
    boundary: Any
    sizes: Any
    labels: Indices
    sums: Floats
    counts: Integers
    account: Any
    scratch: Floats

    @property
    def collisions(self) -> int:
        return int(self.counts[WALL_EVENTS] + self.counts[PAIR_EVENTS])

    def next_epoch(self, epoch: float, shift: float) -> None:
        """Set all clocks back by a shift, s; the epoch is the time at which they then show zero."""
        self.balls[CLOCK] -= shift
        set_back(self.boundary, shift)
        self.sums[[NOW, STILL_SINCE, TIME_LIMIT]] -= shift
        self.sums[EPOCH] = epoch


@inlined
def state_of(states: State, repeat: int) -> State:
    """The state of a repeat, in the memory of the stacked states."""
    return State(
        states.setup,
        states.balls[repeat],
        of_repeat(states.boundary, repeat),
        states.sizes,
        states.labels,
        states.sums[repeat],
        states.counts[repeat],
        of_repeat(states.account, repeat),
        states.scratch[repeat],
    )


class Recorded(NamedTuple):
    """A chunk of events, filled by the kernel: s, ball, ball or -1, kg m/s."""

    time: Floats
    i: Indices
    j: Indices
    impulse: Floats


# Radii and masses


class EqualBalls(NamedTuple):
    """The radius (m) and the mass (kg) of every ball."""

    radius: float
    mass: float

    def radius_of(self, _i: int) -> float:
        return self.radius

    def mass_of(self, _i: int) -> float:
        return self.mass

    def sizes_between(self, _start: int, _stop: int) -> "EqualBalls":
        return self


class UnequalBalls(NamedTuple):
    """The radius (m) and the mass (kg) of each ball, (*N*,)."""

    radii: Floats
    masses: Floats

    def radius_of(self, i: int) -> float:
        return float(self.radii[i])

    def mass_of(self, i: int) -> float:
        return float(self.masses[i])

    def sizes_between(self, start: int, stop: int) -> "UnequalBalls":
        return UnequalBalls(self.radii[start:stop], self.masses[start:stop])


Sizes: TypeAlias = EqualBalls | UnequalBalls


@by_class
def radius_of(sizes: Sizes, i: int) -> float:
    """Radius of ball i, m."""
    raise NotImplementedError


@by_class
def mass_of(sizes: Sizes, i: int) -> float:
    """Mass of ball i, kg."""
    raise NotImplementedError


@by_class
def sizes_between(sizes: Sizes, start: int, stop: int) -> Sizes:
    """The sizes of some balls, counted from 0."""
    raise NotImplementedError


@inlined
def contact_distance(sizes: Sizes, i: int, k: int) -> float:
    """Distance of the centres of two balls that touch, m."""
    return radius_of(sizes, i) + radius_of(sizes, k)


# Places


@inlined
def position(i: int, now: float, balls: Floats) -> tuple[float, float]:
    """Where ball i is at a time on a straight way, m."""
    age = now - balls[CLOCK, i]
    return balls[X, i] + balls[U, i] * age, balls[Y, i] + balls[V, i] * age


@by_class
def of_repeat(stacked: Any, repeat: int) -> Any:
    """The boundary or account of one of many stacked repeats: the same if it has no arrays."""
    return stacked


@by_class
def set_back(boundary: Any, shift: float) -> None:
    """Set the clocks of the boundary back by a shift, s: a fixed one has none."""


@by_class
def nearest_image(boundary: Any, x: float, y: float) -> tuple[float, float]:
    """The offset (x, y) to the nearest of a ball's images, m; without images, to itself."""
    return x, y


@by_class
def relative(
    boundary: Any, x: float, y: float, u: float, v: float, now: float
) -> tuple[float, float, float, float]:
    """A place (m) and a velocity (m/s) relative to the container's centre at a time, s."""
    return x, y, u, v


@by_class
def is_curved(boundary: Any) -> bool:
    """Whether balls may slide along the wall on curved ways, see ``sliding``."""
    return False


@by_class
def place(boundary: Any, i: int, now: float, balls: Floats) -> tuple[float, float]:
    """Where ball i is at a time, m: on a straight way, unless it slides."""
    return position(i, now, balls)


@by_class
def flight(
    boundary: Any, i: int, now: float, settles: bool, state: State
) -> tuple[float, float, float, float]:
    """Place (m) and velocity (m/s) of ball i at a time, s: on a straight way, unless it slides.

    settles : whether its next event sums up the bounces before it slides
    """
    balls = state.balls
    x, y = position(i, now, balls)
    return x, y, balls[U, i], balls[V, i]


@by_class
def container_flight(boundary: Any, now: float) -> tuple[float, float, float, float]:
    """Place (m) and velocity (m/s) of a free container at a time, s; zeros for a fixed one."""
    return 0.0, 0.0, 0.0, 0.0


@by_class
def take_off_wall(boundary: Any, i: int) -> bool:
    """Whether ball i slid up to its collision; it slides no longer."""
    return False
