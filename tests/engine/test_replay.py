"""The state at any time, from the list of collisions; and summaries, which need no list."""

import math
import os
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import (
    EPSILON,
    EVERYONE,
    NEIGHBOURS,
    displaced,
    gas,
    mixed_scene,
    report_scene,
    same_events,
    scene_of,
    sort_often,
)

from snooker_cli.engine import States, replay, replayed, series, simulate
from snooker_cli.engine.replay import Replay, batch_series, repeat_events
from snooker_cli.engine.simulation import Simulation
from snooker_cli.scene import Scene
from snooker_cli.trace import SPEED_BIN, SPEED_BINS, Series, StopReason, Trace


def gas_in_cells(shape: str, **changes: Any) -> Scene:
    """A gas whose container is not at the origin, or moves."""
    return displaced(gas(shape, 120, 0.3, cor=0.95, **changes), drift=(0.5, -0.25))


SCENES = {
    "fixed": lambda: report_scene(cor=0.9, wall_cor=1.0),
    "free, mixed": lambda: mixed_scene(50.0, 0.95),
    "fixed, mixed, tc": lambda: replace(mixed_scene(math.inf, 0.8), contact_duration=0.3),
    "free, elastic below": lambda: replace(mixed_scene(20.0, 0.8), elastic_below=4.0),
    "cells, box": lambda: gas_in_cells("box"),
    "cells, periodic, elastic below": lambda: replace(gas_in_cells("periodic"), elastic_below=4.0),
    # Balls change places in memory; what is added up over them is in the scene's order.
    "cells, sorted, free, mixed, tc": lambda: replace(
        gas_in_cells("circle", mixed=True, container_mass=50.0), contact_duration=0.3
    ),
}


@pytest.fixture(params=SCENES)
def name(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    if "sorted" in request.param:
        sort_often(monkeypatch, 50)
    return request.param


@pytest.fixture
def scene(name: str) -> Scene:
    return SCENES[name]()


@pytest.fixture
def search(name: str) -> type[Simulation]:
    return NEIGHBOURS if name.startswith("cells") else EVERYONE


def assert_state(states: States, row: int, scene: Scene) -> None:
    """Assert that a row of the states is the scene's, bit for bit."""
    assert np.array_equal(states.positions[row], scene.positions)
    assert np.array_equal(states.velocities[row], scene.velocities)
    assert np.array_equal(states.container_position[row], scene.container_position)
    assert np.array_equal(states.container_velocity[row], scene.container_velocity)


def test_any_moment_is_where_a_run_until_then_ends(scene, search):
    trace = simulate(scene, collisions=1500, search=search)
    moments = np.linspace(0.0, trace.stop.time, 9)
    states = replay(trace, moments)
    assert_state(states, 0, trace.start)
    assert_state(states, 8, trace.finish)
    for k, moment in enumerate(moments[1:-1], 1):
        until = simulate(scene, time=float(moment), search=search)
        assert (until.stop.reason, until.stop.time) == (StopReason.TIME, moment)
        assert same_events(until.events, trace.events[: len(until.events)])
        assert_state(states, k, until.finish)


def test_a_moment_of_a_collision_is_just_after_it():
    scene = scene_of([(0.0, 0.0, 4.5, 0.0, 1.0, 1.0)])
    states = replay(simulate(scene, time=3.0), [np.nextafter(2.0, 0.0), 2.0, 2.0, 3.0])
    assert states.velocities[:, 0, 0].tolist() == [4.5, -4.5, -4.5, -4.5]
    assert states.positions[:, 0, 0] == pytest.approx([9.0, 9.0, 9.0, 4.5], rel=EPSILON)


def test_states_in_batches_and_of_single_balls_have_the_same_bits(scene, search):
    trace = simulate(scene, collisions=900, search=search)
    moments = np.sort(np.append(np.linspace(0.0, trace.stop.time, 40), trace.events.time[::50]))
    whole = replay(trace, moments)
    parts = list(replayed(trace, moments, batch=7 * scene.number))
    assert [len(part.time) for part in parts[:-1]] == [7] * (len(parts) - 1)
    columns = {"time": whole.time, **whole.moving}
    for name, column in columns.items():
        assert np.array_equal(np.concatenate([getattr(part, name) for part in parts]), column)
    numbers = np.searchsorted(trace.events.time, moments, side="right")
    chosen = np.arange(len(moments)) % scene.number
    found, _ = Replay(trace).states(numbers, moments, chosen[:, np.newaxis])
    rows = np.arange(len(moments))
    assert np.array_equal(found[:, 2:, 0], whole.velocities[rows, chosen])


@pytest.mark.parametrize("times", [[1.0, 0.5], [-0.1, 0.5], [0.5, 1.1], [math.nan]])
def test_moments_must_ascend_within_the_run(times):
    trace = simulate(report_scene(), time=1.0)
    with pytest.raises(ValueError, match="ascend"):
        replay(trace, times)
    with pytest.raises(ValueError, match="summary"):
        replay(simulate(report_scene(), time=1.0, summary=True), [0.0])


# --- summaries ------------------------------------------------------------------------------

# A few events, so that the grid is as it was made, and enough events to halve the grid often.
LIMITS = [{"collisions": 300}, {"collisions": 30_000}, {"time": 1.7}]


def assert_columns(columns: Series, recorded: Trace) -> np.ndarray:
    """Assert the columns at their times, by a replay; the balls' energies, (t, N), J."""
    scene, events = recorded.start, recorded.events
    states = replay(recorded, columns.time)
    squares = np.sum(states.velocities**2, axis=2)
    energies = 0.5 * scene.masses * squares
    mass = scene.container_mass if scene.free else 0.0
    # Sums in another order differ by a rounding a term at most.
    a_sum = 4 * scene.number * EPSILON
    for column, expected in (
        (columns.kinetic_energy, energies.sum(axis=1)),
        (columns.mean_speed, np.sqrt(squares).mean(axis=1)),
        (columns.energy_moment, np.mean(energies**2, axis=1) / np.mean(energies, axis=1) ** 2),
        (columns.container_energy, 0.5 * mass * np.sum(states.container_velocity**2, axis=1)),
    ):
        assert np.allclose(column, expected, rtol=a_sum, atol=0)
    so_far = np.searchsorted(events.time, columns.time, side="right")
    distances = scene.radii[events.i] + scene.radii[events.j]
    rounding = max(len(events), scene.number) * EPSILON
    for column, terms, tolerance in (
        (columns.wall_events, events.at_wall, 0.0),
        (columns.pair_events, ~events.at_wall, 0.0),
        (columns.wall_impulse, events.impulse * events.at_wall, rounding),
        (columns.pair_virial, events.impulse * distances * ~events.at_wall, rounding),
    ):
        total = np.concatenate([[0.0], np.cumsum(terms)])[so_far]
        assert np.allclose(column, total, rtol=tolerance, atol=0)
    return energies


def test_series_after_each_event(scene, search):
    trace = simulate(scene, collisions=2000, search=search)
    columns = series(trace)
    assert np.array_equal(columns.time, np.concatenate([[0.0], trace.events.time]))
    assert_columns(columns, trace)


@pytest.mark.parametrize("limit", LIMITS)
def test_summary_says_what_the_events_say(scene, search, limit):
    recorded = simulate(scene, **limit, search=search)
    trace = simulate(scene, **limit, summary=True, search=search)
    assert trace.events is None
    assert trace.stop == recorded.stop
    assert (trace.wall_events, trace.pair_events) == (recorded.wall_events, recorded.pair_events)
    assert np.array_equal(trace.finish.positions, recorded.finish.positions)
    assert np.array_equal(trace.finish.velocities, recorded.finish.velocities)
    assert series(trace) is trace.summary.series
    energies = assert_columns(trace.summary.series, recorded)
    reduced = np.sqrt(energies / energies.mean(axis=1, keepdims=True))
    bins = np.minimum((reduced / SPEED_BIN).astype(int), SPEED_BINS - 1)
    histogram = np.array([np.bincount(row, minlength=SPEED_BINS) for row in bins])
    assert np.array_equal(trace.summary.speed_histogram, histogram)


@pytest.mark.parametrize("limit", LIMITS)
def test_grid_of_a_summary(limit):
    scene = SCENES["free, mixed"]()
    trace = simulate(scene, **limit, summary=True)
    time = trace.summary.series.time
    assert time[-1] == trace.stop.time
    step = time[-2] - time[-3]
    assert math.frexp(step)[0] == 0.5  # a power of two: every time is exact
    even = time[:-1] % step == 0
    grid, early = time[:-1][even], time[:-1][~even]
    assert np.array_equal(grid, step * np.arange(len(grid)))
    assert grid[-1] < trace.stop.time <= grid[-1] + step
    assert 200 < len(grid) <= 513
    # Where the step was finer it still is, for the 32 steps that were the first of each.
    finer, expected = early.min(initial=step), set()
    while finer < step:
        expected |= {k * finer for k in range(1, 32, 2)}
        finer *= 2
    assert set(early.tolist()) == expected
    first = trace.summary.series.kinetic_energy[0]
    assert first == pytest.approx(scene.kinetic_energy, rel=scene.number * EPSILON)


def test_summary_of_balls_at_rest():
    scene = report_scene()
    still = simulate(replace(scene, velocities=0 * scene.velocities), time=5.0, summary=True)
    assert np.all(still.summary.series.kinetic_energy == 0)
    assert np.all(still.summary.series.energy_moment == 0)
    assert not still.summary.speed_histogram.any()


def test_a_collision_on_the_grid_is_in_the_row_of_its_time():
    """9 m at 4.5 m/s take 2 s, and 2 s are on the grid: as ``replay``, just after it."""
    scene = scene_of([(0.0, 0.0, 4.5, 0.0, 1.0, 1.0)])
    columns = simulate(scene, time=3.0, summary=True).summary.series
    assert 2.0 in columns.time
    assert np.array_equal(columns.wall_events, columns.time >= 2.0)
    assert columns.wall_impulse[columns.time == 2.0].tolist() == [9.0]


@pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") not in {"", "0"}, reason="nothing is compiled here"
)
def test_replays_of_a_scene_have_one_type():
    """However the events are in memory, locked or not, and whatever is asked of them."""
    import numba

    trace = simulate(gas("circle", 60, 0.3), collisions=50, search=EVERYONE)
    assert trace.events is not None
    columns = {
        name: np.repeat(getattr(trace.events, name), 2)[::2]
        for name in ("time", "i", "j", "impulse")
    }
    for column in columns.values():
        column.flags.writeable = False
    locked = replace(trace, events=replace(trace.events, **columns))
    expected = series(trace)
    for stored in (trace, locked):
        run = Replay(stored)
        run.advance(20)
        assert np.array_equal(series(stored).kinetic_energy, expected.kinetic_energy)
        rows, _ = batch_series([stored], [np.array([0.1])])
        assert np.array_equal(rows.columns[0], expected.kinetic_energy)
    of_state = numba.typeof(run.states_of_one)
    types = [types for types in repeat_events.compiled.signatures if types[0] == of_state]
    assert len(types) == 1
