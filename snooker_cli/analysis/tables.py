"""Rows of fits and comparisons as cells and lines of tables."""

from itertools import groupby
from typing import Any

from snooker_cli.analysis.comparison import CHI_SQUARE
from snooker_cli.analysis.decay import range_held
from snooker_cli.analysis.run_analysis import Records
from snooker_cli.formatting import point_label, ratio, short, text_table, with_error

FIT_COLUMNS = "quantity | model | A | >constant, 1/s | >χ²/dof | >holds, s | >end/fit"
COMPARE_COLUMNS = "quantity | model | >measured | >predicted | >difference | >in errors"
"""Columns of a point's table. It fits 100 columns of a terminal."""

MORE_FIT_COLUMNS = " | >half range | >bootstrap error"

PAIRED = (
    "A difference is taken in each repeat, because many predictions use its own temperature. Its "
    "error is over these differences, so that it can be less than the error of the measured mean."
)
"""What a reader of the errors of comparisons has to know."""


def fit_lines(rows: Records, every: bool) -> list[str]:
    """A table of each point; `every` adds the source report's and the bootstrap error."""
    columns = FIT_COLUMNS + MORE_FIT_COLUMNS * every
    return _lines(rows, columns, [fit_cells(one, every) for one in rows])


def comparison_lines(rows: Records, every: bool) -> list[str]:
    """A table of each point; `every` adds the errors of means and the source report's formulas."""
    kept = rows if every else usual(rows)
    return _lines(kept, COMPARE_COLUMNS, [compare_cells(one, every) for one in kept])


def usual(rows: Records) -> Records:
    """Rows of ``comparisons`` without the formulas of the source report."""
    return [one for one in rows if not one["model"].startswith("source report")]


def _lines(rows: Records, columns: str, cells: list[list[str]]) -> list[str]:
    head, *lines = text_table(columns.split(" | "), cells)
    titles = [f"{point_label(one['parameters'])}: {share_complete(one)} complete" for one in rows]
    found = []
    for title, group in groupby(zip(titles, lines, strict=True), lambda each: each[0]):
        found += [title, head, *(line for _, line in group)]
    return found


def share_complete(one: dict[str, Any]) -> str:
    """How many repeats of a row's point are complete."""
    total = one["simulated"] if "simulated" in one else one["repeats"] + one["failed"]
    return f"{one['complete']} of {total}"


def fit_cells(one: dict[str, Any], every: bool = False) -> list[str]:
    """A row of ``fits`` under ``FIT_COLUMNS``; `every` adds ``MORE_FIT_COLUMNS``."""
    cells = [
        one["quantity"].removesuffix("_amplitude_1").replace("_", " "),
        one["model"],
        "1" if one["amplitude"] == "fixed at 1" else "free",
        "no decay" if one["elastic"] else with_error(one["value"], one["error"]),
        ratio(one["chi_squared_per_degree"]),
        range_held(one),
        ratio(one["end_over_fit"]),
    ]
    more = short(one["max_min_half_range"], 2), short(one["bootstrap_error"], 2)
    return [*cells, *(more if every else ())]


def compare_cells(one: dict[str, Any], every: bool = False) -> list[str]:
    """A row of ``comparisons`` under ``COMPARE_COLUMNS``; `every` has whole names and an error."""
    in_errors, difference = one["difference_in_errors"], one["difference"]
    error = None if in_errors is None else one["difference_error"]
    quantity, model = one["quantity"], one["model"]
    if not every:
        quantity = quantity.replace(CHI_SQUARE, "χ²/dof of speeds").removesuffix(" of a ball")
        quantity, model = quantity.removesuffix(" at the end"), model.removesuffix(" at the start")
    return [
        quantity + ("" if one["unit"] == "1" else f", {one['unit']}"),
        model,
        with_error(one["measured"], one["error"]) if every else short(one["measured"], 4),
        short(one["predicted"], 4),
        f"{'+' if difference >= 0 else ''}{with_error(difference, error)}",
        "–" if in_errors is None else f"{in_errors:+.1f}".replace("-", "−"),
    ]


def note_lines(notes: Records, points: int) -> list[str]:
    """Each note once, with the points that it is about if those are not all."""
    labels: dict[str, list[str]] = {}
    for one in notes:
        labels.setdefault(one["note"], []).append(point_label(one["parameters"]))
    return [
        note if len(about) == points else f"{'; '.join(about)}: {note}"
        for note, about in labels.items()
    ]
