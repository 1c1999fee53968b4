"""Few balls: each keeps its earliest contact, found against all others in vector form.

The ideas, and where they come from:
- Each ball has its own clock and moves only in its own events (Lubachevsky, J. Comput. Phys. 94,
  255 (1991)); partners are projected in a prediction and never written back, so that a replay of
  the recorded events does the same arithmetic and gives the same bits.
- One entry a ball in the agenda, its earliest contact. It remembers how many events its partner
  had had: if the partner has had another since, the entry is stale, and is predicted again when
  it comes up and not before. The partner need not know: its own entry is its own earliest contact.
- A ball's contacts are searched only until it hits the wall: from there its path is another.
- What a scene lacks is ``None`` and is compiled away: a container that never moves, balls that are
  all alike, balls that slide along the wall.
"""

from __future__ import annotations

from snooker_cli.engine.clock import (
    CLOCK_DIGITS,
    COLLAPSE,
    COLLISIONS,
    FULL,
    NOTHING_LEFT,
    PATIENCE,
    STALL_LIMIT,
    TIME,
    WALL_TRAP,
)
from snooker_cli.engine.collision import add_up, contact_lasts, hit_pair, hit_wall, move, touched
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.kernel_state import (
    BOUNCES,
    CONTACT_LASTS,
    COUNT,
    EPOCH,
    FIRST,
    LAST,
    LOOK,
    LOOK_AGAIN,
    NEXT_TIME,
    NOBODY,
    NOW,
    PAIR_EVENTS,
    PAIR_TIME,
    PAIR_VIRIAL,
    PARTNER,
    PARTNER_COUNT,
    PREDICTIONS,
    SECOND,
    SLIDE,
    STALE,
    STALLED,
    WALL_EVENTS,
    WALL_IMPULSE,
    WALL_TIME,
    Floats,
    Integers,
    Recorded,
    Setup,
)
from snooker_cli.engine.prediction import (
    BLOCK,
    candidates,
    candidates_of_two,
    contact_distance,
    earliest,
    is_trapped,
    never_elastic,
    predict_return,
    predict_wall,
    predict_walls,
    without,
)
from snooker_cli.engine.sampling import Grid, sample_until
from snooker_cli.engine.sliding import (
    FLIES,
    SETTLES,
    SLIDES,
    earliest_on_arc,
    has_settled,
    leave_wall,
    only_straight,
    sample_sliding,
    slide_on,
    slide_time,
    who_slides,
)

# A number that times zero is zero.
LARGE = 1e100


@inlined
def search_time(wall_delay: float, number: int, container: Floats | None, setup: Setup) -> float:
    """How far ahead contacts with balls are searched for a ball that hits the wall after a delay.

    A free container is pushed by others' hits, so that the ball may reach it later. It is searched
    further by some times what each ball's hit could do, lest it be searched again after each push.
    """
    if container is None:
        return wall_delay
    pushes = min(4.0 * number * setup.mass / setup.container_mass, LARGE)
    return wall_delay * (1.0 + pushes)


@inlined
def note_contact(
    i: int,
    now: float,
    delay: float,
    whom: int,
    container: Floats | None,
    agenda: Floats,
    links: Integers,
) -> None:
    """Enter ball i's earliest contact with another; its time at the wall is there already."""
    pair_time = now + delay
    if container is None and whom < 0:
        pair_time = NEVER  # none before the wall
    agenda[PAIR_TIME, i] = pair_time
    agenda[NEXT_TIME, i] = min(pair_time, agenda[WALL_TIME, i])
    links[PARTNER, i] = whom
    if whom >= 0:
        links[PARTNER_COUNT, i] = links[COUNT, whom]


@inlined
def find_contact(
    i: int,
    now: float,
    wall_delay: float,
    balls: Floats,
    container: Floats | None,
    slides: Integers | None,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
    links: Integers,
) -> None:
    """Find ball i's earliest contact with another, unless it hits the wall before."""
    number = balls.shape[1]
    delay = search_time(wall_delay, number, container, setup)
    whom = LOOK_AGAIN
    last = links[LAST, i]
    for start in range(0, number, BLOCK):
        stop = min(start + BLOCK, number)
        mask = candidates(i, now, delay, balls, setup, radii, start, stop)
        if last >= 0 and links[LAST, last] == i:
            mask = without(mask, start, last)  # they parted in the last event of both
        if slides is not None:
            mask = only_straight(mask, start, stop, i, slides)
        delay, whom = earliest(mask, start, i, now, delay, whom, balls, setup, radii)
    horizon = delay
    if slides is not None:
        delay, whom = earliest_on_arc(i, now, delay, whom, balls, setup, radii, agenda, slides)
    note_contact(i, now, delay, whom, container, agenda, links)
    if slides is not None and whom == LOOK_AGAIN and delay < horizon:
        agenda[PAIR_TIME, i] = agenda[NEXT_TIME, i] = now + delay


@inlined
def find_contacts(
    i: int,
    j: int,
    now: float,
    wall_delay_i: float,
    wall_delay_j: float,
    balls: Floats,
    container: Floats | None,
    slides: Integers | None,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
    links: Integers,
) -> None:
    """``find_contact`` for two balls that have just collided."""
    if slides is not None:
        find_contact(i, now, wall_delay_i, balls, container, slides, setup, radii, agenda, links)
        find_contact(j, now, wall_delay_j, balls, container, slides, setup, radii, agenda, links)
        return
    number = balls.shape[1]
    delay_i = search_time(wall_delay_i, number, container, setup)
    delay_j = search_time(wall_delay_j, number, container, setup)
    whom_i = whom_j = LOOK_AGAIN
    for start in range(0, number, BLOCK):
        stop = min(start + BLOCK, number)
        mask_i, mask_j = candidates_of_two(
            i, j, now, delay_i, delay_j, balls, setup, radii, start, stop
        )
        mask_i, mask_j = without(mask_i, start, j), without(mask_j, start, i)  # they part
        delay_i, whom_i = earliest(mask_i, start, i, now, delay_i, whom_i, balls, setup, radii)
        delay_j, whom_j = earliest(mask_j, start, j, now, delay_j, whom_j, balls, setup, radii)
    note_contact(i, now, delay_i, whom_i, container, agenda, links)
    note_contact(j, now, delay_j, whom_j, container, agenda, links)


@inlined
def fly_on(
    i: int,
    now: float,
    balls: Floats,
    container: Floats | None,
    slides: Integers | None,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
) -> float:
    """Time until ball i, which has just hit another, will hit the wall, s; it slides no longer."""
    if slides is not None and slides[i] == SLIDES:
        slides[i] = FLIES
        return leave_wall(i, now, balls, agenda)
    return predict_wall(i, now, balls, container, setup, radii, agenda)


@inlined
def soonest(times: Floats) -> int:
    """The ball whose time is the earliest, of equal ones the first."""
    least, i = NEVER, 0
    for k in range(len(times)):
        if times[k] < least:
            least, i = times[k], k
    return i


@kernel
def prepare(
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
    links: Integers,
) -> None:
    """Fill the agenda at time zero: the wall, and to look for contacts first of all."""
    for i in range(balls.shape[1]):
        predict_wall(i, 0.0, balls, container, setup, radii, agenda)
        agenda[PAIR_TIME, i] = agenda[NEXT_TIME, i] = 0.0
        links[PARTNER, i] = LOOK


@kernel
def advance(
    balls: Floats,
    container: Floats | None,
    slides: Integers | None,
    setup: Setup,
    radii: Floats | None,
    masses: Floats | None,
    agenda: Floats,
    links: Integers,
    sums: Floats,
    counts: Integers,
    recorded: Recorded,
    grid: Grid,
    room: int,
) -> int:
    """Simulate at most ``room`` events; why it stopped. Ties go by time, ball, and wall first."""
    number = balls.shape[1]
    next_time, pair_time, wall_time = agenda[NEXT_TIME], agenda[PAIR_TIME], agenda[WALL_TIME]
    partner, partner_count, count = links[PARTNER], links[PARTNER_COUNT], links[COUNT]
    event_time, event_i, event_j = recorded.time, recorded.i, recorded.j
    event_impulse, step, used = recorded.impulse, grid.step, grid.used
    storing = len(event_time) > 0
    traps = setup.wall_restitution < 1.0 and never_elastic(setup)
    for filled in range(room):
        if counts[WALL_EVENTS] + counts[PAIR_EVENTS] >= setup.collision_limit:
            return COLLISIONS
        while True:
            i = soonest(next_time)
            now = next_time[i]
            at_wall = wall_time[i] <= pair_time[i]
            j = NOBODY if at_wall else partner[i]
            if now == NEVER or at_wall or (j >= 0 and partner_count[i] == count[j]):
                break
            if slides is not None and now > setup.time_limit:
                break
            delay = wall_time[i] - now
            find_contact(i, now, delay, balls, container, slides, setup, radii, agenda, links)
            counts[PREDICTIONS] += number
            counts[STALE] += 1
        if now == NEVER:
            return NOTHING_LEFT
        if now > setup.time_limit:
            return TIME
        if step[0] * used[0] - sums[EPOCH] < now:
            if slides is None:
                sample_until(now, grid, balls, container, setup, masses, sums, counts)
            else:
                sample_sliding(now, grid, balls, setup, masses, slides, sums, counts)
        digit = CLOCK_DIGITS * (sums[EPOCH] + now)
        stalls = now - sums[NOW] <= digit
        counts[STALLED] = counts[STALLED] + 1 if stalls else 0
        counts[FIRST], counts[SECOND] = i, j
        sums[NOW] = now
        if slides is not None:
            k = who_slides(i, j, now, balls, slides)
            if k != NOBODY:
                begins = slides[k] == SETTLES
                size = slide_on(k, now, balls, setup, radii, masses, slides)
                if begins:
                    count[k] += 1
                    links[LAST, k], links[BOUNCES, k] = NOBODY, 0
                    wall_time[k] = NEVER
                    find_contact(
                        k, now, NEVER, balls, container, slides, setup, radii, agenda, links
                    )
                    counts[PREDICTIONS] += number
                counts[WALL_EVENTS] += 1
                add_up(sums, WALL_IMPULSE, size)
                if storing:
                    event_time[filled], event_i[filled] = now, k
                    event_j[filled], event_impulse[filled] = SLIDE, size
                continue
        if setup.contact_path > 0.0 and (counts[WALL_EVENTS] + counts[PAIR_EVENTS]) % number == 0:
            sums[CONTACT_LASTS] = contact_lasts(balls, container, setup, None, sums)
        elastic = touched(i, now, balls, sums[EPOCH], sums[CONTACT_LASTS])
        move(i, now, balls)
        count[i] += 1
        trapped = False
        if at_wall:
            links[LAST, i] = NOBODY
            size = hit_wall(i, now, balls, container, setup, masses, elastic)
            if container is not None:
                predict_walls(now, balls, container, setup, radii, agenda)
            delay = predict_return(i, now, balls, container, agenda)
            find_contact(i, now, delay, balls, container, slides, setup, radii, agenda, links)
            counts[PREDICTIONS] += number
            counts[WALL_EVENTS] += 1
            add_up(sums, WALL_IMPULSE, size)
            links[BOUNCES, i] += 1
            if traps and (links[BOUNCES, i] > 1 or setup.wall_restitution == 0.0):
                patient = container is not None or links[BOUNCES, i] <= PATIENCE
                if slides is not None:
                    patient = True
                trapped = is_trapped(
                    i, now, balls, container, setup, radii, masses, next_time, patient, slides
                )
                if slides is not None and (trapped or has_settled(i, digit, balls, setup)):
                    trapped = False
                    slides[i] = SETTLES
                    wall_time[i] = next_time[i] = slide_time(i, balls, setup, masses)
                    pair_time[i] = NEVER
        else:
            elastic = elastic or touched(j, now, balls, sums[EPOCH], sums[CONTACT_LASTS])
            move(j, now, balls)
            count[j] += 1
            links[LAST, i], links[LAST, j] = j, i
            size = hit_pair(i, j, balls, setup, masses, None, elastic)
            delay = fly_on(i, now, balls, container, slides, setup, radii, agenda)
            other_delay = fly_on(j, now, balls, container, slides, setup, radii, agenda)
            find_contacts(
                i, j, now, delay, other_delay, balls, container, slides, setup, radii, agenda, links
            )
            counts[PREDICTIONS] += 2 * number
            counts[PAIR_EVENTS] += 1
            links[BOUNCES, i] = links[BOUNCES, j] = 0
            add_up(sums, PAIR_VIRIAL, size * contact_distance(setup, radii, i, j))
        if storing:
            event_time[filled] = now
            event_i[filled] = i if at_wall else min(i, j)
            event_j[filled] = NOBODY if at_wall else max(i, j)
            event_impulse[filled] = size
        if trapped or counts[STALLED] > STALL_LIMIT * number:
            if counts[WALL_EVENTS] + counts[PAIR_EVENTS] >= setup.collision_limit:
                return COLLISIONS
            return WALL_TRAP if trapped else COLLAPSE
    return FULL
