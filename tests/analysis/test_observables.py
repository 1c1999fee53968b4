"""Observables by hand, by identities, against naive sums; summaries; gases that cool far."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import gas, report_scene, scene_of

from snooker_cli.analysis import decay, measurement, observables
from snooker_cli.analysis.observables import series
from snooker_cli.containers import SHAPES, Circle, Container
from snooker_cli.engine import replay, simulate
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import (
    CONTAINER,
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

# By hand


def head_on(container: Container) -> Trace:
    """20 s of two balls of 2 kg and 1 m, 6 m apart, that fly at each other at 1 m/s; CoR 1/2.

    They are off the centre of a box. They meet after 2 s and part at 0.5 m/s. In the circle both
    hit the wall at 16 s, in the box at 13.5 s and 14.5 s. In the periodic box they meet again at
    14 s. Impulses are 3, then 1.5 kg m/s. Every number is a dyadic fraction, so that sums are
    exact.
    """
    x, y = (0.0, 0.0) if isinstance(container, Circle) else (0.25, 1.0)
    balls = [(x - 3, y, 1.0, 0.0, 1.0, 2.0), (x + 3, y, -1.0, 0.0, 1.0, 2.0)]
    scene = scene_of(balls, container=container, restitution=0.5, wall_restitution=0.5)
    return simulate(scene, time=20.0)


@pytest.fixture(scope="module")
def in_circle() -> Trace:
    return head_on(Circle(9.0))


def test_series_by_hand(in_circle: Trace) -> None:
    found = series(in_circle)
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
    shared = replace(found, container_energy=np.array([2.0, 0.0, 0.0, 0.5]))
    assert observables.energy_ratio(shared).tolist() == [1, 0.125, 0.078125, 0.15625]


BY_HAND = {
    # Impulses over the length of the wall.
    "circle": (18 * math.pi, [2, 16, 16], [0, 1.5, 3], [0, 0, 0, 3, 0]),
    "box": (64, [2, 13.5, 14.5], [0, 1.5, 3], [0, 0, 0, 3, 0]),
    # Kinetic energies of 2, 0.5 and 0.125 J over time, and half of 6 and 3 kg m²/s.
    "periodic": (256, [2, 14], [4 + 3, 4 + 6 + 4.5], [8, 2, 2, 1 + 0.25 + 1.5, 0.5]),
}
"""A length or an area; times; pressures since the start times both; those in windows of 4 s."""

RATIOS = {"circle": (27 / 23, 29 / 23), "box": (48 / 43, 55 / 43), "periodic": (61 / 43, 61 / 43)}
"""PV/NT on the wall and by the virial: in the circle (3/(18π 20)) 81π/(2·0.2875), 1 + 6/23."""


@pytest.mark.parametrize("shape", BY_HAND)
def test_pressures_by_hand(shape: str) -> None:
    trace = head_on(Circle(9.0) if shape == "circle" else SHAPES[shape](16.0, 16.0))
    size, times, sums, windows = BY_HAND[shape]
    time, values = observables.cumulative_pressure(trace, series(trace))
    assert time.tolist() == times
    near = {"rel": 16 * EPSILON, "abs": 0.0}
    assert values * size * time == pytest.approx(sums, **near)
    # An event on an edge, such as at 16 s, belongs to the window before it.
    found = observables.pressures(trace, np.linspace(0.0, 20.0, 6))
    assert found * size * 4 == pytest.approx(windows, **near)
    assert observables.mean_pressure(trace) * size * 20 == pytest.approx(sum(windows), **near)
    late = observables.mean_pressure(trace, 4.0) * size * 16
    assert late == pytest.approx(sum(windows[1:]), **near)
    assert observables.mean_pressure(trace, 20.0) == 0
    ratios = observables.ideal_gas_ratio(trace), observables.virial_ratio(trace)
    assert ratios == pytest.approx(RATIOS[shape], **near)


def test_means_over_time_by_hand(in_circle: Trace) -> None:
    energy = series(in_circle).kinetic_energy  # 2 J for 2 s, 1/2 J for 14 s, 1/8 J for 4 s
    assert observables.time_mean(in_circle, energy) == (2 * 2 + 0.5 * 14 + 0.125 * 4) / 20
    assert observables.time_mean(in_circle, energy, 4.0) == (0.5 * 12 + 0.125 * 4) / 16
    edges = np.array([0.0, 4.0, 16.0, 20.0])
    assert observables.time_means(in_circle, energy, edges).tolist() == [1.25, 0.5, 0.125]
    assert observables.integrals(in_circle, energy, edges).tolist() == [0, 5, 11, 11.5]
    assert observables.integrals(in_circle, energy, edges[2:1:-1]).tolist() == [11]
    assert observables.mean_temperature(in_circle, 16.0) == 0.0625
    still = replace(in_circle, events=NOTHING, stop=in_circle.stop._replace(time=0.0))
    assert observables.mean_pressure(still) == 0
    for mean in (observables.mean_temperature, observables.ideal_gas_ratio):
        assert math.isnan(mean(still))
    assert math.isnan(observables.virial_ratio(still))


def test_mean_free_path_is_the_way_between_contacts(simulated: Trace) -> None:
    """From the states between events: the length of all ways over two ends for each contact."""
    events = simulated.events
    assert events is not None
    times = np.append(0.0, events.time)
    speeds = np.linalg.norm(replay(simulated, times).velocities, axis=2).sum(axis=1)
    ways = np.sum(speeds[:-1] * np.diff(times))
    expected = ways / (2 * np.count_nonzero(~events.at_wall))
    assert observables.mean_free_path(simulated) == pytest.approx(expected, rel=1e-10)


# Against naive sums


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Nineteen balls in a container that they move."""
    return gas("circle", 19, 0.19, cor=0.95, container_mass=50.0)


@pytest.fixture(scope="module")
def simulated(scene: Scene) -> Trace:
    return simulate(scene, collisions=400)


@pytest.fixture(scope="module")
def summarised(scene: Scene) -> Trace:
    return simulate(scene, collisions=400, summary=True)


def test_series_is_what_the_states_say(simulated: Trace) -> None:
    """Means of N numbers differ by their order of summing: at most N epsilon of the value."""
    found, start = series(simulated), simulated.start
    states = replay(simulated, found.time)
    speeds = np.hypot(states.velocities[..., 0], states.velocities[..., 1])
    energies = 0.5 * start.masses * speeds**2
    drift = np.sum(states.container_velocities**2, axis=1)
    for value, expected in (
        (found.kinetic_energy, energies.sum(axis=1)),
        (found.container_energy, 0.5 * start.container_mass * drift),
        (found.mean_speed, speeds.mean(axis=1)),
        (found.energy_moment, (energies**2).mean(axis=1) / energies.mean(axis=1) ** 2),
    ):
        np.testing.assert_allclose(value, expected, rtol=4 * start.number * EPSILON, atol=0)
    # Each collision rounds the two momenta that it changes, by some epsilon of the largest.
    total = observables.momentum(states.velocities, states.container_velocities, start)
    assert total[0] == pytest.approx(observables.total_momentum(start), abs=1e-12)
    assert np.max(np.abs(total - total[0])) <= 8 * EPSILON * speeds.sum(axis=1).max() * 400
    assert np.max(np.abs(states.container_velocities)) * 50 > 1, "the container takes part"


def test_pressures_are_sums_over_wall_events(simulated: Trace) -> None:
    events, end, length = (
        simulated.events,
        simulated.stop.time,
        simulated.start.container.wall_length,
    )
    impulses = np.where(events.j == CONTAINER, events.impulse, 0.0)
    _, values = observables.cumulative_pressure(simulated, series(simulated))
    np.testing.assert_allclose(values, np.cumsum(impulses) / (length * events.time), rtol=1e-12)
    edges = np.linspace(0.0, end, 8)
    expected = np.histogram(events.time, edges, weights=impulses)[0] / (length * end / 7)
    found = observables.pressures(simulated, edges)
    assert found == pytest.approx(expected, rel=0, abs=1e-12 * expected.max())


@pytest.mark.parametrize("shape", ["circle", "periodic"])
def test_distances_are_those_of_the_states(shape: str) -> None:
    """In a periodic box they are those of the nearest images."""
    trace = simulate(gas(shape, 20, 0.2), collisions=200)
    container, states = trace.start.container, observables.at_collisions(trace, 5)
    images = itertools.product((-1, 0, 1) if shape == "periodic" else (0,), repeat=2)
    steps = [np.array(image) * container.size for image in images]
    expected = [
        min(math.dist(a, b + step) for step in steps)
        for positions in states.positions
        for a, b in itertools.combinations(positions, 2)
    ]
    found = observables.pair_distances(states, trace.start)
    np.testing.assert_allclose(found, expected, rtol=64 * EPSILON)
    assert found.min() >= 2 * (1 - 64 * EPSILON * 10)  # nothing overlaps
    expected = [math.hypot(x, y) for x, y in states.positions.reshape(-1, 2)]
    np.testing.assert_allclose(observables.central_distances(states), expected, rtol=4 * EPSILON)


@pytest.mark.parametrize(("shape", "mixed"), [("circle", False), ("box", True), ("periodic", True)])
def test_the_closest_balls_are_found_among_neighbours(shape: str, mixed: bool) -> None:
    """Beside all pairs. In a mixture, small balls far apart have nearer centres than large ones."""
    trace = simulate(gas(shape, 60, 0.2, mixed=mixed), collisions=200)
    states, scene = observables.at_collisions(trace, 5), trace.start
    first, second = np.triu_indices(scene.number, k=1)
    distances = observables.pair_distances(states, scene).reshape(5, -1)
    overlap = float(np.max(scene.radii[first] + scene.radii[second] - distances))
    least, found = observables.closest(states, scene)
    assert least == pytest.approx(distances.min(), rel=64 * EPSILON)
    assert found == pytest.approx(overlap, abs=64 * EPSILON * max(scene.container.size))


@pytest.mark.parametrize("most", [2, 7, 400, 402])
def test_states_are_thinned_evenly(
    most: int, simulated: Trace, summarised: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    states = observables.at_collisions(simulated, most)
    rows = np.searchsorted(series(simulated).time, states.time)
    assert (len(rows), rows[0], rows[-1]) == (min(most, 401), 0, 400)
    assert np.ptp(np.diff(rows)) <= 1
    monkeypatch.setattr(observables, "MOST_BALLS", 2 * 19)  # the states in memory
    assert len(observables.at_collisions(simulated, most).time) == 2
    with pytest.raises(ValueError, match="recorded as a summary"):
        observables.at_collisions(summarised)


@pytest.mark.parametrize("since", [0.0, 0.5])
def test_speeds_are_counted_every_few_collisions(
    since: float, simulated: Trace, summarised: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At fixed times; a summary has a row before each."""
    monkeypatch.setattr(observables, "COLLISIONS_BETWEEN", 2.0)
    found, since = series(simulated), since * simulated.stop.time
    a_ball = 2 / 19 * (simulated.pair_events - found.pair_events[found.time <= since][-1])
    times = observables.sampling_times(simulated, since)
    assert len(times) == int(a_ball / 2) > 2
    step = 2 / a_ball * (simulated.stop.time - since)
    np.testing.assert_allclose(times, since + step * np.arange(1, len(times) + 1), rtol=1e-12)
    grid = series(summarised).time
    samples = observables.sampling_times(summarised, since)
    for trace, at in ((simulated, times), (summarised, grid[np.searchsorted(grid, samples) - 1])):
        speeds = np.hypot(*np.moveaxis(replay(simulated, at).velocities, -1, 0))
        reduced = speeds / np.sqrt(np.mean(speeds**2, axis=1, keepdims=True))
        bins = np.histogram(np.minimum(reduced, 3.99), SPEED_BINS, (0, SPEED_BINS * SPEED_BIN))[0]
        assert observables.reduced_speed_counts(trace, since).tolist() == bins.tolist()


def test_where_no_speeds_are_counted(in_circle: Trace) -> None:
    alone = replace(in_circle, events=in_circle.events[1:], pair_events=0)
    still = replace(in_circle, start=scene_of([(0, 0, 0, 0, 1, 1)]), events=NOTHING)
    for trace in (in_circle, alone, still, replace(still, stop=still.stop._replace(time=0.0))):
        assert observables.sampling_times(trace).tolist() == []
        assert observables.reduced_speed_counts(trace).sum() == 0


def test_virial_and_wall_pressure_obey_the_virial_theorem() -> None:
    """Σ m x·v changes by 2∫K + ΣJd of the balls, less each wall hit's J times its distance."""
    trace = simulate(report_scene(), collisions=3000)
    end, scene = trace.stop.time, trace.start
    before, after = (
        float(np.sum(state.masses[:, None] * state.positions * state.velocities))
        for state in (trace.start, trace.finish)
    )
    virial = 2 * scene.number * observables.mean_temperature(trace) * end
    virial *= observables.virial_ratio(trace)
    walls = 9.0 * observables.mean_pressure(trace) * scene.container.wall_length * end
    # Some thousand terms with their roundings.
    assert virial - walls == pytest.approx(after - before, abs=3000 * 8 * EPSILON * virial)


# Summaries, thinned series, and instants with many collisions


def gridded(
    energy: list[float], events: list[int], time: tuple[float, ...] = (0.0, 4.0, 8.0, 12.0)
) -> Trace:
    """A summary on a grid of times; each collision gives the wall 1 kg m/s on average."""
    counts, zero = np.array(events, dtype=np.float64), np.zeros(len(events))
    found = Series(
        *(np.array(time), np.array(energy), zero, counts, zero, counts, zero),
        mean_speed=np.sqrt(np.array(energy)),
        energy_moment=np.ones(len(events)),
    )
    summary = Summary(found, np.zeros((len(events), SPEED_BINS), dtype=np.int64))
    start = scene_of([(-3, 0, 0, 0, 1, 2), (3, 0, 0, 0, 1, 2)])
    return Trace(
        start, start, Stop(StopReason.TIME, time[-1], (), ""), events[-1], 0, None, summary
    )


def test_a_grid_is_read_where_collisions_are_on_average() -> None:
    """Number j of m collisions is j/(m + 1) of the way and changes j/m, if speeds stay."""
    found = observables.after_collisions(gridded([8.0] * 4, [0, 2, 2, 3]))
    assert found.time.tolist() == [0, pytest.approx(4 / 3), pytest.approx(8 / 3), 10]
    assert found.wall_events.tolist() == [0, 1, 2, 3]
    assert found.wall_impulse.tolist() == [0, 1, 2, 3]


def test_a_grid_is_read_as_a_gas_cools() -> None:
    """Speeds fall by the same factor in each collision: here to a quarter in two of them.

    So after one they are a half, the energy a quarter; impulses go like 1, 1/2 and times like
    1, 2, 4 with the thirds of the way between which two collisions are expected.
    """
    found = observables.after_collisions(gridded([16.0, 1.0, 1.0, 1.0], [0, 2, 2, 2]))
    assert found.kinetic_energy.tolist() == pytest.approx([16, 4, 1])
    assert found.wall_impulse.tolist() == pytest.approx([0, 2 * (1 - 1 / 2) / (1 - 1 / 4), 2])
    third = 4 ** (1 / 3)
    assert found.time.tolist() == pytest.approx([0, 4 * (third - 1) / 3, 4 * (third**2 - 1) / 3])


def test_the_last_bounces_of_a_repeat_that_ended_early_are_one_instant() -> None:
    trace = gridded([8.0] * 4, [0, 1, 2, 5000])
    early = replace(trace, stop=trace.stop._replace(reason=StopReason.WALL_TRAP))
    assert observables.after_collisions(early).time.tolist() == [0, 2, 6, 12]
    assert observables.after_collisions(early).wall_events.tolist() == [0, 1, 2, 5000]
    assert len(observables.after_collisions(trace).time) == 5001


@pytest.mark.parametrize(
    ("pair_events", "end"),
    [(335, 0.83840099289538), (360, 5.190794206126152), (185, 2.6658124511682817)],
)
def test_the_last_sample_is_not_rounded_past_the_end(pair_events: int, end: float) -> None:
    """Cases in which a multiple of the rounded interval comes out above the run's time."""
    trace = gridded([8.0, 8.0], [0, 0], (0.0, end))
    grid = replace(trace.summary.series, pair_events=np.array([0.0, pair_events]))
    times = observables.sampling_times(replace(trace, summary=replace(trace.summary, series=grid)))
    assert len(times) == pair_events // 5
    assert times[-1] <= end


def test_long_traces_of_many_balls_are_measured_every_few_collisions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Sums over balls have another order then."""
    trace = simulate(gas("periodic", 64, 0.3, cor=0.9), collisions=2000)
    full, edges = series(trace), np.linspace(0.0, trace.stop.time, 5)
    windows = observables.pressures(trace, edges)
    monkeypatch.setattr(observables, "MOST_MEASURED", 101 * 64)
    again = replace(trace)
    thin = series(again)
    assert series(again) is thin
    for name, column in thin.columns.items():
        assert column == pytest.approx(getattr(full, name)[np.arange(101) * 20], rel=1e-13), name
    # Between rows all is taken to be straight: a fraction of what 20 of 2000 collisions change.
    assert observables.pressures(again, edges) == pytest.approx(windows, rel=2e-2)
    assert len(observables.after_collisions(again).time) == 101


@pytest.mark.parametrize("summary", [False, True])
def test_a_collapse_is_one_instant(summary: bool) -> None:
    """At a CoR of 0.05 the clock comes to stand still, and thousands of collisions go on."""
    scene = report_scene(cor=0.05, wall_cor=1.0, container_mass=1e7)
    trace = simulate(scene, collisions=5000, summary=summary)
    assert trace.stop.reason is StopReason.COLLAPSE
    found = observables.after_collisions(trace)
    assert np.all(np.diff(found.time[1:]) > observables.INSTANT * trace.stop.time)
    assert len(found.time) < trace.collisions / 4
    assert found.wall_events[-1] + found.pair_events[-1] == trace.collisions
    calm = observables.before_collapse(trace)
    assert 0 < calm.collisions < trace.collisions / 4
    counted = series(calm)
    assert counted.wall_events[-1] + counted.pair_events[-1] == calm.collisions
    assert counted.time[-1] < trace.stop.time
    other = replace(trace, stop=trace.stop._replace(reason=StopReason.COLLISIONS))
    assert observables.before_collapse(other) is other


# A gas that cools by many powers of ten: nearly all energy is lost in the first of many decades


def cooled(collisions: int, *, summary: bool) -> Trace:
    return simulate(gas("box", 60, 0.1, cor=0.9), collisions=collisions, summary=summary)


@pytest.fixture(scope="module")
def cold() -> list[Trace]:
    return [cooled(collisions, summary=True) for collisions in (4_000, 20_000, 40_000)]


def test_the_decay_does_not_depend_on_how_long_the_run_was(cold: list[Trace]) -> None:
    left = [observables.energy_ratio(series(trace))[-1] for trace in cold]
    assert left[0] > 1e-8 > 1e-25 > left[1] > 1e-50 > left[2] > 0
    events = [cooled(collisions, summary=False) for collisions in (4_000, 40_000)]
    first, long, *grids = (
        decay.repeat_fits(trace, "kinetic_energy")["haff"].value for trace in (*events, *cold)
    )
    assert first > 0.1
    assert long == pytest.approx(first, rel=0.005)
    assert grids == pytest.approx([first] * 3, rel=0.01)


def test_means_of_a_late_window_do_not_feel_what_was_before(cold: list[Trace]) -> None:
    """Before it was 1e27 times as much; and what does not change has its mean to the bit."""
    trace, found = cold[1], series(cold[1])
    since = trace.stop.time / 2
    late, rows = observables.time_mean(trace, found.kinetic_energy, since), found.time >= since
    assert found.kinetic_energy[rows].min() <= late <= found.kinetic_energy[rows].max() * 1.01
    constant, edges = np.full(len(found.time), 0.1), np.linspace(0.0, trace.stop.time, 8)
    assert observables.time_means(trace, constant, edges).tolist() == [0.1] * 7


def test_means_of_windows_agree_with_the_pass_of_all_analyses_where_balls_slide() -> None:
    """A slide begins at the time of a collision, so that the energy has two values there."""
    scene = replace(report_scene(cor=0.7, radius=0.2), slides=True)
    trace = simulate(scene, collisions=400)
    assert trace.events is not None
    assert np.any(trace.events.j < CONTAINER)
    columns = series(trace)
    edges = np.linspace(0.0, trace.stop.time, measurement.WINDOWS + 1)
    energy = columns.kinetic_energy + columns.container_energy
    windows = measurement.measure([trace]).windows.total_energy[0]
    assert observables.time_means(trace, energy, edges) == pytest.approx(windows, rel=1e-12)


def test_a_window_has_whole_hits_where_balls_may_slide(in_circle: Trace) -> None:
    """Such a series has one more row, at the end; hits are not spread between rows for that."""
    sliding = simulate(replace(in_circle.start, slides=True), time=20.0)
    assert len(series(sliding).time) == len(series(in_circle).time) + 1
    edges = np.linspace(0.0, 20.0, 6)
    expected = observables.pressures(in_circle, edges).tolist()
    assert observables.pressures(sliding, edges).tolist() == expected
    for trace in (in_circle, sliding):
        energy = series(trace).kinetic_energy
        assert observables.time_means(trace, energy, edges).tolist()[:2] == [1.25, 0.5]
