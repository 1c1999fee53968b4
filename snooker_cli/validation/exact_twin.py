"""The exact twin: hard disks in a circle, box or channel, computed to any number of digits.

The twin uses nothing of the engine. Between its collisions a body is on the line x + w t with t the
time since the start. Vectors are complex numbers. The numbers start as the doubles of the scene.
Chaos loses digits: a run gets as many as its events need, and a second run shows how many of them
are certain.

Symbols: x offset and w relative velocity at t = 0; b = x.w; w2 = |w|^2; d contact distance. A
contact is a root of |x + w t| = d: the smaller one for two balls, and the larger one, with
d = R - r, for a ball in a circle. Channels have images of balls, by multiples of the height.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Box, Channel, Circle
from snooker_cli.laws import Constant, Driven, Law, Sides, Viscoelastic, word_of
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, Events
from snooker_cli.validation.methods import events_from_rows

Number: TypeAlias = Any  # a number of mpmath with the digits of its context
SPARE_DIGITS = 30  # the 17 of a double, and 13 for positions that are differences of larger numbers

DIGITS_PER_EVENT = 0.09
"""Digits lost to chaos: the dilute scene's Lyapunov exponent, 0.196 an event, is 0.085 digits."""


@dataclass
class Body:
    """A ball, or the container, and its line: m, m/s, kg."""

    place: Number
    velocity: Number
    radius: Number
    mass: Number

    def turn(self, change: Number, time: Number) -> None:
        """Add to the velocity at a time; the position at that time stays."""
        self.velocity += change
        self.place -= change * time

    def position(self, time: Number) -> Number:
        """Its position at a time."""
        return self.place + self.velocity * time


def dot(first: Number, second: Number) -> Number:
    return first.real * second.real + first.imag * second.imag


class Collision(NamedTuple):
    """A collision of balls i < j, or of ball i and the container if j is -1; s, kg m/s."""

    time: Number
    i: int
    j: int
    impulse: Number


class Twin:
    """A scene that evolves, in numbers with the given decimal digits.

    Raises ``ValueError`` for a periodic box, and for laws that it does not have, such as thermal
    walls.
    """

    def __init__(self, scene: Scene, digits: int) -> None:
        container = scene.container
        if not isinstance(container, Circle | Box | Channel):
            raise ValueError(f"the exact twin does not support a {container.title}")
        walls = scene.wall_law if isinstance(scene.wall_law, Sides) else (scene.wall_law,)
        for law in (scene.pair_law, *walls):
            if not isinstance(law, Constant | Viscoelastic | Driven):
                raise ValueError(f"the exact twin does not support the {word_of(law)} law")
        from mpmath import MPContext  # here: the report shows saved measurements without it

        self.mathematics = MPContext()
        self.mathematics.dps = digits
        number, vector = self.mathematics.mpf, self.mathematics.mpc
        self.never = self.mathematics.inf
        self.straight = not isinstance(container, Circle)
        self.repeats = isinstance(container, Channel)
        self.free = scene.free
        self.half_sides = [number(side) / 2 for side in container.size]
        self.height = number(container.size[1])
        self.pair_law, self.wall_law = scene.pair_law, scene.wall_law
        columns = (scene.positions, scene.velocities, scene.radii, scene.masses)
        self.balls = [
            Body(vector(*place), vector(*velocity), number(radius), number(mass))
            for place, velocity, radius, mass in zip(*(c.tolist() for c in columns), strict=True)
        ]
        place, velocity = scene.container_position.tolist(), scene.container_velocity.tolist()
        mass = number(scene.container_mass)
        self.container = Body(vector(*place), vector(*velocity), self.half_sides[0], mass)
        self.now = number(0)
        # Of simultaneous contacts the first counts: in the order of balls, the wall first.
        self.contacts: dict[tuple[int, int], Number] = {
            (i, j): self.contact_time(i, j)
            for i in range(len(self.balls))
            for j in (CONTAINER, *range(i + 1, len(self.balls)))
        }

    def collisions(self) -> Iterator[Collision]:
        """The collisions in their order, while there are any."""
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
        """Renew the contacts of two bodies that have just collided."""
        for pair in self.contacts:
            moved = pair[1] == CONTAINER and j == CONTAINER and self.free
            if moved or i in pair or (j in pair and j != CONTAINER):
                self.contacts[pair] = self.contact_time(*pair)
        if j != CONTAINER and not self.repeats:
            self.contacts[i, j] = self.never  # two disks that have collided part or stay together

    def contact_time(self, i: int, j: int) -> Number:
        """When two bodies touch; now if they touch and approach."""
        ball, other = self.balls[i], self.container if j == CONTAINER else self.balls[j]
        if j == CONTAINER and self.straight:
            return max(min(self.side_times(ball)), self.now)
        times = (self.disk_time(ball, other, shift) for shift in self.shifts(ball, other))
        return max(min(times), self.now)

    def shifts(self, ball: Body, other: Body) -> list[Number]:
        """The images of another ball that a ball may meet before either hits a wall, m.

        Without a hit to come both move along the channel alone, and meet the next image.
        """
        if not self.repeats:
            return [0]
        until = min(*self.side_times(ball), *self.side_times(other))
        times = (self.now, self.now if until == self.never else until)
        ends = sorted((ball.position(t) - other.position(t)).imag / self.height for t in times)
        images = range(int(ends[0]) - 2, int(ends[1]) + 3)
        return [self.mathematics.mpc(0, k * self.height) for k in images]

    def disk_time(self, ball: Body, other: Body, shift: Number) -> Number:
        """The smaller root for two balls that approach, the larger one for a ball in a circle."""
        inside = other is self.container
        x, w = other.place + shift - ball.place, other.velocity - ball.velocity
        b, w2 = dot(x, w), dot(w, w)
        if w2 == 0 or (not inside and b + w2 * self.now >= 0):
            return self.never
        distance = other.radius + (-ball.radius if inside else ball.radius)
        discriminant = b * b - w2 * (dot(x, x) - distance**2)
        if discriminant < 0:  # no contact; in a circle, out by a rounding of the scene to the end
            return self.now if inside else self.never
        root = self.mathematics.sqrt(discriminant)
        return (-b + (root if inside else -root)) / w2

    def side_times(self, ball: Body) -> list[Number]:
        """When a ball reaches the vertical and the horizontal side that it moves to."""
        x, w = ball.place - self.container.place, ball.velocity
        axes = ((x.real, w.real), (x.imag, 0 if self.repeats else w.imag))
        return [
            self.never
            if speed == 0
            else ((half - ball.radius) * (1 if speed > 0 else -1) - p) / speed
            for (p, speed), half in zip(axes, self.half_sides, strict=True)
        ]

    def collide(self, i: int, j: int) -> Number:
        """Change the velocities by the law of the pair or the wall; the impulse."""
        ball = self.balls[i]
        if j != CONTAINER:
            return self.exchange(ball, self.balls[j], self.pair_law)
        law = self.wall_law
        if not self.straight:
            assert not isinstance(law, Sides)
            return self.exchange(ball, self.container, law)
        across, along = self.side_times(ball)
        speed = ball.velocity.real if across <= along else ball.velocity.imag
        if isinstance(law, Sides):
            sides = (law.left, law.right) if across <= along else (law.bottom, law.top)
            law = sides[speed > 0]
        change = self.change(abs(speed), law)
        direction = (1 if speed > 0 else -1) * (1 if across <= along else 1j)
        ball.turn(-change * direction, self.now)
        return ball.mass * change

    def change(self, speed: Number, law: Law) -> Number:
        """By how much a collision changes a normal relative speed, m/s."""
        e = self.mathematics.mpf(law.cor)
        if isinstance(law, Driven):
            return (1 + e) * (speed + law.speed)
        if isinstance(law, Viscoelastic) and speed < law.cor_speed:
            e = 1 - (1 - e) * (speed / law.cor_speed) ** self.mathematics.mpf(0.75)
        return (1 + e) * speed

    def exchange(self, first: Body, second: Body, law: Law) -> Number:
        """Exchange an impulse along the line of centres; its size.

        The impulse pushes balls apart, and a ball in a circle inwards: there the normal velocity is
        negative.
        """
        offset = self.nearest(second.position(self.now) - first.position(self.now))
        normal = offset / abs(offset)
        normal_velocity = dot(first.velocity - second.velocity, normal)
        reduced_mass = 1 / (1 / first.mass + 1 / second.mass)
        size = reduced_mass * self.change(abs(normal_velocity), law)
        impulse = size if normal_velocity > 0 else -size
        first.turn(-impulse / first.mass * normal, self.now)
        second.turn(impulse / second.mass * normal, self.now)
        return size

    def nearest(self, vector: Number) -> Number:
        """A vector to the nearest image."""
        turns = self.mathematics.nint(vector.imag / self.height) if self.repeats else 0
        return vector - 1j * turns * self.height

    def state(self) -> NDArray[np.float64]:
        """x, y, u, v of the balls now, and of the container in the last row, rounded."""
        bodies = (*self.balls, self.container)
        rows = ((self.nearest(body.position(self.now)), body.velocity) for body in bodies)
        return np.array([[float(p) for z in row for p in (z.real, z.imag)] for row in rows])


@dataclass(frozen=True)
class ExactTrajectory:
    """What happens in a scene, each number rounded to the nearest double.

    events : its first collisions, fewer if no more happen
    states : (1 + *n*, *N* + 1, 4), at the start and just after each event: x, y (m), u, v (m/s) of
        each ball and, in the last row, of the container
    certain : as many events, from the first, have the same doubles, states included, with
        ``check_digits`` instead of ``digits``
    """

    events: Events
    states: NDArray[np.float64]
    certain: int
    digits: int
    check_digits: int


def trajectory(scene: Scene, collisions: int, digits: int | None = None) -> ExactTrajectory:
    """The exact trajectory of a scene from its doubles.

    digits : of the first run; the second has half as many again. The default comes from the number
        of events

    Raises ``ValueError`` for a periodic box, and for walls with a temperature.
    """
    digits = digits or math.ceil(SPARE_DIGITS + DIGITS_PER_EVENT * collisions)
    check_digits = digits + (digits + 1) // 2
    rows, states = _run(scene, collisions, check_digits)
    other_rows, other_states = _run(scene, collisions, digits)
    certain = 0
    for row, other in zip(rows, other_rows, strict=False):
        if row != other or not np.array_equal(states[certain + 1], other_states[certain + 1]):
            break
        certain += 1
    return ExactTrajectory(events_from_rows(rows), states, certain, digits, check_digits)


def _run(
    scene: Scene, collisions: int, digits: int
) -> tuple[list[tuple[float, int, int, float]], NDArray[np.float64]]:
    twin = Twin(scene, digits)
    rows, states = [], [twin.state()]
    for collision in islice(twin.collisions(), collisions):
        rows.append((float(collision.time), collision.i, collision.j, float(collision.impulse)))
        states.append(twin.state())
    return rows, np.array(states)
