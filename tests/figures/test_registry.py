"""All figures of a run: those that it gives, and why it cannot give the others."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from figure_runs import BASE, layers, made, shown, why_not

import snooker_cli
from snooker_cli.api.drawings import check_names
from snooker_cli.config import parse
from snooker_cli.errors import ArgumentError, FigureError
from snooker_cli.figures.figure_data import FigureData, Points
from snooker_cli.figures.registry import FIGURES, MOST_ALONG, former_names, own_figures, possible
from snooker_cli.figures.series import AXES
from snooker_cli.reproduction.reproduce import REPORT_FIGURES
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection


@pytest.mark.parametrize("shape", ["box", "periodic"])
def test_figures_describe_the_shape_that_is_there(
    shape: str, request: pytest.FixtureRequest
) -> None:
    run: RunFolder = request.getfixturevalue(shape)
    figures: dict[str, FigureData] = {}
    missing = {}
    for name, spec in FIGURES.items():
        try:
            figures[name] = spec.make(run, Selection({"cor": 0.9} if spec.each_point else {}))
        except FigureError as error:
            missing[name] = str(error)
    sweeps = {"gas-law", "temperature-ratio", "van-der-waals"}
    sweeps |= {"swept-key"}  # decay-against-cor has the main result
    others = {"central-distances", "momentum-x", "momentum-y"}
    others |= {"species-temperature", "rotation", "wall-impulses", "result-histogram"}
    others |= {"stationary", "profiles", "energy-balance", "heat-flux", "equation-of-state"}
    others |= {"structure-factor"} if shape == "box" else set()
    assert set(missing) == others | sweeps
    assert "only the wall of a circle is at one distance" in missing["central-distances"]
    assert ("take momentum" if shape == "box" else "is zero at the start") in missing["momentum-x"]
    for name, figure in figures.items():
        labels = [str(getattr(layer, "label", "")) for layer in figure.layers]
        words = " ".join([figure.title, figure.caption, *labels])
        for wrong in ("circle", "container", "R − r", "R = ", "momentum L"):
            assert wrong not in words, name
        assert ("periodic box, width 30 m, height 20 m" in words) is (shape == "periodic")
        assert shape == "box" or "wall" not in words, name
        assert json.loads(json.dumps(figure.numbers, allow_nan=False)) == figure.numbers


def test_reasons_for_missing_figures(warm: RunFolder, decaying: RunFolder) -> None:
    for kind in ("central-distances", "pair-distances"):
        assert "run the config with `record: events`" in why_not(warm, kind)
    assert "fixed walls take momentum" in why_not(warm, "momentum-x")
    for kind in ("decay-against-cor", "cooling", "event-decay", "energy-fit"):
        assert "nothing decays" in why_not(warm, kind)
    assert "values of balls.speed or container.radius" in why_not(decaying, "gas-law")
    assert "elastic" in why_not(decaying, "gas-law", cor=0.8)
    assert layers(shown(warm, "temperature-ratio"), Points)  # at the middle speed
    assert "choose one by cor" in why_not(decaying, "energy-fit")


def test_odd_scenes_get_a_sentence(tmp_path: Path) -> None:
    one = made(tmp_path / "one", "balls.rings=0", "collisions=20", "repeats=1", "cor=1,0.9")
    for kind in ("pair-distances", "speeds", "event-decay"):
        assert "two or more" in why_not(one, kind)
    alone = shown(one, "pressure", cor=1.0)
    assert alone.numbers["points"][0]["theory"] is None  # of one ball, no theory
    assert alone.x_label == "time (s)"  # it meets no other
    still = made(tmp_path / "still", "balls.speed=0", "repeats=1")
    for kind in ("energy", "energy-fit", "cooling", "event-decay"):
        assert "nothing moves" in why_not(still, kind)
    assert "momentum in x is zero" in why_not(still, "momentum-x")
    assert "nothing moves" in why_not(still, "pressure")
    assert "nothing happens" in why_not(still, "pressure-since-start")
    fixed = made(tmp_path / "fixed", "container.mass=.inf", "collisions=20", "repeats=1")
    assert "container.mass" in why_not(fixed, "momentum-y")
    assert "cannot be fitted" in why_not(fixed, "pressure-fit")


def reason_against(run: RunFolder, figure: str) -> str:
    """Why a run cannot give a figure; empty if it can."""
    try:
        FIGURES[figure].make(run, Selection(), first=True)
    except FigureError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", ["decaying", "driven", "periodic"])
def test_the_list_of_figures_has_all_that_a_run_gives(
    name: str, request: pytest.FixtureRequest
) -> None:
    """It reads configs alone. What it has beyond is a figure that needs more collisions."""
    run: RunFolder = request.getfixturevalue(name)
    listed = {figure: (fits, why) for figure, fits, why in possible(FIGURES, run.points)}
    needs_more = ("longer", "more repeats", "is zero at the start", "two or more areas")
    for figure, (fits, why) in listed.items():
        error = reason_against(run, figure)
        if fits:
            assert not error or any(words in error for words in needs_more), (figure, error)
        else:
            assert error in why, figure


def test_own_runs_leave_out_the_figures_of_the_source_report(
    decaying: RunFolder, tmp_path: Path
) -> None:
    """They are drawn by name, and by ``snooker reproduce``."""
    others = FIGURES.keys() - set(own_figures())
    assert others
    assert others <= {entry["figure"] for entry in REPORT_FIGURES.values()}
    run = snooker_cli.open(decaying.directory)
    assert not others & {row["figure"] for row in run.possible_figures()}
    (named,) = run.possible_figures("ideal-ratio")
    assert named["possible"]
    assert "ideal-ratio" in others
    saved = run.save_figures("ideal-ratio", out=tmp_path, formats=["svg"])
    assert [figure.name for figure in saved] == ["ideal-ratio"]
    assert {row["figure"] for row in snooker_cli.figure_list() if row["reproduce_only"]} == others


RATIOS = (
    "/",
    "αt",
    "g(r)",
    "S(k)",
    "|ψ₆|",
    "|⟨ψ₆⟩|",
    "a₂",
    "over",
    "number of",
    "balls of",
    "balls in",
    "collisions per",
)
RATIOS += ("packing fraction", "coefficient of restitution", "reduced", "k times", "density")
RATIOS += (
    "correlation",
    "share of the balls",
    "rings of balls",
    "tangential restitution",
    "friction",
)
"""Words of the labels of axes that are numbers without a unit."""


def test_axes_have_units() -> None:
    labels = {
        label
        for spec in FIGURES.values()
        for key in ("x_label", "y_label", "panel_label")
        if (label := spec.axes.get(key))
    }
    labels |= set(AXES.values())
    unclear = {text for text in labels if not re.search(r"\([^()]*\)$", text)}
    assert {text for text in unclear if not any(word in text for word in RATIOS)} == set()


def test_series_of_many_points_are_thinned() -> None:
    points = parse(BASE, overrides=["cor=0.1:0.9:900"]).points()
    (group,) = FIGURES["decay-against-cor"].groups(points)
    assert (len(group), group[0], group[-1]) == (MOST_ALONG, points[0], points[-1])


@pytest.mark.parametrize("old", sorted(former_names()))
def test_former_names_of_figures_give_the_new_one(old: str) -> None:
    """In one sentence, also of an old name that is near to another one."""
    assert old not in FIGURES
    assert former_names()[old] in own_figures()
    with pytest.raises(ArgumentError, match=f"{old} is now part of {former_names()[old]};"):
        check_names(["energy", old])
