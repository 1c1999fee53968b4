"""``snooker export``: a repeat's events or states, or a run's table, for other programs."""

import math
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli import __version__, api, store
from snooker_cli import export as exporting
from snooker_cli.cli.options import RunName, Where, conditions, flag, option
from snooker_cli.cli.output import print_line, until_the_reader_leaves
from snooker_cli.config.axes import MAX_POINTS, option_values
from snooker_cli.config.problems import PathError
from snooker_cli.errors import UserError
from snooker_cli.runs import RepeatStatus
from snooker_cli.runs.folder import holds_results

FORMATS = {".csv": "CSV", ".parquet": "Parquet", ".h5md": "H5MD", ".h5": "H5MD", ".xyz": "XYZ"}

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
    every: Annotated[float | None, option("T", "States: one every T s from 0.")] = None,
    frames: Annotated[
        int | None, option("N", "States: number of even times.", min=2, max=MOST_FRAMES)
    ] = None,
    table: Annotated[bool, flag("--table", "Export a row for each repeat of all points.")] = False,
    out: Annotated[Path | None, option("FILE", "A .csv, .parquet, .h5md, .xyz [stdout].")] = None,
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
    form = "CSV" if out is None else FORMATS.get(out.suffix.lower())
    if form is None:
        raise UserError(f"--out {out}: give a name in .csv, .parquet, .h5md, .h5 or .xyz")
    states = states or form in ("H5MD", "XYZ")
    ways = {"--times": times, "--every": every, "--frames": frames}
    given = [name for name, value in ways.items() if value is not None]
    if given and not (states or table):
        raise UserError(f"{given[0]} needs --states")
    if len(given) > 1:
        raise UserError(f"{given[0]} and {given[1]} both choose times", "give one of them")
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
        _export_states(status, partial(_times, times, every, frames), out, form)
        return
    # Checked first, and then read in parts: memory stays bounded.
    (header,) = (header for header in store.check(status.path) if header.repeat == repeat)
    tables = map(exporting.events_table, store.read_events(status.path, repeat))
    about = {"events": header.collisions} | _origin(header)
    _write_tables(exporting.EVENTS, tables, out, about)


def _export_states(
    status: RepeatStatus,
    times_until: Callable[[float], NDArray[np.float64]],
    out: Path | None,
    form: str,
) -> None:
    """Write the states of a repeat, or print them.

    times_until : the end of the repeat -> the times of the states, s
    """
    ((trace, header),) = store.read(status.path, [status.repeat])
    times = times_until(trace.stop.time)
    try:
        batches = exporting.frames(trace, times)
    except ValueError as error:
        raise UserError(f"--times: {error}") from None
    if out is not None and form == "XYZ":
        exporting.write_xyz(out, trace.start, batches)
        print_line(str(out))
    elif out is not None and form == "H5MD":
        exporting.write_states(out, trace.start, header, times, batches)
        print_line(str(out))
    else:
        about = {"frames": len(times)} | _origin(header)
        _write_tables(exporting.STATES, map(exporting.states_table, batches), out, about)


def _origin(header: store.RepeatHeader) -> dict[str, Any]:
    """Where a repeat comes from, for the metadata of a Parquet file."""
    provenance = asdict(header.provenance) | {"repeat": header.repeat}
    return {"bits": header.fingerprint, "ending": header.stop.known(), "provenance": provenance}


def _write_tables(
    units: dict[str, str], tables: Iterable[exporting.Table], out: Path | None, about: Any
) -> None:
    """Write tables as a file and print its name, or print them; `about` is for a Parquet file."""
    if out is None:
        with until_the_reader_leaves():
            sys.stdout.writelines(exporting.csv_lines(units, tables))
    elif out.suffix.lower() == ".csv":
        exporting.write_csv(out, units, tables)
    else:
        exporting.write_parquet(out, units, tables, {"snooker": __version__} | about)
    if out is not None:
        print_line(str(out))


def _times(
    times: str | None, every: float | None, frames: int | None, end: float
) -> NDArray[np.float64]:
    """The times of the states, s, by at most one of three options. Raises ``UserError``."""
    if every is not None:
        if not end / MOST_FRAMES < every < math.inf:
            least = f"{end / MOST_FRAMES:.2g} s"
            raise UserError(f"--every {every:g}: give a finite time above {least}")
        multiples = np.arange(int(end / every) + 2) * every
        return np.asarray(multiples[multiples <= end], dtype=np.float64)
    if times is None:
        return np.linspace(0.0, end, frames or 2)
    with suppress(PathError, TypeError, ValueError):
        if values := option_values(times, f"--times {times}"):
            return np.array([float(value) for value in values])  # type: ignore[arg-type]
    ways = f"give times in s as 0,0.5,1 or as start:stop:count, at most {MAX_POINTS:,}"
    raise UserError(f"--times {times}: {ways}")
