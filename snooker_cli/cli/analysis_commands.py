"""``snooker fit``, ``compare`` and ``report``: numbers from runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli import options
from snooker_cli.cli.output import tell
from snooker_cli.cli.run_command import AsJson

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from snooker_cli.formatting import Column
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace

    Records = list[dict[str, Any]]
    Analysis = Callable[[Iterator[Trace], dict[str, Any]], tuple[Records, Sequence[str]]]


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
    from snooker_cli.analysis.decay import SAMPLING, decays, notes, record
    from snooker_cli.cli.output import point_label
    from snooker_cli.formatting import Column, short, with_error

    def analysis(
        traces: Iterator[Trace], parameters: dict[str, Any]
    ) -> tuple[Records, Sequence[str]]:
        found = decays(traces)
        return [record(one, parameters) for one in found], notes(found)

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
    _tell(run, "fit.json", analysis, as_json, columns, cells, SAMPLING)


def compare(run: RunName, as_json: AsJson = False) -> None:
    """Set what RUN measured beside the ideal gas, the report's formulas and kinetic theory.

    Each row: measured mean and standard error, prediction, difference, and the difference in its
    standard errors. Saved in RUN/compare.json.
    """
    from snooker_cli.analysis.comparison import compare as comparisons
    from snooker_cli.analysis.comparison import record
    from snooker_cli.cli.output import point_label
    from snooker_cli.formatting import Column, short, with_error

    def analysis(
        traces: Iterator[Trace], parameters: dict[str, Any]
    ) -> tuple[Records, Sequence[str]]:
        found = comparisons(traces)
        return [record(row, parameters) for row in found.rows], found.notes

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
    _tell(run, "compare.json", analysis, as_json, columns, cells)


def _tell(
    name: str,
    file: str,
    analysis: Analysis,
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
    rows, notes = _analysed(run, analysis)
    if as_json:
        tell(json.dumps(rows))
    else:
        print_table(columns, [cells(one) for one in rows])
        if footer:
            tell(footer)
        _print_notes(notes, len(run.points))
    _save(run, file, rows, notes)


def _analysed(run: Run, analysis: Analysis) -> tuple[Records, Records]:
    """The rows of an analysis of every point, and notes.

    Points of an unfinished run are analysed as far as they are. Raises ``RunError`` if no repeat is
    there.
    """
    rows: Records = []
    notes: Records = []
    wanted = run.experiment.repeats
    present = {point.index: run.present(point) for point in run.points}
    for point in run.points:
        parameters, there = point.as_json(), len(present[point.index])
        if there < wanted:
            are = "the repeat is not" if wanted == 1 else f"{there} of {wanted} repeats are"
            said = f"{are} there; run the config again for the rest"
            notes.append({"parameters": parameters, "note": said})
        if said := not_extended(run.shorter(point), there):
            notes.append({"parameters": parameters, "note": said})
        # Where there is none at all, the first point says so.
        if there or not any(present.values()):
            found, sentences = analysis(run.traces(point, present[point.index]), parameters)
            rows += found
            notes += [{"parameters": parameters, "note": sentence} for sentence in sentences]
    return rows, notes


def _save(run: Run, name: str, rows: Records, notes: Records) -> None:
    """Save an analysis, printed already, in the run's folder. Raises ``RunError``."""
    from snooker_cli.errors import RunError
    from snooker_cli.runs import write_json

    try:
        write_json(run.directory / name, {"rows": rows, "notes": notes})
    except OSError as error:
        raise RunError(
            f"{run.directory / name}: cannot be written ({error.strerror}), so that the result is "
            "only printed; make the run's folder writable, or copy it"
        ) from None


def not_extended(shorter: int, there: int) -> str:
    """How many repeats an extension that is not finished has left as they were, if it has any."""
    if not shorter:
        return ""
    which = "the repeat" if there == 1 else f"{shorter} of {there} repeats"
    verb = "ends" if shorter == 1 else "end"
    return (
        f"{which} {verb} where the run did before it was extended; run the config again for the "
        "rest"
    )


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
