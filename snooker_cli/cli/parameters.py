"""Parameters of commands: arguments that several share, and options from ``options.py``."""

from collections.abc import Callable
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from snooker_cli.options import Option

Command = TypeVar("Command", bound=Callable[..., None])

ConfigPath = Annotated[
    Path, typer.Argument(metavar="CONFIG", readable=False, help="A YAML experiment.")
]
RUN = typer.Argument(metavar="RUN", help="A run's folder, or its name in runs/.")
RunName = Annotated[str, RUN]
RunNames = Annotated[
    list[str],
    typer.Argument(metavar="RUN", help="A run's folder, or its name in runs/; several compare."),
]


def takes(*options: Option) -> Callable[[Command], Command]:
    """Decorates a command's function, which gets a value of each of these by its word.

    Typer reads the signature that the function has then: its positional arguments, and a parameter
    for each option.
    """

    def decorated(command: Command) -> Command:
        arguments = [
            parameter
            for parameter in signature(command, eval_str=True).parameters.values()
            if parameter.kind is Parameter.POSITIONAL_OR_KEYWORD
        ]
        parameters = [*arguments, *map(_parameter, options)]
        vars(command)["__signature__"] = Signature(parameters)
        command.__annotations__ = {one.name: one.annotation for one in parameters}
        return command

    return decorated


def _parameter(option: Option) -> Parameter:
    names = [option.short] if option.short else []
    shown = typer.Option(
        *names,
        option.name,
        metavar=option.metavar,
        help=option.help,
        min=option.least,
        max=option.most,
    )
    return Parameter(
        option.word,
        Parameter.KEYWORD_ONLY,
        default=option.default,
        annotation=Annotated[option.type, shown],
    )


def split(text: str | None) -> list[str]:
    """The words between commas; none without a text."""
    return [word.strip() for word in text.split(",")] if text else []
