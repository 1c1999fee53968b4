"""Distributions of distances from the centre, distances between balls, and speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis import predictions
from snooker_cli.analysis.observables import (
    at_collisions,
    central_distances,
    equal_balls,
    instants,
    pair_distances,
    reduced_speed_counts,
)
from snooker_cli.containers import Circle
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Array,
    FigureData,
    Histogram,
    Layer,
    Line,
    Reference,
)
from snooker_cli.figures.selection import (
    Selection,
    elastic,
    one_repeat,
    present,
    series_of_points,
)
from snooker_cli.formatting import exact, listed, short
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.engine import States
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene


BINS = 45
MOST_DISTANCES = 5_000_000
"""Of a point; of more states an even choice, so that a figure takes seconds."""


@dataclass(frozen=True)
class Distance:
    """A distance, and the limit that no ball may pass.

    limit, limit_of_unequal : the limit in symbols, for equal and unequal balls
    sign : 1 for an upper limit, -1 for a lower one
    extreme, excess, kept, passed : words and JSON keys for how the limit is met
    """

    kind: str
    title: str
    x_label: str
    limit: str
    limit_of_unequal: str
    sign: int
    extreme: str
    excess: str
    kept: str
    passed: str

    @property
    def central(self) -> bool:
        """Whether it is from the container's centre, not between two balls."""
        return self.sign > 0

    def outermost(self, values: Array) -> float:
        """The value nearest to the limit or farthest beyond it."""
        return float(np.max(values) if self.central else np.min(values))

    def of_states(self, states: States, scene: Scene) -> Array:
        """All distances in the states, m."""
        return central_distances(states) if self.central else pair_distances(states, scene)

    def limits(self, scene: Scene) -> tuple[Array, float, float]:
        """The limit of each distance, and the range of the distances; m."""
        if self.central:
            inside = scene.container.wall_gaps(np.zeros(2), scene.radii)
            return inside, 0.0, float(inside.max())
        first, second = np.triu_indices(scene.number, k=1)
        contact = scene.radii[first] + scene.radii[second]
        longest = scene.container.longest_distance(float(scene.radii.min()))
        return contact, float(contact.min()), longest

    def uniform(self, distances: Array, scene: Scene) -> Array:
        """Their density for balls at random places, 1/m."""
        if self.central:
            return np.asarray(2 * distances / distances[-1] ** 2)
        return scene.container.distance_density(distances, float(scene.radii.min()))


CENTRAL = Distance(
    kind="central-distances",
    title="Distances from the container's centre",
    x_label="distance of a ball from the centre (m)",
    limit="R − r",
    limit_of_unequal="R − smallest r",
    sign=1,
    extreme="largest",
    excess="largest_excess",
    kept="no ball is outside",
    passed="it is beyond",
)
PAIRS = Distance(
    kind="pair-distances",
    title="Distances between the balls",
    x_label="distance between two centres (m)",
    limit="2r",
    limit_of_unequal="smallest r₁ + r₂",
    sign=-1,
    extreme="smallest",
    excess="largest_overlap",
    kept="no balls overlap",
    passed="it is short of it",
)


@dataclass(frozen=True, eq=False)
class _Sample:
    """The histogram of the distances of a point.

    scene : the start of its last repeat
    limit, extreme, excess : the limit, the outermost distance, and how far one is beyond; m
    thinned : whether states are left out; once : whether states of one instant are
    """

    scene: Scene
    edges: Array
    density: Array
    limit: float
    extreme: float
    excess: float
    thinned: bool
    once: bool


def distances(distance: Distance, run: Run, selection: Selection) -> FigureData:
    """The distribution of a distance, with its limit and random places."""
    build = FigureBuilder(run, selection, _points_with_states(distance, run, selection))
    found = [_sample(distance, build, point) for point in build.points]
    extremes: dict[float, float] = {}
    for index, (point, each) in enumerate(zip(build.points, found, strict=True)):
        build.lines.append(Histogram(each.edges, each.density, build.label(point), index))
        before = extremes.get(each.limit, each.extreme)
        extremes[each.limit] = distance.outermost(np.array([before, each.extreme]))
        key = f"{distance.extreme}_distance"
        build.record(point, **{key: each.extreme, "beyond_limit": each.excess})
    limit = distance.outermost(np.array(list(extremes)))
    excess = max(each.excess for each in found)
    widest = max(found, key=lambda each: float(each.edges[-1]))
    x = np.linspace(0.0, float(widest.edges[-1]), 200)
    where = f"uniform in the {widest.scene.container.title}"
    equal = all(equal_balls(each.scene) for each in found)
    name = distance.limit if equal else distance.limit_of_unequal
    build.lines += [
        Line(x, distance.uniform(x, widest.scene), where, NEUTRAL, "dashed"),
        *(Reference("x", each, f"{name} = {each:g} m") for each in extremes),
    ]
    texts = [f"{exact(at)} m where {name} = {exact(edge)} m" for edge, at in extremes.items()]
    verdict = distance.kept
    if excess > 0:
        roundings = short(excess / np.spacing(limit), 2)
        verdict = (
            f"{distance.passed} by {short(excess, 2)} m, {roundings} × the rounding of a double"
        )
    every = "every few collisions" if any(each.thinned for each in found) else "each collision"
    caption = f"The {distance.extreme} distance is {listed(texts)}: {verdict}. "
    caption += f"Positions at the start and after {every}"
    caption += ", one per instant." if any(each.once for each in found) else "."
    if any(each.scene.container.period is not None for each in found):
        caption += " Distances are those of nearest images."
    return build.figure(
        kind=distance.kind,
        title=distance.title,
        x_label=distance.x_label,
        y_label="probability density (m⁻¹)",
        caption=caption,
        numbers={
            f"{distance.extreme}_distance": distance.outermost(
                np.array([each.extreme for each in found])
            ),
            "limit": limit,
            distance.excess: excess,
        },
        x_limits=(0.0, 1.04 * limit if distance.central else None),
        y_limits=(0.0, None),
    )


def _sample(distance: Distance, build: FigureBuilder, point: Point) -> _Sample:
    """The distances of a point, gathered repeat by repeat."""
    number = len(present(build.run, point, build.selection))
    counts, excess, extremes, thinned, once = np.zeros(BINS), -math.inf, [], False, False
    for trace in build.traces(point):
        limits, low, high = distance.limits(trace.start)
        most = max(2, MOST_DISTANCES // (len(limits) * number))
        states = at_collisions(trace, most)
        table = distance.of_states(states, trace.start).reshape(-1, len(limits))
        excess = max(excess, float((distance.sign * (table - limits)).max()))
        extremes.append(distance.outermost(table))
        rows = instants(states.time)
        thinned, once = thinned or trace.collisions >= most, once or len(rows) < len(table)
        # A distance that is beyond by rounding belongs to the bin at the limit.
        edges = np.linspace(low, high, BINS + 1)
        counts += np.histogram(np.clip(table[rows], low, high), edges)[0]
    return _Sample(
        scene=trace.start,
        edges=edges,
        density=counts / (counts.sum() * np.diff(edges)),
        limit=high if distance.central else low,
        extreme=distance.outermost(np.array(extremes)),
        excess=excess,
        thinned=thinned,
        once=once,
    )


def _points_with_states(distance: Distance, run: Run, selection: Selection) -> list[Point]:
    """The points to show. Raises ``FigureError`` without states, or for too many distances."""
    if run.experiment.record == "summary":
        raise FigureError("it needs positions; run the config with `record: events`")
    points = series_of_points(run, selection)
    for point in points:
        scene = one_repeat(run, point, selection).start
        number = scene.number
        if distance.central and not isinstance(scene.container, Circle):
            raise FigureError("only the wall of a circle is at one distance from the centre")
        if not distance.central and number < 2:
            raise FigureError("one ball has no distance to another; it needs two or more")
        # The start and the finish at least.
        if 2 * (number if distance.central else number * (number - 1) // 2) > MOST_DISTANCES:
            raise FigureError(f"{number:,} balls have too many distances to show")
    return points


# The distribution of speeds beside Maxwell and Boltzmann's and the one at fixed energy.

LEAST_SPEEDS = 100
"""Fewer show a distribution to no more than a tenth, 1/√n."""

REDUCED_TEMPERATURE = 0.5
"""The reduced speed v sqrt(m/2T) is the speed of a ball of mass 1 at this temperature."""


def speeds(run: Run, selection: Selection) -> FigureData:
    """Speeds at times that are several collisions apart, of all repeats.

    In m/s if no energy is lost and all balls have one mass; else in reduced units, v sqrt(m/2T)
    with the temperature of the moment.
    """
    build = FigureBuilder(run, selection, series_of_points(run, selection))
    starts = [one_repeat(run, point, selection).start for point in build.points]
    in_metres = all(map(elastic, build.points)) and all(map(equal_balls, starts))
    edges = np.arange(SPEED_BINS + 1, dtype=np.float64) * SPEED_BIN
    laws: dict[tuple[int | None, float], None] = {}
    for index, (point, scene) in enumerate(zip(build.points, starts, strict=True)):
        if scene.number < 2 or scene.kinetic_energy == 0:
            raise FigureError("it needs two or more balls that move")
        counts = np.zeros(SPEED_BINS)
        for trace in build.traces(point):
            counts += reduced_speed_counts(trace)
        total = counts.sum()
        if total < LEAST_SPEEDS:
            raise FigureError(
                f"{total:.0f} speeds after enough collisions are no distribution; run longer or "
                "more repeats"
            )
        unit = 1.0
        if in_metres:
            unit = float(np.sqrt(2 * scene.kinetic_energy / scene.number / scene.masses[0]))
        used = int(np.max(np.flatnonzero(counts))) + 1
        heights = counts[:used] / (total * SPEED_BIN * unit)
        build.lines.append(Histogram(edges[: used + 1] * unit, heights, build.label(point), index))
        free = predictions.free_velocities(scene)
        laws[free, unit] = None
        distance = _distance(counts, edges, free)
        build.record(
            point,
            speeds=int(total),
            distance_from_fixed_energy=math.nan if free is None else distance,
            one_over_root=float(total**-0.5),
        )
        build.result(point, f"{distance:.4f}, 1/√n = {total**-0.5:.4f}")
    for index, (free, unit) in enumerate(laws):
        build.lines += _laws(free, unit, named=index == 0)
    fixed = all(free is not None for free, _ in laws)
    law = "the law at fixed energy" if fixed else "Maxwell and Boltzmann's law"
    return build.figure(
        kind="speeds",
        title="Distribution of speeds",
        x_label="speed (m/s)" if in_metres else "reduced speed v √(m/2T)",
        y_label="probability density (s/m)" if in_metres else "probability density",
        caption=f"Largest difference of the cumulative shares of n speeds from {law}: "
        f"{build.results_text}. Sampled about five collisions of a ball apart.",
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def _laws(free: int | None, unit: float, *, named: bool) -> list[Layer]:
    """Maxwell-Boltzmann and the law of ``free`` balls at fixed energy, speeds in ``unit``."""
    reduced = np.linspace(0.0, 3.0, 120)
    maxwell = theory.maxwell_speed_density(reduced, REDUCED_TEMPERATURE) / unit
    text = "Maxwell–Boltzmann" if named else None
    layers: list[Layer] = [Line(reduced * unit, np.asarray(maxwell), text, NEUTRAL, "dashed")]
    if free is not None:
        fixed = theory.fixed_energy_speed_density(reduced, free, REDUCED_TEMPERATURE) / unit
        text = f"fixed energy, {free} free balls" if named else None
        layers.append(Line(reduced * unit, np.asarray(fixed), text, NEUTRAL, "dotted"))
    return layers


def _distance(counts: Array, edges: Array, free: int | None) -> float:
    """Largest difference of cumulative shares, at the bins' edges, from the law at fixed energy.

    From Maxwell and Boltzmann's where that law does not hold.
    """
    shares = np.cumsum(counts) / counts.sum()
    law = theory.maxwell_speed_cdf(edges[1:], REDUCED_TEMPERATURE)
    if free is not None:
        law = theory.fixed_energy_speed_cdf(edges[1:], free, REDUCED_TEMPERATURE)
    return float(np.max(np.abs(shares - law)[:-1]))
