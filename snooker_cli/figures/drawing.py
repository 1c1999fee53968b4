"""Figure data -> a matplotlib figure and its files, without pyplot and its global state."""

import itertools
import json
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from snooker_cli.figures.axis_limits import outside, reach, visible
from snooker_cli.figures.figure_data import (
    MEASURED,
    NEUTRAL,
    Band,
    FigureData,
    Layer,
    Line,
    Points,
    Reference,
    Repeats,
)
from snooker_cli.figures.legends import (
    add_legend,
    add_scale,
    colour,
    entries,
    is_scaled,
    mark_lines,
    marker,
    name_at_ends,
    set_text,
)
from snooker_cli.figures.state_pictures import draw_pictures
from snooker_cli.figures.style import LINE_HEIGHT, WIDTH, SnookerFigure, styled, title_lines
from snooker_cli.files import atomic_write, out_of_sight, write_text
from snooker_cli.formatting import plain

with out_of_sight("matplotlibrc"):
    import matplotlib
    import matplotlib.style
    from matplotlib import ticker
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
    from matplotlib.transforms import ScaledTranslation

HEIGHT = 2.4  # height of a figure with a title of one line and nothing else around the axes, inches
PANEL_HEIGHT = 0.8  # height of a panel with its distance from the axes above, inches
PANEL_SHARE = 0.4  # height of a panel over that of the axes above
LINES = 13  # lines of text that are as high as the axes of a figure of this height

# How many characters fit: of a y label, of a panel's, of the x axis's numbers.
LABEL_WIDTH, PANEL_LABEL_WIDTH, TICKS_WIDTH = 31, 14, 50
SCALE_WIDTH = 12  # characters of the x axis whose room a colour scale takes

LEAST_TICKS, MOST_TICKS = 3, 9  # labels of a logarithmic axis, of a linear x axis
FEWEST_TICKS = 2  # labels of a logarithmic axis of a panel
PANEL_TICKS = 4  # intervals between labels of a panel's y axis at most
PLAIN = 1e-4, 1e6  # a logarithmic axis within these limits has no powers of ten

MARGIN = 0.05  # margin above the data, as a share of the axis, where only its lower limit is given
PATH = 0.9  # width of a line that crosses itself
BAND = 0.15  # strength of the colour of a band: two on each other are paler than a line
MANY_MARKERS = 30  # more markers of a figure are drawn smaller
MANY_VERTICES = 400  # lines of more vertices are mostly noise, and as thin as those of theory


def draw(data: FigureData, size: tuple[float, float] | None = None) -> Figure:
    """The matplotlib figure, with a legend below the axes, where it covers no data.

    size : width and height in inches; None is a column of a page, as high as its texts need
    """
    if data.pictures is not None:
        return draw_pictures(data, data.pictures, size)
    title = title_lines(data.title, size[0] if size else WIDTH)
    with styled():
        layout = ConstrainedLayoutEngine()
        figure = SnookerFigure(size or (WIDTH, HEIGHT), layout=layout)
        FigureCanvasAgg(figure)
        ratios = [1.0, *(PANEL_SHARE for _ in data.all_panels)]
        grid = {"height_ratios": ratios}
        axes, *panels = figure.subplots(
            len(ratios), sharex=True, squeeze=False, gridspec_kw=grid
        ).flat
        of_axes = [(axes, _added(axes, data, data.layers))]
        _scale(axes, data)
        for panel, content in zip(panels, data.all_panels, strict=True):
            of_axes.append((panel, _added(panel, data, content.layers)))
            set_text(panel.yaxis.label, textwrap.fill(content.label, PANEL_LABEL_WIDTH))
            panel.set_yscale("log" if content.log else "linear")
            panel.set_xlim(axes.get_xlim())  # `_scale` may have changed the view of one axis alone
            _clip(panel, data, content.layers, (None, None), logarithmic=content.log)
            if content.log:
                _few_decades(panel.yaxis, PANEL_TICKS)
            else:
                panel.locator_params("y", nbins=PANEL_TICKS)
        set_text([axes, *panels][-1].xaxis.label, data.x_label)
        set_text(axes.yaxis.label, textwrap.fill(data.y_label, LABEL_WIDTH))
        figure.align_ylabels()
        mark_lines(data, of_axes)
        set_text(axes.set_title("", loc="left", pad=4), "\n".join(title))
        if is_scaled(data):
            add_scale(figure, [axes, *panels], data)
        named = name_at_ends(axes, data)
        drawn = [pair for _, layers in of_axes for pair in layers]
        lines = len(title) - 1 + add_legend(figure, entries(data, drawn, named))
        lines += max(0, len(data.y_names) - LINES)
        height = HEIGHT + PANEL_HEIGHT * len(panels) + LINE_HEIGHT * lines
        figure.set_size_inches(size or (WIDTH, height))
        if not data.x_log:
            labels = axes.xaxis.get_major_formatter().format_ticks(list(axes.get_xticks()))
            beside = max(map(len, named), default=0)  # names at lines make the axes narrower
            room = TICKS_WIDTH * figure.get_figwidth() / WIDTH - beside
            room -= SCALE_WIDTH * is_scaled(data)
            axes.locator_params("x", nbins=min(MOST_TICKS, room // (1 + max(map(len, labels)))))
        # Once for all formats: laying out takes as long as drawing.
        layout.execute(figure)
        figure.set_layout_engine(None)
    return figure


def _added(axes: Axes, data: FigureData, layers: Sequence[Layer]) -> list[tuple[Layer, Any]]:
    """Draw layers from the back to the front; each with its artist for the legend."""
    markers = sum(len(layer.x) for layer in layers if isinstance(layer, Points))
    size = 2.8 if markers > MANY_MARKERS else 4.0
    drawn = [(layer, _artist(axes, layer, depth, data, size)) for depth, layer in enumerate(layers)]
    if layers is not data.layers or data.left_of_x:
        points = [(layer, bars) for layer, bars in drawn if isinstance(layer, Points)]
        _set_apart(axes, points, centred=layers is not data.layers)
    return drawn


APART = 4.0  # distance of markers of several series at one x of a panel, in points
WIDEST = 14.0  # way from the first of them to the last


def _set_apart(axes: Axes, drawn: Sequence[tuple[Points, Any]], *, centred: bool) -> None:
    """Move markers of several series at one x sideways, as far as each can be seen.

    centred : whether they stand around x, and not left of it

    Axes of residuals have all of them near zero; the x of their numbers stays.
    """
    of_series = {layer.series: layer.x for layer, _ in drawn if len(layer.x)}
    if not any(np.isin(x, y).any() for x, y in itertools.combinations(of_series.values(), 2)):
        return
    to_axes = axes.transScale + axes.transLimits
    columns = [np.column_stack([x, np.ones_like(x)]) for x in of_series.values() if len(x) > 1]
    gaps = [np.min(np.abs(np.diff(to_axes.transform(column)[:, 0]))) for column in columns]
    between = min(gaps, default=1.0) * axes.bbox.width / axes.figure.dpi * 72
    step = min(APART, min(WIDEST, between / 2) / (len(of_series) - 1)) / 72
    middle = (len(of_series) - 1) / 2 if centred else len(of_series)
    ranks = {series: rank - middle for rank, series in enumerate(of_series)}
    for layer, container in drawn:
        if layer.series in ranks:
            way = ScaledTranslation(ranks[layer.series] * step, 0, axes.figure.dpi_scale_trans)
            line, caps, bars = container
            for artist in (line, *caps, *bars):
                artist.set_transform(axes.transData + way)


def _artist(axes: Axes, layer: Layer, depth: int, data: FigureData, size: float) -> Any:
    """Draw a layer with markers of a size."""
    series = getattr(layer, "series", NEUTRAL)
    tint = colour(series, data.shades, data.hues)
    common: dict[str, Any] = {"color": tint, "zorder": 2 + depth / 100}
    match layer:
        case Line(x, y):
            return axes.plot(
                x,
                y,
                linestyle=layer.style,
                drawstyle="steps-post" if layer.steps else "default",
                linewidth=PATH if data.equal_axes and not layer.thin else _width(layer),
                alpha=0.45 if layer.broad else None,
                **common,
            )[0]
        case Band(x, low, high):
            common |= {"step": "post" if layer.steps else None}
            return axes.fill_between(x, low, high, alpha=BAND, linewidth=0, **common)
        case Repeats(x, rows):
            return axes.plot(x, rows.T, linewidth=0.4, alpha=0.45, linestyle=MEASURED, **common)[0]
        case Points(x, y):
            drawn = axes.errorbar(
                x,
                y,
                yerr=layer.y_error,
                linestyle="none",
                elinewidth=0.8,
                marker=marker(series, data),
                markersize=size,
                markerfacecolor=common["color"] if layer.filled else "white",
                markeredgewidth=0.7,
                # On a path of its own colour a marker needs an edge.
                markeredgecolor="white" if data.equal_axes and layer.filled else common["color"],
                **common,
            )
            drawn.lines[0].set(clip_on=False, in_layout=False)  # a marker on a limit is whole
            return drawn
        case Reference(axis, value):
            across = axes.axvline if axis == "x" else axes.axhline
            return across(value, linewidth=0.8, linestyle=layer.style, **common)


def _width(line: Line) -> float:
    if line.broad:
        return 2.6
    if line.thin:
        return 0.4
    if line.style != MEASURED or len(line.x) > MANY_VERTICES:
        return 0.9
    return 1.3


def _scale(axes: Axes, data: FigureData) -> None:
    axes.set_xscale("log" if data.x_log else "linear")
    axes.set_yscale("log" if data.y_log else "linear")
    axes.set_xlim(*data.x_limits)
    axes.set_ylim(*data.y_limits)
    if data.equal_axes:
        axes.set_aspect("equal", adjustable="datalim")
        axes.autoscale()
    below = [layer for panel in data.all_panels for layer in panel.layers]
    farthest = [np.max(layer.x) for layer in below if isinstance(layer, Points) and len(layer.x)]
    for axis, limits in ((axes.xaxis, data.x_limits), (axes.yaxis, data.y_limits)):
        _, highest = axis.get_data_interval()
        if axis is axes.xaxis:
            highest = max([highest, *farthest])
        least, most = limits
        if least is not None and most is None and least < highest < np.inf:
            # Matplotlib's margin is a share of the data's span, which may be nothing.
            high = highest + MARGIN * (highest - least)
            axis.set_view_interval(least, high, ignore=True)
    if data.y_names:
        axes.set_yticks(range(len(data.y_names)), data.y_names, parse_math=False)
        axes.set_ylim(len(data.y_names) - 0.5, -0.5)
        axes.tick_params("y", length=0)
        axes.grid(visible=False, axis="y")
    else:
        _clip(axes, data, data.layers, data.y_limits, logarithmic=data.y_log)
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            _few_decades(axis)


def _few_decades(axis: Axis, most: int | None = None) -> None:
    """Label a logarithmic axis also if it has few powers of ten, and without them if it can.

    most : labels at most; None leaves them to the height of the axis
    """
    low, high = axis.get_view_interval()
    least = LEAST_TICKS if most is None else FEWEST_TICKS
    few = [ticker.LogLocator(subs=subs, numticks=most) for subs in ((1, 2, 5), (1, 3))]
    for locator in (ticker.LogLocator(numticks=most), *few, ticker.AutoLocator()):
        axis.set_major_locator(locator)
        number = sum(low <= tick <= high for tick in axis.get_majorticklocs())
        if least <= number <= (most or number):
            break
    axis.set_minor_formatter(ticker.NullFormatter())
    if PLAIN[0] <= low and high < PLAIN[1]:
        axis.set_major_formatter("{x:g}")


def _clip(
    axes: Axes,
    data: FigureData,
    layers: Sequence[Layer],
    limits: Sequence[float | None],
    *,
    logarithmic: bool,
) -> None:
    """Let the y axis reach no farther than its data need; arrows mark what is outside."""
    low, high = axes.get_ylim()
    shown = [*visible(layers, *axes.get_xlim())]
    least, most = reach(shown, logarithmic)
    bottom = max(low, least) if limits[0] is None else low
    top = min(high, most) if limits[1] is None else high
    if (bottom, top) != (low, high):
        axes.set_ylim(bottom, top)
    for beyond in outside(shown, bottom, top, limits[0]):
        axes.plot(
            beyond.x,
            np.full(len(beyond.x), top if beyond.above else bottom),
            linestyle="none",
            marker=rf"$\{'up' if beyond.above else 'down'}arrow$",
            color=colour(beyond.series, data.shades, data.hues),
            clip_on=False,
            in_layout=False,
            zorder=5,
        )


# Figure data -> SVG, PNG and JSON, the same bytes every time.

METADATA: dict[str, dict[str, str | None]] = {
    "svg": {"Date": None, "Creator": "snooker"},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": "snooker", "Producer": None},
}
"""Metadata of each format of an image, without dates and versions."""


def save(
    data: FigureData,
    stem: Path,
    formats: Sequence[str] = ("svg", "png"),
    size: tuple[float, float] | None = None,
    dpi: float | None = None,
    outlines: bool = False,
) -> list[Path]:
    """Write the image as ``stem.svg`` and so on, and ``stem.json``; the folder is made if need be.

    formats : of ``METADATA``
    size : width and height, inches; None is a column of a page
    dpi : pixels per inch of a PNG; None is that of the style
    outlines : whether letters of an SVG are outlines, for a document that may lack the font

    Title and caption are also in the metadata of the images.
    """
    # Not with_suffix: a stem may have a point, as in `energy-fit-cor-0.8`.
    paths = [stem.with_name(f"{stem.name}.{ending}") for ending in (*formats, "json")]
    with styled(), matplotlib.rc_context({"svg.fonttype": "path" if outlines else "none"}):
        figure = draw(data, size)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # texts and axes have their places for all formats
        for form, path in zip(formats, paths, strict=False):
            caption = {"Subject" if form == "pdf" else "Description": data.caption}
            metadata = {"Title": data.title} | caption | METADATA[form]
            with atomic_write(path) as part:
                figure.savefig(part, format=form, metadata=metadata, dpi=dpi or "figure")
    write_text(paths[-1], to_json(data))
    return paths


def to_json(data: FigureData) -> str:
    """The figure as JSON: its words, its numbers, and the data of each layer, but no balls.

    Numbers have the shortest decimals that mean the same doubles; what is not finite is null.
    """
    content = dict(vars(data))
    pictures = content.pop("pictures")
    if pictures is not None:  # a million balls are no numbers of a figure
        content["pictures"] = {
            "times": [picture.time for picture in pictures.each],
            **{name: getattr(pictures, name) for name in ("label", "limits", "names")},
        }
    for name in ("layers", "panel"):
        content[name] = _layers(content[name])
    content["panels"] = [vars(p) | {"layers": _layers(p.layers)} for p in data.panels]
    return json.dumps(plain(content), ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def _layers(layers: Sequence[Layer]) -> list[dict[str, Any]]:
    return [{"type": type(layer).__name__.lower()} | vars(layer) for layer in layers]
