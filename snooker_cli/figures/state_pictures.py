"""Pictures of states -> a matplotlib figure: few balls as circles, many as pixels or cells.

A million circles would take minutes and 100 MB. Pixels take seconds, and their number does not
depend on the number of balls.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli.figures.figure_data import FigureData, Picture, Pictures, Wall
from snooker_cli.figures.legends import _SHADES, LIGHTEST, colour
from snooker_cli.figures.style import LINE_HEIGHT, WIDTH, SnookerFigure, styled, title_lines
from snooker_cli.files import out_of_sight
from snooker_cli.formatting import short

with out_of_sight("matplotlibrc"):
    from matplotlib import rcParams
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import EllipseCollection, LineCollection
    from matplotlib.colors import Colormap, ListedColormap, Normalize, to_rgb
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch, Polygon
    from matplotlib.transforms import ScaledTranslation

MOST_CIRCLES = 3000  # balls of a picture that are drawn as circles
WIDE, MOST_COLUMNS = 7.0, 4  # width of many pictures, inches: of a page; pictures in a row
MOST_IN_COLUMN = 4  # pictures of a figure as wide as a column of a page
BAR = 0.25  # length of the scale bar over the width of the container, at most
BAR_HEIGHT = 0.16  # of the space for the scale bar, inches
PIXELS = 900  # of the longer side of a picture, or of a row of them
FINER = 3  # parts of a side of a pixel at most, so that balls smaller than a pixel have their area
PALE = 0.9  # of the palette, for the lowest density; its last part is hardly darker than white
EMPTY = "white"  # the ground of each picture, and what is below the scale of a density
MARGIN = 0.02  # around the container, over its size
BELOW, SCALE = 0.7, 0.04  # height of the colour scale with its texts, inches; its share of that
TITLE_HEIGHT = 0.22  # of the time above a picture, inches


def draw_pictures(data: FigureData, pictures: Pictures, size: tuple[float, float] | None) -> Figure:
    """The pictures in rows, with a common scale of colours below.

    size : width and height in inches; None is as wide as a column of a page for up to four
        pictures, and as a page for more
    """
    number = len(pictures.each)
    columns = 2 if number == MOST_IN_COLUMN and size is None else min(number, MOST_COLUMNS)
    rows = math.ceil(number / columns)
    width = size[0] if size else WIDTH if number <= MOST_IN_COLUMN else WIDE
    title = title_lines(data.title, width)
    high = max(picture.size[1] / picture.size[0] for picture in pictures.each)
    height = rows * (high * (width - 0.4) / columns + TITLE_HEIGHT) + BAR_HEIGHT + BELOW
    marks, names = _key(pictures, colours := _colours(pictures))
    height += LINE_HEIGHT * (len(title) + math.ceil(len(names) / 2))
    with styled():
        layout = ConstrainedLayoutEngine()
        figure = SnookerFigure(size or (width, height), layout=layout)
        FigureCanvasAgg(figure)
        grid = list(figure.subplots(rows, columns, squeeze=False).flat)
        for axes, picture in zip(grid, pictures.each, strict=False):
            _draw(axes, picture, pictures, colours, PIXELS // columns if number > 1 else PIXELS)
        for axes in grid[number:]:
            axes.set_visible(False)
        _add_bar(grid[columns * (rows - 1)], pictures.each[0].size)
        heading = {"fontsize": rcParams["axes.titlesize"], "fontweight": "bold"}
        figure.suptitle("\n".join(title), x=0.01, ha="left", parse_math=False, **heading)
        if names:
            figure.legend(marks, names, loc="outside lower center", ncols=2)
        if not pictures.names:
            scale = figure.colorbar(
                _mappable(pictures, colours),
                ax=grid,
                orientation="horizontal",
                extend="both" if pictures.high_is_dark else "max",
                shrink=0.8 if number <= MOST_IN_COLUMN else 0.4,
                fraction=SCALE * (2 if rows == 1 and number > 1 else 1),
                pad=0.04,
            )
            scale.set_label(pictures.label, parse_math=False)
        layout.execute(figure)
        if size is None:  # pictures as wide as they can be may leave height
            unused = rows * height * min(map(_unused_height, grid[:number]))
            figure.set_size_inches(width, height - unused)
            layout.execute(figure)
        figure.set_layout_engine(None)
    return figure


def _key(pictures: Pictures, colours: Colormap) -> tuple[list[Any], list[str]]:
    """What stands in the key, and the names: of species, and of walls."""
    marks: list[Any] = [
        Line2D([], [], linestyle="none", marker="o", color=colours(k))
        for k in range(len(pictures.names))
    ]
    marks += [Line2D([], [], **_wall_style(wall)) for wall in pictures.walls]
    return marks, [*pictures.names, *(wall.name for wall in pictures.walls)]


def _wall_style(wall: Wall) -> dict[str, Any]:
    """How a wall looks: its temperature as a colour, cold ones dark; short dashes if it drives."""
    if wall.heat is not None:
        return {"color": _SHADES(LIGHTEST * wall.heat), "linewidth": 3.0}
    if wall.drives:
        return {"color": "0.2", "linewidth": 3.0, "linestyle": (0, (0.4, 0.6))}
    return {"color": "0.2", "linewidth": 0.8}


def _unused_height(axes: Axes) -> float:
    """The height of the place of a picture less that of the picture, as a share of the figure's."""
    axes.apply_aspect()
    return float(axes.get_position(original=True).height - axes.get_position().height)


def _colours(pictures: Pictures) -> Colormap:
    """The colours of values from 0 to 1, or those of the names."""
    if pictures.names:
        return ListedColormap([to_rgb(colour(k)) for k in range(len(pictures.names))])
    shades = np.linspace(0.0, PALE if pictures.high_is_dark else LIGHTEST, 256)
    colours = ListedColormap(_SHADES(shades[::-1] if pictures.high_is_dark else shades))
    return colours.with_extremes(under=EMPTY) if pictures.high_is_dark else colours


def _mappable(pictures: Pictures, colours: Colormap) -> Any:
    from matplotlib.cm import ScalarMappable

    return ScalarMappable(Normalize(*pictures.limits), colours)


def _rgb(picture: Picture, pictures: Pictures, colours: Colormap) -> NDArray[np.float64]:
    """The colour of each ball, (*N*, 3), from 0 to 1."""
    if pictures.names:
        return np.asarray(colours(picture.values.astype(int)))[:, :3]
    return np.asarray(colours(Normalize(*pictures.limits, clip=True)(picture.values)))[:, :3]


def _draw(axes: Axes, picture: Picture, pictures: Pictures, colours: Colormap, pixels: int) -> None:
    """A container with its balls, and the time above."""
    width, height = picture.size
    inside = axes.add_patch(Polygon(picture.outline, facecolor="none", edgecolor="none"))
    if len(picture.radii) <= MOST_CIRCLES:
        _draw_circles(axes, picture, _rgb(picture, pictures, colours), inside)
    else:
        place: dict[str, Any] = {"origin": "lower", "zorder": 2}
        place["extent"] = (-width / 2, width / 2, -height / 2, height / 2)
        if picture.cells is None:
            image = raster(picture, _rgb(picture, pictures, colours), pixels)
            drawn = axes.imshow(image, interpolation="antialiased", **place)
        else:  # balls smaller than a dot would be paler than the scale
            lowest, scale = pictures.limits[0], Normalize(*pictures.limits)
            cells = np.where(picture.cells > 0, np.maximum(picture.cells, lowest), -math.inf)
            drawn = axes.imshow(cells, interpolation="nearest", cmap=colours, norm=scale, **place)
        drawn.set_clip_path(inside)
    corners = picture.outline
    edges = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    vertical = np.isclose(edges[:, 0, 0], edges[:, 1, 0]) & (len(corners) == 4)
    open_edges = np.where(vertical, picture.periodic[0], picture.periodic[1])
    for repeats in (False, True):
        lines = LineCollection([*edges[open_edges == repeats]], colors="0.2", linewidths=0.8)
        lines.set_linestyle((0, (2, 2)) if repeats else "solid")
        axes.add_collection(lines)
        lines.set_zorder(3)
    for wall in pictures.walls:
        style = _wall_style(wall) | {"capstyle": "butt" if wall.drives else "projecting"}
        axes.add_collection(LineCollection([*wall.lines], zorder=3, clip_on=False, **style))
    axes.set_aspect("equal")
    margin = MARGIN * max(width, height)
    axes.set_xlim(-width / 2 - margin, width / 2 + margin)
    axes.set_ylim(-height / 2 - margin, height / 2 + margin)
    axes.set_axis_off()
    axes.set_title(f"t = {short(picture.time, 4)} s", fontweight="normal", pad=2, parse_math=False)


def _add_bar(axes: Axes, size: tuple[float, float]) -> None:
    """A scale bar below the container, with its length: 1, 2 or 5 of a power of ten, m."""
    longest = BAR * size[0]
    unit = 10.0 ** math.floor(math.log10(longest))
    length = next(step * unit for step in (5, 2, 1) if step * unit <= longest)
    left, below = -size[0] / 2, -size[1] / 2 - MARGIN * max(size)
    lower = ScaledTranslation(0, -BAR_HEIGHT / 2, axes.figure.dpi_scale_trans)
    (bar,) = axes.plot([left, left + length], [below, below], color="0.2", linewidth=1.5)
    bar.set_solid_capstyle("butt")  # else it is longer by its width
    bar.set(transform=axes.transData + lower, clip_on=False)
    axes.annotate(
        f"{short(length)} m",
        (left + length, below),
        (3, -36 * BAR_HEIGHT),
        textcoords="offset points",
        verticalalignment="center",
        annotation_clip=False,
    )


def _draw_circles(axes: Axes, picture: Picture, rgb: NDArray[np.float64], inside: Patch) -> None:
    """Circles, and those of images that reach into the container; inside: its outline."""
    places, balls = _with_images(picture)
    diameters = 2 * picture.radii[balls]
    circles = EllipseCollection(
        diameters,
        diameters,
        np.zeros(len(balls)),
        units="xy",
        offsets=places,
        offset_transform=axes.transData,
        facecolors=rgb[balls],
        linewidths=0,
        zorder=2,
    )
    axes.add_collection(circles)
    if any(picture.periodic):
        circles.set_clip_path(inside)


def _with_images(picture: Picture) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Places of balls and of images that reach into the container, and the ball of each."""
    places, balls = picture.places, np.arange(len(picture.radii))
    for axis, (side, repeats) in enumerate(zip(picture.size, picture.periodic, strict=True)):
        if not repeats:
            continue
        beyond = np.abs(places[:, axis]) + picture.radii[balls] > side / 2
        images = places[beyond].copy()
        images[:, axis] -= np.copysign(side, images[:, axis])
        places, balls = np.concatenate([places, images]), np.append(balls, balls[beyond])
    return places, balls


def raster(picture: Picture, rgb: NDArray[np.float64], pixels: int) -> NDArray[np.uint8]:
    """The balls as pixels with red, green, blue and cover, (*rows*, *columns*, 4), 0 to 255.

    rgb : (*N*, 3), from 0 to 1
    pixels : of the longer side

    A pixel has the mean colour of its parts that balls cover. A ball covers one part at least.
    """
    places, balls = _with_images(picture)
    scale = pixels / max(picture.size)
    smallest = max(float(picture.radii.min()) * scale, 1e-9)
    finer = min(max(math.ceil(1 / smallest), 1), FINER)
    columns, rows = (max(round(side * scale), 1) for side in picture.size)
    across, up = columns * finer, rows * finer
    fine = np.zeros((up, across, 3), dtype=np.float32)
    covered = np.zeros((up, across), dtype=bool)
    step = np.array(picture.size) / (across, up)
    centres = (places + np.array(picture.size) / 2) / step - 0.5  # of parts: 0, 1, 2 …
    radii = picture.radii[balls] / step.mean()
    nearest = np.rint(centres).astype(np.int64)
    colours = rgb.astype(np.float32)
    reaches = np.ceil(radii).astype(np.int64)
    for reach in np.unique(reaches):
        alike = np.flatnonzero(reaches == reach)
        offsets = np.arange(-reach, reach + 1)
        grid = np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
        # Over the offsets, or over the balls: whichever are fewer.
        loops = grid[:, np.newaxis] if len(grid) < len(alike) else [grid] * len(alike)
        for k, offset in enumerate(loops):
            chosen = alike if len(grid) < len(alike) else alike[k : k + 1]
            parts = nearest[chosen] + offset
            distances = np.hypot(*(parts - centres[chosen]).T)
            covers = (distances <= radii[chosen]) | np.all(np.asarray(offset) == 0, axis=-1)
            covers &= np.all((parts >= 0) & (parts < (across, up)), axis=1)
            x, y = parts[covers].T
            fine[y, x] = colours[balls[np.broadcast_to(chosen, covers.shape)[covers]]]
            covered[y, x] = True
    shares = covered.reshape(rows, finer, columns, finer).mean(axis=(1, 3))
    sums = fine.reshape(rows, finer, columns, finer, 3).sum(axis=(1, 3)) / finer**2
    means = sums / np.maximum(shares, 1e-9)[..., np.newaxis]
    image = np.concatenate([means, shares[..., np.newaxis]], axis=-1)
    return np.asarray(np.rint(255 * image).clip(0, 255), dtype=np.uint8)
