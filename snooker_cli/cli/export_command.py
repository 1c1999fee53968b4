"""``snooker export``: a repeat's events or states, or a run's table, for other programs."""

import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli import api, store
from snooker_cli import export as exporting
from snooker_cli.cli.options import Replace, RunName, Where, conditions, flag, option
from snooker_cli.cli.output import check_free, print_line, until_the_reader_leaves
from snooker_cli.config.axes import MAX_POINTS, option_values
from snooker_cli.config.problems import PathError
from snooker_cli.engine import replayed
from snooker_cli.errors import UserError
from snooker_cli.runs.folder import holds_results

FORMATS = (".csv", ".parquet", *exporting.STATES_FORMATS)
MOST_FRAMES = 10_000_000


def export(
    run: RunName,
    point: Annotated[int, option("N", "Point, from 0.", min=0)] = 0,
    where: Where = None,
    repeat: Annotated[int, option("N", "Repeat, from 0.", min=0)] = 0,
    states: Annotated[bool, flag("--states", "Export positions and velocities.")] = False,
    times: Annotated[
        str | None, option("T,T,…", "States: times in s, or start:stop:count [0 and the end].")
    ] = None,
    frames: Annotated[
        int | None, option("N", "States: number of even times.", min=2, max=MOST_FRAMES)
    ] = None,
    table: Annotated[bool, flag("--table", "Export a row for each repeat of all points.")] = False,
    out: Annotated[Path | None, option("FILE", "A .csv, .parquet, .h5md, .xyz [stdout].")] = None,
    replace: Replace = False,
) -> None:
    """Export collisions or states of a repeat, or the table of a run.

    The default is CSV with the columns time, i, j and impulse of each collision; j = -1 is the
    container. With --states the columns are time, ball, x, y, u and v of all balls; ball -1 is the
    container. Numbers have enough digits to read back the same doubles. A Parquet file has the
    same columns, their units and the provenance. An H5MD file has states in three dimensions with
    z = 0, for programs that read molecular trajectories. An .xyz file (extended XYZ) has them for
    OVITO and ASE.

    With --table each repeat of each point is a row: swept keys, how and when it ended, collisions,
    mean temperature, pressure and speed, the energy at the end over that at the start, and the
    fitted constants k and α of exp(−kt) and of Haff's law.
    """
    if out is not None and holds_results(out):
        raise UserError(f"--out {out}: this file holds results of a run", "give another name")
    ending = ".csv" if out is None else out.suffix.lower()
    if ending not in FORMATS:
        raise UserError(f"--out {out}: give a name in .csv, .parquet, .h5md, .h5 or .xyz")
    if out is not None:
        check_free(out, replace)
    states = states or ending in exporting.STATES_FORMATS
    given = [n for n, value in (("--times", times), ("--frames", frames)) if value is not None]
    if given and not (states or table):
        raise UserError(f"{given[0]} needs --states")
    if len(given) > 1:
        raise UserError("--times and --frames both choose times", "give one of them")
    if table and (states or given):
        raise UserError("--table is for all repeats, not for states, H5MD or XYZ")
    opened = api.open(run)
    selected = conditions(where, opened)
    points = opened.matching(**selected)
    if table and out is not None:
        print_line(str(opened.export(out, **selected)))
        return
    if table:
        rows = opened.table(**selected)
        _write_tables(dict.fromkeys(rows, ""), [rows], None, {})
        return
    if where:
        if point:
            raise UserError("--where and --point both choose the point; give one of them")
        if len(points) > 1:
            raise UserError(f"--where {' '.join(where)}: {len(points)} points; choose one of them")
        point = points[0].index
    if not opened.chosen(point, repeat).experiment.keeps_events:
        what = "states" if states else "events"
        problem = f"{opened.name} was run with `record: summary`: it has no {what} to export"
        raise UserError(problem, "give --table, or run the config with `record: events`")
    status = opened.status(point, repeat)
    status.accept()
    if states:
        ((trace, header),) = store.read(status.path, [repeat])
        moments = _times(times, frames, trace.stop.time)
        try:
            batches = replayed(trace, moments)
        except ValueError as error:
            raise UserError(f"--times: {error}") from None
        if out is not None and ending in exporting.STATES_FORMATS:
            exporting.write_states(out, trace.start, header, moments, batches)
            print_line(str(out))
            return
        tables, units = map(exporting.states_table, batches), exporting.STATES
        about = {"frames": len(moments)}
    else:
        # Checked first, and then read in parts: memory stays bounded.
        (header,) = (header for header in store.check(status.path) if header.repeat == repeat)
        pieces = (events for _, events in store.read_events(status.path, [repeat]))
        tables = map(exporting.events_table, pieces)
        units, about = exporting.EVENTS, {"events": header.collisions}
    _write_tables(units, tables, out, about | exporting.origin(header))


def _write_tables(
    units: dict[str, str], tables: Iterable[exporting.Table], out: Path | None, about: Any
) -> None:
    """Write tables as a file and print its name, or print them; `about` is for a Parquet file."""
    if out is None:
        with until_the_reader_leaves():
            sys.stdout.writelines(exporting.csv_lines(units, tables))
    else:
        exporting.write_table(out, units, tables, about)
        print_line(str(out))


def _times(times: str | None, frames: int | None, end: float) -> NDArray[np.float64]:
    """The times of the states, s. Raises ``UserError``."""
    if times is None:
        return np.linspace(0.0, end, frames or 2)
    with suppress(PathError, TypeError, ValueError):
        if values := option_values(times, f"--times {times}"):
            return np.array([float(value) for value in values])  # type: ignore[arg-type]
    ways = f"give times in s as 0,0.5,1 or as start:stop:count, at most {MAX_POINTS:,}"
    raise UserError(f"--times {times}: {ways}")
