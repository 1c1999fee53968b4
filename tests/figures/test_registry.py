"""All figures of a run: those that it gives, and why it cannot give the others."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import (
    layers,
    made,
    shown,
    why_not,
)

from snooker_cli.errors import FigureError
from snooker_cli.figures import (
    FIGURES,
    FigureData,
    Reference,
    Selection,
    plain,
)
from snooker_cli.runs import Run


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


def test_every_kind_is_described() -> None:
    assert [figure for kind in FIGURES.values() for figure in kind.report_figures] == list(
        range(1, 19)
    )
    for name, kind in FIGURES.items():
        assert kind.name == name
        assert kind.needs.endswith(".")


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
