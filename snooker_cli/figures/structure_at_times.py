"""What a gas looks like at several times: its structure factor and the sizes of its clusters."""

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from snooker_cli.analysis import quantities, structure, theories
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.analysis.structure import Observable, over_time
from snooker_cli.config import Point
from snooker_cli.figures.distributions import LAST, MOST_STATES, second_half, unit_of_distance
from snooker_cli.figures.distributions import times_of_parts as times_of
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    EXTRAPOLATED,
    SECOND,
    Array,
    FigureData,
    Line,
    Reference,
    legend_line,
)
from snooker_cli.figures.series import gas_type_of
from snooker_cli.figures.time_courses import check_clusters
from snooker_cli.formatting import percent, short
from snooker_cli.scene import Scene

MOMENTS = 0.0, 0.01, 0.1, LAST
"""Parts of the time of a gas that cools, at which it is shown."""

SIZES = 40  # places of a curve
MOST_WAVES = 300_000_000  # balls times states times waves of a figure, which take seconds
MOST_BALLS = 5_000_000  # balls times states of a figure, which take seconds


class AtTimes(NamedTuple):
    """An observable of the repeats of a point at some times.

    labels, rows : for each time, or of all that count together; (*repeats*, ...) each
    """

    labels: list[str | None]
    rows: list[Array]


def at_times(
    build: FigureBuilder,
    point: Point,
    observable: Observable,
    most: int,
    *,
    each: int = 0,
    moments: Sequence[float] = MOMENTS,
) -> AtTimes:
    """An observable at parts of the time of a gas that cools, if it is the figure's only point.

    Of other points the last state if they cool, else the mean over the second half.

    most, each : as of ``FigureBuilder.states``
    """
    if has_times(build):
        parts = np.array(moments)
        build.states(point, len(parts), most, each=each, fewest=len(parts))
        rows, times = at_moments(observable, build, point, parts)
        labels: list[str | None] = [f"t = {short(time, 4)} s" for time in times]
        return AtTimes(labels, [rows[:, k] for k in range(len(times))])
    wanted = 1 if gas_type_of(point) == "cooling" else MOST_STATES
    parts = second_half(build, point, wanted, most, each=each)
    means = [
        over_time(observable, trace, times_of(trace, parts)).mean(axis=0)
        for trace in build.traces(point)
    ]
    return AtTimes([build.label(point)], [np.array(means)])


def at_moments(
    observable: structure.Observable, build: FigureBuilder, point: Point, parts: Array
) -> tuple[Array, Array]:
    """An observable at parts of the time of each repeat (*n*, *t*, ...); mean times (*t*,), s."""
    times = np.array([times_of(trace, parts, each=True) for trace in build.traces(point)])
    kept = np.flatnonzero(np.append(True, np.diff(times.mean(axis=0)) > 0))
    pairs = zip(build.traces(point), times, strict=True)
    rows = [over_time(observable, trace, own[kept]) for trace, own in pairs]
    return np.array(rows), times[:, kept].mean(axis=0)


def has_times(build: FigureBuilder) -> bool:
    """Whether a figure shows several times: its only point cools."""
    return [gas_type_of(point) for point in build.points] == ["cooling"]


def shades(build: FigureBuilder) -> dict[str, list[float]]:
    """The shades of the curves of a figure with several times; of another one nothing."""
    last = max(line.series for line in build.lines if isinstance(line, Line))
    return {"shades": [k / max(1, last) for k in range(last + 1)]} if has_times(build) else {}


def when(build: FigureBuilder) -> str:
    """The sentence on the states that a figure of `at_times` shows."""
    if has_times(build):
        return "One state of each repeat."
    if len(build.points) == 1:
        return "The mean over the second half."
    return "The last state of repeats that cool; else the mean over the second half."


def structure_factor(build: FigureBuilder) -> FigureData:
    """S(k) at the times of `at_times`; of several points that cool also at the start."""
    build.lines.append(Reference("y", 1.0, "independent points"))
    cooled = False
    for index, point in enumerate(build.points):
        scene = build.start(point)
        chosen = structure.waves(scene)
        x = chosen.numbers * 2 * float(np.mean(scene.radii))
        s = partial(structure.structure_factor, chosen=chosen)
        most, start = MOST_WAVES // len(chosen.vectors), None
        if gas_type_of(point) == "cooling" and not has_times(build):
            parts, cooled = np.array([MOMENTS[0], MOMENTS[-1]]), True
            build.states(point, len(parts), most, fewest=len(parts))
            rows, _ = at_moments(s, build, point, parts)
            found, start = AtTimes([build.label(point)], [rows[:, -1]]), rows[:, 0]
        else:
            found = at_times(build, point, s, most)
        for series, (label, rows) in enumerate(zip(*found, strict=True), index):
            build.add_means(series, label, x, rows)
        if start is not None:
            build.lines.append(Line(x, start.mean(axis=0), None, index, SECOND))
        expected = build.predicted(scene, quantities.STRUCTURE, theories.COMPRESSIBILITY)
        if expected is not None:
            long_waves, level = x[: max(2, len(x) // 4)], np.full(2, expected)
            build.lines.append(Line(long_waves[[0, -1]], level, None, index, EXTRAPOLATED))
        build.record(
            point,
            longest=mean_and_error(found.rows[-1][:, 0]),
            theory=expected,
            grown_from=_grown_from(x, found.rows[-1].mean(axis=0)),
        )
    if any(record["theory"] is not None for record in build.records):
        build.lines.append(legend_line("theory, k → 0", EXTRAPOLATED))
    if cooled:
        build.lines.append(legend_line("the same at the start", SECOND))
    unit, log = unit_of_distance(build), build.covers_decades
    caption = when(build)
    grown = [record["grown_from"] for record in build.records if record["grown_from"]]
    if grown:
        build.headline = f"above 1 for waves longer than {short(min(grown), 2)} {unit}s"
        build.headline += " at the end" * has_times(build)
        caption += f" S is above 1 for waves longer than {short(min(grown), 2)} {unit}s."
    x_label = f"wave number k times the {unit}"
    return build.figure(caption, x_label=x_label, logarithmic=log, numbers=None, **shades(build))


GROWN = 3.0  # S of long waves in a gas in which clusters have grown
LONG = 0.5  # wave numbers times the diameter below which waves are long


def _grown_from(x: Array, s: Array) -> float | None:
    """The length in diameters from which on waves have S above 1, if clusters have grown."""
    long = x < LONG
    if not long.any() or np.mean(s[long]) < GROWN:
        return None
    peak = int(np.argmax(np.where(long, s, 0.0)))
    above = s[peak:] > 1
    last = peak + (len(above) if above.all() else int(np.argmin(above))) - 1
    return float(2 * math.pi / x[last])


def cluster_sizes(build: FigureBuilder) -> FigureData:
    """The share of balls in clusters of at least a number of balls."""
    check_clusters(build)
    last = max(build.start(point).number for point in build.points)
    sizes = np.union1d(np.geomspace(1, last, SIZES).round(), min(LARGE, last))
    for index, point in enumerate(build.points):
        found = at_times(build, point, partial(_in_clusters, sizes), MOST_BALLS)
        for series, (label, rows) in enumerate(zip(*found, strict=True), index):
            largest = np.count_nonzero(rows[:, :-1].mean(axis=0))  # zero is on no logarithmic axis
            build.add_means(series, label, sizes[:largest], rows[:, :largest])
            build.singles = []  # they end where a repeat has none
        in_large = found.rows[-1][:, int(np.argmax(sizes >= LARGE))] if last >= LARGE else None
        build.record(
            point,
            mean=mean_and_error(found.rows[-1][:, -1]),
            in_large=None if in_large is None else mean_and_error(in_large),
        )
    share = max(record["in_large"] or 0.0 for record in build.records)
    up_to, when_said = "up to " * (len(build.points) > 1), " at the end" * has_times(build)
    build.headline = f"none of {LARGE} or more balls{when_said}"
    if share:
        build.headline = f"{up_to}{percent(share)} of the balls in those of {LARGE} or more"
        build.headline += when_said
    caption = (
        f"{when(build)} Balls with a gap of at most {structure.CLUSTER_GAP:g} mean diameters are "
        "in one cluster (Luding & Herrmann 1999)."
    )
    return build.figure(caption, numbers=None, logarithmic=False, y_log=True, **shades(build))


LARGE = 10  # balls of a cluster that hardly forms without clustering, below a packing of 0.3


def _in_clusters(sizes: Array, positions: Array, velocities: Array, scene: Scene) -> Array:
    """The share of balls in clusters of at least these sizes; last the mean size of a ball's."""
    found = structure.cluster_sizes(positions, velocities, scene).astype(np.float64)
    shares = [found[found >= size].sum() for size in sizes]
    return np.array([*shares, np.sum(found**2)]) / scene.number
