"""What commands print on stdout: lines, tables and JSON."""

import json
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer

from snooker_cli.formatting import printable, text_table

MOST_ROWS = 200  # points in a table that is printed; a terminal keeps about as many lines


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


def print_json(data: Any) -> None:
    """Print data as one line of JSON."""
    print_line(json.dumps(data, allow_nan=False))


def print_result(content: Any, as_json: bool, lines: Iterable[str]) -> None:
    """Print a command's result: the content as JSON, or lines of text."""
    if as_json:
        print_json(content)
    else:
        for line in lines:
            print_line(line)


def table(headings: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows under headings: ``name | >number``, where > aligns a column on the right."""
    return text_table(headings.split(" | "), rows)


def first(lines: Sequence[str], most: int, rest: str) -> list[str]:
    """The first lines, and how many more there are: ``... and 7 more <rest>``."""
    more = len(lines) - most
    return [*lines[:most], *([f"... and {more:,} more{rest}"] if more > 0 else [])]


def point_table(headings: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """A table with a row for each of the first points."""
    heading, *lines = table(headings, rows)
    return [heading, *first(lines, MOST_ROWS, " points; --json prints all")]
