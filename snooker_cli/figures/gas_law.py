"""Pressure against temperature, area and number of balls, beside the ideal gas and theory."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis import predictions
from snooker_cli.analysis.observables import (
    equal_balls,
    ideal_gas_ratio,
    mean_and_error,
    mean_pressure,
    mean_temperature,
    series,
    temperature,
)
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Array,
    FigureData,
    Layer,
    Line,
    Points,
    Reference,
    error_bars,
    legend_line,
)
from snooker_cli.figures.selection import (
    Selection,
    along,
    elastic_points,
    label,
    repeats,
    series_of_points,
)
from snooker_cli.formatting import short

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace


IDEAL = "ideal gas"
THEORY = "hard-disk theory"
CURVE = 120
"""Vertices of a curve of theory."""

BARS = "Error bars: standard errors over the repeats."


@dataclass(frozen=True)
class _State:
    """A point's pressures (Pa·m) and temperatures (J) over its repeats, and their scene."""

    point: Point
    scene: Scene
    pressures: Array
    temperatures: Array

    @property
    def ideal(self) -> Array:
        """The ideal gas's pressure at each repeat's temperature, Pa·m."""
        area = self.scene.container.area
        return np.asarray(
            theory.ideal_gas_pressure(self.scene.number, 1.0, area) * self.temperatures
        )

    @property
    def radius(self) -> float:
        """Radius of the balls, m."""
        return float(self.scene.radii[0])


@dataclass(frozen=True)
class Axis:
    """The x axis of a figure of pressures.

    keys : of the config, one of which must be swept
    value : of a state
    at : a scene, a temperature and x -> number of balls, temperature and scale of the container
    """

    kind: str
    title: str
    keys: tuple[str, ...]
    label: str
    value: Callable[[_State], float]
    at: Callable[[Scene, float, float], tuple[float, float, float]]
    log: bool = False


TEMPERATURE = Axis(
    "pressure-temperature",
    "Pressure and temperature, elastic balls",
    ("balls.speed",),
    "temperature (J)",
    lambda state: float(state.temperatures.mean()),
    lambda scene, warm, x: (scene.number, x, 1.0),
)
AREA = Axis(
    "pressure-area",
    "Pressure and area, elastic balls",
    ("container.radius", "container.width"),
    "area of the container (m²)",
    lambda state: state.scene.container.area,
    lambda scene, warm, x: (scene.number, warm, math.sqrt(x / scene.container.area)),
    log=True,
)
NUMBER = Axis(
    "pressure-number",
    "Pressure and number of elastic balls",
    ("balls.rings", "balls.count"),
    "number of balls",
    lambda state: float(state.scene.number),
    lambda scene, warm, x: (x, warm, 1.0),
)


def pressures(axis: Axis, run: Run, selection: Selection) -> FigureData:
    """Pressures along an axis, a series for each ball radius, with the ideal gas and theory."""
    groups = along(elastic_points(run, selection), *axis.keys, series="balls.radius")
    build = FigureBuilder(run, selection, [point for group in groups for point in group])
    for index, group in enumerate(groups):
        states = [_state(run, point, selection) for point in group]
        found = np.array([mean_and_error(state.pressures) for state in states])
        warm = np.array([mean_and_error(state.temperatures) for state in states])
        x = np.array([axis.value(state) for state in states])
        x_error = error_bars(warm[:, 1]) if axis is TEMPERATURE else None
        if index == 0:
            build.lines.append(_ideal_line(states, x, axis))
        build.lines += _theory_line(states, x, axis, index)
        name = label(group[0], [each[0] for each in groups])
        y, error = found[:, 0], error_bars(found[:, 1])
        build.lines.append(Points(x, y, x_error, error, name or "simulation", index))
        ratios = [float((state.pressures / state.ideal).mean()) for state in states]
        for state, ratio, (mean, deviation), (heat, _) in zip(
            states, ratios, found, warm, strict=True
        ):
            build.record(
                state.point,
                number=state.scene.number,
                area=state.scene.container.area,
                temperature=heat,
                pressure=mean,
                pressure_error=deviation,
                over_ideal=ratio,
                repeats=len(state.pressures),
            )
        low, high = f"{min(ratios):.3f}", f"{max(ratios):.3f}"
        text = low if low == high else f"{low} to {high}"
        build.results.append(text + (f" ({name})" if name else ""))
    build.lines.append(legend_line(THEORY, "dotted"))
    limits = (None, None) if axis.log else (0.0, None)
    return build.figure(
        kind=axis.kind,
        title=axis.title,
        x_label=axis.label,
        y_label="pressure (Pa·m)",
        caption=f"Simulated over ideal pressure: {build.results_text}. {BARS}",
        x_log=axis.log,
        y_log=axis.log,
        x_limits=limits,
        y_limits=limits,
    )


def temperature_ratio(run: Run, selection: Selection) -> FigureData:
    """The temperature by equipartition over that of the ideal gas law, against the ball radius."""
    (points,) = along(elastic_points(run, selection), "balls.radius")
    build = FigureBuilder(run, selection, points)
    states = [_state(run, point, selection) for point in points]
    found = np.array([mean_and_error(state.ideal / state.pressures) for state in states])
    for state, (ratio, error) in zip(states, found, strict=True):
        build.record(
            state.point,
            ratio=float(ratio),
            ratio_error=float(error),
            theory=_ideal_over_theory(state.scene, state.scene.number, state.radius),
            repeats=len(state.pressures),
        )
    radii = np.array([state.radius for state in states])
    scene, fine = states[0].scene, np.linspace(0.0, radii.max(), CURVE)[1:]
    curve = [_ideal_over_theory(scene, scene.number, float(radius)) for radius in fine]
    build.lines += [
        Line(np.array([0.0, radii.max()]), np.ones(2), IDEAL, NEUTRAL, "dashed"),
        Line(fine, np.array(curve), THEORY, NEUTRAL, "dotted"),
        Points(radii, found[:, 0], None, error_bars(found[:, 1]), "simulation", 0),
    ]
    return build.figure(
        kind="temperature-ratio",
        title="Temperature over the ideal gas law's",
        x_label="ball radius (m)",
        y_label="T(equipartition) / (P V / N)",
        caption=f"The ratio is {short(found[0, 0], 4)} at r = {short(radii[0])} m and "
        f"{short(found[-1, 0], 4)} at r = {short(radii[-1])} m, where theory has "
        f"{short(curve[-1], 4)}. {BARS}",
        x_limits=(0.0, None),
        y_limits=(0.0, 1.1),
    )


MOST_MARKERS = 60
"""Repeats of a point that are shown; more hide each other. Means are over all repeats."""


def ideal_ratio(run: Run, selection: Selection) -> FigureData:
    """Simulated over ideal pressure against temperature, two markers for each repeat.

    The mean pressure over the repeat is compared with the ideal gas at the mean temperature and, as
    in the source report, at the temperature in the end.
    """
    build = FigureBuilder(run, selection, series_of_points(run, selection))
    build.lines.append(Reference("y", 1.0, IDEAL))
    ended_early, highest, few = 0, 0.0, ""
    for index, point in enumerate(build.points):
        rows = []
        for trace in build.traces(point):
            rows.append(_ratios(trace))
            ended_early += not trace.stop.reason.complete
        table = np.array(rows)
        seen = table[:MOST_MARKERS]
        few = f" (the first {MOST_MARKERS})" if len(table) > MOST_MARKERS else ""
        highest = max(highest, float(seen[:, [1, 3]].max()))
        build.lines += [
            Points(seen[:, 2], seen[:, 3], None, None, None, index, filled=False),
            Points(seen[:, 0], seen[:, 1], None, None, build.label(point), index),
        ]
        mean, end = mean_and_error(table[:, 1]), mean_and_error(table[:, 3])
        build.record(
            point,
            over_ideal_at_mean=mean[0],
            over_ideal_at_mean_error=mean[1],
            over_ideal_at_end=end[0],
            over_ideal_at_end_error=end[1],
            mean_temperature=float(table[:, 0].mean()),
            final_temperature=float(table[:, 2].mean()),
            repeats=len(table),
        )
        build.result(point, f"{mean[0]:.3f} and {end[0]:.3f}")
    build.lines += [
        Points(np.empty(0), np.empty(0), None, None, f"at the {name} temperature", NEUTRAL, filled)
        for name, filled in (("mean", True), ("final", False))
    ]
    return build.figure(
        kind="ideal-ratio",
        title="Simulated over ideal pressure",
        x_label="temperature (J)",
        y_label="P V / (N T)",
        caption=f"A marker is the mean pressure of a repeat{few} over the ideal gas's at its mean "
        f"(filled) or final (open) temperature. Means: {build.results_text}.",
        numbers={"ended_early": ended_early},
        x_limits=(0.0, None),
        y_log=highest > 20,
    )


def _ideal_line(states: Sequence[_State], x: Array, axis: Axis) -> Line:
    """The ideal gas along the axis; it is the same for every ball radius."""
    scene, warm, fine = states[0].scene, _mean_temperature(states), _grid(x, axis)
    values = [_ideal_pressure(scene, *axis.at(scene, warm, float(each))) for each in fine]
    return Line(fine, np.array(values), IDEAL, NEUTRAL, "dashed")


def _theory_line(states: Sequence[_State], x: Array, axis: Axis, index: int) -> list[Layer]:
    """Hard disks in the container along the axis, where the theory has a value."""
    scene, warm = states[0].scene, _mean_temperature(states)
    if not equal_balls(scene):
        return []
    found = []
    for each in _grid(x, axis):
        number, heat, scale = axis.at(scene, warm, float(each))
        ratio = _ideal_over_theory(scene, number, states[0].radius, scale)
        if math.isfinite(ratio):
            found.append((float(each), _ideal_pressure(scene, number, heat, scale) / ratio))
    curve = np.array(found).reshape(-1, 2)
    return [Line(curve[:, 0], curve[:, 1], None, index, "dotted")] if found else []


def _grid(x: Array, axis: Axis) -> Array:
    """Values of x for a curve: over the points, from (nearly) zero on a linear axis."""
    if axis.log:
        return np.asarray(np.geomspace(x.min(), x.max(), CURVE))
    return np.linspace(x.max() / CURVE, x.max(), CURVE)


def _mean_temperature(states: Sequence[_State]) -> float:
    """Mean over the states, J."""
    return float(np.mean([state.temperatures.mean() for state in states]))


def _ideal_pressure(scene: Scene, number: float, temperature: float, scale: float) -> float:
    """Pressure of the ideal gas in the scaled container, Pa·m."""
    return theory.ideal_gas_pressure(number, temperature, scene.container.area * scale**2)


def _ideal_over_theory(scene: Scene, number: float, radius: float, scale: float = 1.0) -> float:
    """The ideal gas's pressure over that of hard disks in the container; nan if they are solid."""
    container = scene.container.scaled(scale)
    state = predictions.fluid(number, 1.0, radius, container)
    if state is None:
        return math.nan
    return theory.ideal_gas_pressure(number, 1.0, container.area) / state.pressure


def _state(run: Run, point: Point, selection: Selection) -> _State:
    """A point's repeats. Raises ``FigureError`` if one has no collisions with the wall."""
    found = []
    for trace in repeats(run, point, selection):
        found.append((mean_pressure(trace), mean_temperature(trace)))
    columns = np.array(found)
    if np.any(columns[:, 0] == 0):
        raise FigureError("a repeat has no collisions with the wall, so no pressure; run longer")
    return _State(point, trace.start, columns[:, 0], columns[:, 1])


def _ratios(trace: Trace) -> tuple[float, float, float, float]:
    """Mean temperature, ratio there, final temperature, ratio there. Raises ``FigureError``."""
    ratio, mean = ideal_gas_ratio(trace), mean_temperature(trace)
    end = float(temperature(series(trace), trace.start.number)[-1])
    if not (ratio > 0 and end > 0):
        raise FigureError("a repeat has no pressure or no energy left, so it has no ratio")
    return mean, ratio, end, ratio * mean / end
