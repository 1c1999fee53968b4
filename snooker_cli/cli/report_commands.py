"""``snooker reproduce``: the reproduction of the source report."""

from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli.output import notice, print_line


def reproduce(
    runs: Annotated[
        Path, typer.Option("--runs", metavar="DIR", help="The folder with the runs of configs/.")
    ] = Path("runs"),
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="The report's folder.")] = Path(
        "runs/report"
    ),
) -> None:
    """Write the reproduction of the source report.

    It needs finished runs of configs/, which `make report` makes. It consists of figures,
    numbers.json, report.html and report.pdf.
    """
    from snooker_cli.report.build import build  # takes a second to load

    for path in build(runs, out, notice):
        print_line(str(path))
