"""Balls that slide along a fixed circular wall after infinitely many bounces.

docs/how-it-works.md explains it. Below, a is the distance of the ball's centre from that of the
circle, v_n and v_t are the normal and the tangential part of its velocity, e the wall's CoR.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine import prediction
from snooker_cli.engine.boundaries import FixedCircle
from snooker_cli.engine.clock import CLOCK_DIGITS
from snooker_cli.engine.contact import NEVER, chord_delay, wall_delay
from snooker_cli.engine.edge import Edge
from snooker_cli.engine.frames import FARTHEST
from snooker_cli.engine.jit import helper, inlined
from snooker_cli.engine.kernel_state import CLOCK, Floats, Integers, State, U, V, X, Y
from snooker_cli.engine.prediction import next_hit
from snooker_cli.engine.restitution import CONSTANT, COR, KIND, WALL, bounce_sums

# What a ball does: it flies; it flies from a place exactly at the wall, to which it has slid; it
# bounces until it slides; it slides.
FLIES, LEAVES, SETTLES, SLIDES = range(4)

BEYOND = 2.0**-36  # share of a square that rounding does not reach, see ``SlidingCircle.flight``

FLAT = 2.0**-27  # normal over tangential speed from which on its square does not count beside 1

NEARLY_ELASTIC, HALVINGS = 1e-3, 7
"""Of ``chord_sum``: 1 - e up to which terms are too many, and halvings of the arc tangent."""

# pi/2 as a sum of three doubles, the first two with zeros at the end (fdlibm, e_rem_pio2.c).
HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)


@inlined
def cosine_and_sine(angle: float) -> tuple[float, float]:
    """Of an angle in radians, to an ulp or two up to 1e5; the polynomials are fdlibm's."""
    quarters = np.rint(angle * 0.63661977236758134308)
    z = ((angle - quarters * HALF_PI[0]) - quarters * HALF_PI[1]) - quarters * HALF_PI[2]
    w = z * z
    sine = 1.58969099521155010221e-10
    sine = sine * w - 2.50507602534068634195e-08
    sine = sine * w + 2.75573137070700676789e-06
    sine = sine * w - 1.98412698298579493134e-04
    sine = sine * w + 8.33333333332248946124e-03
    sine = sine * w - 1.66666666666666324348e-01
    sine = z + z * w * sine
    cosine = -1.13596475577881948265e-11
    cosine = cosine * w + 2.08757232129817482790e-09
    cosine = cosine * w - 2.75573143513906633035e-07
    cosine = cosine * w + 2.48015872894767294178e-05
    cosine = cosine * w - 1.38888888888741095749e-03
    cosine = cosine * w + 4.16666666666666019037e-02
    cosine = 1.0 - (0.5 * w - w * w * cosine)
    turns = quarters - 4.0 * np.floor(0.25 * quarters)
    if turns == 1.0 or turns == 3.0:
        cosine, sine = -sine, cosine
    return (cosine, sine) if turns < 2.0 else (-cosine, -sine)


# States of a ball


Ball: TypeAlias = tuple[float, float, float, float, float]
"""A ball's rows: place (m), velocity (m/s), clock (s)."""


@inlined
def ball_of(i: int, balls: Floats) -> Ball:
    return balls[X, i], balls[Y, i], balls[U, i], balls[V, i], balls[CLOCK, i]


@inlined
def set_ball(i: int, ball: Ball, balls: Floats) -> None:
    balls[X, i], balls[Y, i], balls[U, i], balls[V, i], balls[CLOCK, i] = ball


@inlined
def angular_velocity(i: int, balls: Floats) -> float:
    """How fast ball i turns round the centre, rad/s."""
    x, y = balls[X, i], balls[Y, i]
    return float((x * balls[V, i] - y * balls[U, i]) / (x * x + y * y))


@inlined
def turned(i: int, now: float, balls: Floats) -> Ball:
    """Ball i, which slides, at a time (s)."""
    c, s = cosine_and_sine(angular_velocity(i, balls) * (now - balls[CLOCK, i]))
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    return c * x - s * y, s * x + c * y, c * u - s * v, s * u + c * v, now


@helper
def bounced(i: int, until: float, state: State) -> tuple[Ball, float]:
    """Ball i, just off the wall and trapped, at a time (s), and its impulse on the wall, kg m/s.

    If it bounces infinitely often until then, this is where and when it begins to slide. A chord
    lasts 2 a v_n/(v_n^2 + v_t^2) and turns it by 2 atan(v_n/v_t): at last two geometric series.
    """
    x, y, u, v, now = ball_of(i, state.balls)
    e = state.setup.laws[WALL, COR]
    square = x * x + y * y
    inward, cross = max(-(x * u + y * v), 0.0), x * v - y * u  # a v_n and a v_t
    c, s, given = 1.0, 0.0, 0.0
    flat = inward <= FLAT * abs(cross)
    while not flat:
        chord = inward * inward + cross * cross
        end = now + 2.0 * inward * square / chord
        if end > until:
            break
        along, aside = (cross * cross - inward * inward) / chord, 2.0 * inward * cross / chord
        c, s = c * along - s * aside, s * along + c * aside
        given += (1.0 + e) * inward
        inward *= e
        now = end
        flat = inward <= FLAT * abs(cross)
    if flat:
        rest = inward / (1.0 - e)
        end = now + 2.0 * rest * square / (cross * cross)
        if end <= until:
            along, aside = cosine_and_sine(2.0 * rest / cross)
            given += (1.0 + e) * rest
        else:  # it seems to slide already
            end = until
            along, aside = cosine_and_sine(cross / square * (until - now))
        c, s = c * along - s * aside, s * along + c * aside
        inward, now = 0.0, end
    length = math.sqrt(c * c + s * s)  # 1 but for many roundings
    c, s = c / length, s / length
    x, y = c * x - s * y, s * x + c * y
    u, v = (-inward * x - cross * y) / square, (-inward * y + cross * x) / square
    return (x, y, u, v, now), float(state.sizes.mass_of(i) * given / math.sqrt(square))


@inlined
def chord_sum(q: float, restitution: float) -> float:
    """Sum of q e^k/(1 + (q e^k)^2) over all k from 0, with only + - * / and roots, for equal bits.

    q : normal over tangential speed after a hit; 2 a/v_t times the sum is how long all chords last
    restitution : e of the wall, below 1

    Near e = 1 this is the formula of Euler and Maclaurin, with the arc tangent as the integral.
    """
    d, total = 1.0 - restitution, 0.0
    if d > NEARLY_ELASTIC:
        while FLAT < q < math.inf:
            total += q / (1.0 + q * q)
            q *= restitution
        return total + q / d
    h = d * (1.0 + d * (1 / 2 + d * (1 / 3 + d * (1 / 4 + d * (1 / 5 + d / 6)))))  # -ln e
    q = min(q, 1e150)  # whose square is finite; its arc tangent is already pi/2
    total = q / (1.0 + q * q) * (0.5 + h / 12.0 * (2.0 / (1.0 + q * q) - 1.0))
    for _ in range(HALVINGS):
        q = q / (1.0 + math.sqrt(1.0 + q * q))
    z = q * q
    arc = q * (1.0 - z * (1 / 3 - z * (1 / 5 - z * (1 / 7 - z / 9))))
    return total + 2.0**HALVINGS * arc / h


@helper
def bounces_to_come(i: int, state: State) -> tuple[float, float]:
    """How long the bounces of ball i, trapped just off the wall, last, s; their impulse, kg m/s.

    With another law than CONSTANT, and at a rough wall, both are upper bounds.
    """
    law = state.setup.laws[WALL]
    e = float(law[COR])
    x, y, u, v, clock = ball_of(i, state.balls)
    x, y, u, v = state.boundary.relative(x, y, u, v, clock)
    square, inward, cross = x * x + y * y, max(0.0, -(x * u + y * v)), abs(x * v - y * u)
    mass = state.boundary.bouncing_mass(float(state.sizes.mass_of(i)))
    if law[KIND] != CONSTANT or state.surface.rubs_wall():
        distance = math.sqrt(square)
        _, changes = bounce_sums(law, inward / square, distance)
        now = float(state.sums[ks.NOW])
        given = float(mass * changes * inward / distance)
        return prediction.bouncing_time(i, now, state), given
    if e == 0.0:
        return 0.0, 0.0
    lasts = 2.0 * (square / cross) * chord_sum(inward / cross, e)
    share = (1.0 + e) / (1.0 - e)
    return float(lasts), float(mass * share * inward / math.sqrt(square))


@inlined
def pressed(i: int, now: float, state: State) -> float:
    """Impulse of ball i, which slides, on the wall since its clock: m w^2 a t, kg m/s."""
    balls = state.balls
    w = angular_velocity(i, balls)
    reach = math.sqrt(balls[X, i] * balls[X, i] + balls[Y, i] * balls[Y, i])
    return float(state.sizes.mass_of(i) * w * w * reach * (now - balls[CLOCK, i]))


# The next contact of a ball if it, or its partner, or both, slide along the wall

EPSILON = 2.0**-52

STEPS = 512  # steps towards a contact, beyond now, after which a ball searches again later

SHORT = 2.0**-46
"""A part of the container's radius that is no more than the rounding of a few places."""


@inlined
def arc_delay(
    way: tuple[float, ...],
    distance: float,
    largest: float,
    since: float,
    passed: float,
    horizon: float,
) -> tuple[float, bool]:
    """Time until a ball on an arc touches one that flies, at a distance (m), and whether it does.

    If not, it is a time up to which they do not touch: inf if not before the horizon. The steps are
    the same whenever it is asked, so a contact has one time.

    way : of a ball that turns at w (rad/s) from (x, y), one that flies from (px, py); their speed
    since : the clock at which both are there, s
    passed : s, the part of that time which has passed; it ends ``STEPS`` steps later

    g = |distance of the centres|^2 - d^2 has a second derivative of at least -2 D w^2 a, with D the
    largest possible distance. So a parabola below g follows from g and g', and a step to its root
    misses none of g. While the ball that flies is nearer to the centre than a - d, it can touch no
    ball that slides, and that time is skipped. Balls that do not approach by more than rounding may
    overlap by as much, or the search would not end.
    """
    x, y, w, px, py, pu, pv, speed = way
    a = math.sqrt(x * x + y * y)
    bend = largest * w * w * a
    inner = a - distance
    # A step moves t, and STEPS of them move the clock, also late in an epoch.
    least = max(SHORT * a / speed, 8.0 * EPSILON / STEPS * since)
    tangible = 4.0 * SHORT * distance * speed
    slack = 8.0 * SHORT * distance * a
    t, steps = 0.0, 0
    while steps < STEPS:
        steps += 1 if t > passed else 0
        shortest = max(least, EPSILON * t)
        c, s = cosine_and_sine(w * t)
        ax, ay = c * x - s * y, s * x + c * y
        bx, by = px + pu * t, py + pv * t
        if inner > 0.0 and bx * bx + by * by < inner * inner:
            step = (1.0 - SHORT) * wall_delay(bx, by, pu, pv, inner * inner)
        else:
            dx, dy = bx - ax, by - ay
            g = dx * dx + dy * dy - distance * distance
            fall = -2.0 * (dx * (pu + w * ay) + dy * (pv - w * ax))
            if g <= 0.0 and fall > tangible:
                return t, True
            if fall > tangible:
                step = 2.0 * g / (fall + math.sqrt(fall * fall + 4.0 * bend * g))
                if step <= shortest:
                    return t, True
            elif bend > 0.0:
                fall = min(fall, 0.0)
                g = max(g, 0.0) + slack
                step = (math.sqrt(fall * fall + 4.0 * bend * g) - fall) / (2.0 * bend)
            else:
                return NEVER, False
        t += max(step, shortest)
        if not t < horizon:
            return NEVER, False
    return t, False


@helper
def contact_on_arc(
    boundary: "SlidingCircle",
    i: int,
    now: float,
    time: float,
    partner: int,
    state: State,
    wall_times: Floats,
) -> tuple[float, int]:
    """When ball i first touches another, if one of them slides, and which, if before a time, s."""
    balls, rim, motions = state.balls, boundary.circle.radius, boundary.motions
    if motions[i] == SETTLES:
        return time, partner
    for k in range(balls.shape[1]):
        if k == i or motions[k] == SETTLES or (motions[i] != SLIDES and motions[k] != SLIDES):
            continue
        a, b = (min(i, k), max(i, k)) if motions[i] == motions[k] else (i, k)
        if motions[a] != SLIDES:
            a, b = b, a
        since = max(balls[CLOCK, a], balls[CLOCK, b])  # as in ``prediction.contact_time``
        x, y = boundary.place(a, since, balls)
        xb, yb = boundary.place(b, since, balls)
        w, until = angular_velocity(a, balls), time
        if motions[b] == SLIDES:
            wb = angular_velocity(b, balls)
            speed = (abs(w) + abs(wb)) * rim
            if abs(w - wb) * rim <= 8.0 * SHORT * speed:
                continue  # side by side
            way = x, y, w - wb, xb, yb, 0.0, 0.0, speed
        else:
            u, v = balls[U, b], balls[V, b]
            until = min(time, wall_times[b])
            way = x, y, w, xb, yb, u, v, abs(w) * rim + math.sqrt(u * u + v * v)
        d = ks.contact_distance(state.sizes, a, b)
        delay, touches = arc_delay(way, d, 2.0 * rim, since, now - since, until - since)
        its_time = max(since + delay, 0.0)
        if its_time < time:
            time, partner = its_time, k if touches else ks.SEARCH_AGAIN
    return time, partner


# The boundary


class SlidingCircle(
    Edge, NamedTuple("SlidingCircle", [("circle", FixedCircle), ("motions", Integers)])
):
    """A fixed circular wall at which trapped balls slide. Its methods are as in ``boundaries``.

    circle : for balls that fly
    motions : (*N*,), what each ball does: FLIES, SETTLES or SLIDES
    """

    def of_repeat(self, repeat: int) -> "SlidingCircle":
        return SlidingCircle(self.circle, self.motions[repeat])

    def time_at_wall(self, i: int, state: State) -> float:
        if self.motions[i] == LEAVES:
            x, y, u, v, clock = ball_of(i, state.balls)
            return float(clock + chord_delay(x, y, u, v))
        return self.circle.time_at_wall(i, state)

    def hit_wall(self, i: int, now: float, state: State, elastic: bool) -> float:
        return self.circle.hit_wall(i, now, state, elastic)

    def is_curved(self) -> bool:
        return True

    def place(self, i: int, now: float, balls: Floats) -> tuple[float, float]:
        if self.motions[i] == SLIDES:
            return turned(i, now, balls)[:2]
        return ks.position(i, now, balls)

    # What the event loop asks

    def is_far(self, i: int, now: float, state: State) -> bool:
        if i < 0 or self.motions[i] != SLIDES:
            return False
        turn = angular_velocity(i, state.balls) * (now - state.balls[CLOCK, i])
        return bool(abs(turn) > FARTHEST)

    def carry_out_slide(self, i: int, j: int, now: float, state: State) -> tuple[int, bool, float]:
        motions, balls = self.motions, state.balls
        k = ks.NO_PARTNER
        if motions[i] == SETTLES or (motions[i] == SLIDES and balls[CLOCK, i] < now):
            k = i
        elif j >= 0 and motions[j] == SLIDES and balls[CLOCK, j] < now:
            k = j
        if k == ks.NO_PARTNER:
            return k, False, 0.0
        begins = bool(motions[k] == SETTLES)
        return k, begins, self.slide(k, now, state)

    def settle(self, i: int, trapped: bool, now: float, state: State) -> bool:
        x, y, u, v, _ = ball_of(i, state.balls)
        inward, cross = max(-(x * u + y * v), 0.0), x * v - y * u
        square = (1.0 - state.setup.laws[WALL, COR]) * cross * cross  # 0 at an elastic wall
        # From then on bounces are shorter than the rounding of the clock.
        least = CLOCK_DIGITS * (state.sums[ks.EPOCH] + now) * square
        if trapped or (square > 0.0 and 2.0 * inward * (x * x + y * y) <= least):
            self.motions[i] = SETTLES
        return False

    def time_of_next_hit(self, i: int, state: State) -> float:
        if self.motions[i] == SLIDES:
            return NEVER
        if self.motions[i] == SETTLES:
            return max(bounced(i, NEVER, state)[0][4], 0.0)
        return next_hit(i, state)

    def take_off_wall(self, i: int) -> None:
        if self.motions[i] != SETTLES:
            self.motions[i] = LEAVES if self.motions[i] == SLIDES else FLIES

    def without_curved(self, mask: int, start: int, stop: int, i: int) -> int:
        for k in range(start, stop):
            if self.motions[i] >= SETTLES or self.motions[k] >= SETTLES:
                mask = prediction.without(mask, start, k)
        return mask

    def earliest_on_arc(
        self, i: int, now: float, time: float, partner: int, state: State, wall_times: Floats
    ) -> tuple[float, int]:
        return contact_on_arc(self, i, now, time, partner, state, wall_times)

    # What replays and summaries ask

    def slide(self, i: int, now: float, state: State) -> float:
        balls = state.balls
        if self.motions[i] == SLIDES:
            size = pressed(i, now, state)
            set_ball(i, turned(i, now, balls), balls)
            return size
        ball, size = bounced(i, NEVER, state)
        set_ball(i, ball, balls)
        # It begins exactly on its circle, so that the roundings of many bounces do not add up.
        part = (self.circle.radius - state.sizes.radius_of(i)) / math.sqrt(
            balls[X, i] * balls[X, i] + balls[Y, i] * balls[Y, i]
        )
        balls[X, i] *= part
        balls[Y, i] *= part
        balls[CLOCK, i] = now
        self.motions[i] = SLIDES
        return size

    def pressing(self, now: float, state: State) -> float:
        total = 0.0
        for k in range(state.balls.shape[1]):
            if self.motions[k] == SLIDES:
                total += pressed(k, now, state)
        return total

    def bounce_on(self, time: float, state: State) -> None:
        for i in range(state.balls.shape[1]):
            if self.motions[i] == SETTLES:
                set_ball(i, ball_of(i, state.balls), state.scratch)
                ball, size = bounced(i, time, state)
                set_ball(i, ball, state.balls)
                state.sums[ks.WALL_IMPULSE] += size

    def bounce_back(self, state: State) -> None:
        for i in range(state.balls.shape[1]):
            if self.motions[i] == SETTLES:
                set_ball(i, ball_of(i, state.scratch), state.balls)

    def flight(self, i: int, now: float, state: State) -> tuple[float, float, float, float]:
        ball = ball_of(i, state.balls)
        if self.motions[i] == SLIDES:
            ball = turned(i, now, state.balls)
        else:
            # Beyond the wall, only one that settles: each hit of another is an event.
            x, y = ks.position(i, now, state.balls)
            reach = self.circle.radius - state.sizes.radius_of(i)
            if x * x + y * y > reach * reach * (1.0 + BEYOND):
                ball = bounced(i, now, state)[0]
        x, y, u, v, clock = ball
        age = now - clock
        return x + u * age, y + v * age, u, v
