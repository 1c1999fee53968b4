"""Arguments and options that several commands share."""

import operator
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from snooker_cli.config.axes import option_values
from snooker_cli.config.problems import PathError
from snooker_cli.errors import UserError
from snooker_cli.runs import Run


def flag(name: str, text: str, **more: Any) -> Any:
    """An option without a value."""
    return typer.Option(name, help=text, **more)


def option(metavar: str, text: str, *names: str, **more: Any) -> Any:
    """An option with a value. By default it has the name of its parameter."""
    return typer.Option(*names, metavar=metavar, help=text, **more)


ConfigPath = Annotated[
    Path, typer.Argument(metavar="CONFIG", readable=False, help="A YAML experiment.")
]
Overrides = Annotated[
    list[str] | None,
    option(
        "KEY=VALUE",
        "Set a key; `-o cor=0.8,0.9`, `-o cor=0.5:1.0:11` and `-o balls.rings=range(1,6)` "
        "sweep it. Can be repeated.",
        "-o",
        "--override",
    ),
]
RUN = typer.Argument(metavar="RUN", help="A run's folder, or its name in runs/.")
RunName = Annotated[str, RUN]
Where = Annotated[
    list[str] | None,
    option(
        "KEY=VALUE",
        "Only points with this: `cor=0.8,0.9`, `cor=0.7:0.9` or `'cor>0.8'`. Can be repeated.",
    ),
]
Names = Annotated[list[str] | None, option("NAME", "Only what has NAME in it. Can be repeated.")]
AsJson = Annotated[bool, flag("--json", "Print JSON on stdout.")]
Replace = Annotated[bool, flag("--replace", "Replace the file if it exists.")]
Jobs = Annotated[
    int | None, option("N", "Repeats at a time [all cores].", "-j", "--jobs", min=1, max=1024)
]

_COMPARED = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
_COMPARED["="] = operator.ge  # of the lower end of a range


def conditions(where: Sequence[str] | None, run: Run) -> dict[str, Any]:
    """The conditions of ``--where``: a value of each key, or a tuple of several of the run's."""
    from snooker_cli.figures.selection import distinct  # loads SciPy, which `ls` does not need

    values_of_key: dict[str, Any] = {}
    for text in where or ():
        match = re.fullmatch(r"\s*([^<>=\s]+)\s*([<>]=?|=)\s*(.*\S)\s*", text)
        if not match:
            raise UserError(f"--where {text}: give KEY=VALUE, as in cor=0.8, cor=0.7:0.9, cor>0.8")
        key, sign, value = match.groups()
        try:
            if sign == "=" and value.count(":") != 1:
                values = option_values(value, f"--where {text}")
            else:
                low, *high = map(float, value.split(":") if sign == "=" else [value])
                numbers = [n for n in distinct(run.points, key) if isinstance(n, int | float)]
                values = [
                    n for n in numbers if _COMPARED[sign](n, low) and n <= min(high, default=n)
                ]
                values = values or [f"{sign}{value}".removeprefix("=")]  # which no point has
        except PathError as error:
            raise UserError(f"--where {text}: {error}") from None
        except ValueError:
            raise UserError(f"--where {text}: give numbers, as in cor=0.7:0.9 or cor>0.8") from None
        values_of_key[key] = tuple(values) if len(values) > 1 else values[0]
    return values_of_key
