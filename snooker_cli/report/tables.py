"""The report's tables, every cell from the results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from snooker_cli.report.audit import FOLLOWS, Audit, Row
from snooker_cli.report.document import Table
from snooker_cli.report.published import Ours, Published, published
from snooker_cli.report.search import TARGETS, Candidate
from snooker_cli.words import short, with_error

if TYPE_CHECKING:
    from snooker_cli.gallery import Picture

Fits = Sequence[Mapping[str, Any]]


def decay_constants(label: str, fits: Fits, repeats: int) -> Table:
    """The fits to the report's scene."""
    found = {(one["parameters"]["cor"], one["quantity"], one["model"]): one for one in fits}
    rows = [
        (
            f"{cor:g}",
            quantity.replace("_", " "),
            *(
                cell
                for law in ("exponential", "haff")
                for cell in (
                    with_error(
                        found[cor, quantity, law]["value"], found[cor, quantity, law]["error"]
                    ),
                    short(found[cor, quantity, law]["max_min_half_range"], 2),
                    f"{found[cor, quantity, law]['r_squared']:.3f}",
                )
            ),
        )
        for cor, quantity, model in found
        if cor < 1.0 and model == "exponential"
    ]
    return Table(
        label,
        f"Decay constants over {repeats} repeats, each fitted by itself: k of the exponential and "
        "α of Haff's law, mean and standard error; half of largest − smallest, the report's ±; "
        "R². Pressure is the mean since the start; local is in windows of time.",
        (
            "CoR",
            "quantity",
            "k, 1/s",
            "half range, 1/s",
            "R²",
            "α, 1/s",
            "half range, 1/s",
            "R²",
        ),
        tuple(rows),
        (True, False, *(True,) * 6),
        (0.5, 1.4, 1.3, 1.1, 0.7, 1.3, 1.1, 0.7),
    )


def audit_rows(label: str, audit: Audit) -> Table:
    """Every printed number."""
    return Table(
        label,
        "Every number that the report prints about its results. As stated: the report's scene, "
        f"{audit.repeats} repeats at each CoR, {audit.early} of them ending early in a wall trap; "
        "± is the standard error of a mean and, for one run, the spread of single runs. "
        f"Common setting: {audit.finding.setting.words()}.",
        (
            "where",
            "what",
            "unit",
            "printed",
            "as stated",
            "common setting",
            "best by itself",
            "verdict",
        ),
        tuple(
            (
                row.number.where,
                row.number.what,
                "" if row.number.unit == "1" else row.number.unit,
                row.number.printed,
                _exactly(row) if row.number.exact else _value(row.ours),
                "" if row.common is None else _value(row.common),
                _by_itself(row),
                row.verdict,
            )
            for row in audit.rows
        ),
        (False, False, False, True, True, True, False, False),
        (1.2, 2.7, 0.65, 1.45, 1.65, 1.6, 2.8, 1.35),
    )


def _value(ours: Ours) -> str:
    return with_error(ours.value, ours.error)


def _exactly(row: Row) -> str:
    """A number that is meant exactly, by how far ours is from it."""
    if row.ours.error > 0:
        return _value(row.ours)
    off = row.ours.value - row.number.value
    return row.number.digits + (f" {'+' if off > 0 else '−'} {short(abs(off), 1)}" if off else "")


def _by_itself(row: Row) -> str:
    """What explains a number best by itself, and what that gives."""
    if row.value is None or row.verdict == FOLLOWS:
        return row.alone
    value = _value(row.value) if row.value.error > 0 else short(row.value.value, 6)
    return f"{'' if row.value.agrees(row.number) else 'nearest: '}{row.alone}: {value}"


def candidates(label: str, audit: Audit) -> Table:
    """The best settings, and what each other choice costs."""
    numbers = [published(name) for name in TARGETS]
    symbols = {
        "energy decay": "k",
        "pressure decay": "κ",
        "mean speed": "⟨v⟩",
        "pressure": "P",
    }
    headings = tuple(
        f"{symbols[number.of]}{'' if number.cor is None else f' at {number.cor:g}'}, {number.unit}"
        for number in numbers
    )
    rows = [("printed", *(number.printed for number in numbers), "")]
    rows += [
        (
            one.setting.words(),
            *(_to_its_digits(one, number) for number in numbers),
            f"{one.score:.1f}" if one.score < 100 else f"{one.score:.0f}",
        )
        for one in audit.profile
    ]
    return Table(
        label,
        "The best setting of all, and the best for every other choice of ball radius, wall, rings, "
        "fitted collisions, amplitude and slip: what each costs. k is the decay constant of "
        f"energy, κ that of pressure, ⟨v⟩ the mean speed, P the pressure at CoR 1; χ² is the sum "
        f"of {len(numbers)} squared differences in uncertainties.",
        ("setting", *headings, "χ²"),
        tuple(rows),
        (False, *(True for _ in numbers), True),
        (3.2, *(1.1 for _ in numbers), 0.65),
    )


def _to_its_digits(one: Candidate, number: Published) -> str:
    """What a setting gives for a number, to the printed decimals, one for a whole number."""
    ours = one.beside(number)
    return "–" if ours is None else f"{ours.value:.{max(number.decimals, 1)}f}"


def sentences(label: str, audit: Audit) -> Table:
    """The report's sentences that can be checked."""
    return Table(
        label,
        "Sentences of the report that can be checked, with its own numbers or with ours.",
        ("where", "sentence", "check", "holds"),
        tuple(
            (one.where, one.claim, one.check, "yes" if one.holds else "no") for one in audit.claims
        ),
        (False, False, False, False),
        (1.0, 2.2, 4.0, 0.45),
    )


def many_coefficients(label: str, pictures: Mapping[str, Picture]) -> Table:
    """The decay constants of the energy over all CoR."""
    stated, elastic = (
        pictures[name].numbers["points"] for name in ("decay-against-cor", "decay-elastic-wall")
    )
    rows = [
        (
            f"{first['parameters']['cor']:g}",
            *(
                cell
                for one in (first, second)
                for cell in (
                    with_error(one["k"], one["k_error"]),
                    with_error(one["alpha"], one["alpha_error"]),
                    str(one["ended_early"]),
                )
            ),
        )
        for first, second in zip(stated, elastic, strict=True)
    ]
    return Table(
        label,
        "Decay constants of the energy, exponential k and Haff's α, mean and standard error over "
        f"{stated[0]['repeats']} repeats with the wall's CoR as the balls' and "
        f"{elastic[0]['repeats']} with an elastic wall, and how many ended early, in a wall trap. "
        "At CoR 1 nothing decays.",
        (
            "CoR",
            "k, 1/s",
            "α, 1/s",
            "early",
            "elastic wall: k, 1/s",
            "α, 1/s",
            "early",
        ),
        tuple(rows),
        (True,) * 7,
        (0.5, 1.3, 1.3, 0.6, 1.3, 1.3, 0.6),
    )
