"""Axes that reach as far as the data, and arrows at what is outside."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from figure_runs import shown

from snooker_cli.figures.axis_limits import outside, reach
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.drawing import draw
from snooker_cli.figures.figure_data import NEUTRAL, Array, FigureData, Layer, Line, Points
from snooker_cli.figures.selection import Selection
from snooker_cli.runs import Run


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


def test_residuals_are_logarithms_of_ratios(decaying: Run) -> None:
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
    errors = f"({200 * math.log(2e31):.1f} errors of its logarithm)"
    assert f"is a factor of (2.000 ± 0.010) × 10³¹ {errors}." in figure.caption


def test_markers_of_many_decades_are_no_part_of_the_axis() -> None:
    low, high = reach([Points(np.arange(3.0), np.array([1e-14, 1e-7, 1.0]))], logarithmic=True)
    assert low < 0.5e-14
    assert high > 2.0


def test_values_above_the_axis_are_named(decaying: Run) -> None:
    """The first hits give a mean pressure that is many times the settled one."""
    found = shown(decaying, "pressure")
    top = max(float(line.y.max()) for line in found.layers if isinstance(line, Line))
    limit = found.y_limits[1]
    assert limit is not None
    assert top > limit
    assert f"Arrows: the axis ends below the highest values, up to {top:.3g} Pa·m." in found.caption
    (axes,) = draw(found).axes
    arrows = [line for line in axes.lines if re.search("uparrow", str(line.get_marker()))]
    assert [line.get_ydata()[0] for line in arrows] == pytest.approx([limit] * len(arrows))
    assert arrows
