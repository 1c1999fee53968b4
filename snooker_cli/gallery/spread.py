"""The curves of several repeats -> those curves at common times, and a band around their mean."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from snooker_cli.gallery.picture import Array, Band

GRID = 300
"""Times at which repeats are compared."""

SPREAD = "mean ± standard deviation of a repeat"
"""What a band shows."""


def at_common_times(
    curves: Sequence[tuple[Array, Array]], *, steps: bool = False
) -> tuple[Array, Array]:
    """Times (*t*,) from the latest start to the earliest end, and the curves there (*n*, *t*).

    steps : whether a curve stays as it is up to its next time, instead of being straight between
    """
    first = max(float(time[0]) for time, _ in curves)
    last = min(float(time[-1]) for time, _ in curves)
    grid = np.linspace(first, last, GRID)
    rows = [
        values[np.searchsorted(time, grid, side="right") - 1]
        if steps
        else np.interp(grid, time, values)
        for time, values in curves
    ]
    return grid, np.array(rows)


def bands(times: Array, table: Array, series: int, label: str | None = None) -> list[Band]:
    """The band of several repeats; none for one, or if they have no time in common."""
    if len(table) < 2 or not times[-1] > times[0]:
        return []
    mean, deviation = table.mean(axis=0), table.std(axis=0, ddof=1)
    return [Band(times, mean - deviation, mean + deviation, label, series)]
