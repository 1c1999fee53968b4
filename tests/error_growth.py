"""What a small error made in every collision grows to: exactly, event by event.

A clumsy twin errs in each collision, in the places and velocities of both bodies, by so little
that, with the digits at hand, its errors stay infinitesimal to the end. So its deviation from the
exact twin, over the size of the errors, is their linear growth, with no chaos to cut it short; that
of a program with double precision is the same times its roundings.
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

CLUMSY_TWINS = 3


@dataclass(frozen=True)
class Growth:
    """Errors at each event for relative errors of 1 in every collision up to it.

    Those of places are relative to the way gone, those of velocities to the speed. The largest of
    some clumsy twins, who err at random; infinite from the event on in which other bodies collide,
    as where contacts are simultaneous.

    time, impulse, place : (*n*,) ``numpy.float64``, s, kg m/s, and m for the worst ball
    """

    time: NDArray[np.float64]
    impulse: NDArray[np.float64]
    place: NDArray[np.float64]


class ClumsyTwin(Twin):
    """Errs at random in each collision: by ``shift`` of the way gone, and of the speed."""

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
        """The way is the container's size and that on the clock, which is rounded as well."""
        speed = abs(body.u) + abs(body.v)
        way = self.half_sides[0] + speed * self.now
        body.turn(self.error(speed), self.error(speed), self.now)
        body.x += self.error(way)
        body.y += self.error(way)

    def error(self, whole: Number) -> Number:
        """A random error in proportion to what it is an error of."""
        return self.dice.gauss(0, 1) * self.shift * whole


def growth(scene: Scene, collisions: int, twins: int = CLUMSY_TWINS) -> Growth:
    """The growth of errors over a scene's first collisions, fewer if no more happen.

    Raises ``ValueError`` for a periodic box.
    """
    digits = math.ceil(SPARE_DIGITS + DIGITS_PER_EVENT * collisions)
    columns = [_deviation(scene, collisions, digits, seed) for seed in range(twins)]
    return Growth(*np.maximum.reduce(columns))


def _deviation(scene: Scene, collisions: int, digits: int, seed: int) -> NDArray[np.float64]:
    """One clumsy twin's deviation in time, impulse and place, over its errors; (3, *n*)."""
    exact = Twin(scene, 2 * digits)
    shift = exact.mathematics.mpf(10) ** -digits
    clumsy = ClumsyTwin(scene, 2 * digits, shift, seed)
    rows, alike = [], True
    for own in islice(exact.collisions(), collisions):
        other = next(clumsy.collisions(), None) if alike else None
        alike = other is not None and (other.i, other.j) == (own.i, own.j)
        if other is None or not alike:
            rows.append([math.inf] * 3)
            continue
        apart = max(
            abs(x - p) + abs(y - q)
            for (x, y), (p, q) in (
                (mine.place(own.time), yours.place(own.time))
                for mine, yours in zip(exact.balls, clumsy.balls, strict=True)
            )
        )
        errors = (abs(other.time - own.time), abs(other.impulse - own.impulse), apart)
        rows.append([float(error / shift) for error in errors])
    return np.array(rows).reshape(-1, 3).T
