"""Words of Python instead of options of commands, in errors and in results."""

import re
from collections.abc import Callable, Sequence
from functools import wraps
from inspect import Parameter, signature
from typing import Any, ParamSpec, TypeVar

from snooker_cli.errors import IN_COMMAND, KeyAbsentError, KeywordError, SnookerError

Given = ParamSpec("Given")
Returned = TypeVar("Returned")

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

CALLS = {
    f"`{LIST_FIGURES}`": "snooker.figure_list()",
    f"`{LIST_TEMPLATES}`": "snooker.templates()",
    "`snooker ls`": "snooker.statuses()",
    "`snooker run CONFIG`": "snooker.run(CONFIG)",
}
"""What Python calls instead of commands that advice names."""

TIMES_NEEDED = "give a number or a list of numbers, s, such as 1.5 or [0, 1.5, 3]"

MOST_LINES = 201  # of a table of points, with its headings


def in_python_words(text: str) -> str:
    """A text with arguments of Python instead of options, unless a command runs."""
    if IN_COMMAND.get():
        return text
    for command, call in CALLS.items():
        text = text.replace(command, call)
    # Another command in backticks is one that a user can give.
    parts = re.split("(`[^`]*`)", text)
    parts[::2] = (
        re.sub("--[a-z]+(?:-[a-z]+)*", lambda option: ARGUMENTS.get(option[0], option[0]), part)
        for part in parts[::2]
    )
    return "".join(parts)


def in_python() -> Callable[[Callable[Given, Returned]], Callable[Given, Returned]]:
    """Decorates what scripts call: errors name arguments of Python, not options of commands.

    A keyword that is no key of the config is a ``TypeError``, as one that a function does not have.
    """

    def decorated(function: Callable[Given, Returned]) -> Callable[Given, Returned]:
        @wraps(function)
        def called(*args: Given.args, **keywords: Given.kwargs) -> Returned:
            try:
                return function(*args, **keywords)
            except KeyAbsentError as error:
                if error.key not in keywords:
                    raise
                raise KeywordError(function.__name__, _arguments(function), error) from None
            except SnookerError as error:
                error.args = (in_python_words(str(error)),)
                raise

        return called

    return decorated


def _arguments(function: Callable[..., Any]) -> list[str]:
    """The names of the arguments that a function takes by keyword."""
    by_keyword = Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY
    arguments = signature(function).parameters.items()
    return [name for name, argument in arguments if argument.kind in by_keyword]


def first(
    lines: Sequence[str], most: int = MOST_LINES, noun: str = " points", rest: str = "--json"
) -> list[str]:
    """The first lines, and how many more there are; by default of a table of points.

    rest : what prints all, in a command
    """
    more = len(lines) - most
    prints = f"; {rest} prints all" if rest and IN_COMMAND.get() else ""
    return [*lines[:most], *([f"... and {more:,} more{noun}{prints}"] if more > 0 else [])]
