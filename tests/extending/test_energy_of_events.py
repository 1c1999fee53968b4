"""A column of events that is not shipped: the energy of a ball just after its collision.

From a config to a file, a table and a page, with what someone adds to the package.
"""

from __future__ import annotations

import pytest
from extended import SAME_IN_V8, Edits, Extended

EDITS: Edits = {
    "fields.py": [
        (
            '    EventColumn("residual", ',
            '    EventColumn("after", "<f8", "J", "observables/energy_after", "energy_after"),\n'
            '    EventColumn("residual", ',
        ),
    ],
    "trace.py": [
        (
            "    residual: NDArray[np.float64] | None = None\n",
            "    residual: NDArray[np.float64] | None = None\n"
            "    after: NDArray[np.float64] | None = None  # J, of ball i\n",
        ),
    ],
    "engine/collision.py": [
        (
            "    labels = state.labels\n",
            "    labels, u, v = state.labels, state.balls[U, i], state.balls[V, i]\n"
            "    if j >= 0 and len(labels) == 0 and j < i:\n"
            "        u, v = state.balls[U, j], state.balls[V, j]\n"
            '    event["after"] = 0.5 * state.sizes.mass_of(i) * (u * u + v * v)\n',
        ),
    ],
}

GAS = """\
container: {shape: circle, radius: 10}
balls: {count: 20, radius: 0.5, speed: 5, mass: 2}
cor: 0.9
collisions: 200
repeats: 2
"""


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Extended:
    """The package with this column, and a run of a gas."""
    extended = Extended(EDITS, tmp_path_factory.mktemp("energies"))
    extended.run("gas", GAS)
    return extended


def test_a_column_of_events_needs_three_files() -> None:
    assert len(EDITS) == 3


def test_it_is_the_energy_of_a_replay_and_is_exported(extended: Extended) -> None:
    stored, replayed = extended.value("""
import json, numpy as np, snooker_cli
repeat = snooker_cli.open("gas")[0, 0]
events = repeat.trace.events
velocities = repeat.states(events.time).velocities[np.arange(len(events)), events.i]
print(json.dumps([events.after.tolist(), np.sum(velocities**2, axis=1).tolist()]))
""")
    assert stored == pytest.approx(replayed, rel=1e-12)
    extended.snooker("verify", "gas", "--replay")
    extended.snooker("export", "gas", "--out", "events.csv")
    header, first, *_ = (extended.folder / "events.csv").read_text().splitlines()
    assert header == "time,i,j,impulse,energy_after"
    assert float(first.rsplit(",", 1)[1]) == stored[0]


def test_pages_hash_it(extended: Extended) -> None:
    """A film's page simulates the same events; it hashes the column too, which has its bits."""
    with extended.compiling():
        here, there = extended.value(SAME_IN_V8.format(boundaries=["fixed_circle"], run="gas"))
    assert here == there
