"""Boundaries: the edge of a container, a class for each shape, with all that balls do there.

``edge.Edge`` says what each method computes. ``sliding`` has one more boundary.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from snooker_cli.containers import Container
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import earlier, enter_lanes
from snooker_cli.engine.collision import change_at_circle, hit_circle, hit_side, shares
from snooker_cli.engine.contact import NEVER, chord_delay, side_delay, wall_delay
from snooker_cli.engine.edge import Edge
from snooker_cli.engine.frames import FARTHEST, Frame, laboratory_velocity, leave_behind
from snooker_cli.engine.jit import inlined
from snooker_cli.engine.kernel_state import (
    CLOCK,
    LANE_TIME,
    NEXT_TIME,
    PAIR_TIME,
    WALL_TIME,
    Floats,
    State,
    U,
    V,
    X,
    Y,
)
from snooker_cli.engine.prediction import candidates_from, padded_square
from snooker_cli.engine.restitution import WALL, bounce_sums
from snooker_cli.errors import SceneError

LAST_HIT = ks.BALL_ROWS
"""The element of ``FreeCircle.motion`` with the scene's number of the ball that last hit it."""


@inlined
def image_delay(row: int, length: float, i: int, state: State) -> float:
    """How long only the nearest image of any other ball can touch ball i, at least; s.

    row : U or V: the axis, along which images are a length (m) apart

    Any other image is half of the length or more away. The margin is for rounding.
    """
    balls, fastest, largest = state.balls, 0.0, 0.0
    for k in range(balls.shape[1]):
        fastest = max(fastest, abs(balls[row, k]))
        largest = max(largest, state.sizes.radius_of(k))
    speed = abs(balls[row, i]) + fastest
    way = 0.5 * length - (state.sizes.radius_of(i) + largest)
    return way * (1.0 - 2.0**-30) / speed if speed > 0.0 else NEVER


class FixedCircle(Edge, NamedTuple("FixedCircle", [("radius", float)])):
    """A circular wall that does not move; its radius, m."""

    def filter_time(self, now: float, _later: float) -> float:
        return now

    def filter_square(self, distance: float) -> float:
        return padded_square(distance, self.radius)

    def time_at_wall(self, i: int, state: State) -> float:
        balls = state.balls
        x, y, u, v, clock = balls[X, i], balls[Y, i], balls[U, i], balls[V, i], balls[CLOCK, i]
        if ks.hits_in_a_row(i, state) > 0:
            return float(clock + chord_delay(x, y, u, v))
        reach = self.radius - state.sizes.radius_of(i)
        return float(clock + wall_delay(x, y, u, v, reach * reach))

    def hit_wall(self, i: int, _now: float, state: State, elastic: bool) -> float:
        return hit_circle(i, state, elastic)


class FreeCircle(
    Edge,
    NamedTuple(
        "FreeCircle",
        [("radius", float), ("mass", float), ("search_factor", float), ("motion", Floats)],
    ),
):
    """A circular wall that moves when a ball hits it: its radius (m), mass (kg) and motion.

    search_factor : how many times as far contacts are searched as in a fixed circle: other balls
        may push the wall away
    motion : (LAST_HIT + 1,), as a column of ``State.balls``, and the ball of the last hit
    """

    def of_repeat(self, repeat: int) -> "FreeCircle":
        return FreeCircle(self.radius, self.mass, self.search_factor, self.motion[repeat])

    def set_back(self, shift: float) -> None:
        self.motion[CLOCK] -= shift

    def container_flight(self, now: float, frame: Frame) -> tuple[float, float, float, float]:
        motion = self.motion
        age = now - motion[CLOCK]
        x, y = motion[X] + motion[U] * age, motion[Y] + motion[V] * age
        return frame.in_laboratory(self, x, y, motion[U], motion[V], now)

    def reference_velocity(self, _j: int, _balls: Floats) -> tuple[float, float]:
        return self.motion[U], self.motion[V]

    def leave_frame(self, u: float, v: float, now: float) -> None:
        leave_behind(self.motion, u, v, now)

    def is_far(self, _i: int, now: float, state: State) -> bool:
        x, y, _, _ = self.container_flight(now, state.frame)
        return bool(max(abs(x), abs(y)) > FARTHEST * self.radius)

    def energy(self, state: State) -> float:
        u, v = laboratory_velocity(self.motion[U], self.motion[V], state)
        return float(0.5 * self.mass * (u * u + v * v))

    def relative(
        self, x: float, y: float, u: float, v: float, now: float
    ) -> tuple[float, float, float, float]:
        motion = self.motion
        age = now - motion[CLOCK]
        x, y = x - (motion[X] + motion[U] * age), y - (motion[Y] + motion[V] * age)
        return x, y, u - motion[U], v - motion[V]

    def time_at_wall(self, i: int, state: State) -> float:
        balls, motion = state.balls, self.motion
        ball, wall = balls[CLOCK, i], motion[CLOCK]
        now = ball if ball > wall else wall
        x, y = ks.position(i, now, balls)
        x, y, u, v = self.relative(x, y, balls[U, i], balls[V, i], now)
        if ks.hits_in_a_row(i, state) > 0 and motion[LAST_HIT] == ks.label_of(i, state.labels):
            return float(now + chord_delay(x, y, u, v))
        reach = self.radius - state.sizes.radius_of(i)
        return float(now + wall_delay(x, y, u, v, reach * reach))

    def hit_wall(self, i: int, now: float, state: State, elastic: bool) -> float:
        balls, motion = state.balls, self.motion
        age = now - motion[CLOCK]
        motion[X] += motion[U] * age
        motion[Y] += motion[V] * age
        motion[CLOCK], motion[LAST_HIT] = now, ks.label_of(i, state.labels)
        x, y, u, v = self.relative(balls[X, i], balls[Y, i], balls[U, i], balls[V, i], now)
        m, change = state.sizes.mass_of(i), change_at_circle(x, y, u, v, state.setup, elastic)
        first, second = shares(change, m, self.mass)
        motion[U] += second * x
        motion[V] += second * y
        balls[U, i] -= first * x
        balls[V, i] -= first * y
        impulse = abs(m * first * math.sqrt(x * x + y * y))
        state.surface.rub_free_wall(i, x, y, u, v, impulse, state, self.mass, motion)
        return impulse

    def search_until(self, _i: int, now: float, wall_time: float, _state: State) -> float:
        return now + (wall_time - now) * self.search_factor

    def candidates(
        self, i: int, now: float, until: float, state: State, start: int, stop: int
    ) -> int:
        # Two loops: that after an event of ball i is shorter.
        if state.balls[CLOCK, i] == now:
            return candidates_from(True, i, now, until, state, start, stop)
        return candidates_from(False, i, now, until, state, start, stop)

    def predict_walls(self, now: float, state: State, times: Floats) -> None:
        # The loop of ``time_at_wall``, in vector registers.
        balls, motion = state.balls, self.motion  # whose clock is at now
        xc, yc, uc, vc = motion[X], motion[Y], motion[U], motion[V]
        for k in range(balls.shape[1]):
            x, y = ks.position(k, now, balls)
            reach = self.radius - state.sizes.radius_of(k)
            delay = wall_delay(x - xc, y - yc, balls[U, k] - uc, balls[V, k] - vc, reach * reach)
            time = now + delay
            times[WALL_TIME, k] = time
            times[NEXT_TIME, k] = earlier(time, times[PAIR_TIME, k])
        enter_lanes(times[NEXT_TIME], times[LANE_TIME])

    def pushed_speed(self, i: int, inward: float, state: State) -> float:
        m, (_, changes) = (
            state.sizes.mass_of(i),
            bounce_sums(state.setup.laws[WALL], inward, 1.0),
        )
        u, v = self.motion[U], self.motion[V]
        pushes = changes * (inward * (m / (m + self.mass)))
        return float(pushes + math.sqrt(u * u + v * v))

    def bouncing_mass(self, mass: float) -> float:
        return mass / (1.0 + mass / self.mass)

    def wall_comes_near(self, k: int, x: float, y: float, way: float, state: State) -> bool:
        x, y = x - self.motion[X], y - self.motion[Y]
        gap = self.radius - state.sizes.radius_of(k) - math.sqrt(x * x + y * y)
        return bool(gap <= way)


class StraightWalls(
    Edge, NamedTuple("StraightWalls", [("half_width", float), ("half_height", float)])
):
    """The four sides of a fixed box: half of its width and height, m."""

    def filter_time(self, now: float, _later: float) -> float:
        return now

    def filter_square(self, distance: float) -> float:
        return padded_square(distance, self.half_width + self.half_height)

    def time_at_wall(self, i: int, state: State) -> float:
        balls, r = state.balls, state.sizes.radius_of(i)
        x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
        delay = side_delay(x, y, u, v, self.half_width - r, self.half_height - r)
        return float(balls[CLOCK, i] + delay)

    def hit_wall(self, i: int, _now: float, state: State, elastic: bool) -> float:
        balls, r = state.balls, state.sizes.radius_of(i)
        x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
        across = self.half_width - r - (x if u > 0.0 else -x) if u != 0.0 else NEVER
        along = self.half_height - r - (y if v > 0.0 else -y) if v != 0.0 else NEVER
        # The nearest side ahead.
        return hit_side(i, bool(across <= along), state, elastic)


class ChannelSides(Edge, NamedTuple("ChannelSides", [("half_width", float), ("height", float)])):
    """Fixed walls left and right; balls that leave above enter below. Half the width, height, m."""

    def time_at_wall(self, i: int, state: State) -> float:
        x, u = state.balls[X, i], state.balls[U, i]
        reach = self.half_width - state.sizes.radius_of(i)
        delay = ((reach if u > 0.0 else -reach) - x) / u
        return float(state.balls[CLOCK, i] + max(delay, 0.0)) if u != 0.0 else NEVER

    def hit_wall(self, i: int, _now: float, state: State, elastic: bool) -> float:
        return hit_side(i, True, state, elastic)

    def nearest_image(self, x: float, y: float) -> tuple[float, float]:
        return x, y - self.height * np.rint(y / self.height)

    def image_nearest_at(
        self, x: float, y: float, _way_x: float, way_y: float
    ) -> tuple[float, float]:
        return x, y - self.height * np.rint((y + way_y) / self.height)

    def search_until(self, i: int, now: float, wall_time: float, state: State) -> float:
        return min(wall_time, now + image_delay(V, self.height, i, state))

    def same_image(self, _x: float, y: float, _new_x: float, new_y: float) -> bool:
        return bool(np.rint(y / self.height) == np.rint(new_y / self.height))

    def wrapped(self, column: int, row: int, _columns: int, rows: int) -> tuple[int, int]:
        row += rows if row < 0 else 0
        row -= rows if row >= rows else 0
        return column, row


class PeriodicSides(Edge, NamedTuple("PeriodicSides", [("width", float), ("height", float)])):
    """No walls: a ball that leaves on one side enters on the other; width and height, m."""

    def nearest_image(self, x: float, y: float) -> tuple[float, float]:
        return x - self.width * np.rint(x / self.width), y - self.height * np.rint(y / self.height)

    def image_nearest_at(
        self, x: float, y: float, way_x: float, way_y: float
    ) -> tuple[float, float]:
        x -= self.width * np.rint((x + way_x) / self.width)
        return x, y - self.height * np.rint((y + way_y) / self.height)

    def search_until(self, i: int, now: float, _wall_time: float, state: State) -> float:
        across, up = image_delay(U, self.width, i, state), image_delay(V, self.height, i, state)
        return now + min(across, up)

    def same_image(self, x: float, y: float, new_x: float, new_y: float) -> bool:
        across = np.rint(x / self.width) == np.rint(new_x / self.width)
        return bool(across and np.rint(y / self.height) == np.rint(new_y / self.height))

    def wrapped(self, column: int, row: int, columns: int, rows: int) -> tuple[int, int]:
        column += columns if column < 0 else 0
        column -= columns if column >= columns else 0
        row += rows if row < 0 else 0
        row -= rows if row >= rows else 0
        return column, row


# The boundary of a container


BOUNDARIES: dict[str, Callable[[float, float], Any]] = {
    "box": lambda width, height: StraightWalls(width / 2, height / 2),
    "channel": lambda width, height: ChannelSides(width / 2, height),
    "periodic": lambda width, height: PeriodicSides(width, height),
}
"""What makes the boundary of a shape that is no circle, by its word, from ``Container.size``, m."""


def fixed_boundary(container: Container) -> Any:
    """The boundary of a container that is no circle.

    Raises ``SceneError`` for a shape that is unknown here.
    """
    make = BOUNDARIES.get(container.name)
    if make is None:
        problem = f"the engine has no boundary for a {container.title}"
        advice = "set another shape, or add one to BOUNDARIES in engine/boundaries.py"
        raise SceneError("container.shape", f"{problem}; {advice}")
    return make(*map(float, container.size))
