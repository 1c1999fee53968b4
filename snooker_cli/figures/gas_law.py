"""Pressure, temperature, area and number of elastic balls beside the ideal gas and theory."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

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
from snooker_cli.figures.captions import setting
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Array,
    FigureData,
    Layer,
    Line,
    Points,
    Reference,
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

_SIZES = ("container.radius", "container.width")
_COUNTS = ("balls.rings", "balls.count")
"""The keys of the area and of the number of balls."""


@dataclass(frozen=True)
class _State:
    """A point's pressure and temperature over its repeats, and the scene they belong to."""

    point: Point
    scene: Scene
    pressures: Array
    temperatures: Array

    @property
    def area(self) -> float:
        """Area of the container, m^2."""
        return self.scene.container.area

    @property
    def ideal(self) -> Array:
        """The ideal gas's pressure at each repeat's temperature, Pa·m."""
        per_temperature = theory.ideal_gas_pressure(self.scene.number, 1.0, self.area)
        return np.asarray(per_temperature * self.temperatures)


@dataclass(frozen=True)
class _Axis:
    """What stands on the x axis: its label, its value, and a state's theory with another value.

    at : (scene, temperature, x) -> number, temperature, and the container's scale
    """

    label: str
    value: Callable[[_State], float]
    at: Callable[[Scene, float, float], tuple[float, float, float]]


_TEMPERATURE = _Axis(
    "temperature (J)",
    lambda state: float(state.temperatures.mean()),
    lambda scene, temperature, x: (scene.number, x, 1.0),
)
_AREA = _Axis(
    "area of the container (m²)",
    lambda state: state.area,
    lambda scene, temperature, x: (scene.number, temperature, math.sqrt(x / scene.container.area)),
)
_NUMBER = _Axis(
    "number of balls",
    lambda state: float(state.scene.number),
    lambda scene, temperature, x: (x, temperature, 1.0),
)


def pressure_temperature(run: Run, selection: Selection) -> FigureData:
    """Pressure against temperature, a series for each ball radius."""
    groups = along(elastic_points(run, selection), "balls.speed", series="balls.radius")
    title = "Pressure and temperature, elastic balls"
    return _pressures(run, selection, groups, _TEMPERATURE, "pressure-temperature", title)


def pressure_area(run: Run, selection: Selection) -> FigureData:
    """Pressure against the container's area, a series for each ball radius."""
    groups = along(elastic_points(run, selection), *_SIZES, series="balls.radius")
    title = "Pressure and area, elastic balls"
    return _pressures(run, selection, groups, _AREA, "pressure-area", title, log=True)


def pressure_number(run: Run, selection: Selection) -> FigureData:
    """Pressure against the number of balls, a series for each ball radius."""
    groups = along(elastic_points(run, selection), *_COUNTS, series="balls.radius")
    title = "Pressure and number of elastic balls"
    return _pressures(run, selection, groups, _NUMBER, "pressure-number", title)


def temperature_ratio(run: Run, selection: Selection) -> FigureData:
    """The temperature by equipartition over that of the ideal gas law, against the ball radius."""
    (points,) = along(elastic_points(run, selection), "balls.radius")
    states = [_state(run, point, selection) for point in points]
    radii = np.array([_radius(state) for state in states])
    found = np.array([mean_and_error(state.ideal / state.pressures) for state in states])
    scene, radius_range = states[0].scene, np.linspace(0.0, radii.max(), CURVE)[1:]
    curve = [_ideal_over_theory(scene, scene.number, float(radius)) for radius in radius_range]
    smallest, largest = found[0], found[-1]
    return FigureData(
        kind="temperature-ratio",
        title="Temperature over the ideal gas law's",
        x_label="ball radius (m)",
        y_label="T(equipartition) / (P V / N)",
        layers=(
            Line(np.array([0.0, radii.max()]), np.ones(2), IDEAL, NEUTRAL, "dashed"),
            Line(radius_range, np.array(curve), THEORY, NEUTRAL, "dotted"),
            Points(radii, found[:, 0], None, _errors(found[:, 1]), "simulation", 0),
        ),
        caption=f"The ratio is {short(smallest[0], 4)} at r = {short(radii[0])} m and "
        f"{short(largest[0], 4)} at r = {short(radii[-1])} m, where {THEORY} has "
        f"{short(curve[-1], 4)}. Error bars: standard errors over the repeats. "
        + setting(run, points, selection),
        numbers={
            "points": [
                {
                    "parameters": state.point.as_json(),
                    "ratio": float(ratio),
                    "ratio_error": float(error),
                    "theory": _ideal_over_theory(state.scene, state.scene.number, _radius(state)),
                    "repeats": len(state.pressures),
                }
                for state, (ratio, error) in zip(states, found, strict=True)
            ]
        },
        x_limits=(0.0, None),
        y_limits=(0.0, 1.1),
    )


def _pressures(
    run: Run,
    selection: Selection,
    groups: Sequence[Sequence[Point]],
    axis: _Axis,
    kind: str,
    title: str,
    *,
    log: bool = False,
) -> FigureData:
    """Pressures along an axis, a series for each group, with the ideal gas and theory."""
    points = [point for group in groups for point in group]
    layers: list[Layer] = []
    records: list[dict[str, Any]] = []
    said = []
    for place, group in enumerate(groups):
        states = [_state(run, point, selection) for point in group]
        found = np.array([mean_and_error(state.pressures) for state in states])
        warm = np.array([mean_and_error(state.temperatures) for state in states])
        x = np.array([axis.value(state) for state in states])
        x_error = _errors(warm[:, 1]) if axis is _TEMPERATURE else None
        if place == 0:
            layers.append(_ideal_line(states, x, axis, log=log))
        layers += _theory_line(states, x, axis, place, log=log)
        name = label(group[0], [each[0] for each in groups])
        layers.append(
            Points(x, found[:, 0], x_error, _errors(found[:, 1]), name or "simulation", place)
        )
        ratios = np.array([float((state.pressures / state.ideal).mean()) for state in states])
        for k, state in enumerate(states):
            records.append(
                {
                    "parameters": state.point.as_json(),
                    "number": state.scene.number,
                    "area": state.area,
                    "temperature": warm[k, 0],
                    "pressure": found[k, 0],
                    "pressure_error": found[k, 1],
                    "over_ideal": ratios[k],
                    "repeats": len(state.pressures),
                }
            )
        low, high = f"{ratios.min():.3f}", f"{ratios.max():.3f}"
        said.append((low if low == high else f"{low} to {high}") + (f" ({name})" if name else ""))
    return FigureData(
        kind=kind,
        title=title,
        x_label=axis.label,
        y_label="pressure (Pa·m)",
        layers=(*layers, Line(np.empty(0), np.empty(0), THEORY, NEUTRAL, "dotted")),
        caption=f"Simulated over ideal pressure: {'; '.join(said)}. Error bars: standard errors "
        "over the repeats. " + setting(run, points, selection),
        numbers={"points": records},
        x_log=log,
        y_log=log,
        x_limits=(None, None) if log else (0.0, None),
        y_limits=(None, None) if log else (0.0, None),
    )


def _grid(x: Array, *, log: bool) -> Array:
    """Values of x for a curve: over the points, from (nearly) zero on a linear axis."""
    if log:
        return np.asarray(np.geomspace(x.min(), x.max(), CURVE))
    return np.linspace(x.max() / CURVE, x.max(), CURVE)


def _ideal_line(states: Sequence[_State], x: Array, axis: _Axis, *, log: bool) -> Line:
    """The ideal gas along the axis; it is the same for every ball radius."""
    fine = _grid(x, log=log)
    temperature = float(np.mean([state.temperatures.mean() for state in states]))
    values = []
    for each in fine:
        number, warm, scale = axis.at(states[0].scene, temperature, float(each))
        values.append(theory.ideal_gas_pressure(number, warm, states[0].area * scale**2))
    return Line(fine, np.array(values), IDEAL, NEUTRAL, "dashed")


def _theory_line(
    states: Sequence[_State], x: Array, axis: _Axis, series: int, *, log: bool
) -> list[Layer]:
    """Hard disks in the container along the axis, where the theory has a value."""
    scene = states[0].scene
    if not equal_balls(scene):
        return []
    temperature = float(np.mean([state.temperatures.mean() for state in states]))
    found = []
    for each in _grid(x, log=log):
        number, warm, scale = axis.at(scene, temperature, float(each))
        ratio = _ideal_over_theory(scene, number, float(scene.radii[0]), scale)
        if math.isfinite(ratio):
            ideal = theory.ideal_gas_pressure(number, warm, scene.container.area * scale**2)
            found.append((float(each), ideal / ratio))
    if not found:
        return []
    curve = np.array(found)
    return [Line(curve[:, 0], curve[:, 1], None, series, "dotted")]


def _ideal_over_theory(scene: Scene, number: float, radius: float, scale: float = 1.0) -> float:
    """The ideal gas's pressure over that of hard disks in the container; nan if they are solid."""
    container = scene.container.scaled(scale)
    state = predictions.fluid(number, 1.0, radius, container)
    if state is None:
        return math.nan
    return theory.ideal_gas_pressure(number, 1.0, container.area) / state.pressure


def _state(run: Run, point: Point, selection: Selection) -> _State:
    """A point's repeats. Raises ``FigureError`` if one has no collisions with the wall."""
    pressures, temperatures = [], []
    for trace in repeats(run, point, selection):
        pressures.append(mean_pressure(trace))
        temperatures.append(mean_temperature(trace))
    if min(pressures) == 0:
        raise FigureError(
            "a repeat has no collisions with the wall, and so no pressure; run longer"
        )
    return _State(point, trace.start, np.array(pressures), np.array(temperatures))


def _radius(state: _State) -> float:
    """Radius of the balls, m."""
    return float(state.scene.radii[0])


def _errors(values: Array) -> Array | None:
    """Error bars, or ``None`` for single repeats."""
    return values if np.all(np.isfinite(values)) else None


# How far inelastic runs are from the ideal gas law, repeat by repeat.

MOST_MARKERS = 60
"""Repeats of a point that are shown; more hide each other. The means are over all."""


def ideal_ratio(run: Run, selection: Selection) -> FigureData:
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
    return FigureData(
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
    """Mean temperature, ratio there, final temperature, ratio there. Raises ``FigureError``."""
    ratio, mean = ideal_gas_ratio(trace), mean_temperature(trace)
    end = float(temperature(series(trace), trace.start.number)[-1])
    if not (ratio > 0 and end > 0):
        raise FigureError("a repeat has no pressure or no energy left, so that it has no ratio")
    return mean, ratio, end, ratio * mean / end
