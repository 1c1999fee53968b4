"""Our value of every printed number, for the scene exactly as the report states it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.decay import Decay, Law, Quantity, decays, reported_constant
from snooker_cli.gallery.selection import Selection, selected, value_at
from snooker_cli.observables import (
    at_collisions,
    central_distances,
    ideal_gas_ratio,
    mean_and_error,
    mean_pressure,
    momentum,
    pair_distances,
)
from snooker_cli.report.published import COEFFICIENTS, PUBLISHED, Ours, Property
from snooker_cli.report.search import Sample, mean_speed

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

Runs = Mapping[str, "Run"]
Laws = Mapping[tuple[Quantity, Law], Decay]


@dataclass(frozen=True)
class Stated:
    """What the stated scene gives.

    numbers : by the name of the printed number
    scene : the start of a repeat
    laws : by CoR, the decay constants over all repeats
    local : by CoR, how many times as fast as the energy the pressure decays in windows of time
    """

    numbers: dict[str, Ours]
    scene: Scene
    laws: Mapping[float, Laws]
    local: dict[float, Ours]


def as_stated(runs: Runs) -> Stated:
    """Our value of every printed number, and what the report's sentences are checked with."""
    whole = runs["restitution"]
    elastic = list(whole.traces(point_of(whole, cor=1.0)))
    scene = elastic[0].start
    singles = {**_exact(runs["decay"]), **_of_the_scene(scene)}
    samples: dict[tuple[Property, float | None], Sample] = {
        ("pressure", None): Sample.over([mean_pressure(trace) for trace in elastic])
    }
    laws: dict[float, Laws] = {}
    local = {}
    for cor in COEFFICIENTS:
        traces = list(whole.traces(point_of(whole, cor=cor)))
        laws[cor] = {(one.quantity, one.law): one for one in decays(traces)}
        local[cor] = _local_ratio(laws[cor])
        for of, sample in _cooling(cor, traces, laws[cor]).items():
            samples[of, cor] = sample
    numbers = {}
    for number in PUBLISHED:
        if number.of in ("temperature ratio", "pressure ratio"):
            numbers[number.name] = _limit(runs, number.of, number.radius)
        elif number.of in singles:
            numbers[number.name] = singles[number.of]
        else:
            numbers[number.name] = samples[number.of, number.cor].beside(number)
    return Stated(numbers, scene, laws, local)


def point_of(run: Run, **values: float) -> Point:
    """The first point with these values; in keys, ``__`` stands for a point."""
    where = {key.replace("__", "."): value for key, value in values.items()}
    return selected(run, Selection(where))[0]


def _cooling(cor: float, traces: Sequence[Trace], laws: Laws) -> dict[Property, Sample]:
    """What the report takes from its inelastic runs."""

    def constants(quantity: Quantity) -> Sample:
        fits = laws[quantity, "exponential"].fits
        return Sample.over([one.value for one in fits if one.converged])

    by_theory = [reported_constant(trace) for trace in traces]
    return {
        "energy decay": constants("kinetic_energy"),
        "temperature decay": constants("temperature"),
        "pressure decay": constants("pressure"),
        "pressure decay, doubled": constants("pressure").times(2),
        "mean speed": Sample.over([mean_speed(trace) for trace in traces]),
        "theory": Sample.over(by_theory),
        "tau": Sample.over([-2 * math.log(cor) / constant for constant in by_theory]),
    }


def _exact(run: Run) -> dict[Property, Ours]:
    """The extremes over all repeats of the scene of the figures: distances and momentum."""
    largest, smallest, worst = -math.inf, math.inf, np.ones(2)
    for point in run.points:
        for trace in run.traces(point):
            states = at_collisions(trace)
            largest = max(largest, float(central_distances(states).max()))
            smallest = min(smallest, float(pair_distances(states, trace.start).min()))
            total = momentum(states, trace.start)
            ratios = total / total[0]
            found = np.take_along_axis(ratios, np.abs(ratios - 1).argmax(axis=0)[None], axis=0)[0]
            worst = np.where(np.abs(found - 1) > np.abs(worst - 1), found, worst)
    return {
        "central distance": Ours(largest),
        "pair distance": Ours(smallest),
        "momentum x": Ours(float(worst[0])),
        "momentum y": Ours(float(worst[1])),
    }


def _of_the_scene(scene: Scene) -> dict[Property, Ours]:
    """What follows from the scene alone, by the report's formulas."""
    density = theory.number_density(scene.number, scene.area)
    radius = float(scene.radii[0])
    return {
        "density": Ours(density),
        "cross-section": Ours(2 * math.pi * radius),
        "mean free path": Ours(theory.report_mean_free_path(density, radius)),
    }


def _limit(runs: Runs, of: Property, radius: float | None) -> Ours:
    """A ratio to the ideal gas of elastic balls so small that it should be 1."""
    if of == "temperature ratio":
        run = runs["radius"]
        point = min(run.points, key=lambda point: float(value_at(point, "balls.radius")))
    else:
        run = runs["dilute"]
        point = selected(run, Selection({"cor": 1.0, "balls.radius": radius}))[0]
    traces = list(run.traces(point))
    scene = traces[0].start
    radius = float(scene.radii[0])
    circle = theory.circle(scene.container_radius, radius)
    disks = theory.fluid_state(scene.number, 1.0, radius, circle).pressure
    expected = disks / theory.ideal_gas_pressure(scene.number, 1.0, scene.area)
    ratios = np.array([ideal_gas_ratio(trace) for trace in traces])
    if of == "temperature ratio":
        ratios, expected = 1 / ratios, 1 / expected
    return Ours(*mean_and_error(ratios), abs(expected - 1))


def _local_ratio(laws: Laws) -> Ours:
    """Decay constant of the pressure in windows of time over that of the energy in the same."""
    pressure, energy = (
        laws[quantity, "exponential"].fits for quantity in ("local_pressure", "local_energy")
    )
    ratios = [
        one.value / other.value
        for one, other in zip(pressure, energy, strict=True)
        if one.converged and other.converged
    ]
    return Ours(*mean_and_error(np.array(ratios)))
