"""The arrays of a repeat under way, saved to a checkpoint and restored from it.

A checkpoint may come from a stranger. Kernels use integers as indices without a check, so each
integer has to be one that a kernel could have left. Floats need no such check: whatever they are,
kernels stay within arrays, but a number that is nan or negative could make a search endless.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.engine import all_pairs, cell_grid
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.sliding import SLIDES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from snooker_cli.engine.all_pairs import Agenda
    from snooker_cli.engine.cell_grid import Cells
    from snooker_cli.engine.kernel_state import State
    from snooker_cli.engine.sampling import Grid

FROM_SCENE = {"setup", "box", "period", "radii", "masses", "at_wall", "mesh"}
SAME_MEMORY = {"tags", "bits"}
WORKING_MEMORY = {"scratch", "near", "followed"}
NOT_SAVED = FROM_SCENE | SAME_MEMORY | WORKING_MEMORY
"""Fields of the engine's named tuples that a new engine has already."""


def arrays(name: str, part: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Copies of the arrays and numbers of a part, by name."""
    if isinstance(part, tuple):
        for field, value in part._asdict().items():  # type: ignore[attr-defined]  # a NamedTuple
            if field not in NOT_SAVED:
                yield from arrays(f"{name}.{field}", value)
    elif part is not None:
        yield name, np.array(part, order="C")


def restored(name: str, part: Any, saved: Mapping[str, NDArray[Any]]) -> Any:
    """A part with what was saved: arrays keep their memory and its order.

    Raises ``ValueError`` for an array that is missing, or of another shape or type than the part's.
    """
    if isinstance(part, tuple):
        values = part._asdict()  # type: ignore[attr-defined]  # a NamedTuple
        found = {
            field: restored(f"{name}.{field}", value, saved)
            for field, value in values.items()
            if field not in NOT_SAVED
        }
        return type(part)(**values | found)
    if part is None:
        return None
    like = np.asarray(part)
    values = array(saved, name, like.ndim)
    require((values.dtype, values.shape) == (like.dtype, like.shape), name)
    if not isinstance(part, np.ndarray):
        return type(part)(values)
    part[...] = values
    return part


def array(saved: Mapping[str, NDArray[Any]], name: str, axes: int) -> NDArray[Any]:
    """An array that was saved. Raises ``ValueError`` without it, or with other axes."""
    require(name in saved and saved[name].ndim == axes, name)
    return saved[name]


def require(holds: object, what: str) -> None:
    """Raise ``ValueError`` for what no simulation gives."""
    if not holds:
        raise ValueError(f"its checkpoint is not of this repeat: {what}")


def require_within(values: NDArray[Any], least: float, most: float, what: str) -> None:
    """Raise ``ValueError`` for numbers out of a range, and for nan."""
    require(np.all((least <= values) & (values <= most)), what)


def check_state(states: State, grids: Grid | None) -> None:
    """Check stacked states and grids. Raises ``ValueError``."""
    number, ends = states.balls.shape[-1], [ks.FIRST, ks.SECOND]
    require(np.isfinite(states.balls[:, : ks.BALL_ROWS]).all(), "balls")
    require(states.container is None or np.isfinite(states.container).all(), "container")
    require(np.isfinite(np.delete(states.sums, ks.TIME_LIMIT, axis=1)).all(), "sums")
    require_within(states.sums[:, ks.TIME_LIMIT], -math.inf, math.inf, "time limit")
    require_within(np.delete(states.counts, ends, axis=1), 0, ks.NO_LIMIT, "counts")
    require_within(states.counts[:, ends], ks.NO_PARTNER, number - 1, "balls of the last event")
    if states.slides is not None:
        require_within(states.slides, 0, SLIDES if states.setup.traps else 0, "slides")
    if grids is not None:
        require_within(grids.used, 0, grids.rows.shape[1], "rows of the grid")
        require_within(grids.early, 0, len(grids.early_times), "early rows of the grid")
        require(np.all(grids.step >= np.finfo(float).tiny), "step of the grid")


def check_agendas(agendas: Agenda) -> None:
    """Check stacked agendas. Raises ``ValueError``."""
    times, links = agendas
    number = links.shape[-1]
    require_within(times, 0.0, math.inf, "times of the agenda")
    require(np.all(times[:, :, number:] == math.inf), "times of the agenda")
    require_within(
        links[:, [all_pairs.PARTNER, all_pairs.LAST]], ks.NOT_SEARCHED, number - 1, "partners"
    )


def check_cells(state: State, cells: Cells) -> None:
    """Check the cells of many balls, and their labels. Raises ``ValueError``."""
    number, capacity = state.balls.shape[1], cells.members.shape[1]
    balls, mesh, links, occupancy = np.arange(number), cells.mesh, cells.links, cells.occupancy
    cell, place = links[cell_grid.CELL], links[cell_grid.PLACE]
    edge = 0 if state.period is not None else (1 << mesh.shift) + 1
    require_within(cell, edge, len(occupancy) - edge - 1, "cells of the balls")
    if state.period is not None:
        column, row = cell & ((1 << mesh.shift) - 1), cell >> mesh.shift
        require_within(column, 0, mesh.columns - 1, "cells of the balls")
        require_within(row, 0, mesh.rows - 1, "cells of the balls")
    require_within(occupancy, 0, capacity, "balls in a cell")
    require_within(cells.members, 0, number - 1, "balls in a cell")
    require_within(place, 0, occupancy[cell] - 1, "places in a cell")
    listed = cells.members[cell, place] == balls
    require(listed.all() and occupancy.sum() == number, "balls in a cell")
    labels = np.sort(state.labels)
    require(np.array_equal(labels, balls[: len(labels)]), "labels")
    partners = np.stack([links[cell_grid.PARTNER], cells.tags[cell_grid.FORMER]])
    require_within(partners, ks.NOT_SEARCHED, number - 1, "partners")
    times, bits = cells.tree.times, cells.tree.bits
    leaves = len(times) // 2
    require_within(times, 0.0, math.inf, "times of the queue")
    require(np.all(times[leaves + number :] == math.inf), "times of the queue")
    lowest = bits[4:].reshape(-1, 4).min(axis=1)
    require(np.array_equal(lowest, bits[1 : len(lowest) + 1]), "order of the queue")
    if cells.margin is not None:
        brink, brinks = np.sort(cells.margin.brink[: cells.margin.brinks[0]]), cells.margin.brinks
        require_within(brinks, 0, number, "brink")
        require(np.array_equal(brink, np.flatnonzero(links[cell_grid.BRINK])), "brink")
