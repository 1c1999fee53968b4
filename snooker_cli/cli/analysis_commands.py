"""``snooker fit`` and ``compare``: numbers from runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

import typer

from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING
from snooker_cli.analysis.run_analysis import RunAnalysis, comparisons, fits
from snooker_cli.analysis.tables import (
    COMPARE_COLUMNS,
    FIT_COLUMNS,
    compare_cells,
    fit_cells,
    note_lines,
)
from snooker_cli.cli.options import AsJson, RunName
from snooker_cli.cli.output import print_result, table
from snooker_cli.runs import Run, open_run

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
    _print_analysis(run, analyse, as_json, FIT_COLUMNS, fit_cells, [SAMPLING, JUDGEMENT])


def compare(run: RunName, as_json: AsJson = False) -> None:
    """Compare the results of RUN with theory.

    The theory is the ideal gas, the formulas of the source report and kinetic theory. Each row has
    the measured mean with its standard error, the prediction, and the difference with its standard
    error, also in such errors. The result is saved in RUN/compare.json.
    """
    _print_analysis(run, comparisons, as_json, COMPARE_COLUMNS, compare_cells, [PAIRED])


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
    print_result(found.rows, as_json, lines + note_lines(found.notes, len(run.points)))
    found.save()
