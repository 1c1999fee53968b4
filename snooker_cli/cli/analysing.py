"""``snooker fit``, ``compare`` and ``report``: numbers from runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from snooker_cli.cli.running import AsJson

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from snooker_cli.results import Run
    from snooker_cli.trace import Trace

Row = TypeVar("Row")

RunName = Annotated[str, typer.Argument(metavar="RUN", help="A run's folder, or name in runs/.")]


def fit(run: RunName, as_json: AsJson = False) -> None:
    """Fit decay constants of energy, temperature and pressure to every repeat of RUN.

    Exponential and Haff's law, 1/(1 + αt)². Shown are the mean over the repeats and its standard
    error, the bootstrap's, and (largest - smallest)/2, which is the report's way. Saved in
    RUN/fit.json.
    """
    import json

    from snooker_cli.cli.tables import Column, point_label, print_table
    from snooker_cli.decay import decays, record
    from snooker_cli.results import open_run
    from snooker_cli.words import short, with_error

    opened = open_run(run)
    records = _saved(opened, "fit.json", decays, record)
    if as_json:
        typer.echo(json.dumps(records))
        return
    print_table(
        [
            Column("point"),
            Column("quantity"),
            Column("model"),
            Column("mean ± standard error, 1/s", True),
            Column("bootstrap", True),
            Column("(max-min)/2", True),
            Column("R²", True),
            Column("repeats", True),
        ],
        [
            [
                point_label(one["parameters"]),
                one["quantity"].replace("_", " "),
                one["model"],
                with_error(one["value"], one["error"]),
                short(one["bootstrap_error"], 4),
                short(one["max_min_half_range"], 4),
                "–" if one["r_squared"] is None else f"{one['r_squared']:.3f}",
                str(one["repeats"]),
            ]
            for one in records
        ],
    )
    _mention_short(records)


def compare(run: RunName, as_json: AsJson = False) -> None:
    """Set what RUN measured beside the ideal gas, the report's formulas and kinetic theory.

    Each row: measured mean and standard error, prediction, difference, and the difference in its
    standard errors. Saved in RUN/compare.json.
    """
    import json

    from snooker_cli.cli.tables import Column, point_label, print_table
    from snooker_cli.compare import compare as comparisons
    from snooker_cli.compare import record
    from snooker_cli.results import open_run
    from snooker_cli.words import short, with_error

    opened = open_run(run)
    records = _saved(opened, "compare.json", comparisons, record)
    if as_json:
        typer.echo(json.dumps(records))
        return
    print_table(
        [
            Column("point"),
            Column("quantity"),
            Column("model"),
            Column("measured", True),
            Column("predicted", True),
            Column("difference", True),
            Column("in errors", True),
        ],
        [
            [
                point_label(one["parameters"]),
                one["quantity"] + ("" if one["unit"] == "1" else f", {one['unit']}"),
                one["model"],
                with_error(one["measured"], one["error"]),
                short(one["predicted"], 4),
                f"{one['difference']:+.3g}",
                "–"
                if one["difference_in_errors"] is None
                else f"{one['difference_in_errors']:+.1f}",
            ]
            for one in records
        ],
    )


def _saved(
    run: Run,
    name: str,
    analysis: Callable[[Iterator[Trace]], list[Row]],
    record: Callable[[Row, dict[str, Any]], dict[str, Any]],
) -> list[dict[str, Any]]:
    """The records of an analysis of every point, also saved beside the run."""
    from snooker_cli.results import write_json

    records = [
        record(row, point.as_json()) for point in run.points for row in analysis(run.traces(point))
    ]
    write_json(run.directory / name, records)
    return records


def _mention_short(records: list[dict[str, Any]]) -> None:
    """Say which points had repeats that ended early."""
    from snooker_cli.cli.tables import point_label

    seen = {point_label(one["parameters"]): one["short"] for one in records if one["short"]}
    for label, short in seen.items():
        typer.echo(
            f"{label}: {short} repeats ended early (wall trap or collapse), fitted up to there"
        )


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
    from snooker_cli.cli.progress import say
    from snooker_cli.report.build import build

    for path in build(runs, out, say):
        typer.echo(str(path))
