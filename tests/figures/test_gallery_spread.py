"""Bands over repeats: what they are of, and that they lie around the repeats that are drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from galleries import layers, made, shown, traces

from snooker_cli.analysis.decay import curve
from snooker_cli.engine import series
from snooker_cli.figures import Band, Line
from snooker_cli.figures.captions import SPREAD
from snooker_cli.figures.figure_data import at_common_times, bands
from snooker_cli.runs import Run


def around(band: Band, curves: list[tuple[Any, Any]]) -> None:
    """Assert that a band is the mean ± standard deviation of curves that change in steps."""
    assert band.x[0] == max(time[0] for time, _ in curves)
    assert band.x[-1] == min(time[-1] for time, _ in curves)
    for k in (0, 100, 299):
        values = [column[np.flatnonzero(time <= band.x[k])[-1]] for time, column in curves]
        mean, deviation = np.mean(values), np.std(values, ddof=1)
        # The mean of the ratios to a start of one is 1 there but for rounding.
        assert band.low[k] == pytest.approx(mean - deviation, rel=1e-12, abs=1e-15)
        assert band.high[k] == pytest.approx(mean + deviation, rel=1e-12, abs=1e-15)


def test_curves_that_are_straight_or_change_in_steps() -> None:
    one = np.array([0.0, 2.0, 4.0]), np.array([1.0, 3.0, 5.0])
    other = np.array([1.0, 4.0, 9.0]), np.array([10.0, 40.0, 90.0])
    times, straight = at_common_times([one, other])
    assert (times[0], times[-1]) == (1.0, 4.0)
    assert straight[0] == pytest.approx(1 + times)
    assert straight[1] == pytest.approx(10 * times)
    times, stepped = at_common_times([one, other], steps=True)
    assert stepped[0].tolist() == np.select([times < 2, times < 4], [1.0, 3.0], 5.0).tolist()
    assert stepped[1].tolist() == np.where(times < 4, 10.0, 40.0).tolist()
    (band,) = bands(times, stepped, 2)
    assert band.series == 2
    assert (band.low[-1], band.high[-1]) == pytest.approx(
        (22.5 - 17.5 * 2**0.5, 22.5 + 17.5 * 2**0.5)
    )


def test_no_band_of_one_repeat_or_of_repeats_without_common_times() -> None:
    early = np.array([0.0, 1.0]), np.array([1.0, 0.5])
    late = np.array([2.0, 3.0]), np.array([1.0, 0.5])
    assert bands(*at_common_times([early]), 0) == []
    assert bands(*at_common_times([early, late]), 0) == []


def test_energy_of_one_repeat_and_of_all(decaying: Run) -> None:
    found = shown(decaying, "energy")
    assert f"Lines: repeat 0; bands: {SPREAD}." in found.caption
    assert "3 repeats, 200 collisions each." in found.caption
    for index, band in enumerate(layers(found, Band)):
        curves = []
        for trace in traces(decaying, index):
            columns = series(trace)
            total = columns.kinetic_energy + columns.container_energy
            curves.append((columns.time, total / total[0]))
        around(band, curves)
        assert band.series == index
        record = found.numbers["points"][index]
        worst = max(float(np.max(np.abs(ratio - 1))) for _, ratio in curves)
        assert (record["largest_deviation"], record["repeats"]) == (worst, 3)


@pytest.mark.parametrize("kind", ["momentum-x", "momentum-y"])
def test_momentum_of_one_repeat_and_of_all(decaying: Run, kind: str) -> None:
    found = shown(decaying, kind, cor=0.9)
    alone = [shown(decaying, kind, repeat=repeat, cor=0.9) for repeat in range(3)]
    worst = max(picture.numbers["largest_deviation"] for picture in alone)
    assert found.numbers["largest_deviation"] == worst
    lines = [layers(picture, Line)[0] for picture in alone]
    (band,) = layers(found, Band)
    around(band, [(line.x, line.y) for line in lines])
    assert layers(found, Line)[0].y.tolist() == lines[0].y.tolist()


@pytest.mark.parametrize(
    ("kind", "quantity"),
    [
        ("energy-fit", "kinetic_energy"),
        ("temperature-fit", "temperature"),
        ("pressure-fit", "pressure"),
    ],
)
def test_fits_to_one_repeat_before_all(decaying: Run, kind: str, quantity: Any) -> None:
    found = shown(decaying, kind, repeat=1, cor=0.8)
    (band,) = layers(found, Band)
    assert band.label == f"all 3 repeats, {SPREAD}"
    # What is fitted to the one that is drawn is told from what is of all.
    simulated, *fits = (line.label for line in layers(found, Line))
    assert simulated == "simulation, repeat 1"
    k = found.numbers["k"]
    assert [fit.partition(" = ")[0] for fit in fits if fit] == [
        f"exponential of repeat 1: {'κ' if quantity == 'pressure' else 'k'}",
        "Haff's law of repeat 1: α",
    ]
    assert fits[0].split(" = ")[1].startswith(f"{k:.2g}"[:3])
    assert f"Band: {SPREAD}." in found.caption
    curves = [curve(trace, quantity) for trace in traces(decaying, 0)]
    if quantity == "pressure":
        times, table = at_common_times([(each.time, each.value) for each in curves])
        curves_there = [(times, row) for row in table]
    else:
        curves_there = [(each.time, each.value) for each in curves]
    around(band, curves_there)


def test_no_bands_where_one_repeat_is_shown(decaying: Run, tmp_path: Path) -> None:
    single = made(tmp_path / "single", "cor=0.8", "repeats=1")

    for kind in ("energy", "momentum-x", "momentum-y"):
        assert layers(shown(decaying, kind, repeat=2, cor=0.8), Band) == []
        assert layers(shown(single, kind), Band) == []
    for kind in ("energy-fit", "temperature-fit", "pressure-fit"):
        found = shown(single, kind)
        assert layers(found, Band) == []
        assert "Band" not in found.caption


def test_repeats_trapped_before_the_pressure_is_fitted_leave_no_band(tmp_path: Path) -> None:
    run = made(tmp_path / "run", "cor=0.9", "wall_cor=0.3", "repeats=8")
    rows = [len(curve(trace, "pressure").time) for trace in traces(run, 0)]
    assert 0 in rows
    assert max(rows) > 10
    assert layers(shown(run, "pressure-fit", repeat=rows.index(max(rows))), Band) == []
