"""``snooker fit`` and ``compare``: numbers from runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Annotated

import typer

from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING
from snooker_cli.analysis.run_analysis import Records, RunAnalysis, comparisons, fits
from snooker_cli.analysis.tables import PAIRED, comparison_lines, fit_lines, note_lines
from snooker_cli.cli.options import AsJson, RunName
from snooker_cli.cli.output import print_result
from snooker_cli.runs import Run, open_run

All = Annotated[bool, typer.Option("--all", help="Print one table with more columns and rows.")]


def fit(
    run: RunName,
    since: Annotated[
        float, typer.Option("--from", metavar="S", help="Fit from this time on, s.")
    ] = 0.0,
    until: Annotated[
        float | None, typer.Option("--to", metavar="S", help="Fit up to this time, s.")
    ] = None,
    every: All = False,
    as_json: AsJson = False,
) -> None:
    """Fit decay constants of energy, temperature and pressure.

    The models are exponential decay and Haff's law, 1/(1 + αt)². Each repeat is fitted. A table
    shows the mean over the repeats with its standard error, χ² per degree of freedom, and the time
    until which the law holds within the errors over repeats. A is the amplitude, 1 or free. The
    last column is the value at the end over the fit. --all adds half of the range, which is the
    source report's error, and the bootstrap error. The fits of all times are saved in RUN/fit.json.
    With --from or --to they are only printed; from a later time on, the amplitude is free.
    """
    analyse = partial(fits, since=since, until=math.inf if until is None else until)
    lines = partial(fit_lines, every=every)
    _print_analysis(run, analyse, as_json, lines, [SAMPLING, JUDGEMENT])


def compare(run: RunName, every: All = False, as_json: AsJson = False) -> None:
    """Compare the results of RUN with theory.

    The theory is the ideal gas and kinetic theory. Each row has the measured mean, the prediction,
    and the difference with its standard error, also in such errors. --all adds the standard error
    of the mean and the formulas of the source report. The result is saved in RUN/compare.json.
    """
    footer = f"{PAIRED} --all also has these errors and the formulas of the source report."
    _print_analysis(run, comparisons, as_json, partial(comparison_lines, every=every), [footer])


def _print_analysis(
    name: str,
    analyse: Callable[[Run], RunAnalysis],
    as_json: bool,
    lines: Callable[[Records], list[str]],
    footer: list[str],
) -> None:
    """Analyse a run, print the rows and notes or, as JSON, the rows, and save both in a file."""
    run = open_run(name)
    found = analyse(run)
    text = [*lines(found.rows), *footer, *note_lines(found.notes, len(run.points))]
    print_result(found.rows, as_json, text)
    found.save()
