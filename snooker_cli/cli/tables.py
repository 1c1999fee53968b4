"""Lines and plain tables on stdout, the same on every terminal and behind every pipe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import typer

from snooker_cli.cli.endings import until_nobody_reads


class Column(NamedTuple):
    """A column's heading and whether its values stand on the right, as numbers do."""

    heading: str
    right: bool = False


def tell(line: str) -> None:
    """Print a line; once nobody reads any more, as behind `| head`, the rest is done in silence."""
    with until_nobody_reads():
        typer.echo(line)


def print_table(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> None:
    """Print rows under headings."""
    for line in table_lines(columns, rows):
        tell(line)


def table_lines(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows under headings, columns as wide as their widest value."""
    table = [[column.heading for column in columns], *rows]
    widths = [max(len(row[k]) for row in table) for k in range(len(columns))]
    lines = []
    for row in table:
        cells = [
            cell.rjust(width) if column.right else cell.ljust(width)
            for cell, width, column in zip(row, widths, columns, strict=True)
        ]
        lines.append("  ".join(cells).rstrip())
    return lines


def point_label(parameters: Mapping[str, object]) -> str:
    """A point's swept keys and values, as in ``cor=0.8, balls.radius=1.0``."""
    values = {key: "null" if value is None else value for key, value in parameters.items()}
    return ", ".join(f"{key}={value}" for key, value in values.items()) or "all"
