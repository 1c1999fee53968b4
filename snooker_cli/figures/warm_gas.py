"""Gases whose walls give energy: temperature, profiles, balance of energy, heat, pressure."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.gas import Gas, finite_ratio
from snooker_cli.analysis.observables import mean_and_error, standard_errors
from snooker_cli.analysis.profiles import (
    NEAR,
    Profile,
    is_radial,
    measured_profile,
    middles,
    temperature_jumps,
    wall_temperatures,
)
from snooker_cli.containers import ENDS
from snooker_cli.errors import FigureError
from snooker_cli.figures.counted_parts import CountedParts, increments, measured, window_edges
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    EXTRAPOLATED,
    LOG_MARGIN,
    MEASURED,
    NEUTRAL,
    SECOND,
    FigureData,
    Layer,
    Line,
    Panel,
    Points,
    Reference,
    legend_line,
    legend_marker,
    markers,
    mean_layers,
    mean_of_remaining,
    more_than_a_decade,
)
from snooker_cli.figures.series import axis_label
from snooker_cli.figures.sweeps import places_between, start_with
from snooker_cli.formatting import counted, listed, short, with_error
from snooker_cli.runs.selection import value_at
from snooker_cli.scene import Scene

BINS = 20  # of profiles
MOST_BALLS = 4_000_000  # balls times states of a point's profiles, which take a second or two
CURVE = 100  # vertices of a curve of theory

OF_TEMPERATURE = theories.WALLS, theories.BALANCE


def stationary(build: FigureBuilder) -> FigureData:
    """Temperature against a swept key, a series for each CoR, with the balance of energy."""
    key, steady = build.key, CountedParts(build)
    for index, group in enumerate(build.groups):
        rows, expected = [], []
        for point in group:
            mean, error = mean_and_error(steady.gas(point).temperature)
            rows.append((mean, error))
            changes = point.index in steady.changing
            law = build.predicted(build.start(point), quantities.TEMPERATURE, *OF_TEMPERATURE)
            expected.append(math.nan if law is None else law)
            measured = {"changing_temperature": mean} if changes else {"temperature": (mean, error)}
            build.record(point, **measured, theory=law)
        x = np.array([float(value_at(point, key)) for point in group])
        y, errors = np.array(rows).T
        if np.isfinite(expected).any():
            places = places_between(build, group[0], key, x)
            curve = [_temperature(start_with(group[0], key, place)) for place in places.tolist()]
            build.lines.append(Line(places, np.array(curve), None, index, BY_THEORY))
        changing = np.array([point.index in steady.changing for point in group])
        build.add_residuals(
            index, *(each[~changing] for each in (x, y, errors, np.array(expected)))
        )
        errors[changing] = math.nan  # an error would say that this is the mean of a steady gas
        build.lines += markers(x, y, errors, build.name_of(group), index, changing)
    caption = steady.text
    if steady.changing:
        build.where = "where steady"
        caption += " Open: the gas still changes."
        build.lines.append(legend_marker("still changes", filled=False))
    if build.cited:
        build.lines.append(legend_line(", ".join(build.cited), BY_THEORY))
    columns = [line.y for line in build.lines if isinstance(line, Points)]
    log = more_than_a_decade(columns)
    columns += [line.y[np.isfinite(line.y)] for line in build.lines if isinstance(line, Line)]
    highest = max(float(column.max()) for column in columns if len(column))  # also of open markers
    return build.figure(
        caption,
        logarithmic=log,
        y_limits=(None if log else 0.0, LOG_MARGIN * highest),
        x_label=axis_label(build.points[0], key),
        x_log=key == "wall_speed",
    )


def _temperature(scene: Scene | None) -> float:
    """The temperature by the first theory of a start, J; nan without one."""
    if scene is None:
        return math.nan
    known = theories.values_of(scene, quantities.TEMPERATURE, *OF_TEMPERATURE)
    return next(iter(known.values()), math.nan)


def _profile(build: FigureBuilder, steady: CountedParts) -> Profile:
    """The profile of the only point in its steady part. Raises ``FigureError``."""
    (point,) = build.points
    most = build.states(point, MOST_BALLS, MOST_BALLS)
    return measured_profile(build.start(point), steady.traces(point), BINS, most)


def profiles(build: FigureBuilder) -> FigureData:
    """Temperature, packing and pressure across a box or channel, or along the radius of a circle.

    The pressure is that of theory at the density and temperature of each place.
    """
    steady, (point,) = CountedParts(build), build.points
    profile, scene = _profile(build, steady), build.start(point)
    places, temperature = profile.middles, profile.temperature
    _, density, across, along = profile
    gas, circle = steady.gas(point), is_radial(scene)
    way = "along the radius" if circle else "across"
    warm = gas.temperature
    build.add_means(0, None, places, temperature)
    heats = wall_temperatures(scene).items()
    walls = {place: heat for place, heat in heats if math.isfinite(heat)}
    if walls:
        at = np.array([*walls]), np.array([*walls.values()])
        build.lines.append(Points(*at, None, "T of the walls", NEUTRAL, filled=False))
    packing = math.pi * float(np.mean(scene.radii**2)) * density
    panels, pressure = [Panel(mean_layers(places, packing), "packing")], None
    coldest, heat = int(np.argmin(temperature.mean(axis=0))), temperature.mean(axis=0)
    hottest = int(np.argmax(heat))
    caption = f" T {way} is that of the velocities {way} alone."
    if not facts.hold(scene, "elastic"):  # else T is uniform, and has only noise
        build.headline = f"from {short(heat[hottest], 2)} J down to {short(heat[coldest], 2)} J"
        ends = [f"{short(heat[k])} J at {short(places[k], 2)} m" for k in (hottest, coldest)]
        caption += f" T is highest with {ends[0]}, lowest with {ends[1]}."
    if facts.hold(scene, *theories.LARGE):
        factor = theory.granular_compressibility(packing.mean(axis=0), scene.restitution)
        # Beside a wall balls are in layers, of which Z of a uniform gas says nothing.
        beside = np.abs(profile.edges[-1] - np.abs(places)) < 2 * gas.radius
        pressure = np.where(beside, math.nan, density * temperature * factor)
        # Centres reach less than the length of the walls, and take all of the force.
        edge = scene.container.accessible(gas.radius).edge
        force = float(np.mean(gas.pressure)) * scene.container.wall_length / edge
        line = Reference("y", force, "force on the walls", SECOND)
        panels.append(Panel((line, *mean_layers(places, pressure)), "nTZ (Pa·m)"))
        if np.isfinite(pressure).any():
            over_force = with_error(*mean_and_error(np.nanmean(pressure, axis=1) / force))
            caption += f" The mean nTZ is {over_force} times the force on the walls over their "
            caption += "length; strips beside walls have none."
    with np.errstate(divide="ignore", invalid="ignore"):  # balls that move along one line, or rest
        share = mean_layers(places, across / temperature)  # T is the mean of both components
        panels.append(Panel((Reference("y", 1.0), *share), f"T {way} / T"))
        ratio = mean_and_error(np.nanmean(across, axis=1) / np.nanmean(along, axis=1))
    build.record(
        point,
        place=places,
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


def energy_balance(build: FigureBuilder) -> FigureData:
    """Power of the walls, of the losses in collisions, and what is left, in windows of time.

    What is left changes the energy of the gas. Its points are open while the gas changes.
    """
    steady, shares, rests = CountedParts(build), list[Layer](), list[float]()
    # Without losses, the power in is zero in the mean.
    over_in = all(facts.hold(point.config, "lossy_pairs") for point in build.points)
    for index, point in enumerate(build.points):
        measurement, part = steady.gas(point).measurement, steady.averages(point)
        lossy = facts.hold(point.config, "lossy_pairs")
        curve, edges = measurement.curve, window_edges(measurement.curve.time)
        given = increments(edges, curve.time, curve.wall_energy) / np.diff(edges)
        # Without losses only rounding is left.
        lost = increments(edges, curve.time, curve.lost_energy) / np.diff(edges) * lossy
        build.add_means(index, build.label(point), middles(edges), given)
        build.add_means(index, None, middles(edges), lost, SECOND)
        unit = mean_of_remaining(given)[0] if over_in else np.ones(len(edges) - 1)
        change = increments(edges, curve.time, curve.kinetic_energy) / np.diff(edges)
        rests.append(float(np.nanmax(np.abs(given - lost - change))))
        first = len(unit) if point.index in steady.changing else steady.gas(point).first_window
        settled = np.arange(len(unit)) >= (first or 0)
        x = middles(edges)
        shares += markers(x, *mean_of_remaining((given - lost) / unit), None, index, ~settled)
        given_rate = mean_and_error(part.wall_energy / part.length)
        taken_rate = mean_and_error(part.lost_energy * lossy / part.length)
        rest = mean_and_error((part.wall_energy - part.lost_energy * lossy) / part.length)
        name = "changing_rate" if point.index in steady.changing else "given_rate"
        build.record(point, **{name: given_rate}, taken_rate=taken_rate, rest_rate=rest)
    build.lines += [
        legend_line("in: walls give", MEASURED),
        legend_line("out: collisions take", SECOND),
    ]
    shares.append(legend_marker("in − out"))
    if any(isinstance(layer, Points) and not layer.filled for layer in shares):
        shares.append(legend_marker("while the gas changes", filled=False))
    build.headline = "it still changes" if steady.changing else "in and out are equal"
    if len(build.points) > 1:
        build.headline = f"steady at {counted(len(build.points) - len(steady.changing), 'point')}"
        build.headline += f" of {len(build.points)}"
    unexplained = f"In − out equals the gain of the gas to {short(max(rests), 1)} W."
    number, still = len(steady.changing), ""
    if number:
        of_points = f" of {counted(number, 'point')}" * (len(build.points) > 1)
        still = f"The gas{of_points} still changes. "
    taken = f"Collisions take {with_error(*taken_rate, 'W')}." * (len(build.points) == 1)
    return build.figure(
        f"{taken} {unexplained} {still}{steady.text}".lstrip(),
        logarithmic=build.covers_decades,
        panel=(Reference("y", 0.0), *shares),
        panel_label="(in−out) / in" if over_in else "in − out (W)",
    )


def heat_flux(build: FigureBuilder) -> FigureData:
    """The flux of heat through the walls, and by Enskog's conductivity between them."""
    (point,) = build.points
    steady, scene = CountedParts(build), build.start(point)
    gas, panels = steady.gas(point), list[Panel]()
    sides, through = ENDS[scene.container.across or "x"], gas.heat_through
    if np.isnan(through).any():
        raise FigureError("a repeat has too many collisions for this figure; run a shorter one")
    both = [mean_and_error(side) for side in through.T]
    numbers: dict[str, Any] = dict(zip(sides, both, strict=True))
    is_elastic, caption = facts.hold(scene, "elastic_pairs"), steady.text
    if is_elastic:
        numbers["flux"] = flux = mean_and_error(through.mean(axis=1))
        build.lines.append(Reference("y", flux[0], "mean of both walls", MEASURED))
    law = theories.theory_of(scene, quantities.HEAT_FLUX, theories.CONDUCTIVITY)
    if law is not None:
        gas = Gas(gas.measurement, first_window=gas.first_window, profile=_profile(build, steady))
        places, local = gas.conduction
        name = build.cite(law.quantity, law.model)
        build.add_means(0, f"{name}, −κ dT/dx of the profile", places, local, BY_THEORY)
        numbers["enskog"] = middle = mean_and_error(np.asarray(law.value(gas)))
        caption += f" dT/dx is the slope of a line through {2 * NEAR + 1} of {BINS} strips."
        if is_elastic:
            over, mean = flux[0] / middle[0], local.mean(axis=0)
            ratio = over, math.hypot(flux[1], over * middle[1]) / abs(middle[0])
            numbers |= {"over_enskog": ratio}
            caption += f" The flux is {with_error(*ratio)} times the mean of Enskog's."
            # To first order, as the mean of ratios would be too large.
            ratios = mean_layers(places, flux[0] / mean * (2 - local / mean))
            along = np.concatenate([layer.y for layer in ratios if isinstance(layer, Line)])
            build.headline = f"{with_error(*ratio)} times Enskog's"
            caption += (
                f" Place by place it is {short(along.min(), 2)} to {short(along.max())} times."
            )
            panels.append(Panel((Reference("y", 1.0), *ratios), "flux / Enskog's"))
        else:
            caption += " κ is that of elastic balls."
        numbers |= (jumps := _jumps(build, gas))
        caption += _jump_sentence(jumps, sides)
    at_walls = np.array([*wall_temperatures(scene)]), through.mean(axis=0), standard_errors(through)
    build.lines.append(Points(*at_walls, "measured at the walls", 1))
    build.record(point, **numbers)
    return build.figure(caption, panels=tuple(panels))


def _jumps(build: FigureBuilder, gas: Gas) -> dict[str, Any]:
    """The jump of temperature at each thermal wall, measured and by theory, J."""
    law = theories.theory_of(gas.scene, quantities.TEMPERATURE_JUMP, theories.JUMP)
    if law is None:
        return {}
    build.cite(law.quantity, law.model)
    found, measured = dict[str, Any](), temperature_jumps(gas.scene, gas.profile)
    expected = np.asarray(law.value(gas))
    for side in np.flatnonzero(np.isfinite(measured[0])):
        found[f"jump_{side}"] = mean_and_error(measured[:, side])
        found[f"jump_theory_{side}"] = float(expected[side])
    return found


def _jump_sentence(jumps: Mapping[str, Any], sides: Sequence[str]) -> str:
    """A sentence on the jumps of temperature; empty without a thermal wall."""
    found = []
    for side, name in enumerate(sides):
        if f"jump_{side}" in jumps:
            (value, error), law = jumps[f"jump_{side}"], short(jumps[f"jump_theory_{side}"])
            found.append(f"{with_error(value, error, 'J')} at the {name} wall (Maxwell: {law} J)")
    return f" T of the wall less T of the gas beside it is {listed(found)}." if found else ""


def equation_of_state(build: FigureBuilder) -> FigureData:
    """PV/NT − 1 by the virial of the balls, over the packing, in the steady state, with theory.

    It is (1 + e) χ in a very large gas. PV/NT itself differs little between dilute gases. Below,
    the rate of collisions over Boltzmann's, which is χ.
    """
    steady = CountedParts(build)
    rates, densest = list[Layer](), 0.0
    for index, group in enumerate(build.groups):
        rows, scenes = [], [build.start(point) for point in group]
        for point, scene in zip(group, scenes, strict=True):
            gas, packing = steady.gas(point), scene.packing_fraction
            disks = theories.disk_ratios(scene)
            inner = mean_and_error(measured(gas, quantities.VIRIAL_RATIO))
            outer = mean_and_error(measured(gas, quantities.RATIO))
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
            law = theories.theory_of(scene, quantities.PAIR_RATE, theories.BOLTZMANN)
            if law is not None and not build.source:
                over = measured(gas, quantities.PAIR_RATE) / np.asarray(law.value(gas))
                numbers["rate_over_boltzmann"] = of_all = mean_and_error(over)
                at, mean, error = (np.array([value]) for value in (packing, *of_all))
                rates.append(Points(at, mean, error, None, index))
                densest = max(densest, packing)
            build.record(point, packing=packing, **numbers, wall=outer)
        packings, added, errors, expected_here = np.array(rows).T
        build.add_residuals(index, packings, added, errors, expected_here)
        label = build.name_of(group)
        build.lines += [
            *_curves(scenes, float(packings.max()), index, both=build.source),
            Points(packings, added, errors, label, index),
        ]
    drawn = {line.style for line in build.lines if isinstance(line, Line)}
    legend = {BY_THEORY: theory.FINITE, EXTRAPOLATED: theory.INFINITE}
    models = {style: model for style, model in legend.items() if style in drawn}
    for style, model in models.items():
        build.lines.append(legend_line(build.cite(quantities.VIRIAL_RATIO, model), style))
    caption = f"Packing and T are means over the whole gas. {steady.text}"
    if not rates:
        return build.figure(caption)
    grid = np.linspace(0.0, densest, CURVE)
    chi = np.array([float(theory.contact_value(packing)) for packing in grid])
    name = build.cite(quantities.PAIR_RATE, theories.ENSKOG)
    owner = NEUTRAL if len(build.groups) > 1 else 0
    panel = Panel((Line(grid, chi, f"χ, {name}", owner, BY_THEORY), *rates), "rate / Boltzmann's")
    return build.figure(caption, panels=(panel,))


def _curves(scenes: Sequence[Scene], highest: float, series: int, *, both: bool) -> list[Line]:
    """What theory has for (PV/NT − 1)/packing up to a packing: of this container, else a large gas.

    both : whether the curve of a large gas is drawn in any case
    """
    first = scenes[0]
    if theory.INFINITE not in theories.disk_ratios(first):
        return []
    grid = np.linspace(highest / CURVE, highest, CURVE)
    large = theory.granular_compressibility(grid, first.restitution)
    curves = [Line(grid, (large - 1) / grid, None, series, EXTRAPOLATED)]
    here = np.array([_of_scene(first, float(packing)) for packing in grid])
    if len({scene.number for scene in scenes}) == 1 and np.isfinite(here).any():
        return [*curves * both, Line(grid, (here - 1) / grid, None, series, BY_THEORY)]
    return curves


def _of_scene(scene: Scene, packing: float) -> float:
    """PV/NT by the virial of as many balls in the container at another packing; nan without it."""
    container, number = scene.container, scene.number
    radius = container.ball_radius(packing, number)
    resized = facts.resized(facts.traits_of(scene), number, radius, container)
    if not facts.hold(resized, *theories.FINITE_DISKS):
        return math.nan
    return finite_ratio(number, radius, container, scene.restitution).virial
