"""A film -> a GIF or an MP4 of its frames."""

from __future__ import annotations

import shutil
import subprocess
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.colors import LinearSegmentedColormap, to_rgba_array
from matplotlib.figure import Figure
from PIL import Image

from snooker_cli.animation import SPEED_COLOURS, frames
from snooker_cli.figures.screen import DPI, HEIGHT, PLAIN, WIDTH, Screen
from snooker_cli.figures.style import styled

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from snooker_cli.animation import Film, Reel

PALETTE_FRAMES = 3
"""Frames from which a GIF's one palette is made."""

MOST_FRAMES = 1200
"""Of a GIF; 0.4 MB of memory each, and a page takes long to load them."""

MP4_OPTIONS = ["-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"]
"""For ffmpeg: colours that every player shows, hardly any loss, and the index at the front."""


class MovieError(Exception):
    """A movie that cannot be written; one sentence."""


def save_movie(
    film: Film, reel: Reel, path: Path, *, seconds: float, rate: int, magnify: float = 1.0
) -> int:
    """Write a film as ``path``, a ``.gif`` or an ``.mp4``; the number of its frames.

    seconds : how long it plays
    rate : frames a second; a GIF's last for whole hundredths of a second
    magnify : by how much the container's motion is enlarged

    Raises ``MovieError`` for an MP4 without ffmpeg, or if that fails, and for a GIF of more than
    ``MOST_FRAMES``.
    """
    gif = path.suffix.lower() == ".gif"
    if not gif and shutil.which("ffmpeg") is None:
        raise MovieError(
            f"{path}: an MP4 needs ffmpeg, which is not on the PATH; install it, or give a name "
            "that ends in .gif or .html"
        )
    count = max(2, round(seconds * rate))
    if gif and count > MOST_FRAMES:
        raise MovieError(
            f"{path}: {count:,} frames are more than the {MOST_FRAMES:,} that a GIF is given, as "
            "it holds them all in memory; take fewer seconds or frames a second, or give a name "
            "that ends in .mp4"
        )
    with styled():
        screen = Screen(film, reel, magnify)
        if gif:
            sample = frames(film, reel, PALETTE_FRAMES, seconds)
            writer: Any = _GifWriter(rate, _palette([screen.image(each) for each in sample]))
        else:
            writer = FFMpegWriter(fps=rate, codec="libx264", extra_args=MP4_OPTIONS)
        sheet = Figure(figsize=(WIDTH, HEIGHT), dpi=DPI)
        shown = sheet.figimage(np.zeros((round(HEIGHT * DPI), round(WIDTH * DPI), 3), np.uint8))
        try:
            with writer.saving(sheet, str(path), DPI):
                for frame in frames(film, reel, count, seconds):
                    shown.set_data(screen.image(frame))
                    writer.grab_frame()
        except subprocess.CalledProcessError as error:
            raise MovieError(
                f"{path}: ffmpeg could not write it (it ended with {error.returncode}); give a "
                "name that ends in .gif or .html"
            ) from None
    return count


class _GifWriter(PillowWriter):
    """Pillow's, with one palette for all frames: nothing flickers, and the file is small."""

    _frames: list[Image.Image]

    def __init__(self, rate: int, palette: Image.Image) -> None:
        super().__init__(fps=rate)
        self.palette = palette

    def grab_frame(self, **options: Any) -> None:
        super().grab_frame(**options)
        latest = self._frames.pop()
        self._frames.append(latest.quantize(palette=self.palette, dither=Image.Dither.NONE))


def _palette(images: Sequence[NDArray[np.uint8]]) -> Image.Image:
    """A palette of 256 colours: those of all films, and those that stand best for some images.

    images : each (*height*, *width*, 3)
    """
    speeds = LinearSegmentedColormap.from_list("speed", SPEED_COLOURS)
    exact = np.vstack([to_rgba_array(PLAIN), speeds(np.linspace(0, 1, 56))])[:, :3]
    best = Image.fromarray(np.vstack(images)).quantize(256 - len(exact)).getpalette("RGB")
    others = np.reshape(best or [], (-1, 3))
    # Pillow looks for a colour's neighbour in steps of 4: white must have none but itself.
    others = np.where(others.min(axis=1, keepdims=True) > 247, 255, others)
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.vstack([(255 * exact).round(), others]).astype(int).ravel().tolist())
    return palette
