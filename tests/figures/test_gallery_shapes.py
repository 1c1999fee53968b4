"""Pictures of boxes and periodic boxes: what they show, what they say, and what cannot be."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from galleries import layers, made, shown, traces, why_not

from snooker_cli import containers, theory
from snooker_cli.analysis import observables
from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, FigureData, Histogram, Line, Reference, Selection
from snooker_cli.runs import Run

BOX = """\
container: {shape: box, width: 20, height: 14}
balls: {count: 37, radius: 0.6, speed: 10.0}
cor: 0.9
collisions: 400
repeats: 3
sweep: {cor: [0.8, 0.9, 1.0]}
"""

PERIODIC = """\
container: {shape: periodic, width: 30, height: 20}
balls: {count: 64, radius: 0.6, speed: 10.0, speeds: maxwell}
cor: 0.9
wall_cor: 0.5
collisions: 500
repeats: 3
sweep: {cor: [0.8, 0.9, 1.0]}
"""

ADRIFT = """\
container: {shape: periodic, width: 16, height: 16}
balls:
  list:
    - {position: [-5.0, 1.0], velocity: [9.0, 3.0], radius: 1.0}
    - {position: [-1.0, 0.0], velocity: [6.0, 3.0], radius: 1.0}
    - {position: [4.0, 0.5], velocity: [5.0, 3.0], radius: 1.0}
cor: 0.9
collisions: 60
"""


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("box") / "run", text=BOX)


@pytest.fixture(scope="module")
def periodic(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("periodic") / "run", text=PERIODIC)


def all_of(run: Run) -> tuple[dict[str, FigureData], dict[str, str]]:
    """Every picture that a run can give, and why it cannot give the others."""
    pictures, lacking = {}, {}
    for name, kind in FIGURES.items():
        selection = Selection({"cor": 0.9} if kind.each_point else {})
        try:
            pictures[name] = kind.make(run, selection)
        except FigureError as error:
            lacking[name] = str(error)
    return pictures, lacking


@pytest.mark.parametrize("shape", ["box", "periodic"])
def test_pictures_speak_of_the_shape_that_is_there(
    shape: str, request: pytest.FixtureRequest
) -> None:
    pictures, lacking = all_of(request.getfixturevalue(shape))
    sweeps = {"pressure-temperature", "pressure-area", "pressure-number", "temperature-ratio"}
    assert set(lacking) == {"central-distances", "momentum-x", "momentum-y"} | sweeps
    for name, picture in pictures.items():
        words = " ".join(
            [
                picture.title,
                picture.caption,
                *(str(vars(layer).get("label")) for layer in picture.layers),
            ]
        )
        for wrong in ("circle", "container", "R − r", "R = ", "floor of L"):
            assert wrong not in words, name
        if shape == "periodic":
            assert "wall" not in words, name
        assert ("periodic box, width 30 m, height 20 m" in words) is (shape == "periodic")
    assert "only the wall of a circle is at one distance" in lacking["central-distances"]


def test_a_box_takes_momentum_and_a_periodic_one_starts_with_none(box: Run, periodic: Run) -> None:
    for kind in ("momentum-x", "momentum-y"):
        assert why_not(box, kind) == "the walls of a box are fixed and take momentum"
        assert "is zero at the start" in why_not(periodic, kind)


def test_momentum_is_kept_without_walls(tmp_path: Path) -> None:
    run = made(tmp_path / "adrift", text=ADRIFT)
    found = shown(run, "momentum-x")
    assert found.title == "Total momentum in x, the balls"
    assert found.numbers["points"][0]["momentum_at_start"] == 20.0
    assert found.numbers["largest_deviation"] < 1e-14
    # Of a total momentum of 20 and 9 kg m/s; half of the square over the mass is left in the end.
    (trace,) = traces(run, 0)
    kept = (20**2 + 9**2) / 6 / trace.start.kinetic_energy
    decay = shown(run, "event-decay")
    (floor,) = layers(decay, Reference)
    assert floor.value == pytest.approx(kept, rel=1e-12)
    assert floor.label is not None
    assert floor.label.startswith("floor of p")
    assert "p²/(2Nm)" in decay.caption
    assert "at the wall" not in decay.caption


@pytest.mark.parametrize("shape", ["box", "periodic"])
def test_pair_distances_beside_uniform_ones(shape: str, request: pytest.FixtureRequest) -> None:
    found = shown(request.getfixturevalue(shape), "pair-distances")
    (line,) = (each for each in layers(found, Line) if each.label)
    # The rule of trapezoids over 200 points; a periodic box's density jumps in slope only.
    area = float(np.sum((line.y[1:] + line.y[:-1]) / 2 * np.diff(line.x)))
    assert area == pytest.approx(1, abs=2e-3)
    sides = np.array([30.0, 20.0]) if shape == "periodic" else np.array([18.8, 12.8])
    farthest = math.hypot(*sides) / (2 if shape == "periodic" else 1)
    assert line.x[-1] == pytest.approx(farthest, rel=1e-12)
    # Means of the square of a uniform distance: s²/12 of each side of images, s²/6 between walls.
    square = float(np.sum(line.x**2 * line.y) / np.sum(line.y))
    expected = float(np.sum(sides**2)) / (12 if shape == "periodic" else 6)
    assert square == pytest.approx(expected, rel=5e-3)
    assert all(each.edges[0] == 1.2 for each in layers(found, Histogram))
    assert ("nearest images" in found.caption) is (shape == "periodic")


def test_pressure_of_a_periodic_box_starts_at_the_ideal_gas_s(periodic: Run) -> None:
    found = shown(periodic, "pressure", cor=1.0)
    (line,) = layers(found, Line)
    assert line.y[0] == pytest.approx(64 * 50 / 600, rel=1e-12)
    measured = observables.mean_pressure(traces(periodic, 2)[0])
    assert line.y[-1] == pytest.approx(measured, rel=1e-12)
    (reference,) = layers(found, Reference)
    ratio = theory.compressibility(64 * math.pi * 0.36 / 600)
    # Balls meet at E/(N − 1), as their centre of mass is at rest.
    expected = (64 * 50 + (ratio - 1) * 64 * 50 * 64 / 63) / 600
    assert reference.value == pytest.approx(expected, rel=1e-9)
    assert abs(line.y[-1] / reference.value - 1) < 0.1


def test_pressure_against_area_and_number_of_boxes(tmp_path: Path) -> None:
    elastic = ("cor=1", "sweep={}", "repeats=1")
    square = "container={shape: box, width: 20}"
    wide = made(tmp_path / "wide", *elastic, square, "container.width=20,30", text=BOX)
    found = shown(wide, "pressure-area")
    ideal = next(line for line in layers(found, Line) if line.label == "ideal gas")
    assert ideal.x[[0, -1]].tolist() == pytest.approx([400, 900])
    assert ideal.y == pytest.approx(37 * 50 / ideal.x, rel=1e-12)
    curve = next(line for line in layers(found, Line) if line.style == "dotted" and len(line.x))
    state = theory.fluid_state(37, 50.0, 0.6, containers.Box(20.0, 20.0))
    assert curve.y[0] == pytest.approx(state.pressure, rel=1e-12)
    many = made(tmp_path / "many", *elastic, "balls.count=20,40", text=PERIODIC)
    found = shown(many, "pressure-number")
    curve = next(line for line in layers(found, Line) if line.style == "dotted" and len(line.x))
    assert curve.x[-1] == 40
    bulk = theory.bulk_pressure(40, 50.0, 0.6, 600.0)
    assert curve.y[-1] == pytest.approx(bulk, rel=1e-9)
    assert "periodic box, width 30 m, height 20 m" in found.caption
    assert "wall CoR" not in found.caption


def test_the_law_of_speeds_counts_one_ball_less(periodic: Run, tmp_path: Path) -> None:
    labels = [line.label for line in layers(shown(periodic, "speeds"), Line)]
    assert labels == ["Maxwell–Boltzmann", "fixed energy, 63 free balls"]
    adrift = made(tmp_path / "adrift", "cor=1", "collisions=1000", text=ADRIFT)
    found = shown(adrift, "speeds")
    assert [line.label for line in layers(found, Line)] == ["Maxwell–Boltzmann"]
    assert "from Maxwell and Boltzmann's law" in found.caption
    assert found.numbers["points"][0]["distance_from_fixed_energy"] is None


def test_captions_count_species(tmp_path: Path) -> None:
    mixture = "balls=[{count: 9, radius: 0.6, speed: 10}, {count: 4, radius: 0.9, speed: 10}]"
    run = made(tmp_path / "mixture", mixture, "sweep={}", "collisions=50", text=BOX)
    caption = shown(run, "energy").caption
    assert "Scene: N = 13 of 2 species, box, width 20 m, height 14 m, CoR 0.9" in caption
