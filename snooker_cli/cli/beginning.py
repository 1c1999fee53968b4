"""``snooker init``: a commented config to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli import completion
from snooker_cli.cli.templates import purpose, templates

SCHEMA = "snooker-schema.json"
"""The file beside a config by which editors complete and check it; its first line names it."""

STDOUT = Path("-")


def init(
    template: Annotated[
        str | None,
        typer.Argument(
            metavar="TEMPLATE",
            help="What to begin with [list what there is].",
            autocompletion=completion.templates,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The config; - prints it [TEMPLATE.yaml]."),
    ] = None,
) -> None:
    """Write a config in which every key is explained; without a TEMPLATE, list what there is.

    Beside it goes snooker-schema.json, by which editors with a YAML language server complete keys
    and check values. The written files are printed.
    """
    from snooker_cli.cli.endings import UserError
    from snooker_cli.cli.progress import say

    if template is None:
        _list()
        return
    text = _text(template)
    if out == STDOUT:
        typer.echo(text, nl=False)
        say(f"`snooker schema > {SCHEMA}` beside it lets editors check it")
        return
    path = out or Path(f"{template}.yaml")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise UserError(f"{path}: is there already; give --out for another name") from None
    for written in (path, _write_schema(path.with_name(SCHEMA))):
        typer.echo(written)
    say(f"next: snooker run {path} --dry-run")


def _list() -> None:
    """Print the templates."""
    from snooker_cli.cli.tables import Column, print_table

    print_table(
        [Column("template"), Column("what it is")],
        [[name, purpose(template)] for name, template in templates().items()],
    )


def _text(name: str) -> str:
    """A template. Raises ``UserError``."""
    import difflib

    from snooker_cli.cli.endings import UserError

    found = templates()
    if name not in found:
        near = difflib.get_close_matches(name, found, n=1, cutoff=0.0)[0]
        raise UserError(
            f"there is no template {name}; the nearest is {near}, and `snooker init` lists all"
        )
    return found[name].read_text(encoding="utf-8")


def _write_schema(path: Path) -> Path:
    """Write the configs' JSON schema as it is now; where it is."""
    import json

    from snooker_cli.config import schema

    path.write_text(json.dumps(schema(), indent=2) + "\n", encoding="utf-8")
    return path
