"""Cooling beyond one exponential: over many CoR, with time, and with collisions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import theory
from snooker_cli.decay import Law, curve, decays, fit_curve
from snooker_cli.fit import ensemble
from snooker_cli.gallery.picture import NEUTRAL, Array, Layer, Line, Picture, PictureError, Points
from snooker_cli.gallery.selection import (
    Selection,
    along,
    equal_balls,
    evenly,
    inelastic_points,
    label,
    one_repeat,
    repeats,
    require_motion,
    setting,
)
from snooker_cli.gallery.statistics import mean_and_error
from snooker_cli.observables import energy_ratio, series
from snooker_cli.words import short, with_error

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

MOST_COOLING = 4
"""Series of markers and two laws each; more cannot be told apart."""

WINDOWS = 14
"""Windows of time in which the local decay rate is taken."""

COUNTS = 14
"""Steps of the collision count at which the energy is averaged over the repeats."""


def decay_against_cor(run: Run, selection: Selection) -> Picture:
    """The decay constants of the energy against the CoR, beside the report's and kinetic theory."""
    (points,) = along(inelastic_points(run, selection), "cor")
    scene = one_repeat(run, points[0], selection).start
    require_motion(scene)
    records = [_decay(run, point, selection) for point in points]
    cors = np.array([point.experiment.cor for point in points])
    layers = _laws(scene, points)
    for index, (name, text) in enumerate(
        (("k", "k, exponential fitted"), ("alpha", "α, Haff's law fitted"))
    ):
        values = np.array([each[name] for each in records])
        errors = np.array([each[f"{name}_error"] for each in records])
        good = np.isfinite(values)
        bars = errors[good] if np.all(np.isfinite(errors[good])) else None
        layers.append(Points(cors[good], values[good], None, bars, text, index))
    early = sum(each["ended_early"] for each in records)
    ends = [
        f"{symbol} from {with_error(records[0][name], records[0][f'{name}_error'])} to "
        + with_error(records[-1][name], records[-1][f"{name}_error"])
        for symbol, name in (("k", "k"), ("α", "alpha"))
    ]
    return Picture(
        kind="decay-against-cor",
        title="Decay constants of the energy",
        x_label="coefficient of restitution",
        y_label="decay constant (s⁻¹)",
        layers=tuple(layers),
        caption=f"Between CoR {cors[0]:g} and {cors[-1]:g} the fits give {' and '.join(ends)} s⁻¹, "
        "means and standard errors over the repeats"
        + (f", {early} of which ended early" if early else "")
        + ". Lines: the report's formula and kinetic theory, both with Enskog's collision rate at "
        "the start. " + setting(run, points, selection),
        numbers={"points": records, "ended_early": early},
        y_log=True,
    )


def haff_time(run: Run, selection: Selection) -> Picture:
    """The local decay rate -d ln E/dt against time, beside Haff's and the report's constant."""
    points = evenly(inelastic_points(run, selection), MOST_COOLING)
    layers: list[Layer] = []
    records, said = [], []
    for index, point in enumerate(points):
        traces = list(repeats(run, point, selection))
        require_motion(traces[0].start)
        middles, rates, errors = _local_rates(traces)
        curves = [curve(trace, "kinetic_energy") for trace in traces]
        k = ensemble(fit_curve(each, "exponential") for each in curves).mean
        alpha = ensemble(fit_curve(each, "haff") for each in curves).mean
        if not (math.isfinite(k) and math.isfinite(alpha)):
            raise PictureError("a point's repeats are too short to be fitted; run longer")
        fine = np.linspace(0.0, middles[-1] + middles[0], 200)
        name = label(point, points)
        layers += [
            Line(fine, 2 * alpha / (1 + alpha * fine), None, index, "solid"),
            Line(fine[[0, -1]], np.array([k, k]), None, index, "dotted"),
            Points(middles, rates, None, errors, name or "simulation", index),
        ]
        records.append(
            {
                "parameters": point.as_json(),
                "k": k,
                "alpha": alpha,
                "first_rate": float(rates[0]),
                "last_rate": float(rates[-1]),
                "repeats": len(traces),
            }
        )
        bars = np.full(WINDOWS, math.nan) if errors is None else errors
        ends = [with_error(rates[k], bars[k]) for k in (0, -1)]
        said.append(f"from {ends[0]} to {ends[1]} s⁻¹" + (f" ({name})" if name else ""))
    return Picture(
        kind="haff-time",
        title="The decay rate falls with time",
        x_label="time (s)",
        y_label="−d ln E / dt (s⁻¹)",
        layers=(
            *layers,
            _key("Haff's law, 2α/(1 + αt)", "solid"),
            _key("one constant k, as in the report", "dotted"),
        ),
        caption=f"From the first to the last window the local rate goes {'; '.join(said)}: the "
        "report's τ, inverse to it, is no constant. Mean energy of the repeats in "
        f"{WINDOWS} windows up to the end of the shortest, with standard errors. "
        + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def event_decay(run: Run, selection: Selection) -> Picture:
    """The energy against collisions, where kinetic theory has an exponential at any density."""
    points = evenly(inelastic_points(run, selection))
    layers: list[Layer] = []
    records, said = [], []
    for index, point in enumerate(points):
        traces = list(repeats(run, point, selection))
        require_motion(traces[0].start)
        number = traces[0].start.number
        counts = np.linspace(0, min(trace.collisions for trace in traces), COUNTS + 1)
        rows = np.array([_against_counts(trace, counts) for trace in traces])
        found, expected = rows[:, 0], rows[:, 1].mean(axis=0)
        spread = found.std(axis=0, ddof=1) / math.sqrt(len(rows)) if len(rows) > 1 else None
        name = label(point, points)
        layers += [
            Line(counts / number, expected, None, index, "solid"),
            Points(counts / number, found.mean(axis=0), None, spread, name or "simulation", index),
        ]
        final, error = mean_and_error(found[:, -1])
        records.append(
            {
                "parameters": point.as_json(),
                "collisions_per_ball": float(counts[-1] / number),
                "final_ratio": final,
                "final_ratio_error": error,
                "theory": float(expected[-1]),
                "repeats": len(rows),
            }
        )
        text = f"{with_error(final, error)} where theory has {short(expected[-1])}"
        said.append(text + (f" ({name})" if name else ""))
    return Picture(
        kind="event-decay",
        title="Energy against collisions",
        x_label="collisions / number of balls",
        y_label="E / E(0)",
        layers=(*layers, _key("expected from the counted collisions", "solid")),
        caption=f"In the end E/E(0) is {'; '.join(said)}. Markers: mean of the repeats; lines: "
        "each of c collisions between balls takes (1 − e²)E/N and each of c_w at the wall "
        "(1 − e_w²)E/N. " + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_log=True,
    )


def _decay(run: Run, point: Point, selection: Selection) -> dict[str, Any]:
    """The decay constants of a point's energy over its repeats, as JSON."""
    found = {each.law: each for each in decays(repeats(run, point, selection), ("kinetic_energy",))}
    names: dict[Law, str] = {"exponential": "k", "haff": "alpha"}
    record: dict[str, Any] = {"parameters": point.as_json()}
    for law, name in names.items():
        over = found[law].over_repeats
        record |= {name: over.mean, f"{name}_error": over.standard_error, "repeats": over.count}
    return record | {"ended_early": found["haff"].short}


def _laws(scene: Scene, points: Sequence[Point]) -> list[Layer]:
    """The report's k and kinetic theory's α over the points' CoR; none for unequal balls."""
    cors = [point.experiment.cor for point in points]
    free = points[0].experiment.wall_cor is None
    # The report's logarithm has no value at CoR 0.
    grid = np.linspace(max(cors[0], 0.01), cors[-1], 100)
    rates = _collision_rates(scene)
    if rates is None:
        return []
    path, speed, pair_rate, wall_rate = rates
    report = [theory.report_decay_constant(float(e), path, speed) for e in grid]
    wall = points[0].experiment.effective_wall_cor
    alpha = [
        theory.haff_rate(
            theory.cooling_rate(float(e), pair_rate, float(e) if free else wall, wall_rate)
        )
        for e in grid
    ]
    return [
        Line(grid, np.array(report), "report's k = −2 ln e / τ", 0, "dashed"),
        Line(grid, np.array(alpha), "α of kinetic theory", 1, "solid"),
    ]


def _collision_rates(scene: Scene) -> tuple[float, float, float, float] | None:
    """Enskog's mean free path (m), mean speed (m/s), pair and wall rates of a ball (1/s) at t = 0.

    None where there is no theory: for unequal balls, or too many for a fluid.
    """
    if not equal_balls(scene):
        return None
    number, radius, outer = scene.number, float(scene.radii[0]), scene.container_radius
    mass, warm = float(scene.masses[0]), scene.kinetic_energy / scene.number
    density = theory.number_density(number, outer)
    contact = float(theory.contact_value(theory.packing_fraction(number, radius, outer)))
    try:
        pressure = theory.circle_state(number, warm, radius, outer).pressure
    except ValueError:
        return None
    return (
        theory.enskog_mean_free_path(density, radius, contact),
        theory.fixed_energy_mean_speed(number, warm, mass),
        theory.ball_ball_rate(density, radius, warm, contact, mass),
        theory.wall_rate_from_pressure(number, pressure, warm, outer, mass),
    )


def _local_rates(traces: Sequence[Trace]) -> tuple[Array, Array, Array | None]:
    """Middles of windows (s), -d ln of the mean energy/dt and its standard error there (1/s)."""
    end = min(trace.stop.time for trace in traces)
    if end == 0:
        raise PictureError("a repeat has no length; run longer")
    edges = np.linspace(0.0, end, WINDOWS + 1)
    table = []
    for trace in traces:
        found = series(trace)
        rows = np.searchsorted(found.time, edges, side="right") - 1
        table.append(energy_ratio(found)[rows])
    energies = np.array(table)
    if np.any(energies <= 0):
        raise PictureError("a repeat loses all of its energy, so that it has no decay rate")
    width = end / WINDOWS
    rates = 0.0 - np.diff(np.log(energies.mean(axis=0))) / width  # never −0.0
    errors = None
    if len(traces) > 1:
        # Each repeat's own rate spreads as much around the mean.
        own = -np.diff(np.log(energies), axis=1) / width
        errors = own.std(axis=0, ddof=1) / math.sqrt(len(traces))
    return (edges[:-1] + edges[1:]) / 2, rates, errors


def _against_counts(trace: Trace, counts: Array) -> tuple[Array, Array]:
    """A repeat's energy ratio after so many collisions, and what theory makes of them."""
    found, scene = series(trace), trace.start
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


def _key(text: str, style: Any) -> Line:
    """A legend's entry for a style that all series share."""
    return Line(np.empty(0), np.empty(0), text, NEUTRAL, style)
