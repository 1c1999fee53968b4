"""Energy, momentum and pressure over time, of one repeat and of all."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import ADRIFT, around, in_circle, layers, made, shown, traces

from snooker_cli import theory
from snooker_cli.analysis import observables
from snooker_cli.engine import replay, series
from snooker_cli.figures import Line, Reference
from snooker_cli.figures.captions import LOG_SPREAD, SPREAD
from snooker_cli.figures.figure_data import Band, bands
from snooker_cli.formatting import short
from snooker_cli.runs import Run
from snooker_cli.scene import EPSILON


def test_energy_of_one_repeat_and_of_all(decaying: Run) -> None:
    found = shown(decaying, "energy")
    records, (*lines, legend) = found.numbers["points"], layers(found, Line)
    assert [line.label for line in lines] == ["CoR 0.8", "CoR 0.9", "CoR 1"]
    assert (legend.label, legend.style, len(legend.x)) == ("line: the first repeat", "solid", 0)
    assert [record["elastic"] for record in records] == [False, False, True]
    assert f"bands: {LOG_SPREAD}." in found.caption
    assert found.y_log  # at CoR 0.8 less than a tenth is left
    for index, (line, band) in enumerate(zip(lines, layers(found, Band)[:-1], strict=True)):
        curves = []
        for trace in traces(decaying, index):
            columns = series(trace)
            total = columns.kinetic_energy + columns.container_energy
            curves.append((columns.time, total / total[0]))
        assert [line.x.tolist(), line.y.tolist()] == [each.tolist() for each in curves[0]]
        around(band, curves, found.y_log)
        assert band.series == index
        worst = max(float(np.max(np.abs(ratio - 1))) for _, ratio in curves)
        assert (records[index]["largest_deviation"], records[index]["repeats"]) == (worst, 3)
        assert records[index]["final_ratio"] == line.y[-1]
    # Each energy is a sum over 19 balls, rounded at each.
    assert records[2]["largest_deviation"] < 200 * 19 * EPSILON


@pytest.mark.parametrize(("component", "kind"), [(0, "momentum-x"), (1, "momentum-y")])
def test_momentum_is_summed_from_the_states(decaying: Run, component: int, kind: str) -> None:
    found = shown(decaying, kind, cor=0.9, repeat=2)
    trace = traces(decaying, 1)[2]
    assert trace.events is not None
    states = replay(trace, np.append(0.0, trace.events.time))
    total = np.einsum("tic,i->tc", states.velocities, trace.start.masses)
    total += trace.start.container_mass * states.container_velocities
    deviation = total[:, component] / total[0, component] - 1
    assert found.numbers["largest_deviation"] == np.max(np.abs(deviation))
    (line,) = layers(found, Line)
    assert line.y.tolist() == (total[:, component] / total[0, component]).tolist()
    assert found.y_label == f"total momentum, p{'xy'[component]}(t)/p{'xy'[component]}(0)"
    zero, line = found.inset
    assert isinstance(line, Line)
    assert isinstance(zero, Reference)
    assert line.y.tolist() == (deviation / 1e-15).tolist()
    assert found.inset_label.endswith("(0) − 1) · 10¹⁵")
    lines = [shown(decaying, kind, repeat=repeat, cor=0.9).inset[-1] for repeat in range(3)]
    of_all = shown(decaying, kind, cor=0.9)
    assert layers(of_all, Band)[-1].label == SPREAD
    band = of_all.inset[0]
    assert isinstance(band, Band)
    around(band, [(line.x, line.y) for line in lines if isinstance(line, Line)])
    # A collision rounds two momenta of at most that of a ball with all of the energy.
    largest = math.sqrt(2 * trace.start.kinetic_energy)
    bound = 4 * EPSILON * largest * len(line.x) / abs(total[0, component])
    assert found.numbers["largest_deviation"] < bound


def test_momentum_is_kept_without_walls(tmp_path: Path) -> None:
    run = made(tmp_path / "adrift", text=ADRIFT)
    found = shown(run, "momentum-x")
    assert found.numbers["points"][0]["momentum_at_start"] == 20.0
    assert found.numbers["largest_deviation"] < 1e-14
    # Of a total momentum of 20 and 9 kg m/s; half of the square over the mass is left in the end.
    (trace,) = traces(run, 0)
    kept = (20**2 + 9**2) / 6 / trace.start.kinetic_energy
    decay = shown(run, "event-decay")
    (floor,) = layers(decay, Reference)
    assert floor.value == pytest.approx(kept, rel=1e-12)
    assert str(floor.label).startswith("energy kept by p")
    assert "p²/(2Nm)" in decay.caption


def test_pressure_rises_from_zero_and_ends_at_the_mean(decaying: Run) -> None:
    found = shown(decaying, "pressure", cor=1.0)
    curves = []
    for trace in traces(decaying, 2):
        columns = series(trace)
        time = columns.time[1:]
        curves.append((time, columns.wall_impulse[1:] / (20 * math.pi * time)))
    line, _ = layers(found, Line)
    assert (line.x[0], line.y[0]) == (0.0, 0.0)
    assert line.y[1:] == pytest.approx(curves[0][1], rel=1e-15)
    end = min(time[-1] for time, _ in curves)
    final = np.array([np.interp(end, *each) for each in curves])
    (point,) = found.numbers["points"]
    assert point["pressure"] == pytest.approx(final.mean(), rel=1e-14)
    assert point["pressure_error"] == pytest.approx(final.std(ddof=1) / math.sqrt(3), rel=1e-12)
    band, _ = layers(found, Band)
    assert band.x[-1] == end
    assert band.high[-1] - band.low[-1] == pytest.approx(2 * final.std(ddof=1), rel=1e-12)
    (reference,) = layers(found, Reference)
    assert reference.value == in_circle(50.0, 1.0)


def test_pressure_of_a_periodic_box_starts_at_the_ideal_gas_s(periodic: Run) -> None:
    found = shown(periodic, "pressure", cor=1.0)
    line, _ = layers(found, Line)
    assert line.y[0] == pytest.approx(64 * 50 / 600, rel=1e-12)
    measured = observables.mean_pressure(traces(periodic, 2)[0])
    assert line.y[-1] == pytest.approx(measured, rel=1e-12)
    (reference,) = layers(found, Reference)
    packing = 64 * math.pi * 0.36 / 600
    ratio = theory.compressibility(packing) - theory.missing_ratio(packing, 64)
    # Balls meet at E/(N − 1), as their centre of mass is at rest.
    expected = (64 * 50 + (ratio - 1) * 64 * 50 * 64 / 63) / 600
    assert reference.value == pytest.approx(expected, rel=1e-9)


def test_a_rise_of_the_energy_is_named_if_there_is_one(decaying: Run) -> None:
    rises = [row["largest_rise"] for row in shown(decaying, "energy").numbers["points"][:2]]
    for cor, rise in zip((0.8, 0.9), rises, strict=True):
        caption = shown(decaying, "energy", cor=cor).caption
        assert ("No inelastic collision raises the energy." in caption) == (rise == 0)
        assert (f"raises it by {short(rise, 2)} of E(0) at most." in caption) == (rise > 0)
    assert "inelastic" not in shown(decaying, "energy", cor=1.0).caption


def test_no_band_of_one_repeat_or_of_repeats_without_common_times() -> None:
    early = np.array([0.0, 1.0]), np.array([1.0, 0.5])
    late = np.array([2.0, 3.0]), np.array([1.0, 0.5])
    assert bands([early], 0, steps=True) == []
    assert bands([early, late], 0, steps=True) == []


def test_the_axis_of_the_pressure_shows_its_mean(decaying: Run) -> None:
    """Not the first hit, which may be many times as large: the first tenth of the time is cut."""
    found = shown(decaying, "pressure")
    later = list(found.numbers["theory"])
    for index in range(len(decaying.points)):
        for trace in traces(decaying, index):
            time, values = observables.cumulative_pressure(trace, series(trace))
            later.append(float(values[time >= 0.1 * time[-1]].max()))
    assert found.y_limits == (0, pytest.approx(1.1 * max(later)))
    time = np.linspace(0.0, 1.0, 101)[1:]
    assert observables.settled_top(time, 1 / time) == pytest.approx(1 / 0.11)
