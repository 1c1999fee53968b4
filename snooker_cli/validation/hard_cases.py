"""``snooker bench hard``: scenes that could break an engine, checked with both engines.

No ball may be lost or overlap another, every number must be finite, and a run must end and give the
reason.
"""

from __future__ import annotations

import difflib
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli.config import load
from snooker_cli.containers import Circle
from snooker_cli.engine import simulate
from snooker_cli.errors import SceneError, UserError
from snooker_cli.formatting import Column, counted, table_lines
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import StopReason
from snooker_cli.validation import hard_case_checks as facts
from snooker_cli.validation.hard_case_checks import Check, checks
from snooker_cli.validation.study import Record, Study, small

if TYPE_CHECKING:
    from snooker_cli.trace import Trace

FOLDER = Path("configs", "hard")

LONGEST, SLOWEST = 60.0, 1e5
"""A run hangs if it takes longer than this time, s, plus its collisions at this rate, 1/s."""

INVARIANTS = {
    "energy": "energy",
    "momentum": "momentum",
    "angular momentum": "angular",
    "virial": "virial",
    "overlap": "overlap, m",
    "escape": "escape, m",
}
"""The checks that most cases have, and their headings."""

COLLISIONS, TIME = StopReason.COLLISIONS, StopReason.TIME
NOTHING_LEFT, WALL_TRAP = StopReason.NOTHING_LEFT, StopReason.WALL_TRAP
COLLAPSE = StopReason.COLLAPSE


@dataclass(frozen=True)
class HardCase:
    """A scene of ``configs/hard`` and what is known of it.

    endings : how a run may end; which of these it is may depend on rounding
    fact : what is known exactly of a complete run
    slow : takes more than a second
    by_name_only : takes minutes
    """

    name: str
    endings: tuple[StopReason, ...]
    fact: facts.Fact | None = None
    slow: bool = False
    by_name_only: bool = False


CASES = {
    case.name: case
    for case in (
        HardCase("grazing-offset", (TIME,), facts.grazing),
        HardCase("grazing-angle", (TIME,), facts.grazing),
        HardCase("touching", (TIME,), facts.touching),
        HardCase("touching-wall", (TIME,), facts.touching_wall),
        HardCase("along-the-wall", (WALL_TRAP, COLLAPSE), facts.along_the_wall),
        HardCase("ring", (COLLISIONS,), facts.ring),
        HardCase("rack", (COLLISIONS, COLLAPSE, WALL_TRAP)),
        HardCase("newton-row", (TIME,), facts.newton_row),
        HardCase("cor-extremes", (COLLISIONS, COLLAPSE)),
        HardCase("whispering-1e-6", (COLLISIONS,), facts.whispering),
        HardCase("whispering-1e-9", (COLLISIONS,), facts.whispering),
        HardCase("wall-trap", (WALL_TRAP,), facts.trapped_ball),
        HardCase("wall-trap-sums", (TIME,), facts.wall_trap_sums),
        HardCase("collapse-two", (COLLAPSE, TIME), facts.collapse_below(3 - 2 * math.sqrt(2))),
        HardCase("collapse-three", (COLLAPSE, TIME), facts.collapse_below(7 - 4 * math.sqrt(3))),
        HardCase("cluster", (COLLAPSE,), slow=True),
        HardCase("cluster-circle", (COLLAPSE, WALL_TRAP)),
        HardCase("galperin", (TIME,), facts.galperin, slow=True),
        HardCase("galperin-1e12", (TIME,), facts.galperin, slow=True),
        HardCase("mass-ratios", (COLLISIONS, COLLAPSE, WALL_TRAP)),
        HardCase("container-masses", (COLLISIONS, COLLAPSE, WALL_TRAP)),
        HardCase("radii-1e-9", (COLLISIONS,), facts.needles),
        HardCase("radii-apart", (COLLISIONS, WALL_TRAP)),
        HardCase("full", (COLLISIONS,), facts.full),
        HardCase("speeds", (COLLISIONS, WALL_TRAP)),
        HardCase("speeds-mixed", (COLLISIONS, WALL_TRAP), slow=True),
        HardCase("packing", (COLLISIONS,), slow=True),
        HardCase("corner", (TIME,), facts.corner),
        HardCase("clock-slow", (TIME,)),
        HardCase("clock-far", (TIME,), facts.late_row),
        HardCase("at-rest", (NOTHING_LEFT,), facts.nothing_happens),
        HardCase("at-rest-periodic", (NOTHING_LEFT,), facts.nothing_happens),
        HardCase("billion", (COLLISIONS,), facts.random_walk, slow=True, by_name_only=True),
    )
}


@dataclass(frozen=True)
class HardCaseStudy(Study):
    """Cases, and the folder of their configs."""

    name = "hard"
    title = "hard cases"
    libraries = ("numpy", "numba")

    cases: tuple[HardCase, ...]
    folder: Path = FOLDER

    @classmethod
    def of(cls, names: Sequence[str], folder: Path) -> HardCaseStudy:
        """The named cases, or all but those that take minutes.

        Raises ``UserError`` if there is no such folder or case.
        """
        if not folder.is_dir():
            raise UserError(
                f"there is no folder {folder}; run this command in the folder with snooker's "
                "configs/hard, or name the folder of the cases with --configs"
            )
        for name in names:
            if name not in CASES:
                close = difflib.get_close_matches(name, CASES, n=1)
                hint = f"did you mean {close[0]}?" if close else f"the cases are {', '.join(CASES)}"
                raise UserError(f"there is no hard case {name}; {hint}")
        chosen = [CASES[name] for name in dict.fromkeys(names)]
        return cls(tuple(chosen or (one for one in CASES.values() if not one.by_name_only)), folder)

    def results(self, report: Callable[[str], None]) -> Record:
        """Run all cases. Raises ``ConfigError`` if a config is missing or wrong."""
        found = []
        for case in self.cases:
            report(f"{case.name} ...")
            found.append(verdict(case, self.folder))
        left_out = [
            one.name for one in CASES.values() if one.by_name_only and one not in self.cases
        ]
        return {"cases": found, "left_out": left_out}

    @staticmethod
    def passed(record: Record) -> bool:
        """Whether all cases hold."""
        return all(case["holds"] for case in record["cases"])

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        """The cases, their worst errors, facts, endings and faults."""
        cases = record["cases"]
        why = [[case["name"], case["why"]] for case in cases]
        yield from table_lines([Column("case"), Column("why it is hard")], why)
        yield from ("", LEGEND, "", *_verdict_lines(cases), "")
        facts = [
            [case["name"], fact, _error(each["error"]), _error(each["bound"])]
            for case in cases
            for fact, each in _facts(case).items()
        ]
        if facts:
            headings = (("case", False), ("fact", False), ("worst error", True), ("bound", True))
            yield from table_lines([Column(*each) for each in headings], facts)
            yield ""
        endings = [[case["name"], each["message"]] for case in cases for each in case["endings"]]
        yield from table_lines([Column("case"), Column("first message of each ending")], endings)
        yield ""
        yield from (f"{case['name']}, {fault}" for case in cases for fault in case["faults"])
        failed = sum(not case["holds"] for case in cases)
        total = (
            f"{counted(len(cases), 'case')}, {counted(sum(len(c['runs']) for c in cases), 'run')}"
        )
        yield f"{total}: {counted(failed, 'case')} failed" if failed else f"{total}: all hold"
        if record["left_out"]:
            names_left = " ".join(record["left_out"])
            yield f"left out, because it takes minutes: snooker bench hard {names_left}"


# What is measured


def runs(case: HardCase, folder: Path, most: int | None = None) -> Iterator[Record]:
    """Each point of a case's config with each engine that supports its container.

    most : collisions at most, instead of those in the config

    Raises ``ConfigError`` if there is no such config, or if its scene cannot exist.
    """
    loaded = load(folder / f"{case.name}.yaml")
    for point in loaded.points():
        experiment = point.experiment
        try:
            scene = starting_scene(experiment, 0)
        except SceneError as error:
            raise loaded.error(error.key, str(error)) from None
        wanted = experiment.collisions
        limit = wanted if most is None else min(most, wanted or most)
        for engine in ("allpairs", "cells") if isinstance(scene.container, Circle) else ("cells",):
            begun = time.monotonic()
            deadline = begun + LONGEST + (limit or 0) / SLOWEST
            trace = simulate(
                scene,
                collisions=limit,
                time=experiment.time,
                summary=experiment.record == "summary",
                engine=engine,
                watch=partial(_is_late, deadline),
            )
            found, faults = judged(case, trace, complete=limit == wanted)
            yield {
                "parameters": point.as_json(),
                "engine": engine,
                "events": trace.collisions,
                "ended": trace.stop.reason.value,
                "message": trace.stop.message,
                "time": trace.stop.time,
                "seconds": time.monotonic() - begun,
                "checks": [check.as_json() for check in found],
                "faults": faults,
            }


def _is_late(deadline: float, _: int) -> bool:
    """Whether a run hangs."""
    return time.monotonic() > deadline


def judged(case: HardCase, trace: Trace, *, complete: bool = True) -> tuple[list[Check], list[str]]:
    """The checks of a trace, and a sentence for each fault.

    complete : if not, the run had a lower limit of collisions, and may end by it
    """
    found = checks(trace)
    # Nothing is measured of broken numbers.
    if case.fact is not None and complete and found[0].holds:
        found += case.fact(trace)
    faults = [
        f"{check.name}: {check.error:.2g} is over {check.bound:.2g}"
        for check in found
        if not check.holds
    ]
    endings = case.endings if complete else (*case.endings, StopReason.COLLISIONS)
    reason = trace.stop.reason
    if reason not in endings:
        faults.append(f"it ended as {reason.value} instead of {' or '.join(endings)}")
    if not trace.stop.message:
        faults.append("it ended without a message")
    return found, faults


def verdict(case: HardCase, folder: Path) -> Record:
    """A case's runs, the worst of each check, the endings, and whether all is right."""
    done = list(runs(case, folder))
    worst: dict[str, Record] = {}
    for each in (check for run in done for check in run["checks"]):
        before = worst.get(each["name"], each)
        worse = max(before, each, key=lambda one: (not one["holds"], one["error"]))
        worst[each["name"]] = worse
    endings: dict[str, Record] = {}
    for run in done:
        first = {"reason": run["ended"], "runs": 0, "message": run["message"]}
        endings.setdefault(run["ended"], first)["runs"] += 1
    return {
        "name": case.name,
        "why": str(load(folder / f"{case.name}.yaml").experiment.title),
        "events": sum(run["events"] for run in done),
        "endings": list(endings.values()),
        "worst": {
            name: {key: each[key] for key in ("error", "bound", "holds")}
            for name, each in worst.items()
        },
        "holds": not any(run["faults"] for run in done),
        "faults": [f"{_label(run)}: {fault}" for run in done for fault in run["faults"]],
        "runs": done,
    }


def _label(run: Record) -> str:
    """A run's engine and point."""
    return ", ".join(
        [run["engine"], *(f"{key}={value}" for key, value in run["parameters"].items())]
    )


# The record as tables

LEGEND = """\
events: of all runs of a case: each point with each engine that supports its container
ended: why runs ended, and how many
energy, momentum, angular, virial: the worst violation of the conservation law, relative
overlap, escape: the deepest of two balls, and of a ball in the wall
facts: how many of the facts that are known exactly hold"""


def _verdict_lines(cases: Sequence[Record]) -> list[str]:
    """A row for each case."""
    headings = ("case", "events", "ended", *INVARIANTS.values(), "facts", "verdict")
    rows = []
    for case in cases:
        endings = (f"{each['runs']} {each['reason']}" for each in case["endings"])
        facts = _facts(case).values()
        worst = (case["worst"].get(name) for name in INVARIANTS)
        rows.append(
            [
                case["name"],
                f"{case['events']:,}",
                ", ".join(endings).replace("_", " "),
                *(_error(each["error"]) if each else "–" for each in worst),
                f"{sum(each['holds'] for each in facts)} of {len(facts)}" if facts else "–",
                "holds" if case["holds"] else "fails",
            ]
        )
    texts = ("case", "ended", "verdict")
    return table_lines([Column(each, each not in texts) for each in headings], rows)


def _facts(case: Record) -> dict[str, Any]:
    """The checks that only this case has."""
    return {
        name: each for name, each in case["worst"].items() if name not in {"numbers", *INVARIANTS}
    }


def _error(value: float | None) -> str:
    """An error to two digits."""
    if value is None:
        return "infinite"
    return small(value) if value else "0"
