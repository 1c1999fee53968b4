"""Observables: against a run worked out by hand, and against direct sums over replayed states."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from snooker_cli.analysis import observables
from snooker_cli.config import parse
from snooker_cli.containers import Circle
from snooker_cli.engine import replay, simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import SPEED_BIN, SPEED_BINS, Events, Stop, StopReason, Trace


@pytest.fixture(scope="module")
def by_hand() -> Trace:
    """Two balls meet head-on, part at half their speed, and each hits the wall.

    Mass 2 kg, radius 1 m, 1 m/s; container of radius 9 m; CoR 1/2. The gap of 4 m closes in 2 s.
    From x = -1 and 1 the balls reach the wall, at x = -8 and 8, 14 s later. Every number is a
    dyadic fraction, so that every sum of them is exact.
    """
    start = Scene(
        positions=np.array([[-3.0, 0.0], [3.0, 0.0]]),
        velocities=np.array([[1.0, 0.0], [-1.0, 0.0]]),
        radii=np.ones(2),
        masses=np.full(2, 2.0),
        container=Circle(9.0),
        container_mass=math.inf,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=0.5,
        wall_restitution=0.5,
    )
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
    middles, windows = observables.window_pressure(by_hand, 5)
    assert middles.tolist() == [2, 6, 10, 14, 18]
    # An event on an edge, here at 16 s, belongs to the window before it.
    assert windows == pytest.approx([0, 0, 0, 3 / perimeter / 4, 0], rel=4 * EPSILON, abs=0)


def test_states_after_each_collision_by_hand(by_hand: Trace) -> None:
    states = observables.at_collisions(by_hand)
    assert states.time.tolist() == [0, 2, 16, 16]
    assert states.positions[..., 0].tolist() == [[-3, 3], [-1, 1], [-8, 8], [-8, 8]]
    assert states.velocities[..., 0].tolist()[:2] == [[1, -1], [-0.5, 0.5]]
    assert observables.central_distances(states).tolist() == [3, 3, 1, 1, 8, 8, 8, 8]
    assert observables.pair_distances(states, by_hand.start).tolist() == [6, 2, 16, 16]
    total = observables.momentum(states, by_hand.start)
    assert total.tolist() == [[0, 0]] * 4


def test_speeds_by_hand(by_hand: Trace) -> None:
    # One collision between two balls in 20 s: one each, so that five take 100 s.
    assert observables.sampling_times(by_hand).tolist() == []
    assert observables.sampling_times(by_hand, 0.25).tolist() == [5, 10, 15, 20]
    assert observables.speeds(by_hand, np.array([0.0, 5.0, 20.0])).tolist() == [
        [1, 1],
        [0.5, 0.5],
        [0.25, 0.25],
    ]
    # One pair collision for every quarter of them: a sample every 5 s, all of equal speeds.
    counts = observables.reduced_speed_counts(replace(by_hand, pair_events=20))
    assert counts[int(1 / SPEED_BIN)] == counts.sum() == 8


def test_means_over_time_by_hand(by_hand: Trace) -> None:
    energy = observables.series(by_hand).kinetic_energy
    # 2 J for 2 s, 1/2 J for 14 s, 1/8 J for 4 s.
    assert observables.time_mean(by_hand, energy) == (2 * 2 + 0.5 * 14 + 0.125 * 4) / 20
    assert observables.time_mean(by_hand, energy, 4.0) == (0.5 * 12 + 0.125 * 4) / 16
    assert math.isnan(observables.time_mean(by_hand, energy, 20.0))
    edges = np.array([0.0, 4.0, 16.0, 20.0])
    assert observables.time_means(by_hand, energy, edges).tolist() == [1.25, 0.5, 0.125]
    middles, windows = observables.window_energy(by_hand, 5)
    assert middles.tolist() == [2, 6, 10, 14, 18]
    assert windows.tolist() == [0.625, 0.25, 0.25, 0.25, 0.0625]
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
    nobody = np.empty(0, dtype=np.int32)
    events = Events(np.empty(0), nobody, nobody, np.empty(0))
    still = replace(by_hand, events=events, stop=replace(by_hand.stop, time=0.0))
    assert observables.mean_pressure(still) == 0
    assert math.isnan(observables.mean_temperature(still))
    assert math.isnan(observables.ideal_gas_ratio(still))
    for windows in (observables.window_pressure(still, 4), observables.window_energy(still, 4)):
        assert [column.tolist() for column in windows] == [[], []]


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
    assert observables.window_pressure(at_once, 1)[1][0] == observables.mean_pressure(at_once) > 0


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
    total = observables.momentum(states, simulated.start)
    assert total.shape == (401, 2)
    largest = 10.0 * simulated.start.number
    assert np.max(np.abs(total - total[0])) <= 8 * EPSILON * largest * 400
    moved = states.container_velocities * simulated.start.container_mass
    assert np.max(np.abs(moved)) > 1, "the container takes part"


def test_momentum_of_a_fixed_container_is_left_out(by_hand: Trace) -> None:
    states = observables.at_collisions(by_hand)
    one_ball = replace(states, velocities=states.velocities * [[[1], [0]]])
    assert observables.momentum(one_ball, by_hand.start)[:, 0].tolist() == [2, -1, 0.5, 0.5]


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
    middles, windows = observables.window_pressure(simulated, 7)
    total = math.fsum(impulse for _, impulse in hits)
    for k in range(7):
        low, high = np.linspace(0.0, end, 8)[k : k + 2]
        expected = math.fsum(impulse for when, impulse in hits if low < when <= high)
        # A window is the difference of two sums as large as the total.
        slack = rounding * total / (2 * math.pi * radius * end / 7)
        assert windows[k] == pytest.approx(
            expected / (2 * math.pi * radius * end / 7), rel=0, abs=slack
        )
        assert low < middles[k] < high
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
    nobody = np.empty(0, dtype=np.int32)
    empty = replace(by_hand, events=Events(np.empty(0), nobody, nobody, np.empty(0)))
    states = observables.at_collisions(empty)
    assert states.time.tolist() == [0]
    assert states.positions.tolist() == [by_hand.start.positions.tolist()]
    assert observables.series(empty).kinetic_energy.tolist() == [2]


def test_sampling_times_are_some_collisions_a_ball_apart(simulated: Trace) -> None:
    times = observables.sampling_times(simulated, 5.0)
    a_ball = 2 * simulated.pair_events / simulated.start.number
    assert len(times) == int(a_ball / 5) > 2
    np.testing.assert_allclose(np.diff(times), 5 / a_ball * simulated.stop.time, rtol=1e-12)
    assert times[0] == pytest.approx(5 / a_ball * simulated.stop.time)
    assert times[-1] <= simulated.stop.time


def test_sampling_times_count_from_when_they_should(simulated: Trace) -> None:
    found = observables.series(simulated)
    since = simulated.stop.time / 2
    later = simulated.pair_events - found.pair_events[found.time <= since][-1]
    times = observables.sampling_times(simulated, 2.0, since)
    a_ball = 2 * later / 19
    assert len(times) == int(a_ball / 2) > 2
    assert times[0] == pytest.approx(since + 2 / a_ball * (simulated.stop.time - since))
    assert observables.sampling_times(simulated, 2.0, simulated.stop.time).tolist() == []
    counts = observables.reduced_speed_counts(simulated, since)
    assert counts.sum() == 19 * len(observables.sampling_times(simulated, since=since))


def test_sampling_times_of_a_run_without_meetings(by_hand: Trace) -> None:
    alone = replace(by_hand, pair_events=0)
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
    nobody = np.empty(0, dtype=np.int32)
    trace = replace(
        by_hand,
        events=Events(np.empty(0), nobody, nobody, np.empty(0)),
        stop=replace(by_hand.stop, time=end),
        pair_events=pair_events,
    )
    samples = pair_events // 5
    assert len(observables.speeds(trace, observables.sampling_times(trace))) == samples
    assert observables.reduced_speed_counts(trace).sum() == 2 * samples


def test_reduced_speeds_are_counted_in_bins(simulated: Trace) -> None:
    counts = observables.reduced_speed_counts(simulated)
    times = observables.sampling_times(simulated)
    assert counts.shape == (SPEED_BINS,)
    assert counts.sum() == len(times) * 19
    expected = np.zeros(SPEED_BINS)
    for found in observables.speeds(simulated, times):
        temperature = np.mean(0.5 * found**2)
        reduced = found * math.sqrt(1 / (2 * temperature))
        bins, _ = np.histogram(np.minimum(reduced, 3.99), SPEED_BINS, (0, SPEED_BINS * SPEED_BIN))
        expected += bins
    assert counts.tolist() == expected.tolist()


def test_balls_at_rest_have_no_reduced_speed(by_hand: Trace) -> None:
    at_rest = replace(by_hand.start, velocities=np.zeros((2, 2)))
    stop = Stop(StopReason.NOTHING_LEFT, 0.0, (), "no collision lies ahead")
    nobody = np.empty(0, dtype=np.int32)
    trace = Trace(
        at_rest, at_rest, stop, 0, 0, Events(np.empty(0), nobody, nobody, np.empty(0)), None
    )
    assert observables.reduced_speed_counts(trace).sum() == 0
