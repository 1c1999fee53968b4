"""A trace -> what a film of it shows in a span of time: balls, collisions, energy, pressure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.analysis.observables import integrals, series
from snooker_cli.containers import Circle
from snooker_cli.engine import replay
from snooker_cli.errors import FigureError
from snooker_cli.trace import CONTAINER, SLIDE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.engine import States
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

    Floats = NDArray[np.float64]
    Integers = NDArray[np.int32]


# Where two that collide touch each other.


def contact_points(
    scene: Scene, states: States, i: NDArray[np.int32], j: NDArray[np.int32]
) -> NDArray[np.float64]:
    """(*n*, 2) m: where ball i touches ball j, or the wall for j = -1, in each of (*n*) states."""
    row = np.arange(len(states.time))
    place = states.positions[row, i]
    outwards = scene.container.wall_directions(place - states.container_positions)
    pairs = j > CONTAINER
    between = scene.container.nearest_image(states.positions[row, j] - place)
    outwards[pairs] = between[pairs]
    lengths = np.hypot(*outwards.T)[:, None]
    unit = np.divide(outwards, lengths, out=np.zeros_like(outwards), where=lengths > 0)
    return np.asarray(place + scene.radii[i][:, None] * unit)


# A trace's balls that slide along the wall: from when to when, and how hard they press.


@dataclass(frozen=True)
class Slide:
    """A ball's way along the wall.

    first : the event with which it begins
    last : the one with which it ends; as many as there are events if none does
    """

    ball: int
    first: int
    last: int


def slides(trace: Trace) -> list[Slide]:
    """All ways along the wall, ball by ball."""
    events, found = trace.events, []
    assert events is not None
    for ball in np.unique(events.i[events.j == SLIDE]).tolist():
        own = np.flatnonzero((events.i == ball) | (events.j == ball))
        sliding = events.j[own] == SLIDE
        # The second of two such rows notes what it has pressed until it is hit.
        begins = np.flatnonzero(sliding & ~np.append(False, sliding[:-1]))
        ends = np.append(own, len(events))[begins + 1]
        found += [
            Slide(ball, first, last)
            for first, last in zip(own[begins].tolist(), ends.tolist(), strict=True)
        ]
    return found


def wall_impulse(trace: Trace, found: list[Slide]) -> tuple[Floats, Floats]:
    """(*n* + 1,) impulse on the wall at the start and after each of n events, kg m/s, and what it
    gains from there on in a second.

    A ball of mass m that slides with speed v on a circle of radius a presses with m v²/a.
    """
    events, scene, container = trace.events, trace.start, trace.start.container
    assert events is not None
    given = np.where(events.at_wall, events.impulse, 0.0)
    change = np.zeros(len(events) + 1)
    found = sorted(found, key=lambda each: each.first)
    velocities = replay(trace, events.time[[each.first for each in found]]).velocities
    for each, velocity in zip(found, velocities, strict=True):
        assert isinstance(container, Circle)  # no ball slides elsewhere
        reach = container.radius - scene.radii[each.ball]
        force = scene.masses[each.ball] * np.sum(velocity[each.ball] ** 2) / reach
        change[each.first + 1] += force
        if each.last < len(events):
            change[each.last + 1] -= force
            if events.j[each.last] == SLIDE:
                given[each.last] = 0.0  # it has been given all along
    force = np.cumsum(change)
    pressed = force[:-1] * np.diff(events.time, prepend=0.0)
    return np.append(0.0, np.cumsum(given + pressed)), force


MOST_COLLISIONS = 10_000
"""Of a film: a page has 83 bytes of each, and steps through them one by one."""

MOST_BALLS = 10_000
"""Of a film: a browser still draws so many several times a second."""

AT_ONCE = 2_000_000
"""Balls times collisions whose states are kept at a time; 64 MB."""

FASTER = 0.02
"""Share of the balls' speeds that are above the scale of colours: a gas has a few fast ones."""


@dataclass(frozen=True)
class Film:
    """What is shown of a repeat, from a time to another; SI units with k_B = 1.

    trace : the repeat up to the last collision that is shown, and where balls slide the next one
    title, subtitle : what stands above it
    ending : what stands below its last instant; empty if nothing is to be said
    start, end : s
    before : collisions of the repeat before the first that is shown
    left_out : collisions of the span that is asked for, after the last that is shown
    opening : the state at ``start``
    time : (*n*,) ``numpy.float64``, s, of the collisions
    i, j : (*n*,) ``numpy.int32``, who collides; j = -1 for the container, -2 as in ``Events``
    sliding : the balls that slide along the wall at the start
    settling : the ball, if any, that bounces after the last of the collisions until it slides
    after : (*n*, 4) velocities of i (u, v) and of j or the container after it, m/s
    contacts : (*n*, 2) where they touch, m
    kinetic_energy : (*n* + 1,) of the balls at the start and after each collision, J
    pressure_sum : (*n* + 1,) what has been gathered for the pressure, see ``pressure``, Pa m s
    pressure_gain : (*n* + 1,) what it gains in a second from there on, Pa m
    top_speed : m/s, of the brightest colour; few balls are faster
    """

    trace: Trace
    title: str
    subtitle: str
    ending: str
    start: float
    end: float
    before: int
    left_out: int
    opening: States
    time: Floats
    i: Integers
    j: Integers
    sliding: tuple[int, ...]
    settling: int | None
    after: Floats
    contacts: Floats
    kinetic_energy: Floats
    pressure_sum: Floats
    pressure_gain: Floats
    top_speed: float

    def __len__(self) -> int:
        return len(self.time)

    @property
    def rows(self) -> Floats:
        """(*n* + 1,) the times of the start and of the collisions, s."""
        return np.concatenate([[self.start], self.time])

    def pressure(self, times: Floats) -> Floats:
        """Mean pressure from the repeat's start to times within the film, Pa m.

        The wall's impulse over its length and the time; in a periodic box what the virial gives,
        as ``observables.cumulative_pressure`` does. At time zero it is what it begins with.
        """
        row = np.searchsorted(self.time, times, side="right")
        gathered = self.pressure_sum[row] + self.pressure_gain[row] * (times - self.rows[row])
        return np.divide(gathered, times, out=self.pressure_gain[row], where=times > 0)


def film(
    trace: Trace,
    title: str,
    subtitle: str = "",
    *,
    since: float = 0.0,
    until: float | None = None,
    most: int | None = None,
) -> Film:
    """The film of a repeat from a time to another (s), of at most so many collisions.

    It ends with the last of them if there are more; without ``most``, ``MOST_COLLISIONS``.
    Raises ``FigureError`` for a repeat without events, a span outside it, and too many balls.
    """
    events, scene = trace.events, trace.start
    if events is None:
        raise FigureError(
            "was recorded as a summary, which has no collisions to show; run it with "
            "`record: events`"
        )
    if scene.number > MOST_BALLS:
        raise FigureError(f"has {scene.number:,} balls; a film shows at most {MOST_BALLS:,}")
    end = trace.stop.time if until is None else until
    if not 0 <= since < end <= trace.stop.time:
        raise FigureError(
            f"cannot be shown from {since!r} s to {end!r} s: give a span within 0 and "
            f"{trace.stop.time!r} s"
        )
    first = int(np.searchsorted(events.time, since, side="right"))
    last = int(np.searchsorted(events.time, end, side="right"))
    limit = MOST_COLLISIONS if most is None else most
    left_out = max(0, last - first - limit)
    if left_out:
        last = first + limit
        end = float(events.time[last - 1])
    shown = slice(first, last)
    time, i, j = events.time[shown], events.i[shown], events.j[shown]
    # What comes after need not be replayed, but that a ball begins to slide says how it bounces.
    kept = last + 1 if scene.slides else last
    trace = replace(trace, events=events[:kept])
    opening = replay(trace, [since])
    after, contacts, energy = _at_collisions(trace, time, i, j)
    energy = np.append(_energy(trace, opening), energy)
    ways = slides(trace)
    gathered, gain = _pressure(trace, ways, first, since, time, energy)
    speeds = np.hypot(*np.vstack([opening.velocities[0], after[:, :2]]).T)
    return Film(
        trace=trace,
        title=title,
        subtitle=subtitle,
        ending="" if end < trace.stop.time or trace.stop.reason.complete else trace.stop.message,
        start=float(since),
        end=float(end),
        before=first,
        left_out=left_out,
        opening=opening,
        time=time,
        i=i,
        j=j,
        sliding=tuple(each.ball for each in ways if each.first < first <= each.last),
        settling=next((each.ball for each in ways if each.first == last), None),
        after=after,
        contacts=contacts,
        kinetic_energy=energy,
        pressure_sum=gathered,
        pressure_gain=gain,
        top_speed=float(np.quantile(speeds, 1 - FASTER)) or 1.0,
    )


def _at_collisions(
    trace: Trace, time: Floats, i: Integers, j: Integers
) -> tuple[Floats, Floats, Floats]:
    """Velocities of the two after each collision, contact points, and the balls' energy (J).

    Of collisions at the same instant each has what is after all of them.
    """
    step = max(1, AT_ONCE // trace.start.number)
    parts = []
    for first in range(0, len(time), step):
        chunk = slice(first, first + step)
        states = replay(trace, time[chunk])
        row, ball, other = np.arange(len(states.time)), i[chunk], j[chunk]
        at_wall = (other <= CONTAINER)[:, None]
        partner = np.where(at_wall, states.container_velocities, states.velocities[row, other])
        parts.append(
            (
                np.hstack([states.velocities[row, ball], partner]),
                contact_points(trace.start, states, ball, other),
                _energy(trace, states),
            )
        )
    if not parts:
        return np.empty((0, 4)), np.empty((0, 2)), np.empty(0)
    after, contacts, energy = (np.concatenate(part) for part in zip(*parts, strict=True))
    return after, contacts, energy


def _energy(trace: Trace, states: States) -> Floats:
    """Kinetic energy of the balls, J."""
    return np.asarray(0.5 * np.sum(states.velocities**2, axis=2) @ trace.start.masses)


def _pressure(
    trace: Trace, ways: list[Slide], first: int, since: float, time: Floats, energy: Floats
) -> tuple[Floats, Floats]:
    """``pressure_sum`` and ``pressure_gain`` of a film from event ``first`` on."""
    scene, events = trace.start, trace.events
    assert events is not None
    rows = slice(first, first + len(time) + 1)
    if scene.container.has_wall:
        given, force = (
            column[rows] / scene.container.wall_length for column in wall_impulse(trace, ways)
        )
        begun = float(events.time[first - 1]) if first else 0.0
        given[0] += force[0] * (since - begun)
        return given, force
    reach = scene.radii[events.i] + scene.radii[events.j]
    virial = np.cumsum(np.append(0.0, events.impulse * reach))[rows]
    begun = float(integrals(trace, series(trace).kinetic_energy, np.array([since]))[0])
    steps = np.diff(time, prepend=since)
    moving = begun + np.cumsum(np.append(0.0, energy[:-1] * steps))
    return (moving + virial / 2) / scene.container.area, energy / scene.container.area
