"""``snooker fit``, ``compare``, ``report`` and ``reproduce``: numbers and pages from runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Annotated

from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING
from snooker_cli.analysis.run_analysis import RunAnalysis, comparisons, fits
from snooker_cli.analysis.tables import (
    PAIRED,
    main_rows,
    note_lines,
    rows_with,
    short_name,
    table_lines,
)
from snooker_cli.cli.options import RUN, AsJson, Names, RunName, Where, conditions, flag, option
from snooker_cli.cli.output import make_folder, make_own_folder, print_line, print_result
from snooker_cli.cli.run_command import run as simulate
from snooker_cli.config import EXAMPLES
from snooker_cli.errors import RunError, UserError, check_name, notice
from snooker_cli.figures import FIGURES
from snooker_cli.figures.captions import unfinished
from snooker_cli.figures.selection import Selection, matching
from snooker_cli.formatting import listed
from snooker_cli.runs import open_run
from snooker_cli.runs.progress import counting
from snooker_cli.runs.status import early_warning, run_status

All = Annotated[bool, flag("--all", "Print more columns and rows.")]
Brief = Annotated[bool, flag("--brief", "Print what holds for each point, without tables.")]


def fit(
    run: RunName,
    where: Where = None,
    quantity: Names = None,
    model: Names = None,
    since: Annotated[float, option("T", "Fit from this time on, s.", "--from")] = 0.0,
    until: Annotated[float | None, option("T", "Fit up to this time, s.", "--until")] = None,
    every: All = False,
    brief: Brief = False,
    as_json: AsJson = False,
) -> None:
    """Fit decay constants of energy, temperature and pressure.

    The models are exponential decay and Haff's law, 1/(1 + αt)². Each repeat is fitted. The output
    begins with what holds for the energy at each point; --brief prints only this. A table shows the
    mean over the repeats with its standard error, the probability p of deviations as large if the
    law holds, and the time until which it holds. A is the amplitude, 1 or free. The last column is
    the value at the end over the fit. --all adds half of the range, which is the source report's
    error, the temperature, and A = 1 for the pressure, which the source report has. With --from,
    the amplitude is free. The results of all times are kept in RUN/analysis.json.
    """
    analyse = partial(fits, since=since, until=math.inf if until is None else until)
    notes = [SAMPLING, JUDGEMENT]
    _print_analysis(run, where, quantity, model, analyse, as_json, every, brief, notes)


def compare(
    run: RunName,
    where: Where = None,
    quantity: Names = None,
    model: Names = None,
    every: All = False,
    brief: Brief = False,
    as_json: AsJson = False,
) -> None:
    """Compare the results of RUN with theory.

    The theory is the ideal gas and kinetic theory. The output begins with the main difference at
    each point; --brief prints only this. Each row has the measured mean, the prediction, and the
    difference with its standard error, also in such errors. --all adds the standard error of the
    mean and the formulas of the source report. The results are
    kept in RUN/analysis.json.
    """
    footer = f"{PAIRED} --all also has these errors and the formulas of the source report."
    _print_analysis(run, where, quantity, model, comparisons, as_json, every, brief, [footer])


def _print_analysis(
    name: str,
    where: Sequence[str] | None,
    quantity: Sequence[str] | None,
    model: Sequence[str] | None,
    analyse: Callable[..., RunAnalysis],
    as_json: bool,
    every: bool,
    brief: bool,
    footer: list[str],
) -> None:
    """Analyse points of a run, print rows and notes or, as JSON, the rows, and save both in a file.

    quantity, model : parts of the names that a row may have
    every : also rows for few readers; without it they are printed if no others are wanted
    brief : only what holds for each point
    """
    run = open_run(name)
    selection = Selection(conditions(where, run))
    points = matching(run, selection)
    analysis = analyse(run, points=points, counting=counting)
    rows, notes = analysis.rows, analysis.notes
    for field, parts in {"quantity": quantity or [""], "model": model or [""]}.items():
        names = dict.fromkeys(f"'{short_name(row[field])}'" for row in rows)  # some have commas
        for part in parts:
            if names and not rows_with(rows, field, [part]):
                problem = f"--{field} {part}: no {field} contains this"
                raise UserError(f"{problem}; there are {listed([*names])}")
        rows, notes = rows_with(rows, field, parts), rows_with(notes, field, parts)
    lines = table_lines(rows if every else main_rows(rows) or rows, every, brief)
    if where or quantity or model or not lines:
        footer = []
    below = [*footer, *note_lines(notes if every else main_rows(notes), len(points))]
    missing = unfinished(run, selection) if brief else ""  # else it is among the notes
    if missing:
        notice(f"{missing}; run the config again for the rest")
    if warning := early_warning(run, points):
        notice(warning)
    print_result(rows, as_json, lines, [] if brief else below)


def report(
    runs: Annotated[list[str], RUN],
    out: Annotated[Path | None, option("DIR", "The report's folder [RUN/report].")] = None,
    figures: Annotated[str, option("F,F,…", "Also these figures; all: every possible one.")] = "",
) -> None:
    """Write a report on runs as HTML and PDF.

    It begins with what holds for each RUN and its points. Each RUN gets a chapter: the figures that
    say most, a film in the HTML page, and how to reproduce it. An appendix has the config, fits and
    comparisons. The same runs give the same bytes. The names of the written files are printed.
    """
    asked = list(FIGURES) if figures == "all" else figures.split(",") if figures else []
    for name in asked:
        check_name(name, FIGURES, "figure", "snooker plot --list")
    opened = [open_run(name) for name in dict.fromkeys(runs)]
    from snooker_cli.report.run_report import run_report  # takes a second to load

    folder = out or make_own_folder(opened[0].directory / "report")
    make_folder(folder)
    for path in run_report(opened, folder, notice, asked):
        print_line(str(path))


def reproduce(
    runs: Annotated[Path, option("DIR", "The folder with the runs of configs/.")] = Path("runs"),
    out: Annotated[Path, option("DIR", "The report's folder.")] = Path("runs/report"),
) -> None:
    """Write the reproduction of the source report.

    Runs of configs/ that are missing or unfinished are simulated first, which takes minutes. The
    paper is report.pdf, its tables are report-tables.pdf; both are HTML pages, too. numbers.json
    has the numbers. live.html runs the gas in the browser, see `snooker live`.
    """
    from snooker_cli.report.document import require_libraries
    from snooker_cli.reproduction.reproduce import RUNS, build  # takes a second to load

    require_libraries()  # before the simulations
    make_folder(out)
    for name in RUNS:
        state = ""
        with suppress(RunError):
            state = run_status(open_run(runs / name))["state"]
        if state != "done":
            simulate(EXAMPLES / f"{name}.yaml", out=runs / name)
    for path in build(runs, out, notice):
        print_line(str(path))
