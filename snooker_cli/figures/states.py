"""Pair correlation; hexatic order, a2, temperature of each species and local energy over time."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis import predictions, structure
from snooker_cli.analysis.observables import mean_and_error, series, time_means
from snooker_cli.analysis.structure import measured
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder, require_motion
from snooker_cli.figures.figure_data import (
    Array,
    FigureData,
    Line,
    Points,
    Reference,
    legend_line,
    more_than_a_decade,
)
from snooker_cli.figures.selection import elastic
from snooker_cli.formatting import short, with_error
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

MOST_SPECIES = 6  # that one figure can show
TIMES = 61  # times at which repeats are compared

MOST_STATES = 40  # states of a repeat for g(r)
MOST_BALLS, MOST_TRIANGULATED, MOST_PAIRED = 5_000_000, 500_000, 200_000
"""Balls times states of a point for sums, hexatic order and g(r), which take seconds."""

LAST = 0.99
"""Part of a repeat's time that is its last state: at its last collision, two balls touch."""


def _courses(
    build: FigureBuilder, measure: Callable[[Trace, Array], Array], most: int = MOST_BALLS
) -> Iterator[tuple[Point, Scene, Array, Array]]:
    """Each point, its start, times (*t*,), s, and what ``measure`` gives there, (*n*, *t*, *k*).

    The times have even collision numbers of the first repeat, until the end of the shortest one.
    ``most`` balls times states are measured.
    """
    for point in build.points:
        build.limit(point, most // (build.start(point).number * TIMES))
        end, first = min(trace.stop.time for trace in build.traces(point)), build.traces(point)
        columns = series(next(first))
        events = columns.wall_events + columns.pair_events
        # Between collisions: at one, two balls touch.
        numbers = np.floor(np.linspace(0, np.interp(end, columns.time, events), TIMES)) - 0.5
        times = np.unique(np.minimum(np.interp(numbers, events, columns.time), end))
        if len(times) < 2:
            raise FigureError("nothing happens until the end of the shortest repeat; run longer")
        rows = np.array([measure(trace, times) for trace in build.traces(point)])
        if not np.any(np.isfinite(rows)):
            raise FigureError("the balls are too few, or do not move; run more balls")
        yield point, build.start(point), times, rows.reshape(*rows.shape[:2], -1)


def hexatic_order(build: FigureBuilder) -> FigureData:
    """|⟨ψ6⟩| over time."""
    measure = partial(measured, structure.hexatic_order)
    courses = _courses(build, measure, MOST_TRIANGULATED)
    for index, (point, scene, times, rows) in enumerate(courses):
        build.add_means(index, build.label(point), times, rows[..., 0])
        final = mean_and_error(rows[:, -1, 0])
        build.record(point, with_error(*final), final=final, balls=scene.number)
    return build.figure(
        f"At the end: {build.results_text}. N balls of a fluid have about 1/√N.",
        logarithmic=_covers_decades(build),
    )


def a2(build: FigureBuilder) -> FigureData:
    """a2 over time, with theory for balls of one type; of a mixture for each species."""
    for point, scene, times, rows in _courses(build, _a2):
        names = [None] if scene.equal_balls else _names(scene)
        expected, known = None, not build.too_thin(scene)
        if known and scene.equal_balls and scene.constant_laws and 0 < scene.restitution < 1:
            expected = theory.sonine_coefficient(scene.restitution)
        elif known and elastic(point) and (free := predictions.independent_velocities(scene)):
            expected = theory.fixed_energy_kurtosis(free) / 2 - 1
        for column, name in zip(np.moveaxis(rows, 2, 0), names, strict=True):
            if not np.isfinite(column).any():
                continue
            label, index = ", ".join(filter(None, [build.label(point), name])), len(build.records)
            middle = (times[1:] + times[:-1]) / 2 if scene.equal_balls else times
            build.add_means(index, label or None, middle, column)
            if expected is not None:
                flat = np.array([expected, expected])
                build.lines.append(Line(times[[0, -1]], flat, None, index, "dotted"))
            final = mean_and_error(column[:, column.shape[1] // 2 :].mean(axis=1))
            build.record(point, species=name, second_half=final, theory=expected)
            build.result(label, with_error(*final))
    source = ""
    if any(record["theory"] is not None for record in build.records):
        build.lines.append(legend_line("theory", "dotted"))
        source = " Theory: homogeneous cooling (van Noije & Ernst 1998); at CoR 1 about −1/N."
    return build.figure(f"Mean over the second half: {build.results_text}.{source}")


def species_temperature(build: FigureBuilder) -> FigureData:
    """Mean kinetic energy of each species over time."""
    _names(build.start(build.points[0]))  # refuses one species before its states are replayed
    measure = partial(measured, structure.species_temperature)
    kept = elastic(build.points[0])  # the temperatures of one instant vary
    for point, scene, times, rows in _courses(build, measure):
        names, start = _names(scene), len(times) // 2 if kept else -1
        means = rows[:, start:].mean(axis=1)
        for index, name in enumerate(names):
            build.add_means(index, name, times, rows[..., index])
            build.result(name, with_error(*mean_and_error(means[:, index]), "J"))
        first, last = means[:, 0], means[:, -1]
        ratio = mean_and_error(first / last) if np.all(last > 0) else None
        build.record(point, species=names, ratio=ratio)
    when = "Mean over the second half" if kept else "At the end"
    return build.figure(f"{when}: {build.results_text}.", logarithmic=_covers_decades(build))


def local_energy(build: FigureBuilder) -> FigureData:
    """Energy of a ball relative to the local flow, and in total, over the total at the start."""
    measure = partial(measured, _both_energies)
    for index, (point, scene, times, rows) in enumerate(_courses(build, measure)):
        require_motion(scene)
        ratios = rows / (scene.kinetic_energy / scene.number)
        build.add_means(index, build.label(point), times, ratios[..., 0], "solid")
        build.add_means(index, None, times, ratios[..., 1], "dotted")
        share = mean_and_error(rows[:, -1, 0] / rows[:, -1, 1])
        build.record(point, with_error(*share), share=share)
    build.lines.append(legend_line("all kinetic energy", "dotted"))
    return build.figure(
        f"The flow is that of cells with {structure.BALLS_IN_CELL:g} balls on average. Local over "
        f"all energy at the end: {build.results_text}; 1 where neighbours move independently.",
        logarithmic=_covers_decades(build),
    )


def pair_correlation(build: FigureBuilder) -> FigureData:
    """g(r): mean over the second half of repeats that lose no energy, else at the end."""
    build.lines.append(Reference("y", 1.0))
    for index, point in enumerate(build.points):
        scene, diameter = build.start(point), 2 * float(np.mean(build.start(point).radii))
        if scene.number < 2:
            raise FigureError("one ball has no pair; it needs two or more")
        edges = structure.distance_edges(scene)
        build.limit(point, MOST_PAIRED // scene.number)
        share = MOST_PAIRED // scene.number // len(build.repeats(point))
        count = max(1, min(MOST_STATES, share)) if elastic(point) else 1
        parts = np.linspace(0.5, LAST, count) if count > 1 else np.array([LAST])
        function = partial(structure.pair_correlation, edges=edges)
        rows = np.array(
            [
                measured(function, trace, parts * trace.stop.time).mean(axis=0)
                for trace in build.traces(point)
            ]
        )
        build.add_means(index, build.label(point), (edges[1:] + edges[:-1]) / 2 / diameter, rows)
        state = predictions.scene_state(scene, 1.0)
        if state is None:
            build.record(point, contact=None, theory=None)
            continue
        first = int(np.argmin(np.abs(edges - diameter)))
        contact = mean_and_error(rows[:, first : first + 2] @ (1.5, -0.5))
        expected = theory.contact_value(state.bulk_packing) if elastic(point) else None
        text = with_error(*contact)
        if expected is not None:
            text += f", theory {short(expected, 4)}"
            name = None if any(isinstance(layer, Points) for layer in build.lines) else "theory, χ"
            marker = Points(np.ones(1), np.array([expected]), None, name, index, filled=False)
            build.lines.append(marker)
        build.record(point, text, contact=contact, theory=expected)
    contact_text = f" At contact, from the first two bins: {build.results_text}."
    kinds = {elastic(point) for point in build.points}
    when = "Mean over the second half" if True in kinds else "The last state"
    if len(kinds) > 1:
        when = "Elastic points: mean over the second half; others: the last state"
    sizes = [build.start(point).radii for point in build.points]
    label = "mean diameter" if any(np.ptp(radii) for radii in sizes) else "diameter"
    caption = f"{when} of each repeat.{contact_text if build.results else ''}"
    return build.figure(caption, x_label=f"distance / {label}")


def _both_energies(positions: Array, velocities: Array, scene: Scene) -> Array:
    """`local_energy` and the mean kinetic energy of a ball, J; (2,)."""
    local = structure.local_energy(positions, velocities, scene)
    return np.array([local, scene.kinetic_energy / scene.number])


def _a2(trace: Trace, times: Array) -> Array:
    """a2 of balls of one type as means between times, of a mixture at the times."""
    if trace.start.equal_balls:
        return time_means(trace, series(trace).energy_moment, times) / 2 - 1
    _names(trace.start)
    if trace.events is None:
        raise FigureError("a2 of a mixture needs the balls' states; run it with `record: events`")
    return measured(structure.a2, trace, times)


def _names(scene: Scene) -> list[str]:
    """The species of a mixture in the legend. Raises ``FigureError`` for one or too many."""
    firsts = [balls[0] for balls in structure.species(scene)]
    if not 1 < len(firsts) <= MOST_SPECIES:
        raise FigureError(f"it needs 2 to {MOST_SPECIES} species of balls, not {len(firsts)}")
    return [f"r = {scene.radii[k]:g} m, m = {scene.masses[k]:g} kg" for k in firsts]


def _covers_decades(build: FigureBuilder) -> bool:
    """Whether the lines cover more than a decade."""
    return more_than_a_decade(line.y for line in build.lines if isinstance(line, Line))
