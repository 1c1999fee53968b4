"""A trace's balls that slide along the wall: from when to when, and how hard they press."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.engine import replay
from snooker_cli.trace import SLIDE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.trace import Trace

    Floats = NDArray[np.float64]


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
    events, scene = trace.events, trace.start
    assert events is not None
    given = np.where(events.at_wall, events.impulse, 0.0)
    change = np.zeros(len(events) + 1)
    found = sorted(found, key=lambda each: each.first)
    velocities = replay(trace, events.time[[each.first for each in found]]).velocities
    for each, velocity in zip(found, velocities, strict=True):
        reach = scene.container_radius - scene.radii[each.ball]
        force = scene.masses[each.ball] * np.sum(velocity[each.ball] ** 2) / reach
        change[each.first + 1] += force
        if each.last < len(events):
            change[each.last + 1] -= force
            if events.j[each.last] == SLIDE:
                given[each.last] = 0.0  # it has been given all along
    force = np.cumsum(change)
    pressed = force[:-1] * np.diff(events.time, prepend=0.0)
    return np.append(0.0, np.cumsum(given + pressed)), force
