"""Structure and velocities over time: means over the repeats, and the theory beside them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import MIXTURE, layers, made, shown, traces, why_not

from snooker_cli import theory
from snooker_cli.analysis import predictions, structure
from snooker_cli.analysis.observables import series, standard_errors, time_means
from snooker_cli.figures import Line, Points, states
from snooker_cli.figures.captions import MEAN_SPREAD
from snooker_cli.figures.figure_data import Band
from snooker_cli.formatting import with_error
from snooker_cli.runs import Run


@pytest.fixture(scope="module")
def mixture(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("mixture") / "run", text=MIXTURE)


def test_g_of_a_fluid_touches_the_contact_value(periodic: Run) -> None:
    """Its last points are elastic: a packing of 0.12, where χ = 1.2."""
    found = shown(periodic, "pair-correlation", cor=1.0)
    (record,) = found.numbers["points"]
    state = predictions.scene_state(traces(periodic, 2)[0].start, 1.0)
    assert state is not None
    assert record["theory"] == pytest.approx(theory.contact_value(state.bulk_packing), rel=1e-5)
    # Pairs of a bin at contact in the 3 × 40 states; those of a repeat are not independent.
    assert abs(record["contact"] - record["theory"]) < 0.3
    (line,), (marker,) = (layers(found, kind) for kind in (Line, Points))
    assert np.all(line.y[line.x < 0.99] == 0)
    assert abs(np.mean(line.y[line.x > 4]) - 1) < 0.05
    assert (marker.x.tolist(), marker.y.tolist()) == ([1.0], [pytest.approx(record["theory"])])
    (band, _) = layers(found, Band)
    assert f"Lines: means over the repeats; bands: {MEAN_SPREAD}." in found.caption
    np.testing.assert_allclose((band.low + band.high) / 2, line.y, atol=1e-12)


def test_g_of_a_lossy_gas_is_that_of_the_last_states(periodic: Run) -> None:
    found = shown(periodic, "pair-correlation", cor=0.8)
    (line,) = layers(found, Line)
    rows = [
        structure.measured(structure.pair_correlation, trace, [0.99 * trace.stop.time])[0]
        for trace in traces(periodic, 0)
    ]
    np.testing.assert_allclose(line.y, np.mean(rows, axis=0), rtol=1e-9)
    assert found.numbers["points"][0]["theory"] is None


def test_captions_of_states_name_what_is_shown(periodic: Run, mixture: Run) -> None:
    elastic, lossy, both = (
        shown(periodic, "pair-correlation", **({"cor": cor} if cor else {})) for cor in (1, 0.8, 0)
    )
    assert "Mean over the second half of each repeat." in elastic.caption
    assert "The last state of each repeat." in lossy.caption
    assert "Elastic points: mean over the second half; others: the last state" in both.caption
    assert elastic.x_label == "distance / diameter"
    assert shown(mixture, "pair-correlation").x_label == "distance / mean diameter"
    assert "Theory: homogeneous cooling" in shown(periodic, "a2", cor=0.8).caption
    assert "Theory" not in shown(mixture, "a2").caption


def test_an_elastic_mixture_has_mean_temperatures_of_the_second_half(tmp_path: Path) -> None:
    run = made(tmp_path / "run", "cor=1", "repeats=2", text=MIXTURE)
    found = shown(run, "species-temperature")
    lines = layers(found, Line)
    half = len(lines[0].x) // 2
    means = [float(np.mean(line.y[half:])) for line in lines]
    assert found.caption.count("Mean over the second half: ") == 1
    shares = [
        structure.measured(structure.species_temperature, one, lines[0].x[half:]).mean(axis=0)
        for one in traces(run, 0)
    ]
    assert means == pytest.approx(np.mean(shares, axis=0), rel=1e-12)
    error = float(standard_errors(np.array(shares)[:, 0]))
    assert with_error(means[0], error, "J") in found.caption


def test_a2_is_half_of_the_energy_moment_between_times(periodic: Run) -> None:
    found = shown(periodic, "a2")
    lines = [line for line in layers(found, Line) if line.style == "series"]
    bands = layers(found, Band)
    for index, e in enumerate((0.8, 0.9, 1.0)):
        repeats, line = traces(periodic, index), lines[index]
        assert line.label == f"CoR {e:g}"
        k = len(line.x) // 2
        width = line.x[k + 1] - line.x[k]
        rows = np.array(
            [
                time_means(one, series(one).energy_moment, np.array([0.0, one.stop.time])) / 2 - 1
                for one in repeats
            ]
        )
        assert width > 0
        assert abs(np.mean(line.y) - rows.mean()) < 0.1
        np.testing.assert_allclose(bands[index].high + bands[index].low, 2 * line.y, atol=1e-12)
        # The theory's line is the coefficient; 63 free balls at CoR 1.
        expected = theory.sonine_coefficient(e) if e < 1 else -1 / 64
        assert found.numbers["points"][index]["theory"] == pytest.approx(expected, rel=1e-5)


def test_times_end_with_the_shortest_repeat_and_begin_at_zero(periodic: Run) -> None:
    found = shown(periodic, "hexatic-order", cor=0.8)
    (line,) = layers(found, Line)
    repeats = traces(periodic, 0)
    assert line.x[0] == 0
    shortest = min(trace.stop.time for trace in repeats)
    assert 0.97 * shortest < line.x[-1] < shortest
    # No time is that of a collision, where two balls touch.
    assert not np.any(np.isin(line.x, series(repeats[0]).time[1:]))
    for k in (0, 20, len(line.x) - 1):
        rows = [structure.measured(structure.hexatic_order, one, line.x[[k]]) for one in repeats]
        assert line.y[k] == pytest.approx(float(np.mean(rows)), rel=1e-12)
        (band, _) = layers(found, Band)
        error = float(standard_errors(np.array(rows))[0])
        assert (band.high[k] - band.low[k]) / 2 == pytest.approx(error, rel=1e-9)
    # Collisions get rarer, and so do the times.
    steps = np.diff(line.x)
    assert steps[-10:].mean() > 1.5 * steps[:10].mean()


def test_many_balls_are_measured_in_few_repeats(
    periodic: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """64 balls at 61 times: three repeats are too many, two have the first and the last one."""
    monkeypatch.setattr(states, "MOST_TRIANGULATED", 3 * 64 * 61 - 1)
    found = shown(periodic, "hexatic-order", cor=0.8)
    (line,) = layers(found, Line)
    repeats = [traces(periodic, 0)[k] for k in (0, 2)]
    rows = [structure.measured(structure.hexatic_order, one, line.x[[-1]]) for one in repeats]
    assert line.y[-1] == pytest.approx(float(np.mean(rows)), rel=1e-12)
    assert found.numbers["points"][0]["repeats"] == 2
    assert found.caption.endswith("The figure uses 2 repeats, evenly chosen, of each point.")
    assert "3 repeats, 500 collisions: all complete." in found.caption
    monkeypatch.setattr(states, "MOST_PAIRED", 64)
    assert shown(periodic, "pair-correlation").caption.endswith("uses 1 repeat of each point.")
    assert "The figure uses" not in shown(periodic, "local-energy").caption


def test_each_species_of_a_mixture_has_its_temperature_and_a2(mixture: Run) -> None:
    found = shown(mixture, "species-temperature")
    heavy, light = layers(found, Line)
    assert [heavy.label, light.label] == ["r = 0.6 m, m = 4 kg", "r = 0.4 m, m = 1 kg"]
    repeats, end = traces(mixture, 0), heavy.x[-1]
    rows = np.array(
        [structure.measured(structure.species_temperature, one, [end])[0] for one in repeats]
    )
    assert (heavy.y[-1], light.y[-1]) == pytest.approx(tuple(rows.mean(axis=0)))
    assert found.numbers["points"][0]["ratio"] == pytest.approx(
        float(np.mean(rows[:, 0] / rows[:, 1])), rel=1e-5
    )
    labels = [line.label for line in layers(shown(mixture, "a2"), Line)]
    assert labels == [heavy.label, light.label]
    energies = shown(mixture, "local-energy").numbers["points"][0]
    assert 0 < energies["share"] < 1


def test_one_ball_of_a_species_has_no_a2(tmp_path: Path) -> None:
    text = MIXTURE.replace("count: 30, radius: 0.6", "count: 1, radius: 0.6")
    found = shown(made(tmp_path / "run", "collisions=200", text=text), "a2")
    assert [line.label for line in layers(found, Line)] == ["r = 0.4 m, m = 1 kg"]


def test_energy_without_the_flow_is_all_energy_at_equilibrium(periodic: Run) -> None:
    """Independent velocities: the share is 1, with an error of about 1/√(0.8 · 3 · 64)."""
    found = shown(periodic, "local-energy", cor=1.0)
    local, total, _ = layers(found, Line)
    assert np.mean(local.y) == pytest.approx(1, abs=4 / math.sqrt(0.8 * 3 * 64))
    np.testing.assert_allclose(total.y, 1, rtol=1e-12)


def test_reasons_for_missing_structure(periodic: Run, warm: Run) -> None:
    assert "it needs 2 to 6 species of balls, not 1" in why_not(
        periodic, "species-temperature", cor=1
    )
    for kind in ("pair-correlation", "hexatic-order", "local-energy"):
        assert "record: events" in why_not(warm, kind)
    assert len(layers(shown(warm, "a2"), Line)) > 1  # a summary has a2
