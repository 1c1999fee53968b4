"""The plain data a simulation starts from: balls, container, coefficients of restitution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

EPSILON = float(np.finfo(np.float64).eps)


class SceneError(ValueError):
    """A scene that cannot exist; ``key`` names the config key to change."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


@dataclass(frozen=True)
class Scene:
    """Balls in a circular container at one instant, in SI units with k_B = 1.

    positions, velocities : (*N*, 2) ``numpy.ndarray`` of ``numpy.float64``, m and m/s
    radii, masses : (*N*,) ``numpy.ndarray`` of ``numpy.float64``, m and kg
    container_radius : m; the wall is the inside of this circle
    container_mass : kg; infinite for a fixed wall
    container_position, container_velocity : (2,) arrays, m and m/s
    restitution, wall_restitution : coefficients of restitution, 0 to 1
    """

    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    radii: NDArray[np.float64]
    masses: NDArray[np.float64]
    container_radius: float
    container_mass: float
    container_position: NDArray[np.float64]
    container_velocity: NDArray[np.float64]
    restitution: float
    wall_restitution: float

    def __post_init__(self) -> None:
        for array in (self.positions, self.velocities, self.radii, self.masses):
            array.flags.writeable = False

    @property
    def number(self) -> int:
        """Number of balls."""
        return len(self.radii)

    @property
    def free(self) -> bool:
        """Whether the container moves when hit."""
        return math.isfinite(self.container_mass)

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of the balls, J."""
        return float(0.5 * np.sum(self.masses * np.sum(self.velocities**2, axis=1)))

    @property
    def container_energy(self) -> float:
        """Kinetic energy of the container, J; zero for a fixed one."""
        if not self.free:
            return 0.0
        return float(0.5 * self.container_mass * np.sum(self.container_velocity**2))

    @property
    def packing_fraction(self) -> float:
        """Area of the balls over the area of the container."""
        return float(np.sum(self.radii**2)) / self.container_radius**2


def check(scene: Scene) -> None:
    """Raise ``SceneError`` where balls overlap or stick out of the container.

    Balls may touch. Positions are doubles, so a touching pair may be short of touching by the
    rounding of its coordinates: that much, 4 epsilon times the container's radius, is let pass.
    """
    slack = 4 * EPSILON * scene.container_radius
    offsets = scene.positions - scene.container_position
    room = scene.container_radius - scene.radii - np.hypot(offsets[:, 0], offsets[:, 1])
    worst = int(np.argmin(room))
    if room[worst] < -slack:
        raise SceneError(
            "balls",
            f"ball {worst} sticks out of the container by {-room[worst]:.6g} m: its centre is "
            f"{scene.container_radius - scene.radii[worst] - room[worst]:.6g} m from the middle "
            f"and its radius {scene.radii[worst]:.6g} m, in a container of radius "
            f"{scene.container_radius:.6g} m; move it inwards or make it smaller",
        )
    i, j, gap = _closest_pair(scene)
    if gap < -slack:
        distance = float(np.hypot(*(scene.positions[i] - scene.positions[j])))
        raise SceneError(
            "balls",
            f"balls {i} and {j} overlap by {-gap:.6g} m: their centres are {distance:.6g} m apart "
            f"and their radii {scene.radii[i]:.6g} m and {scene.radii[j]:.6g} m; use smaller "
            "balls, fewer rings or a larger container",
        )


def _closest_pair(scene: Scene) -> tuple[int, int, float]:
    """The pair with the smallest gap between surfaces, and that gap in m (inf for one ball)."""
    best = (0, 0, math.inf)
    for i in range(scene.number - 1):
        offsets = scene.positions[i + 1 :] - scene.positions[i]
        gaps = np.hypot(offsets[:, 0], offsets[:, 1]) - scene.radii[i + 1 :] - scene.radii[i]
        j = int(np.argmin(gaps))
        if gaps[j] < best[2]:
            best = (i, i + 1 + j, float(gaps[j]))
    return best
