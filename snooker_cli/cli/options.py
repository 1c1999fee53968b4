"""Arguments and options that several commands share."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from snooker_cli import api


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
RunNames = Annotated[
    list[str],
    typer.Argument(metavar="RUN", help="A run's folder, or its name in runs/; several compare."),
]
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


def conditions(where: Sequence[str] | None, run: api.Run | api.SideBySide) -> dict[str, Any]:
    """The conditions of ``--where``, as keywords."""
    return run.where(*(where or ()))


def split(text: str | None) -> list[str]:
    """The words between commas; none without a text."""
    return [word.strip() for word in text.split(",")] if text else []
