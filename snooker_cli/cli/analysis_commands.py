"""``snooker fit``, ``compare``, ``report`` and ``reproduce``: numbers and pages from runs."""

from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import snooker_cli as snooker
from snooker_cli import options
from snooker_cli.cli.output import print_line, print_result
from snooker_cli.cli.parameters import RUN, RunNames, split, takes
from snooker_cli.errors import RunError, notice


@takes(
    *(options.WHERE, options.QUANTITY, options.MODEL, options.FIT_SINCE, options.FIT_UNTIL),
    *(options.ALL, options.BRIEF, options.AS_JSON),
)
def fit(
    runs: RunNames, *, where: list[str], every: bool, brief: bool, as_json: bool, **how: Any
) -> None:
    """Fit decay constants of energy, temperature and pressure.

    The models are exponential decay and Haff's law, 1/(1 + αt)². Each repeat is fitted. The output
    begins with what holds for the energy at each point; --brief prints only this. A table shows the
    mean over the repeats with its standard error, the probability p of deviations as large if the
    law holds, and the time until which it holds. A is the amplitude, 1 or free. The last column is
    the value at the end over the fit. --all adds half of the range, which is the source report's
    error, the temperature, and A = 1 for the pressure, which the source report has. With --from,
    the amplitude is free. Results of all times are kept for the next command. Of several runs, a
    table has one law, and the points of all runs as rows.
    """
    opened = snooker.open(*runs)
    _print_records(opened.fit(**how, **opened.where(*where)), as_json, every, brief)


@takes(
    *(options.WHERE, options.QUANTITY, options.MODEL, options.ALL, options.BRIEF, options.AS_JSON)
)
def compare(
    runs: RunNames, *, where: list[str], every: bool, brief: bool, as_json: bool, **how: Any
) -> None:
    """Compare the results of RUN with theory.

    The theory is the ideal gas and kinetic theory. The output begins with the main difference at
    each point; --brief prints only this. Each row has the measured mean, the prediction, and the
    difference with its standard error, also in such errors. --all adds the standard error of the
    mean and the formulas of the source report. The results are kept for the next
    command. Of several runs, a table has one theory, and the points of all runs as rows.
    """
    opened = snooker.open(*runs)
    _print_records(opened.compare(**how, **opened.where(*where)), as_json, every, brief)


def _print_records(records: snooker.Records, as_json: bool, every: bool, brief: bool) -> None:
    """Print what holds for each point, and unless `brief` is wanted, tables and remarks."""
    if brief and records.unfinished:  # else it is among the remarks
        notice(f"{records.unfinished}; run the config again for the rest")
    if records.warning:
        notice(records.warning)
    remarks = [] if brief else records.remarks(every=every)
    print_result(records, as_json, records.lines(every=every, brief=brief), remarks)


@takes(options.REPORT_OUT, options.FIGURES, options.MARKDOWN)
def report(
    runs: Annotated[list[str], RUN], *, out: Path | None, figures: str, markdown: bool
) -> None:
    """Write a report on runs as HTML and PDF, or as Markdown.

    It begins with what holds for each RUN and its points. Each RUN gets a chapter: the figures that
    say most, a film in the HTML page, and how to reproduce it. An appendix has the config, fits and
    comparisons. The same runs give the same bytes. The names of the written files are printed. With
    --markdown it is a text for your own use, without films.
    """
    asked = figures if figures == "all" else split(figures)
    for path in snooker.write_report(dict.fromkeys(runs), out, asked, markdown=markdown):
        print_line(str(path))


@takes(options.RUNS, options.REPRODUCTION_OUT)
def reproduce(*, runs: Path, out: Path) -> None:
    """Write the reproduction of the source report.

    Runs of configs/ that are missing or unfinished are simulated first, which takes minutes. The
    paper is report.pdf, its tables are report-tables.pdf; both are HTML pages, too. numbers.json
    has the numbers. live.html runs the gas in the browser, see `snooker live`.
    """
    from snooker_cli.api.output_files import made_folder
    from snooker_cli.api.simulating import PlannedRun
    from snooker_cli.cli.run_command import finish
    from snooker_cli.config.template_configs import EXAMPLES
    from snooker_cli.report.document import require_libraries
    from snooker_cli.reproduction.reproduce import RUNS, build  # takes a second to load

    require_libraries()  # before the simulations
    with made_folder(out):
        for name in RUNS:
            state = ""
            with suppress(RunError):
                state = snooker.open(runs / name).status()["state"]
            if state != "done":
                finish(PlannedRun(EXAMPLES / f"{name}.yaml", out=runs / name))
        for path in build(runs, out, notice):
            print_line(str(path))
