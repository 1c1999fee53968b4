"""The hard cases, their checks, which can find errors, and ``snooker bench hard``."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import EPSILON, scene_of

from snooker_cli.config import ConfigError, load, parse
from snooker_cli.engine import series, simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import Events, StopReason, Trace
from snooker_cli.validation.hard_cases import (
    CASES,
    FACTS,
    FOLDER,
    FOLLOWED,
    Check,
    HardCase,
    HardCaseStudy,
    checks,
    exact_start,
    follows,
    judged,
    longest_run,
    verdict,
)

# --- the cases ------------------------------------------------------------------------------


def test_every_config_is_a_case_and_every_case_has_one() -> None:
    assert sorted(path.stem for path in FOLDER.iterdir()) == sorted(CASES)


@pytest.mark.long
@pytest.mark.parametrize("case", [case for case in CASES.values() if not case.by_name_only])
def test_a_case_says_why_it_is_hard_and_holds(case: HardCase) -> None:
    """By both engines where both know the container."""
    found = verdict(case)
    loaded = load(FOLDER / f"{case.name}.yaml")
    engines = 2 if loaded.experiment.container.shape == "circle" else 1
    assert found["faults"] == []
    assert found["why"]
    assert found["runs"] == engines * len(loaded.points())
    assert set(found["worst"]) >= {"numbers", "energy", "overlap"}


@pytest.mark.parametrize("speed", [1e-150, 1e150])
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
    seed: 2
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
    assert failing(replace(trace, finish=replace(finish, positions=places))) >= {"angular momentum"}
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


def test_a_wrong_ending_is_found(trace: Trace) -> None:
    assert len(judged(replace(SEVEN, endings=(StopReason.COLLAPSE,)), trace)[1]) == 1


@pytest.mark.parametrize("name", ["collapse-two", "galperin"])
def test_facts_can_fail(name: str) -> None:
    """Of a run with a collision more, or with another ending."""
    case = CASES[name]
    experiment = load(FOLDER / f"{name}.yaml").points()[-1].experiment
    made = simulate(
        starting_scene(experiment, 0), collisions=experiment.collisions, time=experiment.time
    )
    fact = FACTS[case.fact]
    assert all(check.holds for check in fact(made))
    stop = replace(made.stop, reason=StopReason.COLLAPSE if "two" in name else StopReason.TIME)
    wrong = replace(made, wall_events=made.wall_events + 1, stop=stop)
    assert not all(check.holds for check in fact(wrong))


@pytest.mark.parametrize(
    ("change", "fails"),
    [
        (lambda events: replace(events, time=events.time + 1e-9), "time, s"),
        (lambda events: replace(events, impulse=events.impulse * (1 + 1e-9)), "impulse, kg m/s"),
        (lambda events: events[1:], "wrong collisions"),
    ],
)
def test_events_that_are_not_the_exact_ones_are_found(
    trace: Trace, change: Callable[[Events], Events], fails: str
) -> None:
    truth = exact_start(trace.start)
    assert len(truth[0]) == FOLLOWED // 7
    assert all(check.holds for check in follows(trace, truth))
    wrong = replace(trace, events=change(events_of(trace)))
    assert [check.name for check in follows(wrong, truth) if not check.holds] == [fails]


def test_missed_events_are_found() -> None:
    """A run until a time that ends without the last of its exact collisions."""
    scene = scene_of([(0.0, 0.0, 1.0, 0.5, 1.0, 1.0)])
    made = simulate(scene, time=50.0)
    cut = replace(made, events=events_of(made)[:-1])
    wrong, *_ = follows(cut, exact_start(scene))
    assert (wrong.name, wrong.error) == ("wrong collisions", 1)


def test_not_a_number_never_holds() -> None:
    assert not Check("x", math.nan, 1.0).holds
    assert not Check("x", 1.0, math.nan).holds


def test_the_longest_run_of_hits(trace: Trace) -> None:
    """Ball 0: wall, wall, pair, wall; ball 1: pair, wall, wall, wall; ball 2: wall."""
    i = np.array([0, 0, 0, 1, 2, 1, 0, 1], dtype=np.int32)
    j = np.array([-1, -1, 1, -1, -1, -1, -1, -1], dtype=np.int32)
    assert longest_run(events_of(trace, i=i, j=j, time=np.arange(8.0))) == 3
    assert longest_run(events_of(trace, i=i[2:3], j=j[2:3], time=np.zeros(1))) == 0


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


# --- the study ------------------------------------------------------------------------------


def test_a_record_has_the_faults() -> None:
    cases = (
        CASES["touching"],
        replace(CASES["newton-row"], endings=(StopReason.COLLAPSE,)),
    )
    found = HardCaseStudy(cases).measure()
    first, second = found["cases"]
    assert [case["holds"] for case in found["cases"]] == [True, False]
    assert not HardCaseStudy.passed(found)
    assert (first["events"], first["runs"]) == (6, 6)
    assert first["endings"] == [{"reason": "time", "runs": 6}]
    assert second["faults"][0].startswith("allpairs, cor=0.5: ")
    faults = [line for line in HardCaseStudy.tables(found) if line.startswith("newton-row, ")]
    assert len(faults) == len(second["faults"])


def test_a_scene_that_cannot_exist_is_refused_with_its_place(tmp_path: Path) -> None:
    text = (FOLDER / "full.yaml").read_text(encoding="utf-8")
    (tmp_path / "full.yaml").write_text(text.replace("9.999999999999998", "10.0"))
    with pytest.raises(ConfigError, match=r"full\.yaml:"):
        verdict(CASES["full"], tmp_path)
