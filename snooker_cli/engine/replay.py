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
from snooker_cli.engine.collide import (
    contact_lasts,
    hit_pair,
    hit_side,
    hit_wall,
    move,
    touched,
    wrap,
)
from snooker_cli.engine.compiling import compiled
from snooker_cli.engine.layout import (
    CLOCK,
    NOBODY,
    SLIDE,
    Floats,
    Integers,
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
    slides_of,
    unlike,
)
from snooker_cli.engine.slide import FLIES, pressing, slide_on, write_states
from snooker_cli.trace import Series

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
        slides_of(scene),
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
    slides = slides_of(scene)
    # What slides presses until the end, though there is no event.
    rows = np.zeros((len(kept) + (slides is not None), sampling.COLUMNS))
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
        slides,
        events.time,
        events.i,
        events.j,
        kept,
        trace.stop.time,
        rows,
    )
    at_wall = events.at_wall
    reach = scene.radii[events.i] + np.where(at_wall, 0.0, scene.radii[np.maximum(events.j, 0)])
    for column, increments in (
        (sampling.WALL_IMPULSE, np.where(at_wall, events.impulse, 0.0)),
        (sampling.PAIR_VIRIAL, np.where(at_wall, 0.0, events.impulse * reach)),
        (sampling.WALL_EVENTS, at_wall),
        (sampling.PAIR_EVENTS, ~at_wall),
    ):
        sums = np.append(0.0, np.cumsum(increments))[kept]
        rows[: len(kept), column] += sums
        rows[len(kept) :, column] += sums[-1]
    time = np.concatenate([[0.0], events.time])[kept]
    if slides is not None:
        time = np.append(time, trace.stop.time)
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
    slides: Integers | None,
    time: Floats,
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    kept: NDArray[np.int64],
    end: float,
    rows: Floats,
) -> None:
    """Carry out the collisions again, measuring at the start and after those that are kept."""
    sampling.measure(rows[0], balls, container, setup, masses)
    row = 1
    lasts, in_order = 0.0, np.empty(0, dtype=np.int32)
    for event in range(len(time)):
        if setup.contact_path > 0.0 and event % balls.shape[1] == 0:
            lasts = contact_lasts(balls, container, setup, in_order)
        _collide(
            time[event],
            first[event],
            second[event],
            lasts,
            balls,
            container,
            setup,
            masses,
            box,
            period,
            radii,
            slides,
        )
        if kept[row] == event + 1:
            sampling.measure(rows[row], balls, container, setup, masses)
            if slides is not None:
                rows[row, sampling.WALL_IMPULSE] = pressing(
                    time[event], balls, setup, masses, slides
                )
            row += 1
    if slides is not None:
        sampling.measure(rows[row], balls, container, setup, masses)
        rows[row, sampling.WALL_IMPULSE] = pressing(end, balls, setup, masses, slides)


@compiled
def _collide(
    now: float,
    i: int,
    j: int,
    lasts: float,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    box: Floats | None,
    period: Floats | None,
    radii: Floats | None,
    slides: Integers | None,
) -> None:
    """Carry out one collision again, where contacts last so long (s)."""
    if slides is not None:
        if j == SLIDE:
            slide_on(i, now, balls, setup, radii, masses, slides)
            return
        slides[i] = FLIES
        if j != NOBODY:
            slides[j] = FLIES
    elastic = touched(i, now, balls, lasts)
    move(i, now, balls)
    if period is not None:
        wrap(i, balls, period)
    if j == NOBODY:
        if box is not None:
            hit_side(i, balls, box, setup, radii, masses, elastic)
        else:
            hit_wall(i, now, balls, container, setup, masses, elastic)
    else:
        elastic = elastic or touched(j, now, balls, lasts)
        move(j, now, balls)
        if period is not None:
            wrap(j, balls, period)
        hit_pair(i, j, balls, setup, masses, period, elastic)


@compiled
def _replay(
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    box: Floats | None,
    period: Floats | None,
    radii: Floats | None,
    slides: Integers | None,
    time: Floats,
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    wanted: Floats,
    out: Floats,
    container_out: Floats,
) -> None:
    """Carry out the collisions again, writing the states that are wanted on the way."""
    k = 0
    lasts, in_order = 0.0, np.empty(0, dtype=np.int32)
    for event in range(len(time) + 1):
        while k < len(wanted) and (event == len(time) or wanted[k] < time[event]):
            ages = wanted[k] - balls[CLOCK]
            out[k, 0] = balls[X] + balls[U] * ages
            out[k, 1] = balls[Y] + balls[V] * ages
            out[k, 2] = balls[U]
            out[k, 3] = balls[V]
            if slides is not None:
                begins = event < len(time) and second[event] == SLIDE
                who = first[event] if begins else NOBODY
                write_states(wanted[k], who, balls, setup, masses, slides, out[k])
            if container is not None:
                age = wanted[k] - container[CLOCK]
                container_out[k, 0] = container[X] + container[U] * age
                container_out[k, 1] = container[Y] + container[V] * age
                container_out[k, 2] = container[U]
                container_out[k, 3] = container[V]
            k += 1
        if event < len(time):
            if setup.contact_path > 0.0 and event % balls.shape[1] == 0:
                lasts = contact_lasts(balls, container, setup, in_order)
            _collide(
                time[event],
                first[event],
                second[event],
                lasts,
                balls,
                container,
                setup,
                masses,
                box,
                period,
                radii,
                slides,
            )
