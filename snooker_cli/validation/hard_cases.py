"""``snooker bench hard``: scenes that could break an engine, checked with both engines.

No ball may be lost or overlap another, every number must be finite, and a run must end and give the
reason.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Self

from snooker_cli.config import EXAMPLES, load
from snooker_cli.containers import Circle
from snooker_cli.engine import simulate
from snooker_cli.errors import check_name
from snooker_cli.formatting import counted
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs.plan import checked
from snooker_cli.trace import Trace
from snooker_cli.validation import hard_case_checks as facts
from snooker_cli.validation.hard_case_checks import Check, ExactStart, checks
from snooker_cli.validation.study import LEGENDS, PLANS, Cells, Record, Study, small, table

FOLDER = EXAMPLES / "hard"  # the configs of the cases

LONGEST, SLOWEST = 60.0, 1e5
"""A run hangs if it takes longer than this time, s, plus its collisions at this rate, 1/s."""

INVARIANTS = ("energy", "momentum", "angular momentum", "overlap", "escape")
"""The checks that most cases have."""


@dataclass(frozen=True)
class HardCase:
    """A scene of ``configs/hard`` and what is known of it; plans.yaml explains the fields."""

    name: str
    endings: Sequence[str]
    fact: str | None = None
    by_name_only: bool = False


CASES = {name: HardCase(name, **known) for name, known in PLANS["hard"].items()}


@dataclass(frozen=True)
class HardCaseStudy(Study):
    """The cases to simulate."""

    name = "hard"
    libraries = ("numpy", "numba", "mpmath")

    cases: tuple[HardCase, ...]

    @classmethod
    def of(cls, names: Sequence[str]) -> Self:
        """The named cases, or all but those that take minutes.

        Raises ``UserError`` if there is no such case.
        """
        for name in names:
            check_name(name, CASES, "hard case", "snooker init --list")
        chosen = [CASES[name] for name in dict.fromkeys(names)]
        return cls(tuple(chosen or (one for one in CASES.values() if not one.by_name_only)))

    def results(self, report: Callable[[str], None]) -> Record:
        """Run all cases. Raises ``ConfigError`` if a config is missing or wrong."""
        found = []
        for case in self.cases:
            report(f"{case.name} ...")
            found.append(verdict(case))
        return {"cases": found}

    @staticmethod
    def passed(record: Record) -> bool:
        """Whether all cases hold."""
        return all(case["holds"] for case in record["cases"])

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        """The cases, their worst errors and faults."""
        cases = record["cases"]
        why: Cells = {"case": lambda case: case["name"], "why it is hard": lambda case: case["why"]}
        yield from table(cases, why, left=why)
        yield from ("", *LEGENDS["hard"], "")
        yield from table(cases, VERDICT_CELLS, left=("case", "ended", "verdict"))
        yield ""
        yield from (f"{case['name']}, {fault}" for case in cases for fault in case["faults"])
        failed = sum(not case["holds"] for case in cases)
        runs = counted(sum(case["runs"] for case in cases), "run")
        verdict = f"{counted(failed, 'case')} failed" if failed else "all hold"
        yield f"{counted(len(cases), 'case')}, {runs}: {verdict}"


def verdict(case: HardCase, folder: Path = FOLDER) -> Record:
    """Each point of a case's config with each engine that supports its container.

    The record has the worst of each check, the ``endings`` and the ``faults``.

    Raises ``ConfigError`` if there is no such config, or if its scene cannot exist.
    """
    loaded = load(folder / f"{case.name}.yaml")
    endings: Counter[str] = Counter()
    worst: dict[str, Check] = {}
    events, faults = 0, []
    points, _ = checked(loaded)
    for point in points:
        experiment = point.experiment
        scene = starting_scene(experiment, 0)
        exact = scene.container.has_wall and scene.number <= facts.FOLLOWED
        truth = facts.exact_start(scene) if exact else None
        limit = experiment.collisions
        for engine in ("allpairs", "cells") if isinstance(scene.container, Circle) else ("cells",):
            deadline = time.monotonic() + LONGEST + (limit or 0) / SLOWEST
            trace = simulate(
                scene,
                collisions=limit,
                time=experiment.time,
                summary=experiment.record == "summary",
                engine=engine,
                watch=lambda _, deadline=deadline: time.monotonic() > deadline,  # type: ignore[misc]
            )
            found, wrong = judged(case, trace, truth)
            for check in found:
                before = worst.setdefault(check.name, check)
                worst[check.name] = max(before, check, key=lambda one: (not one.holds, one.error))
            endings[trace.stop.reason.value] += 1
            events += trace.collisions
            label = ", ".join([engine, *(f"{key}={v}" for key, v in point.as_json().items())])
            faults += [f"{label}: {fault}" for fault in wrong]
    return {
        "name": case.name,
        "why": str(loaded.experiment.title),
        "events": events,
        "runs": endings.total(),
        "endings": [{"reason": reason, "runs": runs} for reason, runs in endings.items()],
        "worst": {
            name: {"error": check.error, "bound": check.bound, "holds": check.holds}
            for name, check in worst.items()
        },
        "holds": not faults,
        "faults": faults,
    }


def judged(
    case: HardCase, trace: Trace, truth: ExactStart | None = None
) -> tuple[list[Check], list[str]]:
    """The checks of a trace, and a sentence for each fault.

    truth : the first collisions, if they are known
    """
    found = checks(trace)
    if found[0].holds:  # nothing is measured of broken numbers
        if truth is not None and trace.events is not None:
            found += facts.follows(trace, truth)
        if case.fact is not None:
            found += getattr(facts, case.fact)(trace)
    faults = [
        f"{check.name}: {check.error:.2g} is over {check.bound:.2g}"
        for check in found
        if not check.holds
    ]
    reason = trace.stop.reason
    if reason not in case.endings:
        faults.append(f"it ended as {reason.value} instead of {' or '.join(case.endings)}")
    return found, faults


def _facts(case: Record) -> str:
    """How many of the checks hold that not every case has."""
    others = case["worst"].keys() - {"numbers", *INVARIANTS}
    return f"{sum(case['worst'][name]['holds'] for name in others)} of {len(others)}"


def _error(case: Record, name: str) -> str:
    """The worst error in an invariant; a dash for none."""
    if name not in case["worst"]:
        return "–"
    error = case["worst"][name]["error"]
    return "infinite" if error is None else small(error) if error else "0"


VERDICT_CELLS: Cells = {
    "case": lambda case: str(case["name"]),
    "events": lambda case: f"{case['events']:,}",
    "ended": lambda case: ", ".join(
        f"{each['runs']} {each['reason'].replace('_', ' ')}" for each in case["endings"]
    ),
    **{name: partial(_error, name=name) for name in INVARIANTS},
    "facts": _facts,
    "verdict": lambda case: "holds" if case["holds"] else "fails",
}
