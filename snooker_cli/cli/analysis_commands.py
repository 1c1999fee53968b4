"""``snooker fit``, ``compare`` and ``report``: numbers from runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from snooker_cli.analysis.decay import SAMPLING
from snooker_cli.analysis.run_analysis import Records, RunAnalysis, comparisons, fits
from snooker_cli.cli.options import AsJson, RunName
from snooker_cli.cli.output import notice, point_label, print_line, print_result, table
from snooker_cli.formatting import short, with_error
from snooker_cli.runs import Run, open_run

FIT_COLUMNS = (
    "point | quantity | model | amplitude | >mean ± standard error, 1/s | >bootstrap | "
    ">(max-min)/2 | >R² | >rms residual | >repeats | >complete"
)
COMPARE_COLUMNS = (
    "point | quantity | model | >measured | >predicted | >difference | >in errors | >complete"
)


def fit(run: RunName, as_json: AsJson = False) -> None:
    """Fit decay constants of energy, temperature and pressure.

    The models are exponential decay and Haff's law, 1/(1 + αt)². Each repeat is fitted. The table
    shows the mean over the repeats with its standard error, the bootstrap error, and half of the
    range, which the source report calls the error. The result is saved in RUN/fit.json.
    """
    _print_analysis(run, fits, as_json, FIT_COLUMNS, _fit_cells, [SAMPLING])


def compare(run: RunName, as_json: AsJson = False) -> None:
    """Compare the results of RUN with theory.

    The theory is the ideal gas, the formulas of the source report and kinetic theory. Each row has
    the measured mean with its standard error, the prediction, and the difference, also in standard
    errors. The result is saved in RUN/compare.json.
    """
    _print_analysis(run, comparisons, as_json, COMPARE_COLUMNS, _compare_cells, [])


def _print_analysis(
    name: str,
    analyse: Callable[[Run], RunAnalysis],
    as_json: bool,
    columns: str,
    cells: Callable[[dict[str, Any]], list[str]],
    footer: list[str],
) -> None:
    """Analyse a run, print the rows and notes or, as JSON, the rows, and save both in a file."""
    run = open_run(name)
    found = analyse(run)
    lines = table(columns, [cells(one) for one in found.rows]) + footer
    print_result(found.rows, as_json, lines + _notes(found.notes, len(run.points)))
    found.save()


def _fit_cells(one: dict[str, Any]) -> list[str]:
    r_squared = one["r_squared"]
    return [
        point_label(one["parameters"]),
        one["quantity"].replace("_", " "),
        one["model"],
        one["amplitude"],
        with_error(one["value"], one["error"]),
        short(one["bootstrap_error"], 4),
        short(one["max_min_half_range"], 4),
        "–" if r_squared is None else f"{r_squared:.3f}".replace("-", "−"),
        short(one["rms_residual"], 2),
        str(one["repeats"]),
        str(one["complete"]),
    ]


def _compare_cells(one: dict[str, Any]) -> list[str]:
    in_errors = one["difference_in_errors"]
    return [
        point_label(one["parameters"]),
        one["quantity"] + ("" if one["unit"] == "1" else f", {one['unit']}"),
        one["model"],
        with_error(one["measured"], one["error"]),
        short(one["predicted"], 4),
        f"{one['difference']:+.3g}".replace("-", "−"),
        "–" if in_errors is None else f"{in_errors:+.1f}".replace("-", "−"),
        f"{one['complete']} of {one['simulated']}",
    ]


def _notes(notes: Records, points: int) -> list[str]:
    """Each note once, with the points that it is about if those are not all."""
    labels: dict[str, list[str]] = {}
    for one in notes:
        labels.setdefault(one["note"], []).append(point_label(one["parameters"]))
    return [
        note if len(about) == points else f"{'; '.join(about)}: {note}"
        for note, about in labels.items()
    ]


def report(
    runs: Annotated[
        Path, typer.Option("--runs", metavar="DIR", help="The folder with the runs of configs/.")
    ] = Path("runs"),
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="The report's folder.")] = Path(
        "runs/report"
    ),
) -> None:
    """Write the report on the reproduced results.

    It needs finished runs of configs/, which `make report` makes. It consists of figures,
    numbers.json, report.html and report.pdf.
    """
    from snooker_cli.report.build import build  # takes a second to load

    for path in build(runs, out, notice):
        print_line(str(path))
