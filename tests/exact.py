"""The exact twin beside the engine: the events of a scene, and what chaos lets the engine follow.

Collisions make rounding errors grow. By how much is measured on the scene itself: noisy twins err
in each collision, by ``SHIFT`` of places and velocities. What that makes of an event's time, of the
places of its balls and of its impulse, times the engine's roundings over ``SHIFT``, is the event's
tolerance. Where that of the time reaches ``ORDERED`` of the mean time between events, rounding may
begin to decide who collides first, and the comparison ends.
"""

from __future__ import annotations

import math
import random
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine import simulate
from snooker_cli.engine.simulation import Simulation
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import StopReason
from snooker_cli.validation.exact_twin import (
    Collision,
    Interval,
    Twin,
    UndecidedError,
    follow,
)
from snooker_cli.validation.proof import errors, own_events

SHIFT, BITS = 1e-100, 2048
"""The relative errors of a noisy twin, and a precision in which they grow linearly to the end."""

NOISY_TWINS = 3

ROUNDINGS = 8
"""An event rounds the quadratic's coefficients and root, a clock, a place and a velocity: eight
times half of epsilon, and twice that for unlucky signs. The exact course has none."""

ORDERED = 1e-3
"""Of a thousand events next to each other, rounding may then change the order of one pair."""


def exact_events(scene: Scene, count: int, until: float = math.inf) -> list[Collision]:
    """The exact first collisions, fewer if no more happen, or none until a time (s)."""
    return [collision for _, collision in islice(follow(scene, until), count)]


class NoisyTwin(Twin):
    """Errs at random at the start and in each collision, by ``SHIFT`` of distances and speeds."""

    def __init__(self, scene: Scene, seed: int) -> None:
        self.dice = random.Random(seed)
        super().__init__(scene, BITS)
        for ball in self.balls:
            ball.place += self.error(self.half_sides[0] + abs(ball.place))

    def collide(self, i: int, j: int) -> tuple[Interval, Interval, Interval]:
        """Displace both bodies before they collide; a container that is fixed stays."""
        for body in (self.balls[i], self.bodies[j]):
            if body is not self.container or self.scene.free:
                speed = abs(body.velocity.real) + abs(body.velocity.imag)
                # The container's size, and speed times time: clocks are rounded too.
                way = self.half_sides[0] + speed * self.now
                push = self.error(speed)
                body.velocity += push
                body.place += self.error(way) - push * (self.now - body.since)
        return super().collide(i, j)

    def error(self, whole: Interval) -> Interval:
        """A random vector in proportion to what it is an error of."""
        across, along = (self.dice.gauss(0, 1) for _ in range(2))
        return self.vector(across, along) * self.number(SHIFT) * whole.mid()


def deviation(exact: Twin, truth: Collision, noisy: Twin, other: Collision) -> NDArray[np.float64]:
    """Of a noisy twin's event in time, in the worst place of a ball, and in impulse: over SHIFT."""
    places = (
        abs(exact.nearest(mine.position(truth.time) - yours.position(other.time)))
        for mine, yours in zip(exact.balls, noisy.balls, strict=True)
    )
    time = abs(truth.time - other.time)
    impulse = abs(_push(exact, truth) - _push(exact, other))
    place = max(float(apart.mid() / SHIFT) for apart in places)
    return np.array([float(time.mid() / SHIFT), place, float(impulse.mid() / SHIFT)])


def _push(twin: Twin, collision: Collision) -> Interval:
    """The impulses of a collision along the line of centres and across it, kg m/s."""
    return twin.vector(collision.impulse, collision.tangential)


def compared(
    scene: Scene,
    count: int,
    until: float = math.inf,
    search: type[Simulation] | None = None,
) -> int:
    """Assert that the engine's first events are the exact ones; how many could be compared.

    count : as many are compared at most
    until : s; no events after that are asked for
    """
    trace = simulate(scene, collisions=count, time=until, search=search)
    own, exact = own_events(trace), Twin(scene, BITS)
    noisy = [NoisyTwin(scene, seed) for seed in range(NOISY_TWINS)]
    courses = [twin.collisions(until) for twin in noisy]
    size = max(scene.container.size) / 2 + float(np.max(abs(scene.positions)))
    grown, done = np.zeros(3), 0
    try:
        for truth in islice(exact.collisions(until), count):
            for twin, course in zip(noisy, courses, strict=True):
                grown = np.maximum(grown, deviation(exact, truth, twin, next(course)))
            itself = np.array([float(truth.time), size, float(abs(_push(exact, truth)))])
            # All roundings of the events before may err to one side.
            tolerance = ROUNDINGS * EPSILON * math.sqrt(done + 1) * (grown + abs(itself))
            if tolerance[0] > ORDERED * itself[0] / (done + 1):
                return done
            event = next(own, None)
            if event is None and trace.stop.reason in (StopReason.WALL_TRAP, StopReason.COLLAPSE):
                return done
            assert event is not None, f"no event {done + 1}: {truth.i}, {truth.j}"
            assert (event.i, event.j) == (truth.i, truth.j), f"event {done + 1}"
            found = errors(event, exact, truth)
            assert np.all(found <= tolerance), f"event {done + 1}: {found} over {tolerance}"
            done += 1
    except UndecidedError:
        return done
    assert next(own, None) is None
    return done
