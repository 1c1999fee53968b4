"""Errors over repeats: what covers the truth, and what does not."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

from snooker_cli.analysis.fitting import FitResult, RepeatMean, ensemble, fit
from snooker_cli.analysis.observables import mean_and_error

pytestmark = pytest.mark.filterwarnings("error")

CURVES = {
    "exponential": lambda u, rate: np.exp(-rate * u),
    "haff": lambda u, rate: (1 + rate * u) ** -2,
}


def noisy_curve(model: str, rate: float, noise: np.ndarray, span: float = 6.0):
    t = np.linspace(0, span, noise.size)
    return t, CURVES[model](t, rate) + noise


def autoregressive(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Noise with unit variance that remembers 0.9 of itself from point to point."""
    noise = rng.normal(size=shape)
    for k in range(1, shape[-1]):
        noise[..., k] = 0.9 * noise[..., k - 1] + math.sqrt(1 - 0.81) * noise[..., k]
    return noise


def random_walk(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Noise that starts at zero and adds up, with unit variance at its end."""
    steps = rng.normal(size=shape) / math.sqrt(shape[-1] - 1)
    steps[..., 0] = 0
    return np.cumsum(steps, axis=-1)


@pytest.mark.parametrize(
    ("noise_of", "model", "amplitude"),
    [
        pytest.param(autoregressive, "exponential", None, marks=pytest.mark.long),
        (random_walk, "haff", 1.0),
    ],
)
def test_coverage_with_correlated_noise(noise_of, model, amplitude):
    ensembles, repeats, truth = 200, 20, 0.8
    noise = 0.02 * noise_of(np.random.default_rng(7), (ensembles, repeats, 40))
    by_error = by_bootstrap = by_interval = by_single = by_average = 0
    for curves in noise:
        results = [fit(*noisy_curve(model, truth, x), model, amplitude=amplitude) for x in curves]
        found = ensemble(results, resamples=500)
        by_error += abs(found.mean - truth) < found.standard_error
        by_bootstrap += abs(found.mean - truth) < found.bootstrap_error
        by_interval += found.bootstrap_low < truth < found.bootstrap_high
        by_single += sum(abs(result.value - truth) < result.error for result in results)
        # One fit of the averaged curve with the pointwise standard error of the average. The small
        # addition keeps the first point of a random walk, which has no error at all, usable.
        t, y = noisy_curve(model, truth, curves.mean(axis=0))
        sigma = curves.std(axis=0, ddof=1) / math.sqrt(repeats) + 1e-4
        average = fit(t, y, model, amplitude=amplitude, sigma=sigma)
        by_average += abs(average.value - truth) < average.error
    # Mean ± s/√n of 20 covers by Student's t with 19 degrees of freedom: 67 %, and the bootstrap,
    # whose error is √(19/20) of that, 66 %. Bounds: 99 % of binomial luck in 200 ensembles.
    student = stats.t(repeats - 1)
    expected = 1 - 2 * student.sf(1)
    low, high = stats.binom.interval(0.99, ensembles, expected)
    assert low <= by_error <= high
    resampled = 1 - 2 * student.sf(math.sqrt(1 - 1 / repeats))
    low, high = stats.binom.interval(0.99, ensembles, resampled)
    assert low <= by_bootstrap <= high
    assert low <= by_interval <= high
    # The errors of single curves do not cover: luck of one in a million cannot explain the gap.
    nominal = math.erf(math.sqrt(0.5))
    assert by_single < stats.binom.ppf(1e-6, ensembles * repeats, nominal)
    assert by_average < stats.binom.ppf(1e-6, ensembles, nominal)


def results_with(values: list[float], failed: int = 0) -> list[FitResult]:
    """Results of exact exponential curves with these rates, and of `failed` empty ones."""
    t = np.linspace(0, 1, 20)
    good = [fit(t, np.exp(-value * t)) for value in values]
    return good + [fit([], [])] * failed


def test_ensemble_by_hand():
    values = [1.0, 1.5, 2.0, 2.5, 8.0]
    found = ensemble(results_with(values, failed=2))
    assert (found.count, found.failed) == (5, 2)
    assert found.mean == pytest.approx(3.0, rel=1e-11)
    # Squared deviations 4 + 2.25 + 1 + 0.25 + 25 = 32.5, over n − 1 = 4.
    assert found.standard_deviation == pytest.approx(math.sqrt(32.5 / 4), rel=1e-11)
    assert found.standard_error == pytest.approx(math.sqrt(32.5 / 20), rel=1e-11)
    assert found.max_min_half_range == pytest.approx(3.5, rel=1e-11)
    # The bootstrap's own variance is Σ(x − x̄)²/n², found to 1/√(2·2000) = 1.6 %: four of those.
    assert found.bootstrap_error == pytest.approx(math.sqrt(32.5) / 5, rel=0.064)
    assert 1.0 < found.bootstrap_low < found.mean < found.bootstrap_high < 8.0


def test_bootstrap_interval_of_a_symmetric_ensemble_is_plus_minus_its_error():
    rng = np.random.default_rng(11)
    values = (2 + 0.1 * rng.normal(size=300)).tolist()
    found = ensemble(results_with(values), resamples=20_000)
    # A quantile one σ out of 20,000 draws has the error √(0.159·0.841/20,000)/φ(1) = 0.011 σ.
    tolerance = 4 * 0.011 * found.bootstrap_error
    low, high = found.mean - found.bootstrap_error, found.mean + found.bootstrap_error
    assert found.bootstrap_low == pytest.approx(low, abs=tolerance)
    assert found.bootstrap_high == pytest.approx(high, abs=tolerance)


def test_bootstrap_repeats_itself_and_follows_its_seed():
    results = results_with([1.0, 1.3, 0.8, 2.0])
    assert ensemble(results) == ensemble(iter(results))
    assert ensemble(results).bootstrap_error != ensemble(results, seed=1).bootstrap_error
    assert ensemble(results).mean == ensemble(results, seed=1).mean


@pytest.mark.parametrize(("values", "mean"), [([], math.nan), ([1.7], 1.7)])
def test_fewer_than_two_repeats_have_no_spread(values, mean):
    found = ensemble(results_with(values, failed=1))
    assert (found.count, found.failed) == (len(values), 1)
    assert found.mean == pytest.approx(mean, rel=1e-11, nan_ok=True)
    spreads = [
        getattr(found, item.name)
        for item in dataclasses.fields(RepeatMean)
        if item.name not in ("count", "failed", "mean")
    ]
    assert len(spreads) == 6
    assert all(math.isnan(spread) for spread in spreads)


def test_bootstrap_needs_resamples():
    with pytest.raises(ValueError, match="at least 2 resamples, not 1"):
        ensemble(results_with([1.0, 2.0]), resamples=1)


def test_mean_and_error() -> None:
    assert mean_and_error(np.array([1.0, 2.0, 3.0, 6.0])) == (
        3,
        pytest.approx(math.sqrt(14 / 3 / 4)),
    )
    for alike in ([5.0], [5.0, 5.0, 5.0], [5.0, 5.0 * (1 + 2.0**-50), 5.0], [0.0, 0.0]):
        mean, error = mean_and_error(np.array(alike))
        assert mean == pytest.approx(alike[0])
        assert math.isnan(error)
