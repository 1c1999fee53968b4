"""What one repeat measured: means over time, from when on it has relaxed, and how it cooled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.decay import curve, fit_curve, reported_constant
from snooker_cli.observables import (
    before_collapse,
    energy_ratio,
    gained,
    mean_pressure,
    meeting_temperature,
    series,
    temperature,
    time_mean,
    virial_ratio,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.trace import Trace

RELAXING = 5
"""Ball-ball collisions of a ball after which a gas that started at one speed counts as relaxed.

The kurtosis of its speeds has then come from 1 to 1.83 of 1.95.
"""


@dataclass(frozen=True)
class Measured:
    """What one repeat measured, means over time.

    pressure : impulse on the wall over its length and the time, or by the virial, Pa m
    virial_ratio : PV/NT of the balls, by the virial
    temperature, root_temperature : mean of T and of its root, J and J^(1/2)
    meeting_temperature, root_meeting_temperature : the same of that at which balls meet
    mean_speed : m/s; kurtosis : <v^4>/<v^2>^2
    pair_rate, wall_rate : collisions of one ball per second
    """

    pressure: float
    virial_ratio: float
    temperature: float
    root_temperature: float
    meeting_temperature: float
    root_meeting_temperature: float
    mean_speed: float
    kurtosis: float
    pair_rate: float
    wall_rate: float


@dataclass(frozen=True)
class Lost:
    """How one repeat lost its energy, from start to end.

    decay_constant, pressure_decay_constant, haff_rate : fitted, 1/s
    reported_constant : what the report predicts for the first, 1/s
    pair_events, wall_events : collisions, without those of a collapse
    energy_left : kinetic energy after them over that at the start
    """

    decay_constant: float
    pressure_decay_constant: float
    haff_rate: float
    reported_constant: float
    start_temperature: float
    pair_events: int
    wall_events: int
    energy_left: float


def measure(trace: Trace, since: float) -> Measured:
    """What one repeat measured from a time (s) to its end."""
    found, scene, end = series(trace), trace.start, trace.stop.time
    warm = temperature(found, scene.number)
    met = meeting_temperature(found.kinetic_energy, scene)

    def rate(column: NDArray[np.float64]) -> float:
        length = scene.number * (end - since)
        return gained(trace, column, since) / length if length > 0 else math.nan

    return Measured(
        pressure=mean_pressure(trace, since),
        virial_ratio=virial_ratio(trace, since),
        temperature=time_mean(trace, warm, since),
        root_temperature=time_mean(trace, np.sqrt(warm), since),
        meeting_temperature=time_mean(trace, met, since),
        root_meeting_temperature=time_mean(trace, np.sqrt(np.maximum(met, 0.0)), since),
        mean_speed=time_mean(trace, found.mean_speed, since),
        kurtosis=time_mean(trace, found.energy_moment, since),
        pair_rate=2 * rate(found.pair_events),
        wall_rate=rate(found.wall_events),
    )


def lost(trace: Trace) -> Lost:
    """How one repeat lost its energy."""
    energy, calm = curve(trace, "kinetic_energy"), before_collapse(trace)
    found = series(calm)
    return Lost(
        decay_constant=fit_curve(energy, "exponential").value,
        pressure_decay_constant=fit_curve(curve(trace, "pressure"), "exponential").value,
        haff_rate=fit_curve(energy, "haff").value,
        reported_constant=reported_constant(trace),
        start_temperature=float(meeting_temperature(found.kinetic_energy, trace.start)[0]),
        pair_events=calm.pair_events,
        wall_events=calm.wall_events,
        energy_left=float(energy_ratio(found)[-1]),
    )


def relaxing(number: int) -> int:
    """Ball-ball collisions in which a gas of so many balls relaxes; none for one ball."""
    return math.ceil(RELAXING * number / 2) if number > 1 else 0


def relaxed_at(trace: Trace) -> float | None:
    """When a repeat has relaxed, s; ``None`` if it has not as many collisions again after that."""
    needed = relaxing(trace.start.number)
    if trace.pair_events < 2 * needed:
        return None
    found = series(trace)
    return float(found.time[np.searchsorted(found.pair_events, needed)])
