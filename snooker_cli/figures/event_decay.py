"""The energy against the number of collisions, beside theory."""

import math
from collections.abc import Iterator

import numpy as np

from snooker_cli import facts, theory, two_temperatures
from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.decay import course
from snooker_cli.analysis.gas import components, cooling_spins, floors
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import collisions_per_ball
from snooker_cli.analysis.time_series import interpolated
from snooker_cli.errors import FigureError
from snooker_cli.figures.cooling import FLOOR_MATTERS, FLOORS, kept_letter
from snooker_cli.figures.declared_result import agreement
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    SECOND,
    Array,
    FigureData,
    Layer,
    Line,
    LineStyle,
    Points,
    legend_line,
    mean_of_remaining,
)
from snooker_cli.formatting import percent

COUNTS = 14  # steps of the collision count at which the energy is averaged over the repeats

TOO_FAR = 100.0  # from this many times the measured energy on, a theory of it says nothing

_THEORIES: dict[str, tuple[str, LineStyle]] = {
    "theory": ("expected from the counted collisions", BY_THEORY),
    "theory_above_floor": ("the same with the energy that {} keeps", SECOND),
    "mean_field": (f"theory, {two_temperatures.MEAN_FIELD}", BY_THEORY),
}
"""Theories of the energy left: in the legend, and their dashes."""


def event_decay(build: FigureBuilder) -> FigureData:
    """The energy against collisions, where kinetic theory has an exponential at any density.

    Up to the median number of collisions; of the reproduction, up to that of the shortest repeat.
    A curve of theory ends where the energy is ``TOO_FAR`` from it.
    """
    kept, drawn, ends = kept_letter(build.points), dict[str, None](), False
    ends_beside = list[Layer]()
    for index, point in enumerate(build.points):
        measurement = build.measurement(point)
        scene, events = measurement.scene, measurement.calm_events.sum(axis=1)
        last = int(np.min(events) if build.source else np.median(events))
        if last == 0:
            raise FigureError("a repeat has no collisions; run longer")
        counts = np.unique(np.linspace(0.0, last, COUNTS + 1).round())
        energies, pairs = (
            _at_counts(measurement, counts, values)
            for values in (
                course(measurement, "kinetic_energy").value,
                measurement.curve.pair_events,
            )
        )
        mean, error = mean_of_remaining(energies)
        x = collisions_per_ball(mean_of_remaining(pairs)[0], scene.number)
        if x[-1] == 0:
            raise FigureError("no ball has met another one; run longer")
        build.note_remaining(events, last)
        name = build.label(point) or "simulation"
        build.lines.append(Points(x, mean, error, name, index))
        floor, nearest = float(floors(measurement).mean()), np.full(len(x), math.nan)
        record = {"collisions_per_ball": x[-1], "floor": floor}
        for name, nearest in _expected(build, measurement, counts).items():
            if not build.source:
                nearest[np.abs(np.log(nearest / mean)) > math.log(TOO_FAR)] = math.nan
            known = np.isfinite(nearest)
            record[name] = nearest[-1] if known[-1] else None
            if name != "theory_above_floor" or floor >= FLOOR_MATTERS * mean[-1]:
                style, drawn[name], ends = _THEORIES[name][1], None, ends or not known.all()
                build.lines.append(Line(x[known], nearest[known], None, index, style))
        # E(0) is exact.
        build.add_residuals(index, x[1:], mean[1:], error[1:], nearest[1:])
        build.record(point, **record, final_ratio=(mean[-1], error[-1]))
        if math.isfinite(nearest[-1]):
            share, ratio = error[-1:] / mean[-1:], np.log(mean[-1:] / nearest[-1:])
            ends_beside.append(Points(x[-1:], ratio, share, None, index))
    build.lines += [
        legend_line(_THEORIES[name][0].format(kept), _THEORIES[name][1]) for name in drawn
    ]
    if "theory_above_floor" in drawn:
        shares = [record["floor"] / record["final_ratio"] for record in build.records]
        most = min(1.0, float(max(shares)))
        motion = "the rotation" if kept == "L" else "the drift"
        build.headline = f"{motion} has up to {percent(most)} of what is left"
    elif said := agreement(ends_beside, build.fewest_repeats):
        build.headline = f"{said} at the end"
    caption = ""
    if "theory" in drawn:
        shared = "(N + ½)" if kept == "L" else "(N − ½)"
        caption += f"A collision takes (1 − e²)E/{shared} by theory."
    if "theory_above_floor" in drawn:
        caption += f"{FLOORS[kept]} The panel is over theory with it."
    if ends:
        caption += f" A curve of theory ends where the energy is {TOO_FAR:g} times as large."
    return build.figure(caption)


def _expected(build: FigureBuilder, measurement: Measurement, counts: Array) -> dict[str, Array]:
    """The energy left after numbers of collisions by each of ``_THEORIES`` that holds; (*n*,)."""
    scene, known = measurement.scene, dict[str, Array]()
    if build.too_thin(scene):
        return known
    if theories.theory_of(scene, quantities.ENERGY_LEFT, theories.BY_COUNT):
        free, above = _left_by_counts(measurement, counts)
        shares = floors(measurement)[:, np.newaxis]
        known["theory"] = free
        build.cite(quantities.ENERGY_LEFT, theories.BY_COUNT)
        if np.isfinite(shares).all():
            known["theory_above_floor"] = shares + (1 - shares) * above
    elif theories.theory_of(scene, quantities.SPIN_RATIO, two_temperatures.MEAN_FIELD):
        build.cite(quantities.SPIN_RATIO, two_temperatures.MEAN_FIELD)
        known["mean_field"] = _at_counts(measurement, counts, _rough_energies(measurement))
    return {name: mean_of_remaining(rows)[0] for name, rows in known.items()}


def _rough_energies(measurement: Measurement) -> Array:
    """The energy of rough balls over that at the start by theory, at the rows of the curve.

    The common motion keeps its energy.
    """
    moving, turning = cooling_spins(measurement)
    drift, first = measurement.drift_energy[:, np.newaxis], measurement.curve.kinetic_energy[:, :1]
    energy = drift + (first - drift) * moving / moving[:, :1]
    energy += measurement.scene.number * turning / 2
    return np.asarray(energy / energy[:, :1])


def _left_by_counts(measurement: Measurement, counts: Array) -> Iterator[Array]:
    """Expected energy ratios, (*repeats*, *n*), and those of the energy above the kept one.

    In a circle a component less shares it.
    """
    scene, curve = measurement.scene, measurement.curve
    wall, pairs = (
        _at_counts(measurement, counts, values) for values in (curve.wall_events, curve.pair_events)
    )
    shared, cors = components(scene), (scene.restitution, scene.wall_restitution)
    for number in (shared, shared - facts.hold(scene, "walls")):
        yield theory.energy_ratio_by_events(number, cors[0], pairs, cors[1], wall)


def _at_counts(measurement: Measurement, counts: Array, values: Array) -> Array:
    """Rows of the curve at numbers of collisions, (*repeats*, *n*); nan after a repeat's last."""
    rows = interpolated(counts, measurement.curve.events, values)
    ends = measurement.calm_events.sum(axis=1, keepdims=True)
    return np.where(counts <= ends, rows, math.nan)
