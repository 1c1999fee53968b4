"""Over time: pressure, hexatic order, a2, species' temperatures, local energy."""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from snooker_cli import facts, theory, two_temperatures
from snooker_cli.analysis import observables, quantities, structure, theories
from snooker_cli.analysis.comparison import species_change
from snooker_cli.analysis.gas import cooling_spins, fluid_state, haff_rate, temperatures
from snooker_cli.analysis.goodness import (
    FEWEST_TESTED,
    LEAST_PROBABILITY,
    MOST_ERRORS,
    joint_probability,
)
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import (
    collisions_per_ball,
    mean_and_error,
    standard_errors,
)
from snooker_cli.analysis.time_series import interpolated
from snooker_cli.config import Point
from snooker_cli.engine import stored_times
from snooker_cli.errors import FigureError
from snooker_cli.figures.cooling import with_cor
from snooker_cli.figures.counted_parts import CountedParts, measured
from snooker_cli.figures.declared_result import Result
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    EXTRAPOLATED,
    MEASURED,
    MOST_ENTRIES,
    NEUTRAL,
    SECOND,
    Array,
    Band,
    Course,
    FigureData,
    Layer,
    Line,
    Panel,
    Points,
    Reference,
    courses,
    legend_line,
    level,
    mean_of_remaining,
)
from snooker_cli.figures.series import along, elastic, gas_type_of
from snooker_cli.formatting import chance, least_to_most, short, with_error
from snooker_cli.options import WHERE
from snooker_cli.runs.selection import varying
from snooker_cli.scene import Scene
from snooker_cli.trace import even_choice

MARGIN = 0.1  # margin above settled pressures, as a share of them


def pressure(build: FigureBuilder) -> FigureData:
    """The mean pressure since the start."""
    expected: list[float] = []
    for scene in map(build.start, build.points):
        if not facts.hold(scene, "elastic", "moves", *theories.FINITE_DISKS):
            continue
        # Without walls balls meet at a temperature of their own.
        met = observables.meeting_temperature(scene.kinetic_energy, scene)
        drift = scene.number * (scene.kinetic_energy / scene.number - met)
        value = fluid_state(scene, met).pressure + drift / scene.container.area
        if value not in expected:
            name = None if expected else f"{theory.FINITE}, CoR 1"
            build.lines.append(Reference("y", value, name, BY_THEORY))
            expected.append(value)
    top = max(expected, default=0.0)
    for index, point in enumerate(build.points):
        times, rows = build.add_mean_course(index, point, _pressures(build.measurement(point)))
        top = max([top, *(_settled_top(times, row) for row in rows)])
        final = mean_and_error(rows[:, -1])
        build.record(point, time=float(times[-1]), pressure=final)
    if not any(record["pressure"] for record in build.records):
        raise FigureError("nothing hits the wall, so there is no pressure; run longer")
    return build.figure(
        numbers={"theory": expected},
        y_limits=(0, (1 + MARGIN) * top),
    )


def _pressures(measurement: Measurement) -> list[Course]:
    """Times (s) and mean pressures since the start (Pa·m): at first 0, without walls the ideal."""
    scene, curve = measurement.scene, measurement.curve
    if np.any(measurement.time == 0):
        raise FigureError("nothing happens after the start of a repeat, so it has no pressure")
    first = 0.0 if facts.hold(scene, "walls") else scene.kinetic_energy / scene.container.area
    return courses(curve.time, np.where(curve.time > 0, curve.pressure, first))


def _settled_top(time: Array, values: Array) -> float:
    """The largest value after the first tenth of the time: what an axis of a mean needs to show.

    Before, a mean since the start is that of a few hits, and may be many times as large.
    """
    return float(np.max(values[time >= 0.1 * time[-1]]))


# Means over the repeats of what the states have at even numbers of collisions.

TIMES = 61  # times at which repeats are compared
EARLIEST = 0.05  # collisions over balls at the first time of a logarithmic axis

SUMS, TRIANGLES = (40_000_000, 1700), (500_000, 25)
"""What a figure can afford, for sums over balls and for neighbours: balls times states, and the
balls that a state counts more, because Python needs some 0.2 ms for it."""


def _over_time(
    build: FigureBuilder,
    observable: structure.Observable,
    cost: tuple[int, int] = SUMS,
    *,
    logarithmic: bool = False,
) -> Iterator[tuple[Point, Scene, Array, Array]]:
    """Each point, its start, times (*t*,), s, and an observable of the states, (*n*, *t*, *k*).

    logarithmic : whether the times are even on a logarithmic axis, and begin after the start

    It is nan after the end of a repeat.
    """
    for point, times in _common_times(build, cost, logarithmic=logarithmic):
        times = times[times > 0] if logarithmic else times
        rows = []
        for trace in build.traces(point):
            here = times[times <= trace.stop.time]
            if not point.config.keeps_events:
                here = np.intersect1d(here, stored_times(trace))
            known = structure.over_time(observable, trace, here).reshape(len(here), -1)
            rows.append(np.full((len(times), known.shape[1]), math.nan))
            rows[-1][np.isin(times, here)] = known
        yield point, build.start(point), times, _known(np.array(rows))


def _known(rows: Array) -> Array:
    """Rows of repeats. Raises ``FigureError`` if nothing could be measured."""
    if not np.any(np.isfinite(rows)):
        raise FigureError("the balls are too few, or do not move; run more balls")
    return rows


def _common_times(
    build: FigureBuilder,
    cost: tuple[int, int],
    *,
    of_states: bool = True,
    logarithmic: bool = False,
) -> Iterator[tuple[Point, Array]]:
    """Times (*t*,), s, of each point at even collision numbers of the second longest repeat.

    of_states : whether states are needed there, which a repeat without events has stored
    logarithmic : whether the logarithms of these numbers are even, from `EARLIEST` on

    They end with this repeat. Raises ``FigureError`` if nothing happens in it.
    """
    most, each = cost
    for point in build.points:
        count = build.states(point, TIMES, most, each=each, fewest=TIMES)
        if of_states and not point.config.keeps_events:
            yield point, _stored_times(build, point, count)
            continue
        measurement = build.measurement(point)
        chosen = int(np.argsort(measurement.time)[-2:][0])
        time, events = measurement.curve.time[chosen], measurement.curve.events[chosen]
        end = measurement.time[chosen]
        # The curve has its times between collisions: at one, two balls touch.
        last = float(np.interp(end, time, events)) - 1
        numbers = np.floor(np.linspace(0, last, count))
        if logarithmic:
            first = min(max(1.0, EARLIEST * build.start(point).number), max(1.0, last))
            numbers = np.unique(np.append(0.0, np.floor(np.geomspace(first, last, count))))
        between = np.minimum(np.interp(numbers[1:], events, time), end)
        times = np.unique(np.append(0.0, between))
        if len(times) < 2:
            raise FigureError("nothing happens in the repeats; run longer")
        yield point, times


def _stored_times(build: FigureBuilder, point: Point, count: int) -> Array:
    """At most ``count`` times at which two repeats of a point have a stored state, s, or the only.

    Start and end are among them, but different ends are not. Raises ``FigureError`` if there is
    only the start.
    """
    stored = [stored_times(trace) for trace in build.traces(point) if trace.snapshots is not None]
    times, number = np.unique(np.concatenate([np.empty(0), *stored]), return_counts=True)
    common = times[number >= min(2, len(stored))]
    if len(common) < 2:
        raise FigureError("a repeat ended before its first snapshot; give earlier `snapshots`")
    return np.asarray(common[even_choice(len(common), count)])


def hexatic_order(build: FigureBuilder) -> FigureData:
    """|⟨ψ6⟩| and ⟨|ψ6|⟩ over time, and what |⟨ψ6⟩| is for independent directions."""
    over_time = _over_time(build, structure.hexatic_orders, TRIANGLES, logarithmic=True)
    each, ends, independent = build.for_panel(), list[Points](), dict[int, list[float]]()
    for index, (point, scene, times, rows) in enumerate(over_time):
        last, of_all = build.add_means(index, build.label(point), times, rows[..., 0])
        _, of_each = each.add_means(index, None, times, rows[..., 1])
        final, local = mean_and_error(of_all[:, -1]), mean_and_error(of_each[:, -1])
        value, error = (np.array([number]) for number in final)
        ends.append(Points(last[-1:], value, error, None, index))
        alone = local[0] / math.sqrt(scene.number)
        independent.setdefault(scene.number, []).append(alone)
        build.record(point, final=final, local=local, balls=scene.number, independent=alone)
    for of_number in independent.values():  # nearly the same for all points of as many balls
        build.lines.append(Reference("y", float(np.mean(of_number)), None, EXTRAPOLATED))
    build.lines.append(legend_line("independent balls, ⟨|ψ₆|⟩/√N", EXTRAPOLATED))
    ratios = [record["final"] / record["independent"] for record in build.records]
    times_independent = least_to_most(ratios, partial(short, digits=2))
    build.headline = f"{times_independent} times ⟨|ψ₆|⟩/√N at the end"
    if len(build.points) > 1:  # bands and single repeats would hide the means
        build.singles, build.bands, each.singles, each.bands = [], [], [], []
        build.lines += ends
    return build.figure(
        "Both are 1 in a crystal. If each ball had a direction of its own, |⟨ψ₆⟩| would be near "
        "⟨|ψ₆|⟩/√N; in a liquid neighbours share one, and in a crystal all do.",
        logarithmic=build.covers_decades,
        panels=(each.as_panel("of each ball, ⟨|ψ₆|⟩"),),
    )


def a2(build: FigureBuilder) -> FigureData:
    """a2 over collisions per ball, or against the CoR if it is swept.

    With theory for balls of one type; of a mixture for each species. The first collisions belong to
    the start.
    """
    swept = varying(build.points)
    if "cor" in swept and build.all_hold("equal_balls"):
        others = [key for key in swept if key != "cor"]
        if not others or (len(others) == 1 and len(build.points) > MOST_ENTRIES):
            build.groups = along(build.points, ["cor"], others[0] if others else None)
            return _a2_against_cor(build)
    for point, scene, collisions, rows in _a2(build):
        names = [None] if facts.hold(scene, "equal_balls") else structure.species_names(scene)
        expected = None if build.too_thin(scene) else build.predicted(scene, *SONINE)
        for column, name in zip(np.moveaxis(rows, 2, 0), names, strict=True):
            if not np.isfinite(column).any():
                continue
            label, index = ", ".join(filter(None, [build.label(point), name])), len(build.records)
            _, kept = build.add_means(index, label or None, collisions, column)
            if expected is not None:
                build.lines.append(level(collisions, expected, index))
            build.record(point, species=name, second_half=_second_half(kept), theory=expected)
    if any(record["theory"] is not None for record in build.records):
        build.lines.append(legend_line("theory", BY_THEORY))
    return build.figure(_differences(build))


NEARLY_ELASTIC = 0.999  # the theory at CoR 1 is another one
SONINE = quantities.SONINE, theories.FIXED, theories.COOLING
"""a2 and its theories, the first of which is that of elastic balls."""


def _a2_against_cor(build: FigureBuilder) -> FigureData:
    """a2 in the second half of the collisions of each point, with theory, and their difference.

    Points of another swept key are a series each.
    """
    several, difference = len(build.groups) > 1, list[Layer]()
    means, expected = dict[int, tuple[float, float]](), dict[int, float]()
    for number, (point, start, collisions, rows) in enumerate(_a2(build)):
        _, kept = build.lasting(number, collisions, rows[..., 0])
        means[point.index] = _second_half(kept)
        theory_of_point = build.predicted(start, *SONINE)
        expected[point.index] = math.nan if theory_of_point is None else theory_of_point
        build.record(point, second_half=means[point.index], theory=theory_of_point)
    for index, group in enumerate(build.groups):
        cors = np.array([point.config.cor for point in group])
        mean, error = np.transpose([means[point.index] for point in group])
        build.lines.append(Points(cors, mean, error, build.name_of(group), index))
        grid = np.linspace(cors[0], min(cors[-1], NEARLY_ELASTIC), 100)
        scene = build.start(group[0])
        known = [theories.values_of(with_cor(group[0], scene, float(e)), *SONINE) for e in grid]
        curve = np.array([next(iter(values.values()), math.nan) for values in known])
        if np.isfinite(curve).any():
            build.lines.append(Line(grid, curve, None if several else "theory", index, BY_THEORY))
            law = np.array([expected[point.index] for point in group])
            difference.append(Points(cors, mean - law, error, None, index))
    caption = _differences(build) if difference else ""
    if difference:
        difference.insert(0, Reference("y", 0.0))
        build.lines += [legend_line("theory", BY_THEORY)] if several else []
    return build.figure(
        caption,
        x_label="coefficient of restitution e",
        x_limits=(None, None),
        panels=(Panel(tuple(difference), "a₂ − theory"),) if difference else (),
    )


def _differences(build: FigureBuilder) -> str:
    """A sentence on how far a₂ is from theory, which may be zero; also the headline.

    Empty without a test.
    """
    apart = [
        ((row["second_half"] - row["theory"]) / row["second_half_error"], row, place)
        for row, place in zip(build.records, build.places, strict=True)
        if row["theory"] is not None and row["second_half_error"] > 0
    ]
    if not apart or build.fewest_repeats < FEWEST_TESTED:
        return ""
    differences = np.array([row["second_half"] - row["theory"] for _, row, _ in apart])
    weights = np.array([row["second_half_error"] ** -2 for _, row, _ in apart])
    mean, error = np.average(differences, weights=weights), np.sum(weights) ** -0.5
    by_chance = joint_probability(np.array([errors for errors, *_ in apart]))
    agrees = by_chance >= LEAST_PROBABILITY
    build.headline = f"{'agrees with' if agrees else 'differs from'} theory"
    errors, row, place = max(apart, key=lambda known: abs(known[0]))
    difference = row["second_half"] - row["theory"]
    size = with_error(abs(difference), row["second_half_error"])
    if len(apart) == 1:
        side = "above" if difference > 0 else "below"
        return f"It is {size} {side} theory ({abs(errors):.1f} errors)."
    return (
        f"Chance alone gives differences as large at {len(apart)} points with {chance(by_chance)}; "
        f"weighted by their errors they are {with_error(mean, error)} in the mean. The most "
        f"significant is {size} {'above' if difference > 0 else 'below'} theory "
        f"({abs(errors):.1f} errors, {place})."
    )


def _second_half(rows: Array) -> tuple[float, float]:
    """The mean of rows (*n*, *t*) over their second half, and its standard error."""
    return mean_and_error(rows[:, rows.shape[1] // 2 :].mean(axis=1))


def species_temperature(build: FigureBuilder) -> FigureData:
    """Temperatures of the species over collisions per ball; of two T₁/T₂ below, with theory."""
    parts, panels, numbers = CountedParts(build), list[Panel](), dict[str, float]()
    walls = all(facts.hold(point.config, "walls") for point in build.points)
    observable = partial(structure.species_temperature, walls=walls)
    ((point, scene, times, rows),) = _over_time(build, observable)
    times, rows = build.lasting(0, times, rows)
    curve, caption, kept = build.measurement(point).curve, "", gas_type_of(point) != "cooling"
    pairs = curve.at(times, curve.pair_events).mean(axis=0)
    collisions = collisions_per_ball(pairs, scene.number)
    # The temperatures of one instant vary; those of a gas that cools have no mean.
    later = rows[:, len(times) // 2 if kept else -1 :].mean(axis=1)
    shown = np.where(rows > COLD * rows.max(), rows, math.nan)  # a ball may start at rest
    for index, name in enumerate(structure.species_names(scene)):
        first = int(np.argmax(np.isfinite(shown[..., index]).any(axis=0)))
        of_species = shown[:, first:, index]
        build.add_means(index, f"{index + 1}: {name}", collisions[first:], of_species)
        build.record(point, species=name, temperature=mean_and_error(later[:, index]))
    if rows.shape[2] > 2:
        when = "in the second half" if kept else "at the end"
        build.result = Result("temperature", "temperature", when)
    else:
        gas = parts.gas(point)
        ratio = mean_and_error(measured(gas, quantities.SPECIES_RATIO))
        numbers["ratio"], numbers["ratio_error"] = ratio
        layers = _ratio_layers(collisions, rows)
        model = two_temperatures.EQUAL_RATES
        law = build.predicted(scene, quantities.SPECIES_RATIO, model)
        if law is not None:
            numbers["theory"] = law
            build.headline = f"T₁/T₂ = {with_error(*ratio)}, theory {short(law, 4)}"
            layers.append(level(collisions, law, NEUTRAL))
            build.lines.append(legend_line(f"T₁/T₂, {model}", BY_THEORY))
        panels.append(Panel(tuple(layers), "T₁/T₂"))
        change = species_change(gas.measurement)
        if change.refused:
            caption = f"T₁/T₂: {change.sentence}."
    if point.index in parts.changing:
        caption += " The gas is not steady: its energy still changes."
    return build.figure(
        f"{caption} {parts.text}".strip(),
        numbers=numbers,
        logarithmic=build.covers_decades,
        panels=tuple(panels),
    )


COLD = 1e-9  # share of the highest temperature that is none: a logarithm has no place for it


def _ratio_layers(x: Array, rows: Array) -> list[Layer]:
    """The ratio of two columns' means over repeats, of (*n*, *t*, 2), with its standard error.

    Means come first: the mean of ratios is too large where the second species has few balls.
    """
    shares = rows / rows.sum(axis=2, keepdims=True)  # the repeats may cool at other rates
    first, second = shares.mean(axis=0).T
    ratio = first / second
    error = standard_errors((shares[..., 0] - ratio * shares[..., 1]) / second)
    band = [Band(x, ratio - error, ratio + error, None, NEUTRAL)] if len(rows) > 1 else []
    return [*band, Line(x, ratio, None, NEUTRAL)]


def rotation(build: FigureBuilder) -> FigureData:
    """T_rot/T_tr over collisions per ball, beside theory; below how T_tr falls."""
    decay, known, spins = list[Layer](), False, (quantities.SPIN_RATIO, two_temperatures.MEAN_FIELD)
    for index, point in enumerate(build.points):
        measurement = build.measurement(point)
        collisions, both = temperatures(measurement)
        ends = collisions[:, -1:]
        x = np.linspace(0.0, float(np.sort(ends[:, 0])[-2:][0]), TIMES)[1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = interpolated(x, collisions, both[1] / both[0])
            moving = np.exp(interpolated(x, collisions, np.log(both[0] / both[0, :, :1])))
        ratio, moving = (np.where(x <= ends, rows, math.nan) for rows in (ratio, moving))
        _, kept = build.add_means(index, build.label(point), x, ratio)
        last, final = kept.shape[1] - 1, None
        decay.append(Line(x, mean_of_remaining(moving)[0], None, index))
        if gas_type_of(point) != "warm" and theories.theory_of(measurement.scene, *spins):
            expected, known = cooling_spins(measurement), True
            of_ratio = interpolated(x, collisions, expected[1] / expected[0]).mean(axis=0)
            build.lines.append(Line(x, of_ratio, None, index, BY_THEORY))
            mean, error = mean_of_remaining(ratio)
            few = np.searchsorted(x, np.linspace(0.0, x[-1], RESIDUALS + 2)[1:-1])
            build.add_residuals(index, x[few], mean[few], error[few], of_ratio[few])
            final = float(of_ratio[last])
        build.record(point, final_ratio=mean_and_error(kept[:, -1]), theory=final)
    if known:
        build.lines.append(legend_line(f"theory, {build.cite(*spins)}", BY_THEORY))
    return build.figure(panels=(Panel(tuple(decay), "T_tr / T_tr(0)", log=True),))


RESIDUALS = 5  # of a curve


DENSEST_CLUSTERS = 0.5
"""Packing beyond which elastic balls are as close as those of a cluster, almost everywhere."""


def check_clusters(build: FigureBuilder) -> None:
    """Raise ``FigureError`` for a point that is too dense for clusters."""
    for point in build.points:
        if (packing := build.start(point).packing_fraction) > DENSEST_CLUSTERS:
            raise FigureError(
                f"at a packing of {short(packing, 2)} elastic balls are one cluster too; use a "
                f"packing of {DENSEST_CLUSTERS:g} at most, or choose such points with {WHERE}"
            )


def cluster_growth(build: FigureBuilder) -> FigureData:
    """Clusters over time; below the fluctuations of the density, and energies beside Haff's law."""
    check_clusters(build)
    scenes = [build.start(point) for point in build.points]
    without = dict[str, Reference]()  # by the packing
    density, energies = build.for_panel(), build.for_panel()
    many = all(facts.hold(scene, "many") for scene in scenes)
    over_time = _over_time(build, _clustering, logarithmic=True)
    for index, (point, scene, times, rows) in enumerate(over_time):
        _, of_ball = build.add_means(index, build.label(point), times, rows[..., 0])
        _, of_all = build.add_means(index, None, times, rows[..., 1], SECOND)
        mean, largest = mean_and_error(of_ball[:, -1]), mean_and_error(of_all[:, -1])
        kept, later = elastic(point), of_ball[:, of_ball.shape[1] // 2 :]
        before = float(later.mean()) if kept else _at_start(build, point)
        alike, fluctuation = f"{scene.packing_fraction:.2g}", (math.nan, math.nan)
        if kept or alike not in without:  # elastic balls have it for longer
            without[alike] = Reference("y", before, "without clustering", EXTRAPOLATED)
        if many:
            _, counts = density.add_means(index, None, times, rows[..., 2])
            fluctuation = mean_and_error(counts[:, -1])
        share, rate = _add_energies(energies, index, scene, times, rows[..., 3:])
        build.record(
            point,
            mean=mean,
            largest=largest,
            uniform=before,
            balls=scene.number,
            fluctuation=fluctuation,
            share=share,
            haff_rate=rate,
        )
    build.lines += without.values()
    build.lines.append(legend_line("cluster of a ball, mean", MEASURED))
    build.lines.append(legend_line("the largest cluster", SECOND))
    build.headline = _growth(build.records)
    reference = "that of elastic balls" if any(map(elastic, build.points)) else "the start"
    below = "Below: the variance over the mean of the number of balls in cells, and" * many
    caption = (
        f"{below or 'Below:'} the energy of a ball, thermal and of the flow. Balls with a gap of "
        f"at most {structure.CLUSTER_GAP:g} mean diameters are in one cluster (Luding & Herrmann "
        f"1999). Without clustering is {reference}. The flow is that of cells "
        f"with {structure.BALLS_IN_CELL:g} balls on average."
    )
    pairs = zip(build.points, build.records, strict=True)
    lossy = [record["haff_rate"] for point, record in pairs if not elastic(point)]
    if any(lossy) and None in lossy:
        caption += " Energies without theory of Haff's law are over E(0)/N."
    panels = [_energy_panel(energies)]
    if many:
        caption += f" Cells of the density have {structure.DENSITY_BALLS:g} balls on average."
        panels.insert(0, _density_panel(density, scenes))
    return build.figure(caption, logarithmic=build.covers_decades, panels=tuple(panels))


GROWN = 1.5  # times the size without clustering from which on clusters have grown


def _growth(records: Sequence[Mapping[str, Any]]) -> str:
    """How large the cluster of a ball is at the end, in a few words."""
    grown = [
        record
        for record in records
        if record["mean"] > GROWN * record["uniform"]
        and not record["mean"] - record["uniform"] < MOST_ERRORS * record["mean_error"]
    ]
    if not grown:
        return "none grow"
    if len(records) > 1:
        return f"they grow at {len(grown)} of {len(records)} points"
    return f"that of a ball grows to {short(grown[0]['mean'])} balls"


def _density_panel(panel: FigureBuilder, scenes: Sequence[Scene]) -> Panel:
    """The fluctuations of the density, and their limit in far larger cells where theory has it."""
    limits = {theories.value_of(scene, *COMPRESSIBLE) for scene in scenes} - {None}
    panel.lines += [
        Reference("y", limit, "S(0), far larger cells", EXTRAPOLATED) for limit in limits if limit
    ]
    log = panel.covers_decades
    return panel.as_panel("variance / mean", Reference("y", 1.0, "independent points"), log=log)


def _energy_panel(panel: FigureBuilder) -> Panel:
    """The energies; over Haff's law if one of the points has it."""
    known = any(record["haff_rate"] is not None for record in panel.records)
    name, style = ("Haff's law", BY_THEORY) if known else ("E(0)/N", MEASURED)
    panel.lines.append(legend_line("thermal energy", MEASURED))
    if any(isinstance(line, Line) and line.style == SECOND for line in panel.lines):
        panel.lines.append(legend_line("energy of the flow", SECOND))
    log, one = panel.covers_decades, Reference("y", 1.0, name, style)
    return panel.as_panel(f"energy over {name}", one, log=log)


COMPRESSIBLE = quantities.STRUCTURE, theories.COMPRESSIBILITY


def _clustering(positions: Array, velocities: Array, scene: Scene) -> Array:
    """Two sizes of clusters, the fluctuation of the density, and two energies (J): (5,)."""
    state, local = (positions, velocities, scene), structure.local_energy
    thermal = local(*state)
    flow = scene.kinetic_energy / scene.number - thermal
    counts = structure.density_fluctuation(*state)
    return np.array([*structure.mean_cluster(*state), counts, thermal, flow])


def _at_start(build: FigureBuilder, point: Point) -> float:
    """Mean size of the cluster of a ball at the start of the repeats."""
    starts = [trace.start for trace in build.traces(point)]
    sizes = [structure.mean_cluster(one.positions, one.velocities, one)[0] for one in starts]
    return float(np.mean(sizes))


LEAST_FLOW = 5  # last times at which the flow has more energy than its error, to be shown


def _add_energies(
    panel: FigureBuilder, index: int, scene: Scene, times: Array, rows: Array
) -> tuple[tuple[float, float], float | None]:
    """Add the energy without the flow, and that of the flow, rows (*n*, *t*, 2), over Haff's law.

    Returns the share of the energy without the flow at the end, and α of the law, 1/s.
    """
    rate = None
    if theories.theory_of(scene, quantities.HAFF_RATE, theories.START_RATES):
        panel.cite(quantities.HAFF_RATE, theories.START_RATES)
        rate = haff_rate(scene)
    law = scene.kinetic_energy / scene.number * theory.haff_ratio(times, rate or 0.0)
    thermal, flow = np.moveaxis(rows, 2, 0) / law
    panel.add_means(index, None, times, thermal)
    # The logarithm of what is within its error of zero would be noise alone.
    mean, error = mean_of_remaining(flow)
    noise = mean <= np.nan_to_num(error)
    since = len(times) - int(np.argmax(noise[::-1])) if noise.any() else 0
    if since <= len(times) - LEAST_FLOW:
        panel.add_means(index, None, times[since:], flow[:, since:], SECOND)
    last = panel.lasting(index, times, rows)[1][:, -1]
    return mean_and_error(last[:, 0] / last.sum(axis=1)), rate


RELAXED = 3.0  # collisions per ball in which equal speeds become those of a gas


def _a2(build: FigureBuilder) -> Iterator[tuple[Point, Scene, Array, Array]]:
    """As of `_over_time`, from ``RELAXED`` collisions per ball on, instead of times.

    Of balls of one type means between the times, of a mixture at the times. Raises ``FigureError``
    without this many collisions.
    """
    for point, scene, times, rows in _a2_over_time(build):
        curve = build.measurement(point).curve
        pairs = curve.at(times, curve.pair_events).mean(axis=0)
        collisions = collisions_per_ball(pairs, scene.number)
        later = collisions >= RELAXED
        if np.count_nonzero(later) < 2:
            raise FigureError(
                f"the first {RELAXED:g} collisions per ball are left out, and too few follow; run "
                "longer"
            )
        yield point, scene, collisions[later], _known(rows[:, later])


def _a2_over_time(build: FigureBuilder) -> Iterator[tuple[Point, Scene, Array, Array]]:
    """As of `_over_time`: of balls of one type means between times, of a mixture at the times."""
    if not build.all_hold("equal_balls"):
        yield from _over_time(build, structure.a2)
        return
    for point, times in _common_times(build, SUMS, of_states=False):
        curve = build.measurement(point).curve
        moments = np.diff(curve.at(times, curve.energy_moment_integral), axis=1) / np.diff(times)
        moments[times[1:] > build.measurement(point).time[:, np.newaxis]] = math.nan
        middle = (times[1:] + times[:-1]) / 2
        yield point, build.start(point), middle, _known(moments[..., np.newaxis] / 2 - 1)
