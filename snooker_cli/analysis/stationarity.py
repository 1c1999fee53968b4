"""Whether a quantity still changes in the part of the repeats over which its mean is taken.

One test serves the temperature of a gas that walls keep warm, T₁/T₂ and T_rot/T_tr, and in
`steady_means` all means over time. It can refuse that nothing changes, but it cannot prove it. So
each result says what change the test would find.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.goodness import LEAST_PROBABILITY, equal_means
from snooker_cli.analysis.measurement import WINDOWS, Measurement
from snooker_cli.analysis.observables import mean_and_error, standard_errors
from snooker_cli.formatting import chance, short, with_error

Array = NDArray[np.float64]

LEAST_REPEATS = 5
"""Complete repeats that the test needs: three differences, and two degrees of freedom more."""


class Change(NamedTuple):
    """What the test found in the quarters of a part of the repeats.

    probability : of differences as large if nothing changes; nan without a test
    first, last : means over the repeats in the first and the last quarter, and their errors
    least : change from the first to the last quarter, as a share of the mean, above which the test
        refuses that nothing changes
    repeats : number of tested repeats
    """

    probability: float
    first: tuple[float, float]
    last: tuple[float, float]
    least: float
    repeats: int

    @property
    def refused(self) -> bool:
        """Whether the quantity changes."""
        return self.probability < LEAST_PROBABILITY

    @property
    def sentence(self) -> str:
        """What a reader of the mean has to know, as a sentence without the name of the quantity."""
        if math.isnan(self.probability):
            if self.repeats < LEAST_REPEATS:
                return "too few repeats to test whether it changes"
            return "the repeats differ by rounding alone, so that no change can be tested"
        if self.refused:
            first, last = (with_error(*end) for end in (self.first, self.last))
            quarters = f"{first} in the first quarter of the averaged part, {last} in the last"
            return f"it is not steady: {quarters} ({chance(self.probability)})"
        what = f"{chance(self.probability)}; one {self.findable} would be"
        return f"no change is found ({what})"

    @property
    def findable(self) -> str:
        """The changes that the test would find: ``above 3 %``."""
        return f"above {short(100 * self.least, 2)} %"

    def as_json(self) -> dict[str, Any]:
        """What findings need."""
        return {"refused": self.refused, "sentence": self.sentence}


def change_of(quarters: Array, tests: int = 1) -> Change:
    """The test of means (*repeats*, 4) over the quarters of a part of complete repeats.

    tests : that share the level; `Change.least` is for one of them

    There are two tests, and the smaller probability counts. Hotelling's tests the differences of
    successive quarters. Student's tests the last less the first; it finds a slow change in few
    repeats.
    """
    quarters = quarters[np.all(np.isfinite(quarters), axis=1)]
    count, unknown = len(quarters), (math.nan, math.nan)
    if count < LEAST_REPEATS:
        return Change(math.nan, unknown, unknown, math.nan, count)
    ends = quarters[:, [0, 3]]
    tested = min(equal_means(quarters), equal_means(ends))
    first, last = (mean_and_error(column) for column in ends.T)
    return Change(tested, first, last, _least_change(ends, quarters.mean(), tests), count)


def _least_change(ends: Array, mean: float, tests: int) -> float:
    """`Change.least` of means (*repeats*, 2) over the first and the last quarter."""
    from scipy import special  # takes time to load

    error = float(standard_errors(ends[:, 1] - ends[:, 0]))
    share = LEAST_PROBABILITY / tests
    return float(special.stdtrit(len(ends) - 1, 1 - share / 2)) * error / abs(mean)


# From when on the energy of a gas that walls keep warm no longer changes.


class StationaryPart(NamedTuple):
    """The part of the complete repeats of a point in which the gas is stationary.

    first_window : its first window of ``WINDOWS``; ``None`` if there is no such part
    note : a sentence for a reader
    changes : whether the test refuses all parts
    """

    first_window: int | None
    note: str
    changes: bool = False


def stationary_part(energies: Array, time: Array) -> StationaryPart:
    """The longest part, to the end, in which the mean energy of the balls stays the same.

    energies : (*repeats*, ``WINDOWS``) J, means over windows of time of the complete repeats
    time : (*repeats*,) their ends, s

    The test is that of `change_of`, and Student's of the second half of the time less the first
    window of the part; it finds a slow change in few repeats. Every part leaves out the first of
    all windows, because speeds mix there. It leaves out half of the time at most.
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
        change = change_of(np.diff(until, axis=1))
        tested = min(change.probability, equal_means(np.column_stack([energies[:, first], late])))
        if tested >= LEAST_PROBABILITY:
            begin = float(np.mean(time)) * first / WINDOWS
            since = f"not refused as stationary from {short(begin)} s on ({chance(tested)}"
            chosen = f"the first of {WINDOWS // 2} tried starts that are not refused"
            about = f"a change of the energy {change.findable} would be found"
            return StationaryPart(first, f"{since}, {chosen}); {about}")
    why = f"the parts of the second half differ ({chance(tested)})"
    if math.isnan(tested):
        why = "the repeats differ by rounding alone, so that nothing can be tested"
    changes = not math.isnan(tested)
    return StationaryPart(None, f"not stationary: {why}; make the run longer", changes)


def stationary_part_of(measurement: Measurement) -> StationaryPart:
    """`stationary_part` of measured repeats."""
    complete = measurement.complete
    return stationary_part(measurement.windows.kinetic_energy[complete], measurement.time[complete])
