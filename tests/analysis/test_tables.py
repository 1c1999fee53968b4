"""The sentences that say what holds."""

from __future__ import annotations

from typing import Any

import pytest

from snooker_cli.analysis.goodness import ENOUGH_REPEATS
from snooker_cli.analysis.tables import few_repeats, finding, overview


def law(model: str = "haff", **changes: Any) -> dict[str, Any]:
    """A row of ``fit.json``."""
    row = {
        "parameters": {"cor": 0.8},
        "quantity": "kinetic_energy",
        "model": model,
        "value": 0.697,
        "error": 0.021,
        "elastic": False,
        "repeats": 30,
        "failed": 0,
        "complete": 30,
        "requested": 30,
        "judged_repeats": 30,
        "judged_from": 0.01,
        "judged_to": 3.0,
        "holds_to": 3.0,
        "probability": 0.58,
    }
    return row | changes


def beside(**changes: Any) -> dict[str, Any]:
    """A row of ``compare.json``."""
    row = {
        "parameters": {"cor": 0.8},
        "quantity": "Haff's α",
        "unit": "1/s",
        "model": "Enskog rates at the start",
        "measured": 0.697,
        "error": 0.021,
        "predicted": 0.726,
        "difference": -0.029,
        "difference_in_errors": -2.1,
        "repeats": 10,
        "complete": 10,
        "simulated": 10,
        "requested": 10,
    }
    return row | changes


def state(**changes: Any) -> dict[str, Any]:
    given = {"quantity": "PV/NT", "unit": "1", "model": "hard disks, finite N"}
    numbers = {"measured": 1.01, "error": 0.0021, "predicted": 1.0, "difference": 0.01}
    return beside(**given, **numbers) | changes


def test_a_gas_that_cools_has_its_law_and_theory() -> None:
    rest = "α = 0.697 ± 0.021 1/s, 4 % below Enskog, 2.1 errors"
    held = "Haff's law is not refused up to 3 s by 30 repeats (p = 0.58)"
    assert finding([law()], [state(), beside()]) == f"{held}; {rest}"
    assert finding([], [state(), beside()]) == rest
    assert finding([law()], []).endswith("; α = 0.697 ± 0.021 1/s")


def test_walls_that_do_not_give_what_collisions_take_are_named() -> None:
    """Within 3 errors there is no reason to doubt that the gas is steady."""
    about = {"quantity": "energy from the walls", "model": "taken by collisions"}
    said = [
        finding([], [state(), state(**about, difference_in_errors=errors)])
        for errors in (-2.9, None, -3.9, 4.2)
    ]
    first, unknown, less, more = said
    assert first == unknown == finding([], [state()])
    assert less == f"{first}; the walls give less than collisions take (3.9 errors)"
    assert more == f"{first}; the walls give more than collisions take (4.2 errors)"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"holds_to": 1.5, "probability": 1e-7}, "is refused after 1.5 of 3 s (p <0.001)"),
        (
            {"probability": None, "holds_to": None},
            "is not tested (too few repeats or collisions)",
        ),
    ],
)
def test_a_law_holds_as_far_as_the_test_says(changes: dict[str, Any], words: str) -> None:
    assert finding([law(**changes)], []).startswith(f"Haff's law {words}; α = ")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "is not refused up to 3 s by 5 repeats (p = 0.58)"),
        ({"holds_to": 1.5, "probability": 1e-7}, "is refused after 1.5 of 3 s (p <0.001)"),
        ({"holds_to": 0.01, "probability": 0.002}, "does not hold (p = 0.002)"),
    ],
)
def test_few_repeats_do_not_show_that_a_law_holds(changes: dict[str, Any], words: str) -> None:
    few = law(judged_repeats=5, **changes)
    assert finding([few], []).startswith(f"Haff's law {words}; α = ")
    assert bool(few_repeats([few])) == ("does not hold" not in words)
    enough = {**few, "judged_repeats": ENOUGH_REPEATS}
    assert few_repeats([enough]) == few_repeats([{**few, "probability": None}]) == []
    assert overview([law(), few], []).startswith("Haff's law is not refused to the end at ")


def test_the_law_that_holds_longest_is_named() -> None:
    both = [law("exponential", value=1.0), law(holds_to=0.5, probability=0.001)]
    assert finding(both, [beside()]) == (
        "The exponential law is not refused up to 3 s by 30 repeats (p = 0.58); "
        "k = 1.000 ± 0.021 1/s"
    )
    assert finding([law("exponential"), law()], []).startswith("Haff's law")
    assert finding([law(value=None, holds_to=None, probability=None)], []) == (
        "The energy has no fit"
    )


def test_a_run_has_the_range_over_its_points() -> None:
    cors = [{"cor": cor} for cor in (0.7, 0.8, 1.0)]
    laws = [law(parameters=cors[0], holds_to=1.0), law(parameters=cors[1])]
    theories = [
        state(parameters=cors[0]),
        beside(parameters=cors[0], difference=0.0726),
        beside(parameters=cors[1]),
        state(parameters=cors[2]),
    ]
    assert overview([], [beside(difference=-0.0726), beside(parameters=cors[0])]) == (
        "Haff's α differs from Enskog by −10 to −4 %"
    )
    untested = law(parameters=cors[2], probability=None)
    others = [law(parameters=cors[2], elastic=True), untested]
    assert overview([*laws, *others], theories) == (
        "Haff's law is not refused to the end at 1 of 2 points that cool; "
        "Haff's α differs from Enskog by −4 to 10 %; "
        "PV/NT differs from theory for hard disks, finite N by 1 %"
    )


EARLY = "repeats ended early"


def test_a_result_names_the_repeats_that_ended_early_or_are_missing() -> None:
    judged = {"complete": 26, "judged_repeats": 26}
    for changes, words in (
        (judged, f"4 of 30 {EARLY}, and the law is judged on the others"),
        ({"complete": 22}, f"8 of 30 {EARLY}"),
        ({"complete": 0}, f"all 30 {EARLY}"),
        ({"requested": 40}, "only 30 of 40 repeats are there"),
        ({"repeats": 1, "complete": 0, "requested": 1}, "the repeat ended early"),
    ):
        by = changes.get("judged_repeats", 30)
        held = f"Haff's law is not refused up to 3 s by {by} repeats (p = 0.58)"
        assert finding([law(**changes)], []) == f"{held}; α = 0.697 ± 0.021 1/s; {words}"
    assert finding([], [state(complete=3)]).endswith(f"; 7 of 10 {EARLY}")
    cors = [{"cor": cor} for cor in (0.7, 0.8)]
    laws = [law(parameters=cor, complete=4) for cor in cors]
    compared = [beside(parameters=cor, complete=4) for cor in cors]
    assert overview(laws, compared).endswith(f"; 12 of 20 {EARLY}")
    assert overview([], compared).endswith(f"; 12 of 20 {EARLY}")


def test_the_ideal_gas_is_no_theory_of_balls_with_a_size() -> None:
    """A mixture, for example, has no other row: 69.8 errors would say nothing."""
    ideal = {"model": "ideal gas law", "measured": 1.2347, "error": 0.0034}
    assert finding([], [state(**ideal)]) == "PV/NT = 1.2347 ± 0.0034 (an ideal gas has 1)"
    others = [state(**ideal, parameters={"cor": 1.0}), state(**ideal | {"measured": 1.31})]
    assert overview([], others) == "PV/NT is 1.23 to 1.31 (an ideal gas has 1)"
