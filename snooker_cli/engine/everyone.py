"""The search for few balls: each ball's earliest contact, found against everyone else.

A contact is entered for the ball that searched, not for its partner. So an entry may be stale when
it is the next one; then the ball searches again. docs/how-it-works.md has the ideas and sources.
"""

from typing import NamedTuple

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine import prediction
from snooker_cli.engine.bit_tricks import LANES, earlier, enter_lane, soonest
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.event_loop import Search
from snooker_cli.engine.jit import helper, inlined
from snooker_cli.engine.kernel_state import (
    EVENTS,
    LANE_TIME,
    NEXT_TIME,
    PAIR_TIME,
    TIME_ROWS,
    WALL_TIME,
    Flags,
    Floats,
    Indices,
    State,
)

# Rows of ``Everyone.links``: the partner of the earliest contact, and its number of events when the
# contact was found.
PARTNER, PARTNER_EVENTS, LINK_ROWS = range(3)


class Everyone(
    Search, NamedTuple("Everyone", [("times", Floats), ("links", Indices), ("begun", Flags)])
):
    """What each ball does next. The event loop calls its methods, as those of ``Cells``.

    times : (TIME_ROWS, *N* or up to LANES - 1 more, which never come), nonnegative; of the last row
        the first LANES
    links : (LINK_ROWS, *N*)
    begun : (1,), whether predictions are those of the present epoch
    """

    def of_repeat(self, repeat: int) -> "Everyone":
        return Everyone(self.times[repeat], self.links[repeat], self.begun[repeat])

    def begin(self, now: float, state: State) -> None:
        if self.begun[0]:
            return
        self.begun[0] = True
        for i in range(state.balls.shape[1]):
            self.times[WALL_TIME, i] = state.boundary.time_of_next_hit(i, state)
            enter(i, now, ks.NOT_SEARCHED, state, self)

    def forget(self) -> bool:
        self.begun[0] = False
        return True

    def next_entry(self, state: State) -> tuple[int, int, float]:
        i, another, more = soonest(self.times[NEXT_TIME], self.times[LANE_TIME])
        now = self.times[NEXT_TIME, i]
        if another >= 0 and now != NEVER and (more or not is_same_contact(i, another, self)):
            i = first_of_equal(i, state, self)
        if self.times[WALL_TIME, i] <= self.times[PAIR_TIME, i]:
            return i, ks.NO_PARTNER, now
        return i, fresh_partner(i, state, self), now

    def predict(self, i: int, j: int, happened: bool, now: float, state: State) -> None:
        walls = self.times[WALL_TIME]
        if happened:
            if j < 0:
                state.boundary.predict_walls(now, state, self.times)
            walls[i] = state.boundary.time_of_next_hit(i, state)
        if happened and j >= 0:
            walls[j] = state.boundary.time_of_next_hit(j, state)
            find_contacts(i, j, now, state, self)
        else:
            find_contact(i, now, state, self)


def new_search(repeats: int, number: int) -> Everyone:
    """The stacked search of repeats, with nothing in it."""
    times = np.full((repeats, TIME_ROWS, -(-number // LANES) * LANES), NEVER)
    times[:, :, :number] = 0.0
    links = np.full((repeats, LINK_ROWS, number), ks.NOT_SEARCHED, dtype=np.int32)
    return Everyone(times, links, np.zeros((repeats, 1), dtype=np.bool_))


# Entries


@inlined
def fresh_partner(i: int, state: State, search: Everyone) -> int:
    """The partner of ball i's contact; SEARCH_AGAIN if that had an event since, or is unknown."""
    j = int(search.links[PARTNER, i])
    is_fresh = j >= 0 and search.links[PARTNER_EVENTS, i] == state.history[EVENTS, j]
    return j if is_fresh else ks.SEARCH_AGAIN


@inlined
def enter(i: int, time: float, partner: int, state: State, search: Everyone) -> None:
    """Enter ball i's earliest contact with another; its time at the wall is there already."""
    times, links = search.times, search.links
    times[PAIR_TIME, i] = time
    times[NEXT_TIME, i] = earlier(time, times[WALL_TIME, i])
    enter_lane(i, times[NEXT_TIME], times[LANE_TIME])
    links[PARTNER, i] = partner
    if partner >= 0:
        links[PARTNER_EVENTS, i] = state.history[EVENTS, partner]


@inlined
def is_same_contact(i: int, k: int, search: Everyone) -> bool:
    """Whether balls i and k, whose entries have one time, have each other as partners."""
    times, links = search.times, search.links
    both = links[PARTNER, i] == k and links[PARTNER, k] == i
    at_wall_later = times[WALL_TIME, i] > times[PAIR_TIME, i]
    return bool(both and at_wall_later and times[WALL_TIME, k] > times[PAIR_TIME, k])


@helper
def first_of_equal(i: int, state: State, search: Everyone) -> int:
    """Of the balls whose entries have the same time as that of ball i, the one that is first.

    That is one which has to search again, if there is any. Else ties go by: the wall, the lesser
    ball, the greater ball.
    """
    times, now = search.times, search.times[NEXT_TIME, i]
    first, lesser, greater = i, ks.NO_LIMIT, ks.NO_LIMIT
    for k in range(state.balls.shape[1]):
        if times[NEXT_TIME, k] != now:
            continue
        a, b = k, ks.NO_PARTNER
        if times[WALL_TIME, k] > now:
            partner = fresh_partner(k, state, search)
            if partner < 0:
                return k
            a, b = min(k, partner), max(k, partner)
        if first_comes(a, b, lesser, greater):
            first, lesser, greater = k, a, b
    return first


@inlined
def first_comes(i: int, j: int, lesser: int, greater: int) -> bool:
    """Whether the event of balls i < j, or of i and the wall, is before another at its time."""
    if (j < 0) != (greater < 0):
        return j < 0
    return i < lesser or (i == lesser and j < greater)


# Searches


@inlined
def complete_search(
    i: int, now: float, time: float, partner: int, state: State, search: Everyone
) -> None:
    """Enter what a search among balls on straight ways gave, after one among those on arcs."""
    time, partner = state.boundary.earliest_on_arc(
        i, now, time, partner, state, search.times[WALL_TIME]
    )
    enter(i, time, partner, state, search)


@inlined
def find_contact(i: int, now: float, state: State, search: Everyone) -> None:
    """Find ball i's earliest contact with another, unless it hits the wall before."""
    boundary, number = state.boundary, state.balls.shape[1]
    parted = prediction.cannot_meet(i, now, state)
    time = boundary.search_until(i, now, search.times[WALL_TIME, i], state)
    partner = ks.SEARCH_AGAIN
    for start in range(0, number, prediction.BLOCK):
        stop = min(start + prediction.BLOCK, number)
        mask = boundary.candidates(i, now, time, state, start, stop)
        mask = prediction.without(mask, start, i)
        if parted >= 0:
            mask = prediction.without(mask, start, parted)
        mask = boundary.without_curved(mask, start, stop, i)
        time, partner = prediction.earliest(mask, start, i, now, time, partner, state)
    complete_search(i, now, time, partner, state, search)


@inlined
def find_contacts(i: int, j: int, now: float, state: State, search: Everyone) -> None:
    """``find_contact`` for two balls that have just collided."""
    boundary, number, walls = state.boundary, state.balls.shape[1], search.times[WALL_TIME]
    time_i = boundary.search_until(i, now, walls[i], state)
    time_j = boundary.search_until(j, now, walls[j], state)
    partner_i = partner_j = ks.SEARCH_AGAIN
    for start in range(0, number, prediction.BLOCK):
        stop = min(start + prediction.BLOCK, number)
        mask_i, mask_j = prediction.candidates_of_two(i, j, now, time_i, time_j, state, start, stop)
        mask_i = prediction.without(mask_i, start, j)  # they part
        mask_j = prediction.without(mask_j, start, i)
        mask_i = prediction.without(mask_i, start, i)
        mask_j = prediction.without(mask_j, start, j)
        mask_i = boundary.without_curved(mask_i, start, stop, i)
        mask_j = boundary.without_curved(mask_j, start, stop, j)
        time_i, partner_i = prediction.earliest_now(mask_i, start, i, now, time_i, partner_i, state)
        time_j, partner_j = prediction.earliest_now(mask_j, start, j, now, time_j, partner_j, state)
    complete_search(i, now, time_i, partner_i, state, search)
    complete_search(j, now, time_j, partner_j, state, search)
