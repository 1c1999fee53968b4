"""A run -> what each kind of figure shows, as plain data with a caption; nothing is drawn here."""

from snooker_cli.gallery.caption import unfinished
from snooker_cli.gallery.kinds import KINDS, Kind
from snooker_cli.gallery.picture import (
    NEUTRAL,
    Band,
    Histogram,
    Layer,
    Line,
    Note,
    Picture,
    PictureError,
    Points,
    Reference,
    plain,
)
from snooker_cli.gallery.selection import Selection, described, selected

__all__ = [
    "KINDS",
    "NEUTRAL",
    "Band",
    "Histogram",
    "Kind",
    "Layer",
    "Line",
    "Note",
    "Picture",
    "PictureError",
    "Points",
    "Reference",
    "Selection",
    "described",
    "plain",
    "selected",
    "unfinished",
]
