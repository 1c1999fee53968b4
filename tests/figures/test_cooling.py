"""Fits, decay constants, local rates and energies, beside the laws."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import around, layers, made, shown, traces, why_not

from snooker_cli import theory
from snooker_cli.analysis import gas
from snooker_cli.analysis.decay import course, decays
from snooker_cli.analysis.fitting import LAWS, fitted_curve
from snooker_cli.analysis.measurement import measure
from snooker_cli.engine import series
from snooker_cli.figures import FIGURES, Line, Points, Selection
from snooker_cli.figures.captions import LOG_SPREAD
from snooker_cli.figures.figure_data import Band, courses
from snooker_cli.formatting import with_error
from snooker_cli.runs import Run
from snooker_cli.trace import Trace

"""Three balls in a line, which collapse below CoR 0.0718."""


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
    decaying: Run, name: str, quantity: str, symbol: str
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


def test_decay_against_cor(decaying: Run) -> None:
    found = shown(decaying, "decay-against-cor")
    k, alpha, *_ = layers(found, Points)
    assert k.x.tolist() == [0.8, 0.9]
    for points, law in ((k, "exponential"), (alpha, "haff")):
        for index in (0, 1):
            fitted = decays(traces(decaying, index), ["kinetic_energy"])
            (over,) = (decay.over_repeats for decay in fitted if decay.law == law)
            assert (points.y[index], points.y_error[index]) == (over.value, over.error)
    (kinetic_theory,) = layers(found, Line)
    expected = gas.finite_haff_rate(traces(decaying, 1)[0].start)
    assert kinetic_theory.y[-1] == pytest.approx(expected, rel=1e-12)
    assert "hard disks, finite N" in kinetic_theory.label
    _, residuals = found.panel
    assert isinstance(residuals, Points)
    assert residuals.y[-1] == pytest.approx(math.log(alpha.y[-1] / expected), rel=1e-9)
    assert residuals.y_error[-1] == pytest.approx(alpha.y_error[-1] / alpha.y[-1], rel=1e-12)


def test_the_reproduction_has_the_enskog_rates_of_its_text(decaying: Run) -> None:
    found = FIGURES["decay-against-cor"].make(decaying, Selection(), source=True)
    density, contact = 19 / (100 * math.pi), float(theory.contact_value(0.19))
    rate = theory.ball_ball_rate(density, 1.0, 50.0, contact)
    expected = theory.haff_rate(theory.cooling_rate(0.9, rate))  # the wall is elastic
    (line,) = [line for line in layers(found, Line) if line.label == "α, Enskog rates at the start"]
    assert line.y[-1] == pytest.approx(expected, rel=1e-12)


def test_local_rates_and_the_forms_of_haffs_law(decaying: Run) -> None:
    found = shown(decaying, "haff-time", cor=0.8)
    (points,) = layers(found, Points)
    end = min(trace.stop.time for trace in traces(decaying, 0))
    # A marker is where Haff's law has the mean that it has over the window.
    width, haff = end / 14, found.numbers["points"][0]["theory_alpha"]
    for window, x in ((0, points.x[0]), (13, points.x[-1])):
        edges = np.array([window, window + 1]) * width
        mean = 2 * np.ptp(np.log1p(haff * edges)) / width
        assert x == pytest.approx(2 / mean - 1 / haff, rel=1e-9)
        assert edges[0] < x < edges.mean()
    edges = [0.0, end / 14]
    curve = measure(traces(decaying, 0)).curve
    energies = [
        np.interp(edges, *course) for course in zip(curve.time, curve.kinetic_energy, strict=True)
    ]
    before, after = np.mean(energies, axis=0)
    assert points.y[0] == pytest.approx(math.log(before / after) / (end / 14), rel=1e-6)
    (record,) = found.numbers["points"]
    fitted, of_theory, floored, constant = (
        next(line for line in layers(found, Line) if len(line.x) and line.style == style)
        for style in ("solid", "dashed", "dashdot", "dotted")
    )
    assert "L keeps the energy L²/2I of a rotation" in found.caption
    alpha = record["alpha"]
    assert fitted.y[0] == 2 * alpha
    assert fitted.y[-1] == pytest.approx(2 * alpha / (1 + alpha * fitted.x[-1]))
    assert constant.y.tolist() == [record["k"]] * 2
    alpha = gas.finite_haff_rate(traces(decaying, 0)[0].start)
    assert of_theory.y[0] == pytest.approx(2 * alpha, rel=1e-12)
    floor = np.mean([floor_of(trace) for trace in traces(decaying, 0)])
    assert record["floor"] == pytest.approx(floor, rel=1e-12)
    # The rate is the slope of the logarithm of the law.
    time, step = floored.x[100], 1e-5

    def logarithm(at: float) -> float:
        return math.log(floor + (1 - floor) / (1 + alpha * at) ** 2)

    slope = (logarithm(time - step) - logarithm(time + step)) / (2 * step)
    assert floored.y[100] == pytest.approx(slope, rel=1e-7)


def test_haffs_laws_of_several_points_are_one_curve(decaying: Run) -> None:
    found = shown(decaying, "haff-time")
    law = next(line for line in layers(found, Line) if len(line.x) and line.style == "solid")
    assert law.y == pytest.approx(1 / (1 + law.x), rel=1e-13)
    assert not any(line.style in ("dashed", "dotted") for line in layers(found, Line))
    below = [layer for layer in found.panel if isinstance(layer, Points)]
    for index, points in enumerate(layers(found, Points)):
        record = found.numbers["points"][index]
        alpha = record["theory_alpha"]
        alone = shown(decaying, "haff-time", cor=record["parameters"]["cor"])
        (in_seconds,) = layers(alone, Points)
        assert points.x == pytest.approx(in_seconds.x * alpha, rel=1e-13)
        assert points.y == pytest.approx(in_seconds.y / (2 * alpha), rel=1e-13)
        assert points.y_error == pytest.approx(in_seconds.y_error / (2 * alpha), rel=1e-13)
        # Over a window the law takes ln E by the difference of 2 ln(1 + αt).
        width = min(trace.stop.time for trace in traces(decaying, index)) / 14
        mean = 2 * math.log1p(alpha * width) / width
        assert below[index].y[0] == pytest.approx(math.log(in_seconds.y[0] / mean), rel=1e-9)
        (residuals,) = (layer for layer in alone.panel if isinstance(layer, Points))
        assert below[index].y == pytest.approx(residuals.y, rel=1e-12)


def test_no_rate_is_claimed_from_few_collisions(decaying: Run, tmp_path: Path) -> None:
    few = made(tmp_path / "run", "cor=0.8", "collisions=12", "repeats=2")
    assert "fewer than 10 collisions" in why_not(few, "haff-time")
    alone = shown(decaying, "haff-time", repeat=0, cor=0.8)
    (points,) = layers(alone, Points)
    trace = traces(decaying, 0)[0]
    counts = np.histogram(series(trace).time[1:], 14, (0.0, trace.stop.time))[0]
    assert len(points.x) == np.count_nonzero(counts >= 10) < 14
    assert "Windows with fewer than 10 collisions are left out" in alone.caption


def test_energy_against_collisions(decaying: Run) -> None:
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
