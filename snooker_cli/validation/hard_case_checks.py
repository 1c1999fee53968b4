"""How far a trace is out of its books, and how far rounding alone could have brought it.

The bounds are of the worst case, in which all roundings err to one side, and are linear in the
events: what is measured grows as their root and stays well below.

- A collision takes some ten operations, each exact to half an epsilon of what its bodies have, for
  both of them: ``OPERATIONS`` epsilon an event, of the energy there was at the start, of the
  momenta there are, and of their arms. The impulse acts along the offset as it is, so that errors
  of place do not matter to these three.
- A contact is at the root of a quadratic, good to some epsilon of the way to it, and on a clock,
  good to an epsilon of what it shows: ``PLACE`` epsilon of the largest distances there are, and of
  what the fastest would go until then. A ball that hits the wall again and again goes by a chord
  from where it is, and keeps its distance from the centre and all errors in it: those add up
  until it meets a ball.
- The virial misses each impulse times the error of its place.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.analysis.observables import (
    losses,
    total_angular_momentum,
    total_energy,
    total_momentum,
)
from snooker_cli.containers import Circle
from snooker_cli.engine import States, replay, series
from snooker_cli.scene import EPSILON
from snooker_cli.trace import CONTAINER, StopReason

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Events, Trace

    Floats = NDArray[np.float64]
    Fact = Callable[[Trace], Iterator["Check"]]


OPERATIONS, PLACE = 16, 8

BUDGET = 1_000_000
"""Pairs of balls at an instant that are looked at; of more, instants are left out evenly."""


@dataclass(frozen=True)
class Check:
    """What is out by how much, and how much it may be; not a number never holds."""

    name: str
    error: float
    bound: float

    @property
    def holds(self) -> bool:
        """Whether the error is within its bound."""
        return self.error <= self.bound


@dataclass(frozen=True)
class EventRecord:
    """States that a trace went through, and the sizes that roundings are in proportion to.

    states : at the start, after each event or some of them, and at the end
    ways : (*t* - 1,) s, how long after each of them but the last the balls move straight
    place : m, how far off a contact may be; ``run`` : the most hits of the wall in a row of a ball
    momentum, arm : largest sum of |p| and of |x||p|, kg m/s and kg m^2/s
    """

    states: States
    ways: Floats
    place: float
    run: int
    momentum: float
    arm: float


def checks(trace: Trace) -> list[Check]:
    """All that must be true of a trace whatever its scene; numbers that are none come first."""
    broken = _broken(trace)
    if broken:
        return [Check("numbers", broken, 0.0)]
    course = course_of(trace)
    found = [Check("numbers", 0.0, 0.0), *_books(trace, course)]
    if isinstance(trace.start.container, Circle) and not trace.start.free:
        found += _virial(trace, course)
    found.append(Check("overlap", _deepest_overlap(trace.start, course), course.place))
    if trace.start.container.has_wall:
        bound = course.place * (1 + course.run)
        found.append(Check("escape", _farthest_escape(trace.start, course), bound))
    return found


def _broken(trace: Trace) -> float:
    """How many numbers are not finite, negative or out of order."""
    finish = trace.finish
    columns = [finish.positions, finish.velocities, finish.container_position]
    columns += [finish.container_velocity, np.array([trace.stop.time])]
    columns += [np.asarray(column) for column in vars(series(trace)).values()]
    broken = sum(int(np.sum(~np.isfinite(column))) for column in columns)
    if trace.events is not None:
        events = trace.events
        broken += int(np.sum(~(events.impulse >= 0))) + int(np.sum(~(np.diff(events.time) >= 0)))
        broken += int(np.sum((events.i < 0) | (events.i >= trace.start.number)))
        broken += int(np.sum(~events.at_wall & (events.j <= events.i)))
    return float(broken + (finish.number != trace.start.number))


def course_of(trace: Trace) -> EventRecord:
    """The states of a trace, for a summary those at its ends, and their sizes."""
    start, end = trace.start, trace.stop.time
    if trace.events is None:
        states, ways = _ends(trace), np.zeros(1)
    else:
        times = np.concatenate([[0.0], trace.events.time, [end]])
        pairs = max(1, start.number * (start.number - 1) // 2)
        rows = max(2, min(len(times), BUDGET // pairs, BUDGET // start.number))
        kept = np.linspace(0, len(times) - 1, rows).round().astype(np.int64)
        states, ways = replay(trace, times[kept]), np.diff(times)[kept[:-1]]
    speeds = np.hypot(*np.moveaxis(states.velocities, -1, 0))
    arms = np.hypot(*np.moveaxis(states.positions, -1, 0))
    momentum, arm = speeds @ start.masses, (speeds * arms) @ start.masses
    far, fastest = float(np.max(arms)), np.max(speeds, axis=1)
    if start.free:
        wall_speeds = np.hypot(*states.container_velocities.T)
        wall_arms = np.hypot(*states.container_positions.T)
        momentum = momentum + start.container_mass * wall_speeds
        arm = arm + start.container_mass * wall_speeds * wall_arms
        far, fastest = max(far, float(np.max(wall_arms))), np.maximum(fastest, wall_speeds)
    diameter = 2 * float(np.max(start.radii)) if start.number > 1 else 0.0
    clock = float(np.max(fastest * (states.time + np.append(ways, 0.0))))
    return EventRecord(
        states=states,
        ways=ways,
        place=PLACE * EPSILON * (2 * far + diameter + clock),
        run=longest_run(trace),
        momentum=float(np.max(momentum)),
        arm=float(np.max(arm)),
    )


def _ends(trace: Trace) -> States:
    """The states at both ends."""
    ends = trace.start, trace.finish
    return States(
        time=np.array([0.0, trace.stop.time]),
        positions=np.array([scene.positions for scene in ends]),
        velocities=np.array([scene.velocities for scene in ends]),
        container_positions=np.array([scene.container_position for scene in ends]),
        container_velocities=np.array([scene.container_velocity for scene in ends]),
    )


def longest_run(trace: Trace) -> int:
    """The most hits of the wall in a row of one ball.

    Of a summary, which does not say: more than there would be, but in one of a billion such gases,
    if chance had each ball hit the wall as often; all that there were if balls hit nothing else.
    """
    events = trace.events
    if events is None:
        if not trace.wall_events or not trace.pair_events:
            return trace.wall_events
        # n p^m = 1e-9, p the part of a ball's collisions that are with the wall
        part = trace.wall_events / (trace.wall_events + 2 * trace.pair_events)
        likely = math.log(1e-9 / trace.wall_events) / math.log(part)
        return min(trace.wall_events, math.ceil(likely))
    at_wall = events.at_wall
    ball = np.concatenate([events.i, events.j[~at_wall]])
    of_wall = np.concatenate([at_wall, np.zeros(int(np.sum(~at_wall)), dtype=bool)])
    when = np.concatenate([np.arange(len(events)), np.flatnonzero(~at_wall)])
    order = np.lexsort((when, ball))
    ball, of_wall = ball[order], of_wall[order]
    # A run ends where the ball meets another, and where the next ball's events begin.
    ends = np.flatnonzero(~of_wall | (np.diff(ball, prepend=-1) != 0))
    if not len(ends):
        return 0
    return int(np.max(np.diff(np.append(ends, len(ball)))))


def _books(trace: Trace, course: EventRecord) -> Iterator[Check]:
    """Energy, momentum and angular momentum, as parts of what there was or is."""
    start, finish = trace.start, trace.finish
    rounding = OPERATIONS * EPSILON * (trace.collisions + start.number)
    energy = total_energy(start)
    if trace.events is not None:
        missing = total_energy(finish) - energy + losses(start, trace.events)
        yield Check("energy", _part(missing, energy), rounding)
    elif start.restitution == start.wall_restitution == 1.0:
        rows = series(trace)
        missing = float(np.max(abs(rows.kinetic_energy + rows.container_energy - energy)))
        yield Check("energy", _part(missing, energy), rounding)
    if start.free or not start.container.has_wall:
        change = float(np.hypot(*(total_momentum(finish) - total_momentum(start))))
        yield Check("momentum", _part(change, course.momentum), rounding)
    if isinstance(start.container, Circle):
        change = total_angular_momentum(finish) - total_angular_momentum(start)
        yield Check("angular momentum", _part(change, course.arm), rounding)


def _virial(trace: Trace, course: EventRecord) -> Iterator[Check]:
    """Change of the sum of m x.v = integral of 2 K dt - (R - r) J at the wall + d J of pairs.

    In a fixed circle, about its centre, as a part of all the terms together.
    """
    start, events = trace.start, trace.events
    room = reaches(start)
    if events is not None:
        at_wall = events.at_wall
        energies = series(trace).kinetic_energy
        times = np.concatenate([[0.0], events.time, [trace.stop.time]])
        action = math.fsum(2 * energies * np.diff(times))
        wall = math.fsum((room[events.i] * events.impulse)[at_wall])
        reach = start.radii[events.i] + start.radii[events.j]
        pairs = math.fsum((reach * events.impulse)[~at_wall])
        impulse = math.fsum(events.impulse)
    elif start.restitution == start.wall_restitution == 1.0 and np.ptp(start.radii) == 0:
        rows = series(trace)
        action = 2 * total_energy(start) * trace.stop.time
        wall = float(room[0] * rows.wall_impulse[-1])
        pairs = float(rows.pair_virial[-1])
        impulse = float(rows.wall_impulse[-1] + rows.pair_virial[-1] / (2 * start.radii[0]))
    else:
        return
    change = _moment(trace.finish) - _moment(start)
    whole = action + wall + pairs + course.arm
    rounding = OPERATIONS * EPSILON * (trace.collisions + start.number)
    of_places = impulse * course.place * (1 + course.run)
    bound = rounding * course.arm + of_places + OPERATIONS * EPSILON * start.number * action
    if events is None:  # the kernel adds up its sums one by one
        bound += rounding * (action + wall + pairs)
    yield Check("virial", _part(change - action + wall - pairs, whole), _part(bound, whole))


def reaches(scene: Scene) -> Floats:
    """Distance of each ball from the centre of a circle when it touches the wall; (*N*,), m."""
    return scene.container.wall_gaps(np.zeros(2), scene.radii)


def _moment(scene: Scene) -> float:
    """The sum of m x.v about the container's centre, J s."""
    offsets = scene.positions - scene.container_position
    return math.fsum(scene.masses * np.sum(offsets * scene.velocities, axis=1))


def _part(error: float, whole: float) -> float:
    """The error as a part of a whole; an error of nothing is infinitely large."""
    if whole > 0:
        return abs(error) / whole
    return 0.0 if error == 0 else math.inf


def _deepest_overlap(scene: Scene, course: EventRecord) -> float:
    """The deepest overlap of two balls, m, at the states and on the way until the next event."""
    states = course.states
    i, j = np.triu_indices(scene.number, 1)
    contact = scene.radii[i] + scene.radii[j]
    ways = np.append(course.ways, 0.0)
    deepest = 0.0
    at_once = max(1, 1_000_000 // max(1, len(i)))
    for first in range(0, len(ways), at_once):
        rows = slice(first, first + at_once)
        offset = scene.container.nearest_image(
            states.positions[rows][:, i] - states.positions[rows][:, j]
        )
        velocity = states.velocities[rows][:, i] - states.velocities[rows][:, j]
        x, y, u, v = *np.moveaxis(offset, -1, 0), *np.moveaxis(velocity, -1, 0)
        w2 = u * u + v * v
        until = np.clip(-(x * u + y * v) / np.where(w2 > 0, w2, 1.0), 0.0, ways[rows, None])
        distance = np.hypot(x + u * until, y + v * until)
        deepest = max(deepest, float(np.max(contact - distance, initial=0.0)))
    return deepest


def _farthest_escape(scene: Scene, course: EventRecord) -> float:
    """How far a ball sticks out of the wall, m, at the states; between them it is farther in."""
    states = course.states
    places = states.positions - states.container_positions[:, None]
    return float(np.max(-scene.container.wall_gaps(places, scene.radii), initial=0.0))


# What is known exactly of hard cases: counts, times, impulses, and whom a ball hits.

PI_DIGITS = "3141592"

LEAST = 1e-300
"""What an error is compared by where none is allowed."""


def _difference(name: str, found: Floats, expected: ArrayLike, bound: ArrayLike) -> Check:
    """The difference that is largest beside its bound; infinite if there are not as many."""
    many = np.shape(expected)
    if not len(found) or (many and many != found.shape):
        return Check(name, math.inf, float(np.max(bound)))
    errors = abs(found - np.asarray(expected, dtype=np.float64))
    bounds = np.broadcast_to(np.asarray(bound, dtype=np.float64), errors.shape)
    worst = int(np.argmax(errors / np.maximum(bounds, LEAST)))
    return Check(name, float(errors[worst]), float(bounds[worst]))


def _events(trace: Trace) -> Events:
    """The collisions; a summary has none."""
    assert trace.events is not None
    return trace.events


def _partners(trace: Trace) -> list[tuple[int, int]]:
    """Who collided, in order."""
    return list(zip(_events(trace).i.tolist(), _events(trace).j.tolist(), strict=True))


def _whom(trace: Trace, expected: list[tuple[int, int]]) -> Check:
    """Collisions, from the first, that are between others than expected, missing or too many."""
    found = _partners(trace)
    wrong = sum(one != other for one, other in zip(found, expected, strict=False))
    return Check("wrong collisions", wrong + abs(len(found) - len(expected)), 0)


def grazing(trace: Trace) -> Iterator[Check]:
    """Who hits by exact arithmetic, and with J = (1 + e) mu g, g^2 = w^2 - (x cross w)^2/d^2.

    x cross w is good to an epsilon of |x||w|, so that g is to that part of w^2/g.
    """
    start, hits = trace.start, []
    for i in range(0, start.number, 2):
        (x, y), (u, v) = (
            [Fraction(float(b)) - Fraction(float(a)) for a, b in zip(*column, strict=True)]
            for column in (start.positions[i : i + 2], start.velocities[i : i + 2])
        )
        reach = sum(Fraction(float(radius)) for radius in start.radii[i : i + 2])
        w2, cross = u * u + v * v, x * v - y * u
        if x * u + y * v >= 0 or cross * cross >= w2 * reach * reach:
            continue
        g = math.sqrt(w2 - cross * cross / reach**2)
        mass = 1 / float(np.sum(1 / start.masses[i : i + 2]))
        far = math.sqrt(x * x + y * y)
        bound = 2 * EPSILON * far / float(reach) * float(w2) / g
        hits.append((i, i + 1, (1 + start.restitution) * mass * np.array([g, bound])))
    yield _whom(trace, [(i, j) for i, j, _ in hits])
    impulse, bound = np.array([each for *_, each in hits]).T
    yield _difference("impulse, kg m/s", _events(trace).impulse, impulse, bound)


def touching(trace: Trace) -> Iterator[Check]:
    """Only the pair that approaches, at 1 m/s, collides, at once, with half of (1 + e) w.

    At once: the pair is a rounding of its coordinates short of touching.
    """
    yield _whom(trace, [(0, 1)])
    rounding = 2 * EPSILON * float(np.max(abs(trace.start.positions[:2])))
    yield _difference("time, s", _events(trace).time, np.zeros(1), rounding)
    expected = np.array([(1 + trace.start.restitution) / 2])
    yield _difference("impulse, kg m/s", _events(trace).impulse, expected, 8 * EPSILON)


def touching_wall(trace: Trace) -> Iterator[Check]:
    """Only the ball that moves out hits the wall, at once, with (1 + e) w."""
    yield _whom(trace, [(0, CONTAINER)])
    yield _difference("time, s", _events(trace).time, np.zeros(1), 0.0)
    expected = np.array([1 + trace.start.wall_restitution])
    yield _difference("impulse, kg m/s", _events(trace).impulse, expected, 8 * EPSILON)


def ring(trace: Trace) -> Iterator[Check]:
    """The first n/2 contacts are at once: when the ring's radius is r/sin(pi/n)."""
    start = trace.start
    radius, speed = math.hypot(*start.positions[0]), math.hypot(*start.velocities[0])
    contact = (radius - float(start.radii[0]) / math.sin(math.pi / start.number)) / speed
    first = _events(trace).time[: start.number // 2]
    yield _difference("time, s", first, contact, PLACE * EPSILON * radius / speed)


def newton_row(trace: Trace) -> Iterator[Check]:
    """Elastic balls that touch hand on all of the velocity, one after the other in one instant."""
    start, events = trace.start, _events(trace)
    if start.restitution < 1:
        return
    last = start.number - 1
    yield _whom(trace, [(k, k + 1) for k in range(last)])
    speed = float(start.velocities[0, 0])
    gap = float(start.positions[1, 0] - start.positions[0, 0] - 2 * start.radii[0])
    yield _difference("time, s", events.time, gap / speed, PLACE * EPSILON * gap / speed)
    expected = np.append(np.zeros(last), speed)
    found = trace.finish.velocities[:, 0]
    yield _difference("velocity, m/s", found, expected, 4 * last * EPSILON * speed)


def whispering(trace: Trace) -> Iterator[Check]:
    """A chord at an angle lasts 2 a sin(angle)/v; a bounce turns it by some epsilon at most."""
    start = trace.start
    room, speed = float(reaches(start)[0]), math.hypot(*start.velocities[0])
    sine = -float(start.velocities[0, 0]) / speed
    count = np.arange(1, len(_events(trace)) + 1)
    turned = 4 * EPSILON * count / sine
    chord = 2 * room * sine / speed
    found = np.diff(_events(trace).time, prepend=0.0) / chord
    clock = np.spacing(_events(trace).time) / chord
    yield _difference("a chord's time, relatively", found, 1.0, turned + clock)
    impulse = _events(trace).impulse / (2 * float(start.masses[0]) * speed * sine)
    yield _difference("impulse, relatively", impulse, 1.0, turned)


def full(trace: Trace) -> Iterator[Check]:
    """Hits follow each other after 2 a/v, the first after a/v."""
    start = trace.start
    room, speed = float(reaches(start)[0]), math.hypot(*start.velocities[0])
    count = np.arange(1, len(_events(trace)) + 1)
    found = _events(trace).time * speed / room / (2 * count - 1)
    yield _difference("time, relatively", found, 1.0, PLACE * EPSILON * count)


def wall_trap_told(trace: Trace) -> Iterator[Check]:
    """The ending names the ball and the wall trap."""
    told = trace.stop.balls == (0,) and "wall trap" in trace.stop.message
    yield Check("endings not told", float(not told), 0)


def wall_trap_sums(trace: Trace) -> Iterator[Check]:
    """Times, angles and impulses of a ball in a wall trap, k = 0, 1 ... after the first hit.

    v_n = e^k v_0, with v_t constant: dt = 2 a v_n/(v_n^2 + v_t^2), dphi = 2 atan(v_n/v_t) and
    J = (1 + e) v_n; all J together are v_0 (1 + e)/(1 - e). What was left when the run ended is
    added as known. Each bounce rounds v_n by some epsilon of the whole velocity.
    """
    start, events = trace.start, _events(trace)
    room, e = float(reaches(start)[0]), start.wall_restitution
    across, along = (float(each) for each in start.velocities[0])
    first = e * across
    hits = len(events)
    normal = first * e ** np.arange(4096)
    lasting = 2 * room * normal / (normal**2 + along**2)
    turning = 2 * np.arctan2(normal, along)
    impulse = (1 + e) * normal
    speed = math.hypot(first, along)
    rounding = PLACE * EPSILON * np.arange(1, hits)
    yield _difference(
        "a time, s",
        np.diff(events.time),
        lasting[: hits - 1],
        rounding * room / along + np.spacing(trace.stop.time),
    )
    yield _difference("an impulse", events.impulse[1:], impulse[: hits - 1], 2 * rounding * speed)
    sums, error = math.fsum(np.diff(events.time)), float(np.sum(rounding))
    left = math.fsum(lasting[hits - 1 :])
    expected = np.array([math.fsum(lasting)])
    yield _difference("T, s", np.array([sums + left]), expected, error * room / along)
    turned = _turned(trace) + math.fsum(turning[hits - 1 :])
    yield _difference(
        "phi, rad", np.array([turned]), np.array([math.fsum(turning)]), error * speed / along
    )
    pushed = math.fsum(events.impulse[1:]) + math.fsum(impulse[hits - 1 :])
    expected = np.array([first * (1 + e) / (1 - e)])
    yield _difference("sum of J, kg m/s", np.array([pushed]), expected, 2 * error * speed)


def _turned(trace: Trace) -> float:
    """The angle by which a ball has gone round from its first hit to its last, rad."""
    places = replay(trace, _events(trace).time).positions[:, 0]
    return float(np.sum(np.diff(np.unwrap(np.arctan2(places[:, 1], places[:, 0])))))


def along_the_wall(trace: Trace) -> Iterator[Check]:
    """A wall that takes energy traps the ball; at an elastic one nothing changes but the count."""
    lossy = trace.start.wall_restitution < 1
    expected = StopReason.WALL_TRAP if lossy else StopReason.COLLAPSE
    yield Check("wrong endings", float(trace.stop.reason is not expected), 0)
    yield Check("impulse, kg m/s", math.fsum(_events(trace).impulse), 0)


def collapse_below(critical: float) -> Fact:
    """Whether a run ended in a collapse, as it must below a critical restitution and only there."""

    def fact(trace: Trace) -> Iterator[Check]:
        collapsed = trace.stop.reason is StopReason.COLLAPSE
        wrong = collapsed != (trace.start.restitution < critical)
        yield Check("wrong endings", float(wrong), 0)

    return fact


def galperin(trace: Trace) -> Iterator[Check]:
    """Masses m and 100^k m collide as often as the first k + 1 digits of pi say (Galperin 2003)."""
    power = round(math.log(float(trace.start.masses[1] / trace.start.masses[0]), 100))
    expected = int(PI_DIGITS[: power + 1])
    yield Check("collisions too many or few", abs(trace.collisions - expected), 0)


def needles(trace: Trace) -> Iterator[Check]:
    """The first two contacts of the three balls in a line, both after the same gap."""
    start = trace.start
    gap = -float(start.positions[0, 0] + start.radii[0] + start.radii[1])
    contact = gap / float(start.velocities[0, 0])
    yield _difference("time, s", _events(trace).time[:2], contact, PLACE * EPSILON * contact)


def late_row(trace: Trace) -> Iterator[Check]:
    """A row of elastic balls with gaps: each is hit a gap after the one before it.

    Places and the clock are as large as each other here, and so are their epsilons.
    """
    start = trace.start
    yield _whom(trace, [(k, k + 1) for k in range(start.number - 1)])
    speed = Fraction(float(start.velocities[0, 0]))
    places = [Fraction(float(x)) for x in start.positions[:, 0]]
    diameter = 2 * Fraction(float(start.radii[0]))
    gaps = [after - before - diameter for before, after in itertools.pairwise(places)]
    exact = [sum(gaps[: k + 1]) / speed for k in range(len(gaps))]
    late = [float(Fraction(float(t)) - exact[k]) for k, t in enumerate(_events(trace).time)]
    bound = PLACE * EPSILON * float(exact[-1])
    yield _difference("time, s", np.array(late), np.zeros(len(exact)), bound)


def corner(trace: Trace) -> Iterator[Check]:
    """A ball into the corner hits both sides in one instant, each with twice its momentum."""
    start = trace.start
    time = (start.container.size[0] / 2 - float(start.radii[0])) / float(start.velocities[0, 0])
    own = _events(trace).i == 0
    yield _difference("time, s", _events(trace).time[own][:2], time, PLACE * EPSILON * time)
    momentum = 2 * float(start.masses[0] * start.velocities[0, 0])
    impulse = _events(trace).impulse[own][:2]
    yield _difference("impulse, kg m/s", impulse, momentum, PLACE * EPSILON * momentum)


def random_walk(trace: Trace) -> Iterator[Check]:
    """Roundings of elastic collisions in a fixed circle to either side, not all of them to one.

    Those of n collisions then add up to the root of n times one's, four epsilons of a ball's: six
    standard deviations of it never happen. All to one side would be 5,000 times that for a billion.
    """
    start = trace.start
    walk = 6 * math.sqrt(trace.collisions) * 4 * EPSILON
    energy = total_energy(start)
    drift = float(np.max(abs(series(trace).kinetic_energy - energy)))
    yield Check("drift of energy, of a ball's", drift * start.number / energy, walk)
    turned = abs(total_angular_momentum(trace.finish) - total_angular_momentum(start))
    largest = float(np.max(start.masses * np.hypot(*trace.finish.velocities.T)))
    part = turned / (largest * start.container.size[0] / 2)
    yield Check("drift of angular momentum, of a ball's", part, walk)


def nothing_happens(trace: Trace) -> Iterator[Check]:
    """No collisions, and no ball has moved."""
    yield Check("collisions", trace.collisions, 0)
    moved = float(np.max(abs(trace.finish.positions - trace.start.positions)))
    yield Check("moved by, m", moved, 0)
