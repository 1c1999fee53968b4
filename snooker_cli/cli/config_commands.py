"""``snooker validate`` and ``schema``: look at a config; and how commands choose a repeat."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snooker_cli.cli import options
from snooker_cli.cli.options import purpose, templates
from snooker_cli.cli.run_command import AsJson, ConfigPath, Overrides

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace


# ``snooker init``: a commented config to begin with.

SCHEMA = "snooker-schema.json"
"""The file beside a config by which editors complete and check it; its first line names it."""

STDOUT = Path("-")


def init(
    template: Annotated[
        str | None,
        typer.Argument(
            metavar="TEMPLATE",
            help="What to begin with [list what there is].",
            autocompletion=options.complete_templates,
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
    from snooker_cli.cli.progress_bar import say
    from snooker_cli.errors import UserError

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
    from snooker_cli.cli.output import print_table
    from snooker_cli.formatting import Column

    print_table(
        [Column("template"), Column("what it is")],
        [[name, purpose(template)] for name, template in templates().items()],
    )


def _text(name: str) -> str:
    """A template. Raises ``UserError``."""
    import difflib

    from snooker_cli.errors import UserError

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


PointNumber = Annotated[int, typer.Option("--point", min=0, help="Point, from 0.")]
RepeatNumber = Annotated[int, typer.Option("--repeat", min=0, help="Repeat, from 0.")]


def validate(config: ConfigPath, override: Overrides = None, as_json: AsJson = False) -> None:
    """Check CONFIG, and that each of its scenes can exist, without running it."""
    import json

    from snooker_cli.cli.run_command import checked

    loaded, points, kinds = checked(config, override or ())
    experiment = loaded.experiment
    balls = sorted({number for kind in kinds for number in kind.balls})
    if as_json:
        found = {
            "config": str(config),
            "valid": True,
            "points": len(points),
            "repeats": experiment.repeats,
            "balls": balls,
        }
        typer.echo(json.dumps(found))
        return
    numbers = str(balls[0]) if len(balls) == 1 else f"{balls[0]} to {balls[-1]}"
    typer.echo(
        f"{config}: valid; points: {len(points):,}, repeats of each: {experiment.repeats}, "
        f"balls: {numbers}"
    )


def schema() -> None:
    """Print the JSON schema of configs, for editors."""
    import json

    from snooker_cli.cli.exit_codes import until_nobody_reads
    from snooker_cli.config import schema as config_schema

    with until_nobody_reads():
        typer.echo(json.dumps(config_schema(), indent=2))


def chosen(run: Run, point: int, repeat: int) -> Point:
    """A repeat's point by their numbers. Raises ``UserError`` if the run has none such."""
    from snooker_cli.errors import UserError

    if point >= len(run.points):
        raise UserError(f"--point {point}: {run.name} has points 0 to {len(run.points) - 1}")
    if repeat >= run.experiment.repeats:
        last = run.experiment.repeats - 1
        raise UserError(f"--repeat {repeat}: {run.name} has repeats 0 to {last}")
    return run.points[point]


def trace_of(run: Run, point: int, repeat: int) -> Trace:
    """A repeat by its numbers. Raises ``UserError`` if the run has none such, ``StoreError``."""
    return run.read(chosen(run, point, repeat), repeat)
