"""How the pressure settles: its mean since the start, over the repeats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.analysis import predictions
from snooker_cli.analysis.observables import (
    at_collisions,
    cumulative_pressure,
    energy_ratio,
    mean_and_error,
    meeting_temperature,
    momentum,
    series,
)
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import lines_and_bands, setting
from snooker_cli.figures.figure_data import (
    Array,
    Band,
    FigureData,
    Layer,
    Line,
    Reference,
    at_common_times,
    bands,
    thinned,
)
from snooker_cli.figures.selection import (
    Selection,
    elastic,
    label,
    repeats,
    require_motion,
    series_of_points,
)
from snooker_cli.formatting import short, with_error
from snooker_cli.scene import EPSILON

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace


# What collisions keep: energy where they are elastic, and total momentum without fixed walls.

ROUNDINGS = 1e-15
"""The unit of the momentum's deviation: about four roundings of a number near one."""


def energy(run: Run, selection: Selection) -> FigureData:
    """Kinetic energy of balls and container over that at the start: one repeat, and all around."""
    points = series_of_points(run, selection)
    lines: list[Layer] = []
    spread: list[Band] = []
    records: list[dict[str, Any]] = []
    who = _bodies(points)
    for index, point in enumerate(points):
        curves = [_ratio(trace) for trace in repeats(run, point, selection)]
        time, ratio = curves[0]
        kept = thinned(time)
        lines.append(Line(time[kept], ratio[kept], label(point, points), index, steps=True))
        spread += bands(*at_common_times(curves, steps=True), index)
        rises = [float(np.max(np.diff(each), initial=0.0)) for _, each in curves]
        records.append(
            {
                "parameters": point.as_json(),
                "elastic": elastic(point),
                "final_ratio": float(ratio[-1]),
                "largest_rise": max(rises),
                "largest_deviation": max(float(np.max(np.abs(each - 1))) for _, each in curves),
                "repeats": len(curves),
            }
        )
    said = []
    elastics = [each for each in records if each["elastic"]]
    if elastics:
        worst = max(each["largest_deviation"] for each in elastics)
        said.append(f"Elastic collisions keep the energy to {short(worst, 2)} of it")
    if len(elastics) < len(records):
        rise = max(each["largest_rise"] for each in records if not each["elastic"])
        said.append(
            "Inelastic collisions never raise the energy"
            if rise == 0
            else f"The largest rise by an inelastic collision is {short(rise, 2)} of the start"
        )
    return FigureData(
        kind="energy",
        title=f"Kinetic energy of {who}",
        x_label="time (s)",
        y_label="kinetic energy, E(t)/E(0)",
        layers=(*spread, *lines),
        caption=f"{'. '.join(said)}. "
        + lines_and_bands(run, points, selection, spread)
        + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_limits=(0.0, 1.05),
    )


def momentum_x(run: Run, selection: Selection) -> FigureData:
    """The total momentum's x component: how far its ratio to the start is from 1."""
    return _momentum(run, selection, 0, "x")


def momentum_y(run: Run, selection: Selection) -> FigureData:
    """The total momentum's y component: how far its ratio to the start is from 1."""
    return _momentum(run, selection, 1, "y")


def _momentum(run: Run, selection: Selection, component: int, name: str) -> FigureData:
    if run.experiment.record == "summary":
        raise FigureError("it needs velocities; run the config with `record: events`")
    points = series_of_points(run, selection)
    lines: list[Layer] = []
    spread: list[Band] = []
    records: list[dict[str, Any]] = []
    who = _bodies(points)
    for index, point in enumerate(points):
        totals = [_total(trace, component, name) for trace in repeats(run, point, selection)]
        deviations = [(time, total / total[0] - 1) for time, total in totals]
        curves = [(time, each / ROUNDINGS) for time, each in deviations]
        time, scaled = curves[0]
        kept = thinned(time)
        # Dashes would be lost in the noise.
        lines.append(
            Line(time[kept], scaled[kept], label(point, points), index, "solid", steps=True)
        )
        spread += bands(*at_common_times(curves, steps=True), index)
        records.append(
            {
                "parameters": point.as_json(),
                "momentum_at_start": float(totals[0][1][0]),
                "largest_deviation": max(float(np.max(np.abs(each))) for _, each in deviations),
                "states": max(len(time) for time, _ in totals),
                "repeats": len(totals),
            }
        )
    worst = max(each["largest_deviation"] for each in records)
    return FigureData(
        kind=f"momentum-{name}",
        title=f"Total momentum in {name}, {who}",
        x_label="time (s)",
        y_label=f"(p{name}/p{name}(0) − 1) · 10¹⁵",
        layers=(*spread, Reference("y", 0.0), *lines),
        caption=f"The ratio p{name}(t)/p{name}(0), summed from the velocities of {who} "
        f"at {max(each['states'] for each in records)} moments, stays 1 to within "
        f"{short(worst, 2)}, {short(worst / EPSILON, 2)} roundings of a number near 1. "
        + lines_and_bands(run, points, selection, spread)
        + setting(run, points, selection),
        numbers={"largest_deviation": worst, "points": records},
        x_limits=(0.0, None),
    )


def _ratio(trace: Trace) -> tuple[Array, Array]:
    """Times (s) and the energy over that at the start. Raises ``FigureError``."""
    require_motion(trace.start)
    found = series(trace)
    return found.time, energy_ratio(found)


def _total(trace: Trace, component: int, name: str) -> tuple[Array, Array]:
    """Times and one component of the total momentum, s and kg m/s. Raises ``FigureError``."""
    scene = trace.start
    if not scene.container.can_move and scene.container.has_wall:
        raise FigureError("the walls of a box are fixed and take momentum")
    if scene.container.has_wall and not scene.free:
        raise FigureError("a fixed container takes momentum; give it a finite container.mass")
    states = at_collisions(trace)
    total = momentum(states.velocities, states.container_velocities, scene)[:, component]
    parts = np.abs(scene.masses * scene.velocities[:, component])
    if abs(total[0]) <= scene.number * EPSILON * float(np.sum(parts)):
        raise FigureError(f"the momentum in {name} is zero at the start, so it has no ratio to it")
    return states.time, total


def _bodies(points: Sequence[Point]) -> str:
    """Whose energy and momentum are counted: a circle can move, boxes do not."""
    movable = any(point.experiment.container.shape_class.can_move for point in points)
    return "balls and container" if movable else "the balls"


TITLE_WITHOUT_WALLS = "Mean pressure since the start, by the virial"


def pressure(run: Run, selection: Selection) -> FigureData:
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
        raise FigureError("nothing hits the wall, so that there is no pressure; run longer")
    walls = any(point.experiment.container.shape_class.has_wall for point in points)
    references: list[Layer] = [
        Reference("y", value, "hard-disk theory, CoR 1") for value in expected
    ]
    return FigureData(
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
        raise FigureError("nothing happens after the start of a repeat, so that it has no pressure")
    first = 0.0 if scene.container.has_wall else scene.kinetic_energy / scene.container.area
    return np.append(0.0, time), np.append(first, values)


def _equilibrium(scene: Scene) -> list[float]:
    """The pressure of elastic hard disks in equilibrium (Pa·m), where there is a theory for it."""
    warm = scene.kinetic_energy / scene.number
    met = meeting_temperature(scene.kinetic_energy, scene)
    state = predictions.scene_state(scene, met)
    return (
        []
        if state is None
        else [state.pressure + scene.number * (warm - met) / scene.container.area]
    )
