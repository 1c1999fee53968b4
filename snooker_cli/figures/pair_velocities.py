"""Velocity correlations of pairs and the vorticity around a ball, against the distance."""

from functools import partial

import numpy as np

from snooker_cli.analysis import quantities, theories, velocity_correlations
from snooker_cli.analysis.observables import mean_and_error, standard_errors
from snooker_cli.analysis.structure import over_time
from snooker_cli.errors import FigureError
from snooker_cli.figures.distributions import MOMENTS, MOST_STATES, at_moments, second_half
from snooker_cli.figures.distributions import times_of_parts as times_of
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    EXTRAPOLATED,
    MEASURED,
    Array,
    Band,
    FigureData,
    Layer,
    Line,
    Panel,
    Reference,
    more_than_a_decade,
)
from snooker_cli.figures.series import gas_type_of
from snooker_cli.formatting import short

MOST_SUMMED, OF_A_STATE = 4_000_000, 40_000
"""Balls times states of a figure, which take seconds; a state counts as this many balls more."""

MODELS = theories.FIXED_MOMENTUM, theories.INDEPENDENT


def against_distance(build: FigureBuilder) -> FigureData:
    """Longitudinal and transverse correlation, and the vorticity, below each other.

    Means over the second half of repeats that do not cool; of others the last state. A single point
    that cools has curves at the later ones of ``MOMENTS``.
    """
    across, turning = list[Layer](), list[Layer]()
    cools = [gas_type_of(point) == "cooling" for point in build.points]
    several = cools == [True]
    shades: list[float] = []
    references = dict[float, Reference]()
    for index, (point, cooling) in enumerate(zip(build.points, cools, strict=True)):
        scene = build.start(point)
        edges = velocity_correlations.distance_edges(scene)
        if edges[-1] <= edges[0]:
            raise FigureError(
                "the balls have hardly more room than they need; use a larger container"
            )
        x = (edges[1:] + edges[:-1]) / 2 / (2 * float(np.mean(scene.radii)))
        upper = edges[1:] / (2 * float(np.mean(scene.radii)))
        sums = partial(velocity_correlations.pair_sums, edges=edges)
        if several:
            parts = np.array(MOMENTS[1:])
            build.states(point, len(parts), MOST_SUMMED, each=OF_A_STATE, fewest=len(parts))
            found, times = at_moments(sums, build, point, parts)
            rows = [found[:, k] for k in range(len(times))]
            labels = [f"t = {short(time)} s" for time in times]
            shades = np.linspace(0.0, 1.0, len(times)).tolist()
        else:
            wanted = 1 if cooling else MOST_STATES
            parts = second_half(build, point, wanted, MOST_SUMMED, each=OF_A_STATE)
            rows = [
                np.array(
                    [
                        over_time(sums, trace, times_of(trace, parts)).sum(axis=0)
                        for trace in build.traces(point)
                    ]
                )
            ]
            labels = [build.label(point) or ""]
        for series, (label, of_repeats) in enumerate(zip(labels, rows, strict=True), index):
            curves = velocity_correlations.correlations(of_repeats)
            build.add_means(series, label or None, x, curves[0], MEASURED)
            across += _mean(series, x, curves[1])
            turning += _mean(series, upper, curves[2])
        expected = build.predicted(scene, quantities.NEIGHBOURS, *MODELS)
        if expected is not None:
            name = None if references else "elastic balls"
            references.setdefault(expected, Reference("y", expected, name, EXTRAPOLATED))
        build.record(point, nearest=mean_and_error(curves[0][:, 0]), theory=expected)
    build.lines += references.values()
    across += [Reference("y", line.value, None, line.style) for line in references.values()]
    turning.append(Reference("y", 1.0))
    if not references:
        build.lines.append(Reference("y", 0.0, "independent velocities"))
        across.append(Reference("y", 0.0))
    when = "The last state of repeats that cool; else the mean over the second half."
    if len(cools) == 1:
        when = "One state of each repeat." if several else "The mean over the second half."
    caption = (
        f"{when} Top: the product of both velocities along the line of centres; middle: across it; "
        "both over the mean u² of a component. Bottom: (Σ r × u)²/Σ r² of the balls nearer than r, "
        "over that of independent velocities."
    )
    log = more_than_a_decade(line.y for line in turning if isinstance(line, Line))
    panels = Panel(tuple(across), "across"), Panel(tuple(turning), "vorticity", log)
    if several:
        return build.figure(caption, panels=panels, shades=shades)
    return build.figure(caption, panels=panels)


def _mean(series: int, x: Array, rows: Array) -> list[Layer]:
    """The mean over repeats and the band of its error."""
    mean = rows.mean(axis=0)
    line = Line(x, mean, None, series, MEASURED)
    if len(rows) == 1:
        return [line]
    error = standard_errors(rows)
    return [Band(x, mean - error, mean + error, None, series), line]
