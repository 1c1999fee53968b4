"""A point of an experiment and a repeat -> the scene it starts from, the same bits everywhere."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.config import BallList, Rings
from snooker_cli.containers import Circle
from snooker_cli.errors import JammedError, SceneError
from snooker_cli.placement.places import (
    check_rings,
    lattice,
    packing_of,
    ring_positions,
    scattered,
    unit_polygon,
)
from snooker_cli.placement.random_numbers import (
    PLACES,
    random_directions,
    random_normals,
    shuffled,
    stream,
)
from snooker_cli.scene import Scene, check

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from snooker_cli.config import Experiment
    from snooker_cli.containers import Container

    Floats = NDArray[np.float64]


# Balls given by count: how large they and their container are, where they start and how fast.

Radii = tuple[float, ...]


def container_and_radii(experiment: Experiment) -> tuple[Container, Radii]:
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


def start_positions(
    experiment: Experiment, container: Container, radii: Radii, repeat: int
) -> Floats:
    """Places of all balls, species by species; (*N*, 2), m. Raises ``SceneError``."""
    counts = [each.count for each in experiment.species]
    if not container.has_wall:
        container.check_radii(np.array(radii))
    generator = stream(experiment.seed, repeat, PLACES)
    if experiment.start == "random":
        try:
            return scattered(container, radii, counts, generator)
        except JammedError as jammed:
            raise _too_dense(experiment, container, radii, jammed.packing) from None
    number = sum(counts)
    found = lattice(container, number)
    scale = found.diameter / (2 * max(radii))
    if scale < 1:
        packing = packing_of(container, each_ball(experiment, radii))
        raise _too_dense(experiment, container, radii, scale * scale * packing)
    if len(counts) == 1:
        return found.positions
    return found.positions[shuffled(generator, number)]


def start_velocities(experiment: Experiment, repeat: int) -> Floats:
    """Velocities of all balls, species by species; (*N*, 2), m/s.

    Each species has the kinetic energy of balls that all have its speed. In a periodic box, where
    momentum is conserved, momentum is made zero and the energy of all restored by one factor.
    """
    species = experiment.species
    number = sum(each.count for each in species)
    directions = random_directions(number, experiment.seed, repeat)
    velocities = directions
    if any(each.speeds == "maxwell" for each in species):
        normals = random_normals(number, experiment.seed, repeat)
        velocities = directions.copy()
    first = 0
    for each in species:
        part = slice(first, first + each.count)
        if each.speeds == "maxwell":
            drawn = normals[part]
            velocities[part] = drawn / math.sqrt(_sum_of_squares(drawn) / each.count)
        velocities[part] *= each.speed
        first += each.count
    if not experiment.container.shape_class.has_wall:
        _stop_drift(velocities, each_ball(experiment, [each.mass for each in species]))
    return velocities


def each_ball(experiment: Experiment, values: Sequence[float]) -> Floats:
    """A value of each species for every ball; (*N*,)."""
    counts = [each.count for each in experiment.species]
    return np.repeat(np.array(values, dtype=np.float64), counts)


def _stop_drift(velocities: Floats, masses: Floats) -> None:
    """Take the velocity of the centre of mass off all, at the same kinetic energy."""
    roots = np.sqrt(masses)[:, None]
    energy = _sum_of_squares(roots * velocities)
    mass = math.fsum(masses.tolist())
    for axis in (0, 1):
        velocities[:, axis] -= math.fsum((masses * velocities[:, axis]).tolist()) / mass
    left = _sum_of_squares(roots * velocities)
    if left > 0:
        velocities *= math.sqrt(energy / left)


def _sum_of_squares(values: Floats) -> float:
    """Correctly rounded, and so the same for any order of adding."""
    return math.fsum((values * values).ravel().tolist())


def _too_dense(
    experiment: Experiment, container: Container, radii: Radii, reached: float
) -> SceneError:
    """What to say of balls that do not fit, where a packing of ``reached`` would."""
    counts = [each.count for each in experiment.species]
    packing = packing_of(container, each_ball(experiment, radii))
    random, mixed = experiment.start == "random", len(set(radii)) > 1
    on_lattice = "on a lattice with room for the largest everywhere" if mixed else "on a lattice"
    how = "put in at random and grown" if random else on_lattice
    said = (
        f"{sum(counts):,} balls {how} in a {container.title} reach a packing of "
        f"{math.floor(reached * 1e4) / 1e4:.4f}, and {packing:.4g} is asked for; "
    )
    instead = ", or set start: lattice" if random else ", or set start: random" if mixed else ""
    if experiment.packing is not None:
        return SceneError(experiment.packing[0], f"{said}lower it{instead}")
    largest = max(radii)
    key = f"balls[{radii.index(largest)}]" if isinstance(experiment.balls, tuple) else "balls"
    # Smaller by more than the root's rounding, so that what is printed fits.
    fits = largest * math.sqrt(reached / packing) * (1 - 1e-12)
    advice = "make them smaller" if random or mixed else f"the largest radius is {fits!r} m"
    return SceneError(f"{key}.radius", f"{said}{advice}{instead}")


__all__ = ["random_directions", "ring_positions", "starting_scene", "unit_polygon"]


def starting_scene(experiment: Experiment, repeat: int) -> Scene:
    """The start of a repeat of a point.

    The same repeat has the same random directions at every point of a sweep (common random
    numbers). Raises ``SceneError`` if balls overlap or stick out of the container.
    """
    container, balls = experiment.container.given, experiment.balls
    if isinstance(balls, Rings):
        assert isinstance(container, Circle)
        columns = _of_rings(balls, container.radius, experiment.seed, repeat)
    elif isinstance(balls, BallList):
        columns = _of_list(balls)
    else:
        container, radii = container_and_radii(experiment)
        columns = (
            start_positions(experiment, container, radii, repeat),
            start_velocities(experiment, repeat),
            each_ball(experiment, radii),
            each_ball(experiment, [each.mass for each in experiment.species]),
        )
    assert container is not None
    scene = Scene(
        *columns,
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


def _of_rings(
    balls: Rings, container_radius: float, seed: int, repeat: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Positions, velocities, radii and masses of balls on rings."""
    check_rings(balls, container_radius)
    positions = ring_positions(balls.rings, balls.ring_extent * container_radius)
    number = len(positions)
    velocities = balls.speed * random_directions(number, seed, repeat)
    return positions, velocities, np.full(number, balls.radius), np.full(number, balls.mass)


def _of_list(balls: BallList) -> tuple[Floats, Floats, Floats, Floats]:
    """Positions, velocities, radii and masses of balls given one by one."""
    return (
        np.array([ball.position for ball in balls.list]),
        np.array([ball.velocity for ball in balls.list]),
        np.array([ball.radius for ball in balls.list]),
        np.array([ball.mass for ball in balls.list]),
    )
