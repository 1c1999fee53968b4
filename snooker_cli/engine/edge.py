"""The edge of a container: what boundaries do, and what those without walls do.

The classes of ``boundaries`` and ``sliding`` have those methods in which they differ.
"""

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.frames import Frame
from snooker_cli.engine.jit import called_by_kernels
from snooker_cli.engine.kernel_state import Floats, Part, State, U, V
from snooker_cli.engine.prediction import candidates_from, next_hit, padded_square


@called_by_kernels
class Edge(Part):
    """A boundary. It has no walls, no images and no motion, unless a method says otherwise."""

    # A free container

    def reference_velocity(self, j: int, balls: Floats) -> tuple[float, float]:
        """The velocity of ball j, which has had an event, or of a free container, m/s.

        It is zero after an event at a fixed wall.
        """
        return (balls[U, j], balls[V, j]) if j >= 0 else (0.0, 0.0)

    def leave_frame(self, u: float, v: float, now: float) -> None:
        """Take a velocity, which a frame takes over now, off a free container."""

    def container_flight(self, now: float, frame: Frame) -> tuple[float, float, float, float]:
        """Place (m) and velocity (m/s) of a free container in the laboratory, else zeros."""
        return 0.0, 0.0, 0.0, 0.0

    def is_far(self, i: int, now: float, state: State) -> bool:
        """Whether a free container, or ball i, which slides, has gone ``FARTHEST`` radii by now."""
        return False

    def relative(
        self, x: float, y: float, u: float, v: float, now: float
    ) -> tuple[float, float, float, float]:
        """A place (m) and a velocity (m/s) relative to the container's centre at a time, s."""
        return x, y, u, v

    def energy(self, state: State) -> float:
        """Kinetic energy of a free container, J."""
        return 0.0

    # Images

    def nearest_image(self, x: float, y: float) -> tuple[float, float]:
        """The offset (x, y) to the nearest of a ball's images, m; without images, to itself."""
        return x, y

    def image_nearest_at(
        self, x: float, y: float, way_x: float, way_y: float
    ) -> tuple[float, float]:
        """The offset (x, y) now to that image which is the nearest after a way (m) of the ball."""
        return x, y

    def same_image(self, x: float, y: float, new_x: float, new_y: float) -> bool:
        """Whether two offsets of a ball have the same image of it as the nearest."""
        return True

    def wrapped(self, column: int, row: int, columns: int, rows: int) -> tuple[int, int]:
        """The column and the row, of those that there are, in a periodic box beyond its sides."""
        return column, row

    # Where balls are

    def place(self, i: int, now: float, balls: Floats) -> tuple[float, float]:
        """Where ball i is at a time, m: on a straight way, unless it slides."""
        return ks.position(i, now, balls)

    def flight(self, i: int, now: float, state: State) -> tuple[float, float, float, float]:
        """Place (m) and velocity (m/s) of ball i at a time, s; straight on, unless it slides."""
        balls = state.balls
        x, y = ks.position(i, now, balls)
        return x, y, balls[U, i], balls[V, i]

    # When a ball hits the wall, and whether it meets others before

    def time_at_wall(self, i: int, state: State) -> float:
        """When ball i hits the wall next, s; inf if never.

        After a hit, the next one is at the end of a chord: the ball is exactly at the wall.
        """
        return NEVER

    def time_of_next_hit(self, i: int, state: State) -> float:
        """When ball i next does something at the wall, s: it hits it, or begins to slide."""
        return next_hit(i, state)

    def filter_time(self, now: float, later: float) -> float:
        """The clock, s, at which a filter looks at two balls, the later of whose clocks is given.

        It is that of ``contact_time``, unless ways are so short that a filter may look at both now,
        which is faster; see ``filter_square``.
        """
        return later

    def filter_square(self, distance: float) -> float:
        """Square of a contact distance, m, and more than rounding adds to it at ``filter_time``.

        At the clock of ``contact_time`` itself, places are the same numbers.
        """
        return padded_square(distance, 0.0)

    def candidates(
        self, i: int, now: float, until: float, state: State, start: int, stop: int
    ) -> int:
        """The balls from ``start`` to ``stop`` that may touch ball i up to a time, a bit each.

        The bit of ball i itself, which overlaps itself, is set.
        """
        return candidates_from(False, i, now, until, state, start, stop)

    def search_until(self, i: int, now: float, wall_time: float, state: State) -> float:
        """Until when to search contacts of ball i, which hits the wall at a time, s."""
        return wall_time

    def predict_walls(self, now: float, state: State, times: Floats) -> None:
        """Enter when each ball hits the wall, if that moves: its velocity has just changed."""

    # What a hit changes

    def hit_wall(self, i: int, now: float, state: State, elastic: bool) -> float:
        """Collide ball i, at the present, with the wall; the impulse (1 + e) mu |v_n|, kg m/s.

        mu is the reduced mass of the ball and a free container, or the ball's mass if it is fixed.
        """
        return 0.0

    # Infinitely many hits

    def bouncing_mass(self, mass: float) -> float:
        """The mass (kg) of a ball that bounces at the wall; at a free one the reduced mass."""
        return mass

    def pushed_speed(self, i: int, inward: float, state: State) -> float:
        """Largest speed (m/s) of a wall that ball i hits infinitely often; zero if it is fixed.

        Its bounces push a free container together by no more than its share of ``bounce_sums``.

        inward : v_n of the ball after its last hit, m/s
        """
        return 0.0

    def wall_comes_near(self, k: int, x: float, y: float, way: float, state: State) -> bool:
        """Whether a wall may reach ball k at (x, y) if the two come nearer by a way, m."""
        return False

    # Balls that slide, see ``sliding``

    def is_curved(self) -> bool:
        """Whether balls may slide along the wall on curved ways, see ``sliding``."""
        return False

    def carry_out_slide(self, i: int, j: int, now: float, state: State) -> tuple[int, bool, float]:
        """The ball that slides up to now, whether it begins now, and its impulse, kg m/s.

        It is ball i or j; NO_PARTNER if neither slides. Then they collide.
        """
        return ks.NO_PARTNER, False, 0.0

    def slide(self, i: int, now: float, state: State) -> float:
        """Bring ball i to where it slides now, or begins to; its impulse on the way, kg m/s."""
        return 0.0

    def settle(self, i: int, trapped: bool, now: float, state: State) -> bool:
        """Let ball i, which has just hit the wall, slide from some time on, if it can.

        trapped : whether it will hit the wall infinitely often before all else

        The answer is whether the repeat ends: only if it is trapped and cannot slide.
        """
        return trapped

    def take_off_wall(self, i: int) -> None:
        """Ball i, which may have slid up to its collision, slides no longer."""

    def without_curved(self, mask: int, start: int, stop: int, i: int) -> int:
        """The mask of balls from ``start`` to ``stop`` without those that i meets on an arc."""
        return mask

    def earliest_on_arc(
        self, i: int, now: float, time: float, partner: int, state: State, wall_times: Floats
    ) -> tuple[float, int]:
        """When ball i first touches another, and which, if one slides, and before a time, s."""
        return time, partner

    def pressing(self, now: float, state: State) -> float:
        """Impulse on the wall of all balls that slide, each since its clock, kg m/s."""
        return 0.0

    def bounce_on(self, time: float, state: State) -> None:
        """Bring balls that bounce until they slide to a time, s; add their impulse on the wall."""

    def bounce_back(self, state: State) -> None:
        """Bring these balls back to where ``bounce_on`` found them."""
