"""What collisions keep: energy where they are elastic, and total momentum without fixed walls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.gallery.caption import setting
from snooker_cli.gallery.picture import Array, Layer, Line, Picture, PictureError, Reference
from snooker_cli.gallery.repeats import one_repeat
from snooker_cli.gallery.rows import thinned
from snooker_cli.gallery.selection import (
    Selection,
    elastic,
    label,
    require_motion,
    series_of_points,
)
from snooker_cli.observables import at_collisions, energy_ratio, momentum, series
from snooker_cli.scene import EPSILON
from snooker_cli.words import short

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run

ROUNDINGS = 1e-15
"""The unit of the momentum's deviation: about four roundings of a number near one."""


def energy(run: Run, selection: Selection) -> Picture:
    """Kinetic energy of balls and container over that at the start, one repeat a point."""
    points = series_of_points(run, selection)
    layers: list[Layer] = []
    records: list[dict[str, Any]] = []
    who = _bodies(points)
    for index, point in enumerate(points):
        trace = one_repeat(run, point, selection)
        found = series(trace)
        require_motion(trace.start)
        ratio = energy_ratio(found)
        kept = thinned(found.time)
        name = label(point, points)
        layers.append(Line(found.time[kept], ratio[kept], name, index, steps=True))
        records.append(
            {
                "parameters": point.as_json(),
                "elastic": elastic(point),
                "final_ratio": float(ratio[-1]),
                "largest_rise": max(0.0, float(np.max(np.diff(ratio), initial=0.0))),
                "largest_deviation": float(np.max(np.abs(ratio - 1))),
            }
        )
    said = []
    elastics = [each for each in records if each["elastic"]]
    if elastics:
        worst = max(each["largest_deviation"] for each in elastics)
        said.append(f"Elastic collisions keep the energy to {short(worst, 2)} of it")
    if len(elastics) < len(records):
        rise = max(each["largest_rise"] for each in records if not each["elastic"])
        said.append(
            "Inelastic collisions never raise the energy"
            if rise == 0
            else f"The largest rise by an inelastic collision is {short(rise, 2)} of the start"
        )
    return Picture(
        kind="energy",
        title=f"Kinetic energy of {who}",
        x_label="time (s)",
        y_label="kinetic energy, E(t)/E(0)",
        layers=tuple(layers),
        caption=f"{'. '.join(said)}. " + setting(run, points, selection, single=True),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_limits=(0.0, 1.05),
    )


def momentum_x(run: Run, selection: Selection) -> Picture:
    """The total momentum's x component: how far its ratio to the start is from 1."""
    return _momentum(run, selection, 0, "x")


def momentum_y(run: Run, selection: Selection) -> Picture:
    """The total momentum's y component: how far its ratio to the start is from 1."""
    return _momentum(run, selection, 1, "y")


def _momentum(run: Run, selection: Selection, component: int, name: str) -> Picture:
    if run.experiment.record == "summary":
        raise PictureError("it needs velocities; run the config with `record: events`")
    points = series_of_points(run, selection)
    layers: list[Layer] = [Reference("y", 0.0)]
    records: list[dict[str, Any]] = []
    who = _bodies(points)
    for index, point in enumerate(points):
        time, total = _total(run, point, selection, component, name)
        deviation = total / total[0] - 1
        kept = thinned(time)
        scaled = deviation[kept] / ROUNDINGS
        # Dashes would be lost in the noise.
        layers.append(Line(time[kept], scaled, label(point, points), index, "solid", steps=True))
        records.append(
            {
                "parameters": point.as_json(),
                "momentum_at_start": float(total[0]),
                "largest_deviation": float(np.max(np.abs(deviation))),
                "states": len(time),
            }
        )
    worst = max(each["largest_deviation"] for each in records)
    return Picture(
        kind=f"momentum-{name}",
        title=f"Total momentum in {name}, {who}",
        x_label="time (s)",
        y_label=f"(p{name}/p{name}(0) − 1) · 10¹⁵",
        layers=tuple(layers),
        caption=f"The ratio p{name}(t)/p{name}(0), summed from the velocities of {who} "
        f"at {max(each['states'] for each in records)} moments, stays 1 to within "
        f"{short(worst, 2)}, {short(worst / EPSILON, 2)} roundings of a number near 1. "
        + setting(run, points, selection, single=True),
        numbers={"largest_deviation": worst, "points": records},
        x_limits=(0.0, None),
    )


def _total(
    run: Run, point: Point, selection: Selection, component: int, name: str
) -> tuple[Array, Array]:
    """Times and one component of the total momentum, s and kg m/s. Raises ``PictureError``."""
    trace = one_repeat(run, point, selection)
    scene = trace.start
    if scene.shape == "box":
        raise PictureError("the walls of a box are fixed and take momentum")
    if scene.shape == "circle" and not scene.free:
        raise PictureError("a fixed container takes momentum; give it a finite container.mass")
    states = at_collisions(trace)
    total = momentum(states, scene)[:, component]
    parts = np.abs(scene.masses * scene.velocities[:, component])
    if abs(total[0]) <= scene.number * EPSILON * float(np.sum(parts)):
        raise PictureError(f"the momentum in {name} is zero at the start, so it has no ratio to it")
    return states.time, total


def _bodies(points: Sequence[Point]) -> str:
    """Whose energy and momentum are counted: a circle can move, boxes do not."""
    circle = any(point.experiment.container.shape == "circle" for point in points)
    return "balls and container" if circle else "the balls"
