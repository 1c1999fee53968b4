"""Boundaries: the edge of a container, a class for each shape, with all that balls do there.

Each method is the ``by_class`` function of its name, whose docstring says what it computes. That
function is what all boundaries have that lack the method. ``sliding`` has one more boundary.
"""

import math
from typing import NamedTuple

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.collision import (
    bounce_sums,
    change_at_circle,
    hit_circle,
    hit_side,
    shares,
)
from snooker_cli.engine.contact import NEVER, chord_delay, side_delay, wall_delay
from snooker_cli.engine.kernel_state import CLOCK, Floats, State, U, V, X, Y
from snooker_cli.engine.prediction import delay_to_next_hit


class FixedCircle(NamedTuple):
    """A circular wall that does not move; its radius, m."""

    radius: float

    def delay_to_wall(self, i: int, now: float, left_wall: bool, state: State) -> float:
        balls = state.balls
        u, v = balls[U, i], balls[V, i]
        if left_wall:
            return delay_to_next_hit(self, i, state) - float(now - balls[CLOCK, i])
        x, y = ks.position(i, now, balls)
        reach = self.radius - ks.radius_of(state.sizes, i)
        return wall_delay(x, y, u, v, reach * reach)

    def delay_to_next_hit(self, i: int, state: State) -> float:
        balls = state.balls
        return chord_delay(balls[X, i], balls[Y, i], balls[U, i], balls[V, i])

    def hit_wall(self, i: int, _now: float, state: State, elastic: bool) -> float:
        return hit_circle(state.setup.wall_law, i, state, elastic)


class FreeCircle(NamedTuple):
    """A circular wall that moves when a ball hits it: its radius (m), mass (kg) and motion.

    search_factor : how many times as far contacts are searched as in a fixed circle: other balls
        may push the wall away
    motion : (BALL_ROWS,), as a column of ``State.balls``
    """

    radius: float
    mass: float
    search_factor: float
    motion: Floats

    def of_repeat(self, repeat: int) -> "FreeCircle":
        return FreeCircle(self.radius, self.mass, self.search_factor, self.motion[repeat])

    def set_back(self, shift: float) -> None:
        self.motion[CLOCK] -= shift

    def container_flight(self, now: float) -> tuple[float, float, float, float]:
        motion = self.motion
        age = now - motion[CLOCK]
        x, y = motion[X] + motion[U] * age, motion[Y] + motion[V] * age
        return x, y, motion[U], motion[V]

    def energy(self) -> float:
        motion = self.motion
        return float(0.5 * self.mass * (motion[U] * motion[U] + motion[V] * motion[V]))

    def relative(
        self, x: float, y: float, u: float, v: float, now: float
    ) -> tuple[float, float, float, float]:
        motion = self.motion
        age = now - motion[CLOCK]
        x, y = x - (motion[X] + motion[U] * age), y - (motion[Y] + motion[V] * age)
        return x, y, u - motion[U], v - motion[V]

    def delay_to_wall(self, i: int, now: float, left_wall: bool, state: State) -> float:
        balls = state.balls
        u, v = balls[U, i], balls[V, i]
        if left_wall and self.motion[CLOCK] == balls[CLOCK, i]:  # no ball has hit it since
            return delay_to_next_hit(self, i, state) - float(now - balls[CLOCK, i])
        x, y = ks.position(i, now, balls)
        x, y, u, v = ks.relative(self, x, y, u, v, now)
        reach = self.radius - ks.radius_of(state.sizes, i)
        return wall_delay(x, y, u, v, reach * reach)

    def delay_to_next_hit(self, i: int, state: State) -> float:
        balls = state.balls
        x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
        x, y, u, v = ks.relative(self, x, y, u, v, balls[CLOCK, i])
        return chord_delay(x, y, u, v)

    def hit_wall(self, i: int, now: float, state: State, elastic: bool) -> float:
        balls, motion = state.balls, self.motion
        age = now - motion[CLOCK]
        motion[X] += motion[U] * age
        motion[Y] += motion[V] * age
        motion[CLOCK] = now
        x, y, u, v = ks.relative(self, balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now)
        m, change = ks.mass_of(state.sizes, i), change_at_circle(x, y, u, v, state.setup, elastic)
        first, second = shares(change, m, self.mass)
        motion[U] += second * x
        motion[V] += second * y
        balls[U, i] -= first * x
        balls[V, i] -= first * y
        return abs(m * first * math.sqrt(x * x + y * y))

    def search_time(self, delay: float) -> float:
        return delay * self.search_factor

    def searched_until(self, time: float, _early: bool) -> float:
        return time

    def predict_walls(self, now: float, state: State, times: Floats) -> None:
        balls, motion = state.balls, self.motion  # whose clock is at now
        xc, yc, uc, vc = motion[X], motion[Y], motion[U], motion[V]
        for k in range(balls.shape[1]):
            x, y = ks.position(k, now, balls)
            reach = self.radius - ks.radius_of(state.sizes, k)
            delay = wall_delay(x - xc, y - yc, balls[U, k] - uc, balls[V, k] - vc, reach * reach)
            time = now + delay
            times[ks.WALL_TIME, k] = time
            times[ks.NEXT_TIME, k] = min(time, times[ks.PAIR_TIME, k])

    def pushed_speed(self, i: int, inward: float, state: State) -> float:
        m, (_, changes) = ks.mass_of(state.sizes, i), bounce_sums(state.setup.wall_law, inward, 1.0)
        u, v = self.motion[U], self.motion[V]
        pushes = changes * (inward * (m / (m + self.mass)))
        return float(pushes + math.sqrt(u * u + v * v))

    def bouncing_mass(self, mass: float) -> float:
        return mass / (1.0 + mass / self.mass)

    def wall_comes_near(self, k: int, x: float, y: float, way: float, state: State) -> bool:
        x, y = x - self.motion[X], y - self.motion[Y]
        gap = self.radius - ks.radius_of(state.sizes, k) - math.sqrt(x * x + y * y)
        return bool(gap <= way)


class StraightWalls(NamedTuple):
    """The four sides of a fixed box: half of its width and height, m."""

    half_width: float
    half_height: float

    def delay_to_wall(self, i: int, now: float, _left_wall: bool, state: State) -> float:
        x, y = ks.position(i, now, state.balls)
        r = ks.radius_of(state.sizes, i)
        u, v = state.balls[U, i], state.balls[V, i]
        return side_delay(x, y, u, v, self.half_width - r, self.half_height - r)

    def hit_wall(self, i: int, _now: float, state: State, elastic: bool) -> float:
        balls, r = state.balls, ks.radius_of(state.sizes, i)
        x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
        across = self.half_width - r - (x if u > 0.0 else -x) if u != 0.0 else NEVER
        along = self.half_height - r - (y if v > 0.0 else -y) if v != 0.0 else NEVER
        # The nearest side ahead.
        return hit_side(state.setup.wall_law, i, bool(across <= along), state, elastic)


class ChannelSides(NamedTuple):
    """Fixed walls left and right; balls that leave above enter below. Half the width, height, m."""

    half_width: float
    height: float

    def delay_to_wall(self, i: int, now: float, _left_wall: bool, state: State) -> float:
        x, _ = ks.position(i, now, state.balls)
        u, reach = state.balls[U, i], self.half_width - ks.radius_of(state.sizes, i)
        delay = ((reach if u > 0.0 else -reach) - x) / u
        return max(delay, 0.0) if u != 0.0 else NEVER

    def hit_wall(self, i: int, _now: float, state: State, elastic: bool) -> float:
        return hit_side(state.setup.wall_law, i, True, state, elastic)

    def nearest_image(self, x: float, y: float) -> tuple[float, float]:
        return x, y - self.height * np.rint(y / self.height)

    def same_image(self, _x: float, y: float, _new_x: float, new_y: float) -> bool:
        return bool(np.rint(y / self.height) == np.rint(new_y / self.height))

    def wrapped(self, column: int, row: int, _columns: int, rows: int) -> tuple[int, int]:
        row += rows if row < 0 else 0
        row -= rows if row >= rows else 0
        return column, row


class PeriodicSides(NamedTuple):
    """No walls: a ball that leaves on one side enters on the other; width and height, m."""

    width: float
    height: float

    def nearest_image(self, x: float, y: float) -> tuple[float, float]:
        return x - self.width * np.rint(x / self.width), y - self.height * np.rint(y / self.height)

    def same_image(self, x: float, y: float, new_x: float, new_y: float) -> bool:
        across = np.rint(x / self.width) == np.rint(new_x / self.width)
        return bool(across and np.rint(y / self.height) == np.rint(new_y / self.height))

    def wrapped(self, column: int, row: int, columns: int, rows: int) -> tuple[int, int]:
        column += columns if column < 0 else 0
        column -= columns if column >= columns else 0
        row += rows if row < 0 else 0
        row -= rows if row >= rows else 0
        return column, row
