"""Repeats of a point -> what all analyses need of them, from one pass over their collisions.

A repeat may have millions of collisions. The pass keeps exact means over windows of time, and a
curve of at most ``POINTS`` points for the fits. All arrays have one row for each repeat.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis import observables
from snooker_cli.analysis.observables import INSTANT, sampling_times
from snooker_cli.containers import Circle
from snooker_cli.engine import Rows, batch_series, is_short
from snooker_cli.engine.jit import helper, inlined, kernel
from snooker_cli.laws import Driven, Sides
from snooker_cli.runs.execution import processors
from snooker_cli.scene import Scene
from snooker_cli.trace import SPEED_BINS, StopReason, Trace

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

POINTS = 64
"""Points of a curve at most. Each two of them stand for a group of collisions."""

SAMPLES = 128  # times of a repeat between which a law is judged

WINDOWS = 20  # windows of time for the local pressure and energy

SKIPPED_COLLISIONS = 50
"""Collisions before the cumulative pressure is fitted, as in the source report: it starts at 0."""

RELAXING, LEAST_RELAXING = 15, 5
"""Collisions of a ball while equal speeds relax; the fewest, where a kurtosis of 1.95 is 1.83."""

MOST_ROWS = 2**18  # rows that are measured together, so that they fit in memory

ENERGY, TEMPERATURE, PRESSURE = range(3)
"""The quantities with a curve: the energy of balls and container, that of the balls, and the mean
pressure since the start."""

# Columns of ``Rows.values``, as in ``trace.Series``.
KINETIC, CONTAINER, IMPULSE, VIRIAL, AT_WALL, BETWEEN, SPEED, MOMENT, GIVEN = range(9)

MEANS = 8  # the first columns of `Averages`, which are means over time; the others are gains


class Averages(NamedTuple):
    """Means over windows of time, and what collisions add in them.

    Each array has a row for each repeat, and a column for each window if there are several.

    kinetic_energy, total_energy : J, of the balls; with the container
    root_energy : of the square root of the balls' energy, √J
    meeting, root_meeting : of `observables.meeting_temperature`, J, and of its square root, √J
    mean_speed, energy_moment : as in ``trace.Series``
    squares : of N Σk² over the balls' energies k, J²
    wall_impulse, pair_virial, wall_events, pair_events : gains of these columns of ``Series``
    wall_energy, lost_energy : the same, J; nan unless walls give energy
    length : of the windows, s
    """

    kinetic_energy: Array
    total_energy: Array
    root_energy: Array
    meeting: Array
    root_meeting: Array
    mean_speed: Array
    energy_moment: Array
    squares: Array
    wall_impulse: Array
    pair_virial: Array
    wall_events: Array
    pair_events: Array
    wall_energy: Array
    lost_energy: Array
    length: Array

    def pressure(self, scene: Scene) -> Array:
        """Mean pressures, Pa m, as in `observables.cumulative_pressure`; nan without a length."""
        with np.errstate(invalid="ignore"):
            if scene.container.has_wall:
                return self.wall_impulse / (scene.container.wall_length * self.length)
            virial = self.pair_virial / (2 * self.length)
            return (self.kinetic_energy + virial) / scene.container.area


@dataclass(frozen=True)
class Measurements:
    """All that analyses need of the repeats of a point; each array has a row for each repeat.

    points : (*repeats*, 3, 3, POINTS) for each quantity weights, times (s) and values over the
        first, see `condense`; zeros where there is no point
    samples : (*repeats*, 3, 2, SAMPLES) times (s) and logarithms of values over the first, between
        collisions; nan beyond ``numbers``
    numbers : (*repeats*, 3) collisions behind a curve
    across : (*repeats*, WINDOWS) as in `observables.shares_across`
    by_side : (*repeats*, WINDOWS, *sides*) as in `observables.wall_energies`, J; nan unless the
        laws of straight walls differ
    rotation_energy : J, as in `observables.rotation_energy`; nan unless the wall is a driven circle
        with two balls or more, whose rotation it keeps
    windows, whole, relaxed : averages over ``WINDOWS`` windows of time; over all of it; after the
        relaxation, nan in repeats that are too short
    skipped : collisions between balls in the relaxation, see `relaxation`
    first_energy, last_energy, calm_energy : J, of balls and container at the start, at the end and
        before a collapse
    collision_speed : mean speed of the balls after collisions, m/s; nan unless complete
    speeds : (*repeats*, SPEED_BINS) balls by reduced speed after the relaxation
    events, calm_events : (*repeats*, 2) collisions at the wall and between balls; the latter before
        a collapse
    start_energy, drift_energy : J, of the balls at the start and of their centre of mass
    time : when each repeat ended, s
    endings : words of ``StopReason``
    scene : the start of the first repeat
    """

    points: Array
    samples: Array
    numbers: Integers
    across: Array
    by_side: Array
    rotation_energy: Array
    windows: Averages
    whole: Averages
    relaxed: Averages
    first_energy: Array
    last_energy: Array
    calm_energy: Array
    collision_speed: Array
    speeds: Integers
    events: Integers
    calm_events: Integers
    start_energy: Array
    drift_energy: Array
    time: Array
    endings: "NDArray[Any]"
    scene: Scene
    skipped: int | None

    def chosen(self, repeats: NDArray[np.bool_]) -> "Measurements":
        """The measurements of some of the repeats."""
        if repeats.all():
            return self
        return _mapped([self], lambda columns: columns[0][repeats])

    @property
    def collisions(self) -> Integers:
        """All collisions of each repeat."""
        return np.asarray(self.events.sum(axis=1))

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Whether each repeat reached its requested end."""
        return np.array([StopReason(ending).complete for ending in self.endings], dtype=bool)


def relaxing(number: int, of_a_ball: int = RELAXING) -> int:
    """Ball-ball collisions in which a gas of ``number`` balls relaxes; none for one ball."""
    return math.ceil(of_a_ball * number / 2) if number > 1 else 0


def typical_pairs(repeats: Iterable[tuple[int, bool]]) -> float:
    """Mean number of collisions between balls of the complete repeats, or of all if none is.

    repeats : for each, its collisions between balls and whether it is complete; nan without any
    """
    ended = list(repeats)
    complete = [pairs for pairs, whole in ended if whole]
    counted = complete or [pairs for pairs, _ in ended]
    return sum(counted) / len(counted) if counted else math.nan


def pairs_of(traces: Iterable[Trace]) -> float:
    """The `typical_pairs` of repeats."""
    return typical_pairs((trace.pair_events, trace.stop.reason.complete) for trace in traces)


def relaxation(number: int, pairs: float) -> int | None:
    """Collisions between balls that all repeats of a point skip; ``None`` if there are too few.

    number, pairs : balls; the `typical_pairs` of the point

    The same for all repeats, because one that chose its own would choose by its result. They are 15
    of each ball, but at most half; with fewer than 5, speeds are not mixed.
    """
    if math.isnan(pairs):
        return None
    skipped = min(relaxing(number), math.floor(pairs / 2))
    return skipped if skipped >= relaxing(number, LEAST_RELAXING) else None


def relaxed_at(trace: Trace, skipped: int | None) -> float | None:
    """Time (s) after the skipped collisions between balls; ``None`` for a repeat that is too short.

    A repeat that ended early needs 5 more collisions of each ball.
    """
    if skipped is None:
        return None
    after = 0 if trace.stop.reason.complete else relaxing(trace.start.number, LEAST_RELAXING)
    if trace.pair_events < skipped + after:
        return None
    if trace.events is None or trace.summary is not None or trace.start.slides:
        columns = observables.series(trace)
        time = float(columns.time[np.searchsorted(columns.pair_events, skipped)])
    else:
        pairs = np.flatnonzero(trace.events.j >= 0)
        time = float(trace.events.time[pairs[skipped - 1]]) if skipped else 0.0
    return time if time < trace.stop.time else None


def measure(
    traces: Iterable[Trace],
    since: float = 0.0,
    until: float = math.inf,
    pairs: float = math.nan,
) -> Measurements:
    """What analyses need of the repeats of a point, one or more.

    since, until : times (s) between which curves have points
    pairs : the `typical_pairs` of the point; without it, there is nothing after the relaxation

    The kernels run in threads without Python's lock, while the next repeats are read.
    """
    parts: list[Measurements] = []
    waiting: deque[Any] = deque()
    most = processors()
    with ThreadPoolExecutor(most) as pool:
        for together in _together(traces):
            waiting.append(pool.submit(_measured, together, since, until, pairs))
            if not parts and len(waiting) == 1:
                waiting[0].exception()  # waits: only one thread compiles the kernels
            while len(waiting) > most:
                parts.append(waiting.popleft().result())
        parts += [future.result() for future in waiting]
    return _mapped(parts, np.concatenate)


def _mapped(parts: Sequence[Measurements], function: Callable[[Any], Any]) -> Measurements:
    """Measurements whose arrays a function makes of those of the parts; the scene is the first."""
    made: dict[str, Any] = {}
    for name, value in vars(parts[0]).items():
        columns = [getattr(part, name) for part in parts]
        if isinstance(value, Averages):
            made[name] = Averages(*map(function, zip(*columns, strict=True)))
        else:
            made[name] = function(columns) if isinstance(value, np.ndarray) else value
    return Measurements(**made)


def _together(traces: Iterable[Trace]) -> Iterator[list[Trace]]:
    """The repeats in lists that are measured at once."""
    together, rows = list[Trace](), 0
    for trace in traces:
        together.append(trace)
        rows += trace.collisions + 1
        if rows >= MOST_ROWS:
            yield together
            together, rows = [], 0
    if together:
        yield together


def _measured(traces: Sequence[Trace], since: float, until: float, pairs: float) -> Measurements:
    """`measure` of repeats that fit in memory together."""
    scene, repeats = traces[0].start, len(traces)
    container, number = scene.container, scene.number
    calm = [observables.before_collapse(trace) for trace in traces]
    skipped = relaxation(number, pairs)
    relaxed = [relaxed_at(trace, skipped) for trace in calm]
    if all(map(is_short, traces)):
        both = zip(calm, relaxed, strict=True)
        times = [np.empty(0) if at is None else sampling_times(trace, at) for trace, at in both]
        rows, speeds = batch_series(traces, times)
        held, collisions = np.ones(repeats, dtype=bool), rows
        ends = rows.starts[:-1] + [trace.collisions + 1 for trace in calm]
    else:
        rows = _rows([observables.series(trace) for trace in traces])
        held = np.array([observables.has_all(trace) for trace in traces])
        collisions = rows
        if traces[0].summary is not None:
            collisions = _rows([observables.after_collisions(trace) for trace in traces])
        ends = rows.starts[:-1] + [len(observables.series(trace).time) for trace in calm]
        speeds = np.zeros((repeats, SPEED_BINS), dtype=np.int64)
        for counts_of, trace, time in zip(speeds, calm, relaxed, strict=True):
            if time is not None:
                counts_of[:] = observables.reduced_speed_counts(trace, time)
    velocities, masses = np.stack([trace.start.velocities for trace in traces]), scene.masses
    momenta = np.einsum("i,ric->rc", masses, velocities)
    drift = np.sum(momenta**2, axis=1) / (2 * np.sum(masses))
    lasts = np.array([trace.stop.time for trace in traces])
    calm_lasts = np.array([trace.stop.time for trace in calm])
    later = np.array([math.nan if time is None else time for time in relaxed])

    def averages(edges: Array, before: Integers) -> Averages:
        windows = edges.shape[1] - 1
        table = np.full((repeats, windows, len(Averages._fields) - 1), math.nan)
        walls = container.has_wall or number == 1
        free, kept = (number, 0 * drift) if walls else (number - 1, drift)
        average(rows, before, edges, held, kept, free, np.empty((3, MEANS)), table)
        columns = [*np.moveaxis(table, 2, 0), np.diff(edges)]
        return Averages(*(columns if windows > 1 else (column[:, 0] for column in columns)))

    edges = np.linspace(0.0, lasts, WINDOWS + 1, axis=1)
    by_side = np.full((repeats, WINDOWS, len(container.sides)), math.nan)
    if isinstance(scene.wall_law, Sides):
        windows = zip(traces, edges, strict=True)
        by_side = np.stack([observables.wall_energies(trace, row) for trace, row in windows])
    rotating = np.full(repeats, math.nan)
    if number > 1 and isinstance(container, Circle) and isinstance(scene.wall_law, Driven):
        rotating[:] = [observables.rotation_energy(trace) for trace in traces]
    points = np.zeros((repeats, 3, 3, POINTS))
    samples = np.full((repeats, 3, 2, SAMPLES), math.nan)
    numbers, collision_speed = np.zeros((repeats, 3), np.int64), np.full(repeats, math.nan)
    wall_length = container.wall_length if container.has_wall else 0.0
    limits, sizes = (since, until), (wall_length, container.area)
    for quantity in range(3):
        curves = points[:, quantity], samples[:, quantity], numbers[:, quantity]
        condense(quantity, collisions, held, limits, sizes, *curves, collision_speed)
    with np.errstate(divide="ignore", invalid="ignore"):
        samples[:, :, 1] = np.log(samples[:, :, 1])
    energies = rows.values[:, KINETIC] + rows.values[:, CONTAINER]
    complete = np.array([trace.stop.reason.complete for trace in traces])
    return Measurements(
        points,
        samples,
        numbers,
        across=np.stack([observables.shares_across(trace, WINDOWS) for trace in traces]),
        by_side=by_side,
        rotation_energy=rotating,
        windows=averages(edges, rows.starts[1:]),
        whole=averages(np.stack([0 * lasts, lasts], axis=1), rows.starts[1:]),
        relaxed=averages(np.stack([later, calm_lasts], axis=1), np.asarray(ends)),
        first_energy=energies[rows.starts[:-1]],
        last_energy=energies[rows.starts[1:] - 1],
        calm_energy=energies[ends - 1],
        collision_speed=np.where(complete, collision_speed, math.nan),
        speeds=speeds,
        events=np.array([(trace.wall_events, trace.pair_events) for trace in traces]),
        calm_events=np.array([(trace.wall_events, trace.pair_events) for trace in calm]),
        start_energy=np.einsum("i,ric,ric->r", masses, velocities, velocities) / 2,
        drift_energy=drift,
        time=lasts,
        endings=np.array([trace.stop.reason.value for trace in traces]),
        scene=scene,
        skipped=skipped,
    )


def _rows(columns: Sequence[Any]) -> Rows:
    """Series of repeats, one after the other."""
    time, *values = (
        np.concatenate([getattr(column, name) for column in columns]) for name in columns[0].columns
    )
    starts = np.cumsum([0, *(len(column.time) for column in columns)])
    return Rows(time, np.ascontiguousarray(np.transpose(values)), starts)


@kernel
def average(
    rows: Rows,
    ends: Integers,
    edges: Array,
    held: NDArray[np.bool_],
    drift: Array,
    free: int,
    memory: Array,
    averages: Array,
) -> None:
    """Write the columns of `Averages` between edges (*repeats*, *windows* + 1), s.

    ends : the end of the rows of each repeat that count
    held : whether values stay from one row of a repeat to the next; else they are interpolated
    drift, free : J; the meeting temperature is the energy less the drift over ``free``
    memory : (3, MEANS)

    For each window: find its rows, the least value in them, and the mean above the least. So a
    constant has its mean without rounding, and values before the window have no part in it.
    """
    time, values = rows.time, rows.values
    least, here, there = memory[0], memory[1], memory[2]
    for repeat in range(len(edges)):
        row, end = rows.starts[repeat], ends[repeat]
        for window in range(edges.shape[1] - 1):
            low, high = edges[repeat, window], edges[repeat, window + 1]
            row = last_until(low, row, end, time)
            last = last_until(high, row, end, time)
            means = averages[repeat, window]
            for gain in range(values.shape[1] - 4):  # two more if walls give energy
                column = values[:, IMPULSE + gain if gain < 4 else GIVEN + gain - 4]
                before = 0.0  # collisions at time zero count
                if low > 0.0:
                    before = value_at(low, row, end, time, column, held[repeat])
                after = value_at(high, last, end, time, column, held[repeat])
                means[MEANS + gain] = after - before
            if not high > low:
                continue
            terms(row, values, drift[repeat], free, least)
            for k in range(row + 1, min(last + 2 - held[repeat], end)):
                terms(k, values, drift[repeat], free, here)
                for mean in range(MEANS):
                    least[mean] = min(least[mean], here[mean])
            for mean in range(MEANS):
                means[mean] = 0.0
            for k in range(row, last + 1):
                left, right = max(low, time[k]), high
                if k < last:
                    right = time[k + 1]
                if right > left:
                    terms(k, values, drift[repeat], free, here)
                    if not held[repeat] and k + 1 < end:
                        terms(k + 1, values, drift[repeat], free, there)
                        part = ((left + right) / 2 - time[k]) / (time[k + 1] - time[k])
                        for mean in range(MEANS):
                            here[mean] += part * (there[mean] - here[mean])
                    for mean in range(MEANS):
                        means[mean] += (here[mean] - least[mean]) * (right - left)
            for mean in range(MEANS):
                means[mean] = least[mean] + means[mean] / (high - low)


@inlined
def last_until(instant: float, row: int, end: int, time: Array) -> int:
    """The last row from ``row`` on whose time is not after an instant, s."""
    while row + 1 < end and time[row + 1] <= instant:
        row += 1
    return row


@inlined
def value_at(instant: float, row: int, end: int, time: Array, column: Array, held: bool) -> float:
    """A column's value at an instant (s) between a row and the next."""
    if held or row + 1 >= end:
        return float(column[row])
    part = (instant - time[row]) / (time[row + 1] - time[row])
    return float(column[row] + part * (column[row + 1] - column[row]))


@inlined
def terms(row: int, values: Array, drift: float, free: int, means: Array) -> None:
    """Write the values of a row that `Averages` has means of."""
    energy = values[row, KINETIC]
    means[0], means[1], means[2] = energy, energy + values[row, CONTAINER], math.sqrt(energy)
    means[3] = (energy - drift) / free
    means[4] = math.sqrt(max(means[3], 0.0))
    means[5], means[6] = values[row, SPEED], values[row, MOMENT]
    means[7] = values[row, MOMENT] * energy * energy


@kernel
def condense(
    quantity: int,
    rows: Rows,
    held: NDArray[np.bool_],
    limits: tuple[float, float],
    sizes: tuple[float, float],
    points: Array,
    samples: Array,
    numbers: Integers,
    speeds: Array,
) -> None:
    """Write the ``points`` and ``samples`` of a quantity, as in `Measurements`.

    limits : times (s) between which the curves have points
    sizes : length of the walls, m, zero without walls, and area of the container, m²
    speeds : mean over the collisions of the mean speed of the balls, m/s

    A curve has a value for each instant: collisions at one instant are one row, the last. First its
    rows are counted. Then they are added up in groups, and evenly chosen ones become samples: the
    value between the row before and this one.

    A group becomes two points, at one standard deviation of its times before and after their mean.
    They have the group's mean value and its covariance with the time. So a fit of any smooth law
    has the same sum of squares with them, but for terms of third order in the length of a group.
    """
    time, values = rows.time, rows.values
    for repeat in range(len(numbers)):
        first, end = rows.starts[repeat], rows.starts[repeat + 1]
        number = 0
        for row in range(first, end):
            number += counts(quantity, row, first, end, rows, limits)
        numbers[repeat] = number
        groups, most = min(number, POINTS // 2), min(number, SAMPLES)
        done, sample, group, instants, total = 0, 0, 0, 0, 0.0
        origin, level, size, times, levels, squares, products = 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0
        scale, moved, before, moved_before = 0.0, 0.0, first, 0.0
        for row in range(first, end):
            if row > first:
                width, energy = time[row] - time[row - 1], values[row - 1, KINETIC]
                if not held[repeat]:
                    energy = (energy + values[row, KINETIC]) / 2
                moved += energy * width
            if not is_instant(row, first, end, time):
                continue
            if row > first:
                instants += 1
                total += values[row, SPEED]
            here = value_of(quantity, row, time[row], moved, values, sizes)
            if scale == 0.0 and here > 0.0 and is_settled(quantity, row, rows):
                scale = here
            if counts(quantity, row, first, end, rows, limits):
                here = here / scale if scale > 0.0 else here
                if done == group_begins(group, groups, number):
                    origin, level, group = time[row], here, group + 1
                    size, times, levels, squares, products = 0, 0.0, 0.0, 0.0, 0.0
                later, higher = time[row] - origin, here - level
                size += 1
                times += later
                levels += higher
                squares += later * later
                products += later * higher
                if done + 1 == group_begins(group, groups, number):
                    times, levels = times / size, levels / size
                    spread = math.sqrt(max(squares / size - times * times, 0.0))
                    slope = 0.0
                    if spread > 0.0:
                        slope = (products / size - times * levels) / spread
                    for side in range(2):
                        away = 2 * side - 1
                        place = 2 * group - 2 + side
                        points[repeat, 0, place] = size / 2
                        points[repeat, 1, place] = origin + times + away * spread
                        points[repeat, 2, place] = level + levels + away * slope
                if sample < most and done == sample * (number - 1) // max(most - 1, 1):
                    instant, middle = time[row], here * scale if scale > 0.0 else here
                    if done > 0:
                        instant = (time[before] + time[row]) / 2
                        width, energy = instant - time[before], values[before, KINETIC]
                        if not held[repeat]:
                            # The mean of a straight line over its first half.
                            energy += (values[row, KINETIC] - energy) / 4
                        until = moved_before + energy * width
                        middle = value_of(quantity, before, instant, until, values, sizes)
                        if not held[repeat]:
                            other = value_of(quantity, row, instant, until, values, sizes)
                            middle = (middle + other) / 2
                    samples[repeat, 0, sample] = instant
                    samples[repeat, 1, sample] = middle / scale if scale > 0.0 else middle
                    sample += 1
                done += 1
            before, moved_before = row, moved
        if instants > 0:
            speeds[repeat] = total / instants


@inlined
def group_begins(group: int, groups: int, number: int) -> int:
    """The first row of a group. The first groups are single rows, because a decay is fast there."""
    return group + (number - groups) * group * group // (groups * groups)


@inlined
def is_instant(row: int, first: int, end: int, time: Array) -> bool:
    """Whether a row is the first of all, or the last of those at one instant."""
    if row == first or row + 1 == end:
        return True
    return bool(time[row + 1] - time[row] > INSTANT * time[row + 1])


@inlined
def is_settled(quantity: int, row: int, rows: Rows) -> bool:
    """Whether a row has a value of the quantity: a pressure is a mean over some collisions."""
    collisions = rows.values[row, AT_WALL] + rows.values[row, BETWEEN]
    return quantity != PRESSURE or (rows.time[row] > 0.0 and collisions >= SKIPPED_COLLISIONS)


@helper
def counts(
    quantity: int, row: int, first: int, end: int, rows: Rows, limits: tuple[float, float]
) -> bool:
    """Whether a row is a point of the curve of a quantity."""
    inside = limits[0] <= rows.time[row] <= limits[1]
    return inside and is_instant(row, first, end, rows.time) and is_settled(quantity, row, rows)


@inlined
def value_of(
    quantity: int,
    row: int,
    instant: float,
    moved: float,
    values: Array,
    sizes: tuple[float, float],
) -> float:
    """The value of a quantity at an instant (s) after a row.

    moved : the integral of the balls' energy over time up to the instant, J s
    """
    if quantity == ENERGY:
        return float(values[row, KINETIC] + values[row, CONTAINER])
    if quantity == TEMPERATURE:
        return float(values[row, KINETIC])
    if sizes[0] > 0.0:
        return float(values[row, IMPULSE] / (sizes[0] * instant))
    return float((moved + values[row, VIRIAL] / 2) / (sizes[1] * instant))
