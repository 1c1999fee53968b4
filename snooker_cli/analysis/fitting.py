"""Decay models, least-squares fits of many curves at once, and means of fits over repeats.

The points of one cooling curve are correlated, so that the error of a single fit is far too small:
quote the error over repeats.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli.analysis.observables import standard_errors
from snooker_cli.scene import EPSILON

Array: TypeAlias = NDArray[np.float64]

NOTHING_DECAYS = "The values are equal but for rounding, so nothing decays."

MOST_STEPS = 100
TOGETHER = 256  # curves that are fitted at once, so that their arrays stay in the cache

CURVE_ROUNDING = 4 * EPSILON  # relative change of a curve that is only rounding


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

    def inverse(self, y: Array) -> Array:
        """The x at which g has these positive values."""
        return np.asarray(y ** (-1 / self.power) - 1.0 if self.power else -np.log(y))

    def place_of_mean(self, rate: Array, low: Array, high: Array) -> Array:
        """The time, s since the start, at which g(q t) is its mean between two times.

        rate : q > 0, 1/s; n is 0 or 2
        """
        if self.power:
            return np.asarray((np.sqrt((1 + rate * low) * (1 + rate * high)) - 1) / rate)
        fall = rate * (high - low)
        return np.asarray(low - np.log(-np.expm1(-fall) / fall) / rate)

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


DONE = "The fit converged."

ALL_ZERO = "All values are zero."

UNSETTLED = f"The search did not settle in {MOST_STEPS} steps: no such decay."

UNDETERMINED = "The points do not determine the decay constant."


class Points(NamedTuple):
    """Points of curves that are fitted with one law: arrays (*curves*, *points*).

    time, value : s; any unit
    weight : the number of values that a point stands for; zero if there is no point
    """

    time: Array
    value: Array
    weight: Array

    @property
    def numbers(self) -> list[int]:
        """The values behind each curve."""
        return list(self.weight.sum(axis=1).round().astype(int).tolist())


def fit_all(
    points: Points,
    origin: Array,
    rounding: Array,
    model: str = "exponential",
    amplitude: float | None = None,
) -> list[FitResult]:
    """Least-squares fits of a decay to curves; the search is dimensionless, so any scale is good.

    origin : (*curves*,) t0, s, not after any of the times
    rounding : (*curves*,) relative size of changes that are only rounding; no decay is sought there
    model : a name in ``MODELS``
    amplitude : A is held at this value; by default it is free

    Data that cannot be fitted give a result with converged=False and a message with the reason.
    Raises KeyError for an unknown model.
    """
    results: list[FitResult] = []
    for k in range(0, len(origin), TOGETHER):
        rows = slice(k, k + TOGETHER)
        some = Points(*(column[rows] for column in points))
        results += _fitted(some, origin[rows], rounding[rows], model, amplitude)
    return results


@np.errstate(all="ignore")
def _fitted(
    points: Points, origin: Array, rounding: Array, model: str, amplitude: float | None
) -> list[FitResult]:
    law, free = MODELS[model], amplitude is None
    used, numbers = points.weight > 0, points.numbers
    elapsed = np.where(used, points.time - origin[:, np.newaxis], 0.0)
    value = np.where(used, points.value, 0.0)
    first = value[np.arange(len(value)), np.argmax(used, axis=1)]
    level = first if amplitude is None else np.full(len(value), amplitude)
    changes = np.abs(np.where(used, value, level[:, np.newaxis]) - level[:, np.newaxis]).max(axis=1)
    few = used.sum(axis=1) < 2 + free
    flat = changes <= rounding * np.abs(level)
    messages = np.where(level == 0, ALL_ZERO, NOTHING_DECAYS).astype(object)
    messages[few] = [
        f"A fit needs {2 + free} or more points; here are {number}."
        for number in np.array(numbers)[few]
    ]
    rate, error, height = np.full((3, len(value)), math.nan)
    sought = np.flatnonzero(~few & ~flat)
    if len(sought):
        largest = np.take_along_axis(value, np.argmax(np.abs(value), axis=1)[:, np.newaxis], 1)
        scale = (largest[:, 0] if free else level)[sought]
        span = elapsed[sought].max(axis=1)
        scaled = elapsed[sought] / span[:, None], value[sought] / scale[:, None]
        found = _Search(law, free, *scaled, points.weight[sought]).result()
        rate[sought], error[sought] = found[0] / span, found[1] / span
        height[sought] = found[2] * scale
        messages[sought] = np.where(found[3] > 0, DONE, UNSETTLED)
    results = []
    columns = zip(messages.tolist(), numbers, origin.tolist(), rate, error, height, strict=True)
    for message, number, start, *fitted in columns:
        known = tuple(float(value) + 0.0 for value in fitted) if message == DONE else ()  # no −0.0
        if not all(map(math.isfinite, known)):
            message, known = UNDETERMINED, ()
        results.append(FitResult(model, message == DONE, message, number, start, *known))
    return results


class _Sums(NamedTuple):
    """Of each curve: sum of squares, step, squared change of the curve with p, and A."""

    total: Array
    step: Array
    square: Array
    height: Array

    def where(self, better: "NDArray[np.bool_]", other: "_Sums") -> "_Sums":
        """These sums, where they are better than others."""
        pairs = zip(self, other, strict=True)
        return _Sums(*(np.where(better, mine, others) for mine, others in pairs))


class _Search:
    """The search for the rates of curves (*curves*, *points*) with largest time and value 1.

    The best free A follows from the rate (Golub & Pereyra, SIAM J. Numer. Anal. 10, 413 (1973)).
    So the step of Gauss and Newton has one variable, p, and falls to zero at the minimum: the rate
    of the exponential, else ln(1 + rate), which keeps the law from its pole. The search moves to
    the zero of its secant. A move to a larger sum of squares is made shorter.
    """

    def __init__(self, law: FitModel, free: bool, s: Array, y: Array, w: Array) -> None:
        self.law, self.free, self.s, self.values, self.w = law, free, s, y, w
        self.root = np.sqrt(w)
        self.y = y * self.root
        self.least = CURVE_ROUNDING * np.sqrt(_dot(self.y, self.y))

    def result(self) -> tuple[Array, Array, Array, Array]:
        """Rate, its standard error, A, and 1 where the search settled, else 0; (*curves*,) each."""
        p = self._first_guess()
        best = self._sums(p)
        move, settled, active = best.step, np.zeros(len(p), bool), np.ones(len(p), bool)
        for _ in range(MOST_STEPS):
            tried = self._sums(p + move, active)
            better = active & (np.sqrt(tried.total) <= np.sqrt(best.total) + self.least)
            secant = move / (best.step - tried.step)
            secant = np.clip(np.where(np.isnan(secant), 1.0, secant), 0.25, 4.0)
            p, best = np.where(better, p + move, p), tried.where(better, best)
            move = np.where(better, best.step * secant, move / 4)
            change = np.abs(best.step)
            small = change * np.sqrt(best.square) <= self.least
            settled |= active & (small | (change <= CURVE_ROUNDING * np.abs(p)))
            active &= ~settled & np.isfinite(change)
            if not active.any():
                break
        rate, slope = self._rate(p)
        number = self.w.sum(axis=1)
        error = slope * np.sqrt(best.total / (number - 1 - self.free) / best.square)
        # Refused: a decay that is over before the second point, and a rate with a tenfold error.
        over = np.sqrt(best.square) * np.abs(rate) <= slope * self.least / np.sqrt(EPSILON)
        refused = (np.abs(rate) > 1.0) & (over | (error > 10.0 * np.abs(rate)))
        error = np.where(refused, math.nan, error)
        return rate, error, best.height, settled.astype(np.float64)

    def _rate(self, p: Array) -> tuple[Array, Array]:
        """The rate at p, and its derivative."""
        return (np.expm1(p), np.exp(p)) if self.law.power else (p, np.ones_like(p))

    def _sums(self, p: Array, active: "NDArray[np.bool_] | None" = None) -> _Sums:
        """The sums at p; of curves that are still active, because most settle early."""
        if active is None or active.all():
            return self._of(p, self.s, self.y, self.root)
        sums = np.full((4, len(p)), math.nan)
        some = (column[active] for column in (p, self.s, self.y, self.root))
        sums[:, active] = self._of(*some)
        return _Sums(*sums)

    def _of(self, p: Array, s: Array, y: Array, root: Array) -> _Sums:
        """The sums of curves; values and laws are multiplied by the roots of the weights."""
        power, (rate, rate_slope) = self.law.power, self._rate(p)
        if power:
            base = s * rate[:, np.newaxis]
            base += 1.0
            np.divide(1.0, base, out=base)
            shape = base * root
            if power > 1:
                shape *= base
            slope = base
            slope *= shape
            slope *= s
            slope *= -power * rate_slope[:, np.newaxis]
        else:
            shape = np.exp(s * -rate[:, np.newaxis])
            shape *= root
            slope = shape * s
            np.negative(slope, out=slope)
        height = np.ones_like(p)
        if self.free:
            alone = _dot(shape, shape)
            height = _dot(shape, y) / alone
            slope -= shape * (_dot(shape, slope) / alone)[:, np.newaxis]
            shape *= height[:, np.newaxis]
            slope *= height[:, np.newaxis]
        shape -= y  # now the residuals
        along, square = _dot(slope, shape), _dot(slope, slope)
        return _Sums(_dot(shape, shape), -along / square, square, height)

    def _first_guess(self) -> Array:
        """Start of the search: a straight line b + q s through the positive points' x, weighted.

        x is where g has the value y, and its weight the square of dg/dx there. Where g(b + q s) is
        nearly A g(r s), r is the logarithmic slope there over that at zero.
        """
        power, positive = self.law.power, self.values > 0
        y, s = np.where(positive, self.values, 1.0), self.s
        x = self.law.inverse(y)
        weight = self.w * positive * (power**2 * y ** (2 + 2 / power) if power else y * y)
        middle = level = np.zeros((len(y), 1))  # where the amplitude is held: x = 0 at time zero
        if self.free:
            total = weight.sum(axis=1, keepdims=True)
            middle, level = (_dot(weight, values)[:, np.newaxis] / total for values in (s, x))
        away = weight * (s - middle)
        rate = _dot(away, x - level) / _dot(away, s - middle)
        base = level[:, 0] - rate * middle[:, 0]
        if not power:
            return np.asarray(np.where(np.isfinite(rate), rate, 1.0))
        rate /= 1.0 + base
        rate = np.where(np.isfinite(rate) & (base > -1.0), rate, 1.0)
        return np.asarray(np.log1p(np.maximum(rate, -0.99)))


def _dot(a: Array, b: Array) -> Array:
    """Sums over the points of products."""
    return np.asarray(np.einsum("cp,cp->c", a, b))


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
