"""Rows of fits and comparisons as cells of a table."""

from typing import Any

from snooker_cli.analysis.decay import range_held
from snooker_cli.analysis.run_analysis import Records
from snooker_cli.formatting import point_label, ratio, short, with_error

FIT_COLUMNS = (
    "point | quantity | model | A | >constant, 1/s | >χ²/dof | >holds, s | >end/fit | >complete"
)
COMPARE_COLUMNS = (
    "point | quantity | model | >measured | >predicted | >difference | >in errors | >complete"
)


def fit_cells(one: dict[str, Any]) -> list[str]:
    """A row of ``fits`` under ``FIT_COLUMNS``."""
    constant = "no decay" if one["elastic"] else with_error(one["value"], one["error"])
    return [
        point_label(one["parameters"]),
        one["quantity"].removesuffix("_amplitude_1").replace("_", " "),
        one["model"],
        "1" if one["amplitude"] == "fixed at 1" else "free",
        constant,
        ratio(one["chi_squared_per_degree"]),
        range_held(one),
        ratio(one["end_over_fit"]),
        f"{one['complete']} of {one['repeats'] + one['failed']}",
    ]


def compare_cells(one: dict[str, Any]) -> list[str]:
    """A row of ``comparisons`` under ``COMPARE_COLUMNS``."""
    in_errors, difference = one["difference_in_errors"], one["difference"]
    error = None if in_errors is None else one["difference_error"]
    sign = "+" if difference >= 0 else ""
    return [
        point_label(one["parameters"]),
        one["quantity"] + ("" if one["unit"] == "1" else f", {one['unit']}"),
        one["model"],
        with_error(one["measured"], one["error"]),
        short(one["predicted"], 4),
        f"{sign}{with_error(difference, error)}",
        "–" if in_errors is None else f"{in_errors:+.1f}".replace("-", "−"),
        f"{one['complete']} of {one['simulated']}",
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
