"""What a point's repeats measured beside what theory predicts, difference in standard errors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.compare.measuring import (
    RELAXING,
    Lost,
    Measured,
    lost,
    measure,
    relaxed_at,
    relaxing,
)
from snooker_cli.compare.predictions import (
    cooling,
    exceptions,
    hard_disks,
    ideal_gas,
    shape,
    speeds,
)
from snooker_cli.compare.table import Comparison, Comparisons, Table
from snooker_cli.decay import used_up_to_there
from snooker_cli.observables import before_collapse, reduced_speed_counts
from snooker_cli.trace import SPEED_BINS, StopReason
from snooker_cli.words import counted

if TYPE_CHECKING:
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

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
    table, total = Table(), sum(ended.values())
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
