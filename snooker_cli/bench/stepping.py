"""Time stepping with impulses, as games and codes for grains have it, compiled.

In each step all bodies move, and whoever then overlaps and approaches gets the impulse of a
collision, along the line of centres at that moment. Nobody is pushed apart: what has collided parts
by itself, and a push would only add to the error of the step. To be as fast as such codes are, only
pairs that are nearer than ``SKIN`` to contact are looked at, until they may have come that near.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.engine.jit import kernel
from snooker_cli.trace import CONTAINER, Events

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene

    Floats = NDArray[np.float64]
    Indices = NDArray[np.int32]

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
    skin = SKIN * math.sqrt(scene.area / scene.number)
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
    container = [
        *scene.container_position,
        *scene.container_velocity,
        scene.container_radius,
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
            impulse = _collide(
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
def _collide(
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
