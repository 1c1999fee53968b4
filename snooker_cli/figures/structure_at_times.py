"""What a gas looks like at several times: sizes of clusters, and what other figures need for it."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from snooker_cli.analysis import structure
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.analysis.structure import Observable, over_time
from snooker_cli.config import Point
from snooker_cli.figures.distributions import MOMENTS, MOST_STATES, at_moments, second_half
from snooker_cli.figures.distributions import times_of_parts as times_of
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import MEASURED, Array, FigureData, Line
from snooker_cli.figures.series import gas_type_of
from snooker_cli.figures.time_courses import check_clusters
from snooker_cli.formatting import short
from snooker_cli.scene import Scene

SIZES = 40  # places of a curve
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
        labels: list[str | None] = [f"t = {short(time)} s" for time in times]
        return AtTimes(labels, [rows[:, k] for k in range(len(times))])
    wanted = 1 if gas_type_of(point) == "cooling" else MOST_STATES
    parts = second_half(build, point, wanted, most, each=each)
    means = [
        over_time(observable, trace, times_of(trace, parts)).mean(axis=0)
        for trace in build.traces(point)
    ]
    return AtTimes([build.label(point)], [np.array(means)])


def has_times(build: FigureBuilder) -> bool:
    """Whether a figure shows several times: its only point cools."""
    return [gas_type_of(point) for point in build.points] == ["cooling"]


def shades(build: FigureBuilder) -> dict[str, list[float]]:
    """The shades of the curves of a figure with several times; of another one nothing."""
    number = len({line.series for line in build.lines if isinstance(line, Line)})
    return {"shades": [k / max(1, number - 1) for k in range(number)]} if has_times(build) else {}


def when(build: FigureBuilder) -> str:
    """The sentence on the states that a figure of `at_times` shows."""
    if has_times(build):
        return "One state of each repeat."
    if len(build.points) == 1:
        return "The mean over the second half."
    return "The last state of repeats that cool; else the mean over the second half."


def cluster_sizes(build: FigureBuilder) -> FigureData:
    """The share of balls in clusters of at least so many balls."""
    check_clusters(build)
    last = max(build.start(point).number for point in build.points)
    sizes = np.unique(np.geomspace(1, last, SIZES).round())
    for index, point in enumerate(build.points):
        found = at_times(build, point, partial(_in_clusters, sizes), MOST_BALLS)
        for series, (label, rows) in enumerate(zip(*found, strict=True), index):
            build.add_means(series, label, sizes, rows[:, :-1], MEASURED)
        build.record(point, mean=mean_and_error(found.rows[-1][:, -1]))
    caption = (
        f"{when(build)} Balls with a gap of at most {structure.CLUSTER_GAP:g} mean diameters are "
        "in one cluster (Luding & Herrmann 1999)."
    )
    return build.figure(caption, logarithmic=False, numbers=None, **shades(build))


def _in_clusters(sizes: Array, positions: Array, velocities: Array, scene: Scene) -> Array:
    """The share of balls in clusters of at least these sizes; last the mean size of a ball's."""
    found = structure.cluster_sizes(positions, velocities, scene).astype(np.float64)
    shares = [found[found >= size].sum() for size in sizes]
    return np.array([*shares, np.sum(found**2)]) / scene.number
