"""Few balls: each keeps its earliest contact, found against all others in vector form.

The ideas, and where they come from:
- Each ball has its own clock and moves only in its own events (Lubachevsky, J. Comput. Phys. 94,
  255 (1991)); partners are projected in a prediction and never written back, so that a replay of
  the recorded events does the same arithmetic and gives the same bits.
- One entry a ball in the agenda, its earliest contact. It remembers how many events its partner
  had had: if the partner has had another since, the entry is stale, and is predicted again when
  it comes up and not before.
- A prediction runs over all balls without a branch; the scan for the earliest contact branches,
  since a scan rarely improves.
- What a scene lacks is ``None`` and is compiled away: a container that never moves, equal radii,
  equal masses, events that are not recorded, a grid that is not sampled.
"""

from __future__ import annotations

from snooker_cli.engine.collide import hit_pair, hit_wall, move
from snooker_cli.engine.compiling import compiled
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.layout import (
    BOUNCES,
    COUNT,
    FIRST,
    LAST,
    NOBODY,
    NOW,
    OTHER_ROW,
    PAIR_EVENTS,
    PAIR_TIME,
    PAIR_VIRIAL,
    PARTNER,
    PARTNER_COUNT,
    PREDICTIONS,
    ROW,
    SECOND,
    STALLED,
    WALL_EVENTS,
    WALL_IMPULSE,
    WALL_TIME,
    Floats,
    Integers,
    Recorded,
    Setup,
)
from snooker_cli.engine.predict import (
    contact_distance,
    is_trapped,
    predict_return,
    predict_row,
    predict_row_and_walls,
    predict_two_rows,
    predict_wall,
)
from snooker_cli.engine.sampling import Grid, sample_until

# What ``advance`` answers.
FULL, COLLISIONS, TIME, NOTHING_LEFT, WALL_TRAP, COLLAPSE = range(6)

# After this many events for each ball in a row that do not move the clock, time has stopped. A rack
# of touching balls settles an impact in a few collisions a ball.
STALL_LIMIT = 64

# After this many bounces in a row a ball in a fixed container is trapped even if others have events
# before it has come to an end, so long as none can reach it: two balls may be trapped in step.
PATIENCE = 64

# An event this near to the one before, relative to the time, does not move the clock: a few units
# of its last digit. A ball that only rounding keeps off the wall moves it by one or two.
CLOCK_DIGITS = 4 * 2.0**-52


@compiled
def adopt_row(
    i: int,
    row: Floats,
    pair_time: Floats,
    partner: Integers,
    partner_count: Integers,
    count: Integers,
) -> None:
    """Make the row's earliest contact ball i's, and i the partner of all who meet it sooner.

    The arrays come one by one, not as rows of the agenda: so the loop runs a third faster.
    """
    earliest, whom = NEVER, NOBODY
    for k in range(len(row)):
        time = row[k]
        if time < pair_time[k]:
            pair_time[k] = time
            partner[k] = i
            partner_count[k] = count[i]
        if time < earliest:
            earliest, whom = time, k
    pair_time[i] = earliest
    partner[i] = whom
    partner_count[i] = count[whom] if whom >= 0 else 0


@compiled
def predict_again(
    i: int,
    now: float,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
    links: Integers,
) -> None:
    """Find ball i's earliest contact anew, only its partner having changed."""
    predict_row(i, now, balls, setup, radii, agenda[ROW])
    last = links[LAST, i]
    if last >= 0 and links[LAST, last] == i:
        agenda[ROW, last] = NEVER  # they parted in the last event of both
    earliest, whom = NEVER, NOBODY
    for k in range(agenda.shape[1]):
        if agenda[ROW, k] < earliest:
            earliest, whom = agenda[ROW, k], k
    agenda[PAIR_TIME, i] = earliest
    links[PARTNER, i] = whom
    links[PARTNER_COUNT, i] = links[COUNT, whom] if whom >= 0 else 0


@compiled
def prepare(
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
    links: Integers,
) -> None:
    """Fill the agenda at time zero."""
    for i in range(balls.shape[1]):
        predict_again(i, 0.0, balls, setup, radii, agenda, links)
        predict_wall(i, 0.0, balls, container, setup, radii, agenda)


@compiled
def advance(
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    radii: Floats | None,
    masses: Floats | None,
    agenda: Floats,
    links: Integers,
    sums: Floats,
    counts: Integers,
    recorded: Recorded | None,
    grid: Grid | None,
    room: int,
) -> int:
    """Simulate at most ``room`` events; why it stopped. Ties go by time, ball, and wall first."""
    number = balls.shape[1]
    pair_time, wall_time = agenda[PAIR_TIME], agenda[WALL_TIME]
    row, other_row = agenda[ROW], agenda[OTHER_ROW]
    partner, partner_count, count = links[PARTNER], links[PARTNER_COUNT], links[COUNT]
    for filled in range(room):
        if counts[WALL_EVENTS] + counts[PAIR_EVENTS] >= setup.collision_limit:
            return COLLISIONS
        while True:
            now, i = NEVER, 0
            for k in range(number):
                time = pair_time[k] if pair_time[k] < wall_time[k] else wall_time[k]
                if time < now:
                    now, i = time, k
            at_wall = wall_time[i] <= pair_time[i]
            j = NOBODY if at_wall else partner[i]
            if now == NEVER or at_wall or partner_count[i] == count[j]:
                break
            predict_again(i, now, balls, setup, radii, agenda, links)
            counts[PREDICTIONS] += number
        if now == NEVER:
            return NOTHING_LEFT
        if now > setup.time_limit:
            return TIME
        if grid is not None:
            sample_until(now, grid, balls, container, setup, masses, sums, counts)
        stalls = now - sums[NOW] <= CLOCK_DIGITS * now
        counts[STALLED] = counts[STALLED] + 1 if stalls else 0
        counts[FIRST], counts[SECOND] = i, j
        sums[NOW] = now
        move(i, now, balls)
        count[i] += 1
        trapped = False
        if at_wall:
            links[LAST, i] = NOBODY
            size = hit_wall(i, now, balls, container, setup, masses)
            if container is None:
                predict_row(i, now, balls, setup, radii, row)
            else:
                predict_row_and_walls(i, now, balls, container, setup, radii, row, wall_time)
            adopt_row(i, row, pair_time, partner, partner_count, count)
            predict_return(i, now, balls, container, agenda)
            counts[PREDICTIONS] += number
            counts[WALL_EVENTS] += 1
            sums[WALL_IMPULSE] += size
            links[BOUNCES, i] += 1
            if setup.wall_restitution < 1.0 and (
                links[BOUNCES, i] > 1 or setup.wall_restitution == 0.0
            ):
                patient = container is not None or links[BOUNCES, i] <= PATIENCE
                trapped = is_trapped(
                    i, now, balls, container, setup, radii, masses, agenda, patient
                )
        else:
            move(j, now, balls)
            count[j] += 1
            links[LAST, i], links[LAST, j] = j, i
            size = hit_pair(i, j, balls, setup, masses)
            predict_two_rows(i, j, now, balls, setup, radii, row, other_row)
            row[j] = NEVER  # they part
            other_row[i] = NEVER
            adopt_row(i, row, pair_time, partner, partner_count, count)
            adopt_row(j, other_row, pair_time, partner, partner_count, count)
            predict_wall(i, now, balls, container, setup, radii, agenda)
            predict_wall(j, now, balls, container, setup, radii, agenda)
            counts[PREDICTIONS] += 2 * number
            counts[PAIR_EVENTS] += 1
            links[BOUNCES, i] = links[BOUNCES, j] = 0
            sums[PAIR_VIRIAL] += size * contact_distance(setup, radii, i, j)
        if recorded is not None:
            recorded.time[filled] = now
            recorded.i[filled] = i if at_wall else min(i, j)
            recorded.j[filled] = NOBODY if at_wall else max(i, j)
            recorded.impulse[filled] = size
        if trapped or counts[STALLED] > STALL_LIMIT * number:
            if counts[WALL_EVENTS] + counts[PAIR_EVENTS] >= setup.collision_limit:
                return COLLISIONS
            return WALL_TRAP if trapped else COLLAPSE
    return FULL
