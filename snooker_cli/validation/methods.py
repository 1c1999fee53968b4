"""Ways to simulate a scene, side by side: this engine, the report's algorithm, time stepping."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.containers import Circle
from snooker_cli.engine import replay, simulate
from snooker_cli.engine.jit import kernel
from snooker_cli.formatting import short
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, Events

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene

    Floats = NDArray[np.float64]
    Indices = NDArray[np.int32]


# Time stepping with impulses, as games and codes for grains have it, compiled.

SKIN = 0.2
"""Width of the shell round a ball in which others are looked at, in mean distances of balls."""

ROOM = 8192
"""Events that are recorded before the kernel returns, at the least."""

# Rows of the bodies' table; the container is its last column.
X, Y, U, V, R, M = range(6)

# Elements of the kernel's memory: steps made, moments recorded, deepest overlap (m), the fastest
# body's speed (m/s).
STEPS, MOMENTS, OVERLAP, FASTEST = range(4)


def stepped(scene: Scene, step: float, moments: Floats) -> tuple[Events, Floats, float]:
    """Events until the last moment, states at the moments, and the deepest overlap of all steps.

    step : s
    moments : (*k*,) s, ascending
    Returns, for states, (*k*, 6, *N* + 1): x, y (m), u, v (m/s), and radius and mass, of each ball
    and of the container; m for the overlap.
    """
    bodies = table(scene)
    states = np.empty((len(moments), *bodies.shape))
    memory = np.zeros(4)
    # A pair, or a ball at the wall, collides once at most in a step.
    most_pairs = scene.number * (scene.number + 1) // 2
    pairs = np.empty((most_pairs, 2), dtype=np.int32)
    skin = SKIN * math.sqrt(scene.container.area / scene.number)
    chunks = []
    while memory[MOMENTS] < len(moments):
        events = np.empty((ROOM + most_pairs, 4))
        used = _advance(
            bodies,
            scene.restitution,
            scene.wall_restitution,
            step,
            skin,
            moments,
            states,
            pairs,
            events,
            ROOM,
            memory,
        )
        chunks.append(events[:used])
    time, i, j, impulse = np.concatenate(chunks).T
    return (
        Events(time.copy(), i.astype(np.int32), j.astype(np.int32), impulse.copy()),
        states,
        float(memory[OVERLAP]),
    )


def table(scene: Scene) -> Floats:
    """The scene's bodies, a column each, with the container in the last."""
    balls = np.vstack([scene.positions.T, scene.velocities.T, scene.radii, scene.masses])
    assert isinstance(scene.container, Circle)
    container = [
        *scene.container_position,
        *scene.container_velocity,
        scene.container.radius,
        scene.container_mass,
    ]
    return np.column_stack([balls, container])


@kernel
def _advance(
    bodies: Floats,
    restitution: float,
    wall_restitution: float,
    step: float,
    skin: float,
    moments: Floats,
    states: Floats,
    pairs: Indices,
    events: Floats,
    room: int,
    memory: Floats,
) -> int:
    """Go on until the moments are through or ``room`` events are there; how many there are."""
    number = bodies.shape[1] - 1
    listed, slack, used = 0, -1.0, 0
    while used < room:
        now = memory[STEPS] * step
        while moments[int(memory[MOMENTS])] < now + step:
            moment = int(memory[MOMENTS])
            # Number by number: what numba makes of whole rows takes seconds to compile.
            for k in range(number + 1):
                for row in range(len(bodies)):
                    states[moment, row, k] = bodies[row, k]
                states[moment, X, k] += bodies[U, k] * (moments[moment] - now)
                states[moment, Y, k] += bodies[V, k] * (moments[moment] - now)
            memory[MOMENTS] += 1
            if memory[MOMENTS] == len(moments):
                return used
        memory[STEPS] += 1
        now = memory[STEPS] * step
        for k in range(number + 1):
            bodies[X, k] += bodies[U, k] * step
            bodies[Y, k] += bodies[V, k] * step
        slack -= 2.0 * memory[FASTEST] * step
        if slack < 0.0:
            listed = _list_neighbours(bodies, skin, pairs, memory)
            slack = skin
        for k in range(listed):
            i, j = pairs[k, 0], pairs[k, 1]
            wall = j == number
            impulse = _collide_overlapping(
                bodies, i, j, wall, wall_restitution if wall else restitution, memory
            )
            if impulse > 0.0:
                event = events[used]
                event[0], event[1], event[2] = now, i, CONTAINER if wall else j
                event[3] = impulse
                used += 1
    return used


@kernel
def _list_neighbours(bodies: Floats, skin: float, pairs: Indices, memory: Floats) -> int:
    """List the pairs that are nearer than the skin to contact, and find the fastest body."""
    number = bodies.shape[1] - 1
    listed = 0
    memory[FASTEST] = 0.0
    for i in range(number + 1):
        memory[FASTEST] = max(memory[FASTEST], math.hypot(bodies[U, i], bodies[V, i]))
        for j in range(i + 1, number + 1):
            distance = math.hypot(bodies[X, j] - bodies[X, i], bodies[Y, j] - bodies[Y, i])
            if j == number:
                near = bodies[R, j] - bodies[R, i] - distance < skin
            else:
                near = distance - bodies[R, i] - bodies[R, j] < skin
            if near:
                pairs[listed, 0], pairs[listed, 1] = i, j
                listed += 1
    return listed


@kernel
def _collide_overlapping(
    bodies: Floats, i: int, j: int, wall: bool, restitution: float, memory: Floats
) -> float:
    """Collide a pair, or a ball and the wall, if they overlap and approach; the impulse or 0."""
    x, y = bodies[X, j] - bodies[X, i], bodies[Y, j] - bodies[Y, i]
    square = x * x + y * y
    side = -1.0 if wall else 1.0  # a ball is inside the container, and outside other balls
    contact = bodies[R, j] + side * bodies[R, i]
    if side * (square - contact * contact) >= 0.0:
        return 0.0
    distance = math.sqrt(square)
    memory[OVERLAP] = max(memory[OVERLAP], side * (contact - distance))
    x, y = x / distance, y / distance
    normal = (bodies[U, i] - bodies[U, j]) * x + (bodies[V, i] - bodies[V, j]) * y
    if side * normal <= 0.0:
        return 0.0
    impulse = (1.0 + restitution) * normal / (1.0 / bodies[M, i] + 1.0 / bodies[M, j])
    bodies[U, i] -= impulse / bodies[M, i] * x
    bodies[V, i] -= impulse / bodies[M, i] * y
    bodies[U, j] += impulse / bodies[M, j] * x
    bodies[V, j] += impulse / bodies[M, j] * y
    for k in (i, j):
        memory[FASTEST] = max(memory[FASTEST], math.hypot(bodies[U, k], bodies[V, k]))
    return float(abs(impulse))


TOLERANCE = 1e-6
"""The report: "If the computed time to collision is less than 10⁻⁶ seconds, it is considered zero";
and zero is not a "positive solution" that can be selected."""


@dataclass(frozen=True)
class Trajectory:
    """What a method makes of a scene until the last of some moments.

    positions : (*k*, *N*, 2), m, at the moments
    finish : the scene at the last of them
    overlap : the deepest overlap of two bodies at any of its events or steps, m
    seconds : processor time of the simulation proper
    """

    start: Scene
    events: Events
    positions: Floats
    finish: Scene
    overlap: float
    seconds: float


@dataclass(frozen=True)
class Method:
    """A way to simulate; ``run`` takes a scene and ascending moments, s."""

    name: str
    step: float | None
    run: Callable[[Scene, Floats], Trajectory]


def all_methods(steps: tuple[float, ...]) -> tuple[Method, ...]:
    """All of them; time stepping once for each step, s."""

    def stepping(step: float) -> Callable[[Scene, Floats], Trajectory]:
        return lambda scene, moments: by_steps(scene, moments, step)

    return (
        Method("snooker", None, by_engine),
        Method("the report's algorithm", None, by_report),
        *(Method(f"time steps of {short(step)} s", step, stepping(step)) for step in steps),
    )


def by_engine(scene: Scene, moments: Floats) -> Trajectory:
    """This project's engine."""
    clock = time.process_time()
    trace = simulate(scene, time=float(moments[-1]))
    seconds = time.process_time() - clock
    assert trace.events is not None
    states = replay(trace, moments)
    at_events = replay(trace, trace.events.time)
    overlap = deepest_overlap(scene, at_events.positions, at_events.container_positions)
    return Trajectory(scene, trace.events, states.positions, trace.finish, overlap, seconds)


def by_report(scene: Scene, moments: Floats) -> Trajectory:
    """The report's algorithm as it describes it, with NumPy for all pairs at once.

    At each event every body is moved to it, and every pair's quadratic is solved anew; its smallest
    root beyond ``TOLERANCE`` counts. The container is one of the bodies. The same in Python loops
    over ball objects, as it is mostly written, gives the same numbers more slowly.
    """
    clock = time.process_time()
    number = scene.number
    bodies = table(scene).T
    x, v = bodies[:, 0:2].copy(), bodies[:, 2:4].copy()
    radii, masses = bodies[:, 4], bodies[:, 5]
    first, second = np.triu_indices(number + 1, 1)
    contact = radii[first] + radii[second]
    walls = second == number
    contact[walls] = (radii[second] - radii[first])[walls]
    now, recorded = 0.0, 0
    states = np.empty((len(moments), number, 2))
    rows, history = [], []
    while True:
        offset, velocity = x[first] - x[second], v[first] - v[second]
        a = np.sum(velocity * velocity, axis=1)
        b = np.sum(offset * velocity, axis=1)
        c = np.sum(offset * offset, axis=1) - contact * contact
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(b * b - a * c)
            early, late = (-b - root) / a, (-b + root) / a
        delay = np.where(early > TOLERANCE, early, np.where(late > TOLERANCE, late, np.inf))
        k = int(np.argmin(delay))
        while recorded < len(moments) and moments[recorded] < now + delay[k]:
            states[recorded] = (x + v * (moments[recorded] - now))[:number]
            recorded += 1
        if recorded == len(moments):
            break
        now += float(delay[k])
        x = x + v * delay[k]
        i, j = int(first[k]), int(second[k])
        impulse = _collide(x, v, masses, i, j, _restitution(scene, j))
        rows.append((now, i, CONTAINER if j == number else j, impulse))
        history.append(x)
    left = float(moments[-1]) - now
    x = x + v * left
    seconds = time.process_time() - clock
    finish = _finish(scene, x, v)
    places = np.array(history).reshape(-1, number + 1, 2)
    overlap = deepest_overlap(scene, places[:, :number], places[:, number])
    return Trajectory(scene, _events(rows), states, finish, overlap, seconds)


def _restitution(scene: Scene, j: int) -> float:
    return scene.wall_restitution if j == scene.number else scene.restitution


def _collide(x: Floats, v: Floats, masses: Floats, i: int, j: int, restitution: float) -> float:
    """The report's equations (3) to (5): normal and tangential parts; the impulse's size."""
    normal = (x[i] - x[j]) / np.sqrt(np.sum((x[i] - x[j]) ** 2))
    v1, v2 = np.dot(v[i], normal), np.dot(v[j], normal)
    tangential1, tangential2 = v[i] - v1 * normal, v[j] - v2 * normal
    # m2/(m1 + m2) and m1/(m1 + m2), for an infinite m2 too
    share1, share2 = 1 / (1 + masses[i] / masses[j]), 1 / (1 + masses[j] / masses[i])
    change = share1 * (1 + restitution) * (v2 - v1)
    after1 = v1 + change
    after2 = v2 + share2 * (1 + restitution) * (v1 - v2)
    v[i] = after1 * normal + tangential1
    v[j] = after2 * normal + tangential2
    return abs(float(masses[i] * change))


def by_steps(scene: Scene, moments: Floats, step: float) -> Trajectory:
    """Time stepping with impulses; see ``stepping``."""
    clock = time.process_time()
    events, states, overlap = stepped(scene, step, moments)
    seconds = time.process_time() - clock
    last = states[-1].T
    finish = _finish(scene, last[:, 0:2], last[:, 2:4])
    positions = np.ascontiguousarray(np.moveaxis(states[:, 0:2, :-1], 1, 2))
    return Trajectory(scene, events, positions, finish, overlap, seconds)


def _finish(scene: Scene, x: Floats, v: Floats) -> Scene:
    """The scene with its bodies, the container last, somewhere else."""
    return replace(
        scene,
        positions=x[:-1].copy(),
        velocities=v[:-1].copy(),
        container_position=x[-1].copy(),
        container_velocity=v[-1].copy(),
    )


def _events(rows: list[tuple[float, int, int, float]]) -> Events:
    """Columns of rows."""
    time, i, j, impulse = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return Events(time.copy(), i.astype(np.int32), j.astype(np.int32), impulse.copy())


def deepest_overlap(scene: Scene, positions: Floats, container_positions: Floats) -> float:
    """The deepest overlap of any two bodies in some states, m.

    positions, container_positions : (*k*, *N*, 2) and (*k*, 2), m
    """
    i, j = np.triu_indices(scene.number, 1)
    contact = scene.radii[i] + scene.radii[j]
    deepest = 0.0
    for places, centre in zip(positions, container_positions, strict=True):
        pairs = contact - np.sqrt(np.sum((places[i] - places[j]) ** 2, axis=1))
        walls = -scene.container.wall_gaps(places - centre, scene.radii)
        deepest = max(deepest, float(np.max(pairs, initial=0.0)), float(np.max(walls)))
    return deepest
