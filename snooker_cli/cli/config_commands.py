"""``snooker init``, ``validate`` and ``schema``: write and check configs."""

import os
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli.options import AsJson, ConfigPath, Overrides, check_name, checked, explanation
from snooker_cli.cli.output import notice, print_line, print_result, table
from snooker_cli.config import schema as config_schema
from snooker_cli.errors import UserError
from snooker_cli.files import write_text

SCHEMA = "snooker-schema.json"
"""The schema beside a config; the config's first line names it for editors."""

STDOUT = Path("-")


def templates() -> dict[str, Traversable]:
    """The commented configs by name, the simplest first."""
    names = ("report", "decay", "sweep", "exact", "dense")
    return {name: files("snooker_cli.cli") / "templates" / f"{name}.yaml" for name in names}


def purpose(template: Traversable) -> str:
    """What a template is for: its second line."""
    return template.read_text(encoding="utf-8").splitlines()[1].removeprefix("# ")


def complete_templates() -> list[tuple[str, str]]:
    """Names of templates."""
    return [(name, explanation(purpose(each))) for name, each in templates().items()]


def init(
    template: Annotated[
        str | None,
        typer.Argument(
            metavar="TEMPLATE",
            help="The template [list all].",
            autocompletion=complete_templates,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The config; - prints it [TEMPLATE.yaml]."),
    ] = None,
) -> None:
    """Write a commented config; without TEMPLATE, list all templates.

    The config explains every key. The file snooker-schema.json is written beside it. With that,
    editors with a YAML language server complete keys and check values. The names of the written
    files are printed.
    """
    found = templates()
    if template is None:
        rows = [[name, purpose(each)] for name, each in found.items()]
        print_result(rows, False, table("template | what it is", rows))
        return
    check_name(template, found, "template", "snooker init")
    text = found[template].read_text(encoding="utf-8")
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
    loaded, points, scene_classes = checked(config, override or ())
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
