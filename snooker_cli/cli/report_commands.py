"""``snooker report`` and ``reproduce``: pages on own runs and on the source report."""

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli.options import complete_runs
from snooker_cli.cli.output import print_line
from snooker_cli.cli.run_command import run
from snooker_cli.config import EXAMPLES
from snooker_cli.errors import RunError
from snooker_cli.progress import notice
from snooker_cli.runs import open_run
from snooker_cli.runs.status import run_status


def report(
    runs: Annotated[
        list[str],
        typer.Argument(
            metavar="RUN",
            help="Folders of runs, or their names in runs/.",
            autocompletion=complete_runs,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="The report's folder [RUN/report]."),
    ] = None,
) -> None:
    """Write a report on runs as HTML and PDF.

    Each RUN gets a chapter: its config, how its repeats ended, the figures that fit it, the fits,
    the comparison with theory, and how to reproduce it. The HTML page plays a repeat. The same
    runs give the same bytes. The names of the written files are printed.
    """
    opened = [open_run(name) for name in dict.fromkeys(runs)]
    from snooker_cli.report.run_report import run_report  # takes a second to load

    for path in run_report(opened, out or opened[0].directory / "report", notice):
        print_line(str(path))


def reproduce(
    runs: Annotated[
        Path, typer.Option("--runs", metavar="DIR", help="The folder with the runs of configs/.")
    ] = Path("runs"),
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="The report's folder.")] = Path(
        "runs/report"
    ),
) -> None:
    """Write the reproduction of the source report.

    Runs of configs/ that are missing or unfinished are simulated first, which takes minutes. The
    report consists of figures, numbers.json, report.html and report.pdf.
    """
    from snooker_cli.report.build import build  # takes a second to load
    from snooker_cli.report.content import RUNS

    for name in RUNS:
        if not _is_done(runs / name):
            run(EXAMPLES / f"{name}.yaml", out=runs / name)
    for path in build(runs, out, notice):
        print_line(str(path))


def _is_done(folder: Path) -> bool:
    """Whether a folder holds a finished run."""
    with suppress(RunError):
        return bool(run_status(open_run(folder))["state"] == "done")
    return False
