"""Words of Python instead of options of commands, in errors and in results."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from snooker_cli.errors import IN_COMMAND, SnookerError

ARGUMENTS = {
    "--all": "every=True",
    "--collisions": "most",
    "--controls": "controls",
    "--dpi": "dpi",
    "--executor": "executor",
    "--colour": "colour",
    "--format": "formats",
    "--fps": "fps",
    "--frames": "frames",
    "--fresh": "fresh=True",
    "--from": "since",
    "--jobs": "jobs",
    "--language": "language",
    "--log-x": "log_x",
    "--log-y": "log_y",
    "--model": "model",
    "--out": "out=…",
    "--part": "part",
    "--point": "point",
    "--quantity": "quantity",
    "--replace": "replace=True",
    "--size": "size",
    "--table": "table",
    "--time": "times",
    "--times": "times",
    "--until": "until",
    "--where": "keywords, as in cor=0.8",
    "--yes": "yes=True",
}
"""What Python has for the options of commands that errors of the package name."""

LIST_FIGURES, LIST_TEMPLATES = "snooker plot --list", "snooker init --list"
"""Commands that list names."""

MOST_LINES = 201  # of a table of points, with its headings


def in_python_words(text: str) -> str:
    """A text with arguments of Python instead of options, unless a command runs."""
    if IN_COMMAND.get():
        return text
    # A command in backticks is one that a user can give.
    parts = re.split("(`[^`]*`)", text)
    parts[::2] = (
        re.sub("--[a-z]+(?:-[a-z]+)*", lambda option: ARGUMENTS.get(option[0], option[0]), part)
        for part in parts[::2]
    )
    return "".join(parts)


@contextmanager
def in_python() -> Iterator[None]:
    """Inside, errors name arguments of Python, not options of commands."""
    try:
        yield
    except SnookerError as error:
        error.args = (in_python_words(str(error)),)
        raise


def first(
    lines: Sequence[str], most: int = MOST_LINES, noun: str = " points", rest: str = "--json"
) -> list[str]:
    """The first lines, and how many more there are; by default of a table of points.

    rest : what prints all, in a command
    """
    more = len(lines) - most
    prints = f"; {rest} prints all" if rest and IN_COMMAND.get() else ""
    return [*lines[:most], *([f"... and {more:,} more{noun}{prints}"] if more > 0 else [])]
