"""A point whose walls give energy: from when it is stationary."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.goodness import LEAST_PROBABILITY, equal_means
from snooker_cli.analysis.measurement import WINDOWS, Measurement
from snooker_cli.formatting import probability, short

Array = NDArray[np.float64]

LEAST_REPEATS = 5
"""Complete repeats that the test needs: three differences, and two degrees of freedom more."""


class StationaryPart(NamedTuple):
    """The part of the complete repeats of a point in which the gas is stationary.

    first : its first window of ``WINDOWS``; ``None`` if there is no such part
    note : a sentence for a reader
    """

    first: int | None
    note: str


def stationary_part(energies: Array, time: Array) -> StationaryPart:
    """The longest part, to the end, in which the mean energy of the balls stays the same.

    energies : (*repeats*, ``WINDOWS``) J, means over windows of time of the complete repeats
    time : (*repeats*,) their ends, s

    Three tests over the repeats decide: Hotelling's of the three differences of successive
    quarters; and Student's of the last quarter less the first, and of the second half of the time
    less the first window, which find an approach in few repeats. The first window of all is left
    out, because speeds mix there, and half of the time at most.
    """
    count = len(energies)
    if count < LEAST_REPEATS:
        have = f"{count} {'is' if count == 1 else 'are'} there"
        needs = f"the test needs {LEAST_REPEATS} complete repeats, and {have}"
        return StationaryPart(None, f"the stationary part is not known: {needs}")
    sums = np.cumsum(np.column_stack([np.zeros(count), energies]), axis=1)
    tested, late = math.nan, energies[:, WINDOWS // 2 :].mean(axis=1)
    for first in range(1, WINDOWS // 2 + 1):
        edges = np.linspace(first, WINDOWS, 5)
        until = np.array([np.interp(edges, np.arange(WINDOWS + 1), row) for row in sums])
        quarters = np.diff(until, axis=1)
        pairs = quarters[:, [0, 3]], np.column_stack([energies[:, first], late])
        tested = min(map(equal_means, (quarters, *pairs)))
        if tested >= LEAST_PROBABILITY:
            begin = float(np.mean(time)) * first / WINDOWS
            agree = f"the mean energies of its parts agree ({_chance(tested)})"
            chosen = f"it is the first of {WINDOWS // 2} tried starts for which they do"
            return StationaryPart(first, f"stationary from {short(begin)} s on: {agree}; {chosen}")
    why = f"the parts of the second half differ ({_chance(tested)})"
    if math.isnan(tested):
        why = "the repeats differ by rounding alone, so that nothing can be tested"
    return StationaryPart(None, f"not stationary: {why}; make the run longer")


def stationary_part_of(measurement: Measurement) -> StationaryPart:
    """`stationary_part` of measured repeats."""
    complete = measurement.complete
    return stationary_part(measurement.windows.kinetic_energy[complete], measurement.time[complete])


def _chance(value: float) -> str:
    """``p = 0.05`` or ``p <0.001``."""
    return f"p {'' if value < 0.001 else '= '}{probability(value)}"
