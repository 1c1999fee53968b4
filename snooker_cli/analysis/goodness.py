"""Whether a law describes the repeats of a point: Hotelling's tests of means over repeats."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.analysis.fitting import LAWS, MODELS, MOST_STEPS, FitModel, FitResult
from snooker_cli.formatting import chance, short, with_error

Array: TypeAlias = NDArray[np.float64]

LEAST_PROBABILITY = 0.01
"""A law holds where deviations as large as those found have at least this probability."""

ENOUGH_REPEATS = 20
"""With fewer repeats it is not said that a law holds, only that it is not refused.

The 200 repeats of the source report's scene refuse Haff's law. Of groups of 5 of them nearly all do
not refuse it, of groups of 20 a third do not, of groups of 40 none.
"""

FEW_REPEATS = f"Fewer than {ENOUGH_REPEATS} repeats refuse only a law that is far off."
"""What a reader of a law that few repeats do not refuse has to know."""

MOST_ERRORS = 3.0
"""Standard errors up to which a result agrees with theory."""

FEWEST_TESTED = 3
"""Repeats from which on a difference counts in errors. The error of two says little."""

TOO_FEW = "too few repeats for a test"

FAR = 2.0
"""A factor between a quantity at the end and its law from which on few repeats cannot test the law:
their errors are so large that they do not refuse it, and yet it does not describe them."""

MOST_WINDOWS = 20  # windows of a test at most, and ends of a range that are tried

ROWS_IN_WINDOW = 10
"""Rows of a repeat in a window of a test at least, so that its mean is nearly normal."""


def variance_probability(ratio: float, degrees: int, free: int) -> float:
    """The probability of a ratio of variances at least as large (Fisher's F), by their degrees.

    nan without degrees of freedom of the second.
    """
    from scipy import special  # takes time to load

    return float(special.fdtrc(degrees, free, ratio)) if free > 0 else math.nan


class LargestDifference(NamedTuple):
    """The largest difference D of cumulative shares from their law, if the law holds.

    probability : that of a D at least as large as the measured one
    mean : of D
    """

    probability: float
    mean: float


DRAWS = 20_000  # of the differences at all edges
FEWEST_BEYOND = 50  # draws beyond a distance that give its probability
REDUCED_TEMPERATURE = 0.5
"""The reduced speed v sqrt(m/2T) is the speed of a ball of mass 1 at this temperature."""

EMPTY_SPREAD, JITTER = 1e-6, 1e-12
"""Standard deviation of a share that is always 0 or 1; a share of the variance that is rounding."""


def largest_speed_difference(
    distance: float, edges: Array, number: int, speeds: int
) -> LargestDifference:
    """How large D is by chance for reduced speeds of independent states at a fixed energy.

    distance : the measured D, at the edges
    edges : (*k*,), reduced speeds v √(m/2T)
    number : of balls that share the energy of a state
    speeds : of all states

    D is smaller than by Kolmogorov's law of independent draws, as with Lilliefors' tests (J. Am.
    Stat. Assoc. 64, 387 (1969)): T is that of the state itself. nan for a single ball.
    """
    if number < 2:
        return LargestDifference(math.nan, math.nan)
    spread, largest = _largest_differences(tuple(edges.tolist()), number)
    scaled = distance * math.sqrt(speeds)
    beyond = int(np.count_nonzero(largest >= scaled))
    probability = beyond / DRAWS
    if beyond < FEWEST_BEYOND:  # at most the sum over the edges, which is close to it far outside
        tails = [math.erfc(scaled / sigma / math.sqrt(2)) for sigma in spread.tolist()]
        probability = min(sum(tails), FEWEST_BEYOND / DRAWS)
    return LargestDifference(probability, float(largest.mean()) / math.sqrt(speeds))


@lru_cache(maxsize=8)  # the points of a figure have few numbers of balls
def _largest_differences(edges: tuple[float, ...], number: int) -> tuple[Array, Array]:
    """√n times the differences at the edges: their deviations (*k*,), and draws of the largest.

    The shares v²/Σv² of a state are those of a Dirichlet distribution with equal weights 1: two
    balls have more than a and b with the probability that one has more than a + b. This gives the
    covariance of the cumulative shares, which are normal for many speeds.
    """
    speed = np.array(edges)
    law = partial(theory.fixed_energy_speed_cdf, number=number, temperature=REDUCED_TEMPERATURE)
    below, both_above = law(speed), 1 - law(np.hypot(speed[:, np.newaxis], speed))
    of_one = np.minimum(below[:, np.newaxis], below) - np.outer(below, below)
    covariance = of_one + (number - 1) * (both_above - np.outer(1 - below, 1 - below))
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = spread > EMPTY_SPREAD
    spread, covariance = spread[known], covariance[np.ix_(known, known)]
    root = np.linalg.cholesky(covariance + JITTER * np.eye(len(spread)))
    normal = np.random.default_rng(0).standard_normal((DRAWS, len(spread)))
    return spread, np.abs(normal @ root.T).max(axis=1)


@dataclass(frozen=True)
class Goodness:
    """Whether a law describes the mean of ln y over repeats; what is not known is nan.

    judged_repeats : number of repeats that are judged
    judged_from, judged_to : the judged times (s), in which all these repeats have values
    chi_squared_per_degree, degrees_of_freedom : F of Hotelling's test; if the law holds, its mean
        over n repeats is (n − d)/(n − d − 2) with d degrees: 1 for many repeats, 3 for few
    probability : that of a deviation at least as large if the law holds
    holds_to : end of the longest range from ``judged_from`` in which the law holds (s)
    end_over_fit, end_over_fit_error : y over its fit at ``judged_to``, the geometric mean, and its
        standard error
    """

    judged_repeats: int
    judged_from: float = math.nan
    judged_to: float = math.nan
    chi_squared_per_degree: float = math.nan
    degrees_of_freedom: int = 0
    probability: float = math.nan
    holds_to: float = math.nan
    end_over_fit: float = math.nan
    end_over_fit_error: float = math.nan


def cannot_be_tested(law: Mapping[str, Any]) -> bool:
    """Whether repeats do not refuse a law that is far from the energy, as they are few.

    law : a row of ``snooker fit --json`` with a probability
    """
    factor = law.get("end_over_fit")
    far = factor is not None and not 1 / FAR < factor < FAR
    return far and law["judged_repeats"] < ENOUGH_REPEATS and law["holds_to"] >= law["judged_to"]


def verdict(law: Mapping[str, Any]) -> str:
    """Until when a law of the energy holds, with p, and how far it is from the energy at the end.

    law : a row of ``snooker fit --json``

    ``Haff's law is not refused up to 6.1 s by 5 repeats (p = 0.23; the energy at the end is 1.64 ±
    0.34 times the law's)``
    """
    label, p, end = LAWS[law["model"]].label, law["probability"], law["holds_to"]
    name = label if label[0].isupper() else f"the {label} law"
    begun = f"{name[0].upper()}{name[1:]}"
    if p is None:
        return f"{begun} is not tested (too few repeats or collisions)"
    factor, repeats = law.get("end_over_fit"), law["judged_repeats"]
    judged_to = short(law["judged_to"])
    size, tested = "", chance(p)
    if factor is not None:
        times = with_error(factor, law["end_over_fit_error"])
        size = f"the energy at the end is {times} times the law's"
        tested = f"{tested}; {size}"
    if end < law["judged_to"]:
        begins = end == law["judged_from"]
        until = "does not hold" if begins else f"is refused after {short(end)} of {judged_to} s"
        return f"{begun} {until} ({tested})"
    if cannot_be_tested(law):
        return f"{repeats} repeats cannot test {name} ({chance(p)}): {size}"
    return f"{begun} is not refused up to {judged_to} s by {repeats} repeats ({tested})"


def joint_probability(in_errors: Array) -> float:
    """The probability that chance gives differences as large at all points together.

    in_errors : (*n*,) differences from theory in standard errors, from enough repeats each

    The sum of their squares is that of χ² with *n* degrees of freedom.
    """
    from scipy import special  # takes time to load

    return float(special.chdtrc(len(in_errors), np.sum(np.square(in_errors))))


class Samples(NamedTuple):
    """Logarithms of a quantity at times of repeats, by which a law is judged.

    time, logarithm : (*repeats*, *s*), s, increasing, and ln y; what is not finite is left out
    weight : (*repeats*, *s*) collisions that a sample stands for; zero if there is no sample
    """

    time: Array
    logarithm: Array
    weight: Array


@dataclass(frozen=True)
class Range:
    """Edges (*w* + 1,) of windows from the first judged time to an end, s, and ln y there.

    logarithm : (*repeats*, *w* + 1)
    """

    edges: Array
    logarithm: Array

    @cached_property
    def changes(self) -> tuple[Array, Array] | None:
        """Means (*w*,) of the changes of ln y over the repeats, and what makes them independent.

        The second, (*w*, *w*), turns deviations from the means into numbers of variance 1. None
        without a test: for one window, and for repeats that differ by rounding.
        """
        return independent_changes(self.logarithm) if len(self.edges) > 2 else None


def independent_changes(values: Array) -> tuple[Array, Array] | None:
    """`Range.changes` of values (*repeats*, *w* + 1)."""
    changes, count = np.diff(values, axis=1), len(values)
    mean, spread = changes.mean(axis=0), changes.std(axis=0, ddof=1)
    if not np.all(spread > 1e-9 * np.abs(mean)):
        return None
    scaled = (changes - mean) / spread
    # Not `np.cov`, whose matrix product starts threads that cost more than they save.
    covariance = np.einsum("ri,rj->ij", scaled, scaled) / (count - 1)
    shares, axes = np.linalg.eigh(covariance)
    if shares[0] < 1e-9:
        return None
    return mean, axes * np.sqrt(count / shares) / spread[:, np.newaxis]


def ranges(samples: Samples) -> list[Range]:
    """The ranges in which a law is judged, the longest first; none for fewer than three repeats.

    They have windows of equal numbers of collisions, all between the times that all repeats have.
    """
    time, logarithm, weight = samples
    good = np.isfinite(logarithm) & (weight > 0)
    count = len(good)
    if count < 3 or min(good.sum(axis=1)) < 2:
        return []
    since = np.where(good, time, math.inf).min(axis=1).max()
    until = np.where(good, time, -math.inf).max(axis=1).min()
    inside = good & (time > since) & (time < until)
    if not inside.any():
        return []
    order = np.argsort(time[inside])
    inner, collisions = time[inside][order], np.cumsum(weight[inside][order])
    edges = []
    for share in np.arange(MOST_WINDOWS, 0, -1) / MOST_WINDOWS:
        filled = int(share * collisions[-1] / (ROWS_IN_WINDOW * count))  # with enough rows
        windows = max(1, min(MOST_WINDOWS, (count + 1) // 2, filled))
        wanted = np.linspace(0, share, windows + 1) * collisions[-1]
        edges.append(inner[np.minimum(np.searchsorted(collisions, wanted), len(inner) - 1)])
        edges[-1][0], edges[-1][-1] = since, until if share == 1 else edges[-1][-1]
    rows = zip(good, time, logarithm, strict=True)
    every = np.concatenate(edges)
    known = np.array([np.interp(every, own[here], values[here]) for here, own, values in rows])
    parts = np.split(known, np.cumsum(list(map(len, edges)))[:-1], axis=1)
    return [Range(*pair) for pair in zip(edges, parts, strict=True)]


def goodness(judged: Sequence[Range], results: Sequence[FitResult]) -> Goodness:
    """Judge a law on the mean over repeats of ln y, in standard errors over the repeats.

    judged : `ranges` of the repeats
    results : the fit of each repeat

    Each range of time has the constant that fits it best. A test needs three repeats.
    """
    count = len(results)
    if not judged:
        return Goodness(count)
    form, (since, until) = MODELS[results[0].model], judged[0].edges[[0, -1]].tolist()
    degrees, chi_squared, probability = _deviation(judged[0], form)
    holds = math.nan
    if math.isfinite(probability):
        tests = ((part.edges[-1], _deviation(part, form)[2]) for part in judged)
        holds = next((float(end) for end, p in tests if p >= LEAST_PROBABILITY), since)
    with np.errstate(all="ignore"):
        fits = np.array([(fit.amplitude, fit.value * (until - fit.start)) for fit in results])
        gaps = judged[0].logarithm[:, -1] - np.log(fits[:, 0] * form.curve(fits[:, 1]))
        gaps = gaps[np.isfinite(gaps)]
        ratio = float(np.exp(gaps.mean())) if gaps.size else math.nan
    error = ratio * float(gaps.std(ddof=1)) / math.sqrt(gaps.size) if gaps.size > 1 else math.nan
    numbers = since, until, chi_squared, degrees, probability
    return Goodness(count, *numbers, holds, ratio, error)


def _deviation(judged: Range, form: FitModel) -> tuple[int, float, float]:
    """Degrees of freedom, χ² per degree and its probability in a range; nan without a test.

    The changes of ln y in windows of equal numbers of rows have a covariance over the repeats. The
    least χ² with this estimate is Hotelling's T², Ann. Math. Stat. 2, 360 (1931): with d degrees
    and n repeats, T² (n − d)/((n − 1) d) has the F distribution of d and n − d degrees.
    """
    if judged.changes is None:
        return 0, math.nan, math.nan
    (mean, independent), times = judged.changes, judged.edges / judged.edges[-1]

    def residuals(p: float) -> tuple[Array, Array]:
        """The deviations at the variable p of a search, and their slopes."""
        logarithm, slope = form.logarithm(p, times)
        return (mean - np.diff(logarithm)) @ independent, -np.diff(slope) @ independent

    with np.errstate(all="ignore"):
        x = float(form.inverse(np.exp(mean.sum())))
        best = math.log1p(x) if form.power else x
        for _ in range(MOST_STEPS):  # the method of Gauss and Newton
            here, slope = residuals(best)
            step = float(slope @ here / (slope @ slope))
            best -= step
            if not abs(step) > 1e-9 * abs(best):
                break
        degrees, squares = len(mean) - 1, float(np.sum(residuals(best)[0] ** 2))
    return degrees, *hotelling(squares, degrees, len(judged.logarithm))


def hotelling(squares: float, degrees: int, count: int) -> tuple[float, float]:
    """F of Hotelling's T² over `count` repeats, and the probability of a larger one."""
    from scipy import special  # takes time to load

    free = count - degrees
    ratio = squares * free / ((count - 1) * degrees)
    return ratio, float(special.fdtrc(degrees, free, ratio))


def equal_means(values: Array) -> float:
    """Probability of differences as large if the means of columns (*repeats*, *k*) are equal.

    It is Hotelling's of the k − 1 successive differences; nan for repeats that differ by rounding.
    """
    changes = independent_changes(values)
    if changes is None:
        return math.nan
    mean, independent = changes
    return hotelling(float(np.sum((mean @ independent) ** 2)), len(mean), len(values))[1]
