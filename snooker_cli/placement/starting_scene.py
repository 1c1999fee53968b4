"""A point of an experiment and a repeat -> the scene at its start; the same bits everywhere."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.config import BallList, Rings
from snooker_cli.errors import JammedError, SceneError
from snooker_cli.placement.places import check_rings, lattice, random_places, ring_positions
from snooker_cli.placement.random_numbers import (
    PLACES,
    random_directions,
    random_normals,
    shuffled,
    stream,
)
from snooker_cli.scene import Scene, check

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.config import Experiment
    from snooker_cli.containers import Container

    Floats = NDArray[np.float64]
    Columns = tuple[Floats, Floats, Floats, Floats]
    """Positions, velocities, radii and masses of all balls, in SI units."""


def starting_scene(experiment: Experiment, repeat: int) -> Scene:
    """The scene at the start of a repeat of a point.

    A repeat has the same random directions at every point of a sweep (common random numbers).
    Raises ``SceneError`` if balls overlap or stick out of the container.
    """
    container, balls = experiment.container.given, experiment.balls
    if isinstance(balls, BallList):
        columns = _of_list(balls)
    elif isinstance(balls, Rings):
        assert container is not None
        columns = _of_rings(balls, container.size[0] / 2, experiment.seed, repeat)
    else:
        container, radii = _container_and_radii(experiment)
        counts = [each.count for each in experiment.species]
        masses = np.repeat([each.mass for each in experiment.species], counts)
        columns = (
            _positions(experiment, container, radii, repeat),
            _velocities(experiment, masses, repeat),
            np.repeat(radii, counts),
            masses,
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


def _of_list(balls: BallList) -> Columns:
    """Balls given one by one."""
    names = ("position", "velocity", "radius", "mass")
    positions, velocities, radii, masses = (
        np.array([getattr(ball, name) for ball in balls.list]) for name in names
    )
    return positions, velocities, radii, masses


def _of_rings(balls: Rings, container_radius: float, seed: int, repeat: int) -> Columns:
    """Balls on rings."""
    check_rings(balls, container_radius)
    positions = ring_positions(balls.rings, balls.ring_extent * container_radius)
    number = len(positions)
    velocities = balls.speed * random_directions(number, seed, repeat)
    return positions, velocities, np.full(number, balls.radius), np.full(number, balls.mass)


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
    number = sum(counts)
    packing = container.packing_fraction(_sum_of_squares(np.repeat(radii, counts)))
    if not container.has_wall:
        container.check_radii(np.array(radii))
    generator = stream(experiment.seed, repeat, PLACES)
    if experiment.start == "random":
        try:
            return random_places(container, radii, counts, packing, generator)
        except JammedError as jammed:
            raise _too_dense(experiment, container, radii, packing, jammed.packing) from None
    found = lattice(container, number)
    scale = found.diameter / (2 * max(radii))
    if scale < 1:
        raise _too_dense(experiment, container, radii, packing, scale * scale * packing)
    return found.positions if len(counts) == 1 else found.positions[shuffled(generator, number)]


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
    if not experiment.container.shape_class.has_wall:
        _stop_drift(velocities, masses)
    return velocities


def _stop_drift(velocities: Floats, masses: Floats) -> None:
    """Make the total momentum zero at the same kinetic energy."""
    roots = np.sqrt(masses)[:, None]
    energy = _sum_of_squares(roots * velocities)
    mass = math.fsum(masses.tolist())
    for axis in (0, 1):
        velocities[:, axis] -= math.fsum((masses * velocities[:, axis]).tolist()) / mass
    left = _sum_of_squares(roots * velocities)
    if left > 0:
        velocities *= math.sqrt(energy / left)


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
    number = sum(each.count for each in experiment.species)
    random, mixed = experiment.start == "random", len(set(radii)) > 1
    lattice_type = "on a lattice with space for the largest everywhere" if mixed else "on a lattice"
    problem = (
        f"{number:,} balls {'at random places' if random else lattice_type} in a {container.title} "
        f"reach a packing of {math.floor(reached * 1e4) / 1e4:.4f}, not {packing:.4g}"
    )
    instead = ", or set start: lattice" if random else ", or set start: random" if mixed else ""
    if experiment.packing is not None:
        return SceneError(experiment.packing[0], f"{problem}; lower it{instead}")
    largest = max(radii)
    key = f"balls[{radii.index(largest)}]" if isinstance(experiment.balls, tuple) else "balls"
    # Smaller by more than the rounding of the root, so that the printed radius fits.
    fits = largest * math.sqrt(reached / packing) * (1 - 1e-12)
    advice = "make them smaller" if random or mixed else f"the largest radius is {fits!r} m"
    return SceneError(f"{key}.radius", f"{problem}; {advice}{instead}")
