"""Decay constants from curves: one least-squares fit a curve, honest errors from many repeats.

The points of one cooling curve are correlated, so the error that a single fit reports is several
times too small. `fit` gives it all the same; `ensemble` over repeats gives the error to quote.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

Array = NDArray[np.float64]
Model = Literal["exponential", "haff", "haff_root"]

NOTHING_DECAYS = "The values are equal but for rounding, so nothing decays."
"""The message of a fit to a curve that stays where it is."""

_MOST_STEPS = 200


@dataclass(frozen=True)
class _Form:
    """One decay y = A g(q s), with s the time since t0 over the span of the data, 0 ≤ s ≤ 1.

    The search runs over a free number p; `rate` and `search` turn it into q and back. The first
    guess is a straight line through `straight(y)`, whose points weigh `weight(y)` = 1/straight'².
    """

    value: Callable[[float, Array], Array]
    slope: Callable[[float, Array], Array]
    rate: Callable[[float], float]
    rate_slope: Callable[[float], float]
    search: Callable[[float], float]
    straight: Callable[[Array], Array]
    weight: Callable[[Array], Array]
    rate_of_line: Callable[[float, float], float]


def _power_law(power: int) -> _Form:
    """The form g = (1 + q s)^−power, searched over p = ln(1 + q).

    Every p keeps the pole of g outside the data, even for curves that rise.
    """

    def value(p: float, s: Array) -> Array:
        return np.asarray(1 / (1 + s * np.expm1(p)) ** power)

    def slope(p: float, s: Array) -> Array:
        base = 1 + s * np.expm1(p)
        return np.asarray(-power * np.exp(p) * s / (base**power * base))

    return _Form(
        value=value,
        slope=slope,
        rate=lambda p: float(np.expm1(p)),
        rate_slope=lambda p: float(np.exp(p)),
        search=lambda q: math.log1p(max(q, -0.99)),
        straight=lambda y: y ** (-1 / power),
        weight=lambda y: y ** (2 + 2 / power),
        rate_of_line=lambda slope, intercept: slope / intercept if intercept > 0 else math.nan,
    )


_FORMS: dict[str, _Form] = {
    "exponential": _Form(
        value=lambda p, s: np.exp(-p * s),
        slope=lambda p, s: -s * np.exp(-p * s),
        rate=lambda p: p,
        rate_slope=lambda p: 1.0,
        search=lambda q: q,
        straight=lambda y: np.log(y),
        weight=lambda y: y * y,
        rate_of_line=lambda slope, intercept: -slope,
    ),
    "haff": _power_law(2),
    "haff_root": _power_law(1),
}


@dataclass(frozen=True)
class FitResult:
    """What one curve says about one model; the numbers are nan when the fit has failed.

    Attributes
    ----------
    model : str
        "exponential", "haff" or "haff_root", see `fit`.
    converged : bool
        Whether the numbers can be used.
    message : str
        How the fit ended, in one sentence.
    points : int
        Number of points given.
    start : float
        t0, the time that the amplitude belongs to (s).
    covariance : (1, 1) or (2, 2) numpy.ndarray of numpy.float64
        Of `value` and, if it was free, `amplitude`. Read-only.
    value : float
        Decay constant k or Haff's α (1/s).
    error : float
        Standard error of `value` from this curve alone (1/s). It takes the points for independent,
        which those of a cooling curve are not: too small.
    amplitude : float
        A, in the unit of y; as given if it was held.
    rms_residual : float
        Root of the mean squared residual, in the unit of y.
    r_squared : float
        1 − Σ residual²/Σ (y − mean y)²; nan for a constant y.
    """

    model: Model
    converged: bool
    message: str
    points: int
    start: float
    covariance: Array = field(compare=False)
    value: float = math.nan
    error: float = math.nan
    amplitude: float = math.nan
    rms_residual: float = math.nan
    r_squared: float = math.nan


def fit(
    t: ArrayLike,
    y: ArrayLike,
    model: Model = "exponential",
    *,
    amplitude: float | None = None,
    start: float | None = None,
    sigma: ArrayLike | None = None,
    rounding: float = 0.0,
) -> FitResult:
    """Least-squares fit of a decay to one curve.

    With u = t − t0, the models are "exponential" y = A e^(−k u); "haff" y = A/(1 + αu)², Haff's law
    for the energy (Haff 1983); "haff_root" y = A/(1 + αu), the cumulative pressure under that law.

    Parameters
    ----------
    t, y : (n,) array_like
        Times (s, at least 0) and values (any unit). Any scale: the search is dimensionless.
    amplitude : float, optional
        Hold A at this value (a ratio to the start is 1 there); by default it is free.
    start : float, optional
        t0 (s), not after any of the times; by default the first of them.
    sigma : (n,) array_like, optional
        Standard deviations of y. They weight the points and set the scale of the errors, which
        otherwise comes from the residuals.
    rounding : float, optional
        Relative size of changes that are nothing but rounding: in them no decay is sought.

    Data that cannot be fitted give a result with converged=False and a sentence that says why.
    Raises ValueError for an unknown model, arrays of unlike shape, or an amplitude that is 0 or not
    finite.
    """
    if model not in _FORMS:
        raise ValueError(f"{model!r} is not a decay model; choose from {', '.join(_FORMS)}.")
    if amplitude is not None and (amplitude == 0 or not math.isfinite(amplitude)):
        raise ValueError(f"An amplitude of {amplitude!r} cannot be held; give a finite one, not 0.")
    times, values = np.asarray(t, dtype=np.float64), np.asarray(y, dtype=np.float64)
    sigmas = np.ones_like(values) if sigma is None else np.asarray(sigma, dtype=np.float64)
    if times.ndim != 1 or not times.shape == values.shape == sigmas.shape:
        shapes = ", ".join(str(array.shape) for array in (times, values, sigmas))
        raise ValueError(f"The arrays of a fit must be flat and of one length, not {shapes}.")
    if start is None:
        start = float(times[0]) if times.size else math.nan

    def failure(message: str) -> FitResult:
        size = 2 if amplitude is None else 1
        covariance = np.full((size, size), math.nan)
        covariance.setflags(write=False)
        return FitResult(model, False, message, times.size, start, covariance)

    problem = _problem(times, values, sigmas, start, amplitude, rounding)
    if problem:
        return failure(problem)

    form, free = _FORMS[model], amplitude is None
    span = float(times.max()) - start
    scale = float(values[np.argmax(np.abs(values))]) if amplitude is None else amplitude
    # Overflow and underflow on the way are met by the checks of what comes out.
    with np.errstate(all="ignore"):
        s, scaled, weights = (times - start) / span, values / scale, sigmas.min() / sigmas

        def residuals(x: Array) -> Array:
            factor = x[1] if free else 1.0
            return np.asarray((factor * form.value(x[0], s) - scaled) * weights)

        def jacobian(x: Array) -> Array:
            factor = x[1] if free else 1.0
            rows = np.empty((x.size, s.size))
            rows[0] = factor * form.slope(x[0], s)
            if free:
                rows[1] = form.value(x[0], s)
            rows *= weights
            return rows

        best, _, _, _, code = optimize.leastsq(
            residuals,
            _first_guess(form, s, scaled, weights, free),
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

        rest = residuals(best)
        smallest = float(sigmas.min()) / scale
        freedom = times.size - best.size
        variance = float(rest @ rest) / freedom if sigma is None else smallest * smallest
        slopes = jacobian(best)
        slopes[0] /= form.rate_slope(float(best[0]))
        relative = _inverse(slopes @ slopes.T) * variance
        rate, rate_error = form.rate(float(best[0])), float(np.sqrt(relative[0, 0]))
        units = np.array([1 / span, scale])[: best.size]
        covariance = relative * units[:, None] * units
        plain = rest / weights
        plain_square = float(plain @ plain)
        deviation = scaled - scaled.mean()
        total = float(deviation @ deviation)
    # The last clause meets decays that are over before the second point: no value is too large.
    determined = np.all(np.isfinite(covariance)) and math.isfinite(rate_error)
    if not determined or rate_error > 10 * abs(rate) > 10:
        return failure("The points do not determine the decay constant.")
    covariance.setflags(write=False)
    return FitResult(
        model=model,
        converged=True,
        message="The fit converged.",
        points=times.size,
        start=start,
        covariance=covariance,
        value=rate / span + 0.0,  # never −0.0
        error=rate_error / span,
        amplitude=float(best[1]) * scale if free else scale,
        rms_residual=abs(scale) * math.sqrt(plain_square / times.size),
        r_squared=1 - plain_square / total if total > 0 else math.nan,
    )


def fitted_curve(result: FitResult, t: ArrayLike) -> Array:
    """Values of the fitted model at the times `t` (s), same shape as `t`; nan if the fit failed."""
    elapsed = np.asarray(t, dtype=np.float64) - result.start
    with np.errstate(all="ignore"):
        if result.model == "exponential":
            return np.asarray(result.amplitude * np.exp(-result.value * elapsed))
        power = 2 if result.model == "haff" else 1
        return np.asarray(result.amplitude / (1 + result.value * elapsed) ** power)


def _problem(
    times: Array,
    values: Array,
    sigmas: Array,
    start: float,
    amplitude: float | None,
    rounding: float,
) -> str:
    """Why these data cannot be fitted, as a sentence; empty if they can."""
    held = amplitude is not None
    least = 2 if held else 3
    if times.size < least:
        return f"too few points for this fit: {times.size}; it needs {least} or more."
    for name, array in (("times", times), ("values", values), ("standard deviations", sigmas)):
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            return f"{bad.size} of the {name} are not finite, the first at index {bad[0]}."
    if not np.all(sigmas > 0):
        return "The standard deviations must all be positive."
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


def _first_guess(form: _Form, s: Array, scaled: Array, weights: Array, free: bool) -> Array:
    """Start of the search: a weighted straight line through the transformed positive points."""
    positive = scaled > 0
    s, height = s[positive], scaled[positive]
    line = form.straight(height)
    weight = form.weight(height) * weights[positive] ** 2
    if free:
        total = weight.sum()
        middle, level = (weight @ s) / total, (weight @ line) / total
        slope = (weight @ ((s - middle) * (line - level))) / (weight @ (s - middle) ** 2)
        intercept = float(level - slope * middle)
    else:
        # Held at one: the line starts at the transform of one.
        intercept = float(form.straight(np.ones(1))[0])
        slope = (weight @ (s * (line - intercept))) / (weight @ (s * s))
    rate = form.rate_of_line(float(slope), intercept)
    p = form.search(rate if math.isfinite(rate) else 1.0)
    if not free:
        return np.array([p])
    shape = form.value(p, s)
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
    """A decay constant over repeats; all spreads are nan for fewer than two usable repeats.

    Attributes
    ----------
    count, failed : int
        Repeats used, and repeats left out because their fit failed.
    mean : float
        Mean of the fitted values (1/s).
    standard_deviation : float
        Sample standard deviation of one repeat (1/s).
    standard_error : float
        Of the mean: standard deviation/√count (1/s).
    bootstrap_error : float
        Standard deviation of the mean over resampled repeats (1/s).
    bootstrap_low, bootstrap_high : float
        Percentile interval of the mean that holds 68.27 % of the resamples (1/s).
    max_min_half_range : float
        (largest − smallest)/2 over the repeats, the source report's way (1/s). It is a spread of
        single repeats that grows with their number, not an error of the mean.
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


def ensemble(results: Iterable[FitResult], *, resamples: int = 2000, seed: int = 0) -> RepeatMean:
    """Mean decay constant over repeats of one experiment, and how well it is known.

    The bootstrap (Efron 1979) draws `resamples` sets of repeats with replacement from a generator
    seeded with `seed`: the same results give the same numbers. Raises ValueError for fewer than
    two resamples.
    """
    if resamples < 2:
        raise ValueError(f"A bootstrap needs at least 2 resamples, not {resamples}.")
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
