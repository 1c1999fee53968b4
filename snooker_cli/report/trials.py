"""Saved measurements of hard cases and of known physics -> the report's section on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from snooker_cli.bench.hard import INVARIANTS
from snooker_cli.bench.origin import machine
from snooker_cli.bench.physics import sentence
from snooker_cli.report.document import Block, Heading, Paragraph, Table
from snooker_cli.words import short, with_error

Record = Mapping[str, Any]


def blocks(hard: dict[str, Any], billion: dict[str, Any], physics: dict[str, Any]) -> list[Block]:
    """The section: a sentence and a table for each; ``billion`` is the hard case of that name."""
    return [
        Heading("Hard cases and known physics", after_figures=True),
        Paragraph(f"{_hard_text(hard)} {_billion_text(billion)}"),
        _cases("Table 8", [*hard["cases"], *billion["cases"]]),
        Paragraph(f"{sentence(physics)} Table 9 has them all."),
        _known("Table 9", physics),
    ]


def _hard_text(hard: Record) -> str:
    """How many cases there are, and whether they hold."""
    cases = hard["cases"]
    failed = [case["name"] for case in cases if not case["holds"]]
    verdict = f"These fail: {', '.join(failed)}." if failed else "All of them hold."
    runs = sum(ending["runs"] for case in cases for ending in case["endings"])
    return (
        f"{len(cases)} scenes are made to break an engine (Table 8). Both engines simulate them, "
        f"in {runs} runs; what must stay true is measured beside a bound on what rounding alone "
        f"could do, known facts included. {verdict} (snooker {hard['snooker']}, "
        f"{hard['date'][:10]}.)"
    )


def _billion_text(billion: Record) -> str:
    """What is left of the books after very many collisions."""
    (case,) = billion["cases"]
    energy, walk = case["worst"]["energy"], case["worst"]["drift of energy, of a ball's"]
    return (
        f"One more, {case['name']}, takes minutes and was run once, on {billion['date'][:10]} "
        f"({machine(billion)}): after {case['runs'][0]['events']:,} collisions by each engine the "
        f"energy is off by {short(energy['error'], 2)} of it at most. Of one ball's energy that is "
        f"{short(walk['error'], 2)}, where roundings to either side may add up to "
        f"{short(walk['bound'], 2)}."
    )


def _cases(label: str, cases: Sequence[Record]) -> Table:
    """A row a case."""
    return Table(
        label,
        "Hard cases: collisions of all runs, how they ended, the worst of what is missing in the "
        "books of energy and angular momentum as a part of the whole, the deepest overlap of two "
        "balls, and the verdict.",
        ("case", "why it is hard", "events", "ended", "energy", "angular", "overlap, m", "verdict"),
        tuple(
            (
                case["name"],
                case["why"],
                f"{case['events']:,}",
                ", ".join(
                    f"{one['runs']} {one['reason'].replace('_', ' ')}" for one in case["endings"]
                ),
                *(_worst(case, name) for name in INVARIANTS if name in SHOWN),
                "holds" if case["holds"] else "fails",
            )
            for case in cases
        ),
        (False, False, True, False, True, True, True, False),
        (1.3, 3.2, 0.9, 1.6, 1.0, 1.0, 1.0, 0.7),
    )


SHOWN = ("energy", "angular momentum", "overlap")


def _worst(case: Record, name: str) -> str:
    """The worst error in an invariant, if the case has it."""
    found = case["worst"].get(name)
    return short(found["error"], 2) if found else "–"


def _known(label: str, physics: Record) -> Table:
    """A row for each known value."""
    return Table(
        label,
        "What was measured beside expected values. Known is what the number of balls alone "
        "changes; what is left of the difference is in standard errors; open is what the expected "
        f"value leaves open itself. {' '.join(physics['notes'])}",
        ("quantity", "N", "packing", "CoR", "measured", "expected", "left", "open", "source"),
        tuple(
            (
                row["quantity"],
                f"{row['setting']['balls']:,}",
                f"{row['setting']['packing']:.4g}",
                f"{row['setting']['cor']:g}",
                with_error(row["measured"], row["error"]),
                short(row["expected"], 6),
                f"{row['left_in_errors']:+.1f}".replace("-", "−"),
                short(row["systematic"], 2) if row["systematic"] else "–",
                row["source"],
            )
            for row in physics["rows"]
        ),
        (False, True, True, True, True, True, True, True, False),
        (1.9, 0.6, 0.8, 0.5, 1.8, 1.0, 0.5, 0.8, 2.2),
    )
