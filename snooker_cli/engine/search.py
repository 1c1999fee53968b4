"""Whom a ball touches next, among the balls of its own cell and of those around it.

Partners are looked at in two passes: the first, without a branch, a root or a division, leaves a
mask of the few that can be met in time, and only for those the time of contact is computed.
"""

from __future__ import annotations

from snooker_cli.engine.contact import may_touch, nearest_image, pair_delay
from snooker_cli.engine.jit import inlined, lowest_bit
from snooker_cli.engine.layout import CLOCK, Floats, Indices, Setup, U, V, X, Y, ahead
from snooker_cli.engine.mesh import Mesh, cell_at
from snooker_cli.engine.predict import BLOCK, contact_distance


@inlined
def collect(
    near: Indices,
    found: int,
    column: int,
    row: int,
    mesh: Mesh,
    members: Indices,
    occupancy: Indices,
    period: Floats | None,
) -> int:
    """Append the balls of a cell to ``near``; how many there are then.

    Four are copied whatever their number: that is cheaper than to ask.
    """
    if period is not None:
        column += mesh.columns if column < 0 else 0
        column -= mesh.columns if column >= mesh.columns else 0
        row += mesh.rows if row < 0 else 0
        row -= mesh.rows if row >= mesh.rows else 0
    cell = cell_at(mesh, column, row)
    number = int(occupancy[cell])
    found = ahead(found)
    for place in range(4):
        near[found + place] = members[cell, place]
    for place in range(4, number):
        near[found + place] = members[cell, place]
    return found + number


@inlined
def collect_around(
    near: Indices,
    column: int,
    row: int,
    mesh: Mesh,
    members: Indices,
    occupancy: Indices,
    period: Floats | None,
) -> int:
    """Put the balls of a cell and of the eight around it into ``near``; how many."""
    found = 0
    for up in range(-1, 2):
        for right in range(-1, 2):
            found = collect(near, found, column + right, row + up, mesh, members, occupancy, period)
    return found


@inlined
def nearest(
    i: int,
    now: float,
    near: Indices,
    found: int,
    horizon: float,
    whom: int,
    apart: int,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
    period: Floats | None,
) -> tuple[float, int]:
    """When ball i first touches one of ``near``, and which, if within a horizon; else those given.

    ``apart`` is a ball that it has just parted from.
    """
    age = now - balls[CLOCK, i]
    u, v = balls[U, i], balls[V, i]
    x, y = balls[X, i] + u * age, balls[Y, i] + v * age
    # As many as fill vectors: ball i, which never meets itself, makes up for what is missing.
    found = ahead(found)
    for place in range(3):
        near[found + place] = i
    found = (found + 3) & ~3
    for start in range(0, found, BLOCK):
        twice = 2.0 * horizon
        mask = 0
        for place in range(start, min(start + BLOCK, found)):
            k = near[place]
            d = contact_distance(setup, radii, i, k)
            age = now - balls[CLOCK, k]
            uk, vk = balls[U, k], balls[V, k]
            xk, yk = balls[X, k] + uk * age - x, balls[Y, k] + vk * age - y
            if period is not None:
                xk, yk = nearest_image(xk, yk, period)
            may = may_touch(xk, yk, uk - u, vk - v, d * d, twice) & (k != apart)
            mask |= int(may) << (place - start)
        while mask != 0:
            k = near[start + lowest_bit(mask)]
            mask &= mask - 1
            d = contact_distance(setup, radii, i, k)
            age = now - balls[CLOCK, k]
            uk, vk = balls[U, k], balls[V, k]
            xk, yk = balls[X, k] + uk * age - x, balls[Y, k] + vk * age - y
            if period is not None:
                xk, yk = nearest_image(xk, yk, period)
            delay = pair_delay(xk, yk, uk - u, vk - v, d * d)
            if delay < horizon:
                horizon, whom = delay, k
    return horizon, whom
