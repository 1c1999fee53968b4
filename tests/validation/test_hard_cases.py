"""The hard cases, their checks, which can find errors, and ``snooker bench hard``."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import EPSILON, scene_of

from snooker_cli.config import load, parse
from snooker_cli.engine import series, simulate
from snooker_cli.errors import SceneError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, StopReason, Trace
from snooker_cli.validation import hard_case_checks
from snooker_cli.validation.hard_case_checks import Check, checks, longest_run
from snooker_cli.validation.hard_cases import CASES, HardCase, HardCaseStudy, judged, runs

Snooker = Callable[..., Any]

FOLDER = Path(__file__).parents[2] / "configs" / "hard"
SHORT = 2000
"""Collisions of those that take more than a second."""


# --- the cases ------------------------------------------------------------------------------


def test_every_config_is_a_case_and_every_case_has_one() -> None:
    assert sorted(path.stem for path in FOLDER.iterdir()) == sorted(CASES)


@pytest.mark.long
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_case_says_why_it_is_hard_and_holds(case: HardCase) -> None:
    """By both engines where both know the container; shortened where it takes long."""
    loaded = load(FOLDER / f"{case.name}.yaml")
    assert loaded.experiment.title
    done = list(runs(case, FOLDER, SHORT if case.slow else None))
    engines = 2 if loaded.experiment.container.shape == "circle" else 1
    assert len(done) == engines * len(loaded.points())
    for run in done:
        assert not run["faults"], (run["parameters"], run["engine"])
        names = [check["name"] for check in run["checks"]]
        assert set(names) >= {"numbers", "overlap"}
        assert ("energy" in names, len(set(names))) == (True, len(names))


def test_galperins_count_is_known_to_three_million() -> None:
    scene = starting_scene(load(FOLDER / "galperin-1e12.yaml").experiment, 0)
    trace = simulate(scene, collisions=10, time=5.0)
    for count, holds in ((3_141_592, True), (3_141_591, False)):
        (check,) = hard_case_checks.galperin(replace(trace, wall_events=count, pair_events=0))
        assert check.holds is holds


# --- what is refused ------------------------------------------------------------------------


def lone(radius: float = 1.0, speed: float = 1.0, mass: float = 1.0) -> Scene:
    text = f"""
    container: {{radius: 10.0}}
    balls:
      list: [{{position: [0, 0], velocity: [{speed!r}, 0], radius: {radius!r}, mass: {mass!r}}}]
    cor: 1.0
    collisions: 10
    """
    return starting_scene(parse(text).experiment, 0)


def test_the_largest_ball_is_one_unit_of_the_last_digit_smaller_than_the_container() -> None:
    largest = math.nextafter(10.0, 0.0)
    assert simulate(lone(largest), collisions=10).stop.time == pytest.approx(19 * (10 - largest))
    (ball,) = load(FOLDER / "full.yaml").experiment.balls.list  # type: ignore[union-attr]
    assert ball.radius == largest
    for radius in (10.0, math.nextafter(10.0, 11.0)):
        with pytest.raises(SceneError) as caught:
            lone(radius)
        assert caught.value.key == "balls.list[0]"


@pytest.mark.parametrize("speed", [1e-155, 1e-200, 1e200])
def test_speeds_whose_squares_are_no_doubles_are_refused(speed: float) -> None:
    with pytest.raises(SceneError):
        lone(speed=speed)
    assert lone(speed=0.0).number == lone(speed=1e-150).number == lone(speed=1e150).number == 1


@pytest.mark.parametrize(("mass", "speed"), [(1e100, 1e150), (1e-100, 1e-150)])
def test_energies_that_are_no_doubles_are_refused(mass: float, speed: float) -> None:
    with pytest.raises(SceneError):
        lone(mass=mass, speed=speed)
    assert lone(mass=mass, speed=1 / speed).number == 1


@pytest.mark.parametrize("speed", [1e-150, 1e-70, 1e80, 1e150])
def test_the_energy_moment_is_a_number_at_any_speed(speed: float) -> None:
    """Two balls, one at twice the speed of the other: (1 + 16) 2/(1 + 4)^2, before they meet."""
    balls = [(-5.0, 0.0, speed, 0.0, 1.0, 1.0), (5.0, 0.0, 2 * speed, 0.0, 1.0, 1.0)]
    found = series(simulate(scene_of(balls), collisions=1)).energy_moment
    assert found == pytest.approx([34 / 25, 34 / 25], rel=8 * EPSILON)


# --- the checks ------------------------------------------------------------------------------

SEVEN = HardCase("seven", (StopReason.COLLISIONS,))


@pytest.fixture(scope="module")
def trace() -> Trace:
    """Seven balls, cor 0.9, in a fixed container: all is as it must be."""
    text = """
    container: {radius: 10.0}
    balls: {rings: 1, radius: 1.0, speed: 10.0}
    cor: 0.9
    wall_cor: 1.0
    collisions: 200
    """
    found = simulate(starting_scene(parse(text).experiment, 0), collisions=200)
    assert judged(SEVEN, found)[1] == []
    return found


def events_of(trace: Trace, **changes: Any) -> Events:
    assert trace.events is not None
    return replace(trace.events, **changes)


def failing(trace: Trace) -> set[str]:
    return {check.name for check in checks(trace) if not check.holds}


def test_a_ball_that_was_moved_is_found(trace: Trace) -> None:
    finish = trace.finish
    places = finish.positions.copy()
    places[3] += 1e-6
    assert failing(replace(trace, finish=replace(finish, positions=places))) >= {"virial"}
    velocities = finish.velocities * (1 + 1e-11)
    moved = replace(trace, finish=replace(finish, velocities=velocities))
    assert failing(moved) == {"energy", "angular momentum"}
    assert judged(SEVEN, moved)[1][0].startswith("energy: ")


def test_collisions_that_were_lost_are_found(trace: Trace) -> None:
    """Without one of them balls fly through each other, or through the wall, from there on."""
    assert trace.events is not None
    for lost in (50, 120):
        kept = np.arange(200) != lost
        found = failing(replace(trace, events=trace.events[kept]))
        assert found & {"overlap", "escape"}
        assert "energy" in found or trace.events.j[lost] == -1


def test_an_overlap_between_two_events_is_found() -> None:
    """Two balls that fly through each other: at no event do they overlap."""
    apart = scene_of([(-4.0, 0.5, 1.0, 0.0, 1.0, 1.0), (4.0, -0.5, -1.0, 0.0, 1.0, 1.0)])
    none = Events(np.empty(0), np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0))
    empty = simulate(apart, time=1.0)
    assert len(events_of(empty)) == 0
    stop = replace(empty.stop, time=8.0)
    positions = apart.positions + 8.0 * apart.velocities
    through = replace(empty, events=none, stop=stop, finish=replace(apart, positions=positions))
    (found,) = [check for check in checks(through) if not check.holds]
    assert (found.name, found.error) == ("overlap", pytest.approx(1.0))


def test_broken_numbers_and_order_are_found(trace: Trace) -> None:
    assert trace.events is not None
    impulse, time = trace.events.impulse.copy(), trace.events.time.copy()
    impulse[7] = math.nan
    time[[20, 21]] = time[[21, 20]]
    for broken in (events_of(trace, impulse=impulse), events_of(trace, time=time)):
        (check,) = checks(replace(trace, events=broken))
        assert (check.name, check.holds) == ("numbers", False)
        assert check.error >= 1
    velocities = trace.finish.velocities.copy()
    velocities[0, 0] = math.inf
    finish = replace(trace.finish, velocities=velocities)
    assert failing(replace(trace, finish=finish)) == {"numbers"}


def test_a_wrong_ending_and_a_missing_message_are_found(trace: Trace) -> None:
    assert len(judged(replace(SEVEN, endings=(StopReason.COLLAPSE,)), trace)[1]) == 1
    # A shortened run may also end by its collisions.
    assert judged(replace(SEVEN, endings=(StopReason.TIME,)), trace, complete=False)[1] == []
    silent = replace(trace, stop=replace(trace.stop, message=""))
    assert len(judged(SEVEN, silent)[1]) == 1


def test_a_wrong_fact_is_found(trace: Trace) -> None:
    found, faults = judged(replace(SEVEN, fact=hard_case_checks.nothing_happens), trace)
    assert len(faults) == 2
    assert [check.name for check in found if not check.holds] == ["collisions", "moved by, m"]


@pytest.mark.parametrize(
    "name", [name for name, case in CASES.items() if case.fact is not None and not case.slow]
)
def test_facts_can_fail(name: str) -> None:
    """Of a run one collision short, or of one later and harder than it was."""
    case = CASES[name]
    experiment = load(FOLDER / f"{name}.yaml").points()[-1].experiment
    scene = starting_scene(experiment, 0)
    made = simulate(scene, collisions=experiment.collisions, time=experiment.time)
    assert case.fact is not None
    assert all(check.holds for check in case.fact(made))
    events = events_of(made)
    wrong = replace(
        made,
        events=replace(events, time=events.time + 0.01, impulse=events.impulse + 0.01),
        wall_events=made.wall_events + 1,
        stop=replace(made.stop, reason=StopReason.INTERRUPTED, balls=(1,)),
    )
    if name.startswith("collapse"):  # in the sweep's first point a collapse is due
        wrong = replace(wrong, start=replace(scene, restitution=0.01))
    if name == "wall-trap-sums":
        wrong = replace(wrong, events=replace(events, impulse=events.impulse + 0.01))
    assert not all(check.holds for check in case.fact(wrong))


def test_not_a_number_never_holds() -> None:
    assert not Check("x", math.nan, 1.0).holds
    assert not Check("x", 1.0, math.nan).holds
    assert Check("x", 0.0, 0.0).holds


def test_the_longest_run_of_hits(trace: Trace) -> None:
    """Ball 0: wall, wall, pair, wall; ball 1: pair, wall, wall, wall; ball 2: wall."""
    i = np.array([0, 0, 0, 1, 2, 1, 0, 1], dtype=np.int32)
    j = np.array([-1, -1, 1, -1, -1, -1, -1, -1], dtype=np.int32)
    assert longest_run(replace(trace, events=events_of(trace, i=i, j=j, time=np.arange(8.0)))) == 4
    pairs = replace(trace, events=events_of(trace, i=i[2:3], j=j[2:3], time=np.zeros(1)))
    assert longest_run(pairs) == 1


def test_the_longest_run_of_a_summary_is_what_chance_would_give(trace: Trace) -> None:
    """One hit in ten is with the wall: of 2,000 runs one of 13 has a chance of 2e-10."""
    summary = replace(trace, events=None, wall_events=2000, pair_events=9000)
    assert longest_run(summary) == 13
    assert longest_run(replace(summary, wall_events=3, pair_events=1)) == 3
    assert longest_run(replace(summary, pair_events=0)) == 2000
    assert longest_run(replace(summary, wall_events=0)) == 0


def test_the_billion_is_held_to_a_random_walk() -> None:
    """An energy that is off to one side by an epsilon of itself a collision is found."""
    case = CASES["billion"]
    scene = starting_scene(load(FOLDER / "billion.yaml").experiment, 0)
    found = simulate(scene, collisions=100_000, summary=True)
    done, faults = judged(case, found)
    assert faults == []
    assert len(done) == len({check.name for check in done})
    assert found.summary is not None
    grid = found.summary.series
    drift = grid.kinetic_energy * (1 + EPSILON * (grid.wall_events + grid.pair_events))
    summary = replace(found.summary, series=replace(grid, kinetic_energy=drift))
    assert failing(replace(found, summary=summary)) == set()
    (fault,) = judged(case, replace(found, summary=summary))[1]
    assert fault.startswith("drift of energy, of a ball's: ")
    finish = replace(found.finish, velocities=found.finish.velocities * (1 + 1e-11))
    (fault,) = judged(case, replace(found, finish=finish))[1]
    assert fault.startswith("drift of angular momentum, of a ball's: ")


# --- the study ------------------------------------------------------------------------------


def test_a_record_has_the_faults() -> None:
    cases = (
        CASES["touching"],
        replace(CASES["newton-row"], endings=(StopReason.COLLAPSE,)),
        replace(CASES["touching-wall"], fact=hard_case_checks.newton_row),
    )
    found = HardCaseStudy(cases, FOLDER).measure()
    json.dumps(found, allow_nan=False)
    first, second, _ = found["cases"]
    assert [case["holds"] for case in found["cases"]] == [True, False, False]
    assert not HardCaseStudy.passed(found)
    assert first["events"] == 6
    (ending,) = first["endings"]
    assert (ending["reason"], ending["runs"]) == ("time", 6)
    assert set(first["runs"][0]) == {
        "parameters", "engine", "events", "ended", "message", "time", "seconds", "checks", "faults",
    }  # fmt: skip
    assert first["runs"][0]["parameters"] == {"cor": 0.0}
    assert {run["engine"] for run in first["runs"]} == {"allpairs", "cells"}
    assert all(set(each) == {"error", "bound", "holds"} for each in first["worst"].values())
    assert second["faults"][0].startswith("allpairs, cor=0.5: ")
    assert found["left_out"] == ["billion"]
    faults = [line for line in HardCaseStudy.tables(found) if line.startswith("newton-row, ")]
    assert len(faults) == len(second["faults"])


def test_the_command_prints_what_it_writes(
    snooker: Snooker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(FOLDER.parents[1])
    ended = snooker("bench", "hard", "touching", "at-rest-periodic", "--out", tmp_path)
    assert ended.code == 0
    assert (tmp_path / "hard.txt").read_text(encoding="utf-8") == ended.out
    saved = json.loads((tmp_path / "hard.json").read_text(encoding="utf-8"))
    assert [case["name"] for case in saved["cases"]] == ["touching", "at-rest-periodic"]


def test_a_case_that_fails_gives_an_exit_code(snooker: Snooker, tmp_path: Path) -> None:
    """The config of a case, changed so that its fact is wrong."""
    text = (FOLDER / "touching.yaml").read_text(encoding="utf-8")
    (tmp_path / "touching.yaml").write_text(text.replace("[0.6, 0.8]", "[0.3, 0.4]"))
    ended = snooker("bench", "hard", "touching", "--configs", tmp_path)
    assert ended.code == 4
    assert "touching, allpairs, cor=0.0: impulse, kg m/s: " in ended.out


@pytest.mark.parametrize(
    ("case", "folder", "code"),
    [("xyzzy", FOLDER, 2), ("ring", Path("none"), 2), ("ring", FOLDER.parent, 3)],
)
def test_what_does_not_exist_is_refused(
    snooker: Snooker, case: str, folder: Path, code: int
) -> None:
    ended = snooker("bench", "hard", case, "--configs", folder)
    assert (ended.code, ended.out) == (code, "")


def test_a_scene_that_cannot_exist_is_refused_with_its_place(
    snooker: Snooker, tmp_path: Path
) -> None:
    text = (FOLDER / "full.yaml").read_text(encoding="utf-8")
    (tmp_path / "full.yaml").write_text(text.replace("9.999999999999998", "10.0"))
    ended = snooker("bench", "hard", "full", "--configs", tmp_path)
    assert ended.code == 3
    assert "full.yaml:" in ended.err
