"""Scenes for the engine's tests, and what is read off their traces again and again."""

import hashlib
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from snooker_cli.config import Config
from snooker_cli.containers import SHAPES, Circle, Container
from snooker_cli.engine import simulation
from snooker_cli.laws import Constant, Surface
from snooker_cli.placement.random_numbers import PLACES, random_normals, shuffled, stream
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Trace
from snooker_cli.validation.methods import geometric

EPSILON = 2.0**-52

EVERYONE, NEIGHBOURS = simulation.AmongEveryone, simulation.AmongNeighbours
"""The two searches, which give the same bits."""

Ball = tuple[float, float, float, float, float, float]
"""x, y (m), u, v (m/s), radius (m), mass (kg)."""


def scene_of(
    balls: Sequence[Ball],
    *,
    container: Container = Circle(10.0),  # noqa: B008
    container_mass: float = math.inf,
    container_velocity: tuple[float, float] = (0.0, 0.0),
    restitution: float = 1.0,
    wall_restitution: float = 1.0,
) -> Scene:
    """Balls given one by one, in a container whose centre is at the origin."""
    table = np.array(balls, dtype=np.float64)
    return Scene(
        positions=table[:, 0:2].copy(),
        velocities=table[:, 2:4].copy(),
        radii=table[:, 4].copy(),
        masses=table[:, 5].copy(),
        container=container,
        container_mass=container_mass,
        container_position=np.zeros(2),
        container_velocity=np.array(container_velocity),
        pair_law=Constant(restitution),
        wall_law=Constant(wall_restitution),
    )


def lone_bouncer(*others: Ball) -> Scene:
    """A ball of 1 m that is in a wall trap from its first hit, at 0.5 s, until 14.78 s.

    Its speeds after that hit are 6 m/s off the wall and 8 m/s along it.
    """
    inwards = 6.0 / 0.9
    ball = (9.0 - 0.5 * inwards, -4.0, inwards, 8.0, 1.0, 1.0)
    return scene_of([ball, *others], wall_restitution=0.9)


def gas(
    shape: str,
    number: int,
    packing: float,
    *,
    mixed: bool = False,
    cor: float = 1.0,
    wall_cor: float | None = None,
    container_mass: float = math.inf,
    aspect: float = 1.0,
    seed: int = 0,
) -> Scene:
    """Balls on a square lattice that fills a container, with a Maxwellian's velocities of T = 50 J.

    Their radii are 1 m and their masses 1 kg, or radii are from 0.4 m to 1 m and masses from 0.2 kg
    to 5 kg. The momentum of more than one is zero. A box is ``aspect`` times as wide as it is high.
    """
    dice = stream(seed, 0, PLACES)
    radii, masses = np.ones(number), np.ones(number)
    if mixed:
        radii = np.linspace(0.4, 1.0, number)[shuffled(dice, number)]
        masses = geometric(0.2, 5.0, number)[shuffled(dice, number)]
    area = math.pi * float(np.sum(radii**2)) / packing
    circle = shape == "circle"
    height = math.sqrt(area / math.pi) * 2 if circle else math.sqrt(area / aspect)
    width = height if circle else height * aspect
    places = lattice(number, width, height, float(radii.max()) if circle else None)
    velocities = random_normals(number, seed, [0])[0] * np.sqrt(50.0 / masses)[:, np.newaxis]
    if number > 1:
        velocities -= np.sum(masses[:, np.newaxis] * velocities, axis=0) / masses.sum()
    energy = 0.5 * math.fsum(masses * np.sum(velocities**2, axis=1))
    velocities *= math.sqrt(50.0 * number / energy)
    return Scene(
        positions=places,
        velocities=velocities,
        radii=radii,
        masses=masses,
        container=Circle(height / 2) if circle else SHAPES[shape](width, height),
        container_mass=container_mass,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        pair_law=Constant(cor),
        wall_law=Constant(cor if wall_cor is None else wall_cor),
    )


def rough(scene: Scene) -> Scene:
    """The scene with rough balls that spin, and a rough wall if it has one."""
    surface = Surface(0.4, 0.5, 0.3, 0.2, math.inf)
    return replace(scene, surface=surface, spins=np.linspace(-3.0, 4.0, scene.number))


DARTS = 200_000


def uniform(container: Container, radius: float, seed: int) -> NDArray[np.float64]:
    """Random places of balls of a radius (m) in a container, (*n*, 2), by rejection of DARTS."""
    places = np.random.default_rng(seed).uniform(-0.5, 0.5, (DARTS, 2)) * container.size
    radii = np.full(DARTS, radius if container.has_wall else 0.0)
    return places[container.wall_gaps(places, radii) >= 0]


def displaced(
    scene: Scene, by: Sequence[float] = (1024.0, -512.0), drift: Sequence[float] = (32.0, -8.0)
) -> Scene:
    """The container elsewhere (m); a free one drifts with its balls (m/s)."""
    shift, velocity = np.array(by), np.array(drift if scene.free else (0.0, 0.0))
    return replace(
        scene,
        positions=scene.positions + shift,
        velocities=scene.velocities + velocity,
        container_position=scene.container_position + shift,
        container_velocity=scene.container_velocity + velocity,
    )


def lattice(number: int, width: float, height: float, largest: float | None) -> NDArray[np.float64]:
    """This many places evenly in a rectangle, or in its circle, a largest radius from the wall."""
    cells = number
    while True:
        columns = math.ceil(math.sqrt(cells * width / height))
        rows = math.ceil(cells / columns)
        x = width * ((np.arange(columns) + 0.5) / columns - 0.5)
        y = height * ((np.arange(rows) + 0.5) / rows - 0.5)
        places = np.column_stack([np.tile(x, rows), np.repeat(y, columns)])
        if largest is not None:
            places = places[np.hypot(*places.T) < width / 2 - largest]
        if len(places) >= number:
            chosen = np.linspace(0, len(places) - 1, number).round().astype(int)
            return np.ascontiguousarray(places[chosen])
        cells += 1


def config(
    *,
    radius: float = 1.0,
    cor: float = 1.0,
    wall_cor: float | None = None,
    container_mass: float = math.inf,
    ring_extent: float = 0.8,
    rings: int = 3,
    seed: int = 1,
) -> Config:
    """The source report's experiment: 37 balls at 10 m/s in a circle of radius 10 m.

    Its random numbers are common, because golden files hold results of these starts.
    """
    return Config.model_validate(
        {
            "container": {"radius": 10.0, "mass": container_mass},
            "balls": {"rings": rings, "radius": radius, "speed": 10.0, "ring_extent": ring_extent},
            "cor": cor,
            "wall_cor": wall_cor,
            "collisions": 500,
            "seed": seed,
            "common_random": True,
        }
    )


def report_scene(repeat: int = 0, **changes: float) -> Scene:
    """A start of ``experiment``."""
    return starting_scene(config(**changes), repeat)


def mixed_scene(container_mass: float = math.inf, restitution: float = 1.0) -> Scene:
    """The report's balls with radii from 0.4 m to 1 m and masses from 0.2 kg to 5 kg."""
    scene = report_scene(container_mass=container_mass, cor=restitution)
    return replace(
        scene,
        radii=np.linspace(0.4, 1.0, scene.number)[::-1].copy(),
        masses=geometric(0.2, 5.0, scene.number),
    )


def sort_often(monkeypatch: pytest.MonkeyPatch, chunk: int) -> None:
    """Put balls in cells into the order of their cells after every chunk of events."""
    monkeypatch.setattr(simulation, "REORDERED", 2)
    monkeypatch.setattr(simulation, "REORDER_AFTER", 1)
    monkeypatch.setattr(simulation, "SMALL_CHUNK", chunk)


class TrapSums(NamedTuple):
    """Infinitely many bounces of one ball along a fixed circular wall, until it slides.

    duration : from the first impact until the ball slides, s
    angle : covered around the centre meanwhile, rad
    impulse : of all impacts after the first, kg m/s
    """

    duration: float
    angle: float
    impulse: float


def trap_sums(normal: float, tangential: float, restitution: float, reach: float) -> TrapSums:
    """Sums over the bounces of a ball of 1 kg; the speeds (m/s) are those after the first impact.

    The tangential speed stays, and each bounce multiplies the normal speed by the restitution.
    ``reach`` is the distance of the ball from the centre at the wall, m.
    """
    speeds = [normal * restitution**k for k in range(2000)]
    return TrapSums(
        duration=math.fsum(2 * reach * v / (v * v + tangential**2) for v in speeds),
        angle=math.fsum(2 * math.atan2(v, tangential) for v in speeds),
        impulse=math.fsum(v * (1 + restitution) for v in speeds),
    )


def digest(events: Events) -> str:
    """A hash of every bit of the events."""
    columns = (events.time, events.i, events.j, events.impulse)
    return hashlib.sha256(b"".join(column.tobytes() for column in columns)).hexdigest()


def same_events(a: Events, b: Events) -> bool:
    """Whether all bits are the same."""
    return len(a) == len(b) and digest(a) == digest(b)


def energy_losses(trace: Trace) -> NDArray[np.float64]:
    """What each event takes by the ledger, (1 - e)/(1 + e) J^2/(2 mu), J."""
    start, events = trace.start, trace.events
    masses = np.append(start.masses, start.container_mass)
    half_inverse = (1 / masses[events.i] + 1 / masses[events.j]) / 2  # 1/(2 mu)
    e = np.where(events.at_wall, start.wall_restitution, start.restitution)
    return (1 - e) / (1 + e) * events.impulse**2 * half_inverse
