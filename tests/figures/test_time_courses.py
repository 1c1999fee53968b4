"""Energy, momentum and pressure over time, of one repeat and of all."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import ROUGH, STORED, around, in_circle, layers, made, shown, traces, why_not

from snooker_cli import theory, two_temperatures
from snooker_cli.analysis import gas, structure
from snooker_cli.analysis.measurement import measure
from snooker_cli.analysis.observables import standard_errors
from snooker_cli.analysis.structure import Array
from snooker_cli.engine import replay, series
from snooker_cli.figures import Line, Reference
from snooker_cli.figures.captions import MEAN_SPREAD, SPREAD, FigureBuilder
from snooker_cli.figures.figure_data import Band, Points, at_common_times, courses, lasting
from snooker_cli.figures.selection import Selection
from snooker_cli.runs import Run
from snooker_cli.scene import EPSILON, Scene


def test_energy_is_a_mean_over_the_repeats(decaying: Run) -> None:
    found = shown(decaying, "energy")
    records, lines = found.numbers["points"], layers(found, Line)
    assert [line.label for line in lines] == ["CoR 0.8", "CoR 0.9", "CoR 1"]
    assert [record["elastic"] for record in records] == [False, False, True]
    assert f"Lines: means over the repeats; bands: {MEAN_SPREAD}." in found.caption
    assert found.y_log  # at CoR 0.8 less than a tenth is left
    for index, (line, band) in enumerate(zip(lines, layers(found, Band)[:-1], strict=True)):
        curve = measure(traces(decaying, index)).curve
        curves = courses(curve.time, curve.energy / curve.energy[:, :1])
        end = min(time[-1] for time, _ in curves)
        longer = sorted(time[-1] for time, _ in curves)[-2]
        assert (line.x[0], line.x[-1], band.series) == (0.0, longer, index)
        all_there = line.x <= end
        rows = np.array([np.interp(line.x[all_there], *pair) for pair in curves])
        assert np.allclose(line.y[all_there], rows.mean(axis=0), rtol=1e-14)
        widths = (band.high - band.low)[all_there] / 2
        assert np.allclose(widths, standard_errors(rows), atol=1e-15)
        lasts = [pair for pair in curves if pair[0][-1] >= longer]
        assert line.y[-1] == pytest.approx(np.mean([np.interp(longer, *pair) for pair in lasts]))
        record, last = records[index], np.array([[np.interp(end, *pair)] for pair in curves])
        assert (record["time"], record["final_ratio"]) == (end, pytest.approx(last.mean()))
        if index < 2:
            assert record["final_ratio_error"] == pytest.approx(standard_errors(last)[0])
        worst = max(float(np.max(np.abs(ratio - 1))) for _, ratio in curves)
        assert (record["largest_deviation"], record["repeats"]) == (worst, 3)
    # Each energy is a sum over 19 balls, rounded at each.
    assert records[2]["largest_deviation"] < 200 * 19 * EPSILON
    (single,) = layers(shown(decaying, "energy", cor=0.9, repeat=1), Line)
    first = series(traces(decaying, 1)[1])
    total = first.kinetic_energy + first.container_energy
    assert (single.x[-1], single.y[-1]) == (first.time[-1], total[-1] / total[0])


def test_repeats_that_end_early_do_not_shorten_a_mean_course() -> None:
    """Nor does a long one lengthen it."""
    ends = [1.0, 8.0, 9.0, 10.0, 11.0, 900.0]
    curves = [(np.array([0.0, end]), np.array([1.0, 0.5])) for end in ends]
    assert [time[-1] for time, _ in lasting(curves)] == ends[1:]
    assert at_common_times(lasting(curves))[0][-1] == 8.0
    build = FigureBuilder(None, None, [[None]], {}, brief=1)  # type: ignore[list-item,arg-type]
    assert build._left_out().startswith("The result leaves out 1 repeat that ends before half")


def test_means_go_on_with_the_repeats_that_remain(decaying: Run) -> None:
    """One of many that is trapped at once does not end the mean of the others."""
    (point, *_), ends = decaying.points, [0.5, 8.0, 9.0, 10.0, 15.0, 900.0]
    curves = [(np.array([0.0, end]), np.array([k, k], float)) for k, end in enumerate(ends)]
    build = FigureBuilder(decaying, Selection(), [[point]], {"title": "x", "kind": "x"})
    times, rows = build.add_mean_course(0, point, curves)
    assert (times[-1], len(rows)) == (8.0, 5)  # results are of the same repeats at all times
    thick, thin = (line for line in build.lines if isinstance(line, Line))
    assert (thick.thin, thin.thin, thin.label) == (False, True, None)
    assert (thick.x[0], thin.x[0], thin.x[-1]) == (0.0, thick.x[-1], 15.0)
    assert thick.x[-1] <= 10.0 < thin.x[1]  # from there on two of six remain
    assert np.interp(0.4, thick.x, thick.y) == pytest.approx(2.5)
    assert np.interp(5.0, thick.x, thick.y) == pytest.approx(3.0)  # without the first
    assert thin.y[-1] == pytest.approx(4.5)
    (band,) = build.bands
    assert isinstance(band, Band)
    assert band.x[-1] == 15.0
    assert (band.high - band.low)[-1] / 2 == pytest.approx(0.5)  # of 4 and 5
    assert build._remaining_sentence() == (
        "Means go on with the repeats that remain, 2 of 6 at the end; thin: fewer than half."
    )


def test_a_few_repeats_that_last_a_bit_longer_draw_no_tail(decaying: Run) -> None:
    """Repeats of one number of collisions end at times that are near each other."""
    (point, *_), ends = decaying.points, [8.0, 8.5, 9.0, 9.2, 9.4]
    curves = [(np.array([0.0, end]), np.ones(2)) for end in ends]
    build = FigureBuilder(decaying, Selection(), [[point]], {"title": "x", "kind": "x"})
    build.add_mean_course(0, point, curves)
    (line,) = build.lines
    assert isinstance(line, Line)
    assert 8.9 < line.x[-1] <= 9.0  # as long as three of five are there
    assert build._remaining_sentence() == ""


def test_a_caption_says_where_the_shortest_repeat_ends_a_curve(tmp_path: Path) -> None:
    """Curves that need all repeats at each place: one is trapped at the wall early."""
    overrides = ("balls.rings=1", "cor=0.85", "wall_cor=null", "repeats=8", "seed=8")
    run = made(tmp_path / "run", *overrides)
    ends = np.array([trace.stop.time for trace in traces(run, 0)])
    collisions = np.array([len(trace.events or ()) for trace in traces(run, 0)])
    assert ends.min() < 0.5 * np.median(ends)
    sentence = "The shortest repeat ends a curve at {:.3g} {}; half of the repeats of its point"
    for name in ("haff-time", "a2", "cluster-growth"):
        assert sentence.format(ends.min(), "s") in shown(run, name).caption, name
    found = shown(run, "event-decay")
    assert sentence.format(collisions.min(), "collisions") in found.caption
    assert "ends a curve" not in shown(run, "energy").caption


def test_momentum_is_summed_from_the_states(decaying: Run) -> None:
    component, kind = 1, "momentum-y"
    found = shown(decaying, kind, cor=0.9, repeat=2)
    trace = traces(decaying, 1)[2]
    assert trace.events is not None
    states = replay(trace, np.append(0.0, trace.events.time))
    total = np.einsum("tic,i->tc", states.velocities, trace.start.masses)
    total += trace.start.container_mass * states.container_velocities
    deviation = total[:, component] / total[0, component] - 1
    assert found.numbers["largest_deviation"] == np.max(np.abs(deviation))
    (line,) = layers(found, Line)
    assert line.y.tolist() == (total[:, component] / total[0, component]).tolist()
    _, line = found.panel
    assert isinstance(line, Line)
    assert line.y.tolist() == (deviation / 1e-15).tolist()
    lines = [shown(decaying, kind, repeat=repeat, cor=0.9).panel[-1] for repeat in range(3)]
    of_all = shown(decaying, kind, cor=0.9)
    assert layers(of_all, Band)[-1].label == SPREAD
    band = of_all.panel[0]
    assert isinstance(band, Band)
    around(band, [(line.x, line.y) for line in lines if isinstance(line, Line)])
    # A collision rounds two momenta of at most that of a ball with all of the energy.
    largest = math.sqrt(2 * trace.start.kinetic_energy)
    bound = 4 * EPSILON * largest * len(line.x) / abs(total[0, component])
    assert found.numbers["largest_deviation"] < bound


def test_pressure_rises_from_zero_and_ends_at_the_mean(decaying: Run) -> None:
    found = shown(decaying, "pressure", cor=1.0)
    curve = measure(traces(decaying, 2)).curve
    curves = courses(curve.time, np.nan_to_num(curve.pressure))
    (line,) = layers(found, Line)
    end, longer, _ = sorted(time[-1] for time, _ in curves)
    assert (line.x[-1], line.y[0]) == (longer, 0.0)
    columns = series(traces(decaying, 2)[0])
    at_end = columns.wall_impulse[-1] / (20 * math.pi * columns.time[-1])
    (single,) = layers(shown(decaying, "pressure", cor=1.0, repeat=0), Line)
    assert single.y[-1] == pytest.approx(at_end, rel=1e-15)
    final = np.array([np.interp(end, *curve) for curve in curves])
    (point,) = found.numbers["points"]
    assert (found.unit("pressure"), found.unit("time")) == ("Pa·m", "s")
    assert point["pressure"] == pytest.approx(final.mean(), rel=1e-14)
    before = np.array([np.interp(line.x[100], *curve) for curve in curves])
    assert line.x[100] < end
    assert line.y[100] == pytest.approx(before.mean(), rel=1e-14)
    assert point["pressure_error"] == pytest.approx(final.std(ddof=1) / math.sqrt(3), rel=1e-12)
    (reference,) = layers(found, Reference)
    assert reference.value == in_circle(50.0, 1.0)


# Means over the repeats of what the states have.


def test_times_end_with_the_shortest_repeat_and_begin_at_zero(periodic: Run) -> None:
    found = shown(periodic, "hexatic-order", cor=0.8)
    (line,) = layers(found, Line)
    repeats = traces(periodic, 0)
    assert line.x[0] == 0
    shortest = min(trace.stop.time for trace in repeats)
    assert 0.97 * shortest < line.x[-1] < shortest
    # No time is that of a collision, where two balls touch.
    assert not np.any(np.isin(line.x, series(repeats[0]).time[1:]))
    rows = [structure.over_time(structure.hexatic_order, one, line.x[[20]]) for one in repeats]
    assert line.y[20] == pytest.approx(float(np.mean(rows)), rel=1e-12)
    (band, _) = layers(found, Band)
    error = float(standard_errors(np.array(rows))[0])
    assert (band.high[20] - band.low[20]) / 2 == pytest.approx(error, rel=1e-9)


def test_the_share_of_heat_is_that_of_the_last_states(periodic: Run) -> None:
    found = shown(periodic, "local-energy", cor=0.8)
    last = layers(found, Line)[0].x[[-1]]

    def share(positions: Array, velocities: Array, scene: Scene) -> float:
        heat = structure.local_energy(positions, velocities, scene)
        return heat / (scene.kinetic_energy / scene.number)

    shares = [structure.over_time(share, repeat, last) for repeat in traces(periodic, 0)]
    (point,) = found.numbers["points"]
    assert point["share"] == pytest.approx(float(np.mean(shares)), rel=1e-9)


def test_the_ratio_of_species_is_that_of_their_temperatures(mixture: Run) -> None:
    found = shown(mixture, "species-ratio")
    line, theory_line, entry = layers(found, Line)
    (record,) = found.numbers["points"]
    repeats = traces(mixture, 0)
    assert line.x[0] == 0.0
    assert line.x[-1] == pytest.approx(2 * 900 / 60, rel=0.05)
    shares = []
    for trace in repeats:
        scene = trace.start
        start = structure.species_temperature(scene.positions, scene.velocities, scene)
        shares.append(start / start.sum())
    first, second = np.mean(shares, axis=0)
    assert line.y[0] == pytest.approx(first / second, rel=1e-12)
    assert theory_line.y.tolist() == [record["theory"]] * 2
    assert record["theory"] == gas.species_ratio(repeats[0].start)
    assert record["theory"] > 1
    assert entry.label == "theory, equal cooling rates"
    assert "1: r = 0.6 m, m = 4 kg; 2: r = 0.4 m, m = 1 kg." in found.caption
    (band,) = [band for band in layers(found, Band) if len(band.x)]
    assert np.all(band.low <= line.y)
    assert np.all(line.y <= band.high)


def test_one_species_has_no_ratio(decaying: Run) -> None:
    assert "it needs 2 species of balls, not 1" in why_not(decaying, "species-ratio")


# --- rotation ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rough(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("rough") / "run", text=ROUGH)


def test_temperatures_of_motion_and_rotation_are_those_of_the_states(rough: Run) -> None:
    found = shown(rough, "rotation")
    moving, turning, *theory_lines = [line for line in layers(found, Line) if len(line.x)]
    ratio, expected = [line for line in found.panel if isinstance(line, Line)]
    assert moving.x[-1] == pytest.approx(2 * 1200 / 60, rel=1e-3)
    warm = []
    for trace in traces(rough, 0):
        ends = trace.start, trace.finish
        drift = float(np.sum((trace.start.masses @ trace.start.velocities) ** 2)) / 2 / 60
        first, last = ((scene.kinetic_energy - drift) / 59 for scene in ends)
        warm.append((last / first, trace.finish.spin_energy / 30 / first))
    means = np.mean(warm, axis=0)
    assert (moving.y[-1], turning.y[-1]) == pytest.approx(tuple(means), rel=1e-9)
    assert ratio.y[-1] == pytest.approx(np.mean([turn / move for move, turn in warm]), rel=1e-9)
    assert np.all(np.diff(moving.y) < 0)
    assert len(theory_lines) == 2
    assert expected.y[-1] == pytest.approx(two_temperatures.rough_ratio(0.9, 0.5, 0.5), rel=1e-4)
    assert found.y_log


def test_collisions_per_ball_are_the_same_in_all_figures(rough: Run) -> None:
    """Without walls each collision is of two balls."""
    courses = [line for line in layers(shown(rough, "rotation"), Line) if len(line.x)]
    (points,) = layers(shown(rough, "event-decay"), Points)
    assert points.x[-1] == 2 * 1200 / 60 == pytest.approx(courses[0].x[-1], rel=1e-3)


def test_rough_balls_have_no_figures_whose_theory_is_of_smooth_ones(tmp_path: Path) -> None:
    elastic = made(tmp_path / "run", "cor=1", "tangential_cor=1", text=ROUGH)
    for name in ("pressure-temperature", "mean-squared-displacement", "velocity-autocorrelation"):
        assert "spins take a part of the energy" in why_not(elastic, name)
    assert shown(elastic, "pressure").numbers["theory"] == []


def test_smooth_balls_have_no_rotation(decaying: Run) -> None:
    assert why_not(decaying, "rotation").startswith("smooth balls do not spin")


# --- stored states ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("stored") / "run", text=STORED)


def test_large_cells_of_an_elastic_fluid_have_a_limit(stored: Run, tmp_path: Path) -> None:
    """A gas that cools has clusters instead."""
    text = STORED.replace("cor: 0.8", "cor: 1").replace("30000", "300")
    elastic = made(tmp_path / "elastic", text=text)
    packing = next(elastic.traces(elastic.points[0])).start.packing_fraction
    limit = f"S(0), which is {theory.structure_at_zero(packing):.2g} at packing {packing:.2g}"
    assert limit in shown(elastic, "density-fluctuations").caption
    assert "S(0)" not in shown(stored, "density-fluctuations").caption


def test_figures_of_snapshots_have_the_stored_states(stored: Run) -> None:
    """At the times that both repeats have, without the end, which may be a collision."""
    first, second = traces(stored, 0)
    times = np.intersect1d(first.snapshots.time, second.snapshots.time)
    means = np.array(
        [
            [value(structure.mean_cluster, one.snapshots.read(k))[0] for k in range(len(times))]
            for one in (first, second)
        ]
    )
    figure = shown(stored, "cluster-growth")
    line = layers(figure, Line)[0]
    assert np.array_equal(line.x, times)
    assert np.allclose(line.y, means.mean(axis=0))
    assert math.isclose(figure.numbers["points"][0]["mean"], means[:, -1].mean())
    densities = [
        value(structure.density_fluctuation, one.snapshots.read(len(times) - 1))
        for one in (first, second)
    ]
    final = shown(stored, "density-fluctuations").numbers["points"][0]["final"]
    assert math.isclose(final, np.mean(densities))
    for name in ("hexatic-order", "local-energy"):
        assert layers(shown(stored, name), Line)[0].x.tolist() == [0.0, *times.tolist()]
    assert "record: events" in why_not(stored, "pair-distances")


def value(function: structure.Observable, at: Scene) -> Array:
    return np.atleast_1d(function(at.positions, at.velocities, at))


def test_a_run_without_a_stored_state_gets_a_sentence(tmp_path: Path) -> None:
    late = made(tmp_path / "late", "snapshots=[1e9]", "collisions=2000", text=STORED)
    for name in ("cluster-growth", "structure-factor", "pair-correlation"):
        assert "before its first snapshot" in why_not(late, name)


def test_a2_of_a_summary_needs_no_states(tmp_path: Path) -> None:
    """It is the same as with all collisions, but for the grid of the summary."""
    long = ("cor=0.8", "collisions=1200", "wall_cor=null")
    whole, summed = (
        made(tmp_path / record, f"record={record}", *long) for record in ("events", "summary")
    )
    lines = [layers(shown(run, "a2"), Line)[0] for run in (whole, summed)]
    # The grid knows to a step when the curve has its collisions.
    assert lines[1].y[-5:].mean() == pytest.approx(lines[0].y[-5:].mean(), abs=0.02)
