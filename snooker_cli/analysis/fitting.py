"""Decay models, least-squares fits of one curve, and means of fits over repeats.

The points of one cooling curve are correlated, so that the error of a single fit is far too small:
quote the error over repeats.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special

from snooker_cli.analysis.observables import standard_errors
from snooker_cli.scene import EPSILON

Array: TypeAlias = NDArray[np.float64]
_Found: TypeAlias = tuple[float, float, float, bool]

NOTHING_DECAYS = "The values are equal but for rounding, so nothing decays."

_MOST_STEPS = 100
MOST_VALUES = 2**18  # of curves that are fitted together, which limits the memory
_CURVE_ROUNDING = 4 * EPSILON  # relative change of a curve that is only rounding

LEAST_PROBABILITY = 0.01
"""A law holds where deviations as large as those found have at least this probability."""

MOST_WINDOWS = 20  # windows of a test at most, and ends of a range that are tried

RESAMPLES = 2000  # sets of repeats that a bootstrap draws

ROWS_IN_WINDOW = 10
"""Rows of a repeat in a window of a test at least, so that its mean is nearly normal."""


@dataclass(frozen=True)
class FitModel:
    """A decay y = A g(q s) with one rate q, where g(0) = 1; s is the time since t0.

    label, formula : in legends; of y, with t the time since t0
    key, symbol, mean_symbol : the rate in JSON; its letter; its letter in a mean since the start
    curve, derivative : g at x = q s; dg/dx at x, where g is y
    inverse : the x at which g has a positive value
    has_pole : whether g has a pole at x = −1, so that a fit needs q s > −1; the rate then depends
        on t0, which is the start of the run
    mean_model : the model for a mean since the start; empty: this model. The exponential is fitted
        as in the source report, although the mean of one is (1 − exp(−kt))/(kt)
    """

    label: str
    formula: str
    key: str
    symbol: str
    mean_symbol: str
    curve: Callable[[Array], Array]
    derivative: Callable[[Array, Array], Array]
    inverse: Callable[[Array], Array]
    has_pole: bool = False
    mean_model: str = ""

    def rate(self, p: Array) -> Array:
        """The rate q at the variable p of a search; e^p − 1 is above −1 for every p."""
        return np.expm1(p) if self.has_pole else p

    def rate_slope(self, p: Array) -> Array:
        """dq/dp."""
        return np.exp(p) if self.has_pole else np.ones_like(p)


LAWS = {
    "exponential": FitModel(
        label="exponential",
        formula="A e^(−kt)",
        key="k",
        symbol="k",
        mean_symbol="κ",
        curve=lambda x: np.asarray(np.exp(-x)),
        derivative=lambda x, y: -y,
        inverse=lambda y: np.asarray(-np.log(y)),
    ),
    # The energy by Haff, J. Fluid Mech. 134, 401 (1983).
    "haff": FitModel(
        label="Haff's law",
        formula="A/(1 + αt)²",
        key="alpha",
        symbol="α",
        mean_symbol="α",
        curve=lambda x: 1 / (1 + x) ** 2,
        derivative=lambda x, y: -2 * y / (1 + x),
        inverse=lambda y: y**-0.5 - 1,
        has_pole=True,
        mean_model="haff_root",
    ),
}
"""The laws of cooling by their names in files and tables."""

MODELS = LAWS | {
    "haff_root": replace(  # the mean pressure under Haff's law
        LAWS["haff"],
        curve=lambda x: 1 / (1 + x),
        derivative=lambda x, y: -y / (1 + x),
        inverse=lambda y: 1 / y - 1,
    ),
}
"""The laws, and other models of a mean since the start."""


@dataclass(frozen=True)
class FitResult:
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


def fit_all(
    curves: Sequence[tuple[Array, Array, float]],
    model: str = "exponential",
    *,
    amplitude: float | None = None,
    start: float | None = None,
) -> list[FitResult]:
    """Least-squares fits of a decay to curves (t, y, rounding); short ones are fitted together.

    t, y : (*n*,) times (s, at least 0) and values; any scale, the search is dimensionless
    rounding : relative size of changes that are only rounding; no decay is sought in them
    model : a name in ``MODELS``
    amplitude : A is held at this value; by default it is free
    start : t0 (s), not after any of the times; by default the first of them

    Data that cannot be fitted give a result with converged=False and a message with the reason.
    Raises KeyError for an unknown model.
    """
    form, free = MODELS[model], amplitude is None
    results: list[FitResult] = []
    scaled: dict[int, tuple[float, float, Array, Array]] = {}  # span, scale, s, y/scale
    with np.errstate(all="ignore"):  # the check of the result finds overflow and nan
        for t, y, rounding in curves:
            origin = start if start is not None else float(t[0]) if t.size else math.nan
            level = amplitude if amplitude is not None else y[0] if y.size else math.nan
            if t.size < 2 + free:
                problem = f"A fit needs {2 + free} or more points; here are {t.size}."
            elif np.max(np.abs(y - level)) <= rounding * abs(level):
                problem = NOTHING_DECAYS if level else "All values are zero."
            else:
                problem, span = "", float(t.max()) - origin
                scale = amplitude if amplitude is not None else float(y[np.argmax(np.abs(y))])
                scaled[len(results)] = span, scale, (t - origin) / span, y / scale
            results.append(FitResult(model, False, problem, t.size, origin))
        size = max(1, MOST_VALUES // max((len(s) for *_, s, _ in scaled.values()), default=1))
        for first in range(0, len(scaled), size):
            rows = list(scaled)[first : first + size]
            searched = _search(form, [scaled[row][2:] for row in rows], free)
            for row, result in zip(rows, searched, strict=True):
                results[row] = _outcome(results[row], *scaled[row][:2], result)
    return results


def _outcome(given: FitResult, span: float, scale: float, searched: _Found) -> FitResult:
    """A result with the numbers of a search, or with the reason why it has none."""
    rate, error, height, settled = searched
    numbers = rate / span + 0.0, error / span, height * scale  # never −0.0
    problem = "" if settled else f"The search did not settle in {_MOST_STEPS} steps: no such decay."
    if not all(map(math.isfinite, numbers)):
        problem = "The points do not determine the decay constant."
    if problem:
        return replace(given, message=problem)
    done = "The fit converged."
    return FitResult(given.model, True, done, given.points, given.start, *map(float, numbers))


def _search(form: FitModel, curves: Sequence[tuple[Array, Array]], free: bool) -> Iterator[_Found]:
    """The rate of each curve (s, y), its standard error, A, and whether the search settled.

    The best free A follows from the rate (Golub & Pereyra, SIAM J. Numer. Anal. 10, 413 (1973)).
    So the step of Gauss and Newton has one variable, p, and falls to zero at the minimum. The
    search moves to the zero of its secant. A move to a larger sum of squares is made shorter.
    """
    sizes = np.array([len(s) for s, _ in curves])
    inside = np.arange(sizes.max()) < sizes[:, None]
    s, y = np.zeros((2, *inside.shape))
    s[inside], y[inside] = map(np.concatenate, zip(*curves, strict=True))

    def at(p: Array, rows: NDArray[np.intp]) -> Array:
        """Sum of squares, step, squared change of the curve with p, and A; (4, rows)."""
        x = s[rows] * form.rate(p)[:, None]
        shape = form.curve(x) * inside[rows]
        slope = form.derivative(x, shape) * s[rows] * form.rate_slope(p)[:, None]
        height = np.ones(len(rows))
        if free:
            height = _dot(shape, y[rows]) / _dot(shape, shape)
            slope -= shape * (_dot(slope, shape) / _dot(shape, shape))[:, None]
        rest, slope = height[:, None] * shape - y[rows], height[:, None] * slope
        square = _dot(slope, slope)
        return np.array([_dot(rest, rest), -_dot(slope, rest) / square, square, height])

    p, rows = _first_guess(form, s, y, free), np.arange(len(curves))
    best = at(p, rows)
    move, least = best[1].copy(), _CURVE_ROUNDING * np.sqrt(_dot(y, y))
    settled = np.zeros(len(curves), dtype=bool)
    for _ in range(_MOST_STEPS):
        tried = at(p[rows] + move[rows], rows)
        better = np.sqrt(tried[0]) <= np.sqrt(best[0, rows]) + least[rows]
        kept, nearer = rows[better], tried[:, better]
        secant = np.clip(move[kept] / (best[1, kept] - nearer[1]), 0.25, 4)
        p[kept], best[:, kept] = p[kept] + move[kept], nearer
        move[kept] = nearer[1] * np.where(np.isfinite(secant), secant, 1.0)
        move[rows[~better]] /= 4
        step, change = np.abs(best[1, rows]), np.sqrt(best[2, rows])
        settled[rows] = (step * change <= least[rows]) | (step <= _CURVE_ROUNDING * np.abs(p[rows]))
        rows = rows[~settled[rows] & np.isfinite(best[1, rows])]
        if not rows.size:
            break
    total, _, square, height = best
    rate, slope = form.rate(p), form.rate_slope(p)
    error = slope * np.sqrt(total / (sizes - 1 - free) / square)
    # Refused: a decay that is over before the second point, and a rate with a tenfold error.
    over = np.sqrt(square) * np.abs(rate) <= slope * least / EPSILON**0.5
    error[(np.abs(rate) > 1) & (over | (error > 10 * np.abs(rate)))] = math.nan
    return zip(rate, error, height, settled, strict=True)


def _dot(first: Array, second: Array) -> Array:
    """The scalar product of each row."""
    return np.asarray(np.einsum("ij,ij->i", first, second))


def _first_guess(form: FitModel, s: Array, y: Array, free: bool) -> Array:
    """Start of the search: a straight line b + q s through the positive points' x, weighted.

    Where g(b + q s) is nearly A g(r s), r is the logarithmic slope there over that at zero.
    """
    height = np.where(y > 0, y, 1.0)
    x = form.inverse(height)
    weight = (y > 0) * form.derivative(x, height) ** 2
    middle = level = np.zeros((len(s), 1))  # a held amplitude is 1, at x = 0
    if free:
        middle, level = ((_dot(weight, column) / weight.sum(axis=1))[:, None] for column in (s, x))
    away = weight * (s - middle)
    slope = _dot(away, x - level) / _dot(away, s - middle)
    base = (level - slope[:, None] * middle)[:, 0]
    rate = slope * form.derivative(base, np.ones(len(s)))
    rate /= form.derivative(np.zeros(len(s)), np.ones(len(s)))
    bad = ~np.isfinite(rate) | (form.has_pole & (base <= -1))
    rate[bad] = 1.0
    return np.log1p(np.maximum(rate, -0.99)) if form.has_pole else rate


def fitted_curve(result: FitResult, t: ArrayLike) -> Array:
    """Values of the fitted model at the times `t` (s), same shape as `t`; nan if the fit failed."""
    elapsed = np.asarray(t, dtype=np.float64) - result.start
    with np.errstate(all="ignore"):
        return np.asarray(result.amplitude * MODELS[result.model].curve(result.value * elapsed))


@dataclass(frozen=True)
class RepeatMean:
    """A decay constant over repeats (1/s); all errors are nan for fewer than two usable repeats.

    value, error : mean and its standard error
    repeats, failed : repeats used, and repeats left out because their fit failed
    bootstrap_error : standard deviation of the mean over resampled repeats
    max_min_half_range : half of the range, the source report's error; it grows with the repeats
    """

    value: float
    error: float
    repeats: int
    failed: int
    bootstrap_error: float = math.nan
    max_min_half_range: float = math.nan


def mean_over_repeats(results: Sequence[FitResult]) -> RepeatMean:
    """Mean decay constant over repeats of one experiment, and its errors.

    The bootstrap (Efron 1979) draws ``RESAMPLES`` sets of repeats with replacement. The same
    results give the same numbers.
    """
    values = np.array([result.value for result in results if result.converged])
    count, failed = len(values), len(results) - len(values)
    if count < 2:
        return RepeatMean(float(values[0]) if count else math.nan, math.nan, count, failed)
    draws = np.random.default_rng(0).integers(count, size=(RESAMPLES, count))
    return RepeatMean(
        float(values.mean()),
        float(standard_errors(values)),
        count,
        failed,
        # A resample of n repeats scatters by the spread with n instead of n − 1 degrees of freedom.
        bootstrap_error=float(values[draws].mean(axis=1).std(ddof=1))
        * math.sqrt(count / (count - 1)),
        max_min_half_range=float(np.ptp(values)) / 2,
    )


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


def goodness(curves: Sequence[tuple[Array, Array]], results: Sequence[FitResult]) -> Goodness:
    """Judge a law on the mean over repeats of ln y, in standard errors over the repeats.

    curves : times (s), which increase, and ln y of each repeat, with its fit in ``results``

    Each range of time has the constant that fits it best. A test needs three repeats.
    """
    count = len(curves)
    if count < 3 or min(len(time) for time, _ in curves) < 2:
        return Goodness(count)
    form = MODELS[results[0].model]
    since = max(float(time[0]) for time, _ in curves)
    until = min(float(time[-1]) for time, _ in curves)
    inner = np.concatenate([time for time, _ in curves])
    inner = inner[(inner > since) & (inner < until)]
    if not inner.size:
        return Goodness(count)
    degrees, chi_squared, probability = _deviation(curves, form, inner, since, until)
    holds = since if math.isfinite(probability) else math.nan
    ends = np.append(np.quantile(inner, np.arange(1, MOST_WINDOWS) / MOST_WINDOWS), until)
    for end in map(float, ends[::-1] if math.isfinite(probability) else ()):
        if _deviation(curves, form, inner, since, end)[2] >= LEAST_PROBABILITY:
            holds = end
            break
    with np.errstate(all="ignore"):
        fitted = np.log([float(fitted_curve(result, until)) for result in results])
        gaps = np.array([np.interp(until, *curve) for curve in curves]) - fitted
        gaps = gaps[np.isfinite(gaps)]
        ratio = float(np.exp(gaps.mean())) if gaps.size else math.nan
    error = ratio * float(gaps.std(ddof=1)) / math.sqrt(gaps.size) if gaps.size > 1 else math.nan
    judged = since, until, chi_squared, degrees, probability
    return Goodness(count, *judged, holds, ratio, error)


def _deviation(
    curves: Sequence[tuple[Array, Array]], form: FitModel, inner: Array, since: float, until: float
) -> tuple[int, float, float]:
    """Degrees of freedom, χ² per degree and its probability in a range; nan without a test.

    The changes of ln y in windows of equal numbers of rows have a covariance over the repeats. The
    least χ² with this estimate is Hotelling's T², Ann. Math. Stat. 2, 360 (1931): with d degrees
    and n repeats, T² (n − d)/((n − 1) d) has the F distribution of d and n − d degrees.
    """
    count, inner = len(curves), inner[inner < until]
    windows = min(MOST_WINDOWS, (count + 1) // 2, inner.size // (ROWS_IN_WINDOW * count))
    if windows < 2:
        return 0, math.nan, math.nan
    edges = np.quantile(inner, np.linspace(0, 1, windows + 1))
    edges[[0, -1]] = since, until
    changes = np.diff([np.interp(edges, *curve) for curve in curves], axis=1)
    mean, spread = changes.mean(axis=0), changes.std(axis=0, ddof=1)
    if not np.all(spread > 1e-9 * np.abs(mean)):
        return 0, math.nan, math.nan  # repeats that differ by rounding have no errors
    shares, axes = np.linalg.eigh(np.cov(changes / spread, rowvar=False))
    if shares[0] < 1e-9:
        return 0, math.nan, math.nan

    def residuals(p: Array) -> Array:
        law = np.diff(np.log(form.curve(form.rate(p[0]) * edges / until)))
        return np.asarray(((mean - law) / spread) @ axes * np.sqrt(count / shares))

    with np.errstate(all="ignore"):
        x = float(form.inverse(np.exp(mean.sum())))
        first = math.log1p(x) if form.has_pole else x
        best = optimize.leastsq(residuals, [first], maxfev=_MOST_STEPS)[0]
        degrees = windows - 1
        free = count - degrees
        chi_squared = float(np.sum(residuals(best) ** 2)) * free / ((count - 1) * degrees)
    return degrees, chi_squared, float(special.fdtrc(degrees, free, chi_squared))


def excluded_area(densities: Array, ratios: Array, errors: Array) -> tuple[float, float]:
    """b of P V/(N T) = 1/(1 − n b), fitted to all densities, and its error; m².

    densities, ratios, errors : (*p*,), m⁻² and of P V/(N T); without errors all weigh the same
    """
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
