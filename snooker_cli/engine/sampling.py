"""Observables on a grid of times that doubles its step when it is full.

Its step is a power of two of seconds, so every time on it is exact. Early rows are put aside
instead of dropped: sixteen are left between a time and its double. See docs/how-it-works.md.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.frames import laboratory_velocity
from snooker_cli.engine.jit import called_by_kernels, helper, inlined
from snooker_cli.engine.kernel_state import Floats, Indices, Integers, Part, State, U, V
from snooker_cli.scene import Scene
from snooker_cli.trace import SPEED_BIN, SPEED_BINS, Summary, series_of, series_units

ROWS = 512

EARLY = 32  # steps from the start within which no row is dropped; a power of two

EARLY_ROWS = 512 * EARLY // 2
"""Rows put aside at most: by then energies, which fall as time squared, are no doubles."""

# Energies whose squares are doubles, J. Balls that collapse may have less.
LEAST_ENERGY, MOST_ENERGY = 1e-140, 1e140

# Columns of a row: those of ``trace.Series`` without the time, in order.
KINETIC_ENERGY, CONTAINER_ENERGY, WALL_IMPULSE, PAIR_VIRIAL = range(4)
WALL_EVENTS, PAIR_EVENTS, MEAN_SPEED, ENERGY_MOMENT, COLUMNS = range(4, 9)
WALL_ENERGY, LOST_ENERGY = COLUMNS, COLUMNS + 1  # if walls give energy
SPIN_ENERGY = -1  # of rough balls


@called_by_kernels
class Samples(Part):
    """What the event loop does between events for a summary: nothing without one."""

    def next_sample(self, sums: Floats) -> float:
        """What clocks show at the grid's next time, s."""
        return NEVER

    def take_samples(self, now: float, state: State) -> float:
        """``sample_until``."""
        return NEVER

    def finish(self, end: float, state: State) -> None:
        """``sample_until`` the end (s, on the clocks), and the row at that time."""


class NoSamples(Samples, NamedTuple("NoSamples", [("rows", None)])):
    """Of repeats whose events are recorded: their kernel has no code for summaries."""


class Grid(
    Samples,
    NamedTuple(
        "Grid",
        [
            ("rows", Floats),
            ("histogram", Indices),
            ("step", Floats),
            ("used", Integers),
            ("early", Integers),
            ("early_times", Floats),
            ("early_rows", Floats),
            ("early_histogram", Indices),
            ("last", Floats),
            ("last_histogram", Indices),
        ],
    ),
):
    """Rows at times 0, step, 2 step …, and those put aside, with times of their own.

    The grids of many repeats are one grid too, with an axis of repeats: the first one, but the
    second one of the rows put aside. So all that is used of these is together in memory.

    rows : (ROWS + 1, `columns_of`)
    histogram : (ROWS + 1, SPEED_BINS), balls by reduced speed
    step : (1,), s
    used : (1,), number of filled rows; the last is at time (used - 1) step
    early : (1,), number of rows put aside
    early_times : (EARLY_ROWS,), s
    early_rows, early_histogram : (EARLY_ROWS, `columns_of`) and (EARLY_ROWS, SPEED_BINS)
    last, last_histogram : (`columns_of`,) and (SPEED_BINS,), the row at the end
    """

    def of_repeat(self, repeat: int) -> "Grid":
        return Grid(
            self.rows[repeat],
            self.histogram[repeat],
            self.step[repeat],
            self.used[repeat],
            self.early[repeat],
            self.early_times[:, repeat],
            self.early_rows[:, repeat],
            self.early_histogram[:, repeat],
            self.last[repeat],
            self.last_histogram[repeat],
        )

    def next_sample(self, sums: Floats) -> float:
        return float(self.used[0] * self.step[0] - sums[ks.EPOCH])

    def take_samples(self, now: float, state: State) -> float:
        return sample_until(now, self, state)

    def finish(self, end: float, state: State) -> None:
        sample_until(end, self, state)
        sample(self.last, self.last_histogram, state.boundary.pressing(end, state), state)


def columns_of(scene: Scene) -> int:
    """Number of columns of a row."""
    return len(series_units(scene)) - 1


def new_grids(scenes: Sequence[Scene]) -> Grid:
    """Empty grids; a step is at first a 1024th of the time to cross half the container, or less."""
    repeats, columns = len(scenes), columns_of(scenes[0])
    rows, early = ROWS + 1, EARLY_ROWS
    grids = Grid(  # what is not used is not touched
        rows=np.zeros((repeats, rows, columns)),
        histogram=np.zeros((repeats, rows, SPEED_BINS), dtype=np.int32),
        step=np.ones((repeats, 1)),
        used=np.zeros((repeats, 1), dtype=np.int64),
        early=np.zeros((repeats, 1), dtype=np.int64),
        early_times=np.zeros((early, repeats)),
        early_rows=np.zeros((early, repeats, columns)),
        early_histogram=np.zeros((early, repeats, SPEED_BINS), dtype=np.int32),
        last=np.zeros((repeats, columns)),
        last_histogram=np.zeros((repeats, SPEED_BINS), dtype=np.int32),
    )
    for k, scene in enumerate(scenes):
        speed = max(math.hypot(*velocity) for velocity in scene.velocities.tolist())
        crossing = min(scene.container.size) / 2 / speed if speed > 0.0 else 1.0
        grids.step[k] = math.ldexp(1.0, math.frexp(crossing)[1] - 11)
    return grids


@inlined
def copy_row(row: Floats, histogram: Indices, to_row: Floats, to_histogram: Indices) -> None:
    # Number by number: whole rows take seconds to compile.
    for column in range(len(row)):
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


# Rows


@inlined
def energy_of(i: int, state: State) -> float:
    """Kinetic energy of ball i, J."""
    u, v = laboratory_velocity(state.balls[U, i], state.balls[V, i], state)
    return float(0.5 * state.sizes.mass_of(i) * (u * u + v * v))


@inlined
def terms_of(i: int, state: State) -> tuple[float, float, float]:
    """What ball i adds to sums over the balls: its kinetic energy (J), that squared, its speed."""
    kinetic = energy_of(i, state)
    u, v = laboratory_velocity(state.balls[U, i], state.balls[V, i], state)
    return kinetic, kinetic * kinetic, math.sqrt(u * u + v * v)


@helper
def totals(state: State) -> tuple[float, float, float]:
    """The sums over the balls of ``terms_of``."""
    kinetic, squares, speeds = 0.0, 0.0, 0.0
    for i in range(state.balls.shape[1]):
        terms = terms_of(i, state)
        kinetic += terms[0]
        squares += terms[1]
        speeds += terms[2]
    return kinetic, squares, speeds


@helper
def measure(
    row: Floats, sums_of_balls: tuple[float, float, float], pressed: float, state: State
) -> None:
    """Write the observables into a row.

    sums_of_balls : ``totals``
    pressed : the impulse of balls that slide since their last events, kg m/s
    """
    sums, number = state.sums, state.balls.shape[1]
    kinetic, squares, speeds = sums_of_balls
    row[KINETIC_ENERGY] = kinetic
    row[CONTAINER_ENERGY] = state.boundary.energy(state)
    row[MEAN_SPEED] = speeds / number
    if kinetic > 0.0 and not LEAST_ENERGY < kinetic < MOST_ENERGY:
        squares = 0.0
        for i in range(number):
            share = energy_of(i, state) / kinetic
            squares += share * share
        kinetic = 1.0
    row[ENERGY_MOMENT] = squares * number / (kinetic * kinetic) if kinetic > 0.0 else 0.0
    row[WALL_IMPULSE] = sums[ks.WALL_IMPULSE] + sums[ks.WALL_IMPULSE_REST] + pressed
    row[PAIR_VIRIAL] = sums[ks.PAIR_VIRIAL] + sums[ks.PAIR_VIRIAL_REST]
    row[WALL_EVENTS] = state.counts[ks.WALL_EVENTS]
    row[PAIR_EVENTS] = state.counts[ks.PAIR_EVENTS]
    if len(state.account) > 0:
        for which in range(2):
            row[WALL_ENERGY + which] = state.account[which] + state.account[which + ks.ACCOUNT_REST]
    state.surface.measure_spins(row, state)


@helper
def sample(row: Floats, histogram: Indices, pressed: float, state: State) -> None:
    """``measure``, and count the balls by reduced speed v sqrt(m/2T), T their mean energy."""
    measure(row, totals(state), pressed, state)
    for speed in range(SPEED_BINS):
        histogram[speed] = 0
    count_speeds(row, histogram, state)


@helper
def count_speeds(row: Floats, histogram: Any, state: State) -> None:
    """Add the balls to a histogram by reduced speed; none are added at rest."""
    kinetic, number = row[KINETIC_ENERGY], state.balls.shape[1]
    if kinetic > 0.0:
        for i in range(number):
            reduced = math.sqrt(energy_of(i, state) * number / kinetic)
            histogram[min(int(reduced / SPEED_BIN), SPEED_BINS - 1)] += 1


@helper
def sample_until(now: float, grid: Grid, state: State) -> float:
    """Fill the rows whose time is before clocks show ``now``, and return the next time, s.

    No velocity has changed since the last event, but those of balls that slide or settle.
    """
    rows, histogram, sums, boundary = grid.rows, grid.histogram, state.sums, state.boundary
    known = False  # whether the row before is of the same velocities
    while True:
        time = grid.next_sample(sums)
        if time >= now:
            return time
        k = grid.used[0]
        if k > ROWS:
            halve(grid)
            continue
        if known and not boundary.is_curved():
            copy_row(rows[k - 1], histogram[k - 1], rows[k], histogram[k])
        else:
            impulse = sums[ks.WALL_IMPULSE]
            sums[ks.WALL_IMPULSE] += boundary.pressing(time, state)
            boundary.bounce_on(time, state)
            sample(rows[k], histogram[k], 0.0, state)
            boundary.bounce_back(state)
            sums[ks.WALL_IMPULSE] = impulse
            known = True
        grid.used[0] += 1


def summary(scene: Scene, grid: Grid, time: float) -> Summary:
    """The rows of a scene's finished grid, in order of time, and the last at a time (s)."""
    used, early = int(grid.used[0]), int(grid.early[0])
    grid_times = np.arange(used) * float(grid.step[0])
    times = np.concatenate([grid.early_times[:early], grid_times, [time]])
    rows = np.concatenate([grid.early_rows[:early], grid.rows[:used], [grid.last]])
    balls = np.concatenate(
        [grid.early_histogram[:early], grid.histogram[:used], [grid.last_histogram]]
    )
    order = np.argsort(times, kind="stable")
    series = series_of(scene, times[order], np.ascontiguousarray(rows[order].T))
    return Summary(series, speed_histogram=balls[order].astype(np.int64))
