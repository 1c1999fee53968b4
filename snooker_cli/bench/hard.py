"""The judge of the hard cases: runs each with both engines and holds it to all that must be true.

Balls may not be lost, nor overlap, nor a number be none, and a run has to end, and to say how.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli.arrange import arrange
from snooker_cli.bench.hard_catalogue import CASES, Hard
from snooker_cli.bench.hard_checks import Check, checks
from snooker_cli.bench.origin import origin
from snooker_cli.config import load
from snooker_cli.engine import simulate
from snooker_cli.scene import SceneError
from snooker_cli.trace import StopReason

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

FOLDER = Path("configs", "hard")

PATIENCE, SPEED = 60.0, 1e5
"""A run hangs if it takes this long, s, and longer than its collisions at so many in a second."""

INVARIANTS = ("energy", "momentum", "angular momentum", "virial", "overlap", "escape")


@dataclass(frozen=True)
class Ran:
    """One run of a case: a point of its config, with one engine."""

    parameters: dict[str, Any]
    engine: str
    events: int
    ended: StopReason
    message: str
    time: float
    seconds: float
    checks: tuple[Check, ...]
    faults: tuple[str, ...]


def judged(case: Hard, trace: Trace, *, whole: bool = True) -> tuple[list[Check], list[str]]:
    """What was checked of a trace, and a sentence for each thing that is wrong with it.

    whole : if not, it was cut short by fewer collisions, and need not end as the case does
    """
    found = checks(trace)
    # What is broken is no more to be measured.
    if case.fact is not None and whole and found[0].holds:
        found += case.fact(trace)
    faults = [
        f"{check.name}: {check.error:.2g} is over {check.bound:.2g}"
        for check in found
        if not check.holds
    ]
    endings = case.endings if whole else (*case.endings, StopReason.COLLISIONS)
    reason = trace.stop.reason
    if reason not in endings:
        faults.append(f"it ended as {reason.value} instead of {' or '.join(endings)}")
    if not trace.stop.message:
        faults.append("it ended in silence")
    return found, faults


def runs(case: Hard, folder: Path, most: int | None = None) -> Iterator[Ran]:
    """All runs of a case.

    most : collisions at most, instead of those that the config asks for

    Raises ``ConfigError`` if there is no such config, or none of a scene that can be.
    """
    loaded = load(folder / f"{case.name}.yaml")
    for point in loaded.points():
        try:
            scene = arrange(point.experiment, 0)
        except SceneError as error:
            raise loaded.error(error.key, str(error)) from None
        for engine in ("allpairs", "cells") if scene.shape == "circle" else ("cells",):
            yield _ran(case, point, scene, engine, most)


def _ran(case: Hard, point: Point, scene: Scene, engine: str, most: int | None) -> Ran:
    """One point with one engine."""
    experiment = point.experiment
    asked = experiment.collisions
    limit = asked if most is None else min(most, asked or most)
    begun = time.monotonic()
    patience = PATIENCE + (limit or 0) / SPEED
    trace = simulate(
        scene,
        collisions=limit,
        time=experiment.time,
        summary=experiment.record == "summary",
        engine=engine,
        watch=lambda _: time.monotonic() - begun > patience,
    )
    seconds = time.monotonic() - begun
    found, faults = judged(case, trace, whole=limit == asked)
    return Ran(
        parameters=point.as_json(),
        engine=engine,
        events=trace.collisions,
        ended=trace.stop.reason,
        message=trace.stop.message,
        time=trace.stop.time,
        seconds=seconds,
        checks=tuple(found),
        faults=tuple(faults),
    )


def measured(
    cases: Sequence[Hard], folder: Path = FOLDER, say: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """The verdicts on cases, as plain data. Raises ``ConfigError`` if a config is missing."""
    began, found = datetime.now(UTC), []
    for case in cases:
        say(f"{case.name} ...")
        why = load(folder / f"{case.name}.yaml").experiment.title
        found.append(_verdict(case, str(why), folder))
    return origin("hard cases", began, "numpy", "numba") | {
        "cases": found,
        "left_out": [case.name for case in CASES if case.by_name_only and case not in cases],
    }


def _verdict(case: Hard, why: str, folder: Path) -> dict[str, Any]:
    """A case's runs, the worst of each check, how they ended, and whether all is as it must be."""
    done = list(runs(case, folder))
    by_name: dict[str, list[Check]] = {}
    for ran in done:
        for check in ran.checks:
            by_name.setdefault(check.name, []).append(check)
    by_ending: dict[StopReason, list[Ran]] = {}
    for ran in done:
        by_ending.setdefault(ran.ended, []).append(ran)
    return {
        "name": case.name,
        "why": why,
        "events": sum(ran.events for ran in done),
        "endings": [
            {"reason": reason.value, "runs": len(each), "message": each[0].message}
            for reason, each in by_ending.items()
        ],
        "worst": {
            name: {
                **_plain(max(each, key=lambda check: (not check.holds, check.error))),
                "holds": all(check.holds for check in each),
            }
            for name, each in by_name.items()
        },
        "holds": not any(ran.faults for ran in done),
        "faults": [f"{_label(ran)}: {fault}" for ran in done for fault in ran.faults],
        "runs": [
            {
                **asdict(ran),
                "ended": ran.ended.value,
                "checks": [
                    {"name": each.name, **_plain(each), "holds": each.holds} for each in ran.checks
                ],
            }
            for ran in done
        ],
    }


def _plain(check: Check) -> dict[str, Any]:
    """An error and its bound; ``None`` for what is no number, which JSON has not."""
    return {
        key: value if abs(value) < float("inf") else None
        for key, value in (("error", float(check.error)), ("bound", float(check.bound)))
    }


def _label(ran: Ran) -> str:
    """Which run of a case: its engine and its point."""
    return ", ".join([ran.engine, *(f"{key}={value}" for key, value in ran.parameters.items())])
