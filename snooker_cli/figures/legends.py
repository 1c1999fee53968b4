"""How series look, and where a reader finds their names.

Series have colours and markers, also on their lines; dashes say what a line is, in `figure_data`.

Up to four series have their names at the ends of their lines. More values of one key are a colour
scale, and two keys have a hue and a shade each. What is left is in a legend below the axes.
"""

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from snooker_cli.figures.figure_data import (
    MEASURED,
    MOST_ENTRIES,
    NEUTRAL,
    SECOND,
    Array,
    FigureData,
    Layer,
    Line,
    Points,
    Reference,
)
from snooker_cli.files import out_of_sight
from snooker_cli.trace import even_choice

with out_of_sight("matplotlibrc"):
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize, to_hex, to_rgb
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.text import Text

PALEST = 0.5  # share of white in the palest series of a hue
SCALE_TICKS = 10  # values at a colour scale at most
LEGEND_SHARE = 0.97  # of the figure's width, for the legend

_COLOURS = matplotlib.color_sequences["petroff10"]
_HUES = tuple(_COLOURS[k] for k in (0, 2, 4, 6, 5, 8))  # whose pale shades can be seen on white
_SHADES, LIGHTEST = matplotlib.colormaps["plasma"], 0.75  # its yellow end is pale on white
_MARKERS = ("o", "s", "^", "D", "v", "P")


def colour(series: int, shades: Sequence[float] = (), hues: Sequence[int] = ()) -> str:
    """The colour of a series, which the colour-blind can tell apart.

    shades, hues : of ``FigureData``
    """
    if series == NEUTRAL:
        return "0.3"
    if hues:
        return _paler(_HUES[hues[series] % len(_HUES)], shades[series])
    if shades:
        return to_hex(_SHADES(LIGHTEST * shades[series]))
    return to_hex(_COLOURS[series % len(_COLOURS)])


def _paler(name: Any, shade: float) -> str:
    """A colour with white, of which the shade 1 has most."""
    white = PALEST * shade
    red, green, blue = (white + (1 - white) * part for part in to_rgb(name))
    return to_hex((red, green, blue))


def pattern(series: int) -> int:
    """Which marker a series has: in grey, those with the same one differ in lightness."""
    return (series + series // 6 + series // 12) % 6


def marker(series: int, data: FigureData) -> str:
    """The marker of a series; beside a scale of more colours than markers, all have one."""
    if series == NEUTRAL or not has_markers(data):
        return _MARKERS[0]
    return _MARKERS[pattern(data.hues[series] if data.hues else series)]


_SYMBOL = re.compile(r"(?<![\w$\\])([A-Za-zα-ω])_(rot|tr|th|x|y|c|P)(?!\w)")
"""A symbol with an index, as texts and JSON write it: ``T_rot``."""


def set_text(text: Text, words: str) -> None:
    """Give a text its words, with real subscripts; nothing else in them is a formula."""
    text.set_parse_math(bool(_SYMBOL.search(words)))
    if text.get_parse_math():
        words = _SYMBOL.sub(r"$\1_{\\mathrm{\2}}$", words.replace("$", r"\$"))
    text.set_text(words)


def is_scaled(data: FigureData) -> bool:
    """Whether a colour scale names the series."""
    return len(data.scale) > MOST_ENTRIES and not data.hues


def has_markers(data: FigureData) -> bool:
    """Whether markers tell the series apart."""
    return not is_scaled(data) or len(data.scale) <= len(_MARKERS)


# Markers on lines.

MARKS = 5  # markers on a line
MARK_SIZE = 3.2  # of these markers, points
BESIDE_POINT = 0.1  # share of the axes beside a point of a figure where lines have no marker


def mark_lines(data: FigureData, drawn: Sequence[tuple[Axes, Sequence[tuple[Layer, Any]]]]) -> None:
    """Put markers of the series on their lines, if colours alone tell several of them apart.

    drawn : all axes, whose limits are those in the end, with their layers and artists

    Markers of several series stand at different x, and not beside a point with a value. Where a
    series has points along x, its line has no markers, and neither has a path, where markers are
    places.
    """
    marked = [
        (axes, layer, artist, [other.x for other, _ in layers if isinstance(other, Points)])
        for axes, layers in drawn
        for layer, artist in layers
        if isinstance(layer, Line) and _needs_marks(layer, [other for other, _ in layers])
    ]
    series = sorted({layer.series for _, layer, *_ in marked})
    if len(series) < 2 or not has_markers(data) or data.equal_axes:
        return
    for axes, layer, artist, points in marked:
        aimed = (np.arange(MARKS) + (series.index(layer.series) + 0.5) / len(series)) / MARKS
        artist.set(
            marker=marker(layer.series, data),
            markersize=MARK_SIZE,
            markevery=_nearest_vertices(axes, layer, aimed, np.concatenate([[], *points])),
        )


def _needs_marks(layer: Line, others: Sequence[Layer]) -> bool:
    """Whether a line is that of a series that has no points along x in the same axes."""
    return (
        layer.series != NEUTRAL
        and layer.style in (MEASURED, SECOND)
        and not layer.thin
        and not any(
            isinstance(other, Points) and other.series == layer.series and len(other.x) > 1
            for other in others
        )
    )


def _nearest_vertices(axes: Axes, line: Line, aimed: Array, points: Array) -> list[int]:
    """The vertices of a line nearest to places along the x axis, shares of it, if any are near.

    points : x of points, from which they keep away
    """
    to_shares = (axes.transData + axes.transAxes.inverted()).transform
    shares = to_shares(np.column_stack([line.x, line.y]))
    taken = to_shares(np.column_stack([points, np.full(len(points), axes.get_ylim()[1])]))[:, 0]
    far = np.all(np.abs(shares[:, :1] - taken) > BESIDE_POINT, axis=1)
    inside = np.all(np.abs(shares - 0.5) < 0.49, axis=1)  # whole, and not nan
    known = np.flatnonzero(inside & far)
    shares = shares[known, 0]
    if not len(known):
        return []
    chosen = np.argmin(np.abs(shares - aimed[:, np.newaxis]), axis=1)
    found = known[chosen[np.abs(shares[chosen] - aimed) <= 0.5 / len(aimed)]]
    return [int(row) for row in np.unique(found)]


# Names at the ends of lines.

END_LETTERS = 16  # of a name at the end of its line at most
LINE_SPACE = 1.25  # from name to name, in heights of letters
APART = 0.4  # distance of the ends of two lines that a reader tells apart, in these spaces
FARTHEST = 2.0  # way from the end of a line to its name up or down at most, in these spaces
LETTER_WIDTH = 0.6  # of a letter, over its height
BESIDE = 0.015  # from the end of a line to its name, over the width of the axes


class _End(NamedTuple):
    """The end of a series: its name, and its place as data and as shares of the axes."""

    series: int
    name: str
    data: tuple[float, float]
    x: float
    y: float


def name_at_ends(axes: Axes, data: FigureData) -> set[str]:
    """Write the names of two to four series at the ends of their lines; none if one has no room.

    The limits of the axes are those in the end. Returns the names that need no legend.
    """
    ends = sorted(_ends(axes, data), key=lambda end: end.y)
    if not 1 < len(ends) <= MOST_ENTRIES or data.hues or data.equal_axes:
        return set()
    if any(len(end.name) > END_LETTERS or not -0.02 < end.y < 1.02 for end in ends):
        return set()
    points = float(matplotlib.rcParams["legend.fontsize"])
    box, size = axes.get_window_extent(), points * axes.figure.dpi / 72
    line = LINE_SPACE * size / box.height
    if any(high.y - low.y < APART * line for low, high in itertools.pairwise(ends)):
        return set()
    curves = [_in_axes(axes, layer) for layer in data.layers if isinstance(layer, Line | Points)]
    places: list[tuple[_End, float, float, float]] = []
    for end in ends:
        width = LETTER_WIDTH * size * len(end.name) / box.width
        place = _free_place(end, width, line, curves, places)
        if place is None:
            return set()
        places.append((end, *place, width))
    for end, x, y, _ in places:
        far = x > 1 and (end.x < 1 - 2 * BESIDE or abs(y - end.y) > line / 4)
        tint = colour(end.series, data.shades, data.hues)
        text = axes.annotate(
            "",
            end.data,
            (x, y),
            textcoords="axes fraction",
            color=tint,
            fontsize=points,
            verticalalignment="center",
            arrowprops={"arrowstyle": "-", "linewidth": 0.4, "color": tint, "shrinkA": 0}
            if far
            else None,
            annotation_clip=False,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.3},
        )
        set_text(text, end.name)
    return {end.name for end in ends} - {line.label for line in _named_theories(data)}


def _named_theories(data: FigureData) -> list[Line]:
    """Theories with the names of their series, whose points are in the legend."""
    points = {(layer.series, layer.label) for layer in data.layers if isinstance(layer, Points)}
    lines = (layer for layer in data.layers if isinstance(layer, Line) and layer.label)
    return [line for line in lines if (line.series, line.label) in points and len(line.x)]


def _ends(axes: Axes, data: FigureData) -> Iterator[_End]:
    """The ends of all series that have a name. Dashes of its own are those of a theory or a fit."""
    theories = _named_theories(data)
    for layer in theories or data.layers:
        if not isinstance(layer, Line | Points) or not layer.label or layer.series == NEUTRAL:
            continue
        if isinstance(layer, Line) and layer.style != MEASURED and not theories:
            continue
        # The thin end of a mean has no name of its own.
        parts = [layer] + [
            other
            for other in data.layers
            if isinstance(other, Line) and other.thin and other.series == layer.series
        ]
        places = [place for part in parts for place in _drawn(part).tolist()]
        if places:
            x, y = max(places)
            (share,) = axes.transAxes.inverted().transform(axes.transData.transform([(x, y)]))
            yield _End(layer.series, layer.label, (x, y), float(share[0]), float(share[1]))


def _drawn(layer: Line | Points) -> Array:
    """The places (*n*, 2) of a layer that one sees: a line needs two of them in a row."""
    places = np.column_stack([layer.x, layer.y])
    known = np.asarray(np.isfinite(places).all(axis=1))
    if isinstance(layer, Line):
        beside = np.append(False, known[:-1]) | np.append(known[1:], False)
        known &= beside
    return places[known]


def _in_axes(axes: Axes, layer: Line | Points) -> Array:
    """Places (*n*, 2) along a layer as shares of the axes, close to each other on a line."""
    shares = axes.transAxes.inverted().transform(axes.transData.transform(_drawn(layer)))
    shares = shares[np.isfinite(shares).all(axis=1)]
    if isinstance(layer, Points) or len(shares) < 2:
        return np.asarray(shares)
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(shares, axis=0).T)))
    along = np.linspace(0.0, way[-1], 400)
    return np.column_stack([np.interp(along, way, column) for column in shares.T])


def _free_place(
    end: _End,
    width: float,
    line: float,
    curves: Sequence[Array],
    taken: Sequence[tuple[_End, float, float, float]],
) -> tuple[float, float] | None:
    """The place of a name nearest to its end that covers no curve and no other name, if any.

    A name that has no room inside the axes is right of them.
    """
    left = end.x + BESIDE
    if left + width > 1:
        left = 1 + BESIDE
    steps = np.arange(0.0, FARTHEST + 0.1, 0.25) * line
    for y in (end.y + step for pair in zip(steps, -steps, strict=True) for step in pair):
        names_clear = all(
            abs(y - other) >= line * 0.99 or left + width < start or left > start + length
            for _, start, other, length in taken
        )
        curves_clear = left > 1 or not any(
            np.any(
                (left < curve[:, 0])
                & (curve[:, 0] < left + width)
                & (np.abs(curve[:, 1] - y) < line / 2)
            )
            for curve in curves
        )
        if names_clear and curves_clear:
            return left, y
    return None


# A colour scale, and the legend.


def add_scale(figure: Figure, axes: list[Axes], data: FigureData) -> None:
    """Add a colour scale beside the axes: a step for each series, with its value and marker."""
    steps = sorted(range(len(data.scale)), key=lambda series: data.shades[series])
    colours = ListedColormap([colour(series, data.shades) for series in steps])
    shades = ScalarMappable(Normalize(0, len(steps)), colours)
    bar = figure.colorbar(shades, ax=axes, aspect=30, pad=0.02)
    shown = even_choice(len(steps), SCALE_TICKS)
    bar.set_ticks([row + 0.5 for row in shown], labels=[data.scale[steps[row]] for row in shown])
    bar.ax.tick_params(length=0)
    bar.outline.set_linewidth(0)
    for row, series in enumerate(steps if has_markers(data) else []):
        shape = marker(series, data)
        bar.ax.plot(0.5, row + 0.5, marker=shape, markersize=MARK_SIZE, color="white")
    bar.set_label(data.scale_label)
    set_text(bar.ax.yaxis.label, data.scale_label)


def entries(
    data: FigureData, drawn: Sequence[tuple[Layer, Any]], named: set[str]
) -> list[tuple[str, Any]]:
    """The names in the legend with what they are the names of: first series, then what is for all.

    drawn : layers with their artists
    named : names that are at the lines

    What looks alike in several axes has one entry with all names.
    """
    found: dict[str, tuple[bool, Layer, Any]] = {}  # several series may have limits of one name
    elsewhere = is_scaled(data) or bool(data.hue_names)
    for layer, artist in drawn:
        neutral = getattr(layer, "series", NEUTRAL) == NEUTRAL
        if layer.label and layer.label not in named and (neutral or not elsewhere):
            found.setdefault(layer.label, (neutral, layer, artist))
    alike: dict[Any, tuple[list[str], Any]] = {}
    for name, (_, layer, artist) in sorted(found.items(), key=lambda entry: entry[1][0]):
        names, _ = alike.setdefault(_look(layer), ([], artist))
        names.append(name)
    return [*_of_two_keys(data), *(("; ".join(names), artist) for names, artist in alike.values())]


def _look(layer: Layer) -> tuple[Any, ...]:
    """What a reader sees of a layer's entry in the legend: kind, series, dashes or filling."""
    owner = getattr(layer, "series", NEUTRAL)
    if isinstance(layer, Line | Reference):
        return "line", owner, layer.style
    return type(layer).__name__, owner, getattr(layer, "filled", None)


def _of_two_keys(data: FigureData) -> Iterator[tuple[str, Any]]:
    """An entry for each hue, and one for each shade, in grey."""
    points = any(isinstance(layer, Points) for layer in data.layers)
    for hue, name in enumerate(data.hue_names):
        tint = _HUES[hue % len(_HUES)]
        shape: dict[str, Any] = {"marker": _MARKERS[pattern(hue)], "markersize": MARK_SIZE}
        yield name, Line2D([], [], color=tint, linestyle="none" if points else MEASURED, **shape)
    if data.hue_names:
        names = dict(sorted(zip(data.shades, data.scale, strict=True)))
        shown = [*names.items()]
        for row in even_choice(len(shown), MOST_ENTRIES):
            shade, name = shown[row]
            yield name, Line2D([], [], color=_paler("0.1", shade), linewidth=4)


def add_legend(figure: Figure, found: Sequence[tuple[str, Any]]) -> int:
    """Add the legend below the axes, in up to three columns; the number of its lines."""
    if not found:
        return 0
    labels, artists = zip(*found, strict=True)
    for columns in (3, 2, 1):
        legend = figure.legend(artists, labels, loc="outside lower center", ncols=columns)
        for text, label in zip(legend.get_texts(), labels, strict=True):
            set_text(text, label)
        if columns == 1 or legend.get_window_extent().width <= LEGEND_SHARE * figure.bbox.width:
            break
        legend.remove()
    return math.ceil(len(found) / columns)
