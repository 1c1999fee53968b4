"""Fits of a decay, decay constants against the CoR, the decay rate over time, energy by events."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis import predictions
from snooker_cli.analysis.decay import QUANTITIES, curve, decays, fit_curve, reported_constant
from snooker_cli.analysis.fitting import (
    LAWS,
    FitResult,
    RepeatMean,
    fitted_curve,
    mean_over_repeats,
)
from snooker_cli.analysis.observables import (
    before_collapse,
    energy_ratio,
    mean_and_error,
    meeting_temperature,
    series,
    so_far,
    standard_errors,
)
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import SPREAD, FigureBuilder, early, setting
from snooker_cli.figures.figure_data import (
    Array,
    FigureData,
    Layer,
    Line,
    LineStyle,
    Note,
    Points,
    Reference,
    at_common_times,
    bands,
    error_bars,
    legend_line,
    thinned,
)
from snooker_cli.figures.selection import (
    Selection,
    along,
    described,
    elastic,
    evenly,
    facts,
    inelastic_points,
    one_repeat,
    present,
    repeats,
    require_motion,
    single_point,
    varying,
)
from snooker_cli.formatting import listed, short, with_error

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Series, Trace


RATE = "s⁻¹"

MOST_COOLING = 4
"""Series of markers and laws each; more cannot be told apart."""

WINDOWS = 14
"""Windows of time for the local decay rate."""

LEAST_COLLISIONS = 10
"""Of all repeats, in a window: from n collisions a rate is known to about 1/√n of it."""

COUNTS = 14
"""Steps of the collision count at which the energy is averaged over the repeats."""

FLOOR_MATTERS = 0.1
"""The floor is drawn where it is at least this share of the energy that is left."""

SAME_FLOOR = 0.01
"""Floors that differ by less are one line."""

_FLOORS = {
    "L": " The balls keep their angular momentum L, and with it the energy L²/(2mNa²), a = R − r.",
    "p": " The balls keep their momentum p, and with it the energy p²/(2Nm).",
}
"""The floor of the energy in a circle, and in a periodic box."""

_HAFF: dict[str, tuple[str, str, LineStyle]] = {
    "fitted": ("with α fitted", "Haff's law 2α/(1 + αt), α fitted", "solid"),
    "theory": ("with α of theory", "the same, α of kinetic theory", "dashed"),
    "floor": ("above the floor", "the same above the floor of {}", "dashdot"),
}
"""The forms of Haff's law: in a caption, in the legend, and how they are drawn."""

_ENDS = {"first": 0, "last": -1}


# One repeat's decay with its fits, and the means over the repeats.


def fit_figure(quantity: str, run: Run, selection: Selection) -> FigureData:
    """The decay of a quantity in one repeat, with its fits and the band of all repeats."""
    point = single_point(run, selection)
    if elastic(point):
        raise FigureError("nothing decays where all collisions are elastic; take cor below 1")
    trace, number = one_repeat(run, point, selection), present(run, point, selection)[0]
    require_motion(trace.start)
    shown, known = curve(trace, quantity), QUANTITIES[quantity]
    fits = {law: fit_curve(shown, law) for law in LAWS}
    if not any(result.converged for result in fits.values()):
        raise FigureError(f"this repeat cannot be fitted: {fits['exponential'].message}")
    whole = Selection(selection.where)
    curves = [curve(trace, quantity) for trace in repeats(run, point, whole)]
    means = {law: mean_over_repeats(fit_curve(each, law) for each in curves) for law in LAWS}
    symbols = {
        law: each.mean_symbol if known.is_mean else each.symbol for law, each in LAWS.items()
    }
    steps = not known.is_mean
    started = [(each.time, each.value) for each in curves if len(each.time) > 1]
    label = f"all {len(started)} repeats, {SPREAD}"
    spread = bands(*at_common_times(started, steps=steps), 0, label)
    kept, fine = thinned(shown.time), np.linspace(shown.time[0], shown.time[-1], 300)
    x, y = shown.time[kept], shown.value[kept]
    layers: list[Layer] = [
        *spread,
        Line(x, y, f"simulation, repeat {number}", 0, steps=steps, broad=True),
    ]
    for index, (law, model) in enumerate(LAWS.items(), start=1):
        if fits[law].converged:
            text = f"{symbols[law]} = {with_error(fits[law].value, fits[law].error, RATE)}"
            name = f"{model.label} of repeat {number}: {text}"
            layers.append(Line(fine, fitted_curve(fits[law], fine), name, index))
    layers += [
        Note(
            f"mean of {mean.count} repeats: {symbols[law]} = "
            + with_error(mean.mean, mean.standard_error, RATE)
        )
        for law, mean in means.items()
        if mean.count > 1
    ]
    if known.is_mean:
        layers.append(Note("κ is what the source report calls k/2"))
    title = quantity.replace("_", " ").capitalize() if not known.is_mean else "Cumulative pressure"
    where = ", ".join(described(point, key) for key in varying(run.points))
    ended = early(facts(run, point, whole, single=False))
    return FigureData(
        kind=f"{quantity.removeprefix('kinetic_')}-fit",
        title=f"{title} and its fits" + (f": {where}" if where else ""),
        x_label="time (s)",
        y_label=known.label,
        layers=tuple(layers),
        caption=_fit_caption(fits, means, symbols, ended)
        + (f" Band: {SPREAD}. " if spread else " ")
        + setting(run, [point], selection, single=True),
        numbers=_fit_numbers(point, fits, means, number),
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def _fit_caption(
    fits: dict[str, FitResult],
    means: dict[str, RepeatMean],
    symbols: dict[str, str],
    ended: str,
) -> str:
    """The fits in sentences."""
    this = [
        f"{symbols[law]} = {with_error(fit.value, fit.error, RATE)} "
        f"({LAWS[law].label}, R² = {fit.r_squared:.4f})"
        for law, fit in fits.items()
        if fit.converged
    ]
    text = f"Fits of this repeat: {listed(this)}."
    over = [
        f"{symbols[law]} = {with_error(mean.mean, mean.standard_error, RATE)} "
        f"(half range {short(mean.max_min_half_range, 2)})"
        for law, mean in means.items()
        if mean.count > 1
    ]
    if over:
        text += f" Means over the repeats: {listed(over)}{f'; {ended}' if ended else ''}."
    return text


def _fit_numbers(
    point: Point, fits: dict[str, FitResult], means: dict[str, RepeatMean], repeat: int
) -> dict[str, Any]:
    """The fits as JSON: ``k`` of the exponential (κ of a pressure), ``alpha`` of Haff's law."""
    numbers: dict[str, Any] = {"parameters": point.as_json(), "repeat": repeat}
    for law, model in LAWS.items():
        numbers |= {
            model.key: fits[law].value,
            f"{model.key}_error": fits[law].error,
            f"{model.key}_r_squared": fits[law].r_squared,
            f"{model.key}_mean": means[law].mean,
            f"{model.key}_standard_error": means[law].standard_error,
            f"{model.key}_half_range": means[law].max_min_half_range,
            f"{model.key}_repeats": means[law].count,
        }
    return numbers


# The decay constants of the energy over many CoR, beside the source report's formula and theory.


def decay_against_cor(run: Run, selection: Selection) -> FigureData:
    """The decay constants of the energy against the CoR."""
    (points,) = along(inelastic_points(run, selection), "cor")
    require_motion(one_repeat(run, points[0], selection).start)
    build = FigureBuilder(run, selection, points)
    for point in points:
        build.record(point, **_decay_constants(list(build.traces(point))))
    cors = np.array([point.experiment.cor for point in points])
    column = {name: np.array([each[name] for each in build.records]) for name in build.records[0]}
    curves = _curves_of_theory(build)
    reported = column["report_k"]
    known = np.isfinite(reported)
    draw = np.count_nonzero(known) > 1
    if draw:
        build.lines.append(
            Line(cors[known], reported[known], "k by the source report", 0, "dashed")
        )
    build.lines += curves
    ends = []
    for index, model in enumerate(LAWS.values()):
        values, errors = column[model.key], column[f"{model.key}_error"]
        good = np.isfinite(values)
        name = f"{model.symbol}, {model.label} fitted"
        bars = error_bars(errors[good])
        build.lines.append(Points(cors[good], values[good], None, bars, name, index))
        first, last = (with_error(values[end], errors[end]) for end in (0, -1))
        ends.append(f"{model.symbol} from {first} to {last}")
    caption = f"Fits between CoR {cors[0]:g} and {cors[-1]:g}: {listed(ends)} s⁻¹. "
    if known.any():
        span = [short(each) for each in reported[known][[0, -1]]]
        caption += (
            "The source report's k = −2 ln(CoR)⟨v⟩/λ, λ = 1/(√2 n 2πr), "
            f"{f'goes from {span[0]} to {span[1]}' if draw else f'is {span[0]}'} s⁻¹. "
        )
    if curves:
        caption += "Dotted: that k with Enskog's λ and ⟨v⟩ at the start."
    return build.figure(
        kind="decay-against-cor",
        title="Decay constants of the energy",
        x_label="coefficient of restitution",
        y_label="decay constant (s⁻¹)",
        caption=caption.rstrip(),
        numbers={"ended_early": sum(each["ended_early"] for each in build.records)},
        y_log=True,
    )


def _decay_constants(traces: Sequence[Trace]) -> dict[str, Any]:
    """The decay constants of a point's energy over its repeats, as JSON."""
    record: dict[str, Any] = {}
    for found in decays(traces, ("kinetic_energy",)):
        key, over = LAWS[found.law].key, found.over_repeats
        record |= {key: over.mean, f"{key}_error": over.standard_error, "repeats": over.count}
        record["ended_early"] = found.short
    reported, error = mean_and_error(np.array([reported_constant(trace) for trace in traces]))
    return record | {"report_k": reported, "report_k_error": error}


def _curves_of_theory(build: FigureBuilder) -> list[Layer]:
    """Kinetic theory's α, and the source report's k with its rate; none without a theory."""
    points = build.points
    scene = one_repeat(build.run, points[0], build.selection).start
    rates = predictions.scene_rates(scene, meeting_temperature(scene.kinetic_energy, scene))
    if rates is None:
        return []
    cors, wall = [point.experiment.cor for point in points], points[0].experiment.wall_cor
    # The logarithm has no value at CoR 0.
    grid = np.linspace(max(cors[0], 0.01), cors[-1], 100)
    report, alpha = [], []
    for e in map(float, grid):
        report.append(theory.source_decay_constant(e, rates.mean_free_path, rates.mean_speed))
        loss = theory.cooling_rate(e, rates.ball_ball, e if wall is None else wall, rates.wall)
        alpha.append(theory.haff_rate(loss))
    return [
        Line(grid, np.array(report), "k, Enskog's λ, first ⟨v⟩", 0, "dotted"),
        Line(grid, np.array(alpha), "α, kinetic theory", 1, "solid"),
    ]


# How the rate falls with time.


def haff_time(run: Run, selection: Selection) -> FigureData:
    """The local decay rate −d ln E/dt against time, with Haff's law and one constant."""
    points = evenly(inelastic_points(run, selection), MOST_COOLING)
    build = FigureBuilder(run, selection, points)
    for index, point in enumerate(points):
        record = _add_rates(build, index, point)
        ends = [with_error(record[f"{k}_rate"], record[f"{k}_rate_error"]) for k in _ENDS]
        laws = [
            f"{short(record[f'{law}_last_rate'])} {text}"
            for law, (text, _, _) in _HAFF.items()
            if f"{law}_last_rate" in record
        ]
        build.result(point, f"{ends[0]} to {ends[1]} s⁻¹, Haff's law {listed(laws)}")
    kept, drawn_laws = _kept(points), {law for each in build.records for law in _laws_in(each)}
    build.lines += [
        legend_line(text.format(kept), style)
        for law, (_, text, style) in _HAFF.items()
        if law in drawn_laws
    ]
    build.lines.append(legend_line("one constant k, fitted", "dotted"))
    caption = f"Rates in the first and the last window: {build.results_text}. "
    caption += f"Markers: mean energy of the repeats in {WINDOWS} windows of time."
    if any(record["windows"] < WINDOWS for record in build.records):
        caption += f" Windows with fewer than {LEAST_COLLISIONS} collisions are left out."
    return build.figure(
        kind="haff-time",
        title="The decay rate falls with time",
        x_label="time (s)",
        y_label="−d ln E / dt (s⁻¹)",
        caption=caption + (_FLOORS[kept] if "floor" in drawn_laws else ""),
        x_limits=(0.0, None),
        y_log=True,
    )


def _laws_in(record: dict[str, Any]) -> list[str]:
    """The forms of Haff's law that a record of ``haff_time`` has."""
    return [law for law in _HAFF if f"{law}_last_rate" in record]


def _add_rates(build: FigureBuilder, index: int, point: Point) -> dict[str, Any]:
    """Add a point's local rates and the laws; its numbers as JSON."""
    traces = list(build.traces(point))
    require_motion(traces[0].start)
    edges, rates, errors, left = _local_rates(traces)
    curves = [curve(trace, "kinetic_energy") for trace in traces]
    k, alpha = (
        mean_over_repeats(fit_curve(each, law) for each in curves).mean
        for law in ("exponential", "haff")
    )
    if not (math.isfinite(k) and math.isfinite(alpha)):
        raise FigureError("a point's repeats are too short to be fitted; run longer")
    floor = float(np.mean([predictions.floor(trace.start) for trace in traces]))
    scene = traces[0].start
    start = predictions.scene_rates(scene, meeting_temperature(scene.kinetic_energy, scene))
    laws: dict[str, tuple[float, float]] = {"fitted": (alpha, 0.0)}
    record: dict[str, Any] = {"k": k, "alpha": alpha, "floor": floor, "repeats": len(traces)}
    record["windows"] = len(rates)
    if start is not None:
        losses = scene.restitution, start.ball_ball, scene.wall_restitution, start.wall
        expected = record["theory_alpha"] = theory.haff_rate(theory.cooling_rate(*losses))
        laws["theory"] = (expected, 0.0)
        if floor >= FLOOR_MATTERS * left:
            laws["floor"] = (expected, floor)
    fine = np.linspace(0.0, edges[-1, 1], 200)
    bars, name = errors if len(traces) > 1 else None, build.label(point) or "simulation"
    build.lines += [
        *(
            Line(fine, _haff_rate(fine, *law), None, index, _HAFF[form][2])
            for form, law in laws.items()
        ),
        Line(fine[[0, -1]], np.array([k, k]), None, index, "dotted"),
        Points(edges.mean(axis=1), rates, None, bars, name, index),
    ]
    for end, row in _ENDS.items():
        record |= {f"{end}_rate": float(rates[row]), f"{end}_rate_error": float(errors[row])}
    for form, law in laws.items():
        before, after = np.log(_haff_energy(edges[-1], *law))
        record[f"{form}_last_rate"] = float(before - after) / float(np.ptp(edges[-1]))
    build.record(point, **record)
    return record


def _haff_energy(time: Array, alpha: float, floor: float) -> Array:
    """Energy over its start where Haff's law holds for the energy above the floor."""
    return np.asarray(floor + (1 - floor) * theory.haff_ratio(time, alpha))


def _haff_rate(time: Array, alpha: float, floor: float) -> Array:
    """The decay rate −d ln E/dt of that energy, s⁻¹."""
    slope = 2 * alpha * (1 - floor) / (1 + alpha * time) ** 3
    return np.asarray(slope / _haff_energy(time, alpha, floor))


def _local_rates(traces: Sequence[Trace]) -> tuple[Array, Array, Array, float]:
    """Edges of windows (*w*, 2), −d ln of the mean energy/dt there, its standard error (s⁻¹).

    Last, the mean energy ratio in the end. Windows with too few collisions are left out.
    """
    end = min(trace.stop.time for trace in traces)
    if end == 0:
        raise FigureError("a repeat has no length; run longer")
    edges = np.linspace(0.0, end, WINDOWS + 1)
    table, collisions = [], np.zeros(WINDOWS)
    for trace in traces:
        found = series(trace)
        table.append(so_far(trace, energy_ratio(found), edges))
        counted = so_far(trace, found.wall_events + found.pair_events, edges)
        collisions += np.diff(np.minimum(counted, before_collapse(trace).collisions))
    energies = np.array(table)
    if np.any(energies <= 0):
        raise FigureError("a repeat loses all of its energy, so it has no decay rate")
    good = collisions >= LEAST_COLLISIONS
    if np.count_nonzero(good) < 2:
        raise FigureError(
            f"its windows of time have fewer than {LEAST_COLLISIONS} collisions, too few for a "
            "rate; run longer or more repeats"
        )
    width = end / WINDOWS
    rates = -np.diff(np.log(energies.mean(axis=0))) / width
    # Each repeat's own rate varies as much around the mean.
    errors = standard_errors(-np.diff(np.log(energies), axis=1) / width)
    windows = np.column_stack([edges[:-1], edges[1:]])
    return windows[good], rates[good], errors[good], float(energies[:, -1].mean())


# The energy with the number of collisions.


def event_decay(run: Run, selection: Selection) -> FigureData:
    """The energy against collisions, where kinetic theory has an exponential at any density."""
    points = evenly(inelastic_points(run, selection))
    build = FigureBuilder(run, selection, points)
    for index, point in enumerate(points):
        record = _add_energies(build, index, point)
        text = with_error(record["final_ratio"], record["final_ratio_error"])
        text += f", by the collisions {short(record['theory'])}"
        if "theory_above_floor" in record:
            text += f", above the floor {short(record['theory_above_floor'])}"
        build.result(point, text)
    kept = _kept(points)
    build.lines.append(legend_line("expected from the counted collisions", "solid"))
    floors = [record["floor"] for record in build.records if "theory_above_floor" in record]
    if floors:
        build.lines.append(legend_line(f"the same above the floor of {kept}", "dashed"))
        if max(floors) - min(floors) < SAME_FLOOR * max(floors):
            mean = float(np.mean(floors))
            text = f"floor of {kept}, {short(mean, 2)} E(0)"
            build.lines.append(Reference("y", mean, text))
    walls = any(point.experiment.container.shape_class.has_wall for point in points)
    at_wall = ", one at the wall (1 − e_w²)E/N" if walls else ""
    return build.figure(
        kind="event-decay",
        title="Energy against collisions",
        x_label="collisions / number of balls",
        y_label="E / E(0)",
        caption=f"E/E(0) in the end: {build.results_text}. Lines: a collision between balls takes "
        f"(1 − e²)E/N{at_wall}." + (_FLOORS[kept] if floors else ""),
        x_limits=(0.0, None),
        y_log=True,
    )


def _add_energies(build: FigureBuilder, index: int, point: Point) -> dict[str, Any]:
    """Add a point's energies by collision count; its numbers as JSON."""
    traces = list(build.traces(point))
    scene = traces[0].start
    require_motion(scene)
    if scene.number < 2:
        raise FigureError("kinetic theory does not cover one ball; it needs two or more")
    calm = [before_collapse(trace) for trace in traces]
    shortest = min(trace.collisions for trace in calm)
    if shortest == 0:
        raise FigureError("a repeat has no collisions; run longer")
    counts = np.unique(np.linspace(0.0, shortest, COUNTS + 1).round())
    rows = np.array([_against_counts(series(trace), scene, counts) for trace in calm])
    energies, expected = rows[:, 0], rows[:, 1]
    floors = np.array([predictions.floor(trace.start) for trace in traces])[:, None]
    final, error = mean_and_error(energies[:, -1])
    x = counts / scene.number
    floor, alone = float(floors.mean()), expected.mean(axis=0)
    record: dict[str, Any] = {
        "collisions_per_ball": float(x[-1]),
        "final_ratio": final,
        "final_ratio_error": error,
        "theory": float(alone[-1]),
        "floor": floor,
        "repeats": len(traces),
    }
    build.lines.append(Line(x, alone, None, index, "solid"))
    if floor >= FLOOR_MATTERS * final:
        above = (floors + (1 - floors) * expected).mean(axis=0)
        build.lines.append(Line(x, above, None, index, "dashed"))
        record["theory_above_floor"] = float(above[-1])
    bars, name = error_bars(standard_errors(energies)), build.label(point) or "simulation"
    build.lines.append(Points(x, energies.mean(axis=0), None, bars, name, index))
    build.record(point, **record)
    return record


def _against_counts(found: Series, scene: Scene, counts: Array) -> tuple[Array, Array]:
    """A repeat's energy ratio after these collisions, and the ratio expected from them."""
    events = found.wall_events + found.pair_events
    # A summary's rows may share a count: the last of them counts.
    last = np.append(events[1:] > events[:-1], True)
    ratio, wall, pairs = (
        np.interp(counts, events[last], column[last])
        for column in (energy_ratio(found), found.wall_events, found.pair_events)
    )
    expected = theory.energy_ratio_by_events(
        scene.number, scene.restitution, pairs, scene.wall_restitution, wall
    )
    return ratio, np.asarray(expected)


def _kept(points: Sequence[Point]) -> str:
    """The letter of what the balls keep: angular momentum in a circle, momentum without walls."""
    return "L" if points[0].experiment.container.shape_class.has_wall else "p"
