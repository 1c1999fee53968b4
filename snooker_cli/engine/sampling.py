"""Observables on a grid of times that doubles its step when it is full.

The end of a run that is limited by its collisions is not known beforehand. So the grid starts fine
and, when its rows are used up, drops every second one. Its step is a power of two of seconds, so
every time on it is exact.

A gas that cools does most of it early: by Haff's law as much from 1 s to 2 s as from 1000 s to
2000 s. So rows of the beginning are not dropped but put aside. Where the grid has become coarse,
sixteen rows are left between a time and its double.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.jit import helper, inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Integers, Setup, State, U, V, mass_of
from snooker_cli.engine.sliding import SETTLES, ball_of, bounce, pressing, set_ball
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene


ROWS = 512

EARLY = 32
"""Steps from the start within which no row is dropped; a power of two."""

EARLY_ROWS = 512 * EARLY // 2
"""Rows put aside at most: by then energies, which fall as time squared, are no doubles."""

# Energies whose squares are doubles, J. Balls that collapse may have less.
LEAST_ENERGY, MOST_ENERGY = 1e-140, 1e140

# Columns of a row: those of ``trace.Series`` without the time, in order.
(
    KINETIC_ENERGY,
    CONTAINER_ENERGY,
    WALL_IMPULSE,
    PAIR_VIRIAL,
    WALL_EVENTS,
    PAIR_EVENTS,
    MEAN_SPEED,
    ENERGY_MOMENT,
    COLUMNS,
) = range(9)


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
    return Grid(
        rows=np.zeros((rows, COLUMNS)),
        histogram=np.zeros((rows, SPEED_BINS), dtype=np.int64),
        step=np.array([step]),
        used=np.zeros(1, dtype=np.int64),
        early=np.zeros(1, dtype=np.int64),
        times=np.zeros(early_rows),
    )


def times_and_rows(grid: Grid) -> tuple[Floats, NDArray[np.intp]]:
    """Times of the filled rows, s, ascending, and their indices."""
    used, early = int(grid.used[0]), int(grid.early[0])
    times = np.append(np.arange(used, dtype=np.float64) * grid.step[0], grid.times[:early])
    rows = np.append(np.arange(used), ROWS + 1 + np.arange(early))
    order = np.argsort(times)
    return times[order], rows[order]


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


@inlined
def count_speeds(histogram: Integers, energy: float, state: State) -> None:
    """Count the balls by reduced speed v sqrt(m / 2T), with T their mean energy."""
    balls, setup, masses = state.balls, state.setup, state.masses
    number = balls.shape[1]
    for speed in range(SPEED_BINS):
        histogram[speed] = 0
    if energy > 0.0:
        for i in range(number):
            reduced = math.sqrt(energy_of(i, balls, setup, masses) * number / energy)
            histogram[min(int(reduced / SPEED_BIN), SPEED_BINS - 1)] += 1


@kernel
def sample(
    row: Floats,
    histogram: Integers,
    time: float,
    state: State,
    container: Floats | None,
    slides: Integers | None,
) -> None:
    """``measure``, and count the balls by reduced speed."""
    measure(row, time, state, container, slides)
    count_speeds(histogram, row[KINETIC_ENERGY], state)


@helper
def sample_slides(k: int, time: float, grid: Grid, state: State, slides: Integers) -> None:
    """``sample`` with what balls press at a time (s), and after their bounces up to it."""
    balls, sums, scratch = state.balls, state.sums, state.scratch
    impulse = sums[ks.WALL_IMPULSE]
    sums[ks.WALL_IMPULSE] += pressing(time, state, slides)
    for i in range(balls.shape[1]):
        if slides[i] == SETTLES:
            set_ball(i, ball_of(i, balls), scratch)
            sums[ks.WALL_IMPULSE] += bounce(i, time, state)
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
