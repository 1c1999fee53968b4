"""Observables on a grid of times that doubles its step when it is full.

The end of a run that is limited by its collisions is not known beforehand: the grid starts fine
and, when its rows are used up, drops every second one. Its step is a power of two of seconds, so
that every time on it is exact.

A gas that cools does most of it early, by Haff's law as much from 1 s to 2 s as from 1000 s to
2000 s. Therefore rows of the beginning are not dropped but put aside: where the grid has become
coarse, sixteen rows are left between a time and its double.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine import kernel_state
from snooker_cli.engine.collision import mass_of
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Integers, Setup, U, V
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

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
    """Rows at times 0, step, 2 step …; the last row is filled at time (used - 1) step.

    Behind are those put aside, whose times are of their own.
    """

    rows: Floats  # (ROWS + 1 + EARLY_ROWS, COLUMNS)
    histogram: NDArray[np.int64]  # (ROWS + 1 + EARLY_ROWS, SPEED_BINS)
    step: Floats  # one element, s
    used: NDArray[np.int64]  # one element
    early: NDArray[np.int64]  # one element, how many are put aside
    times: Floats  # (EARLY_ROWS,), when those were, s


def no_grid() -> Grid:
    """A grid of which no row is ever due."""
    return Grid(
        rows=np.zeros((0, COLUMNS)),
        histogram=np.zeros((0, SPEED_BINS), dtype=np.int64),
        step=np.array([math.inf]),
        used=np.ones(1, dtype=np.int64),
        early=np.zeros(1, dtype=np.int64),
        times=np.zeros(0),
    )


def new_grid(scene: Scene) -> Grid:
    """An empty grid that starts with a 1024th of the time to cross half the container, or less."""
    speed = float(np.max(np.hypot(*scene.velocities.T)))
    crossing = min(scene.container.size) / 2 / speed if speed > 0.0 else 1.0
    step = math.ldexp(1.0, math.frexp(crossing)[1] - 11)
    rows = ROWS + 1 + EARLY_ROWS
    return Grid(
        rows=np.zeros((rows, COLUMNS)),
        histogram=np.zeros((rows, SPEED_BINS), dtype=np.int64),
        step=np.array([step]),
        used=np.zeros(1, dtype=np.int64),
        early=np.zeros(1, dtype=np.int64),
        times=np.zeros(EARLY_ROWS),
    )


def times_and_rows(grid: Grid) -> tuple[Floats, NDArray[np.intp]]:
    """When there are rows, s, ascending, and which they are."""
    used, early = int(grid.used[0]), int(grid.early[0])
    times = np.append(np.arange(used, dtype=np.float64) * grid.step[0], grid.times[:early])
    rows = np.append(np.arange(used), ROWS + 1 + np.arange(early))
    order = np.argsort(times)
    return times[order], rows[order]


@inlined
def copy_row(one: int, other: int, grid: Grid) -> None:
    """Write one row into another."""
    # Number by number: what numba makes of whole rows takes seconds to compile.
    for column in range(COLUMNS):
        grid.rows[other, column] = grid.rows[one, column]
    for speed in range(SPEED_BINS):
        grid.histogram[other, speed] = grid.histogram[one, speed]


@inlined
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


@kernel
def measure(
    row: Floats,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
) -> None:
    """Write into a row what can be read off the velocities."""
    number = balls.shape[1]
    energy, squares, speeds = 0.0, 0.0, 0.0
    for i in range(number):
        speed_squared = balls[U, i] * balls[U, i] + balls[V, i] * balls[V, i]
        one = 0.5 * mass_of(setup, masses, i) * speed_squared
        energy += one
        squares += one * one
        speeds += math.sqrt(speed_squared)
    row[KINETIC_ENERGY] = energy
    row[CONTAINER_ENERGY] = 0.0
    if container is not None:
        speed_squared = container[U] * container[U] + container[V] * container[V]
        row[CONTAINER_ENERGY] = 0.5 * setup.container_mass * speed_squared
    row[MEAN_SPEED] = speeds / number
    if energy > 0.0 and not LEAST_ENERGY < energy < MOST_ENERGY:
        squares = 0.0
        for i in range(number):
            speed_squared = balls[U, i] * balls[U, i] + balls[V, i] * balls[V, i]
            share = 0.5 * mass_of(setup, masses, i) * speed_squared / energy
            squares += share * share
        energy = 1.0
    row[ENERGY_MOMENT] = squares * number / (energy * energy) if energy > 0.0 else 0.0


@inlined
def count_speeds(
    histogram: Integers, energy: float, balls: Floats, setup: Setup, masses: Floats | None
) -> None:
    """Count the balls by reduced speed v sqrt(m / 2T), with T their mean energy."""
    number = balls.shape[1]
    for speed in range(SPEED_BINS):
        histogram[speed] = 0
    if energy > 0.0:
        for i in range(number):
            speed_squared = balls[U, i] * balls[U, i] + balls[V, i] * balls[V, i]
            m = mass_of(setup, masses, i)
            reduced = math.sqrt(0.5 * m * speed_squared * number / energy)
            histogram[min(int(reduced / SPEED_BIN), SPEED_BINS - 1)] += 1


@kernel
def sample(
    row: Floats,
    histogram: Integers,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    sums: Floats,
    counts: Integers,
) -> None:
    """Write a whole row, as things are after the last event."""
    measure(row, balls, container, setup, masses)
    count_speeds(histogram, row[KINETIC_ENERGY], balls, setup, masses)
    row[WALL_IMPULSE] = sums[kernel_state.WALL_IMPULSE] + sums[kernel_state.WALL_IMPULSE_REST]
    row[PAIR_VIRIAL] = sums[kernel_state.PAIR_VIRIAL] + sums[kernel_state.PAIR_VIRIAL_REST]
    row[WALL_EVENTS] = counts[kernel_state.WALL_EVENTS]
    row[PAIR_EVENTS] = counts[kernel_state.PAIR_EVENTS]


@kernel
def sample_until(
    now: float,
    grid: Grid,
    balls: Floats,
    container: Floats | None,
    setup: Setup,
    masses: Floats | None,
    sums: Floats,
    counts: Integers,
) -> None:
    """Fill the rows whose time is before clocks are at ``now``: no velocity has changed since."""
    while grid.used[0] * grid.step[0] - sums[kernel_state.EPOCH] < now:
        if grid.used[0] > ROWS:
            halve(grid)
            continue
        k = grid.used[0]
        sample(grid.rows[k], grid.histogram[k], balls, container, setup, masses, sums, counts)
        grid.used[0] += 1
