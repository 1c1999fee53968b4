"""Where two that collide touch each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.trace import CONTAINER

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.engine import States
    from snooker_cli.scene import Scene


def contact_points(
    scene: Scene, states: States, i: NDArray[np.int32], j: NDArray[np.int32]
) -> NDArray[np.float64]:
    """(*n*, 2) m: where ball i touches ball j, or the wall for j = -1, in each of (*n*) states."""
    row = np.arange(len(states.time))
    place = states.positions[row, i]
    outwards = _directions_to_wall(scene, place - states.container_positions)
    pairs = j > CONTAINER
    between = states.positions[row, j] - place
    if scene.period is not None:
        between -= scene.period * np.rint(between / scene.period)
    outwards[pairs] = between[pairs]
    lengths = np.hypot(*outwards.T)[:, None]
    unit = np.divide(outwards, lengths, out=np.zeros_like(outwards), where=lengths > 0)
    return np.asarray(place + scene.radii[i][:, None] * unit)


def _directions_to_wall(scene: Scene, offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """(*n*, 2) from places given from the container's centre towards the nearest piece of wall."""
    if scene.shape == "circle":
        return np.array(offsets)
    across = scene.width / 2 - abs(offsets[:, 0]) <= scene.height / 2 - abs(offsets[:, 1])
    side = np.column_stack([across, ~across])
    return np.where(side, np.sign(offsets), 0.0)
