"""Clocks that keep their precision in long repeats, and the reasons why a kernel stops.

After a number of events all clocks are set back by a shift. The epoch, the time (s) at which they
show zero, moves on by as much. The stored time of an event is epoch and clock as one rounded
double; the stored residual is what that rounding has cut off. Both give the clock to the last bit.
"""

import math

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import next_below
from snooker_cli.engine.jit import inlined
from snooker_cli.engine.kernel_state import Floats, State
from snooker_cli.trace import Events

# Epochs

LEAST_EVENTS, EVENTS_PER_BALL = 16384, 64
"""Events of an epoch, at least and per ball: to begin an epoch then costs nothing."""


@inlined
def length(number: int) -> int:
    """Events of an epoch with this many balls."""
    return max(LEAST_EVENTS, EVENTS_PER_BALL * number)


@inlined
def following(epoch: float, now: float) -> tuple[float, float]:
    """The epoch that begins when clocks show ``now`` (s), and the shift that sets them back.

    The shift is at most ``now``, so that no later event has a negative clock.
    """
    new = epoch + now
    while new - epoch > now:
        new = next_below(new)
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

# Answers of ``advance``; TIME to FAR have the places that they have in ``StopReason``. After
# FULL the repeat continues with the next chunk. The last two are for ``AmongNeighbours``: make
# cells larger, or put them round the container's new place.
FULL, TIME, NOTHING_LEFT, WALL_TRAP, COLLAPSE, IDLE, REST, FAR = range(8)
CELL_FULL, OUT_OF_MARGIN, NEW_FRAME = 8, 9, 10

SLOWEST = 2e-154
"""Speed of the fastest ball, m/s, below which squares of speeds are no doubles."""

CLOCK_DIGITS = 4 * 2.0**-52
"""An event that is later by less than this part of the time does not move the clock."""

STALL_LIMIT = 64
"""Events of one ball in a row, without the clock moving, after which it has collapsed."""


@inlined
def begin_event(i: int, j: int, now: float, state: State) -> None:
    """Move the repeat's clock to the event of balls i and j, and note how long it stands still."""
    clocks, sums, counts = state.balls[ks.CLOCK], state.sums, state.counts
    if now - sums[ks.NOW] > CLOCK_DIGITS * (sums[ks.EPOCH] + now):
        sums[ks.STILL_SINCE] = now
        counts[ks.STALLED], counts[ks.INVOLVED] = 0, 1 + (j >= 0)
    else:
        since = sums[ks.STILL_SINCE]
        counts[ks.STALLED] += 1
        counts[ks.INVOLVED] += is_before(clocks[i], since)
        counts[ks.INVOLVED] += j >= 0 and is_before(clocks[j], since)
    counts[ks.FIRST], counts[ks.SECOND] = i, j
    sums[ks.NOW] = now


@inlined
def is_before(clock: float, since: float) -> bool:
    """Whether a ball's own clock is earlier: it has not collided since then.

    Clocks start at minus zero, so that balls that collide at time zero count too.
    """
    return bool(clock < since or math.copysign(1.0, clock) < 0.0)


# A few balls that collapse keep the clock still, however many others there are. So the limit is for
# the n balls that collide in this instant. Finite racks must stay below it:
#
# - A row of n equal elastic balls settles in up to n (n - 1)/2 collisions, each pair once.
# - A light ball between two heavy ones, or between one and the wall, takes up to pi/theta, with
#   sin(theta) near sqrt(2 m/M) (Galperin, Regul. Chaotic Dyn. 8, 375 (2003)). So ``settling`` is
#   sqrt(M/m), of the heaviest and the lightest body.
# - With a CoR e the collisions are endless if sin(theta) < (1 - e)/(1 + e). So finite ones are of
#   the order of 1/(1 - e) at most, and ``settling`` is at most 2/(1 - e).
#
# Near the border of the last, finite numbers grow without a bound. But the limit is 20 to 60 times
# the numbers above, and by then a loss has reduced the relative speeds to far less than rounding.
@inlined
def most_stalled(involved: int, settling: float) -> float:
    """Events of so many balls in a row that may leave the clock unmoved, without a collapse."""
    return STALL_LIMIT + settling * ((involved - 1) * (involved + STALL_LIMIT))


@inlined
def has_collapsed(state: State) -> bool:
    """Whether more events have not moved the clock than a finite rack of these balls needs."""
    stalled = state.counts[ks.STALLED]
    if stalled <= STALL_LIMIT:
        return False
    return bool(stalled > most_stalled(state.counts[ks.INVOLVED], state.setup.settling))


@inlined
def is_at_rest(i: int, impulse: float, state: State) -> bool:
    """Whether all balls are slower than ``SLOWEST`` after an event of ball i, kg m/s.

    Few impulses are small enough to look at the others.
    """
    if impulse > 2.0 * SLOWEST * state.sizes.mass_of(i):
        return False
    balls = state.balls
    for k in range(balls.shape[1]):
        if max(abs(balls[ks.U, k]), abs(balls[ks.V, k])) > SLOWEST:
            return False
    return True


def still_events(events: Events) -> Events:
    """The last of a repeat's events: the one that moved the clock last, and those after it."""
    gaps = np.diff(events.time, prepend=-1.0)
    if events.residual is not None:
        gaps += np.diff(events.residual, prepend=0.0)
    moving = np.flatnonzero(gaps > CLOCK_DIGITS * events.time)
    return events[slice(moving[-1] if len(moving) else 0, None)]


def settling(heaviest: float, lightest: float, cor: float) -> float:
    """``Setup.settling`` for masses (kg) and the CoR of slow balls: 1 if they are equal."""
    endless = math.inf if cor >= 1.0 else 2.0 / (1.0 - cor)
    return min(math.sqrt(heaviest) / math.sqrt(lightest), endless)
