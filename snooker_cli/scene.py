"""The plain data a simulation starts from: balls, container, coefficients of restitution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from snooker_cli.errors import SceneError
from snooker_cli.neighbours import near_pairs

if TYPE_CHECKING:
    from numpy.typing import NDArray


EPSILON = float(np.finfo(np.float64).eps)

LEAST_DIAMETERS = 5
"""How many of its largest balls a periodic box is wide at least: engines look at 3 by 3 cells."""

ROUNDING = 1e-8
"""By how much more, relatively, so that cells a little wider than a ball fit five times."""


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
    contact_duration : of the TC model, in mean free times; zero without it
    elastic_below : relative normal speed under which collisions are elastic, m/s; zero if none are
    slides : whether a ball that bounces infinitely often at the fixed wall of a circle slides on
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
    contact_duration: float = 0.0
    elastic_below: float = 0.0
    slides: bool = False

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
    def period(self) -> tuple[float, float] | None:
        """Width and height of a periodic box, m; none for what has a wall."""
        return self.size if self.shape == "periodic" else None

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
    def mean_free_path(self) -> float:
        """How far a ball flies between contacts in a dilute gas, the wall counted in, m.

        Boltzmann's A/(2 sqrt(2) N d) between balls, with their mean diameter d; pi A/L between hits
        of a wall of length L. Infinite where there is nothing to hit.
        """
        between = 2 * math.sqrt(2) * self.number * 2 * float(np.mean(self.radii))
        if self.number == 1:
            between = 0.0
        obstacles = between + self.wall_length / math.pi
        return self.area / obstacles if obstacles else math.inf

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
    rounding of its coordinates: that much, 2 epsilon times the container's size, is let pass.
    """
    if scene.shape == "periodic":
        check_period(scene.size, float(np.max(scene.radii)))
    slack = 2 * EPSILON * max(scene.size)
    room = _room(scene)
    worst = int(np.argmin(room))
    if room[worst] < -slack:
        raise SceneError("balls", _sticking_out(scene, worst, float(room[worst])), worst)
    if scene.shape == "circle":
        _check_largest(scene)
    _check_speeds(scene)
    i, j, gap = _closest_pair(scene)
    if gap < -slack:
        raise SceneError(
            "balls",
            f"balls {i} and {j} overlap by {-gap:.6g} m: their centres are "
            f"{gap + scene.radii[i] + scene.radii[j]:.6g} m apart and their radii "
            f"{scene.radii[i]:.6g} m and {scene.radii[j]:.6g} m; move them apart, or use smaller "
            "balls or a larger container",
            j,
        )


def _check_largest(scene: Scene) -> None:
    """Raise ``SceneError`` for a ball that fills the circle: it could not move, nor be turned back.

    This is to the last digit: the largest ball is that of the double before the circle's radius.
    """
    largest = int(np.argmax(scene.radii))
    if scene.radii[largest] >= scene.container_radius:
        raise SceneError(
            "balls",
            f"ball {largest} has a radius of {float(scene.radii[largest])!r} m, in a container of "
            f"radius {scene.container_radius!r} m, so that it has no room to move; make it smaller",
            largest,
        )


def _check_speeds(scene: Scene) -> None:
    """Raise ``SceneError`` for a ball whose contacts cannot be computed, so slow or fast is it.

    They are roots of squares of speed times distance, which must neither be less than the least
    double of full precision nor more than the largest; four times the container's size allows for
    two such balls that meet.
    """
    shortest = 2 * float(np.min(scene.radii))
    if scene.shape == "circle":
        shortest = min(shortest, scene.container_radius - float(np.max(scene.radii)))
    speeds = np.hypot(scene.velocities[:, 0], scene.velocities[:, 1])
    with np.errstate(over="ignore", under="ignore"):
        slow = (speeds > 0) & ((speeds * min(shortest, 1.0)) ** 2 < np.finfo(np.float64).tiny)
        fast = ~np.isfinite((speeds * max(4 * max(scene.size), 1.0)) ** 2)
    if np.any(slow | fast):
        ball = int(np.argmax(slow | fast))
        raise SceneError(
            "balls",
            f"ball {ball} moves at {speeds[ball]:.6g} m/s, too {'slow' if slow[ball] else 'fast'} "
            "for its contacts to be computed, as the square of speed times distance is no longer a "
            "double; choose other units, so that speeds and distances are nearer to 1",
            ball,
        )
    with np.errstate(over="ignore", under="ignore"):
        energy = float(np.sum(scene.masses * speeds**2)) / 2
    if np.any(speeds > 0) and not np.finfo(np.float64).tiny <= energy < math.inf:
        heaviest = int(np.argmax(scene.masses))
        raise SceneError(
            "balls",
            f"the energy of the balls, ball {heaviest} of {scene.masses[heaviest]:.6g} kg among "
            "them, is no longer a double; choose other units, so that masses and speeds are nearer "
            "to 1",
            heaviest,
        )


def check_period(size: tuple[float, float], largest: float) -> None:
    """Raise ``SceneError`` for a periodic box (width, height, m) too small for a radius (m)."""
    for key, side in zip(("width", "height"), size, strict=True):
        if side < LEAST_DIAMETERS * 2 * largest * (1 + ROUNDING):
            raise SceneError(
                f"container.{key}",
                f"the periodic box is {side:.6g} m in {key}, which is under {LEAST_DIAMETERS} "
                f"diameters of its largest ball, {2 * largest:.6g} m each, so that a ball could "
                "meet another and its image at once; use smaller balls, more of them, or a larger "
                "box",
            )


def _room(scene: Scene) -> NDArray[np.float64]:
    """Between each ball and the wall, m; of a periodic box, between its centre and the edge."""
    offsets = scene.positions - scene.container_position
    if scene.shape == "circle":
        return np.asarray(
            scene.container_radius - scene.radii - np.hypot(offsets[:, 0], offsets[:, 1])
        )
    edges = np.min(np.array(scene.size) / 2 - abs(offsets), axis=1)
    return np.asarray(edges - scene.radii if scene.shape == "box" else edges)


def _sticking_out(scene: Scene, ball: int, room: float) -> str:
    """The sentence about a ball that has less than no room."""
    if scene.shape == "circle":
        where = f"{scene.container_radius - scene.radii[ball] - room:.6g} m from the middle"
        container = f"a container of radius {scene.container_radius:.6g} m"
    else:
        x, y = scene.positions[ball] - scene.container_position
        where = f"at [{x:.6g}, {y:.6g}] m from the middle"
        container = f"a {scene.shape} box" if scene.shape == "periodic" else "a box"
        container += f" of {scene.width:.6g} m by {scene.height:.6g} m"
    if scene.shape == "periodic":
        return (
            f"the centre of ball {ball} is {-room:.6g} m outside: it is {where}, in {container}; "
            "give the place of its image inside"
        )
    return (
        f"ball {ball} sticks out of the container by {-room:.6g} m: its centre is {where} and its "
        f"radius {scene.radii[ball]:.6g} m, in {container}; move it inwards or make it smaller"
    )


def _closest_pair(scene: Scene) -> tuple[int, int, float]:
    """The pair that overlaps most, or touches, and the gap in m (inf if no balls touch)."""
    best = (0, 0, math.inf)
    for i, j, distances in near_pairs(scene.positions, scene.radii, 0.0, scene.period):
        if len(i) == 0:
            continue
        gaps = distances - scene.radii[i] - scene.radii[j]
        k = int(np.argmin(gaps))
        if gaps[k] < best[2]:
            first, second = sorted((int(i[k]), int(j[k])))
            best = (first, second, float(gaps[k]))
    return best
