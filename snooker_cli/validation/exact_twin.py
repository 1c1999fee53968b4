"""The exact twin: hard disks in ball arithmetic, where each number is an interval with the truth.

The twin uses nothing of the engine. It starts from the doubles of a scene, which are exact numbers,
and computes with the intervals of Arb (python-flint). If the intervals do not decide which contact
is first, or whether there is one, the twin begins again with twice the precision. So its collisions
are those of the scene, in their order. Where no precision decides, it raises ``UndecidedError``.

Vectors are complex numbers. Symbols: x offset and w relative velocity of two bodies at a time;
b = x.w, negative while they approach; w2 = |w|^2; c = |x|^2 - (contact distance)^2; D is the
discriminant of |x + w t|^2 = (contact distance)^2. docs/accuracy.md has the argument why it is a
proof.
"""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle, Rectangle
from snooker_cli.laws import Constant, Driven, Law, PackageLaw, Viscoelastic
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, Events
from snooker_cli.validation.methods import events_from_rows

Interval: TypeAlias = Any  # an ``arb`` of python-flint, or an ``acb`` for a vector
Floats: TypeAlias = NDArray[np.float64]

FIRST_BITS, MOST_BITS = 512, 16_384
"""The precision to begin with, and the last one; each is twice the one before."""

WIDEST = 2.0**-100  # intervals of times over the time, and of places over the container's size

MOST_SEARCHES = 100_000
"""How often the twin looks for contacts before an event, half a period at a time; at most N² times
with N balls, if that is more. In a wide channel two balls pass more images than it can look at."""

SLACK = 2.0**-40
"""Relative error that is allowed for where doubles show that two bodies cannot touch yet.

It is 8,192 roundings; each of these bounds takes fewer than 40."""


class UndecidedError(ArithmeticError):
    """What the intervals do not decide, in a sentence.

    final : whether no precision decides it
    """

    def __init__(self, question: str, *, final: bool = False) -> None:
        super().__init__(question)
        self.final = final


@dataclass
class Body:
    """A ball, or the container, on a straight line, m, m/s, 1/kg, s.

    turned : when it got its velocity
    spin : rad/s; the container does not turn
    place : where it is at the middle of this interval, which is an exact number
    """

    place: Interval
    velocity: Interval
    radius: Interval
    inverse_mass: Interval
    turned: Interval
    spin: Interval

    @property
    def since(self) -> Interval:
        return self.turned.mid()

    def position(self, time: Interval) -> Interval:
        return self.place + self.velocity * (time - self.since)

    def turn(self, change: Interval, time: Interval) -> None:
        """Add to the velocity at a time; the position at that time stays."""
        exact = time.mid()
        self.place = self.position(exact) - change * (time - exact)
        self.velocity += change
        self.turned = time


class Contact(NamedTuple):
    """When two bodies touch.

    time : s; None if they touch at ``lower`` or later, or never
    lower : no contact is before, s
    question : what the intervals do not decide about it; else empty
    """

    time: Interval | None
    lower: float
    question: str = ""


NEVER = Contact(None, math.inf)


class Collision(NamedTuple):
    """A collision of balls i < j, or of ball i and the container if j is -1; s, kg m/s, m/s.

    speed : their relative speed along the line of centres, before
    tangential : the impulse of rough balls, as ``Events.tangential``; 0 of smooth ones
    """

    time: Interval
    i: int
    j: int
    impulse: Interval
    speed: Interval
    tangential: Interval


def unsupported_key(scene: Scene) -> str | None:
    """The config key of a scene without an exact twin; None for all others."""
    if not isinstance(scene.container, Circle | Rectangle):
        return f"shape: {scene.container.name}"
    for where, law in (("", scene.pair_law), *(("wall_", law) for law in scene.wall_law.parts)):
        if isinstance(law, PackageLaw):
            return f"{where}law: {law.name}"
        if not isinstance(law, Constant | Viscoelastic | Driven):
            return f"{where}{law.numbers()[-1]}"
    return None


class Twin:
    """A scene that evolves, in intervals of some bits.

    Raises ``ValueError`` for a scene that has no exact twin, see ``unsupported_key``.
    """

    def __init__(self, scene: Scene, bits: int = FIRST_BITS) -> None:
        if key := unsupported_key(scene):
            raise ValueError(f"there is no exact twin of a scene with {key}")
        import flint  # here: the report shows saved measurements without it

        self.context, self.bits = flint.ctx, bits
        self.context.prec = bits
        number, vector = flint.arb, flint.acb
        self.number, self.vector, self.zero, self.scene = number, vector, number(0), scene
        width, height = scene.container.size
        self.half_sides = number(width) / 2, number(height) / 2
        self.normals = vector(-1), vector(1), vector(0, -1), vector(0, 1)  # as in ``laws.SIDES``
        across, up = scene.container.periodic
        self.periods = [vector(width)] * across + [vector(0, height)] * up
        self.least_period = min(scene.container.period or (math.inf,))
        self.images = [  # of a ball, by which way they are from it
            vector(x * width, y * height)
            for x in range(-across, across + 1)
            for y in range(-up, up + 1)
        ]
        # All bodies in doubles, the container last, and by how much these may be wrong.
        self.places = np.vstack([scene.positions, scene.container_position])
        self.velocities = np.vstack([scene.velocities, scene.container_velocity])
        self.radii = np.append(scene.radii, 0.0)
        self.clocks, self.blurs, self.speed_blurs = np.zeros((3, scene.number + 1))
        lines = self.places.tolist(), self.velocities.tolist()
        sizes = (*scene.radii.tolist(), width / 2), (*scene.masses.tolist(), scene.container_mass)
        spins = [*([0.0] * scene.number if scene.spins is None else scene.spins.tolist()), 0.0]
        self.bodies = [
            Body(
                vector(*place),
                vector(*velocity),
                number(radius),
                1 / number(mass),
                self.zero,
                number(spin),
            )
            for place, velocity, radius, mass, spin in zip(*lines, *sizes, spins, strict=True)
        ]
        self.balls, self.container = self.bodies[:-1], self.bodies[-1]
        self.now = self.zero
        self.partners = [*range(scene.number)]  # in the last collision of a ball; at first itself
        self.done, self.contact_lasts = 0, self.zero
        self.contacts: dict[tuple[int, int], Contact] = {}
        # Lower bounds of the times of contacts, a row for each ball: with later balls and, in the
        # last column, with the wall. ``soonest`` has their least in each row, or less.
        self.earliest = np.full((scene.number, scene.number + 1), math.inf)
        self.soonest = np.full(scene.number, math.inf)
        self.reach = min(width, height) / 2 if scene.container.has_wall else math.inf
        for i in range(scene.number):
            self.renew(i)

    # What happens

    def collisions(self, until: float = math.inf) -> Iterator[Collision]:
        """The collisions in their order, up to a time, s. Raises ``UndecidedError``."""
        while True:
            self.context.prec = self.bits  # the library has one precision for all twins
            pair = self.next_pair(until)
            if pair is None:
                return
            time: Interval = self.contacts[pair].time
            self.now = time
            if self.scene.contact_duration and self.done % self.scene.number == 0:
                self.contact_lasts = self.contact_time()
            self.done += 1
            happened = self.collide(*pair)
            i, j = pair
            at_wall = j == len(self.balls)
            self.partners[i] = CONTAINER if at_wall else j
            if not at_wall:
                self.partners[j] = i
            changed = {i} if at_wall and not self.scene.free else {i, j}
            self.contacts = {
                pair: contact for pair, contact in self.contacts.items() if changed.isdisjoint(pair)
            }
            for k in changed:
                self.note(k)
            for k in changed:
                self.renew(k)
            yield Collision(time, i, self.partners[i], *happened)

    def collide(self, i: int, j: int) -> tuple[Interval, Interval, Interval]:
        """Change the velocities by the law of the pair or the wall.

        The impulse, the normal speed and the tangential impulse, as in ``Collision``.
        """
        ball, other = self.balls[i], self.bodies[j]
        law: Law = self.scene.pair_law
        if other is not self.container:
            normal = self.nearest(other.position(self.now) - ball.position(self.now))
        else:
            law = self.scene.wall_law
            normal = ball.position(self.now) - other.position(self.now)
            if not isinstance(self.scene.container, Circle):
                # A ball that reaches two sides at once may hit either first, if they are smooth.
                first, *other_side = self.side_hits(ball)
                later = not other_side or not other_side[0][0] < first[0]
                if other_side and (surface := self.scene.surface) and surface.rubs_wall:
                    question = f"which of two sides ball {i} hits first"
                    later = not is_less(other_side[0][0], first[0], question)
                self.now, side = first if later else other_side[0]
                normal = self.normals[side]
                law = law.parts[side] if law.parts[1:] else law
        normal /= abs(normal)
        speed = dot(ball.velocity - other.velocity, normal)
        impulse = self.change(speed, law, (i, j)) / (ball.inverse_mass + other.inverse_mass)
        given = self.rub(ball, other, normal, impulse)
        push = normal * self.vector(impulse, given)
        ball.turn(-push * ball.inverse_mass, self.now)
        other.turn(push * other.inverse_mass, self.now)
        return impulse, speed, given

    def rub(self, ball: Body, other: Body, normal: Interval, impulse: Interval) -> Interval:
        """Change the spins of two rough bodies; the impulse to the left of the normal, kg m/s."""
        surface = self.scene.surface
        if surface is None:
            return self.zero
        cor, friction, bodies = surface.tangential_cor, surface.friction, [ball, other]
        if other is self.container:
            cor, friction, bodies = surface.wall_tangential_cor, surface.wall_friction, [ball]
        slip = dot(ball.velocity - other.velocity, normal * self.vector(0, 1))
        slip += ball.radius * ball.spin + other.radius * other.spin
        turning = sum((body.inverse_mass for body in bodies), self.zero) / surface.inertia
        given = (1 + self.number(cor)) * slip / (ball.inverse_mass + other.inverse_mass + turning)
        if friction < math.inf:
            given = given.min(friction * impulse).max(-friction * impulse)
        for body in bodies:
            body.spin -= given * body.inverse_mass / (surface.inertia * body.radius)
        return given

    def change(self, speed: Interval, law: Law, pair: tuple[int, int]) -> Interval:
        """By how much a collision changes a normal relative speed, m/s."""
        e = self.number(law.cor)
        if isinstance(law, Driven):
            return (1 + e) * (speed + law.speed)
        slow = self.scene.elastic_below
        if self.in_contact(pair) or (slow and self.is_slow(speed, slow, pair)):
            return 2 * speed
        if isinstance(law, Viscoelastic) and self.is_slow(speed, law.cor_speed, pair):
            root = (speed / law.cor_speed).sqrt()
            e = 1 - (1 - e) * root * root.sqrt()
        return (1 + e) * speed

    def contact_time(self) -> Interval:
        """How long a contact lasts in the TC model at the balls' present speeds, s."""
        velocities = [ball.velocity - self.container.velocity for ball in self.balls]
        total = sum((dot(v, v) for v in velocities), self.zero)
        path = self.scene.contact_duration * self.scene.mean_free_path
        return path / (total / len(self.balls)).sqrt()

    def in_contact(self, pair: tuple[int, int]) -> bool:
        """Whether a ball of a pair still has its last contact, in the TC model."""
        if not self.scene.contact_duration:
            return False
        ages = [
            self.now - self.balls[k].turned
            for k in pair
            if k < len(self.balls) and self.partners[k] != k  # it has had a contact
        ]
        question = f"whether {self.names(pair)} still have their last contact"
        return any(is_less(age, self.contact_lasts, question) for age in ages)

    def is_slow(self, speed: Interval, limit: float, pair: tuple[int, int]) -> bool:
        """Whether a normal relative speed is below one of a law, m/s."""
        where = f"of {self.names(pair)} is at the {limit:g} m/s of a law"
        return is_less(speed, limit, f"the speed {where}, to {_digits(speed - limit)} m/s")

    def names(self, pair: tuple[int, int]) -> str:
        i, j = pair
        return f"ball {i} and the wall" if j == len(self.balls) else f"balls {i} and {j}"

    # The next contact

    def next_pair(self, until: float) -> tuple[int, int] | None:
        """The bodies of the next contact; None if there is none up to a time, s.

        Computes the contact with the least bound, until it is certain which one is first.
        """
        first: tuple[int, int] | None = None
        latest, searches, most = until, 0, max(MOST_SEARCHES, len(self.balls) ** 2)
        seen: dict[tuple[int, int], float] = {}
        while True:
            i = int(np.argmin(self.soonest))
            pair = i, int(np.argmin(self.earliest[i]))
            lower = float(self.earliest[pair])
            if lower > self.soonest[i]:  # that was the bound of a contact that changed
                self.soonest[i] = lower
            elif lower > latest or lower == math.inf:
                break
            elif pair not in self.contacts:
                contact = self.contact(*pair, lower)
                self.earliest[pair] = contact.lower
                if contact.time is not None or contact.question:
                    self.contacts[pair] = contact
                elif contact.lower < math.inf:
                    searches += 1
                    if contact.lower <= lower or searches > most:
                        question = f"{self.names(pair)} do not touch for very long"
                        raise UndecidedError(question, final=searches > most)
            else:
                time, _, question = self.contacts[pair]
                if time is None:
                    raise UndecidedError(f"{self.names(pair)}: {question}")
                before = time if first is None else self.contacts[first].time
                if first is None or time < before:
                    first, latest = pair, min(until, above(time))
                elif not before < time:
                    question = f"{self.names(first)} touch at the same time as {self.names(pair)}"
                    question += f", to {_digits(time - before)} s"
                    raise UndecidedError(question, final=bool(time == before))
                seen[pair], self.earliest[pair] = lower, math.inf
        for pair, lower in seen.items():
            self.earliest[pair] = lower
            self.soonest[pair[0]] = min(self.soonest[pair[0]], lower)
        return first

    def contact(self, i: int, j: int, lower: float) -> Contact:
        """When two bodies touch that do not touch before a time, s; now if they approach then."""
        start = self.number(lower).max(self.now)
        ball, other = self.balls[i], self.bodies[j]
        if other is not self.container:
            return self.disk_contact(ball, other, start)
        if isinstance(self.scene.container, Circle):
            return self.circle_contact(i, start)
        times = [time for time, _ in self.side_hits(ball)]
        if not times:
            return NEVER
        time = times[0] if len(times) == 1 else times[0].min(times[1])
        return _at(time, start)

    def disk_contact(self, ball: Body, other: Body, start: Interval) -> Contact:
        """The next contact of two balls.

        In a periodic container it is the one of all images, as far as they move half a period.
        """
        x, w = other.position(start) - ball.position(start), other.velocity - ball.velocity
        distance = ball.radius + other.radius
        if self.least_period == math.inf or w == 0:
            return self.root(x, w, distance, start)
        x, fastest = self.nearest(x), abs(w).upper()
        searched = start + self.number(0.49 * self.least_period) / fastest
        contacts = [self.root(x + image, w, distance, start) for image in self.images]
        return min(*contacts, Contact(None, _below(searched)), key=lambda contact: contact.lower)

    def root(self, x: Interval, w: Interval, distance: Interval, start: Interval) -> Contact:
        """The smaller root of |x + w t| = distance from a time on, if the balls approach."""
        turned, w2, d2 = x.conjugate() * w, dot(w, w), distance**2
        b, cross = turned.real, turned.imag
        discriminant = w2 * d2 - cross * cross
        if b >= 0 or discriminant <= 0:
            return NEVER
        if b < 0 and discriminant > 0:
            gap = (dot(x, x) - d2).nonnegative_part()
            return _at(start + gap / (discriminant.sqrt() - b), start)
        if b < 0 and w2 > 0:  # a grazing contact, or none, but not before this
            lower = start - (b + discriminant.nonnegative_part().sqrt().upper()) / w2
        else:
            lower = start + (abs(x) - distance) / abs(w).upper()
        digits = _digits(discriminant / (w2 * d2))
        question = f"whether they touch; the discriminant is zero, to {digits} of its largest value"
        return Contact(None, _below(lower), question)

    def circle_contact(self, i: int, start: Interval) -> Contact:
        """When a ball in a circle reaches the wall: the larger root.

        A ball that its start's rounding puts outside is at the wall.
        """
        ball = self.balls[i]
        at_wall = self.partners[i] == CONTAINER and (
            not self.scene.free or ball.turned is self.container.turned
        )
        start = ball.turned if at_wall else start
        x = ball.position(start) - self.container.position(start)
        w = ball.velocity - self.container.velocity
        b, w2 = dot(x, w), dot(w, w)
        if w2 == 0:
            return NEVER
        if at_wall:  # the way across a chord, which takes less precision
            return _at(start - 2 * b / w2, start)
        gap = (dot(x, x) - (self.container.radius - ball.radius) ** 2).min(self.zero)
        root = (b * b - w2 * gap).nonnegative_part().sqrt()
        time = start + (-gap / (root + b) if b > 0 else (root - b) / w2)
        return _at(time, start)

    def side_hits(self, ball: Body) -> list[tuple[Interval, int]]:
        """When a ball reaches the vertical and the horizontal side that it moves to, and which."""
        place, velocity = ball.place - self.container.place, ball.velocity
        axes = ((place.real, velocity.real), (place.imag, velocity.imag))
        hits = []
        for axis, (p, speed) in enumerate(axes):
            if speed == 0 or self.scene.container.periodic[axis]:
                continue
            ahead = 1 if speed > 0 else -1
            way = ahead * (self.half_sides[axis] - ball.radius) - p
            hits.append(((ball.since + way / speed).max(self.now), 2 * axis + (ahead > 0)))
        return hits

    def nearest(self, vector: Interval) -> Interval:
        """A vector to the nearest image, or to one that is as near but for a rounding."""
        for period in self.periods:
            turns = round(float(dot(vector, period).mid() / dot(period, period).mid()))
            vector -= turns * period
        return vector

    # What doubles show

    def note(self, i: int) -> None:
        """Note a body's line in doubles, and how far these are from all of its intervals.

        Raises ``UndecidedError`` for intervals that are not much narrower than doubles.
        """
        body = self.bodies[i]
        for row, blurs, vector in (
            (self.places, self.blurs, body.place),
            (self.velocities, self.speed_blurs, body.velocity),
        ):
            row[i] = float(vector.real), float(vector.imag)
            blurs[i] = above(abs(vector - self.vector(*row[i].tolist())))
        self.clocks[i] = float(body.since)
        time, place = body.turned, body.place
        if time.rad() > WIDEST * time or place.rad() > WIDEST * self.half_sides[0]:
            raise UndecidedError(f"intervals of {self.bits:,} bits are too wide")

    def renew(self, i: int) -> None:
        """Renew the bounds of all contacts of a body."""
        bounds = self.bounds(i)
        if i == len(self.balls):
            self.earliest[:, i] = bounds[:i]
        else:
            self.earliest[:i, i], self.earliest[i, i + 1 :] = bounds[:i], bounds[i + 1 :]
            self.soonest[i] = np.min(self.earliest[i])
        self.soonest[:i] = np.minimum(self.soonest[:i], bounds[:i])

    def bounds(self, i: int) -> Floats:
        """Times before which no other body touches a body, s: their gap over their relative speed.

        A body that is at x + v t has roundings of at most ``SLACK`` of |x| + |v| t.
        """
        now, last, container = float(self.now), len(self.balls), self.scene.container
        ages = now - self.clocks
        places = self.places + self.velocities * ages[:, np.newaxis]
        speeds = np.hypot(*self.velocities.T)
        errors = self.blurs + self.speed_blurs * ages
        errors += SLACK * (np.hypot(*self.places.T) + self.radii + container.size[0] + speeds * now)
        distances = np.hypot(*container.nearest_image(places - places[i]).T)
        gaps = distances - self.radii - self.radii[i]
        if i == last:
            gaps = self.reach - self.radii - distances
        else:
            gaps[last] = self.reach - self.radii[i] - distances[last]
            if (j := self.partners[i]) >= 0 and self.partners[j] == i:
                # Two disks that have collided part, or stay together; images are further away.
                gaps[j] = self.least_period - 2 * (self.radii[i] + self.radii[j])
        gaps = np.maximum(gaps - errors - errors[i], 0.0)
        ways = np.hypot(*(self.velocities - self.velocities[i]).T)
        ways += self.speed_blurs + self.speed_blurs[i] + SLACK * (speeds + speeds[i])
        with np.errstate(over="ignore"):  # to infinity
            delays = np.divide(gaps, ways, out=np.full_like(gaps, math.inf), where=ways > 0)
        delays[i] = math.inf
        return np.asarray((now + delays) * (1 - SLACK))

    def state(self) -> Floats:
        """x, y, u, v of the balls now, and of the container in the last row, rounded."""
        rows = ((self.nearest(body.position(self.now)), body.velocity) for body in self.bodies)
        return np.array([[float(p) for z in row for p in (z.real, z.imag)] for row in rows])


def dot(first: Interval, second: Interval) -> Interval:
    return first.real * second.real + first.imag * second.imag


def is_less(interval: Interval, limit: Interval, question: str) -> bool:
    """Whether all numbers are below a limit. Raises ``UndecidedError`` for some of them."""
    if not (interval < limit or interval >= limit):
        raise UndecidedError(question)
    return bool(interval < limit)


def _below(interval: Interval) -> float:
    """A double that is less than all numbers of an interval."""
    return math.nextafter(float(interval.lower()), -math.inf)


def above(interval: Interval) -> float:
    """A double that is at least as large as all numbers of an interval."""
    if interval == 0:
        return 0.0
    return math.nextafter(float(interval.upper()), math.inf)


def _digits(interval: Interval) -> str:
    """The largest absolute value in an interval; it may be too small for a double."""
    return str(interval.abs_upper().str(2, radius=False))


def _at(time: Interval, start: Interval) -> Contact:
    """A contact at a time; undecided from a start on if the time is no number."""
    if time.is_finite():
        return Contact(time, _below(time))
    return Contact(
        None, _below(start), "when they touch; their relative speed is zero or nearly so"
    )


def follow(scene: Scene, until: float = math.inf) -> Iterator[tuple[Twin, Collision]]:
    """The collisions of a scene in their order, up to a time, s, and the twin just after each.

    The precision is raised as often as needed. Raises ``UndecidedError`` where that does not help.
    """
    bits, done = FIRST_BITS, 0
    while True:
        twin = Twin(scene, bits)
        try:
            for collision in islice(twin.collisions(until), done, None):
                done += 1
                yield twin, collision
            return
        except UndecidedError as question:
            bits *= 2
            if question.final or bits > MOST_BITS:
                raise


def trajectory(scene: Scene, collisions: int) -> tuple[Events, Floats]:
    """The first collisions of a scene; fewer if no more happen, or if the next is not decided.

    The second array has the states at the start and just after each event: x, y (m), u, v (m/s) of
    each ball and, in the last row, of the container; (1 + *n*, *N* + 1, 4). Each number is the
    double that is nearest to the true one. Raises ``ValueError`` without an exact twin.
    """
    rows, states = [], [Twin(scene).state()]
    with suppress(UndecidedError):
        for twin, collision in islice(follow(scene), collisions):
            rows.append((float(collision.time), collision.i, collision.j, float(collision.impulse)))
            states.append(twin.state())
    return events_from_rows(rows), np.array(states)
