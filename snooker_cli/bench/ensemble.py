"""What a method does to averages over many starts, where no trajectory can be compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from snooker_cli.bench.methods import Course, Method
    from snooker_cli.scene import Scene

ROUNDING = 1e-9
"""No overlap that rounding makes is deeper, m: a collision came late or not at all."""


@dataclass(frozen=True)
class Ensemble:
    """Starts, a repeat each, that are followed for the same time, s."""

    name: str
    what: str
    time: float
    start: Callable[[int], Scene]


@dataclass(frozen=True)
class Bias:
    """A quantity's mean over the repeats, and how far it is from the first method's.

    Standard errors over the repeats. The difference is taken repeat by repeat: both start alike, so
    that its error is smaller than that of the means.
    """

    quantity: str
    mean: float
    error: float
    difference: float
    difference_error: float


@dataclass(frozen=True)
class Averages:
    """A method's averages, the deepest overlap in any of its repeats, m, and how many overlap."""

    method: str
    step: float | None
    biases: tuple[Bias, ...]
    overlap: float
    overlapping: int


def averages(ensemble: Ensemble, methods: Sequence[Method], repeats: int) -> list[Averages]:
    """The averages of each method; the others are set against the first."""
    found: list[Averages] = []
    moments = np.array([ensemble.time])
    columns: dict[str, np.ndarray] = {}
    for method in methods:
        rows, overlaps = [], []
        for repeat in range(repeats):
            course = method.run(ensemble.start(repeat), moments)
            rows.append(quantities(course, ensemble.time))
            overlaps.append(course.overlap)
        values = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        columns = columns or values
        biases = tuple(
            Bias(name, *_mean(value), *_mean(value - columns[name]))
            for name, value in values.items()
        )
        overlapping = sum(overlap > ROUNDING for overlap in overlaps)
        found.append(Averages(method.name, method.step, biases, max(overlaps), overlapping))
    return found


def quantities(course: Course, time: float) -> dict[str, float]:
    """Averages of one repeat over a time, s.

    The decay constant, k = ln(E(0)/E(t))/t of balls and container, is left out where all collisions
    are elastic.
    """
    start, events = course.start, course.events
    at_wall = events.at_wall
    found = {
        "pressure, Pa m": float(np.sum(events.impulse[at_wall])) / (start.wall_length * time),
        "collisions, 1/s": len(events) / time,
    }
    if min(start.restitution, start.wall_restitution) == 1:
        return found
    before, after = (each.kinetic_energy + each.container_energy for each in (start, course.finish))
    return {"decay constant, 1/s": math.log(before / after) / time, **found}


def _mean(values: np.ndarray) -> tuple[float, float]:
    """Mean and its standard error."""
    error = float(np.std(values, ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else math.nan
    return float(np.mean(values)), error
