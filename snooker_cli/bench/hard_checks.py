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

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.bench.ledger import (
    losses,
    total_angular_momentum,
    total_energy,
    total_momentum,
)
from snooker_cli.engine import States, replay, series
from snooker_cli.scene import EPSILON

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

    Floats = NDArray[np.float64]

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
class Course:
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
    if trace.start.shape == "circle" and not trace.start.free:
        found += _virial(trace, course)
    found.append(Check("overlap", _deepest_overlap(trace.start, course), course.place))
    if trace.start.shape != "periodic":
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


def course_of(trace: Trace) -> Course:
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
    return Course(
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


def _books(trace: Trace, course: Course) -> Iterator[Check]:
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
    if start.free or start.shape == "periodic":
        change = float(np.hypot(*(total_momentum(finish) - total_momentum(start))))
        yield Check("momentum", _part(change, course.momentum), rounding)
    if start.shape == "circle":
        change = total_angular_momentum(finish) - total_angular_momentum(start)
        yield Check("angular momentum", _part(change, course.arm), rounding)


def _virial(trace: Trace, course: Course) -> Iterator[Check]:
    """Change of the sum of m x.v = integral of 2 K dt - (R - r) J at the wall + d J of pairs.

    In a fixed circle, about its centre, as a part of all the terms together.
    """
    start, events = trace.start, trace.events
    room = start.container_radius - start.radii
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


def _moment(scene: Scene) -> float:
    """The sum of m x.v about the container's centre, J s."""
    offsets = scene.positions - scene.container_position
    return math.fsum(scene.masses * np.sum(offsets * scene.velocities, axis=1))


def _part(error: float, whole: float) -> float:
    """The error as a part of a whole; an error of nothing is infinitely large."""
    if whole > 0:
        return abs(error) / whole
    return 0.0 if error == 0 else math.inf


def _deepest_overlap(scene: Scene, course: Course) -> float:
    """The deepest overlap of two balls, m, at the states and on the way until the next event."""
    states = course.states
    i, j = np.triu_indices(scene.number, 1)
    contact = scene.radii[i] + scene.radii[j]
    ways = np.append(course.ways, 0.0)
    deepest = 0.0
    at_once = max(1, 1_000_000 // max(1, len(i)))
    for first in range(0, len(ways), at_once):
        rows = slice(first, first + at_once)
        offset = states.positions[rows][:, i] - states.positions[rows][:, j]
        if scene.period is not None:
            offset -= scene.period * np.rint(offset / scene.period)
        velocity = states.velocities[rows][:, i] - states.velocities[rows][:, j]
        x, y, u, v = *np.moveaxis(offset, -1, 0), *np.moveaxis(velocity, -1, 0)
        w2 = u * u + v * v
        until = np.clip(-(x * u + y * v) / np.where(w2 > 0, w2, 1.0), 0.0, ways[rows, None])
        distance = np.hypot(x + u * until, y + v * until)
        deepest = max(deepest, float(np.max(contact - distance, initial=0.0)))
    return deepest


def _farthest_escape(scene: Scene, course: Course) -> float:
    """How far a ball sticks out of the wall, m, at the states; between them it is farther in."""
    states = course.states
    offsets = abs(states.positions - states.container_positions[:, None])
    if scene.shape == "circle":
        out = np.hypot(*np.moveaxis(offsets, -1, 0)) - (scene.container_radius - scene.radii)
    else:
        out = np.max(offsets - np.array(scene.size) / 2, axis=-1) + scene.radii
    return float(np.max(out, initial=0.0))
