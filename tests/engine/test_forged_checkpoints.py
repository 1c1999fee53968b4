"""Arrays of a checkpoint that no simulation gives do not reach the kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import gas

from snooker_cli.engine import CheckpointError, all_pairs, cell_memory, cells, sampling, simulate
from snooker_cli.engine import kernel_state as ks
from snooker_cli.trace import Trace

BALL, ANY = 7, ...
OF_BOTH = [
    ("states.boundary.motion", (0, ks.U), np.inf),
    ("states.boundary.radius", ANY, 1e3),
    ("states.setup.patience", ANY, 3),
    ("states.sizes.radii", BALL, 0.1),
    ("states.counts", (0, ks.PAIR_EVENTS), -1),
    ("states.counts", (0, ks.WALL_EVENTS), 10**6),
    ("states.counts", (0, ks.FIRST), 60),
    ("states.counts", (0, ks.SECOND), -2),
    ("states.sums", (0, ks.NOW), -1.0),
    ("states.sums", (0, ks.TIME_LIMIT), np.nan),
    ("grids.used", 0, sampling.ROWS + 2),
    ("grids.early", 0, -1),
    ("grids.step", 0, 0.0),
]
FORGED = {
    "allpairs": [
        *OF_BOTH,
        ("states.balls", (0, ks.X, BALL), np.nan),
        ("agendas.links", (0, all_pairs.PARTNER, BALL), 60),
        ("agendas.links", (0, all_pairs.PARTNER, BALL), -4),
        ("agendas.links", (0, all_pairs.LAST, BALL), 60),
        ("agendas.links", (0, all_pairs.EVENTS, BALL), -1),
        ("agendas.times", (0, ks.PAIR_TIME, BALL), np.nan),
        ("agendas.times", (0, ks.NEXT_TIME, -1), 0.0),
    ],
    "cells": [
        *OF_BOTH,
        ("cells.tags", (2 * ks.X + 1, BALL), 0x7FF80000),  # the balls' memory: nan
        ("cells.links", (cell_memory.PARTNER, BALL), 60),
        ("cells.links", (cell_memory.CELL, BALL), -1),
        ("cells.links", (cell_memory.CELL, BALL), 10**6),
        ("cells.links", (cell_memory.PLACE, BALL), 99),
        ("cells.links", (cell_memory.BRINK, BALL), 2),
        ("cells.members", (0, 0), 60),
        ("cells.members", (0, 0), -1),
        ("cells.occupancy", 0, -1),
        ("cells.occupancy", 0, 99),
        ("cells.tags", (cell_memory.FORMER, BALL), 60),
        ("cells.tree.bits", 1, 1),  # a time just above zero
        ("cells.tree.bits", 64, -1),
        ("cells.mesh.columns", ANY, 10**6),
        ("cells.margin.brinks", 0, 61),
        ("cells.margin.place", cells.WIDTH, np.nan),
        ("ordered_at", ANY, -1),
    ],
}


def simulated(engine: str, checkpoint: Any = None, *, stop: bool = False) -> Trace:
    scene = gas("circle", 60, 0.3, mixed=True, cor=0.9, container_mass=20.0)
    return simulate(
        scene,
        collisions=20_000,
        summary=True,
        search=search,
        watch=lambda _: stop,
        checkpoint=checkpoint,
    )


def accepts(engine: str, arrays: dict[str, np.ndarray]) -> bool:
    try:
        simulated(engine, arrays)
    except CheckpointError:
        return False
    return True


@pytest.mark.parametrize("engine", FORGED)
def test_forged_arrays_are_found(engine: str) -> None:
    """Each number out of its range, and arrays of another shape or type, or missing."""
    arrays = simulated(engine, stop=True).checkpoint
    assert accepts(engine, arrays)
    for name, index, value in FORGED[engine]:
        forged = {key: values.copy() for key, values in arrays.items()}
        forged[name][index] = value
        assert not accepts(engine, forged), (name, index, value)
    for name, values in arrays.items():
        others = {key: array for key, array in arrays.items() if key != name}
        assert not accepts(engine, others), name
        assert not accepts(engine, {**others, name: values[..., np.newaxis]}), name
        assert not accepts(engine, {**others, name: values.astype(np.float32)}), name
