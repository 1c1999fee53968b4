"""Observables of a summary's grid beside those of every collision, and instants with many."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from snooker_cli.analysis import observables
from snooker_cli.config import parse
from snooker_cli.containers import Circle
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import (
    SERIES_UNITS,
    SPEED_BIN,
    SPEED_BINS,
    Series,
    Stop,
    StopReason,
    Summary,
    Trace,
)

SCENE = """\
container: {radius: 10.0, mass: 50.0}
balls: {rings: 2, radius: 1.0, mass: 1.0, speed: 10.0}
cor: 0.95
collisions: 400
"""


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Nineteen balls in a container that they move."""
    return starting_scene(parse(SCENE).experiment, 0)


@pytest.fixture(scope="module")
def simulated(scene: Scene) -> Trace:
    return simulate(scene, collisions=400)


@pytest.fixture(scope="module")
def summarised(scene: Scene) -> Trace:
    return simulate(scene, collisions=400, summary=True)


def test_summary_is_the_series_read_at_its_times(simulated: Trace, summarised: Trace) -> None:
    """To the bit: both read the same velocities and add the same impulses in the same order."""
    assert summarised.stop == simulated.stop
    assert (summarised.wall_events, summarised.pair_events) == (
        simulated.wall_events,
        simulated.pair_events,
    )
    full, grid = observables.series(simulated), observables.series(summarised)
    assert len(grid.time) > 100
    assert grid.time[-1] == simulated.stop.time
    *steps, last = np.diff(grid.time).tolist()
    assert max(steps) == steps[-1]
    assert 0 < last <= steps[-1]
    rows = np.searchsorted(full.time, grid.time, side="right") - 1
    for name in SERIES_UNITS:
        if name != "time":
            assert getattr(grid, name).tolist() == getattr(full, name)[rows].tolist(), name


def test_reduced_speeds_of_a_summary_are_those_of_its_rows(
    simulated: Trace, summarised: Trace
) -> None:
    """Its grid is finer than the samples, so that each has a row: the last one before it."""
    counts = observables.reduced_speed_counts(summarised)
    grid = observables.series(summarised).time
    samples = observables.sampling_times(summarised)
    before = grid[np.searchsorted(grid, samples, side="right") - 1]
    assert counts.sum() == 19 * len(samples)
    expected = np.zeros(SPEED_BINS)
    for found in observables.speeds(simulated, before):
        reduced = found * math.sqrt(1 / np.mean(found**2))
        bins, _ = np.histogram(np.minimum(reduced, 3.99), SPEED_BINS, (0, SPEED_BINS * SPEED_BIN))
        expected += bins
    assert counts.tolist() == expected.tolist()


def test_a_summary_has_no_states(summarised: Trace) -> None:
    with pytest.raises(ValueError, match="recorded as a summary"):
        observables.at_collisions(summarised)


def test_every_quantity_of_a_series_has_a_unit(summarised: Trace) -> None:
    assert [field.name for field in fields(observables.series(summarised))] == list(SERIES_UNITS)


@pytest.mark.parametrize("windows", [1, 7, 20])
def test_windows_of_a_summary_hold_what_collisions_gave(
    windows: int, simulated: Trace, summarised: Trace
) -> None:
    """At an edge of a window the impulse is off by that between two rows of the grid at most."""
    middles, found = observables.window_pressure(summarised, windows)
    same, expected = observables.window_pressure(simulated, windows)
    assert middles.tolist() == same.tolist()
    grid, end = observables.series(summarised), simulated.stop.time
    edges = np.linspace(0.0, end, windows + 1)
    steps = np.diff(grid.wall_impulse)[np.searchsorted(grid.time[1:-1], edges)]
    perimeter, width = 2 * math.pi * 10.0, end / windows
    allowed = (steps[:-1] + steps[1:]) / (perimeter * width)
    # Neither the start nor the end of a run is between two rows.
    allowed[0] -= steps[0] / (perimeter * width)
    allowed[-1] -= steps[-1] / (perimeter * width)
    assert np.all(np.abs(found - expected) <= allowed + 400 * EPSILON * expected.max())
    assert found.mean() == pytest.approx(expected.mean(), rel=400 * EPSILON)
    energies = observables.window_energy(summarised, windows)[1]
    exact = observables.window_energy(simulated, windows)[1]
    # Energies fall, and straight lines err by half of a step of time of what falls in it.
    step = np.diff(grid.time).max() / width / 2
    assert np.all(np.abs(energies - exact) <= step * np.abs(np.diff(exact, append=0)).max())


def test_the_rows_after_collisions_are_those_of_the_series(simulated: Trace) -> None:
    full, found = observables.series(simulated), observables.after_collisions(simulated)
    assert len(found.time) == 401
    for name in SERIES_UNITS:
        assert getattr(found, name).tolist() == getattr(full, name).tolist()


def test_the_rows_of_a_summary_come_near_those_after_collisions(
    simulated: Trace, summarised: Trace
) -> None:
    """A collision is somewhere between two rows of the grid; so is what is read for it."""
    full, found = observables.series(simulated), observables.after_collisions(summarised)
    step = np.diff(observables.series(summarised).time).max()
    assert found.wall_events + found.pair_events == pytest.approx(np.arange(401.0))
    assert np.all(np.abs(found.time - full.time) <= step)
    # On average it is neither early nor late: 400 errors of a step at most, uniform.
    assert abs(np.mean(found.time - full.time)) <= 4 * step / math.sqrt(12 * 400)
    assert np.all(np.diff(found.time) >= 0)
    assert found.kinetic_energy[-1] == pytest.approx(full.kinetic_energy[-1], rel=8 * EPSILON)


def test_of_many_collisions_some_are_read_evenly(
    simulated: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(observables, "MOST_POINTS", 40)
    found = observables.after_collisions(simulated)
    counts = found.wall_events + found.pair_events
    assert len(counts) == 41
    assert counts[[0, 1, -1]].tolist() == [0, 1, 400]
    assert set(np.diff(counts[1:])) <= {10, 11}


@pytest.mark.parametrize("summary", [False, True])
def test_a_collapse_is_one_instant(summary: bool) -> None:
    """At a CoR of 0.05 the clock comes to stand still, and thousands of collisions go on."""
    changes = ["balls.rings=3", "container.mass=1e7", "cor=0.05", "wall_cor=1"]
    scene = starting_scene(parse(SCENE, overrides=changes).experiment, 0)
    trace = simulate(scene, collisions=5000, summary=summary)
    assert trace.stop.reason is StopReason.COLLAPSE
    found = observables.after_collisions(trace)
    gaps = np.diff(found.time[1:])
    assert np.all(gaps > observables.INSTANT * trace.stop.time)
    assert len(found.time) < trace.collisions / 4
    assert found.wall_events[-1] + found.pair_events[-1] == trace.collisions
    calm = observables.before_collapse(trace)
    assert 0 < calm.collisions < trace.collisions / 4
    counted = observables.series(calm)
    assert counted.wall_events[-1] + counted.pair_events[-1] == calm.collisions
    assert counted.time[-1] < trace.stop.time
    assert observables.sampling_times(calm, 1.0)[-1] <= calm.stop.time
    other = replace(trace, stop=replace(trace.stop, reason=StopReason.COLLISIONS))
    assert observables.before_collapse(other) is other


def test_a_grid_is_read_where_collisions_are_on_average() -> None:
    """Two collisions in the first interval, none in the second, one in the third.

    Number j of m is j/(m + 1) of the way and changes j/m of what changes, if speeds stay.
    """
    trace = gridded(energy=[8.0, 8.0, 8.0, 8.0], events=[0, 2, 2, 3])
    found = observables.after_collisions(trace)
    assert found.time.tolist() == [0, pytest.approx(4 / 3), pytest.approx(8 / 3), 10]
    assert found.wall_events.tolist() == [0, 1, 2, 3]
    assert found.wall_impulse.tolist() == [0, 1, 2, 3]


def test_a_grid_is_read_as_a_gas_cools() -> None:
    """Speeds fall by the same factor in each collision: here to a quarter in two of them.

    So after one they are a half, the energy a quarter; impulses go like 1, 1/2 and times like
    1, 2, 4 with the thirds of the way between which two collisions are expected.
    """
    trace = gridded(energy=[16.0, 1.0, 1.0, 1.0], events=[0, 2, 2, 2])
    found = observables.after_collisions(trace)
    assert found.kinetic_energy.tolist() == pytest.approx([16, 4, 1])
    assert found.wall_impulse.tolist() == pytest.approx([0, 2 * (1 - 1 / 2) / (1 - 1 / 4), 2])
    third = 4 ** (1 / 3)
    assert found.time.tolist() == pytest.approx([0, 4 * (third - 1) / 3, 4 * (third**2 - 1) / 3])


def test_the_last_bounces_of_a_repeat_that_ended_early_are_one_instant() -> None:
    trace = gridded(energy=[8.0] * 4, events=[0, 1, 2, 5000])
    early = replace(trace, stop=replace(trace.stop, reason=StopReason.WALL_TRAP))
    assert observables.after_collisions(early).time.tolist() == [0, 2, 6, 12]
    assert observables.after_collisions(early).wall_events.tolist() == [0, 1, 2, 5000]
    assert len(observables.after_collisions(trace).time) == 5001


def gridded(energy: list[float], events: list[int]) -> Trace:
    """A summary with a row every 4 s; each collision gives the wall 1 kg m/s on average."""
    counts, zero = np.array(events, dtype=np.float64), np.zeros(4)
    found = Series(
        time=np.array([0.0, 4.0, 8.0, 12.0]),
        kinetic_energy=np.array(energy),
        container_energy=zero,
        wall_impulse=counts,
        pair_virial=zero,
        wall_events=counts,
        pair_events=zero,
        mean_speed=np.sqrt(np.array(energy)),
        energy_moment=np.ones(4),
    )
    summary = Summary(found, np.zeros((4, SPEED_BINS), dtype=np.int64))
    start = Scene(
        positions=np.array([[-3.0, 0.0], [3.0, 0.0]]),
        velocities=np.zeros((2, 2)),
        radii=np.ones(2),
        masses=np.ones(2),
        container=Circle(9.0),
        container_mass=math.inf,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=0.5,
        wall_restitution=0.5,
    )
    stop = Stop(StopReason.TIME, 12.0, (), "12 s reached")
    return Trace(start, start, stop, events[-1], 0, None, summary)
