"""A film -> a GIF or an MP4 of its frames."""

from __future__ import annotations

import math
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from PIL import Image

from snooker_cli.animation.frames import SPEED_COLOURS, Frame, Timeline, frames, view
from snooker_cli.errors import UserError
from snooker_cli.figures.drawing import colour, styled
from snooker_cli.formatting import short

Floats: TypeAlias = NDArray[np.float64]

WIDTH, HEIGHT, DPI = 8.4, 4.8, 100
"""Inches and dots per inch: 840 by 480 pixels; an MP4 needs even numbers."""

FULL_TITLE, LONG_TITLE = 45, 64
"""Characters: longer titles are printed smaller, and then cut."""

INK, SOFT, AMBER, FLOOR = "#1c2430", "#5b6675", "#e76300", "#f7f9fb"
RIM = (0.08, 0.09, 0.14, 0.75)

_CURVES = (
    ("kinetic energy", "J", 0),
    ("temperature", "J", 2),
    ("mean pressure since t = 0", "Pa m", 4),
)
"""Name, unit and colour's series, from the top."""

PLAIN = ("white", FLOOR, INK, SOFT, AMBER, *(colour(series) for _, _, series in _CURVES))
"""All colours except those of the balls."""


class Screen:
    """The figure of a film; resting parts are drawn once, and ``image`` adds the moving parts."""

    def __init__(self, timeline: Timeline, magnify: float) -> None:
        film = timeline.film
        self.film, self.magnify, self.seen = film, magnify, view(film, magnify)
        self.figure = figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DPI, facecolor="white")
        self.canvas: Any = FigureCanvasAgg(figure)  # its methods have no types
        centred: dict[str, Any] = {"va": "center"}
        title = film.title if len(film.title) <= LONG_TITLE else f"{film.title[: LONG_TITLE - 2]} …"
        size = 12 * min(1, FULL_TITLE / len(title))
        figure.text(0.02, 0.955, title, color=INK, size=size, weight="bold", **centred)
        enlarged = f"dashed: the container, its motion × {magnify:,.15g}" if magnify > 1 else ""
        about = "; ".join(each for each in (film.subtitle, enlarged) if each)
        figure.text(0.02, 0.905, about, color=SOFT, **centred)
        self.clock = figure.text(0.585, 0.955, "", color=INK, size=11, weight="bold", **centred)
        self.count = figure.text(0.985, 0.955, "", color=SOFT, ha="right", **centred)
        self.ending = figure.text(0.02, 0.025, "", color="#a8380f", size=7, **centred)
        self._furnish(figure.add_axes((0.01, 0.11, 0.53, 0.76)))
        self._add_scale()
        self._add_curves(by_collision=timeline.pace == "events")
        texts = (self.clock, self.count, self.ending)
        self.moving: list[Artist] = [*texts, self.floor, self.balls, self.wall]
        if magnify > 1:
            self.moving += [self.enlarged, self.path]
        self.moving.append(self.flashes)
        for curve in self.curves:
            self.moving += [curve.line, curve.point, curve.value]
        for artist in (*self.moving, self.enlarged, self.path):
            artist.set_animated(True)
        self._draw_resting_parts()

    def _draw_resting_parts(self) -> None:
        self.canvas.draw()
        self.still = self.canvas.copy_from_bbox(self.figure.bbox)

    def image(self, frame: Frame) -> NDArray[np.uint8]:
        """(*height*, *width*, 3) the pixels of a frame: red, green and blue."""
        self._set(frame)
        self.canvas.restore_region(self.still)
        for artist in self.moving:
            self.figure.draw_artist(artist)
        return np.array(self.canvas.buffer_rgba(), dtype=np.uint8)[:, :, :3]

    def _set(self, frame: Frame) -> None:
        """Set the moving parts to a frame."""
        film, scene = self.film, self.film.trace.start
        origin = frame.container if self.seen.follow else np.zeros(2)
        centre = frame.container - origin
        for patch in (self.floor, self.wall):
            self._move(patch, centre)
        home = film.opening.container_positions[0]
        enlarged = home + self.magnify * (frame.container - home)
        self._move(self.enlarged, enlarged)
        self.path.set_data(*np.transpose([home, enlarged]))
        which, places = _seen(frame.positions - origin, scene.radii, centre, scene.container.period)
        colours, scale = self.colours
        _set(self.balls, places, scene.radii[which], facecolors=colours(scale(frame.speeds[which])))
        self._flash(frame, origin)
        self.clock.set_text(f"t = {frame.time:.{_digits(film.end - film.start)}f} s")
        self.count.set_text(
            f"collision {film.before + frame.collisions:,} of {film.before + len(film):,}"
        )
        self.ending.set_text(film.ending if frame.time >= film.end else "")
        energy = float(film.kinetic_energy[frame.collisions])
        pressure = float(film.pressure(np.array([frame.time]))[0])
        values = (energy, energy / scene.number, pressure)
        now = float(frame.collisions) if self.by_collision else frame.time
        for curve, value in zip(self.curves, values, strict=True):
            curve.grow(frame.collisions + 1, now, value)

    def _furnish(self, axes: Axes) -> None:
        """Add the container, its enlarged motion, the balls and the flashes."""
        self.arena = axes
        axes.set_axis_off()
        axes.set_aspect("equal")
        spare = self.magnify * self.seen.farthest if self.magnify > 1 else 0.0
        left, right, bottom, top = self.seen.extent
        axes.set_xlim(left - spare, right + spare)
        axes.set_ylim(bottom - spare, top + spare)
        container = self.film.trace.start.container
        self.outline, periodic = container.outline, not container.has_wall
        self.floor = self._container(facecolor=FLOOR, edgecolor="none")
        self.wall = self._container(
            facecolor="none",
            edgecolor=SOFT if periodic else INK,
            linestyle=(0, (4, 3)) if periodic else "solid",
            linewidth=0.8 if periodic else 1.4,
        )
        self.enlarged = self._container(
            facecolor="none", edgecolor=AMBER, linestyle=(0, (5, 3)), linewidth=1.2
        )
        self.path = axes.plot([], [], color=AMBER, linewidth=1.2)[0]
        scale = LinearSegmentedColormap.from_list("speed", SPEED_COLOURS)
        self.colours = scale, Normalize(0.0, self.film.top_speed, clip=True)
        self.balls = _discs(axes, edgecolors=[RIM], linewidths=0.5)
        self.flashes = _discs(axes, facecolors="none", linewidths=1.6, clip_on=False)
        if periodic:
            self._move(self.floor, self.film.opening.container_positions[0])
            self.balls.set_clip_path(self.floor)

    def _container(self, **look: Any) -> Polygon:
        """A patch with the shape of the container."""
        patch = Polygon(self.outline, **look)
        self.arena.add_patch(patch)
        return patch

    def _move(self, patch: Polygon, centre: Floats) -> None:
        """Move a patch of the container to a centre."""
        patch.set_xy(self.outline + centre)

    def _flash(self, frame: Frame, origin: Floats) -> None:
        """Set the rings of recent contacts, wider and fainter with age."""
        film, ages = self.film, frame.ages
        reach = film.trace.start.radii[film.i[frame.flashes]]
        rings = np.repeat(to_rgba_array(AMBER), len(ages), axis=0)
        rings[:, 3] = (1 - ages) ** 1.5
        growth = 0.15 + 0.55 * (1 - (1 - ages) ** 2)
        _set(self.flashes, film.contacts[frame.flashes] - origin, reach * growth, edgecolors=rings)

    def _add_scale(self) -> None:
        """Add the colour scale below the container."""
        axes = self.figure.add_axes((0.175, 0.063, 0.2, 0.018))
        axes.imshow(np.linspace(0, 1, 256)[None], cmap=self.colours[0], aspect="auto")
        axes.set_axis_off()
        fast = f"{short(self.film.top_speed, 2)} m/s and faster"
        for x, text, side in ((0.165, "at rest", "right"), (0.385, fast, "left")):
            self.figure.text(x, 0.071, text, color=SOFT, size=7, va="center", ha=side)

    def _add_curves(self, *, by_collision: bool) -> None:
        """Add the panels of the three curves."""
        film, self.by_collision = self.film, by_collision
        steps = np.arange(len(film) + 1.0) if by_collision else film.rows
        end = max(len(film), 1.0) if by_collision else film.end
        energy = film.kinetic_energy
        columns = (energy, energy / film.trace.start.number, film.pressure(film.rows))
        self.curves = []
        for row, (words, values) in enumerate(zip(_CURVES, columns, strict=True)):
            axes = self.figure.add_axes((0.585, 0.655 - 0.265 * row, 0.4, 0.185))
            axes.set_xlim(float(steps[0]), end)
            axes.tick_params(labelbottom=row == len(_CURVES) - 1)
            self.curves.append(_Curve(axes, *words, steps, values))
        axes.set_xlabel("collisions shown" if by_collision else "time (s)")


class _Curve:
    """A panel with a growing curve; its name and current value are above it."""

    def __init__(
        self, axes: Axes, name: str, unit: str, series: int, steps: Floats, values: Floats
    ) -> None:
        self.axes, self.unit, self.steps, self.values = axes, unit, steps, values
        # The mean since t = 0 begins at the first collision.
        self.first = 1 if values[0] == 0 else 0
        shade = colour(series)
        axes.set_ylim(0, 1.08 * float(np.max(values)) or 1.0)
        axes.set_title(name, loc="left", fontweight="normal", color=INK, pad=5)
        self.line = axes.plot([], [], color=shade, clip_on=False)[0]
        self.point = axes.plot([], [], "o", color=shade, clip_on=False)[0]
        above: dict[str, Any] = {"xytext": (0, 5), "textcoords": "offset points", "ha": "right"}
        self.value = axes.annotate(
            "", (1, 1), xycoords="axes fraction", color=shade, weight="bold", **above
        )

    def grow(self, rows: int, now: float, value: float) -> None:
        """Show a number of rows, and the value now."""
        self.line.set_data(
            np.append(self.steps[self.first : rows], now),
            np.append(self.values[self.first : rows], value),
        )
        self.point.set_data([now], [value])
        self.value.set_text(f"{short(value)} {self.unit}")


def _discs(axes: Axes, **look: Any) -> EllipseCollection:
    """An empty collection of circles in the units of the axes."""
    discs = EllipseCollection(
        [], [], [], units="xy", offsets=np.empty((0, 2)), offset_transform=axes.transData, **look
    )
    axes.add_collection(discs)
    return discs


def _set(discs: EllipseCollection, centres: Floats, radii: Floats, **colours: Any) -> None:
    """Set places, sizes and colours of circles."""
    discs.set_offsets(centres)
    discs.set_widths(2 * radii)
    discs.set_heights(2 * radii)
    discs.set_angles(np.zeros(len(radii)))
    discs.set(**colours)


def _seen(
    places: Floats, radii: Floats, centre: Floats, period: tuple[float, float] | None
) -> tuple[NDArray[np.intp], Floats]:
    """Numbers and places of the visible balls; in a periodic box with their images at the edges."""
    if period is None:
        return np.arange(len(radii)), places
    half = np.array(period) / 2
    which, found = [], []
    for across in (-1, 0, 1):
        for along in (-1, 0, 1):
            images = places + np.array(period) * (across, along)
            inside = np.flatnonzero(np.all(abs(images - centre) < half + radii[:, None], axis=1))
            which.append(inside)
            found.append(images[inside])
    return np.concatenate(which), np.concatenate(found)


def _digits(span: float) -> int:
    """Decimals for a ten-thousandth of a span."""
    return max(0, 4 - math.ceil(math.log10(span)))


PALETTE_FRAMES = 3
"""Frames from which the palette of a GIF is made."""

MOST_FRAMES = 1200
"""In a GIF: each needs 0.4 MB of memory, and pages load it slowly."""

MP4_OPTIONS = ["-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"]
"""For ffmpeg: colours for every player, little loss, and the index at the front."""


def save_movie(
    timeline: Timeline, path: Path, *, seconds: float, rate: int, magnify: float = 1.0
) -> int:
    """Write a film to ``path``, a ``.gif`` or an ``.mp4``; return the number of frames.

    seconds : length of the movie
    rate : frames per second; a GIF rounds their length to hundredths of a second
    magnify : factor by which the container's motion is enlarged

    Raises ``UserError`` for an MP4 if ffmpeg is missing or fails, and for a GIF of more than
    ``MOST_FRAMES``.
    """
    gif = path.suffix.lower() == ".gif"
    if not gif and shutil.which("ffmpeg") is None:
        raise UserError(
            f"{path}: an MP4 needs ffmpeg, which is not on the PATH",
            "install it, or give a name that ends in .gif or .html",
            code="ffmpeg-missing",
        )
    count = max(2, round(seconds * rate))
    if gif and count > MOST_FRAMES:
        raise UserError(
            f"{path}: a GIF has at most {MOST_FRAMES:,} frames, not {count:,}",
            "give fewer seconds or frames per second, or a name that ends in .mp4",
            code="too-many-frames",
        )
    with styled():
        screen = Screen(timeline, magnify)
        if gif:
            sample = frames(timeline, PALETTE_FRAMES, seconds)
            writer: Any = _GifWriter(rate, _palette([screen.image(each) for each in sample]))
        else:
            writer = FFMpegWriter(fps=rate, codec="libx264", extra_args=MP4_OPTIONS)
        sheet = Figure(figsize=(WIDTH, HEIGHT), dpi=DPI)
        shown = sheet.figimage(np.zeros((round(HEIGHT * DPI), round(WIDTH * DPI), 3), np.uint8))
        try:
            with writer.saving(sheet, str(path), DPI):
                for frame in frames(timeline, count, seconds):
                    shown.set_data(screen.image(frame))
                    writer.grab_frame()
        except subprocess.CalledProcessError as error:
            raise UserError(
                f"{path}: ffmpeg could not write it (exit code {error.returncode})",
                "give a name that ends in .gif or .html",
                code="ffmpeg-failed",
            ) from None
    return count


class _GifWriter(PillowWriter):
    """Pillow's writer with one palette for all frames: no flicker, and a small file."""

    _frames: list[Image.Image]

    def __init__(self, rate: int, palette: Image.Image) -> None:
        super().__init__(fps=rate)
        self.palette = palette

    def grab_frame(self, **options: Any) -> None:
        super().grab_frame(**options)
        latest = self._frames.pop()
        self._frames.append(latest.quantize(palette=self.palette, dither=Image.Dither.NONE))


def _palette(images: Sequence[NDArray[np.uint8]]) -> Image.Image:
    """256 colours: the fixed ones, and the best ones for some (*height*, *width*, 3) images."""
    speeds = LinearSegmentedColormap.from_list("speed", SPEED_COLOURS)
    exact = np.vstack([to_rgba_array(PLAIN), speeds(np.linspace(0, 1, 56))])[:, :3]
    best = Image.fromarray(np.vstack(images)).quantize(256 - len(exact)).getpalette("RGB")
    others = np.reshape(best or [], (-1, 3))
    # Pillow looks for a colour in steps of 4: no other colour may be near white.
    others = np.where(others.min(axis=1, keepdims=True) > 247, 255, others)
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.vstack([(255 * exact).round(), others]).astype(int).ravel().tolist())
    return palette
