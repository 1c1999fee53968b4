"""Balls that change places in memory keep their numbers, and nothing changes but roundings."""

import importlib

import numpy as np
import pytest
from scenes import EPSILON, displaced, gas, same_events
from test_twin import agreement

from snooker_cli.engine import replay, series, simulate, simulation
from snooker_cli.trace import StopReason, Trace

SIMULATE = importlib.import_module("snooker_cli.engine.simulation")

SCENES = {
    "light circle, mixed": lambda: gas(
        "circle", 120, 0.3, mixed=True, cor=0.95, container_mass=50.0
    ),
    "periodic": lambda: gas("periodic", 120, 0.3, cor=0.95),
}


def assert_summary(trace: Trace, recorded: Trace) -> None:
    """Assert that the grid's columns are those after the last event before."""
    summary, each = trace.summary.series, series(recorded)
    last = np.searchsorted(each.time, summary.time, side="right") - 1
    rounding = len(recorded.events) * EPSILON
    for column in ("wall_events", "pair_events"):
        assert np.array_equal(getattr(summary, column), getattr(each, column)[last])
    for column in ("kinetic_energy", "wall_impulse", "pair_virial", "mean_speed", "energy_moment"):
        expected = getattr(each, column)[last]
        assert np.allclose(getattr(summary, column), expected, rtol=rounding, atol=0)


def in_order(monkeypatch: pytest.MonkeyPatch, after: int, chunk: int) -> None:
    """Put balls into the order of their cells after so many events a ball, looking in chunks."""
    monkeypatch.setattr(simulation, "REORDERED", 2)
    monkeypatch.setattr(simulation, "REORDER_AFTER", after)
    monkeypatch.setattr(SIMULATE, "SMALL_CHUNK", chunk)


@pytest.mark.parametrize("name", SCENES)
def test_the_order_at_the_start_changes_nothing(name, monkeypatch):
    """Everything is predicted at time zero, in whichever order; an impulse is rounded otherwise
    when the other ball of a pair is the first."""
    scene = displaced(SCENES[name]())
    without = simulate(scene, collisions=2000, engine="cells")
    in_order(monkeypatch, 10**6, 500)
    ordered = simulate(scene, collisions=2000, engine="cells")
    assert np.array_equal(ordered.events.time, without.events.time)
    assert np.array_equal(ordered.events.i, without.events.i)
    assert np.array_equal(ordered.events.j, without.events.j)
    assert np.allclose(ordered.events.impulse, without.events.impulse, rtol=4 * EPSILON, atol=0)
    assert np.array_equal(ordered.finish.positions, without.finish.positions)
    assert np.array_equal(ordered.finish.velocities, without.finish.velocities)


@pytest.mark.parametrize("name", SCENES)
def test_any_number_of_new_orders_changes_nothing_but_roundings(name, monkeypatch):
    """A ball's contact is predicted again, from another moment."""
    scene = SCENES[name]()

    def ordered() -> Trace:
        with monkeypatch.context() as context:
            in_order(context, 1, 50)
            return simulate(scene, collisions=1500, engine="cells")

    assert agreement(scene, 1500, ordered().events, "cells") > 300


@pytest.mark.parametrize("name", SCENES)
def test_finish_and_summary_are_in_the_scenes_order(name, monkeypatch):
    in_order(monkeypatch, 1, 300)
    scene = displaced(SCENES[name]())
    trace = simulate(scene, collisions=3000, engine="cells")
    states = replay(trace, [trace.stop.time])
    assert np.array_equal(states.positions[0], trace.finish.positions)
    assert np.array_equal(states.velocities[0], trace.finish.velocities)


def test_a_summary_of_balls_in_another_order(monkeypatch):
    scene = SCENES["periodic"]()
    in_order(monkeypatch, 1, 300)
    recorded = simulate(scene, collisions=3000, engine="cells")
    trace = simulate(scene, collisions=3000, summary=True, engine="cells")
    assert np.array_equal(trace.finish.positions, recorded.finish.positions)
    assert_summary(trace, recorded)


def test_many_balls_are_kept_in_order():
    """6000 of them, in the order of their cells three times over."""
    scene = gas("periodic", 6000, 0.35, cor=0.98, aspect=2.0)
    assert scene.number > simulation.REORDERED
    trace = simulate(scene, collisions=250_000)
    assert trace.stop.reason is StopReason.COLLISIONS
    states = replay(trace, [trace.stop.time])
    assert np.array_equal(states.positions[0], trace.finish.positions)
    assert np.array_equal(states.velocities[0], trace.finish.velocities)
    assert np.bincount(np.append(trace.events.i, trace.events.j)).min() > 0
    again = simulate(scene, collisions=1000)
    assert same_events(again.events, trace.events[:1000])
    assert again.stop.time == trace.events.time[999]
