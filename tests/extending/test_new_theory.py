"""A theory and a quantity that are not shipped: an entry in one file, and an entry with a function.

Tables, notes, findings and JSON have them without another change.
"""

from __future__ import annotations

import json
from typing import Any

import pytest
from extended import Edits, Extended

THEORY: Edits = {
    "analysis/theories.py": [
        (
            "OWN: tuple[Theory, ...] = (\n",
            """\
OWN: tuple[Theory, ...] = (
    Theory(
        *(q.RATIO, "Henderson 1975", "Mol. Phys. 30, 971 (1975)", (*LARGE, "elastic", "no_walls")),
        lambda g: (1 + g.scene.packing_fraction**2 / 8) / (1 - g.scene.packing_fraction) ** 2,
    ),
""",
        ),
    ],
}
QUANTITY: Edits = {
    "analysis/quantities.py": [
        (
            "def _virial_pressure(gas: Gas) -> Array:\n",
            '''\
def _impulse(gas: Gas) -> Array:
    """ΣJ over the number of hits."""
    return gas.ratio(gas.means.wall_impulse, gas.means.wall_events)


def _virial_pressure(gas: Gas) -> Array:
''',
        ),
        (
            "    for quantity in (\n",
            """\
    for quantity in (
        Quantity(
            *("impulse of a hit of the wall", "⟨J⟩", "kg m/s", "impulse of a hit", "hit_impulse"),
            *("means", (), _impulse),
            alone=("walls",),
        ),
""",
        ),
    ],
}
PERIODIC = """\
container: {shape: periodic, width: 20}
balls: {count: 16, radius: 0.8, speed: 10}
cor: 1
collisions: 300
repeats: 3
"""


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Extended:
    """Both, and three runs."""
    package = Extended({**THEORY, **QUANTITY}, tmp_path_factory.mktemp("extended"))
    package.run("periodic", PERIODIC)
    package.run("lossy", PERIODIC.replace("cor: 1", "cor: 0.9"))
    package.run("box", PERIODIC.replace("periodic", "box"))
    return package


def rows(extended: Extended, run: str) -> dict[tuple[str, str], dict[str, Any]]:
    compared = json.loads(extended.snooker("compare", run, "--json"))
    return {(row["quantity"], row["model"]): row for row in compared}


def test_a_theory_is_one_entry_in_one_file(extended: Extended) -> None:
    assert [len(changes) for changes in THEORY.values()] == [1]
    found = rows(extended, "periodic")["PV/NT", "Henderson 1975"]
    packing = 16 * 3.141592653589793 * 0.8**2 / 20**2
    assert found["predicted"] == pytest.approx((1 + packing**2 / 8) / (1 - packing) ** 2)
    assert abs(found["difference"]) < 5 * found["difference_error"] + 0.02
    for other in ("lossy", "box"):
        assert ("PV/NT", "Henderson 1975") not in rows(extended, other)


def test_a_quantity_is_one_entry_and_one_function(extended: Extended) -> None:
    assert [len(changes) for changes in QUANTITY.values()] == [2]
    found = rows(extended, "box")["impulse of a hit of the wall", "no theory"]
    assert found["unit"] == "kg m/s"
    pressure = rows(extended, "box")["pressure", "ideal gas law"]["measured"]
    rate = rows(extended, "box")["wall rate of a ball", "ideal gas"]["measured"]
    assert found["measured"] == pytest.approx(pressure * 80 / (16 * rate), rel=0.05)
    assert "impulse of a hit, kg m/s" in extended.snooker("compare", "box")
    assert ("impulse of a hit of the wall", "no theory") not in rows(extended, "periodic")
