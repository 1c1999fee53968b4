"""What commands print on stdout: lines, tables and JSON."""

import json
import os
import shutil
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer

from snooker_cli.formatting import printable


@contextmanager
def until_the_reader_leaves() -> Iterator[None]:
    """Inside, a reader that goes away, as `| head` does, causes no error."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_line(line: str) -> None:
    """Print a line on stdout."""
    with until_the_reader_leaves():
        typer.echo(printable(line, "\n"))


def print_result(
    content: Any, as_json: bool, lines: Iterable[str], notes: Iterable[str] = ()
) -> None:
    """Print a result: as one line of JSON, or as lines and notes wrapped to the terminal."""
    width = min(100, shutil.get_terminal_size((100, 0)).columns)
    text = [*lines, *(textwrap.fill(note, width, subsequent_indent="  ") for note in notes)]
    for line in [json.dumps(content, allow_nan=False)] if as_json else text:
        print_line(line)


def first(
    lines: Sequence[str], most: int = 201, rest: str = " points; --json prints all"
) -> list[str]:
    """The first lines, and how many more there are; by default of a table of points."""
    more = len(lines) - most
    return [*lines[:most], *([f"... and {more:,} more{rest}"] if more > 0 else [])]
