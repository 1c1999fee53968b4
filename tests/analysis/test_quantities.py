"""The table of quantities."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from figure_runs import traces
from scenes import gas

from snooker_cli.analysis.gas import Gas
from snooker_cli.analysis.measurement import measure
from snooker_cli.analysis.quantities import QUANTITIES, main_quantities
from snooker_cli.analysis.theories import THEORIES, Theory
from snooker_cli.figures.declared_result import Result
from snooker_cli.plugins import Origin, PluginError
from snooker_cli.runs import RunFolder


def test_each_quantity_has_names_of_its_own() -> None:
    for field in ("name", "words", "key"):
        names = [getattr(quantity, field) for quantity in QUANTITIES.values()]
        assert len(set(names)) == len(names)
    assert all(
        quantity.key.isidentifier() and quantity.unit and quantity.symbol
        for quantity in QUANTITIES.values()
    )


def test_each_gas_has_its_main_quantities() -> None:
    def symbols(*kinds: str) -> list[str]:
        return [quantity.symbol for quantity in main_quantities(*kinds)]  # type: ignore[arg-type]

    assert symbols("elastic") == ["PV/NT"]
    assert symbols("cooling") == ["α", "PV/NT"]
    assert symbols("warm") == ["T", "PV/NT"]
    assert symbols("cooling", "mixture") == ["T₁/T₂", "α", "PV/NT"]
    assert symbols("rough") == ["T_rot/T_tr"]
    assert symbols("cooling", "clusters") == ["N_c", "α", "PV/NT"]
    assert symbols("warm", "uneven") == ["q", "T", "PV/NT"]


def test_a_power_has_one_unit() -> None:
    """Tables print the units of quantities, and figures print some of them in another way."""
    powers = [quantity for quantity in QUANTITIES.values() if quantity.key.endswith("power")]
    assert powers
    assert {quantity.unit for quantity in powers} == {Result(powers[0].name, "").unit} == {"W"}


def in_state(returned: Any, monkeypatch: pytest.MonkeyPatch) -> float:
    """The value of a quantity of a package whose function returns this."""
    scene, known = gas("box", 7, 0.1), QUANTITIES["temperature"]
    quantity = known._replace(name="way", of_state=lambda _x, _v, _scene: returned)
    monkeypatch.setattr(QUANTITIES, "origin", {"way": Origin("snooker-way", "0.3", "")}.get)
    return quantity.in_state(scene.positions, scene.velocities, scene)


@pytest.mark.parametrize("returned", [2, 2.0, np.float32(2), np.int64(2), np.array(2.0)])
def test_a_number_in_a_state_is_taken(returned: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert in_state(returned, monkeypatch) == 2.0
    assert math.isnan(in_state(math.nan, monkeypatch))


@pytest.mark.parametrize(
    ("returned", "what"),
    [
        (np.zeros((7, 2)), "an array of the shape (7, 2)"),
        (np.array([2.0]), "an array of the shape (1,)"),
        ([1.0, 2.0], "[1.0, 2.0]"),
        ([[1.0], [1.0, 2.0]], "[[1.0], [1.0, 2.0]]"),
        (None, "None"),
        ("2", "'2'"),
        (2j, "2j"),
        (np.complex128(2), "np.complex128(2+0j)"),
    ],
)
def test_anything_else_in_a_state_names_its_package(
    returned: Any, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(PluginError) as raised:
        in_state(returned, monkeypatch)
    assert str(raised.value) == (
        f"the quantity way of snooker-way 0.3: `of_state` returned {what}; "
        "it must return one number for a state, nan without a value"
    )


@pytest.mark.parametrize(
    ("returned", "what"),
    [
        (np.zeros(2), "an array of the shape (2,)"),
        (1.0, "1.0"),
        (np.array(["1"] * 3), "an array of the shape (3,) and type <U1"),
    ],
)
def test_a_measured_value_is_one_number_for_each_repeat(
    returned: Any, what: str, monkeypatch: pytest.MonkeyPatch, decaying: RunFolder
) -> None:
    repeats = Gas(measure(traces(decaying, 0)))
    quantity = QUANTITIES["temperature"]._replace(name="way", measured=lambda _: returned)
    monkeypatch.setattr(QUANTITIES, "origin", {"way": Origin("snooker-way", "0.3", "")}.get)
    with pytest.raises(PluginError) as raised:
        quantity.values(repeats)
    assert str(raised.value) == (
        f"the quantity way of snooker-way 0.3: `measured` returned {what}; "
        "it must return an array with a number for each repeat, here 3"
    )
    assert quantity._replace(measured=lambda _: np.arange(3)).values(repeats).dtype == np.float64


@pytest.mark.parametrize("returned", [2, np.float64(2), np.zeros(3)])
def test_a_prediction_is_a_number_or_one_for_each_repeat(returned: Any) -> None:
    entry = Theory(QUANTITIES["temperature"], "law", "a book", (), lambda _: returned)
    assert entry.predicted(Gas(gas("box", 7, 0.1)), 3) is returned


@pytest.mark.parametrize("returned", [np.zeros(2), np.zeros((3, 1)), [1.0], None, 1j])
def test_another_prediction_names_its_package(
    returned: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry, alone = (
        Theory(QUANTITIES["temperature"], "law", "a book", (), lambda _, value=value: value)
        for value in (returned, np.zeros(3))
    )
    monkeypatch.setattr(THEORIES, "origin", {entry.name: Origin("snooker-way", "0.3", "")}.get)
    for theory, repeats in ((entry, 3), (alone, None)):
        with pytest.raises(PluginError) as raised:
            theory.predicted(Gas(gas("box", 7, 0.1)), repeats)
        each = ", or an array of one for each repeat, here 3" if repeats else ""
        text = str(raised.value)
        assert text.startswith("the theory temperature: law of snooker-way 0.3: `value` returned ")
        assert text.endswith(f"; it must return a number{each}")
