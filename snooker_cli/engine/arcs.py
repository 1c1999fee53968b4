"""Whom a ball touches next where one of the two, or both, slide along the wall."""

from __future__ import annotations

import math

from snooker_cli.engine.collide import radius_of
from snooker_cli.engine.contact import NEVER, wall_delay
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.layout import LOOK_AGAIN, WALL_TIME, Floats, Integers, Setup, U, V
from snooker_cli.engine.slide import FLIES, SETTLES, SLIDES, cosine_and_sine, place, rate

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
