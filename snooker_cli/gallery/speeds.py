"""The distribution of speeds beside Maxwell and Boltzmann's and the one at fixed energy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import kinetic, theory
from snooker_cli.gallery.caption import setting
from snooker_cli.gallery.picture import (
    NEUTRAL,
    Array,
    Histogram,
    Layer,
    Line,
    Picture,
    PictureError,
)
from snooker_cli.gallery.repeats import one_repeat, repeats
from snooker_cli.gallery.selection import (
    Selection,
    elastic,
    label,
    series_of_points,
)
from snooker_cli.observables import equal_balls, reduced_speed_counts
from snooker_cli.trace import SPEED_BIN, SPEED_BINS
from snooker_cli.words import listed

if TYPE_CHECKING:
    from snooker_cli.results import Run

LEAST_SPEEDS = 100
"""Fewer tell no more of a distribution than a tenth, 1/√n."""

REDUCED_TEMPERATURE = 0.5
"""The reduced speed v sqrt(m/2T) is the speed of a ball of mass 1 at this temperature."""


def speeds(run: Run, selection: Selection) -> Picture:
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
            raise PictureError("it needs two or more balls that move")
        counts = np.zeros(SPEED_BINS)
        for trace in repeats(run, point, selection):
            counts += reduced_speed_counts(trace)
        total = counts.sum()
        if total < LEAST_SPEEDS:
            raise PictureError(
                f"the balls have met too rarely: {total:.0f} speeds that have mixed are no "
                "distribution; run longer or more repeats"
            )
        unit = 1.0
        if in_metres:
            unit = float(np.sqrt(2 * scene.kinetic_energy / scene.number / scene.masses[0]))
        used = int(np.max(np.flatnonzero(counts))) + 1
        heights = counts[:used] / (total * SPEED_BIN * unit)
        layers.append(Histogram(edges[: used + 1] * unit, heights, label(point, points), index))
        free = kinetic.free_velocities(scene)
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
    return Picture(
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
