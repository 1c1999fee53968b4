"""Methods to simulate a scene: this engine, the source report's algorithm, time stepping."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli.containers import Circle
from snooker_cli.engine import States, replay, simulate
from snooker_cli.engine.jit import kernel
from snooker_cli.formatting import short
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, Events

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]

TOLERANCE = 1e-6
"""The source report: "If the computed time to collision is less than 10⁻⁶ seconds, it is considered
zero"; and zero is not a "positive solution" that can be selected."""

SKIN = 0.2
"""Time stepping lists pairs that are nearer than this to contact, in mean distances of balls."""

ROOM = 8192
"""Events after which the kernel of time stepping returns."""

PAIRS_AT_ONCE = 1_000_000
"""Pairs of balls, times states, whose distances are held in memory at once."""


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
    stepping = (
        Method(f"time steps of {short(step)} s", step, partial(by_steps, step=step))
        for step in steps
    )
    return (
        Method("snooker", None, by_engine),
        Method("the source report's algorithm", None, by_source_report),
        *stepping,
    )


# Comparison of trajectories


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


def deepest_overlap(scene: Scene, states: States, flights: Floats | None = None) -> float:
    """The deepest overlap of two balls, m, at the states and during free flight from them.

    flights : (*t*,) s, the time of free flight after each state; none by default
    """
    flights = np.zeros(len(states.time)) if flights is None else flights
    i, j = np.triu_indices(scene.number, 1)
    contact = scene.radii[i] + scene.radii[j]
    deepest = 0.0
    at_once = max(1, PAIRS_AT_ONCE // max(1, len(i)))
    for first in range(0, len(flights), at_once):
        rows = slice(first, first + at_once)
        offset = states.positions[rows][:, i] - states.positions[rows][:, j]
        offset = scene.container.nearest_image(offset)
        velocity = states.velocities[rows][:, i] - states.velocities[rows][:, j]
        speed_squares = np.sum(velocity * velocity, axis=2)
        nearest = -np.sum(offset * velocity, axis=2) / np.where(speed_squares > 0, speed_squares, 1)
        offset += velocity * np.clip(nearest, 0.0, flights[rows, None])[..., None]
        distance = np.sqrt(np.sum(offset * offset, axis=2))
        deepest = max(deepest, float(np.max(contact - distance, initial=0.0)))
    return deepest


def farthest_escape(scene: Scene, states: States) -> float:
    """How far a ball sticks out of the wall, m, at the states; in free flight it is inside."""
    places = states.positions - states.container_positions[:, None]
    return float(np.max(-scene.container.wall_gaps(places, scene.radii), initial=0.0))


# The methods


def by_engine(scene: Scene, moments: Floats) -> Trajectory:
    """Simulate with this project's engine."""
    clock = time.process_time()
    trace = simulate(scene, time=float(moments[-1]))
    seconds = time.process_time() - clock
    assert trace.events is not None
    positions = replay(trace, moments).positions
    at_events = replay(trace, trace.events.time)
    overlap = _overlap(scene, at_events)
    return Trajectory(scene, trace.events, positions, trace.finish, overlap, seconds)


def _overlap(scene: Scene, states: States) -> float:
    """The deepest overlap of any two bodies, m."""
    return max(deepest_overlap(scene, states), farthest_escape(scene, states))


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
    contact = radii[second] + np.where(walls, -1.0, 1.0) * radii[first]
    now, recorded = 0.0, 0
    positions = np.empty((len(moments), number, 2))
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
            positions[recorded] = (x + v * (moments[recorded] - now))[:number]
            recorded += 1
        if recorded == len(moments):
            break
        now += float(delay[k])
        x = x + v * delay[k]
        i, j = int(first[k]), int(second[k])
        restitution = scene.wall_restitution if walls[k] else scene.restitution
        impulse = _collide(x, v, masses, i, j, restitution)
        rows.append((now, i, CONTAINER if walls[k] else j, impulse))
        history.append(x)
    x = x + v * (float(moments[-1]) - now)
    seconds = time.process_time() - clock
    places = np.array(history).reshape(-1, number + 1, 2)
    still = np.zeros_like(places)
    at_events = States(
        np.zeros(len(places)), places[:, :-1], still[:, :-1], places[:, -1], still[:, -1]
    )
    return Trajectory(
        start=scene,
        events=events_from_rows(rows),
        positions=positions,
        finish=_moved(scene, x, v),
        overlap=_overlap(scene, at_events),
        seconds=seconds,
    )


def _collide(x: Floats, v: Floats, masses: Floats, i: int, j: int, restitution: float) -> float:
    """The source report's equations (3) to (5); the size of the impulse."""
    normal = (x[i] - x[j]) / np.sqrt(np.sum((x[i] - x[j]) ** 2))
    v1, v2 = np.dot(v[i], normal), np.dot(v[j], normal)
    tangential1, tangential2 = v[i] - v1 * normal, v[j] - v2 * normal
    # m2/(m1 + m2) and m1/(m1 + m2), also for an infinite m2
    share1, share2 = 1 / (1 + masses[i] / masses[j]), 1 / (1 + masses[j] / masses[i])
    change = share1 * (1 + restitution) * (v2 - v1)
    v[i] = (v1 + change) * normal + tangential1
    v[j] = (v2 + share2 * (1 + restitution) * (v1 - v2)) * normal + tangential2
    return abs(float(masses[i] * change))


def by_steps(scene: Scene, moments: Floats, step: float) -> Trajectory:
    """Simulate with time steps (s): bodies that overlap and approach exchange an impulse."""
    clock = time.process_time()
    events, states, overlap = stepped(scene, step, moments)
    seconds = time.process_time() - clock
    positions = np.ascontiguousarray(np.moveaxis(states[:, 0:2, :-1], 1, 2))
    finish = _moved(scene, states[-1, 0:2].T, states[-1, 2:4].T)
    return Trajectory(scene, events, positions, finish, overlap, seconds)


def _moved(scene: Scene, x: Floats, v: Floats) -> Scene:
    """The scene with other positions and velocities, the container's last."""
    return replace(
        scene,
        positions=x[:-1].copy(),
        velocities=v[:-1].copy(),
        container_position=x[-1].copy(),
        container_velocity=v[-1].copy(),
    )


# Time stepping with impulses, as in games and in codes for granular matter, compiled

# Rows of the table of bodies; the container is its last column.
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
    bodies = _bodies(scene)
    states = np.empty((len(moments), *bodies.shape))
    memory = np.zeros(4)
    # A pair, or a ball at the wall, collides at most once in a step.
    most_pairs = scene.number * (scene.number + 1) // 2
    pairs = np.empty((most_pairs, 2), dtype=np.int32)
    skin = SKIN * math.sqrt(scene.container.area / scene.number)
    restitutions = scene.restitution, scene.wall_restitution
    chunks = []
    while memory[MOMENTS] < len(moments):
        events = np.empty((ROOM + most_pairs, 4))
        used = _advance(
            bodies, *restitutions, step, skin, moments, states, pairs, events, ROOM, memory
        )
        chunks.append(events[:used])
    return events_from_rows(np.concatenate(chunks)), states, float(memory[OVERLAP])


def _bodies(scene: Scene) -> Floats:
    """The table of bodies."""
    assert isinstance(scene.container, Circle)
    balls = np.vstack([scene.positions.T, scene.velocities.T, scene.radii, scene.masses])
    container = (
        *scene.container_position,
        *scene.container_velocity,
        scene.container.radius,
        scene.container_mass,
    )
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
    """Simulate until the last moment or for ``room`` events; the number of events."""
    number = bodies.shape[1] - 1
    listed, slack, used = 0, -1.0, 0
    while used < room:
        now = memory[STEPS] * step
        while moments[int(memory[MOMENTS])] < now + step:
            moment = int(memory[MOMENTS])
            # Element by element: numba takes seconds to compile whole rows.
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
