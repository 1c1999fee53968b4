"""A run -> figures: their data, then their files."""

from snooker_cli.figures.figure_data import FigureData, Line, Points, Reference
from snooker_cli.figures.registry import FIGURES, own_figures
from snooker_cli.figures.selection import Selection, selected

__all__ = [
    "FIGURES",
    "FigureData",
    "Line",
    "Points",
    "Reference",
    "Selection",
    "own_figures",
    "selected",
]
