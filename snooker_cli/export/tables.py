"""Events and states -> tables: columns with units, some rows at a time; and their CSV."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.export.writing import written
from snooker_cli.trace import CONTAINER

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from snooker_cli.engine import States
    from snooker_cli.trace import Events

Table = dict[str, "NDArray[Any]"]
"""Columns of one length, by name."""

EVENTS = {"time": "s", "i": "1", "j": "1", "impulse": "kg m s-1"}
STATES = {"time": "s", "ball": "1", "x": "m", "y": "m", "u": "m s-1", "v": "m s-1"}
"""The columns of both tables and their units; ball -1 is the container."""

LINES = 1 << 16
"""Lines of CSV made at a time."""


def events_table(events: Events) -> Table:
    """The columns of ``EVENTS``."""
    return {name: getattr(events, name) for name in EVENTS}


def states_table(states: States) -> Table:
    """The columns of ``STATES``: at each time the container and all balls."""
    number = states.positions.shape[1] + 1
    x, y = _columns(states.container_positions, states.positions)
    u, v = _columns(states.container_velocities, states.velocities)
    balls = np.arange(CONTAINER, number - 1, dtype=np.int32)
    return {
        "time": np.repeat(states.time, number),
        "ball": np.tile(balls, len(states.time)),
        "x": x,
        "y": y,
        "u": u,
        "v": v,
    }


def csv_lines(units: Mapping[str, str], tables: Iterable[Table]) -> Iterator[str]:
    """The lines of a CSV: the columns' names, then numbers that read back as the same doubles.

    Nothing comes before the first table is there: it may be that it cannot be read.
    """
    line = ",".join(["{!r}"] * len(units)) + "\n"
    for k, table in enumerate(tables):
        if k == 0:
            yield ",".join(units) + "\n"
        columns = [table[name] for name in units]
        for first in range(0, len(columns[0]), LINES):
            some = (column[first : first + LINES].tolist() for column in columns)
            yield from (line.format(*row) for row in zip(*some, strict=True))


def _columns(container: NDArray[np.float64], balls: NDArray[np.float64]) -> NDArray[np.float64]:
    """The two coordinates, each of the container and then the balls, time after time."""
    together = np.concatenate([container[:, None], balls], axis=1)
    return np.ascontiguousarray(together.reshape(-1, 2).T)


def write_csv(path: Path, units: Mapping[str, str], tables: Iterable[Table]) -> None:
    """Write the CSV of tables, whole or not at all. Raises ``ExportError``."""
    with written(path) as part, part.open("x", encoding="ascii", newline="") as file:
        file.writelines(csv_lines(units, tables))
