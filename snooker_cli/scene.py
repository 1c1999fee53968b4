"""The plain data a simulation starts from: balls, container, coefficients of restitution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

EPSILON = float(np.finfo(np.float64).eps)


class SceneError(ValueError):
    """A scene that cannot exist; ``key`` names the config key to change."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


Shape = Literal["circle", "box", "periodic"]
"""A wall round a circle, four walls round a rectangle, or a rectangle that repeats for ever."""


@dataclass(frozen=True)
class Scene:
    """Balls in a container at one instant, in SI units with k_B = 1.

    positions, velocities : (*N*, 2) ``numpy.ndarray`` of ``numpy.float64``, m and m/s
    radii, masses : (*N*,) ``numpy.ndarray`` of ``numpy.float64``, m and kg
    container_radius : m; the wall is the inside of this circle; nan for a box
    container_mass : kg; infinite for a fixed wall
    container_position, container_velocity : (2,) arrays, m and m/s
    restitution, wall_restitution : coefficients of restitution, 0 to 1
    shape : what the container is; a box is centred where the container is, and fixed
    width, height : of a box, m; nan for a circle
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
    shape: Shape = "circle"
    width: float = math.nan
    height: float = math.nan

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
    def size(self) -> tuple[float, float]:
        """Width and height of the container, m."""
        if self.shape == "circle":
            return (2 * self.container_radius, 2 * self.container_radius)
        return (self.width, self.height)

    @property
    def area(self) -> float:
        """Area of the container, m^2."""
        if self.shape == "circle":
            return math.pi * self.container_radius**2
        return self.width * self.height

    @property
    def wall_length(self) -> float:
        """Length of the container's wall, m; zero for a periodic box."""
        if self.shape == "circle":
            return 2 * math.pi * self.container_radius
        return 2 * (self.width + self.height) if self.shape == "box" else 0.0

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
        squares = float(np.sum(self.radii**2))
        if self.shape == "circle":
            return squares / self.container_radius**2
        return math.pi * squares / self.area


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
