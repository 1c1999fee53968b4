"""``snooker export``: a repeat's events or states, for other programs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli.analysis_commands import RunName
from snooker_cli.cli.config_commands import PointNumber, RepeatNumber, chosen

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from snooker_cli.config import Point
    from snooker_cli.export import Table
    from snooker_cli.runs import Run
    from snooker_cli.store import RepeatHeader


class Format(StrEnum):
    """What a repeat can be exported as."""

    CSV = "csv"
    PARQUET = "parquet"
    H5MD = "h5md"


SUFFIXES = {
    ".csv": Format.CSV,
    ".parquet": Format.PARQUET,
    ".h5md": Format.H5MD,
    ".h5": Format.H5MD,
}
MOST_FRAMES = 10_000_000


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
            help="Of states: times in s, separated by commas, or start:stop:count [0 and the end].",
        ),
    ] = None,
    every: Annotated[
        float | None, typer.Option("--every", metavar="T", help="Of states: one each T s from 0.")
    ] = None,
    frames: Annotated[
        int | None,
        typer.Option(
            "--frames", min=2, max=MOST_FRAMES, help="Of states: so many, evenly from 0 to the end."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="A name in .csv, .parquet, .h5md or .h5 [CSV on stdout]."
        ),
    ] = None,
    form: Annotated[
        Format | None, typer.Option("--format", help="Format [what --out ends in, or csv].")
    ] = None,
) -> None:
    """Print a repeat as CSV: ``time,i,j,impulse`` of each collision, j = -1 for the container.

    With --states: ``time,ball,x,y,u,v`` of all balls and, as ball -1, the container. Numbers are
    written so that reading them gives the same doubles. A Parquet file has the same columns, their
    units and where they come from. An H5MD file has states in three dimensions, z = 0, for programs
    that read trajectories of molecules. The written file is printed.
    """
    from snooker_cli.errors import UserError
    from snooker_cli.runs import holds_results, open_run

    form = _format(out, form)
    states = states or form is Format.H5MD
    _check(states, {"--times": times, "--every": every, "--frames": frames})
    opened = open_run(run)
    one = chosen(opened, point, repeat)
    if one.experiment.record == "summary":
        what = "states" if states else "events"
        raise UserError(f"{opened.name} was run with `record: summary`: it has no {what} to export")
    if out is not None and holds_results(out):
        raise UserError(f"--out {out}: this file holds results of a run; give another name")
    if states:
        _export_states(opened, one, repeat, out, form, times, every, frames)
    else:
        _export_events(opened, one, repeat, out, form)
    if out is not None:
        typer.echo(out)


def _format(out: Path | None, form: Format | None) -> Format:
    """The format that is asked for. Raises ``UserError``."""
    from snooker_cli.errors import UserError

    if out is None:
        if form not in (None, Format.CSV):
            raise UserError(f"--format {form}: give --out FILE, too; only CSV is printed")
        return Format.CSV
    found = form or SUFFIXES.get(out.suffix.lower())
    if found is None:
        raise UserError(f"--out {out}: give a name in .csv, .parquet, .h5md or .h5, or --format")
    return found


def _check(states: bool, asked: dict[str, Any]) -> None:
    """Raise ``UserError`` for ways to say when that do not go together."""
    from snooker_cli.errors import UserError

    given = [name for name, value in asked.items() if value is not None]
    if given and not states:
        raise UserError(f"{given[0]} goes with --states")
    if len(given) > 1:
        raise UserError(f"{given[0]} and {given[1]} both say when; give one of them")


def _export_events(run: Run, point: Point, repeat: int, out: Path | None, form: Format) -> None:
    """Export events as they are read, after they have been checked: memory stays bounded."""
    from snooker_cli import store
    from snooker_cli.export import EVENTS, events_table

    path = run.path(point.index, repeat)
    header = store.check(path)
    run.accept(point, repeat, header)
    tables = (events_table(events) for events in store.read_events(path))
    _write_tables(EVENTS, tables, out, form, {"events": header.collisions, **_source(header)})


def _export_states(
    run: Run,
    point: Point,
    repeat: int,
    out: Path | None,
    form: Format,
    times: str | None,
    every: float | None,
    number: int | None,
) -> None:
    """Export states, some frames at a time."""
    import numpy as np

    from snooker_cli import export, store
    from snooker_cli.errors import UserError
    from snooker_cli.export import STATES, frames, states_table

    trace, header = store.read(run.path(point.index, repeat))
    run.accept(point, repeat, header)
    end = trace.stop.time
    if every is not None:
        wanted = _every(every, end)
    elif number is not None:
        wanted = np.linspace(0.0, end, number)
    else:
        wanted = np.array(_times(times, end))
    try:
        batches = frames(trace, wanted)
    except ValueError as error:
        raise UserError(f"--times {times}: {error}") from None
    if form is Format.H5MD and out is not None:
        export.write_states(out, header, wanted, batches)
        return
    tables = (states_table(states) for states in batches)
    _write_tables(STATES, tables, out, form, {"frames": len(wanted), **_source(header)})


def _write_tables(
    units: dict[str, str],
    tables: Iterator[Table],
    out: Path | None,
    form: Format,
    about: dict[str, Any],
) -> None:
    """Write tables as a file, or print them."""
    import sys

    from snooker_cli.cli.exit_codes import until_nobody_reads
    from snooker_cli.export import csv_lines, write_csv, write_parquet

    if out is None:
        with until_nobody_reads():
            sys.stdout.writelines(csv_lines(units, tables))
        return
    if form is Format.CSV:
        write_csv(out, units, tables)
    else:
        write_parquet(out, units, tables, about)


def _source(header: RepeatHeader) -> dict[str, Any]:
    """What a Parquet file says of the repeat that it is made from."""
    from dataclasses import asdict

    from snooker_cli import __version__

    return {
        "snooker": __version__,
        "bits": header.fingerprint,
        "ending": asdict(header.stop),
        "provenance": asdict(header.provenance),
    }


def _every(every: float, end: float) -> NDArray[np.float64]:
    """Times from 0 on, so far apart (s). Raises ``UserError``."""
    import numpy as np

    from snooker_cli.errors import UserError

    if not every > 0:
        raise UserError(f"--every {every:g}: give a number of seconds above 0")
    number = end / every + 1
    if number > MOST_FRAMES:
        raise UserError(
            f"--every {every:g}: would be {number:.2g} frames until {end:g} s, and {MOST_FRAMES:,} "
            "are the most; give a longer time"
        )
    times = np.asarray(np.arange(int(number) + 1) * every, dtype=np.float64)
    return times[times <= end]


def _times(text: str | None, end: float) -> list[float]:
    """The times that ``--times`` asks for. Raises ``UserError``."""
    import numpy as np

    from snooker_cli.errors import UserError

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
