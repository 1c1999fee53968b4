"""Figures of a tagged ball."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from figure_runs import layers, made, shown, traces

from snooker_cli.analysis import diffusion
from snooker_cli.figures.brownian import CLEAR
from snooker_cli.figures.drawing import draw
from snooker_cli.figures.figure_data import BY_THEORY, Line, Points, Reference
from snooker_cli.runs import RunFolder

TEXT = """\
container: {shape: periodic, width: 12}
balls:
  - {position: [0, 0], velocity: [0, 0], radius: 0.8, mass: 5}
  - {count: 80, radius: 0.1, speed: 10, speeds: maxwell, start: random}
cor: 1
time: 20
repeats: 3
"""


@pytest.fixture(scope="module")
def brownian(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return made(tmp_path_factory.mktemp("brownian") / "run", text=TEXT)


def test_the_displacement_has_its_limits_and_a_coefficient(brownian: RunFolder) -> None:
    found = shown(brownian, "mean-squared-displacement")
    (points,) = layers(found, Points)
    ballistic, diffusive, *_ = layers(found, Line)
    theory = diffusion.expected(traces(brownian, 0)[0].start, 0)
    tau = theory.relaxation_time
    assert ballistic.y == pytest.approx(theory.mean_square_speed * (tau * ballistic.x) ** 2)
    assert diffusive.y == pytest.approx(4 * theory.coefficient * tau * diffusive.x)
    assert ballistic.x[-1] <= 1 < 2 <= diffusive.x[0]  # guides end where the motion changes
    steps = np.diff(np.log2(points.x))
    assert steps == pytest.approx(1 / 3, rel=1e-9)  # even, and without near-doubles
    lags = points.x * tau
    rows = [diffusion.correlations(trace, [0], lags)[0] for trace in traces(brownian, 0)]
    assert points.y == pytest.approx(np.mean(rows, axis=0), rel=1e-12)
    assert points.y_error == pytest.approx(np.std(rows, axis=0, ddof=1) / np.sqrt(3), rel=1e-9)
    numbers = found.numbers["points"][0]
    five, ten = (int(np.argmin(abs(points.x - k))) for k in (5, 10))
    slope = (points.y[ten] - points.y[five]) / (lags[ten] - lags[five]) / 4
    assert numbers["diffusion_coefficient"] == pytest.approx(slope, rel=1e-9)
    assert "In two dimensions D depends on the time" in found.caption
    assert not layers(found, Reference)
    over = next(layer for layer in found.panel if isinstance(layer, Points))
    assert over.y == pytest.approx(points.y / (4 * theory.coefficient * lags), rel=1e-9)
    langevin = next(layer for layer in found.panel if isinstance(layer, Line))
    (above,) = (line for line in layers(found, Line) if line.style == BY_THEORY and len(line.x))
    assert above.y == pytest.approx(4 * theory.coefficient * lags * langevin.y, rel=1e-9)
    assert langevin.y[0] == pytest.approx(langevin.x[0] / 2, rel=0.02)  # ballistic
    assert langevin.y[-1] == pytest.approx(1 - 1 / langevin.x[-1], rel=1e-6)


def test_velocities_forget_and_their_integral_is_a_coefficient(brownian: RunFolder) -> None:
    found = shown(brownian, "velocity-autocorrelation")
    (points,) = layers(found, Points)
    theory = diffusion.expected(traces(brownian, 0)[0].start, 0)
    law = layers(found, Line)[0]
    assert law.y == pytest.approx(np.exp(-law.x))
    assert points.y[0] == pytest.approx(1, rel=1e-12)
    numbers = found.numbers["points"][0]
    lags = law.x * theory.relaxation_time
    rows = [diffusion.correlations(trace, [0], lags)[1] for trace in traces(brownian, 0)]
    mean = np.mean(rows, axis=0)
    assert numbers["mean_square_speed"] == pytest.approx(mean[0], rel=1e-12)
    assert numbers["mean_square_speed"] != pytest.approx(theory.mean_square_speed, rel=1e-3)
    integral = np.trapezoid(mean, lags) / 2
    assert numbers["diffusion_coefficient"] == pytest.approx(integral, rel=1e-9)
    assert numbers["theory_coefficient"] == theory.coefficient
    # A logarithm of noise shows nothing: the curve ends, and the panel has all of it.
    end = len(points.x)
    assert found.y_log
    assert np.all(points.y > 0)
    of_ratio = np.std(np.array(rows) - mean / mean[0] * np.array(rows)[:, :1], axis=0, ddof=1)
    errors = of_ratio / np.sqrt(3)
    assert points.y_error == pytest.approx(errors[:end] / mean[0], abs=1e-9)
    assert mean[end] <= CLEAR * errors[end]
    over = next(layer for layer in found.panel if isinstance(layer, Points))
    assert over.y == pytest.approx(mean / mean[0] - law.y, rel=1e-9)


def test_all_balls_of_the_species_of_ball_0_count(decaying: RunFolder, brownian: RunFolder) -> None:
    """One ball of 19 equal ones has a nineteenth of the data."""
    found = shown(decaying, "mean-squared-displacement", cor=1.0)
    (points,) = layers(found, Points)
    repeats = traces(decaying, 2)
    lags = points.x * diffusion.expected(repeats[0].start, 0).relaxation_time
    of_balls = [diffusion.correlations(one, [k], lags)[0] for one in repeats for k in range(19)]
    assert points.y == pytest.approx(np.mean(of_balls, axis=0), rel=1e-9)
    assert "Means over 19 balls of the species of ball 0." in found.caption
    assert "no other is of its species" in shown(brownian, "mean-squared-displacement").caption


def test_the_colours_of_a_path_are_times(brownian: RunFolder) -> None:
    """From dark to light; the parts meet, so that the path has no gap."""
    found = shown(brownian, "tagged-path")
    _, *parts = layers(found, Line)
    assert all(one.x[-1] == two.x[0] for one, two in pairwise(parts))
    assert np.all(np.diff(found.shades) > 0)
    start, *places = layers(found, Points)  # a marker is the place at the end of its part
    ends = [(one.x[-1], one.y[-1]) for one in parts]
    assert [(place.x[0], place.y[0]) for place in places] == ends
    assert (start.x[0], start.y[0]) == (parts[0].x[0], parts[0].y[0])
    assert (found.scale_label, found.scale[-1]) == ("time (s)", "15 to 20")


def test_walls_limit_the_displacement(tmp_path: Path) -> None:
    """Two random places in a circle are a mean square of a² apart."""
    run = made(tmp_path / "run", "container={radius: 6}", text=TEXT)
    (limit,) = layers(shown(run, "mean-squared-displacement"), Reference)
    assert limit.value == pytest.approx((6 - 0.8) ** 2, rel=1e-4)
    assert limit.label == "random places in the circle"


def test_a_limit_is_drawn_once_and_each_name_of_a_legend_is_there_once(tmp_path: Path) -> None:
    """Each point had a line and an entry of its own, at one place and with one name."""
    circle = "container={radius: 6}"
    run = made(tmp_path / "run", circle, "balls[1].speed=10,20", "repeats=1", text=TEXT)
    found = shown(run, "mean-squared-displacement")
    assert len(layers(found, Reference)) == 1
    two = replace(found, layers=(*found.layers, Reference("y", 1.0, "random places in the circle")))
    (legend,) = draw(two).legends
    names = [text.get_text() for text in legend.get_texts()]
    assert len(names) == len(set(names)) == 5
