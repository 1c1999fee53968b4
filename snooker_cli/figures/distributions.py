"""Distances from the centre and between balls, the pair correlation, and speeds."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import quantities, structure, theories
from snooker_cli.analysis.gas import independent_velocities
from snooker_cli.analysis.goodness import (
    LEAST_PROBABILITY,
    REDUCED_TEMPERATURE,
    LargestDifference,
    largest_speed_difference,
)
from snooker_cli.analysis.observables import (
    at_collisions,
    at_equal_steps,
    central_distances,
    mean_and_error,
    pair_distances,
    standard_errors,
)
from snooker_cli.analysis.structure import over_time
from snooker_cli.config import Point
from snooker_cli.engine import stored_times
from snooker_cli.errors import FigureError
from snooker_cli.figures.declared_result import Result, agreement, largest_beyond_errors
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    EXTRAPOLATED,
    MOST_ENTRIES,
    NEUTRAL,
    Array,
    FigureData,
    Layer,
    Line,
    Points,
    Reference,
    legend_line,
    legend_marker,
)
from snooker_cli.figures.series import elastic, gas_type_of
from snooker_cli.formatting import chance, least_to_most, percent, short
from snooker_cli.scene import Scene
from snooker_cli.trace import SPEED_BIN, SPEED_BINS, Trace

BINS = 45
MOST_DISTANCES, FEW_STATES = 10_000_000, 10
"""Distances of a figure, which take seconds; states of a repeat before there are fewer repeats."""

MOST_PAIRED = 2000  # balls, whose pairs are two million

DISTANCES = {
    "central": ("R − r", "R − smallest r", "largest", "largest_excess"),
    "pairs": ("2r", "smallest r₁ + r₂", "smallest", "largest_overlap"),
}
"""Words for the limit that no ball may pass, of equal and of unequal balls; for the value nearest
to it, and for the distance beyond it."""


def distances(which: str, build: FigureBuilder) -> FigureData:
    """The distribution of a distance in ``DISTANCES``, with its limit and random places."""
    limit_of_equal, limit_of_unequal, nearest, beyond = DISTANCES[which]
    central = which == "central"
    outermost = max if central else min
    extremes: dict[float, float] = {}
    key, spans = f"{nearest}_distance", []
    for index, point in enumerate(build.points):
        scene, edges, rows, limit, extreme, excess = _sample(central, build, point)
        build.add_histogram(index, point, edges, rows.mean(axis=0), standard_errors(rows))
        extremes[limit] = outermost(extremes.get(limit, extreme), extreme)
        build.record(point, **{key: extreme, "beyond_limit": excess})
        spans.append((edges[-1], scene))
    limit, excess = outermost(extremes), max(row["beyond_limit"] for row in build.records)
    farthest, widest = max(spans, key=lambda span: span[0])
    x = np.linspace(0.0, farthest, 200)
    uniform = 2 * x / x[-1] ** 2
    if not central:
        uniform = widest.container.distance_density(x, float(widest.radii.min()))
    equal = all(facts.hold(scene, "equal_balls") for _, scene in spans)
    name = limit_of_equal if equal else limit_of_unequal
    build.lines += [
        Line(x, uniform, f"uniform in the {widest.container.title}", NEUTRAL, BY_THEORY),
        *(Reference("x", edge, f"{name} = {edge:g} m") for edge in extremes),
    ]
    return build.figure(
        numbers={key: outermost(extremes.values()), "limit": limit, beyond: excess},
        x_limits=(0.0, 1.04 * limit if central else None),
    )


def _sample(
    central: bool, build: FigureBuilder, point: Point
) -> tuple[Scene, Array, Array, float, float, float]:
    """The start of a point's first repeat; edges, and densities (*n*, *bins*) of its distances.

    Last, the limit, the outermost distance, and how far one is beyond, m. Densities are means over
    time: collisions, at which two balls touch, do not choose the times. Raises ``FigureError``.
    """
    rows, beyond, extremes, scene = [], [], [], build.start(point)
    container, radii, number = scene.container, scene.radii, scene.number
    if central:
        outwards, of_states, limits = 1, central_distances, container.wall_gaps(np.zeros(2), radii)
        low, high = 0.0, float(limits.max())
    else:
        if number > MOST_PAIRED:
            raise FigureError(f"it has all pairs, of {MOST_PAIRED:,} balls at most")
        first, second = np.triu_indices(number, k=1)
        outwards, of_states = -1, partial(pair_distances, scene=scene)
        limits, low = radii[first] + radii[second], float(np.sort(radii)[:2].sum())
        high = container.longest_distance(float(radii.min()))
    edges, cost = np.linspace(low, high, BINS + 1), len(limits) - number
    most = build.states(point, MOST_DISTANCES, MOST_DISTANCES, each=cost, fewest=FEW_STATES)
    for trace in build.traces(point):
        touching = at_collisions(trace, most)
        found = of_states(touching).reshape(-1, len(limits))
        beyond.append(float((outwards * (found - limits)).max()))
        extremes.append(outwards * float((outwards * found).max()))
        table = of_states(at_equal_steps(trace, len(touching.time)))
        # A distance that is beyond by rounding belongs to the bin at the limit.
        rows.append(np.histogram(np.clip(table, low, high), edges, density=True)[0])
    limit, extreme = (high, max(extremes)) if central else (low, min(extremes))
    return scene, edges, np.array(rows), limit, extreme, max(beyond)


MOST_STATES = 40  # of a repeat
MOST_BALLS, OF_A_STATE = 1_000_000, 125
"""Balls times states of a figure's pair correlations, which take seconds; a state counts more."""

LAST = 0.99
"""Part of a repeat's time that is its last state: at its last collision, two balls touch."""


CLOSEST = 0.6  # first distance that is shown, over the least that two balls can have


def pair_correlation(build: FigureBuilder) -> FigureData:
    """g(r): mean over the second half of repeats that do not cool, else at the end."""
    build.lines.append(Reference("y", 1.0, "random places"))
    nearest, contacts, laws = 1.0, replace(build, panel=build.results), list[Line]()
    for index, point in enumerate(build.points):
        scene = build.start(point)
        diameter = 2 * float(np.mean(scene.radii))
        nearest = min(nearest, float(np.sort(scene.radii)[:2].sum()) / diameter)
        edges = structure.distance_edges(scene)
        if edges[-1] <= diameter:
            raise FigureError(
                "the balls have hardly more room than they need; use a larger container"
            )
        wanted = MOST_STATES if gas_type_of(point) != "cooling" else 1
        parts = second_half(build, point, wanted, MOST_BALLS, each=OF_A_STATE)
        g = partial(structure.pair_correlation, edges=edges)
        rows = np.array([_mean(g, trace, parts) for trace in build.traces(point)])
        middle, label = (edges[1:] + edges[:-1]) / 2 / diameter, build.label(point) or "simulation"
        states = len(rows) * len(parts)
        build.add_means(index, label, *_broader(middle, rows, edges, scene, states))
        if not facts.hold(scene, *theories.FINITE_FLUID):
            build.record(point, contact=None, theory=None)
            continue
        first = int(np.argmin(np.abs(edges - diameter)))
        beside, contact = rows[:, first : first + 2], None
        if beside.shape[1] == 2:  # on a straight line through two bins
            contact = mean_and_error(beside @ (1.5, -0.5))
            value, error = (np.array([number]) for number in contact)
            name = f"g(σ⁺), {label}" if 1 < len(build.points) <= MOST_ENTRIES else None
            build.lines.append(Points(np.ones(1), value, error, name, index))
        expected = build.predicted(scene, quantities.CONTACT, theories.CHI)
        if expected is not None:
            up_to_contact = np.array([CLOSEST * nearest, 1.0])
            laws.append(Line(up_to_contact, np.full(2, expected), None, index, BY_THEORY))
            if contact is not None:
                numbers = (np.array([number]) for number in (1.0, *contact, expected))
                contacts.add_residuals(index, *numbers)
        build.record(point, contact=contact, theory=expected)
    kinds = set(map(elastic, build.points))
    when = "Mean over the second half" if True in kinds else "The last state"
    if len(kinds) > 1:
        when = "Elastic points: mean over the second half; others: the last state"
    caption = f"{when} of each repeat."
    build.singles = build.singles if len(build.points) == 1 else []  # they hide the means
    if len(laws) == 1 < len(build.points):  # on the bars of its own colour it would not be seen
        place = build.places[laws[0].series]
        laws = [replace(laws[0], label=f"{theories.CHI}, {place}", series=NEUTRAL)]
    elif laws:
        laws.append(legend_line(theories.CHI, BY_THEORY))
    build.lines = [*laws, *build.lines]
    markers = [layer for layer in build.lines if isinstance(layer, Points)]
    if markers:
        if not markers[0].label:
            build.lines.append(legend_marker("g(σ⁺)"))
        caption += " g(σ⁺) is from a straight line through the two bins beside contact; the curve "
        caption += f"joins up to {MOST_BINS} bins."
        if len(build.points) > 1:
            caption += " Its markers stand left of contact, beside each other."
    x_label = f"distance / {unit_of_distance(build)}"
    limits = CLOSEST * nearest, None
    return build.figure(caption, x_label=x_label, x_limits=limits, left_of_x=True)


ENOUGH_PAIRS = 50  # of a bin beside contact, so that it is known to about a seventh
MOST_BINS = 3  # that one place of the curve is a mean of


def _broader(
    middle: Array, rows: Array, edges: Array, scene: Scene, states: int
) -> tuple[Array, Array]:
    """Middles (*k*,) and rows (*n*, *k*) of fewer bins, if those of few states have few pairs."""
    width, density = float(np.diff(edges).mean()), scene.number / scene.container.area
    shell = 2 * math.pi * 2 * float(np.mean(scene.radii)) * width
    pairs = states * scene.number * density * shell / 2
    share = min(MOST_BINS, math.ceil(ENOUGH_PAIRS / pairs))
    first = int(np.argmin(np.abs(edges - 2 * float(np.mean(scene.radii)))))
    last = first + (len(middle) - first) // share * share
    joined = [
        column[..., first:last].reshape(*column.shape[:-1], -1, share).mean(axis=-1)
        for column in (middle, rows)
    ]
    before = (column[..., :first] for column in (middle, rows))
    x, g = (np.concatenate(pair, axis=-1) for pair in zip(before, joined, strict=True))
    return x, g


def unit_of_distance(build: FigureBuilder) -> str:
    """The unit of lengths, in words."""
    return "diameter" if build.all_hold("equal_balls") else "mean diameter"


def second_half(
    build: FigureBuilder, point: Point, wanted: int, most: int, *, each: int = 0
) -> Array:
    """Even parts of the second half of each repeat's time; of one state the last one.

    wanted, most, each : as of ``FigureBuilder.states``
    """
    count = build.states(point, wanted, most, each=each, fewest=1)
    return np.linspace(0.5, LAST, count) if count > 1 else np.array([LAST])


def _mean(observable: structure.Observable, trace: Trace, parts: Array) -> Array:
    """Mean of an observable at parts of a repeat's time. Raises as `times_of_parts`."""
    return np.asarray(over_time(observable, trace, times_of_parts(trace, parts)).mean(axis=0))


def times_of_parts(trace: Trace, parts: Array, *, each: bool = False) -> Array:
    """Parts of a repeat's time, s; without events the nearest that are stored.

    each : whether there is a time for each part, even if two parts have the same

    Raises ``FigureError`` if it has no snapshot.
    """
    times = parts * trace.stop.time
    if trace.events is None:
        if trace.snapshots is None:
            raise FigureError("a repeat ended before its first snapshot; give earlier `snapshots`")
        stored = stored_times(trace)
        times = np.array([stored[np.argmin(np.abs(stored - time))] for time in times])
    return times if each else np.unique(times)


LEAST_SPEEDS = 100  # fewer show a distribution to no more than a tenth, 1/√n

MOST_HISTOGRAMS = 5  # more of them hide each other


def speeds(build: FigureBuilder) -> FigureData:
    """Speeds at times that are several collisions apart, of all repeats.

    In m/s if no energy is lost and all balls have one mass; else in reduced units, v sqrt(m/2T)
    with the temperature of the moment. More than ``MOST_HISTOGRAMS`` points show their differences
    from the law alone.
    """
    starts = [build.start(point) for point in build.points]
    crowded = len(build.points) > MOST_HISTOGRAMS and not build.source
    equal = all(facts.hold(scene, "equal_balls") for scene in starts)
    in_metres = equal and all(map(elastic, build.points)) and not crowded
    edges = np.arange(SPEED_BINS + 1, dtype=np.float64) * SPEED_BIN
    laws: dict[tuple[int | None, float], None] = {}
    known = [theories.speed_laws(scene) for scene in starts]
    fixed = all(theories.FIXED in laws for laws in known)
    panel: list[Layer] = [Reference("y", 0.0)]
    fastest, largest, few = 3.0, 0.0, False
    of_points = zip(build.points, starts, known, strict=True)
    for index, (point, scene, of_scene) in enumerate(of_points):
        rows = build.measurement(point).speeds
        counts, total = rows.sum(axis=0), float(rows.sum())
        if total < LEAST_SPEEDS:
            raise FigureError(
                f"{total:.0f} speeds after enough collisions are no distribution; run longer or "
                "more repeats"
            )
        unit = 1.0
        if in_metres:
            unit = float(np.sqrt(2 * scene.kinetic_energy / scene.number / scene.masses[0]))
        # The last bin has all faster balls, and no height.
        used = int(np.max(np.flatnonzero(counts[:-1]), initial=0)) + 1
        fastest = max(fastest, float(edges[used]))
        width = SPEED_BIN * unit
        heights = counts[:used] / (total * width)
        shares = counts[:used] / total
        errors = count_errors(counts[:used], np.sqrt(total * shares * (1 - shares)))
        errors /= total * width
        largest = max(largest, float(np.max(np.nan_to_num(errors))))
        few |= bool(np.any(counts[:used] < len(POISSON)))
        free = independent_velocities(scene) if theories.FIXED in of_scene else None
        laws[free, unit] = None
        # The largest difference of cumulative shares, at the bins' edges.
        law = maxwell = theory.maxwell_speed_cdf(edges, REDUCED_TEMPERATURE)
        difference, by_chance = math.nan, LargestDifference(math.nan, math.nan)
        if free is not None:
            law = theory.fixed_energy_speed_cdf(edges, free, REDUCED_TEMPERATURE)
            difference = float(np.max(np.abs(np.cumsum(counts) / total - law[1:])[:-1]))
            by_chance = largest_speed_difference(difference, edges[1:-1], free, int(total))
        expected = np.diff(law if fixed else maxwell)[:used] / width
        middle = (edges[1 : used + 1] + edges[:used]) / 2 * unit
        if crowded:
            build.lines.append(Line(middle, heights - expected, build.label(point), index))
        elif len(build.points) == 1 or build.source:
            build.add_histogram(index, point, edges[: used + 1] * unit, heights, errors)
        else:  # outlines would hide each other
            build.lines.append(Points(middle, heights, errors, build.label(point), index))
        panel.append(Points(middle, heights - expected, errors, None, index))
        build.record(
            point,
            speeds=int(total),
            distance_from_fixed_energy=difference,
            expected_distance=by_chance.mean,
            probability=by_chance.probability,
        )
    counted = [row["speeds"] for row in build.records]
    span = least_to_most(counted, "{:,}".format)
    what = "Bars and bands" if build.bands else "Bars"
    build.errors = f"{what}: standard errors of {span} independent speeds."
    build.errors += f" {FEW_WORDS}" * few
    of_law = "law at fixed energy" if fixed else "Maxwell's law"
    if crowded:
        build.lines.append(Reference("y", 0.0, of_law))
        error = f"The largest standard error is {short(largest, 2)}."
        return build.figure(
            f"{_test_of_law(build)} {error}",
            y_label=f"density minus {of_law}",
            y_limits=(None, None),
        )
    reduced = np.linspace(0.0, fastest, 160)
    maxwell_style = EXTRAPOLATED if any(free for free, _ in laws) else BY_THEORY  # N → ∞
    for index, (free, unit) in enumerate(laws):
        density = theory.maxwell_speed_density(reduced, REDUCED_TEMPERATURE) / unit
        text = None if index else "Maxwell–Boltzmann"
        build.lines.append(Line(reduced * unit, density, text, NEUTRAL, maxwell_style))
        if free is not None:
            exact = theory.fixed_energy_speed_density(reduced, free, REDUCED_TEMPERATURE) / unit
            text = None if index else f"fixed energy, {free} free balls"
            build.lines.append(Line(reduced * unit, exact, text, NEUTRAL, BY_THEORY))
            if fixed:
                below = Line(reduced * unit, density - exact, None, NEUTRAL, EXTRAPOLATED)
                panel.append(below)
    words: dict[str, Any] = {"x_label": "speed (m/s)", "y_label": "probability density (s/m)"}
    panel_unit = " (s/m)" if in_metres else ""
    return build.figure(
        _test_of_law(build),
        panel=tuple(panel),
        panel_label=f"minus {of_law}{panel_unit}",
        **(words if in_metres else {}),
    )


def _test_of_law(build: FigureBuilder) -> str:
    """Whether independent speeds of the law have distances as large.

    Of several points the least probability counts, once for each of them.
    """
    known = [row["probability"] for row in build.records if math.isfinite(row["probability"])]
    if not known:
        return "Maxwell's law is drawn for comparison."
    least, number = min(known), len(known)
    where = f" ({build.places[[row['probability'] for row in build.records].index(least)]})"
    of_points = f"{where}, the least of {number} points" if number > 1 else ""
    refused = number * least < LEAST_PROBABILITY
    build.headline = f"the law at fixed energy is {'' if refused else 'not '}refused"
    return (
        "If states were independent and had this law, D would be at least as large with "
        f"{chance(least)}{of_points}: the law is {'' if refused else 'not '}refused."
    )


POISSON = np.array([0.921, 1.563, 1.965, 2.275, 2.539])
"""Half of the 68 % interval of 0 to 4 events (Gehrels, Astrophys. J. 303 (1986) 336)."""

FEW_WORDS = f"Poisson's intervals for bins of fewer than {len(POISSON)}."


def count_errors(counts: Array, errors: Array) -> Array:
    """Standard errors (*n*,) of counts, but for few counts ``POISSON``, which needs no repeats."""
    few = counts < len(POISSON)
    return np.where(few, POISSON[np.where(few, counts, 0).astype(int)], errors)


TAIL = 2.0  # reduced velocity from which on the tail is counted
TAIL_BIN = 0.25  # of reduced velocities, whose Maxwell's law has the width 1/√2
FEWEST_BALLS = 5  # of a species beside others; T of fewer follows each ball too closely
TAIL_STATES = 400  # of all repeats of a point, at most


def velocity_tails(build: FigureBuilder) -> FigureData:
    """The law of a velocity component over its width at the moment, as far as there are balls.

    Each species of a mixture has a law and a temperature of its own.
    """
    farthest, mixed, few, number = 0.0, False, False, _balls_at_fixed_energy(build)
    shares = theory.maxwell_component_share
    if number is not None:
        shares = partial(theory.fixed_energy_component_share, number=number)
    beyond_tail = float(shares(np.array([TAIL, np.inf]))[0])
    for point in build.points:
        scene = build.start(point)
        names = [None] if facts.hold(scene, "equal_balls") else structure.species_names(scene)
        mixed = mixed or len(names) > 1
        parts = second_half(build, point, TAIL_STATES, MOST_BALLS)
        repeats = [_reduced_components(trace, parts) for trace in build.traces(point)]
        enough = [len(balls) >= FEWEST_BALLS for balls in structure.species(scene)]
        enough = enough if any(enough) else [True] * len(enough)
        of_all = zip(names, zip(*repeats, strict=True), strict=True)
        for name, of_species in itertools.compress(of_all, enough):
            index = len(build.records)
            label = ", ".join(filter(None, [build.label(point), name])) or None
            counts, edges = _add_tail(build, index, label, of_species, shares)
            farthest = max(farthest, float(edges[1:][counts > 0].max(initial=0.0)))
            few |= bool(np.any(counts[counts > 0] < len(POISSON)))
            largest = max(float(np.max(values)) for values in of_species)
            beyond = np.array([np.mean(values > TAIL) for values in of_species]) / beyond_tail
            build.record(
                point,
                species=name,
                velocities=sum(map(len, of_species)),
                largest=largest,
                beyond=mean_and_error(beyond),
                theory=1.0,
            )
    if farthest == 0.0:
        raise FigureError("nothing moves in its states, so there is no law of velocities")
    c = np.linspace(0.0, farthest, 160)
    maxwell, style = theory.maxwell_component_density(c), BY_THEORY
    if number is not None:
        exact, style = theory.fixed_energy_component_density(c, number), EXTRAPOLATED
        name = f"fixed energy, {number} free balls"
        build.lines.append(Line(c, exact, name, NEUTRAL, BY_THEORY))
    build.lines.append(Line(c, maxwell, "Maxwell's law", NEUTRAL, style))
    when = "States of the second half of each repeat."
    whose = "each species" if mixed else "the gas"
    if not all(map(elastic, build.points)):
        when += (
            f" T is that of {whose} at all places together: where these differ in T or in flow, "
            "tails are longer."
        )
    elif mixed:
        when += f" T is that of {whose}."
    law = "Maxwell's law" if number is None else "the law at fixed energy"
    tail = f"Fast is beyond {TAIL:g}; {law} has {percent(beyond_tail)} there."
    build.result = Result("share of fast velocities", "beyond", theory="theory")
    of_records = [build.result.residual(row) for row in build.records]
    tails = [replace(tail, series=k) for k, tail in enumerate(of_records) if tail]
    build.headline = agreement(tails, build.fewest_repeats, law=law)
    worst = largest_beyond_errors(tails)
    if build.headline and worst and len(tails) > 1:
        build.headline += f" ({build.places[worst.series]})"
    return build.figure(
        f"{tail} {when} {FEW_WORDS * few}".rstrip(), panel_label="ln(density / law)"
    )


def _balls_at_fixed_energy(build: FigureBuilder) -> int | None:
    """The number of balls in the law at fixed energy, if it is that of all points."""
    starts = [build.start(point) for point in build.points]
    if not all(theories.FIXED in theories.speed_laws(scene) for scene in starts):
        return None
    numbers = {independent_velocities(scene) for scene in starts}
    return min(numbers) if len(numbers) == 1 else None


def _add_tail(
    build: FigureBuilder,
    index: int,
    label: str | None,
    repeats: Sequence[Array],
    shares: Callable[[Array], Array],
) -> tuple[Array, Array]:
    """Add the shares of reduced components of balls in each repeat; counts and edges of bins.

    shares : those of the law between edges
    """
    largest = max(float(np.max(values)) for values in repeats)
    edges = np.arange(math.ceil(largest / TAIL_BIN) + 1, dtype=np.float64) * TAIL_BIN
    counts = np.array([np.histogram(values, edges)[0] for values in repeats])
    sizes = np.array([len(values) for values in repeats])[:, np.newaxis]
    rows = counts / (sizes * 2 * TAIL_BIN)  # both signs
    total = counts.sum(axis=0)
    filled = total > 0
    middle, mean = ((edges[1:] + edges[:-1]) / 2)[filled], rows.mean(axis=0)[filled]
    unit = mean / total[filled]
    errors = count_errors(total[filled], standard_errors(rows[:, filled]) / unit) * unit
    build.lines.append(Points(middle, mean, errors, label or "simulation", index))
    build.add_residuals(index, middle, mean, errors, shares(edges)[filled] / (2 * TAIL_BIN))
    return total, edges


def _reduced_components(trace: Trace, parts: Array) -> list[Array]:
    """|v_x| and |v_y| over √(2T/m) of the balls of each species at parts of a repeat's time.

    T is that of the species in each state.
    """
    scene, groups = trace.start, structure.species(trace.start)

    def reduced(_places: Array, velocities: Array, _scene: Scene) -> Array:
        found = np.zeros_like(velocities)
        energies = scene.masses[:, np.newaxis] * velocities**2 / 2
        for balls in groups:
            mean = energies[balls].sum() / len(balls)
            found[balls] = np.sqrt(energies[balls] / mean) if mean > 0 else 0.0
        return found

    table = over_time(reduced, trace, times_of_parts(trace, parts))
    return [table[:, balls].ravel() for balls in groups]
