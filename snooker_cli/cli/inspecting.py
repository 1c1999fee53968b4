"""``snooker validate``, ``schema`` and ``export``: look at a config or at a repeat."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from snooker_cli.cli.running import AsJson, ConfigPath, Overrides

if TYPE_CHECKING:
    from collections.abc import Iterator

    from snooker_cli.engine import States
    from snooker_cli.results import Run
    from snooker_cli.trace import Events, Trace

RunName = Annotated[str, typer.Argument(metavar="RUN", help="A run's folder or name.")]
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


def export(
    run: RunName,
    point: PointNumber = 0,
    repeat: RepeatNumber = 0,
    states: Annotated[
        bool, typer.Option("--states", help="Positions and velocities instead of events.")
    ] = False,
    times: Annotated[
        str | None,
        typer.Option(
            "--times",
            metavar="T,T,…",
            help="With --states: times in s, separated by commas, or start:stop:count [0 and the "
            "end].",
        ),
    ] = None,
) -> None:
    """Print a repeat as CSV: ``time,i,j,impulse`` of each collision, j = -1 for the container.

    With --states: ``time,ball,x,y,u,v`` of all balls and, as ball -1, the container. Numbers are
    written so that reading them gives the same doubles.
    """
    import sys

    from snooker_cli.cli.endings import UserError, until_nobody_reads
    from snooker_cli.engine import replay
    from snooker_cli.results import open_run

    opened = open_run(run)
    trace = trace_of(opened, point, repeat)
    if trace.events is None:
        raise UserError(f"{opened.name} was run with `record: summary`: it has no events to export")
    if states:
        try:
            found = replay(trace, _times(times, trace.stop.time))
        except ValueError as error:
            raise UserError(f"--times {times}: {error}") from None
        rows = _state_rows(found)
    elif times is None:
        rows = _event_rows(trace.events)
    else:
        raise UserError("--times goes with --states")
    with until_nobody_reads():
        sys.stdout.writelines(rows)


def trace_of(run: Run, point: int, repeat: int) -> Trace:
    """A repeat by its numbers. Raises ``UserError`` if the run has none, ``StoreError``."""
    from snooker_cli import store
    from snooker_cli.cli.endings import UserError

    if point >= len(run.points):
        raise UserError(f"--point {point}: {run.name} has points 0 to {len(run.points) - 1}")
    if repeat >= run.experiment.repeats:
        last = run.experiment.repeats - 1
        raise UserError(f"--repeat {repeat}: {run.name} has repeats 0 to {last}")
    return store.read(run.path(point, repeat)).trace


def _event_rows(events: Events) -> Iterator[str]:
    """The lines of the events' CSV."""
    yield "time,i,j,impulse\n"
    columns = (events.time, events.i, events.j, events.impulse)
    for row in zip(*(column.tolist() for column in columns), strict=True):
        yield "{!r},{},{},{!r}\n".format(*row)


def _state_rows(found: States) -> Iterator[str]:
    """The lines of the states' CSV; ball -1 is the container."""
    yield "time,ball,x,y,u,v\n"
    for k, time in enumerate(found.time.tolist()):
        places = [found.container_positions[k], *found.positions[k]]
        motions = [found.container_velocities[k], *found.velocities[k]]
        for ball, (place, motion) in enumerate(zip(places, motions, strict=True), start=-1):
            numbers = [time, *place.tolist(), *motion.tolist()]
            yield "{!r},{},{!r},{!r},{!r},{!r}\n".format(numbers[0], ball, *numbers[1:])


def _times(text: str | None, end: float) -> list[float]:
    """The times that ``--times`` asks for. Raises ``UserError``."""
    import numpy as np

    from snooker_cli.cli.endings import UserError

    if text is None:
        return [0.0, end]
    try:
        if ":" in text:
            start, stop, count = text.split(":")
            return [float(time) for time in np.linspace(float(start), float(stop), int(count))]
        return [float(time) for time in text.split(",")]
    except ValueError:
        raise UserError(
            f"--times {text}: give times in s as 0,0.5,1 or as start:stop:count"
        ) from None
