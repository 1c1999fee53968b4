"""Results of a run for other programs: its table, and collisions or states of a repeat."""

import json
import math
from collections.abc import Iterable, Mapping
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Any, TextIO, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli import export, options, store
from snooker_cli.api.arguments import times_given
from snooker_cli.api.output_files import check_free, check_no_results
from snooker_cli.config import Point, to_json
from snooker_cli.engine import nearest_times, replayed, stored_times
from snooker_cli.errors import UserError
from snooker_cli.formatting import listed
from snooker_cli.runs import RepeatStatus, RunFolder
from snooker_cli.runs.progress import counting

Target: TypeAlias = str | PathLike[str] | TextIO
"""A file by its name, or a stream that gets CSV."""

UNITS = {"time": "s", "temperature": "J", "pressure": "Pa m", "mean_speed": "m s-1"}
UNITS |= {"k": "s-1", "alpha": "s-1"}
UNITS |= {"wall_energy": "J", "lost_energy": "J", "stationary_from": "s"}
UNITS |= {"rotational_temperature": "J"}
"""Of the columns of ``Run.table`` that have one."""


def table_of(run: RunFolder, points: tuple[Point, ...]) -> dict[str, NDArray[Any]]:
    """What ``Run.table`` gives for points."""
    from snooker_cli.analysis.run_analysis import table_columns

    tables: list[dict[str, list[Any]]] = []
    for point, columns in zip(points, table_columns(run, points, counting), strict=True):
        if not columns:
            continue
        own = {"repeat": run.present(point)} | columns
        number = len(own["repeat"])
        swept = {
            f"config.{key}" if key in own else key: [value] * number
            for key, value in point.parameters
        }
        tables.append({"point": [point.index] * number} | swept | own)
    names = dict.fromkeys(chain.from_iterable(tables))  # in order; rough points have one more
    return {
        name: _column(
            [v for table in tables for v in table.get(name, [None] * len(table["point"]))]
        )
        for name in names
    }


def _column(values: list[Any]) -> NDArray[Any]:
    """Values as an array: numbers with nan for null, or texts."""
    if all(value is None or isinstance(value, int | float) for value in values):
        return np.array([math.nan if value is None else value for value in values])
    return np.array([text if isinstance(text, str) else json.dumps(text) for text in values])


def check_target(out: Target, replace: bool, *, states: bool = False) -> None:
    """Raise ``UserError`` for a file that is there, or whose format has no tables.

    states : whether a format of states will do, too
    """
    if not isinstance(out, str | PathLike):
        return
    path = Path(out)
    check_no_results(path)
    known = export.format_of(path)
    if known is None or not (known.write_tables or (states and known.write_states)):
        endings = listed(export.export_endings(), "or")
        raise UserError(f"{options.OUT.of(path)}: give a name in {endings}")
    check_free(path, replace)


def write(
    out: Target,
    units: Mapping[str, str],
    tables: Iterable[export.Columns],
    about: Mapping[str, Any],
) -> None:
    """Write tables to a file or as CSV to a stream; ``about`` is for a Parquet file."""
    if isinstance(out, str | PathLike):
        export.write_tables(Path(out), units, tables, about)
    else:
        out.writelines(export.csv_lines(units, tables))


def export_table(run: RunFolder, out: Target, points: tuple[Point, ...], replace: bool) -> None:
    """What ``Run.export`` does."""
    check_target(out, replace)
    rows = table_of(run, points)
    units = {name: UNITS.get(name, "") for name in rows}
    write(out, units, [rows], {"config": to_json(run.config)})


def export_events(run: RunFolder, out: Target, point: int, repeat: int, replace: bool) -> None:
    """What ``Run.export_events`` does. Memory stays bounded: the file is read in parts."""
    check_target(out, replace)
    status = _recorded(run, point, repeat, "events")
    (header,) = (header for header in store.check(status.path) if header.repeat == repeat)
    pieces = (events for _, events in store.read_events(status.path, [repeat]))
    about = {"events": header.collisions} | export.origin(header)
    write(out, export.EVENTS, map(export.events_table, pieces), about)


def export_states(
    run: RunFolder,
    out: Target,
    times: ArrayLike | str | None,
    frames: int | None,
    point: int,
    repeat: int,
    replace: bool,
) -> None:
    """What ``Run.export_states`` does."""
    check_target(out, replace, states=True)
    if times is not None and frames is not None:
        both = f"{options.STATE_TIMES} and {options.FRAMES} both choose times"
        raise UserError(both, "give one of them")
    status = _recorded(run, point, repeat, "states")
    ((trace, header),) = store.read(status.path, [repeat])
    moments = _times(times, frames, trace.stop.time)
    if trace.events is None and times is None and frames is None:
        moments = stored_times(trace)
    try:
        moments = nearest_times(trace, moments)
        batches = replayed(trace, moments)
    except ValueError as error:
        raise UserError(f"{options.STATE_TIMES}: {error}") from None
    path = Path(out) if isinstance(out, str | PathLike) else None
    if path is not None and (known := export.format_of(path)) and known.write_states:
        export.write_states(path, trace.start, header, moments, batches)
        return
    about = {"frames": len(moments)} | export.origin(header)
    write(out, export.STATES, map(export.states_table, batches), about)


def _recorded(run: RunFolder, point: int, repeat: int, what: str) -> RepeatStatus:
    """The status of a repeat that has events or states. Raises ``UserError`` or ``StoreError``."""
    config = run.chosen(point, repeat).config
    if not config.keeps_events and not (what == "states" and config.stored_times):
        problem = f"{run.name} was run with `record: {config.record}`: it has no {what} to export"
        raise UserError(problem, f"use {options.TABLE}, or run the config with `record: events`")
    status = run.status_of(point, repeat)
    status.raise_if_unusable()
    return status


def _times(times: ArrayLike | str | None, frames: int | None, end: float) -> NDArray[np.float64]:
    """The times of the states, s. Raises ``UserError``."""
    if times is None:
        return np.linspace(0.0, end, frames or 2)
    if not isinstance(times, str):
        return np.atleast_1d(np.asarray(times, dtype=np.float64))
    return times_given(times, options.STATE_TIMES)
