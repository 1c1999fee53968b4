"""Lines and plain tables on stdout, the same on every terminal and behind every pipe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import typer

from snooker_cli.cli.exit_codes import until_nobody_reads
from snooker_cli.formatting import Column, table_lines


def tell(line: str) -> None:
    """Print a line; once nobody reads any more, as behind `| head`, the rest is done in silence."""
    with until_nobody_reads():
        typer.echo(line)


def print_table(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> None:
    """Print rows under headings."""
    for line in table_lines(columns, rows):
        tell(line)


def point_label(parameters: Mapping[str, object]) -> str:
    """A point's swept keys and values, as in ``cor=0.8, balls.radius=1.0``."""
    values = {key: "null" if value is None else value for key, value in parameters.items()}
    return ", ".join(f"{key}={value}" for key, value in values.items()) or "all"
