"""A point of an experiment and a repeat -> the scene at its start; the same bits everywhere."""

import math
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Any

import numpy as np

from snooker_cli.config import BallList, Config, Rings
from snooker_cli.config.models import SpinTemperature
from snooker_cli.config.points import stream_seed
from snooker_cli.containers import Container
from snooker_cli.errors import JammedError, SceneError
from snooker_cli.fields import CARRIED, MOVING, MovingField
from snooker_cli.neighbours import Floats
from snooker_cli.placement.places import lattice_around, random_places, ring_positions
from snooker_cli.placement.random_numbers import (
    PLACES,
    SPIN,
    random_directions,
    random_normals,
    shuffled,
    stream,
    wall_key,
)
from snooker_cli.scene import Scene, check, check_speeds


def starting_scene(config: Config, repeat: int) -> Scene:
    """The scene at the start of a repeat of a point; see ``starting_scenes``."""
    (scene,) = starting_scenes(config, [repeat])
    return scene


def starting_scenes(config: Config, repeats: Sequence[int]) -> list[Scene]:
    """The scenes at the start of one or more repeats of a point; they share what is the same.

    Raises ``SceneError`` if balls overlap or stick out of the container.
    """
    container, balls = config.container.given, config.balls
    sizes: tuple[float, ...] = ()
    if config.species:
        container, sizes = _container_and_radii(config)
    assert container is not None
    rules = config.collision_rules
    same: dict[str, Any] = {
        "container": container,
        "container_mass": config.container.mass,
        "container_position": np.zeros(2),
        "container_velocity": np.array(config.container.velocity or (0.0, 0.0)),
        **vars(rules),
    }
    rounding = (config.start and config.start.rounding) or 0.0
    placed = balls.list if isinstance(balls, BallList) else config.placed
    names = ("position", "velocity", "radius", "mass")
    places, moving, radii, masses = (np.array([getattr(b, name) for b in placed]) for name in names)
    places, moving = places.reshape(-1, 2), moving.reshape(-1, 2)
    try:
        if placed:  # before others are placed around them
            check(Scene(places, moving, radii, masses, **same), rounding)
        positions = [places] * len(repeats)
        velocities = np.repeat(moving[np.newaxis], len(repeats), axis=0)
        if isinstance(balls, Rings):
            places = _on_rings(balls, container.size[0] / 2)
            positions, number = [places] * len(repeats), len(places)
            velocities = balls.speed * random_directions(number, stream_seed(config), repeats)
            radii, masses = np.full(number, balls.radius), np.full(number, balls.mass)
        elif config.species:
            counts = [species.count for species in config.species]
            of_gas = np.repeat([species.mass for species in config.species], counts)
            positions = _positions(config, container, sizes, (places, radii), repeats)
            drawn = _velocities(config, repeats)
            velocities = np.concatenate([velocities, drawn], axis=1)
            radii = np.append(radii, np.repeat(sizes, counts))
            masses = np.append(masses, of_gas)
        axes = np.flatnonzero(container.periodic).tolist() if config.species else []
        if axes or not config.common_rotation:
            check_speeds(Scene(positions[0], velocities[0], radii, masses, **same), velocities)
            first = len(placed)
            gas = masses[first:], [places[first:] for places in positions]
            _set_at_rest(velocities[:, first:], *gas, axes, not config.common_rotation)
        carried: dict[str, Any] = {
            field.name: _carried(field, config, radii, masses, repeats)
            for field in MOVING[CARRIED:]
            if same[field.needs] is not None
        }
        keys: list[int | None] = [None] * len(repeats)
        if rules.wall_law.is_random:
            given = config.wall_key
            keys = [
                wall_key(stream_seed(config), repeat) if given is None else (given + repeat) % 2**63
                for repeat in repeats
            ]
        rows = zip(positions, velocities, keys, strict=True)
        own = [{name: values[k] for name, values in carried.items()} for k in range(len(repeats))]
        scenes = [
            Scene(places, moving, radii, masses, **same, **of_repeat, wall_key=key)
            for of_repeat, (places, moving, key) in zip(own, rows, strict=True)
        ]
        for k, scene in enumerate(scenes):
            if k == 0 or scene.positions is not scenes[k - 1].positions:
                check(scene, rounding)
        check_speeds(scenes[0], velocities, carried.get("spins"))
    except SceneError as error:
        if error.ball is not None and error.ball < len(placed):
            home = "balls.list" if isinstance(balls, BallList) else "balls"
            raise SceneError(f"{home}[{error.ball}]", str(error), error.ball) from None
        raise
    return scenes


def _on_rings(balls: Rings, container_radius: float) -> Floats:
    """Places on rings; (*N*, 2), m. Raises ``SceneError`` that says which changes would fit."""
    extent = balls.ring_extent * container_radius
    largest = min(extent / max(balls.rings, 1) / 2, container_radius - extent)
    if not balls.rings or balls.radius <= largest * (1 + 1e-12):
        return ring_positions(balls.rings, extent)
    margin, choices = 1 - balls.ring_extent, []
    if balls.radius > margin * container_radius:
        choices.append("lower ring_extent")
    elif fewer := int(balls.ring_extent * container_radius / balls.radius / 2 * (1 + 1e-12)):
        choices.append(f"set rings to {fewer} or less")
    if margin > 0:
        needed = balls.radius * max(2 * balls.rings / balls.ring_extent, 1 / margin)
        most = Context(4, ROUND_FLOOR).create_decimal(repr(largest * (1 + 1e-13)))
        least = Context(4, ROUND_CEILING).create_decimal(repr(needed * (1 - 1e-13)))
        choices.append(f"set balls.radius to {float(most):g} or less")
        choices.append(f"set container.radius to {float(least):g} or more")
    problem = (
        f"rings: {balls.rings} with balls of radius {balls.radius:.6g} m are too large for a "
        f"container of radius {container_radius:.6g} m"
    )
    raise SceneError("balls", f"{problem}; {', or '.join(choices)}")


# Balls given by count, species after species


def _container_and_radii(config: Config) -> tuple[Container, tuple[float, ...]]:
    """The container and the radius of each species (m); one of them may follow from packing."""
    mixture, packing = config.species, config.packing
    container = config.container.given
    radii = tuple(species.radius for species in mixture if species.radius is not None)
    if container is None:
        assert packing is not None
        pairs = zip(mixture, radii, strict=True)
        squares = math.fsum(species.count * r * r for species, r in pairs)
        container = config.container.shape_class.for_packing(packing[1], squares)
    if not radii:
        assert packing is not None
        number = sum(species.count for species in mixture)
        radii = len(mixture) * (container.ball_radius(packing[1], number),)
    return container, radii


def _positions(
    config: Config,
    container: Container,
    radii: tuple[float, ...],
    placed: tuple[Floats, Floats],
    repeats: Sequence[int],
) -> list[Floats]:
    """Places of each repeat on a lattice or at random; (*N*, 2), m. Raises ``SceneError``.

    placed : places (*n*, 2) and radii (*n*,) of the first balls, m
    """
    counts = [species.count for species in config.species]
    all_radii = np.append(placed[1], np.repeat(radii, counts))
    packing = container.packing_fraction(_sum_of_squares(all_radii))
    if container.period is not None:
        container.check_radii(all_radii)
    seed = stream_seed(config)
    streams = (stream(seed, repeat, PLACES) for repeat in repeats)
    if config.arrangement == "random":
        try:
            return [
                random_places(container, radii, counts, packing, bits, placed) for bits in streams
            ]
        except JammedError as jammed:
            raise _too_dense(config, container, radii, packing, jammed.packing) from None
    positions, diameter = lattice_around(container, sum(counts), max(radii), placed)
    scale = diameter / (2 * max(radii))
    if scale < 1:
        raise _too_dense(config, container, radii, packing, scale * scale * packing)
    if len(counts) == 1:
        return [np.concatenate([placed[0], positions])] * len(repeats)
    shuffles = (positions[shuffled(bits, len(positions))] for bits in streams)
    return [np.concatenate([placed[0], places]) for places in shuffles]


def _velocities(config: Config, repeats: Sequence[int]) -> Floats:
    """Random velocities; (*repeats*, *N*, 2), m/s.

    Each species has the kinetic energy of balls that all have its speed.
    """
    mixture, seed = config.species, stream_seed(config)
    number = sum(species.count for species in mixture)
    velocities = random_directions(number, seed, repeats)
    if any(species.speeds == "maxwell" for species in mixture):
        normals = random_normals(number, seed, repeats)
    first = 0
    for species in mixture:
        part = slice(first, first + species.count)
        if species.speeds == "maxwell":
            for velocity, normal in zip(velocities[:, part], normals[:, part], strict=True):
                velocity[:] = normal / math.sqrt(_sum_of_squares(normal) / species.count)
        velocities[:, part] *= species.speed
        first += species.count
    return velocities


def _carried(
    field: MovingField,
    config: Config,
    radii: Floats,
    masses: Floats,
    repeats: Sequence[int],
) -> Floats:
    """What balls have beside their motion; zero unless the config gives it; (*repeats*, *N*, …).

    Random spins have the energy T/2 each on average, as a normal law with variance T/(q m r²).
    """
    balls, seed = config.balls, stream_seed(config)
    given: Any = balls.list if isinstance(balls, BallList) else balls
    groups = given if isinstance(given, tuple) else (given,)
    counts = [getattr(group, "number", getattr(group, "count", 1)) for group in groups]
    values = np.zeros((len(repeats), *field.shape(len(radii))))
    starts = [getattr(group, field.key, None) for group in groups]
    warm = any(isinstance(start, SpinTemperature) for start in starts)
    normals = random_normals(len(radii), seed, repeats, SPIN)[..., 0] if warm else values
    first = 0
    for start, count in zip(starts, counts, strict=True):
        part = slice(first, first + count)
        if isinstance(start, SpinTemperature):
            moments = config.inertia * masses[part] * radii[part] ** 2
            with np.errstate(over="ignore"):  # to infinity, which ``check_speeds`` refuses
                values[:, part] = normals[:, part] * np.sqrt(start.temperature / moments)
        elif start is not None:
            values[:, part] = start
        first += count
    return values


def _set_at_rest(
    velocities: Floats,
    masses: Floats,
    positions: Sequence[Floats],
    axes: Sequence[int],
    turning: bool,
) -> None:
    """Take common motions from velocities, (*repeats*, *N*, 2), m/s, in place.

    One factor restores the energy.

    positions : of each repeat, (*N*, 2), m
    axes : along which the momentum is taken
    turning : whether the angular momentum L about the origin is taken, as a rigid rotation at L/I
    """
    roots = np.sqrt(masses)[:, None]
    mass = math.fsum(masses.tolist())
    for velocity, (x, y) in zip(velocities, (places.T for places in positions), strict=True):
        energy = _sum_of_squares(roots * velocity)
        for axis in axes:
            velocity[:, axis] -= math.fsum((masses * velocity[:, axis]).tolist()) / mass
        if turning:
            u, v = velocity.T
            momentum = math.fsum((masses * (x * v - y * u)).tolist())
            rate = momentum / math.fsum((masses * (x * x + y * y)).tolist())
            u += rate * y
            v -= rate * x
        left = _sum_of_squares(roots * velocity)
        if left > 0:
            velocity *= math.sqrt(energy / left)


def _sum_of_squares(values: Floats) -> float:
    """Correctly rounded, so the same for any order of the values."""
    return math.fsum((values * values).ravel().tolist())


def _too_dense(
    config: Config,
    container: Container,
    radii: tuple[float, ...],
    packing: float,
    reached: float,
) -> SceneError:
    """The error about balls that do not fit; a packing of ``reached`` would."""
    placed, start = len(config.placed), config.arrangement
    number = placed + sum(species.count for species in config.species)
    problem = (
        f"{number:,} balls with start: {start} in a {container.title} reach a packing of "
        f"{math.floor(reached * 1e4) / 1e4:.4f}, not {packing:.4g}"
    )
    if config.packing is not None:
        return SceneError(config.packing[0], f"{problem}; lower it, or try another start")
    index = placed + radii.index(max(radii))
    key = f"balls[{index}]" if isinstance(config.balls, tuple) else "balls"
    factor = math.floor(math.sqrt(reached / packing) * 1e4) / 1e4
    advice = f"multiply radii by {factor:.4f} or less, or try another start"
    return SceneError(f"{key}.radius", f"{problem}; {advice}")
