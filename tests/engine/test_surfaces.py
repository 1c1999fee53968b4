"""Rough balls: exact collisions, what they keep, and the same trajectory from both searches."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import EPSILON
from scenes import gas as lattice_gas

from snooker_cli.config import parse
from snooker_cli.containers import Box, PeriodicBox
from snooker_cli.engine import replay, simulate
from snooker_cli.engine.simulation import AmongEveryone, AmongNeighbours
from snooker_cli.laws import Constant, Surface
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene

INF = math.inf


def rough(scene: Scene, *numbers: float, spins: Any = None) -> Scene:
    """A scene with a surface: q, β, μ, β and μ of the wall; spins in rad/s."""
    given = np.zeros(scene.number) if spins is None else np.array(spins, dtype=np.float64)
    return replace(scene, surface=Surface(*numbers), spins=given)


def two_balls(angle: float, friction: float, cor: float = 0.9) -> Scene:
    """Ball 0 hits ball 1, which is at rest, with a velocity at an angle to the line of centres."""
    speed = np.array([math.cos(angle), math.sin(angle)])
    places = np.array([[-2.0, 0.0] - speed / 2, [0.0, 0.0]])  # they touch after half a second
    return Scene(
        positions=places,
        velocities=np.array([speed, [0.0, 0.0]]),
        radii=np.array([1.0, 1.0]),
        masses=np.array([1.0, 3.0]),
        container=PeriodicBox(20.0, 20.0),
        container_mass=INF,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        pair_law=Constant(cor),
        wall_law=Constant(1.0),
        surface=Surface(0.5, 0.4, friction, -1.0, 0.0),
        spins=np.array([0.7, -0.3]),
    )


@pytest.mark.parametrize("friction", [INF, 0.2])
@pytest.mark.parametrize("degrees", [-75, -40, -10, 10, 40, 75])
def test_a_collision_is_exact(degrees: int, friction: float) -> None:
    """The formulas of Walton & Braun (1986) and Luding (1998), written for vectors in 3D."""
    scene = two_balls(math.radians(degrees), friction)
    trace = simulate(scene, collisions=1)
    assert trace.events is not None
    finish, (m, n), q = trace.finish, scene.masses, 0.5
    at = replay(trace, [trace.stop.time])
    offset = at.positions[0, 1] - at.positions[0, 0]
    normal = np.append(offset / np.hypot(*offset), 0.0)
    assert np.hypot(*offset) == pytest.approx(2.0, rel=1e-14)
    u, v = (np.append(velocity, 0.0) for velocity in scene.velocities)
    spin, other = (np.array([0.0, 0.0, spin]) for spin in (0.7, -0.3))
    surface = u - v + np.cross(spin, normal) - np.cross(other, -normal)
    along_normal = (surface @ normal) * normal
    tangent = surface - along_normal
    mu = m * n / (m + n)
    push = mu * (1 + 0.9) * along_normal
    rub = q / (1 + q) * mu * (1 + 0.4) * tangent
    most = friction * np.linalg.norm(push)
    if np.linalg.norm(rub) > most:
        rub *= most / np.linalg.norm(rub)
    impulse = push + rub
    assert finish.velocities[0] == pytest.approx((u - impulse / m)[:2], rel=1e-13, abs=1e-15)
    assert finish.velocities[1] == pytest.approx((v + impulse / n)[:2], rel=1e-13, abs=1e-15)
    turn = [
        spin - np.cross(normal, impulse) / (q * m),
        other + np.cross(-normal, impulse) / (q * n),
    ]
    assert finish.spins == pytest.approx([turn[0][2], turn[1][2]], rel=1e-13, abs=1e-15)
    assert abs(trace.events.tangential[0]) == pytest.approx(np.linalg.norm(rub), rel=1e-13)
    assert trace.events.impulse[0] == pytest.approx(np.linalg.norm(push), rel=1e-13)
    left = np.array([-normal[1], normal[0], 0.0])
    assert np.sign(trace.events.tangential[0]) == np.sign(rub @ left)


def energy(scene: Scene) -> float:
    return scene.kinetic_energy + scene.spin_energy


def angular_momentum(scene: Scene) -> float:
    """Of the balls about the origin, with their spins, kg m²/s."""
    x, y = scene.positions.T
    u, v = scene.velocities.T
    assert scene.surface is not None
    assert scene.spins is not None
    of_spins = scene.surface.inertia * scene.masses * scene.radii**2 * scene.spins
    return float(np.sum(scene.masses * (x * v - y * u) + of_spins))


GAS = """
container: {radius: 10.0}
balls:
  - {count: 20, radius: 0.5, speed: 10.0, start: random}
  - {count: 20, radius: 0.3, mass: 2.0, speed: 5.0}
cor: 1.0
collisions: 1000
"""


@pytest.fixture(scope="module")
def gas() -> Scene:
    """Forty balls of two sizes in a circle."""
    return starting_scene(parse(GAS).points()[0].config, 0)


def test_perfectly_rough_balls_keep_energy_and_angular_momentum(gas: Scene) -> None:
    """At a smooth wall: with e = 1 and β = 1 no collision loses anything."""
    scene = rough(gas, 0.5, 1.0, INF, -1.0, 0.0)
    finish = simulate(scene, collisions=4000).finish
    assert energy(finish) == pytest.approx(energy(scene), rel=1e-12)
    assert angular_momentum(finish) == pytest.approx(angular_momentum(scene), rel=1e-11)
    assert 0.2 < finish.spin_energy / finish.kinetic_energy < 0.8


def test_a_rough_wall_keeps_the_energy_too(gas: Scene) -> None:
    scene = rough(gas, 0.5, 1.0, INF, 1.0, INF)
    finish = simulate(scene, collisions=4000).finish
    assert energy(finish) == pytest.approx(energy(scene), rel=1e-12)
    assert abs(angular_momentum(finish) - angular_momentum(scene)) > 1.0


@pytest.mark.parametrize("friction", [0.3, INF])
def test_a_periodic_box_keeps_the_momentum(friction: float) -> None:
    """Of balls that lose energy; what one gives along the tangent, the other gets."""
    scene = rough(
        lattice_gas("periodic", 24, 0.3, mixed=True, cor=0.95), 0.4, 0.5, friction, -1.0, 0.0
    )
    before = scene.masses @ np.abs(scene.velocities)
    finish = simulate(scene, collisions=4000).finish
    assert energy(finish) < 0.5 * energy(scene)
    change = finish.masses @ finish.velocities - scene.masses @ scene.velocities
    assert np.all(np.abs(change) < 4000 * EPSILON * before)


@pytest.mark.parametrize("balls", [1, 5])
@pytest.mark.parametrize("cor", [-1.0, 1.0])
def test_time_can_be_reversed(balls: int, cor: float) -> None:
    """With reversed velocities and spins, elastic balls come back: a slip turns round, or stays.

    A hit of a straight wall enlarges an error by no more than a factor for all. Each of the five
    balls has four collisions or fewer on the way, and as many back. One enlarges an error by the
    path over the radius, less than 20.
    """
    scene = rough(lattice_gas("box", balls, 0.05), 0.5, cor, INF, cor, INF, spins=np.arange(balls))
    scene = replace(scene, velocities=scene.velocities + (balls == 1) * np.array([1.0, 0.7]))
    collisions = 1000 if balls == 1 else 10
    there = simulate(scene, collisions=collisions)
    time = there.stop.time * (1 + 1e-9)
    finish = simulate(scene, time=time).finish
    assert finish.spins is not None
    assert scene.spins is not None
    turned = replace(finish, velocities=-finish.velocities, spins=-finish.spins)
    back = simulate(turned, time=time)
    assert back.collisions == there.collisions == collisions
    enlarged = collisions**2 if balls == 1 else 20**4
    error = enlarged * EPSILON * max(scene.container.size)
    assert back.finish.spins is not None
    assert np.max(np.abs(back.finish.positions - scene.positions)) < error
    assert np.max(np.abs(back.finish.velocities + scene.velocities)) < error
    assert np.max(np.abs(back.finish.spins + scene.spins)) < error


@pytest.mark.parametrize("numbers", [(-1.0, INF), (0.5, 0.0)])
def test_smooth_numbers_give_the_trajectory_of_smooth_balls(
    gas: Scene, numbers: tuple[float, float]
) -> None:
    """To rounding for few collisions: an impulse of zero is added."""
    plain, same = (
        simulate(gas, collisions=60),
        simulate(rough(gas, 0.5, *numbers, *numbers), collisions=60),
    )
    assert plain.events is not None
    assert same.events is not None
    assert np.array_equal(plain.events.i, same.events.i)
    assert same.events.time == pytest.approx(plain.events.time, rel=1e-9)
    assert not np.any(same.finish.spins)
    assert not np.any(same.events.tangential)


def test_both_searches_give_the_same_bits(gas: Scene) -> None:
    cooling = replace(gas, pair_law=Constant(0.95), wall_law=Constant(0.95))
    scene = rough(cooling, 0.4, 0.3, 0.5, 0.1, 0.2, spins=np.linspace(-3, 3, 40))
    first, second = (
        simulate(scene, collisions=3000, search=search)
        for search in (AmongEveryone, AmongNeighbours)
    )
    assert first.events is not None
    assert second.events is not None
    for name in ("time", "i", "j", "impulse", "tangential"):
        assert np.array_equal(getattr(first.events, name), getattr(second.events, name)), name
    assert np.array_equal(first.finish.spins, second.finish.spins)
    at = replay(first, [0.0, first.stop.time])
    assert at.spins is not None
    assert np.array_equal(at.spins[0], scene.spins)
    assert np.array_equal(at.spins[1], first.finish.spins)


def test_friction_limits_the_tangential_impulse(gas: Scene) -> None:
    scene = rough(gas, 0.5, 1.0, 0.1, 1.0, 0.3)
    events = simulate(scene, collisions=2000).events
    assert events is not None
    assert events.tangential is not None
    share = np.abs(events.tangential) / events.impulse
    assert share[~events.at_wall].max() == pytest.approx(0.1, rel=1e-12)
    assert share[events.at_wall].max() == pytest.approx(0.3, rel=1e-12)


def test_a_ball_between_two_rough_walls_turns_round() -> None:
    """β = 1 at walls above and below a ball: each hit turns the slip round."""
    scene = Scene(
        positions=np.array([[0.0, 0.0]]),
        velocities=np.array([[1.0, 4.0]]),
        radii=np.array([1.0]),
        masses=np.array([2.0]),
        container=Box(100.0, 10.0),
        container_mass=INF,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        pair_law=Constant(1.0),
        wall_law=Constant(1.0),
        surface=Surface(0.5, 1.0, INF, 1.0, INF),
        spins=np.array([0.0]),
    )
    # g = (v, -u) along the wall's tangent; J = m/(1 + 1/q) 2 g changes u by 2/3 of g.
    u, spin = 1.0, 0.0
    for hits in range(1, 7):
        up = hits % 2 == 1  # the upper wall is hit first
        slip = -u + spin if up else u + spin
        change = 2 / 3 * slip
        u += change if up else -change
        spin -= change / 0.5
        finish = simulate(scene, collisions=hits).finish
        assert finish.velocities[0] == pytest.approx([u, -4.0 if up else 4.0], abs=1e-13)
        assert finish.spins == pytest.approx([spin], abs=1e-13)
