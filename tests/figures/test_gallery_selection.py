"""What a run cannot give, what is selected, and the words and data of pictures."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from galleries import BASE, layers, made, shown, why_not

from snooker_cli.config import parse
from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, Line, Reference, Selection, described, plain, selected
from snooker_cli.figures.selection import evenly
from snooker_cli.formatting import exact, listed, short, with_error
from snooker_cli.runs import Run

# What a run cannot give


def test_summaries_have_no_states(warm: Run) -> None:
    for kind in ("central-distances", "pair-distances", "momentum-x", "momentum-y"):
        assert "run the config with `record: events`" in why_not(warm, kind)


@pytest.mark.parametrize(
    ("kind", "key"),
    [
        ("pressure-temperature", "balls.speed"),
        ("pressure-area", "container.radius or container.width"),
        ("pressure-number", "balls.rings or balls.count"),
        ("temperature-ratio", "balls.radius"),
    ],
)
def test_a_sweep_is_needed(decaying: Run, kind: str, key: str) -> None:
    assert f"values of {key}; sweep that key" in why_not(decaying, kind)
    assert "elastic" in why_not(decaying, kind, cor=0.8)


def test_nothing_decays_where_all_is_elastic(warm: Run) -> None:
    for kind in ("decay-against-cor", "haff-time", "event-decay"):
        assert "nothing decays" in why_not(warm, kind)


def test_odd_scenes_get_a_sentence(tmp_path: Path) -> None:
    one = made(tmp_path / "one", "balls.rings=0", "collisions=20", "repeats=1", "cor=1,0.9")
    for kind in ("pair-distances", "speeds", "event-decay"):
        assert "two or more" in why_not(one, kind)
    assert layers(shown(one, "pressure", cor=1.0), Reference) == []  # of one ball, no theory
    still = made(tmp_path / "still", "balls.speed=0", "repeats=1")
    for kind in ("energy", "energy-fit", "haff-time", "event-decay"):
        assert "nothing moves" in why_not(still, kind)
    assert "momentum in x is zero" in why_not(still, "momentum-x")
    assert "nothing happens" in why_not(still, "pressure")
    fixed = made(tmp_path / "fixed", "container.mass=.inf", "collisions=20", "repeats=1")
    assert "container.mass" in why_not(fixed, "momentum-y")
    assert "cannot be fitted" in why_not(fixed, "pressure-fit")


# Selections


def test_selections(warm: Run) -> None:
    def indices(**where: Any) -> list[int]:
        keys = {key.replace("__", "."): value for key, value in where.items()}
        return [point.index for point in selected(warm, Selection(keys))]

    assert indices() == [0, 1, 2, 3, 4, 5]
    assert indices(balls__radius=1) == [3, 4, 5]
    assert indices(balls__radius=1.0, balls__speed=(5.0, 20.0)) == [3, 5]
    assert indices(cor=1.0) == [0, 1, 2, 3, 4, 5]  # which is not swept
    assert indices(balls__mass=1) == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize(
    ("selection", "sentence"),
    [
        (Selection({"balls.speed": 7.0}), "no point has balls.speed = 7.0: there it is 5.0, 10.0"),
        (Selection({"balls.sped": 7.0}), "no key balls.sped"),
        (Selection(repeat=3), "repeats 0 to 2"),
        (Selection(repeat=-1), "repeats 0 to 2"),
    ],
)
def test_what_cannot_be_selected(warm: Run, selection: Selection, sentence: str) -> None:
    with pytest.raises(FigureError, match=sentence):
        FIGURES["speeds"].make(warm, selection)


def test_many_points_along_one_key_are_thinned_evenly() -> None:
    eleven = parse(BASE, overrides=["cor=0.5:1.0:11"]).points()
    assert [point.index for point in evenly(eleven)] == [0, 2, 4, 6, 8, 10]
    assert evenly(eleven[:6]) == list(eleven[:6])
    grid = parse(BASE, overrides=["cor=0.5:0.9:5", "balls.radius=0.5,1"]).points()
    with pytest.raises(FigureError, match=r"10 points over cor and balls\.radius are too many"):
        evenly(grid)


def test_points_in_words() -> None:
    overrides = ["balls.rings=3", "wall_cor=null,0.5", "balls.radius=0.1"]
    points = parse(BASE, overrides=overrides).points()
    assert described(points[0], "balls.rings") == "N = 37"
    assert described(points[0], "balls.radius") == "r = 0.1 m"
    assert described(points[0], "wall_cor") == "wall as balls"
    assert described(points[1], "wall_cor") == "wall CoR 0.5"
    assert described(points[0], "container.mass") == "M = 1 × 10⁷ kg"
    (fixed,) = parse(BASE, overrides=["container.mass=.inf", "balls.radius=1e-5"]).points()
    assert described(fixed, "container.mass") == "fixed wall"
    assert described(fixed, "balls.radius") == "r = 1 × 10⁻⁵ m"


# The data itself


def test_every_kind_is_described() -> None:
    assert [figure for kind in FIGURES.values() for figure in kind.report_figures] == list(
        range(1, 19)
    )
    for name, kind in FIGURES.items():
        assert kind.name == name
        assert kind.needs.endswith(".")


def test_layers_keep_read_only_copies() -> None:
    x = np.arange(3.0)
    line = Line(x, x)
    x[0] = 7.0
    assert line.x.tolist() == [0.0, 1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        line.y[0] = 1.0


def test_numbers_of_a_picture_are_json(decaying: Run, warm: Run) -> None:
    for run in (decaying, warm):
        for kind in FIGURES.values():
            where = {"cor": 0.8} if run is decaying else {"balls.speed": 10.0}
            try:
                picture = kind.make(run, Selection(where))
            except FigureError:
                continue
            assert picture.kind == kind.name
            assert json.loads(json.dumps(picture.numbers, allow_nan=False)) == picture.numbers
    assert plain({"a": (math.nan, np.float64(1.5)), "b": np.array([1, 2])}) == {
        "a": [None, 1.5],
        "b": [1, 2],
    }


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (1.8404, 0.0123, "1.840 ± 0.012"),
        (17.3, 2.4, "17.3 ± 2.4"),
        (-0.5, 0.01, "−0.500 ± 0.010"),
        (1234.5, math.nan, "1234"),
        (3.2e-16, 1e-17, "(3.2 × 10⁻¹⁶ ± 1 × 10⁻¹⁷)"),
        (1234.4, 30.0, "1234 ± 30"),
        (12345.0, 300.0, "(1.234 × 10⁴ ± 3 × 10²)"),
    ],
)
def test_values_with_errors(value: float, error: float, text: str) -> None:
    assert with_error(value, error) == text


def test_words() -> None:
    assert short(-2.5e-15, 2) == "−2.5 × 10⁻¹⁵"
    assert short(0.25) == "0.25"
    assert exact(9.000000000000002) == "9.000000000000002"
    assert exact(9.0) == "9"
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
