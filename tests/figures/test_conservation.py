"""Energy and momentum over time: what falls, and what is kept up to rounding."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import ROUGH, layers, made, shown, traces, why_not

from snooker_cli.analysis.measurement import measure
from snooker_cli.analysis.observables import standard_errors
from snooker_cli.engine import replay, series
from snooker_cli.figures.figure_builder import EARLY
from snooker_cli.figures.figure_data import Band, Line, Repeats, courses
from snooker_cli.figures.registry import FIGURES
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection
from snooker_cli.scene import EPSILON


def test_energy_is_a_mean_over_the_repeats(decaying: RunFolder) -> None:
    found = shown(decaying, "energy")
    records, lines = found.numbers["points"], [*layers(found, Line)]
    assert [line.label for line in lines] == ["CoR 0.8", "CoR 0.9", "CoR 1"]
    assert {*lines.pop().y} == {1.0}  # its change is below
    assert [record["elastic"] for record in records] == [False, False, True]
    bold = "Bold: means over the repeats; thin: single repeats; bands: standard errors."
    assert bold in found.caption
    assert found.y_log  # at CoR 0.8 less than a tenth is left
    for index, (line, band) in enumerate(zip(lines, layers(found, Band), strict=True)):
        curve = measure(traces(decaying, index)).curve
        curves = courses(curve.time, curve.energy / curve.energy[:, :1])
        end = min(time[-1] for time, _ in curves)
        longer = sorted(time[-1] for time, _ in curves)[-2]
        assert (line.x[0], band.series) == (0.0, index)
        assert EARLY * longer <= line.x[-1] <= longer
        all_there = line.x <= end
        rows = np.array([np.interp(line.x[all_there], *pair) for pair in curves])
        assert np.allclose(line.y[all_there], rows.mean(axis=0), rtol=1e-14)
        widths = (band.high - band.low)[all_there] / 2
        assert np.allclose(widths, standard_errors(rows), atol=1e-15)
        last = line.x[-1]
        lasts = [np.interp(last, *pair) for pair in curves if pair[0][-1] >= last]
        assert line.y[-1] == pytest.approx(np.mean(lasts))
        record, last = records[index], np.array([[np.interp(end, *pair)] for pair in curves])
        assert (record["time"], record["final_ratio"]) == (end, pytest.approx(last.mean()))
        assert record["final_ratio_error"] == pytest.approx(standard_errors(last)[0])
        worst = max(float(np.max(np.abs(ratio - 1))) for _, ratio in curves)
        assert (record["largest_deviation"], record["repeats"]) == (worst, 3)
    # Each energy is a sum over 19 balls, rounded at each.
    assert records[2]["largest_deviation"] < 200 * 19 * EPSILON
    (single,) = layers(shown(decaying, "energy", cor=0.9, repeat=1), Line)
    first = series(traces(decaying, 1)[1])
    total = first.kinetic_energy + first.container_energy
    assert (single.x[-1], single.y[-1]) == (first.time[-1], total[-1] / total[0])


def test_energy_that_is_kept_is_drawn_as_its_change(decaying: RunFolder, warm: RunFolder) -> None:
    """In a panel beside points that lose energy, or alone; never as a flat line."""
    (changes,) = shown(decaying, "energy").panels
    assert changes.label == "ΔE / E(0) (10⁻¹⁶)"
    mean, above, below = (layer for layer in changes.layers if isinstance(layer, Line))
    (singles,) = (layer for layer in changes.layers if isinstance(layer, Repeats))
    curve = measure(traces(decaying, 2)).curve
    pairs = courses(curve.time, (curve.energy / curve.energy[:, :1] - 1) / 1e-16)
    end = min(time[-1] for time, _ in pairs)
    rows = np.array([np.interp(mean.x[mean.x <= end], *pair) for pair in pairs])
    assert mean.y[: rows.shape[1]] == pytest.approx(rows.mean(axis=0), abs=1e-9)
    assert len(singles.rows) == 3
    # The rounding of a sum over 19 balls, then that of collisions too.
    assert above.y[0] == pytest.approx(EPSILON / 2 * math.sqrt(19 / 3) / 1e-16)
    assert above.y[-1] > above.y[0]
    assert below.y.tolist() == (-above.y).tolist()
    assert np.nanmax(np.abs(singles.rows)) < 20 * above.y[-1]
    alone = shown(warm, "energy")
    assert alone.title.startswith("Change of the kinetic energy: at most ")
    assert not alone.panels
    assert "Largest change of the energy |ΔE|/E is between" in alone.caption
    source = FIGURES["energy"].make(decaying, Selection(), source=True)
    assert not source.panels
    assert len(layers(source, Line)[2].x) > 100


def test_energies_that_fall_by_decades_have_a_logarithmic_time(
    decaying: RunFolder, tmp_path: Path
) -> None:
    """It begins where a hundredth of the energy is lost."""
    assert not shown(decaying, "energy").x_log  # at CoR 0.8 more than a hundredth is left
    found = shown(made(tmp_path / "run", text=ROUGH), "energy")
    (line,) = (line for line in layers(found, Line) if not line.thin)
    assert (found.x_log, found.y_log) == (True, True)
    begins = found.x_limits[0]
    assert begins is not None
    assert np.interp(begins, line.x, line.y) == pytest.approx(0.99, abs=0.01)


def test_the_change_of_the_momentum_is_over_the_sum_of_momenta(decaying: RunFolder) -> None:
    found = shown(decaying, "energy", cor=1.0, repeat=2)
    trace = traces(decaying, 2)[2]
    assert trace.events is not None
    states = replay(trace, np.append(0.0, trace.events.time))
    total = np.einsum("tic,i->tc", states.velocities, trace.start.masses)
    total += trace.start.container_mass * states.container_velocity
    change = np.hypot(*(total - total[0]).T) / np.sum(np.hypot(*trace.start.velocities.T))
    (panel,) = found.panels
    line, rounding = panel.layers
    assert isinstance(line, Line)
    assert isinstance(rounding, Line)
    assert line.y == pytest.approx(change / 1e-16, rel=1e-12)
    (record,) = found.numbers["points"]
    assert record["momentum_deviation"] == pytest.approx(change.max(), rel=1e-12)
    assert change.max() / 1e-16 < 10 * rounding.y[-1]
    assert rounding.y[0] == pytest.approx(EPSILON / 2 * math.sqrt(0.5) / 1e-16)


def test_momentum_is_summed_from_the_states(decaying: RunFolder) -> None:
    component, kind = 1, "momentum-y"
    found = shown(decaying, kind, cor=0.9, repeat=2)
    trace = traces(decaying, 1)[2]
    assert trace.events is not None
    states = replay(trace, np.append(0.0, trace.events.time))
    total = np.einsum("tic,i->tc", states.velocities, trace.start.masses)
    total += trace.start.container_mass * states.container_velocity
    deviation = total[:, component] / total[0, component] - 1
    assert found.numbers["largest_deviation"] == np.max(np.abs(deviation))
    (line,) = layers(found, Line)
    assert line.y.tolist() == (total[:, component] / total[0, component]).tolist()
    line = found.panel[-1]
    assert isinstance(line, Line)
    assert line.y.tolist() == (deviation / 1e-15).tolist()
    lines = [shown(decaying, kind, repeat=repeat, cor=0.9).panel[-1] for repeat in range(3)]
    of_all = shown(decaying, kind, cor=0.9)
    _, _, band, mean = of_all.panel
    assert isinstance(band, Band)
    assert isinstance(mean, Line)
    values = [float(np.interp(mean.x[99], line.x, line.y)) for line in lines]  # type: ignore
    assert mean.y[99] == pytest.approx(np.mean(values))
    assert (band.high - band.low)[99] / 2 == pytest.approx(np.std(values, ddof=1) / math.sqrt(3))
    # A collision rounds two momenta of at most that of a ball with all of the energy.
    largest = math.sqrt(2 * trace.start.kinetic_energy)
    bound = 4 * EPSILON * largest * len(line.x) / abs(total[0, component])
    assert found.numbers["largest_deviation"] < bound


def test_a_momentum_of_zero_has_a_change_but_no_ratio(periodic: RunFolder) -> None:
    assert "is zero at the start" in why_not(periodic, "momentum-x")
    (record,) = shown(periodic, "energy", cor=1.0).numbers["points"]
    assert record["momentum_deviation"] < 1e-14


def test_a_momentum_that_walls_take_is_not_shown(box: RunFolder) -> None:
    found = shown(box, "energy", cor=1.0)
    assert not found.panels
    assert "momentum" not in found.caption
