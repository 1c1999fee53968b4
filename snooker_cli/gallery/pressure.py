"""How the pressure on the wall settles: its mean since the start, over the repeats."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.gallery.caption import setting, which_repeat
from snooker_cli.gallery.picture import Array, Band, Layer, Line, Picture, PictureError, Reference
from snooker_cli.gallery.repeats import repeats
from snooker_cli.gallery.rows import thinned
from snooker_cli.gallery.selection import (
    Selection,
    elastic,
    label,
    series_of_points,
)
from snooker_cli.observables import cumulative_pressure, equal_balls, mean_and_error, series
from snooker_cli.words import with_error

if TYPE_CHECKING:
    from snooker_cli.results import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

GRID = 300


def pressure(run: Run, selection: Selection) -> Picture:
    """The mean pressure since the start: one repeat, and the spread of all around their mean."""
    points = series_of_points(run, selection)
    lines: list[Layer] = []
    bands: list[Layer] = []
    records, said = [], []
    expected: dict[float, None] = {}
    for index, point in enumerate(points):
        traces = list(repeats(run, point, selection))
        curves = [_from_zero(trace) for trace in traces]
        time, first = curves[0]
        kept = thinned(time)
        lines.append(Line(time[kept], first[kept], label(point, points), index))
        shortest = min(float(time[-1]) for time, _ in curves)
        grid = np.linspace(0.0, shortest, GRID)
        table = np.array([np.interp(grid, time, values) for time, values in curves])
        if len(table) > 1:
            mean, spread = table.mean(axis=0), table.std(axis=0, ddof=1)
            bands.append(Band(grid, mean - spread, mean + spread, series=index))
        final, error = mean_and_error(table[:, -1])
        records.append(
            {
                "parameters": point.as_json(),
                "time": shortest,
                "pressure": final,
                "pressure_error": error,
                "repeats": len(table),
            }
        )
        name = label(point, points)
        said.append(with_error(final, error, "Pa·m") + (f" at {name}" if name else ""))
        if elastic(point):
            expected |= dict.fromkeys(_equilibrium(traces[0].start))
    if not any(record["pressure"] for record in records):
        raise PictureError("nothing hits the wall, so that there is no pressure; run longer")
    references: list[Layer] = [
        Reference("y", value, "hard-disk theory, CoR 1") for value in expected
    ]
    band = ", bands: mean ± standard deviation of a repeat" if bands else ""
    return Picture(
        kind="pressure",
        title="Mean pressure on the wall since the start",
        x_label="time (s)",
        y_label="pressure since the start (Pa·m)",
        layers=tuple(bands + references + lines),
        caption=f"Lines: {which_repeat(run, points, selection)}{band}. When the shortest repeat "
        f"ends the mean is {'; '.join(said)}. " + setting(run, points, selection),
        numbers={"points": records, "theory": list(expected)},
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def _from_zero(trace: Trace) -> tuple[Array, Array]:
    """Times and mean pressures since the start, which is zero at time zero; s and Pa·m."""
    time, values = cumulative_pressure(series(trace), trace.start.container_radius)
    if not len(time):
        raise PictureError(
            "nothing happens after the start of a repeat, so that it has no pressure"
        )
    return np.append(0.0, time), np.append(0.0, values)


def _equilibrium(scene: Scene) -> list[float]:
    """The pressure of elastic hard disks in equilibrium (Pa·m), where there is a theory for it."""
    if scene.number < 2 or not equal_balls(scene):
        return []
    temperature = scene.kinetic_energy / scene.number
    try:
        state = theory.circle_state(
            scene.number, temperature, float(scene.radii[0]), scene.container_radius
        )
    except ValueError:  # too dense for a fluid
        return []
    return [state.pressure]
