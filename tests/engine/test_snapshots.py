"""Snapshots are the states that the collisions give, and change no bit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenes import gas, same_events, scene_of

from snooker_cli.engine import (
    nearest_times,
    replay,
    simulate,
    simulation,
    state_at,
    stored_times,
)
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace

SCENES: dict[str, Callable[[], Scene]] = {
    "everyone": lambda: gas("circle", 20, 0.3, cor=0.9),
    "everyone, free": lambda: gas("circle", 20, 0.3, mixed=True, container_mass=20.0),
    "cells": lambda: gas("periodic", 60, 0.3),
}
TIMES = [0.0, 1e-6, 0.03, 0.1, 0.11, 0.5, 1.0, 1.5, 1e9]


def moving(scene: Scene) -> bytes:
    columns = scene.positions, scene.velocities, scene.container_position, scene.container_velocity
    return b"".join(np.ascontiguousarray(column).tobytes() for column in columns)


@pytest.mark.parametrize("name", SCENES)
def test_they_are_what_a_replay_gives(name: str) -> None:
    """Over several epochs too: of 20 balls these are 16,384 collisions."""
    scene = SCENES[name]()
    plain = simulate(scene, collisions=40_000)
    times = [*TIMES[:-1], *np.linspace(2.0, plain.stop.time, 20)[:-1], 1e9]
    taken = simulate(scene, collisions=40_000, snapshots=times)
    assert same_events(plain.events, taken.events)
    assert moving(plain.finish) == moving(taken.finish)
    assert taken.snapshots.time.tolist() == times[:-1]
    replayed = replay(plain, times[:-1])
    for k in range(len(taken.snapshots)):
        snapshot = taken.snapshots.read(k)
        assert np.array_equal(snapshot.positions, replayed.positions[k])
        assert np.array_equal(snapshot.velocities, replayed.velocities[k])
        assert np.array_equal(snapshot.container_position, replayed.container_position[k])


def test_a_summary_is_that_without_snapshots() -> None:
    scene = SCENES["cells"]()
    plain, taken = (
        simulate(scene, collisions=3000, summary=True, snapshots=times) for times in ((), TIMES)
    )
    for name, column in plain.summary.series.columns.items():
        assert np.array_equal(column, getattr(taken.summary.series, name)), name
    assert np.array_equal(plain.summary.speed_histogram, taken.summary.speed_histogram)


def test_they_go_on_after_the_last_collision_up_to_the_end() -> None:
    """A ball flies 3 m/s and stops nowhere; the end is one of the times."""
    balls = [(-3.0, 0.0, 1.0, 0.0, 1.0, 1.0), (3.0, 0.0, -1.0, 0.0, 1.0, 1.0)]
    trace = simulate(scene_of(balls, restitution=0.0), time=10.0, snapshots=[1.0, 5.0, 10.0, 11.0])
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.snapshots.time.tolist() == [1.0, 5.0, 10.0]
    assert trace.snapshots.read(0).positions[:, 0].tolist() == [-2.0, 2.0]
    assert trace.snapshots.read(2).positions[:, 0].tolist() == [-1.0, 1.0]


def test_a_sink_gets_them_one_by_one() -> None:
    scene, got = SCENES["cells"](), []
    trace = simulate(
        scene, time=1.0, summary=True, snapshots=TIMES, states=lambda *one: got.append(one)
    )
    assert trace.snapshots is None
    kept = simulate(scene, time=1.0, summary=True, snapshots=TIMES)
    assert [time for time, _ in got] == kept.snapshots.time.tolist() == TIMES[:7]
    assert [moving(one) for _, one in got] == [moving(kept.snapshots.read(k)) for k in range(7)]


@pytest.mark.parametrize("times", [[1.0, 0.5], [-1.0]])
def test_times_that_do_not_ascend_are_refused(times: list[float]) -> None:
    with pytest.raises(ValueError, match="ascend"):
        simulate(SCENES["cells"](), time=1.0, snapshots=times)


# --- states of a trace ------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stored() -> Trace:
    return simulate(SCENES["cells"](), time=2.0, summary=True, snapshots=[0.5, 1.0])


def test_a_state_is_the_nearest_that_is_stored(stored: Trace) -> None:
    assert stored_times(stored).tolist() == [0.0, 0.5, 1.0, 2.0]
    for time, at in ((0.1, 0.0), (0.3, 0.5), (0.9, 1.0), (1.6, 2.0), (2.0, 2.0)):
        found, scene = state_at(stored, time)
        assert found == at
        expected = {0.0: stored.start, 2.0: stored.finish}
        wanted = expected[at] if at in expected else stored.snapshots.read(int(at > 0.5))
        assert moving(scene) == moving(wanted)
    assert nearest_times(stored, [0.1, 0.2, 0.45, 1.9]).tolist() == [0.0, 0.5, 2.0]
    assert replay(stored, [0.1, 0.45]).time.tolist() == [0.0, 0.5]


def test_a_state_of_collisions_is_at_its_own_time() -> None:
    trace = simulate(SCENES["cells"](), time=2.0)
    assert state_at(trace, 0.7)[0] == 0.7
    assert moving(state_at(trace, 2.0)[1]) == moving(trace.finish)
    with pytest.raises(ValueError, match="within 0"):
        state_at(trace, 2.5)


def test_balls_in_the_order_of_their_cells_are_those_of_the_scene(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = SCENES["cells"]()
    plain = simulate(scene, collisions=6000, snapshots=TIMES[1:6])
    monkeypatch.setattr(simulation, "REORDERED", 10)
    sorted_by_cells = simulate(scene, collisions=6000, snapshots=TIMES[1:6])
    for k in range(5):
        assert moving(plain.snapshots.read(k)) == moving(sorted_by_cells.snapshots.read(k))
