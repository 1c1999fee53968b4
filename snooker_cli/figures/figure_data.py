"""A picture as plain data: layers of numbers with their meaning, no drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.observables import instants
from snooker_cli.formatting import plain

if TYPE_CHECKING:
    from numpy.typing import NDArray


Array: TypeAlias = NDArray[np.float64]

NEUTRAL = -1
"""The series of what belongs to no series: the ideal gas, a limit, a law for all of them."""


@dataclass(frozen=True, eq=False)
class _Layer:
    """Something on the axes; its arrays become read-only copies."""

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, np.ndarray):
                value = np.array(value, dtype=np.float64)
                value.setflags(write=False)
                object.__setattr__(self, each.name, value)


@dataclass(frozen=True, eq=False)
class Line(_Layer):
    """A curve through (x, y).

    label : its entry in the legend, if any
    series : which series it belongs to, from 0: the same number has the same colour
    style : "series" for a dash pattern of its own, or one shared by all series
    steps : whether y stays as it is until the next x
    broad : whether it is drawn wide and pale, so that what lies on it leaves it visible
    """

    x: Array
    y: Array
    label: str | None = None
    series: int = 0
    style: Literal["series", "solid", "dashed", "dashdot", "dotted"] = "series"
    steps: bool = False
    broad: bool = False


@dataclass(frozen=True, eq=False)
class Band(_Layer):
    """The area between two curves, ``low`` and ``high``, over x."""

    x: Array
    low: Array
    high: Array
    label: str | None = None
    series: int = 0


@dataclass(frozen=True, eq=False)
class Points(_Layer):
    """Markers at (x, y), with error bars where errors are given."""

    x: Array
    y: Array
    x_error: Array | None = None
    y_error: Array | None = None
    label: str | None = None
    series: int = 0
    filled: bool = True


@dataclass(frozen=True, eq=False)
class Histogram(_Layer):
    """An outline of bins: ``edges`` has one element more than ``heights``."""

    edges: Array
    heights: Array
    label: str | None = None
    series: int = 0


@dataclass(frozen=True, eq=False)
class Reference(_Layer):
    """A straight line across the axes at one value of x or y."""

    axis: Literal["x", "y"]
    value: float
    label: str | None = None


@dataclass(frozen=True, eq=False)
class Note(_Layer):
    """A line of text on the plot."""

    text: str


Layer: TypeAlias = Line | Band | Points | Histogram | Reference | Note


@dataclass(frozen=True, eq=False)
class FigureData:
    """What a figure shows.

    kind : its name in the registry
    title, x_label, y_label : with units
    layers : from the back to the front
    caption : one to three sentences, written from ``numbers``
    numbers : the key numbers, as JSON has them: what is not finite is ``None``
    x_limits, y_limits : (low, high), either ``None`` to fit the data
    """

    kind: str
    title: str
    x_label: str
    y_label: str
    layers: tuple[Layer, ...]
    caption: str
    numbers: dict[str, Any] = field(default_factory=dict)
    x_log: bool = False
    y_log: bool = False
    x_limits: tuple[float | None, float | None] = (None, None)
    y_limits: tuple[float | None, float | None] = (None, None)

    def __post_init__(self) -> None:
        object.__setattr__(self, "numbers", plain(self.numbers))


# The curves of several repeats -> those curves at common times, and a band around their mean.

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


# A repeat's rows that are worth showing.

MOST_VERTICES = 1000


def thinned(time: Array, most: int = MOST_VERTICES) -> NDArray[np.intp]:
    """At most so many rows, an instant each, evenly, with the last and, but for ties, the first."""
    rows = instants(time)
    return np.asarray(rows[np.linspace(0, len(rows) - 1, min(len(rows), most)).astype(np.intp)])
