"""Fits of a decay, decay constants against the CoR, the decay rate over time, energy by events."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.decay import QUANTITIES, course, decays_of, reported_constants
from snooker_cli.analysis.findings import Findings
from snooker_cli.analysis.fitting import LAWS, fitted_curve
from snooker_cli.analysis.gas import (
    components,
    enskog_rates,
    finite_haff_rate,
    floors,
    haff_rate,
    starting_temperature,
)
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import (
    collisions_per_ball,
    mean_and_error,
    standard_errors,
)
from snooker_cli.analysis.time_series import interpolated
from snooker_cli.analysis.trend import Trend
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import LOG_SPREAD, SPREAD, FigureBuilder
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Array,
    FigureData,
    Line,
    LineStyle,
    Points,
    bands,
    courses,
    legend_line,
    places,
)
from snooker_cli.figures.selection import Selection, described
from snooker_cli.formatting import point_label, with_error
from snooker_cli.laws import Constant
from snooker_cli.scene import Scene

RATE = "s⁻¹"

WINDOWS = 14  # windows of time for the local decay rate

LEAST_COLLISIONS = 10
"""The least collisions of all repeats in a window: n collisions give a rate to about 1/√n of it."""

COUNTS = 14  # steps of the collision count at which the energy is averaged over the repeats
MOST_SENTENCES = 2  # of a caption, on how α changes in each of several series
FLOOR_MATTERS = 0.1  # the floor is drawn where it is at least this share of the energy that is left

_FLOORS = {
    "L": " L keeps the energy L²/2I of a rotation.",
    "p": " The momentum p keeps the energy p²/(2Nm).",
}
"""The floor of the energy in a circle, and in a periodic box."""

_HAFF: dict[str, tuple[str, LineStyle]] = {
    "fitted": ("Haff's law 2α/(1 + αt), α fitted", "solid"),
    "theory": (f"Haff's law, α of {theory.FINITE}", "dashed"),
    "floor": ("Haff's law above the energy kept by {}", "dashdot"),
}
"""The forms of Haff's law: in the legend, and their dashes. What is fitted has the law's colour."""

_COMMON = {
    "theory": "Haff's law 1/(1 + αt), α of kinetic theory",
    "fitted": "Haff's law 1/(1 + αt), α fitted",
}
"""The one curve of Haff's law for several points, by where their α is from."""

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
        build.note_remaining(started, float(band.x[-1]))
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
    seen = ""
    if quantity == "kinetic_energy":
        asked = {"parameters": point.as_json(), "requested": len(build.repeats(point))}
        findings = Findings([decay.as_json() | asked for decay in fitted], [])
        seen = f"{findings.at_point(point_label(point.as_json()))}. "
    return build.figure(
        f"{seen}Each repeat is fitted; the law has the mean of their constants.",
        numbers=numbers,
        logarithmic=log,
        y_limits=(float(least) if lower else None, None),
    )


def decay_against_cor(build: FigureBuilder, source: bool = False) -> FigureData:
    """The decay constants of the energy against the CoR; with the source report's k if wanted.

    One series has a colour for each constant. Several, of runs side by side, have a colour each.
    """
    names, several = [group[0] for group in build.groups], len(build.groups) > 1
    caption, model = "", _model(source)
    if source:
        caption = (
            "Dashed: the source report's k = −2 ln(CoR)⟨v⟩/λ, ⟨v⟩ of complete repeats and "
            "λ = 1/(√2 n 2πr). "
        )
    for index, points in enumerate(build.groups):
        series = dict.fromkeys(LAWS, index) if several else _SERIES
        k_series = series["exponential"]
        records = [_constants(build, point, source) for point in points]
        cors = np.array([point.experiment.cor for point in points])
        column = {name: np.array([row[name] for row in records]) for name in records[0]}
        if source:
            name = "k by the source report"
            build.lines.append(Line(cors, column["report_k"], name, k_series, "dashed"))
        scene = build.start(points[0])
        if theories.theory_of(scene, quantities.HAFF_RATE, model):
            rates = enskog_rates(scene, starting_temperature(scene))
            # The logarithm has no value at CoR 0.
            grid = np.linspace(max(cors[0], 0.01), cors[-1], 100)
            if source:
                free_path, speed = rates.mean_free_path, rates.mean_speed
                law = [theory.source_decay_constant(float(e), free_path, speed) for e in grid]
                name = "k, mean free path after Enskog"
                build.lines.append(Line(grid, np.array(law), name, k_series, "dotted"))
                caption += "Dotted: ⟨v⟩ at the start and Enskog's λ = 1/(√2 n 4rχ). "
            expected = _haff_constants(points[0], scene, np.append(grid, cors), source)
            curve, theory_name = expected[: len(grid)], None if several else f"α, {model}"
            build.lines.append(Line(grid, curve, theory_name, series["haff"], "solid"))
            alpha, error = column["alpha"], column["alpha_error"]
            build.add_residuals(series["haff"], cors, alpha, error, expected[len(grid) :])
            if len(build.groups) <= MOST_SENTENCES:
                about = f"{build.label(points[0], names)}: " if several else ""
                build.beside_theory = True
                caption += f"{about}{_along_cor(records, expected[len(grid) :], model)}. "
        for law_name, law_model in LAWS.items():
            label: str | None = f"{law_model.symbol}, {law_model.label} fitted"
            if several:
                label = build.label(points[0], names) if law_name == "haff" else None
            filled, errors = not several or law_name == "haff", column[f"{law_model.key}_error"]
            build.lines.append(
                Points(cors, column[law_model.key], errors, label, series[law_name], filled)
            )
    if several:
        empty = np.empty(0)
        build.lines += [
            Points(empty, empty, None, f"{m.symbol}, {m.label} fitted", NEUTRAL, law == "haff")
            for law, m in LAWS.items()
        ]
        build.lines.append(legend_line(f"α, {model}", "solid"))
    title, walls = build.title, {described(point, "wall_cor") for point in names}
    if facts.hold(names[0].experiment, "walls") and len(walls) == 1:
        title = f"{title}: {walls.pop()}"
    early = sum(record["ended_early"] for record in build.records)
    return build.figure(caption.strip(), numbers={"ended_early": early}, title=title)


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
    return Trend("cor", rows, words={cor: f"CoR {cor:g}" for cor in cors}).sentence()


def _constants(build: FigureBuilder, point: Point, source: bool) -> dict[str, Any]:
    """The decay constants of a point with their errors, which become its record."""
    fitted = build.energy_decays(point)
    means = {LAWS[decay.law].key: decay.over_repeats for decay in fitted}
    constants = {key: (mean.value, mean.error) for key, mean in means.items()}
    if source:
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


def _haff_constants(point: Point, scene: Scene, cors: Array, source: bool) -> Array:
    """Haff's α of a point with these CoR by theory, from the state at the start; 1/s."""
    follows, rates = point.experiment.wall_cor is None, []
    for cor in cors.tolist():
        law = Constant(cor)
        gas = replace(scene, pair_law=law, wall_law=law if follows else scene.wall_law)
        rates.append(_rate(source)(gas))
    return np.array(rates)


class _LocalDecay(NamedTuple):
    """A point's local rates in windows of time, and the forms of Haff's law that it has.

    edges : (*w*, 2), s
    rates, errors : −d ln E/dt and its standard error; (*w*,), s⁻¹
    k : constant of the fitted exponential, s⁻¹
    alpha_error : standard error of the fitted α, s⁻¹
    floor : energy that the balls keep, over that at the start
    laws : α (s⁻¹) and floor of each form in ``_HAFF``
    """

    edges: Array
    rates: Array
    errors: Array
    k: float
    alpha_error: float
    floor: float
    laws: dict[str, tuple[float, float]]


def haff_time(build: FigureBuilder, source: bool = False) -> FigureData:
    """The local decay rate −d ln E/dt against time, with Haff's law and, of one point, a constant.

    Haff's laws of several points are one curve, with times in units of 1/α and rates of 2α.
    """
    decays = [_local_decay(build, point, source) for point in build.points]
    several, kept, ends = len(decays) > 1, _kept(build.points), []
    drawn = {law for decay in decays for law in decay.laws}
    common = "theory" if all("theory" in decay.laws for decay in decays) else "fitted"
    for index, (point, decay) in enumerate(zip(build.points, decays, strict=True)):
        alpha = decay.laws[common][0]
        inverse_time, inverse_rate = (alpha, 0.5 / alpha) if several else (1.0, 1.0)
        # A mean over a window is drawn where Haff's law has it.
        of_windows = _mean_haff_rates(decay.edges, alpha, 0.0)
        x = (2 / of_windows - 1 / alpha) * inverse_time
        fine = places(0.0, float(decay.edges[-1, 1]), 200)
        ends.append(fine[-1] * inverse_time)
        curves = {law: _haff_rate(fine, *decay.laws[law]) for law in decay.laws}
        for law, rate in curves.items():
            if law == "floor" or not several:
                text, style = _HAFF[law]
                owner = index if several else _SERIES["haff"] if law == "fitted" else NEUTRAL
                name = None if several else text.format(kept)
                line = Line(fine * inverse_time, rate * inverse_rate, name, owner, style)
                build.lines.append(line)
        if "floor" in curves:
            above = np.log(curves["floor"] / curves["theory"])
            owner = index if several else NEUTRAL
            build.panel.append(Line(fine * inverse_time, above, None, owner, _HAFF["floor"][1]))
        if not several:
            flat, name, owner = (
                np.array([decay.k] * 2),
                "one constant k, fitted",
                _SERIES["exponential"],
            )
            build.lines.append(Line(fine[[0, -1]], flat, name, owner, "dotted"))
        y, error, name = decay.rates * inverse_rate, decay.errors * inverse_rate, build.label(point)
        build.lines.append(Points(x, y, error, name or "simulation", index))
        means = {law: _mean_haff_rates(decay.edges, *decay.laws[law]) for law in decay.laws}
        record: dict[str, Any] = {"k": decay.k, "floor": decay.floor, "windows": len(decay.rates)}
        record |= {f"{law}_last_rate": float(mean[-1]) for law, mean in means.items()}
        record["alpha"] = decay.laws["fitted"][0], decay.alpha_error
        if "theory" in decay.laws:
            record["theory_alpha"] = decay.laws["theory"][0]
            build.add_residuals(index, x, decay.rates, decay.errors, means["theory"])
        first, *_, last = zip(decay.rates, decay.errors, strict=True)
        build.record(point, **record, first_rate=first, last_rate=last)
    labels: dict[str, Any] = {}
    if several:
        x, drawn = places(0.0, max(ends), 200), drawn & {"floor"}
        build.lines.insert(0, Line(x, 1 / (1 + x), _COMMON[common], NEUTRAL, "solid"))
        labels = {"x_label": "α t", "y_label": "−d ln E / dt / (2α)"}
        if drawn:
            text, style = _HAFF["floor"]
            build.lines.append(legend_line(text.format(kept), style))
    caption = f"Markers: means over {WINDOWS} windows of time."
    if any(record["windows"] < WINDOWS for record in build.records):
        caption += f" Windows with fewer than {LEAST_COLLISIONS} collisions are left out."
    return build.figure(caption + (_FLOORS[kept] if "floor" in drawn else ""), **labels)


def _local_decay(build: FigureBuilder, point: Point, source: bool) -> _LocalDecay:
    """The local decay of a point. Raises ``FigureError`` if it has too few collisions."""
    measurement = build.measurement(point)
    edges, rates, errors, left = _local_rates(measurement)
    build.end_of_all(measurement.time)
    means = {decay.law: decay.over_repeats for decay in build.energy_decays(point)}
    k, alpha = means["exponential"].value, means["haff"].value
    if not (math.isfinite(k) and math.isfinite(alpha)):
        raise FigureError("a point's repeats are too short to be fitted; run longer")
    floor = float(floors(measurement).mean())
    laws = {"fitted": (alpha, 0.0)}
    if theories.theory_of(measurement.scene, quantities.HAFF_RATE, _model(source)):
        expected = _rate(source)(measurement.scene)
        laws["theory"] = (expected, 0.0)
        if floor >= FLOOR_MATTERS * left:
            laws["floor"] = (expected, floor)
    return _LocalDecay(edges, rates, errors, k, means["haff"].error, floor, laws)


def _haff_rate(time: Array, alpha: float, floor: float) -> Array:
    """The decay rate −d ln E/dt where Haff's law holds for the energy above the floor, s⁻¹."""
    slower = 1 + alpha * time
    above = floor * slower**2 if floor else 0.0  # α may be so large that the square is no double
    return np.asarray(2 * alpha * (1 - floor) / (slower * (above + 1 - floor)))


def _mean_haff_rates(edges: Array, alpha: float, floor: float) -> Array:
    """The mean of this rate in windows of time with edges (*w*, 2); (*w*,), s⁻¹."""
    logs = np.log(floor + (1 - floor) * theory.haff_ratio(edges, alpha))
    return np.asarray((logs[:, 0] - logs[:, 1]) / np.ptp(edges, axis=1))


def _local_rates(measurement: Measurement) -> tuple[Array, Array, Array, float]:
    """Edges of windows (*w*, 2), −d ln of the mean energy/dt there, its standard error (s⁻¹).

    Last, the mean energy ratio in the end. Windows with too few collisions are left out.
    """
    end, curve = float(measurement.time.min()), measurement.curve
    if end == 0:
        raise FigureError("a repeat has no length; run longer")
    edges = np.linspace(0.0, end, WINDOWS + 1)
    energies = curve.at(edges, course(measurement, "kinetic_energy").value)
    if np.any(energies <= 0):
        raise FigureError("a repeat loses all of its energy, so it has no decay rate")
    calm = measurement.calm_events.sum(axis=1, keepdims=True)
    counts = np.minimum(np.rint(curve.at(edges, curve.events)), calm)
    collisions = np.diff(counts).sum(axis=0)
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


def event_decay(build: FigureBuilder) -> FigureData:
    """The energy against collisions, where kinetic theory has an exponential at any density."""
    floor_drawn = False
    for index, point in enumerate(build.points):
        measurement = build.measurement(point)
        events = measurement.calm_events.sum(axis=1)
        scene, shortest = measurement.scene, int(build.end_of_all(events, "collisions"))
        if shortest == 0:
            raise FigureError("a repeat has no collisions; run longer")
        counts = np.unique(np.linspace(0.0, shortest, COUNTS + 1).round())
        pairs, energies, expected, of_heat = _against_counts(measurement, counts)
        kept_shares = floors(measurement)[:, np.newaxis]
        x = collisions_per_ball(pairs, scene.number).mean(axis=0)
        if x[-1] == 0:
            raise FigureError("no ball has met another one; run longer")
        final = mean_and_error(energies[:, -1])
        build.add_points(index, build.label(point), x, energies)
        floor, alone = float(kept_shares.mean()), expected.mean(axis=0)
        record = {"collisions_per_ball": x[-1], "floor": floor}
        known = theories.theory_of(scene, quantities.ENERGY_LEFT, theories.BY_COUNT)
        if known and not build.too_thin(scene):
            record["theory"] = alone[-1]
            build.lines.append(Line(x, alone, None, index, "solid"))
            nearest = alone
            if math.isfinite(floor):
                nearest = above = (kept_shares + (1 - kept_shares) * of_heat).mean(axis=0)
                record["theory_above_floor"] = above[-1]
                if floor >= FLOOR_MATTERS * final[0]:
                    build.lines.append(Line(x, above, None, index, "dashed"))
                    floor_drawn = True
            mean, error = energies.mean(axis=0), standard_errors(energies)
            build.add_residuals(index, x[1:], mean[1:], error[1:], nearest[1:])  # E(0) is exact
        build.record(point, **record, final_ratio=final)
    kept, caption = _kept(build.points), ""
    if any("theory" in record for record in build.records):
        build.lines.append(legend_line("expected from the counted collisions", "solid"))
        shared = "(N + ½)" if kept == "L" else "(N − ½)"
        caption += f"Lines: a collision takes (1 − e²)E/{shared}."
    if floor_drawn:
        build.lines.append(legend_line(f"the same above the energy kept by {kept}", "dashed"))
        caption += f"{_FLOORS[kept][:-1]}, counted below."
    return build.figure(caption)


def _against_counts(measurement: Measurement, counts: Array) -> tuple[Array, Array, Array, Array]:
    """Collisions between balls (*repeats*, *n*) among these; energy ratios; those expected.

    Last, the ratio of the energy above the kept one: in a circle a component less shares it.
    """
    scene, curve = measurement.scene, measurement.curve
    energy = course(measurement, "kinetic_energy").value
    ratio, wall, pairs = (
        interpolated(counts, curve.events, values)
        for values in (energy, curve.wall_events, curve.pair_events)
    )
    shared = components(scene)
    free, above = (
        theory.energy_ratio_by_events(
            number, scene.restitution, pairs, scene.wall_restitution, wall
        )
        for number in (shared, shared - facts.hold(scene, "walls"))
    )
    return pairs, ratio, free, above


def _kept(points: Sequence[Point]) -> str:
    """The letter of what the balls keep: angular momentum in a circle, momentum without walls."""
    return "L" if facts.hold(points[0].experiment, "walls") else "p"
