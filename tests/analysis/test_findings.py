"""The sentences that say what holds: of each point, and of all points of a run."""

from __future__ import annotations

from typing import Any

from snooker_cli.analysis.findings import UNIFORM, Findings, distance, few_repeats, main_result
from snooker_cli.analysis.goodness import ENOUGH_REPEATS
from snooker_cli.formatting import point_label

FINITE = "hard disks, finite N"
EARLY = "repeats ended early"


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


def compared_row(
    quantity: str, model: str, share: float, errors: float | None, **changes: Any
) -> dict[str, Any]:
    """A row of ``compare.json`` that is this share of its prediction of 10 away, in errors."""
    difference = 10 * share
    return {
        "parameters": {"cor": 0.8},
        "quantity": quantity,
        "unit": "1",
        "model": model,
        "measured": 10 + difference,
        "error": 0.1,
        "predicted": 10.0,
        "difference": difference,
        "difference_in_errors": errors,
        "repeats": 30,
        "complete": 30,
        "simulated": 30,
        "requested": 30,
    } | changes


def state(cor: float, *kinds: str, **changes: Any) -> dict[str, Any]:
    """What analyses know of a point besides its rows."""
    known = {"kinds": list(kinds), "stationary": None, "changes": {}, "repeats": 30}
    return {"parameters": {"cor": cor}, **known, **changes}


def alpha(cor: float = 0.8, share: float = -0.04, errors: float = -2.1, **more: Any) -> Any:
    return compared_row("Haff's α", FINITE, share, errors, parameters={"cor": cor}, **more)


def ratio(cor: float = 0.8, share: float = 0.0047, errors: float = 1.3, **more: Any) -> Any:
    return compared_row("PV/NT", FINITE, share, errors, parameters={"cor": cor}, **more)


def at(fits: list[Any], compared: list[Any], *states: Any) -> str:
    """What holds at the first point."""
    findings = Findings(fits, compared, states)
    return findings.at_point(findings.labels[0])


# One point


def test_a_gas_that_cools_has_its_law_its_rate_and_its_pressure() -> None:
    held = "Haff's law is not refused up to 3 s by 30 repeats (p = 0.58)"
    rate = f"α = 9.60 ± 0.10 1/s agrees with theory for {FINITE} (4 % below, 2.1 errors)"
    pressure = f"PV/NT = 10.05 ± 0.10 agrees with theory for {FINITE} (0.47 % above, 1.3 errors)"
    assert at([law()], [ratio(), alpha()]) == f"{held}; {rate}; {pressure}"
    assert at([], [ratio(), alpha()]) == f"{rate}; {pressure}"
    assert at([law()], []) == f"{held}; α = 0.697 ± 0.021 1/s"


def test_a_difference_within_its_errors_is_agreement() -> None:
    """0.47 % are 1.3 errors, or 9."""
    assert "agrees with" in at([], [ratio()])
    far = at([], [ratio(errors=9.0)])
    assert far == f"PV/NT = 10.05 ± 0.10 is 0.47 % above theory for {FINITE} (9.0 errors)"
    unknown = at([], [ratio(errors=None)])
    assert unknown.endswith(f"0.47 % above theory for {FINITE} (without an error)")
    assert at([], [ratio(repeats=2)]).endswith("(too few repeats for a test)")
    published = ratio() | {"model": "Engel et al. 2013"}
    assert "agrees with the simulations of Engel et al. 2013" in at([], [ratio(), published])


def test_main_quantities_are_those_of_the_kind_of_gas() -> None:
    mixture = compared_row("T₁/T₂", "equal cooling rates", 0.01, 0.5)
    rough = compared_row("T_rot/T_tr", "mean field", 0.01, 0.5)
    warm = compared_row("temperature", "balance of energy", -0.21, -23.0, unit="J")
    law_of_ideal_gas = compared_row("temperature", "ideal gas law, PV/N", 0.5, 60.0, unit="J")
    ideal = compared_row("PV/NT", "ideal gas law", 0.5, 60.0)
    assert at([law()], [ideal, mixture]).startswith("T₁/T₂ = 10.10 ± 0.10 agrees with the theory")
    assert "; Haff's law is not refused" in at([law()], [ideal, mixture])
    assert at([], [ratio(), rough]).startswith("T_rot/T_tr = ")
    assert at([], [law_of_ideal_gas, ratio()]).startswith("PV/NT = ")
    stationary = {"found": True, "sentence": "not refused as stationary from 2 s on"}
    assert at([], [warm, ratio()], state(0.8, "warm", stationary=stationary)) == (
        "T = 7.90 ± 0.10 J is 21 % below the balance of energy (23.0 errors); "
        f"PV/NT = 10.05 ± 0.10 agrees with theory for {FINITE} (0.47 % above, 1.3 errors); "
        "the gas is not refused as stationary from 2 s on"
    )
    assert main_result([ratio(), rough])[0]["quantity"] == "T_rot/T_tr"


def test_clusters_that_theory_expects_are_named() -> None:
    def critical(cor: float, share: float) -> dict[str, Any]:
        row = compared_row("L/L_c", "critical length", share, None, parameters={"cor": cor})
        return row | {"measured": share}

    found = at([law()], [critical(0.8, 2.1), ratio()])
    assert found.startswith("Theory expects vortices and then clusters (L/L_c = 2.1); Haff's law")
    calm = [critical(0.8, 0.4), ratio()]
    assert "clusters" not in at([law()], calm)
    both = Findings([], [*calm, critical(0.9, 2.1), ratio(0.9)])
    assert both.overview.startswith(
        "Theory expects vortices and then clusters at 1 of 2 points (cor=0.9) (L/L_c = 2.1); PV/NT"
    )
    assert both.verdict == "theory expects clusters"


def test_theory_of_one_temperature_is_named_where_walls_differ() -> None:
    stationary = {"found": True, "sentence": "not refused as stationary from 2 s on"}
    uneven = state(0.8, "warm", "uneven", stationary=stationary)
    assert f"; {UNIFORM}; the gas is not refused" in at([], [ratio()], uneven)
    assert UNIFORM in Findings([], [ratio(), ratio(0.9)], [uneven]).overview
    even = state(0.8, "warm", stationary=stationary)
    assert (
        UNIFORM
        not in at([], [ratio()], even) + Findings([], [ratio(), ratio(0.9)], [even]).overview
    )
    ideal = compared_row("PV/NT", "ideal gas law", 0.5, 60.0)
    assert UNIFORM not in at([], [ideal], uneven)


def test_the_verdict_has_no_numbers() -> None:
    """Each is the end of a plain sentence; the numbers are in the next one."""

    def verdict(*compared: Any, states: Any = ()) -> str:
        return Findings([], list(compared), states).verdict

    assert verdict() == ""
    assert verdict(ratio()) == f"PV/NT agrees with theory for {FINITE}"
    far = alpha(errors=-9.0)
    assert verdict(ratio(), far) == f"Haff's α is below theory for {FINITE}"
    apart = [far, alpha(0.9, 0.04, 9.0), alpha(0.95)]
    assert verdict(*apart) == f"Haff's α differs from theory for {FINITE} at 2 of 3 points"
    assert (
        verdict(alpha(), alpha(0.9)) == f"Haff's α agrees with theory for {FINITE} at both points"
    )
    alone = compared_row("temperature", "no theory", 0.0, None, unit="J")
    assert verdict(alone | {"measured": 3.0}) == "T = 3.00 ± 0.10 J"
    balance = compared_row("temperature", "balance of energy", -0.2, -23.0, unit="J")
    lacking = state(0.9, "warm", stationary={"found": False, "sentence": "not stationary"})
    settled = state(0.8, "warm", stationary={"found": True, "sentence": ""})
    assert verdict(balance, states=[settled, lacking]) == (
        "the temperature is below the balance of energy at cor=0.8"
    )
    assert verdict(states=[lacking]) == "no stationary part was found"


def test_far_from_theory_a_factor_says_more_than_a_percentage() -> None:
    left = compared_row("energy left at the end", "by event count", 570.0, 12.0)
    above = left | {"model": "by event count, above L²/2I", "measured": 13.0, "difference": 3.0}
    assert distance(left) == "570 times"
    assert distance(left | {"measured": 4.0}) == "0.4 times"
    assert distance(left | {"difference_error": 420.0}) == "571 ± 42 times"
    assert distance(above | {"difference_error": 0.25}) == "30.0 ± 2.5 % above"
    assert distance(above) == "30 % above"
    assert distance(left | {"measured": -1.0, "difference": -11.0}) == "−11 from"
    # Where theory knows the rotation, it is that one that counts.
    found = at([], [ratio(), left, above])
    assert found.endswith(
        "is 30 % above what the counted collisions would leave above the energy "
        "of rotation L²/2I (12.0 errors)"
    )
    assert "energy left" not in at([], [ratio(), above | {"difference_in_errors": 2.9}])


def test_walls_that_do_not_give_what_collisions_take_are_named() -> None:
    """Within 3 errors there is no reason to doubt that the gas is steady."""
    first = at([], [ratio()])
    for errors in (-2.9, None):
        given = compared_row("energy from the walls", "taken by collisions", -0.05, errors)
        assert at([], [ratio(), given]) == first
    less = at(
        [], [ratio(), compared_row("energy from the walls", "taken by collisions", -0.05, -3.9)]
    )
    assert (
        less == f"{first}; the energy from the walls is 5 % below what collisions take (3.9 errors)"
    )


def test_few_repeats_do_not_show_that_a_law_holds() -> None:
    few = law(judged_repeats=5)
    assert "is not refused up to 3 s by 5 repeats" in at([few], [])
    assert few_repeats([few])
    assert not few_repeats([law(judged_repeats=5, holds_to=0.01, probability=0.002)])
    assert not few_repeats([{**few, "end_over_fit": 13.6}])  # "cannot test" says it
    enough = {**few, "judged_repeats": ENOUGH_REPEATS}
    assert few_repeats([enough]) == few_repeats([{**few, "probability": None}]) == []


def test_the_law_that_holds_longest_is_named() -> None:
    both = [law("exponential", value=1.0), law(holds_to=0.5, probability=0.001)]
    found = at(both, [alpha()])
    assert found.startswith(
        "The exponential law is not refused up to 3 s by 30 repeats (p = 0.58); "
        "k = 1.000 ± 0.021 1/s; α = "
    )
    assert at([law("exponential"), law()], []).startswith("Haff's law")
    none = law(value=None, holds_to=None, probability=None)
    assert at([none], []) == "The energy has no fit"


def test_a_result_names_the_repeats_that_ended_early_or_are_missing() -> None:
    judged = {"complete": 26, "judged_repeats": 26}
    for changes, words in (
        (judged, f"4 of 30 {EARLY}, and the law is judged on the others"),
        ({"complete": 22}, f"8 of 30 {EARLY}"),
        ({"complete": 0}, f"all 30 {EARLY}"),
        ({"requested": 40}, "only 30 of 40 repeats are there"),
        ({"repeats": 1, "complete": 0, "requested": 1}, "the repeat ended early"),
    ):
        assert at([law(**changes)], []).endswith(f"; α = 0.697 ± 0.021 1/s; {words}")
    assert at([], [ratio(complete=23)]).endswith(f"; 7 of 30 {EARLY}")
    laws = [law(parameters={"cor": cor}, complete=4) for cor in (0.7, 0.8)]
    compared = [alpha(cor, complete=4) for cor in (0.7, 0.8)]
    assert Findings(laws, compared).overview.endswith(f"; 52 of 60 {EARLY}")


def test_the_ideal_gas_is_no_theory_of_balls_with_a_size() -> None:
    """A mixture, for example, has no other row: 69.8 errors would say nothing."""
    ideal = compared_row("PV/NT", "ideal gas law", 0.23, 69.8, predicted=1.0)
    assert at([], [ideal]) == "PV/NT = 12.30 ± 0.10 (an ideal gas has 1)"
    other = ideal | {"parameters": {"cor": 0.9}, "measured": 13.1}
    assert Findings([], [ideal, other]).overview == (
        "PV/NT is from 12.30 ± 0.10 at cor=0.8 to 13.10 ± 0.10 at cor=0.9 (an ideal gas has 1)"
    )
    none = compared_row("temperature", "no theory", 0.1, None, predicted=None, difference=None)
    assert at([], [none]) == "T = 11.00 ± 0.10 J (there is no theory of it here)"


# All points


def test_the_worst_disagreement_is_named_and_not_the_best_or_the_first() -> None:
    """A sweep whose elastic gas agrees within 1.3 errors, and which is 21 % off at CoR 0.6."""
    rows = [ratio(0.6, -0.21, -17.6), ratio(0.8, -0.05, -4.4), ratio(1.0)]
    assert Findings([], rows).overview == (
        f"PV/NT differs from theory for {FINITE} at 2 of 3 points, most in errors at cor=0.6: "
        "7.90 ± 0.10 is 21 % below it (17.6 errors)"
    )
    assert Findings([], [*rows[2:], ratio(0.9, -0.02, -2.0)]).overview == (
        f"PV/NT agrees with theory for {FINITE} at both points "
        "(at most 2.0 errors, at cor=0.9: 2 % below); "
        "the 2 points together do not refuse it (χ², p = 0.058)"
    )
    # Three differences of 1.5 errors: χ² is 6.75 with three degrees of freedom, p = 0.080.
    three = [ratio(cor, 0.01, 1.5) for cor in (0.5, 0.6, 0.7)]
    assert Findings([], three).overview.endswith("do not refuse it (χ², p = 0.08)")
    few = [row | {"repeats": ENOUGH_REPEATS - 1} for row in three]
    assert "together" not in Findings([], few).overview
    many = [ratio(cor, 0.01, 2.5) for cor in (0.5, 0.6, 0.7, 0.8)]
    assert "the 4 points together differ from theory" in Findings([], many).overview


def test_a_law_is_refused_at_all_points_or_at_some() -> None:
    def laws(*refused: bool) -> str:
        rows = [
            law(parameters={"cor": 0.5 + k / 10}, **({"holds_to": 1.0} if no else {}))
            for k, no in enumerate(refused)
        ]
        return Findings(rows, []).overview.partition(";")[0]

    assert laws(True, True, True, True) == "Haff's law is refused at all 4 points"
    assert laws(False, False) == "Haff's law is not refused at any of 2 points"
    assert laws(True, False, False) == "Haff's law is refused at 1 of 3 points (cor=0.5)"
    untested = law(probability=None, holds_to=None)
    assert Findings([untested], []).overview == (
        "Haff's law is not tested at cor=0.8 (too few repeats or collisions)"
    )


def test_points_that_are_left_out_have_a_reason() -> None:
    found, sentence = {"found": True, "sentence": ""}, "not stationary: the parts differ"
    states = [
        state(0.7, "warm", stationary=found),
        state(0.8, "warm", stationary=found),
        state(0.9, "warm", stationary={"found": False, "sentence": sentence}),
        state(0.95, "warm", stationary=found),
        state(1.0, "warm", stationary=found, repeats=0),
    ]
    warm = compared_row("temperature", "balance of energy", -0.21, -23.0, unit="J")
    rows = [
        warm | {"parameters": {"cor": 0.7}},
        warm | {"repeats": 2},
        warm | {"parameters": {"cor": 0.95}, "model": "no theory", "predicted": None},
    ]
    parts = Findings([], rows, states).overview.split("; ")
    assert parts[0].startswith("T differs from the balance of energy at cor=0.7: 7.90 ± 0.10 J is")
    assert parts[1:6] == [
        "T is left out at cor=0.8 (too few repeats)",
        "T is left out at cor=0.95 (no theory)",
        "T is left out at cor=1.0 (no repeat is there)",
        "the gas is not refused as stationary at 4 of 5 points",
        f"left out: cor=0.9 ({sentence})",
    ]
    assert f"cor=0.9: The gas is {sentence}" in Findings([], rows, states).lines


def test_a_quantity_has_one_theory_at_all_points() -> None:
    """Also in the sentence of a point that has another one besides."""
    enskog = compared_row("Haff's α", "Enskog rates at the start", 0.01, 0.4)
    rows = [enskog, alpha(), enskog | {"parameters": {"cor": 0.9}}, alpha(0.9)]
    for text in (Findings([], rows).overview, *Findings([], rows).lines):
        assert FINITE in text
        assert "Enskog" not in text
    most = [*rows[:3], enskog | {"parameters": {"cor": 0.95}}]  # FINITE has one point of three
    assert "Enskog at all 3 points" in Findings([], most).overview
    assert FINITE not in " ".join(Findings([], most).lines)


def test_a_ratio_that_is_not_steady_says_so() -> None:
    sentence = "it is not steady: 1.10 in the first quarter, 2.10 in the last (p <0.001)"
    change = {"changes": {"T₁/T₂": {"refused": True, "sentence": sentence}}}
    row = compared_row("T₁/T₂", "equal cooling rates", 0.01, 0.5)
    states = [state(0.8, "cooling", "mixture", **change), state(0.9, "cooling", "mixture")]
    assert at([], [row], states[0]).endswith(f"; {sentence}")
    findings = Findings([], [row, row | {"parameters": {"cor": 0.9}}], states)
    assert "T₁/T₂ is not steady at cor=0.8" in findings.overview
    assert findings.lines[0].startswith("2 points: ")
    assert [line.partition(":")[0] for line in findings.lines[1:]] == ["cor=0.8", "cor=0.9"]
    assert point_label({"cor": 0.9}) in findings.labels
