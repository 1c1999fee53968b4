"""A law of collision that is not shipped: balls that yield, elastic up to a speed.

From a config to a film, with what someone adds to the package; and what refuses it.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from extended import SAME_IN_V8, Edits, Extended

EDITS: Edits = {
    "laws.py": [
        (
            "LAWS: dict[str, type[Law]] = "
            "{law.name: law for law in (Constant, Viscoelastic, Driven, Thermal)}\n",
            '''\
@dataclass(frozen=True, config=STRICT)
class Yielding(Law):
    """Elastic below a speed v_y; above, e(v) = (v_y/v)^(1/4), but no less than ``cor``.

    yield_speed : v_y, m/s
    """

    name = "yielding"

    cor: Restitution
    yield_speed: LawSpeed


LAWS: dict[str, type[Law]] = {
    law.name: law for law in (Constant, Viscoelastic, Driven, Thermal, Yielding)
}
''',
        ),
    ],
    "engine/restitution.py": [
        (
            "from snooker_cli.laws import Constant,",
            "from snooker_cli.laws import Yielding, Constant,",
        ),
        ("DRIVEN, THERMAL = range(4)\n", "DRIVEN, THERMAL, YIELDING = range(5)\n"),
        (
            "    Thermal.name: THERMAL,\n",
            "    Thermal.name: THERMAL,\n    Yielding.name: YIELDING,\n",
        ),
        (
            "        factor = 2.0 - (1.0 - law[COR]) * (root * math.sqrt(root))\n",
            """\
        factor = 2.0 - (1.0 - law[COR]) * (root * math.sqrt(root))
    elif kind == YIELDING:
        factor = 2.0
        if abs(normal) * length > law[SPEED]:
            root = math.sqrt(law[SPEED] / (abs(normal) * length))
            factor = 1.0 + max(math.sqrt(root), law[COR])
""",
        ),
    ],
    "config/models.py": [
        (
            "    wall_cor_speed: LawSpeed | None = None\n",
            '''\
    yield_speed: LawSpeed | None = None
    """Relative normal speed v_y, m/s, up to which collisions between balls are elastic; above,
    e(v) = (v_y/v)^¼, but no less than cor. Absent: cor at all speeds."""
    wall_cor_speed: LawSpeed | None = None
''',
        ),
        (
            "        return law_of_pairs(self.cor, self.cor_speed)\n",
            """\
        if self.yield_speed is not None:
            return Yielding(self.cor, self.yield_speed)
        return law_of_pairs(self.cor, self.cor_speed)
""",
        ),
        ("    Sides,\n    law_of_pairs,\n", "    Sides,\n    Yielding,\n    law_of_pairs,\n"),
    ],
}

GAS = """\
container: {shape: periodic, width: 20}
balls: {count: 30, radius: 0.5, speed: 5}
cor: 0.7
yield_speed: 2
collisions: 300
repeats: 3
"""

TWO = """\
container: {shape: box, width: 20}
balls:
  list:
    - {position: [-4, 0], velocity: [2, 0], radius: 1}
    - {position: [4, 0], velocity: [0, 0], radius: 1}
cor: 0.25
sweep: {yield_speed: [4, 2, 0.125, 0.024691358024691357, 0.0008]}
collisions: 1
"""


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Extended:
    """The package with this law, and a run of a gas."""
    extended = Extended(EDITS, tmp_path_factory.mktemp("yielding"))
    extended.run("gas", GAS)
    return extended


def test_a_law_needs_three_files() -> None:
    assert len(EDITS) == 3


def test_two_balls_have_its_restitution(extended: Extended) -> None:
    """The impulse is (1 + e) v/2 of balls of 1 kg, also of a compiled kernel."""
    with extended.compiling():
        extended.run("two", TWO)
    script = """
import json, snooker_cli
run = snooker_cli.open("two")
print(json.dumps([float(run[k, 0].events.impulse[0]) for k in range(5)]))
"""
    impulses = extended.value(script)
    assert impulses == pytest.approx([2.0, 2.0, 1.5, 4 / 3, 1.25], rel=1e-14)


def test_it_is_fitted_verified_and_drawn(extended: Extended) -> None:
    records = json.loads(extended.snooker("fit", "gas", "--quantity", "kinetic_energy", "--json"))
    assert {record["model"] for record in records} == {"exponential", "haff"}
    assert (
        "3 complete repeats; checked: hashes, ranges of values, starts, all bits"
        in extended.snooker("verify", "gas", "--replay")
    )
    extended.snooker("plot", "gas", "event-decay")
    assert [*Path(extended.folder, "runs/gas/figures").glob("event-decay*.svg")]


def test_what_theory_does_not_know_is_missing_with_its_file(extended: Extended) -> None:
    text = " ".join(extended.snooker("compare", "gas").split())
    assert "Enskog rates, e(v)" not in text
    assert "Haff's α, 1/s" not in text
    assert "theory.py has no mean_loss of the yielding law" in text


def test_films_have_it(extended: Extended) -> None:
    """A page simulates the repeat again, with the same bits."""
    extended.snooker("animate", "gas", "--out", "gas.gif", "--seconds", "1", "--collisions", "50")
    assert Path(extended.folder, "gas.gif").read_bytes().startswith(b"GIF89a")
    with extended.compiling():
        here, stored = extended.value(SAME_IN_V8.format(boundaries=["periodic"], run="gas"))
    assert here == stored


def test_the_live_page_refuses_it(extended: Extended) -> None:
    """Its script would make another law of the same config."""
    sentence = extended.refused("live", "gas.yaml")
    assert "yield_speed" in sentence
    assert "laws.py" in sentence


def test_a_circle_whose_wall_has_it_names_the_file_with_the_sums(extended: Extended) -> None:
    """Only balls of the config have it, so that scenes are made here."""
    script = """
import json
from dataclasses import replace
from scenes import scene_of
from snooker_cli.engine import simulate
from snooker_cli.errors import SceneError
from snooker_cli.laws import Yielding
scene = scene_of([(0.0, 0.0, 1.0, 0.0, 1.0, 1.0)])
try:
    simulate(replace(scene, wall_law=Yielding(0.5, 1.0)), collisions=1)
except SceneError as error:
    print(json.dumps(str(error)))
"""
    sentence = extended.value(script)
    assert "yielding law" in sentence
    assert "engine/restitution.py" in sentence


def test_the_exact_twin_refuses_it(extended: Extended) -> None:
    assert "yield_speed" in extended.refused("verify", "gas", "--exact")
