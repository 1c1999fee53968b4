"""How the pressure settles: its mean since the start, over the repeats."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import kinetic
from snooker_cli.gallery.caption import lines_and_bands, setting
from snooker_cli.gallery.picture import Array, Band, Layer, Line, Picture, PictureError, Reference
from snooker_cli.gallery.repeats import repeats
from snooker_cli.gallery.rows import thinned
from snooker_cli.gallery.selection import (
    Selection,
    elastic,
    label,
    series_of_points,
)
from snooker_cli.gallery.spread import at_common_times, bands
from snooker_cli.observables import (
    cumulative_pressure,
    mean_and_error,
    meeting_temperature,
    series,
)
from snooker_cli.words import with_error

if TYPE_CHECKING:
    from snooker_cli.results import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

TITLE_WITHOUT_WALLS = "Mean pressure since the start, by the virial"


def pressure(run: Run, selection: Selection) -> Picture:
    """The mean pressure since the start: one repeat, and the spread of all around their mean."""
    points = series_of_points(run, selection)
    lines: list[Layer] = []
    spread: list[Band] = []
    records, said = [], []
    expected: dict[float, None] = {}
    for index, point in enumerate(points):
        traces = list(repeats(run, point, selection))
        curves = [_from_zero(trace) for trace in traces]
        time, first = curves[0]
        kept = thinned(time)
        lines.append(Line(time[kept], first[kept], label(point, points), index))
        grid, table = at_common_times(curves)
        spread += bands(grid, table, index)
        final, error = mean_and_error(table[:, -1])
        records.append(
            {
                "parameters": point.as_json(),
                "time": float(grid[-1]),
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
    walls = any(point.experiment.container.shape != "periodic" for point in points)
    references: list[Layer] = [
        Reference("y", value, "hard-disk theory, CoR 1") for value in expected
    ]
    return Picture(
        kind="pressure",
        title="Mean pressure on the wall since the start" if walls else TITLE_WITHOUT_WALLS,
        x_label="time (s)",
        y_label="pressure since the start (Pa·m)",
        layers=(*spread, *references, *lines),
        caption=lines_and_bands(run, points, selection, spread)
        + f"When the shortest repeat ends the mean is {'; '.join(said)}. "
        + setting(run, points, selection),
        numbers={"points": records, "theory": list(expected)},
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def _from_zero(trace: Trace) -> tuple[Array, Array]:
    """Times and mean pressures since the start, s and Pa·m.

    At time zero a wall has none, and the virial's is that of the ideal gas.
    """
    scene = trace.start
    time, values = cumulative_pressure(trace, series(trace))
    if not len(time):
        raise PictureError(
            "nothing happens after the start of a repeat, so that it has no pressure"
        )
    first = 0.0 if scene.shape != "periodic" else scene.kinetic_energy / scene.area
    return np.append(0.0, time), np.append(first, values)


def _equilibrium(scene: Scene) -> list[float]:
    """The pressure of elastic hard disks in equilibrium (Pa·m), where there is a theory for it."""
    warm = scene.kinetic_energy / scene.number
    met = meeting_temperature(scene.kinetic_energy, scene)
    state = kinetic.state(scene, met)
    return [] if state is None else [state.pressure + scene.number * (warm - met) / scene.area]
