"""A measurement of speed -> pictures: rates against the number of balls, and against packing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from snooker_cli.bench.origin import machine
from snooker_cli.gallery import Layer, Line, Picture, Points
from snooker_cli.words import short

Record = dict[str, Any]

FEWEST = 3
"""Points that make a curve."""


def pictures(measurement: Record) -> list[tuple[str, Picture]]:
    """The pictures that a measurement can give, each with a name for its files."""
    plain = [one for one in measurement["cases"] if one["cor"] == 1.0 and not one["free"]]
    found = [
        ("speed-number", against(measurement, plain, "balls", "packing", "number of balls")),
        ("speed-packing", against(measurement, plain, "packing", "balls", "packing fraction")),
    ]
    return [(name, picture) for name, picture in found if picture.layers]


def against(
    measurement: Record, cases: Sequence[Record], over: str, each: str, label: str
) -> Picture:
    """Rates over one of a case's numbers, a curve for each value of another and each engine."""
    layers: list[Layer] = []
    records: list[Record] = []
    curves = {(one[each], one["engine"]): None for one in cases}
    series = 0
    for value, engine in sorted(curves):
        curve = _curve(
            [one for one in cases if (one[each], one["engine"]) == (value, engine)], over
        )
        if len(curve) < FEWEST:
            continue
        x, rate, low, high = np.array(
            [[one[name] for one in curve] for name in (over, "median", "lowest", "highest")]
        )
        name = f"{value:,} balls" if each == "balls" else f"packing {value:g}"
        layers.append(Line(x, rate / 1e6, None, series))
        layers.append(
            Points(
                x,
                rate / 1e6,
                None,
                np.maximum(high - rate, rate - low) / 1e6,
                label=f"{name}, {engine}",
                series=series,
            )
        )
        records += [{key: one[key] for key in (over, each, "engine", "median")} for one in curve]
        series += 1
    fastest = max(cases, key=lambda one: float(one["median"]), default=None)
    best = (
        f" At most {short(fastest['median'] / 1e6)} million, of {fastest['balls']:,} balls at "
        f"packing {fastest['packing']:g}."
        if fastest
        else ""
    )
    return Picture(
        kind=f"speed-{over}",
        title=f"Speed against the {label}",
        x_label=label,
        y_label="collisions per second (million)",
        layers=tuple(layers),
        caption="Elastic disks in a fixed circle: medians of one thread's rates, bars to the "
        f"farthest repeat.{best} {machine(measurement)}.",
        numbers={"cases": records},
        x_log=True,
        y_log=True,
    )


def _curve(cases: Iterable[Record], over: str) -> list[Record]:
    """Cases in order, one for each place: the first that was measured."""
    found: dict[float, Record] = {}
    for one in cases:
        found.setdefault(one[over], one)
    return [found[place] for place in sorted(found)]
