"""The parts of the audit: printed digits and their tolerance, arithmetic, and the search."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from figure_runs import made
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from single_fit import fit

from snooker_cli.analysis.decay import Curve
from snooker_cli.config import load, points
from snooker_cli.report import content
from snooker_cli.report.explanations import (
    LIKELY,
    TARGETS,
    Explanation,
    Explanations,
    decay_constants,
    explain,
)
from snooker_cli.report.source_values import (
    CLAIMS,
    LORD,
    SOURCE_VALUES,
    OurValue,
    Sample,
    SourceValue,
)
from snooker_cli.runs import Run

ROOT = Path(__file__).parents[2]
TEMPLATES = ROOT / "snooker_cli" / "report" / "templates"


PRINTED = {printed.digits for printed in SOURCE_VALUES.values()}


def number(printed: str, *, mean: bool = False) -> SourceValue:
    """An invented printed number."""
    return SourceValue("invented", "here", "invented", "energy decay", printed, "1/s", mean=mean)


@given(st.floats(-1, 1), st.floats(0, 10))
def test_agreement_is_the_last_digit_and_two_standard_errors(part: float, error: float) -> None:
    printed = number("4.2 ± 0.3")
    reach = printed.half_digit + 2 * math.hypot(printed.standard_error, error)
    assert OurValue(4.2 + 0.999 * part * reach, error).agrees(printed)
    assert not OurValue(4.2 + 1.001 * reach, error).agrees(printed)
    assert OurValue(4.2 + 0.999 * part * printed.half_digit).rounds_to(printed)
    assert not OurValue(4.2 + 1.001 * printed.half_digit).rounds_to(printed)


def test_interval_of_a_mean_of_five_from_its_range() -> None:
    """Simulates Lord's factor: 95 % of means are within it times the range of five values."""
    draws = np.random.default_rng(1947).standard_normal((200_000, 5))
    ratios = np.abs(draws.mean(axis=1)) / np.ptp(draws, axis=1)
    # Binomial: the share within has a standard deviation of 0.0005.
    assert np.mean(ratios < LORD) == pytest.approx(0.95, abs=0.002)
    mean = number("0.117 ± 0.01", mean=True)
    assert 2 * mean.standard_error == pytest.approx(LORD * 2 * 0.01)


def test_checks_by_printed_numbers_alone_are_right() -> None:
    """Two values within 5 % of each other, λ = 1/(√2 n σ), and errors in proportion to ⟨v⟩."""
    compared = 0
    for claim in CLAIMS.values():
        if found := re.fullmatch(r"(.+) against (.+): (.+) % apart", claim["check"]):
            first, second, apart = map(float, found.groups())
            assert {found[1], found[2]} <= PRINTED
            assert 100 * abs(first / second - 1) == pytest.approx(apart, abs=0.05)
            assert claim["holds"] == (apart <= 5)
            compared += 1
    assert compared == 5
    density, section = (SOURCE_VALUES[name].value for name in ("density", "cross_section"))
    path = f"{1 / (math.sqrt(2) * density * section):.2f} m"
    assert path in CLAIMS["mean_free_path"]["check"]
    for name, digits in (("tau", 2), ("theory", 3)):
        for cor in ("0.8", "0.9"):
            printed, speed = SOURCE_VALUES[f"{name}_{cor}"], SOURCE_VALUES[f"speed_{cor}"]
            assert speed.error is not None
            error = printed.value * speed.error / speed.value
            assert f"± {error:.{digits}f}" in CLAIMS[f"errors_of_{name}"]["check"]


def test_likely_is_the_95_percent_point_of_chi_square() -> None:
    assert pytest.approx(stats.chi2.ppf(0.95, len(TARGETS)), abs=0.005) == LIKELY


# The explanations


def sample(number: SourceValue, factor: float = 1.0, share: float = 0.1) -> Sample:
    """Twenty repeats with the printed mean times a factor, and a deviation of a share of it."""
    return Sample(number.value * factor * (1 + share * math.sqrt(19 / 20) * np.tile([1, -1], 10)))


def explanation(factor: float = 1.0, share: float = 0.1) -> Explanation:
    """An explanation whose decay constants are the printed ones times a factor."""
    samples = {}
    for target in TARGETS:
        decays = target.quantity.endswith("decay")
        samples[target.quantity, target.cor] = sample(
            target, *((factor, share) if decays else (1.0, 0.01))
        )
    return Explanation(f"{factor:g}", samples)


def test_the_score_is_zero_for_the_printed_numbers_and_counts_all_targets() -> None:
    right = explanation()
    assert right.score == pytest.approx(0, abs=1e-20)
    assert not right.rejected
    assert all(map(right.predicts, TARGETS))
    assert explanation(1.5).rejected
    for target in TARGETS[-3:]:
        samples = {**right.samples, (target.quantity, target.cor): sample(target, 0.1)}
        assert replace(right, samples=samples).rejected, target.name


def test_the_first_that_agrees_or_the_nearest_explains_a_number() -> None:
    energy = SOURCE_VALUES["energy_mean_0.8"]
    stated, near, nearer, far = map(explanation, (1.0, 1.03, 1.01, 2.0))

    def simplest(*named: Explanation) -> tuple[Explanation, OurValue] | None:
        return Explanations(named, 10.0, 0, 0).simplest(energy)

    assert simplest(stated, far, near, nearer) == (near, near.our_value(energy))
    assert simplest(stated, explanation(3.0), far) == (far, far.our_value(energy))
    assert simplest(stated, explanation(share=0.6)) is None


AUDIT = """
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 3, radius: 1.0, speed: 10.0}
cor: 0.8
collisions: 120
repeats: 4
common_random: true
"""


@pytest.fixture(scope="module")
def explained(tmp_path_factory: pytest.TempPathFactory) -> Explanations:
    """The explanations of a small audit."""
    folder = tmp_path_factory.mktemp("audit")
    swept = "sweep: {cor: [0.8, 0.9], balls.radius: [0.1, 1.0], wall_cor: [null, 1.0]}"
    elastic = AUDIT.replace("0.8", "1.0") + "sweep: {balls.radius: [0.1, 0.5, 1.0]}"
    runs = [made(folder / name, text=text) for name, text in (("a", AUDIT + swept), ("b", elastic))]
    return explain(*runs)


def test_each_explanation_has_the_values_of_its_setting(explained: Explanations) -> None:
    stated, slip, *_, mixed, best = explained.named
    assert [named.name for named in explained.named[:3]] == [
        *("as stated", "time axis of the fits × 10", "elastic wall")
    ]
    assert mixed.name == "balls of 0.1 m in the fits only, elastic wall, first 48 collisions"
    energy = SOURCE_VALUES["energy_mean_0.8"].quantity, 0.8
    speed, pressure = ("mean speed", 0.8), ("pressure", None)
    assert slip.samples[energy].value == pytest.approx(stated.samples[energy].value / 10)
    assert slip.samples[speed].value == stated.samples[speed].value
    elastic, small = explained.named[2], explained.named[5]
    assert mixed.samples[speed].value == elastic.samples[speed].value
    assert mixed.samples[pressure].value == stated.samples[pressure].value
    assert small.samples[pressure].value < stated.samples[pressure].value / 1.5
    assert mixed.samples[energy].value < elastic.samples[energy].value / 2
    assert best.score <= min(named.score for named in explained.named)
    assert (explained.repeats, explained.factor) == (32, 10.0)
    assert load(ROOT / "configs" / "audit.yaml").experiment.repeats >= 200


def test_a_fit_ends_at_its_last_collision() -> None:
    """Without that collision there is no value."""
    rng = np.random.default_rng(8)
    time = np.sort(rng.uniform(0, 4, 90))
    value = np.exp(-0.7 * time) + rng.normal(0, 0.02, 90)
    decaying = Curve(time, value)
    cut, none = decay_constants([decaying, decaying], np.array([time[30], math.nan]), held=True)
    assert cut == pytest.approx(fit(time[:31], value[:31], amplitude=1.0).value, rel=1e-6)
    assert math.isnan(none)


def test_deviations_from_the_laws_are_in_standard_errors() -> None:
    rate = {"last_rate": 1.0, "fitted_last_rate": 1.4, "last_rate_error": 0.1}
    (found,) = content.last_rates([{"parameters": {"cor": 0.5}, **rate}])
    assert found == {"cor": 0.5, "in_errors": pytest.approx(-4)}
    experiment = load(ROOT / "configs" / "elastic-wall.yaml").experiment
    run = Run(ROOT / "nowhere", experiment, points(experiment))
    fitted = {"parameters": {"cor": 0.8}, "alpha": 1.0, "alpha_error": 0.01}
    (point,) = content.kinetic_theory(run, [fitted])
    assert point["theory"] == pytest.approx(1.116, abs=0.001)
    assert point["excess"] == pytest.approx(point["theory"] - 1)
    assert point["in_errors"] == pytest.approx(100 * point["excess"])


def test_no_result_is_typed_in_the_text_of_the_report() -> None:
    text = (TEMPLATES / "report.md.j2").read_text(encoding="utf-8")
    prose = re.sub(r"\{\{.*?\}\}|\{[%#].*?[%#]\}", "", text, flags=re.DOTALL)
    assert re.findall(r"\d\.\d+", prose) == []
