"""Comparisons with theory: what is measured when, what is left out, and what a reader is told."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from snooker_cli import containers, theory
from snooker_cli.analysis import decay
from snooker_cli.analysis.comparison import Comparisons, compare, record
from snooker_cli.analysis.observables import mean_and_error, reduced_speed_counts, series
from snooker_cli.analysis.predictions import CHI_SQUARE, Comparison
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


def runs(number: int, *overrides: str, text: str = SCENE, summary: bool = False) -> list[Trace]:
    experiment = parse(text, overrides=overrides).experiment
    summary = summary or experiment.record == "summary"
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
    assert "48" in note


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
    (note,) = found.notes
    for fact in ("3 of 3 repeats", f"{min(events)} to {max(events)}", "96", "48"):
        assert fact in note
    mixed = compare([*short, *runs(2)])
    assert row(mixed, "pressure", "ideal gas law").repeats == 2
    assert "3 of 5 repeats" in mixed.notes[0]


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
    energy = row(found, "decay constant of energy", "source report, −2 ln e/τ")
    pressure = row(found, "decay constant of pressure", "source report, −ln e/τ")
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
    idle = replace(
        elastic[1],
        events=Events(np.empty(0), np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0)),
        stop=Stop(StopReason.TIME, 0.01, (), "0.01 s reached"),
        wall_events=0,
        pair_events=0,
    )
    found = compare([trapped, idle, *elastic[2:]])
    early, without = found.notes[:2]
    assert early.startswith("1 of 6 repeats ended early")
    assert without == "1 of 6 repeats has no collisions"
    assert row(found, "pressure", "ideal gas law").repeats == 5
    assert compare([idle]) == Comparisons((), ("the repeat has no collisions",))
    assert compare([]) == Comparisons((), ())


def test_the_collisions_of_a_collapse_are_no_rate() -> None:
    """Thousands of them are at one instant; without them the repeats have some hundred."""
    collapsed = runs(3, "balls.rings=3", "cor=0.05", "wall_cor=1", "collisions=5000")
    assert all(trace.stop.reason is StopReason.COLLAPSE for trace in collapsed)
    assert all(trace.pair_events > 1000 for trace in collapsed)
    found = compare(collapsed)
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
    assert len(found.notes) == 1
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
    assert found.notes[-1].endswith(f"rows are missing: {left_out}")
    assert {"pressure", "PV/NT"} <= quantities(found)
    assert {one.model for one in found.rows if one.quantity == "pressure"} == {"ideal gas law"}
    shown = {"mean speed", "kurtosis of speeds", CHI_SQUARE} & quantities(found)
    assert bool(shown) == (cor == 1.0)
    assert ("mean speed" in shown) == (change == "radii" and cor == 1.0)
    assert "mean free path" not in quantities(found)


def test_balls_that_are_no_fluid_are_said() -> None:
    dense = runs(2, "balls.radius=1.85", "balls.ring_extent=0.775", "cor=0.95", "wall_cor=1")
    found = compare(dense)
    assert "0.65" in found.notes[-1]
    assert "Haff's α" in found.notes[-1]
    assert "Haff's α" not in quantities(found)
    assert {one.model for one in found.rows if one.quantity == "pressure"} == {
        "ideal gas law",
        "accessible area",
    }


def test_a_theory_without_a_value_is_said() -> None:
    sticky = compare(runs(2, "cor=0", "wall_cor=1", "collisions=150"))
    assert any(
        "decay constant of energy (source report, −2 ln e/τ)" in note for note in sticky.notes
    )
    packed = compare(runs(2, "balls.radius=1.64", "balls.ring_extent=0.8"))
    assert any("pressure (van der Waals)" in note for note in packed.notes)
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


# Boxes and periodic boxes, against theory and published simulations

PERIODIC = """\
container: {shape: periodic, packing: 0.4}
balls: {count: 256, radius: 1.0, speed: 10.0, speeds: maxwell}
cor: 1
collisions: 20000
record: summary
"""

BOX = """\
container: {shape: box, width: 20, height: 14}
balls: {count: 37, radius: 0.6, speed: 10.0}
cor: 1
collisions: 5000
record: summary
"""


@pytest.fixture(scope="module")
def periodic() -> Comparisons:
    return compare(runs(6, text=PERIODIC))


@pytest.fixture(scope="module")
def box() -> Comparisons:
    return compare(runs(12, text=BOX))


@pytest.fixture(scope="module")
def periodic_cooling() -> list[Trace]:
    overrides = ("cor=0.9", "container.packing=0.2", "collisions=2560", "record=events")
    return runs(6, *overrides, text=PERIODIC)


def test_a_periodic_gas_has_the_bulk_s_pressure_and_rates(periodic: Comparisons) -> None:
    """Four standard errors, and what a fixed number of balls changes.

    That is −η p''/(2N p') of Z, with p ∝ ηZ: 1.2/N at η = 0.4, of the rate's Z − 1 too.
    """
    ratio = row(periodic, "PV/NT", "hard disks, Padé")
    finite = 1.2 / 256
    assert ratio.predicted == pytest.approx(1 + (2.82932 - 1) * 256 / 255, abs=1e-5)
    assert abs(ratio.difference) < 4 * ratio.difference_error + finite
    assert ratio.difference_error < 0.02
    rate = row(periodic, "ball-ball rate of a ball", "Enskog")
    share = finite / 1.829 * rate.predicted
    assert abs(rate.difference) < 4 * rate.difference_error + share
    assert row(periodic, "PV/NT", "ideal gas law").in_errors > 50


def test_a_periodic_gas_has_no_walls(periodic: Comparisons) -> None:
    about = {one.quantity for one in periodic.rows}
    models = {one.model for one in periodic.rows}
    # The virial's PV/NT is PV/NT itself.
    assert not {"wall rate of a ball", "PV/NT by the virial"} & about
    assert not {"accessible area", "hard disks with a wall"} & models
    assert "no walls: the pressure is the virial's, (N T + ΣJd/2t)/V" in periodic.notes


def test_the_laws_of_speed_count_one_ball_less(periodic: Comparisons) -> None:
    kurtosis = row(periodic, "kurtosis of speeds", "fixed energy")
    assert kurtosis.predicted == theory.fixed_energy_kurtosis(255)
    speed = row(periodic, "mean speed", "fixed energy")
    assert speed.predicted == pytest.approx(theory.fixed_energy_mean_speed(255, 50.0), rel=1e-9)
    assert abs(speed.in_errors) < 4


def test_a_moving_centre_of_mass_has_no_law_at_fixed_energy() -> None:
    traces = []
    for trace in runs(2, "balls.count=64", "collisions=1", text=PERIODIC):
        moving = replace(trace.start, velocities=trace.start.velocities + 3.0)
        traces.append(simulate(moving, collisions=3000, summary=True))
    found = compare(traces)
    assert any("centre of mass moves on for ever" in note for note in found.notes)
    assert "fixed energy" not in {one.model for one in found.rows}
    # Balls meet as they would without the common motion, of 9 of 59 J each.
    rate, ratio = (
        row(found, *which)
        for which in (("ball-ball rate of a ball", "Enskog"), ("PV/NT", "hard disks, Padé"))
    )
    assert rate.measured == pytest.approx(rate.predicted, rel=0.05)
    assert ratio.measured == pytest.approx(ratio.predicted, rel=0.05)
    still = theory.compressibility(0.4)
    assert ratio.predicted == pytest.approx(1 + (still - 1) * 50 * 64 / 63 / 59, rel=1e-6)


def test_published_values_stand_beside_their_packings() -> None:
    packing = math.pi / (2 * math.sqrt(3)) / 2
    for change, there in ((1.0, True), (1 + 1e-4, False)):
        scene_of = f"container.packing={packing * change!r}"
        found = compare(runs(2, "balls.count=64", "collisions=2000", scene_of, text=PERIODIC))
        models = {one.model: one.predicted for one in found.rows if one.quantity == "PV/NT"}
        assert ("Erpenbeck & Luban 1985" in models) is there
        if there:
            expected = 1 + (3.4243 - 1) * 64 / 63
            assert models["Erpenbeck & Luban 1985"] == pytest.approx(expected, rel=1e-9)


def test_published_values_go_where_no_fluid_is() -> None:
    packed = ("balls.count=64", "container.packing=0.7", "collisions=2000")
    found = compare(runs(2, *packed, text=PERIODIC))
    models = {one.model for one in found.rows if one.quantity == "PV/NT"}
    assert models == {"ideal gas law", "Engel et al. 2013"}
    assert any("0.70" in note for note in found.notes)


def test_a_box_has_straight_walls(box: Comparisons) -> None:
    """Left out are second orders of r over half a side, and of η/N at fixed energy."""
    left_out = (0.6 / 7) ** 2 + 0.1494 / 37
    for quantity in ("pressure", "PV/NT by the virial", "wall rate of a ball"):
        found = row(box, quantity, "hard disks with a wall")
        assert abs(found.difference) < left_out * found.predicted + 4 * found.difference_error
    # Far from what leaves out walls, or collisions.
    assert row(box, "pressure", "hard disks, Padé").in_errors > 20
    assert row(box, "pressure", "accessible area").in_errors > 20
    wall, virial = (
        row(box, name, "hard disks with a wall").measured
        for name in ("PV/NT", "PV/NT by the virial")
    )
    assert wall > virial > 1
    assert row(box, "kurtosis of speeds", "fixed energy").predicted == pytest.approx(2 * 37 / 38)
    assert not [note for note in box.notes if "walls" in note]


def test_a_periodic_gas_cools_by_haff_s_law(periodic_cooling: list[Trace]) -> None:
    """In twenty collisions of a ball; Enskog's rate leaves out what a cooling gas correlates."""
    found = compare(periodic_cooling)
    alpha = row(found, "Haff's α", "Enskog rates at the start")
    assert alpha.predicted == pytest.approx(
        theory.haff_rate(
            theory.cooling_rate(
                0.9,
                theory.ball_ball_rate(
                    0.2 / math.pi, 1.0, 50.0 * 256 / 255, theory.contact_value(0.2)
                ),
            )
        ),
        rel=1e-9,
    )
    assert alpha.measured == pytest.approx(alpha.predicted, rel=0.05)
    inelastic = row(found, "PV/NT", "hard disks, impulses (1 + e)/2")
    elastic = row(found, "PV/NT", "hard disks, Padé")
    assert inelastic.predicted - 1 == pytest.approx(0.95 * (elastic.predicted - 1), rel=1e-9)
    assert abs(inelastic.difference) < abs(elastic.difference)


def test_pressure_decays_with_the_energy_without_walls(
    periodic_cooling: list[Trace],
) -> None:
    found = {(one.quantity, one.law): one for one in decay.decays(periodic_cooling)}
    alphas = {quantity: found[quantity, "haff"].over_repeats.mean for quantity in decay.QUANTITIES}
    assert alphas["local_pressure"] == pytest.approx(alphas["local_energy"], rel=0.03)
    assert alphas["pressure"] == pytest.approx(alphas["kinetic_energy"], rel=0.1)
    assert all(one.over_repeats.failed == 0 for one in found.values())
    said = decay.notes(list(found.values()))
    assert said == [decay.WITHOUT_WALLS]
    in_box = decay.decays(runs(2, "cor=0.9", "collisions=300", text=BOX))
    assert decay.notes(in_box) == []


def test_the_pressure_s_curve_is_the_same_of_a_summary() -> None:
    scene = starting_scene(parse(PERIODIC, overrides=["balls.count=64", "cor=0.9"]).experiment, 0)
    full, grid = (
        decay.curve(simulate(scene, collisions=1500, summary=each), "pressure")
        for each in (False, True)
    )
    # Collisions are a hundredth of a second apart, and read off a grid to a fraction of that.
    at = np.linspace(0.3, 0.9, 7) * full.time[-1]
    values = [np.interp(at, each.time, each.value * each.time[-1]) for each in (full, grid)]
    assert values[1] / values[1][0] == pytest.approx(values[0] / values[0][0], rel=1e-2)
