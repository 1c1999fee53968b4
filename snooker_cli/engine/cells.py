"""Many balls: cells to find partners in, and a tournament tree for what comes next.

A ball looks for partners in its own and the eight cells around, and at a crossing in the three on
the far side (Rapaport, J. Comput. Phys. 34, 184 (1980)). A crossing changes neither position nor
clock: a replay needs no cells. For the rest see docs/how-it-works.md.
"""

from snooker_cli.engine import cell_memory as cm
from snooker_cli.engine import cell_prediction, clock
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import nonnegative
from snooker_cli.engine.cell_memory import Cells
from snooker_cli.engine.collision import collide, count, record
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.event_queue import first
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.kernel_state import Recorded, State
from snooker_cli.engine.prediction import is_trapped
from snooker_cli.engine.prefetch import LARGE, fetch_ahead, no_chains
from snooker_cli.engine.sampling import Grid, next_sample, sample_until

CROSSINGS_AT_ONCE = 1_000_000
"""Crossings after which the kernel returns, so that a repeat with few events can be stopped too."""


@inlined
def is_stale(i: int, j: int, cells: Cells) -> bool:
    """Whether ball i has no contact now: its partner had another event since, or none was found."""
    if j >= 0:
        return bool(cells.links[cm.PARTNER_EVENTS, i] != cells.tags[cm.EVENTS, j])
    return j != ks.NO_PARTNER


@inlined
def after_hit(i: int, j: int, now: float, state: State, cells: Cells) -> bool:
    """Note a collision of ball i with j, or with the wall; whether i is trapped there for good."""
    links, tags, setup = cells.links, cells.tags, state.setup
    tags[cm.EVENTS, i] += 1
    tags[cm.FORMER, i] = j
    if j != ks.NO_PARTNER:
        tags[cm.EVENTS, j] += 1
        tags[cm.FORMER, j] = i
        links[cm.BOUNCES, i] = links[cm.BOUNCES, j] = 0
        return False
    links[cm.BOUNCES, i] += 1
    cell_prediction.push(now, state, cells, state.container, cells.margin)
    bounces = links[cm.BOUNCES, i]
    often = bounces > 1 or setup.wall_law.cor == 0.0
    if setup.traps and often and bounces & (bounces - 1) == 0:  # after 2, 4, 8 … bounces
        return is_trapped(i, now, state, state.container, None, None, False)
    return False


@inlined
def predict(i: int, j: int, happened: bool, now: float, state: State, cells: Cells) -> None:
    """Predict what ball i, and after a collision ball j, do next.

    The loop predicts here alone, because copies of this code cost time.
    """
    for turn in range(2 if happened and j != ks.NO_PARTNER else 1):
        k = nonnegative(i if turn == 0 else j)
        if happened:
            cell_prediction.predict_crossing(k, now, state, cells)
        cell_prediction.predict_contact(k, now, j == ks.SEARCH_AGAIN, state, cells)
        cell_prediction.enqueue(k, now, state.balls, cells)


# What the loop does, an event or a crossing in each turn:
#
#   i, now = the ball whose contact or crossing comes first: the root of the tournament tree
#   stop if there is none, or if the time limit comes first, or if a free container left its margin
#   a crossing: move i into the next cell, look for partners on the far side, take the next turn
#   j = the partner of i's contact, or the wall; j is stale if it has had another event since
#   unless j is stale: fill the rows of the summary up to now; bring i and j to now, change their
#       velocities; count and record the event; push a free container
#   predict the next crossing and contact of i and j; only the contact of i if j is stale
#   stop if i is trapped at the wall, or if the clock stands still
@kernel
def advance(state: State, cells: Cells, recorded: Recorded, grid: Grid | None, limit: int) -> int:
    """Simulate at most ``limit`` events; why it stopped. Ties go by time and ball."""
    balls, counts, tree = state.balls, state.counts, cells.tree
    large, chains = balls.shape[1] >= LARGE, no_chains(tree.bits)
    crossings = filled = 0
    sample_time = NEVER
    if grid is not None:
        sample_time = next_sample(grid, state.sums)
    while filled < limit:
        i = first(tree.bits)
        now = tree.times[1]
        certain = cell_prediction.before_renewal(now, cells.margin)
        if certain == NEVER:
            return clock.NOTHING_LEFT
        if certain > state.sums[ks.TIME_LIMIT]:
            return clock.TIME
        if certain < now:
            return clock.OUT_OF_MARGIN
        if large:
            chains = fetch_ahead(now, chains, state, cells)
        if balls[cm.CONTACT_TIME, i] > now:
            if crossings == CROSSINGS_AT_ONCE:
                return clock.FULL
            crossings += 1
            if not cell_prediction.cross(i, now, state, cells):
                return clock.CELL_FULL
            cell_prediction.enqueue(i, now, balls, cells)
            continue
        j = cells.links[cm.PARTNER, i]
        trapped, happens = False, not is_stale(i, j, cells)
        if happens:
            if grid is not None and now > sample_time:
                sample_time = sample_until(now, grid, state, None)
            clock.begin_event(i, j, now, state.sums, counts)
            size = collide(i, j, now, state)
            count(i, j, size, state)
            if grid is None:
                record(recorded, filled, i, j, now, size, state.labels)
            filled += 1
            trapped = after_hit(i, j, now, state, cells)
        predict(i, j, happens, now, state, cells)
        if trapped:
            return clock.WALL_TRAP
        if counts[ks.STALLED] > clock.STALL_LIMIT * balls.shape[1]:
            return clock.COLLAPSE
    return clock.FULL
