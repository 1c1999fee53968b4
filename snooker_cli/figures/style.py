"""How every figure looks: size, fonts, colours, markers, dashes."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

import matplotlib
import matplotlib.style
from matplotlib.colors import to_hex

from snooker_cli.gallery import NEUTRAL

WIDTH = 3.4
"""Width of a figure, inches: a column of a two-column page."""

HEIGHT = 2.4
"""Height of a figure with a title of one line and nothing else around the axes, inches."""

LINE_HEIGHT = 0.14
"""Height of a further line of text, inches."""

_COLOURS = matplotlib.color_sequences["petroff10"]
_MARKERS = ("o", "s", "^", "D", "v", "P")
_DASHES: tuple[Any, ...] = (
    "solid",
    (0, (5, 1.5)),
    (0, (6, 1.5, 1.2, 1.5)),
    (0, (1.2, 1.2)),
    (0, (6, 1.5, 1.2, 1.5, 1.2, 1.5)),
    (0, (2.5, 1.2)),
)
_SHARED_DASHES: dict[str, Any] = {
    "solid": "solid",
    "dashed": (0, (4, 1.6)),
    "dashdot": (0, (4, 1.4, 1, 1.4)),
    "dotted": (0, (1, 1.2)),
}
_NEUTRAL_COLOUR = "0.3"

_SETTINGS: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same everywhere
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.titleweight": "bold",
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.0,
    "errorbar.capsize": 1.5,
    # Letters as outlines look the same where the font is missing.
    "svg.fonttype": "path",
    "svg.hashsalt": "snooker",
    # The layout is that of the PNG.
    "figure.dpi": 200,
    "savefig.dpi": 200,
}


def styled() -> AbstractContextManager[None]:
    """While inside, matplotlib has our style and nothing of the user's own settings."""
    return matplotlib.style.context(["default", _SETTINGS])


def colour(series: int) -> str:
    """The colour of a series, from a palette that the colour-blind can tell apart."""
    return _NEUTRAL_COLOUR if series == NEUTRAL else to_hex(_COLOURS[series % len(_COLOURS)])


def marker(series: int) -> str:
    """The marker of a series."""
    return "o" if series == NEUTRAL else _MARKERS[series % len(_MARKERS)]


def dashes(style: str, series: int) -> Any:
    """The dash pattern of a line: its series' own, or one that all series share."""
    if style == "series":
        return _DASHES[series % len(_DASHES)]
    return _SHARED_DASHES[style]
