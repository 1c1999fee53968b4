"""The distribution of speeds beside Maxwell and Boltzmann's and the one at fixed energy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
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
    laws: dict[tuple[int, float], None] = {}
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
        laws[scene.number, unit] = None
        distance = _distance(counts, edges, scene.number)
        records.append(
            {
                "parameters": point.as_json(),
                "speeds": int(total),
                "distance_from_fixed_energy": distance,
                "one_over_root": float(total**-0.5),
            }
        )
        name = label(point, points)
        said.append(f"{distance:.4f} ({name + ', ' if name else ''}1/√n = {total**-0.5:.4f})")
    for index, (number, unit) in enumerate(laws):
        layers += _laws(number, unit, named=index == 0)
    return Picture(
        kind="speeds",
        title="Distribution of speeds",
        x_label="speed (m/s)" if in_metres else "reduced speed v √(m/2T)",
        y_label="probability density (s/m)" if in_metres else "probability density",
        layers=tuple(layers),
        caption="Largest difference between the cumulative shares of n speeds and the law at fixed "
        f"energy: {listed(said)}. Sampled at even times about five collisions of a ball apart. "
        + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def _laws(number: int, unit: float, *, named: bool) -> list[Layer]:
    """Maxwell-Boltzmann and the law of so many balls at fixed energy, speeds in ``unit``."""
    reduced = np.linspace(0.0, 3.0, 120)
    maxwell = theory.maxwell_speed_density(reduced, REDUCED_TEMPERATURE) / unit
    fixed = theory.fixed_energy_speed_density(reduced, number, REDUCED_TEMPERATURE) / unit
    return [
        Line(
            reduced * unit,
            np.asarray(maxwell),
            "Maxwell–Boltzmann" if named else None,
            NEUTRAL,
            "dashed",
        ),
        Line(
            reduced * unit,
            np.asarray(fixed),
            f"fixed energy, N = {number}" if named else None,
            NEUTRAL,
            "dotted",
        ),
    ]


def _distance(counts: Array, edges: Array, number: int) -> float:
    """Largest difference of cumulative shares, at the bins' edges, from the law at fixed energy."""
    shares = np.cumsum(counts) / counts.sum()
    law = theory.fixed_energy_speed_cdf(edges[1:], number, REDUCED_TEMPERATURE)
    return float(np.max(np.abs(shares - law)[:-1]))
