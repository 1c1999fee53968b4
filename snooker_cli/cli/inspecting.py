"""``snooker validate`` and ``schema``: look at a config; and how commands choose a repeat."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from snooker_cli.cli.running import AsJson, ConfigPath, Overrides

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.trace import Trace

PointNumber = Annotated[int, typer.Option("--point", min=0, help="Point, from 0.")]
RepeatNumber = Annotated[int, typer.Option("--repeat", min=0, help="Repeat, from 0.")]


def validate(config: ConfigPath, override: Overrides = None, as_json: AsJson = False) -> None:
    """Check CONFIG, and that each of its scenes can exist, without running it."""
    import json

    from snooker_cli.cli.running import checked

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

    from snooker_cli.cli.endings import until_nobody_reads
    from snooker_cli.config import schema as config_schema

    with until_nobody_reads():
        typer.echo(json.dumps(config_schema(), indent=2))


def chosen(run: Run, point: int, repeat: int) -> Point:
    """A repeat's point by their numbers. Raises ``UserError`` if the run has none such."""
    from snooker_cli.cli.endings import UserError

    if point >= len(run.points):
        raise UserError(f"--point {point}: {run.name} has points 0 to {len(run.points) - 1}")
    if repeat >= run.experiment.repeats:
        last = run.experiment.repeats - 1
        raise UserError(f"--repeat {repeat}: {run.name} has repeats 0 to {last}")
    return run.points[point]


def trace_of(run: Run, point: int, repeat: int) -> Trace:
    """A repeat by its numbers. Raises ``UserError`` if the run has none such, ``StoreError``."""
    return run.read(chosen(run, point, repeat), repeat)
