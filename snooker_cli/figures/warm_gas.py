"""Gases whose walls give energy: temperature, profiles, balance of energy, heat, pressure."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.gas import Gas, finite_ratio
from snooker_cli.analysis.observables import mean_and_error, standard_errors
from snooker_cli.analysis.quantities import Quantity
from snooker_cli.containers import ENDS
from snooker_cli.engine import States, replayed
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.counted_parts import CountedParts, gains, window_edges
from snooker_cli.figures.figure_data import (
    Array,
    Band,
    FigureData,
    Layer,
    Line,
    LineStyle,
    Panel,
    Points,
    Reference,
    legend_line,
    more_than_a_decade,
)
from snooker_cli.figures.selection import axis_label, swept_numbers, traits, value_at
from snooker_cli.formatting import with_error
from snooker_cli.laws import Law, Sides, Thermal
from snooker_cli.scene import Scene

BINS = 20  # of profiles
NEAR = 3  # bins on each side of one to which a line is fitted for the slope there
AT_WALL = np.array([0.85, 0.45, 0.05, -0.35])
"""Weights of the first bins at a wall: the value at the wall of the line fitted to them."""

MOST_BALLS = 4_000_000  # balls times states of a point's profiles, which take a second or two
BATCH = 2**18  # balls times states at once: arrays of this size stay in the cache
CURVE = 100  # vertices of a curve of theory

SWEPT = "wall_speed", "wall_temperature", "balls.count", "balls.radius", "cor"
"""The keys that the temperature is shown along; the first one that has several values."""


def stationary(build: FigureBuilder) -> FigureData:
    """Temperature against a swept key, a series for each CoR, with the balance of energy."""
    numbers = swept_numbers(build.groups[0])  # of runs side by side not their names
    key = next(key for key in SWEPT if key in numbers)
    names, steady = [group[0] for group in build.groups], CountedParts(build)
    drawn = dict[str, float]()
    for index, group in enumerate(build.groups):
        rows, expected = [], []
        for point in group:
            mean, error = mean_and_error(steady.gas(point).temperature)
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
        build.add_residuals(index, x, y, errors, np.array(expected))
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


def _profile(build: FigureBuilder, steady: CountedParts) -> tuple[Array, Array, Array, Array]:
    """Profiles of the only point, across the container or along the radius.

    Edges (*b* + 1,) of the bins, m; densities of centres (*repeats*, *b*), 1/m², and temperatures
    m⟨v²⟩ of the motion across (or along the radius) and at right angles to it, J: means over states
    at even times. Raises ``FigureError``.
    """
    (point,) = build.points
    scene = build.start(point)
    circle, axis = _is_radial(scene), _axis(scene)
    reach = scene.container.size[axis] / 2 - float(scene.radii.min())
    parts = np.linspace(0.0, 1.0, BINS + 1)
    # Rings of equal area, or strips of equal width.
    edges = reach * np.sqrt(parts) if circle else reach * (2 * parts - 1)
    area = scene.container.accessible(float(scene.radii.min())).area / BINS
    most = build.states(point, MOST_BALLS, MOST_BALLS)

    def sums(states: States) -> Array:
        """Balls, and m v² across and along, in each bin: (3, *b*)."""
        places = states.positions - states.container_positions[:, np.newaxis]
        order = [axis, 1 - axis]
        x, y = np.moveaxis(places, 2, 0)[order]
        u, v = np.moveaxis(states.velocities, 2, 0)[order]
        where = x
        if circle:
            where = np.hypot(x, y)
            far = np.where(where > 0, where, 1.0)
            u, v = (x * u + y * v) / far, (x * v - y * u) / far
        bin_of = np.clip(np.searchsorted(edges, where.ravel(), side="right") - 1, 0, BINS - 1)
        squares = ((scene.masses * speed**2).ravel() for speed in (u, v))
        weighted = [np.bincount(bin_of, square, BINS) for square in squares]
        return np.array([np.bincount(bin_of, minlength=BINS), *weighted])

    rows = []
    for trace, since in steady.traces(point):
        times = np.linspace(since, trace.stop.time, most)
        balls, *squares = np.sum([sums(states) for states in replayed(trace, times, BATCH)], axis=0)
        known = np.where(balls, balls, np.nan)
        rows.append((balls / (most * area), *(square / known for square in squares)))
    density, across, along = np.swapaxes(np.array(rows), 0, 1)
    return edges, density, across, along


def profiles(build: FigureBuilder) -> FigureData:
    """Temperature, packing and pressure across a box or channel, or along the radius of a circle.

    The pressure is that of theory at the density and temperature of each place.
    """
    steady, (point,) = CountedParts(build), build.points
    edges, density, across, along = _profile(build, steady)
    scene, middles, temperature = build.start(point), _middles(edges), (across + along) / 2
    gas, circle = steady.gas(point), _is_radial(scene)
    warm = gas.temperature
    columns = {
        "T": temperature,
        f"its part {'along the radius' if circle else 'across'}": across,
        f"its part {'around' if circle else 'along the walls'}": along,
    }
    styles: tuple[LineStyle, ...] = ("solid", "dashed", "dotted")
    for index, ((name, rows), style) in enumerate(zip(columns.items(), styles, strict=True)):
        build.add_means(index, name, middles, rows, style)
    walls = {place: law for place, law in _walls(scene).items() if isinstance(law, Thermal)}
    for place, law in walls.items():
        at = np.array([place]), np.array([law.temperature])
        build.lines.append(Points(*at, None, None, 0, filled=False))
    packing = math.pi * float(np.mean(scene.radii**2)) * density
    panels, pressure = [Panel(mean_layers(middles, packing), "packing")], None
    caption = " Open: the wall." * bool(walls)
    if facts.hold(scene, *theories.LARGE):
        factor = theory.granular_compressibility(packing.mean(axis=0), scene.restitution)
        pressure = density * temperature * factor
        at_walls = mean_and_error(gas.pressure)
        layers = (Reference("y", at_walls[0], None, "dashed"), *mean_layers(middles, pressure))
        panels.append(Panel(layers, "p = nTZ (Pa·m)"))
        caption += (
            f" Bottom: Z is that of a large gas at the packing there; dashed: P at the walls, "
            f"{with_error(*at_walls, 'Pa·m')}."
        )
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
        packing=packing.mean(axis=0),
        local_pressure=None if pressure is None else pressure.mean(axis=0),
        first_temperature=mean_and_error(temperature[:, 0]),
        last_temperature=mean_and_error(temperature[:, -1]),
        first_density=mean_and_error(density[:, 0] / density.mean()),
        last_density=mean_and_error(density[:, -1] / density.mean()),
    )
    return build.figure(
        f"{steady.text}{caption}",
        panels=tuple(panels),
        x_label="distance from the centre (m)" if circle else "place across (m)",
    )


def mean_layers(x: Array, rows: Array, series: int = 0) -> tuple[Layer, ...]:
    """The mean of rows (*repeats*, *x*), and behind it the band of its standard error."""
    mean, line = rows.mean(axis=0), Line(x, rows.mean(axis=0), None, series, "solid")
    if len(rows) < 2:
        return (line,)
    error = standard_errors(rows)
    return Band(x, mean - error, mean + error, None, series), line


def _middles(values: Array) -> Array:
    """Means of neighbours along the last axis."""
    return (values[..., 1:] + values[..., :-1]) / 2


def _walls(scene: Scene) -> dict[float, Law]:
    """The laws of the walls that a profile ends at, by the place of the wall, m."""
    right, law = scene.container.size[_axis(scene)] / 2, scene.wall_law
    if _is_radial(scene):
        return {right: law} if not isinstance(law, Sides) else {}
    first, last = ENDS[scene.container.across or "x"]
    both = (getattr(law, first), getattr(law, last)) if isinstance(law, Sides) else (law, law)
    return {-right: both[0], right: both[1]}


def _is_radial(scene: Scene) -> bool:
    """Whether profiles are along the radius."""
    return scene.container.across == "radius"


def _axis(scene: Scene) -> int:
    """The axis of profiles, 0 or 1: that across, or in a circle x."""
    return int(scene.container.across == "y")


def energy_balance(build: FigureBuilder) -> FigureData:
    """Power of the walls, of the losses in collisions, and what is left, in windows of time."""
    steady = CountedParts(build)
    for index, point in enumerate(build.points):
        measurement, part = steady.gas(point).measurement, steady.averages(point)
        lossy = facts.hold(traits(point), "lossy_pairs")
        curve, edges = measurement.curve, window_edges(measurement)
        given = gains(measurement, edges, curve.wall_energy) / np.diff(edges)
        # Without losses only rounding is left.
        taken = gains(measurement, edges, curve.lost_energy) / np.diff(edges) * lossy
        build.add_means(index, build.label(point), _middles(edges), given, "solid")
        build.add_means(index, None, _middles(edges), taken, "dashed")
        build.add_means(index, None, _middles(edges), given - taken, "dotted")
        given_rate = mean_and_error(part.wall_energy / part.length)
        taken_rate = mean_and_error(part.lost_energy * lossy / part.length)
        rest = mean_and_error((part.wall_energy - part.lost_energy * lossy) / part.length)
        build.record(point, given_rate=given_rate, taken_rate=taken_rate, rest_rate=rest)
    build.lines += [
        legend_line("walls give", "solid"),
        legend_line("collisions take", "dashed"),
        legend_line("the rest, dE/dt", "dotted"),
        Reference("y", 0.0),
    ]
    return build.figure(steady.text)


def heat_flux(build: FigureBuilder) -> FigureData:
    """The flux of heat through the walls, and by Enskog's conductivity between them."""
    (point,) = build.points
    steady = CountedParts(build)
    gas, scene = steady.gas(point), build.start(point)
    walls, height = _walls(scene), scene.container.size[1 - _axis(scene)]
    sides = ENDS[scene.container.across or "x"]
    ends = [scene.container.sides.index(side) for side in sides]
    edges, density, across, along = _profile(build, steady)
    warm, length = (across + along) / 2, gas.means.length[:, np.newaxis]
    given = gas.measurement.by_side[:, gas.first_window :, ends].sum(axis=1)
    through = given * (1, -1) / (height * length)
    if np.isnan(through).any():
        raise FigureError("a repeat has too many collisions for this figure; run a shorter one")
    size, mass = gas.radius, gas.mass
    packing = math.pi * size**2 * density.mean(axis=0)
    conductivity = theory.thermal_conductivity(packing, size, warm.mean(axis=0), mass)
    inside, middles = slice(NEAR, BINS - NEAR), _middles(edges)
    enskog = -conductivity[inside] * _slopes(warm, float(edges[1] - edges[0]))
    build.add_means(0, "Enskog's conductivity, −κ dT/dx", middles[inside], enskog, "solid")
    error = standard_errors(through)
    at_walls = np.array([*walls]), through.mean(axis=0), error
    build.lines.append(Points(*at_walls, "through the walls", 1))
    middle = mean_and_error(enskog.mean(axis=1))
    both = [mean_and_error(side) for side in through.T]
    numbers = dict(zip(sides, both, strict=True)) | {"enskog": middle}
    panels: tuple[Panel, ...] = ()
    is_elastic = facts.hold(scene, "elastic_pairs")
    if is_elastic:
        flux = mean_and_error(through.mean(axis=1))
        build.lines.insert(0, Reference("y", flux[0], "mean of both walls", "dashed"))
        over = flux[0] / middle[0]
        ratio = over, math.hypot(flux[1], over * middle[1]) / abs(middle[0])
        numbers |= {"flux": flux, "over_enskog": ratio}
        # To first order, as the mean of ratios would be too large.
        local = flux[0] / enskog.mean(axis=0) * (2 - enskog / enskog.mean(axis=0))
        layers = (Reference("y", 1.0), *mean_layers(middles[inside], local))
        panels = (Panel(layers, "flux / Enskog's"),)
    # A straight line through the strips at a wall gives the gas at it.
    for side, law in enumerate(walls.values()):
        if isinstance(law, Thermal):
            near = slice(None, None, -1 if side else 1)
            strips = [column[..., near][..., : len(AT_WALL)] for column in (packing, warm)]
            filling, heat = (float(strip.mean()) for strip in strips)
            slope = float(through[:, side].mean()) * (-1) ** side
            slope /= theory.thermal_conductivity(filling, size, heat, mass)
            expected = slope * theory.temperature_jump(filling, size, heat, mass)
            jump = mean_and_error(law.temperature - strips[1] @ AT_WALL)
            numbers |= {f"jump_{side}": jump, f"jump_theory_{side}": expected}
    build.record(point, **numbers)
    assumed = "" if is_elastic else " κ is that of elastic balls."
    fitted = f" dT/dx is the slope of a line through {2 * NEAR + 1} of {BINS} strips."
    return build.figure(f"{steady.text}{fitted}{assumed}", panels=panels)


def _slopes(rows: Array, width: float) -> Array:
    """Slopes of lines fitted to the ``NEAR`` bins on each side of a bin: (*repeats*, *inner*)."""
    steps = np.arange(-NEAR, NEAR + 1)
    windows = np.lib.stride_tricks.sliding_window_view(rows, len(steps), axis=1)
    return np.asarray(windows @ steps / (np.sum(steps**2) * width))


def equation_of_state(build: FigureBuilder) -> FigureData:
    """PV/NT − 1 by the virial of the balls, over the packing, in the steady state, with theory.

    It is (1 + e) χ in a very large gas. PV/NT itself differs little between dilute gases.
    """
    names, steady = [group[0] for group in build.groups], CountedParts(build)
    for index, group in enumerate(build.groups):
        rows, scenes = [], [build.start(point) for point in group]
        for point, scene in zip(group, scenes, strict=True):
            gas, packing = steady.gas(point), scene.packing_fraction
            disks = theories.disk_ratios(scene)
            inner = mean_and_error(_measured(gas, quantities.VIRIAL_RATIO))
            outer = mean_and_error(_measured(gas, quantities.RATIO))
            # Without walls balls meet at a temperature of their own.
            share = float(gas.meeting_ratio.mean()) * packing
            here = disks.get(theory.FINITE) or disks.get(theory.INFINITE)
            expected = math.nan if here is None else (here.virial - 1) / packing
            rows.append((packing, (inner[0] - 1) / share, inner[1] / share, expected))
            keys = {"theory": theory.INFINITE, "theory_here": theory.FINITE}
            numbers: dict[str, Any] = {
                key: disks[name].virial for key, name in keys.items() if name in disks
            }
            numbers |= {"temperature": mean_and_error(gas.temperature), "virial": inner}
            build.record(point, packing=packing, **numbers, wall=outer)
        packings, added, errors, expected_here = np.array(rows).T
        build.add_residuals(index, packings, added, errors, expected_here)
        label = build.label(group[0], names) or "simulation"
        build.lines += [
            *_curves(scenes, float(packings.max()), index, both=build.source),
            Points(packings, added, errors, label, index),
        ]
    drawn = {line.style for line in build.lines if isinstance(line, Line)}
    legend = {"solid": theory.FINITE, "dotted": theory.INFINITE}
    build.lines += [legend_line(legend[style], style) for style in legend if style in drawn]
    return build.figure(f"Packing and T are means over the whole container. {steady.text}")


def _measured(gas: Gas, quantity: Quantity) -> Array:
    """The values of a quantity in the repeats, as ``snooker compare`` has them."""
    assert quantity.measured is not None
    return quantity.measured(gas)


def _curves(scenes: Sequence[Scene], highest: float, series: int, *, both: bool) -> list[Line]:
    """What theory has for (PV/NT − 1)/packing up to a packing: of this container, else a large gas.

    both : whether the curve of a large gas is drawn in any case
    """
    first = scenes[0]
    if theory.INFINITE not in theories.disk_ratios(first):
        return []
    grid = np.linspace(highest / CURVE, highest, CURVE)
    large = theory.granular_compressibility(grid, first.restitution)
    curves = [Line(grid, (large - 1) / grid, None, series, "dotted")]
    here = np.array([_of_scene(first, float(packing)) for packing in grid])
    if len({scene.number for scene in scenes}) == 1 and np.isfinite(here).any():
        return [*curves * both, Line(grid, (here - 1) / grid, None, series, "solid")]
    return curves


def _of_scene(scene: Scene, packing: float) -> float:
    """PV/NT by the virial of as many balls in the container at another packing; nan without it."""
    container, number = scene.container, scene.number
    radius = container.ball_radius(packing, number)
    resized = facts.resized(facts.traits_of(scene), number, radius, container)
    if not facts.hold(resized, *theories.FINITE_DISKS):
        return math.nan
    return finite_ratio(number, radius, container, scene.restitution).virial
