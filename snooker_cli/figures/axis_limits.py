"""How far a y axis reaches. Measured values decide it; error bars and theories do not.

On a logarithmic axis, an error bar that reaches zero, or a theory that falls by many decades, would
leave no room for the data.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from snooker_cli.figures.figure_data import (
    LOG_MARGIN,
    NEUTRAL,
    Array,
    Band,
    Layer,
    Line,
    Points,
    Reference,
    Repeats,
)

DECADE = 10.0
"""Factor beyond the data, up to which a logarithmic axis shows bars, bands and theories."""

SPANS = 2.0  # the same for a linear axis, in spans of the data or in median bars
MARGIN = 0.05  # margin of a logarithmic axis beyond the data, as a share of their decades


class Outside(NamedTuple):
    """Places (*n*,) on the x axis, where a series leaves the y axis, above or below."""

    x: Array
    above: bool
    series: int


def reach(layers: Sequence[Layer], logarithmic: bool) -> tuple[float, float]:
    """The least and the highest y that an axis of these layers shows; infinite without a limit.

    A linear axis shows error bars and bands as far from the data as twice the data's own span, or
    twice the median bar. A logarithmic one shows them and theories up to a decade from the data.
    """
    values = np.concatenate([np.empty(0), *_data(layers, logarithmic)])
    values = values[np.isfinite(values) & ((values > 0) | (not logarithmic))]
    if not len(values):
        return -math.inf, math.inf
    low, high = float(values.min()), float(values.max())
    if logarithmic:
        ends = np.concatenate([values, *_ends(layers)])
        ends = ends[np.isfinite(ends) & (ends > 0)]
        least, most = max(low / DECADE, float(ends.min())), min(high * DECADE, float(ends.max()))
        margin = (high / low) ** MARGIN
        return min(least / LOG_MARGIN, low / margin), max(most * LOG_MARGIN, high * margin)
    bars = np.concatenate([np.empty(0), *_bars(layers)])
    bars = bars[np.isfinite(bars)]
    far = SPANS * max(high - low, float(np.median(bars)) if len(bars) else 0.0) or math.inf
    return low - far, high + far


def visible(layers: Sequence[Layer], low: float, high: float) -> Iterator[Layer]:
    """The parts of layers between two x; references and single repeats are whole."""
    for layer in layers:
        if isinstance(layer, Reference | Repeats):
            yield layer
            continue
        here = (layer.x >= low) & (layer.x <= high)
        columns = [name for name, value in vars(layer).items() if np.shape(value) == layer.x.shape]
        yield replace(layer, **{name: getattr(layer, name)[here] for name in columns})


def _data(layers: Sequence[Layer], logarithmic: bool) -> Iterator[Array]:
    """The values that decide the axis: lines and markers; if it is logarithmic, measured ones."""
    shown = [layer for layer in layers if isinstance(layer, Line | Points)]
    yield from (layer.y for layer in (measured(shown) if logarithmic else shown))
    yield from (
        np.array([layer.value])
        for layer in layers
        if isinstance(layer, Reference) and layer.axis == "y"
    )


def _ends(layers: Sequence[Layer]) -> Iterator[Array]:
    """All y of lines and bands, and the ends of error bars."""
    for layer in layers:
        if isinstance(layer, Line):
            yield layer.y
        if isinstance(layer, Band):
            yield from (layer.low, layer.high)
        if isinstance(layer, Points) and layer.y_error is not None:
            yield from (layer.y - layer.y_error, layer.y + layer.y_error)


def _bars(layers: Sequence[Layer]) -> Iterator[Array]:
    """The lengths of error bars, and half the widths of bands."""
    for layer in layers:
        if isinstance(layer, Points) and layer.y_error is not None:
            yield layer.y_error
        if isinstance(layer, Band):
            yield (layer.high - layer.low) / 2


def measured(layers: Sequence[Layer]) -> list[Line | Points]:
    """The markers of series; without markers the broad lines; without these the lines of series."""
    drawn = [layer for layer in layers if isinstance(layer, Line | Points)]
    of_series = [layer for layer in drawn if layer.series != NEUTRAL and len(layer.x)]
    points = [layer for layer in of_series if isinstance(layer, Points) and layer.filled]
    broad = [layer for layer in of_series if isinstance(layer, Line) and layer.broad]
    return [*points] or [*broad] or of_series


MANY_DECADES = 100.0
"""A factor between the ends of an axis, from which on a logarithmic one shows more."""

CHANGED = 0.01  # share of its highest value, by which a curve has left its start


def beginning_of_decades(layers: Sequence[Layer]) -> float | None:
    """Where a logarithmic x axis begins, if series span more than two decades of x and of y.

    That is where the first curve has left its start, or the first marker. ``None`` if an axis has
    fewer decades, or values that are not positive.
    """
    begins, ends, values = list[float](), list[float](), list[Array]()
    for layer in measured(layers):
        shown = np.isfinite(layer.y)
        x, y = layer.x[shown], layer.y[shown]
        if not len(x) or np.any(y <= 0) or np.any(x < 0):
            return None
        left = x > 0
        if isinstance(layer, Line):
            left &= np.abs(y - y[0]) > CHANGED * y.max()
        begins += [float(x[left].min())] if left.any() else []
        ends.append(float(x.max()))
        values.append(y)
    if not begins or max(ends) <= MANY_DECADES * min(begins):
        return None
    y = np.concatenate(values)
    return min(begins) if y.max() > MANY_DECADES * y.min() else None


def outside(
    layers: Sequence[Layer], low: float, high: float, least: float | None = None
) -> Iterator[Outside]:
    """Where measured values or their error bars leave an axis from ``low`` to ``high``.

    least : a lower limit that the quantity has by itself, such as 0: bars go beyond it silently
    """
    for layer in measured(layers):
        error = np.zeros_like(layer.y)
        if isinstance(layer, Points) and layer.y_error is not None:
            error = np.nan_to_num(layer.y_error)
        lowest = layer.y - (error if least is None else 0.0)
        for above, beyond in ((True, layer.y + error > high), (False, lowest < low)):
            places = np.flatnonzero(beyond & np.isfinite(layer.y))
            if isinstance(layer, Line):  # the middle of each part of the line
                parts = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
                places = np.array([part[len(part) // 2] for part in parts if len(part)], dtype=int)
            if len(places):
                yield Outside(layer.x[places], above, layer.series)


def farthest(layers: Sequence[Layer], high: float | None) -> float | None:
    """The highest measured value above the upper limit of an axis; ``None`` if all are below."""
    values = np.concatenate([np.empty(0), *(layer.y for layer in measured(layers))])
    top = float(np.max(values[np.isfinite(values)], initial=-math.inf))
    return top if high is not None and top > high else None
