"""Decay models, least-squares fits of one curve, and means of fits over repeats.

The points of one cooling curve are correlated, so that the error of a single fit is far too small:
quote the error over repeats.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special

from snooker_cli.analysis.observables import standard_errors

Array: TypeAlias = NDArray[np.float64]

NOTHING_DECAYS = "The values are equal but for rounding, so nothing decays."

_MOST_STEPS = 200

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
    curve, derivative : g and dg/dx at x = q s
    inverse : the x at which g has a positive value
    has_pole : whether g has a pole at x = −1, so that a fit needs q s > −1; the rate then depends
        on t0, which is the start of the run
    mean_model : the model fitted to a mean since the start; empty for this one. The exponential is
        fitted to such means as in the source report, although they are (1 − exp(−kt))/(kt)
    """

    label: str
    formula: str
    key: str
    symbol: str
    mean_symbol: str
    curve: Callable[[Array], Array]
    derivative: Callable[[Array], Array]
    inverse: Callable[[Array], Array]
    has_pole: bool = False
    mean_model: str = ""

    def rate(self, p: float) -> float:
        """The rate q at the variable p of a search; e^p − 1 is above −1 for every p."""
        return float(np.expm1(p)) if self.has_pole else p

    def rate_slope(self, p: float) -> float:
        """dq/dp."""
        return float(np.exp(p)) if self.has_pole else 1.0


LAWS = {
    "exponential": FitModel(
        label="exponential",
        formula="A e^(−kt)",
        key="k",
        symbol="k",
        mean_symbol="κ",
        curve=lambda x: np.asarray(np.exp(-x)),
        derivative=lambda x: np.asarray(-np.exp(-x)),
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
        derivative=lambda x: -2 / (1 + x) ** 3,
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
        derivative=lambda x: -1 / (1 + x) ** 2,
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


def fit(
    t: ArrayLike,
    y: ArrayLike,
    model: str = "exponential",
    *,
    amplitude: float | None = None,
    start: float | None = None,
    rounding: float = 0.0,
) -> FitResult:
    """Least-squares fit of a decay to one curve.

    t, y : (*n*,) times (s, at least 0) and values; any scale, the search is dimensionless
    model : a name in ``MODELS``
    amplitude : A is held at this value; by default it is free
    start : t0 (s), not after any of the times; by default the first of them
    rounding : relative size of changes that are only rounding; no decay is sought in them

    Data that cannot be fitted give a result with converged=False and a message with the reason.
    Raises KeyError for an unknown model.
    """
    form, free = MODELS[model], amplitude is None
    times, values = np.asarray(t, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if start is None:
        start = float(times[0]) if times.size else math.nan

    def failure(message: str) -> FitResult:
        return FitResult(model, False, message, times.size, start)

    least = 2 + free
    if times.size < least:
        return failure(f"Too few points for this fit: {times.size}; it needs {least} or more.")

    # Overflow, underflow and numbers that are not finite end in the check of the result.
    with np.errstate(all="ignore"):
        level = values[0] if amplitude is None else amplitude
        if np.max(np.abs(values - level)) <= rounding * abs(level):
            return failure(NOTHING_DECAYS if level else "All values are zero.")
        scale = float(values[np.argmax(np.abs(values))]) if amplitude is None else amplitude
        span = times.max() - start
        s, scaled = (times - start) / span, values / scale

        def residuals(x: Array) -> Array:
            p, height = x if free else (x[0], 1.0)  # a held amplitude is 1
            return np.asarray(height * form.curve(s * form.rate(p)) - scaled)

        def jacobian(x: Array) -> Array:
            p, height = x if free else (x[0], 1.0)
            at = s * form.rate(p)
            slope = height * s * form.derivative(at) * form.rate_slope(p)
            return np.array([slope, form.curve(at)])[: len(x)]

        best, _, _, _, code = optimize.leastsq(
            residuals,
            _first_guess(form, s, scaled, free),
            Dfun=jacobian,
            col_deriv=True,
            full_output=True,
            ftol=1e-12,
            xtol=1e-12,
            maxfev=_MOST_STEPS,
        )
        # Codes 6, 7 and 8 are MINPACK's "no further reduction is possible": rounding is reached.
        if code not in (1, 2, 3, 4, 6, 7, 8):
            return failure(f"The search did not settle in {_MOST_STEPS} steps: no such decay.")

        # The search ends where the sum of squares hardly falls: the parameters are known to its
        # root only. One step of Gauss and Newton goes on to the minimum. The sum may rise by its
        # own rounding, which is large where the curve hardly leaves its start.
        slopes, rest = jacobian(best), residuals(best)
        nearer = best - _inverse(slopes @ slopes.T) @ (slopes @ rest)
        if np.sum(residuals(nearer) ** 2) <= np.sum(rest**2) * (1 + 1e-6):
            best = nearer

        rest, slopes = residuals(best), jacobian(best)
        slopes[0] /= form.rate_slope(best[0])
        covariance = _inverse(slopes @ slopes.T) * (rest @ rest / (times.size - best.size))
        rate, error = form.rate(best[0]), np.sqrt(covariance[0, 0])
        found = FitResult(
            model=model,
            converged=True,
            message="The fit converged.",
            points=times.size,
            start=start,
            value=float(rate / span) + 0.0,  # never −0.0
            error=float(error / span),
            amplitude=float(best[1] * scale) if free else scale,
        )
        known = [found.value, found.error, found.amplitude, *covariance.flat]
        # The last clause refuses decays that are over before the second point.
        if not np.all(np.isfinite(known)) or error > 10 * abs(rate) > 10:
            return failure("The points do not determine the decay constant.")
        return found


def fitted_curve(result: FitResult, t: ArrayLike) -> Array:
    """Values of the fitted model at the times `t` (s), same shape as `t`; nan if the fit failed."""
    elapsed = np.asarray(t, dtype=np.float64) - result.start
    with np.errstate(all="ignore"):
        return np.asarray(result.amplitude * MODELS[result.model].curve(result.value * elapsed))


def _first_guess(form: FitModel, s: Array, scaled: Array, free: bool) -> Array:
    """Start of the search: a straight line b + q s through the positive points' x, weighted.

    Where g(b + q s) is nearly A g(r s), r is the logarithmic slope there over that at zero.
    """
    s, height = s[scaled > 0], scaled[scaled > 0]
    x = form.inverse(height)
    weight = form.derivative(x) ** 2
    middle = level = 0.0  # a held amplitude is 1, at x = 0
    if free:
        middle, level = weight @ s / weight.sum(), weight @ x / weight.sum()
    slope = (weight @ ((s - middle) * (x - level))) / (weight @ (s - middle) ** 2)
    base = np.array([level - slope * middle])
    rate = slope * form.derivative(base) / form.curve(base) / form.derivative(np.zeros(1))
    if not math.isfinite(rate[0]) or (form.has_pole and base[0] <= -1):
        rate = np.ones(1)
    p = np.log1p(np.maximum(rate, -0.99)) if form.has_pole else rate
    if not free:
        return np.asarray(p)
    shape = form.curve(s * form.rate(p[0]))
    factor = (shape @ height) / (shape @ shape)
    return np.array([p[0], factor if np.isfinite(factor) else 1.0])


def _inverse(matrix: Array) -> Array:
    """Inverse of a symmetric matrix of order 1 or 2; inf or nan where it has none."""
    if matrix.size == 1:
        return np.asarray(1 / matrix)
    (a, b), (_, d) = matrix
    return np.asarray(np.array([[d, -b], [-b, a]]) / (a * d - b * b))


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
        bootstrap_error=float(values[draws].mean(axis=1).std(ddof=1)),
        max_min_half_range=float(np.ptp(values)) / 2,
    )


@dataclass(frozen=True)
class Goodness:
    """Whether a law describes the mean of ln y over repeats; what is not known is nan.

    judged_repeats : number of repeats that are judged
    judged_from, judged_to : the judged times (s), in which all these repeats have values
    chi_squared_per_degree, degrees_of_freedom : its mean is nearly 1 if the law holds
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
        fitted = np.log([float(fitted_curve(each, until)) for each in results])
        gaps = np.array([np.interp(until, *each) for each in curves]) - fitted
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
    changes = np.diff([np.interp(edges, *each) for each in curves], axis=1)
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
