"""``snooker fit``, ``compare`` and ``report``: numbers from runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli import options
from snooker_cli.cli.output import tell
from snooker_cli.cli.run_command import AsJson

if TYPE_CHECKING:
    from collections.abc import Callable

    from snooker_cli.analysis.run_analysis import Records, RunAnalysis
    from snooker_cli.formatting import Column
    from snooker_cli.runs import Run


RUN = typer.Argument(
    metavar="RUN", help="A run's folder, or its name in runs/.", autocompletion=options.runs
)
RunName = Annotated[str, RUN]


def fit(run: RunName, as_json: AsJson = False) -> None:
    """Fit decay constants of energy, temperature and pressure to every repeat of RUN.

    Exponential and Haff's law, 1/(1 + αt)². Shown are the mean over the repeats and its standard
    error, the bootstrap's, and (largest - smallest)/2, which is the report's way. Saved in
    RUN/fit.json.
    """
    from snooker_cli.analysis.decay import SAMPLING
    from snooker_cli.analysis.run_analysis import fits
    from snooker_cli.cli.output import point_label
    from snooker_cli.formatting import Column, short, with_error

    def cells(one: dict[str, Any]) -> list[str]:
        return [
            point_label(one["parameters"]),
            one["quantity"].replace("_", " "),
            one["model"],
            with_error(one["value"], one["error"]),
            short(one["bootstrap_error"], 4),
            short(one["max_min_half_range"], 4),
            "–" if one["r_squared"] is None else f"{one['r_squared']:.3f}".replace("-", "−"),
            short(one["rms_residual"], 2),
            str(one["repeats"]),
        ]

    columns = [
        Column("point"),
        Column("quantity"),
        Column("model"),
        Column("mean ± standard error, 1/s", True),
        Column("bootstrap", True),
        Column("(max-min)/2", True),
        Column("R²", True),
        Column("rms residual", True),
        Column("repeats", True),
    ]
    _tell(run, fits, as_json, columns, cells, SAMPLING)


def compare(run: RunName, as_json: AsJson = False) -> None:
    """Set what RUN measured beside the ideal gas, the report's formulas and kinetic theory.

    Each row: measured mean and standard error, prediction, difference, and the difference in its
    standard errors. Saved in RUN/compare.json.
    """
    from snooker_cli.analysis.run_analysis import comparisons
    from snooker_cli.cli.output import point_label
    from snooker_cli.formatting import Column, short, with_error

    def cells(one: dict[str, Any]) -> list[str]:
        return [
            point_label(one["parameters"]),
            one["quantity"] + ("" if one["unit"] == "1" else f", {one['unit']}"),
            one["model"],
            with_error(one["measured"], one["error"]),
            short(one["predicted"], 4),
            f"{one['difference']:+.3g}".replace("-", "−"),
            "–"
            if one["difference_in_errors"] is None
            else f"{one['difference_in_errors']:+.1f}".replace("-", "−"),
        ]

    columns = [
        Column("point"),
        Column("quantity"),
        Column("model"),
        Column("measured", True),
        Column("predicted", True),
        Column("difference", True),
        Column("in errors", True),
    ]
    _tell(run, comparisons, as_json, columns, cells)


def _tell(
    name: str,
    analyse: Callable[[Run], RunAnalysis],
    as_json: bool,
    columns: list[Column],
    cells: Callable[[dict[str, Any]], list[str]],
    footer: str = "",
) -> None:
    """Analyse a run, print the rows and notes or, as JSON, the rows, and save both in a file."""
    import json

    from snooker_cli.cli.output import print_table
    from snooker_cli.runs import open_run

    run = open_run(name)
    found = analyse(run)
    if as_json:
        tell(json.dumps(found.rows))
    else:
        print_table(columns, [cells(one) for one in found.rows])
        if footer:
            tell(footer)
        _print_notes(found.notes, len(run.points))
    found.save()


def _print_notes(notes: Records, points: int) -> None:
    """The notes under a table, each once, with the points it is about if those are not all."""
    from snooker_cli.cli.output import point_label

    labels: dict[str, list[str]] = {}
    for one in notes:
        labels.setdefault(one["note"], []).append(point_label(one["parameters"]))
    for note, about in labels.items():
        tell(note if len(about) == points else f"{'; '.join(about)}: {note}")


def report(
    runs: Annotated[
        Path, typer.Option("--runs", metavar="DIR", help="Where the runs of configs/ are.")
    ] = Path("runs"),
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="The report's folder.")] = Path(
        "runs/report"
    ),
) -> None:
    """Write the report from finished runs: figures, numbers.json, report.html and report.pdf.

    `make report` makes the runs it needs first.
    """
    from snooker_cli.cli.progress_bar import say
    from snooker_cli.report.build import build

    for path in build(runs, out, say):
        tell(str(path))
