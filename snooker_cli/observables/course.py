"""A trace -> its series over time: thinned, without a collapse, after collisions, between times."""

from __future__ import annotations

import math
import weakref
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import engine
from snooker_cli.trace import SERIES_UNITS, Series, StopReason, Summary

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.trace import Trace

    Array = NDArray[np.float64]

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
