"""Series of repeats -> means over spans of time, and curves of a few rows.

A series has a row for each collision, or in a summary on a grid of times. The repeats of a point
lie one after the other in the same arrays, so that many short ones cost no loop.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli import engine
from snooker_cli.analysis.observables import INSTANT
from snooker_cli.scene import Scene
from snooker_cli.trace import Series, Trace

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

ROWS = 256  # of a curve at most

SKIPPED_COLLISIONS = 50
"""Collisions before the pressure since the start is fitted, as in the source report."""

# Limits of a series: balls times collisions (about a second), and rows (some 300 megabytes). Beyond
# a limit, an even choice is used.
MOST_MEASURED, MOST_ROWS = 2**28, 2**22

# Columns of a series, as in ``trace.Series`` after the time.
KINETIC, CONTAINER, IMPULSE, VIRIAL, AT_WALL, BETWEEN, SPEED, MOMENT, GIVEN, LOST = range(10)
SPIN = -1  # of rough balls


class Averages(NamedTuple):
    """Means over spans of time, and what collisions add in them.

    Each array has a row for each repeat, and a column for each span if there are several.

    kinetic_energy, total_energy : J, of the balls' motion; with the container and spins
    spin_energy : J, of the balls' rotation; zero of smooth balls
    root_energy : of the square root of the balls' energy, √J
    meeting, root_meeting : of the temperature at which balls meet, J, and of its square root, √J
    mean_speed : of a ball, m/s
    energy_moment : of ⟨k²⟩/⟨k⟩² over the balls' energies k
    squares : of N Σk² over the balls' energies k, J²
    wall_impulse, pair_virial : the sum of the impulses on the wall, kg m/s; that of impulse times
        distance over collisions between balls, kg m²/s
    wall_events, pair_events : the numbers of collisions
    wall_energy, lost_energy : given by walls, and taken by collisions, J; nan unless walls give
        energy
    length : of the spans, s
    """

    kinetic_energy: Array
    total_energy: Array
    root_energy: Array
    meeting: Array
    root_meeting: Array
    mean_speed: Array
    energy_moment: Array
    squares: Array
    spin_energy: Array
    wall_impulse: Array
    pair_virial: Array
    wall_events: Array
    pair_events: Array
    wall_energy: Array
    lost_energy: Array
    length: Array

    def pressure(self, scene: Scene) -> Array:
        """Mean pressures, Pa m; nan without a length.

        With walls ΣJ/(L t): the impulses on the wall over its full length and the time. Without
        walls (E + ΣJd/(2t))/A, with the mean kinetic energy E and the impulses J and contact
        distances d of collisions between balls.
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            if scene.container.has_wall:
                return self.wall_impulse / (scene.container.wall_length * self.length)
            virial = self.pair_virial / (2 * self.length)
            return (self.kinetic_energy + virial) / scene.container.area

    def ideal_gas_ratio(self, scene: Scene) -> Array:
        """P V/(N T), with the temperature's mean; 1 for an ideal gas, nan at rest."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.pressure(scene) * scene.container.area / self.kinetic_energy

    @property
    def virial_ratio(self) -> Array:
        """1 + ΣJd/(2 N T t): P V/(N T) of the balls, with any walls; nan at rest."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return 1 + self.pair_virial / (2 * self.kinetic_energy * self.length)

    def from_window(self, first: int) -> "Averages":
        """Averages over the spans from one on, which are equally long."""
        columns = [column[:, first:] for column in self]
        means = [column.mean(axis=1) for column in columns[:MEANS]]
        return Averages(*means, *(column.sum(axis=1) for column in columns[MEANS:]))


# The first columns are means, the others gains.
MEANS = Averages._fields.index("wall_impulse")
KINETIC_MEAN, MOMENT_MEAN = map(Averages._fields.index, ("kinetic_energy", "energy_moment"))


class Curve(NamedTuple):
    """The course of repeats in at most ``ROWS`` rows, which part their collisions into groups.

    A row is an instant between two collisions: the last is the end, the first the start or the
    beginning of the times that are fitted. Repeats with fewer rows repeat the last one. Each array
    is (*repeats*, ``ROWS``), or for groups (*repeats*, ``ROWS`` − 1).

    time : s
    kinetic_energy, container_energy, spin_energy : J, at the rows; without spins the last is zero
    wall_events, pair_events : collisions before the rows
    pressure : mean pressure since the start, Pa m; nan at the start
    energy_moment_integral : ∫ ``Series.energy_moment`` dt since the start, s
    wall_energy, lost_energy : as in ``Series``; nan unless walls give energy
    weight : collisions of a group that count, zero if there is none; the start counts as one
    group_time, group_kinetic, group_others, group_pressure : means over these collisions of the
        time (s), and of values just after them: the balls' energy of motion, that of the container
        and of spins (J), the pressure (Pa m), which needs ``SKIPPED_COLLISIONS``, and is nan before
    """

    time: Array
    kinetic_energy: Array
    container_energy: Array
    spin_energy: Array
    wall_events: Array
    pair_events: Array
    pressure: Array
    energy_moment_integral: Array
    wall_energy: Array
    lost_energy: Array
    weight: Array
    group_time: Array
    group_kinetic: Array
    group_others: Array
    group_pressure: Array

    @property
    def energy(self) -> Array:
        """Of the balls with their spins and the container, J."""
        return self.kinetic_energy + self.container_energy + self.spin_energy

    @property
    def events(self) -> Array:
        """Collisions before the rows."""
        return self.wall_events + self.pair_events

    def at(self, times: Array, values: Array) -> Array:
        """Values (*repeats*, *rows*) interpolated at times (s) that are those of all repeats."""
        return interpolated(times, self.time, values)


def interpolated(places: Array, rows: Array, values: Array) -> Array:
    """Values at rows (*repeats*, *rows*), interpolated at places that are those of all repeats."""
    pairs = zip(rows, values, strict=True)
    return np.array([np.interp(places, row, value) for row, value in pairs])


def series(trace: Trace) -> Series:
    """The observables at time zero and after each collision; a summary's on its grid."""
    most = max(2, min(MOST_ROWS, MOST_MEASURED // trace.start.number))
    return engine.series(trace, most)


def has_all(trace: Trace, columns: Series) -> bool:
    """Whether a series of a repeat has a row for every collision."""
    rows = 1 + trace.start.slides  # the start, and the end where balls may slide
    return trace.events is not None and len(columns.time) == len(trace.events) + rows


class TimeSeries:
    """The series of repeats, one after the other.

    time : (*m*,), s
    columns : (*columns*, *m*), the other columns of ``Series`` in order
    starts : (*repeats* + 1,), where the rows of each repeat begin, and the end of all
    held : (*repeats*,) whether values stay from a row to the next; else they are interpolated
    drift, free : J; the meeting temperature is the energy less the drift over ``free``
    """

    def __init__(
        self, traces: Sequence[Trace], time: Array, columns: Array, starts: Integers, held: Flags
    ) -> None:
        scene = traces[0].start
        self.time, self.columns, self.starts, self.held = time, columns, starts, held
        self.gains, self.rough = scene.wall_law.adds_energy, scene.surface is not None
        self.drift = np.array([trace.start.drift_energy for trace in traces])
        self.walls = scene.container.has_wall or scene.number == 1
        self.free = scene.number - (not self.walls)
        self.all_held = bool(np.all(held))
        counts = np.diff(starts)
        self.held_rows = np.repeat(held, counts)
        # Until the next row, s; zero after the last row of a repeat.
        self.widths = np.append(np.diff(time), 0.0)
        self.widths[starts[1:] - 1] = 0.0
        self.terms = self._terms(0.0 if self.walls else np.repeat(self.drift, counts))
        # Over the time until the next row, of each term.
        self.integrals = self._between(self.terms) * self.widths

    def _terms(self, drift: Array | float) -> Array:
        """What `Averages` has means of, in the order of its fields: (``MEANS``, *m*)."""
        energy, moment = self.columns[KINETIC], self.columns[MOMENT]
        root, meeting = np.sqrt(energy), (energy - drift) / self.free
        root_meeting = root / math.sqrt(self.free)
        if not self.walls:
            root_meeting = np.sqrt(np.maximum(meeting, 0.0))
        total = energy + self.other_energy
        others = self.columns[SPEED], moment, moment * energy**2, self.spin_energy
        return np.stack([energy, total, root, meeting, root_meeting, *others])

    @property
    def spin_energy(self) -> Array:
        """Of each row, J; zero of smooth balls."""
        return np.asarray(self.columns[SPIN] if self.rough else np.zeros_like(self.time))

    @property
    def other_energy(self) -> Array:
        """Of the container and the balls' spins, J."""
        return np.asarray(self.columns[CONTAINER] + self.spin_energy)

    def _between(self, values: Array) -> Array:
        """Values of rows in the middle between each row and the next."""
        if self.all_held:
            return values
        following = np.append(values[:, 1:], values[:, -1:], axis=1)
        moves = ~self.held_rows & (self.widths > 0)
        return np.asarray(np.where(moves, (values + following) / 2, values))

    def until(self, instants: Array, ends: Integers) -> Integers:
        """The last row at or before instants (*repeats*, *n*), s; before the ends (*repeats*,)."""
        found = np.empty(instants.shape, dtype=np.int64)
        firsts = self.starts[:-1].tolist()
        for repeat, (first, end) in enumerate(zip(firsts, ends.tolist(), strict=True)):
            here = np.searchsorted(self.time[first:end], instants[repeat], side="right")
            found[repeat] = first - 1 + here
        # A nan is after all numbers.
        return np.clip(found, self.starts[:-1, np.newaxis], ends[:, np.newaxis] - 1)

    def at(self, values: Array, row: Integers, instants: Array) -> Array:
        """Values of rows at instants (*repeats*, *n*), s, each between a row and the next."""
        here = values[:, row]
        if self.all_held:
            return here
        width = self.widths[row]
        moves = ~self.held[:, np.newaxis] & (width > 0)
        part = np.where(moves, (instants - self.time[row]) / np.where(moves, width, 1.0), 0.0)
        following = values[:, np.minimum(row + 1, self.time.size - 1)]
        return np.asarray(np.where(moves, here + part * (following - here), here))

    def averages(self, edges: Array, ends: Integers) -> Averages:
        """Averages between edges (*repeats*, *spans* + 1), s, of the rows before the ends.

        Each span is added up by itself, because values before it may be larger by any factor.
        """
        row, length = self.until(edges, ends), np.diff(edges, axis=1)
        first, last = row[:, :-1], row[:, 1:]
        # Whole intervals between rows, and a part of one at each end.
        whole = _sums(self.integrals, first + 1, last)
        following = self.time[np.minimum(first + 1, self.time.size - 1)]
        same = first == last
        rights = np.where(same, edges[:, 1:], following)
        lefts = np.where(same, edges[:, 1:], self.time[last])
        for start, end, at in ((edges[:, :-1], rights, first), (lefts, edges[:, 1:], last)):
            whole += self.at(self.terms, at, (start + end) / 2) * (end - start)
        with np.errstate(divide="ignore", invalid="ignore"):
            means = np.where(length > 0, whole / length, math.nan)
        accounts = [GIVEN, LOST] if self.gains else []
        sums = self.at(self.columns[[IMPULSE, VIRIAL, AT_WALL, BETWEEN, *accounts]], row, edges)
        sums[:, edges == 0] = 0.0  # collisions at time zero count
        gains = np.where(np.isfinite(length), np.diff(sums, axis=2), math.nan)
        unknown = [] if self.gains else [np.full_like(length, math.nan)] * 2
        return Averages(*[*means, *gains, *unknown, length])


def _sums(values: Array, first: Integers, last: Integers) -> Array:
    """Sums of the last axis from one index until before another, which may be the same."""
    end = values.shape[-1] - 1  # ``reduceat`` has no place after the last value, which is added
    bounds = np.minimum(np.stack([first, np.maximum(first, last)], axis=-1), end)
    sums = np.add.reduceat(values, bounds.ravel(), axis=-1)[..., ::2]
    sums = sums.reshape(*values.shape[:-1], *first.shape)
    final = values[..., end].reshape(*values.shape[:-1], *[1] * first.ndim)
    sums += np.where((first < end) & (end < last), final, 0.0)
    return np.asarray(np.where(first < last, sums, 0.0))


class Collisions:
    """The collisions that rows stand for: one each, or in a summary those since the row before.

    Collisions at one instant, as in a collapse, count as one: the last. Number j of the m between
    two rows of a summary is at j/(m + 1) of the way on average, and what it changes at j/m. Those
    between the last two rows of a repeat that ended early, in ever faster bounces, are one instant.

    weight : (*m*,) collisions of a row; the start of a repeat counts as one
    time : (*m*,) their mean, s
    part : (*m*,) of the way from the row before to this one, where values are after them on average
    """

    def __init__(self, rows: TimeSeries, traces: Sequence[Trace]) -> None:
        self.rows, self.traces = rows, traces
        self.first, self.last = rows.starts[:-1], rows.starts[1:] - 1
        self.complete = np.array([trace.stop.reason.complete for trace in traces])
        self.count = rows.columns[AT_WALL] + rows.columns[BETWEEN]
        apart = np.append(np.diff(rows.time) > INSTANT * rows.time[1:], True)
        apart[self.last] = True
        self.weight, self.time = apart.astype(np.float64), rows.time
        self.part = np.ones_like(self.time)
        if not rows.all_held:
            added = np.diff(self.count, prepend=0.0)
            early = ~self.complete
            added[self.last[early]] = np.minimum(added[self.last[early]], 1.0)
            between = ~rows.held_rows
            self.weight = np.where(between, added, self.weight)
            between[self.last[early]] = False
            self.time = rows.time - np.append(0.0, rows.widths[:-1]) / 2 * between
            between &= added > 0
            self.part = np.where(between, (added + 1) / (2 * np.where(between, added, 1.0)), 1.0)
        self.weight[self.first], self.part[self.first] = 1.0, 1.0
        self.scene = traces[0].start
        # Integrals since the start at each row: of the balls' energy, J s, and of its moment, s.
        self.moved, self.moment = map(self._so_far, rows.integrals[[KINETIC_MEAN, MOMENT_MEAN]])

    def _so_far(self, integrals: Array) -> Array:
        sums = np.append(0.0, np.cumsum(integrals[:-1]))
        return np.asarray(sums - np.repeat(sums[self.first], np.diff(self.rows.starts)))

    def after(self, values: Array) -> Array:
        """Values of all rows, just after these collisions."""
        if self.rows.all_held:
            return np.asarray(values)
        before = np.append(values[:1], values[:-1])
        return np.asarray(np.where(self.part < 1, before + self.part * (values - before), values))

    def pressure(self, time: Array, impulse: Array, moved: Array, virial: Array) -> Array:
        """Mean pressure since the start, Pa m, as in `Averages`; nan at the start."""
        container = self.scene.container
        with np.errstate(divide="ignore", invalid="ignore"):
            values = (moved + virial / 2) / (container.area * time)
            if container.has_wall:
                values = impulse / (container.wall_length * time)
            return np.asarray(np.where(time > 0, values, math.nan))

    def pressures(self) -> Array:
        """`pressure` just after the collisions of each row."""
        moved = self.moved
        if not self.rows.all_held:
            earlier = np.append(0.0, self.moved[:-1])
            moved = np.where(self.time < self.rows.time, (earlier + moved) / 2, moved)
        impulse, virial = map(self.after, self.rows.columns[[IMPULSE, VIRIAL]])
        return self.pressure(self.time, impulse, moved, virial)

    def curve(self, since: float, until: float) -> tuple[Curve, Array]:
        """`Measurement.curve` between times (s), and `Measurement.first_fitted_pressure`."""
        rows, weight = self.rows, self.weight * ((self.time >= since) & (self.time <= until))
        row, begin = self._groups(weight)
        time = self._edges(row, begin)
        kinetic, container, impulse, virial = rows.columns[: VIRIAL + 1, row]
        moved, moment = (
            integral[row] + values[row] * (time - rows.time[row])
            for integral, values in (
                (self.moved, rows.columns[KINETIC]),
                (self.moment, rows.columns[MOMENT]),
            )
        )
        pressures = self.pressures()
        settled = np.nan_to_num(pressures) * (self.count >= SKIPPED_COLLISIONS)
        number = _sums(weight, begin[:, :-1], begin[:, 1:])

        def mean(values: Array) -> Array:
            sums = _sums(weight * values, begin[:, :-1], begin[:, 1:])
            return np.asarray(sums / np.maximum(number, 1.0))

        late = self.count[row[:, :-1]] >= SKIPPED_COLLISIONS - 1
        nothing = np.full_like(time, math.nan)
        given, lost = rows.columns[GIVEN : LOST + 1, row] if rows.gains else (nothing, nothing)
        curve = Curve(
            time=time,
            kinetic_energy=kinetic,
            container_energy=container,
            spin_energy=rows.spin_energy[row],
            wall_events=rows.columns[AT_WALL, row],
            pair_events=rows.columns[BETWEEN, row],
            pressure=self.pressure(time, impulse, moved, virial),
            energy_moment_integral=moment,
            wall_energy=given,
            lost_energy=lost,
            weight=number,
            group_time=mean(self.time),
            group_kinetic=mean(self.after(rows.columns[KINETIC])),
            group_others=mean(self.after(rows.other_energy)),
            group_pressure=np.where(late, mean(settled), math.nan),
        )
        return curve, self._settled(np.where(self.weight > 0, settled, 0.0))

    def _groups(self, weight: Array) -> tuple[Integers, Integers]:
        """The last row before each group, and its first: (*repeats*, ``ROWS``).

        The first groups are single collisions, because a decay is fast there. One begins with the
        first collision that a fit of the pressure uses.
        """
        sums = np.cumsum(weight)
        before = sums[self.first] - weight[self.first]
        total = (sums[self.last] - before)[:, np.newaxis]
        number = np.minimum(total, ROWS - 1)
        order = np.minimum(np.arange(ROWS), number)
        begins = order + np.floor((total - number) * (order / np.maximum(number, 1)) ** 2)
        first = np.searchsorted(sums, before, side="right")
        first = np.minimum(first, self.last)[:, np.newaxis]
        # Collisions of the repeat before the first that counts; the start is not one.
        skipped = np.where(first == self.first[:, np.newaxis], -1.0, self.count[first - 1])
        wanted = SKIPPED_COLLISIONS - 1 - skipped
        nearest = np.argmin(np.abs(begins - wanted), axis=1)[:, np.newaxis]
        nearest = np.minimum(nearest, np.maximum(number - 1, 0).astype(np.int64))
        inside = (wanted > 0) & (wanted < total) & (np.arange(ROWS) == nearest)
        begins = np.where(inside, wanted, begins)
        row = np.searchsorted(sums, before[:, np.newaxis] + begins)
        row[:, :1] = first - 1
        row = np.clip(row, self.first[:, np.newaxis], self.last[:, np.newaxis])
        return row, np.hstack([first, row[:, 1:] + 1])

    def _edges(self, row: Integers, begin: Integers) -> Array:
        """Times (s) between the collisions of a row and of the next, at the ends those of these."""
        rows = self.rows
        time = rows.time[row] + np.where(rows.held[:, np.newaxis], rows.widths[row] / 2, 0.0)
        ends = np.array([trace.stop.time for trace in self.traces])[:, np.newaxis]
        time = np.where(row == self.last[:, np.newaxis], ends, time)
        from_start = begin[:, 0] == self.first
        time[from_start, 0] = rows.time[self.first[from_start]]
        return np.asarray(time)

    def _settled(self, pressures: Array) -> Array:
        """Time and value of the first pressure of each repeat that is not zero; nan without one."""
        known = np.append(np.flatnonzero(pressures > 0), len(pressures))
        row = known[np.searchsorted(known, self.first)]
        inside = row <= self.last
        row = np.where(inside, row, 0)
        pairs = np.column_stack([self.time[row], pressures[row]])
        return np.asarray(np.where(inside[:, np.newaxis], pairs, math.nan))

    def mean_speed(self) -> Array:
        """`Measurement.collision_speed`."""
        ends = self.rows.starts[1:]
        number = _sums(self.weight, self.first + 1, ends)
        with np.errstate(divide="ignore", invalid="ignore"):
            after = self.weight * self.after(self.rows.columns[SPEED])
            speeds = _sums(after, self.first + 1, ends) / number
        return np.asarray(np.where(self.complete, speeds, math.nan))
