"""What a course must keep, whatever its trajectory: energy, momentum, angular momentum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.bench.methods import Course
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Events


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
    start, finish, events = course.start, course.finish, course.events
    speeds = np.sqrt(np.sum(start.velocities**2, axis=1))
    arms = np.sqrt(np.sum(start.positions**2, axis=1))
    energy = total_energy(finish) - total_energy(start) + losses(start, events)
    momentum = np.sqrt(np.sum((total_momentum(finish) - total_momentum(start)) ** 2))
    turned = abs(total_angular_momentum(finish) - total_angular_momentum(start))
    return Ledger(
        energy=abs(energy) / total_energy(start),
        momentum=float(momentum / np.sum(start.masses * speeds)) if start.free else None,
        angular_momentum=turned / float(np.sum(start.masses * arms * speeds)),
    )


def total_energy(scene: Scene) -> float:
    """Of the balls and the container, J."""
    return scene.kinetic_energy + scene.container_energy


def losses(start: Scene, events: Events) -> float:
    """The sum of (1 - e)/(1 + e) J^2/(2 mu) over the collisions, J."""
    masses = np.append(start.masses, start.container_mass)  # j = -1 is the last
    e = np.where(events.at_wall, start.wall_restitution, start.restitution)
    inverse = 1 / masses[events.i] + 1 / masses[events.j]
    return float(np.sum((1 - e) / (1 + e) * events.impulse**2 * inverse / 2))


def total_momentum(scene: Scene) -> NDArray[np.float64]:
    """Of the balls and of a container that moves, kg m/s."""
    total = scene.masses @ scene.velocities
    return total + scene.container_mass * scene.container_velocity if scene.free else total


def total_angular_momentum(scene: Scene) -> float:
    """About the origin, with a container that moves as a point mass, kg m^2/s."""
    (x, y), (u, v) = scene.positions.T, scene.velocities.T
    total = float(np.sum(scene.masses * (x * v - y * u)))
    if scene.free:
        (x, y), (u, v) = scene.container_position, scene.container_velocity
        total += scene.container_mass * float(x * v - y * u)
    return total
