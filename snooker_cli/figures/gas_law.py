"""Pressure over time, and against temperature, area and number of balls, with theory."""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.fitting import attraction, excluded_area
from snooker_cli.analysis.goodness import LEAST_PROBABILITY, variance_probability
from snooker_cli.analysis.observables import collisions_per_ball, mean_and_error
from snooker_cli.analysis.profiles import middles
from snooker_cli.analysis.time_series import interpolated
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.counted_parts import CountedParts, increments, measured, window_edges
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    EXTRAPOLATED,
    MEASURED,
    NEUTRAL,
    SECOND,
    Array,
    FigureData,
    Line,
    Points,
    Reference,
    legend_line,
    legend_marker,
    level,
    level_band,
    mean_of_remaining,
)
from snooker_cli.figures.series import gas_type_of
from snooker_cli.formatting import chance, short, with_error
from snooker_cli.options import WHERE
from snooker_cli.scene import Scene

IDEAL = "ideal gas"
IDEAL_RATIO = Reference("y", 1.0, IDEAL, EXTRAPOLATED)
THEORY = theory.FINITE
COURSE = 10  # windows of a course
CURVE = 120  # vertices of a curve of theory
SAME = 1e-9  # packings or temperatures are the same within this share
FEWEST_PACKINGS = 3  # to which one b is fitted


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
    meeting_ratio: float
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
        added = theory.fluid_state(self.number, self.temperature, *size[1:]).pressure
        added -= self.ideal_pressure
        # Balls meet at the temperature without the energy of what all share, which has few axes.
        shared = (1 - 1 / self.meeting_ratio) * self.scene.number / self.number
        return self.ideal_pressure + added / (1 - shared)

    @property
    def conditions(self) -> dict[str, float]:
        """Number of balls, temperature and area, for the records of a figure."""
        return {"number": self.number, "temperature": self.temperature, "area": self.area}


_AXES: dict[str, dict[str, Any]] = {
    "temperature": {"x_label": "temperature (J)"},
    "area": {
        "x_label": "area of the container (m²)",
        "x_log": True,
        "y_log": True,
        "x_limits": (None, None),
        "y_limits": (None, None),
    },
    "number": {"x_label": "number of balls"},
}
"""The axes of pressures against a field of ``_GasState``."""

_FIELDS = {"balls.speed": "temperature", "container.radius": "area", "container.width": "area"}
"""The field that a swept key changes; another one changes the number."""


def pressures(build: FigureBuilder) -> FigureData:
    """Pressures along the field that the swept key changes, a series for each ball radius."""
    axis = _FIELDS.get(build.key, "number")
    build.fields = {**build.fields, "title": f"Pressure and {axis}, elastic balls", **_AXES[axis]}
    whose = "the container's" if axis == "area" else "their"
    build.shows = f"The pressure of elastic balls against {whose} {axis}."
    parts = CountedParts(build)
    for index, group in enumerate(build.groups):
        states = [_gas_state(parts, point) for point in group]
        x = np.array([getattr(state, axis) for state in states])
        grid = np.linspace(x.max() / CURVE, x.max(), CURVE)
        if axis == "area":
            grid = np.geomspace(x.min(), x.max(), CURVE)
        heat = float(np.mean([state.temperature for state in states]))
        first = states[0]._replace(temperature=heat)
        curve = [first._replace(**{axis: value}) for value in grid.tolist()]
        if index == 0:  # it is the same for every radius
            ideal = np.array([state.ideal_pressure for state in curve])
            build.lines.append(Line(grid, ideal, IDEAL, NEUTRAL, EXTRAPOLATED))
        if facts.hold(first.traits, "equal_balls"):
            values = np.array([state.expected for state in curve])
            build.lines.append(Line(grid, values, None, index, BY_THEORY))
        name = build.name_of(group)
        means = [mean_and_error(state.pressures) for state in states]
        y, y_error = np.array(means).T
        build.lines.append(Points(x, y, y_error, name, index))
        if facts.hold(first.traits, "equal_balls"):
            expected = np.array([state.expected for state in states])
            build.add_residuals(index, x, y, y_error, expected)
        ratios = [mean_and_error(state.over_ideal) for state in states]
        for state, pressure, ratio in zip(states, means, ratios, strict=True):
            build.record(state.point, **state.conditions, pressure=pressure, over_ideal=ratio)
    build.lines.append(legend_line(build.cite(quantities.RATIO, THEORY), BY_THEORY))
    exact = "That of hard disks is proportional to T. " * (axis == "temperature")
    return build.figure(f"{exact}{parts.text}")


def temperature_ratio(build: FigureBuilder) -> FigureData:
    """The temperature by equipartition over that of the ideal gas law, against the ball radius."""
    parts = CountedParts(build)
    states = [_gas_state(parts, point) for point in build.points]

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
        Line(fine, curve, build.cite(quantities.RATIO, THEORY), NEUTRAL, BY_THEORY),
        Points(radii, y, y_error, "simulation"),
    ]
    return build.figure(parts.text)


def van_der_waals(build: FigureBuilder) -> FigureData:
    """Van der Waals' b of each point against packing, with theory; b and a of all of them.

    Where the points refuse one b, none is drawn.
    """
    parts = CountedParts(build)
    states = [_gas_state(parts, point) for point in build.points]
    first, radius, disk = states[0], states[0].radius, math.pi * states[0].radius ** 2
    densities = np.array([state.number / state.area for state in states])
    temperatures = np.array([state.temperature for state in states])
    if not any(np.ptp(value) > SAME * np.max(value) for value in (densities, temperatures)):
        raise FigureError("it needs points at two or more areas, numbers or temperatures")
    if any(state.traits.species > 1 or state.radius != radius for state in states):
        raise FigureError(f"it needs balls of one radius; choose it by balls.radius with {WHERE}")
    ratios, errors = np.array([mean_and_error(state.over_ideal) for state in states]).T
    # A fit weighs by errors, and those of few repeats are poor: pooled, they share a scale.
    walls = facts.hold(first.traits, "walls")
    noise = ratios if walls else ratios - 1
    errors = np.abs(noise) * math.sqrt(np.mean((errors / noise) ** 2))
    packing = disk * densities
    excluded, excluded_errors = (1 - 1 / ratios) / packing, errors / ratios**2 / packing
    expected = np.array([state.expected / state.ideal_pressure for state in states])
    grid = np.linspace(0.8 * packing.min(), 1.05 * packing.max(), CURVE)
    scaled = [first._replace(area=first.number * disk / float(value)) for value in grid]
    if first.number != states[-1].number:  # few balls have a smaller pressure at the same packing
        scaled = [first._replace(number=first.area * float(value) / disk) for value in grid]
    real = np.array([state.expected / state.ideal_pressure for state in scaled])
    theirs = (1 - 1 / expected) / packing
    build.add_residuals(0, packing, excluded, excluded_errors, theirs)
    build.errors = "Bars: standard errors, pooled over the points."
    name = build.cite(quantities.RATIO, THEORY)
    build.lines += [
        Reference("y", 2.0, "second virial coefficient, b = 2", EXTRAPOLATED),
        Line(grid, (1 - 1 / real) / grid, name, NEUTRAL, BY_THEORY),
        Points(packing, excluded, excluded_errors, "simulation"),
    ]
    for k, state in enumerate(states):
        build.record(
            state.point,
            **state.conditions,
            packing=packing[k],
            over_ideal=(ratios[k], errors[k]),
            excluded_disks=(excluded[k], excluded_errors[k]),
            theory=expected[k],
        )
    a, a_error = attraction(densities, temperatures, ratios, errors)
    numbers = {"attraction": a, "attraction_error": a_error}
    caption = parts.text + " With walls, b has the strip that no centre reaches." * walls
    if math.isfinite(a):
        caption += f" The attraction is a = {with_error(a, a_error, 'J m²')}."
    if len({float(f"{value:.9g}") for value in packing}) < FEWEST_PACKINGS:
        return build.figure(
            f"{caption} Fewer than {FEWEST_PACKINGS} packings fit no b.".lstrip(), numbers=numbers
        )
    b, b_error = (value / disk for value in excluded_area(densities, ratios, errors))
    residuals, free = (ratios - 1 / (1 - b * packing)) / errors, len(states) - 1
    spread = float(np.sum(residuals**2)) / free
    by_chance = variance_probability(spread, free, sum(len(s.over_ideal) - 1 for s in states))
    numbers["probability"] = by_chance
    if by_chance < LEAST_PROBABILITY:
        first, last = excluded[[np.argmin(packing), np.argmax(packing)]]
        changes = "falls" if last < first else "rises"
        build.fields = {**build.fields, "title": f"Van der Waals' b {changes} with the packing"}
        said = f"One b for all packings is refused ({chance(by_chance)}). {caption}"
        return build.figure(said, numbers=numbers)
    # The points may differ from the law by more than their errors.
    b_error *= max(1.0, math.sqrt(spread))
    build.lines.insert(1, Reference("y", b, f"b = {short(b)}, fitted to all", SECOND))
    numbers |= {"excluded_disks": b, "excluded_disks_error": b_error}
    caption = f"One b for all packings is not refused ({chance(by_chance)}). {caption}"
    return build.figure(caption, numbers=numbers)


def pressure(build: FigureBuilder) -> FigureData:
    """PV/NT in windows of collisions, and its mean over the time, with theory.

    Theory is that of as many hard disks in this container.
    """
    parts = CountedParts(build)
    measurements = [build.measurement(point) for point in build.points]
    meet = all(float(np.median(m.events[:, 1])) >= COURSE for m in measurements)
    means = replace(build, panel=build.results)
    for index, (point, measurement) in enumerate(zip(build.points, measurements, strict=True)):
        gas, curve = parts.gas(point), measurement.curve
        scene, along = gas.scene, curve.time
        if meet:
            along = collisions_per_ball(curve.pair_events, scene.number)
        edges = window_edges(along, COURSE)
        impulses = np.nan_to_num(curve.pressure) * curve.time  # per length
        steps = np.diff(curve.time, axis=1) * middles(curve.kinetic_energy)
        energies = np.cumsum(np.pad(steps, ((0, 0), (1, 0))), axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = increments(edges, along, impulses) / increments(edges, along, energies)
        rows = ratio * scene.container.area
        if not np.any(rows > 0):
            raise FigureError("nothing hits the wall, so there is no pressure; run longer")
        (mean, error), x = mean_of_remaining(rows), middles(edges)
        build.note_remaining(along[:, -1], edges[-1])
        label = build.label(point) or "simulation"
        changes = point.index in parts.changing
        build.lines.append(Points(x, mean, error, label, index, not changes))
        whole = mean_and_error(measured(gas, quantities.RATIO))
        begin = np.maximum(0.0, curve.time[:, -1].mean() - gas.means.length.mean())
        begins = float(interpolated(np.array([begin]), curve.time, along).mean())
        ends = np.array([begins, edges[-1]])
        law = theories.theory_of(scene, quantities.RATIO, THEORY)
        expected = math.nan if law is None else float(np.mean(law.value(gas)))
        if law is not None:
            # Of several points the theories have their names, and the legend their markers.
            name = label if build.points[1:] else None
            build.lines.append(level(edges, expected, index, label=name))
            law_there = np.full(len(mean), expected)
            build.add_residuals(index, x, mean, error, law_there, filled=not changes)
            mean_of_all = (np.array([number]) for number in (ends.mean(), *whole, expected))
            if not changes:
                means.add_residuals(index, *mean_of_all)
        if not changes:
            _mean_over_time(build, index, ends, whole, expected)
        build.record(
            point,
            **{"changing_over_ideal" if changes else "over_ideal": whole},
            pressure=mean_and_error(gas.pressure),
            temperature=mean_and_error(gas.temperature),
            theory=None if law is None else expected,
        )
    if len(parts.changing) < len(build.points):
        build.lines.append(legend_line("mean over the time", MEASURED))
    if parts.changing:
        build.lines.append(legend_marker("the gas still changes", filled=False))
        build.where = "where steady"
    around = ", and bands around the means" * bool(build.bands)
    build.errors = f"Bars{around}: standard errors over the repeats."
    if any(record["theory"] is not None for record in build.records):
        build.lines.append(legend_line(build.cite(quantities.RATIO, THEORY), BY_THEORY))
    x_label = "collisions per ball" if meet else "time (s)"
    return build.figure(parts.text, x_label=x_label)


def _mean_over_time(
    build: FigureBuilder, index: int, ends: Array, whole: tuple[float, float], expected: float
) -> None:
    """Add the mean of a steady gas: over theory; of one series, or without theory, also itself.

    Means of several series are too close to each other, but not their distances from theory.
    """
    if math.isfinite(expected):
        build.panel.append(level(ends, float(np.log(whole[0] / expected)), index, MEASURED))
    if len(build.points) == 1 or not math.isfinite(expected):
        build.lines.append(level(ends, whole[0], index, MEASURED))
        build.bands.append(level_band(ends, *whole, index))


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
        scene, whole = measurement.scene, measurement.whole
        mean, ratio = whole.kinetic_energy / scene.number, whole.ideal_gas_ratio(scene)
        end = measurement.curve.kinetic_energy[:, -1] / scene.number
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
        legend_marker(f"at the {name} temperature", filled=filled)
        for name, filled in (("mean", True), ("final", False))
        if lossy
    ]
    which = "mean (filled) or final (open)" if lossy else "mean"
    return build.figure(
        f"A marker is a repeat at its {which} temperature.",
        numbers={"ended_early": ended_early},
        y_log=highest > 20,
    )


def _gas_state(parts: CountedParts, point: Point) -> _GasState:
    """A point's repeats. Raises ``FigureError`` if one has no collisions with the wall."""
    gas = parts.gas(point)
    pressures, over_ideal = gas.pressure, measured(gas, quantities.RATIO)
    if not np.all(pressures > 0):
        raise FigureError("a repeat has no collisions with the wall, so no pressure; run longer")
    scene, traits, heat = gas.scene, facts.traits_of(gas.scene), float(gas.temperature.mean())
    size = gas.radius, gas.number, heat, gas.container.area
    return _GasState(
        point, scene, traits, *size, float(gas.meeting_ratio.mean()), pressures, over_ideal
    )
