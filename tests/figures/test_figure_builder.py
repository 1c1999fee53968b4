"""Points and repeats that are selected, and the end of every caption."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_runs import BASE, BOX, DECAYING, layers, made, shown, traces, why_not
from repeating import batches_of, file_of, run_of

from snooker_cli.analysis import quantities, theories
from snooker_cli.config import parse
from snooker_cli.errors import FigureError
from snooker_cli.figures import registry
from snooker_cli.figures.caption_text import Caption
from snooker_cli.figures.figure_data import Points
from snooker_cli.figures.registry import FIGURES
from snooker_cli.figures.series import along, as_series, evenly
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection, matching, selected, unfinished, value_at
from snooker_cli.trace import StopReason


@pytest.fixture
def broken(tmp_path: Path) -> RunFolder:
    """The run ``decaying``, interrupted: CoR 0.8 is whole, 0.9 has its last repeat, 1.0 none."""
    with batches_of(1):
        run = made(tmp_path / "broken", *DECAYING)
    for point, repeat in ((1, 0), (1, 1), (2, 0), (2, 1), (2, 2)):
        file_of(run, point, repeat).unlink()
    return run


def test_captions_describe_the_scene_and_its_repeats(decaying: RunFolder, tmp_path: Path) -> None:
    scene = "Scene: N = 19, r = 1 m, v₀ = 10 m/s, R = 10 m, CoR 0.8, wall CoR 1; "
    one = shown(decaying, "energy", repeat=2, cor=0.8).caption
    assert one.endswith(scene + "repeat 2 of 3, 200 collisions: complete.")
    several = shown(decaying, "energy", cor=0.8).caption
    assert several.endswith(scene + "3 repeats, 200 collisions: all complete.")
    mixture = "balls=[{count: 9, radius: 0.6, speed: 10}, {count: 4, radius: 0.9, speed: 10}]"
    run = made(tmp_path / "mixture", mixture, "sweep={}", "collisions=50", text=BOX)
    caption = shown(run, "energy").caption
    assert "Scene: N = 13 of several species, box, width 20 m, height 14 m, CoR 0.9" in caption


def test_a_caption_says_what_y_is_then_the_result_the_theory_and_the_scene() -> None:
    parts = Caption(["Y."], ["α = 1 1/s.", ""], ["Theory."], ["Bold."], ["Scene."])
    assert parts.text == "Y. α = 1 s⁻¹. Theory. Bold. Scene."


def test_captions_cite_theories_from_their_table(periodic: RunFolder) -> None:
    found = shown(periodic, "pair-correlation", cor=1.0).caption
    source = theories.source_of(quantities.CONTACT, theories.CHI)
    assert source in found
    assert found.index("Pair correlation at contact") < found.index(source)
    assert found.index(source) < found.index("Bold: ") < found.index("Scene: ")
    for path in files("snooker_cli.figures").iterdir():
        if path.name.endswith(".py"):  # a method has no entry in the table
            by_hand = re.findall(
                r"[^.]*\((?:[A-Z][^()]* )?(?:19|20)\d\d\)", path.read_text("utf-8")
            )
            assert not any("theory" in text.lower() for text in by_hand), path.name


def test_captions_count_what_ended_early(tmp_path: Path) -> None:
    overrides = ("balls.rings=1", "cor=0.85,1.0", "wall_cor=null", "repeats=4", "seed=8")
    run = made(tmp_path / "trapped", *overrides)
    ended = [trace.stop.reason is StopReason.WALL_TRAP for trace in traces(run, 0)]
    assert 0 < sum(ended) < 4
    assert shown(run, "ideal-ratio").caption.endswith(
        f"4 repeats, at most 200 collisions: {sum(ended)} of 8 repeats ended early, in a wall trap."
    )
    assert f"{sum(ended)} of 4 repeats ended" in shown(run, "pressure", cor=0.85).caption
    assert "early" not in shown(run, "pressure", cor=1.0).caption
    alone = shown(run, "energy", repeat=ended.index(True), cor=0.85).caption
    assert "the repeat ended early, in a wall trap." in alone


def test_figures_of_an_unfinished_run(broken: RunFolder, decaying: RunFolder) -> None:
    missing = "the run is unfinished: 4 of 9 repeats are there, of 2 of 3 points"
    assert unfinished(broken, Selection()) == missing
    assert unfinished(decaying, Selection()) == ""
    assert shown(broken, "energy").caption.endswith(f" T{missing[1:]}.")
    means = shown(broken, "decay-against-cor")
    assert [record["repeats"] for record in means.numbers["points"]] == [3, 1]
    assert np.isnan(layers(means, Points)[0].y_error).tolist() == [False, True]  # of one repeat
    fit = shown(broken, "energy-fit", cor=0.9)
    assert fit.numbers["repeat"] == 2
    whole = shown(decaying, "energy-fit", repeat=2, cor=0.9)
    assert fit.numbers["repeat_k"] == whole.numbers["repeat_k"]
    assert "no repeat is there yet" in why_not(broken, "energy", cor=1.0)
    assert "repeat 0 is not there yet" in why_not(broken, "energy", repeat=0, cor=0.9)


@pytest.mark.parametrize(
    ("where", "indices"),
    [
        ({"balls.radius": 1, "balls.speed": (5.0, 20.0)}, [3, 5]),
        ({"cor": 1.0, "balls.mass": 1}, [0, 1, 2, 3, 4, 5]),  # which are not swept
    ],
)
def test_selections(warm: RunFolder, where: dict[str, Any], indices: list[int]) -> None:
    assert [point.index for point in selected(warm, Selection(where))] == indices


def test_many_points_over_several_keys_have_the_middle_of_the_others() -> None:
    grid = parse(BASE, overrides=["cor=0.5:0.9:5", "balls.radius=0.5,0.7,1"]).points()
    assert [point.parameters for point in evenly(grid, 6)] == [
        (("cor", e), ("balls.radius", 0.7)) for e in (0.5, 0.6, 0.7, 0.8, 0.9)
    ]
    assert evenly(grid) == list(grid)
    ((*series,),) = along(grid, ["cor"], None)
    assert series == evenly(grid, 6)
    keys = ["cor=0.7,0.8", "balls.radius=0.5,1", "balls.speed=1,2,3"]
    of_three = parse(BASE, overrides=keys).points()
    assert evenly(of_three) == list(of_three)
    assert as_series(of_three) == [p for p in of_three if value_at(p, "balls.speed") == 2.0]


def test_many_collisions_are_those_of_few_repeats(
    decaying: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each repeat has 200: two fit. Means of pressures and fits use all repeats."""
    monkeypatch.setattr(registry, "MOST_COLLISIONS", 3 * 599)
    found = FIGURES["energy"].make(decaying, Selection())
    assert [row["repeats"] for row in found.numbers["points"]] == [2, 2, 2]
    assert found.caption.endswith("The figure uses 2 evenly chosen repeats of each point.")
    for name in ("event-decay", "decay-against-cor"):
        figure = FIGURES[name].make(decaying, Selection())
        assert [row["repeats"] for row in figure.numbers["points"]] == [3, 3]
        assert "evenly chosen" not in figure.caption


def test_a_rounded_value_finds_the_only_one(tmp_path: Path) -> None:
    text = "container: {radius: 10}\nballs: {rings: 1, radius: 1, speed: 1}\ncollisions: 1\n"
    values = 0.5357142857142857, 0.6928571428571428, 0.7, 0.75
    run = run_of(tmp_path / "run", f"{text}sweep: {{cor: {[*values]}}}\n")
    for given, value in ((0.536, values[0]), (0.692857, values[1]), (0.7, 0.7)):
        (point,) = matching(run, Selection({"cor": given}))
        assert point.config.cor == value
    there = r"there it is 0\.535714, 0\.692857, 0\.7 and 0\.75"
    for given in (0.8, 0.694):
        with pytest.raises(FigureError, match=there):
            matching(run, Selection({"cor": given}))
