"""Comparisons with theory: what is measured when, what is left out, and what a reader is told."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from snooker_cli import containers, theory
from snooker_cli.analysis import decay
from snooker_cli.analysis.comparison import compare, record
from snooker_cli.analysis.observables import mean_and_error, reduced_speed_counts, series
from snooker_cli.analysis.predictions import Comparison, Comparisons
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import CONTAINER, Events, Stop, StopReason, Trace

SCENE = """\
container: {radius: 10.0, mass: .inf}
balls: {rings: 2, radius: 1.0, mass: 1.0, speed: 10.0}
cor: 1.0
collisions: 600
"""
NUMBER = 19
RELAXING = 48
"""Ball-ball collisions in which nineteen balls have five each."""

CHI_SQUARE = "χ² of the speed distribution, per degree of freedom"


def runs(number: int, *overrides: str, summary: bool = False) -> list[Trace]:
    experiment = parse(SCENE, overrides=overrides).experiment
    return [
        simulate(
            starting_scene(experiment, repeat),
            collisions=experiment.collisions or 0,
            summary=summary,
        )
        for repeat in range(number)
    ]


@pytest.fixture(scope="module")
def elastic() -> list[Trace]:
    return runs(6)


@pytest.fixture(scope="module")
def cooling() -> list[Trace]:
    return runs(6, "cor=0.9", "wall_cor=1")


def row(found: Comparisons, quantity: str, model: str) -> Comparison:
    (only,) = [one for one in found.rows if (one.quantity, one.model) == (quantity, model)]
    return only


def quantities(found: Comparisons) -> set[str]:
    return {one.quantity for one in found.rows}


# What is measured


def test_equilibrium_is_measured_after_the_gas_has_relaxed(elastic: list[Trace]) -> None:
    """By hand, from the events: after the 48th between balls, five of each of the nineteen."""
    pressures, pairs, walls = [], [], []
    for trace in elastic:
        events = trace.events
        assert events is not None
        at_wall = events.j == CONTAINER
        since = events.time[np.flatnonzero(~at_wall)[RELAXING - 1]]
        later, length = events.time > since, trace.stop.time - since
        force = events.impulse[at_wall & later].sum() / length
        pressures.append(force / (2 * math.pi * 10.0))
        pairs.append(2 * np.sum(~at_wall & later) / length / NUMBER)
        walls.append(np.sum(at_wall & later) / length / NUMBER)
    found = compare(elastic)
    for quantity, model, expected in (
        ("pressure", "hard disks with a wall", pressures),
        ("ball-ball rate of a ball", "Enskog", pairs),
        ("wall rate of a ball", "ideal gas", walls),
    ):
        one = row(found, quantity, model)
        assert (one.measured, one.error) == pytest.approx(mean_and_error(np.array(expected)))
        assert (one.repeats, one.samples) == (6, None)
    (note,) = found.notes
    assert "after the first 48 ball-ball collisions, 5 a ball" in note


def test_a_summary_compares_as_its_events_do(elastic: list[Trace], cooling: list[Trace]) -> None:
    """Its rows are some 1/400 of a run apart, which is where a part of it begins and ends."""
    for full, grid in (
        (compare(elastic), compare(runs(6, summary=True))),
        (compare(cooling), compare(runs(6, "cor=0.9", "wall_cor=1", summary=True))),
    ):
        assert [(one.quantity, one.model) for one in full.rows] == [
            (one.quantity, one.model) for one in grid.rows
        ]
        assert full.notes == grid.notes
        for one, other in zip(full.rows, grid.rows, strict=True):
            if one.quantity == CHI_SQUARE:
                assert one.samples == pytest.approx(other.samples, abs=6 * NUMBER)
                continue
            assert other.measured == pytest.approx(one.measured, rel=0.02), one
            assert other.predicted == pytest.approx(one.predicted, rel=0.02), one


def test_a_gas_that_has_not_relaxed_has_no_equilibrium() -> None:
    short = runs(3, "collisions=60")
    found = compare(short)
    assert found.rows == ()
    events = [trace.pair_events for trace in short]
    assert found.notes == (
        f"no pressures, rates and speeds of 3 of 3 repeats, with {min(events)} to {max(events)} "
        "ball-ball collisions: the speeds mix in 48, 5 a ball, and as many again are needed to "
        "measure",
    )
    mixed = compare([*short, *runs(2)])
    assert row(mixed, "pressure", "ideal gas law").repeats == 2
    assert mixed.notes[0].startswith("no pressures, rates and speeds of 3 of 5 repeats, with ")


def test_a_repeat_is_relaxed_with_as_many_collisions_again(elastic: list[Trace]) -> None:
    """Cut off at the 96th collision between balls it counts, at the one before it does not."""
    for count, relaxed in ((2 * RELAXING, True), (2 * RELAXING - 1, False)):
        events = elastic[0].events
        assert events is not None
        last = int(np.flatnonzero(events.j != CONTAINER)[count - 1]) + 1
        part = events[:last]
        cut = replace(
            elastic[0],
            events=part,
            stop=replace(elastic[0].stop, time=float(part.time[-1])),
            pair_events=count,
            wall_events=last - count,
        )
        assert bool(compare([cut]).rows) == relaxed


def test_cooling_is_compared_with_the_reports_own_constant(cooling: list[Trace]) -> None:
    found = compare(cooling)
    reported = np.mean([decay.reported_constant(trace) for trace in cooling])
    energy = row(found, "decay constant of energy", "report, −2 ln e/τ")
    pressure = row(found, "decay constant of pressure", "report, −ln e/τ")
    assert energy.predicted == pytest.approx(reported, rel=1e-12)
    assert pressure.predicted == pytest.approx(reported / 2, rel=1e-12)
    fitted = {(one.quantity, one.law): one for one in decay.decays(cooling)}
    assert energy.measured == fitted["kinetic_energy", "exponential"].over_repeats.mean
    assert pressure.measured == fitted["pressure", "exponential"].over_repeats.mean
    haff = row(found, "Haff's α", "Enskog rates at the start")
    rates = theory.collision_rates(NUMBER, 50.0, 1.0, containers.Circle(10.0))
    assert haff.predicted == pytest.approx(theory.cooling_rate(0.9, rates.ball_ball) / 2)
    assert haff.measured == fitted["kinetic_energy", "haff"].over_repeats.mean


# Speeds


def test_the_distribution_of_speeds_counts_repeats_and_speeds(elastic: list[Trace]) -> None:
    found = [one for one in compare(elastic).rows if one.quantity == CHI_SQUARE]
    assert [one.model for one in found] == ["Maxwell-Boltzmann", "fixed energy"]
    for one in found:
        assert one.repeats == 6
        assert one.samples is not None
        assert one.samples % NUMBER == 0
        assert 0 < one.samples < sum(reduced_speed_counts(trace).sum() for trace in elastic)


def test_a_cooling_gas_is_compared_with_three_laws(cooling: list[Trace]) -> None:
    found = compare(cooling)
    models = ["Maxwell-Boltzmann", "fixed energy", "homogeneous cooling, a2"]
    for quantity in (CHI_SQUARE, "kurtosis of speeds"):
        assert [one.model for one in found.rows if one.quantity == quantity] == models
    a2 = theory.sonine_coefficient(0.9)
    assert row(found, "kurtosis of speeds", models[2]).predicted == pytest.approx(2 * (1 + a2))


def test_speeds_at_fixed_energy_follow_their_law() -> None:
    """Few balls are far from Maxwell and Boltzmann's, and their chi-square says so."""
    few = runs(20, "balls.rings=1", "collisions=4000")
    found = compare(few)
    fixed = row(found, CHI_SQUARE, "fixed energy")
    maxwell = row(found, CHI_SQUARE, "Maxwell-Boltzmann")
    assert abs(fixed.in_errors) < 4
    assert maxwell.in_errors > 20


# What is left out, and said


def test_early_endings_and_idle_repeats_are_said(elastic: list[Trace]) -> None:
    trapped = replace(elastic[0], stop=replace(elastic[0].stop, reason=StopReason.WALL_TRAP))
    nobody = np.empty(0, dtype=np.int32)
    idle = replace(
        elastic[1],
        events=Events(np.empty(0), nobody, nobody, np.empty(0)),
        stop=Stop(StopReason.TIME, 0.01, (), "0.01 s reached"),
        wall_events=0,
        pair_events=0,
    )
    found = compare([trapped, idle, *elastic[2:]])
    assert found.notes[:2] == (
        "1 of 6 repeats ended early, in a wall trap, and is used up to there",
        "1 of 6 repeats has no collisions",
    )
    assert row(found, "pressure", "ideal gas law").repeats == 5
    assert compare([idle]) == Comparisons((), ("the repeat has no collisions",))
    assert compare([]) == Comparisons((), ())


def test_early_endings_in_words() -> None:
    trap, done = StopReason.WALL_TRAP, StopReason.COLLISIONS
    for counts, sentence in (
        ({done: 3, StopReason.NOTHING_LEFT: 1}, ""),
        ({}, ""),
        ({trap: 1}, "the repeat ended early, in a wall trap, and is used up to there"),
        ({trap: 1, done: 4}, "1 of 5 repeats ended early, in a wall trap, and is used up to there"),
    ):
        assert decay.used_up_to_there(counts) == sentence


def test_the_collisions_of_a_collapse_are_no_rate() -> None:
    """Thousands of them are at one instant; without them the repeats have some hundred."""
    collapsed = runs(3, "balls.rings=3", "cor=0.05", "wall_cor=1", "collisions=5000")
    assert all(trace.stop.reason is StopReason.COLLAPSE for trace in collapsed)
    assert all(trace.pair_events > 1000 for trace in collapsed)
    found = compare(collapsed)
    assert found.notes[0] == "3 of 3 repeats ended early, in a collapse, and are used up to there"
    longest = max(trace.stop.time for trace in collapsed)
    for one in found.rows:
        if one.quantity == "ball-ball rate of a ball":
            assert one.measured * 37 / 2 * longest < 1000
    left = row(found, "energy left at the end", "by event count")
    assert left.predicted > 0.01


def test_one_ball_has_no_ball_ball_rows() -> None:
    found = compare(runs(3, "balls.rings=0"))
    assert quantities(found) == {"pressure", "temperature", "PV/NT", "wall rate of a ball"}
    assert {one.model for one in found.rows} == {
        "ideal gas law",
        "ideal gas law, PV/N",
        "accessible area",
        "ideal gas",
    }
    (note,) = found.notes
    assert note.startswith("one ball meets no other: no equations of state, ball-ball rates")
    lossy = compare(runs(3, "balls.rings=0", "cor=0.9"))
    assert quantities(lossy) == quantities(found)


@pytest.mark.parametrize(
    ("change", "cor", "left_out"),
    [
        ("radii", 1.0, "equations of state, collision rates and mean free path"),
        ("masses", 1.0, "equations of state, collision rates, mean free path and mean speed"),
        (
            "radii",
            0.9,
            "equations of state, collision rates, mean free path, distribution of speeds, decay "
            "constants and energy left",
        ),
    ],
)
def test_what_does_not_hold_for_unequal_balls_is_said(
    change: str, cor: float, left_out: str
) -> None:
    scene = starting_scene(parse(SCENE, overrides=[f"cor={cor}"]).experiment, 0)
    unequal = np.linspace(0.8, 1.0, NUMBER)
    trace = simulate(replace(scene, **{change: unequal}), collisions=1000)
    found = compare([trace])
    assert found.notes[-1] == (f"the balls differ, and theory is for equal ones: no {left_out}")
    assert {"pressure", "PV/NT"} <= quantities(found)
    assert {one.model for one in found.rows if one.quantity == "pressure"} == {"ideal gas law"}
    shown = {"mean speed", "kurtosis of speeds", CHI_SQUARE} & quantities(found)
    assert bool(shown) == (cor == 1.0)
    assert ("mean speed" in shown) == (change == "radii" and cor == 1.0)
    assert "mean free path" not in quantities(found)


def test_balls_that_are_no_fluid_are_said() -> None:
    dense = runs(2, "balls.radius=1.85", "balls.ring_extent=0.775", "cor=0.95", "wall_cor=1")
    found = compare(dense)
    assert found.notes[-1] == (
        "the balls fill 0.65 of the area, and theory is for a fluid: no equations of state, "
        "collision rates, mean free path and Haff's α"
    )
    assert "Haff's α" not in quantities(found)
    assert {one.model for one in found.rows if one.quantity == "pressure"} == {
        "ideal gas law",
        "accessible area",
    }


def test_a_theory_without_a_value_is_said() -> None:
    sticky = compare(runs(2, "cor=0", "wall_cor=1", "collisions=150"))
    assert (
        "decay constant of energy (report, −2 ln e/τ) is left out: the theory has no value here"
        in sticky.notes
    )
    packed = compare(runs(2, "balls.radius=1.64", "balls.ring_extent=0.8"))
    assert "pressure (van der Waals) is left out: the theory has no value here" in packed.notes
    assert math.inf not in [one.predicted for one in packed.rows]


def test_a_record_is_json(elastic: list[Trace], cooling: list[Trace]) -> None:
    for traces in (elastic, cooling, elastic[:1]):
        for one in compare(traces).rows:
            found = record(one, {"cor": 1.0})
            assert json.loads(json.dumps(found, allow_nan=False)) == found
            assert set(found) == {
                "parameters",
                "quantity",
                "unit",
                "model",
                "measured",
                "error",
                "predicted",
                "difference",
                "difference_error",
                "difference_in_errors",
                "repeats",
                "samples",
            }
            assert (found["samples"] is None) == (one.quantity != CHI_SQUARE)


def test_repeats_that_agree_to_rounding_have_no_error(elastic: list[Trace]) -> None:
    """The temperature of elastic balls in a fixed container is that of the start."""
    warm = row(compare(elastic), "temperature", "ideal gas law, PV/N")
    assert warm.measured == pytest.approx(50, rel=1e-12)
    assert math.isnan(warm.error)
    assert series(elastic[0]).kinetic_energy[0] == pytest.approx(NUMBER * 50)
