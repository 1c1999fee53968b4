"""A run -> figures: their data, then their files."""

from snooker_cli.figures.captions import unfinished
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Band,
    FigureData,
    Histogram,
    Layer,
    Line,
    Points,
    Reference,
)
from snooker_cli.figures.registry import FIGURES, FigureSpec
from snooker_cli.figures.selection import Selection, described, selected
from snooker_cli.formatting import plain

__all__ = [
    "FIGURES",
    "NEUTRAL",
    "Band",
    "FigureData",
    "FigureSpec",
    "Histogram",
    "Layer",
    "Line",
    "Points",
    "Reference",
    "Selection",
    "described",
    "plain",
    "selected",
    "unfinished",
]
