"""An independent program that checks certificates of ``snooker verify --exact``.

It uses nothing of snooker or of a library: intervals of whole numbers in units of 2^-UNIT, which
every operation rounds outwards. It takes the times of a certificate as hints. For each event it
shows that just before and after its time the two bodies are apart and overlap, that no other two
bodies touch up to then, and what the new velocities and spins are. Circles and boxes, constant
laws.
"""

from __future__ import annotations

import json
import sys
from fractions import Fraction
from math import isqrt
from pathlib import Path
from typing import Any, NamedTuple

UNIT = 2048
WIDEST = 64  # the interval that contains a time is at most 2^-WIDEST s
WALL = -1


class CheckError(Exception):
    """A certificate that is not shown to be right."""


class Interval(NamedTuple):
    """All numbers from one to another, in units of 2^-UNIT."""

    low: int
    high: int

    def __add__(self, other: Interval) -> Interval:  # type: ignore[override]
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)

    def __mul__(self, other: Interval) -> Interval:  # type: ignore[override]
        products = [a * b for a in self for b in other]
        return Interval(min(products) >> UNIT, -(-max(products) >> UNIT))

    def __truediv__(self, other: Interval) -> Interval:
        """Raises ``CheckError`` for an interval with zero."""
        if other.low <= 0 <= other.high:
            raise CheckError("a division by zero")
        ends = [(a << UNIT, b) for a in self for b in other]
        return Interval(min(a // b for a, b in ends), max(-(-a // b) for a, b in ends))

    def root(self) -> Interval:
        return Interval(isqrt(max(self.low, 0) << UNIT), isqrt(self.high << UNIT) + 1)

    def within(self, limit: Interval) -> Interval:
        """The numbers, those beyond plus or minus a limit moved to it."""
        ends = [max(min(end, most), -most) for end in self for most in limit]
        return Interval(min(ends), max(ends))


Vector = tuple[Interval, Interval]


def number(value: Any) -> Interval:
    """A double or a fraction."""
    scaled = Fraction(value) * 2**UNIT
    return Interval(scaled.__floor__(), scaled.__ceil__())


def dot(a: Vector, b: Vector) -> Interval:
    return a[0] * b[0] + a[1] * b[1]


def minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1]


def along(a: Vector, b: Vector, factor: Interval) -> Vector:
    """The sum of a and a multiple of b."""
    return a[0] + b[0] * factor, a[1] + b[1] * factor


class Body:
    """A ball or the container: its place at a time, and its velocity since then."""

    def __init__(self, place: Any, velocity: Any, radius: float, mass: float | None) -> None:
        self.place = number(place[0]), number(place[1])
        self.velocity = number(velocity[0]), number(velocity[1])
        self.radius = number(radius)
        self.lightness = number(0 if mass is None else 1 / Fraction(mass))
        self.since = self.spin = number(0)

    def at(self, time: Interval) -> Vector:
        return along(self.place, self.velocity, time - self.since)

    def turn(self, change: Vector, time: Interval) -> None:
        middle = Interval((time.low + time.high) // 2, (time.low + time.high) // 2)
        self.place = along(self.at(middle), change, middle - time)
        self.velocity = along(self.velocity, change, number(1))
        self.since = middle


class Check:
    """The bodies of a certificate, up to an event."""

    def __init__(self, scene: Any) -> None:
        shape = scene["container"]
        if shape["shape"] not in ("circle", "box"):
            raise CheckError(f"this program checks circles and boxes, not shape: {shape['shape']}")
        if scene["contact_duration"] or scene["elastic_below"]:
            raise CheckError("this program has no rules of collapse")
        self.sides = None
        if shape["shape"] == "box":
            self.sides = [number(Fraction(shape[key]) / 2) for key in ("width", "height")]
        columns = [scene[key] for key in ("positions", "velocities", "radii", "masses")]
        self.balls = [Body(*row) for row in zip(*columns, strict=True)]
        self.surface = scene.get("surface")
        for ball, spin in zip(self.balls, scene.get("spins", []), strict=self.surface is not None):
            ball.spin = number(spin)
        at, velocity = scene["container_position"], scene["container_velocity"]
        self.wall = Body(at, velocity, shape.get("radius", 0), scene["container_mass"])
        laws = scene["pair_law"], scene["wall_law"]
        assert all(law["name"] == "constant" for law in laws)
        self.rebound, self.wall_rebound = (number(1 + Fraction(law["cor"])) for law in laws)
        self.parted = [(k, k) for k in range(len(self.balls))]

    def gaps(self, i: int, j: int, time: Interval) -> list[Interval]:
        """Positive while two bodies are apart; for the wall, while the ball is inside."""
        ball, other = self.balls[i], self.wall if j == WALL else self.balls[j]
        x = minus(ball.at(time), other.at(time))
        if j != WALL:
            d = ball.radius + other.radius
            return [dot(x, x) - d * d]
        if self.sides is None:
            d = other.radius - ball.radius
            return [d * d - dot(x, x)]
        rooms = [side - ball.radius for side in self.sides]
        return [gap for p, room in zip(x, rooms, strict=True) for gap in (room - p, room + p)]

    def event(self, i: int, j: int, middle: int, radius: int, exponent: int) -> None:
        """Check an event and carry it out."""
        scale = Fraction(2) ** exponent
        wide = max(number(radius * scale).high, 1)
        while True:
            low, high = number(middle * scale).low - wide, number(middle * scale).high + wide
            before, after = Interval(low, low), Interval(high, high)
            apart = all(gap.low > 0 for gap in self.gaps(i, j, before))
            hit = [k for k, gap in enumerate(self.gaps(i, j, after)) if gap.high < 0]
            if apart and hit:
                break
            wide *= 2
            if wide >> (UNIT - WIDEST):
                raise CheckError(f"{i} and {j} do not touch then")
        for k in range(len(self.balls)):
            for other in (WALL, *range(k + 1, len(self.balls))):
                if (k, other) != (i, j) and not self.stay_apart(k, other, after):
                    raise CheckError(f"{k} and {other} may touch before {i} and {j}")
        time = Interval(low, high)
        ball, other = self.balls[i], self.wall if j == WALL else self.balls[j]
        x, w = minus(other.at(time), ball.at(time)), minus(ball.velocity, other.velocity)
        if j == WALL:
            x = minus(ball.at(time), other.at(time))
            if self.sides is not None:
                zero, unit = number(0), number(1 - 2 * (hit[0] % 2))
                x = (unit, zero) if hit[0] < 2 else (zero, unit)
        approach = dot(w, x)
        if approach.low <= 0:
            raise CheckError(f"{i} and {j} may not approach")
        rebound = self.wall_rebound if j == WALL else self.rebound
        change = rebound * approach / (dot(x, x) * (ball.lightness + other.lightness))
        across = self.rub(ball, other, x, w, change)
        push = x[0] * change - x[1] * across, x[1] * change + x[0] * across
        still = number(0), number(0)
        ball.turn(along(still, push, number(0) - ball.lightness), time)
        if other.lightness.high:
            other.turn(along(still, push, other.lightness), time)
        self.parted[i] = (i, j)
        if j != WALL:
            self.parted[j] = (i, j)

    def rub(self, ball: Body, other: Body, x: Vector, w: Vector, change: Interval) -> Interval:
        """Change the spins; the impulse across x to the left over its length, as is ``change``."""
        if self.surface is None:
            return number(0)
        place = "wall_" if other is self.wall else ""
        square, lightness = dot(x, x), ball.lightness + other.lightness
        bodies = [ball] if other is self.wall else [ball, other]
        slip = x[0] * w[1] - x[1] * w[0]
        inertia = number(self.surface["inertia"])
        for body in bodies:
            slip += square.root() * body.radius * body.spin
            lightness += body.lightness / inertia
        cor, friction = (self.surface[place + key] for key in ("tangential_cor", "friction"))
        given = number(1 + Fraction(cor)) * slip / (square * lightness)
        if friction is not None:
            given = given.within(number(friction) * change)
        for body in bodies:
            body.spin -= given * square.root() * body.lightness / (inertia * body.radius)
        return given

    def stay_apart(self, i: int, j: int, end: Interval) -> bool:
        """Whether two bodies do not touch before a time, after their last events."""
        if j == WALL:  # the distance from the centre is convex, and they began inside
            return all(gap.low > 0 for gap in self.gaps(i, j, end))
        if self.parted[i] == self.parted[j]:
            return True
        ball, other = self.balls[i], self.balls[j]
        start = max(ball.since, other.since)
        w, d = minus(other.velocity, ball.velocity), ball.radius + other.radius
        x, y = minus(other.at(start), ball.at(start)), minus(other.at(end), ball.at(end))
        cross = x[0] * w[1] - x[1] * w[0]
        recede, miss = dot(x, w).low >= 0, (dot(w, w) * d * d - cross * cross).high < 0
        return recede or miss or (dot(y, w).high <= 0 and self.gaps(i, j, end)[0].low > 0)


def check(certificate: Any) -> int:
    """The number of events of a certificate that are shown. Raises ``CheckError``."""
    checked = Check(certificate["scene"])
    for i, j, middle, radius, exponent in certificate["events"]:
        checked.event(i, j, int(middle, 16), int(radius, 16), exponent)
    return len(certificate["events"])


def main(path: Path) -> str:
    """What a certificate's file shows, or why it does not."""
    try:
        return f"{check(json.loads(path.read_text(encoding='utf-8')))} events are shown."
    except CheckError as error:
        return f"Not shown: {error}."


if __name__ == "__main__":
    sentence = main(Path(sys.argv[1]))
    print(sentence)
    sys.exit(sentence.startswith("Not"))
