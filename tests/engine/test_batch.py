"""Repeats that are simulated in one call have the bits of each simulated alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from scenes import gas, mixed_scene, report_scene

from snooker_cli.engine import clock, simulate, simulate_batch, simulation
from snooker_cli.laws import Constant
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace


def content(value: Any) -> Any:
    """All that a trace holds, with arrays as their type and bytes."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if hasattr(value, "__dataclass_fields__"):
        return {name: content(field) for name, field in vars(value).items()}
    return value


def assert_same(traces: list[Trace], scenes: list[Scene], **limits: Any) -> None:
    """Assert that the traces are those of the scenes simulated one by one."""
    assert len(traces) == len(scenes)
    for trace, scene in zip(traces, scenes, strict=True):
        assert trace.start is scene
        assert content(trace) == content(simulate(scene, **limits))


def mixture(repeat: int, container_mass: float) -> Scene:
    """Different balls at the same places, with the velocities of a repeat."""
    scene = mixed_scene(container_mass, 0.9)
    return replace(scene, velocities=report_scene(repeat).velocities.copy())


def sliding(repeat: int) -> Scene:
    return replace(report_scene(repeat, radius=0.1, cor=0.8), slides=True)


SCENES: dict[str, Callable[[int], Scene]] = {
    "mixture, free": partial(mixture, container_mass=50.0),
    "tc": lambda repeat: replace(report_scene(repeat, cor=0.8), contact_duration=0.1),
    "traps": partial(report_scene, radius=0.1, cor=0.8),
    "sliding": sliding,
    "cells": lambda repeat: gas("circle", 60, 0.3, cor=0.95, seed=repeat),
    "box": lambda repeat: gas("box", 60, 0.3, cor=0.9, seed=repeat),
}


@pytest.mark.parametrize("summary", [False, True], ids=["events", "summary"])
@pytest.mark.parametrize("name", SCENES)
def test_a_batch_has_the_bits_of_its_repeats(name, summary):
    scenes = [SCENES[name](repeat) for repeat in range(5)]
    traces = simulate_batch(scenes, collisions=400, summary=summary)
    assert_same(traces, scenes, collisions=400, summary=summary)
    assert len({trace.stop.time for trace in traces}) == 5


@pytest.mark.parametrize("summary", [False, True], ids=["events", "summary"])
def test_some_repeats_end_before_others(summary, monkeypatch):
    """In wall traps at several times, and in several chunks or groups."""
    monkeypatch.setattr(simulation, "MOST_EVENTS", 500)
    monkeypatch.setattr(simulation, "MOST_SUMMARIES", 5)
    scenes = [SCENES["traps"](repeat) for repeat in range(12)]
    traces = simulate_batch(scenes, collisions=330, summary=summary)
    assert_same(traces, scenes, collisions=330, summary=summary)
    assert {trace.stop.reason for trace in traces} == {StopReason.COLLISIONS, StopReason.WALL_TRAP}
    assert len({trace.collisions for trace in traces}) > 4


def test_a_time_limit(monkeypatch):
    monkeypatch.setattr(simulation, "MOST_EVENTS", 700)
    scenes = [SCENES["sliding"](repeat) for repeat in range(6)]
    for limits in ({"time": 4.0}, {"time": 4.0, "collisions": 150}):
        traces = simulate_batch(scenes, **limits)
        assert_same(traces, scenes, **limits)
    assert len({trace.collisions for trace in simulate_batch(scenes, time=4.0)}) > 3


def test_epochs():
    """Each repeat sets its clocks back by another time."""
    events = 2 * clock.LEAST_EVENTS + 300
    scenes = [report_scene(repeat, container_mass=50.0) for repeat in range(3)]
    traces = simulate_batch(scenes, collisions=events)
    assert_same(traces, scenes, collisions=events)
    end = min(trace.stop.time for trace in traces)
    late = simulate_batch(scenes, time=0.9 * end)
    assert all(trace.collisions > clock.LEAST_EVENTS for trace in late)
    assert_same(late, scenes, time=0.9 * end)


def test_nothing_to_simulate():
    assert simulate_batch([], collisions=10) == []
    scenes = [report_scene(repeat) for repeat in range(2)]
    assert_same(simulate_batch(scenes, collisions=0), scenes, collisions=0)
    at_rest = [replace(scene, velocities=np.zeros((37, 2))) for scene in scenes]
    traces = simulate_batch(at_rest, time=2.0)
    assert_same(traces, at_rest, time=2.0)
    assert traces[1].stop.reason is StopReason.NOTHING_LEFT


def test_watch_counts_the_events_of_the_whole_batch(monkeypatch):
    monkeypatch.setattr(simulation, "MOST_EVENTS", 300)
    seen: list[tuple[int, float]] = []

    def watch(number: int, share: float) -> bool:
        seen.append((number, share))
        return True  # which stops nothing

    traces = simulate_batch([report_scene(k) for k in range(3)], collisions=250, watch=watch)
    assert seen == [(300, pytest.approx(0.4)), (300, pytest.approx(0.8)), (150, 1.0)]
    assert [trace.collisions for trace in traces] == [250] * 3


def test_watch_may_abandon_the_batch():
    def watch(number: int, share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate_batch([report_scene(k) for k in range(3)], collisions=250, watch=watch)


@pytest.mark.parametrize(
    "change",
    [{"radii": np.full(37, 0.9)}, {"pair_law": Constant(0.5)}, {"slides": True}],
    ids=lambda change: next(iter(change)),
)
def test_scenes_of_another_point_are_refused(change):
    scenes = [report_scene(), replace(report_scene(1), **change)]
    with pytest.raises(ValueError, match="differ in more than positions and velocities"):
        simulate_batch(scenes, collisions=10)
