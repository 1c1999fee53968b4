"""``snooker reproduce``: the reproduction of the source report."""

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli.output import notice, print_line
from snooker_cli.cli.run_command import run
from snooker_cli.config import EXAMPLES
from snooker_cli.errors import RunError
from snooker_cli.runs import open_run
from snooker_cli.runs.status import run_status


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
