"""Pressure against temperature, area and number of balls, beside the ideal gas and theory."""

import math
from typing import NamedTuple

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import theories
from snooker_cli.analysis.fitting import attraction, excluded_area
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Array,
    FigureData,
    Line,
    LineStyle,
    Points,
    Reference,
    legend_line,
)
from snooker_cli.figures.selection import gas_type_of
from snooker_cli.formatting import short
from snooker_cli.scene import Scene

IDEAL = "ideal gas"
IDEAL_RATIO = Reference("y", 1.0, IDEAL, "dashed")
THEORY = theory.FINITE
CURVE = 120  # vertices of a curve of theory
SAME = 1e-9  # packings or temperatures are the same within this share


class _GasState(NamedTuple):
    """What decides the pressure of a point's gas (m, J, m²), and the pressures of its repeats.

    pressures, over_ideal : (*repeats*,) Pa·m, and over those of the ideal gas
    """

    point: Point
    scene: Scene
    traits: facts.Traits
    radius: float
    number: float
    temperature: float
    area: float
    pressures: Array
    over_ideal: Array

    @property
    def ideal_pressure(self) -> float:
        """Pressure of the ideal gas, Pa·m."""
        return theory.ideal_gas_pressure(self.number, self.temperature, self.area)

    @property
    def expected(self) -> float:
        """Pressure of hard disks in a container of this shape, Pa·m; nan if they are solid."""
        container = self.scene.container.scaled(math.sqrt(self.area / self.scene.container.area))
        size = self.number, self.radius, container
        if not facts.hold(facts.resized(self.traits, *size), *theories.FINITE_DISKS):
            return math.nan
        return theory.fluid_state(self.number, self.temperature, *size[1:]).pressure

    @property
    def conditions(self) -> dict[str, float]:
        """Number of balls, temperature and area, for the records of a figure."""
        return {"number": self.number, "temperature": self.temperature, "area": self.area}


def pressures(axis: str, build: FigureBuilder) -> FigureData:
    """Pressures along a field of ``_GasState``, a series for each ball radius, with theory."""
    for index, group in enumerate(build.groups):
        states = [_gas_state(build, point) for point in group]
        x = np.array([getattr(state, axis) for state in states])
        grid = np.linspace(x.max() / CURVE, x.max(), CURVE)
        if axis == "area":
            grid = np.geomspace(x.min(), x.max(), CURVE)
        heat = float(np.mean([state.temperature for state in states]))
        first = states[0]._replace(temperature=heat)
        curve = [first._replace(**{axis: value}) for value in grid.tolist()]
        if index == 0:  # it is the same for every radius
            ideal = np.array([state.ideal_pressure for state in curve])
            build.lines.append(Line(grid, ideal, IDEAL, NEUTRAL, "dashed"))
        if facts.hold(first.traits, "equal_balls"):
            values = np.array([state.expected for state in curve])
            build.lines.append(Line(grid, values, None, index, "dotted"))
        name = build.label(group[0], [points[0] for points in build.groups])
        means = [mean_and_error(state.pressures) for state in states]
        y, y_error = np.array(means).T
        build.lines.append(Points(x, y, y_error, name or "simulation", index))
        if facts.hold(first.traits, "equal_balls"):
            expected = np.array([state.expected for state in states])
            build.add_residuals(index, x, y, y_error, expected)
        ratios = [mean_and_error(state.over_ideal) for state in states]
        for state, pressure, ratio in zip(states, means, ratios, strict=True):
            build.record(state.point, **state.conditions, pressure=pressure, over_ideal=ratio)
    build.lines.append(legend_line(THEORY, "dotted"))
    return build.figure()


def temperature_ratio(build: FigureBuilder) -> FigureData:
    """The temperature by equipartition over that of the ideal gas law, against the ball radius."""
    states = [_gas_state(build, point) for point in build.points]

    def theory_of(radii: Array) -> list[float]:
        gases = [states[0]._replace(radius=float(radius)) for radius in radii]
        return [gas.ideal_pressure / gas.expected for gas in gases]

    radii = np.array([state.radius for state in states])
    means = [mean_and_error(1 / state.over_ideal) for state in states]
    for state, ratio, expected in zip(states, means, theory_of(radii), strict=True):
        build.record(state.point, ratio=ratio, theory=expected)
    fine = np.linspace(0.0, radii.max(), CURVE)[1:]
    curve, (y, y_error) = np.array(theory_of(fine)), np.array(means).T
    build.add_residuals(0, radii, y, y_error, np.array(theory_of(radii)))
    build.lines += [
        IDEAL_RATIO,
        Line(fine, curve, THEORY, NEUTRAL, "dotted"),
        Points(radii, y, y_error, "simulation"),
    ]
    return build.figure()


def van_der_waals(build: FigureBuilder) -> FigureData:
    """P V/(N T) against packing, with van der Waals' b, also by single points, and a."""
    states = [_gas_state(build, point) for point in build.points]
    first, radius, disk = states[0], states[0].radius, math.pi * states[0].radius ** 2
    densities = np.array([state.number / state.area for state in states])
    temperatures = np.array([state.temperature for state in states])
    if not any(np.ptp(value) > SAME * np.max(value) for value in (densities, temperatures)):
        raise FigureError("it needs points at two or more areas, numbers or temperatures")
    if any(state.traits.species > 1 or state.radius != radius for state in states):
        raise FigureError("it needs balls of one radius; choose it by balls.radius with --where")
    ratios, errors = np.array([mean_and_error(state.over_ideal) for state in states]).T
    # A fit weighs by errors, and those of few repeats are poor: pooled, they share a scale.
    walls = facts.hold(first.traits, "walls")
    noise = ratios if walls else ratios - 1
    errors = np.abs(noise) * math.sqrt(np.mean((errors / noise) ** 2))
    packing, single = disk * densities, (1 - 1 / ratios) / densities / disk
    b, b_error = (value / disk for value in excluded_area(densities, ratios, errors))
    residuals = (ratios - 1 / (1 - b * packing)) / errors
    misfit = math.sqrt(np.sum(residuals**2) / max(1, len(states) - 1))
    a, a_error = attraction(densities, temperatures, ratios, errors)
    grid = np.linspace(0.0, packing.max() * 1.05, CURVE)[1:]
    scaled = [first._replace(area=first.number * disk / float(value)) for value in grid]
    if first.number != states[-1].number:  # few balls have a smaller pressure at the same packing
        scaled = [first._replace(number=first.area * float(value) / disk) for value in grid]
    real = np.array([state.expected / state.ideal_pressure for state in scaled])
    build.lines += [IDEAL_RATIO, Line(grid, real, THEORY, NEUTRAL, "dotted")]
    fits: list[tuple[float, str, LineStyle]] = [
        (2.0, "van der Waals, b = 2 disks", "dashdot"),
        (b, f"van der Waals, b = {short(b)} disks, fitted", "dashed"),
    ]
    for value, text, style in fits:
        below = value * grid < 1 - 1 / (1.2 * ratios.max())  # towards its pole it leaves the figure
        build.lines.append(Line(grid[below], 1 / (1 - value * grid[below]), text, 1, style))
    build.lines.append(Points(packing, ratios, errors, "simulation"))
    for k, state in enumerate(states):
        build.record(
            state.point,
            **state.conditions,
            packing=packing[k],
            over_ideal=(ratios[k], errors[k]),
            excluded_disks=(single[k], errors[k] / ratios[k] ** 2 / packing[k]),
            van_der_waals=1 / (1 - b * packing[k]),
            theory=state.expected / state.ideal_pressure,
        )
    return build.figure(
        "With walls, b has the strip that no centre reaches." * walls,
        numbers={
            "excluded_disks": b,
            # The points may differ from the law by more than their errors.
            "excluded_disks_error": b_error * max(misfit, 1.0),
            "attraction": a,
            "attraction_error": a_error,
        },
    )


def ideal_ratio(build: FigureBuilder) -> FigureData:
    """Simulated over ideal pressure against temperature, two markers for each repeat.

    The mean pressure over the repeat is compared with the ideal gas at the mean temperature and, as
    in the source report, at the temperature in the end.
    """
    build.lines.append(IDEAL_RATIO)
    ended_early, highest = 0, 0.0
    lossy = [point for point in build.points if gas_type_of(point) == "cooling"]
    for index, point in enumerate(build.points):
        measurement = build.measurement(point)
        mean, _, ratio = _means(measurement)
        end = measurement.curve.kinetic_energy[:, -1] / measurement.scene.number
        if not np.all((ratio > 0) & (end > 0)):
            raise FigureError("a repeat has no pressure or no energy left, so it has no ratio")
        ended_early += int(np.count_nonzero(~measurement.complete))
        table = np.column_stack([mean, ratio, end, ratio * mean / end])
        highest = max(highest, float(table[:, [1, 3]].max()))
        if point in lossy:  # others have one temperature
            build.lines.append(Points(table[:, 2], table[:, 3], series=index, filled=False))
        build.lines.append(Points(table[:, 0], table[:, 1], None, build.label(point), index))
        at_mean, at_end = mean_and_error(table[:, 1]), mean_and_error(table[:, 3])
        build.record(
            point,
            over_ideal_at_mean=at_mean,
            over_ideal_at_end=at_end,
            mean_temperature=float(table[:, 0].mean()),
            final_temperature=float(table[:, 2].mean()),
        )
    build.lines += [
        Points(np.empty(0), np.empty(0), None, f"at the {name} temperature", NEUTRAL, filled)
        for name, filled in (("mean", True), ("final", False))
        if lossy
    ]
    which = "mean (filled) or final (open)" if lossy else "mean"
    return build.figure(
        f"A marker is a repeat at its {which} temperature.",
        numbers={"ended_early": ended_early},
        y_log=highest > 20,
    )


def _means(measurement: Measurement) -> tuple[Array, Array, Array]:
    """Temperature (J), pressure (Pa m) and PV/NT of each repeat, means over its whole time."""
    scene, whole = measurement.scene, measurement.whole
    warm = whole.kinetic_energy / scene.number
    return warm, whole.pressure(scene), whole.ideal_gas_ratio(scene)


def _gas_state(build: FigureBuilder, point: Point) -> _GasState:
    """A point's repeats. Raises ``FigureError`` if one has no collisions with the wall."""
    measurement = build.measurement(point)
    warm, pressures, over_ideal = _means(measurement)
    if not np.all(pressures > 0):
        raise FigureError("a repeat has no collisions with the wall, so no pressure; run longer")
    scene = measurement.scene
    area = scene.container.area
    size, traits = float(scene.radii[0]), facts.traits_of(scene)
    heat = warm.mean()
    return _GasState(point, scene, traits, size, scene.number, heat, area, pressures, over_ideal)
