"""The event loop: what is next, what it changes, and what happens after that.

A search knows what each ball does next: ``everyone.Everyone`` or ``cells.Neighbours``. It only
saves time. Which event is next follows from the state alone: it is the contact with the least time
(``prediction.contact_time``, ``time_at_wall``). Ties go by kind (the wall first), by the lesser
ball, and by the greater ball, in the scene's numbers.
"""

from snooker_cli.engine import clock
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.collision import collide, count, record
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.jit import called_by_kernels, inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Integers, Part, Records, State
from snooker_cli.engine.prediction import is_trapped
from snooker_cli.engine.sampling import Samples
from snooker_cli.trace import SLIDE


@called_by_kernels
class Search(Part):
    """What each ball does next, found among everyone or among neighbours."""

    def begin(self, now: float, state: State) -> None:
        """If an epoch has begun, forget all predictions and begin with new ones at a time, s.

        ``Neighbours`` does so from outside.
        """

    def forget(self) -> bool:
        """Forget all predictions, so that ``begin`` makes new ones; false if others have to."""
        return False

    def next_entry(self, state: State) -> tuple[int, int, float]:
        """The ball that is next, its partner, and the time, s; inf if nothing is left.

        The partner is a ball, the wall (NO_PARTNER), or SEARCH_AGAIN if the entry no longer holds:
        no event is before that time. A lower number is an answer of ``advance``, see
        ``STOPS``: the kernel stops.
        """
        raise NotImplementedError

    def predict(self, i: int, j: int, happened: bool, now: float, state: State) -> None:
        """Find what ball i does next, and after a collision ball j.

        happened : whether they had an event; else the entry of ball i no longer holds
        """
        raise NotImplementedError


STOPS = -8
"""A search gives STOPS less an answer as the partner, to stop with this answer."""


FINISH = -1
"""A limit of `advance` that says: complete the summary up to the end, without an event."""


# What one repeat does, an event in each turn of the loop:
#
#   at the beginning of an epoch, whose clocks have been set back: predict everything
#   i, j, now = the earliest contact of all; j is a ball or the wall
#   stop if there is none, or if the time up to which to simulate comes first
#   if the entry no longer holds: search i's contacts again, and take the next turn
#   stop if what moves on without an event has become too far for its place
#   fill the rows of the summary up to now
#   a ball that slides: bring it to now along the wall; the same contact is next
#   bring i and j to now, change their velocities; count and record the event
#   stop if i is trapped at the wall, if the clock stands still, or if the balls are too slow
#   if a frame has taken over the velocity that all share: predict everything
#   predict the next contacts of i and j; if a free container has moved, all its hits
@inlined
def simulate_repeat(
    state: State,
    search: Search,
    records: Records,
    samples: Samples,
    limit: int,
    until: float,
    turns: int,
) -> int:
    """Simulate at most ``limit`` events of a repeat; why it stopped, see ``clock``.

    until : what clocks show at the end, s; TIME_LIMIT, unless more is simulated later
    turns : of the loop, at most
    """
    sums, boundary = state.sums, state.boundary
    filled, sample_time = 0, samples.next_sample(sums)
    search.begin(sums[ks.NOW], state)
    while filled < limit and turns > 0:
        turns -= 1
        i, j, time = search.next_entry(state)
        if j <= STOPS:
            return int(STOPS - j)
        if time == NEVER:
            return clock.NOTHING_LEFT
        if time > until:
            return clock.TIME
        now, happens = max(time, sums[ks.NOW]), j != ks.SEARCH_AGAIN
        if happens:
            if boundary.is_far(i, now, state) or boundary.is_far(j, now, state):
                return clock.FAR
            if now > sample_time:
                sample_time = samples.take_samples(now, state)
            i, j = ks.in_order(i, j, state.labels)
            clock.begin_event(i, j, now, state)
            slider, begins, size = boundary.carry_out_slide(i, j, now, state)
            if slider != ks.NO_PARTNER:
                i, j = slider, SLIDE
            else:
                size = collide(i, j, now, state)
            count(i, j, size, state)
            if filled < len(records):
                record(records[filled], i, j, now, size, state)
                state.surface.record_rub(records[filled])
            filled += 1
            if j == SLIDE:
                if not begins:
                    continue
                ks.note_slide(i, state)
            else:
                ks.note_collision(i, j, state)
                boundary.take_off_wall(i)
            if j >= 0:
                boundary.take_off_wall(j)
            at_wall = j == ks.NO_PARTNER
            if at_wall and boundary.settle(i, is_trapped(i, now, state), now, state):
                return clock.WALL_TRAP
            if clock.has_collapsed(state):
                return clock.COLLAPSE
            if clock.is_at_rest(i, size, state):
                return clock.REST
            if state.frame.renew_frame(i, j, size, now, state):
                if not search.forget():
                    return clock.NEW_FRAME
                search.begin(now, state)
                continue
        search.predict(i, j, happens, now, state)
    return clock.FULL


@kernel
def advance(
    states: State,
    searches: Search,
    records: Records,
    samples: Samples,
    active: Integers,
    answers: Integers,
    limit: int,
    ends: Floats,
) -> None:
    """Simulate at most ``limit`` events of each active repeat, and answer why each stopped.

    states, searches, samples : stacked, of all repeats
    active : (*a*,), the repeats to simulate
    records, answers : a row for each of these; records have no room if there is a summary
    limit : FINISH completes the summaries instead
    ends : (*a*,), what the clocks of each show at the time up to which to simulate, s
    """
    for row in range(len(active)):
        repeat = active[row]
        state = ks.state_of(states, repeat)
        search, own = searches.of_repeat(repeat), samples.of_repeat(repeat)
        if limit == FINISH:
            own.finish(ends[row], state)
            continue
        answers[row] = simulate_repeat(
            state, search, records[row], own, limit, ends[row], ks.NO_LIMIT
        )


@kernel
def advance_alone(
    state: State, search: Search, records: Records, samples: Samples, limit: int, end: float
) -> int:
    """`advance` of a single repeat up to one time, s; why it stopped.

    Its arrays are not parts of stacked ones: so Numba knows that each ball is a line of the cache,
    and addresses take one register. With many balls this is 2 % faster.
    """
    if limit == FINISH:
        samples.finish(end, state)
        return clock.FULL
    return simulate_repeat(state, search, records, samples, limit, end, ks.NO_LIMIT)
