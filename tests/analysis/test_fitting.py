"""Fits: exact curves, honest errors, every scale and every way to fail."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import PCG64
from scenes import EPSILON, report_scene
from scipy import optimize
from scipy.optimize import minimize_scalar
from single_fit import fit

from snooker_cli.analysis.decay import QUANTITIES, decays
from snooker_cli.analysis.fitting import (
    LAWS,
    NOTHING_DECAYS,
    FitModel,
    FitResult,
    Points,
    attraction,
    excluded_area,
    fit_all,
    fitted_curve,
    mean_over_repeats,
)
from snooker_cli.analysis.measurement import WINDOWS, measure
from snooker_cli.analysis.observables import INSTANT, mean_and_error
from snooker_cli.analysis.time_series import SKIPPED_COLLISIONS, series
from snooker_cli.engine import simulate
from snooker_cli.trace import Trace

pytestmark = pytest.mark.filterwarnings("error")
STEADY = settings(derandomize=True, deadline=None)

CURVES = {
    "exponential": lambda u, rate: np.exp(-rate * u),
    "haff": lambda u, rate: (1 + rate * u) ** -2,
    "haff_root": lambda u, rate: 1 / (1 + rate * u),
}
MODELS = list(CURVES)
EXACT = {  # and their derivatives, for numbers of python-flint
    "exponential": (lambda x: (-x).exp(), lambda x: -(-x).exp()),
    "haff": (lambda x: (1 + x) ** -2, lambda x: -2 * (1 + x) ** -3),
    "haff_root": (lambda x: 1 / (1 + x), lambda x: -((1 + x) ** -2)),
}


def noisy_curve(model: str, rate: float, noise: np.ndarray, span: float = 6.0):
    t = np.linspace(0, span, noise.size)
    return t, CURVES[model](t, rate) + noise


# -- exact curves ---------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("held", [False, True])
@STEADY
@given(
    rate=st.one_of(st.floats(0.01, 30), st.floats(-0.9, -0.01)),
    amplitude=st.one_of(st.floats(1e-3, 1e3), st.floats(-1e3, -1e-3)),
    first=st.sampled_from([0.0, 0.5]),
)
def test_exact_curves_are_recovered(model, held, rate, amplitude, first):
    t = first + np.linspace(0, 1, 60)
    y = amplitude * CURVES[model](t - first, rate)
    result = fit(t, y, model, amplitude=amplitude if held else None)
    assert result.converged
    # The search ends at a relative step of 1e-12; a first time of ½ costs one more digit of s.
    assert result.value == pytest.approx(rate, rel=1e-11, abs=1e-13)
    assert result.amplitude == pytest.approx(amplitude, rel=1e-11)
    assert (result.start, result.points) == (first, 60)
    np.testing.assert_allclose(fitted_curve(result, [t, t]), [y, y], rtol=1e-10)


# -- errors ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("held", [False, True])
def test_against_curve_fit(model, held):
    rng = np.random.default_rng(3)
    t = np.append(0.0, np.sort(rng.uniform(0, 7, 200)))
    y = 2.5 * CURVES[model](t, 1.3) + 0.03 * rng.normal(size=t.size)
    guess = [1.0] if held else [1.0, 2.0]
    expected, covariance = optimize.curve_fit(
        lambda t, rate, a=2.5: a * CURVES[model](t, rate), t, y, p0=guess, ftol=1e-14, xtol=1e-14
    )
    result = fit(t, y, model, amplitude=2.5 if held else None)
    # curve_fit differentiates numerically: steps of √ε leave 1e-8 to 1e-6 in the derivatives.
    found = [result.value] if held else [result.value, result.amplitude]
    assert found == pytest.approx(expected, rel=1e-6)
    assert result.error == pytest.approx(math.sqrt(covariance[0, 0]), rel=1e-5)


# -- scales ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("time_scale", "value_scale"), [(1e-150, 1e150), (1e120, 1e150)])
def test_any_scale(model, time_scale, value_scale):
    t, y = noisy_curve(model, 0.8, 0.01 * np.random.default_rng(8).normal(size=80))
    plain = fit(t, y, model)
    scaled = fit(t * time_scale, y * value_scale, model)
    # The problem solved is the same up to rounding of its data, ε, and the end of the search, 1e-12
    # in the sum of squares, which leaves the root of it, 1e-6, of one standard error.
    assert scaled.converged
    assert scaled.value * time_scale == pytest.approx(plain.value, abs=1e-6 * plain.error)
    assert scaled.error * time_scale == pytest.approx(plain.error, rel=1e-6)
    assert scaled.amplitude / value_scale == pytest.approx(plain.amplitude, rel=1e-6)


# -- flat curves ----------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("amplitude", [None, 1.0])
def test_flat_curves_do_not_decay(model, amplitude):
    t = np.linspace(0, 3, 500)
    flat = fit(t, np.ones(500), model, amplitude=amplitude)
    assert not flat.converged
    assert flat.message == NOTHING_DECAYS
    assert math.isnan(flat.value)
    rng = np.random.default_rng(10)
    for size in (1e-15, 1e-3):
        noisy = fit(t, 1 + size * rng.normal(size=500), model, amplitude=amplitude)
        assert noisy.converged
        # Four standard errors: one draw in 16,000 falls outside. Steps of rounding below.
        assert abs(noisy.value) <= 4 * noisy.error + 1e-16
        # σ_q = σ/√Σ(s − s̄)², 500 points with variance 1/12 (or mean square 1/3) of s, over the
        # span of 3 s, and half of that for Haff's square.
        spread = 1 / 12 if amplitude is None else 1 / 3
        power = 2 if model == "haff" else 1
        predicted = size / math.sqrt(500 * spread) / 3 / power
        # s of 500 residuals is known to 1/√1000 = 3 %; 4 of those, and rounding for the small size.
        assert noisy.error == pytest.approx(predicted, rel=0.13 if size > 1e-10 else 0.3)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("amplitude", [None, 2.0])
def test_changes_that_are_rounding_are_no_decay(model, amplitude):
    t = np.linspace(0, 3, 500)
    drift = 2 * (1 - 1e-13 * t / 3)
    refused = fit(t, drift, model, amplitude=amplitude, rounding=1.1e-13)
    assert (refused.converged, refused.message) == (False, NOTHING_DECAYS)
    # Values that are equal but not the amplitude have come there by a decay.
    assert fit([1.0, 2.0, 3.0], [0.5] * 3, model, amplitude=1.0, start=0.0).converged
    # Without leave, and beyond it, the drift is a decay: 1e-13 in 3 s, Haff's square half of it.
    for rounding in (0.0, 0.9e-13):
        found = fit(t, drift, model, amplitude=amplitude, rounding=rounding)
        assert found.converged
        power = 2 if model == "haff" else 1
        # Values near 2 are rounded to 2.2e-16, a part in 500 of the drift of a point.
        assert found.value == pytest.approx(1e-13 / 3 / power, rel=0.01)


# -- failures -------------------------------------------------------------------------------------

GOOD = (np.linspace(0, 2, 30), np.exp(-np.linspace(0, 2, 30)))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    ("t", "y", "options"),
    [
        ([], [], {}),
        ([0.0, 1.0], [1.0, 0.5], {}),
        (GOOD[0], np.where(GOOD[0] == 0, math.nan, GOOD[1]), {}),
        (*GOOD, {"amplitude": 0.0}),
        ([3.0] * 5, [1.0, 0.9, 0.8, 0.7, 0.6], {}),
        (GOOD[0], np.zeros(30), {"amplitude": 1.0}),
        (GOOD[0], np.eye(30)[0], {}),
        (GOOD[0], -GOOD[1], {"amplitude": 1.0}),
    ],
)
def test_data_that_cannot_be_fitted(t, y, options, model):
    result = fit(t, y, model, **options)
    assert not result.converged
    assert result.message.endswith(".")
    numbers = (result.value, result.error, result.amplitude)
    assert all(math.isnan(number) for number in numbers)
    assert (result.model, result.points) == (model, len(t))
    assert np.isnan(fitted_curve(result, [0.0, 1.0])).all()


@pytest.mark.parametrize("model", MODELS)
@STEADY
@given(
    pairs=st.lists(st.tuples(st.floats(), st.floats()), max_size=8),
    amplitude=st.sampled_from([None, 1.0, -2.0, 1e-200]),
)
def test_no_data_raise_or_warn(model, pairs, amplitude):
    t, y = [p[0] for p in pairs], [p[1] for p in pairs]
    result = fit(t, y, model, amplitude=amplitude)
    assert isinstance(result.message, str)
    assert math.isfinite(result.value) == result.converged
    assert math.isfinite(result.error) == result.converged


def assert_best(result: FitResult, t: np.ndarray, y: np.ndarray) -> None:
    """No rate near the fit's has a smaller sum of squares."""
    assert result.converged
    sums = []
    for rate in result.value + np.linspace(-0.1, 0.1, 201) * result.error:
        shape = CURVES[result.model](t, rate)
        sums.append(np.sum((shape @ y / (shape @ shape) * shape - y) ** 2))
    assert np.argmin(sums) == 100


@pytest.mark.parametrize("model", MODELS)
def test_of_late_hits_the_best_rate_is_found(model):
    """Where a search could end at 4e9 1/s, with a variance below zero."""
    heights = np.array([0.0] * 11 + [1.0, 1.929, 0.974, 1.728, 0.0, 0.0, 0.716, 0.684, 0.907])
    t = (np.arange(20) + 0.5) * 0.17346361605309066 / 20
    result = fit(t, heights, model, start=0.0)
    assert 0 < result.error < abs(result.value)
    assert_best(result, t, heights)


@pytest.mark.parametrize("seed", [2, 5])
def test_a_fit_of_noise_ends_at_the_minimum(seed):
    """Rounding, which differs between processors, does not decide where the search ends."""
    t = np.linspace(0, 10, 500)
    y = 1 - 1e-7 * (np.sqrt(t) + PCG64(seed).random_raw(500) / 2.0**64)
    model = np.exp(-fit(t, y, amplitude=1.0).value * t)
    slope = t * model
    assert abs(slope @ (model - y)) <= EPSILON * np.sum(slope)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_few_points_give_the_fit_of_all_collisions(quantity):
    """A repeat's fit is where the sum of squares over all collisions, with 40 digits, has no slope.

    The difference is a two-hundredth of the constant's standard deviation over repeats, some 5 %.
    """
    collisions = 5000
    trace = simulate(report_scene(0, cor=0.85, container_mass=1e7), collisions=collisions)
    time, value = course_of(trace, quantity)
    for decay in decays([trace], [quantity]):
        (found,) = decay.fits
        assert found.points == len(time)
        if quantity.startswith("local"):
            assert found.value == pytest.approx(
                best_in_windows(time, value, LAWS[found.model], found.value), rel=3e-4
            )
            continue
        exact = best_rate(time, value, decay.held, EXACT[found.model], found.start, found.value)
        assert found.value == pytest.approx(exact, rel=2.5e-4)


def best_in_windows(middle: np.ndarray, mean: np.ndarray, law: FitModel, near: float) -> float:
    """The best rate of a law whose means over windows are these, near a given rate.

    The times at which it has these means are those of the rate itself.
    """
    low, high = middle - middle[0], middle + middle[0]
    time = law.place_of_mean(np.array(near), low, high)

    def squares(rate: float) -> float:
        shape = law.curve(rate * time)
        return float(np.sum((mean - (shape @ mean) / (shape @ shape) * shape) ** 2))

    bounds = (near / 2, 2 * near)
    return float(
        minimize_scalar(squares, bounds=bounds, method="bounded", options={"xatol": 1e-9}).x
    )


def course_of(trace: Trace, quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and values over the first: after the collisions of each instant, or in windows."""
    columns, end, wall = series(trace), trace.stop.time, trace.start.container.wall_length
    apart = np.append(np.diff(columns.time) > INSTANT * columns.time[1:], True)
    columns = columns[apart]
    energy, time = columns.kinetic_energy, columns.time
    if quantity.startswith("pressure"):
        late = columns.wall_events + columns.pair_events >= SKIPPED_COLLISIONS
        time, value = time[late], (columns.wall_impulse[late] / (wall * time[late]))
        return time, value / value[0]
    if not quantity.startswith("local"):
        energy = energy + columns.container_energy * (quantity == "kinetic_energy")
        return time, energy / energy[0]
    windows, first = measure([trace]).windows, float(energy[0])
    value = windows.total_energy[0] / first
    if quantity == "local_pressure":
        value = windows.wall_impulse[0] / windows.wall_impulse[0, 0]
    return (np.arange(WINDOWS) + 0.5) * end / WINDOWS, value


def best_rate(
    time: np.ndarray,
    value: np.ndarray,
    is_held: bool,
    model: tuple[Callable[[Any], Any], ...],
    start: float,
    near: float,
) -> float:
    """The rate near a given one where the sum of squares has no slope, with 40 digits."""
    with ctx.workdps(40):
        t, y = [arb(at) - start for at in time.tolist()], value.tolist()

        def slope(rate):
            shape, slopes = ([part(rate * time) for time in t] for part in model)
            rests = zip(shape, y, slopes, t, strict=True)
            held = 1
            if not is_held:
                held = sum(a * b for a, b in zip(shape, y, strict=True)) / sum(a * a for a in shape)
            return sum((held * fitted - value) * s * time for fitted, value, s, time in rests).mid()

        before, rate = arb(near), arb(near) * (1 + 1e-6)
        for _ in range(5):  # secants
            first, second = slope(before), slope(rate)
            if first == second:
                break
            before, rate = rate, (rate - second * (rate - before) / (second - first)).mid()
        return float(rate)


def test_many_curves_are_fitted_as_each_is_alone():
    rng = np.random.default_rng(8)
    lengths = [40, 2, 9000, 0, 300]
    curves = [
        (t, np.exp(-t) + 0.01 * rng.normal(size=t.size))
        for t in (np.linspace(0, 1 + row, length) for row, length in enumerate(lengths))
    ]
    curves.append((np.linspace(0, 1, 9), np.ones(9)))
    time, value, weight = np.zeros((3, len(curves), 9000))
    for row, (t, y) in enumerate(curves):
        time[row, : t.size], value[row, : t.size], weight[row, : t.size] = t, y, 1.0
    for law in LAWS:
        results = fit_all(Points(time, value, weight), np.zeros(6), np.zeros(6), law)
        for (t, y), found in zip(curves, results, strict=True):
            alone = fit(t, y, law, start=0.0)
            assert (found.converged, found.message) == (alone.converged, alone.message)
            # Sums of other lengths are rounded otherwise.
            assert found.value == pytest.approx(alone.value, rel=1e-9, nan_ok=True)
            assert found.error == pytest.approx(alone.error, rel=1e-9, nan_ok=True)


def test_a_weight_is_a_number_of_equal_points():
    t = np.linspace(0, 3, 40)
    y, weight = np.exp(-t) + 0.1 * np.sin(9 * t), np.arange(40.0) % 3 + 1
    for law in LAWS:
        repeated = fit(np.repeat(t, weight.astype(int)), np.repeat(y, weight.astype(int)), law)
        found = fit(t, y, law, weight=weight)
        assert found.points == repeated.points
        assert found.value == pytest.approx(repeated.value, rel=1e-12)
        assert found.error == pytest.approx(repeated.error, rel=1e-12)


# -- errors over repeats ---------------------------------------------------------------------------


def results_with(values: list[float], failed: int = 0) -> list[FitResult]:
    """Results of fits with these rates, and of `failed` ones."""
    good = [FitResult("exponential", True, "", 20, 0.0, value) for value in values]
    return good + [fit([], [])] * failed


def test_ensemble_by_hand():
    found = mean_over_repeats(results_with([1.0, 1.5, 2.0, 2.5, 8.0], failed=2))
    assert (found.repeats, found.failed, found.value, found.max_min_half_range) == (5, 2, 3.0, 3.5)
    # Squared deviations 4 + 2.25 + 1 + 0.25 + 25 = 32.5, over n − 1 = 4.
    assert found.error == pytest.approx(math.sqrt(32.5 / 20), rel=1e-14)


def test_mean_and_error() -> None:
    assert mean_and_error(np.array([1.0, 2.0, 3.0, 6.0])) == (
        3,
        pytest.approx(math.sqrt(14 / 3 / 4)),
    )
    for alike in ([5.0], [5.0, 5.0, 5.0], [5.0, 5.0 * (1 + 2.0**-50), 5.0], [0.0, 0.0]):
        mean, error = mean_and_error(np.array(alike))
        assert mean == pytest.approx(alike[0])
        assert math.isnan(error)


# -- van der Waals' constants ----------------------------------------------------------------------


def test_van_der_waals_constants_are_found_again() -> None:
    """Of exact pressures with b = 0.3 m² and a = 2 J m², and of noisy ones within their errors."""
    n, t = (axis.ravel() for axis in np.meshgrid([0.1, 0.5, 1.0], [5.0, 10.0, 20.0]))
    errors = np.full(9, 0.002)
    exact = 1 / (1 - 0.3 * n)
    assert excluded_area(n, exact, np.full(9, math.nan))[0] == pytest.approx(0.3, rel=1e-7)
    assert attraction(n, t, exact - 2 * n / t, errors)[0] == pytest.approx(2, rel=1e-12)
    rows = []
    for seed in range(300):
        noise = errors * np.random.default_rng(seed).standard_normal(9)
        rows.append(
            (*excluded_area(n, exact + noise, errors), *attraction(n, t, exact + noise, errors))
        )
    b, b_error, a, a_error = np.array(rows).T
    assert np.std(b) == pytest.approx(np.mean(b_error), rel=0.15)
    assert np.std(a) == pytest.approx(np.mean(a_error), rel=0.15)
    assert abs(np.mean(a)) < 4 * np.mean(a_error) / math.sqrt(300)
    assert math.isnan(attraction(n, np.full(9, 3.0), exact, errors)[0])
