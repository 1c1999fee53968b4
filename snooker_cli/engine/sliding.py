"""Balls that slide along a fixed circular wall after infinitely many bounces.

A ball that bounces at a wall of restitution e keeps its tangential speed v_t, and its normal speed
falls as e^k: after a finite time it slides, with a constant speed on a circle of radius a, and
presses against the wall with m v_t^2/a. Where it is follows from a rotation. Its cosine and sine
are made here of + - * and /, which round alike on every machine, and those of a library do not.
"""

from __future__ import annotations

import math

import numpy as np

from snooker_cli.engine import kernel_state
from snooker_cli.engine.collision import mass_of, radius_of
from snooker_cli.engine.contact import NEVER, wall_delay
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.kernel_state import (
    BALL_ROWS,
    CLOCK,
    LOOK_AGAIN,
    NOBODY,
    SUMS,
    WALL_TIME,
    Floats,
    Integers,
    Setup,
    U,
    V,
    X,
    Y,
)
from snooker_cli.engine.sampling import Grid, sample_until

# What a ball does: it flies, or it bounces until it slides, or it slides.
FLIES, SETTLES, SLIDES = range(3)

# Normal over tangential speed from which on its square does not count beside 1.
FLAT = 2.0**-27

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
    if turns == 0.0:
        return cosine, sine
    if turns == 1.0:
        return -sine, cosine
    if turns == 2.0:
        return -cosine, -sine
    return sine, -cosine


@inlined
def rate(i: int, balls: Floats) -> float:
    """How fast ball i turns round the centre, rad/s."""
    x, y = balls[X, i], balls[Y, i]
    return float((x * balls[V, i] - y * balls[U, i]) / (x * x + y * y))


@inlined
def turn(i: int, now: float, balls: Floats) -> None:
    """Bring ball i, which slides, to the present."""
    c, s = cosine_and_sine(rate(i, balls) * (now - balls[CLOCK, i]))
    balls[X, i], balls[Y, i] = c * balls[X, i] - s * balls[Y, i], s * balls[X, i] + c * balls[Y, i]
    balls[U, i], balls[V, i] = c * balls[U, i] - s * balls[V, i], s * balls[U, i] + c * balls[V, i]
    balls[CLOCK, i] = now


@kernel
def turn_all(now: float, balls: Floats, slides: Integers) -> None:
    """Bring all balls that slide to the present."""
    for k in range(balls.shape[1]):
        if slides[k] == SLIDES:
            turn(k, now, balls)


@inlined
def place(i: int, now: float, balls: Floats, slides: Integers | None) -> tuple[float, float]:
    """Where ball i is, which flies or slides, m."""
    age = now - balls[CLOCK, i]
    x, y = balls[X, i], balls[Y, i]
    if slides is not None and slides[i] == SLIDES:
        c, s = cosine_and_sine(rate(i, balls) * age)
        return c * x - s * y, s * x + c * y
    return x + balls[U, i] * age, y + balls[V, i] * age


@inlined
def pressed(i: int, now: float, balls: Floats, setup: Setup, masses: Floats | None) -> float:
    """Impulse of ball i, which slides, on the wall since its clock: m w^2 a t, kg m/s."""
    w = rate(i, balls)
    reach = math.sqrt(balls[X, i] * balls[X, i] + balls[Y, i] * balls[Y, i])
    return float(mass_of(setup, masses, i) * w * w * reach * (now - balls[CLOCK, i]))


@kernel
def pressing(
    now: float, balls: Floats, setup: Setup, masses: Floats | None, slides: Integers
) -> float:
    """Impulse on the wall of all balls that slide, each since its clock, kg m/s."""
    total = 0.0
    for k in range(balls.shape[1]):
        if slides[k] == SLIDES:
            total += pressed(k, now, balls, setup, masses)
    return total


@kernel
def bounce(i: int, until: float, balls: Floats, setup: Setup, masses: Floats | None) -> float:
    """Let ball i, just off the wall and trapped, bounce up to a time (s); the impulse, kg m/s.

    If it bounces infinitely often until then, it is left where and when it begins to slide. With
    q = v_n/v_t a chord lasts 2 a v_n/(v_n^2 + v_t^2) and turns it by 2 atan(q), of which cosine and
    sine are (1 - q^2)/(1 + q^2) and 2q/(1 + q^2). Once q^2 does not count beside 1 both are
    geometric series.
    """
    x, y, u, v, now = balls[X, i], balls[Y, i], balls[U, i], balls[V, i], balls[CLOCK, i]
    e = setup.wall_restitution
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
    balls[X, i], balls[Y, i] = x, y
    balls[U, i] = (-inward * x - cross * y) / square
    balls[V, i] = (-inward * y + cross * x) / square
    balls[CLOCK, i] = now
    return float(mass_of(setup, masses, i) * given / math.sqrt(square))


@inlined
def state_of(i: int, balls: Floats) -> tuple[float, float, float, float, float]:
    """Ball i's state, to put it back."""
    return balls[X, i], balls[Y, i], balls[U, i], balls[V, i], balls[CLOCK, i]


@inlined
def put_back(i: int, state: tuple[float, float, float, float, float], balls: Floats) -> None:
    """Make it ball i's state again."""
    balls[X, i], balls[Y, i], balls[U, i], balls[V, i], balls[CLOCK, i] = state


@kernel
def slide_time(i: int, balls: Floats, setup: Setup, masses: Floats | None) -> float:
    """When ball i, just off the wall and trapped, begins to slide, s; it is left as it is."""
    kept = state_of(i, balls)
    bounce(i, NEVER, balls, setup, masses)
    time = float(balls[CLOCK, i])
    put_back(i, kept, balls)
    return time


@kernel
def sample_sliding(
    now: float,
    grid: Grid,
    balls: Floats,
    setup: Setup,
    masses: Floats | None,
    slides: Integers,
    sums: Floats,
    counts: Integers,
) -> None:
    """``sample_until``, with the impulse of what presses and bounces meanwhile."""
    number, kept = balls.shape[1], sums[SUMS:]
    while grid.used[0] * grid.step[0] - sums[kernel_state.EPOCH] < now:
        due = grid.used[0] * grid.step[0] - sums[kernel_state.EPOCH]
        impulse = sums[kernel_state.WALL_IMPULSE]
        for k in range(number):
            for row in range(BALL_ROWS):
                kept[row * number + k] = balls[row, k]
        sums[kernel_state.WALL_IMPULSE] += pressing(due, balls, setup, masses, slides)
        for k in range(number):
            if slides[k] == SETTLES:
                sums[kernel_state.WALL_IMPULSE] += bounce(k, due, balls, setup, masses)
        until = min(now, due + grid.step[0])
        sample_until(until, grid, balls, None, setup, masses, sums, counts)
        for k in range(number):
            for row in range(BALL_ROWS):
                balls[row, k] = kept[row * number + k]
        sums[kernel_state.WALL_IMPULSE] = impulse


@inlined
def leave_wall(i: int, now: float, balls: Floats, agenda: Floats) -> float:
    """Time until ball i, which was hit while it slid, hits the wall, s, entered into the agenda.

    It does now unless it was hit away from the wall.
    """
    b = balls[X, i] * balls[U, i] + balls[Y, i] * balls[V, i]
    w2 = balls[U, i] * balls[U, i] + balls[V, i] * balls[V, i]
    delay = 0.0
    if b < 0.0:
        delay = -2.0 * b / w2
    agenda[WALL_TIME, i] = now + delay
    return delay


@inlined
def has_settled(i: int, digit: float, balls: Floats, setup: Setup) -> bool:
    """Whether the infinitely many bounces of ball i, just off the wall, are over but for rounding.

    They last at most 2 a v_n/((1 - e) v_t^2), and nothing else happens within some digits (s).
    """
    x, y, u, v = balls[X, i], balls[Y, i], balls[U, i], balls[V, i]
    inward, cross = max(-(x * u + y * v), 0.0), x * v - y * u
    square = (1.0 - setup.wall_restitution) * cross * cross
    return bool(cross != 0.0 and 2.0 * inward * (x * x + y * y) <= digit * square)


@inlined
def who_slides(i: int, j: int, now: float, balls: Floats, slides: Integers) -> int:
    """Who, in an event of balls i and j, slides from now on or has pressed since its clock."""
    if slides[i] == SETTLES or (slides[i] == SLIDES and balls[CLOCK, i] < now):
        return i
    if j >= 0 and slides[j] == SLIDES and balls[CLOCK, j] < now:
        return j
    return NOBODY


@inlined
def slide_on(
    i: int,
    now: float,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
    masses: Floats | None,
    slides: Integers,
) -> float:
    """Take ball i to where it begins to slide, or slides, now; the impulse on the way, kg m/s.

    It begins exactly on its circle, so that the roundings of many bounces do not add up.
    """
    if slides[i] == SLIDES:
        size = pressed(i, now, balls, setup, masses)
        turn(i, now, balls)
        return size
    size = bounce(i, NEVER, balls, setup, masses)
    reach = setup.container_radius - radius_of(setup, radii, i)
    part = reach / math.sqrt(balls[X, i] * balls[X, i] + balls[Y, i] * balls[Y, i])
    balls[X, i] *= part
    balls[Y, i] *= part
    balls[CLOCK, i] = now
    slides[i] = SLIDES
    return size


@kernel
def write_states(
    time: float,
    who: int,
    balls: Floats,
    setup: Setup,
    masses: Floats | None,
    slides: Integers,
    out: Floats,
) -> None:
    """Write where balls that slide, and one that bounces until it does, are at a time (s).

    who : the ball of the next event, if that is the beginning of its slide, or ``NOBODY``
    """
    for k in range(balls.shape[1]):
        settles = k == who and slides[k] != SLIDES
        if not settles and slides[k] != SLIDES:
            continue
        kept = state_of(k, balls)
        if settles:
            bounce(k, time, balls, setup, masses)
        else:
            turn(k, time, balls)
        age = time - balls[CLOCK, k]
        out[0, k], out[1, k] = balls[X, k] + balls[U, k] * age, balls[Y, k] + balls[V, k] * age
        out[2, k], out[3, k] = balls[U, k], balls[V, k]
        put_back(k, kept, balls)


# Whom a ball touches next where one of the two, or both, slide along the wall.

# Steps towards a contact after which a ball looks again from there.
STEPS = 512

# A part of the container's radius that is no more than the rounding of a few places.
SHORT = 2.0**-46


@inlined
def arc_delay(
    x: float,
    y: float,
    w: float,
    px: float,
    py: float,
    pu: float,
    pv: float,
    distance: float,
    largest: float,
    speed: float,
    horizon: float,
) -> tuple[float, bool]:
    """Time until a ball that turns at w (rad/s) from (x, y) touches one that flies from (px, py).

    And whether it does: else it is a time up to which it does not; inf if not before the horizon.

    g = |distance of the centres|^2 - d^2 has a second derivative of at least -2 D w^2 a, with D the
    largest distance there can be. So from g and g' follows a parabola below g, and a step to its
    root does not step over one of g; near a root it is Newton's. While the one that flies is nearer
    to the centre than a - d, it can touch nothing that slides, and that time is skipped.
    Where they do not approach by more than rounding, they may overlap by as much: else those that
    stay side by side would be looked at without end.

    largest : D, m; speed : of both together, m/s, whose rounding is no approach
    """
    a = math.sqrt(x * x + y * y)
    bend = largest * w * w * a
    inner = a - distance
    least = SHORT * a / speed
    tangible = 4.0 * SHORT * distance * speed
    slack = 8.0 * SHORT * distance * a
    t = 0.0
    for _ in range(STEPS):
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
                if step <= least:
                    return t, True
            elif bend > 0.0:
                fall = min(fall, 0.0)
                g = max(g, 0.0) + slack
                step = (math.sqrt(fall * fall + 4.0 * bend * g) - fall) / (2.0 * bend)
            else:
                return NEVER, False
        t += max(step, least)
        if not t < horizon:
            return NEVER, False
    return t, False


@kernel
def earliest_on_arc(
    i: int,
    now: float,
    delay: float,
    whom: int,
    balls: Floats,
    setup: Setup,
    radii: Floats | None,
    agenda: Floats,
    slides: Integers,
) -> tuple[float, int]:
    """Whom ball i touches first, if before ``delay``, when one of the two slides, and when."""
    wi = rate(i, balls) if slides[i] == SLIDES else 0.0
    xi, yi = place(i, now, balls, slides)
    ri = radius_of(setup, radii, i)
    reach = 2.0 * setup.container_radius
    for k in range(balls.shape[1]):
        if k == i or slides[k] == SETTLES or (slides[i] != SLIDES and slides[k] != SLIDES):
            continue
        d = ri + radius_of(setup, radii, k)
        xk, yk = place(k, now, balls, slides)
        if slides[i] == SLIDES and slides[k] == SLIDES:
            wk = rate(k, balls)
            rim = setup.container_radius
            speed = (abs(wi) + abs(wk)) * rim
            if abs(wi - wk) * rim <= 8.0 * SHORT * speed:
                continue  # side by side
            its, sure = arc_delay(xi, yi, wi - wk, xk, yk, 0.0, 0.0, d, reach, speed, delay)
        elif slides[i] == SLIDES:
            u, v = balls[U, k], balls[V, k]
            until = min(delay, agenda[WALL_TIME, k] - now)
            speed = abs(wi) * setup.container_radius + math.sqrt(u * u + v * v)
            its, sure = arc_delay(xi, yi, wi, xk, yk, u, v, d, reach, speed, until)
        else:
            u, v = balls[U, i], balls[V, i]
            wk = rate(k, balls)
            speed = abs(wk) * setup.container_radius + math.sqrt(u * u + v * v)
            its, sure = arc_delay(xk, yk, wk, xi, yi, u, v, d, reach, speed, delay)
        if its < delay:
            delay, whom = its, k if sure else LOOK_AGAIN
    return delay, whom


@inlined
def only_straight(mask: int, start: int, stop: int, i: int, slides: Integers) -> int:
    """The mask of balls from ``start`` to ``stop``, less those whose way is not straight."""
    if slides[i] != FLIES:
        return 0
    for k in range(start, stop):
        if slides[k] != FLIES:
            mask &= ~(1 << (k - start))
    return mask
