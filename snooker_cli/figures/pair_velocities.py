"""Velocity correlations of pairs and the vorticity around a ball, against the distance."""

import math
from functools import partial

from snooker_cli.analysis import quantities, theories, velocity_correlations
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.errors import FigureError
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    EXTRAPOLATED,
    FigureData,
    Layer,
    Line,
    Panel,
    Reference,
    mean_layers,
    more_than_a_decade,
)
from snooker_cli.figures.structure_at_times import MOMENTS, at_times, has_times, shades, when
from snooker_cli.formatting import short

MOST_SUMMED, OF_A_STATE = 4_000_000, 40_000
"""Balls times states of a figure, which take seconds; a state counts as this many balls more."""

WIDE = 20.0  # farthest over least distance from which on its axis is logarithmic

MODELS = theories.FIXED_MOMENTUM, theories.INDEPENDENT


def against_distance(build: FigureBuilder) -> FigureData:
    """Longitudinal and transverse correlation, and the vorticity, below each other."""
    across, turning, references = list[Layer](), list[Layer](), dict[float, Reference]()
    wide = False
    for index, point in enumerate(build.points):
        scene = build.start(point)
        edges, diameter = velocity_correlations.distance_edges(scene), 2 * float(scene.radii.mean())
        if edges[-1] <= edges[0]:
            raise FigureError(
                "the balls have hardly more room than they need; use a larger container"
            )
        x, upper = (edges[1:] + edges[:-1]) / 2 / diameter, edges[1:] / diameter
        wide |= bool(edges[-1] > WIDE * edges[0])
        sums = partial(velocity_correlations.pair_sums, edges=edges)
        later = MOMENTS[1:]  # a start has no correlations
        found = at_times(build, point, sums, MOST_SUMMED, each=OF_A_STATE, moments=later)
        # A time has the colour and the marker that it has in the other figures of times.
        first = len(MOMENTS) - len(later) if has_times(build) else index
        for series, (label, rows) in enumerate(zip(*found, strict=True), first):
            along, *others = velocity_correlations.correlations(rows)
            build.add_means(series, label, x, along)
            across += mean_layers(x, others[0], series)
            turning += mean_layers(upper, others[1], series)
        expected = build.predicted(scene, quantities.NEIGHBOURS, *MODELS)
        if expected is not None:
            name = None if references else "elastic balls"
            references.setdefault(expected, Reference("y", expected, name, EXTRAPOLATED))
        build.record(point, nearest=mean_and_error(along[:, 0]), theory=expected)
    build.lines += references.values()
    across += [Reference("y", line.value, None, line.style) for line in references.values()]
    turning.append(Reference("y", 1.0))
    if not references:
        build.lines.append(Reference("y", 0.0, "independent velocities"))
        across.append(Reference("y", 0.0))
    reach = max(float(line.x[0]) for line in turning if isinstance(line, Line))
    known = [one["nearest"] for one in build.records if math.isfinite(one["nearest"])]
    if known:
        up_to = "up to " * (len(build.records) > 1)
        nearest = short(float(max(known, key=abs)), 2)
        build.headline = f"{up_to}{nearest} for pairs within {short(reach, 2)} diameters"
        build.headline += " at the end" * has_times(build)
    caption = (
        f"{when(build)} Top: the product of both velocities along the line of centres; middle: "
        "across it; both over the mean u² of a component, so that 1 is one velocity and 0 none in "
        "common. Bottom: (Σ r × u)²/Σ r² of the balls nearer than r, over that of independent "
        "velocities: balls turn around each other where it is large."
    )
    log = more_than_a_decade(line.y for line in turning if isinstance(line, Line))
    panels = Panel(tuple(across), "across"), Panel(tuple(turning), "vorticity", log)
    limits = (None, None) if wide else (0.0, None)
    return build.figure(
        caption,
        panels=panels,
        numbers=None,
        logarithmic=False,
        x_log=wide,
        x_limits=limits,
        **shades(build),
    )
