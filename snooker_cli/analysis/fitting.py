"""Decay models, least-squares fits of one curve, and means of fits over repeats.

The points of one cooling curve are correlated, so that the error of a single fit is far too small:
quote the error over repeats.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli.analysis.observables import standard_errors
from snooker_cli.engine.jit import helper, kernel
from snooker_cli.scene import EPSILON

Array: TypeAlias = NDArray[np.float64]

NOTHING_DECAYS = "The values are equal but for rounding, so nothing decays."

_MOST_STEPS = 100
_CURVE_ROUNDING = 4 * EPSILON  # relative change of a curve that is only rounding

LEAST_PROBABILITY = 0.01
"""A law holds where deviations as large as those found have at least this probability."""

ENOUGH_REPEATS = 20
"""With fewer repeats it is not said that a law holds, only that it is not refused.

The 200 repeats of the source report's scene refuse Haff's law. Of groups of 5 of them nearly all do
not refuse it, of groups of 20 a third do not, of groups of 40 none.
"""

FEW_REPEATS = f"Fewer than {ENOUGH_REPEATS} repeats refuse only a law that is far off."
"""What a reader of a law that few repeats do not refuse has to know."""

MOST_WINDOWS = 20  # windows of a test at most, and ends of a range that are tried

ROWS_IN_WINDOW = 10
"""Rows of a repeat in a window of a test at least, so that its mean is nearly normal."""


@dataclass(frozen=True)
class FitModel:
    """A decay y = A g(q s) with one rate q; s is the time since t0.

    g(x) is 1/(1 + x)ⁿ, or exp(−x) for n = 0. It has a pole at x = −1 unless n = 0: a fit needs
    q s > −1, and the rate depends on t0, which is the start of the run.

    label, formula : in legends; of y, with t the time since t0
    key, symbol, mean_symbol : the rate in JSON; its letter; its letter in a mean since the start
    power : n
    mean_model : the model for a mean since the start; empty: this model. The exponential is fitted
        as in the source report, although the mean of one is (1 − exp(−kt))/(kt)
    """

    label: str
    formula: str
    key: str
    symbol: str
    mean_symbol: str
    power: int
    mean_model: str = ""

    def curve(self, x: Array) -> Array:
        """g at x."""
        return np.asarray((1 + x) ** -self.power if self.power else np.exp(-x))

    def logarithm(self, p: float, s: Array) -> tuple[Array, Array]:
        """ln g(q s) and its derivative with p, the variable of a search.

        The rate q is p for the exponential, else e^p − 1, which is above −1 for every p.
        """
        if not self.power:
            return -p * s, -s
        rate = math.expm1(p)
        return -self.power * np.log1p(rate * s), -self.power * s * (1.0 + rate) / (1.0 + rate * s)


LAWS = {
    "exponential": FitModel("exponential", "A e^(−kt)", "k", "k", "κ", power=0),
    # The energy by Haff, J. Fluid Mech. 134, 401 (1983).
    "haff": FitModel("Haff's law", "A/(1 + αt)²", "alpha", "α", "α", 2, mean_model="haff_root"),
}
"""The laws of cooling by their names in files and tables."""

MODELS = LAWS | {"haff_root": replace(LAWS["haff"], power=1)}  # the mean pressure under Haff's law
"""The laws, and other models of a mean since the start."""


class FitResult(NamedTuple):
    """What one curve gives for one model; the numbers are nan if the fit failed.

    model : a name in ``MODELS``
    converged, message : whether the numbers can be used; how the fit ended, in one sentence
    points, start : number of points given; t0, the time of the amplitude (s)
    value, error : the rate, decay constant k or Haff's α (1/s), and its standard error
    amplitude : A, as given if it was held; in the unit of y
    """

    model: str
    converged: bool
    message: str
    points: int
    start: float
    value: float = math.nan
    error: float = math.nan
    amplitude: float = math.nan


class Curves(NamedTuple):
    """Curves that are fitted with one law, one after the other.

    starts : (*curves* + 1,) where the points of each begin, and the end of all
    origin : (*curves*,) times of the first points, s
    time, value, weight : (*points*,) s; any unit; the number of values that a point stands for
    rounding : (*curves*,) relative size of changes that are only rounding; no decay is sought there
    """

    starts: NDArray[np.int64]
    origin: Array
    time: Array
    value: Array
    weight: Array
    rounding: Array

    def numbers(self) -> NDArray[np.int64]:
        """(*curves*,) The numbers of equal points behind each."""
        totals = np.append(0.0, np.cumsum(self.weight))[self.starts]
        return np.diff(totals).round().astype(np.int64)

    @classmethod
    def of(cls, curves: Sequence[tuple[Array, Array, float]]) -> "Curves":
        """Curves (t, y, rounding) of single values."""
        times, values, rounding = zip(*curves, strict=True)
        starts = np.cumsum([0, *map(len, times)])
        origin = np.array([time[0] if len(time) else math.nan for time in times])
        time, value = np.concatenate(times), np.concatenate(values)
        weight = np.ones_like(time)
        return cls(starts, origin, time, value, weight, np.array(rounding, np.float64))


def fit_all(
    curves: Curves,
    model: str = "exponential",
    *,
    amplitude: float | None = None,
    start: float | None = None,
) -> list[FitResult]:
    """Least-squares fits of a decay to curves; the search is dimensionless, so any scale is good.

    model : a name in ``MODELS``
    amplitude : A is held at this value; by default it is free
    start : t0 (s), not after any of the times; by default the first of them

    Data that cannot be fitted give a result with converged=False and a message with the reason.
    Raises KeyError for an unknown model.
    """
    power, free, number = MODELS[model].power, amplitude is None, len(curves.rounding)
    results: list[FitResult] = []
    given = math.nan if start is None else start, math.nan if amplitude is None else amplitude
    sizes = np.diff(curves.starts)
    table, memory = np.empty((number, 5)), np.empty((4, max(sizes, default=0)))
    search(curves, power, given, table, memory)
    few = f"A fit needs {2 + free} or more points; here are {{}}."
    for points, row in zip(curves.numbers().tolist(), table.tolist(), strict=True):
        rate, error, height, origin, outcome = row
        message = OUTCOMES[int(outcome)] or few.format(points)
        numbers = (rate + 0.0, error, height) if message == DONE else ()  # never −0.0
        if not all(map(math.isfinite, numbers)):
            message, numbers = "The points do not determine the decay constant.", ()
        done = message == DONE
        results.append(FitResult(model, done, message, points, origin, *numbers))
    return results


DONE = "The fit converged."

FEW, FLAT, ZERO, UNSETTLED, SETTLED = range(5)

OUTCOMES = (
    "",
    NOTHING_DECAYS,
    "All values are zero.",
    f"The search did not settle in {_MOST_STEPS} steps: no such decay.",
    DONE,
)
"""How a search may end, in the order of the numbers above."""


@kernel
def search(
    curves: Curves, power: int, given: tuple[float, float], table: Array, memory: Array
) -> None:
    """Write rate (1/s), its standard error, A, t0 (s) and the outcome of each curve.

    given : t0 and A, nan if they are not held
    table : (*curves*, 5); memory : (4, longest)

    The best free A follows from the rate (Golub & Pereyra, SIAM J. Numer. Anal. 10, 413 (1973)).
    So the step of Gauss and Newton has one variable, p, and falls to zero at the minimum. The
    search moves to the zero of its secant. A move to a larger sum of squares is made shorter.
    """
    free = math.isnan(given[1])
    for k in range(len(table)):
        first, last = curves.starts[k], curves.starts[k + 1]
        times, values = curves.time[first:last], curves.value[first:last]
        w, size, number = curves.weight[first:last], last - first, 0.0
        s, y, shape, slope = memory[0, :size], memory[1, :size], memory[2, :size], memory[3, :size]
        origin = given[0]
        if math.isnan(origin):
            origin = curves.origin[k]
        table[k, 3], table[k, 4] = origin, FEW
        if size < 2 + free:
            continue
        for i in range(size):
            number += w[i]
        level, largest, changes, span = given[1], 0.0, 0.0, times[0]
        if free:
            level = values[0]
        for i in range(size):
            span = max(span, times[i])
            changes = max(changes, abs(values[i] - level))
            if abs(values[i]) > abs(largest):
                largest = values[i]
        if changes <= curves.rounding[k] * abs(level):
            table[k, 4] = ZERO if level == 0.0 else FLAT
            continue
        scale = largest if free else level
        span -= origin
        squares = 0.0
        for i in range(size):
            s[i], y[i] = (times[i] - origin) / span, values[i] / scale
            squares += w[i] * y[i] ** 2
        least = _CURVE_ROUNDING * np.sqrt(squares)
        p = first_guess(power, free, s, y, w)
        best = sums(p, power, free, s, y, w, shape, slope)
        move, settled = best[1], False
        for _ in range(_MOST_STEPS):
            tried = sums(p + move, power, free, s, y, w, shape, slope)
            if np.sqrt(tried[0]) <= np.sqrt(best[0]) + least:
                secant = move / (best[1] - tried[1])
                if math.isnan(secant):
                    secant = 1.0
                p += move
                best = tried
                move = best[1] * min(max(secant, 0.25), 4.0)
            else:
                move /= 4
            change = abs(best[1])
            settled = change * np.sqrt(best[2]) <= least or change <= _CURVE_ROUNDING * abs(p)
            if settled or not math.isfinite(change):
                break
        rate, rate_slope = p, 1.0
        if power > 0:
            rate, rate_slope = np.expm1(p), np.exp(p)
        error = rate_slope * np.sqrt(best[0] / (number - 1 - free) / best[2])
        # Refused: a decay that is over before the second point, and a rate with a tenfold error.
        over = np.sqrt(best[2]) * abs(rate) <= rate_slope * least / np.sqrt(EPSILON)
        if abs(rate) > 1.0 and (over or error > 10.0 * abs(rate)):
            error = math.nan
        table[k, 0], table[k, 1], table[k, 2] = rate / span, error / span, best[3] * scale
        table[k, 4] = SETTLED if settled else UNSETTLED


@helper
def sums(
    p: float,
    power: int,
    free: bool,
    s: Array,
    y: Array,
    w: Array,
    shape: Array,
    slope: Array,
) -> tuple[float, float, float, float]:
    """Sum of squares, step, squared change of the curve with p, and A; writes shape and slope."""
    rate, rate_slope, height, tilt = p, 1.0, 1.0, 0.0
    if power > 0:
        rate, rate_slope = np.expm1(p), np.exp(p)
    for i in range(len(s)):
        if power == 0:
            base = np.exp(-rate * s[i])
            shape[i], slope[i] = base, -base * s[i]
        else:
            base = 1.0 / (1.0 + rate * s[i])
            shape[i] = base if power == 1 else base * base
            slope[i] = -power * shape[i] * base * s[i] * rate_slope
    if free:
        with_y, with_slope, alone = 0.0, 0.0, 0.0
        for i in range(len(s)):
            with_y += w[i] * shape[i] * y[i]
            with_slope += w[i] * shape[i] * slope[i]
            alone += w[i] * shape[i] * shape[i]
        height, tilt = with_y / alone, with_slope / alone
    total, along, square = 0.0, 0.0, 0.0
    for i in range(len(s)):
        rest = height * shape[i] - y[i]
        change = height * (slope[i] - tilt * shape[i])
        total += w[i] * rest * rest
        along += w[i] * change * rest
        square += w[i] * change * change
    return total, -along / square, square, height


@helper
def first_guess(power: int, free: bool, s: Array, y: Array, w: Array) -> float:
    """Start of the search: a straight line b + q s through the positive points' x, weighted.

    Where g(b + q s) is nearly A g(r s), r is the logarithmic slope there over that at zero.
    """
    total, middle, level = 0.0, 0.0, 0.0
    for i in range(len(s)):
        if y[i] > 0.0:
            weight = w[i] * point_weight(power, y[i])
            total += weight
            middle += weight * s[i]
            level += weight * inverse(power, y[i])
    if free:
        middle, level = middle / total, level / total
    else:  # the amplitude is 1, at x = 0
        middle, level = 0.0, 0.0
    along, square = 0.0, 0.0
    for i in range(len(s)):
        if y[i] > 0.0:
            away = w[i] * point_weight(power, y[i]) * (s[i] - middle)
            along += away * (inverse(power, y[i]) - level)
            square += away * (s[i] - middle)
    rate = along / square
    base = level - rate * middle
    if power > 0:
        rate /= 1.0 + base
    if not math.isfinite(rate) or (power > 0 and base <= -1.0):
        rate = 1.0
    if power > 0:
        return math.log1p(max(rate, -0.99))
    return rate


@helper
def inverse(power: int, y: float) -> float:
    """The x at which g has a positive value."""
    if power == 0:
        return -math.log(y)
    return 1.0 / y - 1.0 if power == 1 else 1.0 / math.sqrt(y) - 1.0


@helper
def point_weight(power: int, y: float) -> float:
    """The square of dg/dx where g is y."""
    if power == 0:
        return y * y
    return y**4 if power == 1 else 4.0 * y**3


def fitted_curve(result: FitResult, t: ArrayLike) -> Array:
    """Values of the fitted model at the times `t` (s), same shape as `t`; nan if the fit failed."""
    elapsed = np.asarray(t, dtype=np.float64) - result.start
    with np.errstate(all="ignore"):
        return np.asarray(result.amplitude * MODELS[result.model].curve(result.value * elapsed))


@dataclass(frozen=True)
class RepeatMean:
    """A decay constant over repeats (1/s); both errors are nan for fewer than two usable repeats.

    value, error : mean and its standard error
    repeats, failed : repeats used, and repeats left out because their fit failed
    max_min_half_range : half of the range, the source report's error; it grows with the repeats
    """

    value: float
    error: float
    repeats: int
    failed: int
    max_min_half_range: float = math.nan


def mean_over_repeats(results: Sequence[FitResult]) -> RepeatMean:
    """Mean decay constant over repeats of one experiment, and its errors."""
    values = np.array([result.value for result in results if result.converged])
    count, failed = len(values), len(results) - len(values)
    if count < 2:
        return RepeatMean(float(values[0]) if count else math.nan, math.nan, count, failed)
    error, half_range = float(standard_errors(values)), float(np.ptp(values)) / 2
    return RepeatMean(float(values.mean()), error, count, failed, half_range)


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


def holding(repeats: int) -> str:
    """What a law does that this number of repeats do not refuse."""
    return "holds" if repeats >= ENOUGH_REPEATS else "is not refused"


class Samples(NamedTuple):
    """Logarithms of a quantity at times of repeats, by which a law is judged.

    time, logarithm : (*repeats*, *s*), s, increasing, and ln y; what is not finite is left out
    numbers : (*repeats*,) collisions behind the samples of a repeat
    """

    time: Array
    logarithm: Array
    numbers: NDArray[np.int64]


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
    shares, axes = np.linalg.eigh(np.atleast_2d(np.cov(changes / spread, rowvar=False)))
    if shares[0] < 1e-9:
        return None
    return mean, axes * np.sqrt(count / shares) / spread[:, np.newaxis]


def ranges(samples: Samples) -> list[Range]:
    """The ranges in which a law is judged, the longest first; none for fewer than three repeats.

    They have windows of equal numbers of samples, all between the times that all repeats have.
    """
    good = np.isfinite(samples.logarithm)
    sizes, count = good.sum(axis=1), len(good)
    if count < 3 or min(sizes) < 2:
        return []
    order = np.argsort(~good, axis=1, kind="stable")  # those that are finite first
    time, logarithm = (np.take_along_axis(values, order, axis=1) for values in samples[:2])
    since, until = time[:, 0].max(), time[np.arange(count), sizes - 1].min()
    inner = np.sort(time[np.take_along_axis(good, order, axis=1)])
    inner = inner[(inner > since) & (inner < until)]
    if not inner.size:
        return []
    collisions = inner.size / sizes.sum() * samples.numbers.sum()
    judged = []
    for share in np.arange(MOST_WINDOWS, 0, -1) / MOST_WINDOWS:
        filled = int(share * collisions / (ROWS_IN_WINDOW * count))  # windows with enough rows
        windows = max(1, min(MOST_WINDOWS, (count + 1) // 2, filled))
        quantiles = np.linspace(0, share, windows + 1) * (inner.size - 1)
        edges = inner[np.rint(quantiles).astype(int)]
        edges[0], edges[-1] = since, until if share == 1 else edges[-1]
        judged.append(Range(edges, np.empty((count, windows + 1))))
        interpolate(edges, time, logarithm, sizes, judged[-1].logarithm)
    return judged


@kernel
def interpolate(
    edges: Array, time: Array, values: Array, sizes: NDArray[np.int64], result: Array
) -> None:
    """Write the values (*repeats*, *edges*) at increasing edges, between samples at times."""
    for repeat in range(len(time)):
        row = 0
        for k in range(len(edges)):
            while row + 2 < sizes[repeat] and time[repeat, row + 1] <= edges[k]:
                row += 1
            width = time[repeat, row + 1] - time[repeat, row]
            part = min((edges[k] - time[repeat, row]) / width, 1.0)
            step = values[repeat, row + 1] - values[repeat, row]
            result[repeat, k] = values[repeat, row] + part * step


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
        x = inverse(form.power, float(np.exp(mean.sum())))
        best = math.log1p(x) if form.power else x
        for _ in range(_MOST_STEPS):  # the method of Gauss and Newton
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


def excluded_area(densities: Array, ratios: Array, errors: Array) -> tuple[float, float]:
    """b of P V/(N T) = 1/(1 − n b), fitted to all densities, and its error; m².

    densities, ratios, errors : (*p*,), m⁻² and of P V/(N T); without errors all weigh the same
    """
    from scipy import optimize  # takes half a second to load

    known = bool(np.all(errors > 0))  # false for nan
    b, covariance = optimize.curve_fit(
        lambda n, b: 1 / (1 - n * b),
        densities,
        ratios,
        p0=float(np.min((1 - 1 / ratios) / densities)),
        sigma=errors if known else None,
        absolute_sigma=known,
    )
    return float(b[0]), math.sqrt(covariance[0, 0])


def attraction(
    densities: Array, temperatures: Array, ratios: Array, errors: Array
) -> tuple[float, float]:
    """a of P V/(N T) = 1/(1 − n b) − a n/T, and its error; J m². nan without its temperatures.

    Each density with several temperatures gives a slope, whatever b is there; a is their mean.
    Arguments are as in ``excluded_area``, with temperatures in J.
    """
    slope, total = 0.0, 0.0
    for at in (densities == density for density in np.unique(densities)):
        x = densities[at] / temperatures[at]
        if np.ptp(x) > 1e-9 * np.max(x) and np.all(errors[at] > 0):
            weights = errors[at] ** -2
            centred = x - np.average(x, weights=weights)
            slope -= float(np.sum(weights * centred * ratios[at]))
            total += float(np.sum(weights * centred**2))
    return (slope / total, 1 / math.sqrt(total)) if total else (math.nan, math.nan)
