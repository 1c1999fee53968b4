"""Gases that walls keep warm: when they are stationary, and what they measure beside theory."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import gas
from scipy import stats

from snooker_cli.analysis import stationarity
from snooker_cli.analysis.comparison import Comparison, compare
from snooker_cli.analysis.decay import WARM, decays, fit_notes
from snooker_cli.analysis.goodness import equal_means
from snooker_cli.analysis.measurement import WINDOWS, measure
from snooker_cli.analysis.observables import wall_energies
from snooker_cli.analysis.quantities import TEMPERATURE
from snooker_cli.analysis.theories import BALANCE, NO_THEORY, WALLS, values_of
from snooker_cli.containers import Box
from snooker_cli.engine import replay, series
from snooker_cli.engine.simulation import simulate_batch
from snooker_cli.facts import traits_of
from snooker_cli.formatting import with_error
from snooker_cli.laws import Constant, Driven, Sides, Thermal, Viscoelastic
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace

REPEATS = 24


def repeats_of(scene: Scene, wall_law: Any, number: int = REPEATS, **limits: Any) -> list[Trace]:
    """Repeats of a gas with other random directions, and other keys of a thermal wall."""
    scenes = []
    for repeat in range(number):
        angle = np.random.default_rng(repeat).uniform(0, 2 * math.pi, scene.number)
        speed = np.hypot(*scene.velocities.T)
        velocities = np.column_stack([speed * np.cos(angle), speed * np.sin(angle)])
        scenes.append(replace(scene, velocities=velocities, wall_law=wall_law, wall_key=repeat))
    return simulate_batch(scenes, **({"collisions": 3000} | limits))


@pytest.fixture(scope="module")
def thermal() -> list[Trace]:
    """Seven elastic balls that start at 2.5 times the temperature of the wall."""
    return repeats_of(gas("circle", 7, 0.1), Thermal(20.0), 12)


@pytest.fixture(scope="module")
def driven() -> list[Trace]:
    return repeats_of(gas("circle", 50, 0.05, cor=0.9), Driven(0.95, 3.0), 12, collisions=30_000)


def row(rows: list[Comparison], quantity: str, model: str) -> Comparison:
    (found,) = (row for row in rows if (row.quantity, row.model) == (quantity, model))
    return found


# The test


def test_the_probability_is_uniform_for_equal_means() -> None:
    """Of 2,000 samples of eight repeats, and small for a difference of six errors."""
    rng = np.random.default_rng(3)
    found = [equal_means(rng.normal(size=(8, 4)) + rng.normal(size=(8, 1))) for _ in range(2000)]
    for share in (0.01, 0.1, 0.5):
        error = math.sqrt(share * (1 - share) / 2000)
        assert abs(np.mean(np.array(found) < share) - share) < 4 * error
    shifted = rng.normal(size=(30, 4)) + np.array([0, 0, 0, 1.5])
    assert equal_means(shifted) < 0.001
    values = rng.normal(size=(9, 2))
    student = stats.ttest_1samp(np.diff(values, axis=1)[:, 0], 0.0).pvalue
    assert equal_means(values) == pytest.approx(student)


def test_the_stationary_part_begins_after_the_approach() -> None:
    rng, windows, ends = np.random.default_rng(4), np.arange(WINDOWS), np.full(20, 40.0)
    noise = 100 + rng.normal(size=(20, WINDOWS))
    firsts = [
        stationarity.stationary_part(noise + change, ends).first_window
        for change in (0 * windows, 30 * np.exp(-windows), 30 * np.exp(-windows / 2))
    ]
    assert firsts[0] == 1
    assert 1 < firsts[1] < firsts[2] <= WINDOWS // 2
    assert "not refused as stationary from 2 s on" in stationarity.stationary_part(noise, ends).note
    # The quarters of the rest have no trend of more than their error.
    part = stationarity.stationary_part(noise + windows, ends)
    assert part.first_window is None
    assert "not stationary" in part.note


def test_what_the_test_lacks_is_a_sentence(thermal: list[Trace]) -> None:
    measured = measure(thermal[:6])
    early = np.where(np.arange(6) < 2, StopReason.COLLAPSE.value, measured.endings)
    few = stationarity.stationary_part_of(replace(measured, endings=early))
    assert few.note == (
        "the stationary part is not known: the test needs 5 complete repeats, and 4 are there"
    )
    alike = stationarity.stationary_part(np.full((6, WINDOWS), 7.0), measured.time)
    assert alike.first_window is None
    assert "rounding" in alike.note
    rows, notes = compare(thermal[:4])
    assert rows == []
    assert [note.note for note in notes] == [few.note]


def test_a_thermal_wall_sets_the_temperature(thermal: list[Trace]) -> None:
    """Seven balls are canonical: the kurtosis is 2, not that of a fixed energy, 1.75."""
    rows, _ = compare(thermal)
    assert row(rows, "temperature", "temperature of the wall").predicted == 20.0
    assert row(rows, "kurtosis of speeds", "Maxwell-Boltzmann").predicted == 2.0
    assert not [row for row in rows if "fixed energy" in row.model or "Haff" in row.quantity]


def test_a_driven_wall_sets_the_temperature_of_the_balance(driven: list[Trace]) -> None:
    rows, _ = compare(driven)
    (warm,) = values_of(driven[0].start, TEMPERATURE, WALLS, BALANCE).values()
    assert row(rows, "temperature", BALANCE).predicted == pytest.approx(warm)


# Rows


def test_a_driven_gas_takes_what_it_is_given(driven: list[Trace]) -> None:
    rows, _ = compare(driven)
    balance = row(rows, "energy from the walls", "taken by collisions")
    assert abs(balance.in_errors) < 4
    large = row(rows, "PV/NT by the virial", "hard disks, N → ∞")
    assert large.difference == pytest.approx(0, abs=0.05)
    assert not [row for row in rows if "fixed energy" in row.model]
    # Theory has the rate of hits in equilibrium only.
    rates = {row.model for row in rows if row.quantity == "wall rate of a ball"}
    assert rates == {"ideal gas"}
    assert row(rows, "T across/T along", "equal parts").measured > 1.02


def test_a_driven_circle_keeps_the_common_rotation(driven: list[Trace]) -> None:
    """Lω/2 of the energy, with the angular velocity ω = L/I of the balls in the end."""

    def sentences(traces: list[Trace]) -> list[str]:
        return [note.note for note in compare(traces)[1] if note.note.startswith("common rotation")]

    part, shares = stationarity.stationary_part_of(measure(driven)), []
    energies = measure(driven).windows.kinetic_energy[:, part.first_window :].mean(axis=1)
    for trace, energy in zip(driven, energies, strict=True):
        (x, y), (u, v) = trace.finish.positions.T, trace.finish.velocities.T
        turning = np.sum(x * v - y * u)
        shares.append(100 * turning / 2 * (turning / np.sum(x * x + y * y)) / energy)
    share, error = np.mean(shares), stats.sem(shares)
    (sentence,) = sentences(driven)
    assert f": {with_error(share, error)} % of the energy; " in sentence
    assert ("`common_rotation: false`" in sentence) == (share > 1)

    # Nothing is kept by a wall with a temperature.
    scene = gas("circle", 20, 0.05, cor=0.9)
    assert sentences(repeats_of(scene, Thermal(20.0), 6)) == []


def test_two_temperatures_have_no_theory_of_the_mean_one() -> None:
    scene = replace(gas("channel", 40, 0.2), pair_law=Viscoelastic(1.0, 1.0))
    law = Sides(Thermal(40.0), Thermal(60.0), Constant(1.0), Constant(1.0))
    rows, notes = compare(repeats_of(scene, law, 6, collisions=4000, summary=True))
    found = row(rows, "temperature", NO_THEORY)
    assert 40 < found.measured < 60
    record = found.as_json()
    assert record["predicted"] is record["difference"] is record["difference_in_errors"] is None
    assert any("needs `record: events`" in note.note for note in notes)
    assert not [row for row in rows if row.quantity.endswith("wall")]


def test_each_side_of_a_box_has_its_energy() -> None:
    """In two halves of the time, by a sum over hits; and in `compare`."""
    scene = replace(gas("box", 30, 0.1), container=Box(40.0, 30.0))
    law = Sides(Thermal(40.0), Constant(0.9), Driven(0.95, 2.0), Constant(1.0))
    traces = repeats_of(scene, law, 6, collisions=4000)
    trace, end = traces[0], traces[0].stop.time
    gains = np.diff(series(trace).kinetic_energy)
    expected = np.zeros((2, 4))
    for event in np.flatnonzero(trace.events.at_wall):
        time, ball = trace.events.time[event], trace.events.i[event]
        x, y = replay(trace, [time]).positions[0, ball]
        side = int(x > 0) if abs(abs(x) - 19) < 1e-9 else 2 + int(y > 0)
        expected[int(time > end / 2), side] += gains[event]
    energy = series(trace).kinetic_energy
    found = wall_energies(trace, energy, np.array([0.0, end / 2, end]))
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-9)
    assert found[:, 1].max() < 0 < found[:, 2].min()
    assert abs(found[:, 3]).max() < 1e-9
    rows, _ = compare(traces)
    sides = [row(rows, f"energy from the {side} wall", NO_THEORY) for side in Box.sides]
    total = sum(side.measured for side in sides)
    steady = measure(traces).windows
    mean = (steady.wall_energy[:, 1:].sum(axis=1) / steady.length[:, 1:].sum(axis=1)).mean()
    assert total == pytest.approx(mean, rel=1e-9)


def test_a_wall_with_one_temperature_on_some_sides() -> None:
    scene = replace(gas("box", 40, 0.2), container=Box(30.0, 30.0))
    elastic, warm = Constant(1.0), Thermal(40.0)
    for law, wanted in (
        (warm, 40.0),
        (Sides(warm, elastic, elastic, elastic), 40.0),
        (Sides(warm, Constant(0.9), elastic, elastic), None),
        (Sides(Thermal(0.9), Constant(0.9), elastic, elastic), None),
        (Sides(warm, Thermal(50.0), elastic, elastic), None),
        (Driven(1.0, 2.0), None),
    ):
        assert traits_of(replace(scene, wall_law=law, wall_key=0)).wall_temperature == (
            wanted or 0.0
        )


# Other analyses


def test_a_warm_gas_has_no_decay_constants(driven: list[Trace]) -> None:
    constants = decays(driven[:3])
    assert not any(fit.converged for decay in constants for fit in decay.fits)
    assert [note.note for note in fit_notes(constants)] == [WARM]


def test_longer_driven_walls_keep_a_gas_warmer() -> None:
    """Two boxes of one area: in the high one, the walls that give energy are longer."""
    found = []
    for width, height in ((30.0, 10.0), (10.0, 30.0)):
        law = Sides(Driven(0.9, 5.0), Driven(0.9, 5.0), Constant(1.0), Constant(1.0))
        scene = replace(gas("box", 30, 0.1, cor=0.9), container=Box(width, height), wall_law=law)
        found.append(next(iter(values_of(scene, TEMPERATURE, WALLS, BALANCE).values())))
    assert found[1] > 1.5 * found[0]
