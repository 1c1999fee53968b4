"""Whether means over time change: no gas that does not is accused more often than stated."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import gas
from scipy import stats

from snooker_cli.analysis.comparison import compare
from snooker_cli.analysis.goodness import LEAST_PROBABILITY
from snooker_cli.analysis.measurement import WINDOWS, measure, pairs_of
from snooker_cli.analysis.steady_means import (
    SteadyMeans,
    quarters_of_means,
    refused_together,
    steady_means,
)
from snooker_cli.engine.simulation import simulate_batch
from snooker_cli.laws import Constant, Sides, Thermal
from snooker_cli.trace import Trace

RATIO, PATH, RATE = "PV/NT", "mean free path", "ball-ball rate of a ball"


def found_in(traces: list[Trace]) -> SteadyMeans:
    return steady_means(measure(traces, pairs=pairs_of(traces)))


@pytest.mark.parametrize(
    ("probabilities", "refused"),
    [
        ((0.001, 0.004, 0.5, 0.0051), "a"),  # 4 × 0.001, 3 × 0.004
        ((0.003, 0.001, 0.004), "abc"),  # 3 × 0.001, 2 × 0.003, 0.004
        ((0.02, 0.011), ""),
        ((0.0099,), "a"),
        ((), ""),
    ],
)
def test_holms_method(probabilities: tuple[float, ...], refused: str) -> None:
    names = dict(zip("abcd", probabilities, strict=False))
    assert "".join(refused_together(names)) == refused


def test_elastic_gases_are_accused_as_seldom_as_stated() -> None:
    """120 gases of 8 repeats, with 8 means each. Chance accuses more than 5 with p = 0.001."""
    points, repeats = 120, 8
    scenes = [gas("circle", 16, 0.1, seed=seed) for seed in range(points * repeats)]
    traces = simulate_batch(scenes, collisions=1500, summary=True)
    accused = 0
    for k in range(points):
        found = found_in(traces[k * repeats : (k + 1) * repeats])
        assert len(found.changing) + len(found.steady) == 8
        assert "temperature" not in found.steady  # it is constant to rounding
        accused += bool(found.changing)
    assert stats.binom.sf(5, points, LEAST_PROBABILITY) < 0.002
    assert accused <= 5


def test_a_cooling_gas_changes_and_its_ratios_do_not() -> None:
    scenes = [gas("periodic", 16, 0.1, cor=0.95, seed=seed) for seed in range(12)]
    traces = simulate_batch(scenes, collisions=1500, summary=True)
    found = found_in(traces)
    assert {"temperature", "pressure", RATE, "mean speed"} == {*found.changing}
    assert {RATIO, PATH} < {*found.steady}
    (note,) = [note for note in compare(traces)[1] if note.note.startswith("means over time")]
    assert "these change within their part: pressure, temperature" in note.note
    assert "no change is found in PV/NT, mean free path" in note.note
    assert RATIO in note.quantity


def test_quarters_are_those_of_the_events() -> None:
    """The rate of collisions in four quarters of windows 4 to 20, and after the relaxation."""
    traces = simulate_batch([gas("box", 16, 0.1, seed=seed) for seed in range(6)], collisions=3000)
    measurement = measure(traces, pairs=pairs_of(traces))
    found = quarters_of_means(measurement, first_window=4)
    relaxed = quarters_of_means(measurement)[RATE]
    for k, trace in enumerate(traces):
        events, end = trace.events, trace.stop.time
        assert events is not None
        edges = np.linspace(4, WINDOWS, 5) / WINDOWS * end
        pairs = np.histogram(events.time[events.j >= 0], edges)[0]
        assert found[RATE][k] == pytest.approx(2 * pairs / (16 * np.diff(edges)), rel=1e-9)
        begin = math.ceil((1 - measurement.relaxed.length[k] / end) * WINDOWS) / WINDOWS * end
        later = np.sum(events.time[events.j >= 0] > begin)
        assert relaxed[k].mean() == pytest.approx(2 * later / (16 * (end - begin)), rel=1e-9)


def test_a_change_of_the_stated_size_is_found() -> None:
    """A path that shrinks by twice the least change from the first quarter to the last."""
    scenes = [gas("periodic", 16, 0.1, seed=seed) for seed in range(12)]
    traces = simulate_batch(scenes, collisions=3000, summary=True)
    measurement = measure(traces, pairs=pairs_of(traces))
    steady = steady_means(measurement)
    assert not steady.changing
    share = 2 * steady.least[steady.steady.index(PATH)]
    windows = measurement.windows
    slope = 1 + share * np.linspace(-0.5, 0.5, WINDOWS) / (1 - 5 / WINDOWS)
    later = windows._replace(pair_events=windows.pair_events * slope)
    assert PATH in steady_means(replace(measurement, windows=later)).changing


def test_every_mean_of_a_warm_gas_is_tested() -> None:
    """Also the energy from each wall, and what needs events; χ² is no mean over time."""
    law = Sides(Thermal(40.0), Thermal(60.0), Constant(1.0), Constant(1.0))
    scene = replace(gas("box", 30, 0.1, cor=0.98), wall_law=law)
    scenes = [replace(scene, wall_key=key) for key in range(8)]
    rows, notes = compare(simulate_batch(scenes, collisions=6000))
    (note,) = [note for note in notes if note.note.startswith("means over time")]
    constant = {"energy from the bottom wall", "energy from the top wall"}  # both are elastic
    assert {*note.quantity.split(", ")} == {row.quantity for row in rows} - constant


def test_few_repeats_are_not_tested() -> None:
    traces = simulate_batch([gas("box", 16, 0.1, seed=seed) for seed in range(4)], collisions=1500)
    assert found_in(traces) == ((), (), ())
    assert "is not known: the test needs 5 complete repeats" in found_in(traces).note.note
