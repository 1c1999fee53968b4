"""Few balls: each keeps its earliest contact, found against all others in vector form.

A contact is entered for the ball that searched, not for its partner. So it may be stale when it is
the next one: ``next_event`` then searches again. docs/how-it-works.md has the ideas and sources.
"""

from typing import Any, NamedTuple

import numpy as np

from snooker_cli.engine import clock, prediction
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import LANES, soonest
from snooker_cli.engine.collision import collide, count, record
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.jit import by_class, inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Integers, Recorded, State
from snooker_cli.engine.prediction import delay_to_next_hit, delay_to_wall
from snooker_cli.engine.sampling import Grid, grid_of, next_sample, sample_until
from snooker_cli.trace import SLIDE

# Rows of ``Agenda.links``: the partner of the earliest contact, its number of events when the
# contact was predicted, the ball's own number of events, the ball it last collided with, and its
# hits of the wall since then. With SEARCH_AGAIN there is no partner before ks.PAIR_TIME.
PARTNER, PARTNER_EVENTS, EVENTS, LAST, BOUNCES, LINK_ROWS = range(6)


class Agenda(NamedTuple):
    """The next contacts of each ball.

    times : (ks.TIME_ROWS, *N* or up to LANES - 1 more, which never come), nonnegative
    links : (LINK_ROWS, *N*)
    """

    times: Floats
    links: Integers


def new_agendas(repeats: int, number: int) -> Agenda:
    """The stacked agendas of repeats at time zero, without the times at the wall."""
    times = np.full((repeats, ks.TIME_ROWS, -(-number // LANES) * LANES), NEVER)
    times[:, :, :number] = 0.0
    links = np.full((repeats, LINK_ROWS, number), ks.NO_PARTNER, dtype=np.int64)
    links[:, [EVENTS, BOUNCES]] = 0
    links[:, PARTNER] = ks.NOT_SEARCHED
    return Agenda(times, links)


# What boundaries change


@by_class
def search_time(boundary: Any, delay: float) -> float:
    """How far ahead to search contacts of a ball that hits the wall after a delay, s."""
    return delay


@by_class
def searched_until(boundary: Any, time: float, early: bool) -> float:
    """When to search contacts again if there are none up to a time, s: after the hit of the wall.

    early : whether the search gave up at that time, though the hit of the wall is later
    """
    return NEVER


@by_class
def predict_walls(boundary: Any, now: float, state: State, times: Floats) -> None:
    """Enter when each ball hits the wall, if that moves: it has just been given a new velocity."""


@by_class
def without_curved(boundary: Any, mask: int, start: int, stop: int, i: int) -> int:
    """The mask of balls from ``start`` to ``stop`` without those that ball i meets on an arc."""
    return mask


@by_class
def earliest_on_arc(
    boundary: Any,
    i: int,
    now: float,
    delay: float,
    partner: int,
    state: State,
    wall_times: Floats,
) -> tuple[float, int]:
    """When ball i first touches another, if one of them slides, and which, if before ``delay``."""
    return delay, partner


@by_class
def settle(boundary: Any, i: int, trapped: bool, now: float, state: State) -> float:
    """When ball i, which has just hit the wall, begins to slide, s; never if it does not."""
    return NEVER


@by_class
def carry_out_slide(
    boundary: Any, i: int, j: int, now: float, state: State
) -> tuple[int, bool, float]:
    """The ball of the two that slides up to now, whether it begins now, and its impulse, kg m/s.

    The ball is NO_PARTNER if none slides; then i and j collide.
    """
    return ks.NO_PARTNER, False, 0.0


# Entries and searches; only the first functions know the rows of ``Agenda.links``


@inlined
def entered_partner(i: int, links: Integers) -> tuple[int, bool]:
    """The partner of ball i's entry, and whether that has had no event since the entry was made."""
    j = links[PARTNER, i]
    return j, j >= 0 and links[PARTNER_EVENTS, i] == links[EVENTS, j]


@inlined
def just_parted(i: int, links: Integers) -> int:
    """The ball that ball i parted from in the last event of both; negative if there is none."""
    last = links[LAST, i]
    return last if last >= 0 and links[LAST, last] == i else ks.NO_PARTNER


@inlined
def bounces(i: int, links: Integers) -> int:
    """How often ball i has hit the wall in a row."""
    return int(links[BOUNCES, i])


@inlined
def count_event(i: int, partner: int, in_a_row: int, links: Integers) -> None:
    """Note an event of ball i: with which partner, and its hits of the wall in a row by now."""
    links[EVENTS, i] += 1
    links[LAST, i] = partner
    links[BOUNCES, i] = in_a_row


@inlined
def enter_contact(i: int, time: float, partner: int, agenda: Agenda) -> None:
    """Enter ball i's earliest contact with another; its time at the wall is there already."""
    times, links = agenda.times, agenda.links
    times[ks.PAIR_TIME, i] = time
    times[ks.NEXT_TIME, i] = min(time, times[ks.WALL_TIME, i])
    links[PARTNER, i] = partner
    if partner >= 0:
        links[PARTNER_EVENTS, i] = links[EVENTS, partner]


@inlined
def complete_search(
    i: int, now: float, delay: float, partner: int, state: State, agenda: Agenda
) -> None:
    """Enter what a search among balls on straight ways gave, after one among those on arcs."""
    boundary, straight = state.boundary, delay
    delay, partner = earliest_on_arc(
        boundary, i, now, delay, partner, state, agenda.times[ks.WALL_TIME]
    )
    time = now + delay
    if partner < 0:
        time = searched_until(boundary, time, delay < straight)
    enter_contact(i, time, partner, agenda)


@inlined
def find_contact(i: int, now: float, wall_delay: float, state: State, agenda: Agenda) -> None:
    """Find ball i's earliest contact with another, unless it hits the wall before."""
    number, parted = state.balls.shape[1], just_parted(i, agenda.links)
    delay = search_time(state.boundary, wall_delay)
    partner = ks.SEARCH_AGAIN
    for start in range(0, number, prediction.BLOCK):
        stop = min(start + prediction.BLOCK, number)
        mask = prediction.candidates(i, now, delay, state, start, stop)
        if parted >= 0:
            mask = prediction.without(mask, start, parted)
        mask = without_curved(state.boundary, mask, start, stop, i)
        delay, partner = prediction.earliest(mask, start, i, now, delay, partner, state)
    complete_search(i, now, delay, partner, state, agenda)


@inlined
def find_contacts(
    i: int,
    j: int,
    now: float,
    wall_delay_i: float,
    wall_delay_j: float,
    state: State,
    agenda: Agenda,
) -> None:
    """``find_contact`` for two balls that have just collided."""
    boundary, number = state.boundary, state.balls.shape[1]
    delay_i = search_time(boundary, wall_delay_i)
    delay_j = search_time(boundary, wall_delay_j)
    partner_i = partner_j = ks.SEARCH_AGAIN
    for start in range(0, number, prediction.BLOCK):
        stop = min(start + prediction.BLOCK, number)
        mask_i, mask_j = prediction.candidates_of_two(
            i, j, now, delay_i, delay_j, state, start, stop
        )
        mask_i = prediction.without(mask_i, start, j)  # they part
        mask_j = prediction.without(mask_j, start, i)
        mask_i = without_curved(boundary, mask_i, start, stop, i)
        mask_j = without_curved(boundary, mask_j, start, stop, j)
        delay_i, partner_i = prediction.earliest(mask_i, start, i, now, delay_i, partner_i, state)
        delay_j, partner_j = prediction.earliest(mask_j, start, j, now, delay_j, partner_j, state)
    complete_search(i, now, delay_i, partner_i, state, agenda)
    complete_search(j, now, delay_j, partner_j, state, agenda)


# Events


@inlined
def predict_wall(i: int, now: float, state: State, agenda: Agenda) -> float:
    """Enter when ball i, after any event but a hit of the wall, hits it; the time until then, s."""
    slid = ks.take_off_wall(state.boundary, i)
    delay = delay_to_wall(state.boundary, i, now, slid, state)
    # The sum makes a negative zero positive: soonest compares bits.
    agenda.times[ks.WALL_TIME, i] = now + delay
    return delay


@inlined
def begin(state: State, agenda: Agenda) -> None:
    """Enter when each ball first hits the wall; all contacts are searched when they come up."""
    for k in range(state.balls.shape[1]):
        predict_wall(k, 0.0, state, agenda)


@inlined
def next_event(state: State, agenda: Agenda) -> tuple[int, int, float]:
    """The ball of the next event, its partner or the wall (NO_PARTNER), and the time, s.

    Ties go by time, ball, and wall first. An entry is stale if the partner has had another event
    since it was made. Then, and where no ball was found up to that time, search again from there.
    """
    times = agenda.times
    while True:
        i = soonest(times[ks.NEXT_TIME])
        now = times[ks.NEXT_TIME, i]
        if times[ks.WALL_TIME, i] <= times[ks.PAIR_TIME, i]:
            return i, ks.NO_PARTNER, now
        j, is_fresh = entered_partner(i, agenda.links)
        if is_fresh:
            return i, j, now
        # A search on arcs may give up often. The repeat ends here, so a stale j does no harm.
        if ks.is_curved(state.boundary) and now > state.sums[ks.TIME_LIMIT]:
            return i, j, now
        find_contact(i, now, times[ks.WALL_TIME, i] - now, state, agenda)


@inlined
def other_events(end: float, i: int, next_times: Floats) -> int:
    """How many balls, other than i, have their next event up to a time, s."""
    number = 0
    for k in range(len(next_times)):
        number += 1 if k != i and next_times[k] <= end else 0
    return number


@inlined
def after_wall_hit(i: int, now: float, state: State, agenda: Agenda) -> bool:
    """Predict what ball i does after a hit of the wall; whether it is trapped there for good."""
    boundary, setup, times, links = state.boundary, state.setup, agenda.times, agenda.links
    count_event(i, ks.NO_PARTNER, bounces(i, links) + 1, links)
    predict_walls(boundary, now, state, times)
    delay = delay_to_next_hit(boundary, i, state)
    times[ks.WALL_TIME, i] = now + delay
    find_contact(i, now, delay, state, agenda)
    if not setup.traps or (bounces(i, links) == 1 and not prediction.may_stay(setup.wall_law)):
        return False
    if prediction.is_endless(setup.wall_law, bounces(i, links)):
        return True
    lasts = prediction.bouncing_time(i, now, state)
    undisturbed = bool(bounces(i, links) <= setup.patience)
    trapped = False
    if not undisturbed or other_events(now + lasts, i, times[ks.NEXT_TIME]) == 0:
        trapped = prediction.is_trapped(i, now, lasts, undisturbed, state)
    slides_from = settle(boundary, i, trapped, now, state)
    if slides_from == NEVER:
        return trapped
    # Not a hit, but when it begins to slide; until then it meets no ball.
    times[ks.WALL_TIME, i] = times[ks.NEXT_TIME, i] = slides_from
    times[ks.PAIR_TIME, i] = NEVER
    return False


@inlined
def after_pair(i: int, j: int, now: float, state: State, agenda: Agenda) -> None:
    """Predict what balls i and j do after their collision."""
    count_event(i, j, 0, agenda.links)
    count_event(j, i, 0, agenda.links)
    delay_i = predict_wall(i, now, state, agenda)
    delay_j = predict_wall(j, now, state, agenda)
    find_contacts(i, j, now, delay_i, delay_j, state, agenda)


@inlined
def begin_slide(i: int, now: float, agenda: Agenda) -> None:
    """Ball i slides from now on: it has no wall ahead, and its contacts are searched next."""
    count_event(i, ks.NO_PARTNER, 0, agenda.links)
    agenda.times[ks.WALL_TIME, i] = NEVER
    enter_contact(i, now, ks.NOT_SEARCHED, agenda)


# What one repeat does, an event in each turn of the loop:
#
#   i, j, now = the earliest contact of all balls; j is a ball or the wall
#   stop if there is none, or if the time limit comes first
#   fill the rows of the summary up to now
#   a ball that slides: bring it to now along the wall, and take the next turn (``sliding``)
#   bring i and j to now, change their velocities; count and record the event
#   at the wall: a free container has moved: predict the hits of all; search i's next contact
#   between balls: search the next contacts of i and j
#   stop if i is trapped at the wall, or if the clock stands still
@inlined
def simulate_repeat(
    state: State, agenda: Agenda, recorded: Recorded, grid: Grid | None, limit: int
) -> int:
    """Simulate at most ``limit`` events of a repeat; why it stopped, see ``clock``."""
    counts, sums = state.counts, state.sums
    sample_time = NEVER
    if grid is not None:
        sample_time = next_sample(grid, sums)
    if counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS] == 0:
        begin(state, agenda)
    for filled in range(limit):
        i, j, now = next_event(state, agenda)
        if now == NEVER:
            return clock.NOTHING_LEFT
        if now > sums[ks.TIME_LIMIT]:
            return clock.TIME
        if grid is not None and now > sample_time:
            sample_time = sample_until(now, grid, state)
        clock.begin_event(i, j, now, state)
        slider, begins, size = carry_out_slide(state.boundary, i, j, now, state)
        if slider != ks.NO_PARTNER:
            i, j = slider, SLIDE
        else:
            size = collide(state.account, i, j, now, state)
        count(i, j, size, state)
        if grid is None:
            record(recorded, filled, i, j, now, size, state.labels)
        if begins:
            begin_slide(i, now, agenda)
        if j == SLIDE:
            continue  # entries stay, so the next turn has the same contact and collides the balls
        if j == ks.NO_PARTNER:
            if after_wall_hit(i, now, state, agenda):
                return clock.WALL_TRAP
        else:
            after_pair(i, j, now, state, agenda)
        if clock.has_collapsed(state):
            return clock.COLLAPSE
    return clock.FULL


@kernel
def advance(
    states: State,
    agendas: Agenda,
    records: Recorded,
    grids: Grid | None,
    active: Integers,
    answers: Integers,
    limit: int,
) -> None:
    """Simulate at most ``limit`` events of each active repeat, and answer why each stopped.

    states, agendas, grids : stacked, of all repeats; without grids events are recorded
    active : (*a*,), the repeats to simulate
    records, answers : a row for each of these
    """
    for row in range(len(active)):
        repeat = active[row]
        state = ks.state_of(states, repeat)
        agenda = Agenda(agendas.times[repeat], agendas.links[repeat])
        recorded = Recorded(records.time[row], records.i[row], records.j[row], records.impulse[row])
        grid = grid_of(grids, repeat)
        answers[row] = simulate_repeat(state, agenda, recorded, grid, limit)
