"""A quantity of balls that is not shipped: how far collisions have worn each ball down.

From a config to a table, a figure, a film and a file, with what someone adds to the package.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from extended import SAME_IN_V8, Edits, Extended

EDITS: Edits = {
    "fields.py": [
        (
            '"s-1", ("spin",), needs="surface"),\n',
            '"s-1", ("spin",), needs="surface"),\n'
            '    MovingField("wear", "wear", "wear", "kg m s-1", ("wear",), needs="surface"),\n',
        ),
    ],
    "scene.py": [
        (
            "    spins: NDArray[np.float64] | None = None\n",
            "    spins: NDArray[np.float64] | None = None\n"
            "    wear: NDArray[np.float64] | None = None  # kg m/s, rubbed by so far\n",
        ),
    ],
    "engine/surfaces.py": [
        ('("spins", Floats)])', '("spins", Floats), ("wear", Floats)])'),
        (
            "Rough(self.law, self.given[repeat], self.spins[repeat])",
            "Rough(self.law, self.given[repeat], self.spins[repeat], self.wear[repeat])",
        ),
        (
            "        self.spins[a] -= first / (law.inertia * r)\n",
            "        self.spins[a] -= first / (law.inertia * r)\n"
            "        self.wear[a] += abs(given)\n"
            "        self.wear[b] += abs(given)\n",
        ),
        (
            "    surface.spins[a] -= first / (law.inertia * r)\n    surface.given",
            "    surface.spins[a] -= first / (law.inertia * r)\n"
            "    surface.wear[a] += abs(given)\n    surface.given",
        ),
        (
            "        column[0] = self.spins[i]",
            "        column[0], column[1] = self.spins[i], self.wear[i]",
        ),
    ],
    "config/models.py": [
        (
            '    """Spin at the start, rad/s, positive to the left; absent: 0 of rough balls."""\n',
            '    """Spin at the start, rad/s, positive to the left; absent: 0 of rough balls."""\n'
            "    wear: Coordinate | None = None\n"
            '    """Impulse by which the ball has been rubbed before, kg m/s; absent: 0."""\n',
        ),
    ],
}

GAS = """\
container: {shape: circle, radius: 10}
balls: {count: 20, radius: 0.5, speed: 5}
cor: 0.9
tangential_cor: 0.4
collisions: 200
repeats: 2
"""

LATER = """\
start: {run: runs/gas}
cor: 0.9
tangential_cor: 0.4
collisions: 100
"""


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Extended:
    """The package with this quantity, and a run of a gas."""
    extended = Extended(EDITS, tmp_path_factory.mktemp("wear"))
    extended.run("gas", GAS)
    return extended


def test_a_quantity_of_balls_needs_four_files() -> None:
    assert len(EDITS) == 4


def test_it_is_the_sum_of_the_tangential_impulses_of_each_ball(extended: Extended) -> None:
    """Replays and the stored finish have it, and a repeat that starts from a state goes on."""
    extended.run("later", LATER)
    stored, summed, replayed, before, started = extended.value("""
import json, numpy as np, snooker_cli
repeat, later = snooker_cli.open("gas")[0, 0], snooker_cli.open("later")[0, 0]
events, number = repeat.trace.events, repeat.scene.number
summed, given, pairs = np.zeros(number), abs(events.tangential), events.j >= 0
np.add.at(summed, events.i, given)
np.add.at(summed, events.j[pairs], given[pairs])
states = repeat.states([repeat.trace.stop.time])
finish = repeat.trace.finish.wear
print(json.dumps([a.tolist() for a in
    (finish, summed, states.wear[0], finish, later.trace.start.wear)]))
""")
    assert stored == pytest.approx(summed, rel=1e-12)
    assert stored == replayed
    assert before == started
    assert min(stored) > 0.0


def test_a_compiled_kernel_has_the_same_bits(extended: Extended) -> None:
    script = """
import json, snooker_cli
print(json.dumps(snooker_cli.open("{}")[0, 0].trace.finish.wear.tolist()))
"""
    plain = extended.value(script.format("gas"))
    with extended.compiling():
        extended.run("compiled", GAS)
        assert extended.value(script.format("compiled")) == plain


def test_exports_have_it(extended: Extended) -> None:
    for name in ("states.csv", "states.xyz", "states.h5md"):
        extended.snooker("export", "gas", "--states", "--frames", "2", "--out", name)
    header, *rows = (extended.folder / "states.csv").read_text().splitlines()
    assert header.endswith(",spin,wear")
    assert float(rows[-1].rsplit(",", 1)[1]) > 0.0
    text = (extended.folder / "states.xyz").read_text()
    assert ":angular_velocity:R:3:wear:R:3 Time" in text


def test_it_is_verified_continued_drawn_and_shown(extended: Extended) -> None:
    extended.snooker("verify", "gas", "--replay")
    extended.snooker("plot", "gas", "rotation")
    assert [*Path(extended.folder, "runs/gas/figures").glob("rotation*.svg")]
    extended.snooker("animate", "gas", "--out", "gas.gif", "--seconds", "1", "--collisions", "50")
    assert Path(extended.folder, "gas.gif").read_bytes().startswith(b"GIF89a")


def test_the_page_of_a_film_has_the_same_events(extended: Extended) -> None:
    with extended.compiling():
        here, there = extended.value(SAME_IN_V8.format(boundaries=["fixed_circle"], run="gas"))
    assert here == there
