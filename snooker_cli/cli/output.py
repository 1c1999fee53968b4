"""What commands print on stdout: lines, tables and JSON."""

import errno
import json
import shutil
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer

from snooker_cli.errors import drop
from snooker_cli.formatting import printable, text_table


@contextmanager
def until_the_reader_leaves() -> Iterator[None]:
    """Inside, a reader that goes away, as `| head` or a terminal does, causes no error.

    Another error is named after stdout.
    """
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        drop(sys.stdout)
        if error.errno not in (errno.EPIPE, errno.EIO):
            error.filename = error.filename or "stdout"
            raise


def print_line(line: str) -> None:
    """Print a line on stdout."""
    with until_the_reader_leaves():
        typer.echo(printable(line, "\n"))


def print_result(
    content: Any, as_json: bool, lines: Iterable[str], notes: Iterable[str] = ()
) -> None:
    """Print a result: as one line of JSON, or as lines and notes wrapped to the terminal."""
    for line in [json.dumps(content, allow_nan=False)] if as_json else lines:
        print_line(line)
    print_wrapped(() if as_json else notes)


def print_wrapped(lines: Iterable[str], indent: int = 2) -> None:
    """Print lines wrapped to the terminal, at most 100 columns; indent what follows the first."""
    width = min(100, shutil.get_terminal_size((100, 0)).columns)
    later = " " * min(indent, width // 2)
    for line in lines:
        print_line(textwrap.fill(line, width, subsequent_indent=later, break_on_hyphens=False))


def print_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print rows under headings; the last column is wrapped to the terminal."""
    lines = text_table(headings, rows)
    print_wrapped(lines, indent=lines[0].rindex(headings[-1]))
