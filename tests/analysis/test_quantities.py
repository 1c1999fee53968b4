"""The table of quantities."""

from snooker_cli.analysis.quantities import QUANTITIES, main_quantities
from snooker_cli.figures.declared_result import Result


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
