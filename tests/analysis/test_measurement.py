"""Measurements of repeats: by hand, against slow loops, and gases that cool far."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scenes import gas, report_scene, scene_of

from snooker_cli.analysis import measurement, time_series
from snooker_cli.analysis.decay import decays
from snooker_cli.analysis.gas import Gas
from snooker_cli.analysis.measurement import (
    STATES,
    WINDOWS,
    Array,
    Measurement,
    measure,
    pairs_of,
    relaxed_at,
)
from snooker_cli.analysis.observables import INSTANT
from snooker_cli.analysis.time_series import ROWS, SKIPPED_COLLISIONS, series
from snooker_cli.containers import SHAPES, Circle, Container
from snooker_cli.engine import simulate, state_at
from snooker_cli.laws import Thermal
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import SPEED_BINS, Series, Stop, StopReason, Summary, Trace

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


BY_HAND = {
    # Impulses over the length of the wall.
    "circle": (18 * math.pi, [0, 0, 3], [0] * 15 + [3] + [0] * 4),
    "box": (64, [0, 0, 1.5, 3], [0] * 13 + [1.5, 1.5] + [0] * 5),
    # Kinetic energies of 2, 0.5 and 0.125 J over time, and half of 6 and 3 kg m²/s.
    "periodic": (256, [2, 4 + 3 + 3, 15.25], [2, 5] + [0.5] * 11 + [2] + [0.125] * 6),
}
"""A length or an area; pressures times this and the time at rows; the same in windows of 1 s."""

RATIOS = {"circle": (27 / 23, 29 / 23), "box": (48 / 43, 55 / 43), "periodic": (61 / 43, 61 / 43)}
"""PV/NT on the wall and by the virial: in the circle (3/(18π 20)) 81π/(2·0.2875), 1 + 6/23."""

AT_ROWS = {
    "circle": ([0, 1, 9, 20], [2, 2, 0.5, 0.125], [0, 0, 1, 3]),
    "box": ([0, 1, 7.75, 14, 20], [2, 2, 0.5, 0.3125, 0.125], [0, 0, 1, 2, 3]),
    "periodic": ([0, 1, 8, 20], [2, 2, 0.5, 0.125], [0, 0, 1, 2]),
}
"""Times, energies and collisions at rows, which are in the middle between collisions."""


@pytest.mark.parametrize("shape", BY_HAND)
def test_a_measurement_by_hand(shape: str) -> None:
    trace = head_on(Circle(9.0) if shape == "circle" else SHAPES[shape](16.0, 16.0))
    size, sums, windows = BY_HAND[shape]
    found, scene, near = measure([trace]), trace.start, {"rel": 16 * EPSILON, "abs": 0.0}
    # An event on an edge, such as at 16 s, belongs to the window before it.
    assert found.windows.pressure(scene)[0] * size == pytest.approx(windows, **near)
    assert found.whole.pressure(scene)[0] * size * 20 == pytest.approx(sum(windows), **near)
    ratios = found.whole.ideal_gas_ratio(scene)[0], found.whole.virial_ratio[0]
    assert ratios == pytest.approx(RATIOS[shape], **near)
    time, energy, events = AT_ROWS[shape]
    curve, rows = found.curve, len(time)
    assert curve.time[0, :rows].tolist() == time
    assert set(curve.time[0, rows:]) == {20.0}
    assert curve.energy[0, :rows].tolist() == energy
    assert curve.events[0, :rows].tolist() == events
    assert math.isnan(curve.pressure[0, 0])
    assert (curve.pressure * curve.time)[0, 1:rows] * size == pytest.approx(sums, **near)


def test_means_over_time_by_hand(in_circle: Trace) -> None:
    """2 J for 2 s, 1/2 J for 14 s, 1/8 J for 4 s."""
    found = measure([in_circle])
    assert found.windows.kinetic_energy[0].tolist() == [2] * 2 + [0.5] * 14 + [0.125] * 4
    assert found.whole.kinetic_energy[0] == pytest.approx(11.5 / 20, rel=4 * EPSILON)
    assert found.windows.from_window(16).kinetic_energy.tolist() == [0.125]
    assert (found.first_energy[0], found.last_energy[0]) == (2, 0.125)
    # The start, and the three collisions: two of them at one instant count as the last.
    curve = found.curve
    assert curve.weight[0, :4].tolist() == [1, 1, 1, 0]
    assert curve.group_time[0, :3].tolist() == [0, 2, 16]
    assert curve.group_kinetic[0, :3].tolist() == [2, 0.5, 0.125]
    assert found.collision_speed[0] == (0.5 + 0.25) / 2


# Against slow loops over the rows


def slow_averages(trace: Trace, low: float, high: float) -> dict[str, float]:
    """Means over time between two instants, and what collisions add; of a repeat with events."""
    columns, sums = series(trace), dict.fromkeys(time_series.Averages._fields, 0.0)
    time, scene = [*columns.time.tolist(), trace.stop.time], trace.start
    drift = np.sum((scene.masses @ scene.velocities) ** 2) / (2 * np.sum(scene.masses))
    walls = scene.container.has_wall or scene.number == 1
    for row in range(len(columns.time)):
        here = min(max(time[row], low), high)
        length = min(max(time[row + 1], low), high) - here
        kinetic, moment = columns.kinetic_energy[row], columns.energy_moment[row]
        meeting = kinetic / scene.number if walls else (kinetic - drift) / (scene.number - 1)
        terms = {
            "kinetic_energy": kinetic,
            "total_energy": kinetic + columns.container_energy[row],
            "root_energy": math.sqrt(kinetic),
            "meeting": meeting,
            "root_meeting": math.sqrt(meeting),
            "mean_speed": columns.mean_speed[row],
            "energy_moment": moment,
            "squares": moment * kinetic**2,
        }
        for name, value in terms.items():
            sums[name] += value * length / (high - low)
        if row and (low < time[row] <= high or (low == 0 == time[row])):
            for name in ("wall_impulse", "pair_virial", "wall_events", "pair_events"):
                sums[name] += getattr(columns, name)[row] - getattr(columns, name)[row - 1]
    return sums | {"length": high - low}


SCENES: dict[str, Callable[[], Trace]] = {
    "free circle": lambda: simulate(
        gas("circle", 19, 0.19, cor=0.95, container_mass=50.0), collisions=400
    ),
    "periodic": lambda: simulate(gas("periodic", 30, 0.2, cor=0.9), collisions=700),
    "sliding": lambda: simulate(
        replace(report_scene(cor=0.7, radius=0.2), slides=True), collisions=400
    ),
    "collapse": lambda: simulate(
        report_scene(cor=0.05, wall_cor=1.0, container_mass=1e7), collisions=3000
    ),
}


@pytest.fixture(scope="module", params=SCENES)
def measured(request: pytest.FixtureRequest) -> tuple[Trace, Measurement]:
    trace = SCENES[request.param]()
    return trace, measure([trace], pairs=pairs_of([trace]))


def test_windows_are_those_of_slow_loops(measured: tuple[Trace, Measurement]) -> None:
    trace, found = measured
    edges = np.linspace(0.0, trace.stop.time, WINDOWS + 1)
    for window, pair in enumerate(itertools.pairwise(edges)):
        for name, expected in slow_averages(trace, *pair).items():
            if not name.endswith(("wall_energy", "lost_energy")):
                value = getattr(found.windows, name)[0, window]
                assert value == pytest.approx(expected, rel=1e-10, abs=1e-300), name


def test_the_curve_is_that_of_slow_loops(measured: tuple[Trace, Measurement]) -> None:
    trace, found = measured
    columns, curve = series(trace), found.curve
    time, end = columns.time, trace.stop.time
    events = columns.wall_events + columns.pair_events
    instants = [
        row
        for row in range(len(time))
        if row in (0, len(time) - 1) or time[row + 1] - time[row] > INSTANT * time[row + 1]
    ]
    scene, moved = (
        trace.start,
        np.append(0.0, np.cumsum(columns.kinetic_energy[:-1] * np.diff(time))),
    )
    later = np.maximum(time, 1e-300)
    after = (moved + columns.pair_virial / 2) / (scene.container.area * later)
    if scene.container.has_wall:
        after = columns.wall_impulse / (scene.container.wall_length * later)
    taken = 0
    for group in range(ROWS - 1):
        number = int(curve.weight[0, group])
        rows = instants[taken : taken + number]
        taken += number
        if not number:
            continue
        for name, values in (
            ("group_time", time),
            ("group_kinetic", columns.kinetic_energy),
            ("group_others", columns.container_energy),
            ("group_pressure", after),
        ):
            value = getattr(curve, name)[0, group]
            if name == "group_pressure" and events[rows[0]] < SKIPPED_COLLISIONS:
                assert math.isnan(value)
            else:
                assert value == pytest.approx(np.mean(values[rows]), rel=1e-12, abs=1e-300), name
        # A row is between the last collision of a group and the first of the next.
        at = curve.time[0, group + 1]
        assert time[rows[-1]] <= at <= (time[rows[-1] + 1] if rows[-1] + 1 < len(time) else end)
        last = rows[-1]
        assert curve.kinetic_energy[0, group + 1] == columns.kinetic_energy[last]
        assert curve.events[0, group + 1] == events[last]
        if scene.container.has_wall:
            expected = columns.wall_impulse[last] / (scene.container.wall_length * at)
        else:
            moving = moved[last] + columns.kinetic_energy[last] * (at - time[last])
            expected = (moving + columns.pair_virial[last] / 2) / (scene.container.area * at)
        assert curve.pressure[0, group + 1] == pytest.approx(expected, rel=1e-12)
    assert taken == len(instants)
    assert curve.time[0, -1] == end
    first = next((row for row in instants if events[row] >= SKIPPED_COLLISIONS), None)
    if first is not None:
        expected = [time[first], after[first]]
        assert found.first_fitted_pressure[0] == pytest.approx(expected, rel=1e-12)


def test_after_the_relaxation_only_calm_collisions_count(
    measured: tuple[Trace, Measurement],
) -> None:
    trace, found = measured
    calm = measurement.observables.before_collapse(trace)
    since = measurement.relaxed_at(calm, found.skipped)
    assert found.calm_events[0].tolist() == [calm.wall_events, calm.pair_events]
    if math.isnan(since):
        assert np.isnan(found.relaxed.length).all()
        return
    expected = slow_averages(replace(calm), since, trace.stop.time)
    for name in ("wall_impulse", "pair_virial", "wall_events", "pair_events", "length"):
        assert getattr(found.relaxed, name)[0] == pytest.approx(expected[name], rel=1e-10), name


def test_repeats_are_measured_as_each_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """In one part or in several; with repeats that have fewer rows."""
    start = gas("circle", 19, 0.19, cor=0.9)
    traces = [simulate(start, collisions=number) for number in (300, 40, 3, 700)]
    alone = [measure([trace], pairs=100.0) for trace in traces]
    together = measure(traces, pairs=100.0)
    monkeypatch.setattr(measurement, "MOST_TOGETHER", 100)
    apart = measure(traces, pairs=100.0)
    for found in (together, apart):
        for row, single in enumerate(alone):
            for name in ("windows", "relaxed", "curve"):
                pairs = zip(getattr(found, name), getattr(single, name), strict=True)
                for values, own in pairs:
                    np.testing.assert_allclose(values[row], own[0], rtol=1e-12, err_msg=name)
            expected = pytest.approx(single.first_fitted_pressure[0], rel=1e-12, nan_ok=True)
            assert found.first_fitted_pressure[row] == expected
    chosen = together.chosen(np.array([False, True, False, True]))
    assert chosen.collisions.tolist() == [40, 700]
    assert chosen.curve.time.tolist() == together.curve.time[[1, 3]].tolist()


def test_a_curve_between_times_has_the_collisions_there() -> None:
    trace = simulate(gas("circle", 19, 0.19, cor=0.95), collisions=400)
    since, until = trace.stop.time / 4, trace.stop.time / 2
    curve = measure([trace], since, until).curve
    inside = (series(trace).time >= since) & (series(trace).time <= until)
    assert curve.weight.sum() == np.count_nonzero(inside)
    assert since * 0.9 < curve.time[0, 0] < curve.time[0, -1] < until * 1.1
    means = (curve.weight * curve.group_time).sum() / curve.weight.sum()
    assert means == pytest.approx(series(trace).time[inside].mean(), rel=1e-12)


def test_virial_and_wall_pressure_obey_the_virial_theorem() -> None:
    """Σ m x·v changes by 2∫K + ΣJd of the balls, less each wall hit's J times its distance."""
    trace = simulate(report_scene(), collisions=3000)
    end, scene = trace.stop.time, trace.start
    before, after = (
        float(np.sum(state.masses[:, None] * state.positions * state.velocities))
        for state in (trace.start, trace.finish)
    )
    whole = measure([trace]).whole
    virial = 2 * whole.kinetic_energy[0] * end * whole.virial_ratio[0]
    walls = 9.0 * whole.pressure(scene)[0] * scene.container.wall_length * end
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
    """Of two collisions between rows the first changes half and the second all of the way.

    So the mean after them is 3/4 of the way, at the middle of the time.
    """
    curve = measure([gridded([16.0, 8.0, 8.0, 4.0], [0, 2, 2, 3])]).curve
    some = curve.weight[0] > 0
    assert curve.weight[0, some].tolist() == [1, 2, 1]
    assert curve.group_time[0, some].tolist() == [0, 2, 10]
    assert curve.group_kinetic[0, some].tolist() == [16, 10, 4]
    windows = measure([gridded([16.0, 8.0, 8.0, 4.0], [0, 2, 2, 3])]).windows
    assert windows.kinetic_energy[0, [0, 10, 19]] == pytest.approx([15.4, 8, 4.3])
    assert windows.wall_events.sum() == pytest.approx(3)


def test_the_last_bounces_of_a_repeat_that_ended_early_are_one_instant() -> None:
    trace = gridded([8.0] * 4, [0, 1, 2, 5000])
    early = replace(trace, stop=trace.stop._replace(reason=StopReason.WALL_TRAP))
    curve = measure([early]).curve
    some = curve.weight[0] > 0
    assert curve.weight[0, some].tolist() == [1, 1, 1, 1]
    assert curve.group_time[0, some].tolist() == [0, 2, 6, 12]
    assert measure([trace]).curve.weight.sum() == 5001


def test_long_traces_of_many_balls_are_measured_every_few_collisions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Sums over balls have another order then."""
    trace = simulate(gas("periodic", 64, 0.3, cor=0.9), collisions=2000)
    full, whole = series(trace), measure([trace])
    monkeypatch.setattr(time_series, "MOST_MEASURED", 101 * 64)
    monkeypatch.setattr(measurement, "is_short", lambda _trace: False)
    thin, thinned = series(trace), measure([trace])
    for name, column in thin.columns.items():
        assert column == pytest.approx(getattr(full, name)[np.arange(101) * 20], rel=1e-13), name
    # Between rows all is taken to be straight: a fraction of what 20 of 2000 collisions change.
    many, few = (
        found.windows.pressure(trace.start).reshape(4, 5).mean(axis=1) for found in (whole, thinned)
    )
    assert few == pytest.approx(many, rel=2e-2)
    assert thinned.curve.weight.sum() == 2001


def test_long_repeats_are_measured_as_short_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """One by one, and with walls that give energy."""
    start = replace(gas("box", 20, 0.1, cor=0.9), wall_law=Thermal(20.0), wall_key=1)
    trace = simulate(start, collisions=600)
    short = measure([trace, trace], pairs=200.0)
    monkeypatch.setattr(measurement, "is_short", lambda _trace: False)
    long = measure([trace, trace], pairs=200.0)
    for name in ("windows", "relaxed", "curve"):
        for values, own in zip(getattr(short, name), getattr(long, name), strict=True):
            np.testing.assert_allclose(values, own, rtol=1e-11, err_msg=name)
    assert short.speeds.tolist() == long.speeds.tolist()
    assert short.speeds.sum() > 0
    # Walls gave, collisions took: the difference is what the balls have.
    change = short.windows.wall_energy.sum() - short.windows.lost_energy.sum()
    assert change / 2 == pytest.approx(short.last_energy[0] - short.first_energy[0], rel=1e-9)


# A gas that cools by many powers of ten: nearly all energy is lost in the first of many decades


def cooled(collisions: int, *, summary: bool) -> Trace:
    return simulate(gas("box", 60, 0.1, cor=0.9), collisions=collisions, summary=summary)


@pytest.fixture(scope="module")
def cold() -> list[Trace]:
    return [cooled(collisions, summary=True) for collisions in (4_000, 20_000, 40_000)]


def haff(trace: Trace) -> float:
    found = decays([trace], ("kinetic_energy",))
    return next(decay.fits[0].value for decay in found if decay.law == "haff")


def test_the_decay_does_not_depend_on_how_long_the_run_was(cold: list[Trace]) -> None:
    left = [float(measure([trace]).last_energy[0] / trace.start.kinetic_energy) for trace in cold]
    assert left[0] > 1e-8 > 1e-25 > left[1] > 1e-50 > left[2] > 0
    first, long = (haff(cooled(collisions, summary=False)) for collisions in (4_000, 40_000))
    assert first > 0.1
    assert long == pytest.approx(first, rel=0.005)
    assert list(map(haff, cold)) == pytest.approx([first] * 3, rel=0.01)


def test_energy_of_a_summary_is_straight_between_rows() -> None:
    """From 120 to 60 J in 61 rows, of which a window has several."""
    time = np.arange(61.0)
    trace = gridded((120 - time).tolist(), [0] * 61, tuple(time.tolist()))
    assert measure([trace]).whole.kinetic_energy[0] == pytest.approx(90)


def distance_of_two(positions: Array, _velocities: Array, scene: Scene) -> float:
    """From the first ball to the second one, m; nan beyond 5 m."""
    way = float(np.linalg.norm(positions[0] - positions[1]))
    assert scene.number == 2
    return way if way <= 5 else math.nan


@pytest.mark.parametrize("walls", [0.0, 1.0])
def test_a_quantity_of_states_is_a_mean_over_the_counted_part(walls: float) -> None:
    """After the relaxation, and in a steady part: beside states that are asked for one by one."""
    laws = {"wall_law": Thermal(walls)} if walls else {}
    scene = replace(gas("box", 2, 0.05), **laws, wall_key=7 if walls else None)
    trace = simulate(scene, collisions=600)
    found = measure(
        [trace], pairs=pairs_of([trace]), observables_of=lambda _: {"way": distance_of_two}
    )
    for first in (None, 5):
        since = 0.0 if first is None else first / WINDOWS * trace.stop.time
        times = found.state_times[0]
        assert len(times) == STATES
        values = []
        for time in times[times >= since].tolist():
            _, state = state_at(trace, time)
            values.append(distance_of_two(state.positions, state.velocities, scene))
        assert not np.isnan(values).all()
        mean = Gas(found, first_window=first).mean_of_states("way")
        assert mean[0] == pytest.approx(np.nanmean(values), rel=1e-12)
    relaxed = relaxed_at(trace, found.skipped)
    begins = 0.0 if walls else relaxed
    assert found.state_times[0, 0] == pytest.approx(
        begins + (trace.stop.time - begins) / STATES, rel=1e-12
    )
    assert np.isnan(Gas(found).mean_of_states("other")).all()
