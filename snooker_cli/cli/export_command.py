"""``snooker export``: a repeat's events or states, or a run's table, for other programs."""

import json
import math
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli import __version__, api, store
from snooker_cli import export as exporting
from snooker_cli.analysis.tables import named
from snooker_cli.cli.options import (
    Names,
    PointNumber,
    RepeatNumber,
    RunName,
    Where,
    conditions,
    flag,
    option,
)
from snooker_cli.cli.output import print_line, until_the_reader_leaves
from snooker_cli.config import to_json
from snooker_cli.errors import UserError
from snooker_cli.runs.folder import holds_results

FORMATS = {".csv": "CSV", ".parquet": "Parquet", ".h5md": "H5MD", ".h5": "H5MD", ".xyz": "XYZ"}

MOST_FRAMES = 10_000_000


def export(
    run: RunName,
    point: PointNumber = 0,
    where: Where = None,
    repeat: RepeatNumber = 0,
    states: Annotated[bool, flag("--states", "Export positions and velocities.")] = False,
    times: Annotated[
        str | None, option("T,T,…", "States: times in s, or start:stop:count [0 and the end].")
    ] = None,
    every: Annotated[float | None, option("T", "States: one every T s from 0.")] = None,
    frames: Annotated[
        int | None, option("N", "States: number of even times.", min=2, max=MOST_FRAMES)
    ] = None,
    table: Annotated[bool, flag("--table", "Export a row for each repeat of all points.")] = False,
    quantity: Names = None,
    model: Names = None,
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
    fitted constants k and α of exp(−kt) and of Haff's law. --quantity and --model choose columns.
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
    table = bool(table or quantity or model)
    if table and (states or given):
        raise UserError("--table is for all repeats, not for states, H5MD or XYZ")
    opened = api.open(run)
    selected = conditions(where, opened)
    points = opened.matching(**selected)
    if table:
        rows = _chosen(opened.table(**selected), quantity or [""], model or [""])
        units = {name: api.UNITS.get(name, "") for name in rows}
        about = {"rows": len(rows["point"]), "config": json.loads(to_json(opened.experiment))}
        _write_tables(units, [rows], out, about)
        return
    if where:
        if point:
            raise UserError("--where and --point both choose the point; give one of them")
        if len(points) > 1:
            raise UserError(f"--where {' '.join(where)}: {len(points)} points; choose one of them")
        point = points[0].index
    chosen = opened.chosen(point, repeat)
    if chosen.experiment.record == "summary":
        what = "states" if states else "events"
        problem = f"{opened.name} was run with `record: summary`: it has no {what} to export"
        raise UserError(problem, "give --table, or run the config with `record: events`")
    status = opened.status(point, repeat)
    status.accept()
    path = status.path
    if states:
        ((trace, header),) = store.read(path, [repeat])
        wanted = _times(times, every, frames, trace.stop.time)
        try:
            batches = exporting.frames(trace, wanted)
        except ValueError as error:
            raise UserError(f"--times {times}: {error}") from None
        units, tables = exporting.STATES, map(exporting.states_table, batches)
        about = {"frames": len(wanted)}
    else:
        # Checked first, and then read in parts: memory stays bounded.
        (header,) = (header for header in store.check(path) if header.repeat == repeat)
        units = exporting.EVENTS
        tables = map(exporting.events_table, store.read_events(path, repeat))
        about = {"events": header.collisions}
    if out is not None and form == "XYZ":
        exporting.write_xyz(out, trace.start, batches)
        print_line(str(out))
    elif out is not None and form == "H5MD":
        exporting.write_states(out, trace.start, header, wanted, batches)
        print_line(str(out))
    else:
        about |= {"bits": header.fingerprint, "ending": header.stop.known()}
        about["provenance"] = asdict(header.provenance) | {"repeat": header.repeat}
        _write_tables(units, tables, out, about)


def _chosen(table: exporting.Table, quantity: list[str], model: list[str]) -> exporting.Table:
    """The columns about a repeat, and results with these parts of names. Raises ``UserError``."""
    names, laws = [*table], {"k": "exponential", "alpha": "haff"}  # of the kinetic energy
    first = names.index("complete") + 1
    results = [
        {"": name, "quantity": name + " kinetic_energy" * (name in laws), "model": laws.get(name)}
        for name in names[first:]
    ]
    found = [one[""] for one in named(named(results, "quantity", quantity), "model", model)]
    if not found:
        raise UserError("no result has these names; `snooker export RUN --table` has all")
    return {name: table[name] for name in names[:first] + found}


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
    times: str | None, every: float | None, number: int | None, end: float
) -> NDArray[np.float64]:
    """The times of the states, s, with at most one of three options. Raises ``UserError``."""
    if every is not None:
        if not end / MOST_FRAMES < every < math.inf:
            least = f"{end / MOST_FRAMES:.2g} s"
            raise UserError(f"--every {every:g}: give a finite time above {least}")
        found = np.arange(int(end / every) + 2) * every
        return np.asarray(found[found <= end], dtype=np.float64)
    if times is None:
        return np.linspace(0.0, end, number or 2)
    try:
        if ":" not in times:
            return np.array([float(time) for time in times.split(",")])
        start, stop, count = times.split(":")
        if 0 < int(count) <= MOST_FRAMES and math.isfinite(float(stop) - float(start)):
            return np.linspace(float(start), float(stop), int(count))
    except ValueError:
        pass
    ways = f"give times in s as 0,0.5,1 or as start:stop:count, at most {MOST_FRAMES:,}"
    raise UserError(f"--times {times}: {ways}")
