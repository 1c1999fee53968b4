"""How far inelastic runs are from the ideal gas law, repeat by repeat."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.gallery.caption import setting
from snooker_cli.gallery.picture import NEUTRAL, Layer, Picture, PictureError, Points, Reference
from snooker_cli.gallery.repeats import repeats
from snooker_cli.gallery.selection import (
    Selection,
    label,
    series_of_points,
)
from snooker_cli.observables import (
    ideal_gas_ratio,
    mean_and_error,
    mean_temperature,
    series,
    temperature,
)

if TYPE_CHECKING:
    from snooker_cli.results import Run
    from snooker_cli.trace import Trace


MOST_MARKERS = 60
"""Repeats of a point that are shown; more hide each other. The means are over all."""


def ideal_ratio(run: Run, selection: Selection) -> Picture:
    """Simulated over ideal pressure against temperature, two points a repeat.

    The mean pressure over the repeat is set beside the ideal gas at the mean temperature and,
    which is what the report plots, at the temperature in the end.
    """
    points = series_of_points(run, selection)
    layers: list[Layer] = [Reference("y", 1.0, "ideal gas")]
    records, said, ended_early = [], [], 0
    for index, point in enumerate(points):
        rows = []
        for trace in repeats(run, point, selection):
            rows.append(_ratios(trace))
            ended_early += not trace.stop.reason.complete
        table = np.array(rows)
        name, seen = label(point, points), table[:MOST_MARKERS]
        layers += [
            Points(seen[:, 2], seen[:, 3], None, None, None, index, filled=False),
            Points(seen[:, 0], seen[:, 1], None, None, name, index),
        ]
        mean, end = mean_and_error(table[:, 1]), mean_and_error(table[:, 3])
        records.append(
            {
                "parameters": point.as_json(),
                "over_ideal_at_mean": mean[0],
                "over_ideal_at_mean_error": mean[1],
                "over_ideal_at_end": end[0],
                "over_ideal_at_end_error": end[1],
                "mean_temperature": float(table[:, 0].mean()),
                "final_temperature": float(table[:, 2].mean()),
                "repeats": len(table),
            }
        )
        said.append((f"{name}: " if name else "") + f"{mean[0]:.3f} and {end[0]:.3f}")
    few = f" (the first {MOST_MARKERS})" if len(table) > MOST_MARKERS else ""
    return Picture(
        kind="ideal-ratio",
        title="Simulated over ideal pressure",
        x_label="temperature (J)",
        y_label="P V / (N T)",
        layers=(
            *layers,
            _key("at the mean temperature", filled=True),
            _key("at the final temperature", filled=False),
        ),
        caption=f"A marker is a repeat{few}: its mean pressure over the ideal gas's at its mean "
        "temperature (filled) and at its temperature in the end (open), which is lower where "
        f"energy is lost; means: {'; '.join(said)}. " + setting(run, points, selection),
        numbers={"points": records, "ended_early": ended_early},
        x_limits=(0.0, None),
        y_log=max(float(np.max(layer.y)) for layer in layers if isinstance(layer, Points)) > 20,
    )


def _key(text: str, *, filled: bool) -> Points:
    """A legend's entry for markers that all series share."""
    return Points(np.empty(0), np.empty(0), None, None, text, NEUTRAL, filled)


def _ratios(trace: Trace) -> tuple[float, float, float, float]:
    """Mean temperature, ratio there, final temperature, ratio there. Raises ``PictureError``."""
    ratio, mean = ideal_gas_ratio(trace), mean_temperature(trace)
    end = float(temperature(series(trace), trace.start.number)[-1])
    if not (ratio > 0 and end > 0):
        raise PictureError("a repeat has no pressure or no energy left, so that it has no ratio")
    return mean, ratio, end, ratio * mean / end
