"""A trace's start and its list of collisions -> the state at any time, in the engine's bits.

Only who collided and when is needed: each collision is carried out again by the arithmetic that
the engine itself uses, on balls that move only in their own events.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine import clock, sampling
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
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.kernel_state import (
    CLOCK,
    CONTACT_LASTS,
    EPOCH,
    NOBODY,
    PAIR_VIRIAL,
    PAIR_VIRIAL_REST,
    SLIDE,
    WALL_IMPULSE,
    WALL_IMPULSE_REST,
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
    new_sums,
    origin_of,
    period_of,
    slides_of,
    unlike,
)
from snooker_cli.engine.prediction import contact_distance
from snooker_cli.engine.sliding import FLIES, pressing, slide_on, write_states
from snooker_cli.trace import Series

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from snooker_cli.trace import Trace


NONE_KEPT = np.zeros(0, dtype=np.int64)
NO_ROWS = np.zeros((0, sampling.COLUMNS))


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
    wanted = times_within(trace, times)
    scene, origin = trace.start, origin_of(trace.start)
    out = np.empty((len(wanted), 4, scene.number))
    container_out = np.zeros((len(wanted), 4))
    again = _Again(trace)
    done = np.searchsorted(trace.events.time, wanted, side="right")
    for k, instant in enumerate(wanted):
        again.carry_out(int(done[k]))
        again.write_state(float(instant), out[k], container_out[k])
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


def times_within(trace: Trace, times: ArrayLike) -> NDArray[np.float64]:
    """The times (s) as an array. Raises ``ValueError`` unless they ascend within 0 and the end."""
    wanted = np.asarray(times, dtype=np.float64)
    inside = np.all((wanted >= 0) & (wanted <= trace.stop.time))  # false for nan
    if not inside or np.any(np.diff(wanted) < 0):
        raise ValueError(f"times must ascend within 0 and {trace.stop.time!r} s")
    return wanted


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
    slides = scene.slides
    # What slides presses until the end, though there is no event.
    rows = np.zeros((len(kept) + slides, sampling.COLUMNS))
    again = _Again(trace)
    again.measure(rows[0], 0.0)
    again.carry_out(len(events), kept[1:], rows[1:])
    if slides:
        again.measure(rows[-1], trace.stop.time)
    for column, happened in (
        (sampling.WALL_EVENTS, events.at_wall),
        (sampling.PAIR_EVENTS, ~events.at_wall),
    ):
        number = np.append(0, np.cumsum(happened))[kept]
        rows[: len(kept), column] = number
        rows[len(kept) :, column] = number[-1]
    time = np.concatenate([[0.0], events.time])[kept]
    if slides:
        time = np.append(time, trace.stop.time)
    return Series(time, *np.ascontiguousarray(rows.T))


class _Again:
    """A trace whose collisions are being carried out again, and how far that is."""

    def __init__(self, trace: Trace) -> None:
        assert trace.events is not None
        scene = trace.start
        self.events, self.done = trace.events, 0
        self.parts = clock.parts(trace.events, scene.number)
        self.part = next(self.parts)
        self.balls, self.container = balls_of(scene), container_of(scene)
        self.setup, self.slides = Setup.of(scene), slides_of(scene)
        self.radii, self.masses = unlike(scene)
        self.box, self.period = half_sides_of(scene), period_of(scene)
        self.sums = new_sums(scene)

    def carry_out(
        self, end: int, kept: NDArray[np.int64] = NONE_KEPT, rows: Floats = NO_ROWS
    ) -> None:
        """Go on to before event ``end``, with a row after each of so many events as ``kept``."""
        while self.done < end:
            events, clocks, following, shift = self.part
            stop = min(end, events.stop)
            here = slice(self.done, stop)
            first, last = np.searchsorted(kept, [self.done, stop], side="right")
            _carry_out(
                self.balls,
                self.container,
                self.setup,
                self.masses,
                self.box,
                self.period,
                self.radii,
                self.slides,
                self.sums,
                self.done,
                clocks[self.done - events.start : stop - events.start],
                self.events.i[here],
                self.events.j[here],
                self.events.impulse[here],
                kept[first:last],
                rows[first:last],
            )
            self.done = stop
            if stop == events.stop:
                self.sums[EPOCH] = following
                self.balls[CLOCK] -= shift
                if self.container is not None:
                    self.container[CLOCK] -= shift
                self.part = next(self.parts, self.part)

    def measure(self, row: Floats, time: float) -> None:
        """Write into a row what there is at a time (s), but for numbers of events."""
        clock = time - self.sums[EPOCH]
        state = self.balls, self.container, self.setup, self.masses
        _measure(row, clock, *state, self.slides, self.sums)

    def write_state(self, time: float, out: Floats, container_out: Floats) -> None:
        """Write position and velocity of all balls and of the container at a time, s."""
        clock = time - self.sums[EPOCH]
        ages = clock - self.balls[CLOCK]
        out[:2] = self.balls[[X, Y]] + self.balls[[U, V]] * ages
        out[2:] = self.balls[[U, V]]
        if self.slides is not None:
            begins = self.done < len(self.events) and self.events.j[self.done] == SLIDE
            who = int(self.events.i[self.done]) if begins else NOBODY
            write_states(clock, who, self.balls, self.setup, self.masses, self.slides, out)
        if self.container is not None:
            velocity = self.container[[U, V]]
            container_out[:2] = self.container[[X, Y]] + velocity * (clock - self.container[CLOCK])
            container_out[2:] = velocity


@inlined
def _measure(
    row: Floats,
    clock: float,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    slides: Integers | None,
    sums: Floats,
) -> None:
    """Write into a row what there is when clocks are at a time (s), but for numbers of events."""
    sampling.measure(row, balls, container, setup, masses)
    row[sampling.WALL_IMPULSE] = sums[WALL_IMPULSE] + sums[WALL_IMPULSE_REST]
    row[sampling.PAIR_VIRIAL] = sums[PAIR_VIRIAL] + sums[PAIR_VIRIAL_REST]
    if slides is not None:
        row[sampling.WALL_IMPULSE] += pressing(clock, balls, setup, masses, slides)


@kernel
def _carry_out(
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    box: Floats | None,
    period: Floats | None,
    radii: Floats | None,
    slides: Integers | None,
    sums: Floats,
    done: int,
    clocks: Floats,
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    impulse: Floats,
    kept: NDArray[np.int64],
    rows: Floats,
) -> None:
    """Carry out collisions again when so many are done, measuring after those that are kept."""
    row = 0
    for event in range(len(clocks)):
        now, i, j = clocks[event], first[event], second[event]
        if setup.contact_path > 0.0 and (done + event) % balls.shape[1] == 0:
            sums[CONTACT_LASTS] = contact_lasts(balls, container, setup, None, sums)
        _collide(now, i, j, balls, container, setup, masses, box, period, radii, slides, sums)
        if j < 0:
            add_up(sums, WALL_IMPULSE, impulse[event])
        else:
            add_up(sums, PAIR_VIRIAL, impulse[event] * contact_distance(setup, radii, i, j))
        if row < len(kept) and kept[row] == done + event + 1:
            _measure(rows[row], now, balls, container, setup, masses, slides, sums)
            row += 1


@inlined
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
    slides: Integers | None,
    sums: Floats,
) -> None:
    """Carry out one collision again."""
    if slides is not None:
        if j == SLIDE:
            slide_on(i, now, balls, setup, radii, masses, slides)
            return
        slides[i] = FLIES
        if j != NOBODY:
            slides[j] = FLIES
    elastic = touched(i, now, balls, sums[EPOCH], sums[CONTACT_LASTS])
    move(i, now, balls)
    if period is not None:
        wrap(i, balls, period)
    if j == NOBODY:
        if box is not None:
            hit_side(i, balls, box, setup, radii, masses, elastic)
        else:
            hit_wall(i, now, balls, container, setup, masses, elastic)
    else:
        elastic = elastic or touched(j, now, balls, sums[EPOCH], sums[CONTACT_LASTS])
        move(j, now, balls)
        if period is not None:
            wrap(j, balls, period)
        hit_pair(i, j, balls, setup, masses, period, elastic)
