"""Pressure, temperature, area and number of elastic balls beside the ideal gas and theory."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import kinetic, theory
from snooker_cli.gallery.caption import setting
from snooker_cli.gallery.picture import NEUTRAL, Array, Layer, Line, Picture, PictureError, Points
from snooker_cli.gallery.repeats import repeats
from snooker_cli.gallery.selection import (
    Selection,
    along,
    elastic_points,
    label,
)
from snooker_cli.observables import equal_balls, mean_and_error, mean_pressure, mean_temperature
from snooker_cli.words import short

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.scene import Scene

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
        return self.scene.area

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
    lambda scene, temperature, x: (scene.number, temperature, math.sqrt(x / scene.area)),
)
_NUMBER = _Axis(
    "number of balls",
    lambda state: float(state.scene.number),
    lambda scene, temperature, x: (x, temperature, 1.0),
)


def pressure_temperature(run: Run, selection: Selection) -> Picture:
    """Pressure against temperature, a series for each ball radius."""
    groups = along(elastic_points(run, selection), "balls.speed", series="balls.radius")
    title = "Pressure and temperature, elastic balls"
    return _pressures(run, selection, groups, _TEMPERATURE, "pressure-temperature", title)


def pressure_area(run: Run, selection: Selection) -> Picture:
    """Pressure against the container's area, a series for each ball radius."""
    groups = along(elastic_points(run, selection), *_SIZES, series="balls.radius")
    title = "Pressure and area, elastic balls"
    return _pressures(run, selection, groups, _AREA, "pressure-area", title, log=True)


def pressure_number(run: Run, selection: Selection) -> Picture:
    """Pressure against the number of balls, a series for each ball radius."""
    groups = along(elastic_points(run, selection), *_COUNTS, series="balls.radius")
    title = "Pressure and number of elastic balls"
    return _pressures(run, selection, groups, _NUMBER, "pressure-number", title)


def temperature_ratio(run: Run, selection: Selection) -> Picture:
    """The temperature by equipartition over that of the ideal gas law, against the ball radius."""
    (points,) = along(elastic_points(run, selection), "balls.radius")
    states = [_state(run, point, selection) for point in points]
    radii = np.array([_radius(state) for state in states])
    found = np.array([mean_and_error(state.ideal / state.pressures) for state in states])
    scene, radius_range = states[0].scene, np.linspace(0.0, radii.max(), CURVE)[1:]
    curve = [_ideal_over_theory(scene, scene.number, float(radius)) for radius in radius_range]
    smallest, largest = found[0], found[-1]
    return Picture(
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
) -> Picture:
    """Pressures along an axis, a series for each group, with the ideal gas and theory."""
    points = [point for group in groups for point in group]
    layers: list[Layer] = []
    records: list[dict[str, Any]] = []
    said = []
    for series, group in enumerate(groups):
        states = [_state(run, point, selection) for point in group]
        found = np.array([mean_and_error(state.pressures) for state in states])
        warm = np.array([mean_and_error(state.temperatures) for state in states])
        x = np.array([axis.value(state) for state in states])
        x_error = _errors(warm[:, 1]) if axis is _TEMPERATURE else None
        if series == 0:
            layers.append(_ideal_line(states, x, axis, log=log))
        layers += _theory_line(states, x, axis, series, log=log)
        name = label(group[0], [each[0] for each in groups])
        layers.append(
            Points(x, found[:, 0], x_error, _errors(found[:, 1]), name or "simulation", series)
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
    return Picture(
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
            ideal = theory.ideal_gas_pressure(number, warm, scene.area * scale**2)
            found.append((float(each), ideal / ratio))
    if not found:
        return []
    curve = np.array(found)
    return [Line(curve[:, 0], curve[:, 1], None, series, "dotted")]


def _ideal_over_theory(scene: Scene, number: float, radius: float, scale: float = 1.0) -> float:
    """The ideal gas's pressure over that of hard disks in the container; nan if they are solid."""
    room = kinetic.container(scene, radius, scale)
    state = kinetic.fluid(number, 1.0, radius, room)
    if state is None:
        return math.nan
    return theory.ideal_gas_pressure(number, 1.0, room.area) / state.pressure


def _state(run: Run, point: Point, selection: Selection) -> _State:
    """A point's repeats. Raises ``PictureError`` if one has no collisions with the wall."""
    pressures, temperatures = [], []
    for trace in repeats(run, point, selection):
        pressures.append(mean_pressure(trace))
        temperatures.append(mean_temperature(trace))
    if min(pressures) == 0:
        raise PictureError(
            "a repeat has no collisions with the wall, and so no pressure; run longer"
        )
    return _State(point, trace.start, np.array(pressures), np.array(temperatures))


def _radius(state: _State) -> float:
    """Radius of the balls, m."""
    return float(state.scene.radii[0])


def _errors(values: Array) -> Array | None:
    """Error bars, or ``None`` for single repeats."""
    return values if np.all(np.isfinite(values)) else None
