"""Figures, tables and reports of runs side by side, and of the main result along a swept key."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from figure_runs import BASE, ROUGH, layers, made, shown, why_not
from matplotlib.colors import to_rgb

import snooker_cli as snooker
from snooker_cli.analysis.gas import finite_haff_rate, late_spins
from snooker_cli.analysis.run_analysis import comparisons
from snooker_cli.config import parse
from snooker_cli.errors import FigureError
from snooker_cli.figures.figure_builder import FigureBuilder, theories_once
from snooker_cli.figures.figure_data import NEUTRAL, Line, Points
from snooker_cli.figures.legends import PALEST, colour
from snooker_cli.figures.registry import FIGURES, possible
from snooker_cli.figures.series import described, scale
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection
from snooker_cli.runs.side_by_side import FoldersSideBySide


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunFolder, RunFolder]:
    """Two sweeps over the CoR with different walls, and the paths that commands open."""
    folder = tmp_path_factory.mktemp("runs")
    return (
        made(folder / "A", "cor=0.8,0.9", "wall_cor=null", "repeats=4"),
        made(folder / "B", "cor=0.8,0.9", "repeats=5"),
    )


@pytest.fixture(scope="module")
def joined(runs: tuple[RunFolder, RunFolder]) -> FoldersSideBySide:
    return FoldersSideBySide.of(runs)


def test_each_run_is_a_series(runs: tuple[RunFolder, RunFolder], joined: FoldersSideBySide) -> None:
    found = shown(joined, "decay-against-cor")
    filled = [points for points in layers(found, Points) if points.filled and len(points.x)]
    assert [points.label for points in filled] == ["A, wall CoR = ball CoR", "B, wall CoR 1"]
    assert [points.series for points in filled] == [0, 1]
    for run, points in zip(runs, filled, strict=True):
        alone = shown(run, "decay-against-cor")
        (alpha,) = (p for p in layers(alone, Points) if p.label == "Haff's law fitted")
        assert points.y.tolist() == alpha.y.tolist()
    # The walls differ, and so does theory.
    theories = [line for line in layers(found, Line) if len(line.x)]
    assert [line.series for line in theories] == [0, 1]
    assert not found.shades


def test_one_series_for_one_point_of_each_run(joined: FoldersSideBySide) -> None:
    found = shown(joined, "energy", cor=0.9)
    lines = [line for line in layers(found, Line) if len(line.x) and not line.thin]
    assert [line.label for line in lines] == ["A, wall CoR = ball CoR", "B, wall CoR 1"]
    assert "4 to 5 repeats, at most 200 collisions: 1 of 9 repeats ended early" in found.caption


def test_several_points_of_a_run_are_shades_of_its_colour(joined: FoldersSideBySide) -> None:
    found = shown(joined, "event-decay")
    assert (found.hues, found.shades) == ((0, 0, 1, 1), (0.0, 1.0, 0.0, 1.0))
    assert colour(0, found.shades, found.hues) == colour(0)
    assert colour(2, found.shades, found.hues) != colour(0)
    assert found.scale == ("CoR 0.8", "CoR 0.9") * 2
    assert len(found.hue_names) == 2
    strong, pale = (np.array(to_rgb(colour(k, found.shades, found.hues))) for k in (0, 1))
    assert pale == pytest.approx(1 - (1 - strong) * (1 - PALEST), abs=0.005)
    assert not shown(joined, "event-decay", cor=0.9).hues


def test_one_value_of_the_key_from_each_run(tmp_path: Path) -> None:
    """No run sweeps the CoR: the points of the runs are one series along it."""
    pair = FoldersSideBySide.of([made(tmp_path / "A", "cor=0.8"), made(tmp_path / "B", "cor=0.9")])
    found = shown(pair, "decay-against-cor")
    alpha = next(p for p in layers(found, Points) if p.label == "Haff's law fitted")
    assert alpha.x.tolist() == [0.8, 0.9]
    radii = (made(tmp_path / radius, f"balls.radius={radius}") for radius in ("0.5", "1.0"))
    pair = FoldersSideBySide.of([*radii])
    main = next(points for points in layers(shown(pair, "swept-key"), Points) if len(points.x))
    assert main.x.tolist() == [0.5, 1.0]


def test_runs_with_other_keys_of_balls_are_drawn_together(tmp_path: Path) -> None:
    """One has rings, the other random places; a key that a run lacks has no words and no value."""
    random = "balls={count: 19, radius: 1.0, speed: 10.0, start: random}"
    pair = FoldersSideBySide.of([made(tmp_path / "rings"), made(tmp_path / "random", random)])
    drawn = 0
    for name, spec in FIGURES.items():
        with suppress(FigureError):
            found, drawn = spec.make(pair, Selection(), first=True), drawn + 1
            labels = [str(getattr(layer, "label", None) or "") for layer in found.layers]
            assert "None" not in " ".join([found.title, found.caption, *labels]), name
    assert drawn > 7
    lines = [line for line in layers(shown(pair, "energy"), Line) if len(line.x)]
    assert [line.label for line in lines] == ["rings, N = 19, ring extent 0.8", "random"]
    elastic = [made(tmp_path / "A", "cor=1"), made(tmp_path / "B", random, "cor=1")]
    assert "balls.rings or balls.count" in why_not(FoldersSideBySide.of(elastic), "gas-law")


def test_a_swept_key_has_its_unit(tmp_path: Path) -> None:
    """On the axis, in the caption and in legends."""
    found = shown(made(tmp_path / "run", "balls.radius=0.5,1.0"), "swept-key")
    assert found.x_label == "ball radius (m)"
    assert found.result["unit"] == "s⁻¹"
    assert "s⁻¹ at r = 0.5 m to" in found.caption
    speeds = parse(BASE, overrides=["wall_cor=0.9", "wall_cor_speed=1.0,2.0"]).points()
    assert described(speeds[0], "wall_cor_speed") == "wall CoR as at 1 m/s"
    assert scale(speeds) == ("wall CoR as at (m/s)", ("1", "2"))


def test_the_steady_temperature_is_along_a_value_of_each_run(tmp_path: Path) -> None:
    how = ("collisions=2000", "container.mass=.inf", "repeats=2")
    runs = [made(tmp_path / speed, *how, f"wall_speed={speed}") for speed in ("1.0", "2.0")]
    (points,) = (p for p in layers(shown(FoldersSideBySide.of(runs), "stationary"), Points))
    assert points.x.tolist() == [1.0, 2.0]


def test_theory_is_drawn_once_if_it_is_the_same(tmp_path: Path) -> None:
    runs = [made(tmp_path / "A", "cor=0.8,0.9"), made(tmp_path / "B", "cor=0.8,0.9", "seed=2")]
    found = shown(FoldersSideBySide.of(runs), "decay-against-cor")
    (line,) = (line for line in layers(found, Line) if len(line.x))
    assert line.series == NEUTRAL
    assert len([points for points in layers(found, Points) if points.filled and len(points.x)]) == 2


def test_curves_that_differ_visibly_stay(decaying: RunFolder) -> None:
    x = np.linspace(0.0, 1.0, 9)
    build = FigureBuilder(decaying, None, [[*decaying.points]], {})  # type: ignore[arg-type]
    build.lines = [
        Line(x, x + 1, None, 0, "dashed"),
        Line(2 * x, 2 * x + 1.0005, None, 1, "dashed"),  # the same, and longer
        Line(x, x + 1.01, None, 2, "dashed"),
        Line(x, x + 1, None, 3, "dotted"),
        Line(x, x + 1, None, 4),  # a simulation
    ]
    kept = [(line.series, len(line.x), line.x[-1]) for line in theories_once(build.lines)]
    assert kept == [(NEUTRAL, 9, 2.0), (2, 9, 1.0), (3, 9, 1.0), (4, 9, 1.0)]


def test_analyses_are_those_of_each_run(
    runs: tuple[RunFolder, RunFolder], joined: FoldersSideBySide
) -> None:
    found = comparisons(joined).rows
    alone = [row for run in runs for row in comparisons(run).rows]
    assert [row["measured"] for row in found] == [row["measured"] for row in alone]
    first, last = (row["parameters"] for row in (found[0], found[-1]))
    assert first == {"run": "A", "cor": 0.8, "wall_cor": None}
    assert last == {"run": "B", "cor": 0.9, "wall_cor": 1.0}
    assert [row["requested"] for row in (found[0], found[-1])] == [4, 5]


def test_tables_of_python_and_commands(runs: tuple[RunFolder, RunFolder]) -> None:
    pair = snooker.open(*(run.directory for run in runs))
    lines = pair.fit(quantity="kinetic", cor=0.9).lines()
    table = lines[lines.index("") + 1 :]
    assert table[0].split()[:3] == ["point", "constant,", "1/s"]
    assert table[1] == "kinetic energy, exponential, A 1"
    assert table[4] == "kinetic energy, haff, A 1"
    places = ["  A, wall_cor=cor ", "  B, wall_cor=1.0 "] * 2
    rows = [line for line in table[1:] if line.startswith("  ")]
    assert [row[: len(place)] for row, place in zip(rows, places, strict=True)] == places
    columns = pair.table()
    assert columns["run"].tolist() == ["A"] * 8 + ["B"] * 10
    assert len(pair.matching(run="B", cor=0.9)) == 1
    with pytest.raises(FigureError, match="no point has run = C: there it is A and B"):
        pair.matching(run="C")


def test_the_main_result_along_any_number(tmp_path: Path) -> None:
    """With theory between the points."""
    run = made(tmp_path / "R", "cor=0.8", "balls.radius=0.5,1.0", "collisions=600")
    found = shown(run, "swept-key")
    (points,) = (points for points in layers(found, Points) if len(points.x))
    rows = [row for row in comparisons(run).rows if row["quantity"] == "Haff's α"]
    of_point = {row["parameters"]["balls.radius"]: row for row in rows}  # the last is the best
    assert points.x.tolist() == [0.5, 1.0]
    assert points.y.tolist() == [of_point[radius]["measured"] for radius in (0.5, 1.0)]
    (line,) = (line for line in layers(found, Line) if len(line.x))
    assert len(line.x) == 100
    assert line.y[[0, -1]] == pytest.approx([of_point[r]["predicted"] for r in (0.5, 1.0)])
    between = parse(BASE, overrides=["cor=0.8", f"balls.radius={line.x[50]}"]).points()[0]
    of_start = finite_haff_rate(starting_scene(between.config, 0))
    assert line.y[50] == pytest.approx(of_start, rel=0.01)
    assert "α rises from" in found.caption
    with pytest.raises(FigureError, match="sweep a key"):
        shown(run, "swept-key", balls__radius=1.0)


def test_theory_of_spins_is_drawn_between_the_points(tmp_path: Path) -> None:
    """Its course up to as many collisions of a ball, also where no point is."""
    run = made(tmp_path / "R", "tangential_cor=-0.9,0.5", "repeats=2", text=ROUGH)
    (line,) = (line for line in layers(shown(run, "swept-key"), Line) if len(line.x))
    assert len(line.x) == 100
    scene = starting_scene(parse(ROUGH).points()[0].config, 0)
    surface = scene.surface
    assert surface is not None
    expected = [
        late_spins(replace(scene, surface=replace(surface, tangential_cor=float(x))), 40.0)
        for x in line.x
    ]
    # What was measured at the two points changes it by a factor, straight between them.
    factor = line.y / expected
    assert factor == pytest.approx(np.linspace(factor[0], factor[-1], 100), rel=1e-9)
    assert factor == pytest.approx(np.ones(100), abs=0.1)


def test_a_key_that_another_figure_has_is_left_to_it(tmp_path: Path) -> None:
    """Of a sweep over two keys the other one is on the axis."""
    run = made(tmp_path / "R", "cor=0.8,0.9", "balls.radius=0.5,1.0", "repeats=2")
    found = shown(run, "swept-key")
    assert found.x_label == "ball radius (m)"
    assert [points.x.tolist() for points in layers(found, Points) if len(points.x)] == [
        [0.5, 1.0]
    ] * 2
    why = "decay-against-cor has Haff's α along cor; draw decay-against-cor"
    assert why_not(run, "swept-key", balls__radius=1.0) == why
    fits = [fits for _, fits, _ in possible(["swept-key"], run.points[::2])]
    assert fits == [False]


TOGETHER = "sweep: {zip: {cor: [0.7, 0.8, 0.9], balls.radius: [0.8, 0.9, 1]}}"
ZIPPED = BASE.replace("\ncor: 0.9", f"\n{TOGETHER}\ncor: 0.9")


def test_keys_that_change_together_are_one_axis(tmp_path: Path) -> None:
    """It was listed, and then refused with the advice to run longer."""
    run = made(tmp_path / "run", text=ZIPPED)
    assert [fits for _, fits, _ in possible(["swept-key"], run.points)] == [True]
    found = shown(run, "swept-key")
    (points,) = layers(found, Points)
    assert points.x.tolist() == [0.7, 0.8, 0.9]
    assert "Along with it changes: ball radius." in found.caption
    why = "balls.radius changes with cor, so that it does not show cor alone; "
    assert why_not(run, "decay-against-cor") == f"{why}run a sweep of cor alone"


def test_points_that_leave_a_figure_are_named(tmp_path: Path) -> None:
    """A point whose wall is elastic does not cool."""
    run = made(tmp_path / "run", "cor=1", "wall_cor=0.8,0.9,1.0")
    found = shown(run, "swept-key")
    assert len(layers(found, Points)[0].x) == 2
    assert "sweep more values of it" in why_not(run, "swept-key", wall_cor=(0.8, 1.0))
    left_out = "Left out: 1 of 3 points without this result or this theory (wall CoR 1)."
    assert left_out in found.caption
