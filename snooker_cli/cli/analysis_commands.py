"""``snooker fit``, ``compare`` and ``report``: numbers from runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING, range_held
from snooker_cli.analysis.run_analysis import Records, RunAnalysis, comparisons, fits
from snooker_cli.cli.options import AsJson, RunName
from snooker_cli.cli.output import notice, point_label, print_line, print_result, table
from snooker_cli.formatting import ratio, short, with_error
from snooker_cli.runs import Run, open_run

FIT_COLUMNS = (
    "point | quantity | model | A | >constant, 1/s | >χ²/dof | >holds, s | >end/fit | >complete"
)
COMPARE_COLUMNS = (
    "point | quantity | model | >measured | >predicted | >difference | >in errors | >complete"
)

PAIRED = (
    "A difference is taken in each repeat, because many predictions use its own temperature. Its "
    "error is over these differences, so that it can be less than the error of the measured mean."
)
"""What a reader of the errors of ``compare`` has to know."""


def fit(
    run: RunName,
    since: Annotated[
        float, typer.Option("--from", metavar="S", help="Fit from this time on, s.")
    ] = 0.0,
    until: Annotated[
        float | None, typer.Option("--to", metavar="S", help="Fit up to this time, s.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fit decay constants of energy, temperature and pressure.

    The models are exponential decay and Haff's law, 1/(1 + αt)². Each repeat is fitted. The table
    shows the mean over the repeats with its standard error, χ² per degree of freedom, and the time
    until which the law holds within the errors over repeats. A is the amplitude, 1 or free. The
    last columns are the value at the end over the fit, and how many repeats are complete. --json
    has more errors. The fits of all times are saved in RUN/fit.json. With --from or --to they are
    only printed; from a later time on, the amplitude is free.
    """
    end = math.inf if until is None else until
    analyse = partial(fits, since=since, until=end)
    _print_analysis(run, analyse, as_json, FIT_COLUMNS, _fit_cells, [SAMPLING, JUDGEMENT])


def compare(run: RunName, as_json: AsJson = False) -> None:
    """Compare the results of RUN with theory.

    The theory is the ideal gas, the formulas of the source report and kinetic theory. Each row has
    the measured mean with its standard error, the prediction, and the difference with its standard
    error, also in such errors. The result is saved in RUN/compare.json.
    """
    _print_analysis(run, comparisons, as_json, COMPARE_COLUMNS, _compare_cells, [PAIRED])


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


def _compare_cells(one: dict[str, Any]) -> list[str]:
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
