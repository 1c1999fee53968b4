"""Rows of fits and comparisons as tables, below what holds."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

from snooker_cli.analysis.decay import FURTHER
from snooker_cli.analysis.findings import Findings, few_repeats
from snooker_cli.analysis.goodness import FEWEST_TESTED
from snooker_cli.analysis.quantities import QUANTITIES
from snooker_cli.analysis.run_analysis import JsonRows
from snooker_cli.analysis.theories import SOURCE_REPORT
from snooker_cli.formatting import (
    point_label,
    probability,
    range_held,
    ratio,
    short,
    text_table,
    with_error,
)
from snooker_cli.runs.run import RUN

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

MORE_COMPARED = "also has these errors and the formulas of the source report."


def main_rows(rows: JsonRows) -> JsonRows:
    """Rows or notes that are printed without ``--all``."""
    known = [row for row in rows if not row["model"].startswith(SOURCE_REPORT)]
    return [row for row in known if row["quantity"] not in FURTHER or "amplitude" not in row]


def rows_with(rows: JsonRows, field: str, parts: Sequence[str]) -> JsonRows:
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


def table_lines(
    rows: JsonRows, every: bool, brief: bool = False, states: JsonRows | None = None
) -> list[str]:
    """What holds for each point, and unless `brief` is wanted tables; `every` adds errors.

    states : of the points, see `Findings`

    A point has a table. Runs side by side have one for each quantity and model, with their points
    as rows.
    """
    rows = [row for row in rows if not row.get("elastic")]
    columns, cells, is_fit = COMPARE_COLUMNS, compare_cells, bool(rows) and "amplitude" in rows[0]
    if is_fit:
        columns, cells = FIT_COLUMNS + MORE_FIT_COLUMNS * every, fit_cells
    holds = Findings(rows * is_fit, rows * (not is_fit), states or []).lines
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


def _place(row: Mapping[str, Any], rows: JsonRows) -> str:
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
    known = in_errors is not None and (row["samples"] or row["repeats"] >= FEWEST_TESTED)
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


def note_lines(notes: JsonRows, points: int) -> Iterator[str]:
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
