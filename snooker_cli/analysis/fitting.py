"""Decay models, least-squares fits of one curve, and means of fits over repeats.

The points of one cooling curve are correlated, so the error of a single fit is several times too
small. Quote the error over repeats, see `mean_over_repeats`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

Array: TypeAlias = NDArray[np.float64]

NOTHING_DECAYS = "The values are equal but for rounding, so nothing decays."
"""The message of a fit to a curve that stays where it is."""

_MOST_STEPS = 200


@dataclass(frozen=True)
class _Search:
    """The free number p that a search uses in place of a rate q.

    rate, slope : q and dq/dp at p
    parameter : p at q
    """

    rate: Callable[[float], float]
    slope: Callable[[float], float]
    parameter: Callable[[float], float]


_ANY_RATE = _Search(lambda p: p, lambda p: 1.0, lambda q: q)
_ABOVE_POLE = _Search(
    lambda p: float(np.expm1(p)),
    lambda p: float(np.exp(p)),
    lambda q: math.log1p(max(q, -0.99)),
)
"""q > −1 for every p, so that the pole of 1/(1 + q s) stays outside 0 ≤ s ≤ 1."""


@dataclass(frozen=True)
class FitModel:
    """A decay y = A g(q s) with one rate q, where g(0) = 1; s is the time since t0.

    name, label, formula : in files and tables; in legends; of y, with t the time since t0
    key, symbol, mean_symbol : the rate in JSON; its letter; its letter in a mean since the start
    curve, derivative : g and dg/dx at x = q s
    line, weight, rate_of_line : for the first guess: y as a straight line in s, 1/(its
        derivative)², and the rate for the slope and intercept of that line
    search : the variable of the search
    mean_model : the model that the mean since the start follows; empty if it is this one
    from_start : whether the rate depends on t0, so that t0 is always the start of the run
    """

    name: str
    label: str
    formula: str
    key: str
    symbol: str
    mean_symbol: str
    curve: Callable[[Array], Array]
    derivative: Callable[[Array], Array]
    line: Callable[[Array], Array]
    weight: Callable[[Array], Array]
    rate_of_line: Callable[[float, float], float]
    search: _Search = _ANY_RATE
    mean_model: str = ""
    from_start: bool = False


def _power_law(power: int, name: str, formula: str, mean_model: str = "") -> FitModel:
    """The model g = 1/(1 + x)^power of Haff's law."""
    return FitModel(
        name=name,
        label="Haff's law",
        formula=formula,
        key="alpha",
        symbol="α",
        mean_symbol="α",
        curve=lambda x: 1 / (1 + x) ** power,
        derivative=lambda x: -power / (1 + x) ** (power + 1),
        line=lambda y: y ** (-1 / power),
        weight=lambda y: y ** (2 + 2 / power),
        rate_of_line=lambda slope, intercept: slope / intercept if intercept > 0 else math.nan,
        search=_ABOVE_POLE,
        mean_model=mean_model,
        from_start=True,
    )


_ALL = (
    FitModel(
        name="exponential",
        label="exponential",
        formula="A e^(−kt)",
        key="k",
        symbol="k",
        mean_symbol="κ",
        curve=lambda x: np.asarray(np.exp(-x)),
        derivative=lambda x: np.asarray(-np.exp(-x)),
        line=lambda y: np.asarray(np.log(y)),
        weight=lambda y: y * y,
        rate_of_line=lambda slope, intercept: -slope,
    ),
    # Haff's law for the energy (Haff, J. Fluid Mech. 134, 401 (1983)), and the mean pressure under
    # that law.
    _power_law(2, "haff", "A/(1 + αt)²", "haff_root"),
    _power_law(1, "haff_root", "A/(1 + αt)"),
)

MODELS: dict[str, FitModel] = {model.name: model for model in _ALL}
"""Every decay model by its name."""

LAWS: dict[str, FitModel] = {
    name: model
    for name, model in MODELS.items()
    if name not in {other.mean_model for other in _ALL}
}
"""The laws of cooling: the models that are not the mean of another one."""


@dataclass(frozen=True)
class FitResult:
    """What one curve gives for one model; the numbers are nan if the fit failed.

    model : a name in ``MODELS``
    converged, message : whether the numbers can be used; how the fit ended, in one sentence
    points, start : number of points given; t0, the time of the amplitude (s)
    value : the rate: decay constant k or Haff's α (1/s)
    error : its standard error from this curve alone (1/s); too small for a cooling curve, whose
        points are correlated
    amplitude, rms_residual : A, as given if it was held, and the residual; in the unit of y
    r_squared : 1 − Σ residual²/Σ (y − mean y)²; nan for a constant y
    """

    model: str
    converged: bool
    message: str
    points: int
    start: float
    value: float = math.nan
    error: float = math.nan
    amplitude: float = math.nan
    rms_residual: float = math.nan
    r_squared: float = math.nan


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
    Raises ValueError for an unknown model, arrays of different shape, or an amplitude that is 0 or
    not finite.
    """
    if model not in MODELS:
        raise ValueError(f"{model!r} is not a decay model; choose from {', '.join(MODELS)}.")
    if amplitude is not None and (amplitude == 0 or not math.isfinite(amplitude)):
        raise ValueError(
            f"The amplitude cannot be held at {amplitude!r}; give a finite one, not 0."
        )
    times, values = np.asarray(t, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if times.ndim != 1 or times.shape != values.shape:
        raise ValueError(
            f"t and y must be flat and of one length, not {times.shape}, {values.shape}."
        )
    if start is None:
        start = float(times[0]) if times.size else math.nan

    def failure(message: str) -> FitResult:
        return FitResult(model, False, message, times.size, start)

    problem = _problem(times, values, start, amplitude, rounding)
    if problem:
        return failure(problem)

    form, free = MODELS[model], amplitude is None
    span = float(times.max()) - start
    scale = float(values[np.argmax(np.abs(values))]) if amplitude is None else amplitude
    s, scaled = (times - start) / span, values / scale

    def residuals(x: Array) -> Array:
        height = form.curve(s * form.search.rate(x[0]))
        return np.asarray((x[1] * height if free else height) - scaled)

    def jacobian(x: Array) -> Array:
        at = s * form.search.rate(x[0])
        slope = s * form.derivative(at) * form.search.slope(x[0])
        return np.array([x[1] * slope, form.curve(at)] if free else [slope])

    # Overflow and underflow on the way give numbers that the checks below refuse.
    with np.errstate(all="ignore"):
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

        # The search ends where the sum of squares hardly falls, which leaves the parameters known
        # to its root only. One step of Gauss and Newton takes them on to the minimum. The sum may
        # rise by its own rounding, which is large where the curve hardly leaves its start.
        slopes, rest = jacobian(best), residuals(best)
        nearer = best - _inverse(slopes @ slopes.T) @ (slopes @ rest)
        if np.sum(residuals(nearer) ** 2) <= np.sum(rest**2) * (1 + 1e-6):
            best = nearer

        rest, slopes = residuals(best), jacobian(best)
        squares = float(rest @ rest)
        slopes[0] /= form.search.slope(float(best[0]))
        covariance = _inverse(slopes @ slopes.T) * (squares / (times.size - best.size))
        deviation = scaled - scaled.mean()
        total = float(deviation @ deviation)
        rate = form.search.rate(float(best[0]))
        error = float(np.sqrt(covariance[0, 0]))
        found = FitResult(
            model=model,
            converged=True,
            message="The fit converged.",
            points=times.size,
            start=start,
            value=rate / span + 0.0,  # never −0.0
            error=error / span,
            amplitude=float(best[1] * scale) if free else scale,
            rms_residual=abs(scale) * math.sqrt(squares / times.size),
            r_squared=1 - squares / total if total > 0 else math.nan,
        )
    known = np.array([found.value, found.error, found.amplitude, *covariance.flat])
    # The last clause refuses decays that are over before the second point: no value is too large.
    if not np.all(np.isfinite(known)) or error > 10 * abs(rate) > 10:
        return failure("The points do not determine the decay constant.")
    return found


def fitted_curve(result: FitResult, t: ArrayLike) -> Array:
    """Values of the fitted model at the times `t` (s), same shape as `t`; nan if the fit failed."""
    elapsed = np.asarray(t, dtype=np.float64) - result.start
    with np.errstate(all="ignore"):
        return np.asarray(result.amplitude * MODELS[result.model].curve(result.value * elapsed))


def _problem(
    times: Array, values: Array, start: float, amplitude: float | None, rounding: float
) -> str:
    """Why these data cannot be fitted, as a sentence; empty if they can."""
    held = amplitude is not None
    least = 2 if held else 3
    if times.size < least:
        return f"too few points for this fit: {times.size}; it needs {least} or more."
    for name, array in (("times", times), ("values", values)):
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            return f"{bad.size} of the {name} are not finite, the first at index {bad[0]}."
    lowest, highest = float(times.min()), float(times.max())
    if lowest < 0:
        return f"The time {lowest:g} s is negative; times count from the start of the run."
    if not lowest >= start:
        return f"The time {lowest:g} s lies before the start of the decay at {start:g} s."
    if highest == (start if held else lowest):
        return f"All times are {highest:g} s, so nothing decays between them."
    if not np.any(values):
        return "All values are zero, so there is no decay to fit."
    level = float(values[0]) if amplitude is None else amplitude
    with np.errstate(over="ignore"):
        if np.max(np.abs(values - level)) <= rounding * abs(level):
            return NOTHING_DECAYS
    return ""


def _first_guess(form: FitModel, s: Array, scaled: Array, free: bool) -> Array:
    """Start of the search: a weighted straight line through the transformed positive points."""
    positive = scaled > 0
    s, height = s[positive], scaled[positive]
    line, weight = form.line(height), form.weight(height)
    if free:
        total = weight.sum()
        middle, level = (weight @ s) / total, (weight @ line) / total
        slope = (weight @ ((s - middle) * (line - level))) / (weight @ (s - middle) ** 2)
        intercept = float(level - slope * middle)
    else:
        # Held at one: the line starts at the transform of one.
        intercept = float(form.line(np.ones(1))[0])
        slope = (weight @ (s * (line - intercept))) / (weight @ (s * s))
    rate = form.rate_of_line(float(slope), intercept)
    p = form.search.parameter(rate if math.isfinite(rate) else 1.0)
    if not free:
        return np.array([p])
    shape = form.curve(s * form.search.rate(p))
    factor = (shape @ height) / (shape @ shape)
    return np.array([p, factor if np.isfinite(factor) else 1.0])


def _inverse(matrix: Array) -> Array:
    """Inverse of a symmetric matrix of order 1 or 2; inf or nan where it has none."""
    if matrix.size == 1:
        return np.asarray(1 / matrix)
    (a, b), (_, d) = matrix
    return np.asarray(np.array([[d, -b], [-b, a]]) / (a * d - b * b))


@dataclass(frozen=True)
class RepeatMean:
    """A decay constant over repeats (1/s); all errors are nan for fewer than two usable repeats.

    count, failed : repeats used, and repeats left out because their fit failed
    standard_deviation, standard_error : of one repeat, and of the mean
    bootstrap_error : standard deviation of the mean over resampled repeats
    bootstrap_low, bootstrap_high : interval of the mean that holds 68.27 % of the resamples
    max_min_half_range : half of the range, the source report's error; it grows with the number of
        repeats
    """

    count: int
    failed: int
    mean: float = math.nan
    standard_deviation: float = math.nan
    standard_error: float = math.nan
    bootstrap_error: float = math.nan
    bootstrap_low: float = math.nan
    bootstrap_high: float = math.nan
    max_min_half_range: float = math.nan


def mean_over_repeats(
    results: Iterable[FitResult], *, resamples: int = 2000, seed: int = 0
) -> RepeatMean:
    """Mean decay constant over repeats of one experiment, and its errors.

    The bootstrap (Efron 1979) draws `resamples` sets of repeats with replacement from a generator
    seeded with `seed`: the same results give the same numbers.
    """
    given = list(results)
    values = np.array([result.value for result in given if result.converged])
    count, failed = values.size, len(given) - values.size
    if count < 2:
        return RepeatMean(count, failed, mean=float(values[0]) if count else math.nan)
    deviation = float(values.std(ddof=1))
    draws = np.random.default_rng(seed).integers(count, size=(resamples, count))
    means = values[draws].mean(axis=1)
    outside = 50 * math.erfc(math.sqrt(0.5))
    low, high = np.percentile(means, [outside, 100 - outside])
    return RepeatMean(
        count=count,
        failed=failed,
        mean=float(values.mean()),
        standard_deviation=deviation,
        standard_error=deviation / math.sqrt(count),
        bootstrap_error=float(means.std(ddof=1)),
        bootstrap_low=float(low),
        bootstrap_high=float(high),
        max_min_half_range=float(np.ptp(values)) / 2,
    )
