"""Energy, momentum and pressure over time, of one repeat and of all."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import (
    MIXTURE,
    PERIODIC,
    ROUGH,
    STORED,
    in_circle,
    layers,
    made,
    shown,
    traces,
    why_not,
)

from snooker_cli import theory, two_temperatures
from snooker_cli.analysis import gas, quantities, structure
from snooker_cli.analysis.measurement import measure, pairs_of
from snooker_cli.analysis.observables import standard_errors
from snooker_cli.analysis.run_analysis import comparisons
from snooker_cli.analysis.structure import Array
from snooker_cli.engine import series
from snooker_cli.figures.figure_builder import EARLY, MOST_SINGLE, FigureBuilder
from snooker_cli.figures.figure_data import (
    MEASURED,
    Band,
    Line,
    Points,
    Reference,
    Repeats,
    at_common_times,
    courses,
    lasting,
    lasting_rows,
)
from snooker_cli.formatting import short
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection
from snooker_cli.scene import Scene


def test_repeats_that_end_early_do_not_shorten_a_mean_course() -> None:
    """Nor does a long one lengthen it."""
    ends = [1.0, 8.0, 9.0, 10.0, 11.0, 900.0]
    curves = [(np.array([0.0, end]), np.array([1.0, 0.5])) for end in ends]
    assert [time[-1] for time, _ in lasting(curves)] == ends[1:]
    assert at_common_times(lasting(curves))[0][-1] == 8.0
    build = FigureBuilder(None, None, [[None]], {}, brief={0: 1})  # type: ignore[list-item,arg-type]
    assert build._left_out().startswith("The result leaves out 1 repeat that ends before half")


def test_means_go_on_with_the_repeats_that_remain(decaying: RunFolder) -> None:
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
    (band,), (singles,) = build.bands, build.singles
    assert isinstance(band, Band)
    assert band.x[-1] == 15.0
    assert np.isnan(singles.rows[0, singles.x > 0.5]).all()
    assert (band.high - band.low)[-1] / 2 == pytest.approx(0.5)  # of 4 and 5
    assert build._remaining_sentence() == (
        "Means go on with the repeats that remain, 2 of 6 at the end; a mean of fewer than "
        "half is thin."
    )


def test_a_mean_that_jumps_where_a_repeat_ends_has_a_gap_there(decaying: RunFolder) -> None:
    """Else the jump looks like an event of the gas. All values are kept."""
    (point, *_), x = decaying.points, np.arange(10.0)
    rows = np.array([np.full(10, 1.0), np.full(10, 1.1), np.full(10, 9.0)])
    rows[2, 5:] = math.nan
    build = FigureBuilder(decaying, Selection(), [[point]], {"title": "x", "kind": "x"})
    build.add_means(0, None, x, rows)
    (line,), (band,) = build.lines, build.bands
    assert isinstance(line, Line)
    assert isinstance(band, Band)
    assert line.x.tolist() == band.x.tolist() == [0, 1, 2, 3, 4, 5, 5, 6, 7, 8, 9]
    assert np.flatnonzero(np.isnan(line.y)).tolist() == [5]
    assert line.y[6:].tolist() == [1.05] * 5
    rows[2] = rows[0]
    rows[2, 5:] = math.nan
    build.add_means(0, None, x, rows)
    assert len(build.lines[-1].x) == 10  # this one hardly changes the mean


def test_a_few_repeats_that_last_a_bit_longer_draw_no_tail(decaying: RunFolder) -> None:
    """Repeats of one number of collisions end at times that are near each other."""
    (point, *_), ends = decaying.points, [8.0, 8.5, 9.0, 9.2, 9.4]
    curves = [(np.array([0.0, end]), np.ones(2)) for end in ends]
    build = FigureBuilder(decaying, Selection(), [[point]], {"title": "x", "kind": "x"})
    build.add_mean_course(0, point, curves)
    (line,) = build.lines
    assert isinstance(line, Line)
    assert 8.9 < line.x[-1] <= 9.0  # as long as three of five are there
    assert build._remaining_sentence() == ""


def test_results_of_rows_are_of_the_same_repeats_at_all_times() -> None:
    """A value that is not known before the end is no end."""
    nan, x = np.nan, np.arange(6.0)
    rows = np.array([[9, nan, nan, nan, nan, nan], [1, nan, 3, 4, 5, nan], [1, 2, 3, 4, 5, 6]])
    times, kept = lasting_rows(x, rows)
    assert times.tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal(kept, rows[1:, :5])
    np.testing.assert_array_equal(lasting_rows(x, np.stack([rows, rows], axis=2))[1][..., 1], kept)


def test_thin_lines_are_an_even_choice_of_the_repeats(decaying: RunFolder) -> None:
    """Of many series they would hide the means, and there are none."""
    (point, *_), x = decaying.points, np.linspace(0.0, 1.0, 5)
    rows = np.repeat(np.arange(30.0), 5).reshape(30, 5)
    build = FigureBuilder(decaying, Selection(), [[point]], {"title": "x", "kind": "x"})
    for index in range(3):
        build.add_means(index, None, x, rows)
    shown_rows = [layer.rows[:, 0].tolist() for layer in build.shown_singles()]
    assert shown_rows == [[0.0, 10.0, 19.0, 29.0]] * 3
    assert sum(map(len, shown_rows)) == MOST_SINGLE
    for index in range(3, 7):
        build.add_means(index, None, x, rows)
    assert build.shown_singles() == []
    assert build._means_sentence(False) == "Bold: means over the repeats; bands: standard errors."


def test_no_curve_ends_with_the_shortest_repeat(tmp_path: Path) -> None:
    """One is trapped at the wall early."""
    overrides = ("balls.rings=1", "cor=0.85", "wall_cor=null", "repeats=8", "seed=8")
    run = made(tmp_path / "run", *overrides)
    ends = np.array([trace.stop.time for trace in traces(run, 0)])
    collisions = np.array([len(trace.events or ()) for trace in traces(run, 0)])
    assert ends.min() < 0.5 * np.median(ends)
    for name in ("energy", "a2", "cooling", "cluster-growth"):
        found = shown(run, name)
        assert "Means go on with the repeats that remain" in found.caption, name
        (singles,) = layers(found, Repeats)
        assert np.isnan(singles.rows[:, -1]).any()
        lines = [line for line in layers(found, Line) if line.style == MEASURED]
        if name != "a2":  # which is over collisions per ball
            assert max(line.x[-1] for line in lines if len(line.x)) > np.median(ends)
    found = shown(run, "event-decay")
    assert "Means go on with the repeats that remain" in found.caption
    (points,) = layers(found, Points)
    pairs = [t.pair_events for t, n in zip(traces(run, 0), collisions, strict=True) if n >= 200]
    assert points.x[-1] >= 2 * min(pairs) / 7


def test_pressure_rises_from_zero_and_ends_at_the_mean(decaying: RunFolder) -> None:
    found = shown(decaying, "pressure-since-start", cor=1.0)
    curve = measure(traces(decaying, 2)).curve
    curves = courses(curve.time, np.nan_to_num(curve.pressure))
    (line,) = layers(found, Line)
    end, longer, _ = sorted(time[-1] for time, _ in curves)
    assert (line.x[-1], line.y[0]) == (longer, 0.0)
    columns = series(traces(decaying, 2)[0])
    at_end = columns.wall_impulse[-1] / (20 * math.pi * columns.time[-1])
    (single,) = layers(shown(decaying, "pressure-since-start", cor=1.0, repeat=0), Line)
    assert single.y[-1] == pytest.approx(at_end, rel=1e-15)
    final = np.array([np.interp(end, *curve) for curve in curves])
    (point,) = found.numbers["points"]
    assert point["pressure"] == pytest.approx(final.mean(), rel=1e-14)
    before = np.array([np.interp(line.x[100], *curve) for curve in curves])
    assert line.x[100] < end
    assert line.y[100] == pytest.approx(before.mean(), rel=1e-14)
    assert point["pressure_error"] == pytest.approx(final.std(ddof=1) / math.sqrt(3), rel=1e-12)
    (reference,) = layers(found, Reference)
    assert reference.value == in_circle(50.0, 1.0)


# Means over the repeats of what the states have.


def test_times_are_even_in_their_logarithm_while_two_repeats_remain(periodic: RunFolder) -> None:
    found = shown(periodic, "hexatic-order", cor=0.8)
    line, (each,) = layers(found, Line)[0], found.panels
    local = next(layer for layer in each.layers if isinstance(layer, Line))
    repeats = traces(periodic, 0)
    longer = sorted(trace.stop.time for trace in repeats)[-2]
    assert EARLY * longer < line.x[-1] < longer
    # No time is that of a collision, where two balls touch.
    assert not np.any(np.isin(line.x, series(repeats[0]).time[1:]))
    rows = [structure.over_time(structure.hexatic_order, one, line.x[[20]]) for one in repeats]
    assert line.y[20] == pytest.approx(float(np.mean(rows)), rel=1e-12)

    def size(positions: Array, velocities: Array, scene: Scene) -> float:
        return float(np.abs(structure.bond_order(positions, velocities, scene)).mean())

    sizes = [structure.over_time(size, one, line.x[[20]]) for one in repeats]
    assert local.y[20] == pytest.approx(float(np.mean(sizes)), rel=1e-12)
    steps = np.diff(np.log(line.x))
    assert found.x_log
    assert steps[-10:].max() < 0.2 * np.log(line.x[-1] / line.x[0])  # few of the first are even
    (point,) = found.numbers["points"]
    (dotted,) = layers(found, Reference)
    assert dotted.value == pytest.approx(point["local"] / 8, rel=1e-9)  # N = 64
    times = short(point["final"] / dotted.value, 2)
    assert found.title == f"Hexatic order over time: CoR 0.8, {times} times ⟨|ψ₆|⟩/√N at the end"
    band = layers(found, Band)[0]
    error = float(standard_errors(np.array(rows))[0])
    assert (band.high[20] - band.low[20]) / 2 == pytest.approx(error, rel=1e-9)


def test_the_share_of_heat_is_that_of_the_last_states(periodic: RunFolder) -> None:
    found = shown(periodic, "cluster-growth", cor=0.8)
    thermal = next(layer for layer in found.panels[-1].layers if isinstance(layer, Line))
    repeats = traces(periodic, 0)
    shortest = min(repeat.stop.time for repeat in repeats)
    row = np.flatnonzero(thermal.x <= shortest)[[-1]]  # results are of the same repeats
    last = thermal.x[row]

    def share(positions: Array, velocities: Array, scene: Scene) -> float:
        heat = structure.local_energy(positions, velocities, scene)
        return heat / (scene.kinetic_energy / scene.number)

    shares = [structure.over_time(share, repeat, last) for repeat in repeats]
    (point,) = found.numbers["points"]
    assert point["share"] == pytest.approx(float(np.mean(shares)), rel=1e-9)
    # The curve is over Haff's law; an elastic gas keeps its energy, and has no flow to show.
    start, rate = repeats[0].start, gas.haff_rate(repeats[0].start)
    law = start.kinetic_energy / 64 / (1 + rate * last) ** 2
    heats = [structure.over_time(structure.local_energy, repeat, last) for repeat in repeats]
    assert thermal.y[row] == pytest.approx(np.mean(heats) / law, rel=1e-9)
    assert found.panels[-1].label == "energy over Haff's law"
    elastic = shown(periodic, "cluster-growth", cor=1.0)
    (energies,) = elastic.panels  # its cells need more balls
    assert energies.label == "energy over E(0)/N"
    curve = next(layer for layer in energies.layers if isinstance(layer, Line)).y
    assert curve[np.isfinite(curve)] == pytest.approx(1.0, abs=0.2)
    assert "Haff" not in elastic.caption


def test_clusters_have_those_of_elastic_balls_beside_them(
    periodic: RunFolder, tmp_path: Path
) -> None:
    """Near close packing elastic balls are one cluster too, so that growth means nothing."""
    found = shown(periodic, "cluster-growth")
    (reference,) = layers(found, Reference)
    (record,) = (row for row in found.numbers["points"] if row["parameters"] == {"cor": 1.0})
    assert reference.value == record["uniform"]
    shortest = min(trace.stop.time for trace in traces(periodic, 2))
    (curve,) = (line for line in layers(found, Line) if line.label == "CoR 1")
    whole = curve.y[curve.x <= shortest]
    assert reference.value == pytest.approx(whole[len(whole) // 2 :].mean(), rel=1e-9)
    alone = shown(periodic, "cluster-growth", cor=0.8)
    starts = [trace.start for trace in traces(periodic, 0)]
    sizes = [value(structure.mean_cluster, start)[0] for start in starts]
    assert layers(alone, Reference)[0].value == pytest.approx(np.mean(sizes), rel=1e-12)
    dense = made(tmp_path / "dense", "balls.radius=1.35", "collisions=20", text=PERIODIC)
    assert "elastic balls are one cluster too" in why_not(dense, "cluster-growth")


def test_species_have_their_temperatures_and_the_ratio_of_compare(mixture: RunFolder) -> None:
    found = shown(mixture, "species-temperature")
    first, second, entry = layers(found, Line)
    assert [line.label for line in (first, second, entry)] == [
        "1: r = 0.6 m, m = 4 kg",
        "2: r = 0.4 m, m = 1 kg",
        "T₁/T₂, equal cooling rates",
    ]
    assert first.x[0] == 0.0
    assert first.x[-1] == pytest.approx(2 * 900 / 60, rel=0.05)
    shares, starts = [], []
    for trace in traces(mixture, 0):
        scene = trace.start
        starts.append(structure.species_temperature(scene.positions, scene.velocities, scene))
        shares.append(starts[-1] / starts[-1].sum())
    assert [first.y[0], second.y[0]] == pytest.approx(np.mean(starts, axis=0), rel=1e-12)
    (panel,) = found.panels
    band, line, theory_line = panel.layers
    assert isinstance(band, Band)
    assert isinstance(line, Line)
    assert isinstance(theory_line, Line)
    one, other = np.mean(shares, axis=0)
    assert line.y[0] == pytest.approx(one / other, rel=1e-12)
    assert np.all(band.low <= line.y)
    assert np.all(line.y <= band.high)
    numbers = found.numbers
    assert theory_line.y.tolist() == [numbers["theory"]] * 2
    assert numbers["theory"] == gas.species_ratio(scene) > 1
    # The finding, the table and the figure have one mean.
    rows = comparisons(mixture).rows
    (row,) = [row for row in rows if row["quantity"] == quantities.SPECIES_RATIO.name]
    assert (numbers["ratio"], numbers["ratio_error"]) == (row["measured"], row["error"])
    assert numbers["theory"] == row["predicted"]


def test_the_caption_says_if_a_mixture_is_not_steady(tmp_path: Path) -> None:
    """Walls of 1 J cool it; T₁/T₂ is the mean over the second half, of the last two quarters."""
    text = MIXTURE.replace("shape: periodic", "shape: box")
    cold = made(tmp_path / "run", "wall_temperature=1", "cor=1", "repeats=6", text=text)
    figure = shown(cold, "species-temperature")
    assert "The gas is not steady: its energy still changes." in figure.caption
    repeats = traces(cold, 0)
    measured = measure(repeats, pairs=pairs_of(repeats))
    first, second = measured.species_quarters[:, 2:].mean(axis=1).T
    assert figure.numbers["ratio"] == pytest.approx(np.mean(first / second), rel=1e-12)


# --- rotation ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rough(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return made(tmp_path_factory.mktemp("rough") / "run", text=ROUGH)


def test_temperatures_of_motion_and_rotation_are_those_of_the_states(rough: RunFolder) -> None:
    """Their ratio comes first, beside theory; in a panel that of the motion falls over decades."""
    found = shown(rough, "rotation")
    ratio, expected = [line for line in layers(found, Line) if len(line.x)]
    (decay,) = found.panels
    (moving,) = decay.layers
    assert ratio.x[-1] == pytest.approx(2 * 1200 / 60, rel=1e-3)
    warm = []
    for trace in traces(rough, 0):
        ends = trace.start, trace.finish
        drift = float(np.sum((trace.start.masses @ trace.start.velocities) ** 2)) / 2 / 60
        first, last = ((scene.kinetic_energy - drift) / 59 for scene in ends)
        warm.append((last / first, trace.finish.spin_energy / 30 / first))
    assert moving.y[-1] == pytest.approx(np.mean([move for move, _ in warm]), rel=1e-9)
    assert ratio.y[-1] == pytest.approx(np.mean([turn / move for move, turn in warm]), rel=1e-9)
    assert np.all(np.diff(moving.y) < 0)
    assert expected.y[-1] == pytest.approx(two_temperatures.rough_ratio(0.9, 0.5, 0.5), rel=1e-4)
    assert (decay.log, found.y_log) == (True, False)
    _, residuals = found.panel
    assert isinstance(residuals, Points)
    last = np.flatnonzero(ratio.x == residuals.x[-1])
    assert residuals.y[-1:] == pytest.approx(np.log(ratio.y / expected.y)[last], rel=1e-9)


def test_collisions_per_ball_are_the_same_in_all_figures(rough: RunFolder) -> None:
    """Without walls each collision is of two balls."""
    courses = [line for line in layers(shown(rough, "rotation"), Line) if len(line.x)]
    (points,) = layers(shown(rough, "event-decay"), Points)
    assert points.x[-1] == 2 * 1200 / 60 == pytest.approx(courses[0].x[-1], rel=1e-3)


def test_rough_balls_have_no_figures_whose_theory_is_of_smooth_ones(tmp_path: Path) -> None:
    elastic = made(tmp_path / "run", "cor=1", "tangential_cor=1", text=ROUGH)
    for name in ("gas-law", "mean-squared-displacement", "velocity-autocorrelation"):
        assert "spins take a part of the energy" in why_not(elastic, name)
    (point,) = shown(elastic, "pressure").numbers["points"]
    assert point["theory"] is None


def test_smooth_balls_have_no_rotation(decaying: RunFolder) -> None:
    assert why_not(decaying, "rotation").startswith("smooth balls do not spin")


# --- stored states ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return made(tmp_path_factory.mktemp("stored") / "run", text=STORED)


def test_large_cells_of_an_elastic_fluid_have_a_limit(stored: RunFolder, tmp_path: Path) -> None:
    """A gas that cools has clusters instead."""
    text = STORED.replace("cor: 0.8", "cor: 1").replace("30000", "300")
    elastic = made(tmp_path / "elastic", text=text)
    packing = next(elastic.traces(elastic.points[0])).start.packing_fraction
    limits = [
        layer
        for layer in shown(elastic, "cluster-growth").panels[0].layers
        if isinstance(layer, Reference)
    ]
    assert [one.value for one in limits] == [1.0, theory.structure_at_zero(packing)]
    assert "S(0)" in shown(elastic, "cluster-growth").alt
    assert "S(0)" not in shown(stored, "cluster-growth").alt


def test_figures_of_snapshots_have_the_stored_states(stored: RunFolder) -> None:
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
    assert math.isclose(figure.numbers["points"][0]["fluctuation"], np.mean(densities))
    assert layers(shown(stored, "hexatic-order"), Line)[0].x.tolist() == times.tolist()
    assert "record: events" in why_not(stored, "pair-distances")


def value(function: structure.Observable, at: Scene) -> Array:
    return np.atleast_1d(function(at.positions, at.velocities, at))


def test_a_gas_that_cools_has_the_structure_factor_at_four_times(stored: RunFolder) -> None:
    """Structures grow from short waves to long ones; one curve shows no growth."""
    found = shown(stored, "structure-factor")
    curves = layers(found, Line)
    repeats = traces(stored, 0)
    times = [0.0]
    for share in (0.01, 0.1):
        nearest = [
            min(one.snapshots.time, key=lambda time: abs(time - share * one.stop.time))
            for one in repeats
        ]
        times.append(float(np.mean(nearest)))
    assert [line.label for line in curves[:3]] == [f"t = {short(time)} s" for time in times]
    assert len(curves) == 4
    assert found.shades == pytest.approx([0, 1 / 3, 2 / 3, 1])
    begins = [value(structure.structure_factor, one.start) for one in repeats]
    assert curves[0].y == pytest.approx(np.mean(begins, axis=0), rel=1e-9)


def test_a_run_without_a_stored_state_gets_a_sentence(tmp_path: Path) -> None:
    late = made(tmp_path / "late", "snapshots=[1e9]", "collisions=2000", text=STORED)
    for name in ("cluster-growth", "structure-factor", "pair-correlation"):
        assert "before its first snapshot" in why_not(late, name)


def test_a2_begins_after_three_collisions_per_ball(decaying: RunFolder, tmp_path: Path) -> None:
    """Before, equal speeds are those of the start."""
    found = shown(decaying, "a2", cor=0.8)
    line = next(line for line in layers(found, Line) if line.style == MEASURED)
    assert 3.0 <= line.x[0] < 4.0
    pairs = [trace.pair_events for trace in traces(decaying, 0)]
    assert line.x[-1] == pytest.approx(2 * np.mean(pairs) / 19, rel=0.05)
    short = made(tmp_path / "run", "collisions=30", "cor=0.8")
    assert "first 3 collisions per ball are left out" in why_not(short, "a2")


def test_a2_is_against_a_swept_cor_beside_van_noije_and_ernst(decaying: RunFolder) -> None:
    found = shown(decaying, "a2")
    (points,) = layers(found, Points)
    assert points.x.tolist() == [0.8, 0.9, 1.0]
    records = found.numbers["points"]
    assert points.y.tolist() == [record["second_half"] for record in records]
    (line,) = (line for line in layers(found, Line) if len(line.x))
    assert len(line.x) == 100

    def expected(cor: float) -> float:
        """Of 19 balls, whose temperature is that of the moment."""
        return 19 / 20 * (1 + theory.sonine_coefficient(cor)) - 1

    assert line.y == pytest.approx([expected(e) for e in line.x], rel=1e-12)
    assert line.y[-1] == pytest.approx(-1 / 20, abs=1e-3)  # that of elastic balls
    (difference,) = found.panels
    _, rest = difference.layers
    assert isinstance(rest, Points)
    assert rest.y[0] == pytest.approx(points.y[0] - expected(0.8), rel=1e-9)
    assert (
        records[0]["second_half"]
        == shown(decaying, "a2", cor=0.8).numbers["points"][0]["second_half"]
    )


def test_a2_of_a_summary_needs_no_states(tmp_path: Path) -> None:
    """It is the same as with all collisions, but for the grid of the summary."""
    long = ("cor=0.8", "collisions=1200", "wall_cor=null")
    whole, summed = (
        made(tmp_path / record, f"record={record}", *long) for record in ("events", "summary")
    )
    lines = [layers(shown(run, "a2"), Line)[0] for run in (whole, summed)]
    # The grid knows to a step when the curve has its collisions.
    assert lines[1].y[-5:].mean() == pytest.approx(lines[0].y[-5:].mean(), abs=0.02)
