"""Rows of fits and comparisons as tables, and as sentences on what holds."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

from snooker_cli.analysis.decay import FURTHER
from snooker_cli.analysis.fitting import LAWS
from snooker_cli.analysis.goodness import ENOUGH_REPEATS, FEW_REPEATS, verdict
from snooker_cli.analysis.quantities import (
    GIVEN,
    HAFF_RATE,
    QUANTITIES,
    RATIO,
    SPECIES_RATIO,
    SPIN_RATIO,
)
from snooker_cli.analysis.run_analysis import Records
from snooker_cli.analysis.theories import NO_THEORY, SOURCE_REPORT, START_RATES
from snooker_cli.formatting import (
    point_label,
    probability,
    range_held,
    ratio,
    short,
    text_table,
    with_error,
)
from snooker_cli.runs.side_by_side import RUN
from snooker_cli.theory import IDEAL
from snooker_cli.two_temperatures import MEAN_FIELD

Item = TypeVar("Item")

FIT_COLUMNS = "quantity | model | A | >constant, 1/s | >p | >holds, s | >end/fit"
COMPARE_COLUMNS = "quantity | model | >measured | >predicted | >difference | >in errors"
"""Columns of a point's table. It fits 100 columns of a terminal."""

MORE_FIT_COLUMNS = " | >half range"
MOST_POINTS = 3  # that notes name

PAIRED = (
    "A difference is taken in each repeat, because many predictions use its own temperature. Its "
    "error is over these differences, so that it can be less than the error of the measured mean."
)
"""What a reader of the errors of comparisons has to know."""

MORE_COMPARED = "--all also has these errors and the formulas of the source report."


def main_rows(rows: Records) -> Records:
    """Rows or notes that are printed without ``--all``."""
    known = [row for row in rows if not row["model"].startswith(SOURCE_REPORT)]
    return [row for row in known if row["quantity"] not in FURTHER or "amplitude" not in row]


def rows_with(rows: Records, field: str, parts: Sequence[str]) -> Records:
    """Rows or notes with one of these parts in a name of files or tables, or without a name."""

    def has_part(row: Mapping[str, Any]) -> bool:
        """With its unit, as tables have it."""
        name = f"{row[field]} {short_name(row[field])}, {row.get('unit', '')}".lower()
        return any(part.lower() in name for part in parts)

    return [row for row in rows if not row[field] or has_part(row)]


def short_name(name: str) -> str:
    """The name of a quantity or a model in tables."""
    if name in QUANTITIES:
        return QUANTITIES[name].words
    name = name.replace("_amplitude_1", "").replace(" at the start", "")
    return re.sub("(?<=[a-z])_", " ", name)


def table_lines(rows: Records, every: bool, brief: bool = False) -> list[str]:
    """What holds for each point, and unless `brief` is wanted tables; `every` adds errors.

    A point has a table. Runs side by side have one for each quantity and model, with their points
    as rows.
    """
    rows = [row for row in rows if not row.get("elastic")]
    columns, cells, is_fit = COMPARE_COLUMNS, compare_cells, bool(rows) and "amplitude" in rows[0]
    if is_fit:
        columns, cells = FIT_COLUMNS + MORE_FIT_COLUMNS * every, fit_cells
    holds = list[str]()
    for label, group in _grouped(rows, lambda row: point_label(row["parameters"])).items():
        if sentence := finding(group * is_fit, group * (not is_fit)):
            holds.append(f"{label}: {sentence}")
    holds += few_repeats(rows * is_fit)
    if brief or not rows:
        return holds
    headings, texts = columns.split(" | "), [cells(row, every) for row in rows]
    titles = list(map(point_heading, rows))
    if side_by_side := RUN in rows[0]["parameters"]:
        names = 3 if is_fit else 2  # columns that say what a row is about
        titles = [", ".join(_words(headings[:names], text[:names])) for text in texts]
        headings = ["point", *headings[names:]]
        pairs = zip(rows, texts, strict=True)
        texts = [[f"  {_place(row, rows)}", *text[names:]] for row, text in pairs]
    head, *lines = text_table(headings, texts)
    tables = _grouped(list(zip(titles, lines, strict=True)), lambda pair: pair[0])
    printed = [head] if side_by_side else []
    for title, of_table in tables.items():
        printed += [title, *([] if side_by_side else [head]), *(line for _, line in of_table)]
    return [*holds, *[""] * bool(holds), *printed]


def _grouped(items: Sequence[Item], name: Callable[[Item], str]) -> dict[str, list[Item]]:
    """Items by a name, in the order in which names first appear."""
    groups: dict[str, list[Item]] = {}
    for item in items:
        groups.setdefault(name(item), []).append(item)
    return groups


def _words(headings: Sequence[str], cells: Sequence[str]) -> Iterator[str]:
    """What a row of runs side by side is about: ``energy, haff, A free``."""
    for heading, cell in zip(headings, cells, strict=True):
        yield f"A {cell}" if heading == "A" else cell


def _place(row: Mapping[str, Any], rows: Records) -> str:
    """The run and the keys that vary among rows: ``B, cor=0.8``."""
    parameters = dict(row["parameters"])
    run = parameters.pop(RUN)
    varying = {
        key: value
        for key, value in parameters.items()
        if any(other["parameters"][key] != value for other in rows)
    }
    return f"{run}, {point_label(varying)}" if varying else str(run)


def point_heading(row: dict[str, Any]) -> str:
    """A row's point, and how many of its repeats are complete."""
    total = row["simulated"] if "simulated" in row else row["repeats"] + row["failed"]
    return f"{point_label(row['parameters'])}: {row['complete']} of {total} complete"


def fit_cells(row: dict[str, Any], every: bool = False) -> list[str]:
    """A row of ``fits`` under ``FIT_COLUMNS``; `every` adds ``MORE_FIT_COLUMNS``."""
    cells = [
        short_name(row["quantity"]),
        row["model"],
        "1" if row["amplitude"] == "fixed at 1" else "free",
        with_error(row["value"], row["error"]),
        probability(row["probability"]),
        range_held(row),
        ratio(row["end_over_fit"]),
    ]
    return [*cells, *([short(row["max_min_half_range"], 2)] if every else [])]


def compare_cells(row: dict[str, Any], every: bool = False) -> list[str]:
    """A row of ``comparisons`` under ``COMPARE_COLUMNS``; `every` has whole names and an error.

    Two repeats have an error with one degree of freedom, which says little about a difference.
    """
    in_errors, difference = row["difference_in_errors"], row["difference"]
    error = None if in_errors is None else row["difference_error"]
    plus = "" if difference is None or difference < 0 else "+"
    known = in_errors is not None and (row["samples"] or row["repeats"] > 2)
    shows_error = every or row["predicted"] is None  # else the difference has one
    quantity, model = row["quantity"], row["model"]
    if not every:
        quantity, model = short_name(quantity), short_name(model)
    return [
        quantity + ("" if row["unit"] == "1" else f", {row['unit']}"),
        model,
        with_error(row["measured"], row["error"]) if shows_error else short(row["measured"], 4),
        short(row["predicted"], 4),
        f"{plus}{with_error(difference, error)}",
        f"{in_errors:+.1f}".replace("-", "−") if known else "–",
    ]


def note_lines(notes: Records, points: int) -> Iterator[str]:
    """Each note once, with the points that it is about if those are not all.

    Notes of more than ``MOST_POINTS`` points that differ in numbers alone are one line.
    """
    alike: dict[str, dict[str, list[str]]] = {}
    for row in notes:
        same = alike.setdefault(re.sub(r"\d+", "", row["note"]), {})
        same.setdefault(row["note"], []).append(point_label(row["parameters"]))
    for same in alike.values():
        number = len({label for labels in same.values() for label in labels})
        merged = number > MOST_POINTS and (len(same) > 1 or number < points)
        for note, labels in list(same.items())[: 1 if merged else None]:
            about = (
                f"{number} of {points} points, as at {labels[0]}" if merged else "; ".join(labels)
            )
            yield note if len(labels) == points else f"{about}: {note}"


# What holds for a point or a run, as a sentence.

MOST_ERRORS = 3.0  # of the balance of energy in a gas that is called steady

SYMBOLS = {
    one.name: (one.symbol, one.unit_text) for one in (RATIO, SPECIES_RATIO, SPIN_RATIO, HAFF_RATE)
}
"""The comparisons that a finding may have: symbol and unit. The last one of each point counts."""


def finding(fits: Records, compared: Records) -> str:
    """What holds for a point: a sentence without a full stop, empty if nothing is known.

    fits, compared : the point's rows of fits and comparisons; either may be empty

    A gas that cools has the law that its energy follows longest, and Haff's α beside theory.
    Another gas has PV/NT beside theory, and one that walls keep warm whether it may not be steady.
    """
    laws, beside = [row for row in fits if _cools(row)], main_comparisons(compared)
    if not laws:
        known = [*map(_beside, beside[-1:]), *_imbalance(compared)]
        return "; ".join([*known, *_reservations(beside[-1:])])
    law = max(laws, key=lambda row: (row["holds_to"] or 0.0, row["model"] == "haff"))
    if law["value"] is None:
        return "The energy has no fit"
    constant = f"{LAWS[law['model']].symbol} = {with_error(law['value'], law['error'], '1/s')}"
    if law["model"] == "haff" and beside and beside[-1]["quantity"] == "Haff's α":
        constant = _beside(beside[-1])
    rest = "; ".join([constant, *_reservations([law])])
    return f"{verdict(law)}; {rest}"


def _imbalance(compared: Records) -> Iterator[str]:
    """A sentence if the walls do not give what collisions take: then a gas is hardly steady."""
    for row in compared:
        errors = row["difference_in_errors"]
        if row["quantity"] == GIVEN.name and errors is not None and abs(errors) > MOST_ERRORS:
            less = "more" if errors > 0 else "less"
            yield f"the walls give {less} than collisions take ({abs(errors):.1f} errors)"


def few_repeats(fits: Records) -> list[str]:
    """``FEW_REPEATS`` if few repeats do not refuse one of these laws, up to some time."""
    judged = (row for row in fits if row["probability"] is not None)
    few = (row for row in judged if row["judged_repeats"] < ENOUGH_REPEATS)
    return [FEW_REPEATS] if any(row["holds_to"] > row["judged_from"] for row in few) else []


def overview(fits: Records, compared: Records) -> str:
    """What holds for the points of a run, in a sentence like that of ``finding``."""
    haff = [row for row in fits if _cools(row) and row["model"] == "haff"]
    judged = [row for row in haff if row["probability"] is not None]
    held = [row["holds_to"] == row["judged_to"] for row in judged]
    parts = [f"Haff's law is not refused to the end at {sum(held)} of {len(held)} points that cool"]
    groups: dict[str, list[float]] = {}
    beside, ideal = main_comparisons(compared), []
    for row in beside:
        if row["model"] == IDEAL:
            ideal.append(row["measured"])
            continue
        name = f"{row['quantity']} differs from {theory_name(row)} by"
        groups.setdefault(name, []).append(100 * row["difference"] / row["predicted"])
    for name, shares in groups.items():
        ends = dict.fromkeys(short(share, 2) for share in (min(shares), max(shares)))
        parts.append(f"{name} {' to '.join(ends)} %")
    if ideal:
        ends = dict.fromkeys(short(value) for value in (min(ideal), max(ideal)))
        parts.append(f"PV/NT is {' to '.join(ends)} (an ideal gas has 1)")
    return "; ".join([*parts[not held :], *_reservations([*haff, *beside])])


def _reservations(rows: Records) -> Iterator[str]:
    """How many repeats behind rows ended early or are missing, each point counted once."""
    points = {point_label(row["parameters"]): row for row in rows}.values()
    total, early, requested = 0, 0, 0
    for row in points:
        repeats = row["simulated"] if "simulated" in row else row["repeats"] + row["failed"]
        total, early = total + repeats, early + repeats - row["complete"]
        requested += row["requested"]
    if early:
        of_all = f"all {total}" if early == total else f"{early} of {total}"
        sentence = "the repeat ended early" if total == 1 else f"{of_all} repeats ended early"
        judged = [row.get("judged_repeats") for row in points] == [total - early]
        yield f"{sentence}, and the law is judged on the others" if judged else sentence
    if total < requested:
        yield f"only {total} of {requested} repeats are there"


def _cools(fit: dict[str, Any]) -> bool:
    """Whether a fit is that of the energy of a gas that loses energy."""
    return fit["quantity"] == "kinetic_energy" and not fit["elastic"]


def main_comparisons(rows: Records) -> Records:
    """The comparison of each point: Haff's α or T_rot/T_tr, else PV/NT with the best theory."""
    beside = (row for row in rows if row["quantity"] in SYMBOLS and row["model"] != NO_THEORY)
    known = {point_label(row["parameters"]): row for row in beside}
    return list(known.values())


def _beside(row: dict[str, Any]) -> str:
    """``α = 0.697 ± 0.021 1/s, 4 % below Enskog, 2.1 errors``."""
    symbol, unit = SYMBOLS[row["quantity"]]
    errors = row["difference_in_errors"]
    value = with_error(row["measured"], row["error"], unit)
    if row["model"] == IDEAL:  # no theory of these balls: the difference is no test
        return f"{symbol} = {value} (an ideal gas has {short(row['predicted'])})"
    known = errors is not None and row["repeats"] > 2  # an error of two repeats says little
    distance = f", {abs(errors):.1f} errors" if known else ""
    return f"{symbol} = {value}, {excess(row)} {theory_name(row)}{distance}"


def excess(row: Mapping[str, Any]) -> str:
    """How far a result is from its prediction: ``4 % below``."""
    share = 100 * row["difference"] / row["predicted"]
    return f"{ratio(abs(share))} % {'below' if share < 0 else 'above'}"


def theory_name(row: Mapping[str, Any]) -> str:
    """The name of a model as a theory: ``Enskog``, ``theory for hard disks, finite N``."""
    known = {START_RATES: "Enskog", MEAN_FIELD: "mean-field theory"}
    return known.get(row["model"], f"theory for {row['model']}")
