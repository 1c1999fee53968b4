"""Where the balls are: distances from the container's centre and between balls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.gallery.caption import setting
from snooker_cli.gallery.picture import (
    NEUTRAL,
    Array,
    Histogram,
    Line,
    Picture,
    PictureError,
    Reference,
)
from snooker_cli.gallery.repeats import one_repeat, repeats
from snooker_cli.gallery.selection import (
    Selection,
    label,
    series_of_points,
    there,
)
from snooker_cli.observables import (
    at_collisions,
    central_distances,
    equal_balls,
    instants,
    pair_distances,
)
from snooker_cli.words import exact, listed, short

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.scene import Scene, Shape

BINS = 45
DIRECTIONS = 2000
MOST_DISTANCES = 5_000_000
"""Of a point; more states are thinned out evenly, so that a picture takes seconds."""


_SHAPES: dict[Shape, str] = {"circle": "circle", "box": "box", "periodic": "periodic box"}


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


def central_distances_picture(run: Run, selection: Selection) -> Picture:
    """How far the balls' centres are from the container's: none may be outside R − r."""
    return _picture(run, selection, _CENTRAL)


def pair_distances_picture(run: Run, selection: Selection) -> Picture:
    """How far the balls' centres are from each other: no two may be nearer than 2r."""
    return _picture(run, selection, _PAIRS)


def _picture(run: Run, selection: Selection, words: _Words) -> Picture:
    central = words is _CENTRAL
    points = _points_with_states(run, selection, 1 if central else 2)
    found = [_distances(run, point, selection, central=central) for point in points]
    pick: Callable[[Sequence[float]], float] = max if central else min
    limit, extreme = pick([each.limit for each in found]), pick([each.extreme for each in found])
    excess = max(each.excess for each in found)
    widest = max(found, key=lambda each: float(each.edges[-1]))
    largest = float(widest.edges[-1])
    apart = np.linspace(0.0, largest, 200)
    uniform = 2 * apart / largest**2 if central else _uniform_pairs(apart, widest.scene)
    where = f"uniform in the {_SHAPES[widest.scene.shape]}"
    equal = all(equal_balls(each.scene) for each in found)
    name = words.limit if equal else words.limit_of_unequal
    extremes = {each.limit: each.extreme for each in found}
    for each in found:
        extremes[each.limit] = pick([extremes[each.limit], each.extreme])
    said = listed(
        [f"{exact(at)} m where {name} = {exact(limit)} m" for limit, at in extremes.items()]
    )
    once = ", an instant of many counting once" if any(each.once for each in found) else ""
    images = any(each.scene.shape == "periodic" for each in found)
    return Picture(
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
        inside = scene.container_radius - scene.radii
        return inside, 0.0, float(inside.max())
    first, second = np.triu_indices(scene.number, k=1)
    contact = scene.radii[first] + scene.radii[second]
    return contact, float(contact.min()), _farthest(scene)


def _reach(scene: Scene) -> Array:
    """Width and height of the region that the centres of the smallest balls can reach, m."""
    walls = 0.0 if scene.shape == "periodic" else 2 * float(scene.radii.min())
    return np.array(scene.size) - walls


def _farthest(scene: Scene) -> float:
    """The largest distance that two balls can have, m; in a periodic box of nearest images."""
    width, height = _reach(scene)
    if scene.shape == "circle":
        return float(width)
    diagonal = float(np.hypot(width, height))
    return diagonal if scene.shape == "box" else diagonal / 2


def _points_with_states(run: Run, selection: Selection, least: int) -> list[Point]:
    """The points to show. Raises ``PictureError`` if their states cannot be had or are too many."""
    if run.experiment.record == "summary":
        raise PictureError("it needs positions; run the config with `record: events`")
    points = series_of_points(run, selection)
    for point in points:
        scene = one_repeat(run, point, selection).start
        number = scene.number
        if least == 1 and scene.shape != "circle":
            raise PictureError("only the wall of a circle is at one distance from the centre")
        if number < least:
            raise PictureError("one ball has no distance to another; it needs two or more")
        # The start and the finish at least.
        if 2 * (number if least == 1 else number * (number - 1) // 2) > MOST_DISTANCES:
            raise PictureError(f"{number:,} balls have too many distances to show")
    return points


def _uniform_pairs(apart: Array, scene: Scene) -> Array:
    """Density of the distance of two random points in a container.

    In a circle that of disk line picking. In a rectangle both components of the distance are
    independent, and their densities are multiplied and summed over directions.
    """
    if scene.shape == "circle":
        diameter = _farthest(scene)
        s = np.clip(apart / diameter, 0.0, 1.0)
        density = 16 * s / math.pi * (np.arccos(s) - s * np.sqrt(1 - s * s)) / diameter
        return np.asarray(density)
    angles = (np.arange(DIRECTIONS) + 0.5) * (math.pi / 2 / DIRECTIONS)
    product = np.ones((len(apart), DIRECTIONS))
    for component, side in zip((np.cos(angles), np.sin(angles)), _reach(scene), strict=True):
        along = apart[:, None] * component
        if scene.shape == "box":
            product *= 2 * np.maximum(side - along, 0.0) / side**2
        else:
            product *= np.where(along <= side / 2, 2 / side, 0.0)
    return np.asarray(apart * product.mean(axis=1) * (math.pi / 2))


def _verdict(excess: float, limit: float, words: _Words) -> str:
    """Whether a limit is kept; if not, by how much, also in roundings of a double of its size."""
    if excess <= 0:
        return words.good
    roundings = short(excess / np.spacing(limit), 2)
    plural = "" if roundings == "1" else "s"
    return f"{words.bad} by {short(excess, 2)} m, {roundings} rounding{plural} of a double"
