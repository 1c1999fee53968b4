"""Balls at a rough circular wall: traps are sound and found, and nothing else ends a repeat."""

from __future__ import annotations

import itertools
import math
import random
from dataclasses import replace

import numpy as np
import pytest
from exact import exact_events
from scenes import EPSILON, Ball, gas, scene_of
from test_surfaces import rough

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine import simulate
from snooker_cli.engine.conversion import new_states
from snooker_cli.engine.restitution import ENDLESS
from snooker_cli.laws import Viscoelastic
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, SLIDE, StopReason

INF = math.inf


def lone(dice: random.Random, cor: float, surface: tuple[float, ...], mass: float) -> Scene:
    """A ball that spins in a circle with a mass (kg), not along a diameter."""
    angle = dice.uniform(-1.5, 1.5)
    ball = (1.0, 0.5, 5 * math.cos(angle), 5 * math.sin(angle), 1.0, 2.0)
    scene = scene_of([ball], container_mass=mass, wall_restitution=cor)
    return rough(scene, *surface, spins=[dice.uniform(-10, 10)])


def bounces_after(scene: Scene) -> tuple[float, float, float]:
    """How long all bounces of a lone ball last, s, and their impulses, kg m/s: one by one.

    And its least tangential speed, m/s.

    Relative to a free container the ball has the reduced mass, but turns as one of its own mass.
    """
    surface = scene.surface
    assert surface is not None
    assert scene.spins is not None
    (mass,), (radius,), (spin,) = scene.masses, scene.radii, scene.spins.tolist()
    reduced, e = mass / (1 + mass / scene.container_mass), scene.wall_restitution
    place = scene.positions[0] - scene.container_position
    velocity = scene.velocities[0] - scene.container_velocity
    reach = math.hypot(*place)
    out = place / reach
    normal, along = -float(velocity @ out), float(velocity @ (-out[1], out[0]))
    lasts, given, least = 0.0, 0.0, abs(along)
    while normal > 1e-290:
        lasts += 2 * reach * normal / (normal**2 + along**2)
        push = reduced * (1 + e) * normal
        given += push
        rub = (1 + surface.wall_tangential_cor) * (along + radius * spin)
        rub /= 1 / reduced + 1 / (surface.inertia * mass)
        rub = max(min(rub, surface.wall_friction * push), -surface.wall_friction * push)
        along -= rub / reduced
        spin -= rub / (surface.inertia * mass * radius)
        normal *= e
        least = min(least, abs(along))
    return lasts, given, least


SURFACES = [
    *itertools.product((0.5,), (1.0,), (INF,), (-1.0, -0.5, 0.0, 0.5, 1.0), (0.1, 1.0, INF)),
    (1.0, 0.5, INF, 0.99, INF),
]


@pytest.mark.parametrize("mass", [INF, 3.0, 0.2])
@pytest.mark.parametrize("cor", [0.3, 0.9])
def test_a_lone_ball_is_in_a_trap_that_ends_in_time(cor: float, mass: float) -> None:
    """All its bounces end by the stated time with the stated impulse, or earlier and with less."""
    dice = random.Random(1)
    for surface in SURFACES * 3:
        trace = simulate(lone(dice, cor, surface, mass), collisions=20_000)
        stop = trace.stop
        assert stop.reason is StopReason.WALL_TRAP, (surface, stop)
        lasts, given, _ = bounces_after(trace.finish)
        assert stop.accumulation_time is not None
        assert stop.impulse_to_come is not None
        # The reach, and speeds relative to a container that has moved, have roundings.
        rounding = 1e6 * EPSILON
        assert lasts <= (stop.accumulation_time - stop.time) * (1 + rounding) + rounding
        assert given == pytest.approx(stop.impulse_to_come, rel=1e-6, abs=rounding)


@pytest.mark.parametrize("mass", [INF, 3.0, 0.2])
def test_no_bounce_is_slower_along_the_wall_than_the_bound(mass: float) -> None:
    """One is as slow, without friction or where it limits all, unless the bound is zero."""
    dice, attained = random.Random(3), {INF: 0, 0.1: 0}
    for surface in (surface for surface in SURFACES * 30 if surface[3] > -1):
        scene = lone(dice, 0.5, surface, mass)
        out, reach, spins = np.array([0.6, 0.8]), 9.0, scene.spins
        normal, along = dice.uniform(0.01, 1), dice.uniform(-5, 5)
        velocity = -normal * out + along * np.array([-0.8, 0.6])
        scene = replace(scene, positions=np.array([reach * out]), velocities=np.array([velocity]))
        *_, least = bounces_after(scene)
        state = ks.state_of(new_states([scene]), 0)
        reduced = 2.0 / (1.0 + 2.0 / mass)
        changes = normal * (1 + 0.5) / (1 - 0.5)
        bound = state.surface.slowest_along(0, along, changes, reduced, state)
        assert bound <= least * (1 + 1e-12)
        slides = spins is not None and abs(along + spins[0]) > 9
        if bound > 0 and (surface[4] == INF or (surface[4] == 0.1 and slides)):
            attained[surface[4]] += 1
            assert bound == pytest.approx(least, rel=1e-9)
    assert min(attained.values()) >= 10  # there are such cases


def others(dice: random.Random, free: bool) -> Scene:
    """Four rough balls in a circle, the first just before it hits the wall at a flat angle."""
    while True:
        radius = dice.uniform(0.1, 1.0)
        ball = (10 - radius - 0.01, 0.0, dice.uniform(0.02, 1.0), dice.uniform(0.5, 5), radius, 1.0)
        balls: list[Ball] = [ball]
        for _ in range(3):
            place = (dice.uniform(-7, 7), dice.uniform(-7, 7))
            speed = (dice.uniform(-5, 5), dice.uniform(-5, 5))
            balls.append((*place, *speed, dice.uniform(0.1, 1.0), 10 ** dice.uniform(-1, 1)))
        table = np.array(balls)
        apart = np.hypot(*(table[:, np.newaxis, :2] - table[:, :2]).T) + 9 * np.eye(4)
        if apart.min() > 2:
            break
    scene = scene_of(
        balls,
        container_mass=10 ** dice.uniform(0, 2) if free else INF,
        restitution=0.9,
        wall_restitution=dice.choice([0.1, 0.4, 0.6]),
    )
    surface = (0.5, 0.5, 0.5, dice.choice([-0.5, 0.0, 0.6, 1.0]), dice.choice([0.1, 0.5, INF]))
    return rough(scene, *surface, spins=[dice.uniform(-9, 9) for _ in range(4)])


@pytest.mark.parametrize("free", [False, True])
def test_no_ball_reaches_a_ball_in_a_trap(free: bool) -> None:
    """The exact twin bounces on 30 times or more; less than 1e-6 of the time is left.

    Others may meet elsewhere, but hit no container that is free.
    """
    dice, traps = random.Random(2), 0
    for _ in range(40):
        trace = simulate(others(dice, free), collisions=15)
        if trace.stop.reason is StopReason.WALL_TRAP:
            traps += 1
            (ball,) = trace.stop.balls
            pairs = [(event.i, event.j) for event in exact_events(trace.finish, 40)]
            assert pairs.count((ball, CONTAINER)) >= 30
            assert all(CONTAINER in pair or ball not in pair for pair in pairs)
            assert not free or {i for i, j in pairs if j == CONTAINER} == {ball}
    assert traps >= 8


def test_a_trap_says_what_is_certain() -> None:
    """Bounds at a rough wall; at a smooth one, and with a CoR of 0, the sums of smooth balls."""
    scene, messages = lone(random.Random(4), 0.5, (0.5, 1.0, INF, 0.5, 0.3), INF), []
    smooth = rough(scene, 0.5, 1.0, INF, -1.0, INF, spins=[3.0])
    for changed in (scene, smooth, replace(scene, wall_law=replace(scene.wall_law, cor=0.0))):
        stop = simulate(changed, collisions=2000).stop
        assert stop.reason is StopReason.WALL_TRAP
        messages.append(stop.message)
    bound, exact, stays = messages
    assert "bounces ever faster at the wall: it stops by" in bound
    assert "at most" in bound
    assert "bounces infinitely often at the wall, until" in exact
    assert "stays at the wall, because the wall CoR is 0" in stays


def test_restitution_that_grows_as_balls_slow_down_ends_too() -> None:
    scene = lone(random.Random(5), 0.5, (0.5, 1.0, INF, 0.5, 0.3), INF)
    stop = simulate(replace(scene, wall_law=Viscoelastic(0.5, 20.0)), collisions=2000).stop
    assert stop.reason is StopReason.WALL_TRAP


def test_an_elastic_wall_traps_no_ball() -> None:
    """However many hits there are in a row."""
    scene = lone(random.Random(6), 1.0, (0.5, 1.0, INF, 1.0, INF), INF)
    trace = simulate(scene, collisions=ENDLESS + 1)
    assert trace.stop.reason is StopReason.COLLISIONS


def test_slides_at_a_smooth_wall_rub_nothing() -> None:
    scene = replace(gas("circle", 12, 0.15, cor=0.6), slides=True)
    events = simulate(rough(scene, 0.5, 0.3, INF, -1.0, INF), collisions=300).events
    assert events is not None
    assert events.tangential is not None
    slides = events.j == SLIDE
    assert np.count_nonzero(slides) > 3
    assert not np.any(events.tangential[slides])
    assert np.all(events.tangential[~events.at_wall & ~slides] != 0.0)
