"""Observables on a grid of times that doubles its step when it is full.

Its step is a power of two of seconds, so every time on it is exact. Early rows are put aside
instead of dropped: sixteen are left between a time and its double. See docs/how-it-works.md.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.jit import helper, inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Indices, Integers, Setup, State, U, V, mass_of
from snooker_cli.engine.sliding import SETTLES, ball_of, bounced, pressing, set_ball
from snooker_cli.scene import Scene
from snooker_cli.trace import SPEED_BIN, SPEED_BINS, Series, Summary

ROWS = 512

EARLY = 32  # steps from the start within which no row is dropped; a power of two

EARLY_ROWS = 512 * EARLY // 2
"""Rows put aside at most: by then energies, which fall as time squared, are no doubles."""

# Energies whose squares are doubles, J. Balls that collapse may have less.
LEAST_ENERGY, MOST_ENERGY = 1e-140, 1e140

# Columns of a row: those of ``trace.Series`` without the time, in order.
KINETIC_ENERGY, CONTAINER_ENERGY, WALL_IMPULSE, PAIR_VIRIAL = range(4)
WALL_EVENTS, PAIR_EVENTS, MEAN_SPEED, ENERGY_MOMENT, COLUMNS = range(4, 9)


class Grid(NamedTuple):
    """Rows at times 0, step, 2 step …, and those put aside, with times of their own.

    The grids of many repeats are one grid too, with an axis of repeats: the first one, but the
    second one of the rows put aside. So all that is used of these is together in memory.

    rows : (ROWS + 1, COLUMNS)
    histogram : (ROWS + 1, SPEED_BINS), balls by reduced speed
    step : (1,), s
    used : (1,), number of filled rows; the last is at time (used - 1) step
    early : (1,), number of rows put aside
    early_times : (EARLY_ROWS,), s
    early_rows, early_histogram : (EARLY_ROWS, COLUMNS) and (EARLY_ROWS, SPEED_BINS)
    """

    rows: Floats
    histogram: Indices
    step: Floats
    used: Integers
    early: Integers
    early_times: Floats
    early_rows: Floats
    early_histogram: Indices


def new_grids(scenes: Sequence[Scene]) -> Grid:
    """Empty grids; a step is at first a 1024th of the time to cross half the container, or less."""
    repeats = len(scenes)
    grids = Grid(  # what is not used is not touched
        rows=np.zeros((repeats, ROWS + 1, COLUMNS)),
        histogram=np.zeros((repeats, ROWS + 1, SPEED_BINS), dtype=np.int32),
        step=np.empty((repeats, 1)),
        used=np.zeros((repeats, 1), dtype=np.int64),
        early=np.zeros((repeats, 1), dtype=np.int64),
        early_times=np.zeros((EARLY_ROWS, repeats)),
        early_rows=np.zeros((EARLY_ROWS, repeats, COLUMNS)),
        early_histogram=np.zeros((EARLY_ROWS, repeats, SPEED_BINS), dtype=np.int32),
    )
    for k, scene in enumerate(scenes):
        speed = max(math.hypot(*velocity) for velocity in scene.velocities.tolist())
        crossing = min(scene.container.size) / 2 / speed if speed > 0.0 else 1.0
        grids.step[k] = math.ldexp(1.0, math.frexp(crossing)[1] - 11)
    return grids


@inlined
def grid_of(grids: Any, repeat: int) -> Any:
    """The grid of a repeat, in the same memory, or ``None`` of ``None``."""
    if grids is None:
        return None
    return Grid(
        grids.rows[repeat],
        grids.histogram[repeat],
        grids.step[repeat],
        grids.used[repeat],
        grids.early[repeat],
        grids.early_times[:, repeat],
        grids.early_rows[:, repeat],
        grids.early_histogram[:, repeat],
    )


@inlined
def copy_row(row: Floats, histogram: Indices, to_row: Floats, to_histogram: Indices) -> None:
    # Number by number: whole rows take seconds to compile.
    for column in range(COLUMNS):
        to_row[column] = row[column]
    for speed in range(SPEED_BINS):
        to_histogram[speed] = histogram[speed]


@helper
def halve(grid: Grid) -> None:
    """Put every second row aside, if it is early, or drop it, and double the step."""
    rows, histogram = grid.rows, grid.histogram
    kept = (grid.used[0] + 1) // 2
    for k in range(1, EARLY, 2):
        place = grid.early[0]
        if place < len(grid.early_times):
            to_row, to_histogram = grid.early_rows[place], grid.early_histogram[place]
            copy_row(rows[k], histogram[k], to_row, to_histogram)
            grid.early_times[place] = k * grid.step[0]
            grid.early[0] += 1
    for k in range(1, kept):
        copy_row(rows[2 * k], histogram[2 * k], rows[k], histogram[k])
    grid.used[0] = kept
    grid.step[0] *= 2.0


@inlined
def energy_of(i: int, balls: Floats, setup: Setup, masses: Floats | None) -> float:
    """Kinetic energy of ball i, J."""
    u, v = balls[U, i], balls[V, i]
    return float(0.5 * mass_of(i, setup, masses) * (u * u + v * v))


@inlined
def terms_of(i: int, state: State) -> tuple[float, float, float]:
    """What ball i adds to sums over the balls: its kinetic energy (J), that squared, its speed."""
    one = energy_of(i, state.balls, state.setup, state.masses)
    u, v = state.balls[U, i], state.balls[V, i]
    return one, one * one, math.sqrt(u * u + v * v)


@helper
def totals(state: State) -> tuple[float, float, float]:
    """The sums over the balls of ``terms_of``."""
    energy, squares, speeds = 0.0, 0.0, 0.0
    for i in range(state.balls.shape[1]):
        one = terms_of(i, state)
        energy += one[0]
        squares += one[1]
        speeds += one[2]
    return energy, squares, speeds


@helper
def measure(
    row: Floats,
    sums_of_balls: tuple[float, float, float],
    time: float,
    state: State,
    container: Floats | None,
    slides: Integers | None,
) -> None:
    """Write the observables into a row, when clocks are at a time (s) after the last event.

    sums_of_balls : ``totals``
    """
    balls, setup, masses = state.balls, state.setup, state.masses
    sums, number = state.sums, balls.shape[1]
    energy, squares, speeds = sums_of_balls
    row[KINETIC_ENERGY] = energy
    row[CONTAINER_ENERGY] = 0.0
    if container is not None:
        speed_squared = container[U] * container[U] + container[V] * container[V]
        row[CONTAINER_ENERGY] = 0.5 * setup.container_mass * speed_squared
    row[MEAN_SPEED] = speeds / number
    if energy > 0.0 and not LEAST_ENERGY < energy < MOST_ENERGY:
        squares = 0.0
        for i in range(number):
            share = energy_of(i, balls, setup, masses) / energy
            squares += share * share
        energy = 1.0
    row[ENERGY_MOMENT] = squares * number / (energy * energy) if energy > 0.0 else 0.0
    row[WALL_IMPULSE] = sums[ks.WALL_IMPULSE] + sums[ks.WALL_IMPULSE_REST]
    if slides is not None:
        row[WALL_IMPULSE] += pressing(time, state, slides)
    row[PAIR_VIRIAL] = sums[ks.PAIR_VIRIAL] + sums[ks.PAIR_VIRIAL_REST]
    row[WALL_EVENTS] = state.counts[ks.WALL_EVENTS]
    row[PAIR_EVENTS] = state.counts[ks.PAIR_EVENTS]


@kernel
def sample(
    row: Floats,
    histogram: Indices,
    time: float,
    state: State,
    container: Floats | None,
    slides: Integers | None,
) -> None:
    """``measure``, and count the balls by reduced speed v sqrt(m/2T), T their mean energy."""
    measure(row, totals(state), time, state, container, slides)
    for speed in range(SPEED_BINS):
        histogram[speed] = 0
    count_speeds(row, histogram, state)


@helper
def count_speeds(row: Floats, histogram: Any, state: State) -> None:
    """Add the balls to a histogram by reduced speed; none are added at rest."""
    energy, number = row[KINETIC_ENERGY], state.balls.shape[1]
    if energy > 0.0:
        for i in range(number):
            one = energy_of(i, state.balls, state.setup, state.masses)
            histogram[min(int(math.sqrt(one * number / energy) / SPEED_BIN), SPEED_BINS - 1)] += 1


@helper
def sample_slides(k: int, time: float, grid: Grid, state: State, slides: Integers) -> None:
    """``sample`` with what balls press at a time (s), and after their bounces up to it."""
    balls, sums, scratch = state.balls, state.sums, state.scratch
    impulse = sums[ks.WALL_IMPULSE]
    sums[ks.WALL_IMPULSE] += pressing(time, state, slides)
    for i in range(balls.shape[1]):
        if slides[i] == SETTLES:
            set_ball(i, ball_of(i, balls), scratch)
            ball, bounces = bounced(i, time, state)
            set_ball(i, ball, balls)
            sums[ks.WALL_IMPULSE] += bounces
    sample(grid.rows[k], grid.histogram[k], time, state, state.container, None)
    for i in range(balls.shape[1]):
        if slides[i] == SETTLES:
            set_ball(i, ball_of(i, scratch), balls)
    sums[ks.WALL_IMPULSE] = impulse


@inlined
def next_sample(grid: Grid, sums: Floats) -> float:
    """What clocks show at the grid's next time, s."""
    return float(grid.used[0] * grid.step[0] - sums[ks.EPOCH])


@kernel
def sample_until(now: float, grid: Grid, state: State, slides: Integers | None) -> float:
    """Fill the rows whose time is before clocks show ``now``, and return the next time, s.

    No velocity has changed since the last event.
    """
    rows, histogram = grid.rows, grid.histogram
    known = False  # whether the row before is of the same velocities
    while True:
        time = next_sample(grid, state.sums)
        if time >= now:
            return time
        k = grid.used[0]
        if k > ROWS:
            halve(grid)
            continue
        if slides is not None:
            sample_slides(k, time, grid, state, slides)
        elif known:
            copy_row(rows[k - 1], histogram[k - 1], rows[k], histogram[k])
        else:
            sample(rows[k], histogram[k], 0.0, state, state.container, None)
            known = True
        grid.used[0] += 1


@kernel
def sample_to_end(
    ends: Floats,
    grids: Grid,
    states: State,
    all_slides: Integers | None,
    rows: Floats,
    histograms: Indices,
) -> None:
    """``sample_until`` the end of each repeat (s, on its clocks), and a row more at that time."""
    for repeat in range(len(ends)):
        end, state = ends[repeat], ks.state_of(states, repeat)
        slides = ks.part_of(all_slides, repeat)
        sample_until(end, grid_of(grids, repeat), state, slides)
        sample(rows[repeat], histograms[repeat], end, state, state.container, slides)


def summary(grid: Grid, time: float, row: Floats, histogram: Indices) -> Summary:
    """The rows of a grid, in order of time, and one more at a time (s)."""
    used, early = int(grid.used[0]), int(grid.early[0])
    grid_times = np.arange(used) * float(grid.step[0])
    times = np.concatenate([grid.early_times[:early], grid_times, [time]])
    rows = np.concatenate([grid.early_rows[:early], grid.rows[:used], [row]])
    balls = np.concatenate([grid.early_histogram[:early], grid.histogram[:used], [histogram]])
    order = np.argsort(times, kind="stable")
    series = Series(times[order], *np.ascontiguousarray(rows[order].T))
    return Summary(series, speed_histogram=balls[order].astype(np.int64))
