"""Fits, decay constants, local rates and energies, beside the laws."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from figure_runs import ROUGH, around, layers, made, shown, traces, why_not

from snooker_cli import theory
from snooker_cli.analysis import gas
from snooker_cli.analysis.decay import course, decays
from snooker_cli.analysis.fitting import LAWS, fitted_curve
from snooker_cli.analysis.measurement import measure
from snooker_cli.engine import series
from snooker_cli.figures.figure_builder import LOG_SPREAD
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    EXTRAPOLATED,
    Band,
    Line,
    Points,
    Reference,
    courses,
)
from snooker_cli.figures.registry import FIGURES
from snooker_cli.formatting import with_error
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection
from snooker_cli.trace import Trace


def floor_of(trace: Trace) -> float:
    """Energy of a rigid rotation in the end over that at the start, for balls of 1 kg."""
    x, v = trace.start.positions, trace.start.velocities
    turning = float(np.sum(x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]))
    inertia = float(np.sum((trace.finish.positions - trace.finish.container_position) ** 2))
    return turning**2 / (2 * inertia) / (0.5 * float(np.sum(v**2)))


@pytest.mark.parametrize(
    ("name", "quantity", "symbol"),
    [
        ("energy-fit", "kinetic_energy", "k"),
        ("temperature-fit", "temperature", "k"),
        ("pressure-fit", "pressure", "κ"),
    ],
)
def test_fits_are_those_of_the_repeat_and_of_all(
    decaying: RunFolder, name: str, quantity: str, symbol: str
) -> None:
    found = shown(decaying, name, repeat=1, cor=0.8)
    falling = course(measure(traces(decaying, 0)), quantity)
    pairs = [
        (time[time >= begin], value[time >= begin])
        for (time, value), begin in zip(
            courses(falling.time, falling.value), falling.origin, strict=True
        )
    ]
    data, *lines = layers(found, Line)
    assert data.y.tolist() == pairs[1][1].tolist()
    judged = decays(traces(decaying, 0), [quantity])
    for decay, line in zip(judged, lines, strict=True):
        law, results, over = decay.law, decay.fits, decay.over_repeats
        model = LAWS[law]
        (row,) = (row for row in found.numbers["fits"] if row["model"] == law)
        assert row == decay.as_json()
        assert (row["value"], row["error"], row["repeats"]) == (over.value, over.error, 3)
        assert found.numbers[model.key] == over.value
        assert found.numbers[f"repeat_{model.key}"] == results[1].value
        logs = np.log([fitted_curve(result, line.x) for result in results])
        assert line.y == pytest.approx(np.exp(logs.mean(axis=0)), rel=1e-12)
        sign = symbol if law == "exponential" else model.symbol
        averaged = with_error(over.value, over.error, "s⁻¹")
        assert line.label == f"{model.label}, mean of 3 repeats: {sign} = {averaged}"
    (band,) = layers(found, Band)
    values = np.concatenate([row for _, row in pairs])
    assert found.y_log
    assert band.label == f"all 3 repeats, {LOG_SPREAD}"
    # The axis ends below the data: a fit may fall by many more decades.
    least = values.min() / 10
    falls = min(line.y.min() for line in lines) < least
    assert found.y_limits == (pytest.approx(least) if falls else None, None)
    around(band, pairs, True)


def test_alpha_against_cor_is_over_the_share_of_energy_that_is_lost(decaying: RunFolder) -> None:
    found = shown(decaying, "decay-against-cor")
    (points,) = layers(found, Points)
    assert points.x.tolist() == [0.8, 0.9]
    lost = 1 - points.x**2
    for index in (0, 1):
        fitted = decays(traces(decaying, index), ["kinetic_energy"])
        (over,) = (decay.over_repeats for decay in fitted if decay.law == "haff")
        assert points.y[index] == pytest.approx(over.value / lost[index], rel=1e-13)
        assert points.y_error[index] == pytest.approx(over.error / lost[index], rel=1e-13)
    (kinetic_theory,) = layers(found, Line)
    assert len(kinetic_theory.x) == 100
    expected = gas.finite_haff_rate(traces(decaying, 1)[0].start)
    assert kinetic_theory.y[-1] == pytest.approx(expected / lost[1], rel=1e-12)
    assert "hard disks, finite N" in kinetic_theory.label
    _, residuals = found.panel
    assert isinstance(residuals, Points)
    ratio = points.y[-1] * lost[1] / expected
    assert residuals.y[-1] == pytest.approx(math.log(ratio), rel=1e-9)
    assert residuals.y_error[-1] == pytest.approx(points.y_error[-1] / points.y[-1], rel=1e-12)


def test_the_title_says_how_far_alpha_is_from_theory(decaying: RunFolder, tmp_path: Path) -> None:
    """Where it differs by most errors. Balls from rings collide less often at first."""
    assert (
        shown(decaying, "decay-against-cor").title == "Haff's α against the CoR: agrees with theory"
    )
    run = made(tmp_path / "run", "cor=0.8,0.95", "repeats=40", "balls.radius=1.5")
    found = shown(run, "decay-against-cor")
    _, residuals = found.panel
    assert isinstance(residuals, Points)
    assert residuals.y_error is not None
    of_alpha = np.abs(np.expm1(residuals.y)) / np.exp(residuals.y) / residuals.y_error
    worst = int(np.argmax(of_alpha))
    share, side = (
        100 * math.expm1(residuals.y[worst]),
        "above" if residuals.y[worst] > 0 else "below",
    )
    stated = re.search(r": (.*) % (above|below) theory at CoR (.*)$", found.title)
    assert stated is not None
    assert float(stated[1]) == pytest.approx(abs(share), rel=0.05)
    assert f"{stated[2]} theory at CoR {stated[3]}" in found.caption
    assert (stated[2], float(stated[3])) == (side, residuals.x[worst])


def test_points_of_repeats_that_ended_early_are_open(tmp_path: Path) -> None:
    """Wall traps end some repeats at CoR 0.8; at 0.95 all are complete."""
    run = made(tmp_path / "run", "cor=0.8,0.95", "wall_cor=null", "balls.radius=0.01", "repeats=12")
    found = shown(run, "decay-against-cor")
    early = [row["ended_early"] > 0 for row in found.numbers["points"]]
    assert early == [True, False]
    markers = {points.filled: points for points in layers(found, Points) if len(points.x)}
    assert (markers[False].x.tolist(), markers[True].x.tolist()) == ([0.8], [0.95])
    below = {
        points.filled: points.x.tolist() for points in found.panel if isinstance(points, Points)
    }
    assert below == {False: [0.8], True: [0.95]}
    assert "with repeats that ended early" in [layer.label for layer in layers(found, Points)]


def test_walls_that_lose_otherwise_leave_alpha_as_it_is(tmp_path: Path) -> None:
    """At CoR 1 the share of energy that collisions of balls lose is zero."""
    run = made(tmp_path / "run", "cor=0.9,1.0", "wall_cor=0.8")
    found = shown(run, "decay-against-cor")
    (points,) = layers(found, Points)
    assert found.y_label == "decay constant (s⁻¹)"
    assert points.y.tolist() == [row["alpha"] for row in found.numbers["points"]]
    assert points.x.tolist() == [0.9, 1.0]


def test_the_reproduction_has_the_rates_and_the_constants_of_its_text(decaying: RunFolder) -> None:
    found = FIGURES["decay-against-cor"].make(decaying, Selection(), source=True)
    density, contact = 19 / (100 * math.pi), float(theory.contact_value(0.19))
    rate = theory.ball_ball_rate(density, 1.0, 50.0, contact)
    expected = theory.haff_rate(theory.cooling_rate(0.9, rate))  # the wall is elastic
    (line,) = [line for line in layers(found, Line) if line.label == "α, Enskog rates at the start"]
    assert line.y[-1] == pytest.approx(expected, rel=1e-12)
    alpha, k = layers(found, Points)
    records = found.numbers["points"]
    assert k.y.tolist() == [row["k"] for row in records]
    assert alpha.y.tolist() == [row["alpha"] for row in records]


def test_haffs_law_is_a_line_for_the_slowdown(decaying: RunFolder) -> None:
    """√(E(0)/E) − 1 is αt by the law, and has a mean over the repeats that remain."""
    found = shown(decaying, "cooling", cor=0.8)
    (record,) = found.numbers["points"]
    drawn = layers(found, Line)
    by_style = {line.style: line for line in drawn if not line.thin}
    mean, fitted, expected = (by_style[name] for name in ("solid", "dotted", "dashed"))
    alpha, of_theory = record["alpha"], record["theory_alpha"]
    assert fitted.y == pytest.approx(alpha * fitted.x, rel=1e-9)
    assert expected.y == pytest.approx(of_theory * expected.x, rel=1e-9)
    assert of_theory == pytest.approx(gas.finite_haff_rate(traces(decaying, 0)[0].start), rel=1e-12)
    falling = course(measure(traces(decaying, 0)), "kinetic_energy")
    curves = courses(falling.time, falling.value)
    rows = [np.interp(mean.x, *curve, right=math.nan) ** -0.5 - 1 for curve in curves]
    assert mean.y == pytest.approx(np.nanmean(rows, axis=0), rel=1e-12)
    assert (found.x_log, found.y_log) == (True, True)
    assert found.y_limits[0] == pytest.approx(0.005)  # half of αt where the curves begin
    assert "α = " in found.caption
    assert "theory for hard disks, finite N (" in found.caption


def test_local_rates_have_windows_with_as_many_collisions_by_haffs_law(decaying: RunFolder) -> None:
    found = shown(decaying, "cooling", cor=0.8)
    (record,) = found.numbers["points"]
    (rates,) = found.panels
    assert (rates.label, rates.log) == ("−d ln E/dt (s⁻¹)", True)
    (points,) = (layer for layer in rates.layers if isinstance(layer, Points))
    repeats = traces(decaying, 0)
    ends = np.array([trace.stop.time for trace in repeats])
    alpha, haff = record["alpha"], record["theory_alpha"]
    edges = np.expm1(np.linspace(0.0, np.log1p(alpha * np.median(ends)), 15)) / alpha
    assert len(points.x) == record["windows"] == 14
    curve = measure(repeats).curve
    for window in (0, 13):
        here = edges[window : window + 2]
        # A marker is where Haff's law has the mean that it has over the window.
        mean = 2 * np.ptp(np.log1p(haff * here)) / np.ptp(here)
        assert points.x[window] == pytest.approx(2 / mean - 1 / haff, rel=1e-9)
        there = [row for row, end in enumerate(ends) if end >= here[1] * (1 - 1e-12)]
        energies = [np.interp(here, curve.time[row], curve.energy[row]) for row in there]
        before, after = np.mean(energies, axis=0)
        expected = math.log(before / after) / np.ptp(here)
        assert points.y[window] == pytest.approx(expected, rel=1e-6)
    of_law = {layer.style: layer for layer in rates.layers if isinstance(layer, Line)}
    fitted, floored = of_law["dotted"], of_law["dashdot"]
    residual = next(
        layer for layer in found.panel if isinstance(layer, Line) and layer.style == "dotted"
    )
    law = of_law["dashed"]
    assert residual.y == pytest.approx(np.log(fitted.y / law.y), rel=1e-9, abs=1e-12)
    assert fitted.y == pytest.approx(2 * alpha / (1 + alpha * fitted.x), rel=1e-12)
    assert "L keeps the energy L²/2I of a rotation" in found.caption
    floor = np.mean([floor_of(trace) for trace in repeats])
    assert record["floor"] == pytest.approx(floor, rel=1e-12)
    # The rate is the slope of the logarithm of the law.
    time, step = floored.x[100], 1e-5 * floored.x[100]

    def logarithm(at: float) -> float:
        return math.log(floor + (1 - floor) / (1 + haff * at) ** 2)

    slope = (logarithm(time - step) - logarithm(time + step)) / (2 * step)
    assert floored.y[100] == pytest.approx(slope, rel=1e-6)


def test_haffs_laws_of_several_points_are_one_curve(decaying: RunFolder) -> None:
    found = shown(decaying, "cooling")
    law = next(line for line in layers(found, Line) if len(line.x) and line.style == BY_THEORY)
    assert law.y.tolist() == law.x.tolist()
    assert not any(line.style == EXTRAPOLATED for line in layers(found, Line))
    (rates,) = found.panels
    of_rate = next(layer for layer in rates.layers if getattr(layer, "style", "") == "dashed")
    assert isinstance(of_rate, Line)
    assert of_rate.y == pytest.approx(1 / (1 + of_rate.x), rel=1e-13)
    below = [layer for layer in found.panel if isinstance(layer, Points)]
    points = [layer for layer in rates.layers if isinstance(layer, Points)]
    for index, (several, record) in enumerate(zip(points, found.numbers["points"], strict=True)):
        alpha = record["theory_alpha"]
        alone = shown(decaying, "cooling", cor=record["parameters"]["cor"])
        (in_seconds,) = (p for p in alone.panels[0].layers if isinstance(p, Points))
        assert several.x == pytest.approx(in_seconds.x * alpha, rel=1e-13)
        assert several.y == pytest.approx(in_seconds.y / (2 * alpha), rel=1e-13)
        assert several.y_error == pytest.approx(in_seconds.y_error / (2 * alpha), rel=1e-13)
        (residuals,) = (layer for layer in alone.panel if isinstance(layer, Points))
        assert below[index].y == pytest.approx(residuals.y, rel=1e-12)


def test_the_reproduction_has_windows_of_one_length_in_which_all_repeats_are(
    decaying: RunFolder,
) -> None:
    found = FIGURES["cooling"].make(decaying, Selection({"cor": 0.8}), source=True)
    (points,) = (layer for layer in found.panels[0].layers if isinstance(layer, Points))
    width = min(trace.stop.time for trace in traces(decaying, 0)) / 14
    curve = measure(traces(decaying, 0)).curve
    energies = [
        np.interp([0.0, width], *course)
        for course in zip(curve.time, curve.kinetic_energy, strict=True)
    ]
    before, after = np.mean(energies, axis=0)
    assert points.y[0] == pytest.approx(math.log(before / after) / width, rel=1e-6)


def test_the_time_at_which_haffs_law_is_refused_is_marked(tmp_path: Path) -> None:
    """Of one point; the rotation keeps energy that the law does not know."""
    run = made(tmp_path / "run", "cor=0.6", "collisions=900", "repeats=12")
    found = shown(run, "cooling")
    (mark,) = layers(found, Reference)
    (row,) = (
        fit.goodness for fit in decays(traces(run, 0), ["kinetic_energy"]) if fit.law == "haff"
    )
    assert (mark.axis, mark.value, mark.label) == ("x", row.holds_to, "Haff's law is refused")
    assert "Haff's law is refused after" in found.caption


def test_no_rate_is_claimed_from_few_collisions(decaying: RunFolder, tmp_path: Path) -> None:
    few = made(tmp_path / "run", "cor=0.8", "collisions=12", "repeats=2")
    assert "fewer than 10 collisions" in why_not(few, "cooling")
    alone = shown(decaying, "cooling", repeat=0, cor=0.8)
    (points,) = (layer for layer in alone.panels[0].layers if isinstance(layer, Points))
    trace, alpha = traces(decaying, 0)[0], alone.numbers["points"][0]["alpha"]
    edges = np.expm1(np.linspace(0.0, np.log1p(alpha * trace.stop.time), 15)) / alpha
    counts = np.histogram(series(trace).time[1:], edges)[0]
    assert abs(len(points.x) - np.count_nonzero(counts >= 10)) <= 1
    assert len(points.x) < 14
    assert "Windows with fewer than 10 collisions are left out" in alone.caption


def test_energy_against_collisions(decaying: RunFolder) -> None:
    found = shown(decaying, "event-decay", cor=0.9)
    (points,) = layers(found, Points)
    assert (points.x[0], points.y[0]) == (0.0, 1.0)
    pairs = np.array([trace.pair_events for trace in traces(decaying, 1)])
    assert points.x[-1] == pytest.approx(2 * pairs.mean() / 19, rel=1e-12)
    finals = []
    for trace in traces(decaying, 1):
        columns = series(trace)
        finals.append(columns.kinetic_energy[200] / columns.kinetic_energy[0])
    # The container has its share of the energy too, of the order of its mass to a ball's.
    assert points.y[-1] == pytest.approx(np.mean(finals), rel=1e-5)
    line = layers(found, Line)[0]
    expected = np.mean((1 - (1 - 0.9**2) / 19.5) ** pairs)
    assert line.y[-1] == pytest.approx(expected, rel=1e-12)
    (record,) = found.numbers["points"]
    floors = np.array([floor_of(trace) for trace in traces(decaying, 1)])
    # The rotation counts for theory also where its energy is too small to be drawn.
    above = np.mean(floors + (1 - floors) * (1 - (1 - 0.9**2) / 19) ** pairs)
    assert record["theory_above_floor"] == pytest.approx(above, rel=1e-12)
    assert record["floor"] < 0.1 * record["final_ratio"]
    _, residuals = found.panel
    assert isinstance(residuals, Points)
    assert residuals.y[-1] == pytest.approx(math.log(points.y[-1] / above), rel=1e-9)
    assert residuals.x.tolist() == points.x[1:].tolist()


def test_a_theory_of_the_energy_ends_where_it_is_far_off(tmp_path: Path) -> None:
    """The residuals too. Balls in a circle keep a rotation that collisions cannot take."""
    run = made(tmp_path / "run", "cor=0.5", "collisions=1500", "repeats=4")
    found = shown(run, "event-decay")
    (points,) = layers(found, Points)
    line = next(line for line in layers(found, Line) if line.style == BY_THEORY and len(line.x))
    assert len(line.x) < len(points.x)
    assert np.all(points.y[: len(line.x)] < 100 * line.y)
    (record,) = found.numbers["points"]
    assert record["theory"] is None
    assert "ends where the energy is 100 times as large" in found.caption


def test_energy_of_rough_balls_beside_the_mean_field(tmp_path: Path) -> None:
    found = shown(made(tmp_path / "run", text=ROUGH), "event-decay")
    (points,) = layers(found, Points)
    line, _ = layers(found, Line)
    assert line.y[0] == pytest.approx(1.0, rel=1e-12)
    assert found.layers[-1].label == "theory, mean field"
    # The gas is dilute: in ten errors or a tenth they agree at all numbers of collisions.
    assert np.all(np.abs(points.y / line.y - 1) < np.maximum(0.1, 10 * points.y_error / points.y))
