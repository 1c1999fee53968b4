"""What packages that extend snooker import. docs/extending.md describes how to write one.

These names stay; other modules of snooker may change in any version. Each name is loaded when it is
asked for: a law needs none of the figures.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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
    from snooker_cli.laws import PackageLaw, law
    from snooker_cli.neighbours import near_pairs
    from snooker_cli.ranges import LawSpeed, Restitution
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
    "LawSpeed",
    "Line",
    "Measurement",
    "PackageLaw",
    "Point",
    "Points",
    "Quantity",
    "Reference",
    "RepeatHeader",
    "Restitution",
    "Result",
    "Scene",
    "States",
    "Theory",
    "Trace",
    "UserError",
    "law",
    "mean_and_error",
    "near_pairs",
    "over_time",
    "replay",
]

_HOMES = {
    "FACTS": "snooker_cli.facts",
    "QUANTITIES": "snooker_cli.analysis.quantities",
    "Band": "snooker_cli.figures.figure_data",
    "Columns": "snooker_cli.export",
    "Events": "snooker_cli.trace",
    "FigureBuilder": "snooker_cli.figures.figure_builder",
    "FigureData": "snooker_cli.figures.figure_data",
    "FigureError": "snooker_cli.errors",
    "FigureSpec": "snooker_cli.figures.registry",
    "Format": "snooker_cli.export",
    "Gas": "snooker_cli.analysis.gas",
    "LawSpeed": "snooker_cli.ranges",
    "Line": "snooker_cli.figures.figure_data",
    "Measurement": "snooker_cli.analysis.measurement",
    "PackageLaw": "snooker_cli.laws",
    "Point": "snooker_cli.config",
    "Points": "snooker_cli.figures.figure_data",
    "Quantity": "snooker_cli.analysis.quantities",
    "Reference": "snooker_cli.figures.figure_data",
    "RepeatHeader": "snooker_cli.store",
    "Restitution": "snooker_cli.ranges",
    "Result": "snooker_cli.figures.declared_result",
    "Scene": "snooker_cli.scene",
    "States": "snooker_cli.engine",
    "Theory": "snooker_cli.analysis.theories",
    "Trace": "snooker_cli.trace",
    "UserError": "snooker_cli.errors",
    "law": "snooker_cli.laws",
    "mean_and_error": "snooker_cli.analysis.observables",
    "near_pairs": "snooker_cli.neighbours",
    "over_time": "snooker_cli.analysis.structure",
    "replay": "snooker_cli.engine",
}
"""The module of each name."""


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
