"""The audit's parts: printed digits and their tolerance, arithmetic, the search, what is typed."""

from __future__ import annotations

import ast
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from snooker_cli.analysis.decay import curve, fit_curve
from snooker_cli.analysis.observables import ROUNDING, mean_pressure
from snooker_cli.config import load, parse, points
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report import audit, content, setting_search
from snooker_cli.report.setting_search import (
    LIKELY,
    SLIPS,
    TARGETS,
    Candidate,
    CandidateSetting,
    Sample,
    Slip,
    free_factor,
    mean_speed,
    profile,
    simplest,
)
from snooker_cli.report.source_values import (
    COEFFICIENTS,
    LORD,
    PUBLISHED,
    OurValue,
    SourceValue,
    published,
)
from snooker_cli.runs import Run

ROOT = Path(__file__).parents[2]
REPORT = ROOT / "snooker_cli" / "report"


def number(digits: str, uncertainty: str | None = None, **more: object) -> SourceValue:
    """A made-up printed number."""
    return SourceValue("made_up", "here", "made up", "energy decay", digits, uncertainty, **more)  # type: ignore[arg-type]


# Printed digits


def test_names_are_distinct() -> None:
    assert len({one.name for one in PUBLISHED}) == len(PUBLISHED)


@pytest.mark.parametrize(
    ("digits", "half"), [("0.117", 0.0005), ("15.010", 0.0005), ("4.23", 0.005), ("17", 0.5)]
)
def test_half_of_the_last_digit(digits: str, half: float) -> None:
    assert number(digits).half_digit == pytest.approx(half, rel=1e-12)


def test_an_exact_number_has_rounding_only() -> None:
    largest = published("largest_distance")
    assert largest.half_digit == 9 * ROUNDING
    assert OurValue(9.000000000000004).agrees(largest)
    assert not OurValue(9.0000001).agrees(largest)


@pytest.mark.parametrize("one", PUBLISHED, ids=lambda one: one.name)
def test_a_number_prints_as_it_was_read(one: SourceValue) -> None:
    assert one.printed.removeprefix("≈ ").startswith(one.digits)
    assert one.uncertainty is None or one.printed.endswith(f"± {one.uncertainty}")
    assert OurValue(one.value).agrees(one)
    assert OurValue(one.value).rounds_to(one)


@given(st.floats(-1, 1), st.floats(0, 10))
def test_agreement_is_the_last_digit_and_two_standard_errors(part: float, error: float) -> None:
    one = number("4.2", "0.3")
    reach = one.half_digit + 2 * math.hypot(one.standard_error, error)
    assert OurValue(4.2 + 0.999 * part * reach, error).agrees(one)
    assert not OurValue(4.2 + 1.001 * reach, error).agrees(one)
    assert OurValue(4.2 + 0.999 * part * one.half_digit).rounds_to(one)
    assert not OurValue(4.2 + 1.001 * one.half_digit).rounds_to(one)


def test_interval_of_a_mean_of_five_from_its_range() -> None:
    """Lord's factor, drawn: 95 % of means are within it times the range of their five values."""
    draws = np.random.default_rng(1947).standard_normal((200_000, 5))
    ratios = np.abs(draws.mean(axis=1)) / np.ptp(draws, axis=1)
    # Binomial: the share within has a standard deviation of 0.0005.
    assert np.mean(ratios < LORD) == pytest.approx(0.95, abs=0.002)
    mean = number("0.117", "0.01", mean=True)
    assert 2 * mean.standard_error == pytest.approx(LORD * 2 * 0.01)


# Arithmetic


def test_what_follows_from_the_report_s_own_numbers_has_its_digits() -> None:
    own = audit._own()
    for cor in COEFFICIENTS:
        assert {f"tau_{cor}", f"theory_{cor}", f"doubled_{cor}"} <= own.keys()
    for name, (words, value) in own.items():
        assert value.rounds_to(published(name)), name
        assert words
    assert own["theory_0.8"][0] == "−2 ln 0.8 × 4.23/15.010 = 0.1258"
    assert own["tau_0.9"][0] == "15.010/5.43 = 2.764"


def test_chance_of_the_score() -> None:
    assert pytest.approx(stats.chi2.ppf(0.95, len(TARGETS)), abs=0.005) == LIKELY


def test_mean_free_path_is_ten_times_that_of_the_stated_balls() -> None:
    experiment = load(ROOT / "configs" / "audit.yaml").experiment
    run = Run(ROOT / "nowhere", experiment, points(experiment))
    assert setting_search.slip_factor(run) == 10.0


def test_speeds_that_are_powers_of_two_apart_are_copies() -> None:
    assert content.copies([5.0, 10.0, 15.0, 20.0, 25.0, 30.0]) == [[5.0, 10.0, 20.0], [15.0, 30.0]]


# The search

FIRST = Slip("")


def sample(name: str, factor: float = 1.0, share: float = 0.1) -> Sample:
    """Repeats with the printed mean times a factor, scattering by a share of it."""
    mean = published(name).value * factor
    return Sample(mean, share * mean, 20)


def candidate(
    factor: float = 1.0, share: float = 0.1, slip: Slip = FIRST, **more: object
) -> Candidate:
    """A setting whose decay constants are the printed ones times a factor."""
    parts = {"radius": 1.0, "elastic_wall": False, "extent": 0.8, "window": 500, "held": True}
    changes = tuple(f"{key} {value}" for key, value in more.items())
    setting = CandidateSetting(**{**parts, **more}, slip=slip, changes=changes)  # type: ignore[arg-type]
    decays = [name for name in TARGETS if published(name).of.endswith("decay")]
    return Candidate(
        setting,
        {
            (published(name).of, published(name).cor): sample(
                name, factor if name in decays else 1.0, share if name in decays else 0.01
            )
            for name in TARGETS
        },
    )


def test_a_setting_that_gives_the_printed_numbers_has_no_score() -> None:
    assert candidate().score == 0.0
    assert candidate(1.5).score > LIKELY
    assert all(map(candidate().predicts, TARGETS))


def test_the_speeds_and_the_pressure_are_in_the_score() -> None:
    right = candidate()
    for name in ("speed_0.8", "speed_0.9", "pressure"):
        one = published(name)
        wrong = Candidate(right.setting, {**right.samples, (one.of, one.cor): sample(name, 0.1)})
        assert wrong.score > LIKELY, name


def test_a_setting_that_scatters_says_nothing() -> None:
    wide = candidate(share=0.6)
    assert not wide.predicts("energy_mean_0.8")
    assert wide.predicts("speed_0.8")
    assert simplest([wide], published("energy_mean_0.8")) is None


def test_the_simplest_that_agrees_is_taken_and_else_the_nearest() -> None:
    one = published("energy_mean_0.8")
    exact, near, far = candidate(held=False), candidate(1.02), candidate(2.0, window=100)
    assert simplest([exact, near, far], one) == (near, near.beside(one))
    assert simplest([far, candidate(3.0)], one) == (far, far.beside(one))
    assert simplest([exact], published("density")) is None


def test_profile_has_the_best_of_every_choice() -> None:
    ranked = [
        candidate(),
        candidate(1.1, elastic_wall=True),
        candidate(1.2, elastic_wall=True, radius=0.1),
        candidate(1.3, elastic_wall=True, window=100),
    ]
    assert profile(ranked) == ranked
    assert profile([*ranked, candidate(1.4, radius=0.1)]) == ranked


def test_free_slip_is_found() -> None:
    found = free_factor(candidate(1.05), 10.0)
    assert found.value == pytest.approx(10.5, rel=1e-12)
    assert 0 < found.error < 0.5
    assert free_factor(candidate(), 10.0).value == pytest.approx(10.0, rel=1e-12)


def test_doubled_pressure_and_temperature_go_with_their_twins() -> None:
    one = candidate()
    assert one.beside(published("density")) is None
    single, double = (one.beside(published(f"{name}_0.8")) for name in ("pressure_mean", "doubled"))
    assert single is not None
    assert double is not None
    assert double.value == 2 * single.value
    assert double.error == 2 * single.error
    twins = [one.beside(published(f"{name}_one_0.9")) for name in ("energy", "temperature")]
    assert twins[0] == twins[1]


def test_slips_are_what_slower_balls_do() -> None:
    """The same repeat at a sixteenth of the speed, which doubles scale by exactly."""
    config = """
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 3, radius: 1.0, speed: 16.0}
cor: 0.9
collisions: 300
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
        constants = [fit_curve(curve(one, quantity), "exponential").value for one in (fast, slow)]
        assert constants[1] == pytest.approx(constants[0] * 16.0**slip.decay, rel=1e-9)


# Nothing is typed


@pytest.mark.parametrize(
    "path",
    [path for path in REPORT.glob("*.py") if path.stem != "source_values"],
    ids=lambda p: p.stem,
)
def test_no_printed_number_is_typed_outside_its_home(path: Path) -> None:
    """Numbers in prose come from results; printed ones stand in source_values.py alone."""
    printed = {one.value for one in PUBLISHED if one.decimals}
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docstrings = {
        ast.get_docstring(node, clean=False)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
    }
    for node in ast.walk(tree):
        if not isinstance(node, ast.Constant) or node.value in docstrings:
            continue
        if isinstance(node.value, float):
            assert node.value not in printed, f"line {node.lineno}"
        if isinstance(node.value, str) and node.value not in {one.name for one in PUBLISHED}:
            assert not re.search(r"\d\.\d", node.value), f"line {node.lineno}: {node.value}"
