"""Arrays of a checkpoint that no simulation gives do not reach the kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import EVERYONE, NEIGHBOURS, gas

from snooker_cli.engine import CheckpointError, sampling, simulate
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.simulation import Simulation
from snooker_cli.trace import Trace

BALL, ANY = 7, ...
FORGED = [
    ("states.balls", (0, ks.X, BALL), np.nan),
    ("states.history", (0, ks.FORMER, BALL), 60),
    ("states.history", (0, ks.FORMER, BALL), -(2**31)),
    ("states.boundary.motion", (0, ks.U), np.inf),
    ("states.boundary.radius", ANY, 1e3),
    ("states.setup.settling", ANY, 3.0),
    ("states.setup.laws", (0, 1), 0.5),
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


def simulated(search: type[Simulation], checkpoint: Any = None, *, stop: bool = False) -> Trace:
    scene = gas("circle", 60, 0.3, mixed=True, cor=0.9, container_mass=20.0)
    return simulate(
        scene,
        collisions=20_000,
        summary=True,
        search=search,
        watch=lambda _: stop,
        checkpoint=checkpoint,
    )


def accepts(search: type[Simulation], arrays: dict[str, np.ndarray]) -> bool:
    try:
        simulated(search, arrays)
    except CheckpointError:
        return False
    return True


@pytest.mark.parametrize("search", [EVERYONE, NEIGHBOURS])
def test_forged_arrays_are_found(search: type[Simulation]) -> None:
    """Each number out of its range, and arrays of another shape or type, or missing."""
    arrays = simulated(search, stop=True).checkpoint
    assert accepts(search, arrays)
    for name, index, value in FORGED:
        forged = {key: values.copy() for key, values in arrays.items()}
        forged[name][index] = value
        assert not accepts(search, forged), (name, index, value)
    for name, values in arrays.items():
        others = {key: array for key, array in arrays.items() if key != name}
        assert not accepts(search, others), name
        assert not accepts(search, {**others, name: values[..., np.newaxis]}), name
        assert not accepts(search, {**others, name: values.astype(np.float32)}), name
