"""What a point's repeats measured beside what theory predicts, difference in standard errors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.analysis.decay import curve, fit_curve, reported_constant, used_up_to_there
from snooker_cli.analysis.observables import (
    before_collapse,
    energy_ratio,
    gained,
    mean_pressure,
    meeting_temperature,
    reduced_speed_counts,
    series,
    temperature,
    time_mean,
    virial_ratio,
)
from snooker_cli.analysis.predictions import (
    Comparison,
    Comparisons,
    ComparisonTable,
    cooling,
    exceptions,
    hard_disks,
    ideal_gas,
    shape,
    speeds,
)
from snooker_cli.formatting import counted
from snooker_cli.trace import SPEED_BINS, StopReason

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace


# What one repeat measured: means over time, from when on it has relaxed, and how it cooled.

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


__all__ = ["Comparison", "Comparisons", "compare", "record"]


def compare(traces: Iterable[Trace]) -> Comparisons:
    """A point's repeats beside every theory that its scene has.

    Pressures, rates and speeds are those of the part of each repeat in which it has relaxed.
    """
    ended: Counter[StopReason] = Counter()
    relaxed: list[Measured] = []
    losses: list[Lost] = []
    counts = np.zeros(SPEED_BINS, dtype=np.int64)
    scene: Scene | None = None
    for trace in traces:
        ended[trace.stop.reason] += 1
        if trace.collisions == 0:
            continue
        scene = trace.start
        losses.append(lost(trace))
        trace = before_collapse(trace)
        since = relaxed_at(trace)
        if since is not None:
            relaxed.append(measure(trace, since))
            counts += reduced_speed_counts(trace, since)
    table, total = ComparisonTable(), sum(ended.values())
    table.note(used_up_to_there(ended))
    if len(losses) < total:
        idle = total - len(losses)
        which = "the repeat" if total == 1 else f"{idle} of {total} repeats"
        table.note(f"{which} {'has' if idle == 1 else 'have'} no collisions")
    if scene is not None:
        table.note(_relaxation(scene.number, losses, len(relaxed)))
        table.note(shape(scene))
        table.note(exceptions(scene))
        with np.errstate(divide="ignore", invalid="ignore"):  # what has no value is left out
            if relaxed:
                table.columns = relaxed
                ideal_gas(table, scene)
                hard_disks(table, scene)
                speeds(table, scene, counts)
            table.columns = losses
            cooling(table, scene)
    return Comparisons(tuple(table.rows), tuple(table.notes))


def record(row: Comparison, parameters: dict[str, Any]) -> dict[str, Any]:
    """A comparison as JSON; what is not a number is null."""
    values = {"parameters": parameters, **vars(row), "difference_in_errors": row.in_errors}
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in values.items()
    }


def _relaxation(number: int, losses: list[Lost], relaxed: int) -> str:
    """From when on equilibrium is measured, and in how many of the repeats."""
    needed, repeats = relaxing(number), len(losses)
    if not needed:
        return ""
    if relaxed == repeats:
        return (
            f"pressures, rates and speeds are those after the first {needed} ball-ball collisions, "
            f"{RELAXING} a ball, in which the speeds mix"
        )
    events = [one.pair_events for one in losses if one.pair_events < 2 * needed]
    have = counted(max(events), "ball-ball collision")
    if min(events) < max(events):
        have = f"{min(events)} to {have}"
    which = "the repeat" if repeats == 1 else f"{len(events)} of {repeats} repeats"
    return (
        f"no pressures, rates and speeds of {which}, with {have}: the speeds mix in {needed}, "
        f"{RELAXING} a ball, and as many again are needed to measure"
    )
