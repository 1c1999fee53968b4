"""The names of series: at the ends of their lines, in a colour scale, by hue and shade, below."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_runs import made
from matplotlib.figure import Figure

from snooker_cli.figures.drawing import draw
from snooker_cli.figures.figure_data import MOST_ENTRIES, NEUTRAL, FigureData, Line, Points
from snooker_cli.figures.legends import MARKS, colour
from snooker_cli.figures.registry import FIGURES
from snooker_cli.figures.style import styled
from snooker_cli.runs.selection import Selection

X = np.linspace(0.0, 1.0, 50)


def figure_of(*layers: Line | Points, **fields: Any) -> FigureData:
    return FigureData("k", "A title", "x", "y", layers, "A caption.", **fields)


def names(figure: Figure) -> tuple[list[str], list[str]]:
    """The names at the lines, and those in the legend."""
    below = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    return [text.get_text() for text in figure.axes[0].texts], below


FALLING = [Line(X, np.exp(-k * X), f"CoR 0.{k}", k - 1) for k in (1, 2, 3, 4)]


def test_up_to_four_series_have_their_names_at_their_ends() -> None:
    """In their colours; what is for all is below."""
    law = Line(X, np.exp(-5 * X), "a law for all of them", NEUTRAL, "dashed")
    figure = draw(figure_of(*FALLING, law, y_log=True))
    at_lines, below = names(figure)
    assert sorted(at_lines) == ["CoR 0.1", "CoR 0.2", "CoR 0.3", "CoR 0.4"]
    assert below == [law.label]
    with styled():
        figure.draw_without_rendering()
    texts = {text.get_text(): text for text in figure.axes[0].texts}
    boxes = [text.get_window_extent() for text in texts.values()]
    assert not any(one.overlaps(two) for one, two in itertools.combinations(boxes, 2))
    for layer in FALLING:
        assert texts[str(layer.label)].get_color() == colour(layer.series)
    heights = [texts[str(layer.label)].get_window_extent().y0 for layer in FALLING]
    assert heights == sorted(heights, reverse=True)  # as the lines end


def test_a_name_is_inside_the_axes_where_its_line_ends_early() -> None:
    """It covers no other curve."""
    short = Line(X[:20], 1 - X[:20], "short", 0)
    figure = draw(figure_of(short, Line(X, 0.55 + 0.1 * X, "long", 1)))
    with styled():
        figure.draw_without_rendering()
    axes = figure.axes[0]
    text = next(text for text in axes.texts if text.get_text() == "short")
    left, low, right, high = (
        axes.transData.inverted().transform_bbox(text.get_window_extent()).extents
    )
    assert X[19] < left < right < 1.0
    between = X[(left < X) & (right > X)]
    assert not np.any((low < 0.55 + 0.1 * between) & (0.55 + 0.1 * between < high))


@pytest.mark.parametrize(
    "layers",
    [
        [Line(X, (1 - X) * k, f"to zero {k}", k) for k in (1, 2)],  # they end at one place
        [*FALLING, Line(X, np.exp(-6 * X), "CoR 0.6", 4)],
        [replace(FALLING[0], label="a name that is too long for a margin"), FALLING[3]],
    ],
)
def test_series_without_room_at_their_ends_are_in_a_legend(layers: list[Line]) -> None:
    at_lines, below = names(draw(figure_of(*layers)))
    assert (at_lines, below) == ([], [layer.label for layer in layers])


def test_a_theory_of_one_series_has_no_name_at_its_end() -> None:
    """A legend has its dashes."""
    theory = Line(X, 1 - 0.8 * X, "theory", 0, "dotted")
    assert names(draw(figure_of(*FALLING[1:3], replace(theory, series=1)))) == (
        sorted((line.label for line in FALLING[1:3]), reverse=True),
        ["theory"],
    )


def test_theories_with_the_names_of_their_series_have_them_at_their_ends() -> None:
    """The legend has the markers, where points of several series lie among each other."""
    points = [Points(X[::10], X[::10], None, f"CoR 0.{k}", k) for k in (1, 2)]
    laws = [Line(X, np.full(50, k / 3), f"CoR 0.{k}", k, "dashed") for k in (1, 2)]
    figure = draw(figure_of(*points, *laws))
    assert names(figure) == (["CoR 0.1", "CoR 0.2"], ["CoR 0.1", "CoR 0.2"])
    assert [text.xy for text in figure.axes[0].texts] == [(1.0, 1 / 3), (1.0, 2 / 3)]


def test_a_single_series_is_named_in_the_legend() -> None:
    """Beside its line the name would take room from the axes."""
    theory = Line(X, 1 - 0.8 * X, "theory", 0, "dotted")
    assert names(draw(figure_of(Line(X, 1 - X / 2, "simulation", 0), theory))) == (
        [],
        ["simulation", "theory"],
    )


def test_the_thin_end_of_a_mean_has_the_name() -> None:
    thick, thin = Line(X[:20], X[:20], "mean", 0), Line(X[19:], X[19:], None, 0, thin=True)
    texts = draw(figure_of(thick, thin, FALLING[3])).axes[0].texts
    assert (1.0, 1.0) in [text.xy for text in texts]


def test_a_name_is_at_the_last_piece_of_a_line_that_one_sees() -> None:
    """A single value behind a gap is no line."""
    y = np.append(X[:-2], [math.nan, 1.0])
    texts = draw(figure_of(Line(X, y, "mean", 0), FALLING[3])).axes[0].texts
    assert (X[-3], X[-3]) in [text.xy for text in texts]


def test_more_than_four_values_of_one_key_are_a_colour_scale() -> None:
    fields: dict[str, Any] = {"shades": (0.0, 0.25, 0.5, 0.75, 1.0), "scale": tuple("abcde")}
    lines = [Line(X, k * X, f"key {name}", k) for k, name in enumerate("abcde")]
    figure = draw(figure_of(*lines, scale_label="key", **fields))
    assert len(figure.axes) == 2
    assert names(figure) == ([], [])
    assert [label.get_text() for label in figure.axes[1].get_yticklabels()] == [*"abcde"]
    few = {key: value[:4] for key, value in fields.items()}
    assert len(draw(figure_of(*lines[:MOST_ENTRIES], **few)).axes) == 1


def marks(figure: Figure) -> dict[str, list[float]]:
    """The markers on lines of the first axes, and where they are along x."""
    lines = [line for line in figure.axes[0].lines if line.get_markevery() is not None]
    return {str(line.get_marker()): [*line.get_xdata()[line.get_markevery()]] for line in lines}


def test_several_lines_have_markers_so_that_grey_tells_them_apart() -> None:
    """Each has its own, at places of its own; a theory, a thin end and a single line have none."""
    theory = Line(X, 1 - X / 3, "theory", 0, "dashed")
    thin = Line(X, 1 - X / 4, None, 0, thin=True)
    found = marks(draw(figure_of(*FALLING, theory, thin)))
    assert [*found] == ["o", "s", "^", "D"]
    places = [place for each in found.values() for place in each]
    assert len(places) == len(set(places)) == MARKS * len(FALLING)
    for series, each in enumerate(found.values()):  # evenly along x
        aimed = (np.arange(MARKS) + (series + 0.5) / 4) / MARKS
        assert each == pytest.approx(list(aimed), abs=0.06)
    assert not marks(draw(figure_of(FALLING[0], theory)))


def test_a_line_beside_the_points_of_its_series_has_no_markers_of_its_own() -> None:
    """One point, as a value at contact, does not name a line; markers keep away from it."""
    points = [Points(X[::10], X[::10], None, f"point {k}", k) for k in range(2)]
    assert not marks(draw(figure_of(*points, *FALLING[:2])))
    single = [replace(layer, x=layer.x[:1], y=layer.y[:1]) for layer in points]
    found = marks(draw(figure_of(*single, *FALLING[:2])))
    assert [*found] == ["o", "s"]
    assert min(min(places) for places in found.values()) > 0.09  # the points are at 0


def test_a_colour_scale_has_the_markers_of_the_lines() -> None:
    """As far as there are shapes; beyond these only shades tell series apart."""
    for number in (5, 7):
        shades = tuple(np.linspace(0, 1, number))
        lines = [Line(X, (k + 1) * X, f"key {k}", k) for k in range(number)]
        scale = tuple(map(str, range(number)))
        figure = draw(figure_of(*lines, scale_label="key", shades=shades, scale=scale))
        in_scale = [
            line.get_marker() for line in figure.axes[1].lines if line.get_marker() != "None"
        ]
        assert in_scale == [*marks(figure)] == (["o", "s", "^", "D", "v"] if number == 5 else [])


def test_two_keys_are_hue_and_shade(tmp_path: Path) -> None:
    """A legend has a name for each value of each, not for all pairs."""
    grid = made(tmp_path / "grid", "cor=0.7,0.8,0.9", "balls.radius=0.5,1.0", "repeats=1")
    found = FIGURES["energy"].make(grid, Selection())
    assert (found.hues, found.shades) == ((0, 1) * 3, (0.0, 0.0, 0.5, 0.5, 1.0, 1.0))
    figure = draw(found)
    assert names(figure) == ([], ["r = 0.5 m", "r = 1 m", "CoR 0.7", "CoR 0.8", "CoR 0.9"])
    markers = [line.get_marker() for line in figure.axes[0].lines]
    assert markers == ["o", "s"] * 3  # also in grey
    assert {line.get_linestyle() for line in figure.axes[0].lines} == {"-"}
    linked = "sweep={zip: {cor: [0.7, 0.8, 0.9], balls.radius: [0.5, 0.7, 1.0]}}"
    together = FIGURES["energy"].make(made(tmp_path / "zip", linked, "repeats=1"), Selection())
    assert not together.hues
