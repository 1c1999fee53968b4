"""A figure as plain data: layers of numbers with their meaning, nothing drawn."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.observables import instants, standard_errors
from snooker_cli.errors import FigureError
from snooker_cli.formatting import listed, plain
from snooker_cli.options import LOG_X, LOG_Y
from snooker_cli.trace import even_choice

Array: TypeAlias = NDArray[np.float64]
Course: TypeAlias = tuple[Array, Array]  # times (s) and values

LineStyle: TypeAlias = Literal["solid", "dashed", "dashdot", "dotted"]
"""A dash pattern: it says what a line is. Series have colours and markers instead."""

MEASURED: LineStyle = "solid"
SECOND: LineStyle = "dashdot"
BY_THEORY: LineStyle = "dashed"
EXTRAPOLATED: LineStyle = "dotted"
"""What the dashes of a line mean in every figure: a measurement; a second quantity of the same
series, or a second form of its theory; the theory of this gas; a limit, such as N → ∞, or a fit."""

MOST_ENTRIES = 4  # names of series at lines or in a legend; more shades are a colour scale

NEUTRAL = -1
"""The series of layers that belong to no series: the ideal gas, a limit, a law for all of them."""


@dataclass(frozen=True, eq=False)
class Line:
    """A curve through (x, y).

    label : its entry in the legend, if any
    series : the number of its series, from 0; it decides the colour
    steps : whether y stays as it is until the next x
    broad : whether it is drawn wide and pale, so that lines on it leave it visible
    thin : whether it is drawn thin, as a mean of fewer than half of the repeats
    """

    x: Array
    y: Array
    label: str | None = None
    series: int = 0
    style: LineStyle = MEASURED
    steps: bool = False
    broad: bool = False
    thin: bool = False


@dataclass(frozen=True, eq=False)
class Band:
    """The area between two curves, ``low`` and ``high``, over x; steps: as of ``Line``."""

    x: Array
    low: Array
    high: Array
    label: str | None = None
    series: int = 0
    steps: bool = False


@dataclass(frozen=True, eq=False)
class Repeats:
    """Thin curves of single repeats, rows (*n*, *x*) over x, behind the mean of their series.

    A row is nan where its repeat has ended.
    """

    x: Array
    rows: Array
    label: str | None = None
    series: int = 0


@dataclass(frozen=True, eq=False)
class Points:
    """Markers at (x, y), with error bars of y where the error is not nan."""

    x: Array
    y: Array
    y_error: Array | None = None
    label: str | None = None
    series: int = 0
    filled: bool = True


@dataclass(frozen=True, eq=False)
class Reference:
    """A straight line across the axes at one value of x or y."""

    axis: Literal["x", "y"]
    value: float
    label: str | None = None
    style: LineStyle = MEASURED


Layer: TypeAlias = Line | Band | Repeats | Points | Reference


@dataclass(frozen=True, eq=False)
class Panel:
    """Axes below others with the same x: their layers, y label, and whether y is logarithmic."""

    layers: tuple[Layer, ...]
    label: str
    log: bool = False


@dataclass(frozen=True, eq=False)
class Picture:
    """The balls in their container at one time, s. Places are seen from its centre, in m.

    places, radii : (*N*, 2) and (*N*,)
    values : (*N*,), what the colours show
    cells : (*rows*, *columns*), the value of each cell of an even grid if the colours show these,
        0 in one without balls
    outline : (*n*, 2), corners of the container
    size : width and height around the container
    periodic : whether it repeats along x and along y
    """

    time: float
    places: Array
    radii: Array
    values: Array
    outline: Array
    size: tuple[float, float]
    periodic: tuple[bool, bool]
    cells: Array | None = None


@dataclass(frozen=True, eq=False)
class Wall:
    """The walls of one law.

    lines : (*n*, 2, 2), m, seen from the centre
    name : in the key
    heat : the rank of its temperature from 0 to 1 among all walls; ``None`` of other walls
    drives : whether it moves inwards at each hit
    """

    lines: Array
    name: str
    heat: float | None = None
    drives: bool = False


@dataclass(frozen=True, eq=False)
class Pictures:
    """Pictures side by side, whose colours mean the same.

    label : what the colours show, with its unit
    limits : the values of the first and the last colour
    names : of the values 0, 1, 2 … if they are no scale
    high_is_dark : whether the colours are darkest at the highest value, as of a density; below the
        lowest one is white, as space without balls
    walls : those that a key names, since they give energy or are not all alike
    """

    each: tuple[Picture, ...]
    label: str
    limits: tuple[float, float]
    names: tuple[str, ...] = ()
    high_is_dark: bool = False
    walls: tuple[Wall, ...] = ()


@dataclass(frozen=True, eq=False)
class FigureData:
    """What a figure shows.

    kind : its name in the registry
    title, x_label, y_label : with units
    layers : from the back to the front
    caption : at most five lines
    numbers : the key numbers, as JSON has them: what is not finite is ``None``
    result : the quantity of the result, its unit, and the names of its number and of the theory's;
        empty without one
    x_limits, y_limits : (low, high); ``None`` fits the data
    equal_axes : whether a metre is as long in y as in x
    y_names : names of y = 0, 1, 2 … from the top, instead of a scale; each has a line of its own
    shades : the rank of each series in a sequential palette, from 0 to 1; empty: other colours
    hues : the number of the colour of each series, of which ``shades`` are pale; empty: one palette
    hue_names : what each of these colours stands for, if the labels of the series say no more than
        these and ``scale``: a legend of both is shorter
    scale, scale_label : the value of each series in these shades as a text, and what it is, if the
        labels of the series say no more; many of them are a colour scale instead of a legend
    panel, panel_label : layers of lower axes with the same x and a linear y, such as residuals, and
        their y label
    panels : further axes between these two
    pictures : of states, instead of axes
    left_of_x : whether markers of several series at one x stand left of it, beside each other
    """

    kind: str
    title: str
    x_label: str
    y_label: str
    layers: tuple[Layer, ...]
    caption: str
    numbers: dict[str, Any] = field(default_factory=dict)
    result: dict[str, str] = field(default_factory=dict)
    x_log: bool = False
    y_log: bool = False
    x_limits: Sequence[float | None] = (None, None)
    y_limits: Sequence[float | None] = (None, None)
    equal_axes: bool = False
    y_names: Sequence[str] = ()
    shades: Sequence[float] = ()
    hues: Sequence[int] = ()
    hue_names: Sequence[str] = ()
    scale: Sequence[str] = ()
    scale_label: str = ""
    panel: tuple[Layer, ...] = ()
    panel_label: str = ""
    panels: tuple[Panel, ...] = ()
    pictures: Pictures | None = None
    left_of_x: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "numbers", plain(self.numbers))

    @property
    def all_panels(self) -> tuple[Panel, ...]:
        """The axes below the first ones, from above."""
        return (*self.panels, *([Panel(self.panel, self.panel_label)] if self.panel else []))

    @property
    def alt(self) -> str:
        """The figure in a sentence, for readers who cannot see it: title, axes and legend."""
        if self.pictures is not None:
            return f"{self.title}. The colour of a ball shows: {self.pictures.label}."
        scales = [" (logarithmic)" if log else "" for log in (self.y_log, self.x_log)]
        axes = f"{self.y_label}{scales[0]} against {self.x_label}{scales[1]}"
        labels = [panel.label for panel in self.all_panels]
        below = f". Below: {listed(labels)}" if labels else ""
        layers = [*self.layers, *(layer for panel in self.all_panels for layer in panel.layers)]
        legend = "; ".join(dict.fromkeys(layer.label for layer in layers if layer.label))
        return f"{self.title}. {axes}{below}{f'. Legend: {legend}' if legend else ''}."


LOG_MARGIN = 1.2  # the least value over the lower limit of a logarithmic axis


def with_logarithmic_axes(data: FigureData, x: bool, y: bool) -> FigureData:
    """The figure with logarithmic axes where wanted; their limits then fit the data.

    Zeros, such as the start of the time or empty bins, have no place on such an axis and are not
    shown. The panel keeps its y axis. Raises ``FigureError`` if a value is negative, or none is
    positive, and for axes on which a metre is as long in y as in x.
    """
    changes: dict[str, Any] = {}
    for axis, option, wanted in (("x", LOG_X, x), ("y", LOG_Y, y)):
        if not wanted or getattr(data, f"{axis}_log"):
            continue
        if data.equal_axes:
            raise FigureError(f"it shows places, on axes of one scale; leave out {option}")
        shown = [layer for layer in data.layers if isinstance(layer, Line | Points)]
        values = np.concatenate([np.empty(0), *(getattr(layer, axis) for layer in shown)])
        values = values[np.isfinite(values)]
        if np.any(values < 0) or not np.any(values > 0):
            has = f"its least is {values.min():.3g}" if len(values) else "there is none"
            raise FigureError(f"{option} needs positive values of {axis}, and {has}; leave it out")
        changes[f"{axis}_log"] = True
        # Theory may fall by hundreds of decades where nothing is measured.
        panels = [layer for panel in data.all_panels for layer in panel.layers]
        below = [layer for layer in panels if isinstance(layer, Points) and axis == "x"]
        measured = [getattr(layer, axis) for layer in (*shown, *below) if layer.series != NEUTRAL]
        least = [row[row > 0].min() / LOG_MARGIN for row in measured if np.any(row > 0)]
        changes[f"{axis}_limits"] = min(least, default=None), None
    if changes.get("y_log"):
        changes["layers"] = tuple(
            replace(layer, y=np.where(layer.y > 0, layer.y, math.nan))
            if isinstance(layer, Points)
            else layer
            for layer in data.layers
        )
    return replace(data, **changes)


def legend_line(text: str, style: LineStyle) -> Line:
    """A legend's entry for a line style that all series share."""
    return Line(np.empty(0), np.empty(0), text, NEUTRAL, style)


def legend_marker(text: str, *, filled: bool = True) -> Points:
    """A legend's entry for markers that all series have, filled or open."""
    return Points(np.empty(0), np.empty(0), None, text, NEUTRAL, filled)


def markers(
    x: Array, y: Array, error: Array, label: str | None, series: int, apart: NDArray[np.bool_]
) -> list[Points]:
    """Markers, which are open where they are ``apart``; the filled ones have the name, if any.

    error : nan without one
    """
    found = []
    for filled, own in ((True, ~apart), (False, apart)):
        if own.any():
            bars = error[own] if np.isfinite(error[own]).any() else None
            named = label if filled or apart.all() else None
            found.append(Points(x[own], y[own], bars, named, series, filled))
    return found


def level(
    x: Array, y: float, series: int, style: LineStyle = BY_THEORY, label: str | None = None
) -> Line:
    """A straight line of one value from the first x to the last."""
    return Line(x[[0, -1]], np.array([y, y]), label, series, style)


def level_band(x: Array, y: float, error: float, series: int) -> Band:
    """The band of the error of such a line."""
    low, high = (np.full(2, y + sign * error) for sign in (-1, 1))
    return Band(x[[0, -1]], low, high, None, series)


def mean_layers(x: Array, rows: Array, series: int = 0) -> tuple[Layer, ...]:
    """The mean of rows (*repeats*, *x*), and behind it the band of its standard error."""
    mean, line = rows.mean(axis=0), Line(x, rows.mean(axis=0), None, series)
    if len(rows) < 2:
        return (line,)
    error = standard_errors(rows)
    return Band(x, mean - error, mean + error, None, series), line


# The curves of several repeats -> those curves at common times, and a band around their mean.

DECADES = 1e6  # the last place of a curve over the first one above zero
COMMON_TIMES = 300  # times at which repeats are compared
MOST_VERTICES = 1000  # vertices of a line at most


def courses(times: Array, values: Array) -> list[Course]:
    """Each row of arrays (*repeats*, *rows*), without rows that repeat the last time."""
    pairs = zip(times, values, strict=True)
    later = [(np.append(True, np.diff(time) > 0), time, value) for time, value in pairs]
    return [(time[rows], value[rows]) for rows, time, value in later]


def places(first: float, last: float, number: int) -> Array:
    """Places (*n*,) of a curve: even ones, and from zero on those of a logarithmic axis too."""
    even = np.linspace(first, last, number)
    if first != 0.0 or not last > 0.0:
        return even
    return np.union1d(even, np.geomspace(last / DECADES, last, number // 2))


def lasting(curves: Sequence[Course]) -> list[Course]:
    """The curves of the repeats that last at least half as long as the median of all."""
    ends = np.array([time[-1] for time, _ in curves])
    return [curve for curve, end in zip(curves, ends, strict=True) if end >= np.median(ends) / 2]


def at_common_times(curves: Sequence[Course]) -> Course:
    """Times (*t*,) from the latest start to the earliest end, and the curves there (*n*, *t*).

    One curve has an even choice of its own times.
    """
    if len(curves) == 1:
        time, values = curves[0]
        kept = thinned(time)
        return time[kept], values[np.newaxis, kept]
    first = max(float(time[0]) for time, _ in curves)
    last = min(float(time[-1]) for time, _ in curves)
    times = places(first, last, COMMON_TIMES)
    return times, np.array([np.interp(times, time, values) for time, values in curves])


def remaining(curves: Sequence[Course]) -> Course:
    """Times (*t*,) from the latest start until two curves remain, and the curves there (*n*, *t*).

    A curve is nan after its end. One curve has an even choice of its own times.
    """
    if len(curves) == 1:
        return at_common_times(curves)
    first = max(float(time[0]) for time, _ in curves)
    last = sorted(float(time[-1]) for time, _ in curves)[-2]
    times = places(first, max(first, last), COMMON_TIMES)
    rows = [np.interp(times, time, values, right=math.nan) for time, values in curves]
    return times, np.array(rows)


def mean_of_remaining(rows: Array) -> tuple[Array, Array]:
    """Means of rows (*n*, *t*) with nan, and their standard errors, which are nan for one row."""
    mean, deviation, number = _mean_and_deviation(rows)
    return mean, np.where(number > 1, deviation / np.sqrt(np.maximum(number, 1)), math.nan)


def _mean_and_deviation(rows: Array) -> tuple[Array, Array, NDArray[np.intp]]:
    """Means of rows (*n*, *t*) with nan, their standard deviations, and how many are known.

    A mean of none is nan, and the deviation of one is zero.
    """
    known = np.isfinite(rows)
    number = known.sum(axis=0)
    mean = np.where(known, rows, 0.0).sum(axis=0) / np.where(number, number, math.nan)
    squares = np.where(known, (rows - mean) ** 2, 0.0).sum(axis=0)
    return mean, np.sqrt(squares / np.maximum(number - 1, 1)), number


def lasting_rows(x: Array, rows: Array) -> tuple[Array, Array]:
    """The rows (*n*, *t*, …) of `lasting` repeats, until the first of these ends.

    A row is nan from its end on. What a figure states as a result is of the same repeats at all x.
    One repeat that ends at once would leave nothing of the others.
    """
    ends = last_known(rows)
    kept = x[ends] >= np.median(x[ends]) / 2
    until = int(ends[kept].min()) + 1
    return x[:until], rows[kept, :until]


def last_known(rows: Array) -> NDArray[np.intp]:
    """The last place of each row (*n*, *t*, …) that is finite; the last of all without one."""
    known: NDArray[np.bool_] = np.any(np.isfinite(rows).reshape(*rows.shape[:2], -1), axis=2)
    return np.asarray(rows.shape[1] - 1 - np.argmax(known[:, ::-1], axis=1))


def bands(
    curves: Sequence[Course],
    series: int,
    label: str | None = None,
    *,
    logarithmic: bool = False,
) -> list[Band]:
    """The band mean ± standard deviation of curves, as long as two remain; none without a span.

    logarithmic : whether mean and deviation are those of ln y, which needs y > 0
    """
    times, rows = remaining(curves)
    if len(rows) < 2 or not times[-1] > times[0]:
        return []
    mean, deviation, _ = _mean_and_deviation(np.log(rows) if logarithmic else rows)
    low, high = mean - deviation, mean + deviation
    low, high = (np.exp(low), np.exp(high)) if logarithmic else (low, high)
    return [Band(times, low, high, label, series)]


def more_than_a_decade(columns: Iterable[Array]) -> bool:
    """Whether values above zero cover a factor of more than ten, so that a logarithm shows more."""
    values = np.concatenate(list(columns))
    values = values[np.isfinite(values)]
    return bool(len(values) and 0 < 10 * values.min() < values.max())


def thinned(time: Array) -> NDArray[np.intp]:
    """An even choice of at most ``MOST_VERTICES`` rows, one per instant, the first and the last."""
    rows = instants(time)
    return np.asarray(rows[even_choice(len(rows), MOST_VERTICES)])
