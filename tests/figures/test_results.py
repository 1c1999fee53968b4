"""The result of each figure, as its caption says it."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from figure_runs import ADRIFT, ROUGH, STORED, check_caption, made, shown, unnamed_lines

from snooker_cli.analysis.findings import result_and_theory
from snooker_cli.figures.declared_result import (
    Result,
    agreement,
    deviation_sentence,
    with_units_of_axes,
)
from snooker_cli.figures.figure_data import FigureData, Points
from snooker_cli.figures.registry import FIGURES, figures_of
from snooker_cli.figures.series import described
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection

GASES = "decaying", "warm", "box", "periodic", "mixture", "heated", "driven"
FURTHER = {"rough": ROUGH, "stored": STORED, "adrift": ADRIFT}


@pytest.mark.parametrize("gas", [*GASES, *FURTHER])
def test_captions_say_the_result_with_its_unit(
    gas: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """Of every figure; `tests/test_gas_kinds.py` has every type of gas."""
    if gas in FURTHER:
        run = made(tmp_path / "run", text=FURTHER[gas])
    else:
        run = request.getfixturevalue(gas)
    figures = [figure for _, _, figure in figures_of(run, FIGURES, Selection(), most=2)]
    drawn = [figure for figure in figures if isinstance(figure, FigureData)]
    assert len(drawn) > 9
    for figure in drawn:
        check_caption(figure)
    unnamed = {figure.kind: unnamed_lines(figure) for figure in drawn}
    assert not any(unnamed.values()), {kind: lines for kind, lines in unnamed.items() if lines}


def test_a_result_is_the_least_and_the_largest_of_the_points(
    decaying: RunFolder, warm: RunFolder
) -> None:
    """Not the first and the last. Errors of rounding are none."""
    least = Result("temperature", "mean", "in the second half")
    rows = [{"mean": mean, "mean_error": 0.01} for mean in (2.0, 1.0, 4.0, 3.0)]
    assert least.sentence([*rows, {"mean": None}], list("abcde"), 3) == (
        "Temperature T in the second half is between 1.000 ± 0.010 J (b) and 4.000 ± 0.010 J (c); "
        "1 of 5 points have no such value."
    )
    assert (
        least.sentence(rows[:1], ["a"], 3) == "Temperature T in the second half = 2.000 ± 0.010 J."
    )
    assert least.sentence([{"mean": None}], ["a"], 3) == ""
    alike = [{"mean": 1.0}, {"mean": 1.0}]
    assert "in the second half is 1 J at all 2 points." in least.sentence(alike, ["a", "b"], 3)
    alone = [{"mean": 2.0}, {"mean": None}]
    known = "Temperature T in the second half is 2 J (a); 1 of 2 points have no such value."
    assert least.sentence(alone, ["a", "b"], 3) == known
    caption = shown(decaying, "energy").caption
    assert re.search(r"is 0\.\d+ ± 0\.\d+ \(CoR 0\.8\), .* \(CoR 0\.9\) and 1 \(CoR 1\)\.", caption)


def test_units_are_those_of_axes_also_after_a_bracket_or_a_power() -> None:
    text = "α = (8.9 ± 0.1) × 10⁻² 1/s; k = (1 ± 4 × 10⁻¹⁷) 1/s; P = 2 Pa m, 3 W; a 1/sth"
    assert with_units_of_axes(text) == (
        "α = (8.9 ± 0.1) × 10⁻² s⁻¹; k = (1 ± 4 × 10⁻¹⁷) s⁻¹; P = 2 Pa·m, 3 W; a 1/sth"
    )


def test_species_count_from_one_and_have_a_record_each(mixture: RunFolder) -> None:
    found = shown(mixture, "species-temperature")
    first, second = (record["temperature"] for record in found.numbers["points"])
    assert found.result["quantity"] == "T₁/T₂"
    assert re.search(r"\(theory: 1\.381, \d\.\d errors away\)", found.caption)
    assert 1.0 < first / second < 2.0


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("wall_temperature.right", "right wall at 50 J"),
        ("wall_temperature", "wall at left 50, right 50 J"),
    ],
)
def test_keys_of_a_config_have_words(heated: RunFolder, key: str, words: str) -> None:
    assert described(heated.points[0], key) == words


def test_a_deviation_counts_the_errors_that_it_prints() -> None:
    """The panel draws logarithms, which have others: 37 ± 12 % are no 3.5 errors."""

    def sentence(residual: float, error: float) -> str:
        (x, y, y_error) = np.array([[1.0], [residual], [error]])
        return deviation_sentence([Points(x, y, y_error)], {})

    assert sentence(0.01, 0.004) == "The deviation from theory is 1.01 ± 0.40 % (2.5 errors)."
    assert sentence(0.315, 0.088) == "The deviation from theory is 37 ± 12 % (3.1 errors)."
    assert sentence(-0.965, 0.113).endswith("0.381 ± 0.043 (14.4 errors).")
    assert sentence(0.315, 0.0) == "The deviation from theory is 37.03 %."


@pytest.mark.parametrize("repeats", [2, 3])
def test_two_repeats_count_no_errors_in_captions_and_findings(repeats: int) -> None:
    """One rule, in the same words."""
    residual = Points(np.ones(1), np.array([0.1]), np.array([0.01]))
    row = {"quantity": "PV/NT", "model": "Enskog", "measured": 1.1, "predicted": 1.0}
    row |= {"error": 0.01, "difference": 0.1, "difference_error": 0.01, "repeats": repeats}
    row |= {"difference_in_errors": 10.0}
    for text in (deviation_sentence([residual], {}, "", repeats), result_and_theory(row)):
        assert ("(too few repeats for a test)" in text) == (repeats == 2), text
        assert (" errors" in text) == (repeats == 3), text


def test_captions_name_the_part_of_the_repeats_that_a_pressure_is_from(
    warm: RunFolder, driven: RunFolder
) -> None:
    for name in "pressure", "gas-law":
        assert "Means are over the part after the relaxation." in shown(warm, name).caption
    assert "Steady part: the last 50 % of each repeat" in shown(driven, "pressure").caption


def test_the_most_significant_and_the_largest_deviation_are_named() -> None:
    """One of them may be nearer to theory, and the other have a large error."""
    panel = [
        Points(np.arange(2.0), np.log([1.02, 1.01]), np.array([0.001, 0.01]), None, 0),
        Points(np.arange(1.0), np.log([1.3]), np.array([0.2]), None, 1),
    ]
    assert deviation_sentence(panel, {0: "CoR 0.8", 1: "CoR 0.9"}, "ball radius (m)") == (
        "Of 3 deviations from theory, the most significant is 2.00 ± 0.10 % (19.6 errors, CoR 0.8, "
        "ball radius 0 m), and the largest 30 ± 26 % (1.2 errors, CoR 0.9, ball radius 0 m)."
    )
    alone = "Of 2 deviations from theory, the most significant is 2.00 ± 0.10 % (19.6 errors)."
    assert deviation_sentence(panel[:1], {}) == alone


def test_a_title_says_how_far_theory_is() -> None:
    def said(
        residuals: list[float], errors: list[float], repeats: int = 3, whose: str = "α"
    ) -> str:
        x = np.arange(float(len(residuals)))
        panel = [Points(x, np.log(residuals), np.array(errors))]
        return agreement(panel, repeats, whose=whose)

    assert said([1.02, 0.99], [0.01, 0.01]) == "α agrees with theory within 2 %"
    assert said([1.02, 0.9], [0.001, 0.01]) == "α differs from theory by up to 10 %"
    assert said([0.98, 0.9], [0.001, 0.01]) == "α is up to 10 % below theory"
    assert said([1.02, 0.9], [0.001, 0.5]) == "α is 2 % above theory at 1 of 2 places"
    assert said([0.9], [0.01]) == "α is 10.00 ± 0.90 % below theory"
    assert said([0.9], [0.05]) == "α agrees with theory (−10.0 ± 4.5 %)"
    assert said([3.0, 1.0], [0.01, 0.01]) == "α is up to 3 times theory"
    assert said([0.9], [0.01], repeats=2) == ""
    assert said([0.9], [math.nan]) == ""
    assert agreement([], 3) == ""
    assert said([0.9], [0.01], whose="") == "10.00 ± 0.90 % below theory"
    assert said([1.02, 0.99], [0.01, 0.01], whose="") == "agrees with theory within 2 %"
