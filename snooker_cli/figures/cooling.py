"""Cooling beyond one exponential: how the rate falls with time, and the energy with collisions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis import predictions
from snooker_cli.analysis.decay import (
    SKIPPED_COLLISIONS,
    Curve,
    curve,
    decays,
    fit_curve,
    reported_constant,
)
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
)
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import early, setting
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    SPREAD,
    Array,
    FigureData,
    Layer,
    Line,
    Note,
    Points,
    Reference,
    at_common_times,
    bands,
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
    label,
    one_repeat,
    repeats,
    require_motion,
    single_point,
    there,
    varying,
)
from snooker_cli.formatting import listed, short, with_error

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Series, Trace


MOST_COOLING = 4
"""Series of markers and laws each; more cannot be told apart."""

WINDOWS = 14
"""Windows of time in which the local decay rate is taken."""

LEAST_COLLISIONS = 10
"""Of all repeats, in a window: from n collisions a rate is known to about 1/√n of it."""

COUNTS = 14
"""Steps of the collision count at which the energy is averaged over the repeats."""

FLOOR_MATTERS = 0.1
"""The floor is drawn where it is at least this share of the energy that is left."""

SAME_FLOOR = 0.01
"""Floors that differ by less are one line."""

SPARSE = f"Windows with fewer than {LEAST_COLLISIONS} collisions are left out. "

_FLOORS = {
    "L": "The wall leaves the balls their angular momentum L about the container's centre, and "
    "with it at least the energy L²/(2mNa²), a = R − r. ",
    "p": "Without walls the balls keep their momentum p, and with it the energy p²/(2Nm). ",
}
"""What a circle, and a periodic box, leaves the balls."""

_Style: TypeAlias = Literal["solid", "dashed", "dashdot", "dotted"]

_HAFF: dict[str, tuple[str, str, _Style]] = {
    "fitted": ("with α fitted", "Haff's law 2α/(1 + αt), α fitted", "solid"),
    "theory": ("with α of theory", "the same, α of kinetic theory", "dashed"),
    "floor": ("above the floor", "the same above the floor of {}", "dashdot"),
}
"""The forms of Haff's law: in a caption, in the legend, and how they are drawn."""

_ENDS = {"first": 0, "last": -1}


def haff_time(run: Run, selection: Selection) -> FigureData:
    """The local decay rate −d ln E/dt against time, beside Haff's law and one constant."""
    points = evenly(inelastic_points(run, selection), MOST_COOLING)
    layers: list[Layer] = []
    records, said = [], []
    for index, point in enumerate(points):
        name = label(point, points)
        traces = list(repeats(run, point, selection))
        record, drawn = _rates_over_time(traces, index, name or "simulation")
        records.append({"parameters": point.as_json(), **record})
        layers += drawn
        ends = [with_error(record[f"{k}_rate"], record[f"{k}_rate_error"]) for k in _ENDS]
        laws = [
            f"{short(record[f'{law}_last_rate'])} {text}"
            for law, (text, _, _) in _HAFF.items()
            if f"{law}_last_rate" in record
        ]
        text = f"from {ends[0]} to {ends[1]} s⁻¹, where Haff's law has {listed(laws)}"
        said.append(text + (f" ({name})" if name else ""))
    kept = _kept(points)
    keys = [
        _key(text.format(kept), style)
        for law, (_, text, style) in _HAFF.items()
        if any(f"{law}_last_rate" in record for record in records)
    ]
    return FigureData(
        kind="haff-time",
        title="The decay rate falls with time",
        x_label="time (s)",
        y_label="−d ln E / dt (s⁻¹)",
        layers=(*layers, *keys, _key("one constant k, fitted", "dotted")),
        caption=f"From the first to the last window the rate goes {'; '.join(said)}. Markers: "
        f"mean energy of the repeats in {WINDOWS} windows of time up to the end of the shortest, "
        "with standard errors. "
        + (SPARSE if any(record["windows"] < WINDOWS for record in records) else "")
        + (_FLOORS[kept] if any("floor_last_rate" in record for record in records) else "")
        + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_log=True,
    )


def event_decay(run: Run, selection: Selection) -> FigureData:
    """The energy against collisions, where kinetic theory has an exponential at any density."""
    points = evenly(inelastic_points(run, selection))
    layers: list[Layer] = []
    records, said = [], []
    for index, point in enumerate(points):
        name = label(point, points)
        traces = list(repeats(run, point, selection))
        record, drawn = _energy_over_counts(traces, index, name or "simulation")
        records.append({"parameters": point.as_json(), **record})
        layers += drawn
        text = with_error(record["final_ratio"], record["final_ratio_error"])
        text += f" where the counted collisions leave {short(record['theory'])}"
        if "theory_above_floor" in record:
            text += f", above the floor {short(record['theory_above_floor'])}"
        said.append(text + (f" ({name})" if name else ""))
    kept = _kept(points)
    floored = [record for record in records if "theory_above_floor" in record]
    keys: list[Layer] = [_key("expected from the counted collisions", "solid")]
    if floored:
        keys.append(_key(f"the same above the floor of {kept}", "dashed"))
        floors = [record["floor"] for record in floored]
        if max(floors) - min(floors) < SAME_FLOOR * max(floors):
            mean = float(np.mean(floors))
            keys.append(Reference("y", mean, f"floor of {kept}, {short(mean, 2)} E(0)"))
    return FigureData(
        kind="event-decay",
        title="Energy against collisions",
        x_label="collisions / number of balls",
        y_label="E / E(0)",
        layers=(*layers, *keys),
        caption=f"In the end E/E(0) is {'; '.join(said)}. Markers: mean of the repeats; lines: "
        f"each of c collisions between balls takes (1 − e²)E/N{_at_walls(points)}. "
        + (_FLOORS[kept] if floored else "")
        + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_log=True,
    )


def _rates_over_time(
    traces: Sequence[Trace], index: int, name: str
) -> tuple[dict[str, Any], list[Layer]]:
    """A point's local rates beside the laws: numbers as JSON, and what is drawn."""
    require_motion(traces[0].start)
    edges, rates, errors, left = _local_rates(traces)
    curves = [curve(trace, "kinetic_energy") for trace in traces]
    k = mean_over_repeats(fit_curve(each, "exponential") for each in curves).mean
    alpha = mean_over_repeats(fit_curve(each, "haff") for each in curves).mean
    if not (math.isfinite(k) and math.isfinite(alpha)):
        raise FigureError("a point's repeats are too short to be fitted; run longer")
    floor = float(np.mean([predictions.floor(trace.start) for trace in traces]))
    scene = traces[0].start
    start = predictions.scene_rates(scene, meeting_temperature(scene.kinetic_energy, scene))
    laws: dict[str, tuple[float, float]] = {"fitted": (alpha, 0.0)}
    if start is not None:
        losses = scene.restitution, start.ball_ball, scene.wall_restitution, start.wall
        expected = theory.haff_rate(theory.cooling_rate(*losses))
        laws["theory"] = (expected, 0.0)
        if floor >= FLOOR_MATTERS * left:
            laws["floor"] = (expected, floor)
    fine = np.linspace(0.0, edges[-1, 1], 200)
    middles = edges.mean(axis=1)
    layers: list[Layer] = [
        Line(fine, _haff_rate(fine, *law), None, index, _HAFF[name][2])
        for name, law in laws.items()
    ]
    layers += [
        Line(fine[[0, -1]], np.array([k, k]), None, index, "dotted"),
        Points(middles, rates, None, errors if len(traces) > 1 else None, name, index),
    ]
    record: dict[str, Any] = {"k": k, "alpha": alpha, "floor": floor, "repeats": len(traces)}
    record["windows"] = len(rates)
    if start is not None:
        record["theory_alpha"] = laws["theory"][0]
    for end, which in _ENDS.items():
        record |= {f"{end}_rate": float(rates[which]), f"{end}_rate_error": float(errors[which])}
    for law, values in laws.items():
        before, after = np.log(_haff_energy(edges[-1], *values))
        record[f"{law}_last_rate"] = float(before - after) / float(np.ptp(edges[-1]))
    return record, layers


def _energy_over_counts(
    traces: Sequence[Trace], index: int, name: str
) -> tuple[dict[str, Any], list[Layer]]:
    """A point's energies by collision count: numbers as JSON, and what is drawn."""
    scene = traces[0].start
    require_motion(scene)
    if scene.number < 2:
        raise FigureError("kinetic theory has no word on one ball; it needs two or more")
    calm = [before_collapse(trace) for trace in traces]
    shortest = min(trace.collisions for trace in calm)
    if shortest == 0:
        raise FigureError("a repeat has no collisions; run longer")
    counts = np.unique(np.linspace(0.0, shortest, COUNTS + 1).round())
    rows = np.array([_against_counts(series(trace), scene, counts) for trace in calm])
    energies, expected = rows[:, 0], rows[:, 1]
    floors = np.array([predictions.floor(trace.start) for trace in traces])[:, None]
    final, error = mean_and_error(energies[:, -1])
    spread = None
    if len(traces) > 1:
        spread = energies.std(axis=0, ddof=1) / math.sqrt(len(traces))
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
    layers: list[Layer] = [Line(x, alone, None, index, "solid")]
    if floor >= FLOOR_MATTERS * final:
        above = (floors + (1 - floors) * expected).mean(axis=0)
        layers.append(Line(x, above, None, index, "dashed"))
        record["theory_above_floor"] = float(above[-1])
    layers.append(Points(x, energies.mean(axis=0), None, spread, name, index))
    return record, layers


def _haff_energy(time: Array, alpha: float, floor: float) -> Array:
    """Energy over its start where Haff's law holds for what is above the floor."""
    return np.asarray(floor + (1 - floor) * theory.haff_ratio(time, alpha))


def _haff_rate(time: Array, alpha: float, floor: float) -> Array:
    """The decay rate −d ln E/dt of that energy, s⁻¹."""
    slope = 2 * alpha * (1 - floor) / (1 + alpha * time) ** 3
    return np.asarray(slope / _haff_energy(time, alpha, floor))


def _local_rates(traces: Sequence[Trace]) -> tuple[Array, Array, Array, float]:
    """Edges of windows (*w*, 2), −d ln of the mean energy/dt there, its standard error (s⁻¹).

    At last, the mean energy ratio in the end. Windows with too few collisions are left out.
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
        raise FigureError("a repeat loses all of its energy, so that it has no decay rate")
    good = collisions >= LEAST_COLLISIONS
    if np.count_nonzero(good) < 2:
        raise FigureError(
            f"its windows of time have fewer than {LEAST_COLLISIONS} collisions, too few for a "
            "rate; run longer or more repeats"
        )
    width = end / WINDOWS
    rates = -np.diff(np.log(energies.mean(axis=0))) / width
    # Each repeat's own rate spreads as much around the mean.
    own = -np.diff(np.log(energies), axis=1) / width
    errors = np.full(WINDOWS, math.nan)
    if len(traces) > 1:
        errors = own.std(axis=0, ddof=1) / math.sqrt(len(traces))
    windows = np.column_stack([edges[:-1], edges[1:]])
    return windows[good], rates[good], errors[good], float(energies[:, -1].mean())


def _against_counts(found: Series, scene: Scene, counts: Array) -> tuple[Array, Array]:
    """A repeat's energy ratio after so many collisions, and what theory makes of them."""
    events = found.wall_events + found.pair_events
    # A summary's rows may share a count: the last of them stands for it.
    last = np.append(events[1:] > events[:-1], True)
    ratio = np.interp(counts, events[last], energy_ratio(found)[last])
    wall = np.interp(counts, events[last], found.wall_events[last])
    pairs = np.interp(counts, events[last], found.pair_events[last])
    expected = theory.energy_ratio_by_events(
        scene.number, scene.restitution, pairs, scene.wall_restitution, wall
    )
    return ratio, np.asarray(expected)


def _kept(points: Sequence[Point]) -> str:
    """The letter of what the balls keep: angular momentum in a circle, momentum without walls."""
    return "L" if points[0].experiment.container.shape_class.has_wall else "p"


def _at_walls(points: Sequence[Point]) -> str:
    """What collisions at walls take, where there are any."""
    walls = any(point.experiment.container.shape_class.has_wall for point in points)
    return " and each of c_w at the wall (1 − e_w²)E/N" if walls else ""


def _key(text: str, style: _Style) -> Line:
    """A legend's entry for a style that all series share."""
    return Line(np.empty(0), np.empty(0), text, NEUTRAL, style)


# One repeat's decay beside its exponential and Haff's law, and the means over the repeats.

RATE = "s⁻¹"
_NAMES: dict[str, str] = {"exponential": "exponential", "haff": "Haff"}


def energy_fit(run: Run, selection: Selection) -> FigureData:
    """Decay of the kinetic energy of balls and container."""
    return _fit(run, selection, "kinetic_energy", "energy-fit", "Kinetic energy")


def temperature_fit(run: Run, selection: Selection) -> FigureData:
    """Decay of the temperature."""
    return _fit(run, selection, "temperature", "temperature-fit", "Temperature")


def pressure_fit(run: Run, selection: Selection) -> FigureData:
    """Decay of the mean pressure since the start, after the first collisions."""
    return _fit(run, selection, "pressure", "pressure-fit", "Cumulative pressure")


def _fit(run: Run, selection: Selection, quantity: str, kind: str, title: str) -> FigureData:
    point = single_point(run, selection)
    if elastic(point):
        raise FigureError("nothing decays where all collisions are elastic; take cor below 1")
    trace = one_repeat(run, point, selection)
    require_motion(trace.start)
    shown, which = curve(trace, quantity), there(run, point, selection)[0]
    fits = {law: fit_curve(shown, law) for law in LAWS}
    if not any(result.converged for result in fits.values()):
        raise FigureError(f"this repeat cannot be fitted: {fits['exponential'].message}")
    whole = Selection(selection.where)
    traces = list(repeats(run, point, whole))
    curves = [curve(trace, quantity) for trace in traces]
    means = {law: mean_over_repeats(fit_curve(each, law) for each in curves) for law in LAWS}
    symbols: dict[str, str] = {"exponential": "κ" if quantity == "pressure" else "k", "haff": "α"}
    steps = quantity != "pressure"
    begun = [(each.time, each.value) for each in curves if len(each.time) > 1]
    spread = bands(*at_common_times(begun, steps=steps), 0, f"all {len(begun)} repeats, {SPREAD}")
    layers = [*spread, *_curves(shown, fits, symbols, which, steps=steps)]
    layers += [
        Note(
            f"mean of {means[law].count} repeats: {symbols[law]} = "
            + with_error(means[law].mean, means[law].standard_error, RATE)
        )
        for law in LAWS
        if means[law].count > 1
    ]
    if quantity == "pressure":
        layers.append(Note("κ is what the report calls k/2"))
    return FigureData(
        kind=kind,
        title=f"{title} and its fits" + _where(point, run),
        x_label="time (s)",
        y_label={
            "kinetic_energy": "kinetic energy, E(t)/E(0)",
            "temperature": "temperature, T(t)/T(0)",
        }.get(quantity, f"pressure, P(t)/P({SKIPPED_COLLISIONS} collisions)"),
        layers=tuple(layers),
        caption=f"{_caption(fits, means, symbols, early(facts(run, point, whole, single=False)))} "
        + (f"Band: {SPREAD}. " if spread else "")
        + setting(run, [point], selection, single=True),
        numbers=_numbers(point, fits, means, which),
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def _curves(
    shown: Curve, fits: dict[str, FitResult], symbols: dict[str, str], repeat: int, *, steps: bool
) -> list[Layer]:
    """The repeat's curve and the laws fitted to it, with value ± error of this fit alone."""
    kept = thinned(shown.time)
    name = f"simulation, repeat {repeat}"
    layers: list[Layer] = [
        Line(shown.time[kept], shown.value[kept], name, 0, steps=steps, broad=True)
    ]
    fine = np.linspace(shown.time[0], shown.time[-1], 300)
    for place, law in enumerate(LAWS, start=1):
        result = fits[law]
        if result.converged:
            text = with_error(result.value, result.error, RATE)
            name = f"{_NAMES[law]} of repeat {repeat}: {symbols[law]} = {text}"
            layers.append(Line(fine, fitted_curve(result, fine), name, place))
    return layers


def _caption(
    fits: dict[str, FitResult],
    means: dict[str, RepeatMean],
    symbols: dict[str, str],
    ended: str,
) -> str:
    """What the fits say, in sentences."""
    this = [
        f"{symbols[law]} = {with_error(fits[law].value, fits[law].error, RATE)} "
        f"({_NAMES[law]}, R² = {fits[law].r_squared:.4f})"
        for law in LAWS
        if fits[law].converged
    ]
    text = f"This repeat alone gives {' and '.join(this)}."
    over = [
        f"{symbols[law]} = {with_error(means[law].mean, means[law].standard_error, RATE)} "
        f"(half range {short(means[law].max_min_half_range, 2)})"
        for law in LAWS
        if means[law].count > 1
    ]
    if over:
        text += f" Means over the repeats, with standard errors: {' and '.join(over)}"
        text += f"; {ended}." if ended else "."
    return text


def _numbers(
    point: Point, fits: dict[str, FitResult], means: dict[str, RepeatMean], repeat: int
) -> dict[str, Any]:
    """The fits as JSON: ``k`` of the exponential (κ of a pressure), ``alpha`` of Haff's law."""
    numbers: dict[str, Any] = {"parameters": point.as_json(), "repeat": repeat}
    names: dict[str, str] = {"exponential": "k", "haff": "alpha"}
    for law, name in names.items():
        numbers |= {
            name: fits[law].value,
            f"{name}_error": fits[law].error,
            f"{name}_r_squared": fits[law].r_squared,
            f"{name}_mean": means[law].mean,
            f"{name}_standard_error": means[law].standard_error,
            f"{name}_half_range": means[law].max_min_half_range,
            f"{name}_repeats": means[law].count,
        }
    return numbers


def _where(point: Point, run: Run) -> str:
    """The point's place in the title, if the run has others."""
    text = ", ".join(described(point, key) for key in varying(run.points))
    return f": {text}" if text else ""


# The decay constants of the energy over many CoR, beside the report's formula and theory.

_CONSTANTS: tuple[tuple[str, str, str], ...] = (
    ("exponential", "k", "k, exponential fitted"),
    ("haff", "alpha", "α, Haff's law fitted"),
)


def decay_against_cor(run: Run, selection: Selection) -> FigureData:
    """The decay constants of the energy against the CoR, beside the report's and kinetic theory."""
    (points,) = along(inelastic_points(run, selection), "cor")
    require_motion(one_repeat(run, points[0], selection).start)
    records = [_decay(run, point, selection) for point in points]
    cors = np.array([point.experiment.cor for point in points])
    laws = _laws(run, points, selection)
    layers = list(laws)
    reported = np.array([each["report_k"] for each in records])
    known = np.isfinite(reported)
    draw = np.count_nonzero(known) > 1
    if draw:
        layers.insert(0, Line(cors[known], reported[known], "k by the report", 0, "dashed"))
    for index, (_, name, text) in enumerate(_CONSTANTS):
        values = np.array([each[name] for each in records])
        errors = np.array([each[f"{name}_error"] for each in records])
        good = np.isfinite(values)
        bars = errors[good] if np.all(np.isfinite(errors[good])) else None
        layers.append(Points(cors[good], values[good], None, bars, text, index))
    ends = [
        f"{symbol} from {with_error(records[0][name], records[0][f'{name}_error'])} to "
        + with_error(records[-1][name], records[-1][f"{name}_error"])
        for symbol, name in (("k", "k"), ("α", "alpha"))
    ]
    formula = ""
    if known.any():
        span = [short(each) for each in reported[known][[0, -1]]]
        formula = (
            "The report's own k = −2 ln(CoR)⟨v⟩/λ, with λ = 1/(√2 n 2πr) and ⟨v⟩ the mean over all "
            f"collisions, {f'goes from {span[0]} to {span[1]}' if draw else f'is {span[0]}'} s⁻¹. "
        )
    if laws:
        formula += "Dotted: that k with Enskog's λ and the balls' mean speed at the start. "
    return FigureData(
        kind="decay-against-cor",
        title="Decay constants of the energy",
        x_label="coefficient of restitution",
        y_label="decay constant (s⁻¹)",
        layers=tuple(layers),
        caption=f"Between CoR {cors[0]:g} and {cors[-1]:g} the fits give {' and '.join(ends)} s⁻¹"
        + (", means and standard errors over the repeats. " if run.experiment.repeats > 1 else ". ")
        + formula
        + setting(run, points, selection),
        numbers={
            "points": records,
            "ended_early": sum(each["ended_early"] for each in records),
        },
        y_log=True,
    )


def _decay(run: Run, point: Point, selection: Selection) -> dict[str, Any]:
    """The decay constants of a point's energy over its repeats, as JSON."""
    traces = list(repeats(run, point, selection))
    found = {each.law: each for each in decays(traces, ("kinetic_energy",))}
    record: dict[str, Any] = {"parameters": point.as_json()}
    for law, name, _ in _CONSTANTS:
        over = found[law].over_repeats
        record |= {name: over.mean, f"{name}_error": over.standard_error, "repeats": over.count}
    reported, error = mean_and_error(np.array([reported_constant(trace) for trace in traces]))
    record |= {"report_k": reported, "report_k_error": error}
    return record | {"ended_early": found["haff"].short}


def _laws(run: Run, points: Sequence[Point], selection: Selection) -> list[Layer]:
    """Kinetic theory's α, and the report's formula with its rate; none where there is no theory."""
    scene = one_repeat(run, points[0], selection).start
    rates = predictions.scene_rates(scene, meeting_temperature(scene.kinetic_energy, scene))
    if rates is None:
        return []
    cors = [point.experiment.cor for point in points]
    # The report's logarithm has no value at CoR 0.
    grid = np.linspace(max(cors[0], 0.01), cors[-1], 100)
    wall = points[0].experiment.wall_cor
    path, speed = rates.mean_free_path, rates.mean_speed
    report = [theory.report_decay_constant(float(e), path, speed) for e in grid]
    losses = [
        theory.cooling_rate(
            float(e), rates.ball_ball, float(e) if wall is None else wall, rates.wall
        )
        for e in grid
    ]
    alpha = [theory.haff_rate(each) for each in losses]
    return [
        Line(grid, np.array(report), "k, Enskog's λ, first ⟨v⟩", 0, "dotted"),
        Line(grid, np.array(alpha), "α, kinetic theory", 1, "solid"),
    ]
