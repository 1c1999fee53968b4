"""Fits of a decay, decay constants against the CoR, Haff's law over time."""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.comparison import comparisons_of
from snooker_cli.analysis.decay import QUANTITIES, course, decays_of, reported_constants
from snooker_cli.analysis.findings import Findings
from snooker_cli.analysis.fitting import LAWS, fitted_curve
from snooker_cli.analysis.gas import (
    enskog_rates,
    finite_haff_rate,
    floors,
    haff_rate,
    starting_temperature,
)
from snooker_cli.analysis.goodness import FEWEST_TESTED, MOST_ERRORS, cannot_be_tested
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import (
    mean_and_error,
)
from snooker_cli.analysis.trend import Trend
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.declared_result import agreement, most_significant
from snooker_cli.figures.figure_builder import LOG_SPREAD, OVER_THEORY, SPREAD, FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    COMMON_TIMES,
    EXTRAPOLATED,
    NEUTRAL,
    SECOND,
    Array,
    FigureData,
    Layer,
    Line,
    LineStyle,
    Panel,
    Points,
    Reference,
    bands,
    courses,
    legend_line,
    legend_marker,
    markers,
    mean_of_remaining,
    places,
)
from snooker_cli.formatting import percent, point_label, short, with_error
from snooker_cli.laws import Constant
from snooker_cli.runs.selection import Selection
from snooker_cli.scene import Scene

RATE = "s⁻¹"

WINDOWS = 14  # windows of time for the local decay rate

LEAST_COLLISIONS = 10
"""The least collisions of all repeats in a window: n collisions give a rate to about 1/√n of it."""

MOST_SENTENCES = 2  # of a caption, on how α changes in each of several series
FLOOR_MATTERS = 0.1  # the floor is drawn where it is at least this share of the energy that is left

FLOORS = {
    "L": " L keeps the energy L²/2I of a rotation.",
    "p": " The momentum p keeps the energy p²/(2Nm).",
}
"""The floor of the energy in a circle, and in a periodic box."""

_HAFF: dict[str, tuple[str, LineStyle]] = {
    "fitted": ("Haff's law, α fitted", EXTRAPOLATED),
    "theory": ("Haff's law, α of {model}", BY_THEORY),
    "floor": ("Haff's law above the energy kept by {kept}", SECOND),
}
"""The forms of Haff's law: in the legend, and their dashes."""

BEGINNING = 0.01
"""αt where curves of the slowdown begin: a hundredth of the time in which the speeds halve."""

_SERIES = {law: series for series, law in enumerate(LAWS, start=1)}
"""The series whose colour a law has in each figure; the simulation is series 0."""


def fit_figure(quantity: str, build: FigureBuilder) -> FigureData:
    """The mean decay of a quantity or that of a chosen repeat, fits, and a band of all repeats."""
    (point,), known = build.points, QUANTITIES[quantity]
    number, chosen = build.repeats(point)[0], build.selection.repeat is not None
    build.selection = Selection(build.selection.where)  # the means are over all repeats
    row, measurement = build.repeats(point).index(number), build.measurement(point)
    fitted, falling = decays_of(measurement, (quantity,)), course(measurement, quantity)
    if not any(decay.fits[row].converged for decay in fitted):
        raise FigureError(f"repeat {number} cannot be fitted: {fitted[0].fits[row].message}")
    begins = falling.origin.tolist()
    drawn = [
        (time[time >= begin], value[time >= begin])
        for (time, value), begin in zip(courses(falling.time, falling.value), begins, strict=True)
    ]
    started = [pair for pair in drawn if len(pair[0]) > 1]
    log = min(values.min() for _, values in started) > 0  # an exponential is a straight line
    label = f"all {len(started)} repeats, {LOG_SPREAD if log else SPREAD}"
    build.bands = bands(started, 0, label, logarithmic=log)
    time, value = drawn[row]
    label = f"simulation, repeat {number}"
    if build.bands and not chosen:
        (band,) = build.bands
        build.note_remaining(np.array([each[-1] for each, _ in started]), float(band.x[-1]))
        value = np.sqrt(band.low * band.high) if log else (band.low + band.high) / 2
        time, label = band.x, f"simulation, mean of {len(started)} repeats"
    build.lines.append(Line(time, value, label, broad=True))
    fine = places(float(time[0]), float(time[-1]), 300)
    numbers: dict[str, Any] = {"parameters": point.as_json(), "repeat": number, "fits": []}
    for decay in fitted:
        converged = [fit for fit in decay.fits if fit.converged]
        if not converged:
            continue
        model, mean = LAWS[decay.law], decay.over_repeats
        symbol = model.mean_symbol if known.is_mean else model.symbol
        text = f"{symbol} = {with_error(mean.value, mean.error, RATE)}"
        repeats = f"mean of {mean.repeats} repeats" if mean.repeats > 1 else "one repeat"
        with np.errstate(divide="ignore"):
            logs = np.log([fitted_curve(fit, fine) for fit in converged])
        name = f"{model.label}, {repeats}: {text}"
        build.lines.append(Line(fine, np.exp(logs.mean(axis=0)), name, _SERIES[decay.law]))
        numbers[model.key], numbers[f"{model.key}_error"] = mean.value, mean.error
        numbers[f"repeat_{model.key}"] = decay.fits[row].value
        numbers["fits"].append(decay.as_json())
    # An exponential leaves slower decays by many decades.
    least = min(values.min() for _, values in started) / 10 if log else 0.0
    lower = not log or any(line.y.min() < least for line in build.lines if isinstance(line, Line))
    return build.figure(
        "Each repeat is fitted; the law has the mean of their constants.",
        numbers=numbers,
        logarithmic=log,
        y_limits=(float(least) if lower else None, None),
    )


def decay_against_cor(build: FigureBuilder) -> FigureData:
    """α of Haff's law over 1 − e², which is near the rate of collisions, against the CoR e.

    The reproduction has α itself, with the constants k of an exponential. Of several runs side by
    side each has a colour; α is that of `_haff_constants`.
    """
    names, several = [group[0] for group in build.groups], len(build.groups) > 1
    model, shared = _model(build.source), build.source or not all(map(_loses_alike, names))
    sentences, any_early, symbol = list[str](), False, "α, " * shared  # beside k
    for index, points in enumerate(build.groups):
        records = [_constants(build, point) for point in points]
        cors = np.array([point.config.cor for point in points])
        column = {name: np.array([row[name] for row in records]) for name in records[0]}
        alpha, error = column["alpha"], column["alpha_error"]
        scene, expected = build.start(points[0]), np.full(len(cors), math.nan)
        if theories.theory_of(scene, quantities.HAFF_RATE, model):
            # The logarithm of the source report has no value at CoR 0.
            grid = np.linspace(max(cors[0], 0.01), cors[-1], 100)
            curve, expected = (_haff_constants(build, points[0], scene, e) for e in (grid, cors))
            name = None if several else f"{symbol}{model}"
            y = curve if shared else curve / (1 - grid**2)
            build.lines.append(Line(grid, y, name, index, BY_THEORY))
            build.cite(quantities.HAFF_RATE, model)
            if len(build.groups) <= MOST_SENTENCES:
                about = f"{build.label(points[0], names)}: " if several else ""
                build.beside_theory = True
                sentences.append(f"{about}{_along_cor(records, expected, model)}.")
            if build.source:
                _add_source_constants(build, index, scene, grid)
        label = build.label(points[0], names) if several else f"{symbol}Haff's law fitted"
        scale = 1.0 if shared else 1 / (1 - cors**2)
        early = (column["ended_early"] > 0) & (not build.source)
        build.lines += markers(cors, alpha * scale, error * scale, label, index, early)
        for kept, filled in ((~early, True), (early, False)):
            if kept.any():
                columns = (each[kept] for each in (cors, alpha, error, expected))
                build.add_residuals(index, *columns, filled=filled)
        any_early |= bool(early.any())
        if build.source:
            series, name = index + len(build.groups), "k by the source report"
            build.lines.append(Line(cors, column["report_k"], name, series, SECOND))
            name = "k, exponential fitted"
            build.lines.append(Points(cors, column["k"], column["k_error"], name, series, False))
    if several:
        build.lines.append(legend_line(f"{symbol}{model}", BY_THEORY))
    if any_early:
        name = "with repeats that ended early"
        build.lines.append(legend_marker(name, filled=False))
    title = build.title if build.source else _title_beside_theory(build)
    ended_early = sum(record["ended_early"] for record in build.records)
    axes: dict[str, Any] = {}
    if shared:
        axes = {"y_label": "decay constant (s⁻¹)", "logarithmic": True}
    return build.figure(
        " ".join(sentences), numbers={"ended_early": ended_early}, title=title, **axes
    )


def _title_beside_theory(build: FigureBuilder) -> str:
    """The title, and how far α is from theory where it differs by most errors."""
    farthest = most_significant(build.panel)
    if farthest is None or build.fewest_repeats < FEWEST_TESTED:
        return build.title
    if not farthest.in_errors > MOST_ERRORS:
        return f"{build.title}: agrees with theory"
    share, _ = farthest.percent
    side = "above" if share > 0 else "below"
    return f"{build.title}: {percent(abs(share) / 100)} {side} theory at CoR {farthest.x:g}"


def _loses_alike(point: Point) -> bool:
    """Whether all collisions that lose energy lose 1 − e² of the normal motion."""
    return point.config.wall_cor in (None, 1.0)


def _add_source_constants(build: FigureBuilder, index: int, scene: Scene, cors: Array) -> None:
    """Add the source report's k with Enskog's free path and the speed at the start."""
    rates = enskog_rates(scene, starting_temperature(scene))
    free_path, speed = rates.mean_free_path, rates.mean_speed
    law = [theory.source_decay_constant(float(e), free_path, speed) for e in cors]
    name, series = "k, mean free path after Enskog", index + len(build.groups)
    build.lines.append(Line(cors, np.array(law), name, series, BY_THEORY))


def _along_cor(records: Sequence[dict[str, Any]], expected: Array, model: str) -> str:
    """How the fitted α changes with the CoR, beside its prediction, as a sentence."""
    columns = ("alpha", "alpha_error")
    alpha, error = (np.array([row[name] for row in records]) for name in columns)
    numbers = {
        "measured": alpha,
        "error": error,
        "predicted": expected,
        "difference": alpha - expected,
        "difference_error": error,
        "difference_in_errors": (alpha - expected) / error,
        "repeats": np.array([row["repeats"] for row in records]),
    }
    cors = [row["parameters"]["cor"] for row in records]
    rows = [
        {"quantity": quantities.HAFF_RATE.name, "model": model, **record}
        | {name: column[place] for name, column in numbers.items()}
        for place, record in enumerate(records)
    ]
    sentence = Trend("cor", rows, words={cor: f"CoR {cor:g}" for cor in cors}).sentence()
    return f"By itself, {sentence}"


def _constants(build: FigureBuilder, point: Point) -> dict[str, Any]:
    """The decay constants of a point with their errors, which become its record."""
    fitted = build.energy_decays(point)
    means = {LAWS[decay.law].key: decay.over_repeats for decay in fitted}
    constants = {key: (mean.value, mean.error) for key, mean in means.items()}
    if build.source:
        constants["report_k"] = mean_and_error(reported_constants(build.measurement(point)))
    repeats, early = fitted[-1].over_repeats.repeats, fitted[-1].short
    build.record(point, **constants, repeats=repeats, ended_early=early)
    return build.records[-1]


def _model(source: bool) -> str:
    """The theory of Haff's α: that of findings, or in the reproduction that of its text."""
    return theories.START_RATES if source else theory.FINITE


def _rate(source: bool) -> Callable[[Scene], float]:
    """Haff's α of a scene by the theory of `_model`, 1/s."""
    return haff_rate if source else finite_haff_rate


def _haff_constants(build: FigureBuilder, point: Point, scene: Scene, cors: Array) -> Array:
    """Haff's α of a point with these CoR by theory, from the state at the start; 1/s."""
    rate = _rate(build.source)
    return np.array([rate(with_cor(point, scene, cor)) for cor in cors.tolist()])


def with_cor(point: Point, scene: Scene, cor: float) -> Scene:
    """The start of a point with another CoR, which the wall follows if it has none of its own."""
    law = Constant(cor)
    follows = point.config.wall_cor is None and not facts.hold(scene, "warm_walls")
    return replace(scene, pair_law=law, wall_law=law if follows else scene.wall_law)


class _LocalDecay(NamedTuple):
    """A point's local rates in windows of time, and the forms of Haff's law that it has.

    edges : (*w*, 2), s
    rates, errors : −d ln E/dt and its standard error; (*w*,), s⁻¹
    k : constant of the fitted exponential, s⁻¹
    alpha_error : standard error of the fitted α, s⁻¹
    floor : energy that the balls keep, over that at the start
    holds : time until which Haff's law is not refused, s; infinite if it is not refused at all
    tested : whether there are repeats enough to refuse it
    laws : α (s⁻¹) and floor of each form in ``_HAFF``
    """

    edges: Array
    rates: Array
    errors: Array
    k: float
    alpha_error: float
    floor: float
    holds: float
    tested: bool
    laws: dict[str, tuple[float, float]]


def cooling(build: FigureBuilder) -> FigureData:
    """√(E(0)/E) − 1, which is αt by Haff's law, the decay rate −d ln E/dt, and its residuals.

    Of several points, times are in units of 1/α and rates of 2α, so that the law is one curve.
    """
    decays = [_local_decay(build, point) for point in build.points]
    several, kept, rate = len(decays) > 1, kept_letter(build.points), list[Layer]()
    words = {"model": _model(build.source), "kept": kept}
    drawn = {law for decay in decays for law in decay.laws}
    common = "theory" if all("theory" in decay.laws for decay in decays) else "fitted"
    ends = list[float]()
    for index, (point, decay) in enumerate(zip(build.points, decays, strict=True)):
        alpha, *_ = common_law = decay.laws[common]
        inverse_time, inverse_rate = (alpha, 0.5 / alpha) if several else (1.0, 1.0)
        begins, end = _add_slowdown(build, index, point, alpha, inverse_time)
        fine = np.geomspace(begins, decay.edges[-1, 1], 200)
        ends += [alpha * begins, alpha * end]
        for law, constants in decay.laws.items():
            if law == "floor" or not several:
                text, style = _HAFF[law]
                name, owner = None if several else text.format(**words), NEUTRAL
                if several or law == "fitted":
                    owner = index if several else _SERIES["haff"]
                x, speed = fine * inverse_time, _haff_rate(fine, *constants) * inverse_rate
                build.lines.append(Line(x, _slowdown(fine, *constants), name, owner, style))
                rate.append(Line(x, speed, None, owner, style))
                if law != common:
                    above = np.log(_haff_rate(fine, *constants) / _haff_rate(fine, *common_law))
                    build.panel.append(Line(x, above, None, owner, style))
        # A mean over a window is drawn where Haff's law has it.
        x = (2 / _mean_haff_rates(decay.edges, alpha, 0.0) - 1 / alpha) * inverse_time
        y, error = decay.rates * inverse_rate, decay.errors * inverse_rate
        rate.append(Points(x, y, error, None, index))
        means = {law: _mean_haff_rates(decay.edges, *decay.laws[law]) for law in decay.laws}
        record: dict[str, Any] = {"k": decay.k, "floor": decay.floor, "windows": len(decay.rates)}
        record |= {f"{law}_last_rate": float(mean[-1]) for law, mean in means.items()}
        record["alpha"] = decay.laws["fitted"][0], decay.alpha_error
        if "theory" in decay.laws:
            record["theory_alpha"] = decay.laws["theory"][0]
            build.cite(quantities.HAFF_RATE, words["model"])
        build.add_residuals(index, x, decay.rates, decay.errors, means[common])
        first, *_, last = zip(decay.rates, decay.errors, strict=True)
        build.record(point, **record, first_rate=first, last_rate=last)
    labels, unit, holds = dict[str, Any](), "s⁻¹", min(decay.holds for decay in decays)
    if several:
        x = np.geomspace(min(ends), max(ends), 200)
        build.lines.append(Line(x, x, _HAFF[common][0].format(**words), NEUTRAL, _HAFF[common][1]))
        rate.append(Line(x, 1 / (1 + x), None, NEUTRAL, _HAFF[common][1]))
        labels = {"x_label": f"α t, α {'of theory' if common == 'theory' else 'fitted'}"}
        unit, drawn = "2α", drawn & {"floor"}
        if drawn:
            text, style = _HAFF["floor"]
            build.lines.append(legend_line(text.format(**words), style))
    build.headline = _law_holds(build, decays)
    if not several and math.isfinite(holds):
        build.lines.append(Reference("x", holds, "Haff's law is refused"))
    return build.figure(
        " ".join(filter(None, _cooling_sentences(build, drawn, kept))),
        y_limits=(min(ends) / 2, None),
        panel_label=OVER_THEORY if common == "theory" else "ln(result / fit)",
        panels=(Panel(tuple(rate), f"−d ln E/dt ({unit})", log=True),),
        **labels,
    )


def _law_holds(build: FigureBuilder, decays: Sequence[_LocalDecay]) -> str:
    """Whether Haff's law is refused, in a few words; of one point also how far α is from theory."""
    refused = [decay.holds for decay in decays if math.isfinite(decay.holds)]
    if len(decays) > 1:
        return f"refused at {len(refused)} of {len(decays)} points" if refused else "not refused"
    if refused:
        return f"refused from {short(refused[0])} s on"
    if not decays[0].tested:
        return "not tested"
    assert build.result is not None
    residuals = [point for row in build.records if (point := build.result.residual(row))]
    beside = agreement(residuals, build.fewest_repeats, whose="α")
    return "; ".join(filter(None, ["not refused", beside]))


def _cooling_sentences(build: FigureBuilder, drawn: Collection[str], kept: str) -> Iterator[str]:
    """Sentences on the result of one point beside theory, and on how rates are measured."""
    if len(build.points) == 1 and not build.source:
        (point,), build.beside_theory = build.points, True
        yield f"{_finding(build, point)}."
    yield f"Markers: means over {WINDOWS} windows of time."
    if any(record["windows"] < WINDOWS for record in build.records):
        yield f"Windows with fewer than {LEAST_COLLISIONS} collisions are left out."
    if "floor" in drawn:
        yield FLOORS[kept].strip()


def _finding(build: FigureBuilder, point: Point) -> str:
    """Haff's α of a point beside theory, and whether its law holds; without a full stop."""
    measurement, label = build.measurement(point), point_label(point.as_json())
    asked = {"parameters": point.as_json(), "requested": len(build.repeats(point))}
    fitted = build.energy_decays(point)
    compared, _ = comparisons_of(measurement, decays_of(measurement))
    rows = [row.as_json() | asked for row in compared if row.quantity == quantities.HAFF_RATE.name]
    return Findings([decay.as_json() | asked for decay in fitted], rows).at_point(label)


def _add_slowdown(
    build: FigureBuilder, index: int, point: Point, alpha: float, inverse_time: float
) -> tuple[float, float]:
    """Add the mean of √(E(0)/E) − 1 over the repeats; the beginning and the end of the axis, s.

    It begins where Haff's law has ``BEGINNING``, or at a hundredth of a shorter time. The mean
    begins where it has a half of that.
    """
    energy = course(build.measurement(point), "kinetic_energy")
    curves = courses(energy.time, energy.value)
    end = sorted(float(time[-1]) for time, _ in curves)[-2:][0]
    begins = min(BEGINNING / alpha, end / 100)
    x = np.geomspace(begins, end, COMMON_TIMES)
    ratio = np.array([np.interp(x, *curve, right=math.nan) for curve in curves])
    rows = ratio**-0.5 - 1
    first = int(np.argmax(rows.mean(axis=0) >= alpha * begins / 2))
    name = build.label(point) or "simulation"
    build.add_means(index, name, x[first:] * inverse_time, rows[:, first:])
    build.brief[index] = 0  # the result is fitted to all repeats
    return begins, end


def _slowdown(time: Array, alpha: float, floor: float) -> Array:
    """√(E(0)/E) − 1 where Haff's law holds for the energy above the floor."""
    return np.asarray((floor + (1 - floor) * theory.haff_ratio(time, alpha)) ** -0.5 - 1)


def _local_decay(build: FigureBuilder, point: Point) -> _LocalDecay:
    """The local decay of a point. Raises ``FigureError`` if it has too few collisions."""
    measurement = build.measurement(point)
    if measurement.time.min() == 0:
        raise FigureError("a repeat has no length; run longer")
    decays = {decay.law: decay for decay in build.energy_decays(point)}
    k, alpha = (decays[law].over_repeats.value for law in ("exponential", "haff"))
    if not (math.isfinite(k) and 0 < alpha < math.inf):
        raise FigureError("a point's repeats are too short to be fitted; run longer")
    if build.source:
        edges = np.linspace(0.0, float(np.min(measurement.time)), WINDOWS + 1)
    else:  # as many collisions in each, by Haff's law
        end = float(np.median(measurement.time))
        edges = np.expm1(np.linspace(0.0, np.log1p(alpha * end), WINDOWS + 1)) / alpha
        edges[-1] = end
    windows, rates, errors, left = _local_rates(measurement, edges)
    floor, holds = float(floors(measurement).mean()), math.inf
    if not build.source and decays["haff"].goodness.holds_to < decays["haff"].goodness.judged_to:
        holds = decays["haff"].goodness.holds_to
    laws = {"fitted": (alpha, 0.0)}
    if theories.theory_of(measurement.scene, quantities.HAFF_RATE, _model(build.source)):
        expected = _rate(build.source)(measurement.scene)
        laws["theory"] = (expected, 0.0)
        if floor >= FLOOR_MATTERS * left:
            laws["floor"] = (expected, floor)
    judged = decays["haff"].as_json()
    tested = judged["probability"] is not None and not cannot_be_tested(judged)
    error = decays["haff"].over_repeats.error
    return _LocalDecay(windows, rates, errors, k, error, floor, holds, tested, laws)


def _haff_rate(time: Array, alpha: float, floor: float) -> Array:
    """The decay rate −d ln E/dt where Haff's law holds for the energy above the floor, s⁻¹."""
    slower = 1 + alpha * time
    above = floor * slower**2 if floor else 0.0  # α may be so large that the square is no double
    return np.asarray(2 * alpha * (1 - floor) / (slower * (above + 1 - floor)))


def _mean_haff_rates(edges: Array, alpha: float, floor: float) -> Array:
    """The mean of this rate in windows of time with edges (*w*, 2); (*w*,), s⁻¹."""
    logs = np.log(floor + (1 - floor) * theory.haff_ratio(edges, alpha))
    return np.asarray((logs[:, 0] - logs[:, 1]) / np.ptp(edges, axis=1))


def _local_rates(measurement: Measurement, edges: Array) -> tuple[Array, Array, Array, float]:
    """Windows (*w*, 2) between edges, s; −d ln of the mean energy/dt there, s⁻¹; its error.

    A window has the repeats that reach its end. Last, the mean energy ratio in the last window.
    Windows with too few collisions are left out.
    """
    curve = measurement.curve
    energies = curve.at(edges, course(measurement, "kinetic_energy").value)
    there = measurement.time[:, np.newaxis] >= edges[1:]
    if np.any(energies <= 0):
        raise FigureError("a repeat loses all of its energy, so it has no decay rate")
    calm = measurement.calm_events.sum(axis=1, keepdims=True)
    counts = np.minimum(np.rint(curve.at(edges, curve.events)), calm)
    collisions = np.where(there, np.diff(counts), 0.0).sum(axis=0)
    good = collisions >= LEAST_COLLISIONS
    if np.count_nonzero(good) < 2:
        raise FigureError(
            f"its windows of time have fewer than {LEAST_COLLISIONS} collisions, too few for a "
            "rate; run longer or more repeats"
        )
    width = np.diff(edges)
    means = [np.where(there, energies[:, k : k + WINDOWS], 0.0).sum(axis=0) for k in (0, 1)]
    rates = np.log(means[0] / means[1]) / width
    # Each repeat's own rate varies as much around the mean.
    own = np.where(there, -np.diff(np.log(energies), axis=1) / width, math.nan)
    _, errors = mean_of_remaining(own)
    windows = np.column_stack([edges[:-1], edges[1:]])
    left = float(energies[there[:, -1], -1].mean())
    return windows[good], rates[good], errors[good], left


def kept_letter(points: Sequence[Point]) -> str:
    """The letter of what the balls keep: angular momentum in a circle, momentum without walls."""
    return "L" if facts.hold(points[0].config, "walls") else "p"
