"""What kinetic theory makes of a scene at its start: collision rates, Haff's α, energy floor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.observables import equal_balls

if TYPE_CHECKING:
    from snooker_cli.scene import Scene

HEAVY = 1000.0
"""A free container this many times as heavy as the balls keeps their angular momentum."""


@dataclass(frozen=True)
class Rates:
    """A ball's mean free path (m) and speed (m/s), and its collisions per second, at the start."""

    path: float
    speed: float
    pairs: float
    wall: float

    def haff(self, restitution: float, wall_restitution: float) -> float:
        """Haff's α at these rates, s⁻¹."""
        return theory.haff_rate(
            theory.cooling_rate(restitution, self.pairs, wall_restitution, self.wall)
        )


def rates(scene: Scene) -> Rates | None:
    """After Enskog, with the wall; None for one ball, unequal ones, or too many for a fluid."""
    if scene.number < 2 or not equal_balls(scene):
        return None
    number, radius, outer = scene.number, float(scene.radii[0]), scene.container_radius
    mass, warm = float(scene.masses[0]), scene.kinetic_energy / scene.number
    density = theory.number_density(number, outer)
    contact = float(theory.contact_value(theory.packing_fraction(number, radius, outer)))
    try:
        pressure = theory.circle_state(number, warm, radius, outer).pressure
    except ValueError:
        return None
    return Rates(
        path=theory.enskog_mean_free_path(density, radius, contact),
        speed=theory.fixed_energy_mean_speed(number, warm, mass),
        pairs=theory.ball_ball_rate(density, radius, warm, contact, mass),
        wall=theory.wall_rate_from_pressure(number, pressure, warm, outer, mass),
    )


def floor(scene: Scene) -> float:
    """Least energy that the balls' angular momentum leaves them, over that at the start.

    nan where it is not conserved (a light container) or the balls are unequal.
    """
    light = scene.container_mass < HEAVY * float(np.sum(scene.masses))
    if light or not equal_balls(scene) or scene.kinetic_energy == 0:
        return math.nan
    offsets = scene.positions - scene.container_position
    velocities = scene.velocities - scene.container_velocity
    turning = offsets[:, 0] * velocities[:, 1] - offsets[:, 1] * velocities[:, 0]
    least = theory.angular_momentum_floor(
        float(np.sum(scene.masses * turning)),
        scene.number,
        scene.container_radius - float(scene.radii[0]),
        float(scene.masses[0]),
    )
    return least / scene.kinetic_energy
