"""Few balls: each keeps its earliest contact, found against all others in vector form.

A contact is entered for the ball that searched, not for its partner. So it may be stale when it is
the next one: ``next_event`` then searches again. docs/how-it-works.md has the ideas and sources.
"""

from typing import NamedTuple

import numpy as np

from snooker_cli.engine import clock, prediction, sliding
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import LANES, soonest
from snooker_cli.engine.collision import collide, count, record
from snooker_cli.engine.contact import NEVER, chord_delay, wall_delay
from snooker_cli.engine.jit import inlined, kernel
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


# Events


@inlined
def begin(state: State, agenda: Agenda) -> None:
    """Enter when each ball first hits the wall; all contacts are searched when they come up."""
    for k in range(state.balls.shape[1]):
        # The sum makes a negative zero positive: soonest compares bits.
        delay = prediction.time_to_wall(k, 0.0, state, state.container)
        agenda.times[WALL_TIME, k] = 0.0 + delay


@inlined
def next_event(state: State, slides: Integers | None, agenda: Agenda) -> tuple[int, int, float]:
    """The ball of the next event, its partner or the wall (NO_PARTNER), and the time, s.

    Ties go by time, ball, and wall first. An entry is stale if the partner has had another event
    since it was made. Then, and where no ball was found up to that time, search again from there.
    """
    times, links = agenda.times, agenda.links
    while True:
        i = soonest(times[NEXT_TIME])
        now = times[NEXT_TIME, i]
        if times[WALL_TIME, i] <= times[PAIR_TIME, i]:
            return i, ks.NO_PARTNER, now
        j = links[PARTNER, i]
        if j >= 0 and links[PARTNER_EVENTS, i] == links[EVENTS, j]:
            return i, j, now
        if slides is not None and now > state.sums[ks.TIME_LIMIT]:
            return i, j, now
        find_contact(i, now, times[WALL_TIME, i] - now, state, slides, agenda)


@inlined
def slide_event(
    i: int, j: int, now: float, state: State, slides: Integers | None, agenda: Agenda
) -> tuple[int, float]:
    """The ball of the two that begins to slide now, or slid up to now, and its impulse, kg m/s.

    The ball is NO_PARTNER if none slides; then i and j collide.
    """
    if slides is None:
        return ks.NO_PARTNER, 0.0
    k = sliding.sliding_ball(i, j, now, state.balls, slides)
    if k == ks.NO_PARTNER:
        return k, 0.0
    begins = slides[k] == sliding.SETTLES
    size = sliding.slide_on(k, now, state, slides)
    if begins:
        links = agenda.links
        links[EVENTS, k] += 1
        links[LAST, k], links[BOUNCES, k] = ks.NO_PARTNER, 0
        agenda.times[WALL_TIME, k] = NEVER
        find_contact(k, now, NEVER, state, slides, agenda)
    return k, size


@inlined
def after_wall_hit(
    i: int, now: float, state: State, slides: Integers | None, agenda: Agenda
) -> bool:
    """Predict what ball i does after a hit of the wall; whether it is trapped there for good."""
    balls, setup, times, links = state.balls, state.setup, agenda.times, agenda.links
    links[EVENTS, i] += 1
    links[LAST, i] = ks.NO_PARTNER
    links[BOUNCES, i] += 1
    predict_walls(now, state, agenda, state.container)
    x, y, u, v = ks.seen_from_container(
        balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now, state.container
    )
    delay = chord_delay(x, y, u, v)
    times[WALL_TIME, i] = now + delay
    find_contact(i, now, delay, state, slides, agenda)
    if not setup.traps or (links[BOUNCES, i] == 1 and setup.wall_law.cor != 0.0):
        return False
    patient = links[BOUNCES, i] <= setup.patience
    trapped = prediction.is_trapped(
        i, now, state, state.container, slides, times[NEXT_TIME], patient
    )
    if slides is None:
        return trapped
    if trapped or sliding.has_settled(i, state, now):
        times[WALL_TIME, i] = times[NEXT_TIME, i] = sliding.settle(i, state, slides)
        times[PAIR_TIME, i] = NEVER
    return False


@inlined
def after_pair(
    i: int, j: int, now: float, state: State, slides: Integers | None, agenda: Agenda
) -> None:
    """Predict what balls i and j do after their collision."""
    links = agenda.links
    links[EVENTS, i] += 1
    links[EVENTS, j] += 1
    links[LAST, i], links[LAST, j] = j, i
    links[BOUNCES, i] = links[BOUNCES, j] = 0
    delay_i = predict_wall_after_pair(i, now, state, slides, agenda)
    delay_j = predict_wall_after_pair(j, now, state, slides, agenda)
    find_contacts(i, j, now, delay_i, delay_j, state, slides, agenda)


# What one repeat does, an event in each turn of the loop:
#
#   i, j, now = the earliest contact of all balls; j is a ball or the wall
#   stop if there is none, or if the time limit comes first
#   fill the rows of the summary up to now
#   a ball that slides: bring it to now along the wall, and take the next turn
#   bring i and j to now, change their velocities; count and record the event
#   at the wall: a free container has moved: predict the hits of all; search i's next contact
#   between balls: search the next contacts of i and j
#   stop if i is trapped at the wall, or if the clock stands still
@inlined
def simulate_repeat(
    state: State,
    slides: Integers | None,
    agenda: Agenda,
    recorded: Recorded,
    grid: Grid | None,
    limit: int,
) -> int:
    """Simulate at most ``limit`` events of a repeat; why it stopped, see ``clock``."""
    counts, sums = state.counts, state.sums
    sample_time = NEVER
    if grid is not None:
        sample_time = next_sample(grid, sums)
    if counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS] == 0:
        begin(state, agenda)
    for filled in range(limit):
        i, j, now = next_event(state, slides, agenda)
        if now == NEVER:
            return clock.NOTHING_LEFT
        if now > sums[ks.TIME_LIMIT]:
            return clock.TIME
        if grid is not None and now > sample_time:
            sample_time = sample_until(now, grid, state, slides)
        clock.begin_event(i, j, now, sums, counts)
        slider, size = slide_event(i, j, now, state, slides, agenda)
        if slider != ks.NO_PARTNER:
            i, j = slider, SLIDE
        else:
            size = collide(i, j, now, state)
        count(i, j, size, state)
        if grid is None:
            record(recorded, filled, i, j, now, size, state.labels)
        if j == SLIDE:
            continue
        if j == ks.NO_PARTNER:
            if after_wall_hit(i, now, state, slides, agenda):
                return clock.WALL_TRAP
        else:
            after_pair(i, j, now, state, slides, agenda)
        if counts[ks.STALLED] > clock.STALL_LIMIT * state.balls.shape[1]:
            return clock.COLLAPSE
    return clock.FULL


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

    states, all_slides, agendas, grids : stacked, of all repeats; without grids events are recorded
    active : (*a*,), the repeats to simulate
    records, answers : a row for each of these
    """
    for row in range(len(active)):
        repeat = active[row]
        state, slides = ks.state_of(states, repeat), ks.part_of(all_slides, repeat)
        agenda = Agenda(agendas.times[repeat], agendas.links[repeat])
        recorded = Recorded(records.time[row], records.i[row], records.j[row], records.impulse[row])
        grid = grid_of(grids, repeat)
        answers[row] = simulate_repeat(state, slides, agenda, recorded, grid, limit)
