"""What a point's repeats measured, beside the predictions of theory."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.analysis import predictions
from snooker_cli.analysis.decay import curve, early_note, fit_curve, reported_constant
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
from snooker_cli.analysis.predictions import Comparison, ComparisonTable
from snooker_cli.formatting import counted, plain
from snooker_cli.trace import SPEED_BINS, StopReason

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

RELAXING = 5
"""Ball-ball collisions of a ball after which a gas that started at one speed counts as relaxed.

The kurtosis of its speeds has then come from 1 to 1.83 of 1.95.
"""


@dataclass(frozen=True)
class Comparisons:
    """All comparisons of a point, and notes for their reader, in sentences."""

    rows: tuple[Comparison, ...]
    notes: tuple[str, ...]


def measured(trace: Trace, since: float) -> dict[str, float]:
    """Means over time of one repeat from a time (s) to its end.

    pressure : on the wall, or by the virial, Pa m; virial_ratio : PV/NT of the balls by the virial
    temperature, root_temperature : of T and of its root, J and J^(1/2)
    meeting_temperature, root_meeting_temperature : the same of the temperature at which balls meet
    mean_speed : m/s; kurtosis : <v^4>/<v^2>^2
    pair_rate, wall_rate : collisions of one ball per second
    """
    found, scene = series(trace), trace.start
    warm = temperature(found, scene.number)
    met = meeting_temperature(found.kinetic_energy, scene)
    length = scene.number * (trace.stop.time - since)

    def rate(column: NDArray[np.float64]) -> float:
        return gained(trace, column, since) / length if length > 0 else math.nan

    return {
        "pressure": mean_pressure(trace, since),
        "virial_ratio": virial_ratio(trace, since),
        "temperature": time_mean(trace, warm, since),
        "root_temperature": time_mean(trace, np.sqrt(warm), since),
        "meeting_temperature": time_mean(trace, met, since),
        "root_meeting_temperature": time_mean(trace, np.sqrt(np.maximum(met, 0.0)), since),
        "mean_speed": time_mean(trace, found.mean_speed, since),
        "kurtosis": time_mean(trace, found.energy_moment, since),
        "pair_rate": 2 * rate(found.pair_events),
        "wall_rate": rate(found.wall_events),
    }


def lost(trace: Trace) -> dict[str, float]:
    """How one repeat lost its energy, from start to end.

    decay_constant, pressure_decay_constant, haff_rate : fitted, 1/s
    reported_constant : what the source report predicts for the first, 1/s
    start_temperature : at which balls meet, J
    pair_events, wall_events : collisions, without those of a collapse
    energy_left : kinetic energy after them over that at the start
    """
    energy, calm = curve(trace, "kinetic_energy"), before_collapse(trace)
    found = series(calm)
    return {
        "decay_constant": fit_curve(energy, "exponential").value,
        "pressure_decay_constant": fit_curve(curve(trace, "pressure"), "exponential").value,
        "haff_rate": fit_curve(energy, "haff").value,
        "reported_constant": reported_constant(trace),
        "start_temperature": float(meeting_temperature(found.kinetic_energy, trace.start)[0]),
        "pair_events": calm.pair_events,
        "wall_events": calm.wall_events,
        "energy_left": float(energy_ratio(found)[-1]),
    }


def relaxing(number: int) -> int:
    """Ball-ball collisions in which a gas of ``number`` balls relaxes; none for one ball."""
    return math.ceil(RELAXING * number / 2) if number > 1 else 0


def relaxed_at(trace: Trace) -> float | None:
    """When a repeat has relaxed, s; ``None`` if fewer than as many collisions follow."""
    needed = relaxing(trace.start.number)
    if trace.pair_events < 2 * needed:
        return None
    found = series(trace)
    return float(found.time[np.searchsorted(found.pair_events, needed)])


def compare(traces: Iterable[Trace]) -> Comparisons:
    """A point's repeats beside every theory that applies to its scene.

    Pressures, rates and speeds are those of the part of each repeat after its relaxation.
    """
    ended: Counter[StopReason] = Counter()
    relaxed: list[dict[str, float]] = []
    losses: list[dict[str, float]] = []
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
            relaxed.append(measured(trace, since))
            counts += reduced_speed_counts(trace, since)
    notes, total = [early_note(ended)], sum(ended.values())
    if len(losses) < total:
        idle = total - len(losses)
        which = "the repeat" if total == 1 else f"{idle} of {total} repeats"
        notes.append(f"{which} {'has' if idle == 1 else 'have'} no collisions")
    rows: list[Comparison] = []
    if scene is not None:
        notes += [
            _relaxation_note(scene.number, losses, len(relaxed)),
            predictions.shape_note(scene),
            predictions.missing_note(scene),
        ]
        with np.errstate(divide="ignore", invalid="ignore"):  # rows without a value are left out
            if relaxed:
                table = ComparisonTable(relaxed, rows, notes)
                predictions.ideal_gas(table, scene)
                predictions.hard_disks(table, scene)
                predictions.speeds(table, scene, counts)
            predictions.cooling(ComparisonTable(losses, rows, notes), scene)
    return Comparisons(tuple(rows), tuple(filter(None, notes)))


def record(row: Comparison, parameters: dict[str, Any]) -> dict[str, Any]:
    """A comparison as JSON; what is not a number is null."""
    values = {"parameters": parameters, **vars(row), "difference_in_errors": row.in_errors}
    return {key: plain(value) for key, value in values.items()}


def _relaxation_note(number: int, losses: list[dict[str, float]], relaxed: int) -> str:
    """Which collisions the means over time skip, and which repeats are too short for them."""
    needed, repeats = relaxing(number), len(losses)
    if not needed:
        return ""
    if relaxed == repeats:
        return (
            f"pressures, rates and speeds skip the first {needed} ball-ball collisions (relaxation)"
        )
    events = [int(one["pair_events"]) for one in losses if one["pair_events"] < 2 * needed]
    have = counted(max(events), "ball-ball collision")
    if min(events) < max(events):
        have = f"{min(events)} to {have}"
    which = "the repeat is" if repeats == 1 else f"{len(events)} of {repeats} repeats are"
    return (
        f"{which} too short for pressures, rates and speeds: {have}, and {2 * needed} are needed "
        f"({needed} for the relaxation)"
    )
