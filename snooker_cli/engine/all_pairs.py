"""Few balls: each keeps its earliest contact, found against all others in vector form.

The ideas and their sources are in docs/how-it-works.md and docs/engine.md.
"""

from typing import NamedTuple

import numpy as np

from snooker_cli.engine import clock, prediction, sliding
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.collision import collide, count, record
from snooker_cli.engine.contact import NEVER, chord_delay, wall_delay
from snooker_cli.engine.jit import inlined, kernel, lowest_bit
from snooker_cli.engine.kernel_state import Floats, Integers, Recorded, Setup, State, U, V, X, Y
from snooker_cli.engine.sampling import Grid, grid_of, next_sample, sample_until
from snooker_cli.trace import SLIDE

# Rows of ``Agenda.times``, s: a ball's earliest contact with another, that with the wall, and the
# earlier of the two.
PAIR_TIME, WALL_TIME, NEXT_TIME, TIME_ROWS = range(4)

# Rows of ``Agenda.links``: the partner of the earliest contact, its number of events when the
# contact was predicted, the ball's own number of events, the ball it last collided with, and its
# hits of the wall since then. With SEARCH_AGAIN there is no partner before PAIR_TIME.
PARTNER, PARTNER_EVENTS, EVENTS, LAST, BOUNCES, LINK_ROWS = range(6)

LARGE = 1e100  # large but finite, so that times zero it is zero
LANES = 8  # rows of the agenda have a multiple of this length, so that vectors are full


class Agenda(NamedTuple):
    """The next contacts of each ball.

    times : (TIME_ROWS, *N* or up to LANES - 1 more, which never come), nonnegative
    links : (LINK_ROWS, *N*)
    """

    times: Floats
    links: Integers


def new_agendas(repeats: int, number: int) -> Agenda:
    """The stacked agendas of repeats at time zero, without the times at the wall."""
    times = np.full((repeats, TIME_ROWS, -(-number // LANES) * LANES), NEVER)
    times[:, :, :number] = 0.0
    links = np.full((repeats, LINK_ROWS, number), ks.NO_PARTNER, dtype=np.int64)
    links[:, [EVENTS, BOUNCES]] = 0
    links[:, PARTNER] = ks.NOT_SEARCHED
    return Agenda(times, links)


@inlined
def search_time(wall_delay: float, number: int, setup: Setup, container: Floats | None) -> float:
    """How far ahead to search contacts of a ball that hits the wall after a delay, s.

    It is further if the container is free: others may push it away.
    """
    if container is None:
        return wall_delay
    pushes = min(4.0 * number * setup.mass / setup.container_mass, LARGE)
    return wall_delay * (1.0 + pushes)


@inlined
def enter_contact(
    i: int, time: float, partner: int, agenda: Agenda, container: Floats | None
) -> None:
    """Enter ball i's earliest contact with another; its time at the wall is there already."""
    times, links = agenda.times, agenda.links
    if container is None and partner < 0:
        time = NEVER  # none before the wall
    times[PAIR_TIME, i] = time
    times[NEXT_TIME, i] = min(time, times[WALL_TIME, i])
    links[PARTNER, i] = partner
    if partner >= 0:
        links[PARTNER_EVENTS, i] = links[EVENTS, partner]


@inlined
def find_contact(
    i: int,
    now: float,
    wall_delay: float,
    state: State,
    slides: Integers | None,
    agenda: Agenda,
) -> None:
    """Find ball i's earliest contact with another, unless it hits the wall before."""
    times, links, number = agenda.times, agenda.links, state.balls.shape[1]
    delay = search_time(wall_delay, number, state.setup, state.container)
    partner = ks.SEARCH_AGAIN
    last = links[LAST, i]
    for start in range(0, number, prediction.BLOCK):
        stop = min(start + prediction.BLOCK, number)
        mask = prediction.candidates(i, now, delay, state, start, stop)
        if last >= 0 and links[LAST, last] == i:
            mask = prediction.without(mask, start, last)  # they parted in the last event of both
        if slides is not None:  # not those on curved ways
            for k in range(start, stop):
                if slides[i] != sliding.FLIES or slides[k] != sliding.FLIES:
                    mask = prediction.without(mask, start, k)
        delay, partner = prediction.earliest(mask, start, i, now, delay, partner, state)
    horizon = delay
    if slides is not None:
        delay, partner = sliding.earliest_on_arc(
            i, now, delay, partner, state, times[WALL_TIME], slides
        )
    enter_contact(i, now + delay, partner, agenda, state.container)
    if slides is not None and partner == ks.SEARCH_AGAIN and delay < horizon:
        times[PAIR_TIME, i] = times[NEXT_TIME, i] = now + delay


@inlined
def find_contacts(
    i: int,
    j: int,
    now: float,
    wall_delay_i: float,
    wall_delay_j: float,
    state: State,
    slides: Integers | None,
    agenda: Agenda,
) -> None:
    """``find_contact`` for two balls that have just collided."""
    if slides is not None:
        find_contact(i, now, wall_delay_i, state, slides, agenda)
        find_contact(j, now, wall_delay_j, state, slides, agenda)
        return
    number = state.balls.shape[1]
    delay_i = search_time(wall_delay_i, number, state.setup, state.container)
    delay_j = search_time(wall_delay_j, number, state.setup, state.container)
    partner_i = partner_j = ks.SEARCH_AGAIN
    for start in range(0, number, prediction.BLOCK):
        stop = min(start + prediction.BLOCK, number)
        mask_i, mask_j = prediction.candidates_of_two(
            i, j, now, delay_i, delay_j, state, start, stop
        )
        mask_i = prediction.without(mask_i, start, j)  # they part
        mask_j = prediction.without(mask_j, start, i)
        delay_i, partner_i = prediction.earliest(mask_i, start, i, now, delay_i, partner_i, state)
        delay_j, partner_j = prediction.earliest(mask_j, start, j, now, delay_j, partner_j, state)
    enter_contact(i, now + delay_i, partner_i, agenda, state.container)
    enter_contact(j, now + delay_j, partner_j, agenda, state.container)


@inlined
def predict_wall_after_pair(
    i: int, now: float, state: State, slides: Integers | None, agenda: Agenda
) -> float:
    """Time until ball i, which has just hit another, will hit the wall, s; it slides no longer."""
    if slides is not None and slides[i] == sliding.SLIDES:
        slides[i] = sliding.FLIES
        balls = state.balls
        delay = chord_delay(balls[X, i], balls[Y, i], balls[U, i], balls[V, i])
    else:
        delay = prediction.time_to_wall(i, now, state, state.container)
    agenda.times[WALL_TIME, i] = now + delay
    return delay


@inlined
def predict_walls(now: float, state: State, agenda: Agenda, container: Floats | None) -> None:
    """Enter when each ball hits the wall, if that moves: it has just been given a new velocity."""
    if container is None:
        return
    balls, times = state.balls, agenda.times
    xc, yc, uc, vc = container[X], container[Y], container[U], container[V]
    for k in range(balls.shape[1]):
        x, y = ks.position(k, now, balls)
        reach = ks.wall_reach(k, state.setup, state.radii)
        delay = wall_delay(x - xc, y - yc, balls[U, k] - uc, balls[V, k] - vc, reach * reach)
        time = now + delay
        times[WALL_TIME, k] = time
        times[NEXT_TIME, k] = min(time, times[PAIR_TIME, k])


@inlined
def soonest(times: Floats) -> int:
    """The ball whose time is earliest, of equal ones the first: a minimum of integers is fast."""
    bits = times.view(np.int64)
    least = bits[0]
    for k in range(len(bits)):
        least = min(least, bits[k])
    for start in range(0, len(bits), LANES):
        mask = 0
        for k in range(LANES):
            mask |= 1 << k if bits[start + k] == least else 0
        if mask != 0:
            return int(start + lowest_bit(mask))
    return 0


@kernel
def advance(
    states: State,
    all_slides: Integers | None,
    agendas: Agenda,
    records: Recorded,
    grids: Grid | None,
    active: Integers,
    answers: Integers,
    limit: int,
) -> None:
    """Simulate at most ``limit`` events of each active repeat, and answer why each stopped.

    Ties go by time, ball, and wall first.

    states, all_slides, agendas, grids : stacked, of all repeats; without grids events are recorded
    active : (*a*,), the repeats to simulate
    records, answers : a row for each of these
    """
    for row in range(len(active)):
        repeat = active[row]
        state, slides = ks.state_of(states, repeat), ks.part_of(all_slides, repeat)
        balls, setup, counts, sums = state.balls, state.setup, state.counts, state.sums
        agenda = Agenda(agendas.times[repeat], agendas.links[repeat])
        links = agenda.links
        next_time, pair_time = agenda.times[NEXT_TIME], agenda.times[PAIR_TIME]
        wall_time = agenda.times[WALL_TIME]
        sample_time = NEVER
        if grids is not None:
            sample_time = next_sample(grid_of(grids, repeat), sums)
        recorded = Recorded(records.time[row], records.i[row], records.j[row], records.impulse[row])
        if counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS] == 0:
            for k in range(balls.shape[1]):
                # The sum makes a negative zero positive: soonest compares bits.
                wall_time[k] = 0.0 + prediction.time_to_wall(k, 0.0, state, state.container)
        answers[row] = clock.FULL
        for filled in range(limit):
            while True:
                i = soonest(next_time)
                now = next_time[i]
                at_wall = wall_time[i] <= pair_time[i]
                j = ks.NO_PARTNER if at_wall else links[PARTNER, i]
                valid = j >= 0 and links[PARTNER_EVENTS, i] == links[EVENTS, j]
                if now == NEVER or at_wall or valid:
                    break
                if all_slides is not None and now > sums[ks.TIME_LIMIT]:
                    break
                find_contact(i, now, wall_time[i] - now, state, slides, agenda)
            if now == NEVER:
                answers[row] = clock.NOTHING_LEFT
                break
            if now > sums[ks.TIME_LIMIT]:
                answers[row] = clock.TIME
                break
            if grids is not None and now > sample_time:
                sample_time = sample_until(now, grid_of(grids, repeat), state, slides)
            clock.begin_event(i, j, now, sums, counts)
            if all_slides is not None:
                k = sliding.sliding_ball(i, j, now, balls, slides)
                if k != ks.NO_PARTNER:
                    begins = slides[k] == sliding.SETTLES
                    size = sliding.slide_on(k, now, state, slides)
                    if begins:
                        links[EVENTS, k] += 1
                        links[LAST, k], links[BOUNCES, k] = ks.NO_PARTNER, 0
                        wall_time[k] = NEVER
                        find_contact(k, now, NEVER, state, slides, agenda)
                    count(k, SLIDE, size, state)
                    if grids is None:
                        record(recorded, filled, k, SLIDE, now, size, state.labels)
                    continue
            size = collide(i, j, now, state)
            count(i, j, size, state)
            if grids is None:
                record(recorded, filled, i, j, now, size, state.labels)
            links[EVENTS, i] += 1
            trapped = False
            if at_wall:
                links[LAST, i] = ks.NO_PARTNER
                links[BOUNCES, i] += 1
                predict_walls(now, state, agenda, state.container)
                x, y, u, v = ks.seen_from_container(
                    balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now, state.container
                )
                delay = chord_delay(x, y, u, v)
                wall_time[i] = now + delay
                find_contact(i, now, delay, state, slides, agenda)
                if setup.traps and (links[BOUNCES, i] > 1 or setup.wall_law.cor == 0.0):
                    patient = links[BOUNCES, i] <= setup.patience
                    trapped = prediction.is_trapped(
                        i, now, state, state.container, slides, next_time, patient
                    )
                    if all_slides is not None and (trapped or sliding.has_settled(i, state, now)):
                        trapped = False
                        slides[i] = sliding.SETTLES
                        wall_time[i] = next_time[i] = sliding.bounced(i, NEVER, state)[0][ks.CLOCK]
                        pair_time[i] = NEVER
            else:
                links[EVENTS, j] += 1
                links[LAST, i], links[LAST, j] = j, i
                links[BOUNCES, i] = links[BOUNCES, j] = 0
                delay_i = predict_wall_after_pair(i, now, state, slides, agenda)
                delay_j = predict_wall_after_pair(j, now, state, slides, agenda)
                find_contacts(i, j, now, delay_i, delay_j, state, slides, agenda)
            if trapped:
                answers[row] = clock.WALL_TRAP
                break
            if counts[ks.STALLED] > clock.STALL_LIMIT * balls.shape[1]:
                answers[row] = clock.COLLAPSE
                break
