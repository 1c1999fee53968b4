"""A saved measurement of physics -> a picture: Z measured less published, over the packing."""

from __future__ import annotations

from typing import Any

import numpy as np

from snooker_cli.bench.physics_fluid import STATE
from snooker_cli.gallery import NEUTRAL, Layer, Line, Picture, Points, Reference
from snooker_cli.words import short

Record = dict[str, Any]


def pictures(measurement: Record) -> list[tuple[str, Picture]]:
    """The measurement's picture, with a name for its files."""
    return [("physics-state", state(measurement))]


def state(measurement: Record) -> Picture:
    """Z less what is published, each source a series, beside what N balls are known to lack."""
    rows = [row for row in measurement["rows"] if row["group"] == STATE]
    layers: list[Layer] = [Reference("y", 0.0)]
    for series, source in enumerate(dict.fromkeys(row["source"] for row in rows)):
        x, y, error = _columns([row for row in rows if row["source"] == source])
        layers.append(
            Points(x, y, None, error, label=f"less {source}", series=series, filled=series > 0)
        )
    by_packing = sorted({(row["setting"]["packing"], row["known"]) for row in rows})
    packings, lacking = np.array(by_packing, dtype=np.float64).T
    balls = max(row["setting"]["balls"] for row in rows)
    layers.append(
        Line(packings, lacking, f"what {balls:,} balls are known to lack", NEUTRAL, "dashed")
    )
    worst = max(rows, key=lambda row: abs(row["left_in_errors"]))
    return Picture(
        kind="physics-state",
        title="Equation of state, measured less published",
        x_label="packing fraction",
        y_label="difference of Z = PV/NT",
        layers=tuple(layers),
        caption=f"Elastic disks, {balls:,} in a periodic box, {rows[-1]['setting']['seeds']} seeds "
        "at each packing; bars are standard errors, that of the published value included. Off the "
        "dashed line, which is what a finite number lacks by theory, the farthest is by "
        f"{short(abs(worst['left_in_errors']), 2)} of them, at packing "
        f"{short(worst['setting']['packing'])}. snooker {measurement['snooker']}, "
        f"{measurement['date'][:10]}.",
        numbers={
            "rows": [
                {
                    "packing": row["setting"]["packing"],
                    **{
                        name: row[name] for name in ("source", "difference", "both_errors", "known")
                    },
                }
                for row in rows
            ]
        },
    )


def _columns(rows: list[Record]) -> np.ndarray:
    """Packing, difference and its error, a row each."""
    return np.array(
        [(row["setting"]["packing"], row["difference"], row["both_errors"]) for row in rows]
    ).T
