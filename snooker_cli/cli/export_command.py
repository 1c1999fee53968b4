"""``snooker export``: a repeat's events or states, or a run's table, for other programs."""

import sys
from contextlib import nullcontext
from pathlib import Path

import snooker_cli as snooker
from snooker_cli import options
from snooker_cli.cli.output import print_line, until_the_reader_leaves
from snooker_cli.cli.parameters import RunName, takes
from snooker_cli.errors import UserError
from snooker_cli.export import has_only_states


@takes(
    *(options.POINT, options.WHERE, options.EXPORT_REPEAT, options.STATES, options.STATE_TIMES),
    *(options.FRAMES, options.TABLE, options.EXPORT_OUT, options.REPLACE),
)
def export(
    run: RunName,
    *,
    point: int,
    where: list[str],
    repeat: int,
    states: bool,
    times: str | None,
    frames: int | None,
    table: bool,
    out: Path | None,
    replace: bool,
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
    states = states or (out is not None and has_only_states(out))
    given = [n for n, value in (("--times", times), ("--frames", frames)) if value is not None]
    if given and not (states or table):
        raise UserError(f"{given[0]} needs --states")
    if table and (states or given):
        raise UserError("--table is for all repeats, not for states, H5MD or XYZ")
    opened = snooker.open(run)
    selected = opened.where(*where)
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
