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
- The first collisions are those of the exact twin. A rounding changes an event by no more than
  ``PLACE`` epsilon of the start does, or of the contact's distance at its speed; roundings add up.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from snooker_cli.analysis.observables import losses, total_energy
from snooker_cli.containers import Circle
from snooker_cli.engine import States, replay, series
from snooker_cli.neighbours import Floats
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import Events, StopReason, Trace
from snooker_cli.validation.exact_twin import trajectory
from snooker_cli.validation.methods import (
    deepest_overlap,
    farthest_escape,
    first_different,
    imbalance,
)

OPERATIONS, PLACE = 16, 8

BUDGET = 1_000_000
"""Pairs of balls, times states, that are checked; of more states, evenly distributed ones."""

FOLLOWED, TWIN_DIGITS = 100, 60  # balls times events that the exact twin follows, and its digits
ROUNDED_STARTS = 2  # starts that are a rounding apart, to see what roundings change
LEAST = 1e-300  # replaces a bound of zero where errors are compared with their bounds

PI_DIGITS = "3141592"


class Check(NamedTuple):
    """An error and its bound. An error that is not a number never holds."""

    name: str
    error: float
    bound: float

    @property
    def holds(self) -> bool:
        """Whether the error is within its bound."""
        return self.error <= self.bound


class EventRecord(NamedTuple):
    """States of a trace, and the sizes to which roundings are proportional."""

    states: States  # at the start, after each event or some of them, and at the end
    flights: Floats  # s, the time of free flight after each state
    place: float  # m, the error of a contact's position
    run: int  # the largest number of wall hits in a row of one ball
    momentum: float  # the largest sum of |p|, kg m/s
    arm: float  # and of |x||p|, kg m^2/s


# Checks of any trace


def checks(trace: Trace) -> list[Check]:
    """The checks of any trace; the first is that all numbers are valid, or the only one.

    A summary has no events, so its overlaps are those at the end.
    """
    broken = _broken_numbers(trace)
    found = [Check("numbers", broken, 0.0)]
    if broken:
        return found
    start, record = trace.start, event_record(trace)
    found += _conservation(trace, record)
    overlap = deepest_overlap(start, record.states, record.flights)
    found.append(Check("overlap", overlap, record.place))
    if trace.events is None or not start.container.has_wall:
        return found
    if isinstance(start.container, Circle) and not start.free:
        found.append(_virial(trace, trace.events, record))
    escape = farthest_escape(start, record.states)
    found.append(Check("escape", escape, record.place * (1 + record.run)))
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
    """The states of a trace, for a summary the last, and their sizes."""
    start, finish, end = trace.start, trace.finish, trace.stop.time
    if trace.events is None:
        one = finish.positions, finish.velocities, finish.container_position
        columns = (column[np.newaxis] for column in (*one, finish.container_velocity))
        states, flights = States(np.array([end]), *columns), np.zeros(1)
    else:
        times = np.concatenate([[0.0], trace.events.time, [end]])
        pairs = max(1, start.number * (start.number - 1) // 2)
        rows = max(2, min(len(times), BUDGET // pairs, BUDGET // start.number))
        kept = np.linspace(0, len(times) - 1, rows).round().astype(np.int64)
        states, flights = replay(trace, times[kept]), np.diff(times, append=end)[kept]
    velocities, positions, masses = states.velocities, states.positions, start.masses
    if start.free:
        velocities = np.hstack([velocities, states.container_velocities[:, np.newaxis]])
        positions = np.hstack([positions, states.container_positions[:, np.newaxis]])
        masses = np.append(masses, start.container_mass)
    speeds = np.hypot(*np.moveaxis(velocities, -1, 0))
    arms = np.hypot(*np.moveaxis(positions, -1, 0))
    diameter = 2 * float(np.max(start.radii)) if start.number > 1 else 0.0
    clock = float(np.max(np.max(speeds, axis=1) * (states.time + flights)))
    return EventRecord(
        states=states,
        flights=flights,
        place=PLACE * EPSILON * (2 * float(np.max(arms)) + diameter + clock),
        run=0 if trace.events is None else longest_run(trace.events),
        momentum=float(np.max(speeds @ masses)),
        arm=float(np.max((speeds * arms) @ masses)),
    )


def longest_run(events: Events) -> int:
    """The largest number of wall hits in a row of one ball."""
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
    lost = 0.0 if trace.events is None else losses(start, trace.events)
    found = imbalance(start, finish, lost)
    if trace.events is not None or start.restitution == start.wall_restitution == 1.0:
        yield Check("energy", _relative(found["energy"], energy), rounding)
    if start.free or not start.container.has_wall:
        yield Check("momentum", _relative(found["momentum"], record.momentum), rounding)
    if isinstance(start.container, Circle):
        turned = found["angular momentum"]
        yield Check("angular momentum", _relative(turned, record.arm), rounding)


def _virial(trace: Trace, events: Events, record: EventRecord) -> Check:
    """Change of the sum of m x.v = integral of 2 K dt - (R - r) J at the wall + d J of pairs.

    In a fixed circle, about its centre, relative to all terms together.
    """
    start, at_wall = trace.start, events.at_wall
    room = start.container.wall_gaps(np.zeros(2), start.radii)
    times = np.concatenate([[0.0], events.time, [trace.stop.time]])
    action = math.fsum(2 * series(trace).kinetic_energy * np.diff(times))
    wall = math.fsum((room[events.i] * events.impulse)[at_wall])
    distance = start.radii[events.i] + start.radii[events.j]
    pairs = math.fsum((distance * events.impulse)[~at_wall])
    change = _moment(trace.finish) - _moment(start)
    rounding = OPERATIONS * EPSILON * (trace.collisions + start.number)
    of_places = math.fsum(events.impulse) * record.place * (1 + record.run)
    bound = rounding * record.arm + of_places + OPERATIONS * EPSILON * start.number * action
    whole = action + wall + pairs + record.arm
    return Check(
        "virial", _relative(change - action + wall - pairs, whole), _relative(bound, whole)
    )


def _moment(scene: Scene) -> float:
    """The sum of m x.v about the container's centre, J s."""
    offsets = scene.positions - scene.container_position
    return math.fsum(scene.masses * np.sum(offsets * scene.velocities, axis=1))


def _relative(error: float, whole: float) -> float:
    """The error over a whole; an error of nothing is infinitely large."""
    if whole > 0:
        return abs(error) / whole
    return 0.0 if error == 0 else math.inf


class ExactStart(NamedTuple):
    """The first collisions of a scene by the exact twin.

    changes : largest changes of their times (s) and impulses (kg m/s) by a rounding of the start
    """

    events: Events
    changes: dict[str, Floats]


def exact_start(scene: Scene) -> ExactStart:
    """As many collisions as are certain, up to where a rounding of the start changes who collides.

    Raises ``ValueError`` for a periodic box.
    """
    rounding, shape = PLACE * EPSILON, scene.positions.shape
    speeds = np.hypot(*scene.velocities.T)[:, np.newaxis]
    collisions = FOLLOWED // scene.number
    found = trajectory(scene, collisions, TWIN_DIGITS)
    count, others = found.certain, []
    for seed in range(ROUNDED_STARTS):
        dice = np.random.default_rng(seed)
        moved, pushed = rounding * dice.normal(size=(2, *shape))
        other = replace(
            scene,
            positions=scene.positions + moved * scene.container.size[0] / 2,
            velocities=scene.velocities + pushed * speeds,
        )
        others.append(trajectory(other, collisions, TWIN_DIGITS).events)
        count = min(count, first_different(others[-1], found.events))
    events = found.events[:count]
    changes = {
        name: np.max([abs(getattr(one[:count], name) - getattr(events, name)) for one in others], 0)
        for name in ("time", "impulse")
    }
    return ExactStart(events, changes)


def follows(trace: Trace, truth: ExactStart) -> Iterator[Check]:
    """The first collisions are those of the exact twin: who, when and how hard."""
    events, start, exact = trace.events, trace.start, truth.events
    assert events is not None
    count = min(len(exact), len(events))
    due = len(exact) if trace.stop.reason is StopReason.TIME else count
    missed = int(np.sum(exact.time[:due] < trace.stop.time)) - count
    wrong = max(0, missed) + count - first_different(events[:count], exact[:count])
    yield Check("wrong collisions", wrong, 0)
    if wrong or not count:
        return
    exact = exact[:count]
    masses = np.append(start.masses, start.container_mass)
    inverse = 1 / masses[exact.i] + 1 / masses[exact.j]
    restitution = np.where(exact.at_wall, start.wall_restitution, start.restitution)
    with np.errstate(divide="ignore"):  # bodies that do not approach can touch at any time
        delays = start.container.size[0] / (exact.impulse * inverse / (1 + restitution))
    sizes = {"time": exact.time + delays, "impulse": exact.impulse}
    for name, unit in (("time", "s"), ("impulse", "kg m/s")):
        each = truth.changes[name][:count] + PLACE * EPSILON * sizes[name]
        bounds = np.arange(1, count + 1) * np.maximum.accumulate(each)
        errors = abs(getattr(events, name)[:count] - getattr(exact, name))
        worst = int(np.argmax(errors / np.maximum(bounds, LEAST)))
        yield Check(f"{name}, {unit}", float(errors[worst]), float(bounds[worst]))


# Facts about single cases


def _collapses_below(critical: float, trace: Trace) -> Iterator[Check]:
    """A run collapses if, and only if, its restitution is below a critical one."""
    collapsed = trace.stop.reason is StopReason.COLLAPSE
    wrong = collapsed != (trace.start.restitution < critical)
    yield Check("wrong endings", float(wrong), 0)


two_collapse = partial(_collapses_below, 3 - 2 * math.sqrt(2))
three_collapse = partial(_collapses_below, 7 - 4 * math.sqrt(3))


def galperin(trace: Trace) -> Iterator[Check]:
    """Masses m and 100^k m collide as often as the first k + 1 digits of pi (Galperin 2003)."""
    power = round(math.log(float(trace.start.masses[1] / trace.start.masses[0]), 100))
    expected = int(PI_DIGITS[: power + 1])
    yield Check("collisions too many or few", abs(trace.collisions - expected), 0)


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


def nothing_happens(trace: Trace) -> Iterator[Check]:
    """No collisions, and no ball has moved."""
    yield Check("collisions", trace.collisions, 0)
    moved = float(np.max(abs(trace.finish.positions - trace.start.positions)))
    yield Check("moved by, m", moved, 0)
