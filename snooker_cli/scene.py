"""The plain data that a simulation starts from: balls, container, laws of collision."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli.containers import LEAST_AMOUNT, MOST_AMOUNT, MOST_SPEED, Container
from snooker_cli.errors import SceneError
from snooker_cli.fields import CARRIED, MOVING
from snooker_cli.laws import CollisionRules, Law, Surface
from snooker_cli.neighbours import near_pairs

EPSILON = float(np.finfo(np.float64).eps)
TINY = float(np.finfo(np.float64).tiny)

OF_BALLS = ("radii", "masses", *(field.name for field in MOVING if not field.of_container))


@dataclass(frozen=True)
class Scene:
    """Balls in a container at one instant, in SI units with k_B = 1.

    positions, velocities : (*N*, 2) ``numpy.ndarray`` of ``numpy.float64``, m and m/s
    radii, masses : (*N*,) ``numpy.ndarray`` of ``numpy.float64``, m and kg
    container : its shape and size
    container_mass : kg; infinite for a fixed container
    container_position, container_velocity : of its centre, (2,) arrays, m and m/s
    pair_law, wall_law : of collisions between balls and at the wall, see ``laws``
    contact_duration : of the TC model, in mean free times; 0 without it
    elastic_below : relative normal speed below which collisions are elastic, m/s; 0 without it
    slides : whether a ball slides on after infinitely many bounces on a fixed circular wall
    surface : of rough balls; None for smooth ones, which do not spin
    spins : (*N*,) ``numpy.float64``, rad/s, a turn to the left positive; zeros of rough balls by
        default, None of smooth ones
    wall_key : of the random numbers of a wall with a temperature, from 0 to below 2^63; else None
    """

    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    radii: NDArray[np.float64]
    masses: NDArray[np.float64]
    container: Container
    container_mass: float
    container_position: NDArray[np.float64]
    container_velocity: NDArray[np.float64]
    pair_law: Law
    wall_law: Law
    contact_duration: float = 0.0
    elastic_below: float = 0.0
    slides: bool = False
    wall_key: int | None = None
    surface: Surface | None = None
    spins: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        for field in MOVING[CARRIED:]:
            absent = getattr(self, field.needs) is None
            if absent != (getattr(self, field.name) is None):  # as after `replace` of one of them
                values = None if absent else np.zeros(field.shape(len(self.radii)))
                object.__setattr__(self, field.name, values)
        for name in OF_BALLS:
            if (array := getattr(self, name)) is not None:
                array.flags.writeable = False

    @property
    def number(self) -> int:
        """Number of balls."""
        return len(self.radii)

    @property
    def equal_balls(self) -> bool:
        """Whether all balls have one radius and one mass, as the theories need."""
        return bool(np.all(self.radii == self.radii[0]) and np.all(self.masses == self.masses[0]))

    @property
    def free(self) -> bool:
        """Whether the container moves when a ball hits it."""
        return math.isfinite(self.container_mass)

    @property
    def rules(self) -> CollisionRules:
        """What collisions do."""
        return CollisionRules.of(self)

    @property
    def restitution(self) -> float:
        """Coefficient of restitution between balls, of fast collisions."""
        return self.pair_law.cor

    @property
    def wall_restitution(self) -> float:
        """Coefficient of restitution at the wall, of fast collisions."""
        return self.wall_law.cor

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of the balls' motion, without that of their spins, J."""
        return float(0.5 * np.sum(self.masses * np.sum(self.velocities**2, axis=1)))

    @property
    def drift_energy(self) -> float:
        """Kinetic energy of the balls' centre of mass, p²/(2 Σm), J; a periodic box keeps it."""
        momentum = self.masses @ self.velocities
        return float(np.sum(momentum**2) / (2 * np.sum(self.masses)))

    @property
    def spin_energy(self) -> float:
        """Energy of the balls' spins, J; 0 of smooth ones."""
        if self.surface is None or self.spins is None:
            return 0.0
        ways = self.radii * self.spins
        return float(0.5 * self.surface.inertia * np.sum(self.masses * ways**2))

    @property
    def container_energy(self) -> float:
        """Kinetic energy of the container, J; 0 for a fixed one."""
        if not self.free:
            return 0.0
        return float(0.5 * self.container_mass * np.sum(self.container_velocity**2))

    @property
    def mean_free_path(self) -> float:
        """Mean path of a ball between collisions in a dilute gas, including those at the wall, m.

        The rates per length add up: Boltzmann's 2 sqrt(2) N d/A for balls of mean diameter d, and
        L/(pi A) for a wall of length L. Infinite without any other ball or wall.
        """
        between = 2 * math.sqrt(2) * self.number * 2 * float(np.mean(self.radii))
        if self.number == 1:
            between = 0.0
        obstacles = between + self.container.wall_length / math.pi
        return self.container.area / obstacles if obstacles else math.inf

    @property
    def packing_fraction(self) -> float:
        """Area of the balls over the area of the container."""
        return self.container.packing_fraction(float(np.sum(self.radii**2)))


PLACE = 8  # roundings of a place at a contact, see ``place_rounding``

STORED = 1e-9
"""Share of the smallest diameter by which listed balls may overlap: they may be a state of a run at
a rounded time. This is ``place_rounding`` after a flight of half a million diameters."""


def place_rounding(container: Container, diameter: float, flown: float = 0.0) -> float:
    """How far balls of a simulation overlap, or stick out, at most by rounding, m.

    diameter : of the largest ball, m
    flown : m, by the fastest ball since time zero: a stored time is rounded

    docs/accuracy.md has this bound, and the hard cases test it. Overlaps by rounding never deepen,
    see ``engine.contact``.
    """
    return PLACE * EPSILON * (max(container.size) + diameter + flown)


def check(scene: Scene, rounding: float = 0.0) -> None:
    """Raise ``SceneError`` for balls that overlap, stick out, or are too large, slow or fast.

    rounding : m, up to which balls of this scene may overlap or stick out

    Balls may touch. Any scene may be a state of a simulation, see ``STORED``.
    """
    if not sizes_are_possible(scene.radii, scene.masses, scene.container.size):
        problem = (
            f"lengths that follow from packing are not from {LEAST_AMOUNT:g} to {MOST_AMOUNT:g} m"
        )
        raise SceneError("balls", f"{problem}; choose units in which they are nearer to 1")
    slack = place_rounding(scene.container, 2 * float(np.max(scene.radii)))
    slack = max(slack + STORED * 2 * float(np.min(scene.radii)), rounding)
    _check_places(scene, slack)
    check_speeds(scene, scene.velocities[np.newaxis], scene.spins)
    _check_pairs(scene, slack)


def sizes_are_possible(*sizes: ArrayLike) -> bool:
    """Whether lengths (m) and masses (kg) are those that a config can give."""
    arrays = map(np.asarray, sizes)
    return all(np.all((array >= LEAST_AMOUNT) & (array <= MOST_AMOUNT)) for array in arrays)


def _check_places(scene: Scene, slack: float) -> None:
    """Raise ``SceneError`` for balls that are too large for the container or stick out of it."""
    container = scene.container
    container.check_radii(scene.radii)
    places = scene.positions - scene.container_position
    gaps = container.wall_gaps(places, scene.radii)
    if container.period is not None:
        edges = np.min(np.array(container.period) / 2 - abs(places), axis=1)
        gaps = np.minimum(gaps, edges)
    ball = int(np.argmin(gaps))
    if gaps[ball] >= -slack:
        return
    x, y = places[ball]
    where = f"[{x:.6g}, {y:.6g}] m from the centre of {container.description}"
    problem = f"ball {ball} sticks out of the container by {-gaps[ball]:.6g} m"
    if container.period is not None and gaps[ball] == edges[ball]:
        problem = f"the centre of ball {ball} is {-gaps[ball]:.6g} m outside"
    advice = f"move it inwards{' or make it smaller' if container.has_wall else ''}"
    raise SceneError("balls", f"{problem}: it is {where}; {advice}", ball)


def check_speeds(
    scene: Scene, velocities: NDArray[np.float64], spins: NDArray[np.float64] | None = None
) -> None:
    """Raise ``SceneError`` for balls too slow, fast, light or heavy to be computed with.

    velocities : (*repeats*, *N*, 2), m/s, of the scene's balls in each repeat
    spins : rad/s, (*repeats*, *N*) or one row for all; ``None`` of smooth balls

    The engine computes with squares of speed times distance, which must be doubles of full
    precision. The factor 4 allows for two fast balls that meet across the container.
    """
    shortest = min(scene.container.shortest_way(scene.radii), 1.0)
    longest = max(4 * max(scene.container.size), 1.0)
    with np.errstate(over="ignore"):
        fast = not np.isfinite((np.hypot(*scene.container_velocity) * longest) ** 2)
    if fast or np.any(np.abs(scene.container_velocity) > MOST_SPEED):
        problem = f"it is above {MOST_SPEED:g} m/s, or its square times distances is no double"
        raise SceneError(
            "container.velocity", f"{problem}; choose units in which it is nearer to 1"
        )
    with np.errstate(over="ignore", under="ignore"):
        speeds = np.hypot(velocities[..., 0], velocities[..., 1])
        if spins is not None:  # collisions can turn a spin into a speed
            speeds = np.hypot(speeds, scene.radii * spins)
        slow = (speeds > 0) & ((speeds * shortest) ** 2 < TINY)
        wrong = slow | ~np.isfinite((speeds * longest) ** 2)
        energies = np.sum(scene.masses * speeds**2, axis=1) / 2
    usable = (energies >= TINY) & (energies < math.inf) & ~np.any(wrong, axis=1)
    unusable = np.any(speeds > 0, axis=1) & ~usable
    if np.any(unusable):
        repeat = int(np.argmax(unusable))
        ball = int(np.argmax(wrong[repeat] if np.any(wrong[repeat]) else scene.masses))
        which = f"ball {ball} of {scene.masses[ball]:.6g} kg at {speeds[repeat, ball]:.6g} m/s"
        which += " with its spin" if spins is not None else ""
        problem = f"{which} has squares of speed times distance, or an energy, that are no doubles"
        advice = "choose units in which speeds, distances and masses are nearer to 1"
        raise SceneError("balls", f"{problem}; {advice}", ball)


def _check_pairs(scene: Scene, slack: float) -> None:
    """Raise ``SceneError`` for the two balls that overlap most."""
    first, second, deepest = 0, 0, -slack
    for i, j, distances in near_pairs(scene.positions, scene.radii, 0.0, scene.container.period):
        if len(i) == 0:
            continue
        gaps = distances - scene.radii[i] - scene.radii[j]
        k = int(np.argmin(gaps))
        if gaps[k] < deepest:
            first, second = sorted((int(i[k]), int(j[k])))
            deepest = float(gaps[k])
    if deepest < -slack:
        apart = deepest + scene.radii[first] + scene.radii[second]
        problem = f"balls {first} and {second} overlap by {-deepest:.6g} m"
        advice = "move them apart, or use smaller balls or a larger container"
        sentence = f"{problem}: their centres are {apart:.6g} m apart; {advice}"
        raise SceneError("balls", sentence, second)
