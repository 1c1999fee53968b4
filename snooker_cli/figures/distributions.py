"""Where the balls are: distances from the container's centre and between balls."""

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
from snooker_cli.figures.captions import setting
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
    label,
    one_repeat,
    repeats,
    series_of_points,
    there,
)
from snooker_cli.formatting import exact, listed, short
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene


BINS = 45
MOST_DISTANCES = 5_000_000
"""Of a point; more states are thinned out evenly, so that a picture takes seconds."""


@dataclass(frozen=True)
class _Words:
    """How one of the two pictures speaks of its distances and of what they must not pass."""

    kind: str
    title: str
    x_label: str
    limit: str
    limit_of_unequal: str
    extreme: str
    beyond: str
    good: str
    bad: str


_CENTRAL = _Words(
    kind="central-distances",
    title="Distances from the container's centre",
    x_label="distance of a ball from the centre (m)",
    limit="R − r",
    limit_of_unequal="R − smallest r",
    extreme="largest",
    beyond="largest_excess",
    good="no ball is outside",
    bad="it is beyond",
)
_PAIRS = _Words(
    kind="pair-distances",
    title="Distances between the balls",
    x_label="distance between two centres (m)",
    limit="2r",
    limit_of_unequal="smallest r₁ + r₂",
    extreme="smallest",
    beyond="largest_overlap",
    good="no balls overlap",
    bad="it is short of it",
)


def central_distances_picture(run: Run, selection: Selection) -> FigureData:
    """How far the balls' centres are from the container's: none may be outside R − r."""
    return _picture(run, selection, _CENTRAL)


def pair_distances_picture(run: Run, selection: Selection) -> FigureData:
    """How far the balls' centres are from each other: no two may be nearer than 2r."""
    return _picture(run, selection, _PAIRS)


def _picture(run: Run, selection: Selection, words: _Words) -> FigureData:
    central = words is _CENTRAL
    points = _points_with_states(run, selection, 1 if central else 2)
    found = [_distances(run, point, selection, central=central) for point in points]
    pick: Callable[[Sequence[float]], float] = max if central else min
    limit, extreme = pick([each.limit for each in found]), pick([each.extreme for each in found])
    excess = max(each.excess for each in found)
    widest = max(found, key=lambda each: float(each.edges[-1]))
    largest = float(widest.edges[-1])
    apart = np.linspace(0.0, largest, 200)
    uniform = (
        2 * apart / largest**2
        if central
        else widest.scene.container.distance_density(apart, float(widest.scene.radii.min()))
    )
    where = f"uniform in the {widest.scene.container.title}"
    equal = all(equal_balls(each.scene) for each in found)
    name = words.limit if equal else words.limit_of_unequal
    extremes = {each.limit: each.extreme for each in found}
    for each in found:
        extremes[each.limit] = pick([extremes[each.limit], each.extreme])
    said = listed(
        [f"{exact(at)} m where {name} = {exact(limit)} m" for limit, at in extremes.items()]
    )
    once = ", an instant of many counting once" if any(each.once for each in found) else ""
    images = any(each.scene.container.period is not None for each in found)
    return FigureData(
        kind=words.kind,
        title=words.title,
        x_label=words.x_label,
        y_label="probability density (m⁻¹)",
        layers=(
            *(
                Histogram(each.edges, each.density, label(each.point, points), series)
                for series, each in enumerate(found)
            ),
            Line(apart, uniform, where, NEUTRAL, "dashed"),
            *(Reference("x", each, f"{name} = {each:g} m") for each in extremes),
        ),
        caption=f"The {words.extreme} distance is {said}: {_verdict(excess, limit, words)}. "
        "Positions at the start and after "
        f"{'every few collisions' if any(each.thinned for each in found) else 'each collision'}"
        f"{once}. "
        + ("In a periodic box distances are those of nearest images. " if images else "")
        + setting(run, points, selection),
        numbers={
            f"{words.extreme}_distance": extreme,
            "limit": limit,
            words.beyond: excess,
            "points": [
                {
                    "parameters": each.point.as_json(),
                    f"{words.extreme}_distance": each.extreme,
                    "beyond_limit": each.excess,
                }
                for each in found
            ],
        },
        x_limits=(0.0, 1.04 * limit if central else None),
        y_limits=(0.0, None),
    )


@dataclass(frozen=True, eq=False)
class _Distances:
    """The histogram of distances of a point.

    scene : the start of its last repeat
    limit : what the distances must not pass, m; extreme : the one nearest to it or farthest
        beyond, m; excess : how far one goes beyond, m
    thinned : whether states are left out; once : whether states of one instant were
    """

    point: Point
    scene: Scene
    edges: Array
    density: Array
    limit: float
    extreme: float
    excess: float
    thinned: bool
    once: bool


def _distances(run: Run, point: Point, selection: Selection, *, central: bool) -> _Distances:
    """The distances of a point, gathered repeat by repeat."""
    number = len(there(run, point, selection))
    counts, excess, extremes, thinned, once = np.zeros(BINS), -math.inf, [], False, False
    for trace in repeats(run, point, selection):
        limits, low, high = _limits(trace.start, central=central)
        most = max(2, MOST_DISTANCES // (len(limits) * number))
        states = at_collisions(trace, most)
        found = central_distances(states) if central else pair_distances(states, trace.start)
        table = found.reshape(-1, len(limits))
        beyond = table - limits if central else limits - table
        excess = max(excess, float(beyond.max()))
        extremes.append(float(table.max() if central else table.min()))
        rows = instants(states.time)
        thinned, once = thinned or trace.collisions >= most, once or len(rows) < len(table)
        # A distance that is beyond by rounding belongs to the bin at the limit.
        edges = np.linspace(low, high, BINS + 1)
        counts += np.histogram(np.clip(table[rows], low, high), edges)[0]
    return _Distances(
        point=point,
        scene=trace.start,
        edges=edges,
        density=counts / (counts.sum() * np.diff(edges)),
        limit=high if central else low,
        extreme=max(extremes) if central else min(extremes),
        excess=excess,
        thinned=thinned,
        once=once,
    )


def _limits(scene: Scene, *, central: bool) -> tuple[Array, float, float]:
    """What each distance must not pass, and the range that the distances can have; m."""
    if central:
        inside = scene.container.wall_gaps(np.zeros(2), scene.radii)
        return inside, 0.0, float(inside.max())
    first, second = np.triu_indices(scene.number, k=1)
    contact = scene.radii[first] + scene.radii[second]
    return contact, float(contact.min()), scene.container.longest_distance(float(scene.radii.min()))


def _points_with_states(run: Run, selection: Selection, least: int) -> list[Point]:
    """The points to show. Raises ``FigureError`` if their states cannot be had or are too many."""
    if run.experiment.record == "summary":
        raise FigureError("it needs positions; run the config with `record: events`")
    points = series_of_points(run, selection)
    for point in points:
        scene = one_repeat(run, point, selection).start
        number = scene.number
        if least == 1 and not isinstance(scene.container, Circle):
            raise FigureError("only the wall of a circle is at one distance from the centre")
        if number < least:
            raise FigureError("one ball has no distance to another; it needs two or more")
        # The start and the finish at least.
        if 2 * (number if least == 1 else number * (number - 1) // 2) > MOST_DISTANCES:
            raise FigureError(f"{number:,} balls have too many distances to show")
    return points


def _verdict(excess: float, limit: float, words: _Words) -> str:
    """Whether a limit is kept; if not, by how much, also in roundings of a double of its size."""
    if excess <= 0:
        return words.good
    roundings = short(excess / np.spacing(limit), 2)
    plural = "" if roundings == "1" else "s"
    return f"{words.bad} by {short(excess, 2)} m, {roundings} rounding{plural} of a double"


# The distribution of speeds beside Maxwell and Boltzmann's and the one at fixed energy.

LEAST_SPEEDS = 100
"""Fewer tell no more of a distribution than a tenth, 1/√n."""

REDUCED_TEMPERATURE = 0.5
"""The reduced speed v sqrt(m/2T) is the speed of a ball of mass 1 at this temperature."""


def speeds(run: Run, selection: Selection) -> FigureData:
    """Speeds at times that are several collisions apart, of all repeats.

    In m/s if no energy is lost and all balls have one mass; else in reduced units, v sqrt(m/2T)
    with the temperature of the moment.
    """
    points = series_of_points(run, selection)
    starts = [one_repeat(run, point, selection).start for point in points]
    in_metres = all(elastic(point) for point in points) and all(map(equal_balls, starts))
    edges = np.arange(SPEED_BINS + 1, dtype=np.float64) * SPEED_BIN
    layers: list[Layer] = []
    records, said = [], []
    laws: dict[tuple[int | None, float], None] = {}
    for index, (point, scene) in enumerate(zip(points, starts, strict=True)):
        if scene.number < 2 or scene.kinetic_energy == 0:
            raise FigureError("it needs two or more balls that move")
        counts = np.zeros(SPEED_BINS)
        for trace in repeats(run, point, selection):
            counts += reduced_speed_counts(trace)
        total = counts.sum()
        if total < LEAST_SPEEDS:
            raise FigureError(
                f"the balls have met too rarely: {total:.0f} speeds that have mixed are no "
                "distribution; run longer or more repeats"
            )
        unit = 1.0
        if in_metres:
            unit = float(np.sqrt(2 * scene.kinetic_energy / scene.number / scene.masses[0]))
        used = int(np.max(np.flatnonzero(counts))) + 1
        heights = counts[:used] / (total * SPEED_BIN * unit)
        layers.append(Histogram(edges[: used + 1] * unit, heights, label(point, points), index))
        free = predictions.free_velocities(scene)
        laws[free, unit] = None
        distance = _distance(counts, edges, free)
        from_fixed = math.nan if free is None else distance
        records.append(
            {
                "parameters": point.as_json(),
                "speeds": int(total),
                "distance_from_fixed_energy": from_fixed,
                "one_over_root": float(total**-0.5),
            }
        )
        name = label(point, points)
        said.append(f"{distance:.4f} ({name + ', ' if name else ''}1/√n = {total**-0.5:.4f})")
    for index, (free, unit) in enumerate(laws):
        layers += _laws(free, unit, named=index == 0)
    fixed = all(free is not None for free, _ in laws)
    return FigureData(
        kind="speeds",
        title="Distribution of speeds",
        x_label="speed (m/s)" if in_metres else "reduced speed v √(m/2T)",
        y_label="probability density (s/m)" if in_metres else "probability density",
        layers=tuple(layers),
        caption="Largest difference between the cumulative shares of n speeds and "
        + ("the law at fixed energy" if fixed else "Maxwell and Boltzmann's law")
        + f": {listed(said)}. Sampled at even times about five collisions of a ball apart. "
        + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def _laws(free: int | None, unit: float, *, named: bool) -> list[Layer]:
    """Maxwell-Boltzmann and the law of so many balls at fixed energy, speeds in ``unit``."""
    reduced = np.linspace(0.0, 3.0, 120)
    maxwell = theory.maxwell_speed_density(reduced, REDUCED_TEMPERATURE) / unit
    layers: list[Layer] = [
        Line(
            reduced * unit,
            np.asarray(maxwell),
            "Maxwell–Boltzmann" if named else None,
            NEUTRAL,
            "dashed",
        )
    ]
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
