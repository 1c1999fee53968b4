"""Why a kernel stopped, and when a clock that does not move means that time has come to an end."""

from __future__ import annotations

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
