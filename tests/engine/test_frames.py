"""Cold gases with a common velocity: the frame takes it over, and no digit of the rest is lost."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scenes import EPSILON, EVERYONE, NEIGHBOURS, gas, rough, sort_often

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine import replay, series, simulate, simulation
from snooker_cli.engine.frames import Laboratory
from snooker_cli.laws import Constant, Surface
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace

COLD: dict[str, Callable[[], Scene]] = {
    "periodic": partial(gas, "periodic", 40, 0.1, cor=0.9),
    "channel": partial(gas, "channel", 40, 0.1, cor=0.9, aspect=1.5),
    "rough": lambda: rough(COLD["periodic"]()),
    "free circle": lambda: rough(soft(gas("circle", 19, 0.2, container_mass=20.0))),
}
"""Gases that keep momentum, and cool until the squares of their speeds are no doubles."""


END = {False: StopReason.REST, True: StopReason.FAR}
"""How they end; of scenes with a free container the second."""


def soft(scene: Scene) -> Scene:
    """The scene with short contacts that lose nothing, so that no ball is trapped at a wall."""
    return replace(scene, contact_duration=0.01)


DRIFT = np.array([40960.0, -20480.0])
"""A common velocity, m/s: some 4,000 times what the balls have beside it."""


def drifting(scene: Scene, drift: np.ndarray = DRIFT) -> Scene:
    """The scene with a common velocity; in a channel it is along the walls."""
    if scene.container.has_wall and not scene.free:
        drift = drift * scene.container.periodic
    velocities = scene.velocities + drift
    moved = {"container_velocity": scene.container_velocity + drift} if scene.free else {}
    return replace(scene, velocities=velocities, **moved)


def momentum(scene: Scene) -> np.ndarray:
    """Of balls and a free container, kg m/s."""
    total = scene.masses @ scene.velocities
    return total + scene.container_mass * scene.container_velocity if scene.free else total


def with_frame(scene: Scene, collisions: int) -> tuple[Trace, np.ndarray]:
    """A repeat, and the velocity that the frame has taken over at its end, m/s."""
    run = simulation.usual_search(scene)([scene], collisions, None)
    while len(run.active):
        run.chunk()
    (trace,) = run.traces()
    return trace, run.states.frame.motion[0, [ks.U, ks.V]]


def frame_of(scene: Scene, collisions: int) -> np.ndarray:
    """The velocity that the frame has taken over after a number of collisions, m/s."""
    return with_frame(scene, collisions)[1]


@pytest.mark.parametrize("name", COLD)
def test_a_gas_cools_although_balls_share_a_rounding(name: str) -> None:
    """They share some 10^-15 m/s. After 300 collisions of each ball it is all that they have.

    Without walls the squares of speeds end it; a free container is too far away before.
    """
    scene = COLD[name]()
    trace, frame = with_frame(scene, 20_000 * scene.number)
    assert trace.stop.reason is END[scene.free], trace.stop.message
    assert trace.collisions > (500 if scene.free else 1000) * scene.number
    assert np.all(trace.events.impulse > 0.0)
    assert np.all(np.diff(trace.events.time) >= 0.0)
    shared = np.hypot(*frame)
    assert 0.0 < shared < 1e-10
    if not scene.free:
        assert f"beside the {shared:.3g} m/s that all share" in trace.stop.message


@pytest.mark.parametrize("name", COLD)
def test_a_gas_with_a_drift_is_the_same_gas(name: str) -> None:
    """The same collisions, until chaos makes a rounding large. The frame takes the drift over."""
    scene, number = COLD[name](), 100
    plain, (moved, taken) = simulate(scene, collisions=number), with_frame(drifting(scene), number)
    assert np.array_equal(moved.events.i, plain.events.i)
    assert np.array_equal(moved.events.j, plain.events.j)
    assert moved.events.time == pytest.approx(plain.events.time, rel=1e-6)
    assert moved.events.impulse == pytest.approx(plain.events.impulse, rel=1e-4)
    drift = drifting(scene).velocities[0] - scene.velocities[0]
    assert np.abs(taken - drift) == pytest.approx(0.0, abs=64.0)  # that of one of the balls


@pytest.mark.parametrize("name", COLD)
def test_a_gas_with_a_drift_cools_as_far(name: str) -> None:
    scene = drifting(COLD[name]())
    trace = simulate(scene, collisions=20_000 * scene.number)
    assert trace.stop.reason is END[scene.free], trace.stop.message
    assert ("places have lost half" if scene.free else "that all share") in trace.stop.message
    if scene.free:
        assert np.max(np.abs(trace.finish.container_position)) > 2.0**26 * scene.container.radius


@pytest.mark.parametrize("name", COLD)
@pytest.mark.parametrize("collisions", [50, 20_000])
def test_states_are_those_of_the_laboratory(name: str, collisions: int) -> None:
    """Momentum is kept, replays have the bits of the run, and energies are those of velocities."""
    scene = drifting(COLD[name]())
    trace = simulate(scene, collisions=collisions)
    finish = trace.finish
    speed = np.max(np.abs(momentum(scene)))
    rounding = EPSILON * speed * (collisions + 1)
    if scene.container.has_wall and not scene.free:  # nothing but the walls changes it
        assert momentum(finish)[1] == pytest.approx(momentum(scene)[1], abs=rounding)
    else:
        assert momentum(finish) == pytest.approx(momentum(scene), abs=rounding)
    again = replay(trace, [0.0, trace.stop.time])
    for quantity in ("positions", "velocities"):
        assert np.array_equal(getattr(again, quantity)[0], getattr(scene, quantity))
        assert np.array_equal(getattr(again, quantity)[1], getattr(finish, quantity))
    assert np.array_equal(again.container_velocity[1], finish.container_velocity)
    energy = 0.5 * np.sum(finish.masses * np.sum(finish.velocities**2, axis=1))
    columns = series(trace)
    assert columns.kinetic_energy[-1] == pytest.approx(energy, rel=1e-12)
    summary = simulate(scene, collisions=collisions, summary=True).summary.series
    assert summary.kinetic_energy[-1] == pytest.approx(energy, rel=1e-12)
    if scene.free:
        of_container = 0.5 * scene.container_mass * np.sum(finish.container_velocity**2)
        assert columns.container_energy[-1] == pytest.approx(of_container, rel=1e-12)


@pytest.mark.parametrize("name", ["periodic", "channel", "free circle"])
def test_balls_move_on_without_a_jump(name: str) -> None:
    """Between two times without a collision all fly by their velocity times the time."""
    scene = drifting(COLD[name](), DRIFT / 1024)  # taken over only when the gas is colder
    trace, frame = with_frame(scene, 20_000)
    assert np.any(frame != 0.0)
    times = trace.events.time
    gaps = np.flatnonzero(np.diff(times) > 1e-9 * times[:-1])[::97]
    begin, end = times[gaps], times[gaps] + 0.5 * (times[gaps + 1] - times[gaps])
    pairs = np.column_stack([begin, end]).ravel()
    states = replay(trace, pairs)
    ways = states.velocities[::2] * (end - begin)[:, np.newaxis, np.newaxis]
    rest = states.positions[1::2] - states.positions[::2] - ways
    if scene.container.period is not None:
        rest -= np.rint(rest / scene.container.period) * scene.container.period
    lengths = np.max(np.abs(ways), axis=(1, 2)) + np.max(np.abs(states.positions))
    drifted = np.max(np.abs(scene.velocities)) * times[gaps]
    assert np.all(np.max(np.abs(rest), axis=(1, 2)) <= 64 * EPSILON * (lengths + drifted))


def same(first: Trace, second: Trace) -> bool:
    columns = ("time", "i", "j", "impulse")
    pairs = [(getattr(first.events, name), getattr(second.events, name)) for name in columns]
    finishes = [(first.finish.positions, second.finish.positions)]
    finishes += [(first.finish.velocities, second.finish.velocities)]
    return all(np.array_equal(*pair) for pair in pairs + finishes)


def test_both_searches_renew_the_frame_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where balls are sorted by their cells."""
    scene = drifting(COLD["free circle"]())
    expected = simulate(scene, collisions=40_000, search=EVERYONE)
    assert expected.stop.reason is StopReason.FAR
    assert same(simulate(scene, collisions=40_000, search=NEIGHBOURS), expected)
    sort_often(monkeypatch, 100)
    expected = simulate(scene, collisions=1500, search=EVERYONE)  # later ways are ever longer
    assert same(simulate(scene, collisions=1500, search=NEIGHBOURS), expected)


def test_a_repeat_that_is_continued_has_the_same_frame() -> None:
    scene = drifting(COLD["periodic"]())
    expected = simulate(scene, collisions=30_000)
    first = simulate(scene, collisions=30_000, watch=lambda *_: True)
    rest = simulate(scene, collisions=30_000, checkpoint=first.checkpoint)
    assert 0 < len(first.events) < 30_000
    assert np.array_equal(rest.finish.velocities, expected.finish.velocities)
    assert np.array_equal(rest.finish.positions, expected.finish.positions)


@pytest.mark.long
def test_a_rough_wall_of_a_channel_is_at_rest_in_the_laboratory() -> None:
    """Friction at it slows a drift, by at most the friction times what balls give it across."""
    scene = drifting(rough(COLD["channel"]()))
    surface = Surface(0.5, 0.5, 0.3, 0.0, 0.1)
    trace = simulate(replace(scene, surface=surface), collisions=20_000)
    across = np.sum(trace.events.impulse[trace.events.at_wall])
    slowed = abs(momentum(scene)[1]) - abs(momentum(trace.finish)[1])
    assert 0.09 * across < slowed < 0.1 * across * (1 + 1e-9)
    assert np.any(frame_of(replace(scene, surface=surface), 20_000) != 0.0)


def test_between_walls_nothing_is_shared() -> None:
    """Two balls that fly side by side touch softly, and the walls turn both round."""
    for scene in (gas("box", 60, 0.1), gas("circle", 19, 0.2)):
        run = simulation.usual_search(scene)([scene], 1, None)
        assert run.states.frame == Laboratory(None)


def test_a_rotation_stays_and_is_resolved() -> None:
    """Balls in a smooth, elastic circle keep angular momentum and end on a common rotation.

    It is no frame: they bounce on along the wall, touch ever more rarely and more softly, but as a
    power of the number of hits. After 10,000 collisions each, impulses have most of their digits.
    """
    scene = replace(gas("circle", 19, 0.2), pair_law=Constant(0.9))
    spin = np.column_stack([-scene.positions[:, 1], scene.positions[:, 0]])
    trace = simulate(replace(scene, velocities=scene.velocities + spin), collisions=95_000)
    assert trace.stop.reason is StopReason.COLLISIONS
    late = trace.events[slice(80_000, None)]
    speed = math.sqrt(np.mean(np.sum(trace.finish.velocities**2, axis=1)))
    assert np.min(late.impulse[~late.at_wall]) > 1e-6 * speed
