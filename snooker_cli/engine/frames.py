"""The frame in which a repeat is computed: it takes over the velocity that all balls share.

A gas keeps its momentum in a periodic box, along a channel, and together with a free container.
(A rough wall of a channel does not stop a cold gas: friction is in proportion to how balls hit it.)
While a gas cools, velocities relative to this common one become as small as the rounding of the
velocities, and a ball flies through the box very often before it meets another. The motion is the
same in any frame (Galilean invariance). So when all velocities are near a common one, the frame
takes it over. The balls keep all digits of the rest, and the gas can cool on.

This follows from the state alone, after an event. So a replay does it after the same events.
"""

from typing import Any, NamedTuple

from snooker_cli.engine.jit import called_by_kernels, inlined
from snooker_cli.engine.kernel_state import CLOCK, Floats, Part, State, U, V, X, Y

NEAR = 2.0**-10
"""A frame takes over a common velocity if all others differ from it by less than this part."""

FARTHEST = 2.0**27
"""Radii of the container: places that are computed from such a way have half of their digits."""


@inlined
def leave_behind(body: Floats, u: float, v: float, now: float) -> None:
    """Take a velocity off a body, which stays where it is now.

    body : a column of ``State.balls``, or a free container's motion

    Its clock stays, so its place at that clock changes.
    """
    age = now - body[CLOCK]
    body[X] += u * age
    body[Y] += v * age
    body[U] -= u
    body[V] -= v


@called_by_kernels
class Frame(Part):
    """A frame of reference. It is the laboratory, unless a method says otherwise."""

    def renew_frame(self, i: int, j: int, impulse: float, now: float, state: State) -> bool:
        """After an event of balls i and j, take over what all balls share, if that is nearly all.

        impulse : of the event, kg m/s; few are small enough to look at all balls

        The answer is whether it was so. Then all predictions have to be made anew.
        """
        return False

    def in_laboratory(
        self, boundary: Any, x: float, y: float, u: float, v: float, now: float
    ) -> tuple[float, float, float, float]:
        """Place (m) and velocity (m/s) in the laboratory at a time (s), of those in the frame."""
        return x, y, u, v


class Laboratory(Frame, NamedTuple("Laboratory", [("motion", None)])):
    """The frame between walls on all sides, where balls share no velocity."""


class MovingFrame(
    Frame, NamedTuple("MovingFrame", [("motion", Floats), ("across", float), ("up", float)])
):
    """A frame, in scenes in which balls may share a velocity.

    motion : (BALL_ROWS,), as the column of a ball: its place and velocity in the laboratory
    across, up : 1 if balls may share a velocity along x and along y, else 0

    Stacked, ``motion`` has one axis more, the first.
    """

    def of_repeat(self, repeat: int) -> "MovingFrame":
        return MovingFrame(self.motion[repeat], self.across, self.up)

    def set_back(self, shift: float) -> None:
        self.motion[CLOCK] -= shift

    def renew_frame(self, i: int, j: int, impulse: float, now: float, state: State) -> bool:
        # A difference of doubles that are near each other is exact (Sterbenz). So velocities
        # relative to each other stay to the bit. Places are rounded once.
        boundary, balls = state.boundary, state.balls
        u, v = boundary.reference_velocity(j, balls)
        u, v = self.across * u, self.up * v
        least = NEAR * max(abs(u), abs(v))
        if impulse >= 2.0 * least * state.sizes.mass_of(i):
            return False
        for k in range(balls.shape[1]):
            if max(abs(balls[U, k] - u), abs(balls[V, k] - v)) >= least:
                return False
        for k in range(balls.shape[1]):
            leave_behind(balls[:, k], u, v, now)
            balls[X, k], balls[Y, k] = boundary.nearest_image(balls[X, k], balls[Y, k])
        boundary.leave_frame(u, v, now)
        leave_behind(self.motion, -u, -v, now)
        return True

    def in_laboratory(
        self, boundary: Any, x: float, y: float, u: float, v: float, now: float
    ) -> tuple[float, float, float, float]:
        motion = self.motion
        if motion[U] == 0.0 and motion[V] == 0.0:
            return x, y, u, v
        age = now - motion[CLOCK]
        far_x, far_y = motion[X] + motion[U] * age, motion[Y] + motion[V] * age
        # Inside a container that repeats, so that balls keep their distances. A gas may have
        # drifted so far that a box is less than the rounding of its place: then again.
        while True:
            own_x, own_y = boundary.nearest_image(far_x, far_y)
            if not (abs(own_x) < abs(far_x) or abs(own_y) < abs(far_y)):
                return x + own_x, y + own_y, u + motion[U], v + motion[V]
            far_x, far_y = own_x, own_y


@inlined
def laboratory_velocity(u: float, v: float, state: State) -> tuple[float, float]:
    """A velocity in the laboratory, m/s, of one in the frame."""
    _, _, u, v = state.frame.in_laboratory(state.boundary, 0.0, 0.0, u, v, 0.0)
    return u, v
