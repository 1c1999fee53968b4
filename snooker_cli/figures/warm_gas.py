"""Gases whose walls give energy: temperature, profiles, balance of energy, heat, pressure."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis import predictions
from snooker_cli.analysis.observables import (
    has_all,
    ideal_gas_ratio,
    mean_and_error,
    mean_temperature,
    series,
    so_far,
    standard_errors,
    virial_ratio,
)
from snooker_cli.analysis.structure import values
from snooker_cli.config import Point
from snooker_cli.containers import Circle
from snooker_cli.engine import replay
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
    more_than_a_decade,
)
from snooker_cli.figures.selection import value_at, varying
from snooker_cli.formatting import short, with_error
from snooker_cli.laws import Driven, Law, Sides, Thermal, WallLaw
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

BINS, COARSE_BINS = 20, 10  # of profiles, and of those whose slope is taken
MOST_BALLS = 4_000_000  # balls times states of a point's profiles, which take seconds
AT_ONCE = 2**22  # balls times states in memory
ROUNDING = 1e-9  # of the place of a ball at a wall, as a share of it
TIMES = 200  # times at which repeats are compared
CURVE = 100  # vertices of a curve of theory

AXES = {
    "wall_speed": "speed V of the wall (m/s)",
    "wall_temperature": "temperature of the wall (J)",
    "balls.count": "number of balls",
    "balls.radius": "ball radius (m)",
    "cor": "coefficient of restitution",
}
"""Labels of the x axis, by the swept key."""


def steady_parts(build: FigureBuilder, point: Point) -> Iterator[tuple[Trace, float]]:
    """The repeats of a point, and when the part begins that counts as steady, s: the second half.

    All figures of this module take it from here.
    """
    for trace in build.traces(point):
        yield trace, trace.stop.time / 2


def _balance(scene: Scene) -> float | None:
    """Temperature at which an elastic or driven wall gives what collisions take, J, if known."""
    law, fluid = scene.wall_law, scene.packing_fraction <= theory.DENSEST_FLUID
    if isinstance(law, Thermal) and scene.restitution == 1:
        return law.temperature
    known = fluid and scene.equal_balls and scene.pair_law.constant and scene.restitution < 1
    if not (known and isinstance(law, Driven) and law.cor == 1):
        return None
    balls = float(scene.radii[0]), scene.container, float(scene.masses[0])
    return theory.driven_temperature(scene.number, scene.restitution, law.speed, *balls)


def stationary(build: FigureBuilder) -> FigureData:
    """Temperature against a swept key, a series for each CoR, with the balance of energy."""
    key = varying(build.groups[0])[0]
    names = [group[0] for group in build.groups]
    for index, group in enumerate(build.groups):
        rows, expected = [], []
        for point in group:
            warm = [mean_temperature(trace, since) for trace, since in steady_parts(build, point)]
            rows.append(mean_and_error(np.array(warm)))
            expected.append(_balance(build.start(point)))
            build.record(point, temperature=rows[-1], theory=expected[-1])
        x = np.array([float(value_at(point, key)) for point in group])
        y, errors = np.array(rows).T
        law = np.array([math.nan if value is None else value for value in expected])
        if np.isfinite(law).any():
            build.lines.append(Line(x, law, None, index, "dotted"))
        label = build.label(group[0], names) or "simulation"
        build.lines.append(Points(x, y, errors, label, index))
        build.result(build.label(group[0], names), f"{short(y[0])} to {short(y[-1])} J")
    caption = f"T from the first to the last point: {build.results_text}."
    if any(record["theory"] is not None for record in build.records):
        build.lines.append(legend_line("balance of energy, uniform gas", "dotted"))
        caption += " Dotted: balance of energy in a uniform, nearly elastic gas (Kumaran 1998)."
    log = more_than_a_decade(line.y for line in build.lines if isinstance(line, Points))
    return build.figure(caption, logarithmic=log, x_label=AXES[key], x_log=key == "wall_speed")


class _Profile(NamedTuple):
    """Profiles of a point's repeats, in bins across the container or along the radius.

    edges : (*b* + 1,) of the bins, m
    density : (*repeats*, *b*) of centres, 1/m²
    across, along : (*repeats*, *b*) temperatures m⟨v²⟩ of the motion across (or along the radius)
        and at right angles to it, J
    """

    edges: Array
    density: Array
    across: Array
    along: Array

    @property
    def middles(self) -> Array:
        """(*b*,) m"""
        return (self.edges[1:] + self.edges[:-1]) / 2

    @property
    def temperature(self) -> Array:
        """(*repeats*, *b*) J"""
        return (self.across + self.along) / 2


def _profile(build: FigureBuilder, bins: int) -> _Profile:
    """Profiles of the only point, over states at even times. Raises ``FigureError``."""
    (point,) = build.points
    scene = build.start(point)
    if not scene.container.has_wall:
        raise FigureError("it shows the gas between walls; set another container.shape")
    reach = scene.container.size[0] / 2 - float(scene.radii.min())
    circle = isinstance(scene.container, Circle)
    parts = np.linspace(0.0, 1.0, bins + 1)
    # Rings of equal area, or strips of equal width.
    edges = reach * np.sqrt(parts) if circle else reach * (2 * parts - 1)
    area = scene.container.accessible(float(scene.radii.min())).area / bins
    most = max(2, MOST_BALLS // scene.number // len(build.repeats(point)))

    def sums(positions: Array, velocities: Array, state: Scene) -> Array:
        """Balls, and m v² across and along, in each bin: (3, *b*)."""
        places, moving = positions - state.container_position, velocities
        where = places[:, 0]
        if circle:
            where = np.hypot(*places.T)
            outward = places / np.where(where > 0, where, 1.0)[:, None]
            turned = outward[:, 0] * moving[:, 1] - outward[:, 1] * moving[:, 0]
            moving = np.column_stack([np.sum(outward * moving, axis=1), turned])
        where = np.clip(where, edges[0], edges[-1])
        weights = np.ones(len(where)), *(state.masses * moving.T**2)
        return np.array([np.histogram(where, edges, weights=weight)[0] for weight in weights])

    rows = []
    for trace, since in steady_parts(build, point):
        times = np.linspace(since, trace.stop.time, min(most, AT_ONCE // scene.number))
        total = sum(values(sums, trace.start, replay(trace, times)))
        rows.append(
            (total[0] / (len(times) * area), *(total[1:] / np.where(total[0], total[0], np.nan)))
        )
    return _Profile(edges, *np.swapaxes(np.array(rows), 0, 1))


def profiles(build: FigureBuilder) -> FigureData:
    """Density and temperature across a box or channel, or along the radius of a circle."""
    profile, (point,) = _profile(build, BINS), build.points
    scene, parts = build.start(point), steady_parts(build, point)
    warm = np.array([mean_temperature(trace, since) for trace, since in parts])
    mean, circle = float(warm.mean()), isinstance(scene.container, Circle)
    density = profile.density / profile.density.mean()
    columns = {
        "density": density,
        "temperature": profile.temperature / mean,
        f"its part {'along the radius' if circle else 'across'}": profile.across / mean,
        f"its part {'around' if circle else 'along the walls'}": profile.along / mean,
    }
    for index, (name, rows) in enumerate(columns.items()):
        style: LineStyle = "solid" if index < 2 else "dashed"
        build.add_means(index, name, profile.middles, rows, style)
    for place, law in _walls(scene, scene.wall_law).items():
        if isinstance(law, Thermal):
            at = np.array([place]), np.array([law.temperature / mean])
            build.lines.append(Points(*at, None, None, 1, filled=False))
    marked = any(isinstance(line, Points) for line in build.lines)
    build.record(
        point,
        place=profile.middles,
        density=profile.density.mean(axis=0),
        **{
            name: rows.mean(axis=0)
            for name, rows in zip(
                ("temperature", "across", "along"),
                (profile.temperature, profile.across, profile.along),
                strict=True,
            )
        },
        mean_temperature=mean_and_error(warm),
    )
    ratio = mean_and_error(np.nanmean(profile.across, axis=1) / np.nanmean(profile.along, axis=1))
    return build.figure(
        f"T is {with_error(*mean_and_error(warm), 'J')} on average; its first part over the second "
        f"is {with_error(*ratio)}.{' Open: the wall.' * marked}",
        x_label="distance from the centre (m)" if circle else "place across (m)",
    )


def _walls(scene: Scene, law: WallLaw) -> dict[float, Law]:
    """The laws of the walls that a profile ends at, by the place of the wall, m."""
    right = scene.container.size[0] / 2
    if isinstance(scene.container, Circle):
        assert not isinstance(law, Sides)
        return {right: law}
    left, right_law = law[:2] if isinstance(law, Sides) else (law, law)
    return {-right: left, right: right_law}


def _account(trace: Trace) -> tuple[Array, Array]:
    """Energy that walls gave and collisions of balls took so far, at rows of the series, J."""
    if not has_all(trace):
        raise FigureError("a repeat has too many collisions for this figure; run a shorter one")
    assert trace.events is not None
    gain, at_wall = np.diff(series(trace).kinetic_energy), trace.events.at_wall
    given, taken = np.where(at_wall, gain, 0.0), np.where(at_wall, 0.0, -gain)
    if trace.start.restitution == 1.0:
        taken *= 0.0  # only rounding is left
    return np.append(0.0, np.cumsum(given)), np.append(0.0, np.cumsum(taken))


def energy_balance(build: FigureBuilder) -> FigureData:
    """Energy that walls gave, that collisions took, and their difference, over time."""
    for index, point in enumerate(build.points):
        end = min(trace.stop.time for trace in build.traces(point))
        times, table, rates = np.linspace(0.0, end, TIMES), [], []
        for trace in build.traces(point):
            given, taken = (so_far(trace, part, times) for part in _account(trace))
            energy = so_far(trace, series(trace).kinetic_energy, times)
            table.append((given, taken, energy - energy[0]))
            half = TIMES // 2
            rates.append([(row[-1] - row[half]) / (end - times[half]) for row in table[-1]])
        rows = np.moveaxis(np.array(table), 1, 0)
        build.add_means(index, build.label(point), times, rows[0], "solid")
        build.add_means(index, None, times, rows[1], "dashed")
        build.add_means(index, None, times, rows[2], "dotted")
        given_rate, taken_rate, growth = map(mean_and_error, np.array(rates).T)
        build.record(point, given_rate=given_rate, taken_rate=taken_rate, growth=growth)
        units = with_error(*given_rate, "J/s"), with_error(*taken_rate, "J/s")
        build.result(build.label(point), " and ".join(units))
    build.lines += [
        legend_line("walls gave", "solid"),
        legend_line("collisions took", "dashed"),
        legend_line("their difference, E − E(0)", "dotted"),
    ]
    return build.figure(f"Per second of the second half, given and taken: {build.results_text}.")


def heat_flux(build: FigureBuilder) -> FigureData:
    """The flux of heat through the walls, and by Enskog's conductivity between them."""
    (point,) = build.points
    scene = build.start(point)
    if isinstance(scene.container, Circle) or not any(
        law.gains for law in _walls(scene, scene.wall_law).values()
    ):
        raise FigureError("it needs a box or a channel whose left or right wall gives energy")
    if not scene.equal_balls:
        raise FigureError("the conductivity is that of equal balls")
    profile = _profile(build, COARSE_BINS)
    through = np.array([_through_walls(*part) for part in steady_parts(build, point)])
    size, mass = float(scene.radii[0]), float(scene.masses[0])
    between = (profile.temperature[:, 1:] + profile.temperature[:, :-1]) / 2
    crowd = (profile.density[:, 1:] + profile.density[:, :-1]) / 2
    slopes = np.diff(profile.temperature) / np.diff(profile.middles)
    packing, between = math.pi * size**2 * crowd.mean(axis=0), between.mean(axis=0)
    conductivity = theory.thermal_conductivity(packing, size, between, mass)
    enskog = -conductivity * slopes
    walls = _walls(scene, scene.wall_law)
    ends = np.array([*walls])
    build.lines += [
        Points(ends, through.mean(axis=0), standard_errors(through), "through the walls", 0),
        Points(
            profile.edges[1:-1],
            enskog.mean(axis=0),
            standard_errors(enskog),
            "Enskog's conductivity, −κ dT/dx",
            1,
            filled=False,
        ),
    ]
    middle = mean_and_error(enskog[:, 2:-2].mean(axis=1))
    both = [mean_and_error(side) for side in through.T]
    words = f"Through the left and right wall: {' and '.join(with_error(*q) for q in both)} J/(m s)"
    numbers = {"left": both[0], "right": both[1], "enskog": middle}
    if scene.restitution == 1.0:
        flux = mean_and_error(through.mean(axis=1))
        build.lines.insert(0, Reference("y", flux[0], "mean of both walls", "dashed"))
        over = flux[0] / middle[0]
        ratio = over, math.hypot(flux[1], over * middle[1]) / abs(middle[0])
        numbers |= {"flux": flux, "over_enskog": ratio}
        words += f"; their mean over −κ dT/dx of the middle: {with_error(*ratio)}"
    # A straight line through the two strips at a wall gives the gas at it.
    jumps, warm = [], profile.temperature
    for side, (law, beside) in enumerate(zip(walls.values(), ((0, 1), (-1, -2)), strict=True)):
        if isinstance(law, Thermal):
            gas = warm[:, beside] @ (1.5, -0.5)
            here = float(packing[-side]), size, float(between[-side]), mass
            slope = float(through[:, side].mean()) / conductivity[-side] * (-1) ** side
            expected = slope * theory.temperature_jump(*here)
            jump = mean_and_error(law.temperature - gas)
            jumps.append(f"{with_error(*jump)} J, by theory {short(expected)} J")
            numbers |= {f"jump_{side}": jump, f"jump_theory_{side}": expected}
    build.record(point, **numbers)
    jumped = f" Wall less gas at it: {'; '.join(jumps)}." if jumps else ""
    elastic = "" if scene.restitution == 1.0 else " κ is that of elastic balls."
    return build.figure(f"{words}.{jumped}{elastic}")


def _through_walls(trace: Trace, since: float) -> Array:
    """Flux of heat to the right through the left and the right wall, J/(m s); steady part."""
    given, _ = _account(trace)
    events = trace.events
    assert events is not None
    rows = np.flatnonzero(events.at_wall & (events.time > since))
    gain = given[rows + 1] - given[rows]
    width, height = trace.start.container.size
    totals = np.zeros(2)
    for part in np.array_split(np.arange(len(rows)), 1 + len(rows) * trace.start.number // AT_ONCE):
        positions, balls = replay(trace, events.time[rows[part]]).positions, events.i[rows[part]]
        x = positions[np.arange(len(part)), balls, 0]
        # A hit of the lower or upper wall of a box counts for neither side.
        reach = (width / 2 - trace.start.radii[balls]) * (1 - ROUNDING)
        for side, sign in enumerate((-1, 1)):
            totals[side] -= sign * gain[part][sign * x > reach].sum()
    return totals / (height * (trace.stop.time - since))


def equation_of_state(build: FigureBuilder) -> FigureData:
    """PV/NT in the steady state against packing, a series for each CoR, with theory."""
    names, highest = [group[0] for group in build.groups], 0.0
    for index, group in enumerate(build.groups):
        rows = []
        for point in group:
            table = np.array([_pressures(*part) for part in steady_parts(build, point)])
            scene = build.start(point)
            packing, (inner, outer, warm) = scene.packing_fraction, map(mean_and_error, table.T)
            numbers: dict[str, Any] = {
                "theory": theory.granular_compressibility(packing, scene.restitution)
            }
            here = predictions.fluid(scene.number, 1.0, float(scene.radii[0]), scene.container)
            if here is not None:  # impulses are (1 + e)/2 of those of elastic balls
                weaker = (1 + scene.restitution) / 2
                numbers["theory_here"] = 1 + weaker * (here.virial_ratio - 1)
            rows.append((packing, *inner, *outer))
            numbers |= {"temperature": warm, "virial": inner, "wall": outer}
            build.record(point, packing=packing, **numbers)
        packings, inside, inside_error, at_wall, wall_error = np.array(rows).T
        highest = max(highest, float(packings.max()))
        grid = np.linspace(0.0, packings.max(), CURVE)
        label = build.label(group[0], names) or "simulation"
        curve = theory.granular_compressibility(grid, scene.restitution)
        build.lines += [
            Line(grid, curve, None, index, "dotted"),
            Points(packings, inside, inside_error, label, index),
            Points(packings, at_wall, wall_error, None, index, filled=False),
        ]
        build.result(build.label(group[0], names), f"{short(inside[-1])} and {short(at_wall[-1])}")
    build.lines.append(legend_line("1 + (1 + e) η χ", "dotted"))
    for text, filled in (("by the virial of the balls", True), ("by the wall", False)):
        empty = np.empty(0)
        build.lines.append(Points(empty, empty, None, text, NEUTRAL, filled))
    return build.figure(
        f"At the largest packing, by virial and wall: {build.results_text}. Dotted: a large gas."
    )


def _pressures(trace: Trace, since: float) -> tuple[float, float, float]:
    """PV/NT in the steady part by the virial of the balls and by the wall; the temperature, J."""
    return virial_ratio(trace, since), ideal_gas_ratio(trace, since), mean_temperature(trace, since)
