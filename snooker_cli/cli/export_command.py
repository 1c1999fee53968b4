"""``snooker export``: a repeat's events or states, or a run's table, for other programs."""

import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

from snooker_cli import api
from snooker_cli.cli.app import ENDINGS
from snooker_cli.cli.options import Replace, RunName, Where, conditions, flag, option
from snooker_cli.cli.output import print_line, until_the_reader_leaves
from snooker_cli.errors import UserError


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
        int | None, option("N", "States: number of even times.", min=2, max=10_000_000)
    ] = None,
    table: Annotated[bool, flag("--table", "Export a row for each repeat of all points.")] = False,
    out: Annotated[Path | None, option("FILE", f"A {ENDINGS} [stdout].")] = None,
    replace: Replace = False,
) -> None:
    """Export collisions or states of a repeat, or the table of a run.

    The default is CSV with the columns time, i, j and impulse of each collision; j = -1 is the
    container. With --states the columns are time, ball, x, y, u and v of all balls; ball -1 is the
    container. Rough balls have one column more: tangential_impulse or spin. Numbers have enough
    digits to read back the same doubles. A Parquet file has the same columns, their units and the
    provenance. An H5MD file has states in three dimensions with z = 0, for programs that read
    molecular trajectories. An .xyz file (extended XYZ) has them for OVITO and ASE.

    With --table each repeat of each point is a row: swept keys, how and when it ended, collisions,
    mean temperature, pressure and speed, the energy at the end over that at the start, and the
    fitted constants k and α of exp(−kt) and of Haff's law.
    """
    states = states or (out is not None and api.has_only_states(out))
    given = [n for n, value in (("--times", times), ("--frames", frames)) if value is not None]
    if given and not (states or table):
        raise UserError(f"{given[0]} needs --states")
    if table and (states or given):
        raise UserError("--table is for all repeats, not for states, H5MD or XYZ")
    opened = api.open(run)
    selected = conditions(where, opened)
    if where and not table:
        if point:
            raise UserError("--where and --point both choose the point; give one of them")
        points = opened.matching(**selected)
        if len(points) > 1:
            raise UserError(f"--where {' '.join(where)}: {len(points)} points; choose one of them")
        point = points[0].index
    target = out or sys.stdout
    with nullcontext() if out else until_the_reader_leaves():
        if table:
            opened.export(target, replace=replace, **selected)
        elif states:
            opened.export_states(
                target, times, frames=frames, point=point, repeat=repeat, replace=replace
            )
        else:
            opened.export_events(target, point, repeat, replace=replace)
    if out is not None:
        print_line(str(out))
