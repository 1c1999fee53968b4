"""Results of the stated scene from events, errors of ratios, and settings of the fits."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repeating
from figure_runs import made

import snooker_cli as snooker
from snooker_cli.config import load
from snooker_cli.reproduction import explanations, run_results
from snooker_cli.reproduction.explanations import FIRST, SETTINGS, explain
from snooker_cli.reproduction.source_values import SOURCE_VALUES, OurValue

ROOT = Path(__file__).parents[2]


def leave_one_out(above: Any, below: Any) -> float:
    """The jackknife's standard error of a ratio of means."""
    count = len(above)
    ratios = [np.delete(above, k).mean() / np.delete(below, k).mean() for k in range(count)]
    return math.sqrt(count - 1) * float(np.std(ratios))


@pytest.fixture(scope="module")
def cooled(tmp_path_factory: pytest.TempPathFactory) -> snooker.Run:
    """Repeats of the source report's scene at CoR 0.95."""
    folder = tmp_path_factory.mktemp("cooled") / "run"
    text = (ROOT / "configs" / "restitution.yaml").read_text(encoding="utf-8")
    repeating.done(repeating.made(folder, text, "cor=0.95", "repeats=40"))
    return snooker.open(folder)


def test_the_slope_of_the_mean_pressure_is_that_of_the_events(cooled: snooker.Run) -> None:
    """Its error is that of leaving out one repeat after the other, to first order."""
    repeats = run_results.complete_repeats(cooled)
    found = run_results.mean_pressure_slope([repeat.series() for repeat in repeats])
    end, changes = min(repeat.stop.time for repeat in repeats), []
    for repeat in repeats:
        events, energy = repeat.events, np.log(repeat.series().kinetic_energy)
        rows = []
        for time in (run_results.SETTLED, end):
            before = events.time <= time
            impulse = float(events.impulse[(events.j == -1) & before].sum())
            rows.append((math.log(impulse / time), energy[np.count_nonzero(before)]))
        changes.append(np.subtract(rows[1], rows[0]))
    pressure, energy = np.array(changes).T
    assert found["value"] == pytest.approx(pressure.mean() / energy.mean(), rel=1e-9)
    assert found["error"] == pytest.approx(leave_one_out(pressure, energy), rel=0.1)


def test_windows_have_the_impulses_and_energies_of_the_events(cooled: snooker.Run) -> None:
    repeats = run_results.complete_repeats(cooled)
    scene = repeats[0].scene
    found = run_results.in_windows(scene, [repeat.series() for repeat in repeats])
    edges = np.linspace(0, min(repeat.stop.time for repeat in repeats), run_results.WINDOWS + 1)
    work, heat = [], []
    for repeat in repeats:
        events, course = repeat.events, repeat.series()
        inside = (events.j == -1) & (events.time > edges[-2]) & (events.time <= edges[-1])
        impulse = events.impulse[inside].sum()
        work.append(impulse * scene.container.area / scene.container.wall_length)
        fine = np.linspace(edges[-2], edges[-1], 20_001)
        middle = (fine[1:] + fine[:-1]) / 2
        energy = course.kinetic_energy[np.searchsorted(course.time, middle, side="right") - 1]
        heat.append(energy.mean() * (edges[-1] - edges[-2]))
    expected = np.mean(work) / np.mean(heat)
    assert found["last"]["value"] == pytest.approx(expected, rel=1e-4)
    assert found["last"]["error"] == pytest.approx(
        leave_one_out(np.array(work), np.array(heat)), rel=0.1
    )
    assert found["kept"]["value"] == pytest.approx(expected / found["first"]["value"], rel=1e-4)
    assert found["cooling"] > 1


def test_factors_of_the_steady_gas_have_the_errors_of_both_points() -> None:
    """T falls from 50 to 20 J, with 1 % and 2 %; PV/NT is 10 % above a theory of 1.5."""
    shared = {"theory_here": 1.5, "theory": 1.4, "virial_error": 0.03, "wall": 1.8}
    points = [
        {**shared, "parameters": {"cor": cor, "balls.radius": 1.0}, "virial": virial}
        | {"temperature": warm, "temperature_error": error}
        for cor, warm, error, virial in ((0.8, 20.0, 0.4, 1.65), (1.0, 50.0, 0.5, 1.8))
    ]
    elastic, row = run_results.warm_gas(points)
    assert (elastic["cor"], elastic["colder"]["value"], row["cor"]) == (1.0, 1.0, 0.8)
    assert row["colder"] == pytest.approx({"value": 2.5, "error": 2.5 * math.hypot(0.01, 0.02)})
    error = 1.8 / 1.65 * math.hypot(0.03 / 1.8, 0.03 / 1.65)
    assert row["weaker"] == pytest.approx({"value": 1.8 / 1.65, "error": error})
    assert row["excess"] == pytest.approx({"value": 0.1, "error": 0.02})


AUDIT = """
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 3, radius: 1.0, speed: 10.0}
cor: 0.8
collisions: 240
repeats: 4
common_random: true
sweep: {cor: [0.8, 0.9], balls.radius: [0.1, 1.0], wall_cor: [null, 1.0]}
"""


RADIUS = {"balls.radius": 1.0}


def test_each_explanation_has_the_values_of_its_setting(tmp_path: Path) -> None:
    made(tmp_path / "audit", text=AUDIT)
    run = snooker.open(tmp_path / "audit")
    found = explain(run, {"value": 17.1, "deviation": 0.6})
    assert list(found) == list(SETTINGS)
    stated, slip, small, elastic, first, both = (one["values"] for one in found.values())
    k, kappa, speed = "energy_mean_0.8", "pressure_mean_0.8", "speed_0.8"
    assert stated[k]["value"] == pytest.approx(
        run.fit(cor=0.8, wall_cor=None, **RADIUS)[0]["value"]
    )
    for name in (k, kappa):
        for shorter, given in ((slip, stated), (both, elastic)):
            for key in ("value", "error"):
                assert shorter[name][key] == pytest.approx(given[name][key] / 10)
    assert small[k]["value"] < stated[k]["value"] / 3
    assert slip[speed] == small[speed] == first[speed] == stated[speed]
    assert both[speed] == elastic[speed] != stated[speed]
    where = {"cor": 0.8, "wall_cor": None, **RADIUS}
    (point,) = run.matching(**where)
    times = [repeat.events.time[FIRST - 1] for repeat in run.repeats(point.index)]
    until = float(np.mean(times))
    assert explanations._end(run, where) == pytest.approx(until)
    assert first[k]["value"] == pytest.approx(run.fit(until=until, **where)[0]["value"])
    for one in found.values():
        assert one["repeats"] == 8
        for name in one["values"]:
            agrees = OurValue(**one["values"][name]).agrees(SOURCE_VALUES[name])
            assert agrees == (name in one["agreeing"])


def test_the_settings_are_few_and_the_run_has_them() -> None:
    assert len(SETTINGS) == 6
    assert replace(SETTINGS["elastic wall"], slip=True) == [*SETTINGS.values()][-1]
    config = load(ROOT / "configs" / "audit.yaml").config
    assert config.repeats >= 200
    assert config.common_random
