"""A gas that cools by many powers of ten: what was early is still known, and what is late is exact.

By Haff's law nearly all of the energy is lost in the first of many decades of time.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import gas

from snooker_cli.analysis import decay, observables
from snooker_cli.analysis.comparison import compare
from snooker_cli.engine import simulate
from snooker_cli.engine.sampling import EARLY
from snooker_cli.trace import Trace

COLLISIONS = (4_000, 20_000, 40_000)


def cooled(collisions: int, *, summary: bool) -> Trace:
    return simulate(gas("box", 60, 0.1, cor=0.9), collisions=collisions, summary=summary)


@pytest.fixture(scope="module")
def summaries() -> list[Trace]:
    return [cooled(number, summary=True) for number in COLLISIONS]


def alpha(trace: Trace) -> float:
    """Haff's rate, 1/s."""
    return decay.fit_curve(decay.curve(trace, "kinetic_energy"), "haff").value


def test_the_gas_cools_far(summaries: list[Trace]) -> None:
    left = [observables.energy_ratio(observables.series(trace))[-1] for trace in summaries]
    assert left[0] > 1e-8 > 1e-25 > left[1] > 1e-50 > left[2] > 0
    assert summaries[2].stop.time > 1e20 * summaries[0].stop.time


def test_the_decay_does_not_depend_on_how_long_the_run_was(summaries: list[Trace]) -> None:
    events = cooled(COLLISIONS[0], summary=False)
    expected = alpha(events)
    assert expected > 0.1
    assert [alpha(trace) for trace in summaries] == pytest.approx([expected] * 3, rel=0.01)
    longer = [cooled(number, summary=False) for number in COLLISIONS[1:]]
    assert [alpha(trace) for trace in longer] == pytest.approx([expected] * 2, rel=0.005)


def test_rows_of_a_summary_follow_each_other_by_a_sixteenth_of_the_time(
    summaries: list[Trace],
) -> None:
    for trace in summaries:
        time = observables.series(trace).time
        later = time[:-1] >= EARLY / 2 * time[1]
        assert np.all(np.diff(time)[later] <= time[:-1][later] * 2 / EARLY)


def test_a_summary_is_what_collisions_gave_at_all_times(summaries: list[Trace]) -> None:
    full = observables.series(cooled(COLLISIONS[1], summary=False))
    grid = observables.series(summaries[1])
    rows = np.searchsorted(full.time, grid.time, side="right") - 1
    assert np.array_equal(full.kinetic_energy[rows], grid.kinetic_energy)
    assert np.array_equal(full.pair_events[rows], grid.pair_events)


def test_means_of_a_late_window_do_not_feel_what_was_before(summaries: list[Trace]) -> None:
    """Before it was 1e27 times as much."""
    trace = summaries[1]
    found = observables.series(trace)
    since = trace.stop.time / 2
    late = observables.time_mean(trace, found.kinetic_energy, since)
    rows = found.time >= since
    assert found.kinetic_energy[rows].min() <= late <= found.kinetic_energy[rows].max() * 1.01


def test_what_does_not_change_has_its_mean_to_the_bit() -> None:
    trace = simulate(gas("box", 20, 0.1), collisions=200, summary=True)
    constant = np.full(len(observables.series(trace).time), 0.1)
    edges = np.linspace(0.0, trace.stop.time, 8)
    assert observables.time_means(trace, constant, edges).tolist() == [0.1] * 7


@pytest.mark.filterwarnings("error")
def test_a_comparison_of_what_is_cold_is_finite_and_positive(summaries: list[Trace]) -> None:
    for trace in summaries:
        for row in compare([trace]).rows:
            assert math.isfinite(row.measured)
            assert row.predicted > 0 or "energy left" in row.quantity
            assert row.measured >= 0


@pytest.mark.filterwarnings("error")
def test_a_comparison_of_what_is_at_rest_leaves_out_what_has_no_value() -> None:
    trace = cooled(2000, summary=True)
    assert trace.summary is not None
    found = trace.summary.series
    still = replace(found, kinetic_energy=found.kinetic_energy * 0, mean_speed=found.mean_speed * 0)
    compared = compare([replace(trace, summary=replace(trace.summary, series=still))])
    assert all(math.isfinite(row.measured) for row in compared.rows)
    assert any("could not be measured" in note for note in compared.notes)
