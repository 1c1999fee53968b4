"""A trace -> temperature, pressure, momentum, distances and speeds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.engine import States, replay, series
from snooker_cli.trace import (
    SERIES_UNITS,
    SPEED_BIN,
    SPEED_BINS,
    Events,
    Series,
    StopReason,
    Summary,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

    Array = NDArray[np.float64]

__all__ = [
    "INSTANT",
    "ROUNDING",
    "after_collisions",
    "at_collisions",
    "before_collapse",
    "central_distances",
    "cumulative_pressure",
    "energy_ratio",
    "equal_balls",
    "gained",
    "ideal_gas_ratio",
    "instants",
    "mean_and_error",
    "mean_pressure",
    "mean_temperature",
    "momentum",
    "over_first",
    "pair_distances",
    "reduced_speed_counts",
    "sampling_times",
    "series",
    "so_far",
    "speeds",
    "temperature",
    "time_mean",
    "time_means",
    "window_energy",
    "window_pressure",
]

ROUNDING = 1e-12
"""Relative spread below which repeats differ by nothing but rounding."""

INSTANT = 1e-9
"""Collisions nearer than this share of a repeat's length are at one instant: a decay over the
repeat cannot tell them apart, and a collapse has thousands of them."""

MOST_POINTS = 2**16
"""Collisions after which a curve has a point; of more, evenly so many."""


def temperature(found: Series, number: int) -> Array:
    """Temperature by equipartition in two dimensions, T = <KE>, J (k_B = 1)."""
    return found.kinetic_energy / number


def energy_ratio(found: Series) -> Array:
    """Kinetic energy of balls and container over that at the start; 0 if all is at rest."""
    return over_first(found.kinetic_energy + found.container_energy)


def over_first(values: Array) -> Array:
    """Values over the first of them that is not zero; as they are if all of them are."""
    positive = values[values > 0]
    return np.asarray(values / positive[0] if len(positive) else values)


def equal_balls(scene: Scene) -> bool:
    """Whether all balls have one radius and one mass, as the theories want."""
    return bool(np.all(scene.radii == scene.radii[0]) and np.all(scene.masses == scene.masses[0]))


def mean_and_error(values: Array) -> tuple[float, float]:
    """Mean over repeats and its standard error.

    The error is nan for fewer than two of them, and if they differ by rounding alone: that is no
    measure of their spread.
    """
    mean = float(values.mean())
    deviation = float(values.std(ddof=1)) if len(values) > 1 else 0.0
    if deviation <= ROUNDING * abs(mean):
        return mean, math.nan
    return mean, deviation / math.sqrt(len(values))


def instants(time: Array) -> NDArray[np.intp]:
    """The last row of each instant: collisions go on while a collapse's clock stands still."""
    return np.flatnonzero(np.append(np.diff(time) > INSTANT * time[-1], True))


def before_collapse(trace: Trace) -> Trace:
    """The repeat without the collisions of a collapse, at the instant where its clock stands still.

    Of a summary the part up to the last row of its grid before that is left.
    """
    if trace.stop.reason is not StopReason.COLLAPSE:
        return trace
    found, end = series(trace), trace.stop.time
    rows = max(1, int(np.count_nonzero(found.time < (1 - INSTANT) * end)))
    events, summary = trace.events, trace.summary
    if events is not None:
        events = Events(*(column[: rows - 1] for column in vars(events).values()))
    if summary is not None:
        calm = Series(*(column[:rows] for column in vars(summary.series).values()))
        summary, end = Summary(calm, summary.speed_histogram[:rows]), float(calm.time[-1])
    return replace(
        trace,
        stop=replace(trace.stop, time=end),
        wall_events=int(found.wall_events[rows - 1]),
        pair_events=int(found.pair_events[rows - 1]),
        events=events,
        summary=summary,
    )


def after_collisions(trace: Trace) -> Series:
    """The series at the start and after each collision, an instant a row, at most some thousands.

    A summary's are read between the rows of its grid: of the m collisions between two rows, number
    j is taken to be where the j-th of m random ones is on average, j/(m + 1) of the way, in a gas
    that cools by Haff's law. Those between the last two rows of a repeat that ended early, in ever
    faster bounces, are one instant, at its end.
    """
    found = series(trace)
    if len(found.time) < 2:
        return found
    if trace.summary is None:
        rows = 1 + instants(found.time[1:])
        rows = np.append(0, rows[_evenly(len(rows))])
        return Series(*(getattr(found, name)[rows] for name in SERIES_UNITS))
    events = found.wall_events + found.pair_events
    told = int(events[-1] if trace.stop.reason.complete else events[-2])
    number = 1.0 + _evenly(told)
    before = np.searchsorted(events, number) - 1
    order, between = number - events[before], events[before + 1] - events[before]
    speed = np.sqrt(np.where(found.kinetic_energy > 0, found.kinetic_energy, 1.0))
    slowing = np.log(speed[before + 1] / speed[before])
    rest = slice(len(events) - (told < events[-1]), None)

    def read(name: str) -> Array:
        column, powers = getattr(found, name), _POWERS.get(name, 0) * slowing
        part = order / (between + (name == "time"))
        # The sum of q^(px) over x from 0 to a part, over that to 1; q is how speeds change.
        falling = np.where(powers == 0, 1.0, powers)
        part = np.where(powers == 0, part, np.expm1(part * falling) / np.expm1(falling))
        change = column[before + 1] - column[before]
        return np.concatenate([column[:1], column[before] + part * change, column[rest]])

    return Series(*map(read, SERIES_UNITS))


_POWERS = {
    "time": -1,
    "kinetic_energy": 2,
    "wall_impulse": 1,
    "pair_virial": 1,
    "mean_speed": 1,
}
"""The power of the speed that a collision changes a column by, as in Haff's law."""


def _evenly(count: int) -> NDArray[np.intp]:
    """Of so many rows in order, evenly at most ``MOST_POINTS``, with the first and the last."""
    return np.linspace(0, count - 1, min(count, MOST_POINTS)).round().astype(np.intp)


def cumulative_pressure(found: Series, container_radius: float) -> tuple[Array, Array]:
    """Times and the wall's mean pressure since the start, sum J / (2 pi R t), Pa m.

    Time zero, where it is not defined, is left out.
    """
    later = found.time > 0
    time = found.time[later]
    return time, found.wall_impulse[later] / (2 * math.pi * container_radius * time)


def so_far(trace: Trace, column: Array, times: Array) -> Array:
    """A column of the series that only collisions add to, such as the wall's impulse, at times.

    At the time of a collision it is that after it; between the rows of a summary it is straight.
    """
    known = _times(trace)
    if trace.summary is not None:
        return np.interp(times, known, column)
    return np.asarray(column[np.searchsorted(known, times, side="right") - 1])


def gained(trace: Trace, column: Array, since: float) -> float:
    """What collisions add to a column of the series after a time (s); all of it if that is 0."""
    before = so_far(trace, column, np.array([since]))[0] if since > 0 else 0.0
    return float(column[-1] - before)


def time_means(trace: Trace, values: Array, edges: Array) -> Array:
    """Means over time between the edges (s) of what the rows of the series say.

    After a collision it stays as it is; between the rows of a summary it is straight.
    """
    time, first = _times(trace), values[0]
    if trace.summary is None:
        time, values = np.append(time, trace.stop.time), np.append(values, values[-1])
        held = values[:-1]
    else:
        held = (values[:-1] + values[1:]) / 2
    # Less the first value, so that what does not change has a mean without rounding.
    integral = np.concatenate([[0.0], np.cumsum((held - first) * np.diff(time))])
    return np.asarray(first + np.diff(np.interp(edges, time, integral)) / np.diff(edges))


def _times(trace: Trace) -> Array:
    """The times of the series' rows, without the work of reading the rest of it."""
    if trace.events is None:
        return series(trace).time
    return np.concatenate([[0.0], trace.events.time])


def window_pressure(trace: Trace, windows: int) -> tuple[Array, Array]:
    """Middles and pressures of equal windows of time over the whole repeat; s and Pa m."""
    edges = _edges(trace, windows)
    impulse = np.diff(so_far(trace, series(trace).wall_impulse, edges[1:]), prepend=0.0)
    perimeter = 2 * math.pi * trace.start.container_radius
    return (edges[:-1] + edges[1:]) / 2, impulse / (perimeter * np.diff(edges))


def window_energy(trace: Trace, windows: int) -> tuple[Array, Array]:
    """Middles (s) of equal windows of time, and the mean of ``energy_ratio`` in each."""
    edges = _edges(trace, windows)
    middles = (edges[:-1] + edges[1:]) / 2
    return middles, time_means(trace, energy_ratio(series(trace)), edges)


def _edges(trace: Trace, windows: int) -> Array:
    """The edges of equal windows of time, s; none for a repeat without length."""
    end = trace.stop.time
    return np.linspace(0.0, end, windows + 1) if end > 0 else np.empty(0)


def mean_pressure(trace: Trace, since: float = 0.0) -> float:
    """Pressure on the wall from a time (s) to the end, Pa m; 0 if there is nothing between."""
    end = trace.stop.time
    if not end > since:
        return 0.0
    impulse = gained(trace, series(trace).wall_impulse, since)
    return impulse / (2 * math.pi * trace.start.container_radius * (end - since))


def mean_temperature(trace: Trace, since: float = 0.0) -> float:
    """Temperature from a time (s) to the end, J; nan if there is nothing between."""
    return time_mean(trace, temperature(series(trace), trace.start.number), since)


def ideal_gas_ratio(trace: Trace, since: float = 0.0) -> float:
    """P V / (N T) from a time (s) to the end, with the temperature's mean; 1 for an ideal gas."""
    scene, warm = trace.start, mean_temperature(trace, since)
    area = math.pi * scene.container_radius**2
    return mean_pressure(trace, since) * area / (scene.number * warm) if warm > 0 else math.nan


def time_mean(trace: Trace, values: Array, since: float = 0.0) -> float:
    """Mean over time of what the rows of the series say, from a time (s) to the end; or nan."""
    if not trace.stop.time > since:
        return math.nan
    return float(time_means(trace, values, np.array([since, trace.stop.time]))[0])


def at_collisions(trace: Trace, most: int = 2000) -> States:
    """The states at time zero and after each collision; evenly thinned to at most ``most``.

    Raises ``ValueError`` if the trace has no events.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no states to show")
    rows = np.unique(np.linspace(0, len(trace.events), most).astype(int))
    if len(trace.events) < most:
        rows = np.arange(len(trace.events) + 1)
    return replay(trace, np.concatenate([[0.0], trace.events.time])[rows])


def momentum(states: States, scene: Scene) -> Array:
    """Total momentum of balls and container, from the states; (*t*, 2), kg m/s.

    A fixed container's momentum is not a number, and is left out.
    """
    total = np.einsum("tic,i->tc", states.velocities, scene.masses)
    if scene.free:
        total = total + scene.container_mass * states.container_velocities
    return np.asarray(total)


def central_distances(states: States) -> Array:
    """Distances of the balls from the container's centre; (*t* *N*,), m."""
    offsets = states.positions - states.container_positions[:, None]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def pair_distances(states: States) -> Array:
    """Distances of the centres of all pairs of balls; (*t* *N*(*N*-1)/2,), m."""
    first, second = np.triu_indices(states.positions.shape[1], k=1)
    offsets = states.positions[:, first] - states.positions[:, second]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def sampling_times(trace: Trace, collisions_between: float = 5.0, since: float = 0.0) -> Array:
    """Fixed times, apart by some collisions a ball, at which speeds are nearly independent.

    They count from ``since`` (s), which is not among them: there is none before balls have met so
    often. Never at events: those are biased towards fast balls.
    """
    length, pairs = trace.stop.time - since, float(trace.pair_events)
    if since > 0:
        pairs = gained(trace, series(trace).pair_events, since)
    if not (pairs > 0 and length > 0):
        return np.empty(0)
    interval = length * (collisions_between * trace.start.number / 2) / pairs
    times = since + np.arange(1, int(length / interval) + 1, dtype=np.float64) * interval
    return np.asarray(np.minimum(times, trace.stop.time))


def speeds(trace: Trace, times: Array) -> Array:
    """Speeds of all balls at given times; (*t*, *N*), m/s."""
    velocities = replay(trace, times).velocities
    return np.asarray(np.hypot(velocities[..., 0], velocities[..., 1]))


def reduced_speed_counts(trace: Trace, since: float = 0.0) -> NDArray[np.int64]:
    """Balls by reduced speed v sqrt(m/2T), over the sampling times, in bins of ``SPEED_BIN``."""
    times = sampling_times(trace, since=since)
    if trace.summary is not None:
        rows = np.searchsorted(trace.summary.series.time, times, side="right") - 1
        return np.asarray(trace.summary.speed_histogram[np.unique(rows)].sum(axis=0))
    velocities = replay(trace, times).velocities
    energies = 0.5 * trace.start.masses * np.sum(velocities**2, axis=2)
    means = energies.mean(axis=1, keepdims=True)
    reduced = np.sqrt(energies / np.where(means > 0, means, 1.0))
    bins = np.minimum((reduced / SPEED_BIN).astype(int), SPEED_BINS - 1)
    return np.bincount(bins.ravel(), minlength=SPEED_BINS)
