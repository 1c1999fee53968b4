"""Axes that reach as far as the data, and arrows at what is outside."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from figure_runs import made, shown

from snooker_cli.figures.axis_limits import beginning_of_decades, outside, reach, visible
from snooker_cli.figures.drawing import draw
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Array,
    Band,
    FigureData,
    Layer,
    Line,
    Points,
    Reference,
)
from snooker_cli.figures.registry import FIGURES
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection


def markers(y: Array, error: Array | None = None) -> Points:
    return Points(np.arange(1.0, len(y) + 1), y, error, "simulation")


def data(*layers: Layer, y_log: bool = False, panel: tuple[Layer, ...] = ()) -> FigureData:
    return FigureData("x", "title", "x (m)", "y (J)", layers, "", y_log=y_log, panel=panel)


def test_error_bars_to_zero_and_a_falling_theory_leave_room_for_the_data() -> None:
    """A logarithmic axis had twenty decades for a bar that reaches zero, or for Maxwell's law."""
    y = np.array([1.0, 0.1, 0.01])
    falls = Line(np.array([1.0, 3.0]), np.array([1.0, 1e-30]), "law", NEUTRAL, "dashed")
    figure = draw(data(falls, markers(y, np.array([0.1, 0.05, 0.02])), y_log=True))
    low, high = figure.axes[0].get_ylim()
    assert 0.01 / 12 <= low < 0.01 < 1.1 < high < 2
    (arrows,) = outside((markers(y, np.array([0.1, 0.05, 0.02])),), low, high)
    assert (arrows.x.tolist(), arrows.above) == ([3.0], False)


def test_a_bar_below_the_least_possible_value_needs_no_arrow() -> None:
    """A density is not below zero, though half of an interval around a small one is longer."""
    within, below = markers(np.ones(1), np.array([2.0])), markers(-np.ones(1), np.ones(1))
    assert [*outside((within,), 0.0, 4.0)]
    assert not [*outside((within,), 0.0, 4.0, least=0.0)]
    assert [*outside((below,), 0.0, 4.0, least=0.0)]


def test_a_bar_of_many_spans_does_not_flatten_a_panel() -> None:
    y, error = np.array([0.1, -0.1, 0.0, 0.05]), np.array([0.1, 0.1, 0.1, 5e3])
    figure = draw(data(markers(y), panel=(markers(y, error),)))
    low, high = figure.axes[1].get_ylim()
    assert low == pytest.approx(-0.5)  # twice the span of 0.2 below the least
    assert high == pytest.approx(0.5)
    drawn = [line for line in figure.axes[1].lines if "arrow" in str(line.get_marker())]
    assert sorted(line.get_ydata()[0] for line in drawn) == [low, high]
    usual = np.array([3.0, 3.0, 3.0, 3.0])  # bars of one length are whole
    assert reach([markers(y, usual)], False) == pytest.approx((-6.1, 6.1))
    assert reach([markers(np.zeros(2))], False) == (-math.inf, math.inf)


def test_residuals_are_logarithms_of_ratios(decaying: RunFolder) -> None:
    """5 × 10³⁰ % were drawn; a factor is a factor, up or down, and small ones are shares."""
    (point, *_), fields = decaying.points, {"kind": "x", "title": "x", "x_label": "x (m)"}
    labels = {**fields, "y_label": "y (J)"}
    build = FigureBuilder(decaying, Selection(), [[point]], labels)
    x, theory = np.arange(1.0, 4.0), np.array([1.0, 1e-32, 1.0])
    build.add_residuals(0, x, np.array([1.01, 2e-1, -1.0]), np.array([1e-2, 1e-3, 1.0]), theory)
    (below,) = build.panel
    assert isinstance(below, Points)
    assert below.y == pytest.approx([math.log(1.01), math.log(2e31)])
    assert below.y_error == pytest.approx([1 / 101, 1 / 200])
    figure = build.figure()
    assert figure.panel_label == "ln(result / theory)"
    assert "is a factor of (2.000 ± 0.010) × 10³¹ (200.0 errors, x 2 m)." in figure.caption
    assert figure.title == "x: CoR 0.8, up to 2 × 10³¹ times theory"


def test_markers_of_many_decades_are_no_part_of_the_axis() -> None:
    low, high = reach([Points(np.arange(3.0), np.array([1e-14, 1e-7, 1.0]))], logarithmic=True)
    assert low < 0.5e-14
    assert high > 2.0


def test_values_above_the_axis_are_named(decaying: RunFolder) -> None:
    """The first hits give a mean pressure that is many times the settled one."""
    found = shown(decaying, "pressure-since-start")
    top = max(float(np.nanmax(line.y)) for line in found.layers if isinstance(line, Line))
    limit = found.y_limits[1]
    assert limit is not None
    assert top > limit
    assert f"Arrows: the axis ends below the highest values, up to {top:.3g} Pa·m." in found.caption
    (axes,) = draw(found).axes
    arrows = [line for line in axes.lines if re.search("uparrow", str(line.get_marker()))]
    assert [line.get_ydata()[0] for line in arrows] == pytest.approx([limit] * len(arrows))
    assert arrows


def test_an_axis_fits_what_its_x_axis_shows() -> None:
    """Arrows mark no markers left of it."""
    x, y = np.array([1e-6, 1e-5, 1.0, 10.0, 100.0]), np.array([1e-9, 1e-6, 1.0, 10.0, 200.0])
    points = Points(x, y, np.full(5, 0.1))
    band, line = Band(x, y / 2, y * 2), Line(x, y, None)
    shown = [*visible([points, band, line, Reference("y", 3.0)], 0.5, 200.0)]
    assert [getattr(layer, "x", x[2:]).tolist() for layer in shown] == [[1.0, 10.0, 100.0]] * 4
    axes = draw(replace(data(line, y_log=True), x_log=True, x_limits=(0.5, None))).axes[0]
    assert 0.05 < axes.get_ylim()[0] < 1.0
    assert len(axes.lines) == 1


X = np.geomspace(1e-3, 1e3, 200)


@pytest.mark.parametrize(
    ("layer", "begins"),
    [
        (Line(X, (1 + X) ** -2.0, "Haff's law"), 0.005),  # it has lost 1 % there
        (Line(X, 1 / (1 + X / 200), "less than two decades of y"), None),
        (Line(X, np.exp(-X / 300) - 0.5, "negative"), None),
        (Points(X[::20], X[::20] ** 2), 1e-3),
        (Points(np.array([1.0, 2.0, 90.0]), np.array([1.0, 2.0, 900.0])), None),
    ],
)
def test_two_axes_are_logarithmic_if_both_span_decades(
    layer: Line | Points, begins: float | None
) -> None:
    found = beginning_of_decades([layer])
    assert found == (None if begins is None else pytest.approx(begins, rel=0.3))


def test_the_energy_of_long_repeats_has_two_logarithmic_axes(tmp_path: Path) -> None:
    """The figures of the source report keep theirs, and so do other axes that a figure wants."""
    run = made(tmp_path / "run", "cor=0.6", "collisions=800", "repeats=1", "container.mass=.inf")
    found = FIGURES["energy"].make(run, Selection())
    assert (found.x_log, found.y_log) == (True, True)
    (line,) = (layer for layer in found.layers if isinstance(layer, Line))
    start = float(np.interp(found.x_limits[0] or 0.0, line.x, line.y))
    assert 0.9 < start < 1.0
    assert not FIGURES["energy"].make(run, Selection(), source=True).x_log
