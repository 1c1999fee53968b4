"""A trace -> temperature, pressure, momentum, distances and speeds."""

from __future__ import annotations

import math
import weakref
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from snooker_cli import engine
from snooker_cli.engine import States, replay
from snooker_cli.trace import SERIES_UNITS, SPEED_BIN, SPEED_BINS, Series, StopReason, Summary

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Events, Series, Trace

    Array = NDArray[np.float64]


# A trace -> its series over time: thinned, without a collapse, after collisions, between times.

INSTANT = 1e-9
"""Collisions nearer than this share of the time since the start are at one instant: a collapse has
thousands of them."""

MOST_POINTS = 2**16
"""Collisions after which a curve has a point; of more, evenly so many."""

MOST_MEASURED = 2**28
"""Balls times collisions that are measured, about a second's work: of more collisions evenly so
many, some thousands of them for a hundred thousand balls."""

MOST_ROWS = 2**22
"""Collisions that are measured at most; their series takes some 300 megabytes."""

_remembered: tuple[weakref.ref[Trace], Series] | None = None


def series(trace: Trace) -> Series:
    """The observables at time zero and after each collision; a summary's on its grid.

    Of more collisions than ``MOST_ROWS``, or ``MOST_MEASURED`` / *N*, there is a row after every
    few. Those of the repeat asked for last are remembered: an analysis asks again and again.
    """
    global _remembered
    if _remembered is not None and _remembered[0]() is trace:
        return _remembered[1]
    most = min(MOST_ROWS, MOST_MEASURED // trace.start.number)
    found = engine.series(trace, max(2, most))
    _remembered = weakref.ref(trace), found
    return found


def instants(time: Array) -> NDArray[np.intp]:
    """The last row of each instant: collisions go on while a collapse's clock stands still."""
    return np.flatnonzero(np.append(np.diff(time) > INSTANT * time[1:], True))


def before_collapse(trace: Trace) -> Trace:
    """The repeat without the collisions of a collapse, at the instant where its clock stands still.

    Of a summary the part up to the last row of its grid before that is left.
    """
    if trace.stop.reason is not StopReason.COLLAPSE:
        return trace
    events, summary, end = trace.events, trace.summary, trace.stop.time
    if summary is None:
        if events is None:
            raise ValueError("this repeat has neither events nor a summary")
        kept = int(np.count_nonzero(events.time < (1 - INSTANT) * end))
        events = events[:kept]
        at_wall = int(np.count_nonzero(events.at_wall))
        counts = at_wall, kept - at_wall
    else:
        found = summary.series
        rows = max(1, int(np.count_nonzero(found.time < (1 - INSTANT) * end)))
        calm = Series(*(column[:rows] for column in vars(found).values()))
        summary, end = Summary(calm, summary.speed_histogram[:rows]), float(calm.time[-1])
        counts = int(calm.wall_events[-1]), int(calm.pair_events[-1])
    return replace(
        trace,
        stop=replace(trace.stop, time=end),
        wall_events=counts[0],
        pair_events=counts[1],
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


def so_far(trace: Trace, column: Array, times: Array) -> Array:
    """A column of the series that only collisions add to, such as the wall's impulse, at times.

    At the time of a collision it is that after it; between the rows of a summary, or of a series
    without all collisions, it is straight.
    """
    known = series(trace).time
    if not _has_all(trace):
        return np.asarray(np.interp(times, known, column))
    return np.asarray(column[np.searchsorted(known, times, side="right") - 1])


def gained(trace: Trace, column: Array, since: float) -> float:
    """What collisions add to a column of the series after a time (s); all of it if that is 0."""
    before = so_far(trace, column, np.array([since]))[0] if since > 0 else 0.0
    return float(column[-1] - before)


def integrals(trace: Trace, values: Array, times: Array) -> Array:
    """Integrals over time, from the start to each time (s), of what the rows of the series say.

    After a collision it stays as it is; between the rows of a summary, or of a series without all
    collisions, it is straight.
    """
    first = values[0]
    return np.asarray(first * times + _changes(trace, values, times))


def time_means(trace: Trace, values: Array, edges: Array) -> Array:
    """Means over time between the edges (s) of what the rows of the series say, see `integrals`.

    Each is made of its own window alone: what went before may be larger by any factor.
    """
    if len(edges) < 2:
        return np.empty(0)
    known = series(trace).time
    inside = known[(known > edges[0]) & (known < edges[-1])]
    times = np.union1d(inside, edges)
    if _has_all(trace):
        held = values[np.searchsorted(known, times[:-1], side="right") - 1]
    else:
        read = np.interp(times, known, values)
        held = (read[:-1] + read[1:]) / 2
    windows = np.searchsorted(times, edges[:-1])
    least = np.minimum.reduceat(held, windows)  # of what does not change the mean, without rounding
    above = held - np.repeat(least, np.diff(np.append(windows, len(held))))
    return np.asarray(least + np.add.reduceat(above * np.diff(times), windows) / np.diff(edges))


def _changes(trace: Trace, values: Array, times: Array) -> Array:
    """Integrals of values less the first, so that what does not change has one without rounding."""
    time, first = series(trace).time, values[0]
    if _has_all(trace):
        time, values = np.append(time, trace.stop.time), np.append(values, values[-1])
        held = values[:-1]
    else:
        held = (values[:-1] + values[1:]) / 2
        if time[-1] < trace.stop.time:
            # After the last collision.
            time, held = np.append(time, trace.stop.time), np.append(held, values[-1])
    integral = np.concatenate([[0.0], np.cumsum((held - first) * np.diff(time))])
    return np.asarray(np.interp(times, time, integral))


def time_mean(trace: Trace, values: Array, since: float = 0.0) -> float:
    """Mean over time of what the rows of the series say, from a time (s) to the end; or nan."""
    if not trace.stop.time > since:
        return math.nan
    return float(time_means(trace, values, np.array([since, trace.stop.time]))[0])


def _has_all(trace: Trace) -> bool:
    """Whether the series has a row for every collision."""
    return trace.events is not None and len(series(trace).time) == len(trace.events) + 1


# A trace -> energy, temperature and pressure, over time and as means.

Real = TypeVar("Real", float, "NDArray[np.float64]")

ROUNDING = 1e-12
"""Relative spread below which repeats differ by nothing but rounding."""


def temperature(found: Series, number: int) -> Array:
    """Temperature by equipartition in two dimensions, T = <KE>, J (k_B = 1)."""
    return found.kinetic_energy / number


def total_energy(scene: Scene) -> float:
    """Kinetic energy of the balls and the container, J."""
    return scene.kinetic_energy + scene.container_energy


def losses(start: Scene, events: Events) -> float:
    """Energy that collisions take, J: the sum of (1 - e)/(1 + e) J^2/(2 mu).

    Of a run without lasting contacts, elastic slow collisions and sliding balls.
    """
    masses = np.append(start.masses, start.container_mass)  # j = -1 is the last
    e = np.where(events.at_wall, start.wall_restitution, start.restitution)
    inverse = 1 / masses[events.i] + 1 / masses[events.j]
    return float(np.sum((1 - e) / (1 + e) * events.impulse**2 * inverse / 2))


def total_momentum(scene: Scene) -> Array:
    """Momentum of the balls and of a free container; (2,), kg m/s."""
    total = scene.masses @ scene.velocities
    return total + scene.container_mass * scene.container_velocity if scene.free else total


def total_angular_momentum(scene: Scene) -> float:
    """Angular momentum about the origin, kg m^2/s; a free container counts as a point mass."""
    (x, y), (u, v) = scene.positions.T, scene.velocities.T
    total = float(np.sum(scene.masses * (x * v - y * u)))
    if scene.free:
        (x, y), (u, v) = scene.container_position, scene.container_velocity
        total += scene.container_mass * float(x * v - y * u)
    return total


def drift_energy(scene: Scene) -> float:
    """Kinetic energy of the balls' centre of mass, p^2/(2 sum m), J; a periodic box keeps it."""
    momentum = scene.masses @ scene.velocities
    return float(momentum @ momentum / (2 * np.sum(scene.masses)))


def meeting_temperature(kinetic_energy: Real, scene: Scene) -> Real:
    """Temperature at which balls meet each other, J.

    In a periodic box the centre of mass keeps its motion, and the rest of the kinetic energy is
    that of N - 1 free velocities; with walls it is `temperature`.
    """
    if scene.container.has_wall or scene.number == 1:
        return kinetic_energy / scene.number
    return (kinetic_energy - drift_energy(scene)) / (scene.number - 1)


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


def elastic(scene: Scene) -> bool:
    """Whether no collision loses energy; a periodic box has none with a wall."""
    walls = not scene.container.has_wall or scene.wall_restitution == 1.0
    return scene.restitution == 1.0 and walls


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


def cumulative_pressure(trace: Trace, found: Series) -> tuple[Array, Array]:
    """Times and the mean pressure since the start, s and Pa m, at the rows of a series.

    The wall's impulse over its length and the time, or what the virial gives in a periodic box.
    Time zero, where it is not defined, is left out.
    """
    scene, later = trace.start, found.time > 0
    time = found.time[later]
    if scene.container.has_wall:
        return time, found.wall_impulse[later] / (scene.container.wall_length * time)
    moving = integrals(trace, series(trace).kinetic_energy, time)
    return time, (moving + found.pair_virial[later] / 2) / (scene.container.area * time)


def window_pressure(trace: Trace, windows: int) -> tuple[Array, Array]:
    """Middles and pressures of equal windows of time over the whole repeat; s and Pa m."""
    edges = _edges(trace, windows)
    found, scene = series(trace), trace.start
    middles, widths = (edges[:-1] + edges[1:]) / 2, np.diff(edges)
    has_wall = scene.container.has_wall
    column = found.wall_impulse if has_wall else found.pair_virial
    gains = np.diff(so_far(trace, column, edges[1:]), prepend=0.0)
    if has_wall:
        return middles, gains / (scene.container.wall_length * widths)
    moving = time_means(trace, found.kinetic_energy, edges)
    return middles, (moving + gains / (2 * widths)) / scene.container.area


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
    """Pressure from a time (s) to the end, Pa m; 0 if there is nothing between.

    That on the wall, or what the virial gives in a periodic box.
    """
    end, scene = trace.stop.time, trace.start
    if not end > since:
        return 0.0
    if not scene.container.has_wall:
        moving = scene.number * mean_temperature(trace, since)
        return (moving + _mean_virial(trace, since) / 2) / scene.container.area
    impulse = gained(trace, series(trace).wall_impulse, since)
    return impulse / (scene.container.wall_length * (end - since))


def mean_temperature(trace: Trace, since: float = 0.0) -> float:
    """Temperature from a time (s) to the end, J; nan if there is nothing between."""
    return time_mean(trace, temperature(series(trace), trace.start.number), since)


def ideal_gas_ratio(trace: Trace, since: float = 0.0) -> float:
    """P V / (N T) from a time (s) to the end, with the temperature's mean; 1 for an ideal gas."""
    scene, warm = trace.start, mean_temperature(trace, since)
    if not warm > 0:
        return math.nan
    return mean_pressure(trace, since) * scene.container.area / (scene.number * warm)


def virial_ratio(trace: Trace, since: float = 0.0) -> float:
    """1 + sum J d / (2 N T t) from a time (s) to the end: Z of the balls, whatever the walls do."""
    moving = trace.start.number * mean_temperature(trace, since)
    return 1 + _mean_virial(trace, since) / (2 * moving) if moving > 0 else math.nan


def _mean_virial(trace: Trace, since: float) -> float:
    """Sum of impulse times distance over pair collisions from a time (s) to the end, per s, J."""
    return gained(trace, series(trace).pair_virial, since) / (trace.stop.time - since)


# States of a trace -> momentum, distances and speeds.

MOST_BALLS = 2**22
"""Balls times states that are held at once, some hundred megabytes."""


def at_collisions(trace: Trace, most: int = 2000) -> States:
    """The states at time zero and after each collision; evenly thinned to at most ``most``.

    Of many balls to fewer, so that they fit in memory. Raises ``ValueError`` if the trace has no
    events.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no states to show")
    most = max(2, min(most, MOST_BALLS // trace.start.number))
    rows = np.unique(np.linspace(0, len(trace.events), most).astype(int))
    if len(trace.events) < most:
        rows = np.arange(len(trace.events) + 1)
    return replay(trace, np.concatenate([[0.0], trace.events.time])[rows])


def momentum(states: States, scene: Scene) -> Array:
    """Total momentum of balls and container, from the states; (*t*, 2), kg m/s.

    A fixed container's momentum is not a number, and is left out; a periodic box has none.
    """
    total = np.einsum("tic,i->tc", states.velocities, scene.masses)
    if scene.free:
        total = total + scene.container_mass * states.container_velocities
    return np.asarray(total)


def central_distances(states: States) -> Array:
    """Distances of the balls from the container's centre; (*t* *N*,), m."""
    offsets = states.positions - states.container_positions[:, None]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def pair_distances(states: States, scene: Scene) -> Array:
    """Distances of the centres of all pairs of balls; (*t* *N*(*N*-1)/2,), m.

    In a periodic box they are those of the nearest images.
    """
    first, second = np.triu_indices(states.positions.shape[1], k=1)
    offsets = states.positions[:, first] - states.positions[:, second]
    offsets = scene.container.nearest_image(offsets)
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


__all__ = [
    "INSTANT",
    "MOST_MEASURED",
    "MOST_POINTS",
    "ROUNDING",
    "after_collisions",
    "at_collisions",
    "before_collapse",
    "central_distances",
    "cumulative_pressure",
    "drift_energy",
    "elastic",
    "energy_ratio",
    "equal_balls",
    "gained",
    "ideal_gas_ratio",
    "instants",
    "integrals",
    "losses",
    "mean_and_error",
    "mean_pressure",
    "mean_temperature",
    "meeting_temperature",
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
    "total_angular_momentum",
    "total_energy",
    "total_momentum",
    "virial_ratio",
    "window_energy",
    "window_pressure",
]
