"""Arguments of methods that commands have as options, and keywords that are keys of a config."""

from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from inspect import Parameter, cleandoc, signature
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from snooker_cli.config.axes import MAX_POINTS
from snooker_cli.config.problems import PathError
from snooker_cli.errors import ArgumentError, KeyAbsentError, KeywordError
from snooker_cli.options import Option

Arguments = ParamSpec("Arguments")
Returned = TypeVar("Returned")

TIMES_NEEDED = "give a number or a list of numbers, s, such as 1.5 or [0, 1.5, 3]"

OPTIONS_OF: dict[str, tuple[Option, ...]] = {}
"""The options that functions have as arguments, by the function's module and name."""


def with_options(
    *options: Option,
) -> Callable[[Callable[Arguments, Returned]], Callable[Arguments, Returned]]:
    """Decorates what scripts call with arguments that are options of a command.

    Types stay in the signatures, because type checkers read nothing else: they cannot make types of
    values, and a ``TypedDict`` leaves no room for ``**where``. Many are wider than a command's
    text: ``times`` is also a list of numbers. ``tests/test_api.py`` compares words and defaults.

    Their help is added to the docstring. A keyword that is no key of the config is a ``TypeError``,
    as one that a function does not have.
    """

    def decorated(function: Callable[Arguments, Returned]) -> Callable[Arguments, Returned]:
        @wraps(function)
        def called(*args: Arguments.args, **keywords: Arguments.kwargs) -> Returned:
            try:
                return function(*args, **keywords)
            except KeyAbsentError as error:
                if error.key not in keywords:
                    raise
                raise KeywordError(function.__name__, _by_keyword(function), error) from None

        OPTIONS_OF[f"{function.__module__}.{function.__qualname__}"] = options
        lines = [f"{option.word} : {option.help}" for option in options]
        called.__doc__ = "\n\n".join([cleandoc(function.__doc__ or ""), "\n".join(lines)]).strip()
        return called

    return decorated


def _by_keyword(function: Callable[..., Any]) -> list[str]:
    """The names of the arguments that a function takes by keyword."""
    by_keyword = Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY
    arguments = signature(function).parameters.items()
    return [name for name, argument in arguments if argument.kind in by_keyword]


def times_given(text: str, option: Option) -> NDArray[np.float64]:
    """The times of an option, s. Raises ``UserError``."""
    from snooker_cli.config.reading import option_values  # loads what reads YAML

    with suppress(PathError, TypeError, ValueError):
        if values := option_values(text, option.of(text)):
            return np.array([float(value) for value in values])  # type: ignore[arg-type]
    ways = f"give times in s as 0,0.5,1 or as start:stop:count, at most {MAX_POINTS:,}"
    raise ArgumentError(f"{option.of(text)}: {ways}")
