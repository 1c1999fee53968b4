"""Pressure and temperature against theory, and over the ideal gas's."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from figure_runs import PERIODIC, in_circle, layers, made, shown, traces

from snooker_cli import theory
from snooker_cli.analysis.measurement import Array, measure, pairs_of
from snooker_cli.analysis.run_analysis import comparisons
from snooker_cli.engine import series
from snooker_cli.figures.figure_data import BY_THEORY, MEASURED, Band, Line, Points, Reference
from snooker_cli.formatting import short
from snooker_cli.runs import RunFolder
from snooker_cli.theory import FINITE
from snooker_cli.trace import Trace


def pressures_of(repeats: list[Trace]) -> Array:
    """Mean pressures after the relaxation."""
    measurement = measure(repeats, pairs=pairs_of(repeats))
    return measurement.relaxed.pressure(repeats[0].start)


def test_pressure_against_temperature(warm: RunFolder) -> None:
    found = shown(warm, "gas-law")
    small, large = layers(found, Points)
    assert small.x == pytest.approx([12.5, 50.0, 200.0], rel=1e-13)
    for series_number, points in enumerate((small, large)):
        for k in range(3):
            pressures = pressures_of(traces(warm, 3 * series_number + k))
            assert points.y[k] == pytest.approx(np.mean(pressures), rel=1e-13)
            error = np.std(pressures, ddof=1) / math.sqrt(3)
            assert points.y_error[k] == pytest.approx(error, rel=1e-10)
    ideal = next(line for line in layers(found, Line) if line.label == "ideal gas")
    assert ideal.y == pytest.approx(19 * ideal.x / (100 * math.pi), rel=1e-14)
    curve_of_large = next(line for line in layers(found, Line) if line.series == 1)
    expected = [in_circle(temperature, 1.0) for temperature in curve_of_large.x]
    assert curve_of_large.y == pytest.approx(expected, rel=1e-12)
    across, *residuals = found.panel
    assert vars(across) == vars(Reference("y", 0.0))
    for points, radius, below in zip((small, large), (0.2, 1.0), residuals, strict=True):
        assert isinstance(below, Points)
        theirs = np.array([in_circle(temperature, radius) for temperature in points.x])
        assert below.x.tolist() == points.x.tolist()
        assert below.y == pytest.approx(np.log(points.y / theirs), rel=1e-9)
        assert below.y_error == pytest.approx(points.y_error / points.y, rel=1e-12)
    values = np.concatenate([below.y for below in residuals])
    largest = found.numbers["largest_residual"]
    in_errors = np.abs(values) / np.concatenate([below.y_error for below in residuals])
    percent = 100 * np.expm1(values[np.argmax(in_errors)])
    assert (largest, found.numbers["residuals"]) == (pytest.approx(percent, rel=1e-12), 6)
    assert found.numbers["largest_residual_error"] > 0
    point = found.numbers["points"][5]
    assert point["parameters"] == {"balls.radius": 1.0, "balls.speed": 20.0}
    assert point["over_ideal"] == pytest.approx(large.y[2] / (19 * 200 / (100 * math.pi)), rel=1e-9)


def test_temperature_ratio_against_the_ball_radius(warm: RunFolder) -> None:
    found = shown(warm, "temperature-ratio", balls__speed=10.0)
    (points,) = layers(found, Points)
    assert points.x.tolist() == [0.2, 1.0]
    for k, index in enumerate((1, 4)):
        ratios = 50 / (pressures_of(traces(warm, index)) * 100 * math.pi / 19)
        assert points.y[k] == pytest.approx(np.mean(ratios), rel=1e-13)
        expected = in_circle(50.0, points.x[k])
        theirs = found.numbers["points"][k]["theory"]
        assert theirs == pytest.approx(19 * 50 / (100 * math.pi) / expected, rel=1e-13)


def test_ideal_ratio_is_taken_at_two_temperatures(decaying: RunFolder) -> None:
    found = shown(decaying, "ideal-ratio", cor=0.8)
    at_end, at_mean, *keys = layers(found, Points)
    assert [len(key.x) for key in keys] == [0, 0]
    assert (at_end.filled, at_mean.filled) == (False, True)
    for k, trace in enumerate(traces(decaying, 0)):
        columns, end = series(trace), trace.stop.time
        pressure = columns.wall_impulse[-1] / (20 * math.pi * end)
        temperature = columns.kinetic_energy / 19
        mean = np.sum(temperature[:-1] * np.diff(columns.time)) / end
        ideal = 19 / (100 * math.pi)
        assert at_mean.x[k] == pytest.approx(mean, rel=1e-13)
        assert at_mean.y[k] == pytest.approx(pressure / (ideal * mean), rel=1e-13)
        assert at_end.x[k] == temperature[-1]
        assert at_end.y[k] == pytest.approx(pressure / (ideal * temperature[-1]), rel=1e-13)


def test_van_der_waals_beside_theory(tmp_path: Path) -> None:
    """b of single points is that of the measured pressure; a vanishes, as hard disks scale."""
    run = made(
        tmp_path / "run",
        *("cor=1", "repeats=4", "record=summary", "collisions=4000"),
        *("balls.count=20,60,120", "balls.speed=5,10"),
        text=PERIODIC.partition("sweep")[0],
    )
    found = shown(run, "van-der-waals")
    (points,) = layers(found, Points)
    disk, area = math.pi * 0.36, 600
    for k, state in enumerate(found.numbers["points"]):
        repeats = traces(run, k)
        relaxed = measure(repeats, pairs=pairs_of(repeats)).relaxed
        ratio = np.mean(relaxed.ideal_gas_ratio(repeats[0].start))
        excluded = (1 - 1 / ratio) * area / state["number"] / disk
        assert points.y[k] == pytest.approx(excluded, rel=1e-10)
        assert state["excluded_disks"] == points.y[k]
        assert points.x[k] == state["packing"]
        ratio = theory.compressibility(state["packing"])
        ratio -= theory.missing_ratio(state["packing"], state["number"])
        # Balls meet at a temperature without the motion of the centre of mass.
        ratio = 1 + (ratio - 1) * state["number"] / (state["number"] - 1)
        assert state["theory"] == pytest.approx(ratio, rel=1e-12)
    numbers = found.numbers
    assert abs(numbers["attraction"]) < 3 * numbers["attraction_error"]
    singles = [state["excluded_disks"] for state in numbers["points"]]
    assert 1.9 < singles[0] < 2.1
    # The b of these packings differ by far more than their errors.
    assert numbers["probability"] < 0.01
    assert "excluded_disks" not in numbers
    assert found.title.startswith("Van der Waals' b falls with the packing: ")
    assert "One b for all packings is refused (p <0.001)." in found.caption
    dilute = made(
        tmp_path / "dilute",
        *("cor=1", "repeats=4", "record=summary", "collisions=2000"),
        "balls.count=20,24,28",
        text=PERIODIC.partition("sweep")[0],
    )
    same = shown(dilute, "van-der-waals")
    assert same.numbers["probability"] > 0.01
    labels = [layer.label for layer in same.layers]
    assert f"b = {short(same.numbers['excluded_disks'])}, fitted to all" in labels
    # A law of one constant says nothing of two packings.
    two = shown(run, "van-der-waals", balls__count=(20, 120))
    assert "Fewer than 3 packings fit no b." in two.caption
    assert "excluded_disks" not in two.numbers
    assert re.search(r"b is between 1\.\d+ ± \d\.\d+ areas of a disk \(", two.caption)


def test_the_mean_pressure_of_one_point_has_its_error(decaying: RunFolder) -> None:
    found = shown(decaying, "pressure", cor=1.0)
    (record,), (band,) = found.numbers["points"], layers(found, Band)
    mean = next(line for line in layers(found, Line) if line.style == MEASURED and len(line.x))
    assert mean.y.tolist() == [record["over_ideal"]] * 2
    assert (band.high - band.low) / 2 == pytest.approx([record["over_ideal_error"]] * 2, rel=1e-9)


def test_pressure_in_windows(decaying: RunFolder) -> None:
    """Windows have equal numbers of collisions per ball; the mean is that of `compare`."""
    found = shown(decaying, "pressure")
    rows = comparisons(decaying).rows
    compared = [row for row in rows if row["quantity"] == "PV/NT" and row["model"] == FINITE]
    markers = [points for points in layers(found, Points) if len(points.x)]
    means = [layer for layer in found.panel if isinstance(layer, Line)]
    assert not layers(found, Band)  # means of several points are too close to each other
    flat = [line for line in layers(found, Line) if line.style == BY_THEORY and len(line.x)]
    assert "PV/NT over the time is " in found.caption
    assert "Of 3 deviations from theory" in found.caption  # those of the means
    for index, (record, row) in enumerate(zip(found.numbers["points"], compared, strict=True)):
        assert (record["over_ideal"], record["over_ideal_error"]) == (row["measured"], row["error"])
        assert record["theory"] == pytest.approx(row["predicted"], rel=1e-12)
        assert flat[index].y.tolist() == [record["theory"]] * 2
        mean = means[index]
        assert mean.y == pytest.approx(math.log(row["measured"] / row["predicted"]), rel=1e-9)
        scene, curve = traces(decaying, index)[0].start, measure(traces(decaying, index)).curve
        along = 2 * curve.pair_events / 19
        edges = np.linspace(0, np.median(along[:, -1]), 11)
        known = np.isfinite(markers[index].y)
        x, y = markers[index].x[known], markers[index].y[known]
        assert 0 < mean.x[0] < mean.x[1] == pytest.approx(edges[-1])  # after the relaxation
        assert x == pytest.approx((edges[1:] + edges[:-1])[: len(x)] / 2)
        of_repeats = []
        for trace in traces(decaying, index):
            columns = series(trace)
            pairs = 2 * columns.pair_events / 19
            moved = np.append(0.0, np.cumsum(columns.kinetic_energy[:-1] * np.diff(columns.time)))
            rows_of = np.searchsorted(pairs, [edges[0], edges[5]])
            force = np.diff(columns.wall_impulse[rows_of]) / scene.container.wall_length
            of_repeats.append(force * scene.container.area / np.diff(moved[rows_of]))
        # Over half of the repeat; a hit more or less at its end is some per cent.
        assert y[:5].mean() == pytest.approx(np.mean(of_repeats), rel=0.1)


def test_repeats_too_short_to_relax_count_as_a_whole(tmp_path: Path) -> None:
    run = made(tmp_path / "run", "collisions=60", "cor=1")
    found = shown(run, "pressure")
    (record,) = found.numbers["points"]
    repeats = traces(run, 0)
    whole = measure(repeats).whole.pressure(repeats[0].start)
    assert record["pressure"] == pytest.approx(whole.mean(), rel=1e-12)
    assert "The repeats are too short to relax; they count as a whole." in found.caption
