"""How many events are certain in all hard cases, golden scenes and references.

``PYTHONPATH=tests:tests/engine python tests/validation/test_certified.py >
tests/golden/certified.json`` counts them anew, which takes two minutes: of each point of a hard
case, and of each scene, the events that are certain, those that were compared, and the verdict.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import make_reference
import pytest
import test_bits

from snooker_cli.config import load
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.validation.hard_cases import CASES, FOLDER
from snooker_cli.validation.proof import prove

GOLDEN = Path(__file__).parents[1] / "golden" / "certified.json"
MOST = 2000  # events; of hard cases FEW, because some need many bits
FEW = 300


@cache
def certified() -> dict[str, list[list[Any]]]:
    return dict(json.loads(GOLDEN.read_text(encoding="utf-8")))


def hard(name: str) -> Iterator[list[Any]]:
    for point in load(FOLDER / f"{name}.yaml").points():
        limits = point.experiment
        most = min(limits.collisions or FEW, FEW)
        yield counted(starting_scene(limits, 0), most, time=limits.time)


def golden(name: str) -> Iterator[list[Any]]:
    case = test_bits.CASES[name]
    yield counted(case.scene(), MOST)


def reference(name: str) -> Iterator[list[Any]]:
    kept = make_reference.read(name)
    yield counted(kept.scene, len(kept.events))


def counted(scene: Scene, most: int, **how: Any) -> list[Any]:
    proof = prove(simulate(scene, collisions=most, **how), most)
    return [proof["certain"], proof["compared"], proof["verdict"]]


KINDS = {"hard": hard, "golden": golden, "reference": reference}
LEFT_OUT = ("tc", "thermal", "sides", "summary", "prefetched")  # no twin, or too many balls
NAMES = [
    *(f"hard: {name}" for name, case in CASES.items() if not case.by_name_only),
    *(f"golden: {name}" for name in test_bits.CASES if not name.endswith(LEFT_OUT)),
    *(f"reference: {path.stem}" for path in sorted(make_reference.FOLDER.iterdir())),
]
QUICK = ["hard: corner", "hard: ring", "hard: rack", "hard: grazing-angle", "hard: galperin"]
QUICK += ["golden: channel, driven", "golden: circle, sliding", "reference: dilute"]


def count(name: str) -> list[list[Any]]:
    kind, _, rest = name.partition(": ")
    return list(KINDS[kind](rest))


@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in NAMES],
)
def test_as_many_events_are_certain_as_before(name: str) -> None:
    assert count(name) == certified()[name]


def test_no_event_is_wrong() -> None:
    """And all scenes are there."""
    assert [*certified()] == NAMES
    verdicts = {row[2] for rows in certified().values() for row in rows}
    assert verdicts == {"all", "rounding", "undecided"}


if __name__ == "__main__":
    lines = (f" {json.dumps(name)}: {json.dumps(count(name))}" for name in NAMES)
    print("{\n" + ",\n".join(lines) + "\n}")
