"""Verdicts on hard cases -> their tables for people, and cases by their names."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli.cli.endings import UserError
from snooker_cli.cli.tables import Column, table_lines
from snooker_cli.words import counted

if TYPE_CHECKING:
    from snooker_cli.bench.hard_catalogue import Hard

LEGEND = """\
events: of all runs of a case, its points with each of the two engines that knows its container
ended: why runs ended, and how many of them
energy, momentum, angular, virial: the worst of what is missing in the books, as a part of the whole
overlap, escape: the deepest of two balls, and of a ball in the wall
facts: how many of those that are known exactly hold"""


def chosen(names: Sequence[str], folder: Path) -> list[Hard]:
    """The cases of some names; of none, all but those that take minutes. Raises ``UserError``."""
    from snooker_cli.bench.hard_catalogue import CASES

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
    from snooker_cli.bench.hard import INVARIANTS

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
    from snooker_cli.bench.hard import INVARIANTS

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
