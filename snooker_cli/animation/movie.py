"""A film -> a GIF or an MP4 of its frames."""

import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from snooker_cli.animation.film import BATCH, Film, Pace, turned_by
from snooker_cli.engine import replayed
from snooker_cli.errors import UserError
from snooker_cli.figures.legends import colour
from snooker_cli.figures.style import styled
from snooker_cli.files import atomic_write, out_of_sight
from snooker_cli.formatting import short
from snooker_cli.pages.html_page import SPEED_COLOURS

with out_of_sight("matplotlibrc"):
    from matplotlib.animation import FFMpegWriter
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgba_array
    from matplotlib.figure import Figure
    from matplotlib.patches import Polygon
    from matplotlib.patheffects import withStroke

Floats: TypeAlias = NDArray[np.float64]
Pixels: TypeAlias = NDArray[np.uint8]

WIDTH, HEIGHT, DPI = 8.4, 4.8, 100
"""Inches and dots per inch: 840 by 480 pixels; an MP4 needs even numbers."""

FULL_TITLE = 45  # characters: longer titles are printed smaller

INK, SOFT, GREEN = "#1c2430", "#5b6675", "#009e73"  # no speed has the green of contacts
RIM = (0.08, 0.09, 0.14, 0.75)

PALETTE_FRAMES = 3
"""Frames from which the palette of a GIF is made: one for all frames, so that nothing flickers."""

SMALLEST = 2.0  # points: the diameter of balls that would be too small to see
MOST_FRAMES = 1200  # in a GIF: each needs 0.4 MB of memory, and pages load it slowly

FLASH = 0.3  # how long a contact flashes, s of playing; as in arena.js
MOST_FLASHES = 60  # the latest ones: more would hide the balls; as in arena.js

# As in panels.js: bins of speeds over √(2T/m), the last with all faster balls, and the
# share of the balls at the top of the panel. A speed this little below an edge (in bins) is above
# it, so that equal speeds are in one bin.
BIN, BINS, MOST_SHARE, EDGE = 0.2, 15, 0.25, 1e-9

MP4_OPTIONS = ["-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart", "-f", "mp4"]
"""For ffmpeg: colours for every player, little loss, and the index at the front."""


@dataclass(frozen=True)
class Frame:
    """What a film shows at a time (s), after this number of its collisions.

    positions, speeds : (*N*, 2) m, in a periodic box inside it; (*N*,) m/s
    container : (2,) m, its centre
    flashes, ages : the collisions that flash, at most ``MOST_FLASHES``; 0 at the contact, 1 in
        the end
    angles : (*N*,) rad, by which rough balls have turned since the repeat's start; or ``None``
    """

    time: float
    collisions: int
    positions: Floats
    speeds: Floats
    container: Floats
    flashes: NDArray[np.intp]
    ages: Floats
    angles: Floats | None = None


def frames(film: Film, pace: Pace, count: int, seconds: float) -> Iterator[Frame]:
    """Frames of a film, the first at its start and the last at its end.

    pace : with "events" each collision takes the same part, and so does the time after the last
    count : number of frames, at least 2
    seconds : s, how long it plays; a contact flashes for ``FLASH`` of it
    """
    # From 0 to 1: when frames are shown, and the start, the collisions and the end of the film.
    moments = np.append(film.rows, film.end)
    shown, knots = np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, len(moments))
    if pace == "time":
        knots = (moments - film.start) / (film.end - film.start)
    # Rounding must not move the last frame beyond the end.
    times = np.clip(np.interp(shown, knots, moments), film.start, film.end)
    collisions = np.searchsorted(film.time, times, side="right")
    hit, flash = knots[1:-1], FLASH / seconds
    recent = np.searchsorted(hit, shown - flash, side="right")
    batches = replayed(film.trace, times, BATCH)
    rows = ((states, row) for states in batches for row in range(len(states.time)))
    events, counted, turned, angles = film.trace.events, 0, np.zeros(1), None
    assert events is not None
    for frame, (states, row) in enumerate(rows):
        done = collisions[frame]
        if states.spins is not None:
            now = film.before + int(done)
            turned = turned + turned_by(events[counted:now], film.trace.start)
            angles, counted = states.spins[row] * times[frame] + turned, now
        flashes = np.arange(max(min(recent[frame], done), done - MOST_FLASHES), done)
        yield Frame(
            time=float(times[frame]),
            collisions=int(done),
            positions=states.positions[row],
            speeds=np.hypot(*states.velocities[row].T),
            container=states.container_position[row],
            flashes=flashes,
            ages=np.clip((shown[frame] - hit[flashes]) / flash, 0.0, 1.0),
            angles=angles,
        )


class Screen:
    """The figure of a film; resting parts are drawn once, and ``image`` adds the moving parts."""

    def __init__(self, film: Film, pace: Pace) -> None:
        self.film, self.by_collision = film, pace == "events"
        self.figure = figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DPI, facecolor="white")
        self.canvas = cast(Any, FigureCanvasAgg(figure))  # its methods have no types
        self.moving: list[Artist] = []
        size = 12 * min(1, FULL_TITLE / max(1, len(film.title)))
        self._text(0.02, 0.955, film.title, color=INK, size=size, weight="bold")
        self._text(0.02, 0.905, film.subtitle, color=SOFT)
        self.clock = self._moves(self._text(0.585, 0.955, color=INK, size=11))
        self.count = self._moves(self._text(0.98, 0.955, color=SOFT, ha="right"))
        self.ending = self._moves(self._text(0.02, 0.025, color="#a8380f", size=7))
        self._add_container(figure.add_axes((0.01, 0.11, 0.53, 0.76)))
        self._add_panels()
        self.colours = LinearSegmentedColormap.from_list("speed", SPEED_COLOURS)
        self.scale = Normalize(0.0, film.top_speed, clip=True)
        axes = figure.add_axes((0.175, 0.063, 0.2, 0.018))
        axes.imshow(np.linspace(0, 1, 256)[None], cmap=self.colours, aspect="auto")
        axes.set_axis_off()
        self._text(0.165, 0.071, "at rest", color=SOFT, size=7, ha="right")
        fast = f"{short(film.top_speed, 2)} m/s and faster"
        self._text(0.385, 0.071, fast, color=SOFT, size=7)
        self._text(0.02, 0.071, "○", color=GREEN, size=9, weight="bold")
        self._text(0.037, 0.071, "contact", color=SOFT, size=7)
        self.canvas.draw()
        self.still = self.canvas.copy_from_bbox(figure.bbox)

    def image(self, frame: Frame) -> Pixels:
        """(*height*, *width*, 3) the pixels of a frame: red, green and blue."""
        film, scene = self.film, self.film.trace.start
        origin = frame.container if film.follow else np.zeros(2)
        centre = frame.container - origin
        self.wall.set_xy(scene.container.outline + centre)
        self.sides.set_segments(scene.container.wall_lines + centre)
        which, places = _seen(frame.positions - origin, scene.radii, centre, scene.container.period)
        colours = self.colours(self.scale(frame.speeds[which]))
        self._place(self.balls, places, scene.radii[which], facecolors=colours)
        if frame.angles is not None:
            turned = frame.angles[which]
            lines = scene.radii[which] * np.array([np.cos(turned), np.sin(turned)])
            self.marks.set_segments(np.stack([places, places + lines.T], axis=1))
        # Rings of recent contacts, wider and fainter with age.
        reach = scene.radii[film.i[frame.flashes]]
        rings = np.repeat(to_rgba_array(GREEN), len(reach), axis=0)
        rings[:, 3] = (1 - frame.ages) ** 1.5
        growth = 0.15 + 0.55 * (1 - (1 - frame.ages) ** 2)
        contacts = film.contacts[frame.flashes] - origin
        self._place(self.flashes, contacts, reach * growth, edgecolors=rings)
        self.clock.set_text(f"t = {film.time_text(frame.time)} s")
        self.count.set_text(
            f"collision {film.before + frame.collisions:,} of {film.before + len(film):,}"
        )
        self.ending.set_text(film.ending if frame.time >= film.end else "")
        moving = float(film.kinetic_energy[frame.collisions])
        energy = moving + float(film.spin_energy[frame.collisions])
        pressure = float(film.pressure(np.array([frame.time]))[0])
        now = float(frame.collisions) if self.by_collision else frame.time
        rows = slice(frame.collisions + 1)
        for (line, point, text, unit, column), value in zip(
            self.curves, (energy, pressure), strict=True
        ):
            line.set_data(np.append(self.steps[rows], now), np.append(column[rows], value))
            point.set_data([now], [min(value, point.axes.get_ylim()[1])])
            text.set_text(f"{short(value, 4)} {unit}")
        temperature = moving / scene.number
        reduced = frame.speeds * np.sqrt(scene.masses / (2 * temperature or 1.0))
        bins = np.minimum(reduced / BIN + EDGE, BINS - 1).astype(int)
        self.bars.set_data(np.bincount(bins, minlength=BINS) / scene.number)
        self.temperature.set_text(f"T = {short(temperature, 4)} J")
        self.canvas.restore_region(self.still)
        for artist in self.moving:
            self.figure.draw_artist(artist)
        return np.array(self.canvas.buffer_rgba(), dtype=np.uint8)[:, :, :3]

    def _place(self, discs: Any, centres: Floats, radii: Floats, **colours: Any) -> None:
        sizes = np.maximum(2 * radii * self.points, SMALLEST) ** 2
        discs.set(offsets=centres, sizes=sizes, **colours)

    def _moves(self, artist: Any) -> Any:
        """Draw an artist anew in each frame, on top of those added before."""
        artist.set_animated(True)
        self.moving.append(artist)
        return artist

    def _text(self, x: float, y: float, text: str = "", **look: Any) -> Any:
        return self.figure.text(x, y, text, va="center", parse_math=False, **look)

    def _add_container(self, axes: Axes) -> None:
        axes.set_axis_off()
        axes.set_aspect("equal")
        left, right, bottom, top = self.film.extent
        axes.set_xlim(left, right)
        axes.set_ylim(bottom, top)
        axes.apply_aspect()
        self.points = axes.get_window_extent().width * 72 / DPI / float(np.diff(axes.get_xlim())[0])
        container = self.film.trace.start.container
        look: dict[str, Any] = {"edgecolor": INK, "linewidth": 1.4}
        if container.period is not None:
            look = {"edgecolor": SOFT, "linewidth": 0.8, "linestyle": (0, (4, 3))}
        self.balls = self._moves(axes.scatter([], [], edgecolors=[RIM], linewidths=0.5))
        edge = [withStroke(linewidth=2.2, foreground=RIM)]  # so that each colour of balls shows it
        self.marks = self._moves(
            LineCollection([], colors="white", path_effects=edge, linewidths=1)
        )
        axes.add_collection(self.marks)
        self.wall = self._moves(Polygon(container.outline, facecolor="none", **look))
        axes.add_patch(self.wall)
        lines: dict[str, Any] = {"colors": INK, "linewidths": 1.4 * (container.period is not None)}
        self.sides = self._moves(LineCollection([], **lines))
        axes.add_collection(self.sides)
        rings: dict[str, Any] = {"facecolors": "none", "linewidths": 1.6, "clip_on": False}
        self.flashes = self._moves(axes.scatter([], [], **rings))
        if container.period is not None:
            self.balls.set_clip_path(self.wall)
            self.marks.set_clip_path(self.wall)

    def _add_panels(self) -> None:
        film = self.film
        self.steps = np.arange(len(film) + 1.0) if self.by_collision else film.rows
        energy, pressure = film.kinetic_energy + film.spin_energy, film.pressure(film.rows)
        pressure[pressure == 0] = np.nan  # it begins at the first collision
        self.curves: list[Any] = []
        for bottom, name, unit, shade, values, top in (
            (0.69, "kinetic energy", "J", colour(0), energy, energy.max()),
            (0.44, "mean pressure since t = 0", "Pa m", colour(4), pressure, film.pressure_top),
        ):
            axes, text = self._panel(bottom, name, shade, 1.08 * top or 1.0)
            axes.set_xlim(
                float(self.steps[0]), max(len(film), 1.0) if self.by_collision else film.end
            )
            line, point = axes.plot([], [], "-", [], [], "o", color=shade, clip_on=False)
            line.set_clip_on(True)
            self.curves.append((self._moves(line), self._moves(point), text, unit, values))
            if film.haff_rate is not None and values is energy:
                start = film.trace.start.kinetic_energy + film.trace.start.spin_energy
                law = start / (1 + film.haff_rate * film.rows) ** 2
                axes.plot(
                    self.steps, law, "--", color=INK, linewidth=0.8, label="Haff’s law, fitted"
                )
                axes.legend(loc="upper right")
            axes.tick_params(labelbottom=values is pressure)
        axes.set_xlabel("collisions shown" if self.by_collision else "time (s)")
        axes, self.temperature = self._panel(0.11, "balls by speed now", colour(2), MOST_SHARE)
        edges, speeds = BIN * np.arange(BINS + 1), np.linspace(0.0, BIN * BINS, 121)
        axes.set_xlim(0.0, BIN * BINS)
        self.bars = self._moves(
            axes.stairs(edges[1:], edges, fill=True, color=colour(2), alpha=0.6)
        )
        law = BIN * 2 * speeds * np.exp(-(speeds**2))
        axes.plot(speeds, law, "--", color=INK, linewidth=0.8, label="Maxwell’s law")
        axes.legend(loc="upper right")
        axes.set_xlabel(f"speed ÷ √(2T/m); last bar: {BIN * (BINS - 1):.1f} and more")

    def _panel(self, bottom: float, name: str, shade: str, top: float) -> tuple[Axes, Any]:
        """Axes below their name, and the text of the current value there."""
        axes = self.figure.add_axes((0.585, bottom, 0.395, 0.155))
        axes.set_ylim(0.0, top)
        axes.set_title(name, loc="left", fontweight="normal", color=INK, pad=5)
        return axes, self._moves(axes.set_title("", loc="right", color=shade, pad=5))


def _seen(
    places: Floats, radii: Floats, centre: Floats, period: tuple[float, float] | None
) -> tuple[NDArray[np.intp], Floats]:
    """Numbers and places of the visible balls; in a periodic box with their images at the edges."""
    if period is None:
        return np.arange(len(radii)), places
    steps = np.array([(across, along) for across in (-1, 0, 1) for along in (-1, 0, 1)])
    images = places + np.array(period) * steps[:, None]
    inside = np.all(abs(images - centre) < np.array(period) / 2 + radii[:, None], axis=2)
    image, which = np.nonzero(inside)
    return which, images[image, which]


def save_movie(film: Film, path: Path, *, pace: Pace, seconds: float, rate: int) -> None:
    """Write a film to ``path``, a ``.gif`` or an ``.mp4``.

    seconds : length of the movie
    rate : frames per second; a GIF rounds their length to hundredths of a second

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
        screen = Screen(film, pace)
        images = map(screen.image, frames(film, pace, count, seconds))
        if not gif:
            sheet = Figure(figsize=(WIDTH, HEIGHT), dpi=DPI)
            shown = sheet.figimage(np.zeros((round(HEIGHT * DPI), round(WIDTH * DPI), 3), np.uint8))
            writer = FFMpegWriter(fps=rate, codec="libx264", extra_args=MP4_OPTIONS)
            try:
                with atomic_write(path, given=True) as part, writer.saving(sheet, str(part), DPI):
                    for image in images:
                        shown.set_data(image)
                        writer.grab_frame()
            except subprocess.CalledProcessError as error:
                raise UserError(
                    f"{path}: ffmpeg could not write it (exit code {error.returncode})",
                    "give a name that ends in .gif or .html",
                    code="ffmpeg-failed",
                ) from None
            return
        sample = [screen.image(frame) for frame in frames(film, pace, PALETTE_FRAMES, seconds)]
        # The colours that cover most: others would tint the white.
        palette = Image.fromarray(np.vstack(sample)).quantize(method=Image.Quantize.MAXCOVERAGE)
        first, *others = (
            Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE)
            for image in images
        )
    with atomic_write(path, given=True) as part:
        first.save(part, "GIF", save_all=True, append_images=others, duration=1000 / rate, loop=0)
