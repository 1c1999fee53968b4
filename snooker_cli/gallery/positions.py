"""Where the balls are: distances from the container's centre and between balls."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.gallery.picture import (
    NEUTRAL,
    Array,
    Histogram,
    Layer,
    Line,
    Picture,
    PictureError,
    Reference,
)
from snooker_cli.gallery.selection import (
    Selection,
    label,
    repeats,
    series_of_points,
    setting,
)
from snooker_cli.observables import at_collisions, central_distances, pair_distances
from snooker_cli.words import exact, short

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run

BINS = 45
MOST_DISTANCES = 5_000_000
"""Of a point; more states are thinned out evenly, so that a picture takes seconds."""


def central_distances_picture(run: Run, selection: Selection) -> Picture:
    """How far the balls' centres are from the container's: none may be outside R - r."""
    points = _points_with_states(run, selection, 1)
    found = [_Distances(run, point, selection, central=True) for point in points]
    limit, largest = max(each.limit for each in found), max(each.largest for each in found)
    excess = max(each.excess for each in found)
    layers: list[Layer] = [
        Histogram(each.edges, each.density, label(each.point, points), series)
        for series, each in enumerate(found)
    ]
    reach = np.array([0.0, limit])
    layers += [
        Line(reach, 2 * reach / limit**2, "uniform in the circle", NEUTRAL, "dashed"),
        Reference("x", limit, f"R − r = {limit:g} m"),
    ]
    return Picture(
        kind="central-distances",
        title="Distances of the balls from the container's centre",
        x_label="distance from the centre (m)",
        y_label="probability density (m⁻¹)",
        layers=tuple(layers),
        caption=f"The largest distance is {exact(largest)} m where R − r = {exact(limit)} m: "
        f"{_verdict(excess, limit, 'no ball is outside', 'it is beyond')}. "
        f"Positions at the start and after {found[0].which}. " + setting(run, points, selection),
        numbers={
            "largest_distance": largest,
            "limit": limit,
            "largest_excess": excess,
            "points": [each.record("largest_distance") for each in found],
        },
        x_limits=(0.0, 1.04 * limit),
        y_limits=(0.0, None),
    )


def pair_distances_picture(run: Run, selection: Selection) -> Picture:
    """How far the balls' centres are from each other: no two may be nearer than 2r."""
    points = _points_with_states(run, selection, 2)
    found = [_Distances(run, point, selection, central=False) for point in points]
    limit, smallest = min(each.limit for each in found), min(each.smallest for each in found)
    excess = max(each.excess for each in found)
    layers: list[Layer] = [
        Histogram(each.edges, each.density, label(each.point, points), series)
        for series, each in enumerate(found)
    ]
    largest = max(each.edges[-1] for each in found)
    apart = np.linspace(0.0, largest, 200)
    layers += [
        Line(apart, _uniform_pairs(apart, largest), "uniform in the circle", NEUTRAL, "dashed"),
        Reference("x", limit, f"2r = {limit:g} m"),
    ]
    return Picture(
        kind="pair-distances",
        title="Distances between the balls",
        x_label="distance between two centres (m)",
        y_label="probability density (m⁻¹)",
        layers=tuple(layers),
        caption=f"The smallest distance is {exact(smallest)} m where 2r = {exact(limit)} m: "
        f"{_verdict(excess, limit, 'no balls overlap', 'it is short of it')}. "
        f"Positions at the start and after {found[0].which}. " + setting(run, points, selection),
        numbers={
            "smallest_distance": smallest,
            "limit": limit,
            "largest_overlap": excess,
            "points": [each.record("smallest_distance") for each in found],
        },
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


class _Distances:
    """The histogram of distances of a point, gathered repeat by repeat.

    limit : what the distances must not go beyond, m; excess : how far one goes beyond, m
    """

    def __init__(self, run: Run, point: Point, selection: Selection, *, central: bool) -> None:
        self.point, self.largest, self.smallest, self.excess = point, 0.0, math.inf, -math.inf
        counts, self.which = np.zeros(BINS), "each collision"
        measure = central_distances if central else pair_distances
        number = run.experiment.repeats if selection.repeat is None else 1
        for trace in repeats(run, point, selection):
            scene = trace.start
            inside = scene.container_radius - scene.radii
            if central:
                low, high = 0.0, float(inside.max())
                self.limit, per_state = high, scene.number
            else:
                first, second = np.triu_indices(scene.number, k=1)
                contact = scene.radii[first] + scene.radii[second]
                low, high = float(contact.min()), 2 * float(inside.max())
                self.limit, per_state = low, len(contact)
            most = max(2, MOST_DISTANCES // (per_state * number))
            if trace.collisions >= most:
                self.which = "every few collisions"
            distances = measure(at_collisions(trace, most))
            table = distances.reshape(-1, per_state)
            beyond = table - inside if central else contact - table
            self.excess = max(self.excess, float(beyond.max()))
            self.largest = max(self.largest, float(distances.max()))
            self.smallest = min(self.smallest, float(distances.min()))
            self.edges: Array = np.linspace(low, high, BINS + 1)
            # A distance that is beyond by rounding belongs to the bin at the limit.
            counts += np.histogram(np.clip(distances, low, high), self.edges)[0]
        self.density: Array = counts / (counts.sum() * np.diff(self.edges))

    def record(self, name: str) -> dict[str, object]:
        """The point's own numbers as JSON."""
        extreme = self.largest if name.startswith("largest") else self.smallest
        return {"parameters": self.point.as_json(), name: extreme, "beyond_limit": self.excess}


def _points_with_states(run: Run, selection: Selection, least: int) -> list[Point]:
    """The points to show. Raises ``PictureError`` if their states cannot be had or are too many."""
    if run.experiment.record == "summary":
        raise PictureError("it needs positions; run the config with `record: events`")
    points = series_of_points(run, selection)
    for point in points:
        number = next(repeats(run, point, selection)).start.number
        if number < least:
            raise PictureError("one ball has no distance to another; it needs two or more")
        if number * (number - 1) > MOST_DISTANCES:
            raise PictureError(f"{number:,} balls have too many distances to show")
    return points


def _uniform_pairs(apart: Array, diameter: float) -> Array:
    """Density of the distance of two random points in a circle (disk line picking)."""
    s = np.clip(apart / diameter, 0.0, 1.0)
    density = 16 * s / math.pi * (np.arccos(s) - s * np.sqrt(1 - s * s)) / diameter
    return np.asarray(density)


def _verdict(excess: float, limit: float, good: str, bad: str) -> str:
    """Whether a limit is kept; if not, by how much, also in roundings of a double of its size."""
    if excess <= 0:
        return good
    roundings = short(excess / np.spacing(limit), 2)
    return f"{bad} by {short(excess, 2)} m, {roundings} roundings of a double"
