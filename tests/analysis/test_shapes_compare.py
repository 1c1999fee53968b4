"""``compare`` and ``decay`` of boxes and periodic boxes, against theory and others' simulations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from snooker_cli import theory
from snooker_cli.analysis import decay
from snooker_cli.analysis.comparison import compare
from snooker_cli.analysis.predictions import Comparison, Comparisons
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import Trace

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


def runs(text: str, number: int, *overrides: str) -> list[Trace]:
    experiment = parse(text, overrides=overrides).experiment
    summary = experiment.record == "summary"
    return [
        simulate(
            starting_scene(experiment, repeat), collisions=experiment.collisions, summary=summary
        )
        for repeat in range(number)
    ]


def row(found: Comparisons, quantity: str, model: str) -> Comparison:
    (one,) = [each for each in found.rows if (each.quantity, each.model) == (quantity, model)]
    return one


@pytest.fixture(scope="module")
def periodic() -> Comparisons:
    return compare(runs(PERIODIC, 6))


@pytest.fixture(scope="module")
def box() -> Comparisons:
    return compare(runs(BOX, 12))


@pytest.fixture(scope="module")
def cooling() -> list[Trace]:
    overrides = ("cor=0.9", "container.packing=0.2", "collisions=2560", "record=events")
    return runs(PERIODIC, 6, *overrides)


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
    for trace in runs(PERIODIC, 2, "balls.count=64", "collisions=1"):
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
        found = compare(runs(PERIODIC, 2, "balls.count=64", "collisions=2000", scene_of))
        models = {one.model: one.predicted for one in found.rows if one.quantity == "PV/NT"}
        assert ("Erpenbeck & Luban 1985" in models) is there
        if there:
            expected = 1 + (3.4243 - 1) * 64 / 63
            assert models["Erpenbeck & Luban 1985"] == pytest.approx(expected, rel=1e-9)


def test_published_values_go_where_no_fluid_is() -> None:
    packed = ("balls.count=64", "container.packing=0.7", "collisions=2000")
    found = compare(runs(PERIODIC, 2, *packed))
    models = {one.model for one in found.rows if one.quantity == "PV/NT"}
    assert models == {"ideal gas law", "Engel et al. 2013"}
    assert any("the balls fill 0.70 of the area" in note for note in found.notes)


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


def test_a_periodic_gas_cools_by_haff_s_law(cooling: list[Trace]) -> None:
    """In twenty collisions of a ball; Enskog's rate leaves out what a cooling gas correlates."""
    found = compare(cooling)
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


def test_pressure_decays_with_the_energy_where_there_are_no_walls(cooling: list[Trace]) -> None:
    found = {(one.quantity, one.law): one for one in decay.decays(cooling)}
    alphas = {quantity: found[quantity, "haff"].over_repeats.mean for quantity in decay.QUANTITIES}
    assert alphas["local_pressure"] == pytest.approx(alphas["local_energy"], rel=0.03)
    assert alphas["pressure"] == pytest.approx(alphas["kinetic_energy"], rel=0.1)
    assert all(one.over_repeats.failed == 0 for one in found.values())
    said = decay.notes(list(found.values()))
    assert said == [decay.WITHOUT_WALLS]
    in_box = decay.decays(runs(BOX, 2, "cor=0.9", "collisions=300"))
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
