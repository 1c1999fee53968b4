"""The linear growth of a small error in every collision: exactly, event by event.

A noisy twin errs in each collision, in positions and velocities of both bodies, by so little that
its errors stay infinitesimal to the end, with the digits at hand. Its deviation from the exact twin
over the size of the errors is their linear growth, which chaos does not limit. The errors of a
program with double precision are this growth times its roundings.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.trace import CONTAINER
from snooker_cli.validation.exact_twin import DIGITS_PER_EVENT, SPARE_DIGITS, Body, Number, Twin

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene

NOISY_TWINS = 3


@dataclass(frozen=True)
class Growth:
    """Errors at each event for relative errors of 1 in every collision up to it.

    Those of positions are relative to the distance covered, those of velocities to the speed. The
    largest of some noisy twins; infinite from the event in which other bodies collide, as where
    contacts are simultaneous.

    time, impulse, place : (*n*,) ``numpy.float64``, s, kg m/s, and m for the worst ball
    """

    time: NDArray[np.float64]
    impulse: NDArray[np.float64]
    place: NDArray[np.float64]


class NoisyTwin(Twin):
    """Errs at random in each collision: by ``shift`` of the distance covered and of the speed."""

    def __init__(self, scene: Scene, digits: int, shift: Number, seed: int) -> None:
        self.shift, self.dice = shift, random.Random(seed)
        super().__init__(scene, digits)

    def collide(self, i: int, j: int) -> Number:
        """Displace both bodies before they collide; a container that is fixed stays."""
        for body in (self.balls[i], self.container if j == CONTAINER else self.balls[j]):
            if body is not self.container or self.free:
                self.disturb(body)
        return super().collide(i, j)

    def disturb(self, body: Body) -> None:
        """The distance is the container's size plus speed times time: clocks are rounded too."""
        speed = abs(body.u) + abs(body.v)
        way = self.half_sides[0] + speed * self.now
        body.turn(self.error(speed), self.error(speed), self.now)
        body.x += self.error(way)
        body.y += self.error(way)

    def error(self, whole: Number) -> Number:
        """A random error in proportion to what it is an error of."""
        return self.dice.gauss(0, 1) * self.shift * whole


def growth(scene: Scene, collisions: int, twins: int = NOISY_TWINS) -> Growth:
    """The growth of errors over a scene's first collisions, fewer if no more happen.

    Raises ``ValueError`` for a periodic box.
    """
    digits = math.ceil(SPARE_DIGITS + DIGITS_PER_EVENT * collisions)
    columns = [_deviation(scene, collisions, digits, seed) for seed in range(twins)]
    return Growth(*np.maximum.reduce(columns))


def _deviation(scene: Scene, collisions: int, digits: int, seed: int) -> NDArray[np.float64]:
    """One noisy twin's deviation in time, impulse and place, over its errors; (3, *n*)."""
    exact = Twin(scene, 2 * digits)
    shift = exact.mathematics.mpf(10) ** -digits
    noisy = NoisyTwin(scene, 2 * digits, shift, seed)
    rows, alike = [], True
    for own in islice(exact.collisions(), collisions):
        other = next(noisy.collisions(), None) if alike else None
        alike = other is not None and (other.i, other.j) == (own.i, own.j)
        if other is None or not alike:
            rows.append([math.inf] * 3)
            continue
        apart = max(
            abs(x - p) + abs(y - q)
            for (x, y), (p, q) in (
                (mine.position(own.time), yours.position(own.time))
                for mine, yours in zip(exact.balls, noisy.balls, strict=True)
            )
        )
        errors = (abs(other.time - own.time), abs(other.impulse - own.impulse), apart)
        rows.append([float(error / shift) for error in errors])
    return np.array(rows).reshape(-1, 3).T
