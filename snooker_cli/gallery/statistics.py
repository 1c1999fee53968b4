"""A repeat's means over time, and means over repeats with their standard errors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from snooker_cli.observables import series, temperature, time_mean, window_pressure

if TYPE_CHECKING:
    from snooker_cli.gallery.picture import Array
    from snooker_cli.trace import Trace


def mean_and_error(values: Array) -> tuple[float, float]:
    """Mean and its standard error, nan for fewer than two values."""
    if len(values) < 2:
        return float(values.mean()), math.nan
    return float(values.mean()), float(values.std(ddof=1)) / math.sqrt(len(values))


def mean_pressure(trace: Trace) -> float:
    """Pressure on the wall over the whole repeat, Pa m; 0 if it has no length."""
    end = _end(trace)
    if end == 0:
        return 0.0
    return float(window_pressure(series(trace), trace.start.container_radius, 1, end)[1][0])


def mean_temperature(trace: Trace) -> float:
    """Temperature over the whole repeat, J."""
    found = series(trace)
    return time_mean(found.time, temperature(found, trace.start.number), _end(trace))


def _end(trace: Trace) -> float:
    """Until when the series is known, s: of a summary, the last time of its grid."""
    return trace.stop.time if trace.summary is None else float(trace.summary.series.time[-1])
