"""Energy, momentum and mean pressure over time."""

from dataclasses import replace

import numpy as np

from snooker_cli.analysis import observables, predictions
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder, require_motion
from snooker_cli.figures.figure_data import (
    Curve,
    FigureData,
    Reference,
    at_common_times,
    more_than_a_decade,
)
from snooker_cli.figures.selection import elastic
from snooker_cli.formatting import short, with_error
from snooker_cli.scene import EPSILON
from snooker_cli.trace import Trace

MOMENTUM_UNIT = 1e-15
"""The unit of the momentum's deviation: about four roundings of a number near one."""

MARGIN = 0.1  # margin above settled pressures, as a share of them


def energy(build: FigureBuilder) -> FigureData:
    """Kinetic energy of balls and container over that at the start."""
    courses: list[list[Curve]] = []
    for point in build.points:
        courses.append([])
        for trace in build.traces(point):
            require_motion(trace.start)
            columns = observables.series(trace)
            courses[-1].append((columns.time, observables.energy_ratio(columns)))
    log = more_than_a_decade(ratios for curves in courses for _, ratios in curves)
    for index, (point, curves) in enumerate(zip(build.points, courses, strict=True)):
        build.add_course(index, point, curves, logarithmic=log)
        build.record(
            point,
            elastic=elastic(point),
            final_ratio=float(curves[0][1][-1]),
            largest_rise=max(float(np.max(np.diff(ratio), initial=0.0)) for _, ratio in curves),
            largest_deviation=max(float(np.max(np.abs(ratio - 1))) for _, ratio in curves),
        )
    sentences = []
    if kept := [record["largest_deviation"] for record in build.records if record["elastic"]]:
        sentences.append(f"Elastic collisions keep the energy to {short(max(kept), 2)} of it.")
    if rises := [record["largest_rise"] for record in build.records if not record["elastic"]]:
        risen = f"An inelastic collision raises it by {short(max(rises), 2)} of E(0) at most."
        sentences.append(risen if max(rises) else "No inelastic collision raises the energy.")
    return build.figure(" ".join(sentences), logarithmic=log)


def momentum_component(name: str, build: FigureBuilder) -> FigureData:
    """A component of the total momentum over that at the start, and how far this is from 1."""
    deviation = replace(build, lines=[], bands=[])
    for index, point in enumerate(build.points):
        totals = [_momentum(trace, name) for trace in build.traces(point)]
        ratios = [(time, total / total[0]) for time, total in totals]
        curves = [(time, (ratio - 1) / MOMENTUM_UNIT) for time, ratio in ratios]
        build.add_course(index, point, ratios)
        deviation.add_course(index, point, curves, style="solid")  # dashes are lost in the noise
        build.record(
            point,
            momentum_at_start=float(totals[0][1][0]),
            largest_deviation=max(float(np.max(np.abs(ratio - 1))) for _, ratio in ratios),
            states=max(len(time) for time, _ in totals),
        )
    worst = max(record["largest_deviation"] for record in build.records)
    return build.figure(
        f"The total momentum stays p{name}(0) to within {short(worst, 2)} of it, "
        f"{short(worst / EPSILON, 2)} roundings, at "
        f"{max(record['states'] for record in build.records)} times.",
        numbers={"largest_deviation": worst},
        inset=(*deviation.bands, Reference("y", 0.0), *deviation.lines),
    )


def pressure(build: FigureBuilder) -> FigureData:
    """The mean pressure since the start."""
    expected: list[float] = []
    for scene in (build.start(point) for point in build.points if elastic(point)):
        # Without walls balls meet at a temperature of their own.
        met = observables.meeting_temperature(scene.kinetic_energy, scene)
        drift = scene.number * (scene.kinetic_energy / scene.number - met)
        state = predictions.scene_state(scene, met)
        if state and (value := state.pressure + drift / scene.container.area) not in expected:
            name = None if expected else "hard-disk theory, CoR 1"
            build.lines.append(Reference("y", value, name, "dotted"))
            expected.append(value)
    top = max(expected, default=0.0)
    for index, point in enumerate(build.points):
        curves = [_pressure(trace) for trace in build.traces(point)]
        build.add_course(index, point, curves, steps=False)
        top = max([top, *(observables.settled_top(*curve) for curve in curves)])
        times, rows = at_common_times(curves)
        final = observables.mean_and_error(rows[:, -1])
        build.record(point, with_error(*final, "Pa·m"), time=float(times[-1]), pressure=final)
    if not any(record["pressure"] for record in build.records):
        raise FigureError("nothing hits the wall, so there is no pressure; run longer")
    return build.figure(
        f"Mean at the end of the shortest repeat: {build.results_text}.",
        numbers={"theory": expected},
        y_limits=(0, (1 + MARGIN) * top),
    )


def _momentum(trace: Trace, name: str) -> Curve:
    """Times (s) and one component of the total momentum, kg m/s. Raises ``FigureError``."""
    scene, component = trace.start, "xy".index(name)
    if scene.container.has_wall and not scene.free:
        raise FigureError("fixed walls take momentum; give a circle a finite container.mass")
    states = observables.at_collisions(trace)
    total = observables.momentum(states.velocities, states.container_velocities, scene).T[component]
    parts = np.abs(scene.masses * scene.velocities[:, component])
    if abs(total[0]) <= scene.number * EPSILON * float(np.sum(parts)):
        raise FigureError(f"the momentum in {name} is zero at the start, so it has no ratio to it")
    return states.time, total


def _pressure(trace: Trace) -> Curve:
    """Times (s) and mean pressures since the start (Pa·m): at first 0, without walls the ideal."""
    scene = trace.start
    time, values = observables.cumulative_pressure(trace, observables.series(trace))
    if not len(time):
        raise FigureError("nothing happens after the start of a repeat, so it has no pressure")
    first = 0.0 if scene.container.has_wall else scene.kinetic_energy / scene.container.area
    return np.append(0.0, time), np.append(first, values)
