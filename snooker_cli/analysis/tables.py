"""Rows of fits and comparisons as cells and lines of tables."""

import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from snooker_cli.analysis.comparison import CHI_SQUARE
from snooker_cli.analysis.decay import FURTHER, range_held
from snooker_cli.analysis.findings import finding
from snooker_cli.analysis.run_analysis import Records
from snooker_cli.formatting import point_label, probability, ratio, short, text_table, with_error

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


def usual(rows: Records) -> Records:
    """Rows or notes that are printed without ``--all``."""
    known = [row for row in rows if not row["model"].startswith("source report")]
    return [row for row in known if row["quantity"] not in FURTHER or "amplitude" not in row]


def named(rows: Records, field: str, parts: Sequence[str]) -> Records:
    """Rows or notes with one of these parts in a name of files or tables, or without a name."""
    names = [row[field] and f"{row[field]} {shown_name(row[field])}".lower() for row in rows]
    both = zip(rows, names, strict=True)
    return [row for row, name in both if not name or any(part.lower() in name for part in parts)]


def shown_name(name: str) -> str:
    """The name of a quantity or a model in tables."""
    name = name.replace("_amplitude_1", "").replace(CHI_SQUARE, "χ²/dof of speeds")
    return re.sub(" of a ball| at the (end|start)", "", re.sub("(?<=[a-z])_", " ", name))


def table_lines(rows: Records, every: bool, brief: bool = False) -> list[str]:
    """What holds for each point, and unless `brief` is wanted its table; `every` adds errors."""
    rows = [row for row in rows if not row.get("elastic")]
    columns, cells, is_fit = COMPARE_COLUMNS, compare_cells, bool(rows) and "amplitude" in rows[0]
    if is_fit:
        columns, cells = FIT_COLUMNS + MORE_FIT_COLUMNS * every, fit_cells
    head, *lines = text_table(columns.split(" | "), [cells(row, every) for row in rows])
    holds, tables = list[str](), list[str]()
    for title, group in groupby(zip(rows, lines, strict=True), lambda pair: point_heading(pair[0])):
        same, table = map(list, zip(*group, strict=True))
        tables += [title, head, *table]
        if sentence := finding(same * is_fit, same * (not is_fit)):
            holds.append(f"{point_label(same[0]['parameters'])}: {sentence}")
    return holds if brief else [*holds, *[""] * bool(holds), *tables]


def point_heading(row: dict[str, Any]) -> str:
    """A row's point, and how many of its repeats are complete."""
    total = row["simulated"] if "simulated" in row else row["repeats"] + row["failed"]
    return f"{point_label(row['parameters'])}: {row['complete']} of {total} complete"


def fit_cells(row: dict[str, Any], every: bool = False) -> list[str]:
    """A row of ``fits`` under ``FIT_COLUMNS``; `every` adds ``MORE_FIT_COLUMNS``."""
    cells = [
        shown_name(row["quantity"]),
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
    quantity, model = row["quantity"], row["model"]
    if not every:
        quantity, model = shown_name(quantity), shown_name(model)
    return [
        quantity + ("" if row["unit"] == "1" else f", {row['unit']}"),
        model,
        with_error(row["measured"], row["error"]) if every else short(row["measured"], 4),
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
