"""The exact twin: hard disks in a circle or a box as a textbook has them, to any number of digits.

Nothing of the engine is used. Between its collisions a body is on the line (x + u t, y + v t), with
t the time since the start, so that only a collision changes x, y, u and v. The numbers start as
the very doubles of the scene. Chaos eats digits: those a run needs are taken from its number of
events, and a second run with half as many again says how many of its events are certain.

Symbols: (x, y) offset and (u, v) relative velocity at t = 0; b = x.w; w2 = |w|^2; d contact
distance. A contact is a root of |x + w t| = d: for two balls the smaller one, for a ball in a
circle, with d = R - r, the larger one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from mpmath import MPContext

from snooker_cli.containers import Box, Circle
from snooker_cli.engine import replay, simulate
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import CONTAINER, Events

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Events


Number: TypeAlias = Any
"""A number of mpmath's, with the digits of its context."""

SPARE_DIGITS = 30
"""The 17 of a double, and 13 for places that are differences of larger numbers."""

DIGITS_PER_EVENT = 0.09
"""What chaos eats: the dilute scene's Lyapunov exponent, 0.196 an event, is 0.085 digits."""

MOST_DIGITS = 2000
"""More are not tried unasked: what is still uncertain then depends on no digit, as ties do."""


@dataclass
class Body:
    """A ball, or the container, and the line it is on: m, m/s, kg."""

    x: Number
    y: Number
    u: Number
    v: Number
    radius: Number
    mass: Number

    def turn(self, u: Number, v: Number, time: Number) -> None:
        """Change the velocity by (u, v) at a time; the place at that time stays."""
        self.u += u
        self.v += v
        self.x -= u * time
        self.y -= v * time

    def place(self, time: Number) -> tuple[Number, Number]:
        """Where it is at a time."""
        return self.x + self.u * time, self.y + self.v * time


class Collision(NamedTuple):
    """A collision of balls i < j, or of ball i and the container if j is -1; s, kg m/s."""

    time: Number
    i: int
    j: int
    impulse: Number


class Twin:
    """A scene under way, in numbers of so many decimal digits.

    Raises ``ValueError`` for a periodic box.
    """

    def __init__(self, scene: Scene, digits: int) -> None:
        container = scene.container
        if not container.has_wall:
            raise ValueError("the exact twin knows circles and boxes, not periodic ones")
        self.mathematics = MPContext()
        self.mathematics.dps = digits
        number = self.mathematics.mpf
        self.never = self.mathematics.inf
        self.box = isinstance(container, Box)
        self.free = scene.free
        self.half_sides = [number(side) / 2 for side in container.size]
        self.restitution = number(scene.restitution)
        self.wall_restitution = number(scene.wall_restitution)
        columns = np.column_stack([scene.positions, scene.velocities, scene.radii, scene.masses])
        self.balls = [Body(*map(number, row)) for row in columns.tolist()]
        centre = [*scene.container_position.tolist(), *scene.container_velocity.tolist()]
        radius = container.radius if isinstance(container, Circle) else math.nan
        self.container = Body(*map(number, (*centre, radius, scene.container_mass)))
        self.now = number(0)
        # Ties go to the first: in the order of balls, and the wall before other balls.
        self.contacts: dict[tuple[int, int], Number] = {
            (i, j): self.contact_time(i, j)
            for i in range(len(self.balls))
            for j in (CONTAINER, *range(i + 1, len(self.balls)))
        }

    def collisions(self) -> Iterator[Collision]:
        """The collisions in their order, as long as there are any."""
        while True:
            i, j = min(self.contacts, key=self.contacts.__getitem__)
            time = self.contacts[i, j]
            if time == self.never:
                return
            self.now = time
            impulse = self.collide(i, j)
            self.predict(i, j)
            yield Collision(time, i, j, impulse)

    def predict(self, i: int, j: int) -> None:
        """Renew the contacts of those that have just collided."""
        for pair in self.contacts:
            moved = pair[1] == CONTAINER and j == CONTAINER and self.free
            if moved or i in pair or (j in pair and j != CONTAINER):
                self.contacts[pair] = self.contact_time(*pair)
        if j != CONTAINER:
            self.contacts[i, j] = self.never  # two disks that have collided part or stay together

    def contact_time(self, i: int, j: int) -> Number:
        """When two bodies will touch; now if they do already, and approach."""
        if j != CONTAINER:
            time = self.pair_time(self.balls[i], self.balls[j])
        elif self.box:
            time = min(self.side_times(self.balls[i]))
        else:
            time = self.wall_time(self.balls[i])
        return max(time, self.now)

    def pair_time(self, first: Body, second: Body) -> Number:
        """The smaller root for two balls, if they approach."""
        x, y, u, v = self.relative(first, second)
        b, w2 = x * u + y * v, u * u + v * v
        if b + w2 * self.now >= 0:
            return self.never
        discriminant = b * b - w2 * (x * x + y * y - (first.radius + second.radius) ** 2)
        if discriminant < 0:
            return self.never
        return (-b - self.mathematics.sqrt(discriminant)) / w2

    def wall_time(self, ball: Body) -> Number:
        """The larger root for a ball in a circle, unless it rests there."""
        x, y, u, v = self.relative(self.container, ball)
        b, w2 = x * u + y * v, u * u + v * v
        if w2 == 0:
            return self.never
        discriminant = b * b - w2 * (x * x + y * y - (self.container.radius - ball.radius) ** 2)
        if discriminant < 0:  # it sticks out by a rounding of the scene and will not come back in
            return self.now
        return (-b + self.mathematics.sqrt(discriminant)) / w2

    def side_times(self, ball: Body) -> list[Number]:
        """When a ball is at the side of the box that it moves to: across, and up or down."""
        x, y, u, v = self.relative(self.container, ball)
        return [
            self.never if w == 0 else ((half - ball.radius) * (1 if w > 0 else -1) - p) / w
            for p, w, half in zip((x, y), (u, v), self.half_sides, strict=True)
        ]

    def relative(self, first: Body, second: Body) -> tuple[Number, Number, Number, Number]:
        """The second body's line less the first's."""
        return second.x - first.x, second.y - first.y, second.u - first.u, second.v - first.v

    def collide(self, i: int, j: int) -> Number:
        """Turn the normal relative velocity g into -e g; the impulse."""
        ball = self.balls[i]
        if j != CONTAINER:
            return self.exchange(ball, self.balls[j], self.restitution)
        if not self.box:
            return self.exchange(ball, self.container, self.wall_restitution)
        across, along = self.side_times(ball)
        factor = 1 + self.wall_restitution
        u, v = (factor * ball.u, 0) if across <= along else (0, factor * ball.v)
        ball.turn(-u, -v, self.now)
        return ball.mass * abs(u + v)

    def exchange(self, first: Body, second: Body, restitution: Number) -> Number:
        """Exchange the impulse J = (1 + e) mu g along the line of centres; its size.

        It pushes balls apart, and a ball in a circle inwards: there g is negative.
        """
        (x1, y1), (x2, y2) = first.place(self.now), second.place(self.now)
        x, y = x2 - x1, y2 - y1
        distance = self.mathematics.sqrt(x * x + y * y)
        x, y = x / distance, y / distance
        normal_velocity = (first.u - second.u) * x + (first.v - second.v) * y
        reduced_mass = 1 / (1 / first.mass + 1 / second.mass)
        impulse = (1 + restitution) * reduced_mass * normal_velocity
        first.turn(-impulse / first.mass * x, -impulse / first.mass * y, self.now)
        second.turn(impulse / second.mass * x, impulse / second.mass * y, self.now)
        return abs(impulse)

    def state(self) -> NDArray[np.float64]:
        """x, y, u, v of the balls, and of the container in the last row, rounded; now."""
        bodies = (*self.balls, self.container)
        return np.array(
            [[*map(float, body.place(self.now)), float(body.u), float(body.v)] for body in bodies]
        )


@dataclass(frozen=True)
class Trajectory:
    """What happens in a scene, each number rounded to the nearest double.

    events : its first collisions, fewer if no more happen
    states : (1 + *n*, *N* + 1, 4), at the start and just after each event: x, y (m), u, v (m/s) of
        each ball and, in the last row, of the container
    certain : how many events, from the first, come out as the same doubles, states and all, when
        they are computed with ``check_digits`` instead of ``digits``
    """

    scene: Scene
    events: Events
    states: NDArray[np.float64]
    certain: int
    digits: int
    check_digits: int


def trajectory(scene: Scene, collisions: int, digits: int | None = None) -> Trajectory:
    """The exact course of a scene from its doubles.

    digits : of the first run; the second has half as many again. If not given, they are taken from
        the number of events, and doubled as long as that makes more events certain

    Raises ``ValueError`` for a periodic box.
    """
    attempt = digits or math.ceil(SPARE_DIGITS + DIGITS_PER_EVENT * collisions)
    found = _with_digits(scene, collisions, attempt)
    while digits is None and found.certain < len(found.events) and attempt < MOST_DIGITS:
        attempt *= 2
        better = _with_digits(scene, collisions, attempt)
        if better.certain <= found.certain:
            break
        found = better
    return found


def _with_digits(scene: Scene, collisions: int, digits: int) -> Trajectory:
    """Two runs and what they agree on."""
    check_digits = digits + (digits + 1) // 2
    check, states = _run(scene, collisions, check_digits)
    other, other_states = _run(scene, collisions, digits)
    same = [
        one == another and np.array_equal(state, other_state)
        for one, another, state, other_state in zip(
            check, other, states[1:], other_states[1:], strict=False
        )
    ]
    certain = same.index(False) if False in same else len(same)
    time, i, j, impulse = zip(*check, strict=True) if check else ((), (), (), ())
    events = Events(
        np.array(time, dtype=np.float64),
        np.array(i, dtype=np.int32),
        np.array(j, dtype=np.int32),
        np.array(impulse, dtype=np.float64),
    )
    return Trajectory(scene, events, states, certain, digits, check_digits)


def _run(
    scene: Scene, collisions: int, digits: int
) -> tuple[list[tuple[float, int, int, float]], NDArray[np.float64]]:
    """Events and states of one run, rounded."""
    twin = Twin(scene, digits)
    events, states = [], [twin.state()]
    for time, i, j, impulse in islice(twin.collisions(), collisions):
        events.append((float(time), i, j, float(impulse)))
        states.append(twin.state())
    return events, np.array(states)


# How far ahead a scene can be computed: where the engine and the exact twin part ways.

SMALL, LARGE = 1e-13, 1e-3
"""The growth rate is fitted where the error of place, m, is beyond rounding and still linear."""


@dataclass(frozen=True)
class Question:
    """A kind of scene, a repeat each, and its Lyapunov exponent, 1/event, as known from elsewhere.

    The exponents are from pairs of runs whose starts differ by one rounding.
    """

    name: str
    what: str
    exponent: float
    repeats: int
    start: Callable[[int], Scene]

    @property
    def estimate(self) -> float:
        """Events until an error of one rounding is as large as what it is an error of."""
        return math.log(1 / EPSILON) / self.exponent


@dataclass(frozen=True)
class Horizon:
    """What was found in one repeat.

    parted : events before the first in which the engine has other bodies collide
    exponent : growth rate of the error of place, 1/event; nan if too few errors are in its range
    certain, digits : of the exact twin
    """

    repeat: int
    parted: int
    exponent: float
    certain: int
    digits: int


def horizon(question: Question, repeat: int) -> Horizon:
    """Follow a repeat until the engine and the exact twin part ways."""
    scene, collisions = question.start(repeat), math.ceil(question.estimate)
    while True:
        truth = trajectory(scene, collisions)
        trace = simulate(scene, collisions=collisions)
        assert trace.events is not None
        parted = first_different(trace.events, truth.events)
        if parted < truth.certain or truth.certain < collisions:
            break
        collisions = math.ceil(1.25 * collisions)
    times = truth.events.time[:parted]
    times = times[times <= trace.stop.time]
    places = replay(trace, times).positions
    errors = rms_distance(places, truth.states[1 : len(times) + 1, :-1, :2])
    kept = np.flatnonzero((errors > SMALL) & (errors < LARGE))
    exponent = math.nan
    if len(kept) > 1:
        exponent = float(np.polyfit(kept, np.log(errors[kept]), 1)[0])
    return Horizon(repeat, parted, exponent, truth.certain, truth.digits)


def first_different(events: Events, truth: Events) -> int:
    """How many events there are before the first in which other bodies collide, or the last."""
    common = min(len(events), len(truth))
    differs = (events.i[:common] != truth.i[:common]) | (events.j[:common] != truth.j[:common])
    return int(np.argmax(differs)) if differs.any() else common


def rms_distance(
    positions: NDArray[np.float64], others: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Root mean square over the balls of how far they are apart, (*k*,), m."""
    squares = np.sum((positions - others) ** 2, axis=2)
    mean: NDArray[np.float64] = np.sqrt(np.mean(squares, axis=1))
    return mean
