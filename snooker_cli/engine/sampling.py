"""Observables on a grid of times that doubles its step when it is full.

The end of a run that is limited by its collisions is not known beforehand. So the grid starts fine
and, when its rows are used up, drops every second one. Its step is a power of two of seconds, so
every time on it is exact. A gas cools most at the beginning, whose rows are put aside instead of
dropped: sixteen are left between a time and its double.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.jit import helper, inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Integers, Setup, State, U, V, mass_of
from snooker_cli.engine.sliding import SETTLES, ball_of, bounced, pressing, set_ball
from snooker_cli.trace import SPEED_BIN, SPEED_BINS, Series, Summary

if TYPE_CHECKING:
    from snooker_cli.scene import Scene


ROWS = 512

EARLY = 32
"""Steps from the start within which no row is dropped; a power of two."""

EARLY_ROWS = 512 * EARLY // 2
"""Rows put aside at most: by then energies, which fall as time squared, are no doubles."""

# Energies whose squares are doubles, J. Balls that collapse may have less.
LEAST_ENERGY, MOST_ENERGY = 1e-140, 1e140

# Columns of a row: those of ``trace.Series`` without the time, in order.
KINETIC_ENERGY, CONTAINER_ENERGY, WALL_IMPULSE, PAIR_VIRIAL = range(4)
WALL_EVENTS, PAIR_EVENTS, MEAN_SPEED, ENERGY_MOMENT, COLUMNS = range(4, 9)


class Grid(NamedTuple):
    """Rows at times 0, step, 2 step …, and behind them those put aside, with times of their own.

    rows : (ROWS + 1 + EARLY_ROWS, COLUMNS)
    histogram : (ROWS + 1 + EARLY_ROWS, SPEED_BINS), balls by reduced speed
    step : (1,), s
    used : (1,), number of filled rows; the last is at time (used - 1) step
    early : (1,), number of rows put aside
    times : (EARLY_ROWS,), s, of the rows put aside
    """

    rows: Floats
    histogram: Integers
    step: Floats
    used: Integers
    early: Integers
    times: Floats


def no_grid() -> Grid:
    """A grid without rows, for runs that record events."""
    return _grid(0, 0, math.inf)._replace(used=np.ones(1, dtype=np.int64))


def new_grid(scene: Scene) -> Grid:
    """An empty grid that starts with a 1024th of the time to cross half the container, or less."""
    speed = max(math.hypot(*velocity) for velocity in scene.velocities.tolist())
    crossing = min(scene.container.size) / 2 / speed if speed > 0.0 else 1.0
    step = math.ldexp(1.0, math.frexp(crossing)[1] - 11)
    return _grid(ROWS + 1 + EARLY_ROWS, EARLY_ROWS, step)


def _grid(rows: int, early_rows: int, step: float) -> Grid:
    used, early = np.zeros((2, 1), dtype=np.int64)
    columns = np.zeros((rows, COLUMNS))
    histogram = np.zeros((rows, SPEED_BINS), dtype=np.int64)
    return Grid(columns, histogram, np.array([step]), used, early, np.zeros(early_rows))


@helper
def copy_row(one: int, other: int, grid: Grid) -> None:
    """Write one row into another."""
    # Number by number: whole rows take seconds to compile.
    for column in range(COLUMNS):
        grid.rows[other, column] = grid.rows[one, column]
    for speed in range(SPEED_BINS):
        grid.histogram[other, speed] = grid.histogram[one, speed]


@helper
def halve(grid: Grid) -> None:
    """Put every second row aside, if it is early, or drop it, and double the step."""
    kept = (grid.used[0] + 1) // 2
    for k in range(1, EARLY, 2):
        if grid.early[0] < len(grid.times):
            copy_row(k, ROWS + 1 + grid.early[0], grid)
            grid.times[grid.early[0]] = k * grid.step[0]
            grid.early[0] += 1
    for k in range(1, kept):
        copy_row(2 * k, k, grid)
    grid.used[0] = kept
    grid.step[0] *= 2.0


@inlined
def energy_of(i: int, balls: Floats, setup: Setup, masses: Floats | None) -> float:
    """Kinetic energy of ball i, J."""
    u, v = balls[U, i], balls[V, i]
    return float(0.5 * mass_of(i, setup, masses) * (u * u + v * v))


@helper
def measure(
    row: Floats, time: float, state: State, container: Floats | None, slides: Integers | None
) -> None:
    """Write the observables into a row, when clocks are at a time (s) after the last event."""
    balls, setup, masses = state.balls, state.setup, state.masses
    sums, number = state.sums, balls.shape[1]
    energy, squares, speeds = 0.0, 0.0, 0.0
    for i in range(number):
        one = energy_of(i, balls, setup, masses)
        energy += one
        squares += one * one
        speeds += math.sqrt(balls[U, i] * balls[U, i] + balls[V, i] * balls[V, i])
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
    histogram: Integers,
    time: float,
    state: State,
    container: Floats | None,
    slides: Integers | None,
) -> None:
    """``measure``, and count the balls by reduced speed v sqrt(m / 2T), T their mean energy."""
    measure(row, time, state, container, slides)
    energy, number = row[KINETIC_ENERGY], state.balls.shape[1]
    for speed in range(SPEED_BINS):
        histogram[speed] = 0
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
def sample_until(now: float, grid: Grid, state: State, slides: Integers | None) -> None:
    """Fill the rows whose time is before clocks show ``now``: no velocity has changed since."""
    while next_sample(grid, state.sums) < now:
        k = grid.used[0]
        if k > ROWS:
            halve(grid)
            continue
        if slides is None:
            sample(grid.rows[k], grid.histogram[k], 0.0, state, state.container, None)
        else:
            sample_slides(k, next_sample(grid, state.sums), grid, state, slides)
        grid.used[0] += 1


def summary(now: float, time: float, grid: Grid, state: State) -> Summary:
    """The rows of a grid before clocks show ``now``, at a time (s), and one more at it."""
    sample_until(now, grid, state, state.slides)
    used, early = int(grid.used[0]), int(grid.early[0])
    times = np.append(np.arange(used) * grid.step[0], grid.times[:early])
    rows = np.append(np.arange(used), ROWS + 1 + np.arange(early))[np.argsort(times)]
    row, histogram = np.zeros(COLUMNS), np.zeros(SPEED_BINS, dtype=np.int64)
    sample(row, histogram, now, state, state.container, state.slides)
    columns = np.ascontiguousarray(np.vstack([grid.rows[rows], row]).T)
    return Summary(
        series=Series(np.append(np.sort(times), time), *columns),
        speed_histogram=np.vstack([grid.histogram[rows], histogram]),
    )
