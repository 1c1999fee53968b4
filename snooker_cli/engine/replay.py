"""A trace's start and its list of collisions -> the state at any time, in the engine's bits.

Only who collided and when is needed: each collision is carried out again by the arithmetic that
the engine itself uses, on balls that move only in their own events.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine import sampling
from snooker_cli.engine.collide import hit_pair, hit_side, hit_wall, move, wrap
from snooker_cli.engine.compiling import compiled
from snooker_cli.engine.layout import (
    CLOCK,
    NOBODY,
    Floats,
    Setup,
    U,
    V,
    X,
    Y,
    balls_of,
    container_of,
    half_sides_of,
    origin_of,
    period_of,
    unlike,
)
from snooker_cli.trace import CONTAINER, Series

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from snooker_cli.trace import Trace


@dataclass(frozen=True)
class States:
    """Positions and velocities of everything at given times.

    time : (*t*,) s
    positions, velocities : (*t*, *N*, 2), m and m/s
    container_positions, container_velocities : (*t*, 2), m and m/s
    """

    time: NDArray[np.float64]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    container_positions: NDArray[np.float64]
    container_velocities: NDArray[np.float64]


def replay(trace: Trace, times: ArrayLike) -> States:
    """The states at ``times`` (s, ascending); at the time of a collision, just after it.

    Raises ``ValueError`` if the trace has no events, or for times that are not ascending within
    0 and the trace's end.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no events to replay")
    wanted = np.asarray(times, dtype=np.float64)
    inside = np.all((wanted >= 0) & (wanted <= trace.stop.time))  # false for nan
    if not inside or np.any(np.diff(wanted) < 0):
        raise ValueError(f"times must ascend within 0 and {trace.stop.time!r} s")
    scene = trace.start
    origin = origin_of(scene)
    out = np.empty((len(wanted), 4, scene.number))
    container_out = np.zeros((len(wanted), 4))
    radii, masses = unlike(scene)
    _replay(
        balls_of(scene),
        container_of(scene),
        Setup.of(scene),
        masses,
        half_sides_of(scene),
        period_of(scene),
        radii,
        trace.events.time,
        trace.events.i,
        trace.events.j,
        wanted,
        out,
        container_out,
    )
    positions = out[:, :2].transpose(0, 2, 1)
    period = period_of(scene)
    if period is not None:
        positions = positions - period * np.rint(positions / period)
    return States(
        time=wanted,
        positions=positions + origin,
        velocities=out[:, 2:].transpose(0, 2, 1),
        container_positions=container_out[:, :2] + origin,
        container_velocities=container_out[:, 2:],
    )


def series(trace: Trace, most: int | None = None) -> Series:
    """The observables at time zero and after each collision; a summary's on its grid.

    Of more than ``most`` rows (at least 2) so many are kept, evenly, with the first and the last.
    Energies and speeds are read off the replayed velocities, not summed from losses.
    """
    if trace.summary is not None:
        return trace.summary.series
    if trace.events is None:
        raise ValueError("this repeat has neither events nor a summary")
    scene, events = trace.start, trace.events
    count = len(events) + 1
    kept = np.linspace(0, count - 1, min(count, most or count)).round().astype(np.int64)
    rows = np.zeros((len(kept), sampling.COLUMNS))
    balls, (radii, masses) = balls_of(scene), unlike(scene)
    container, setup = container_of(scene), Setup.of(scene)
    _replay_observables(
        balls,
        container,
        setup,
        masses,
        half_sides_of(scene),
        period_of(scene),
        radii,
        events.time,
        events.i,
        events.j,
        kept,
        rows,
    )
    at_wall = events.j == CONTAINER
    reach = scene.radii[events.i] + np.where(at_wall, 0.0, scene.radii[events.j])
    for column, increments in (
        (sampling.WALL_IMPULSE, np.where(at_wall, events.impulse, 0.0)),
        (sampling.PAIR_VIRIAL, np.where(at_wall, 0.0, events.impulse * reach)),
        (sampling.WALL_EVENTS, at_wall),
        (sampling.PAIR_EVENTS, ~at_wall),
    ):
        rows[1:, column] = np.cumsum(increments)[kept[1:] - 1]
    time = np.concatenate([[0.0], events.time])[kept]
    return Series(time, *np.ascontiguousarray(rows.T))


@compiled
def _replay_observables(
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    box: Floats | None,
    period: Floats | None,
    radii: Floats | None,
    time: Floats,
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    kept: NDArray[np.int64],
    rows: Floats,
) -> None:
    """Carry out the collisions again, measuring at the start and after those that are kept."""
    sampling.measure(rows[0], balls, container, setup, masses)
    row = 1
    for event in range(len(time)):
        _collide(
            time[event],
            first[event],
            second[event],
            balls,
            container,
            setup,
            masses,
            box,
            period,
            radii,
        )
        if kept[row] == event + 1:
            sampling.measure(rows[row], balls, container, setup, masses)
            row += 1


@compiled
def _collide(
    now: float,
    i: int,
    j: int,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    box: Floats | None,
    period: Floats | None,
    radii: Floats | None,
) -> None:
    """Carry out one collision again."""
    move(i, now, balls)
    if period is not None:
        wrap(i, balls, period)
    if j == NOBODY:
        if box is not None:
            hit_side(i, balls, box, setup, radii, masses)
        else:
            hit_wall(i, now, balls, container, setup, masses)
    else:
        move(j, now, balls)
        if period is not None:
            wrap(j, balls, period)
        hit_pair(i, j, balls, setup, masses, period)


@compiled
def _replay(
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    box: Floats | None,
    period: Floats | None,
    radii: Floats | None,
    time: Floats,
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    wanted: Floats,
    out: Floats,
    container_out: Floats,
) -> None:
    """Carry out the collisions again, writing the states that are wanted on the way."""
    k = 0
    for event in range(len(time) + 1):
        while k < len(wanted) and (event == len(time) or wanted[k] < time[event]):
            ages = wanted[k] - balls[CLOCK]
            out[k, 0] = balls[X] + balls[U] * ages
            out[k, 1] = balls[Y] + balls[V] * ages
            out[k, 2] = balls[U]
            out[k, 3] = balls[V]
            if container is not None:
                age = wanted[k] - container[CLOCK]
                container_out[k, 0] = container[X] + container[U] * age
                container_out[k, 1] = container[Y] + container[V] * age
                container_out[k, 2] = container[U]
                container_out[k, 3] = container[V]
            k += 1
        if event < len(time):
            _collide(
                time[event],
                first[event],
                second[event],
                balls,
                container,
                setup,
                masses,
                box,
                period,
                radii,
            )
