"""Distances from the centre, between balls, and speeds."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from figure_runs import ADRIFT, BASE, MIXTURE, layers, made, shown, traces, why_not
from scipy import stats

from snooker_cli import theory
from snooker_cli.analysis.gas import fluid_state
from snooker_cli.analysis.measurement import measure, pairs_of
from snooker_cli.config import parse
from snooker_cli.engine import replay
from snooker_cli.errors import FigureError
from snooker_cli.figures import distributions
from snooker_cli.figures.distributions import _reduced_components
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    MEASURED,
    NEUTRAL,
    Band,
    FigureData,
    Line,
    Points,
    Reference,
)
from snooker_cli.figures.registry import FIGURES
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection
from snooker_cli.trace import SPEED_BIN


def histograms(found: FigureData) -> list[Line]:
    return [line for line in layers(found, Line) if line.steps]


def laws(found: FigureData) -> list[Line]:
    return [line for line in layers(found, Line) if not line.steps]


def test_distances_from_the_centre(decaying: RunFolder) -> None:
    found = shown(decaying, "central-distances", cor=0.8)
    largest = 0.0
    for trace in traces(decaying, 0):
        assert trace.events is not None
        states = replay(trace, np.append(0.0, trace.events.time))
        offsets = states.positions - states.container_position[:, None]
        largest = max(largest, float(np.hypot(offsets[..., 0], offsets[..., 1]).max()))
    assert found.numbers["largest_distance"] == largest
    assert found.numbers["largest_excess"] == largest - 9.0
    (histogram,) = histograms(found)
    assert np.sum(histogram.y[:-1] * np.diff(histogram.x)) == pytest.approx(1, abs=1e-12)
    assert (histogram.x[0], histogram.x[-1]) == (0.0, 9.0)
    assert (histogram.y[0], histogram.y[-1]) == (0.0, 0.0)
    assert [reference.value for reference in layers(found, Reference)] == [9.0]


def test_distances_are_those_of_equal_steps_of_time(decaying: RunFolder) -> None:
    """At collisions two balls touch, so such times would have too many short distances."""
    found = shown(decaying, "pair-distances", cor=1.0)
    (histogram,) = histograms(found)
    densities = []
    first, second = np.triu_indices(19, k=1)
    for trace in traces(decaying, 2):
        steps = trace.collisions + 1
        states = replay(trace, (np.arange(steps) + 0.5) / steps * trace.stop.time)
        apart = states.positions[:, first] - states.positions[:, second]
        distances = np.hypot(apart[..., 0], apart[..., 1])
        densities.append(np.histogram(distances, histogram.x[1:], density=True)[0])
    mean = np.mean(densities, axis=0)
    assert histogram.y[1:-1] == pytest.approx(mean, rel=1e-9)
    band = layers(found, Band)[0]
    errors = np.std(densities, axis=0, ddof=1) / np.sqrt(3)
    assert (band.high - band.low)[1:-1] / 2 == pytest.approx(errors, rel=1e-9)
    assert band.steps


def test_speeds_in_metres_if_elastic(warm: RunFolder) -> None:
    found = shown(warm, "speeds", balls__radius=1.0)
    assert found.x_label == "speed (m/s)"
    assert not histograms(found)  # three outlines would hide each other
    for points, speed in zip(layers(found, Points), (5.0, 10.0, 20.0), strict=True):
        widths = np.diff(points.x)
        assert widths == pytest.approx(SPEED_BIN * speed, rel=1e-9)
        assert np.sum(points.y) * widths[0] == pytest.approx(1, abs=1e-12)
    (histogram,) = histograms(shown(warm, "speeds", balls__radius=1.0, balls__speed=5.0))
    assert np.sum(histogram.y[:-1] * np.diff(histogram.x)) == pytest.approx(1, abs=1e-12)
    repeats = traces(warm, 3)
    shares = measure(repeats, pairs=pairs_of(repeats)).speeds
    cdf = theory.fixed_energy_speed_cdf(histogram.x[[4, 5]], 19, 12.5)
    _, residuals, *_ = found.panel
    assert isinstance(residuals, Points)
    share = np.sum(shares, axis=0)[3] / np.sum(shares)
    assert residuals.y[3] == pytest.approx((share - np.diff(cdf)[0]) / (SPEED_BIN * 5), rel=1e-9)
    error = math.sqrt(share * (1 - share) / np.sum(shares)) / (SPEED_BIN * 5)
    assert residuals.y_error[3] == pytest.approx(error, rel=1e-9)
    assert "independent speeds. " in found.caption
    assert "over the repeats" not in found.caption
    assert found.panel_label == "minus law at fixed energy (s/m)"
    maxwell, fixed = laws(found)[:2]
    assert maxwell.y == pytest.approx(theory.maxwell_speed_density(maxwell.x, 12.5), rel=1e-12)
    assert fixed.y == pytest.approx(
        theory.fixed_energy_speed_density(fixed.x, 19, 12.5), rel=1e-9, abs=1e-15
    )
    assert {line.series for line in laws(found)} == {NEUTRAL}


def test_more_than_five_points_show_the_differences_from_the_law_alone(warm: RunFolder) -> None:
    """Six histograms on each other show nothing. The reproduction keeps its form."""
    found = shown(warm, "speeds")
    assert (len(layers(found, Line)), found.panel) == (6, ())
    assert found.y_label == "density minus law at fixed energy"
    assert found.x_label.startswith("reduced speed")
    (one,) = [k for k, point in enumerate(warm.points) if dict(point.parameters) == FASTEST]
    alone = shown(warm, "speeds", **{name.replace(".", "__"): v for name, v in FASTEST.items()})
    _, residuals, *_ = alone.panel
    assert isinstance(residuals, Points)
    assert layers(found, Line)[one].y == pytest.approx(residuals.y * 20.0, rel=1e-9)
    source = FIGURES["speeds"].make(warm, Selection(), source=True)
    assert len(histograms(source)) == 6


FASTEST = {"balls.radius": 1.0, "balls.speed": 20.0}


@pytest.mark.parametrize("factor", [1.0, 0.8])
def test_the_caption_says_whether_chance_explains_the_distance_from_the_law(
    factor: float, warm: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Speeds that follow the law, and a law of balls that are slower by a fifth."""
    exact = theory.fixed_energy_speed_cdf
    wrong = lambda speed, *gas: exact(np.asarray(speed) / factor, *gas)  # noqa: E731
    monkeypatch.setattr(distributions.theory, "fixed_energy_speed_cdf", wrong)
    found = FIGURES["speeds"].make(warm, Selection(FASTEST))
    (record,) = found.numbers["points"]
    assert f"the law is {'not ' if factor == 1 else ''}refused." in found.caption
    assert (record["probability"] < 0.01) is (factor < 1)


def test_few_counts_have_poissons_interval() -> None:
    """One repeat with one count has no spread over the repeats, but an error."""
    inside = math.erf(math.sqrt(0.5))
    low, high = ((1 - inside) / 2, (1 + inside) / 2)
    counts = np.arange(7.0)
    found = distributions.count_errors(counts, np.full(7, 9.0))
    assert found[5:].tolist() == [9.0, 9.0]
    ends = stats.gamma.ppf(high, counts + 1) - np.nan_to_num(stats.gamma.ppf(low, counts))
    assert found[:5] == pytest.approx(ends[:5] / 2, abs=1e-3)


def test_the_law_of_speeds_counts_one_ball_less(periodic: RunFolder, tmp_path: Path) -> None:
    reduced = shown(periodic, "speeds")
    assert reduced.x_label.startswith("reduced speed")
    assert reduced.numbers["points"][0]["speeds"] % 64 == 0
    labels = [line.label for line in laws(reduced)]
    assert labels == ["Maxwell–Boltzmann", "fixed energy, 63 free balls"]
    record = reduced.numbers["points"][0]  # by Kolmogorov's law, of independent speeds, 0.87/√n
    assert 0.5 < record["expected_distance"] * math.sqrt(record["speeds"]) < 0.87
    adrift = made(tmp_path / "adrift", "cor=1", "collisions=1000", text=ADRIFT)
    found = shown(adrift, "speeds")
    assert [line.label for line in laws(found)] == ["Maxwell–Boltzmann"]
    assert found.panel_label == "minus Maxwell's law (s/m)"
    assert "Maxwell's law is drawn for comparison." in found.caption
    assert found.numbers["points"][0]["distance_from_fixed_energy"] is None


def test_g_of_a_fluid_touches_the_contact_value(periodic: RunFolder) -> None:
    """Its last points are elastic: a packing of 0.12, where χ = 1.2."""
    found = shown(periodic, "pair-correlation", cor=1.0)
    (record,) = found.numbers["points"]
    state = fluid_state(traces(periodic, 2)[0].start)
    assert record["theory"] == pytest.approx(theory.contact_value(state.bulk_packing), rel=1e-5)
    # Pairs of a bin at contact in the 3 × 40 states; those of a repeat are not independent.
    assert abs(record["contact"] - record["theory"]) < 0.3
    measured, named = layers(found, Points)
    lines = layers(found, Line)
    (line,) = (layer for layer in lines if layer.style == MEASURED)
    expected = [layer for layer in lines if layer.style == BY_THEORY]
    assert (measured.x.tolist(), measured.y.tolist()) == ([1.0], [record["contact"]])
    assert measured.y_error.tolist() == [record["contact_error"]]
    assert (named.label, found.left_of_x) == ("g(σ⁺)", True)
    assert [(law.style, law.label) for law in expected] == [
        (BY_THEORY, None),
        (BY_THEORY, "contact value χ"),
    ]
    share = 100 * (record["contact"] / record["theory"] - 1)
    stated = re.search(r"The deviation from theory is (.*?) ± .* %", found.caption)
    assert stated is not None
    assert float(stated[1].replace("−", "-")) == pytest.approx(share, abs=1)
    assert found.x_limits == (0.6, None)
    assert np.all(line.y[line.x < 0.99] == 0)
    assert abs(np.mean(line.y[line.x > 4]) - 1) < 0.05
    assert expected[0].x.tolist() == [0.6, 1.0]
    assert expected[0].y == pytest.approx(record["theory"], rel=1e-12)
    (band,) = layers(found, Band)
    assert "Bold: means over the repeats; thin: single repeats; bands: standard" in found.caption
    np.testing.assert_allclose((band.low + band.high) / 2, line.y, atol=1e-12)


def test_g_of_several_points_has_their_contact_values_in_the_legend(periodic: RunFolder) -> None:
    """Beside a colour scale one entry is for all."""
    found = shown(periodic, "pair-correlation")
    names = [points.label for points in layers(found, Points)]
    assert names == [f"g(σ⁺), CoR {cor}" for cor in ("0.8", "0.9", "1")]
    (law,) = (line for line in layers(found, Line) if line.style == BY_THEORY)
    assert (law.label, law.series) == ("contact value χ, CoR 1", NEUTRAL)


def test_g_of_two_balls_with_little_room(tmp_path: Path) -> None:
    """There is one wide bin, which gives no contact value, or none beyond contact."""
    text = """\
container: {shape: box, width: 10}
balls:
  list:
    - {position: [-2.5, 0], velocity: [1, 0.2], radius: 1}
    - {position: [2.5, 0], velocity: [0, 1], radius: 1}
cor: 1.0
collisions: 30
"""
    narrow = made(tmp_path / "narrow", text=text)
    assert shown(narrow, "pair-correlation").numbers["points"][0]["contact"] is None
    full = made(
        tmp_path / "full", "balls.list[0].radius=2.4", "balls.list[1].radius=2.49", text=text
    )
    assert "hardly more room" in why_not(full, "pair-correlation")


def test_distances_are_of_a_number_of_pairs_that_memory_has(
    decaying: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All pairs of 100,000 balls would need 37 GiB."""
    monkeypatch.setattr(distributions, "MOST_PAIRED", 9)
    with pytest.raises(FigureError, match="all pairs, of 9 balls at most"):
        FIGURES["pair-distances"].make(decaying, Selection({"cor": 1.0}))


def test_a_single_ball_has_no_law_of_velocities_over_its_own_temperature(tmp_path: Path) -> None:
    """|v_x| over √(2T/m) of its own T is at most one."""
    run = made(tmp_path / "run", "balls[0].count=1", "repeats=1", text=MIXTURE)
    (points,) = layers(shown(run, "velocity-tails"), Points)
    assert points.label == "r = 0.4 m, m = 1 kg"


def test_velocity_tails_of_a_mixture_are_by_species(mixture: RunFolder) -> None:
    """Each over its own temperature: T₁ and T₂ differ in a cooling gas."""
    found = shown(mixture, "velocity-tails")
    names = ["r = 0.6 m, m = 4 kg", "r = 0.4 m, m = 1 kg"]
    points = layers(found, Points)
    assert [p.label for p in points] == names
    assert [record["species"] for record in found.numbers["points"]] == names
    assert "T is that of each species at all places together" in found.caption
    for trace in traces(mixture, 0):
        for kind in _reduced_components(trace, np.array([0.5, 0.9])):
            assert np.mean(kind.reshape(2, -1) ** 2, axis=1) == pytest.approx([0.5, 0.5])
    many = [f"{{count: 2, radius: 0.{k}, speed: 1}}" for k in range(1, 8)]
    case = parse(BASE, overrides=[f"balls=[{', '.join(many)}]"])
    (reason,) = FIGURES["velocity-tails"].fitting(case.points())[1]
    assert "6 species at most" in reason


def test_velocity_tails_are_shares_of_all_states(periodic: RunFolder) -> None:
    """Each bin has both signs, and the whole law has the second moment 1/2 per component."""
    found = shown(periodic, "velocity-tails", cor=1.0)
    (points,) = layers(found, Points)
    assert 2 * 0.25 * points.y.sum() == pytest.approx(1, rel=1e-9)  # no bin is left out
    assert 2 * 0.25 * np.sum(points.y * points.x**2) == pytest.approx(0.5, rel=0.05)
    exact, maxwell = layers(found, Line)
    assert maxwell.y[0] == pytest.approx(1 / math.sqrt(math.pi))
    edges = np.array([0.0, 0.25, 30.0])
    shares = theory.maxwell_component_share(edges)
    assert shares == pytest.approx([math.erf(0.25), math.erfc(0.25)])
    # The law at fixed energy is the density of its shares, and that of many balls is Maxwell's.
    step = np.array([0.3, 0.3 + 1e-6])
    (share,), density = theory.fixed_energy_component_share(step, 7), 1e6 / 2
    at = theory.fixed_energy_component_density(step.mean(keepdims=True), 7)
    assert share * density == pytest.approx(at[0], rel=1e-6)
    many = theory.fixed_energy_component_share(edges, 10**7)
    assert many == pytest.approx(shares, rel=1e-6)
    (record,) = found.numbers["points"]
    assert exact.label == "fixed energy, 63 free balls"
    assert exact.y[0] < maxwell.y[0]
    fast = theory.fixed_energy_component_share(np.array([2.0, 30.0]), 63)[0]
    assert record["beyond"] == pytest.approx(points.y[8:].sum() * 2 * 0.25 / fast, rel=1e-9)
    assert "the law at fixed energy" in found.title
    assert record["velocities"] % (2 * 64) == 0
