"""Many balls: cells to find partners in, and a tournament tree for what comes next.

The ideas, and where they come from:
- Each ball has its own clock, moves only in its own events, and has one entry in the queue, its
  earliest event; an entry whose partner has had an event since is stale, and is predicted again
  when it comes up (Lubachevsky, J. Comput. Phys. 94, 255 (1991)).
- A ball looks for partners in its own and the eight cells around; when it crosses into another
  cell it looks at the three on the far side, all others being known (Rapaport, J. Comput. Phys.
  34, 184 (1980)). A crossing changes neither position nor clock: a replay knows nothing of cells.
- A ball's state is one line of a cache; the wall is predicted only from cells that are next to it.
- A free container is taken to be where it was, with a wall that is nearer by ``margin``: what that
  predicts comes too early, and is predicted exactly when it comes up. So a push of the container
  costs nothing, until it has moved by the margin.
"""

from __future__ import annotations

from snooker_cli.engine.cell_grid import (
    Cells,
    Mesh,
    cell_at,
    column_of,
    crossing_delays,
    put_into,
    put_out,
    row_of,
)
from snooker_cli.engine.cell_prediction import (
    UNTIL,
    Margin,
    collect,
    enqueue,
    enter_contact,
    nearest,
    parted_from,
    predict,
    predict_crossing,
    push,
    time_at_wall,
)
from snooker_cli.engine.clock import (
    CELL_FULL,
    CLOCK_DIGITS,
    COLLAPSE,
    COLLISIONS,
    FULL,
    NOTHING_LEFT,
    OUT_OF_MARGIN,
    STALL_LIMIT,
    TIME,
    WALL_TRAP,
)
from snooker_cli.engine.collision import (
    add_up,
    contact_lasts,
    hit_pair,
    hit_side,
    hit_wall,
    move,
    touched,
    wrap,
)
from snooker_cli.engine.contact import NEVER, nearest_image
from snooker_cli.engine.event_queue import LARGE, Tree, fetch_ahead, first, no_chains
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.kernel_state import (
    BOUNCES,
    CELL,
    CLOCK,
    CONTACT_LASTS,
    CONTACT_TIME,
    CROSSING_TIME,
    CROSSINGS,
    EPOCH,
    EVENTS,
    FIRST,
    FORMER,
    LOOK,
    LOOK_AGAIN,
    NOBODY,
    NOW,
    PAIR_EVENTS,
    PAIR_VIRIAL,
    PARTNER,
    PARTNER_COUNT,
    PREDICTIONS,
    SECOND,
    STALE,
    STALLED,
    WALL_EVENTS,
    WALL_IMPULSE,
    Flags,
    Floats,
    Indices,
    Integers,
    Recorded,
    Setup,
    U,
    V,
    X,
    Y,
    ahead,
)
from snooker_cli.engine.prediction import contact_distance, is_trapped, never_elastic
from snooker_cli.engine.sampling import Grid, sample_until

# A crossing is no event: after this many for each event that there is room for the kernel returns,
# so that a run in which nothing happens can be stopped too.
CROSSINGS_AT_ONCE = 64


@inlined
def cross(
    i: int,
    now: float,
    balls: Floats,
    container: Floats | None,
    margin: Margin | None,
    box: Floats | None,
    period: Floats | None,
    setup: Setup,
    radii: Floats | None,
    links: Indices,
    tags: Indices,
    mesh: Mesh,
    members: Indices,
    occupancy: Indices,
    at_wall: Flags,
    near: Indices,
    counts: Integers,
) -> bool:
    """Take ball i into the next cell and look at the far side; false if there is no room in it."""
    sideways, upwards = crossing_delays(i, now, balls, period, links, mesh)
    across = sideways <= upwards
    old = links[CELL, i]
    column, row = column_of(mesh, old), row_of(mesh, old)
    w = balls[U, i] if across else balls[V, i]
    step = 1 if w > 0.0 else -1
    right, up = (step, 0) if across else (0, step)
    column, row = column + right, row + up
    if period is not None:
        column += mesh.columns if column < 0 else 0
        column -= mesh.columns if column >= mesh.columns else 0
        row += mesh.rows if row < 0 else 0
        row -= mesh.rows if row >= mesh.rows else 0
    new = cell_at(mesh, column, row)
    if occupancy[new] == members.shape[1]:
        return False
    put_out(i, links, members, occupancy)
    put_into(i, new, links, members, occupancy)
    side = mesh.width if across else mesh.height
    balls[CROSSING_TIME, i] = now + min(side / abs(w), upwards if across else sideways)
    delay, whom = balls[CONTACT_TIME, i] - now, NOBODY
    better = False
    if at_wall[new]:
        wall, known = time_at_wall(
            i, now, False, balls, container, margin, box, setup, radii, links
        )
        if wall < delay:
            delay, whom, better = wall, NOBODY if known else LOOK_AGAIN, True
    found = 0
    for along in range(-1, 2):
        found = collect(
            near,
            found,
            column + (right if across else along),
            row + (along if across else up),
            mesh,
            members,
            occupancy,
            period,
        )
    apart = parted_from(i, now, balls, period, tags)
    sooner, partner = nearest(i, now, near, found, delay, whom, apart, balls, setup, radii, period)
    counts[PREDICTIONS] += found
    if better or sooner < delay:
        enter_contact(i, now + sooner, partner, balls, links, tags)
    return True


@kernel
def fill(
    now: float,
    balls: Floats,
    period: Floats | None,
    links: Indices,
    tags: Indices,
    mesh: Mesh,
    cells: Cells,
    tree: Tree,
) -> bool:
    """Sort all balls into cells, and have each look what it does next; false if a cell is full."""
    members, occupancy = cells.members, cells.occupancy
    times, bits = tree.times, tree.bits
    occupancy[:] = 0
    for i in range(balls.shape[1]):
        age = now - balls[CLOCK, i]
        x, y = balls[X, i] + balls[U, i] * age, balls[Y, i] + balls[V, i] * age
        if period is not None:
            x, y = nearest_image(x, y, period)
        column = min(max(int((x - mesh.left) / mesh.width), 0), mesh.columns - 1)
        row = min(max(int((y - mesh.bottom) / mesh.height), 0), mesh.rows - 1)
        cell = cell_at(mesh, column, row)
        if occupancy[cell] == members.shape[1]:
            return False
        put_into(i, cell, links, members, occupancy)
        predict_crossing(i, now, balls, period, links, mesh)
        enter_contact(i, now, LOOK, balls, links, tags)
        enqueue(i, now, balls, times, bits)
    return True


@kernel
def advance(
    balls: Floats,
    container: Floats | None,
    margin: Margin | None,
    box: Floats | None,
    period: Floats | None,
    setup: Setup,
    radii: Floats | None,
    masses: Floats | None,
    links: Indices,
    tags: Indices,
    mesh: Mesh,
    cells: Cells,
    near: Indices,
    tree: Tree,
    labels: Indices,
    sums: Floats,
    counts: Integers,
    recorded: Recorded,
    grid: Grid,
    room: int,
) -> int:
    """Simulate at most ``room`` events; why it stopped. Ties go by time and ball."""
    number = balls.shape[1]
    members, occupancy, at_wall = cells.members, cells.occupancy, cells.at_wall
    times, bits = tree.times, tree.bits
    crossings = filled = 0
    large, chains = number >= LARGE, no_chains(bits)
    event_time, event_i, event_j = recorded.time, recorded.i, recorded.j
    event_impulse, step, used = recorded.impulse, grid.step, grid.used
    storing, labelled = len(event_time) > 0, len(labels) > 0
    traps = setup.wall_restitution < 1.0 and never_elastic(setup)
    while filled < room:
        if counts[WALL_EVENTS] + counts[PAIR_EVENTS] >= setup.collision_limit:
            return COLLISIONS
        i = first(bits)
        now = times[1]
        due = now if margin is None else min(now, margin.place[UNTIL])
        if due == NEVER:
            return NOTHING_LEFT
        if due > setup.time_limit:
            return TIME
        if due < now:
            return OUT_OF_MARGIN
        if large:
            chains = fetch_ahead(
                now,
                chains,
                balls,
                period,
                links,
                mesh,
                members,
                occupancy,
                at_wall,
                times,
                bits,
                tree.followed,
            )
        if balls[CONTACT_TIME, i] > now:
            if crossings == CROSSINGS_AT_ONCE * room:
                return FULL
            crossings += 1
            counts[CROSSINGS] += 1
            if not cross(
                i,
                now,
                balls,
                container,
                margin,
                box,
                period,
                setup,
                radii,
                links,
                tags,
                mesh,
                members,
                occupancy,
                at_wall,
                near,
                counts,
            ):
                return CELL_FULL
            enqueue(i, now, balls, times, bits)
            continue
        j = links[PARTNER, i]
        happens = j == NOBODY or (j >= 0 and links[PARTNER_COUNT, i] == tags[EVENTS, j])
        trapped = False
        if happens:
            if step[0] * used[0] - sums[EPOCH] < now:
                sample_until(now, grid, balls, container, setup, masses, sums, counts)
            stalls = now - sums[NOW] <= CLOCK_DIGITS * (sums[EPOCH] + now)
            counts[STALLED] = counts[STALLED] + 1 if stalls else 0
            counts[FIRST], counts[SECOND] = i, j
            sums[NOW] = now
            done = counts[WALL_EVENTS] + counts[PAIR_EVENTS]
            if setup.contact_path > 0.0 and done % number == 0:
                sums[CONTACT_LASTS] = contact_lasts(balls, container, setup, labels, sums)
            elastic = touched(i, now, balls, sums[EPOCH], sums[CONTACT_LASTS])
            move(i, now, balls)
            if period is not None:
                wrap(i, balls, period)
            tags[EVENTS, i] += 1
            if j == NOBODY:
                counts[WALL_EVENTS] += 1
                tags[FORMER, i] = NOBODY
                links[BOUNCES, i] += 1
                bounces = links[BOUNCES, i]
                if box is not None:
                    size = hit_side(i, balls, box, setup, radii, masses, elastic)
                else:
                    size = hit_wall(i, now, balls, container, setup, masses, elastic)
                    if container is not None and margin is not None:
                        push(now, container, margin, links, tags, balls, times, bits)
                    # To ask takes a look at all balls, so it is asked after 2, 4, 8 ... bounces.
                    often = bounces > 1 or setup.wall_restitution == 0.0
                    if traps and often and bounces & (bounces - 1) == 0:
                        trapped = is_trapped(
                            i, now, balls, container, setup, radii, masses, None, False, None
                        )
                add_up(sums, WALL_IMPULSE, size)
            else:
                counts[PAIR_EVENTS] += 1
                elastic = elastic or touched(j, now, balls, sums[EPOCH], sums[CONTACT_LASTS])
                move(j, now, balls)
                if period is not None:
                    wrap(j, balls, period)
                tags[EVENTS, j] += 1
                tags[FORMER, i], tags[FORMER, j] = j, i
                links[BOUNCES, i] = links[BOUNCES, j] = 0
                size = hit_pair(i, j, balls, setup, masses, period, elastic)
                add_up(sums, PAIR_VIRIAL, size * contact_distance(setup, radii, i, j))
            if storing:
                one, other = i, j
                if labelled:
                    one = labels[i]
                    other = labels[j] if j != NOBODY else NOBODY
                event_time[filled] = now
                event_i[filled] = one if j == NOBODY else min(one, other)
                event_j[filled] = NOBODY if j == NOBODY else max(one, other)
                event_impulse[filled] = size
            filled += 1
        else:
            counts[STALE] += 1
        for turn in range(2 if happens and j != NOBODY else 1):
            k = ahead(i if turn == 0 else j)
            if happens:
                predict_crossing(k, now, balls, period, links, mesh)
            predict(
                k,
                now,
                j == LOOK_AGAIN,
                balls,
                container,
                margin,
                box,
                period,
                setup,
                radii,
                links,
                tags,
                mesh,
                members,
                occupancy,
                at_wall,
                near,
                counts,
            )
            enqueue(k, now, balls, times, bits)
        if trapped or counts[STALLED] > STALL_LIMIT * number:
            if counts[WALL_EVENTS] + counts[PAIR_EVENTS] >= setup.collision_limit:
                return COLLISIONS
            if labelled:
                counts[FIRST] = labels[i]
                counts[SECOND] = labels[j] if j != NOBODY else NOBODY
            return WALL_TRAP if trapped else COLLAPSE
    return FULL
