"""The judge of the hard cases: runs each with both engines and holds it to all that must be true.

Balls may not be lost, nor overlap, nor a number be none, and a run has to end, and to say how.
"""

from __future__ import annotations

import difflib
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
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
from snooker_cli.validation.study import origin

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace
    from snooker_cli.validation.hard_case_checks import Check


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
            scene = starting_scene(point.experiment, 0)
        except SceneError as error:
            raise loaded.error(error.key, str(error)) from None
        for engine in ("allpairs", "cells") if isinstance(scene.container, Circle) else ("cells",):
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


# The hard cases: which endings each may have, and what is known exactly of it.

COLLISIONS, TIME = StopReason.COLLISIONS, StopReason.TIME
NOTHING_LEFT, WALL_TRAP = StopReason.NOTHING_LEFT, StopReason.WALL_TRAP
COLLAPSE = StopReason.COLLAPSE


@dataclass(frozen=True)
class Hard:
    """A case.

    endings : how a run of it may end; which of them it is may depend on roundings
    fact : what is known exactly of a whole run
    lengthy : takes more than a second; for ``by_name_only`` it is minutes
    """

    name: str
    endings: tuple[StopReason, ...]
    fact: Callable[[Trace], Iterator[Check]] | None = None
    lengthy: bool = False
    by_name_only: bool = False


CASES = (
    Hard("grazing-offset", (TIME,), facts.grazing),
    Hard("grazing-angle", (TIME,), facts.grazing),
    Hard("touching", (TIME,), facts.touching),
    Hard("touching-wall", (TIME,), facts.touching_wall),
    Hard("along-the-wall", (WALL_TRAP, COLLAPSE), facts.along_the_wall),
    Hard("ring", (COLLISIONS,), facts.ring),
    Hard("rack", (COLLISIONS, COLLAPSE, WALL_TRAP)),
    Hard("newton-row", (TIME,), facts.newton_row),
    Hard("cor-extremes", (COLLISIONS, COLLAPSE)),
    Hard("whispering-1e-6", (COLLISIONS,), facts.whispering),
    Hard("whispering-1e-9", (COLLISIONS,), facts.whispering),
    Hard("wall-trap", (WALL_TRAP,), facts.wall_trap_told),
    Hard("wall-trap-sums", (TIME,), facts.wall_trap_sums),
    Hard("collapse-two", (COLLAPSE, TIME), facts.collapse_below(3 - 2 * math.sqrt(2))),
    Hard("collapse-three", (COLLAPSE, TIME), facts.collapse_below(7 - 4 * math.sqrt(3))),
    Hard("cluster", (COLLAPSE,), lengthy=True),
    Hard("cluster-circle", (COLLAPSE, WALL_TRAP)),
    Hard("galperin", (TIME,), facts.galperin, lengthy=True),
    Hard("galperin-1e12", (TIME,), facts.galperin, lengthy=True),
    Hard("mass-ratios", (COLLISIONS, COLLAPSE, WALL_TRAP)),
    Hard("container-masses", (COLLISIONS, COLLAPSE, WALL_TRAP)),
    Hard("radii-1e-9", (COLLISIONS,), facts.needles),
    Hard("radii-apart", (COLLISIONS, WALL_TRAP)),
    Hard("full", (COLLISIONS,), facts.full),
    Hard("speeds", (COLLISIONS, WALL_TRAP)),
    Hard("speeds-mixed", (COLLISIONS, WALL_TRAP), lengthy=True),
    Hard("packing", (COLLISIONS,), lengthy=True),
    Hard("corner", (TIME,), facts.corner),
    Hard("clock-slow", (TIME,)),
    Hard("clock-far", (TIME,), facts.late_row),
    Hard("at-rest", (NOTHING_LEFT,), facts.nothing_happens),
    Hard("at-rest-periodic", (NOTHING_LEFT,), facts.nothing_happens),
    Hard("billion", (COLLISIONS,), facts.random_walk, lengthy=True, by_name_only=True),
)


# Verdicts on hard cases -> their tables for people, and cases by their names.

LEGEND = """\
events: of all runs of a case, its points with each of the two engines that knows its container
ended: why runs ended, and how many of them
energy, momentum, angular, virial: the worst of what is missing in the books, as a part of the whole
overlap, escape: the deepest of two balls, and of a ball in the wall
facts: how many of those that are known exactly hold"""


def chosen(names: Sequence[str], folder: Path) -> list[Hard]:
    """The cases of some names; of none, all but those that take minutes. Raises ``UserError``."""

    if not folder.is_dir():
        raise UserError(
            f"there is no folder {folder}; run this where snooker's configs/hard is, or name that "
            "folder with --configs"
        )
    if not names:
        return [case for case in CASES if not case.by_name_only]
    known = {case.name: case for case in CASES}
    for name in names:
        if name not in known:
            close = difflib.get_close_matches(name, known, n=1)
            meant = f"did you mean {close[0]}?" if close else f"the cases are {', '.join(known)}"
            raise UserError(f"there is no hard case {name}; {meant}")
    return [known[name] for name in dict.fromkeys(names)]


def lines_of_hard(measurement: dict[str, Any]) -> Iterator[str]:
    """The measurement as tables and sentences."""
    cases = measurement["cases"]
    yield from table_lines(
        [Column("case"), Column("why it is hard")], [[case["name"], case["why"]] for case in cases]
    )
    yield ""
    yield LEGEND
    yield ""
    yield from _verdicts(cases)
    yield ""
    yield from _facts(cases)
    yield from table_lines(
        [Column("case"), Column("how it ended, the first run of each kind")],
        [[case["name"], each["message"]] for case in cases for each in case["endings"]],
    )
    yield ""
    faults = [f"{case['name']}, {fault}" for case in cases for fault in case["faults"]]
    yield from faults
    failed = sum(not case["holds"] for case in cases)
    runs = counted(sum(len(case["runs"]) for case in cases), "run")
    verdict = f"{counted(failed, 'case')} failed" if failed else "all hold"
    yield f"{counted(len(cases), 'case')}, {runs}: {verdict}"
    if measurement["left_out"]:
        names = " ".join(measurement["left_out"])
        yield f"left out, as it takes minutes: snooker bench hard {names}"


def _verdicts(cases: list[dict[str, Any]]) -> list[str]:
    """A row a case."""

    units = {"overlap": ", m", "escape": ", m", "angular momentum": ""}
    return table_lines(
        [
            Column("case"),
            Column("events", True),
            Column("ended"),
            *(
                Column(name.removesuffix(" momentum") + units.get(name, ""), True)
                for name in INVARIANTS
            ),
            Column("facts", True),
            Column("verdict"),
        ],
        [
            [
                case["name"],
                f"{case['events']:,}",
                ", ".join(
                    f"{each['runs']} {each['reason']}".replace("_", " ") for each in case["endings"]
                ),
                *(_error(case["worst"].get(name)) for name in INVARIANTS),
                _held([each for name, each in case["worst"].items() if _is_fact(name)]),
                "holds" if case["holds"] else "fails",
            ]
            for case in cases
        ],
    )


def _facts(cases: list[dict[str, Any]]) -> Iterator[str]:
    """A row a fact, if there are any."""
    rows = [
        [case["name"], name, _error(each), _error({"error": each["bound"]})]
        for case in cases
        for name, each in case["worst"].items()
        if _is_fact(name)
    ]
    if rows:
        yield from table_lines(
            [Column("case"), Column("fact"), Column("worst error", True), Column("bound", True)],
            rows,
        )
        yield ""


def _is_fact(name: str) -> bool:
    """Whether a check is one of a case's own."""

    return name not in ("numbers", *INVARIANTS)


def _held(facts: list[dict[str, Any]]) -> str:
    """As in ``2 of 3``."""
    return f"{sum(each['holds'] for each in facts)} of {len(facts)}" if facts else "–"


def _error(check: dict[str, Any] | None) -> str:
    """An error to two digits, as 1.2e−15; a dash where there is nothing to measure."""
    if check is None:
        return "–"
    if check["error"] is None:
        return "infinite"
    return "0" if check["error"] == 0 else f"{check['error']:.1e}".replace("-", "−")
