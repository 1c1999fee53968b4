"""The arrays of a repeat, and the names of their rows.

Compiled loops over a row of a C-contiguous array run in vector registers. A value is ``None`` if
the scene has no such part. Numba removes a branch on ``None`` only if the value is an argument of
the function, so functions take such a value beside the state.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Box, Circle
from snooker_cli.engine.jit import inlined
from snooker_cli.laws import Law
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Indices: TypeAlias = NDArray[np.int32]
Flags: TypeAlias = NDArray[np.bool_]

NO_PARTNER = CONTAINER  # the wall
SEARCH_AGAIN = -2  # no ball up to a time; search again then
NOT_SEARCHED = -3  # nothing has been searched yet

# Rows of ``balls``, one column per ball: position (m), velocity (m/s) and the ball's own clock (s).
# A ball moves only in its own events. ``container`` has the same five as elements.
X, Y, U, V, CLOCK, BALL_ROWS = range(6)

# Elements of ``sums``: how long a contact lasts, the time at which clocks show zero, the clock at
# the last event, and what clocks show when the repeat ends (s); the impulse on the wall (kg m/s),
# the virial of the ball-ball collisions (kg m^2/s), and what rounding has cut off from these two.
CONTACT_LASTS, EPOCH, NOW, TIME_LIMIT = range(4)
WALL_IMPULSE, PAIR_VIRIAL, WALL_IMPULSE_REST, PAIR_VIRIAL_REST, SUMS = range(4, 9)
REST = WALL_IMPULSE_REST - WALL_IMPULSE

# Elements of ``counts``: events at the wall and between balls; the balls of the last event; events
# in a row that did not move the clock.
WALL_EVENTS, PAIR_EVENTS, FIRST, SECOND, STALLED, COUNTS = range(6)

NO_LIMIT = 2**62  # as good as no limit for a number of events
PATIENCE = 64  # ``Setup.patience`` in a fixed container: two balls may be trapped in step


class Setup(NamedTuple):
    """The constants of a repeat, in SI units.

    radius, mass : of every ball if they are equal, else of the first
    contact_path : m, what a ball flies while a contact lasts in the TC model; zero without it
    elastic_below : m/s, relative normal speed below which collisions are elastic; zero for never
    traps : whether every hit of a circle loses its share, so that infinitely many may follow
    patience : bounces in a row after which a ball that no other can reach counts as trapped
    """

    radius: float
    mass: float
    container_radius: float
    container_mass: float
    pair_law: Law
    wall_law: Law
    contact_path: float
    elastic_below: float
    traps: bool
    patience: int

    @classmethod
    def of(cls, scene: Scene) -> "Setup":
        container, lasts = scene.container, scene.contact_duration
        law = scene.wall_law
        always_loses = law.constant and law.cor < 1.0 and not lasts and scene.elastic_below == 0.0
        return cls(
            radius=float(scene.radii[0]),
            mass=float(scene.masses[0]),
            container_radius=float(container.radius) if isinstance(container, Circle) else math.nan,
            container_mass=float(scene.container_mass),
            pair_law=type(scene.pair_law)(*map(float, scene.pair_law)),
            wall_law=type(scene.wall_law)(*map(float, scene.wall_law)),
            contact_path=float(lasts * scene.mean_free_path) if lasts else 0.0,
            elastic_below=float(scene.elastic_below),
            traps=bool(isinstance(container, Circle) and always_loses),
            patience=NO_LIMIT if scene.free or scene.slides else PATIENCE,
        )


class State(NamedTuple):
    """The state of a repeat, as both engines and a replay have it.

    The states of many repeats of one point are one state too, with stacked arrays: balls,
    container, slides, sums, counts and scratch have one axis more, the first.

    balls : (BALL_ROWS or more, *N*), seen from ``origin_of``
    container : (BALL_ROWS,), or ``None`` if it is fixed
    box : (2,), half the width and height of a box with walls, m
    period : (2,), width and height of a periodic box, m
    radii, masses : (*N*,), or ``None`` if all balls are equal
    slides : (*N*,), what each ball does, see ``sliding``; ``None`` if no ball may slide
    labels : (*N*,), the scene's number of each column; (0,) if columns are in the scene's order
    sums, counts : (SUMS,) and (COUNTS,)
    scratch : memory for sums over balls in the scene's order, and for balls that slide
    """

    setup: Setup
    balls: Floats
    container: Floats | None
    box: Floats | None
    period: Floats | None
    radii: Floats | None
    masses: Floats | None
    slides: Integers | None
    labels: Indices
    sums: Floats
    counts: Integers
    scratch: Floats

    @property
    def collisions(self) -> int:
        return int(self.counts[WALL_EVENTS] + self.counts[PAIR_EVENTS])

    def next_epoch(self, epoch: float, shift: float) -> None:
        """Set all clocks back by a shift, s; the epoch is the time at which they then show zero."""
        self.balls[CLOCK] -= shift
        if self.container is not None:
            self.container[CLOCK] -= shift
        self.sums[[NOW, TIME_LIMIT]] -= shift
        self.sums[EPOCH] = epoch


def new_states(
    scenes: Sequence[Scene], time_limit: float = math.inf, balls: Floats | None = None
) -> State:
    """The stacked states of repeats of one point at their start.

    balls : stacked memory for the balls, with BALL_ROWS or more rows
    """
    scene, repeats = scenes[0], len(scenes)
    number = scene.number
    balls = np.zeros((repeats, BALL_ROWS, number)) if balls is None else balls
    positions = np.stack([each.positions for each in scenes])
    positions -= np.stack([origin_of(each) for each in scenes])[:, np.newaxis]
    balls[:, [X, Y]] = positions.transpose(0, 2, 1)
    balls[:, [U, V]] = np.stack([each.velocities for each in scenes]).transpose(0, 2, 1)
    container = None
    if scene.free:
        places = [(*each.container_position, *each.container_velocity, 0.0) for each in scenes]
        container = np.array(places)
    shape = scene.container
    unequal = not scene.equal_balls
    sums, counts = np.zeros((repeats, SUMS)), np.zeros((repeats, COUNTS), dtype=np.int64)
    sums[:, TIME_LIMIT] = time_limit
    counts[:, [FIRST, SECOND]] = NO_PARTNER
    scratch_rows = BALL_ROWS if scene.slides else 1 if scene.contact_duration else 0
    return State(
        setup=Setup.of(scene),
        balls=balls,
        container=container,
        box=np.array(shape.size) / 2 if isinstance(shape, Box) else None,
        period=None if shape.period is None else np.array(shape.period),
        radii=np.array(scene.radii) if unequal else None,
        masses=np.array(scene.masses) if unequal else None,
        slides=np.zeros((repeats, number), dtype=np.int64) if scene.slides else None,
        labels=np.zeros(0, dtype=np.int32),
        sums=sums,
        counts=counts,
        scratch=np.zeros((repeats, scratch_rows, number)),
    )


@inlined
def part_of(array: Any, rows: int | slice) -> Any:
    """Some rows of an array, in the same memory, or ``None`` of ``None``."""
    if array is None:
        return None
    return array[rows]


@inlined
def state_of(states: State, repeat: int) -> State:
    """The state of a repeat, in the memory of the stacked states."""
    return State(
        states.setup,
        states.balls[repeat],
        part_of(states.container, repeat),
        states.box,
        states.period,
        states.radii,
        states.masses,
        part_of(states.slides, repeat),
        states.labels,
        states.sums[repeat],
        states.counts[repeat],
        states.scratch[repeat],
    )


def origin_of(scene: Scene) -> Floats:
    """Where the kernel's coordinates begin: at the centre of a fixed container, m."""
    return np.zeros(2) if scene.free else np.asarray(scene.container_position)


class Recorded(NamedTuple):
    """A chunk of events, filled by the kernel: s, ball, ball or -1, kg m/s."""

    time: Floats
    i: Indices
    j: Indices
    impulse: Floats


@inlined
def radius_of(i: int, setup: Setup, radii: Floats | None) -> float:
    """Radius of ball i, m."""
    if radii is None:
        return setup.radius
    return float(radii[i])


@inlined
def contact_distance(i: int, k: int, setup: Setup, radii: Floats | None) -> float:
    """Distance of the centres of two balls that touch, m."""
    return radius_of(i, setup, radii) + radius_of(k, setup, radii)


@inlined
def wall_reach(i: int, setup: Setup, radii: Floats | None) -> float:
    """Largest distance of ball i's centre from that of a circle, m."""
    return setup.container_radius - radius_of(i, setup, radii)


@inlined
def mass_of(i: int, setup: Setup, masses: Floats | None) -> float:
    """Mass of ball i, kg."""
    if masses is None:
        return setup.mass
    return float(masses[i])


@inlined
def position(i: int, now: float, balls: Floats) -> tuple[float, float]:
    """Where ball i is at a time on a straight way, m."""
    age = now - balls[CLOCK, i]
    return balls[X, i] + balls[U, i] * age, balls[Y, i] + balls[V, i] * age


@inlined
def seen_from_container(
    x: float, y: float, u: float, v: float, now: float, container: Floats | None
) -> tuple[float, float, float, float]:
    """A place (m) and a velocity (m/s) relative to the container's centre."""
    if container is None:
        return x, y, u, v
    age = now - container[CLOCK]
    x, y = x - (container[X] + container[U] * age), y - (container[Y] + container[V] * age)
    return x, y, u - container[U], v - container[V]
