"""The whole measurement of speed as one record, with the machine that it holds for."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

from snooker_cli.bench.origin import origin
from snooker_cli.bench.speed import (
    CASES,
    MOST,
    QUICK,
    QUICK_CASES,
    Case,
    Effort,
    Timing,
    crossover,
    measure,
)
from snooker_cli.bench.speed_costs import cooling, memory, recording
from snooker_cli.gallery import plain


@dataclass(frozen=True)
class Plan:
    """What to measure.

    recorded : collisions in a run that is stored
    resident : the case whose memory is measured
    """

    cases: Sequence[Case]
    effort: Effort
    cooled: Case
    recorded: int
    resident: Case


FULL = Plan(CASES, Effort(), Case(1000, 0.4, cor=0.9), 1_000_000, Case(100_000, 0.4))
ALL = replace(FULL, cases=[*CASES, *MOST], resident=MOST[0])
SMALL = Plan(QUICK_CASES, QUICK, Case(100, 0.05, cor=0.9), 5000, Case(5000, 0.4))


def measured(plan: Plan, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure; the record, as JSON has it.

    tell : is given a word on what is measured, from time to time
    """
    began, load = datetime.now(UTC), _load()
    tell(f"memory of {plan.resident.balls:,} balls")
    bytes_a_ball = memory(plan.resident)
    timings = []
    for number, case in enumerate(dict.fromkeys(plan.cases), start=1):
        tell(f"gas {number} of {len(plan.cases)}: {case.balls:,} balls at packing {case.packing:g}")
        timings.append(measure(case, plan.effort))
    tell("recording")
    report = Case(37, 0.37, free=True)
    stored = recording(report, plan.recorded, plan.effort.repeats)
    tell("cooling")
    cold = cooling(plan.cooled, plan.effort)
    head = origin("speed", began, "numpy", "numba", "h5py")
    record: dict[str, Any] = plain(
        head
        | {
            "machine": head["machine"] | {"load": load},
            "cases": [timing.as_json() for timing in timings],
            "crossover": crossover(timings),
            "growth": growth(timings),
            "recording": vars(stored),
            "cooling": vars(cold),
            "memory": {"balls": plan.resident.balls, "bytes_a_ball": bytes_a_ball},
        }
    )
    return record


def growth(timings: Sequence[Timing]) -> list[dict[str, float]]:
    """The time for a collision over that of a thousand balls, for many more at their packing."""
    plain_ones = [
        timing
        for timing in timings
        if timing.case == Case(timing.case.balls, 0.4) and timing.case.balls >= 1000
    ]
    if not plain_ones:
        return []
    least = min(plain_ones, key=lambda timing: timing.case.balls)
    return [
        {"balls": timing.case.balls, "times": least.median / timing.median}
        for timing in plain_ones
        if timing is not least
    ]


def _load() -> float | None:
    """Programs that wanted to run in the last minute, where the system tells."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None
