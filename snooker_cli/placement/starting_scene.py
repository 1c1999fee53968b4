"""A point of an experiment and a repeat -> the scene at its start; the same bits everywhere."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, Context
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.config import BallList, Rings
from snooker_cli.errors import JammedError, SceneError
from snooker_cli.placement.places import lattice, random_places, ring_positions
from snooker_cli.placement.random_numbers import (
    PLACES,
    random_directions,
    random_normals,
    shuffled,
    stream,
)
from snooker_cli.scene import Scene, check

if TYPE_CHECKING:
    from snooker_cli.config import Experiment
    from snooker_cli.containers import Container
    from snooker_cli.neighbours import Floats


def starting_scene(experiment: Experiment, repeat: int) -> Scene:
    """The scene at the start of a repeat of a point.

    A repeat has the same random directions at every point of a sweep (common random numbers).
    Raises ``SceneError`` if balls overlap or stick out of the container.
    """
    container, balls = experiment.container.given, experiment.balls
    if isinstance(balls, BallList):
        names = ("position", "velocity", "radius", "mass")
        positions, velocities, radii, masses = (
            np.array([getattr(ball, name) for ball in balls.list]) for name in names
        )
    elif isinstance(balls, Rings):
        assert container is not None
        positions, velocities, radii, masses = _of_rings(
            balls, container.size[0] / 2, experiment.seed, repeat
        )
    else:
        container, sizes = _container_and_radii(experiment)
        counts = [each.count for each in experiment.species]
        masses = np.repeat([each.mass for each in experiment.species], counts)
        positions = _positions(experiment, container, sizes, repeat)
        velocities, radii = _velocities(experiment, masses, repeat), np.repeat(sizes, counts)
    assert container is not None
    scene = Scene(
        positions,
        velocities,
        radii,
        masses,
        container=container,
        container_mass=experiment.container.mass,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=experiment.cor,
        wall_restitution=experiment.effective_wall_cor,
        contact_duration=experiment.contact_duration,
        elastic_below=experiment.elastic_below,
        slides=experiment.collapse == "slide",
    )
    try:
        check(scene)
    except SceneError as error:
        if isinstance(balls, BallList) and error.ball is not None:
            raise SceneError(f"balls.list[{error.ball}]", str(error), error.ball) from None
        raise
    return scene


def _of_rings(balls: Rings, container_radius: float, seed: int, repeat: int) -> list[Floats]:
    """Positions, velocities, radii and masses of balls on rings, in SI units."""
    extent = balls.ring_extent * container_radius
    largest = min(extent / max(balls.rings, 1) / 2, container_radius - extent)
    if balls.rings and balls.radius > largest * (1 + 1e-12):
        raise _too_tight(balls, container_radius, largest)
    positions = ring_positions(balls.rings, extent)
    number = len(positions)
    velocities = balls.speed * random_directions(number, seed, repeat)
    return [positions, velocities, np.full(number, balls.radius), np.full(number, balls.mass)]


def _too_tight(balls: Rings, container_radius: float, largest: float) -> SceneError:
    """The error about rings that do not fit; balls of the radius ``largest`` (m) would."""
    margin, choices = 1 - balls.ring_extent, []
    if balls.radius > margin * container_radius:
        choices.append("lower ring_extent")
    elif fewer := int(balls.ring_extent * container_radius / balls.radius / 2 * (1 + 1e-12)):
        choices.append(f"set rings to {fewer} or less")
    if margin > 0:
        needed = balls.radius * max(2 * balls.rings / balls.ring_extent, 1 / margin)
        rounded = float(Context(4, ROUND_CEILING).create_decimal(repr(needed * (1 - 1e-13))))
        choices.append(f"set balls.radius to {largest!r} or less")
        choices.append(f"set container.radius to {rounded:g} or more")
    problem = (
        f"rings: {balls.rings} with balls of radius {balls.radius:.6g} m are too large for a "
        f"container of radius {container_radius:.6g} m"
    )
    return SceneError("balls", f"{problem}; {', or '.join(choices)}")


# Balls given by count, species after species


def _container_and_radii(experiment: Experiment) -> tuple[Container, tuple[float, ...]]:
    """The container and the radius of each species (m); one of them may follow from packing."""
    species, packing = experiment.species, experiment.packing
    container = experiment.container.given
    radii = tuple(each.radius for each in species if each.radius is not None)
    if container is None:
        assert packing is not None
        squares = math.fsum(one.count * r * r for one, r in zip(species, radii, strict=True))
        container = experiment.container.shape_class.for_packing(packing[1], squares)
    if not radii:
        assert packing is not None
        number = sum(each.count for each in species)
        radii = len(species) * (container.ball_radius(packing[1], number),)
    return container, radii


def _positions(
    experiment: Experiment, container: Container, radii: tuple[float, ...], repeat: int
) -> Floats:
    """Places on a lattice or at random; (*N*, 2), m. Raises ``SceneError``."""
    counts = [each.count for each in experiment.species]
    packing = container.packing_fraction(_sum_of_squares(np.repeat(radii, counts)))
    if not container.has_wall:
        container.check_radii(np.array(radii))
    generator = stream(experiment.seed, repeat, PLACES)
    if experiment.start == "random":
        try:
            return random_places(container, radii, counts, packing, generator)
        except JammedError as jammed:
            raise _too_dense(experiment, container, radii, packing, jammed.packing) from None
    positions, diameter = lattice(container, sum(counts))
    scale = diameter / (2 * max(radii))
    if scale < 1:
        raise _too_dense(experiment, container, radii, packing, scale * scale * packing)
    return positions if len(counts) == 1 else positions[shuffled(generator, len(positions))]


def _velocities(experiment: Experiment, masses: Floats, repeat: int) -> Floats:
    """Random velocities; (*N*, 2), m/s.

    Each species has the kinetic energy of balls that all have its speed. In a periodic box the
    total momentum is zero, and one factor restores the energy.
    """
    species, number = experiment.species, len(masses)
    velocities = random_directions(number, experiment.seed, repeat)
    if any(each.speeds == "maxwell" for each in species):
        normals = random_normals(number, experiment.seed, repeat)
    first = 0
    for each in species:
        part = slice(first, first + each.count)
        if each.speeds == "maxwell":
            drawn = normals[part]
            velocities[part] = drawn / math.sqrt(_sum_of_squares(drawn) / each.count)
        velocities[part] *= each.speed
        first += each.count
    if experiment.container.shape_class.has_wall:
        return velocities
    roots = np.sqrt(masses)[:, None]
    energy = _sum_of_squares(roots * velocities)
    mass = math.fsum(masses.tolist())
    for axis in (0, 1):
        velocities[:, axis] -= math.fsum((masses * velocities[:, axis]).tolist()) / mass
    left = _sum_of_squares(roots * velocities)
    return velocities * math.sqrt(energy / left) if left > 0 else velocities


def _sum_of_squares(values: Floats) -> float:
    """Correctly rounded, so the same for any order of the values."""
    return math.fsum((values * values).ravel().tolist())


def _too_dense(
    experiment: Experiment,
    container: Container,
    radii: tuple[float, ...],
    packing: float,
    reached: float,
) -> SceneError:
    """The error about balls that do not fit; a packing of ``reached`` would."""
    number, start = sum(each.count for each in experiment.species), experiment.start
    problem = (
        f"{number:,} balls with start: {start} in a {container.title} reach a packing of "
        f"{math.floor(reached * 1e4) / 1e4:.4f}, not {packing:.4g}"
    )
    if experiment.packing is not None:
        return SceneError(experiment.packing[0], f"{problem}; lower it, or try another start")
    key = f"balls[{radii.index(max(radii))}]" if isinstance(experiment.balls, tuple) else "balls"
    factor = math.floor(math.sqrt(reached / packing) * 1e4) / 1e4
    advice = f"multiply radii by {factor:.4f} or less, or try another start"
    return SceneError(f"{key}.radius", f"{problem}; {advice}")
