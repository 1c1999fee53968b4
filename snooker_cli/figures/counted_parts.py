"""The part of each repeat that means are over, as in ``snooker compare``; means in windows."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.gas import Gas
from snooker_cli.analysis.measurement import WINDOWS
from snooker_cli.analysis.quantities import Quantity
from snooker_cli.analysis.stationarity import stationary_part_of
from snooker_cli.analysis.time_series import Averages, interpolated
from snooker_cli.config import Point
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import Array
from snooker_cli.figures.series import gas_type_of
from snooker_cli.formatting import counted, least_to_most
from snooker_cli.trace import Trace

ROUNDING = 1e-12
"""Share of its end by which the last window may pass the end of a repeat."""


class CountedParts:
    """The part of each repeat of a figure's points over which means are taken.

    It is that of ``snooker compare``: the stationary part of a gas that walls keep warm, in its
    complete repeats; of others the part after the relaxation, in the repeats that are long enough.
    Where ``compare`` has no mean, it is the second half, and all of the time. Means of the source
    report are over all of the time.

    changing : indices of the points that walls keep warm and that are not stationary
    """

    def __init__(self, build: FigureBuilder) -> None:
        self.build, self.changing = build, set[int]()
        self._parts: dict[int, tuple[Gas, NDArray[np.bool_]]] = {}
        self._lasts: list[int] = []
        self._unsure = self._short = self._relaxed = 0
        for point in build.points:
            warm = gas_type_of(point) == "warm"
            self._parts[point.index] = self._warm(point) if warm else self._cold(point)

    def _warm(self, point: Point) -> tuple[Gas, NDArray[np.bool_]]:
        measurement = self.build.measurement(point)
        part = stationary_part_of(measurement)
        if part.changes:
            self.changing.add(point.index)
        first = part.first_window
        self._unsure += first is None
        first = WINDOWS // 2 if first is None else first
        self._lasts.append(100 - 100 * first // WINDOWS)
        used = measurement.complete
        used = used if used.any() else ~used
        return Gas(measurement.chosen(used), first_window=first), used

    def _cold(self, point: Point) -> tuple[Gas, NDArray[np.bool_]]:
        measurement = self.build.measurement(point)
        used = np.isfinite(measurement.relaxed.length)
        if used.any() and not self.build.source:
            self._relaxed += 1
            return Gas(measurement.chosen(used)), used
        self._short += not self.build.source
        return Gas(measurement, first_window=0), np.ones_like(used)

    def gas(self, point: Point) -> Gas:
        """The repeats of a point that count, with means over this part."""
        return self._parts[point.index][0]

    def averages(self, point: Point) -> Averages:
        """Averages over this part of the repeats that count."""
        return self.gas(point).means

    def traces(self, point: Point) -> Iterator[tuple[Trace, float]]:
        """The repeats of a point that count, and when the part begins in each, s."""
        gas, used = self._parts[point.index]
        kept = (trace for trace, there in zip(self.build.traces(point), used, strict=True) if there)
        for trace, length in zip(kept, gas.means.length, strict=True):
            yield trace, max(0.0, trace.stop.time - float(length))

    @property
    def text(self) -> str:
        """A sentence on the parts of all points."""
        sentences = []
        if self._lasts:
            span = least_to_most(self._lasts, str)
            points = f" (not confirmed for {counted(self._unsure, 'point')})" * bool(self._unsure)
            sentences.append(f"Steady part: the last {span} % of each repeat{points}.")
        if self._relaxed:
            sentences.append("Means are over the part after the relaxation.")
        if self._short:
            where = f" of {counted(self._short, 'point')}" * (self._relaxed > 0)
            sentences.append(f"The repeats{where} are too short to relax; they count as a whole.")
        return " ".join(sentences)


def measured(gas: Gas, quantity: Quantity) -> Array:
    """The values of a quantity in the repeats that count, as ``snooker compare`` has them."""
    assert quantity.measured is not None
    return quantity.measured(gas)


def window_edges(along: Array, number: int = WINDOWS) -> Array:
    """Edges (*n* + 1,) of equal windows, up to the median end of the repeats.

    along : (*repeats*, *rows*) of a curve, such as its times
    """
    return np.linspace(0.0, float(np.median(along[:, -1])), number + 1)


def increments(edges: Array, along: Array, values: Array) -> Array:
    """What values of the rows of curves gain between edges: (*repeats*, *n*).

    It is nan after the end of a repeat.
    """
    found = np.diff(interpolated(edges, along, values), axis=1)
    found[edges[1:] > along[:, -1:] * (1 + ROUNDING)] = np.nan
    return found
