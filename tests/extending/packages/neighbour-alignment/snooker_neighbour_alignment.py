"""Whether neighbours move in the same direction: a quantity and its theory."""

import numpy as np

from snooker_cli.extending import Quantity, Scene, Theory, near_pairs

GAP = 0.5  # diameters between the surfaces of neighbours at most


def alignment(positions: np.ndarray, velocities: np.ndarray, scene: Scene) -> float:
    """The mean of v₁·v₂ over pairs of neighbours, over the mean of v²; nan without neighbours."""
    gap = GAP * 2 * float(np.mean(scene.radii))
    pairs = near_pairs(positions, scene.radii, gap, scene.container.period)
    products = [np.sum(velocities[i] * velocities[j], axis=1) for i, j, _ in pairs]
    square = np.mean(np.sum(velocities**2, axis=1))
    values = np.concatenate([*products, np.empty(0)])
    return float(values.mean() / square) if len(values) and square > 0 else np.nan


ALIGNMENT = Quantity(
    name="alignment of neighbours",
    symbol="A",
    unit="1",
    words="alignment of neighbours",
    key="neighbour_alignment",
    source="snapshots",
    of_state=alignment,
    unmeasured="it needs `record: events` or `snapshots`",
    alone=("several", "equal_balls", "moves"),
)

MOMENTUM = Theory(
    quantity=ALIGNMENT,
    model="momentum of N balls",
    source="exact: balls of momentum zero have Σv = 0, and places and velocities are independent",
    needs=("elastic", "several", "equal_balls", "no_walls", "at_rest", "smooth"),
    value=lambda gas: -1 / (gas.number - 1),
)
