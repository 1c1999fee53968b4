"""Which picture of which run is which figure of the report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from snooker_cli.report.published import published


@dataclass(frozen=True)
class Plate:
    """A figure of the report: its file, its label, and where its picture comes from."""

    file: str
    label: str
    run: str
    kind: str
    where: Mapping[str, Any] = field(default_factory=dict)


def _numbered(number: int, run: str, kind: str, **where: Any) -> Plate:
    """One of the source report's 18 figures."""
    keys = {key.replace("__", "."): value for key, value in where.items()}
    return Plate(f"fig{number:02d}", f"Figure {number}", run, kind, keys)


MOTION = (
    _numbered(1, "decay", "central-distances", cor=1.0),
    _numbered(2, "decay", "pair-distances", cor=1.0),
)
ENERGY = (
    _numbered(3, "decay", "energy"),
    _numbered(4, "decay", "momentum-x"),
    _numbered(5, "decay", "momentum-y"),
    _numbered(6, "decay", "energy-fit", cor=0.8),
    _numbered(7, "decay", "energy-fit", cor=0.9),
    _numbered(8, "decay", "temperature-fit", cor=0.8),
    _numbered(9, "decay", "temperature-fit", cor=0.9),
)
PRESSURE = (
    _numbered(10, "decay", "pressure"),
    _numbered(11, "decay", "pressure-fit", cor=0.8),
    _numbered(12, "decay", "pressure-fit", cor=0.9),
)
IDEAL = (
    _numbered(13, "temperature", "pressure-temperature"),
    _numbered(14, "area", "pressure-area"),
    _numbered(15, "number", "pressure-number"),
    _numbered(16, "radius", "temperature-ratio"),
    _numbered(17, "dilute", "ideal-ratio", balls__radius=published("ratio_caption").radius),
    Plate(
        "fig17-text",
        "Figure 17, text",
        "dilute",
        "ideal-ratio",
        {"balls.radius": published("ratio_text").radius},
    ),
)
SPEEDS = (_numbered(18, "speeds", "speeds"),)
BEYOND = (
    Plate("decay-against-cor", "Figure 19", "restitution", "decay-against-cor"),
    Plate("decay-elastic-wall", "Figure 20", "elastic-wall", "decay-against-cor"),
    Plate("haff-time", "Figure 21", "elastic-wall", "haff-time"),
    Plate("event-decay", "Figure 22", "elastic-wall", "event-decay"),
)
PLATES = (*MOTION, *ENERGY, *PRESSURE, *IDEAL, *SPEEDS, *BEYOND)

RUNS = (
    "decay",
    "temperature",
    "area",
    "number",
    "radius",
    "dilute",
    "speeds",
    "restitution",
    "elastic-wall",
    "sliding",
    "audit",
)
"""The runs the report is made from: those of the configs of the same names."""
