"""Figures of a tagged ball."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from figure_runs import layers, made, shown, traces

from snooker_cli.analysis import diffusion
from snooker_cli.figures import Line, Points, Reference
from snooker_cli.figures.drawing import draw
from snooker_cli.runs import Run

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
def brownian(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("brownian") / "run", text=TEXT)


def test_the_displacement_has_its_limits_and_a_coefficient(brownian: Run) -> None:
    found = shown(brownian, "mean-squared-displacement")
    (points,) = layers(found, Points)
    ballistic, diffusive, *_ = layers(found, Line)
    theory = diffusion.expected(traces(brownian, 0)[0].start, 0)
    assert ballistic.y == pytest.approx(theory.mean_square_speed * ballistic.x**2)
    assert diffusive.y == pytest.approx(4 * theory.coefficient * diffusive.x)
    steps = np.diff(np.log2(points.x))
    assert steps == pytest.approx(1 / 3, rel=1e-9)  # even, and without near-doubles
    rows = [diffusion.correlations(trace, 0, points.x)[0] for trace in traces(brownian, 0)]
    assert points.y == pytest.approx(np.mean(rows, axis=0), rel=1e-12)
    assert points.y_error == pytest.approx(np.std(rows, axis=0, ddof=1) / np.sqrt(3), rel=1e-9)
    numbers = found.numbers["points"][0]
    five, ten = (int(np.argmin(abs(points.x - k * theory.relaxation_time))) for k in (5, 10))
    slope = (points.y[ten] - points.y[five]) / (points.x[ten] - points.x[five]) / 4
    assert numbers["diffusion_coefficient"] == pytest.approx(slope, rel=1e-9)
    assert "In two dimensions D depends on the time" in found.caption
    assert not layers(found, Reference)


def test_velocities_forget_and_their_integral_is_a_coefficient(brownian: Run) -> None:
    found = shown(brownian, "velocity-autocorrelation")
    (points,) = layers(found, Points)
    theory = diffusion.expected(traces(brownian, 0)[0].start, 0)
    law = layers(found, Line)[0]
    assert law.y == pytest.approx(np.exp(-law.x / theory.relaxation_time))
    assert points.y[0] == pytest.approx(1, rel=1e-12)
    numbers = found.numbers["points"][0]
    rows = [diffusion.correlations(trace, 0, points.x)[1] for trace in traces(brownian, 0)]
    assert numbers["mean_square_speed"] == pytest.approx(np.mean(rows, axis=0)[0], rel=1e-12)
    assert numbers["mean_square_speed"] != pytest.approx(theory.mean_square_speed, rel=1e-3)
    integral = np.trapezoid(points.y, points.x) * numbers["mean_square_speed"] / 2
    assert numbers["diffusion_coefficient"] == pytest.approx(integral, rel=1e-9)
    assert numbers["theory_coefficient"] == theory.coefficient


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
