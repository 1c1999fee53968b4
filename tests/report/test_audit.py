"""The parts of the audit: printed digits and their tolerance, arithmetic, and the search."""

from __future__ import annotations

import math
import re
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from single_fit import fit

from snooker_cli.analysis.decay import QUANTITIES, Curve, curve, fit_curves
from snooker_cli.analysis.observables import ROUNDING, mean_pressure, mean_speed
from snooker_cli.config import load, parse, points
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report import content, reproduction, setting_search
from snooker_cli.report.setting_search import (
    FREEDOM,
    LIKELY,
    PARTS,
    SLIPS,
    TARGETS,
    Candidate,
    Sample,
    Search,
    decay_constants,
    simplest,
)
from snooker_cli.report.source_values import LORD, SOURCE_VALUES, OurValue, SourceValue
from snooker_cli.runs import Run

ROOT = Path(__file__).parents[2]
TEMPLATES = ROOT / "snooker_cli" / "report" / "templates"


def number(printed: str, *, mean: bool = False) -> SourceValue:
    """An invented printed number."""
    return SourceValue("invented", "here", "invented", "energy decay", printed, "1/s", mean=mean)


# Printed digits


@pytest.mark.parametrize(
    ("printed", "value", "error", "half"),
    [
        ("0.117 ± 0.01", 0.117, 0.01, 0.0005),
        ("15.010", 15.01, None, 0.0005),
        ("≈ 17", 17.0, None, 0.5),
    ],
)
def test_value_error_and_half_of_the_last_digit(
    printed: str, value: float, error: float | None, half: float
) -> None:
    one = number(printed)
    assert (one.value, one.error) == (value, error)
    assert one.half_digit == pytest.approx(half, rel=1e-12)


def test_an_exact_number_allows_only_rounding() -> None:
    largest = SOURCE_VALUES["largest_distance"]
    assert largest.half_digit == 9 * ROUNDING
    assert OurValue(9.000000000000004).agrees(largest)
    assert not OurValue(9.0000001).agrees(largest)


@given(st.floats(-1, 1), st.floats(0, 10))
def test_agreement_is_the_last_digit_and_two_standard_errors(part: float, error: float) -> None:
    one = number("4.2 ± 0.3")
    reach = one.half_digit + 2 * math.hypot(one.standard_error, error)
    assert OurValue(4.2 + 0.999 * part * reach, error).agrees(one)
    assert not OurValue(4.2 + 1.001 * reach, error).agrees(one)
    assert OurValue(4.2 + 0.999 * part * one.half_digit).rounds_to(one)
    assert not OurValue(4.2 + 1.001 * one.half_digit).rounds_to(one)


def test_interval_of_a_mean_of_five_from_its_range() -> None:
    """Simulates Lord's factor: 95 % of means are within it times the range of five values."""
    draws = np.random.default_rng(1947).standard_normal((200_000, 5))
    ratios = np.abs(draws.mean(axis=1)) / np.ptp(draws, axis=1)
    # Binomial: the share within has a standard deviation of 0.0005.
    assert np.mean(ratios < LORD) == pytest.approx(0.95, abs=0.002)
    mean = number("0.117 ± 0.01", mean=True)
    assert 2 * mean.standard_error == pytest.approx(LORD * 2 * 0.01)


# Arithmetic


def test_what_follows_from_other_printed_numbers_has_the_printed_digits() -> None:
    own = reproduction.arithmetic()
    assert len(own) == 7
    for name, (_, value) in own.items():
        assert value.rounds_to(SOURCE_VALUES[name]), name
    assert own["theory_0.8"][1].value == pytest.approx(-2 * math.log(0.8) * 4.23 / 15.01, rel=1e-12)
    assert own["tau_0.9"][1].value == pytest.approx(15.01 / 5.43, rel=1e-12)


def test_likely_is_the_95_percent_point_of_chi_square() -> None:
    """The degrees of freedom are the targets less the choices of a setting."""
    assert set(PARTS) == {one.name for one in fields(Candidate)} - {"changes", "samples"}
    assert len(TARGETS) - len(PARTS) == FREEDOM > 0
    assert pytest.approx(stats.chi2.ppf(0.95, FREEDOM), abs=0.005) == LIKELY


def test_mean_free_path_is_ten_times_that_of_the_stated_balls() -> None:
    experiment = load(ROOT / "configs" / "audit.yaml").experiment
    run = Run(ROOT / "nowhere", experiment, points(experiment))
    assert setting_search.slip_factor(run) == 10.0


# The search


def sample(number: SourceValue, factor: float = 1.0, share: float = 0.1) -> Sample:
    """Twenty repeats with the printed mean times a factor, and a deviation of a share of it."""
    return Sample(number.value * factor * (1 + share * math.sqrt(19 / 20) * np.tile([1, -1], 10)))


def candidate(factor: float = 1.0, share: float = 0.1, **changes: Any) -> Candidate:
    """A setting whose decay constants are the printed ones times a factor."""
    parts = {
        "radius": 1.0,
        "elastic_wall": False,
        "extent": 0.8,
        "window": 500,
        "fixed_amplitude": True,
        "slip": SLIPS[0],
        **changes,
    }
    samples = {}
    for one in TARGETS:
        decays = one.quantity.endswith("decay")
        samples[one.quantity, one.cor] = sample(one, *((factor, share) if decays else (1.0, 0.01)))
    return Candidate(**parts, changes=tuple(changes), samples=samples)


def test_a_printed_mean_has_the_standard_error_and_one_run_the_deviation() -> None:
    several = Sample([1.0, 2.0, 3.0, 6.0])
    deviation = math.sqrt(14 / 3)
    assert several.our_value(number("3 ± 1", mean=True)).error == pytest.approx(deviation / 2)
    assert several.our_value(number("3 ± 1")).error == pytest.approx(deviation)


def searched(*candidates: Candidate) -> Search:
    return Search(candidates, factor=10.0, extent=0.8, early=0)


def test_the_score_is_zero_for_the_printed_numbers_and_counts_all_targets() -> None:
    right = candidate()
    assert right.score == pytest.approx(0, abs=1e-20)
    assert all(map(right.predicts, TARGETS))
    assert candidate(1.5).score > LIKELY
    for one in TARGETS[-3:]:
        samples = {**right.samples, (one.quantity, one.cor): sample(one, 0.1)}
        assert replace(right, samples=samples).score > LIKELY, one.name


def test_a_setting_with_much_scatter_predicts_nothing() -> None:
    energy, wide = SOURCE_VALUES["energy_mean_0.8"], candidate(share=0.6)
    assert not wide.predicts(energy)
    assert wide.predicts(SOURCE_VALUES["speed_0.8"])
    assert simplest([wide], energy) is None
    assert searched(wide).ranked == []


def test_a_setting_whose_repeats_mostly_end_early_is_not_ranked() -> None:
    energy, right = SOURCE_VALUES["energy_mean_0.8"], candidate()
    key = energy.quantity, energy.cor
    for early, predicts in ((10, True), (11, False)):
        each = right.samples[key].each.copy()
        each[:early] = math.nan
        cut = replace(right, samples={**right.samples, key: Sample(each)})
        assert cut.predicts(energy) is predicts
        assert cut.complete == 20 - early


def test_the_ranking_is_resampled() -> None:
    """Two settings that chance alone decides between both win; one far off never does."""
    found = searched(candidate(1.01), candidate(0.99, extent=0.7), candidate(2.0, window=100))
    assert sum(found.wins) == pytest.approx(1)
    assert min(found.wins[:2]) > 0.1
    assert found.wins[2] == 0
    assert found.support("window") == 1
    assert found.support("extent") == found.wins[0]
    assert found.cost("window") == found.ranked[2].score - found.ranked[0].score


def test_resampled_means_scatter_by_the_standard_error() -> None:
    each = np.append(np.random.default_rng(3).normal(5.0, 1.0, 200), [math.nan] * 20)
    one = Sample(each)
    assert (one.count, one.value) == (200, pytest.approx(np.nanmean(each)))
    assert np.std(one.resampled_means()) == pytest.approx(one.error, rel=0.1)
    assert np.mean(one.resampled_means()) == pytest.approx(one.value, abs=0.1 * one.error)


def test_the_audit_has_enough_repeats() -> None:
    assert load(ROOT / "configs" / "audit.yaml").experiment.repeats >= 200


@pytest.mark.parametrize("fixed", [True, False])
def test_many_curves_are_fitted_as_one_is(fixed: bool) -> None:
    """Each up to its own end; one that ends early has no value, a value of zero does no harm."""
    rng = np.random.default_rng(8)
    curves = []
    for count in (40, 90, 120, 500):
        time = np.sort(rng.uniform(0, 4, count))
        value = rng.uniform(0.8, 1.2) / (1 + 0.7 * time) ** 2 + rng.normal(0, 0.02, count)
        value[-1] = 0.0
        curves.append(Curve(QUANTITIES["pressure"], time, value, 0.0, fixed))
    ends = np.array([one.time[-1] for one in curves])
    ends[1:3] = curves[1].time[30], math.nan
    found = decay_constants(curves, ends, fixed=fixed)
    for value, one, end in zip(found, curves, ends, strict=True):
        kept = one.time <= end
        expected = fit(one.time[kept], one.value[kept], amplitude=1.0 if fixed else None)
        assert value == pytest.approx(expected.value, rel=1e-6, nan_ok=True)
    assert np.isnan(found).tolist() == [False, False, True, False]


def test_deviations_from_the_laws_are_in_standard_errors() -> None:
    rate = {"last_rate": 1.0, "fitted_last_rate": 1.4, "last_rate_error": 0.1}
    (found,) = content.last_rates([{"parameters": {"cor": 0.5}, **rate}])
    assert found == {"cor": 0.5, "in_errors": pytest.approx(-4)}
    experiment = load(ROOT / "configs" / "elastic-wall.yaml").experiment
    run = Run(ROOT / "nowhere", experiment, points(experiment))
    fitted = {"parameters": {"cor": 0.8}, "alpha": 1.0, "alpha_error": 0.01}
    (one,) = content.kinetic_theory(run, [fitted])
    assert one["theory"] == pytest.approx(1.116, abs=0.001)
    assert one["excess"] == pytest.approx(one["theory"] - 1)
    assert one["in_errors"] == pytest.approx(100 * one["excess"])


def test_simplest_is_the_one_with_fewest_changes_or_the_nearest() -> None:
    one = SOURCE_VALUES["energy_mean_0.8"]
    exact, near, far = candidate(fixed_amplitude=False), candidate(1.02), candidate(2.0, window=100)
    assert simplest([exact, near, far], one) == (near, near.our_value(one))
    assert simplest([far, candidate(3.0)], one) == (far, far.our_value(one))
    assert simplest([exact], SOURCE_VALUES["density"]) is None


def test_profile_has_the_best_of_every_choice() -> None:
    ranked = [
        candidate(),
        candidate(1.1, elastic_wall=True),
        candidate(1.2, elastic_wall=True, radius=0.1),
        candidate(1.3, elastic_wall=True, window=100),
    ]
    assert searched(*ranked).profile == ranked
    assert searched(*ranked, candidate(1.4, radius=0.1)).profile == ranked


def test_the_free_slip_is_found() -> None:
    found = searched(candidate(1.05)).free
    assert found.value == pytest.approx(10.5, rel=1e-12)
    assert 0 < found.error < 0.5
    assert searched(candidate()).free.value == pytest.approx(10.0, rel=1e-12)


def test_slips_are_what_slower_balls_do() -> None:
    """The same repeat at a sixteenth of the speed, by which doubles scale exactly."""
    config = """
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 3, radius: 1.0, speed: 16.0}
cor: 0.9
collisions: 300
common_random: true
"""
    fast, slow = (
        simulate(starting_scene(parse(config.replace("16.0", speed)).experiment, 0), collisions=300)
        for speed in ("16.0", "1.0")
    )
    slip = SLIPS[-1]
    assert mean_speed(slow) == pytest.approx(mean_speed(fast) * 16.0**slip.speed, rel=1e-12)
    assert mean_pressure(slow) == pytest.approx(
        mean_pressure(fast) * 16.0**slip.pressure, rel=1e-12
    )
    for quantity in setting_search.FITTED:
        curves = [curve(one, quantity) for one in (fast, slow)]
        constants = [one.value for one in fit_curves(curves, "exponential")]
        assert constants[1] == pytest.approx(constants[0] * 16.0**slip.decay, rel=1e-9)


def test_no_result_is_typed_in_the_text_of_the_report() -> None:
    text = (TEMPLATES / "report.md.j2").read_text(encoding="utf-8")
    prose = re.sub(r"\{\{.*?\}\}|\{[%#].*?[%#]\}", "", text, flags=re.DOTALL)
    assert re.findall(r"\d\.\d+", prose) == []
