"""Gases whose walls give energy: temperature, profiles, balance of energy, heat, pressure."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.gas import Gas, finite_ratio
from snooker_cli.analysis.measurement import WINDOWS
from snooker_cli.analysis.observables import mean_and_error, meeting_temperature, standard_errors
from snooker_cli.analysis.profiles import (
    Profile,
    axis_across,
    is_radial,
    measured_profile,
    wall_temperatures,
)
from snooker_cli.analysis.stationarity import stationary_part_of
from snooker_cli.analysis.time_series import Averages
from snooker_cli.config import Point
from snooker_cli.containers import ENDS
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.figure_data import (
    Array,
    FigureData,
    Line,
    LineStyle,
    Points,
    Reference,
    legend_line,
    more_than_a_decade,
)
from snooker_cli.figures.selection import axis_label, gas_type_of, swept_numbers, value_at
from snooker_cli.formatting import counted
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

BINS, COARSE_BINS = 20, 10  # of profiles, and of those whose slope is taken
MOST_BALLS = 4_000_000  # balls times states of a point's profiles, which take a second or two
TIMES = 200  # times at which repeats are compared
CURVE = 100  # vertices of a curve of theory

SWEPT = "wall_speed", "wall_temperature", "balls.count", "balls.radius", "cor"
"""The keys that the temperature is shown along; the first one that has several values."""


class _Steady:
    """The part of each repeat that counts as steady: that of `stationarity.stationary_part`.

    All figures of this module take it from here. A point without such a part, and elastic balls
    that no wall heats, have the second half.
    """

    def __init__(self, build: FigureBuilder) -> None:
        self.build = build
        warm = [point for point in build.points if gas_type_of(point) == "warm"]
        parts = {point.index: stationary_part_of(build.measurement(point)) for point in warm}
        self.firsts = {index: part.first_window for index, part in parts.items()}
        self.changing = {index for index, part in parts.items() if part.changes}

    def first(self, point: Point) -> int:
        """The first window of ``WINDOWS`` that counts."""
        return self.firsts.get(point.index) or WINDOWS // 2

    def averages(self, point: Point) -> Averages:
        """Averages over this part of the repeats of a point."""
        return self.build.measurement(point).windows.from_window(self.first(point))

    def temperatures(self, point: Point) -> Array:
        """Mean energies of a ball in this part, J; (*repeats*,)."""
        return self.averages(point).kinetic_energy / self.build.start(point).number

    def traces(self, point: Point) -> Iterator[tuple[Trace, float]]:
        """The repeats of a point, and when the part begins in each, s."""
        for trace in self.build.traces(point):
            yield trace, self.first(point) / WINDOWS * trace.stop.time

    @property
    def text(self) -> str:
        """A sentence on the parts of all points."""
        lasts = {100 - 100 * self.first(point) // WINDOWS for point in self.build.points}
        span = " to ".join(map(str, sorted({min(lasts), max(lasts)})))
        unsure = [*self.firsts.values()].count(None)
        points = f" (not confirmed for {counted(unsure, 'point')})" if unsure else ""
        return f"Steady part: the last {span} % of each repeat{points}."


def stationary(build: FigureBuilder) -> FigureData:
    """Temperature against a swept key, a series for each CoR, with the balance of energy."""
    numbers = swept_numbers(build.groups[0])  # of runs side by side not their names
    key = next(key for key in SWEPT if key in numbers)
    names, steady = [group[0] for group in build.groups], _Steady(build)
    drawn = dict[str, float]()
    for index, group in enumerate(build.groups):
        rows, expected = [], []
        for point in group:
            mean, error = mean_and_error(steady.temperatures(point))
            rows.append((mean, error))
            changes = point.index in steady.changing
            models = theories.WALLS, theories.BALANCE
            known = theories.values_of(build.start(point), quantities.TEMPERATURE, *models)
            law = next(iter(known.values()), None)
            drawn |= known
            expected.append(math.nan if law is None else law)
            measured = {"changing_temperature": mean} if changes else {"temperature": (mean, error)}
            build.record(point, **measured, theory=law)
        x = np.array([float(value_at(point, key)) for point in group])
        y, errors = np.array(rows).T
        if np.isfinite(expected).any():
            build.lines.append(Line(x, np.array(expected), None, index, "dotted"))
        label = build.label(group[0], names) or "simulation"
        settled = np.array([point.index not in steady.changing for point in group])
        build.lines.append(Points(x[settled], y[settled], errors[settled], label, index))
        if not settled.all():  # an error would say that this is the mean of a steady gas
            build.lines.append(Points(x[~settled], y[~settled], None, None, index, filled=False))
    caption = steady.text
    if steady.changing:
        caption += " Open: the gas still changes."
    if drawn:
        build.lines.append(legend_line(", ".join(drawn), "dotted"))
    if theories.BALANCE in drawn:
        caption += " Dotted: balance of energy in a uniform gas (Kumaran 1998)."
    log = more_than_a_decade(line.y for line in build.lines if isinstance(line, Points))
    return build.figure(
        caption,
        logarithmic=log,
        x_label=axis_label(build.points[0], key),
        x_log=key == "wall_speed",
    )


def _profile(build: FigureBuilder, steady: _Steady, bins: int) -> Profile:
    """The profile of the only point in its steady part. Raises ``FigureError``."""
    (point,) = build.points
    most = build.states(point, MOST_BALLS, MOST_BALLS)
    return measured_profile(build.start(point), steady.traces(point), bins, most)


def profiles(build: FigureBuilder) -> FigureData:
    """Density and temperature across a box or channel, or along the radius of a circle."""
    steady, (point,) = _Steady(build), build.points
    profile, scene = _profile(build, steady, BINS), build.start(point)
    middles, temperature = profile.middles, profile.temperature
    _, density, across, along = profile
    warm = steady.temperatures(point)
    mean, circle = float(warm.mean()), is_radial(scene)
    columns = {
        "density": density / density.mean(),
        "temperature": temperature / mean,
        f"its part {'along the radius' if circle else 'across'}": across / mean,
        f"its part {'around' if circle else 'along the walls'}": along / mean,
    }
    for index, (name, rows) in enumerate(columns.items()):
        style: LineStyle = "solid" if index < 2 else "dashed"
        build.add_means(index, name, middles, rows, style)
    heats = wall_temperatures(scene).items()
    walls = {place: heat for place, heat in heats if math.isfinite(heat)}
    for place, heat in walls.items():
        at = np.array([place]), np.array([heat / mean])
        build.lines.append(Points(*at, None, None, 1, filled=False))
    with np.errstate(divide="ignore", invalid="ignore"):  # balls that move along one line
        ratio = mean_and_error(np.nanmean(across, axis=1) / np.nanmean(along, axis=1))
    build.record(
        point,
        place=middles,
        across_over_along=ratio,
        density=density.mean(axis=0),
        temperature=temperature.mean(axis=0),
        across=across.mean(axis=0),
        along=along.mean(axis=0),
        mean_temperature=mean_and_error(warm),
        first_temperature=mean_and_error(temperature[:, 0]),
        last_temperature=mean_and_error(temperature[:, -1]),
        first_density=mean_and_error(density[:, 0] / density.mean()),
        last_density=mean_and_error(density[:, -1] / density.mean()),
    )
    return build.figure(
        f"{steady.text}{' Open: the wall.' if walls else ''}",
        x_label="distance from the centre (m)" if circle else "place across (m)",
    )


def energy_balance(build: FigureBuilder) -> FigureData:
    """Energy that walls gave, that collisions took, and their difference, over time."""
    steady = _Steady(build)
    for index, point in enumerate(build.points):
        measurement = build.measurement(point)
        lossy = facts.hold(point.experiment, "lossy_pairs")
        curve, part = measurement.curve, steady.averages(point)
        times = np.linspace(0.0, build.end_of_all(measurement.time), TIMES)
        given = curve.at(times, curve.wall_energy)
        taken = curve.at(times, curve.lost_energy) * lossy  # else only rounding is left
        build.add_means(index, build.label(point), times, given, "solid")
        build.add_means(index, None, times, taken, "dashed")
        build.add_means(index, None, times, given - taken, "dotted")
        given_rate = mean_and_error(part.wall_energy / part.length)
        taken_rate = mean_and_error(part.lost_energy * lossy / part.length)
        build.record(point, given_rate=given_rate, taken_rate=taken_rate)
    build.lines += [
        legend_line("walls gave", "solid"),
        legend_line("collisions took", "dashed"),
        legend_line("their difference, E − E(0)", "dotted"),
    ]
    return build.figure(steady.text)


def heat_flux(build: FigureBuilder) -> FigureData:
    """The flux of heat through the walls, and by Enskog's conductivity between them."""
    (point,) = build.points
    scene, measurement, steady = build.start(point), build.measurement(point), _Steady(build)
    height = scene.container.size[1 - axis_across(scene)]
    sides = ENDS[scene.container.across or "x"]
    ends = [scene.container.sides.index(side) for side in sides]
    first, length = steady.first(point), steady.averages(point).length[:, np.newaxis]
    given = measurement.by_side[:, first:, ends].sum(axis=1)
    through = given * (1, -1) / (height * length)
    if np.isnan(through).any():
        raise FigureError("a repeat has too many collisions for this figure; run a shorter one")
    both = [mean_and_error(side) for side in through.T]
    numbers: dict[str, Any] = dict(zip(sides, both, strict=True))
    places = np.array([*wall_temperatures(scene)])
    _add_points(build, places, through, "through the walls")
    is_elastic, caption = facts.hold(scene, "elastic_pairs"), steady.text
    if is_elastic:
        numbers["flux"] = flux = mean_and_error(through.mean(axis=1))
        build.lines.insert(0, Reference("y", flux[0], "mean of both walls", "dashed"))
    law = theories.theory_of(scene, quantities.HEAT_FLUX, theories.CONDUCTIVITY)
    if law is not None:
        profile = _profile(build, steady, COARSE_BINS)
        gas = Gas(measurement, first_window=first, profile=profile)
        _add_points(build, profile.edges[1:-1], gas.conduction.flux, f"{law.model}, −κ dT/dx")
        numbers["enskog"] = middle = mean_and_error(np.asarray(law.value(gas)))
        if is_elastic:
            over = flux[0] / middle[0]
            ratio = over, math.hypot(flux[1], over * middle[1]) / abs(middle[0])
            numbers |= {"over_enskog": ratio}
        else:
            caption += " κ is that of elastic balls."
        numbers |= _jumps(gas, through)
    build.record(point, **numbers)
    return build.figure(caption)


def _add_points(build: FigureBuilder, places: Array, rows: Array, label: str) -> None:
    """Means with errors over the repeats at some places, m; those of theory are open."""
    series = sum(isinstance(line, Points) for line in build.lines)
    means, errors = rows.mean(axis=0), standard_errors(rows)
    build.lines.append(Points(places, means, errors, label, series, filled=not series))


def _jumps(gas: Gas, through: Array) -> dict[str, Any]:
    """The jump of temperature at each thermal wall, measured and by theory, J.

    through : the flux of heat through both walls in each repeat, J/(m s)
    """
    warm, found = gas.profile.temperature, dict[str, Any]()
    packing, between, conductivity, _ = gas.conduction
    # A straight line through the two strips at a wall gives the gas at it.
    heats = wall_temperatures(gas.scene).values()
    for side, (heat, beside) in enumerate(zip(heats, ((0, 1), (-1, -2)), strict=True)):
        if math.isfinite(heat):
            near = warm[:, beside] @ (1.5, -0.5)
            here = float(packing[-side]), gas.radius, float(between[-side]), gas.mass
            slope = float(through[:, side].mean()) / conductivity[-side] * (-1) ** side
            expected = slope * theory.temperature_jump(*here)
            jump = mean_and_error(heat - near)
            found |= {f"jump_{side}": jump, f"jump_theory_{side}": expected}
    return found


def equation_of_state(build: FigureBuilder) -> FigureData:
    """PV/NT − 1 by the virial of the balls, over the packing, in the steady state, with theory.

    It is (1 + e) χ in a very large gas. PV/NT itself differs little between dilute gases.
    """
    names, steady = [group[0] for group in build.groups], _Steady(build)
    for index, group in enumerate(build.groups):
        rows, scenes = [], [build.start(point) for point in group]
        for point, scene in zip(group, scenes, strict=True):
            part, warm = steady.averages(point), mean_and_error(steady.temperatures(point))
            inner = mean_and_error(part.virial_ratio)
            outer = mean_and_error(part.ideal_gas_ratio(scene))
            packing, disks = scene.packing_fraction, theories.disk_ratios(scene)
            # Without walls balls meet at a temperature of their own.
            met = meeting_temperature(scene.kinetic_energy, scene) * scene.number
            share = met / scene.kinetic_energy * packing
            rows.append((packing, (inner[0] - 1) / share, inner[1] / share))
            keys = {"theory": theory.INFINITE, "theory_here": theory.FINITE}
            numbers: dict[str, Any] = {
                key: disks[name].virial for key, name in keys.items() if name in disks
            }
            numbers |= {"temperature": warm, "virial": inner, "wall": outer}
            build.record(point, packing=packing, **numbers)
        first = scenes[0]
        packings, added, errors = np.array(rows).T
        label = build.label(group[0], names) or "simulation"
        build.lines.append(Points(packings, added, errors, label, index))
        if theory.INFINITE in theories.disk_ratios(first):
            grid = np.linspace(packings.max() / CURVE, packings.max(), CURVE)
            large = theory.granular_compressibility(grid, first.restitution)
            build.lines.append(Line(grid, (large - 1) / grid, None, index, "dotted"))
            here = [_of_scene(first, float(packing)) for packing in grid]
            if len({scene.number for scene in scenes}) == 1 and np.isfinite(here).any():
                build.lines.append(Line(grid, (np.array(here) - 1) / grid, None, index, "solid"))
    drawn = {line.style for line in build.lines if isinstance(line, Line)}
    legend = {"solid": theory.FINITE, "dotted": theory.INFINITE}
    build.lines += [legend_line(legend[style], style) for style in legend if style in drawn]
    return build.figure(steady.text)


def _of_scene(scene: Scene, packing: float) -> float:
    """PV/NT by the virial of as many balls in the container at another packing; nan without it."""
    container, number = scene.container, scene.number
    radius = container.ball_radius(packing, number)
    resized = facts.resized(facts.traits_of(scene), number, radius, container)
    if not facts.hold(resized, *theories.FINITE_DISKS):
        return math.nan
    return finite_ratio(number, radius, container, scene.restitution).virial
