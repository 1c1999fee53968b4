"""The energy and the momentum over time; what collisions keep changes by rounding alone."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from snooker_cli import facts
from snooker_cli.analysis import observables
from snooker_cli.analysis.decay import course
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.declared_result import Result
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    NEUTRAL,
    Course,
    FigureData,
    Layer,
    Line,
    Panel,
    Reference,
    courses,
    more_than_a_decade,
)
from snooker_cli.figures.series import elastic, gas_type_of
from snooker_cli.formatting import least_to_most, percent, short
from snooker_cli.scene import EPSILON
from snooker_cli.trace import Trace

UNIT = 1e-16
"""The unit of changes by rounding: a rounding of a number near one is at most about that."""

SOURCE_UNIT = 1e-15  # the same in the reproduction
MORE = 1.05  # the axis of energies over their highest value

ENERGY_CHANGE = Result("change of the energy", "largest_deviation")
CHANGE_LABEL = "ΔE / E(0) (10⁻¹⁶)"
MOMENTUM_LABEL = "|Δp| / Σm|v| (10⁻¹⁶)"
KEPT = "keeps_momentum", "moves", "events"  # of a gas whose momentum is shown
ROUNDING = "Expected is the rounding of sums over the balls and of collisions."


def energy(build: FigureBuilder) -> FigureData:
    """Kinetic energy of balls and container over that at the start, or its change if it is kept.

    Beside points that lose energy, the change of the others is in a panel. The reproduction has
    energies alone.
    """
    changes, log, means = build.for_panel(), False, list[Course]()
    kept, top = [], 1.0
    for index, point in enumerate(build.points):
        falling = course(build.measurement(point), "kinetic_energy")
        curves = courses(falling.time, falling.value)
        if elastic(point) and not build.source:
            kept.append(point)
            of_rounding = [(time, (ratio - 1) / UNIT) for time, ratio in curves]
            times, rows = changes.add_mean_course(index, point, of_rounding)
            rows = 1 + UNIT * rows
        else:
            times, rows = build.add_mean_course(index, point, curves)
            log |= more_than_a_decade(ratio for _, ratio in curves)
            top = max(top, *(float(ratio.max()) for _, ratio in curves))
        means.append((times, rows.mean(axis=0)))
        build.record(
            point,
            elastic=elastic(point),
            final_ratio=mean_and_error(rows[:, -1]),
            time=float(times[-1]),
            largest_deviation=max(float(np.max(np.abs(ratio - 1))) for _, ratio in curves),
        )
    if not all(record["elastic"] for record in build.records):
        warm = any(gas_type_of(point) == "warm" for point in build.points)
        build.headline = _left(means, warm=warm)
    axes: dict[str, Any] = {"logarithmic": log}
    if not log:
        axes["y_limits"] = 0.0, MORE * top
    if not build.source:
        axes |= _in_decades(build.lines)
    if not kept:
        return build.figure(**axes)
    rounding = _rounding(build, kept, True)
    if len(kept) == len(build.points):
        build.lines, build.bands, build.singles = changes.lines, changes.bands, changes.singles
        build.lines += rounding
        build.brief, build.fewest, build.result = changes.brief, changes.fewest, ENERGY_CHANGE
        largest = max(record["largest_deviation"] for record in build.records)
        build.headline = f"at most {short(largest, 1)} of it"
        build.shows = "The change of the total kinetic energy, over the energy at the start."
        build.fields = {**build.fields, "title": "Change of the kinetic energy"}
        if not all(facts.hold(point.config, *KEPT) for point in kept):
            return build.figure(ROUNDING, y_label=CHANGE_LABEL)
        build.fields = {**build.fields, "title": "Changes of the energy and the momentum"}
        below = f"Below: the change of the momentum of all that moves, over Σm|v|. {ROUNDING}"
        return build.figure(below, y_label=CHANGE_LABEL, panels=(_momentum(build),))
    for line in changes.lines:
        if isinstance(line, Line) and line.label:
            build.lines.append(replace(line, y=np.ones_like(line.x)))
    changes.lines += rounding
    return build.figure(
        f"Below: the change of the energy of elastic balls. {ROUNDING}",
        panels=(changes.as_panel(CHANGE_LABEL),),
        **axes,
    )


def _left(means: Sequence[Course], *, warm: bool) -> str:
    """How much of the energy is left when the first of the points ends, in a few words.

    warm : whether walls give some, so that it may be more
    """
    end = min(float(times[-1]) for times, _ in means)
    left = [float(np.interp(end, *mean)) for mean in means]
    if warm:
        return f"{least_to_most(left, partial(short, digits=2))} of E(0) after {short(end)} s"
    return f"{least_to_most(left, percent)} is left after {short(end)} s"


DECADES = 100.0  # from this factor on, a falling energy is a power of the time
BEGUN = 0.01  # share of the energy that is lost where a logarithmic time begins


def _in_decades(lines: Sequence[Layer]) -> dict[str, Any]:
    """A logarithmic time for energies that fall by two decades: Haff's law is then a line."""
    curves = [line for line in lines if isinstance(line, Line)]
    lowest = min((float(np.nanmin(line.y)) for line in curves), default=1.0)
    if not 0 < lowest < 1 / DECADES:
        return {}
    begun = [line.x[line.y < 1 - BEGUN] for line in curves]
    first = min(float(x[0]) for x in begun if len(x))
    return {"x_log": True, "x_limits": (first, None)}


def _momentum(build: FigureBuilder) -> Panel:
    """How far the total momentum is from that at the start, over Σm|v| there."""
    panel = build.for_panel()
    for index, (point, record) in enumerate(zip(build.points, build.records, strict=True)):
        curves = [_momentum_change(trace) for trace in build.traces(point)]
        panel.add_mean_course(index, point, [(time, change / UNIT) for time, change in curves])
        record["momentum_deviation"] = max(float(change.max()) for _, change in curves)
    panel.lines.append(_rounding(build, build.points, False)[0])
    return panel.as_panel(MOMENTUM_LABEL)


def _momentum_change(trace: Trace) -> Course:
    """Times (s) and |p − p(0)|/Σm|v|."""
    total, scene = _momenta(trace), trace.start
    parts = scene.masses * np.hypot(*scene.velocities.T)
    change = np.hypot(*(total[1] - total[1][0]).T)
    return total[0], change / float(np.sum(parts))


def _momenta(trace: Trace) -> Course:
    """Times (s) and total momenta (*t*, 2), kg m/s."""
    states = observables.at_collisions(trace)
    velocities = states.velocities, states.container_velocity
    return states.time, observables.momentum(*velocities, trace.start)


def _rounding(build: FigureBuilder, points: Sequence[Point], of_energy: bool) -> list[Layer]:
    """The expected rounding over time, above and below zero; that of the point with the largest.

    Each rounding is at most ε/2 of its number, and they add up as in a random walk. The parts of a
    sum over N balls grow up to the energy, (N/3)^½ of it in the mean square, and as √k m|v| for the
    momentum of k balls. A collision rounds four components of velocities.
    """
    rows = []
    for point in points:
        curve, number = build.measurement(point).curve, build.start(point).number
        time = np.linspace(0.0, float(np.median(curve.time[:, -1])), 100)
        collisions = curve.at(time, curve.events).mean(axis=0)
        of_sum, each = (number / 3, 4) if of_energy else (0.5, 2)
        size = EPSILON / 2 * np.sqrt(of_sum + each * collisions / number**2)
        rows.append((time, size / UNIT))
    time, size = max(rows, key=lambda row: float(row[1][-1]))
    return [Line(time, sign * size, "expected rounding", NEUTRAL, BY_THEORY) for sign in (1, -1)]


def momentum_component(name: str, build: FigureBuilder) -> FigureData:
    """A component of the total momentum over that at the start, and how far this is from 1."""
    deviation = build.for_panel()
    for index, point in enumerate(build.points):
        totals = [_component(trace, name) for trace in build.traces(point)]
        ratios = [(time, total / total[0]) for time, total in totals]
        curves = [(time, (ratio - 1) / SOURCE_UNIT) for time, ratio in ratios]
        build.add_mean_course(index, point, ratios)
        deviation.add_mean_course(index, point, curves)
        build.record(
            point,
            momentum_at_start=float(totals[0][1][0]),
            largest_deviation=max(float(np.max(np.abs(ratio - 1))) for _, ratio in ratios),
            states=max(len(time) for time, _ in totals),
        )
    worst = max(record["largest_deviation"] for record in build.records)
    below = deviation.as_panel("", Reference("y", 0.0)).layers
    return build.figure(
        f"Below: how far the total momentum is from p{name}(0).",
        numbers={"largest_deviation": worst},
        panel=below,
    )


def _component(trace: Trace, name: str) -> Course:
    """Times (s) and one component of the total momentum, kg m/s. Raises ``FigureError``."""
    scene, component = trace.start, "xy".index(name)
    time, total = _momenta(trace)
    parts = np.abs(scene.masses * scene.velocities[:, component])
    if abs(total[0, component]) <= scene.number * EPSILON * float(np.sum(parts)):
        raise FigureError(f"the momentum in {name} is zero at the start, so it has no ratio to it")
    return time, np.asarray(total[:, component])
