"""``snooker init``, ``validate`` and ``schema``: write and check configs."""

import os
import re
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli.options import AsJson, ConfigPath, Overrides, explanation
from snooker_cli.cli.output import print_line, print_result, table
from snooker_cli.config import EXAMPLES, load
from snooker_cli.config import schema as config_schema
from snooker_cli.errors import UserError, check_name
from snooker_cli.files import write_text
from snooker_cli.progress import notice
from snooker_cli.runs.plan import checked

SCHEMA = "snooker-schema.json"
"""The schema beside a config; the config's first line names it for editors."""

STDOUT = Path("-")


def templates() -> dict[str, Traversable]:
    """The commented configs by name, the simplest first."""
    names = ("report", "decay", "sweep", "exact", "dense", "brownian")
    return {name: files("snooker_cli.cli") / "templates" / f"{name}.yaml" for name in names}


def examples() -> dict[str, Traversable]:
    """The configs of configs/ by name, such as ``configs/box`` and ``configs/hard/ring``."""
    paths = [*sorted(EXAMPLES.glob("*.yaml")), *sorted(EXAMPLES.glob("*/*.yaml"))]
    return {
        Path("configs", path.relative_to(EXAMPLES)).with_suffix("").as_posix(): path
        for path in paths
    }


def purpose(config: Traversable) -> str:
    """What a template is for: its second line; the title of an example."""
    lines = config.read_text(encoding="utf-8").splitlines()
    if lines[2] == "#":
        return lines[1].removeprefix("# ")
    return next(line.removeprefix("title: ") for line in lines if line.startswith("title: "))


def complete_templates() -> list[tuple[str, str]]:
    """Names of templates."""
    return [(name, explanation(purpose(each))) for name, each in templates().items()]


def init(
    template: Annotated[
        str | None,
        typer.Argument(
            metavar="TEMPLATE",
            help="A name of the list [list the templates].",
            autocompletion=complete_templates,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The config; - prints it [TEMPLATE.yaml]."),
    ] = None,
    list_all: Annotated[
        bool, typer.Option("--list", help="List the templates and all example configs.")
    ] = False,
) -> None:
    """Write a commented config; without TEMPLATE, list all templates.

    A template explains every key. --list also lists the examples in configs/: the configs of the
    reproduction, and scenes that are hard to simulate. The file snooker-schema.json is written
    beside the config. With that, editors with a YAML language server complete keys and check
    values. The names of the written files are printed.
    """
    found = templates() | examples()
    if template is None or list_all:
        shown = found if list_all else templates()
        rows = [[name, purpose(each)] for name, each in shown.items()]
        print_result(rows, False, table("template | what it is", rows))
        return
    check_name(template, found, "template", "snooker init --list")
    text = found[template].read_text(encoding="utf-8")
    text = re.sub(r"\$schema=\S+", f"$schema={SCHEMA}", text, count=1)
    if out == STDOUT:
        typer.echo(text, nl=False)
        notice(f"tip: `snooker schema > {SCHEMA}` in this folder lets your editor check the file")
        return
    path = out or Path(f"{template}.yaml")
    if os.path.lexists(path):
        raise UserError(f"{path}: exists already", "give --out for another name")
    write_text(path, text)
    beside = path.with_name(SCHEMA)
    write_text(beside, config_schema())
    for written in (path, beside):
        print_line(str(written))
    notice(f"next: snooker run {path} --dry-run")


def validate(config: ConfigPath, override: Overrides = None, as_json: AsJson = False) -> None:
    """Check CONFIG without running it.

    The check includes the starting scene of every point.
    """
    loaded = load(config, override or ())
    points, scene_classes = checked(loaded)
    repeats = loaded.experiment.repeats
    balls = sorted({number for each in scene_classes for number in each.balls})
    numbers = str(balls[0]) if len(balls) == 1 else f"{balls[0]} to {balls[-1]}"
    found = {"config": str(config), "valid": True, "points": len(points)}
    print_result(
        found | {"repeats": repeats, "balls": balls},
        as_json,
        [f"{config}: valid; points: {len(points):,}, repeats of each: {repeats}, balls: {numbers}"],
    )


def schema() -> None:
    """Print the JSON schema of configs, for editors."""
    print_line(config_schema().rstrip())
