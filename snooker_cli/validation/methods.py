"""Methods to simulate a scene: this engine, the source report's algorithm, time stepping.

Also the scenes that they are compared on.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli.analysis.observables import total_angular_momentum, total_energy, total_momentum
from snooker_cli.config import load
from snooker_cli.containers import Circle
from snooker_cli.engine import States, replay, simulate
from snooker_cli.engine.jit import kernel
from snooker_cli.formatting import short
from snooker_cli.placement.places import DIGITS
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, Events

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]

TOLERANCE = 1e-6
"""The source report: "If the computed time to collision is less than 10⁻⁶ seconds, it is considered
zero"; and zero is not a "positive solution" that can be selected. This is one reading of it."""

SKIN = 0.2
"""Time stepping lists pairs that are nearer than this to contact, in mean distances of balls."""

ROOM = 1 << 20  # events of time stepping; the scenes have some hundred


@dataclass(frozen=True)
class Trajectory:
    """A scene simulated by a method, until the last of the given times.

    positions : (*k*, *N*, 2), m, at the given times
    finish : the scene at the last of them
    overlap : the deepest overlap of two bodies at any of its events or steps, m
    seconds : processor time of the simulation
    """

    start: Scene
    events: Events
    positions: Floats
    finish: Scene
    overlap: float
    seconds: float


class Method(NamedTuple):
    """A method; ``run`` takes a scene and ascending times, s."""

    name: str
    step: float | None
    run: Callable[[Scene, Floats], Trajectory]


def all_methods(steps: Sequence[float]) -> tuple[Method, ...]:
    """All of them; time stepping once for each step, s."""
    return (
        Method("snooker", None, by_engine),
        Method("the source report's algorithm", None, by_source_report),
        *(
            Method(f"time steps of {short(step)} s", step, partial(by_steps, step=step))
            for step in steps
        ),
    )


def events_from_rows(rows: ArrayLike) -> Events:
    """Events from rows of time (s), i, j and impulse (kg m/s)."""
    time, i, j, impulse = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return Events(time.copy(), i.astype(np.int32), j.astype(np.int32), impulse.copy())


def first_different(events: Events, truth: Events) -> int:
    """The number of events before the first in which other bodies collide, or the last."""
    common = min(len(events), len(truth))
    differs = (events.i[:common] != truth.i[:common]) | (events.j[:common] != truth.j[:common])
    return int(np.argmax(differs)) if differs.any() else common


def rms_distance(positions: Floats, others: Floats) -> Floats:
    """Root mean square over the balls of their distance in two trajectories, (*k*,), m."""
    squares = np.sum((positions - others) ** 2, axis=2)
    return np.asarray(np.sqrt(np.mean(squares, axis=1)))


def imbalance(start: Scene, finish: Scene, lost: float) -> dict[str, float]:
    """Violations of the conservation laws, in J, kg m/s and kg m^2/s (about the origin).

    lost : energy that the collisions take, J
    """
    return {
        "energy": abs(total_energy(finish) - total_energy(start) + lost),
        "momentum": math.hypot(*(total_momentum(finish) - total_momentum(start))),
        "angular momentum": abs(total_angular_momentum(finish) - total_angular_momentum(start)),
    }


def deepest_overlap(scene: Scene, states: States, flights: Floats) -> float:
    """The deepest overlap of two balls, m, at the states and during free flight from them.

    flights : (*t*,) s, the time of free flight after each state
    """
    i, j = np.triu_indices(scene.number, 1)
    contact = scene.radii[i] + scene.radii[j]
    offset = scene.container.nearest_image(states.positions[:, i] - states.positions[:, j])
    velocity = states.velocities[:, i] - states.velocities[:, j]
    speed_squares = np.sum(velocity * velocity, axis=2)
    nearest = -np.sum(offset * velocity, axis=2) / np.where(speed_squares > 0, speed_squares, 1)
    offset += velocity * np.clip(nearest, 0.0, flights[:, None])[..., None]
    distance = np.sqrt(np.sum(offset * offset, axis=2))
    return float(np.max(contact - distance, initial=0.0))


def farthest_escape(scene: Scene, states: States) -> float:
    """How far a ball sticks out of the wall, m, at the states; in free flight it is inside."""
    places = states.positions - states.container_position[:, None]
    return float(np.max(-scene.container.wall_gaps(places, scene.radii), initial=0.0))


def by_engine(scene: Scene, moments: Floats) -> Trajectory:
    """Simulate with this project's engine."""
    clock = time.process_time()
    trace = simulate(scene, time=float(moments[-1]))
    seconds = time.process_time() - clock
    assert trace.events is not None
    positions = replay(trace, moments).positions
    states = replay(trace, trace.events.time)
    overlap = max(deepest_overlap(scene, states, 0 * states.time), farthest_escape(scene, states))
    return Trajectory(scene, trace.events, positions, trace.finish, overlap, seconds)


def by_source_report(scene: Scene, moments: Floats) -> Trajectory:
    """Simulate with the source report's algorithm, with NumPy for all pairs at once.

    Each event moves every body and solves every pair's quadratic again; the smallest root beyond
    ``TOLERANCE`` is the next event. The container is one of the bodies.
    """
    clock = time.process_time()
    number = scene.number
    bodies = _bodies(scene).T
    x, v, radii, masses = bodies[:, 0:2], bodies[:, 2:4].copy(), bodies[:, 4], bodies[:, 5]
    first, second = np.triu_indices(number + 1, 1)
    walls = second == number
    side = np.where(walls, -1.0, 1.0)  # balls are inside the container
    contact = radii[second] + side * radii[first]
    now, recorded, overlap = 0.0, 0, 0.0
    positions = np.empty((len(moments), number, 2))
    rows = []
    while True:
        offset, velocity = x[first] - x[second], v[first] - v[second]
        a = np.sum(velocity * velocity, axis=1)
        b = np.sum(offset * velocity, axis=1)
        square = np.sum(offset * offset, axis=1)
        c = square - contact * contact
        overlap = max(overlap, float(np.max(side * (contact - np.sqrt(square)))))
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(b * b - a * c)
            early, late = (-b - root) / a, (-b + root) / a
        # The next event: the smallest root of all pairs that is not "zero".
        delay = np.where(early > TOLERANCE, early, np.where(late > TOLERANCE, late, np.inf))
        k = int(np.argmin(delay))
        while recorded < len(moments) and moments[recorded] < now + delay[k]:
            positions[recorded] = (x + v * (moments[recorded] - now))[:number]
            recorded += 1
        if recorded == len(moments):
            break
        now += float(delay[k])
        x = x + v * delay[k]
        i, j = int(first[k]), int(second[k])
        normal = (x[i] - x[j]) / np.sqrt(np.sum((x[i] - x[j]) ** 2))
        restitution = scene.wall_restitution if walls[k] else scene.restitution
        reduced_mass = 1 / (1 / masses[i] + 1 / masses[j])
        impulse = (1 + restitution) * reduced_mass * np.dot(v[j] - v[i], normal)
        v[i] += impulse / masses[i] * normal
        v[j] -= impulse / masses[j] * normal
        rows.append((now, i, CONTAINER if walls[k] else j, abs(impulse)))
    x = x + v * (float(moments[-1]) - now)
    seconds = time.process_time() - clock
    finish = _moved(scene, x, v)
    return Trajectory(scene, events_from_rows(rows), positions, finish, overlap, seconds)


def by_steps(scene: Scene, moments: Floats, step: float) -> Trajectory:
    """Simulate with time steps (s): bodies that overlap and approach exchange an impulse.

    So do games and codes for granular matter. Pairs far apart are skipped until they can touch.
    """
    states = np.empty((len(moments), 6, scene.number + 1))
    pairs = np.empty((scene.number * (scene.number + 1) // 2, 2), dtype=np.int32)
    skin = SKIN * math.sqrt(scene.container.area / scene.number)
    restitutions = scene.restitution, scene.wall_restitution
    rows, bodies = np.empty((ROOM, 4)), _bodies(scene)
    clock = time.process_time()
    happened, overlap = _step(bodies, *restitutions, step, skin, moments, states, pairs, rows)
    seconds = time.process_time() - clock
    assert happened <= ROOM
    positions = np.ascontiguousarray(np.moveaxis(states[:, 0:2, :-1], 1, 2))
    finish = _moved(scene, states[-1, 0:2].T, states[-1, 2:4].T)
    events = events_from_rows(rows[:happened])
    return Trajectory(scene, events, positions, finish, overlap, seconds)


# Rows of the table of bodies; the container is its last column.
X, Y, U, V, R, M = range(6)


def _bodies(scene: Scene) -> Floats:
    assert isinstance(scene.container, Circle)
    balls = np.vstack([scene.positions.T, scene.velocities.T, scene.radii, scene.masses])
    centre = *scene.container_position, *scene.container_velocity
    return np.column_stack([balls, (*centre, scene.container.radius, scene.container_mass)])


def _moved(scene: Scene, x: Floats, v: Floats) -> Scene:
    """The scene with other positions and velocities, the container's last."""
    return replace(
        scene,
        positions=x[:-1].copy(),
        velocities=v[:-1].copy(),
        container_position=x[-1].copy(),
        container_velocity=v[-1].copy(),
    )


@kernel
def _step(
    bodies: Floats,
    restitution: float,
    wall_restitution: float,
    step: float,
    skin: float,
    moments: Floats,
    states: Floats,
    pairs: Indices,
    events: Floats,
) -> tuple[int, float]:
    """Step until the last moment; the number of events, and the deepest overlap of all steps, m.

    states : (*k*, 6, *N* + 1), filled with the bodies at the moments
    events : rows of time, i, j and impulse, filled as far as there are rows
    """
    number, happened = bodies.shape[1] - 1, 0
    listed, slack, fastest, deepest = 0, -1.0, 0.0, 0.0
    steps, recorded = 0, 0
    while True:
        now = steps * step
        while moments[recorded] < now + step:
            # Element by element: numba takes seconds to compile whole rows.
            for k in range(number + 1):
                for row in range(len(bodies)):
                    states[recorded, row, k] = bodies[row, k]
                states[recorded, X, k] += bodies[U, k] * (moments[recorded] - now)
                states[recorded, Y, k] += bodies[V, k] * (moments[recorded] - now)
            recorded += 1
            if recorded == len(moments):
                return happened, deepest
        steps += 1
        now = steps * step
        for k in range(number + 1):
            bodies[X, k] += bodies[U, k] * step
            bodies[Y, k] += bodies[V, k] * step
        # A pair that is not listed was farther apart than the skin. Two bodies approach by at most
        # twice the largest speed, so the list is made anew before such a pair can touch.
        slack -= 2.0 * fastest * step
        if slack < 0.0:
            listed, fastest = _list_neighbours(bodies, skin, pairs)
            slack = skin
        for k in range(listed):
            i, j = pairs[k, 0], pairs[k, 1]
            wall = j == number
            impulse, overlap = _collide(bodies, i, j, wall_restitution if wall else restitution)
            deepest = max(deepest, overlap)
            if impulse > 0.0:
                fastest = max(fastest, math.hypot(bodies[U, i], bodies[V, i]))
                fastest = max(fastest, math.hypot(bodies[U, j], bodies[V, j]))
                if happened < len(events):
                    event = events[happened]
                    event[0], event[1], event[2] = now, i, CONTAINER if wall else j
                    event[3] = impulse
                happened += 1


@kernel
def _list_neighbours(bodies: Floats, skin: float, pairs: Indices) -> tuple[int, float]:
    """List the pairs that are nearer than the skin to contact; their number, the largest speed."""
    number = bodies.shape[1] - 1
    listed, fastest = 0, 0.0
    for i in range(number + 1):
        fastest = max(fastest, math.hypot(bodies[U, i], bodies[V, i]))
        for j in range(i + 1, number + 1):
            distance = math.hypot(bodies[X, j] - bodies[X, i], bodies[Y, j] - bodies[Y, i])
            side = -1.0 if j == number else 1.0
            if side * distance - side * bodies[R, j] - bodies[R, i] < skin:
                pairs[listed, 0], pairs[listed, 1] = i, j
                listed += 1
    return listed, fastest


@kernel
def _collide(bodies: Floats, i: int, j: int, restitution: float) -> tuple[float, float]:
    """Collide two bodies if they overlap and approach; impulse (or 0) and overlap, m."""
    x, y = bodies[X, j] - bodies[X, i], bodies[Y, j] - bodies[Y, i]
    square = x * x + y * y
    side = -1.0 if j == bodies.shape[1] - 1 else 1.0  # balls are inside the container
    contact = bodies[R, j] + side * bodies[R, i]
    if side * (square - contact * contact) >= 0.0:
        return 0.0, 0.0
    distance = math.sqrt(square)
    overlap = side * (contact - distance)
    x, y = x / distance, y / distance
    normal = (bodies[U, i] - bodies[U, j]) * x + (bodies[V, i] - bodies[V, j]) * y
    if side * normal <= 0.0:
        return 0.0, overlap
    impulse = (1.0 + restitution) * normal / (1.0 / bodies[M, i] + 1.0 / bodies[M, j])
    bodies[U, i] -= impulse / bodies[M, i] * x
    bodies[V, i] -= impulse / bodies[M, i] * y
    bodies[U, j] += impulse / bodies[M, j] * x
    bodies[V, j] += impulse / bodies[M, j] * y
    return abs(impulse), overlap


# The scenes


def start_of(known: Mapping[str, Any], repeat: int = 0) -> Scene:
    """The scene of a repeat of an entry of ``scenes`` in plans.yaml."""
    return rings(repeat, **known["rings"]) if "rings" in known else mixture()


def rings(
    repeat: int = 0,
    *,
    radius: float = 1.0,
    restitution: float = 1.0,
    container_mass: float = 1e7,
    number: int = 3,
) -> Scene:
    """The source report's balls: on rings, at 10 m/s in random directions of each repeat.

    A repeat has the same directions in all scenes.
    """
    known = {
        "container": {"radius": 10.0, "mass": container_mass},
        "balls": {"rings": number, "radius": radius, "speed": 10.0, "ring_extent": 0.8},
        "cor": restitution,
        "collisions": 500,
        "seed": 1,
        "common_random": True,
    }
    return starting_scene(load(known).config, repeat)


def mixture() -> Scene:
    """The source report's balls with radii of 0.4 to 1 m, masses of 0.2 to 5 kg, and cor 0.9."""
    scene = rings(restitution=0.9, container_mass=20.0)
    return replace(
        scene,
        radii=np.linspace(1.0, 0.4, scene.number),
        masses=geometric(0.2, 5.0, scene.number),
    )


def geometric(first: float, last: float, number: int) -> NDArray[np.float64]:
    """A geometric sequence of ``number`` values from first to last, each correctly rounded.

    NumPy's ``geomspace`` rounds differently on different processors.
    """
    with localcontext() as context:
        context.prec = DIGITS
        start, ratio = Decimal(first), Decimal(last) / Decimal(first)
        powers = (ratio ** (Decimal(k) / max(number - 1, 1)) for k in range(number))
        return np.array([float(start * power) for power in powers])
