"""Figures of gases whose walls give energy."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from figure_runs import layers, shown, traces, why_not

from snooker_cli import theory
from snooker_cli.analysis.measurement import Measurement, measure
from snooker_cli.analysis.run_analysis import comparisons
from snooker_cli.analysis.stationarity import StationaryPart
from snooker_cli.engine import replay, series
from snooker_cli.figures import counted_parts
from snooker_cli.figures.figure_data import BY_THEORY, EXTRAPOLATED, Line, Points, Reference
from snooker_cli.figures.registry import FIGURES
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection

SIGMAS = 4
ALIKE = {"wall_temperature__right": 50.0}


def within(value: float, error: float, expected: float) -> bool:
    return abs(value - expected) < SIGMAS * error


def test_elastic_balls_between_equal_walls_have_their_temperature_everywhere(
    heated: RunFolder,
) -> None:
    found = shown(heated, "profiles", **ALIKE)
    (record,) = found.numbers["points"]
    assert within(*record_pair(record, "mean_temperature"), 50.0)
    # The slowest wave of the temperature has an amplitude of 50 √(2/40) = 11 J in one state, and a
    # repeat has some 5 independent ones: the walls differ by 2 J or so, with a heated wall by 40 J.
    for name in ("temperature", "across", "along"):
        column = np.array(record[name])
        assert abs(column.mean() - 50.0) < SIGMAS * 2.0, name
        assert abs(np.polyfit(record["place"], column, 1)[0]) * 19 < SIGMAS * 2.0, name
    # Strips of equal width hold all balls: (w - 2r) h times the mean density.
    assert np.mean(record["density"]) * 19 * 12 == pytest.approx(40, rel=1e-12)
    assert np.array(record["density"])[[0, -1]] == pytest.approx(record["density"][0], rel=0.1)
    walls = [points for points in layers(found, Points) if not points.filled]
    assert [points.x.tolist() for points in walls] == [[-10.0, 10.0]]


def record_pair(record: dict[str, float], name: str) -> tuple[float, float]:
    return record[name], record[f"{name}_error"]


def test_a_profile_counts_the_balls_of_each_ring(driven: RunFolder) -> None:
    """By the states themselves; rings of equal area up to R - r."""
    found = shown(driven, "profiles", cor=0.9, balls__radius=0.5)
    (record,), means = found.numbers["points"], []
    for trace in traces(driven, 1):
        times = np.linspace(trace.stop.time / 2, trace.stop.time, 33_333)
        radii = np.hypot(*np.moveaxis(replay(trace, times).positions, 2, 0))
        means.append(
            np.count_nonzero(radii < 9.5 * math.sqrt(0.5)) / len(times) / (45.125 * math.pi)
        )
    assert np.mean(record["density"][:10]) == pytest.approx(np.mean(means), rel=1e-3)
    assert np.mean(record["density"]) * 9.5**2 * math.pi == pytest.approx(40, rel=1e-12)
    (share,) = (panel for panel in found.panels if panel.label == "T along the radius / T")
    line = next(layer for layer in share.layers if isinstance(layer, Line))
    ratio = np.array(record["across"]) / record["temperature"]
    assert line.y == pytest.approx(ratio, rel=0.02)  # a mean of ratios, over two repeats
    # The wall drives the motion towards it; the middle is colder.
    assert record["last_temperature"] == pytest.approx(record["temperature"][-1], rel=1e-12)
    assert record["across"][-1] > 1.2 * record["along"][-1]
    assert record["temperature"][-1] > 1.2 * record["temperature"][0]


def test_heat_flows_from_the_hot_to_the_cold_wall(heated: RunFolder) -> None:
    figures = shown(heated, "heat-flux", wall_temperature__right=100.0)
    (record,) = figures.numbers["points"]
    flux = []
    share = 1 - int(re.search(r"the last (\d+) % of", figures.caption)[1]) / 100
    assert share < 0.5
    for trace in traces(heated, 1):
        assert trace.events is not None
        gains = np.diff(series(trace).kinetic_energy)
        late = trace.events.at_wall & (trace.events.time > share * trace.stop.time)
        x = replay(trace, trace.events.time[late]).positions[
            np.arange(np.count_nonzero(late)), trace.events.i[late], 0
        ]
        span = 12 * (1 - share) * trace.stop.time
        flux.append([gains[late][x < 0].sum() / span, -gains[late][x > 0].sum() / span])
    left, right = np.mean(flux, axis=0)
    assert record["left"] == pytest.approx(left, rel=1e-9)
    assert record["right"] == pytest.approx(right, rel=1e-9)
    assert max(left, right) < 0
    (mean,) = layers(figures, Reference)
    assert mean.value == pytest.approx((left + right) / 2, rel=1e-12)
    # Enskog's conductivity is good to some per cent.
    assert abs(record["over_enskog"] - 1) < SIGMAS * record["over_enskog_error"] + 0.05
    assert record["jump_0"] < 0 < record["jump_1"]


def test_the_balance_of_energy(driven: RunFolder) -> None:
    """What walls gave less what collisions took is the change of the energy."""
    found = shown(driven, "energy-balance", cor=0.9)
    lines = [line for line in layers(found, Line) if len(line.x)]
    assert len(lines) == 4
    markers = [layer for layer in found.panel if isinstance(layer, Points) and len(layer.x)]
    assert [points.filled for points in markers] == [True, False] * 2
    # Four repeats are too few for the test, so the second half counts.
    assert [len(points.x) for points in markers] == [10] * 4
    assert "while the gas changes" in [getattr(layer, "label", None) for layer in found.panel]
    rest = re.search(r"In − out equals the gain of the gas to \S+ × 10⁻¹¹ W", found.caption)
    assert rest is not None, found.caption
    for index, (given, taken) in enumerate(zip(lines[::2], lines[1::2], strict=True)):
        repeats = traces(driven, index)
        curve, width = measure(repeats).curve, given.x[1] - given.x[0]
        assert given.x[0] == pytest.approx(width / 2)
        edges = np.array([4.0, 5.0]) * width
        change = np.diff(curve.at(edges, curve.energy), axis=1).mean() / width
        assert given.y[4] - taken.y[4] == pytest.approx(change, abs=1e-9 * given.y[4])
        settled, changing = markers[2 * index : 2 * index + 2]
        assert changing.y[4] == pytest.approx(change / given.y[4], abs=1e-9)
        assert settled.x[0] > changing.x[-1]
    assert "last 50 % of each repeat (not confirmed for 2 points)" in found.caption
    for index, record in enumerate(found.numbers["points"]):
        losses = []
        for trace in traces(driven, index):
            events, half = trace.events, trace.stop.time / 2
            late = ~events.at_wall & (events.time > half)
            # A collision takes (1 - e)/(1 + e) J²/(2μ), with μ = 1/2.
            losses.append(0.1 / 1.9 * np.sum(events.impulse[late] ** 2) / half)
        assert record["taken_rate"] == pytest.approx(np.mean(losses), rel=1e-9)
        rest = record["given_rate"] - record["taken_rate"]
        assert record["rest_rate"] == pytest.approx(rest, abs=1e-9 * record["taken_rate"])


def test_temperature_and_pressure_in_the_steady_state(driven: RunFolder) -> None:
    warm, pressures = shown(driven, "stationary"), shown(driven, "equation-of-state")
    assert warm.x_label == "ball radius (m)"
    for index, (one, other) in enumerate(
        zip(warm.numbers["points"], pressures.numbers["points"], strict=True)
    ):
        point = driven.points[index]
        assert one["parameters"] == other["parameters"] == point.as_json()
        e, radius = point.config.cor, point.config.balls.radius
        packing = 40 * radius**2 / 100
        assert other["packing"] == pytest.approx(packing, rel=1e-12)
        expected = 1 + (1 + e) * packing * theory.contact_value(packing)
        assert other["theory"] == pytest.approx(expected, rel=1e-12)
        start = traces(driven, index)[0].start
        walls = [(start.wall_law, 2 * math.pi * (10 - radius))]
        expected_warm = theory.balance_temperature(40, radius, 1.0, e, start.container, walls)
        assert one["theory"] == pytest.approx(expected_warm, rel=1e-12)
        if packing < 0.01:  # the mean free path is 14 m; theory is the first order in 1 - e²
            assert one["temperature"] == pytest.approx(one["theory"], rel=1 - e**2)
        # Walls raise the density inside by some per cent; N balls meet N - 1.
        assert other["virial"] - 1 == pytest.approx(expected - 1, rel=0.15)
        state = theory.fluid_state(40, 1.0, radius, start.container).inelastic(e)
        assert other["theory_here"] == pytest.approx(state.virial_ratio, rel=1e-12)
        # By the virial theorem, but for what Σ m x·v changes over the time.
        at_wall, errors = other["virial"] * 10 / (10 - radius), 4 * other["wall_error"]
        assert other["wall"] == pytest.approx(at_wall, abs=errors)
    # Theory is a smooth curve through its values at the points.
    for index, curve in enumerate(layers(warm, Line)[:2]):
        rows = warm.numbers["points"][2 * index : 2 * index + 2]
        assert len(curve.x) > 50
        ends = [row["theory"] for row in rows]
        assert curve.y[[0, -1]].tolist() == pytest.approx(ends, rel=1e-12)
    # The figure has what collisions add over the packing, beside theory of these balls alone.
    marks, lines = layers(pressures, Points), layers(pressures, Line)
    of_large = layers(FIGURES["equation-of-state"].make(driven, Selection(), source=True), Line)
    assert [line.style for line in of_large[:4]] == [EXTRAPOLATED, BY_THEORY] * 2
    for points, line, cor in zip(marks, lines, (0.9, 0.95), strict=False):
        rows = [row for row in pressures.numbers["points"] if row["parameters"]["cor"] == cor]
        added = [(row["virial"] - 1) / row["packing"] for row in rows]
        assert points.y == pytest.approx(added, rel=1e-9)
        assert line.style == BY_THEORY
        theirs = (rows[-1]["theory_here"] - 1) / rows[-1]["packing"]
        assert line.y[-1] == pytest.approx(theirs, rel=1e-9)
    below = [layer for layer in pressures.panel if isinstance(layer, Points)]
    assert below[0].y[-1] == pytest.approx(np.log(marks[0].y[-1] / lines[0].y[-1]), rel=1e-9)


def test_results_of_warm_gases_are_those_of_compare(heated: RunFolder) -> None:
    """Of the same part of the same repeats."""
    for row in comparisons(heated).rows:
        where = {"wall_temperature__right": row["parameters"]["wall_temperature.right"]}
        found = shown(heated, "profiles", **where).numbers["points"][0]
        if row["quantity"] == "temperature":
            mean = found["mean_temperature"], found["mean_temperature_error"]
            assert mean == (row["measured"], row["error"])
            pressure = shown(heated, "pressure", **where).numbers["points"][0]
            assert (pressure["temperature"], pressure["temperature_error"]) == mean


def test_a_gas_that_still_changes_has_an_open_point_without_an_error(
    driven: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    def part(measurement: Measurement) -> StationaryPart:
        changes = measurement.scene.restitution == 0.95
        return StationaryPart(None if changes else 1, "", changes)

    monkeypatch.setattr(counted_parts, "stationary_part_of", part)
    found = FIGURES["stationary"].make(driven, Selection())
    settled, changing, entry = layers(found, Points)
    assert settled.filled
    assert len(settled.x) == 2
    assert not changing.filled
    assert changing.label == "CoR 0.95"
    assert (entry.filled, entry.label, len(entry.x)) == (False, "still changes", 0)
    assert changing.y_error is None
    for record in found.numbers["points"]:
        changes = record["parameters"]["cor"] == 0.95
        assert ("temperature_error" in record) != changes
        assert ("changing_temperature" in record) == changes
    assert "Open: the gas still changes" in found.caption
    residuals = [layer for layer in found.panel if isinstance(layer, Points)]
    assert [layer.series for layer in residuals] == [settled.series]
    assert "2 of 4 points have no such value" in found.caption


def test_figures_of_other_gases_say_why(
    driven: RunFolder, heated: RunFolder, decaying: RunFolder
) -> None:
    for name in ("energy-fit", "cooling", "decay-against-cor", "gas-law"):
        assert "walls give energy" in why_not(driven, name)
    assert "it is about walls that give energy" in why_not(decaying, "stationary")
    assert "a box or a channel" in why_not(driven, "heat-flux", cor=0.9, balls__radius=0.1)
    assert "wall_temperature or balls.count" in why_not(heated, "stationary")
