"""What packages that extend snooker import. docs/extending.md describes how to write one.

These names stay; other modules of snooker may change in any version.
"""

from snooker_cli.analysis.gas import Gas
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.analysis.quantities import QUANTITIES, Quantity
from snooker_cli.analysis.structure import over_time
from snooker_cli.analysis.theories import Theory
from snooker_cli.config import Point
from snooker_cli.engine import States, replay
from snooker_cli.errors import FigureError, UserError
from snooker_cli.export import Columns, Format
from snooker_cli.facts import FACTS
from snooker_cli.figures.declared_result import Result
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import Band, FigureData, Line, Points, Reference
from snooker_cli.figures.registry import FigureSpec
from snooker_cli.neighbours import near_pairs
from snooker_cli.scene import Scene
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import Events, Trace

__all__ = [
    "FACTS",
    "QUANTITIES",
    "Band",
    "Columns",
    "Events",
    "FigureBuilder",
    "FigureData",
    "FigureError",
    "FigureSpec",
    "Format",
    "Gas",
    "Line",
    "Measurement",
    "Point",
    "Points",
    "Quantity",
    "Reference",
    "RepeatHeader",
    "Result",
    "Scene",
    "States",
    "Theory",
    "Trace",
    "UserError",
    "mean_and_error",
    "near_pairs",
    "over_time",
    "replay",
]
