"""How far ahead a scene can be computed: where the engine and the exact twin part ways."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.bench.exact import trajectory
from snooker_cli.engine import replay, simulate
from snooker_cli.scene import EPSILON, Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.trace import Events

SMALL, LARGE = 1e-13, 1e-3
"""The growth rate is fitted where the error of place, m, is beyond rounding and still linear."""


@dataclass(frozen=True)
class Question:
    """A kind of scene, a repeat each, and its Lyapunov exponent, 1/event, as known from elsewhere.

    The exponents are from pairs of runs whose starts differ by one rounding.
    """

    name: str
    what: str
    exponent: float
    repeats: int
    start: Callable[[int], Scene]

    @property
    def estimate(self) -> float:
        """Events until an error of one rounding is as large as what it is an error of."""
        return math.log(1 / EPSILON) / self.exponent


@dataclass(frozen=True)
class Horizon:
    """What was found in one repeat.

    parted : events before the first in which the engine has other bodies collide
    exponent : growth rate of the error of place, 1/event; nan if too few errors are in its range
    certain, digits : of the exact twin
    """

    repeat: int
    parted: int
    exponent: float
    certain: int
    digits: int


def horizon(question: Question, repeat: int) -> Horizon:
    """Follow a repeat until the engine and the exact twin part ways."""
    scene, collisions = question.start(repeat), math.ceil(question.estimate)
    while True:
        truth = trajectory(scene, collisions)
        trace = simulate(scene, collisions=collisions)
        assert trace.events is not None
        parted = first_different(trace.events, truth.events)
        if parted < truth.certain or truth.certain < collisions:
            break
        collisions = math.ceil(1.25 * collisions)
    times = truth.events.time[:parted]
    times = times[times <= trace.stop.time]
    places = replay(trace, times).positions
    errors = rms_distance(places, truth.states[1 : len(times) + 1, :-1, :2])
    kept = np.flatnonzero((errors > SMALL) & (errors < LARGE))
    exponent = math.nan
    if len(kept) > 1:
        exponent = float(np.polyfit(kept, np.log(errors[kept]), 1)[0])
    return Horizon(repeat, parted, exponent, truth.certain, truth.digits)


def first_different(events: Events, truth: Events) -> int:
    """How many events there are before the first in which other bodies collide, or the last."""
    common = min(len(events), len(truth))
    differs = (events.i[:common] != truth.i[:common]) | (events.j[:common] != truth.j[:common])
    return int(np.argmax(differs)) if differs.any() else common


def rms_distance(
    positions: NDArray[np.float64], others: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Root mean square over the balls of how far they are apart, (*k*,), m."""
    squares = np.sum((positions - others) ** 2, axis=2)
    mean: NDArray[np.float64] = np.sqrt(np.mean(squares, axis=1))
    return mean
