"""Observables against a run worked out by hand, sums over replayed states, and summaries."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
import pytest

from snooker_cli.analysis import observables
from snooker_cli.config import parse
from snooker_cli.containers import Circle
from snooker_cli.engine import replay, simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import (
    SERIES_UNITS,
    SPEED_BIN,
    SPEED_BINS,
    Events,
    Series,
    Stop,
    StopReason,
    Summary,
    Trace,
)

NOTHING = Events(np.empty(0), np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0))


def speeds(trace: Trace, times: np.ndarray) -> np.ndarray:
    """Speeds of all balls at given times; (*t*, *N*), m/s."""
    return np.hypot(*np.moveaxis(replay(trace, times).velocities, -1, 0))


def window_pressures(trace: Trace, number: int) -> np.ndarray:
    return observables.pressures(trace, observables.windows(trace, number))


def window_energies(trace: Trace, number: int) -> np.ndarray:
    ratio = observables.energy_ratio(observables.series(trace))
    return observables.time_means(trace, ratio, observables.windows(trace, number))


def binned(found: np.ndarray) -> np.ndarray:
    """Balls of one mass by reduced speed."""
    reduced = found * math.sqrt(1 / np.mean(found**2))
    return np.histogram(np.minimum(reduced, 3.99), SPEED_BINS, (0, SPEED_BINS * SPEED_BIN))[0]


TIMES = (0.0, 4.0, 8.0, 12.0)


def two_balls(speed: float) -> Scene:
    """Two balls of 2 kg and radius 1 m that move towards each other, in a container of 9 m."""
    return Scene(
        positions=np.array([[-3.0, 0.0], [3.0, 0.0]]),
        velocities=np.array([[speed, 0.0], [-speed, 0.0]]),
        radii=np.ones(2),
        masses=np.full(2, 2.0),
        container=Circle(9.0),
        container_mass=math.inf,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=0.5,
        wall_restitution=0.5,
    )


@pytest.fixture(scope="module")
def by_hand() -> Trace:
    """Two balls meet head-on, part at half their speed, and each hits the wall.

    Mass 2 kg, radius 1 m, 1 m/s; container of radius 9 m; CoR 1/2. The gap of 4 m closes in 2 s.
    From x = -1 and 1 the balls reach the wall, at x = -8 and 8, 14 s later. Every number is a
    dyadic fraction, so that every sum of them is exact.
    """
    start = two_balls(1.0)
    finish = replace(
        start,
        positions=np.array([[-7.0, 0.0], [7.0, 0.0]]),
        velocities=np.array([[0.25, 0.0], [-0.25, 0.0]]),
    )
    events = Events(
        time=np.array([2.0, 16.0, 16.0]),
        i=np.array([0, 0, 1], dtype=np.int32),
        j=np.array([1, -1, -1], dtype=np.int32),
        # (1 + e) times the reduced mass times the speed of approach; at the wall, the mass.
        impulse=np.array([1.5 * 1.0 * 2.0, 1.5 * 2.0 * 0.5, 1.5 * 2.0 * 0.5]),
    )
    stop = Stop(StopReason.TIME, 20.0, (), "20 s reached")
    return Trace(start, finish, stop, wall_events=2, pair_events=1, events=events, summary=None)


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


# The run worked out by hand


def test_series_by_hand(by_hand: Trace) -> None:
    found = observables.series(by_hand)
    assert found.time.tolist() == [0, 2, 16, 16]
    assert found.kinetic_energy.tolist() == [2, 0.5, 0.3125, 0.125]
    assert found.container_energy.tolist() == [0, 0, 0, 0]
    assert found.wall_impulse.tolist() == [0, 0, 1.5, 3]
    assert found.pair_virial.tolist() == [0, 6, 6, 6]
    assert found.wall_events.tolist() == [0, 0, 1, 2]
    assert found.pair_events.tolist() == [0, 1, 1, 1]
    assert found.mean_speed.tolist() == [1, 0.5, 0.375, 0.25]
    # Energies 1/16 and 1/4: <k^2>/<k>^2 = (17/512) / (5/32)^2.
    assert found.energy_moment.tolist() == [1, 1, pytest.approx(1.36, rel=4 * EPSILON), 1]


def test_temperature_and_energy_ratio_by_hand(by_hand: Trace) -> None:
    found = observables.series(by_hand)
    assert observables.temperature(found, 2).tolist() == [1, 0.25, 0.15625, 0.0625]
    assert observables.energy_ratio(found).tolist() == [1, 0.25, 0.15625, 0.0625]
    shared = replace(found, container_energy=np.array([2.0, 0.0, 0.0, 0.5]))
    assert observables.energy_ratio(shared).tolist() == [1, 0.125, 0.078125, 0.15625]


def test_pressure_by_hand(by_hand: Trace) -> None:
    time, values = observables.cumulative_pressure(by_hand, observables.series(by_hand))
    assert time.tolist() == [2, 16, 16]
    perimeter = 2 * math.pi * 9
    assert values == pytest.approx(
        [0, 1.5 / perimeter / 16, 3 / perimeter / 16], rel=4 * EPSILON, abs=0
    )
    assert observables.windows(by_hand, 5).tolist() == [0, 4, 8, 12, 16, 20]
    windows = window_pressures(by_hand, 5)
    # An event on an edge, here at 16 s, belongs to the window before it.
    assert windows == pytest.approx([0, 0, 0, 3 / perimeter / 4, 0], rel=4 * EPSILON, abs=0)


def test_states_after_each_collision_by_hand(by_hand: Trace) -> None:
    states = observables.at_collisions(by_hand)
    assert states.time.tolist() == [0, 2, 16, 16]
    assert states.positions[..., 0].tolist() == [[-3, 3], [-1, 1], [-8, 8], [-8, 8]]
    assert states.velocities[..., 0].tolist()[:2] == [[1, -1], [-0.5, 0.5]]
    assert observables.central_distances(states).tolist() == [3, 3, 1, 1, 8, 8, 8, 8]
    assert observables.pair_distances(states, by_hand.start).tolist() == [6, 2, 16, 16]
    total = observables.momentum(states.velocities, states.container_velocities, by_hand.start)
    assert total.tolist() == [[0, 0]] * 4


def test_speeds_by_hand(by_hand: Trace, monkeypatch: pytest.MonkeyPatch) -> None:
    # One collision between two balls in 20 s: one each, so that five take 100 s.
    assert observables.sampling_times(by_hand).tolist() == []
    monkeypatch.setattr(observables, "COLLISIONS_BETWEEN", 0.25)
    # One pair collision for every quarter of them: a sample every 5 s, all of equal speeds.
    assert observables.sampling_times(by_hand).tolist() == [5, 10, 15, 20]
    counts = observables.reduced_speed_counts(by_hand)
    assert counts[int(1 / SPEED_BIN)] == counts.sum() == 8


def test_means_over_time_by_hand(by_hand: Trace) -> None:
    energy = observables.series(by_hand).kinetic_energy
    # 2 J for 2 s, 1/2 J for 14 s, 1/8 J for 4 s.
    assert observables.time_mean(by_hand, energy) == (2 * 2 + 0.5 * 14 + 0.125 * 4) / 20
    assert observables.time_mean(by_hand, energy, 4.0) == (0.5 * 12 + 0.125 * 4) / 16
    assert math.isnan(observables.time_mean(by_hand, energy, 20.0))
    edges = np.array([0.0, 4.0, 16.0, 20.0])
    assert observables.time_means(by_hand, energy, edges).tolist() == [1.25, 0.5, 0.125]
    assert window_energies(by_hand, 5).tolist() == [0.625, 0.25, 0.25, 0.25, 0.0625]
    assert observables.mean_temperature(by_hand) == 0.2875
    assert observables.mean_temperature(by_hand, 16.0) == 0.0625
    perimeter = 2 * math.pi * 9
    assert observables.mean_pressure(by_hand) == pytest.approx(3 / perimeter / 20, rel=4 * EPSILON)
    assert observables.mean_pressure(by_hand, 10.0) == pytest.approx(
        3 / perimeter / 10, rel=4 * EPSILON
    )
    assert observables.mean_pressure(by_hand, 16.0) == 0
    assert observables.mean_pressure(by_hand, 20.0) == 0
    # P V/(N T) with the area of 81 pi: 3/(18 pi 20) 81 pi/(2 * 0.2875).
    assert observables.ideal_gas_ratio(by_hand) == pytest.approx(
        0.675 / 0.575, rel=8 * EPSILON, abs=0
    )


def test_a_run_that_takes_no_time_has_no_means(by_hand: Trace) -> None:
    still = replace(by_hand, events=NOTHING, stop=replace(by_hand.stop, time=0.0))
    assert observables.mean_pressure(still) == 0
    assert math.isnan(observables.mean_temperature(still))
    assert math.isnan(observables.ideal_gas_ratio(still))
    assert len(window_pressures(still, 4)) == len(window_energies(still, 4)) == 0


def test_what_is_gained_by_hand(by_hand: Trace) -> None:
    events = observables.series(by_hand).wall_events
    assert [observables.gained(by_hand, events, since) for since in (0.0, 15.0, 16.0)] == [2, 2, 0]
    assert observables.so_far(by_hand, events, np.array([0.0, 15.9, 16.0, 20.0])).tolist() == [
        0,
        0,
        2,
        2,
    ]
    # A ball that touches the wall at the start hits it at time zero: that is part of the run.
    at_once = replace(by_hand, events=replace(by_hand.events, time=np.zeros(3)))
    assert observables.gained(at_once, events, 0.0) == 2
    assert observables.mean_pressure(at_once) > 0


def test_one_row_an_instant_by_hand(by_hand: Trace) -> None:
    found = observables.after_collisions(by_hand)
    assert found.time.tolist() == [0, 2, 16]
    assert found.kinetic_energy.tolist() == [2, 0.5, 0.125]
    assert found.wall_events.tolist() == [0, 0, 2]


def test_balls_are_equal_in_radius_and_mass(by_hand: Trace) -> None:
    scene = by_hand.start
    assert observables.equal_balls(scene)
    for name in ("radii", "masses"):
        assert not observables.equal_balls(replace(scene, **{name: np.array([1.0, 2.0])}))


# Against direct sums


def test_series_is_what_the_states_say(simulated: Trace) -> None:
    """Means of N numbers differ by their order of summing: at most N epsilon of the value."""
    found = observables.series(simulated)
    states = replay(simulated, found.time)
    number = simulated.start.number
    speeds = np.hypot(states.velocities[..., 0], states.velocities[..., 1])
    energies = 0.5 * simulated.start.masses * speeds**2
    drift = np.sum(states.container_velocities**2, axis=1)
    rounding = 4 * number * EPSILON
    for value, expected in (
        (found.kinetic_energy, energies.sum(axis=1)),
        (found.container_energy, 0.5 * simulated.start.container_mass * drift),
        (found.mean_speed, speeds.mean(axis=1)),
        (found.energy_moment, (energies**2).mean(axis=1) / energies.mean(axis=1) ** 2),
    ):
        np.testing.assert_allclose(value, expected, rtol=rounding, atol=0)
    assert found.kinetic_energy[0] == pytest.approx(simulated.start.kinetic_energy, rel=rounding)
    assert found.container_energy[-1] == pytest.approx(
        simulated.finish.container_energy, rel=rounding
    )
    assert (found.wall_events[-1], found.pair_events[-1]) == (
        simulated.wall_events,
        simulated.pair_events,
    )


def test_momentum_is_kept_by_balls_and_container(simulated: Trace) -> None:
    """Each collision rounds the two momenta it changes, by some epsilon of the largest."""
    states = observables.at_collisions(simulated)
    total = observables.momentum(states.velocities, states.container_velocities, simulated.start)
    assert total[0] == pytest.approx(observables.total_momentum(simulated.start), rel=1e-14)
    assert total.shape == (401, 2)
    largest = 10.0 * simulated.start.number
    assert np.max(np.abs(total - total[0])) <= 8 * EPSILON * largest * 400
    moved = states.container_velocities * simulated.start.container_mass
    assert np.max(np.abs(moved)) > 1, "the container takes part"


def test_momentum_of_a_fixed_container_is_left_out(by_hand: Trace) -> None:
    states = observables.at_collisions(by_hand)
    one_ball = states.velocities * [[[1], [0]]]
    total = observables.momentum(one_ball, states.container_velocities, by_hand.start)
    assert total[:, 0].tolist() == [2, -1, 0.5, 0.5]


def test_pressures_are_sums_over_wall_events(simulated: Trace) -> None:
    events, radius, end = simulated.events, 10.0, simulated.stop.time
    assert events is not None
    hits = [
        (time, impulse)
        for time, j, impulse in zip(events.time, events.j, events.impulse, strict=True)
        if j == -1
    ]
    rounding = 2 * len(hits) * EPSILON
    time, values = observables.cumulative_pressure(simulated, observables.series(simulated))
    assert time.tolist() == events.time.tolist()
    for k in (0, 57, 399):
        expected = math.fsum(impulse for when, impulse in hits if when <= time[k])
        assert values[k] == pytest.approx(
            expected / (2 * math.pi * radius * time[k]), rel=rounding, abs=0
        )
    windows = window_pressures(simulated, 7)
    total = math.fsum(impulse for _, impulse in hits)
    for k in range(7):
        low, high = np.linspace(0.0, end, 8)[k : k + 2]
        expected = math.fsum(impulse for when, impulse in hits if low < when <= high)
        # A window is the difference of two sums as large as the total.
        slack = rounding * total / (2 * math.pi * radius * end / 7)
        assert windows[k] == pytest.approx(
            expected / (2 * math.pi * radius * end / 7), rel=0, abs=slack
        )
    assert windows.mean() == pytest.approx(values[-1], rel=rounding)


def test_distances_are_those_of_the_states(simulated: Trace) -> None:
    states = observables.at_collisions(simulated, 5)
    central = observables.central_distances(states)
    pairs = observables.pair_distances(states, simulated.start)
    assert len(central) == 5 * 19
    assert len(pairs) == 5 * 19 * 18 // 2
    expected_central, expected_pairs = [], []
    for positions, middle in zip(states.positions, states.container_positions, strict=True):
        expected_central += [math.dist(ball, middle) for ball in positions]
        expected_pairs += [math.dist(*pair) for pair in itertools.combinations(positions, 2)]
    np.testing.assert_allclose(central, expected_central, rtol=4 * EPSILON, atol=1e-14)
    np.testing.assert_allclose(pairs, expected_pairs, rtol=4 * EPSILON)
    # Nothing overlaps or sticks out, to the rounding of positions of some 10 m.
    assert pairs.min() >= 2 - 64 * EPSILON * 10
    assert central.max() <= 9 + 64 * EPSILON * 10


@pytest.mark.parametrize("most", [2, 7, 400, 401, 402, 2000])
def test_states_are_thinned_evenly(most: int, simulated: Trace) -> None:
    events = simulated.events
    assert events is not None
    states = observables.at_collisions(simulated, most)
    assert len(states.time) == min(most, 401)
    times = [0.0, *events.time.tolist()]
    rows = [times.index(time) for time in states.time.tolist()]
    assert (rows[0], rows[-1]) == (0, 400)
    gaps = np.diff(rows)
    assert gaps.max() - gaps.min() <= 1


def test_a_run_without_collisions_has_its_start(by_hand: Trace) -> None:
    empty = replace(by_hand, events=NOTHING)
    states = observables.at_collisions(empty)
    assert states.time.tolist() == [0]
    assert states.positions.tolist() == [by_hand.start.positions.tolist()]
    assert observables.series(empty).kinetic_energy.tolist() == [2]


def test_sampling_times_are_some_collisions_a_ball_apart(simulated: Trace) -> None:
    times = observables.sampling_times(simulated)
    a_ball = 2 * simulated.pair_events / simulated.start.number
    assert len(times) == int(a_ball / 5) > 2
    np.testing.assert_allclose(np.diff(times), 5 / a_ball * simulated.stop.time, rtol=1e-12)
    assert times[0] == pytest.approx(5 / a_ball * simulated.stop.time)
    assert times[-1] <= simulated.stop.time


def test_sampling_times_count_from_when_they_should(
    simulated: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(observables, "COLLISIONS_BETWEEN", 2.0)
    found = observables.series(simulated)
    since = simulated.stop.time / 2
    later = simulated.pair_events - found.pair_events[found.time <= since][-1]
    times = observables.sampling_times(simulated, since)
    a_ball = 2 * later / 19
    assert len(times) == int(a_ball / 2) > 2
    assert times[0] == pytest.approx(since + 2 / a_ball * (simulated.stop.time - since))
    assert observables.sampling_times(simulated, simulated.stop.time).tolist() == []
    counts = observables.reduced_speed_counts(simulated, since)
    assert counts.sum() == 19 * len(times)


def test_sampling_times_of_a_run_without_meetings(by_hand: Trace) -> None:
    walls = by_hand.events[1:]
    alone = replace(by_hand, events=walls, pair_events=0)
    assert observables.sampling_times(alone).tolist() == []
    assert observables.reduced_speed_counts(alone).sum() == 0
    never = replace(alone, stop=replace(by_hand.stop, time=0.0))
    assert observables.sampling_times(never).tolist() == []


@pytest.mark.parametrize(
    ("pair_events", "end"),
    [(335, 0.83840099289538), (360, 5.190794206126152), (185, 2.6658124511682817)],
)
def test_the_last_sample_is_not_rounded_past_the_end(
    pair_events: int, end: float, by_hand: Trace
) -> None:
    """Cases in which a multiple of the rounded interval comes out above the run's time."""
    trace = gridded([8.0, 8.0], [0, 0], [0.0, end])
    grid = replace(trace.summary.series, pair_events=np.array([0.0, pair_events]))
    trace = replace(
        trace, summary=replace(trace.summary, series=grid), stop=replace(trace.stop, time=end)
    )
    times = observables.sampling_times(trace)
    assert len(times) == pair_events // 5
    assert times[-1] <= end


def test_reduced_speeds_are_counted_in_bins(simulated: Trace) -> None:
    counts = observables.reduced_speed_counts(simulated)
    times = observables.sampling_times(simulated)
    assert counts.shape == (SPEED_BINS,)
    assert counts.sum() == len(times) * 19
    assert counts.tolist() == sum(map(binned, speeds(simulated, times))).tolist()


def test_balls_at_rest_have_no_reduced_speed(by_hand: Trace) -> None:
    at_rest = replace(by_hand.start, velocities=np.zeros((2, 2)))
    stop = Stop(StopReason.NOTHING_LEFT, 0.0, (), "no collision lies ahead")
    trace = Trace(at_rest, at_rest, stop, 0, 0, NOTHING, None)
    assert observables.reduced_speed_counts(trace).sum() == 0


# Summaries, and instants with many collisions


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
    assert counts.tolist() == sum(map(binned, speeds(simulated, before))).tolist()


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
    found = window_pressures(summarised, windows)
    expected = window_pressures(simulated, windows)
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
    energies = window_energies(summarised, windows)
    exact = window_energies(simulated, windows)
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


def gridded(energy: list[float], events: list[int], time: Sequence[float] = TIMES) -> Trace:
    """A summary on a grid of times; each collision gives the wall 1 kg m/s on average."""
    counts, zero = np.array(events, dtype=np.float64), np.zeros(len(events))
    found = Series(
        time=np.array(time),
        kinetic_energy=np.array(energy),
        container_energy=zero,
        wall_impulse=counts,
        pair_virial=zero,
        wall_events=counts,
        pair_events=zero,
        mean_speed=np.sqrt(np.array(energy)),
        energy_moment=np.ones(len(events)),
    )
    summary = Summary(found, np.zeros((len(events), SPEED_BINS), dtype=np.int64))
    start = two_balls(0.0)
    stop = Stop(StopReason.TIME, 12.0, (), "12 s reached")
    return Trace(start, start, stop, events[-1], 0, None, summary)
