"""Many balls: cells to find partners in, and a tournament tree for what comes next.

A ball looks for partners in its own and the eight cells around, and at a crossing in the three on
the far side (Rapaport, J. Comput. Phys. 34, 184 (1980)). A crossing changes neither position nor
clock: a replay needs no cells. For the rest see docs/how-it-works.md.
"""

from snooker_cli.engine import cell_grid, cell_prediction, clock
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.cell_grid import Cells
from snooker_cli.engine.collision import collide, count, record
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.event_queue import LARGE, fetch_ahead, first, no_chains
from snooker_cli.engine.jit import kernel
from snooker_cli.engine.kernel_state import Recorded, State
from snooker_cli.engine.prediction import is_trapped
from snooker_cli.engine.sampling import Grid, next_sample, sample_until

CROSSINGS_AT_ONCE = 1_000_000
"""Crossings after which the kernel returns, so that a repeat with few events can be stopped too."""


@kernel
def advance(state: State, cells: Cells, recorded: Recorded, grid: Grid | None, limit: int) -> int:
    """Simulate at most ``limit`` events; why it stopped. Ties go by time and ball."""
    balls, counts = state.balls, state.counts
    links, tags, tree = cells.links, cells.tags, cells.tree
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
        if balls[cell_grid.CONTACT_TIME, i] > now:
            if crossings == CROSSINGS_AT_ONCE:
                return clock.FULL
            crossings += 1
            if not cell_prediction.cross(i, now, state, cells):
                return clock.CELL_FULL
            cell_prediction.enqueue(i, now, balls, cells)
            continue
        j = links[cell_grid.PARTNER, i]
        known = j >= 0 and links[cell_grid.PARTNER_EVENTS, i] == tags[cell_grid.EVENTS, j]
        happens = known or j == ks.NO_PARTNER
        trapped = False
        if happens:
            if grid is not None and now > sample_time:
                sample_time = sample_until(now, grid, state, None)
            clock.begin_event(i, j, now, state.sums, counts)
            size = collide(i, j, now, state)
            count(i, j, size, state)
            if grid is None:
                record(recorded, filled, i, j, now, size, state.labels)
            filled += 1
            tags[cell_grid.EVENTS, i] += 1
            tags[cell_grid.FORMER, i] = j
            if j == ks.NO_PARTNER:
                links[cell_grid.BOUNCES, i] += 1
                cell_prediction.push(now, state, cells, state.container, cells.margin)
                bounces = links[cell_grid.BOUNCES, i]
                often = bounces > 1 or state.setup.wall_law.cor == 0.0
                # After 2, 4, 8 … bounces.
                if state.setup.traps and often and bounces & (bounces - 1) == 0:
                    trapped = is_trapped(i, now, state, state.container, None, None, False)
            else:
                tags[cell_grid.EVENTS, j] += 1
                tags[cell_grid.FORMER, j] = i
                links[cell_grid.BOUNCES, i] = links[cell_grid.BOUNCES, j] = 0
        for turn in range(2 if happens and j != ks.NO_PARTNER else 1):
            k = ks.nonnegative(i if turn == 0 else j)
            if happens:
                cell_prediction.predict_crossing(k, now, state, cells)
            cell_prediction.predict_contact(k, now, j == ks.SEARCH_AGAIN, state, cells)
            cell_prediction.enqueue(k, now, balls, cells)
        if trapped:
            return clock.WALL_TRAP
        if counts[ks.STALLED] > clock.STALL_LIMIT * balls.shape[1]:
            return clock.COLLAPSE
    return clock.FULL
