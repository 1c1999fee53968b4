"""What must be true of a trace, and how far rounding alone can violate it.

The bounds are for the worst case, in which all roundings have the same sign. They are linear in the
number of events; measured errors grow as its square root and stay far below.

- A collision takes about ten operations, each exact to half an epsilon of a property of a body:
  ``OPERATIONS`` epsilon an event, of the energy at the start, the momenta and their arms. The
  impulse acts along the actual offset, so errors of position do not matter to these three.
- A contact is the root of a quadratic. It is exact to some epsilon of the distance to it and of the
  clock: ``PLACE`` epsilon of the largest distances, and of the distance that the fastest body
  covers until then. A ball that hits the wall several times in a row keeps its distance from the
  centre with all errors, so these add up until it meets a ball.
- The virial errs by each impulse times the error of its position.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

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
from snooker_cli.validation.methods import deepest_overlap, farthest_escape

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Events, Trace

    Floats = NDArray[np.float64]
    Fact = Callable[[Trace], Iterator["Check"]]

OPERATIONS, PLACE = 16, 8

BUDGET = 1_000_000
"""Pairs of balls, times states, that are checked; of more states, evenly distributed ones."""

PI_DIGITS = "3141592"

LEAST = 1e-300
"""Replaces a bound of zero where errors are compared with their bounds."""


@dataclass(frozen=True)
class Check:
    """An error and its bound. An error that is not a number never holds."""

    name: str
    error: float
    bound: float

    @property
    def holds(self) -> bool:
        """Whether the error is within its bound."""
        return self.error <= self.bound

    def as_json(self) -> dict[str, Any]:
        """Its fields and its verdict."""
        error, bound = float(self.error), float(self.bound)
        return {"name": self.name, "error": error, "bound": bound, "holds": self.holds}


@dataclass(frozen=True)
class EventRecord:
    """States of a trace, and the sizes to which roundings are proportional.

    states : at the start, after each event or some of them, and at the end
    flights : (*t*,) s, the time of free flight after each state; 0 for the last
    place : m, the error of a contact's position
    run : the largest number of wall hits in a row of one ball
    momentum, arm : largest sum of |p| and of |x||p|, kg m/s and kg m^2/s
    """

    states: States
    flights: Floats
    place: float
    run: int
    momentum: float
    arm: float


# Checks of any trace


def checks(trace: Trace) -> list[Check]:
    """The checks of any trace; the first is that all numbers are valid, or the only one."""
    broken = _broken_numbers(trace)
    found = [Check("numbers", broken, 0.0)]
    if broken:
        return found
    start, record = trace.start, event_record(trace)
    found += _conservation(trace, record)
    if isinstance(start.container, Circle) and not start.free:
        found += _virial(trace, record)
    overlap = deepest_overlap(start, record.states, record.flights)
    found.append(Check("overlap", overlap, record.place))
    if start.container.has_wall:
        bound = record.place * (1 + record.run)
        found.append(Check("escape", farthest_escape(start, record.states), bound))
    return found


def _broken_numbers(trace: Trace) -> float:
    """The number of values that are not finite, negative or out of order."""
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


def event_record(trace: Trace) -> EventRecord:
    """The states of a trace, for a summary those at its ends, and their sizes."""
    start, end = trace.start, trace.stop.time
    if trace.events is None:
        ends = start, trace.finish
        states = States(
            time=np.array([0.0, end]),
            positions=np.array([scene.positions for scene in ends]),
            velocities=np.array([scene.velocities for scene in ends]),
            container_positions=np.array([scene.container_position for scene in ends]),
            container_velocities=np.array([scene.container_velocity for scene in ends]),
        )
        flights = np.zeros(2)
    else:
        times = np.concatenate([[0.0], trace.events.time, [end]])
        pairs = max(1, start.number * (start.number - 1) // 2)
        rows = max(2, min(len(times), BUDGET // pairs, BUDGET // start.number))
        kept = np.linspace(0, len(times) - 1, rows).round().astype(np.int64)
        states, flights = replay(trace, times[kept]), np.diff(times, append=end)[kept]
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
    clock = float(np.max(fastest * (states.time + flights)))
    return EventRecord(
        states=states,
        flights=flights,
        place=PLACE * EPSILON * (2 * far + diameter + clock),
        run=longest_run(trace),
        momentum=float(np.max(momentum)),
        arm=float(np.max(arm)),
    )


def longest_run(trace: Trace) -> int:
    """The largest number of wall hits in a row of one ball.

    A summary has no events. Its number is so large that one gas in a billion exceeds it, if all
    balls hit the wall equally often; it is all wall hits if there are no others.
    """
    events = trace.events
    if events is None:
        if not trace.wall_events or not trace.pair_events:
            return trace.wall_events
        # n p^m = 1e-9 with the wall's share p of a ball's collisions
        share = trace.wall_events / (trace.wall_events + 2 * trace.pair_events)
        likely = math.log(1e-9 / trace.wall_events) / math.log(share)
        return min(trace.wall_events, math.ceil(likely))
    at_wall = events.at_wall
    ball = np.concatenate([events.i, events.j[~at_wall]])
    of_wall = np.concatenate([at_wall, np.zeros(int(np.sum(~at_wall)), dtype=bool)])
    when = np.concatenate([np.arange(len(events)), np.flatnonzero(~at_wall)])
    order = np.lexsort((when, ball))
    ball, of_wall = ball[order], of_wall[order]
    # A run ends where the ball meets another, and where the next ball's events begin.
    ends = np.flatnonzero(~of_wall | (np.diff(ball, prepend=-1) != 0))
    return int(np.max(np.diff(np.append(ends, len(ball))), initial=0))


def _conservation(trace: Trace, record: EventRecord) -> Iterator[Check]:
    """Errors of energy, momentum and angular momentum, relative."""
    start, finish = trace.start, trace.finish
    rounding = OPERATIONS * EPSILON * (trace.collisions + start.number)
    energy = total_energy(start)
    if trace.events is not None:
        missing = total_energy(finish) - energy + losses(start, trace.events)
        yield Check("energy", _relative(missing, energy), rounding)
    elif start.restitution == start.wall_restitution == 1.0:
        rows = series(trace)
        missing = float(np.max(abs(rows.kinetic_energy + rows.container_energy - energy)))
        yield Check("energy", _relative(missing, energy), rounding)
    if start.free or not start.container.has_wall:
        change = float(np.hypot(*(total_momentum(finish) - total_momentum(start))))
        yield Check("momentum", _relative(change, record.momentum), rounding)
    if isinstance(start.container, Circle):
        change = total_angular_momentum(finish) - total_angular_momentum(start)
        yield Check("angular momentum", _relative(change, record.arm), rounding)


def _virial(trace: Trace, record: EventRecord) -> Iterator[Check]:
    """Change of the sum of m x.v = integral of 2 K dt - (R - r) J at the wall + d J of pairs.

    In a fixed circle, about its centre, relative to all terms together.
    """
    start, events = trace.start, trace.events
    room = start.container.wall_gaps(np.zeros(2), start.radii)
    rows = series(trace)
    if events is not None:
        at_wall = events.at_wall
        times = np.concatenate([[0.0], events.time, [trace.stop.time]])
        action = math.fsum(2 * rows.kinetic_energy * np.diff(times))
        wall = math.fsum((room[events.i] * events.impulse)[at_wall])
        distance = start.radii[events.i] + start.radii[events.j]
        pairs = math.fsum((distance * events.impulse)[~at_wall])
        impulse = math.fsum(events.impulse)
    elif start.restitution == start.wall_restitution == 1.0 and np.ptp(start.radii) == 0:
        action = 2 * total_energy(start) * trace.stop.time
        wall = float(room[0] * rows.wall_impulse[-1])
        pairs = float(rows.pair_virial[-1])
        impulse = float(rows.wall_impulse[-1] + rows.pair_virial[-1] / (2 * start.radii[0]))
    else:
        return
    change = _moment(trace.finish) - _moment(start)
    whole = action + wall + pairs + record.arm
    rounding = OPERATIONS * EPSILON * (trace.collisions + start.number)
    of_places = impulse * record.place * (1 + record.run)
    bound = rounding * record.arm + of_places + OPERATIONS * EPSILON * start.number * action
    if events is None:  # the kernel adds its sums term by term
        bound += rounding * (action + wall + pairs)
    error = change - action + wall - pairs
    yield Check("virial", _relative(error, whole), _relative(bound, whole))


def _moment(scene: Scene) -> float:
    """The sum of m x.v about the container's centre, J s."""
    offsets = scene.positions - scene.container_position
    return math.fsum(scene.masses * np.sum(offsets * scene.velocities, axis=1))


def _relative(error: float, whole: float) -> float:
    """The error over a whole; an error of nothing is infinitely large."""
    if whole > 0:
        return abs(error) / whole
    return 0.0 if error == 0 else math.inf


# Exact facts about single cases: counts, times, impulses and partners


def _difference(name: str, found: Floats, expected: ArrayLike, bound: ArrayLike) -> Check:
    """The difference that is largest relative to its bound; infinite if values are missing."""
    expected, bounds = np.asarray(expected, dtype=np.float64), np.asarray(bound, dtype=np.float64)
    if not len(found) or (expected.ndim and expected.shape != found.shape):
        return Check(name, math.inf, float(np.max(bounds)))
    errors = abs(found - expected)
    bounds = np.broadcast_to(bounds, errors.shape)
    worst = int(np.argmax(errors / np.maximum(bounds, LEAST)))
    return Check(name, float(errors[worst]), float(bounds[worst]))


def _events(trace: Trace) -> Events:
    """The collisions; a summary has none."""
    assert trace.events is not None
    return trace.events


def _partners(trace: Trace, expected: list[tuple[int, int]]) -> Check:
    """Collisions, from the first, between other bodies than expected, missing or too many."""
    events = _events(trace)
    found = list(zip(events.i.tolist(), events.j.tolist(), strict=True))
    wrong = sum(one != other for one, other in zip(found, expected, strict=False))
    return Check("wrong collisions", wrong + abs(len(found) - len(expected)), 0)


def _lone_ball(trace: Trace) -> tuple[float, float]:
    """The radius of the circle in which the centre of ball 0 moves, m, and its speed, m/s."""
    start = trace.start
    room = start.container.wall_gaps(np.zeros(2), start.radii)
    return float(room[0]), math.hypot(*start.velocities[0])


def grazing(trace: Trace) -> Iterator[Check]:
    """Exact arithmetic gives who hits, and J = (1 + e) mu g, g^2 = w^2 - (x cross w)^2/d^2.

    x cross w has an error of an epsilon of |x||w|, so g has that part of w^2/g.
    """
    start, hits = trace.start, []
    for i in range(0, start.number, 2):
        (x, y), (u, v) = (
            [Fraction(float(b)) - Fraction(float(a)) for a, b in zip(*column, strict=True)]
            for column in (start.positions[i : i + 2], start.velocities[i : i + 2])
        )
        contact = sum(Fraction(float(radius)) for radius in start.radii[i : i + 2])
        w2, cross = u * u + v * v, x * v - y * u
        if x * u + y * v >= 0 or cross * cross >= w2 * contact * contact:
            continue
        g = math.sqrt(w2 - cross * cross / contact**2)
        mass = 1 / float(np.sum(1 / start.masses[i : i + 2]))
        bound = 2 * EPSILON * math.sqrt(x * x + y * y) / float(contact) * float(w2) / g
        hits.append((i, i + 1, (1 + start.restitution) * mass * np.array([g, bound])))
    yield _partners(trace, [(i, j) for i, j, _ in hits])
    impulse, bounds = np.array([each for *_, each in hits]).T
    yield _difference("impulse, kg m/s", _events(trace).impulse, impulse, bounds)


def touching(trace: Trace) -> Iterator[Check]:
    """Only the approaching pair collides, at once, at 1 m/s, with half of (1 + e) w.

    At once up to rounding: the pair is a rounding of its coordinates short of touching.
    """
    yield _partners(trace, [(0, 1)])
    rounding = 2 * EPSILON * float(np.max(abs(trace.start.positions[:2])))
    yield _difference("time, s", _events(trace).time, np.zeros(1), rounding)
    expected = np.array([(1 + trace.start.restitution) / 2])
    yield _difference("impulse, kg m/s", _events(trace).impulse, expected, 8 * EPSILON)


def touching_wall(trace: Trace) -> Iterator[Check]:
    """Only the ball that moves outwards hits the wall, at once, with (1 + e) w."""
    yield _partners(trace, [(0, CONTAINER)])
    yield _difference("time, s", _events(trace).time, np.zeros(1), 0.0)
    expected = np.array([1 + trace.start.wall_restitution])
    yield _difference("impulse, kg m/s", _events(trace).impulse, expected, 8 * EPSILON)


def ring(trace: Trace) -> Iterator[Check]:
    """The first n/2 contacts are simultaneous: when the ring's radius is r/sin(pi/n)."""
    start = trace.start
    radius, speed = math.hypot(*start.positions[0]), math.hypot(*start.velocities[0])
    contact = (radius - float(start.radii[0]) / math.sin(math.pi / start.number)) / speed
    first = _events(trace).time[: start.number // 2]
    yield _difference("time, s", first, contact, PLACE * EPSILON * radius / speed)


def newton_row(trace: Trace) -> Iterator[Check]:
    """Elastic balls that touch pass on the whole velocity, one after the other in one instant."""
    start = trace.start
    if start.restitution < 1:
        return
    last = start.number - 1
    yield _partners(trace, [(k, k + 1) for k in range(last)])
    speed = float(start.velocities[0, 0])
    contact = float(start.positions[1, 0] - start.positions[0, 0] - 2 * start.radii[0]) / speed
    yield _difference("time, s", _events(trace).time, contact, PLACE * EPSILON * contact)
    expected = np.append(np.zeros(last), speed)
    found = trace.finish.velocities[:, 0]
    yield _difference("velocity, m/s", found, expected, 4 * last * EPSILON * speed)


def whispering(trace: Trace) -> Iterator[Check]:
    """A chord at an angle lasts 2 a sin(angle)/v; a bounce turns it by a few epsilon at most."""
    start, events = trace.start, _events(trace)
    room, speed = _lone_ball(trace)
    sine = -float(start.velocities[0, 0]) / speed
    turned = 4 * EPSILON * np.arange(1, len(events) + 1) / sine
    chord = 2 * room * sine / speed
    found, clock = np.diff(events.time, prepend=0.0) / chord, np.spacing(events.time) / chord
    yield _difference("a chord's time, relatively", found, 1.0, turned + clock)
    impulse = events.impulse / (2 * float(start.masses[0]) * speed * sine)
    yield _difference("impulse, relatively", impulse, 1.0, turned)


def full(trace: Trace) -> Iterator[Check]:
    """The first hit is after a/v, and the others follow each other after 2 a/v."""
    room, speed = _lone_ball(trace)
    count = np.arange(1, len(_events(trace)) + 1)
    found = _events(trace).time * speed / room / (2 * count - 1)
    yield _difference("time, relatively", found, 1.0, PLACE * EPSILON * count)


def trapped_ball(trace: Trace) -> Iterator[Check]:
    """The stop names the ball in the wall trap."""
    yield Check("wrong balls in the stop", float(trace.stop.balls != (0,)), 0)


def wall_trap_sums(trace: Trace) -> Iterator[Check]:
    """Times, angles and impulses of a ball in a wall trap, k = 0, 1 ... after the first hit.

    v_n = e^k v_0 with constant v_t: dt = 2 a v_n/(v_n^2 + v_t^2), dphi = 2 atan(v_n/v_t) and
    J = (1 + e) v_n; the sum of all J is v_0 (1 + e)/(1 - e). The exact rest after the end of the
    run is added. Each bounce rounds v_n by a few epsilon of the whole velocity.
    """
    events, e = _events(trace), trace.start.wall_restitution
    room, _ = _lone_ball(trace)
    across, along = (float(each) for each in trace.start.velocities[0])
    first, hits = e * across, len(events)
    normal = first * e ** np.arange(4096)
    flights = 2 * room * normal / (normal**2 + along**2)
    angles = 2 * np.arctan2(normal, along)
    impulse = (1 + e) * normal
    speed = math.hypot(first, along)
    rounding = PLACE * EPSILON * np.arange(1, hits)
    clock = np.spacing(trace.stop.time)
    found = np.diff(events.time)
    yield _difference("a time, s", found, flights[: hits - 1], rounding * room / along + clock)
    bounds = 2 * rounding * speed
    yield _difference("an impulse", events.impulse[1:], impulse[: hits - 1], bounds)
    x, y = replay(trace, events.time).positions[:, 0].T
    turned = float(np.sum(np.diff(np.unwrap(np.arctan2(y, x)))))
    pushed = math.fsum(events.impulse[1:])
    error, total = float(np.sum(rounding)), first * (1 + e) / (1 - e)
    for name, before, rest, expected, bound in (
        ("T, s", math.fsum(found), flights, math.fsum(flights), error * room / along),
        ("phi, rad", turned, angles, math.fsum(angles), error * speed / along),
        ("sum of J, kg m/s", pushed, impulse, total, 2 * error * speed),
    ):
        whole = np.array([before + math.fsum(rest[hits - 1 :])])
        yield _difference(name, whole, np.array([expected]), bound)


def along_the_wall(trace: Trace) -> Iterator[Check]:
    """A wall with losses traps the ball; at an elastic wall only the count changes."""
    lossy = trace.start.wall_restitution < 1
    expected = StopReason.WALL_TRAP if lossy else StopReason.COLLAPSE
    yield Check("wrong endings", float(trace.stop.reason is not expected), 0)
    yield Check("impulse, kg m/s", math.fsum(_events(trace).impulse), 0)


def collapse_below(critical: float) -> Fact:
    """The fact that a run collapses if, and only if, its restitution is below a critical one."""

    def fact(trace: Trace) -> Iterator[Check]:
        collapsed = trace.stop.reason is StopReason.COLLAPSE
        wrong = collapsed != (trace.start.restitution < critical)
        yield Check("wrong endings", float(wrong), 0)

    return fact


def galperin(trace: Trace) -> Iterator[Check]:
    """Masses m and 100^k m collide as often as the first k + 1 digits of pi (Galperin 2003)."""
    power = round(math.log(float(trace.start.masses[1] / trace.start.masses[0]), 100))
    expected = int(PI_DIGITS[: power + 1])
    yield Check("collisions too many or few", abs(trace.collisions - expected), 0)


def needles(trace: Trace) -> Iterator[Check]:
    """The first two contacts of three balls in a line, both after the same gap."""
    start = trace.start
    gap = -float(start.positions[0, 0] + start.radii[0] + start.radii[1])
    contact = gap / float(start.velocities[0, 0])
    yield _difference("time, s", _events(trace).time[:2], contact, PLACE * EPSILON * contact)


def late_row(trace: Trace) -> Iterator[Check]:
    """A row of elastic balls with gaps: each is hit one gap after the ball before it.

    Positions and the clock are equally large here, and so are their epsilons.
    """
    start = trace.start
    yield _partners(trace, [(k, k + 1) for k in range(start.number - 1)])
    speed = Fraction(float(start.velocities[0, 0]))
    places = [Fraction(float(x)) for x in start.positions[:, 0]]
    diameter = 2 * Fraction(float(start.radii[0]))
    gaps = [after - before - diameter for before, after in itertools.pairwise(places)]
    exact = [gap / speed for gap in itertools.accumulate(gaps)]
    late = [float(Fraction(float(t)) - exact[k]) for k, t in enumerate(_events(trace).time)]
    bound = PLACE * EPSILON * float(exact[-1])
    yield _difference("time, s", np.array(late), np.zeros(len(exact)), bound)


def corner(trace: Trace) -> Iterator[Check]:
    """A ball into the corner hits both sides in one instant, each with twice its momentum."""
    start, events = trace.start, _events(trace)
    time = (start.container.size[0] / 2 - float(start.radii[0])) / float(start.velocities[0, 0])
    own = events.i == 0
    yield _difference("time, s", events.time[own][:2], time, PLACE * EPSILON * time)
    momentum = 2 * float(start.masses[0] * start.velocities[0, 0])
    impulse = events.impulse[own][:2]
    yield _difference("impulse, kg m/s", impulse, momentum, PLACE * EPSILON * momentum)


def random_walk(trace: Trace) -> Iterator[Check]:
    """The roundings of elastic collisions in a fixed circle have random signs.

    Those of n collisions add up to the root of n times one of them, four epsilons of a ball's; six
    standard deviations of that never happen. With equal signs a billion give 5,000 times as much.
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
