"""Clocks that stay as fine as they are at the start: time zero is moved along, epoch by epoch.

After so many events all clocks are set back by a shift, and the epoch, the time (s) at which they
count from zero, goes on by as much. What is stored of an event is its time, epoch and clock as one
rounded double, and what that rounding has left out: from both follows the clock, bit for bit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from snooker_cli.engine.kernel_state import Floats

if TYPE_CHECKING:
    from collections.abc import Iterator

    from snooker_cli.trace import Events


LEAST_EVENTS = 16384
"""Events of an epoch at least, so that it costs nothing to begin one."""

EVENTS_A_BALL = 64
"""Events a ball of an epoch: some hundred times a ball's mean free time."""


def length(number: int) -> int:
    """Events of an epoch of so many balls."""
    return max(LEAST_EVENTS, EVENTS_A_BALL * number)


def following(epoch: float, now: float) -> tuple[float, float]:
    """The epoch that begins when clocks are at ``now`` (s), and by how much they are set back.

    By no more than ``now``, so that no time that is to come is negative.
    """
    new = epoch + now
    while new - epoch > now:
        new = math.nextafter(new, 0.0)
    return new, new - epoch


def times(epoch: float, clocks: Floats) -> tuple[Floats, Floats | None]:
    """Times (s) of events whose clocks are given, and what rounding has left out of them.

    The latter is exact, by Sterbenz' lemma: time less epoch is zero, or within a factor of two of
    the clock. It is ``None``, for nothing, in the first epoch and of no events.
    """
    if epoch == 0.0 or not len(clocks):
        return clocks, None
    rounded = epoch + clocks
    return rounded, clocks - (rounded - epoch)


class Part(NamedTuple):
    """The events of an epoch.

    events : which they are
    clocks : (*n*,) ``numpy.float64``, s, what clocks showed
    following : s, the epoch after them, this one if they do not fill it
    shift : s, by how much clocks are set back after them
    """

    events: slice
    clocks: Floats
    following: float
    shift: float


def parts(events: Events, number: int) -> Iterator[Part]:
    """All events of so many balls, by epoch; at least one part."""
    size, epoch = length(number), 0.0
    for start in range(0, max(len(events), 1), size):
        part = slice(start, min(start + size, len(events)))
        clocks = np.ascontiguousarray(events.time[part])
        if epoch > 0.0:
            clocks = clocks - epoch
            if events.residual is not None:
                clocks = clocks + events.residual[part]
        new, shift = epoch, 0.0
        if len(clocks) == size:
            new, shift = following(epoch, float(clocks[-1]))
        yield Part(part, clocks, new, shift)
        epoch = new


# Why a kernel stopped, and when a clock that does not move means that time has come to an end.

# What ``advance`` answers. The last two are for whoever calls it: make cells larger, or put them
# round the container's new place, and go on.
(
    FULL,
    COLLISIONS,
    TIME,
    NOTHING_LEFT,
    WALL_TRAP,
    COLLAPSE,
    CELL_FULL,
    OUT_OF_MARGIN,
) = range(8)

# After this many events for each ball in a row that do not move the clock, time has stopped. A rack
# of touching balls settles an impact in a few collisions a ball.
STALL_LIMIT = 64

# After this many bounces in a row a ball in a fixed container is trapped even if others have events
# before it has come to an end, so long as none can reach it: two balls may be trapped in step.
PATIENCE = 64

# An event this near to the one before, relative to the time, does not move the clock: a few units
# of its last digit. A ball that only rounding keeps off the wall moves it by one or two.
CLOCK_DIGITS = 4 * 2.0**-52
