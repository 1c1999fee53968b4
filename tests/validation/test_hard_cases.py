"""The hard cases, their checks, which can find errors, and ``snooker bench hard``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from snooker_cli.config import load, parse
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import StopReason, Trace
from snooker_cli.validation.hard_cases import CASES, FOLDER, checks, hard_plan, judged, verdict

SLOW = {"cor-extremes", "container-masses", "at-rest-periodic", "galperin-1e12", "mass-ratios"}
SLOW |= {"cluster", "packing", "full", "radii-apart", "speeds", "speeds-mixed", "whispering-1e-9"}
SLOW |= {"cold-channel", "cold-box", "cold-rotation", "cold-free", "cold-sliding"}
"""Cases that take long, or need a kernel of their own."""


def test_every_config_is_a_case_and_every_case_has_one() -> None:
    assert sorted(path.stem for path in FOLDER.iterdir()) == sorted(CASES)


NO_BALANCE = {"cold-rotation", "cold-free", "cold-sliding"}
"""Cases of balls that spin or slide: their collisions have no balance of energy to check."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.long) if name in SLOW else name
        for name in hard_plan([])["cases"]
    ],
)
def test_a_case_says_why_it_is_hard_and_holds(name: str) -> None:
    (found,) = verdict(name)
    assert found["faults"] == []
    assert found["runs"] == len(load(FOLDER / f"{name}.yaml").points())
    assert set(found["worst"]) >= {"numbers", "overlap"}
    assert ("energy" in found["worst"]) == (name not in NO_BALANCE)


SEVEN = {"endings": [StopReason.COLLISIONS]}


@pytest.fixture(scope="module")
def trace() -> Trace:
    """Seven balls, cor 0.9, in a fixed container: all is as it must be."""
    text = """
    container: {radius: 10.0}
    balls: {rings: 1, radius: 1.0, speed: 10.0}
    cor: 0.9
    wall_cor: 1.0
    collisions: 200
    seed: 2
    """
    found = simulate(starting_scene(parse(text).config, 0), collisions=200)
    assert judged(found, SEVEN)[1] == []
    return found


def failing(trace: Trace) -> set[str]:
    return {check.name for check in checks(trace) if not check.holds}


def test_a_ball_that_was_moved_is_found(trace: Trace) -> None:
    finish = trace.finish
    places = finish.positions.copy()
    places[3] += 1e-6
    assert failing(replace(trace, finish=replace(finish, positions=places))) >= {"angular momentum"}
    velocities = finish.velocities * (1 + 1e-11)
    moved = replace(trace, finish=replace(finish, velocities=velocities))
    assert failing(moved) == {"energy", "angular momentum"}
    assert judged(moved, SEVEN)[1][0].startswith("energy: ")


def test_collisions_that_were_lost_are_found(trace: Trace) -> None:
    """Without one of them balls fly through each other, or through the wall, from there on."""
    assert trace.events is not None
    for lost, names in ((180, {"energy", "overlap", "escape"}), (185, {"escape"})):
        kept = np.arange(200) != lost
        assert failing(replace(trace, events=trace.events[kept])) == names
