"""What a course must keep, whatever its trajectory: energy, momentum, angular momentum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.trace import CONTAINER

if TYPE_CHECKING:
    from snooker_cli.bench.methods import Course
    from snooker_cli.scene import Scene


@dataclass(frozen=True)
class Ledger:
    """How far the books are out, each as a part of what there was at the start.

    energy : change of kinetic energy and the losses that the impulses stand for
    momentum : of balls and container, over the sum of the balls' |p|; ``None`` if it is fixed
    angular_momentum : about the origin, over the sum of the balls' |x||p|
    """

    energy: float
    momentum: float | None
    angular_momentum: float


def ledger(course: Course) -> Ledger:
    """The books of a course in a circle."""
    start, finish = course.start, course.finish
    speeds = np.sqrt(np.sum(start.velocities**2, axis=1))
    arms = np.sqrt(np.sum(start.positions**2, axis=1))
    energy = _energy(finish) - _energy(start) + _losses(course)
    momentum = np.sqrt(np.sum((_momentum(finish) - _momentum(start)) ** 2))
    turned = abs(_angular_momentum(finish) - _angular_momentum(start))
    return Ledger(
        energy=abs(energy) / _energy(start),
        momentum=float(momentum / np.sum(start.masses * speeds)) if start.free else None,
        angular_momentum=turned / float(np.sum(start.masses * arms * speeds)),
    )


def _energy(scene: Scene) -> float:
    return scene.kinetic_energy + scene.container_energy


def _losses(course: Course) -> float:
    """The sum of (1 - e)/(1 + e) J^2/(2 mu) over the collisions, J."""
    events, start = course.events, course.start
    masses = np.append(start.masses, start.container_mass)  # j = -1 is the last
    e = np.where(events.j == CONTAINER, start.wall_restitution, start.restitution)
    inverse = 1 / masses[events.i] + 1 / masses[events.j]
    return float(np.sum((1 - e) / (1 + e) * events.impulse**2 * inverse / 2))


def _momentum(scene: Scene) -> np.ndarray:
    total = scene.masses @ scene.velocities
    return total + scene.container_mass * scene.container_velocity if scene.free else total


def _angular_momentum(scene: Scene) -> float:
    (x, y), (u, v) = scene.positions.T, scene.velocities.T
    total = float(np.sum(scene.masses * (x * v - y * u)))
    if scene.free:
        (x, y), (u, v) = scene.container_position, scene.container_velocity
        total += scene.container_mass * float(x * v - y * u)
    return total
