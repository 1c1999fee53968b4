"""Arguments and options that several commands share, and their completion on Tab."""

import json
from collections.abc import Sequence
from pathlib import Path
from textwrap import shorten
from typing import Annotated, Any, Literal

import typer
from rich.markup import escape

from snooker_cli.config import Point, schema
from snooker_cli.config.axes import option_values
from snooker_cli.config.problems import PathError
from snooker_cli.errors import FigureError, UserError
from snooker_cli.runs import MANIFEST, RUNS, Run

LINE = 72
"""Characters of an explanation: rich breaks longer ones, and fish would show two candidates."""


def explanation(text: str) -> str:
    """Text as completion can show it: one line, no apostrophe for zsh, no markup for rich."""
    return escape(shorten(text.replace("'", "’"), LINE, placeholder="…"))


def complete_runs() -> list[str]:
    """Names of the runs in runs/."""
    return sorted(path.parent.name for path in RUNS.glob(f"*/{MANIFEST}"))


def complete_overrides() -> list[tuple[str, str]]:
    """Keys for -o: those at the top of a config, and those that can be swept."""
    top = json.loads(schema())["properties"]
    keys = {**top, **top["sweep"]["properties"]}
    return [
        (f"{key}=", explanation(entry["description"]))
        for key, entry in keys.items()
        if key not in ("container", "balls", "sweep", "zip")
    ]


EngineName = Literal["allpairs", "cells"]  # the engines that a user can choose

ConfigPath = Annotated[Path, typer.Argument(metavar="CONFIG", help="A YAML experiment.")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "-o",
        "--override",
        metavar="KEY=VALUE",
        help="Set a key; `-o cor=0.8,0.9`, `-o cor=0.5:1.0:11` and `-o balls.rings=range(1,6)` "
        "sweep it. Can be repeated.",
        autocompletion=complete_overrides,
    ),
]
RUN = typer.Argument(
    metavar="RUN", help="A run's folder, or its name in runs/.", autocompletion=complete_runs
)
RunName = Annotated[str, RUN]
PointNumber = Annotated[int, typer.Option("--point", min=0, help="Point, from 0.")]
RepeatNumber = Annotated[int, typer.Option("--repeat", min=0, help="Repeat, from 0.")]
Where = Annotated[
    list[str] | None,
    typer.Option(
        "--where",
        metavar="KEY=VALUE",
        help="Only points with this value, as `cor=0.8` or `cor=0.8,0.9`. Can be repeated.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]
Jobs = Annotated[
    int | None, typer.Option("-j", "--jobs", min=1, max=1024, help="At the same time [all cores].")
]


def conditions(where: Sequence[str] | None) -> dict[str, Any]:
    """The conditions of ``--where``: a value of each key, or a tuple of several."""
    found: dict[str, Any] = {}
    for text in where or ():
        key, separator, value = text.partition("=")
        if not separator or not key or not value.strip():
            raise UserError(f"--where {text}: give KEY=VALUE, as in cor=0.8")
        try:
            values = option_values(value, f"--where {text}")
        except PathError as error:
            raise UserError(f"--where {text}: {error}") from None
        found[key.strip()] = tuple(values) if len(values) > 1 else values[0]
    return found


def points_where(run: Run, where: Sequence[str] | None) -> tuple[Point, ...]:
    """The points of a run that meet ``--where``. Raises ``UserError`` if there is none."""
    from snooker_cli.figures import Selection
    from snooker_cli.figures.selection import matching

    try:
        return matching(run, Selection(conditions(where)))
    except FigureError as error:
        raise UserError(f"{run.name}: {error}") from None
