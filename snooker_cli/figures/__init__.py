"""A run -> figures: their data, then their files."""

from snooker_cli.figures.captions import unfinished
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    FigureData,
    Layer,
    Line,
    Points,
    Reference,
)
from snooker_cli.figures.registry import FIGURES
from snooker_cli.figures.selection import Selection, selected

__all__ = [
    "FIGURES",
    "NEUTRAL",
    "FigureData",
    "Layer",
    "Line",
    "Points",
    "Reference",
    "Selection",
    "selected",
    "unfinished",
]
