"""Whether any quantity changes in the part of the repeats over which `compare` takes its mean.

`stationarity` has the test of one quantity. Here every mean over time is tested in the quarters of
its part, all quantities of a point together by Holm's method: a gas in which nothing changes is
accused with a probability of ``LEAST_PROBABILITY`` at most, however many quantities there are.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from snooker_cli.analysis import theories
from snooker_cli.analysis.decay import Note
from snooker_cli.analysis.gas import Array, Gas, late_quarters
from snooker_cli.analysis.goodness import LEAST_PROBABILITY
from snooker_cli.analysis.measurement import WINDOWS, Measurement
from snooker_cli.analysis.quantities import SPECIES_RATIO, SPIN_RATIO
from snooker_cli.analysis.stationarity import LEAST_REPEATS, change_of
from snooker_cli.analysis.time_series import MEANS, Averages
from snooker_cli.formatting import listed, short

QUARTERS = 4
TESTS = 2  # of a quantity, see `change_of`, which gives the smaller probability
ROUNDING = 1e-9
"""Spread of the changes of repeats, as a share of the mean, below which nothing can be tested."""


class SteadyMeans(NamedTuple):
    """The means of a point that change within their part, and the others.

    changing, steady : names of quantities for which the test refuses that nothing changes, or not
    least : for each of the latter the change that would be found, as `Change.least`
    """

    changing: tuple[str, ...]
    steady: tuple[str, ...]
    least: tuple[float, ...]

    @property
    def note(self) -> Note:
        """What a reader of the means has to know."""
        names = *self.changing, *self.steady
        if not names:
            few = f"the test needs {LEAST_REPEATS} complete repeats that differ"
            return Note(f"whether means over time are steady is not known: {few}")
        how = f"{len(names)} tested together by Holm's method, at {100 * LEAST_PROBABILITY:g} %"
        parts = []
        if self.changing:
            parts.append(f"these change within their part: {listed([*self.changing])}")
        if self.steady:
            of_all = f" in {listed([*self.steady])}" if self.changing else ""
            largest = 100 * max(self.least)
            size = short(largest, 2 if largest < 99 else 3)
            missed = f"some of up to {size} % may be missed"
            parts.append(f"no change is found{of_all}; {missed}")
        return Note(f"means over time: {'; '.join(parts)} ({how})", ", ".join(names))


def steady_means(measurement: Measurement, first_window: int | None = None) -> SteadyMeans:
    """The test of the means of a point.

    first_window : with which the part of a gas that walls keep warm begins; else the part is that
        after the relaxation
    """
    quarters = {
        name: values
        for name, values in quarters_of_means(measurement, first_window).items()
        if np.ptp(np.ptp(values, axis=1)) > ROUNDING * abs(float(np.mean(values)))
    }
    tests = TESTS * len(quarters)
    changes = {name: change_of(values, tests) for name, values in quarters.items()}
    known = {name: c for name, c in changes.items() if math.isfinite(c.probability)}
    changing = refused_together({name: TESTS * c.probability for name, c in known.items()})
    steady = tuple(name for name in known if name not in changing)
    return SteadyMeans(changing, steady, tuple(known[name].least for name in steady))


def refused_together(probabilities: Mapping[str, float]) -> tuple[str, ...]:
    """The names that Holm's method refuses together, in their order (Holm 1979).

    The smallest of m probabilities must be below the level over m, the next one over m − 1 and so
    on, up to the first that is not. Chance refuses any of those that hold with at most the level,
    also where they depend on each other.
    """
    refused = set[str]()
    for left, name in zip(
        range(len(probabilities), 0, -1),
        sorted(probabilities, key=lambda name: probabilities[name]),
        strict=True,
    ):
        if probabilities[name] * left >= LEAST_PROBABILITY:
            break
        refused.add(name)
    return tuple(name for name in probabilities if name in refused)


def quarters_of_means(
    measurement: Measurement, first_window: int | None = None
) -> dict[str, Array]:
    """The means (*repeats*, 4) of quantities in the quarters of the part, by name.

    They are of the complete repeats that are long enough. The part after the relaxation begins
    with the first whole window.
    """
    complete = measurement.chosen(measurement.complete)
    if first_window is None:
        complete = complete.chosen(np.isfinite(complete.relaxed.length))
    if len(complete.time) < LEAST_REPEATS:
        return {}
    begin = np.full(len(complete.time), float(first_window or 0))
    if first_window is None:
        skipped = 1 - complete.relaxed.length / complete.time
        begin = np.clip(np.ceil(skipped * WINDOWS), 0, WINDOWS - QUARTERS)
    gases = _gases_of_quarters(complete, begin, first_window is not None)
    found = dict[str, Array]()
    with np.errstate(divide="ignore", invalid="ignore"):
        for entry in theories.holding(complete.scene):
            quantity = entry.quantity
            if quantity.measured is None or quantity.source == "decay" or quantity.name in found:
                continue
            if quantity == SPECIES_RATIO:
                first, second = np.moveaxis(complete.species_quarters, 2, 0)
                values = first / second
            elif quantity == SPIN_RATIO and first_window is None:
                values = late_quarters(complete)
            else:
                values = np.column_stack([quantity.measured(gas) for gas in gases])
            if np.all(np.isfinite(values)):
                found[quantity.name] = values
    return found


def _gases_of_quarters(measurement: Measurement, begin: Array, warm: bool) -> list[Gas]:
    """A gas for each quarter of the windows from those where repeats begin."""
    edges = np.linspace(begin, np.full_like(begin, WINDOWS), QUARTERS + 1, axis=1)
    windows = Averages(*(_sums(column, edges) for column in measurement.windows))
    spans = np.diff(edges, axis=1)
    means = [column / spans for column in windows[:MEANS]]
    averages = Averages(*means, *windows[MEANS:])
    across = _sums(measurement.across, edges) / spans
    by_side = _sums(measurement.by_side, edges)
    return [
        Gas(
            replace(
                measurement,
                windows=Averages(*(column[:, k : k + 1] for column in averages)),
                relaxed=Averages(*(column[:, k] for column in averages)),
                across=across[:, k : k + 1],
                by_side=by_side[:, k : k + 1],
            ),
            first_window=0 if warm else None,
        )
        for k in range(QUARTERS)
    ]


def _sums(windows: Array, edges: Array) -> Array:
    """Sums of (*repeats*, ``WINDOWS``, ...) between edges (*repeats*, *n*), also within one."""
    sums = np.cumsum(np.concatenate([np.zeros_like(windows[:, :1]), windows], axis=1), axis=1)
    low = np.minimum(edges.astype(int), WINDOWS - 1)
    repeats = np.arange(len(windows))[:, np.newaxis]
    share = (edges - low).reshape(*edges.shape, *[1] * (windows.ndim - 2))
    below, above = sums[repeats, low], sums[repeats, low + 1]
    return np.diff(below + share * (above - below), axis=1)
