"""Pictures: their numbers and layers against direct computation on small runs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from galleries import ELASTIC, layers, made, shown, traces, why_not

from snooker_cli import containers, theory
from snooker_cli.analysis.decay import curve, fit_curve
from snooker_cli.analysis.fitting import fitted_curve, mean_over_repeats
from snooker_cli.engine import replay, series
from snooker_cli.figures import NEUTRAL, Band, Histogram, Line, Note, Points, Reference
from snooker_cli.formatting import exact, with_error
from snooker_cli.runs import Run
from snooker_cli.trace import SPEED_BIN, Trace

EPSILON = 2.0**-52


# Positions


def test_distances_from_the_centre(decaying: Run) -> None:
    found = shown(decaying, "central-distances", cor=0.8)
    largest = 0.0
    for trace in traces(decaying, 0):
        assert trace.events is not None
        states = replay(trace, np.append(0.0, trace.events.time))
        offsets = states.positions - states.container_positions[:, None]
        largest = max(largest, float(np.hypot(offsets[..., 0], offsets[..., 1]).max()))
    assert found.numbers["largest_distance"] == largest
    assert found.numbers["largest_excess"] == largest - 9.0
    assert exact(largest) in found.caption
    (histogram,) = layers(found, Histogram)
    assert np.sum(histogram.heights * np.diff(histogram.edges)) == pytest.approx(1, abs=1e-12)
    assert (histogram.edges[0], histogram.edges[-1]) == (0.0, 9.0)
    assert [reference.value for reference in layers(found, Reference)] == [9.0]


def test_distances_between_balls(decaying: Run) -> None:
    found = shown(decaying, "pair-distances", repeat=1, cor=1.0)
    trace = traces(decaying, 2)[1]
    assert trace.events is not None
    positions = replay(trace, np.append(0.0, trace.events.time)).positions
    first, second = np.triu_indices(trace.start.number, k=1)
    apart = positions[:, first] - positions[:, second]
    smallest = float(np.hypot(apart[..., 0], apart[..., 1]).min())
    assert found.numbers["smallest_distance"] == smallest
    assert found.numbers["largest_overlap"] == 2.0 - smallest
    # A position is rounded at each of the ball's flights, to half of the spacing at 10 m or less.
    assert smallest > 2 - 100 * 10 * EPSILON
    uniform = layers(found, Line)[0]
    area = np.sum((uniform.y[1:] + uniform.y[:-1]) / 2 * np.diff(uniform.x))
    assert area == pytest.approx(1, abs=1e-4)  # of a polygon of 200 sides under the density


# Conservation


def test_energy_is_that_of_the_series(decaying: Run) -> None:
    found = shown(decaying, "energy")
    for index, line in enumerate(layers(found, Line)):
        columns = series(traces(decaying, index)[0])
        total = columns.kinetic_energy + columns.container_energy
        assert line.y.tolist() == (total / total[0]).tolist()
        assert line.x.tolist() == columns.time.tolist()
    last = [point["final_ratio"] for point in found.numbers["points"]]
    assert last == [line.y[-1] for line in layers(found, Line)]
    assert [point["elastic"] for point in found.numbers["points"]] == [False, False, True]
    # Each energy is a sum over 19 balls, rounded at each.
    assert found.numbers["points"][2]["largest_deviation"] < 200 * 19 * EPSILON
    assert [line.label for line in layers(found, Line)] == ["CoR 0.8", "CoR 0.9", "CoR 1"]


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
    assert line.y.tolist() == (deviation / 1e-15).tolist()
    # A collision rounds two momenta of at most that of a ball with all of the energy.
    largest = math.sqrt(2 * trace.start.kinetic_energy)
    bound = 4 * EPSILON * largest * len(line.x) / abs(total[0, component])
    assert found.numbers["largest_deviation"] < bound


# Fits


@pytest.mark.parametrize(
    ("kind", "quantity", "symbol"),
    [
        ("energy-fit", "kinetic_energy", "k"),
        ("temperature-fit", "temperature", "k"),
        ("pressure-fit", "pressure", "κ"),
    ],
)
def test_fits_are_those_of_the_repeat_and_of_all(
    decaying: Run, kind: str, quantity: Any, symbol: str
) -> None:
    found = shown(decaying, kind, repeat=1, cor=0.8)
    curves = [curve(trace, quantity) for trace in traces(decaying, 0)]
    data, *laws = layers(found, Line)
    assert data.y.tolist() == curves[1].value.tolist()
    notes = [note.text for note in layers(found, Note)]
    law: Any
    for law, name, line in zip(("exponential", "haff"), ("k", "alpha"), laws, strict=True):
        results = [fit_curve(each, law) for each in curves]
        assert found.numbers[name] == results[1].value
        assert found.numbers[f"{name}_error"] == results[1].error
        over = mean_over_repeats(results)
        assert found.numbers[f"{name}_mean"] == over.mean
        assert found.numbers[f"{name}_standard_error"] == over.standard_error
        assert found.numbers[f"{name}_half_range"] == over.max_min_half_range
        assert line.y.tolist() == fitted_curve(results[1], line.x).tolist()
        sign = symbol if law == "exponential" else "α"
        printed = f"{sign} = {with_error(results[1].value, results[1].error, 's⁻¹')}"
        assert line.label is not None
        assert line.label.endswith(printed)
        averaged = with_error(over.mean, over.standard_error, "s⁻¹")
        assert f"mean of 3 repeats: {sign} = {averaged}" in notes
    assert ("κ is what the source report calls k/2" in notes) == (kind == "pressure-fit")


def test_fits_show_one_point_that_decays(decaying: Run) -> None:
    assert "choose one by cor" in why_not(decaying, "energy-fit")
    assert "nothing decays" in why_not(decaying, "temperature-fit", cor=1.0)


# Pressure


def test_pressure_rises_from_zero_and_ends_at_the_mean(decaying: Run) -> None:
    found = shown(decaying, "pressure", cor=1.0)
    curves = []
    for trace in traces(decaying, 2):
        columns = series(trace)
        time = columns.time[1:]
        curves.append((time, columns.wall_impulse[1:] / (20 * math.pi * time)))
    (line,) = layers(found, Line)
    assert (line.x[0], line.y[0]) == (0.0, 0.0)
    assert line.y[1:] == pytest.approx(curves[0][1], rel=1e-15)
    end = min(time[-1] for time, _ in curves)
    final = np.array([np.interp(end, *each) for each in curves])
    (point,) = found.numbers["points"]
    assert point["pressure"] == pytest.approx(final.mean(), rel=1e-14)
    assert point["pressure_error"] == pytest.approx(final.std(ddof=1) / math.sqrt(3), rel=1e-12)
    (band,) = layers(found, Band)
    assert band.x[-1] == end
    assert band.high[-1] - band.low[-1] == pytest.approx(2 * final.std(ddof=1), rel=1e-12)
    (reference,) = layers(found, Reference)
    assert reference.value == in_circle(50.0, 1.0)


def test_pressure_of_one_repeat_has_no_band(decaying: Run) -> None:
    found = shown(decaying, "pressure", repeat=2, cor=0.8)
    assert layers(found, Band) == []
    assert found.numbers["points"][0]["pressure_error"] is None
    assert layers(found, Reference) == []  # of an elastic gas alone


# The ideal gas


def in_circle(temperature: float, radius: float) -> float:
    """Pressure of 19 hard disks in the circle of 10 m, by theory."""
    circle = containers.Circle(10.0)
    return theory.fluid_state(19, temperature, radius, circle).pressure


def pressure_of(trace: Trace) -> float:
    assert trace.summary is not None
    columns = trace.summary.series
    return float(
        columns.wall_impulse[-1] / columns.time[-1] / (2 * math.pi * trace.start.container.radius)
    )


def test_pressure_against_temperature(warm: Run) -> None:
    found = shown(warm, "pressure-temperature")
    small, large = layers(found, Points)
    assert (small.label, large.label) == ("r = 0.2 m", "r = 1 m")
    assert small.x == pytest.approx([12.5, 50.0, 200.0], rel=1e-13)
    for series_number, each in enumerate((small, large)):
        for k in range(3):
            pressures = [pressure_of(trace) for trace in traces(warm, 3 * series_number + k)]
            assert each.y[k] == pytest.approx(np.mean(pressures), rel=1e-13)
            assert each.y_error is not None
            error = np.std(pressures, ddof=1) / math.sqrt(3)
            assert each.y_error[k] == pytest.approx(error, rel=1e-10)
    ideal = next(line for line in layers(found, Line) if line.label == "ideal gas")
    assert ideal.y == pytest.approx(19 * ideal.x / (100 * math.pi), rel=1e-14)
    curve_of_large = next(line for line in layers(found, Line) if line.series == 1)
    expected = [in_circle(each, 1.0) for each in curve_of_large.x]
    assert curve_of_large.y == pytest.approx(expected, rel=1e-12)
    point = found.numbers["points"][5]
    assert point["parameters"] == {"balls.radius": 1.0, "balls.speed": 20.0}
    assert point["over_ideal"] == pytest.approx(large.y[2] / (19 * 200 / (100 * math.pi)), rel=1e-9)


def test_temperature_ratio_against_the_ball_radius(warm: Run) -> None:
    found = shown(warm, "temperature-ratio", balls__speed=10.0)
    (points,) = layers(found, Points)
    assert points.x.tolist() == [0.2, 1.0]
    for k, index in enumerate((1, 4)):
        ratios = [50 / (pressure_of(trace) * 100 * math.pi / 19) for trace in traces(warm, index)]
        assert points.y[k] == pytest.approx(np.mean(ratios), rel=1e-13)
        expected = in_circle(50.0, points.x[k])
        theirs = found.numbers["points"][k]["theory"]
        assert theirs == pytest.approx(19 * 50 / (100 * math.pi) / expected, rel=1e-13)
    assert "one value of balls.speed" in why_not(warm, "temperature-ratio")


def test_pressure_against_area_and_number(tmp_path: Path) -> None:
    wide = made(tmp_path / "wide", *ELASTIC, "container.radius=10,20", "repeats=1")
    found = shown(wide, "pressure-area")
    (points,) = layers(found, Points)
    assert points.x == pytest.approx([100 * math.pi, 400 * math.pi], rel=1e-15)
    assert points.y.tolist() == pytest.approx([pressure_of(*traces(wide, k)) for k in (0, 1)])
    assert points.y_error is None
    assert (found.x_log, found.y_log) == (True, True)
    many = made(tmp_path / "many", *ELASTIC, "balls.rings=1,2,3", "repeats=1")
    found = shown(many, "pressure-number")
    assert layers(found, Points)[0].x.tolist() == [7, 19, 37]
    ideal = next(line for line in layers(found, Line) if line.label == "ideal gas")
    assert ideal.y == pytest.approx(ideal.x * 50 / (100 * math.pi), rel=1e-13)


def test_ideal_ratio_is_taken_at_two_temperatures(decaying: Run) -> None:
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
    assert np.all(at_end.x < at_mean.x)
    assert np.all(at_end.y > at_mean.y)


# Speeds


def test_speeds_in_metres_if_elastic(warm: Run) -> None:
    found = shown(warm, "speeds", balls__radius=1.0)
    assert found.x_label == "speed (m/s)"
    for histogram, speed in zip(layers(found, Histogram), (5.0, 10.0, 20.0), strict=True):
        widths = np.diff(histogram.edges)
        assert widths == pytest.approx(SPEED_BIN * speed, rel=1e-13)
        assert np.sum(histogram.heights * widths) == pytest.approx(1, abs=1e-12)
    maxwell, fixed = layers(found, Line)[:2]
    assert maxwell.y == pytest.approx(theory.maxwell_speed_density(maxwell.x, 12.5), rel=1e-12)
    assert fixed.y == pytest.approx(
        theory.fixed_energy_speed_density(fixed.x, 19, 12.5), rel=1e-9, abs=1e-15
    )
    assert {line.series for line in layers(found, Line)} == {NEUTRAL}


def test_speeds_are_reduced_if_not(decaying: Run) -> None:
    found = shown(decaying, "speeds")
    assert found.x_label.startswith("reduced speed")
    assert len(layers(found, Line)) == 2  # one of each law, for all points
    (counted_speeds, *_) = found.numbers["points"]
    assert counted_speeds["speeds"] % 19 == 0
