"""The engine's slow twin: hard disks in a circle as a textbook has them, in plain Python.

Nothing of the engine is used. At each event every ball is moved to it, all pairs and all balls
with the wall are asked when they will touch, and the earliest answer is next. Ties go by ball,
and the wall comes before other balls.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

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
    """A ball, or the container: the inside of a circle, of infinite mass if it is fixed."""

    x: float
    y: float
    u: float
    v: float
    radius: float
    mass: float

    def move(self, time: float) -> None:
        self.x += self.u * time
        self.y += self.v * time


def pair_time(a: Body, b: Body) -> float:
    """When |offset + velocity t| falls to the sum of the radii: the quadratic's smaller root."""
    x, y, u, v = b.x - a.x, b.y - a.y, b.u - a.u, b.v - a.v
    approach = x * u + y * v
    if approach >= 0:
        return NEVER
    speed_squared = u * u + v * v
    discriminant = approach**2 - speed_squared * (x * x + y * y - (a.radius + b.radius) ** 2)
    if discriminant < 0:
        return NEVER
    # Balls in touch have their root at 0; rounding may put it just before.
    return max((-approach - math.sqrt(discriminant)) / speed_squared, 0.0)


def wall_time(ball: Body, container: Body) -> float:
    """When |offset + velocity t| grows to the difference of the radii: the larger root."""
    x, y = ball.x - container.x, ball.y - container.y
    u, v = ball.u - container.u, ball.v - container.v
    approach = x * u + y * v
    speed_squared = u * u + v * v
    if speed_squared == 0:
        return NEVER
    room = (container.radius - ball.radius) ** 2 - x * x - y * y
    discriminant = max(approach**2 + speed_squared * room, 0.0)
    return max((-approach + math.sqrt(discriminant)) / speed_squared, 0.0)


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


def next_contact(balls: list[Body], container: Body) -> tuple[float, int, int]:
    """Time until the next collision, and whose it is."""
    best = (NEVER, WALL, WALL)
    for i, ball in enumerate(balls):
        best = min(best, (wall_time(ball, container), i, WALL))
        for j in range(i + 1, len(balls)):
            best = min(best, (pair_time(ball, balls[j]), i, j))
    return best


def undisturbed(bodies: list[Body], now: float) -> None:
    """Leave the bodies as they are."""


def collisions(
    balls: list[Body],
    container: Body,
    restitution: float,
    wall_restitution: float,
    disturb: Callable[[list[Body], float], None] = undisturbed,
) -> Iterator[Event]:
    """The collisions in their order, as long as there are any; the bodies are changed.

    disturb : may displace the bodies before each event, to see what small errors grow to
    """
    now = 0.0
    while True:
        disturb([*balls, container], now)
        delay, i, j = next_contact(balls, container)
        if delay == NEVER:
            return
        now += delay
        for body in (*balls, container):
            body.move(delay)
        ball = balls[i]
        if j == WALL:
            x, y = ball.x - container.x, ball.y - container.y
            impulse = collide(ball, container, x, y, wall_restitution)
        else:
            x, y = balls[j].x - ball.x, balls[j].y - ball.y
            impulse = collide(ball, balls[j], x, y, restitution)
        yield Event(now, i, j, impulse)
