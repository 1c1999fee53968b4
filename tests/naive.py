"""The engine's slow twin: hard disks in a container as a textbook has them, in plain Python.

Nothing of the engine is used. At each event the twin moves every ball to it. It computes when each
pair, and each ball and the wall, will touch, and the earliest contact is the next event. Ties go by
ball, and the wall comes before other balls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from snooker_cli.containers import Circle

if TYPE_CHECKING:
    from snooker_cli.scene import Scene

WALL = -1
NEVER = math.inf


class Event(NamedTuple):
    """A collision of balls i < j, or of ball i and the wall if j is -1: s, kg m/s."""

    time: float
    i: int
    j: int
    impulse: float


@dataclass
class Body:
    """A ball, or the container, which has an infinite mass if it is fixed; SI units."""

    x: float
    y: float
    u: float
    v: float
    radius: float
    mass: float

    def move(self, time: float) -> None:
        self.x += self.u * time
        self.y += self.v * time


Disturb = Callable[[list[Body], float], None]
"""Displaces bodies before an event at a time (s), to see what small errors grow to."""


def pair_time(a: Body, b: Body, x: float, y: float) -> float:
    """When |(x, y) + velocity t| falls to the sum of the radii: the quadratic's smaller root."""
    u, v = b.u - a.u, b.v - a.v
    approach = x * u + y * v
    if approach >= 0:
        return NEVER
    speed_squared = u * u + v * v
    reach = a.radius + b.radius
    discriminant = approach * approach - speed_squared * (x * x + y * y - reach * reach)
    if discriminant < 0:
        return NEVER
    # Balls in touch have their root at 0; rounding may put it just before.
    return max((-approach - math.sqrt(discriminant)) / speed_squared, 0.0)


def collide(a: Body, b: Body, x: float, y: float, restitution: float) -> float:
    """Turn the normal relative velocity g into -e g; (x, y) points from a to b. The impulse."""
    distance = math.sqrt(x * x + y * y)
    x, y = x / distance, y / distance
    normal_velocity = (a.u - b.u) * x + (a.v - b.v) * y
    reduced_mass = 1 / (1 / a.mass + 1 / b.mass)
    impulse = (1 + restitution) * reduced_mass * normal_velocity
    a.u -= impulse / a.mass * x
    a.v -= impulse / a.mass * y
    b.u += impulse / b.mass * x
    b.v += impulse / b.mass * y
    return impulse


class Twin:
    """A scene whose collisions are being computed; ``now`` is the time of its bodies, s."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.now = scene, 0.0
        columns = scene.positions, scene.velocities, scene.radii, scene.masses
        self.balls = [
            Body(*place, *velocity, radius, mass)
            for place, velocity, radius, mass in zip(*(c.tolist() for c in columns), strict=True)
        ]
        self.width, self.height = scene.container.size
        at, velocity = scene.container_position.tolist(), scene.container_velocity.tolist()
        self.container = Body(*at, *velocity, self.width / 2, scene.container_mass)
        # From a ball to itself, and to those of its images that can be the nearest to another.
        sides = (0,) if scene.container.has_wall else (-1, 0, 1)
        self.shifts = [(p * self.width, q * self.height) for p in sides for q in sides]
        self.last = [-math.inf] * scene.number
        self.contact_lasts = 0.0
        self.done = 0

    def collisions(self, until: float = NEVER, disturb: Disturb | None = None) -> Iterator[Event]:
        """The collisions in order, while there are any before a time (s)."""
        while True:
            if disturb is not None:
                disturb([*self.balls, self.container], self.now)
            delay, i, j = self.next_contact()
            step = min(delay, self.foresight())
            if step == NEVER or self.now + step > until:
                return
            self.now += step
            self.move(step)
            if step == delay:
                yield self.event(i, j)

    def next_contact(self) -> tuple[float, int, int]:
        """Time until the next collision, and its partners."""
        best, partners = NEVER, (WALL, WALL)
        for i, ball in enumerate(self.balls):
            time = self.wall_time(ball)
            if time < best:
                best, partners = time, (i, WALL)
            for j in range(i + 1, len(self.balls)):
                other = self.balls[j]
                x, y = other.x - ball.x, other.y - ball.y
                for p, q in self.shifts:
                    time = pair_time(ball, other, x + p, y + q)
                    if time < best:
                        best, partners = time, (i, j)
        return best, *partners

    def wall_time(self, ball: Body) -> float:
        """When |offset + velocity t| grows to the difference of the radii: the larger root."""
        container = self.container
        if not isinstance(self.scene.container, Circle):
            return min(self.side_times(ball), default=(NEVER,))[0]
        x, y = ball.x - container.x, ball.y - container.y
        u, v = ball.u - container.u, ball.v - container.v
        approach = x * u + y * v
        speed_squared = u * u + v * v
        if speed_squared == 0:
            return NEVER
        room = (container.radius - ball.radius) ** 2 - x * x - y * y
        discriminant = max(approach**2 + speed_squared * room, 0.0)
        return max((-approach + math.sqrt(discriminant)) / speed_squared, 0.0)

    def side_times(self, ball: Body) -> list[tuple[float, int, int]]:
        """When a ball reaches each side of a box that it moves to, and the normal out of it."""
        hits = []
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            half = (self.width if x else self.height) / 2
            offset = (ball.x - self.container.x) * x + (ball.y - self.container.y) * y
            speed = ball.u * x + ball.v * y
            if speed > 0 and self.scene.container.has_wall:
                hits.append((max((half - ball.radius - offset) / speed, 0.0), x, y))
        return hits

    def foresight(self) -> float:
        """How long no ball meets an image that is not among ``shifts``.

        Those include all within a box's side. Two balls that each move by a quarter of it, and are
        no wider than that, meet none from farther away.
        """
        fastest = max(math.hypot(ball.u, ball.v) for ball in self.balls)
        if self.scene.container.has_wall or fastest == 0:
            return NEVER
        return min(self.width, self.height) / 4 / fastest

    def move(self, time: float) -> None:
        """Move everything; a ball that leaves a periodic box comes in on the other side."""
        for body in (*self.balls, self.container):
            body.move(time)
        if not self.scene.container.has_wall:
            for ball in self.balls:
                ball.x -= self.width * round((ball.x - self.container.x) / self.width)
                ball.y -= self.height * round((ball.y - self.container.y) / self.height)

    def event(self, i: int, j: int) -> Event:
        """Collide two balls, or a ball and the wall, that touch now."""
        ball, other = self.balls[i], self.container if j == WALL else self.balls[j]
        x, y = self.line_of_centres(ball, other)
        speed = ((ball.u - other.u) * x + (ball.v - other.v) * y) / math.hypot(x, y)
        usual = self.scene.wall_restitution if j == WALL else self.scene.restitution
        restitution = 1.0 if self.is_elastic(i, j, speed) else usual
        return Event(self.now, i, j, collide(ball, other, x, y, restitution))

    def line_of_centres(self, ball: Body, other: Body) -> tuple[float, float]:
        """From a ball to what it touches: the nearest image of another, or the wall."""
        if other is not self.container:
            x, y = other.x - ball.x, other.y - ball.y
            return min(((x + p, y + q) for p, q in self.shifts), key=lambda way: math.hypot(*way))
        if not isinstance(self.scene.container, Circle):
            return min(self.side_times(ball))[1:]
        return ball.x - other.x, ball.y - other.y

    def is_elastic(self, i: int, j: int, speed: float) -> bool:
        """Whether a collision is slow (m/s), or one of its balls still has its last contact.

        A contact lasts a part of the mean free time, which is that of every N-th collision.
        """
        if self.done % self.scene.number == 0:
            self.contact_lasts = self.scene.contact_duration * self.mean_free_time()
        self.done += 1
        both = [i] if j == WALL else [i, j]
        touching = any(self.now - self.last[ball] < self.contact_lasts for ball in both)
        for ball in both:
            self.last[ball] = self.now
        return touching or speed < self.scene.elastic_below

    def mean_free_time(self) -> float:
        """Boltzmann's mean free path, with hits of the wall, over the root mean square speed; s."""
        scene, home = self.scene, self.container
        contacts = scene.container.wall_length / (math.pi * scene.container.area)  # in a metre
        if scene.number > 1:
            diameter = 2 * math.fsum(scene.radii) / scene.number
            contacts += math.sqrt(8) * scene.number / scene.container.area * diameter
        squares = [(ball.u - home.u) ** 2 + (ball.v - home.v) ** 2 for ball in self.balls]
        return 1 / (contacts * math.sqrt(math.fsum(squares) / scene.number))
