"""Points and repeats that are selected, and their words."""

from __future__ import annotations

from typing import Any

import pytest
from figure_runs import BASE

from snooker_cli.config import parse
from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, Selection, described, selected
from snooker_cli.figures.selection import evenly
from snooker_cli.runs import Run


@pytest.mark.parametrize(
    ("where", "indices"),
    [
        ({}, [0, 1, 2, 3, 4, 5]),
        ({"balls.radius": 1}, [3, 4, 5]),
        ({"balls.radius": 1.0, "balls.speed": (5.0, 20.0)}, [3, 5]),
        ({"cor": 1.0, "balls.mass": 1}, [0, 1, 2, 3, 4, 5]),  # which are not swept
    ],
)
def test_selections(warm: Run, where: dict[str, Any], indices: list[int]) -> None:
    assert [point.index for point in selected(warm, Selection(where))] == indices


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
    overrides = ["balls.rings=3", "wall_cor=null,0.5", "balls.radius=1e-5"]
    points = parse(BASE, overrides=overrides).points()
    assert described(points[0], "balls.rings") == "N = 37"
    assert described(points[0], "balls.radius") == "r = 1 × 10⁻⁵ m"
    assert described(points[0], "wall_cor") == "wall as balls"
    assert described(points[1], "wall_cor") == "wall CoR 0.5"
    assert described(points[0], "container.mass") == "M = 1 × 10⁷ kg"
