"""Every figure is drawn without a warning, legibly, and in the same bytes."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_runs import ELASTIC, ROUGH, STORED, made
from figure_runs import shown as shown_of
from matplotlib.axis import Axis
from matplotlib.text import Text

from snooker_cli.errors import FigureError
from snooker_cli.figures import state_pictures
from snooker_cli.figures.drawing import draw, save, to_json
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Band,
    FigureData,
    Line,
    Panel,
    Pictures,
    Points,
    Reference,
    with_logarithmic_axes,
)
from snooker_cli.figures.legends import colour, marker
from snooker_cli.figures.registry import FIGURES
from snooker_cli.figures.style import styled
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection

pytestmark = pytest.mark.filterwarnings("error")
X = np.array([0.1, 0.2, 0.3])


EVERYTHING = FigureData(
    kind="everything",
    title="Every <type> of layer & $\\frac, in a title so long that it needs a second line",
    x_label="time (s)",
    y_label="a quantity $q$ whose name is too long for one line (Pa·m)",
    layers=(
        Band(X, X - 0.1, X + 0.1, "band", 0),
        Line(X, X / 3, "line", 0),
        Line(X, X**2, "steps", 1, "dotted", steps=True),
        Points(X, X + 1, np.array([0.1, np.nan, 0.3]), "$ points", 2),
        Points(X, X + 2, label="open points", series=3, filled=False),
        Reference("x", 0.25, "x = 0.25"),
        Reference("y", 2.5),
    ),
    caption="“Quoted” & <escaped> − 1/3.",
    numbers={"third": 1 / 3, "nothing": float("nan")},
    y_limits=(0.0, None),
    panel=(Points(X, X, np.array([0.1, np.nan, 0.3])), Reference("y", 0.2)),
    panel_label="above theory (%)",
)


@pytest.fixture(scope="module")
def figures(
    decaying: RunFolder,
    warm: RunFolder,
    driven: RunFolder,
    heated: RunFolder,
    mixture: RunFolder,
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, FigureData]:
    """Every figure, made of small runs."""
    folder = tmp_path_factory.mktemp("gases")
    runs: dict[str, tuple[RunFolder, dict[str, Any]]] = {
        "gas-law": (wide := made(folder / "wide", *ELASTIC, "container.radius=10,20,50"), {}),
        "temperature-ratio": (warm, {"balls.speed": 10.0}),
        "van-der-waals": (wide, {}),
        "speeds": (warm, {"balls.radius": 1.0}),
        "species-temperature": (mixture, {}),
        "stationary": (driven, {}),
        "equation-of-state": (driven, {}),
        "energy-balance": (driven, {"cor": 0.9}),
        "profiles": (driven, {"cor": 0.9, "balls.radius": 0.5}),
        "heat-flux": (heated, {"wall_temperature.right": 50.0}),
        "swept-key": (made(folder / "radii", "balls.radius=0.5,1.0"), {}),
        "wall-impulses": (decaying, {"cor": 1.0}),
        "result-histogram": (made(folder / "ten", "repeats=10"), {}),
        "rotation": (made(folder / "rough", text=ROUGH), {}),
        "structure-factor": (stored := made(folder / "stored", text=STORED), {}),
        "cluster-growth": (stored, {}),
    }
    found = {"everything": EVERYTHING}
    for name, spec in FIGURES.items():
        run, where = runs.get(name, (decaying, {"cor": 0.8} if spec.each_point else {}))
        found[name] = spec.make(run, Selection(where))
    return found


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The files of every type of layer: SVG, PNG and JSON."""
    return save(EVERYTHING, tmp_path_factory.mktemp("saved") / "a.b")


def plain_text(text: Any) -> str:
    """The words of a text in a line, with subscripts as data have them: T_rot."""
    words = re.sub(r"\$(\w)_\{\\mathrm\{(\w+)\}\}\$", r"\1_\2", text.get_text())
    return str(words.replace("\n", " "))


def tick_labels(axis: Axis) -> list[Text]:
    """The labels of ticks that are drawn: those within the axis's limits."""
    low, high = axis.get_view_interval()
    locations, labels = axis.get_ticklocs(), axis.get_ticklabels()
    pairs = zip(locations, labels, strict=True)
    return [label for at, label in pairs if low <= at <= high and label.get_text()]


@pytest.mark.parametrize("name", [*(name for name in FIGURES if name != "snapshot"), "everything"])
def test_every_figure_is_drawn_legibly(name: str, figures: dict[str, FigureData]) -> None:
    shown = figures[name]
    with styled():
        figure = draw(shown)
        figure.draw_without_rendering()
        axes, *panels = [one for one in figure.axes if one.get_label() != "<colorbar>"]
        lowest = [axes, *panels][-1]
        ticks = [tick_labels(axis) for axis in (lowest.xaxis, *(one.yaxis for one in figure.axes))]
        in_legends = [text for legend in figure.legends for text in legend.get_texts()]
        titles = [text for text in axes.findobj(Text) if plain_text(text) == shown.title]
        words = [*titles, lowest.xaxis.label, *axes.texts, *in_legends]
        words += [one.yaxis.label for one in figure.axes]
        for text in [*words, *itertools.chain(*ticks)]:
            box = text.get_window_extent()
            inside = figure.bbox.contains(box.x0, box.y0) and figure.bbox.contains(box.x1, box.y1)
            assert inside or not text.get_text(), f"{text.get_text()!r} is cut off"
        for legend in figure.legends:
            assert not legend.get_window_extent().overlaps(lowest.get_window_extent())
            assert legend.get_window_extent().height <= figure.bbox.height / 4, "a high legend"
        for owner, line in [(one, line) for one in figure.axes for line in one.lines]:
            on_line = line.get_markevery()  # of points it is None
            places = np.column_stack(line.get_data())[on_line if on_line else slice(None)]
            is_marker = str(line.get_marker()) in "os^DvP"  # not an error bar's cap
            if is_marker and len(places) and owner in (axes, *panels):
                assert line.get_clip_on() == (on_line is not None)
                to_shares = owner.transData + owner.transAxes.inverted()
                shown_at = to_shares.transform(places)
                assert np.nanmin(shown_at) >= 0
                assert np.nanmax(shown_at) < 1, "a marker is at the upper limit"
        for labels in ticks:
            assert len(labels) >= 2
            boxes = [label.get_window_extent() for label in labels]
            assert not any(one.overlaps(two) for one, two in itertools.combinations(boxes, 2))
    drawn = {name for text in words for name in (plain_text(text), *plain_text(text).split("; "))}
    assert {shown.title, shown.x_label, shown.y_label} <= drawn
    assert len(panels) == len(shown.all_panels)
    assert {panel.label for panel in shown.all_panels} <= drawn
    for panel in panels:
        assert panel.get_xlim() == axes.get_xlim()
        assert not panel.get_window_extent().overlaps(axes.get_window_extent())
    of_keys = {*shown.hue_names, *shown.scale} if shown.hue_names else set()
    assert of_keys <= drawn
    for layer in shown.layers:
        in_parts = {*str(layer.label).split(", ")} <= of_keys
        assert layer.label is None or layer.label in drawn or in_parts


def entries(found: FigureData) -> Iterator[tuple[Any, ...]]:
    """What a reader sees of each named line and marker: two of them must not be the same."""
    for layer in found.layers:
        if isinstance(layer, Line) and layer.label:
            tint = colour(layer.series, found.shades, found.hues)
            yield "line", tint, marker(layer.series, found), layer.style, layer.broad
        if isinstance(layer, Points) and layer.label:
            tint = colour(layer.series, found.shades, found.hues)
            yield "points", tint, marker(layer.series, found), layer.filled


def test_names_on_the_y_axis_have_a_line_each() -> None:
    names = [f"name {number}, or ${number}" for number in range(30)]
    data = FigureData("names", "Names", "x", "", (Points(X, X),), "", y_names=names)
    figures = [draw(replace(data, y_names=names[:most])) for most in (1, 30)]
    for figure in figures:
        figure.draw_without_rendering()
        labels = figure.axes[0].get_yticklabels()
        assert [label.get_text() for label in labels] == names[: len(labels)]
        heights = [label.get_window_extent().y0 for label in labels]
        assert heights == sorted(heights, reverse=True)
        for above, below in itertools.pairwise(label.get_window_extent() for label in labels):
            assert not above.overlaps(below)
    assert figures[1].get_figheight() > figures[0].get_figheight()


@pytest.mark.parametrize("name", FIGURES)
def test_no_two_entries_of_a_legend_look_the_same(
    name: str, figures: dict[str, FigureData], decaying: RunFolder
) -> None:
    alone = [shown_of(decaying, name, cor=0.8)] if name == "cooling" else []
    for found in (figures[name], *alone):
        seen = [*entries(found)]
        assert len(seen) == len(set(seen))


def test_what_is_drawn_is_what_the_json_says(saved: list[Path]) -> None:
    _, _, path = saved
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["numbers"] == {"third": 1 / 3, "nothing": None}
    _, line, steps, points, _, vertical, horizontal = content["layers"]
    axes, panel = draw(EVERYTHING).axes
    residuals = content["panel"][0]
    assert [residuals["x"], residuals["y"]] in [
        np.array(artist.get_data()).tolist() for artist in panel.lines
    ]
    drawn = [np.array(artist.get_data()).tolist() for artist in axes.lines]
    for layer in (line, steps, points):
        assert [layer["x"], layer["y"]] in drawn
    assert points["y_error"] == [0.1, None, 0.3]
    assert [[vertical["value"]] * 2, [0.0, 1.0]] in drawn
    assert [[0.0, 1.0], [horizontal["value"]] * 2] in drawn


# Colour scales


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    values = "cor=0.6,0.65,0.7,0.75,0.8,0.85,0.9,0.95"
    return made(tmp_path_factory.mktemp("swept") / "run", values)


@pytest.mark.parametrize("name", ["energy", "event-decay", "cooling"])
def test_many_values_of_one_key_are_a_colour_scale(name: str, swept: RunFolder) -> None:
    """Each step has the colour of its series; the legend keeps what is for all."""
    shown = FIGURES[name].make(swept, Selection())
    figure = draw(shown)
    with styled():
        figure.draw_without_rendering()
    bar = figure.axes[-1]
    assert bar.get_ylabel() == "CoR"
    values = [text.get_text() for text in bar.get_yticklabels()]
    assert values == ["0.6", "0.65", "0.7", "0.75", "0.8", "0.85", "0.9", "0.95"]
    (mesh,) = (artist for artist in bar.collections if artist.get_array() is not None)
    steps = [colour(0, [rank]) for rank in np.linspace(0, 1, 8)]
    drawn = mesh.cmap(mesh.norm(mesh.get_array().ravel()))
    assert [colour_of(row) for row in drawn] == steps
    entries = [plain_text(text) for legend in figure.legends for text in legend.get_texts()]
    assert bool(entries) == (name != "energy")
    assert not any(entry.startswith("CoR") for entry in entries)


def colour_of(row: Any) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in row[:3])


@pytest.mark.parametrize(
    ("override", "label", "values"),
    [
        ("balls.radius=0.25,0.5", "r (m)", ("0.25", "0.5")),
        ("balls.rings=1,2", "N", ("7", "19")),
        ("balls.speed=5,10", "v₀ (m/s)", ("5", "10")),
        ("collisions=100,200", "collisions", ("100", "200")),
        ("container.radius=10,12", "R (m)", ("10", "12")),
    ],
)
def test_a_scale_has_the_name_and_the_unit_of_its_key(
    override: str, label: str, values: tuple[str, ...], tmp_path: Path
) -> None:
    shown = FIGURES["energy"].make(made(tmp_path / "run", override), Selection())
    assert (shown.scale_label, shown.scale) == (label, values)


# Logarithmic axes


def test_a_logarithmic_axis_shows_all_positive_values(figures: dict[str, FigureData]) -> None:
    """Of theory, which falls by more decades, it shows what the measured values need."""
    linear = figures["speeds"]
    shown = with_logarithmic_axes(linear, False, True)
    axes = draw(shown).axes[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    low, high = axes.get_ylim()
    lines = [layer for layer in shown.layers if isinstance(layer, Line)]
    points = [layer for layer in shown.layers if isinstance(layer, Points)]
    measured = np.concatenate([layer.y[np.isfinite(layer.y)] for layer in points])
    all_bins = np.concatenate([layer.y for layer in linear.layers if isinstance(layer, Points)])
    assert measured.tolist() == all_bins[all_bins > 0].tolist()  # empty bins have no place
    theory = [line for line in lines if line.label == "Maxwell–Boltzmann"]
    assert 0 < low < measured[measured > 0].min() < measured.max() < high
    assert min(line.y.min() for line in theory) < low
    assert not linear.y_log
    both = draw(with_logarithmic_axes(figures["energy"], True, True)).axes[0]
    assert (both.get_xscale(), both.get_yscale()) == ("log", "log")
    lines = [layer for layer in figures["energy"].layers if isinstance(layer, Line)]
    first = min(line.x[line.x > 0].min() for line in lines if len(line.x))
    assert 0 < both.get_xlim()[0] < first


@pytest.mark.parametrize("name", ["speeds", "energy", "pressure", "hexatic-order"])
def test_a_figure_with_logarithmic_axes_is_drawn_legibly(
    name: str, figures: dict[str, FigureData]
) -> None:
    test_every_figure_is_drawn_legibly(
        name, {name: with_logarithmic_axes(figures[name], True, True)}
    )


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (
            [-0.5, 1.0, 2.0],
            "log_y=True needs positive values of y, and its least is -0.5; leave it",
        ),
        (
            [0.0, 0.0, 0.0],
            "log_y=True needs positive values of y, and its least is 0; leave it out",
        ),
        ([np.nan, np.nan, np.nan], "log_y=True needs positive values of y, and there is none"),
    ],
)
def test_what_has_no_logarithm_is_refused_in_one_sentence(values: list[float], reason: str) -> None:
    data = replace(EVERYTHING, layers=(Line(X, np.array(values), "line"),))
    with pytest.raises(FigureError, match=f"^{reason}"):
        with_logarithmic_axes(data, False, True)
    with pytest.raises(FigureError, match="on axes of one scale; leave out log_x=True"):
        with_logarithmic_axes(replace(data, equal_axes=True), True, False)


def test_the_densest_balls_are_darkest_on_white() -> None:
    """The fastest ones are the lightest, as in other figures."""
    lightness = []
    for dark in (True, False):
        colours = state_pictures._colours(Pictures((), "", (0.0, 1.0), high_is_dark=dark))
        lightness += [np.mean(colours(value)[:3]) for value in (0.0, 1.0)]
    sparse, dense, slow, fast = lightness
    assert dense == slow < fast < sparse < 1  # empty cells are white


def test_letters_of_images_are_letters(tmp_path: Path) -> None:
    """PDF with TrueType fonts, which journals take, and SVG with text, which can be searched."""
    pdf, svg, _ = save(EVERYTHING, tmp_path / "a", ("pdf", "svg"))
    content = pdf.read_bytes()
    assert b"/Type3" not in content
    assert b"/CIDFontType2" in content
    assert f">{EVERYTHING.x_label}</text>" in svg.read_text(encoding="utf-8")
    outlined, _ = save(EVERYTHING, tmp_path / "b", ("svg",), outlines=True)
    assert "<text" not in outlined.read_text(encoding="utf-8")


def test_panels_share_the_x_axis_and_have_scales_of_their_own() -> None:
    """Between the first axes and the residuals."""
    x = np.array([1.0, 10.0, 100.0])
    rate = Panel((Line(x, 1 / x**2),), "rate (s⁻¹)", log=True)
    residuals = (Points(x, np.array([0.1, 0.0, -0.1])),)
    content: dict[str, Any] = {"panels": (rate,), "panel": residuals, "panel_label": "residuals"}
    data = FigureData("k", "t", "x", "y", (Line(x, x),), "c", x_log=True, **content)
    axes = draw(data).axes
    assert [each.get_yscale() for each in axes] == ["linear", "log", "linear"]
    assert [each.get_ylabel() for each in axes] == ["y", "rate (s⁻¹)", "residuals"]
    assert {each.get_xscale() for each in axes} == {"log"}
    assert len({each.get_xlim() for each in axes}) == 1
    assert data.alt.endswith("Below: rate (s⁻¹) and residuals.")
    stored = json.loads(to_json(data))["panels"][0]
    assert (stored["label"], stored["layers"][0]["type"]) == ("rate (s⁻¹)", "line")


@pytest.mark.parametrize("decades", [0.4, 1.0, 2.4, 6.0])
def test_a_low_logarithmic_panel_has_labels_apart(decades: float) -> None:
    """2, 5 and 10 of each decade had no room in it from two decades on."""
    low = Panel((Line(X, 10 ** (-decades * X - 1.6)),), "rate (s⁻¹)", log=True)
    figure = draw(FigureData("k", "t", "x", "y", (Line(X, X),), "c", panels=(low,)))
    with styled():
        figure.draw_without_rendering()
        boxes = [label.get_window_extent() for label in tick_labels(figure.axes[1].yaxis)]
    assert len(boxes) >= 2
    assert not any(one.overlaps(two) for one, two in itertools.combinations(boxes, 2))


def test_a_title_has_real_subscripts() -> None:
    titles = draw(replace(EVERYTHING, title="T_rot/T_tr against β")).axes[0].get_title("left")
    assert titles == r"$T_{\mathrm{rot}}$/$T_{\mathrm{tr}}$ against β"


def test_symbols_have_real_subscripts_and_other_words_are_no_formulas() -> None:
    """Names of runs and keys may have the same characters."""
    line = Line(X, X, "T_rot of run_x at 5 $", NEUTRAL)
    data = replace(EVERYTHING, layers=(line,), x_label="a_very_x $x$", y_label="T_rot/T_tr")
    data = replace(data, panel_label="v_x (m/s)")
    figure = draw(data)
    axes, panel = figure.axes
    assert axes.get_ylabel() == r"$T_{\mathrm{rot}}$/$T_{\mathrm{tr}}$"
    assert panel.get_ylabel() == r"$v_{\mathrm{x}}$ (m/s)"
    (entry,) = figure.legends[0].get_texts()
    assert entry.get_text() == r"$T_{\mathrm{rot}}$ of run_x at 5 \$"
    assert (panel.get_xlabel(), panel.xaxis.label.get_parse_math()) == ("a_very_x $x$", False)
    with styled():
        figure.draw_without_rendering()
    assert "T_rot/T_tr against" in data.alt
