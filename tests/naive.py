"""The engine's slow twin: hard disks in a container as a textbook has them, in plain Python.

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


@dataclass
class Box(Body):
    """A container of four walls around its place; or of none, and everything repeats for ever."""

    width: float
    height: float
    periodic: bool


def shifts(container: Body) -> list[tuple[float, float]]:
    """From a ball to itself, and to those of its images that can be the nearest to another."""
    if isinstance(container, Box) and container.periodic:
        sides = -1, 0, 1
        return [(p * container.width, q * container.height) for p in sides for q in sides]
    return [(0.0, 0.0)]


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


def wall_time(ball: Body, container: Body) -> float:
    """When |offset + velocity t| grows to the difference of the radii: the larger root."""
    if isinstance(container, Box):
        return min(side_times(ball, container), default=(NEVER,))[0]
    x, y = ball.x - container.x, ball.y - container.y
    u, v = ball.u - container.u, ball.v - container.v
    approach = x * u + y * v
    speed_squared = u * u + v * v
    if speed_squared == 0:
        return NEVER
    room = (container.radius - ball.radius) ** 2 - x * x - y * y
    discriminant = max(approach**2 + speed_squared * room, 0.0)
    return max((-approach + math.sqrt(discriminant)) / speed_squared, 0.0)


def side_times(ball: Body, box: Box) -> list[tuple[float, int, int]]:
    """When a ball reaches each side of a box that it moves to, and the normal out of it."""
    found = []
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        half = (box.width if x else box.height) / 2
        room = half - ball.radius - (ball.x - box.x) * x - (ball.y - box.y) * y
        speed = ball.u * x + ball.v * y
        if speed > 0 and not box.periodic:
            found.append((max(room / speed, 0.0), x, y))
    return found


def line_of_centres(ball: Body, other: Body, container: Body) -> tuple[float, float]:
    """From a ball to what it touches: the nearest image of another, or the wall."""
    if other is not container:
        x, y = other.x - ball.x, other.y - ball.y
        return min(((x + p, y + q) for p, q in shifts(container)), key=lambda way: math.hypot(*way))
    if isinstance(container, Box):
        return min(side_times(ball, container))[1:]
    return ball.x - container.x, ball.y - container.y


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
    best, whom = NEVER, (WALL, WALL)
    images = shifts(container)
    for i, ball in enumerate(balls):
        time = wall_time(ball, container)
        if time < best:
            best, whom = time, (i, WALL)
        for j in range(i + 1, len(balls)):
            other = balls[j]
            x, y = other.x - ball.x, other.y - ball.y
            for p, q in images:
                time = pair_time(ball, other, x + p, y + q)
                if time < best:
                    best, whom = time, (i, j)
    return best, *whom


def foresight(balls: list[Body], container: Body) -> float:
    """How long nothing meets an image that is not among ``shifts``.

    Those include all within a box's side. Two balls that each move by a quarter of it, and are no
    wider than that, meet none from farther away.
    """
    if not (isinstance(container, Box) and container.periodic):
        return NEVER
    fastest = max(math.hypot(ball.u, ball.v) for ball in balls)
    return min(container.width, container.height) / 4 / fastest if fastest > 0 else NEVER


def move(balls: list[Body], container: Body, time: float) -> None:
    """Move everything; who leaves a periodic box comes in on the other side."""
    for body in (*balls, container):
        body.move(time)
    if isinstance(container, Box) and container.periodic:
        for ball in balls:
            ball.x -= container.width * round((ball.x - container.x) / container.width)
            ball.y -= container.height * round((ball.y - container.y) / container.height)


def undisturbed(bodies: list[Body], now: float) -> None:
    """Leave the bodies as they are."""


Rule = Callable[[float, int, int, float], bool]
"""Whether a collision is elastic, of its time (s), i and j as in ``Event``, and normal speed."""


def never(now: float, i: int, j: int, speed: float) -> bool:
    """No collision is elastic but by its coefficient of restitution."""
    return False


def collisions(
    balls: list[Body],
    container: Body,
    restitution: float,
    wall_restitution: float,
    disturb: Callable[[list[Body], float], None] = undisturbed,
    until: float = NEVER,
    elastic: Rule = never,
) -> Iterator[Event]:
    """The collisions in their order, as long as there are any; the bodies are changed.

    disturb : may displace the bodies before each event, to see what small errors grow to
    until : s
    """
    now = 0.0
    while True:
        disturb([*balls, container], now)
        delay, i, j = next_contact(balls, container)
        step = min(delay, foresight(balls, container))
        if step == NEVER or now + step > until:
            return
        now += step
        move(balls, container, step)
        if step < delay:
            continue
        ball, other = balls[i], container if j == WALL else balls[j]
        x, y = line_of_centres(ball, other, container)
        speed = ((ball.u - other.u) * x + (ball.v - other.v) * y) / math.hypot(x, y)
        usual = wall_restitution if j == WALL else restitution
        impulse = collide(ball, other, x, y, 1.0 if elastic(now, i, j, speed) else usual)
        yield Event(now, i, j, impulse)
