"""Clocks that keep their precision in long repeats, and the reasons why a kernel stops.

After a number of events all clocks are set back by a shift. The epoch, the time (s) at which they
show zero, moves on by as much. The stored time of an event is epoch and clock as one rounded
double; the stored residual is what that rounding has cut off. Both give the clock to the last bit.
"""

import math

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.jit import inlined
from snooker_cli.engine.kernel_state import Floats, Integers
from snooker_cli.trace import Events

# Epochs

LEAST_EVENTS, EVENTS_PER_BALL = 16384, 64
"""Events of an epoch, at least and per ball: to begin an epoch then costs nothing."""


def length(number: int) -> int:
    """Events of an epoch with this many balls."""
    return max(LEAST_EVENTS, EVENTS_PER_BALL * number)


def following(epoch: float, now: float) -> tuple[float, float]:
    """The epoch that begins when clocks show ``now`` (s), and the shift that sets them back.

    The shift is at most ``now``, so that no later event has a negative clock.
    """
    new = epoch + now
    while new - epoch > now:
        new = math.nextafter(new, 0.0)
    return new, new - epoch


def times(epoch: float, clocks: Floats) -> tuple[Floats, Floats | None]:
    """Times (s) of events whose clocks are given, and exactly what rounding has cut off from them.

    The latter is ``None`` in the first epoch, and if there are no events.
    """
    if epoch == 0.0 or not len(clocks):
        return clocks, None
    rounded = epoch + clocks
    return rounded, clocks - (rounded - epoch)


def clocks(epoch: float, events: Events) -> Floats:
    """What clocks showed at events of an epoch, s: the reverse of ``times``."""
    if epoch == 0.0:
        return np.ascontiguousarray(events.time)
    return events.time - epoch + (0.0 if events.residual is None else events.residual)


# Endings

# Answers of ``advance``; TIME to IDLE have the places that they have in ``StopReason``. After
# FULL the repeat continues with the next chunk. The last two are for ``InCells``: make cells
# larger, or put them round the container's new place.
FULL, TIME, NOTHING_LEFT, WALL_TRAP, COLLAPSE, IDLE, CELL_FULL, OUT_OF_MARGIN = range(8)

STALL_LIMIT = 64
"""Events per ball in a row, without the clock moving, after which a repeat has collapsed.

A rack of touching balls settles an impact in a few collisions per ball.
"""

CLOCK_DIGITS = 4 * 2.0**-52
"""An event that is later by less than this part of the time does not move the clock."""


@inlined
def begin_event(i: int, j: int, now: float, sums: Floats, counts: Integers) -> None:
    """Move the repeat's clock to the event of balls i and j."""
    stalls = now - sums[ks.NOW] <= CLOCK_DIGITS * (sums[ks.EPOCH] + now)
    counts[ks.STALLED] = counts[ks.STALLED] + 1 if stalls else 0
    counts[ks.FIRST], counts[ks.SECOND] = i, j
    sums[ks.NOW] = now
