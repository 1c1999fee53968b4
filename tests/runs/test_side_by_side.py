"""Several runs as one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from figure_runs import BASE, BOX, made

from snooker_cli.config import parse
from snooker_cli.errors import RunError
from snooker_cli.runs import RunFolder
from snooker_cli.runs.side_by_side import FoldersSideBySide


def planned(name: str, *overrides: str) -> RunFolder:
    """A run without files."""
    loaded = parse(BASE, overrides=list(overrides))
    return RunFolder(Path(name), loaded.config, loaded.points())


def parameters(*runs: RunFolder) -> list[dict[str, object]]:
    return [dict(point.parameters) for point in FoldersSideBySide.of(runs).points]


def test_the_parameters_are_what_tells_the_points_apart() -> None:
    found = parameters(planned("A", "cor=0.8"), planned("B", "cor=0.9"))
    assert found == [{"run": "A", "cor": 0.8}, {"run": "B", "cor": 0.9}]
    found = parameters(planned("A", "cor=0.8,0.9"), planned("B", "cor=0.8", "wall_cor=0.5"))
    assert found == [
        {"run": "A", "cor": 0.8, "wall_cor": 1.0},
        {"run": "A", "cor": 0.9, "wall_cor": 1.0},
        {"run": "B", "cor": 0.8, "wall_cor": 0.5},
    ]


def test_what_changes_no_physics_is_no_parameter() -> None:
    others = ("seed=7", "repeats=9", "collisions=5000", "record=summary", "title=other")
    assert parameters(planned("A"), planned("B", *others)) == [{"run": "A"}, {"run": "B"}]


def test_a_key_that_a_run_does_not_have_is_null_there() -> None:
    box = parse(BOX)
    found = parameters(planned("A"), RunFolder(Path("B"), box.config, box.points()))
    assert [(point["container.radius"], point["container.width"]) for point in found] == [
        (10.0, None),
        *[(None, 20.0)] * 3,
    ]


def test_names_of_folders_that_are_alike_have_the_folder_above(tmp_path: Path) -> None:
    runs = [replace(planned("x"), directory=tmp_path / name / "same") for name in ("one", "two")]
    assert [point["run"] for point in parameters(*runs)] == ["one/same", "two/same"]
    with pytest.raises(RunError, match="same: this run is given twice; give each run once"):
        FoldersSideBySide.of([runs[0], runs[0]])


def test_files_and_repeats_are_those_of_each_run(tmp_path: Path) -> None:
    runs = [
        made(tmp_path / "A", "cor=0.8"),
        made(tmp_path / "B", "cor=0.85,0.9", "repeats=5"),
    ]
    joined = FoldersSideBySide.of(runs)
    assert joined.name == "A and B"
    own = [(run, point) for run in runs for point in run.points]
    for point, (run, of_run) in zip(joined.points, own, strict=True):
        assert joined.origin(point) == (run, of_run)
        assert joined.present(point) == run.present(of_run) == [*range(joined.requested(point))]
        assert joined.batches(point.index) == run.batches(of_run.index)
        ours, theirs = joined.read(point, 2), run.read(of_run, 2)
        assert ours.stop == theirs.stop
        assert ours.start.restitution == of_run.config.cor
    assert [joined.requested(point) for point in joined.points] == [3, 5, 5]
