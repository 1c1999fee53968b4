"""A scene -> what theory has of it: its fluid, its collision rates, the energy it keeps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.observables import ROUNDING, drift_energy, equal_balls

if TYPE_CHECKING:
    from snooker_cli.scene import Scene

DENSEST_FLUID = 0.65
"""Packing fraction above which disks begin to order, where no theory here speaks of them."""

HEAVY = 1000.0
"""A free container this many times as heavy as the balls keeps their angular momentum."""


def container(scene: Scene, radius: float | None = None, scale: float = 1.0) -> theory.Container:
    """The scene's container for balls of a radius (m), that of the first by default.

    scale : of the container's sizes
    """
    ball = float(scene.radii[0]) if radius is None else radius
    width, height = (scale * size for size in scene.size)
    if scene.shape == "circle":
        return theory.circle(width / 2, ball)
    if scene.shape == "box":
        return theory.box(width, height, ball)
    return theory.periodic_box(width, height)


def fluid(
    number: float, temperature: float, radius: float, room: theory.Container
) -> theory.FluidState | None:
    """The state of equal hard disks; None where they are too many to be a fluid."""
    if theory.packing_fraction(number, radius, room.area) > DENSEST_FLUID:
        return None
    try:
        return theory.fluid_state(number, temperature, radius, room)
    except ValueError:
        return None


def state(scene: Scene, temperature: float) -> theory.FluidState | None:
    """The state of a scene's balls; None for one ball, unequal ones, or too many for a fluid."""
    if scene.number < 2 or not equal_balls(scene):
        return None
    return fluid(scene.number, temperature, float(scene.radii[0]), container(scene))


def rates(scene: Scene, temperature: float) -> theory.CollisionRates | None:
    """How a scene's balls collide at a temperature (J), after Enskog; None as for `state`."""
    if state(scene, temperature) is None:
        return None
    radius, mass = float(scene.radii[0]), float(scene.masses[0])
    return theory.collision_rates(scene.number, temperature, radius, container(scene), mass)


def at_rest(scene: Scene) -> bool:
    """Whether the balls' centre of mass is at rest, but for rounding."""
    return drift_energy(scene) <= ROUNDING * scene.kinetic_energy


def free_velocities(scene: Scene) -> int | None:
    """As many balls as the law of speeds at fixed energy counts; None where it does not hold.

    With walls all of them; without, one less, as total momentum is kept, and for balls of one mass
    whose centre of mass is at rest only.
    """
    if scene.shape != "periodic":
        return scene.number
    one_mass = bool(np.all(scene.masses == scene.masses[0]))
    return scene.number - 1 if scene.number > 2 and one_mass and at_rest(scene) else None


def floor(scene: Scene) -> float:
    """Least energy that what is conserved leaves the balls, over that at the start.

    A circle keeps their angular momentum about its centre, a periodic box their momentum. nan where
    nothing is kept (a box, a light circle), and in a circle for unequal balls.
    """
    if scene.kinetic_energy == 0 or scene.shape == "box":
        return math.nan
    if scene.shape == "periodic":
        return drift_energy(scene) / scene.kinetic_energy
    light = scene.container_mass < HEAVY * float(np.sum(scene.masses))
    if light or not equal_balls(scene):
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
