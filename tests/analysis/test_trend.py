"""How the main result changes along a swept key, as a sentence."""

from __future__ import annotations

from typing import Any

import pytest

from snooker_cli.analysis.trend import Trend, trends


def row(cor: float, measured: float, predicted: float, error: float = 0.01) -> dict[str, Any]:
    """A row of ``compare.json``."""
    difference = measured - predicted
    return {
        "parameters": {"cor": cor, "balls.radius": 1.0},
        "quantity": "Haff's α",
        "model": "Enskog rates at the start",
        "measured": measured,
        "error": error,
        "predicted": predicted,
        "difference": difference,
        "difference_error": error,
        "difference_in_errors": difference / error,
        "repeats": 10,
    }


def sentence(*rows: dict[str, Any]) -> str:
    return Trend("cor", rows).sentence()


def test_a_result_that_falls_as_theory_does() -> None:
    found = sentence(row(0.8, 1.39, 1.4), row(0.9, 0.7, 0.72), row(0.95, 0.3, 0.3))
    assert found == (
        "α falls from 1.390 ± 0.010 1/s at cor = 0.8 to 0.300 ± 0.010 1/s at cor = 0.95, as "
        "steeply as Enskog (within 3 standard errors); it is 2.8 ± 1.4 % below theory at cor = 0.9 "
        "(2.0 errors, the most of 3 points)"
    )


@pytest.mark.parametrize(
    ("first", "last", "steepness"),
    [(2.0, 0.3, "more steeply"), (1.0, 0.3, "less steeply"), (1.39, 0.3, "as steeply")],
)
def test_the_steepness_is_that_of_the_shares_of_theory(
    first: float, last: float, steepness: str
) -> None:
    """Shares of 1.43, 0.71 and 0.99 at the first point, with errors of 0.007 and 0.033."""
    assert f", {steepness}" in sentence(row(0.8, first, 1.4), row(0.95, last, 0.3))


def test_the_direction_needs_steps_beyond_their_errors() -> None:
    ups = [row(0.1, 1.0, 1.0), row(0.2, 0.99, 1.0), row(0.3, 1.2, 1.0)]  # 0.7 errors down
    assert sentence(*ups).startswith("α rises from")
    turns = [row(0.1, 1.0, 1.0), row(0.2, 0.8, 1.0), row(0.3, 1.2, 1.0)]
    least = "α changes, not in one direction, from 0.800 ± 0.010 1/s at cor = 0.2 to 1.200"
    assert sentence(*turns).startswith(least)
    flat = [row(0.1, 1.0, 1.0), row(0.2, 1.02, 1.0)]  # 1.4 errors
    assert sentence(*flat).startswith("α ranges from")


def test_a_step_that_is_as_large_as_its_error_has_no_direction() -> None:
    """The error of a step is that of both points: 0.014."""
    assert sentence(row(0.1, 1.0, 1.0), row(0.2, 1.03, 1.0)).startswith("α rises")


def test_an_ideal_gas_is_no_theory_of_these_balls() -> None:
    ideal = {"quantity": "PV/NT", "model": "ideal gas law"}
    found = sentence(row(0.1, 1.1, 1.0) | ideal, row(0.2, 1.3, 1.0) | ideal)
    assert found == "PV/NT rises from 1.100 ± 0.010 at cor = 0.1 to 1.300 ± 0.010 at cor = 0.2"


def test_trends_are_by_the_other_keys_and_in_the_order_of_the_key() -> None:
    large = {"parameters": {"cor": 0.9, "balls.radius": 2.0}}
    rows = [row(0.9, 0.7, 0.7), row(0.8, 1.4, 1.4), row(0.9, 0.5, 0.5) | large]
    (label, trend), *others = trends(rows, "cor").items()
    assert (label, trend.x.tolist(), others) == ("balls.radius=1.0", [0.8, 0.9], [])


def test_a_trend_has_the_quantity_of_most_points() -> None:
    """The last point is elastic: it has no α."""
    elastic = row(1.0, 1.7, 1.7) | {"quantity": "PV/NT", "model": "hard disks, finite N"}
    (trend,) = trends([row(0.8, 1.4, 1.4), row(0.9, 0.7, 0.7), elastic], "cor").values()
    assert trend.x.tolist() == [0.8, 0.9]
    assert not trends([elastic], "cor")
    named = [row(0.8, 1, 1) | {"parameters": {"run": name}} for name in "AB"]
    assert not trends(named, "run")


def test_a_point_without_an_error_is_not_counted() -> None:
    unknown = {"difference_in_errors": None, "difference_error": None, "error": None}
    rows = [row(0.1, 1.0, 1.02), row(0.2, 0.9, 0.91), row(0.3, 0.5, 0.8) | unknown]
    assert "(2.0 errors, the most of 2 points)" in sentence(*rows)
    assert "the most of" not in sentence(*rows[1:])
