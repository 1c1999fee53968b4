"""Typical scales of a gas: against simulated gases, and where a theory is missing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gas_kinds import KINDS, scene_of
from scenes import gas

from snooker_cli import facts, theory
from snooker_cli.analysis.measurement import measure, pairs_of
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.analysis.typical_scales import SCALES, TypicalScales, scales_of
from snooker_cli.engine import simulate
from snooker_cli.scene import Scene

PATH, BETWEEN, AT_WALL, COOLING, LENGTH, RATIO = range(6)


def measured(scenes: list[Scene], collisions: int) -> dict[int, tuple[float, float]]:
    """Mean free path (m) and rates (1/s) after the relaxation, with their errors."""
    traces = [simulate(scene, collisions=collisions) for scene in scenes]
    means = measure(traces, pairs=pairs_of(traces)).relaxed
    number = scenes[0].number
    pairs = 2 * means.pair_events / (number * means.length)
    found = {PATH: means.mean_speed / pairs, BETWEEN: pairs}
    if scenes[0].container.has_wall:
        found[AT_WALL] = means.wall_events / (number * means.length)
    return {place: mean_and_error(values) for place, values in found.items()}


@pytest.mark.parametrize(("shape", "packing"), [("periodic", 0.1), ("box", 0.01), ("circle", 0.01)])
def test_scales_are_those_of_a_simulated_gas(shape: str, packing: float) -> None:
    """16 balls in equilibrium. The theory of walls is exact to second order in the density."""
    scenes = [gas(shape, 16, packing, seed=seed) for seed in range(40)]
    scales = scales_of(scenes[0])
    found = measured(scenes, 4000)
    for place, (mean, error) in found.items():
        scale = scales[place]
        expected = scale.value if place == PATH else 1 / scale.value
        assert abs(mean - expected) < 4 * error, SCALES[place].words
        assert error < 0.01 * mean
    # A path that leaves out walls, the number of balls, or χ, would be noticed.
    path, error = found[PATH]
    contact = theory.contact_value(packing)
    for other in (1.0, contact):
        wrong = theory.mean_free_path(16 / scenes[0].container.area, 1.0, other)
        assert abs(path - wrong) > 4 * error, (other, path, wrong, error)


def test_a_warm_gas_has_the_times_of_its_walls() -> None:
    """At the start it is colder; a wall at 30 J warms it."""
    start, warm = scales_of(scene_of("elastic")), scales_of(scene_of("thermal"))
    scene = scene_of("thermal")
    ratio = math.sqrt(scene.kinetic_energy / scene.number / 30)
    contact = theory.contact_value(scene.packing_fraction)
    rate = theory.ball_ball_rate(scene.number / scene.container.area, 0.8, 30.0, contact)
    assert warm[BETWEEN].value == pytest.approx(1 / rate)
    assert warm[AT_WALL].value == pytest.approx(start[AT_WALL].value * ratio, rel=0.02)
    driven = scales_of(scene_of("two temperatures"))
    assert driven[PATH].model == "Enskog"
    assert driven[BETWEEN] == (
        pytest.approx(math.nan, nan_ok=True),
        "",
        "the theory needs walls that give energy by one law",
    )


def test_the_critical_length_is_that_of_the_ratio() -> None:
    scene = gas("periodic", 400, 0.05, cor=0.8)
    scales = scales_of(scene)
    expected = theory.critical_length(0.8, 400, 1.0, scene.container)
    assert scales[LENGTH].value == pytest.approx(expected)
    assert scales[RATIO].value == pytest.approx(scene.container.size[0] / expected)
    # Brito & Ernst: 10 λ/√(1 − e²) in a dilute gas.
    path = theory.mean_free_path(400 / scene.container.area, 1.0)
    assert expected == pytest.approx(10.03 * path / 0.6, rel=0.1)


def test_gases_cool_to_a_quarter_in_their_time() -> None:
    scenes = [gas("periodic", 100, 0.1, cor=0.95, seed=seed) for seed in range(12)]
    time = scales_of(scenes[0])[COOLING].value
    left = [
        simulate(scene, time=time).finish.kinetic_energy / scene.kinetic_energy for scene in scenes
    ]
    mean, error = mean_and_error(np.array(left))
    assert abs(mean - 0.25) < 4 * error
    assert error < 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_each_type_of_gas_has_scales_or_reasons(kind: str) -> None:
    scene = scene_of(kind)
    traits = facts.traits_of(scene)
    for scale, found in zip(SCALES, scales_of(scene), strict=True):
        assert bool(found.model) == math.isfinite(found.value)
        assert not (found.model and found.absence)
        if not facts.hold(traits, "equal_balls"):
            assert found.absence in ("", "the theory needs equal balls"), scale.words
    if facts.hold(traits, "elastic"):
        assert not any(scales_of(scene)[place].model for place in (COOLING, LENGTH, RATIO))


def test_a_sweep_has_a_value_of_each_point() -> None:
    scenes = [gas("periodic", 100, 0.1, cor=cor) for cor in (0.8, 0.9, 1.0)]
    table = TypicalScales(scenes)
    rows = {row["symbol"]: row for row in table.as_json()}
    alone = [scales_of(scene) for scene in scenes]
    assert rows["λ"]["values"] == [point[PATH].value for point in alone]
    assert rows["L_c"]["values"] == [alone[0][LENGTH].value, alone[1][LENGTH].value, None]
    assert "1/ν_w" not in rows
    lines, notes = table.texts()
    (row,) = [line for line in lines if line.startswith("critical length")]
    assert " to " in row
    assert "(2 of 3 points)" in row
    assert any("Brito & Ernst 1998" in line for line in notes)
