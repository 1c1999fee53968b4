"""A run's folder: its manifest, which results it may hold, and how it is found again."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from figure_runs import shown
from repeating import contents, done, made, run_of

import snooker_cli as snooker
from snooker_cli import runs
from snooker_cli.errors import RunError, StoreError
from snooker_cli.files import temporary_path, write_json
from snooker_cli.runs import MANIFEST, RunFolder
from snooker_cli.runs.folder import FAILURES
from snooker_cli.runs.run import FIGURE_KEYS
from snooker_cli.runs.selection import unlisted


@pytest.fixture
def copied(finished_one_each: RunFolder, tmp_path: Path) -> Path:
    """A copy of the folder of a finished run with one file for each repeat, to be changed."""
    return Path(shutil.copytree(finished_one_each.directory, tmp_path / "copied"))


def files(directory: Path) -> dict[str, bytes]:
    """The content of every file below a folder."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.rglob("*")
        if path.is_file()
    }


def refusal(run: RunFolder, *, fresh: bool = False) -> str:
    """The code with which a run is refused, planned or created; nothing is changed."""
    before = files(run.directory)
    with pytest.raises((RunError, StoreError)) as planned:
        runs.planned_change(run, fresh=fresh)
    with pytest.raises((RunError, StoreError)) as created:
        runs.create(run, fresh=fresh)
    assert files(run.directory) == before
    assert str(planned.value) == str(created.value)
    return planned.value.code


# Open and read


def test_a_manifest_with_other_digests_is_refused(copied: Path, small_config: str) -> None:
    manifest = copied / MANIFEST
    manifest.write_text(manifest.read_text().replace('"digest": "', '"digest": "0', 1))
    with pytest.raises(StoreError, match="cannot be read"):
        runs.open_run(copied)
    run = run_of(copied, small_config)
    assert refusal(run) == ""
    runs.create(run, fresh=True)
    assert runs.open_run(copied) == run


def test_a_manifest_that_lacks_a_point_is_refused(copied: Path) -> None:
    manifest = json.loads((copied / MANIFEST).read_text())
    write_json(copied / MANIFEST, manifest | {"points": manifest["points"][:1]})
    with pytest.raises(StoreError, match="its points are not those of its experiment"):
        runs.open_run(copied)


# Create and extend


@pytest.mark.parametrize(
    ("overrides", "change"),
    [
        ((), ""),
        (("title=other",), ""),
        (("collisions=200", "repeats=5"), "collisions from 150 to 200, repeats from 3 to 5"),
        (("repeats=2",), "has 3 repeats, and this config uses 2 of them"),
    ],
)
def test_the_same_physics_keeps_the_results(
    overrides: tuple[str, ...], change: str, copied: Path, small_config: str
) -> None:
    (copied / FAILURES).write_text("[]")
    before = files(copied)
    run = run_of(copied, small_config, *overrides)
    planned = runs.planned_change(run)
    assert files(copied) == before
    assert change in planned
    assert bool(planned) == bool(change)
    assert runs.create(run) == planned
    assert runs.open_run(copied) == run
    assert not runs.planned_change(run)
    after = files(copied)
    if overrides:
        assert before.pop(MANIFEST) != after.pop(MANIFEST)
    assert after == before


def test_a_sweep_grows_and_keeps_what_it_no_longer_lists(
    copied: Path, small_config: str, tmp_path: Path
) -> None:
    before = files(copied)
    run = runs.continued(run_of(copied, small_config, "cor=0.7,1.0"))
    assert [(point.index, point.as_json()) for point in run.points] == [
        (2, {"cor": 0.7}),
        (1, {"cor": 1.0}),
    ]
    assert "1 new point, 1 point no longer listed" in runs.create(run)
    assert runs.open_run(copied) == run
    assert [result.cached for result in done(run)] == [True] * 3 + [False] * 3
    assert run.chosen(None, 0) == run.points[0]  # there is no point 0
    assert {row["point"] for row in snooker.open(copied).hashes()} == {1, 2}
    assert before.items() - files(copied).items() == {(MANIFEST, before[MANIFEST])}
    alone = made(tmp_path / "alone", small_config, "cor=0.7,1.0")
    done(alone)
    expected = {
        (2 if point == 0 else 1, repeat): bits for (point, repeat), bits in contents(alone).items()
    }
    assert contents(run) == expected
    # The first sweep again: nothing is left to do, and the new point is not listed.
    again = runs.continued(run_of(copied, small_config))
    runs.create(again)
    assert [point.index for point in (*again.points, *again.former)] == [0, 1, 2]
    assert all(result.cached for result in done(again))


def test_a_single_point_becomes_one_of_a_sweep(tmp_path: Path, one_point: str) -> None:
    done(made(tmp_path, one_point))
    run = runs.continued(run_of(tmp_path, one_point, "cor=0.9,1.0"))
    runs.create(run)
    assert [result.cached for result in done(run)] == [True] * 3 + [False] * 3


def test_a_single_value_adds_a_point_to_a_sweep(copied: Path, small_config: str) -> None:
    """One after the other; the values of all points list them again."""
    for cor, number in (("0.7", 2), ("0.75", 3)):
        run = runs.continued(run_of(copied, small_config, f"cor={cor}"))
        assert [point.index for point in run.points] == [number]
        assert "1 new point" in runs.create(run)
        assert runs.open_run(copied) == run
    assert [result.cached for result in done(run)] == [False] * 3
    assert unlisted(run) == "the sweep lists 1 of the 4 points that are stored"
    assert shown(run, "energy").caption.endswith(f" T{unlisted(run)[1:]}.")
    assert str(snooker.open(copied).compare()).count("1 of the 4 points") == 1
    change = runs.planned_change(runs.continued(run_of(copied, small_config, "cor=0.85")))
    assert "cor=0.7,0.75,0.85,1.0 lists all points" in change
    everyone = runs.continued(run_of(copied, small_config, "cor=0.7,0.75,0.85,1.0"))
    runs.create(everyone)
    assert [point.index for point in everyone.points] == [2, 3, 0, 1]
    assert unlisted(everyone) == ""


@pytest.mark.parametrize("change", ["balls.mass=2", "seed=5", "wall_cor=0.9"])
def test_other_physics_is_no_growth_of_a_sweep(
    change: str, copied: Path, small_config: str
) -> None:
    for values in ("cor=0.85,0.9", "cor=0.7"):
        run = runs.continued(run_of(copied, small_config, values, change))
        assert refusal(run) == "other_config"


def test_a_run_of_fewer_repeats_deletes_no_later_ones(copied: Path, small_config: str) -> None:
    before = files(copied)
    run = run_of(copied, small_config, "repeats=2")
    runs.create(run)
    assert all(result.cached for result in done(run))
    assert files(copied).keys() == before.keys()


def test_no_repeat_of_a_sweep_of_limits_is_shortened(tmp_path: Path, small_config: str) -> None:
    """Though the first point becomes longer."""
    done(made(tmp_path, small_config, "repeats=1", "collisions=100,200"))
    changed = run_of(tmp_path, small_config, "repeats=1", "collisions=300,100")
    assert refusal(changed) == "shorter_limits"
    with pytest.raises(RunError, match=re.escape("from [100, 200] to [300, 100]")):
        runs.create(changed)


def test_an_extension_can_be_undone_until_its_first_repeat_is_done(
    small_config: str, tmp_path: Path
) -> None:
    done(made(tmp_path, small_config))
    before = files(tmp_path)
    made(tmp_path, small_config, "collisions=300")
    run = run_of(tmp_path, small_config)
    assert "collisions from 300 to 150" in runs.create(run)
    assert all(result.cached for result in done(run))
    assert files(tmp_path) == before


def test_results_of_another_engine_are_refused_or_replaced(copied: Path, small_config: str) -> None:
    manifest = json.loads((copied / MANIFEST).read_text())
    newer = {"engine_version": manifest["engine_version"] + 1}
    write_json(copied / MANIFEST, manifest | newer)
    run = run_of(copied, small_config)
    assert refusal(run) == "other_engine_version"
    runs.create(run, fresh=True)
    assert list(files(copied)) == [MANIFEST]
    assert runs.open_run(copied) == run


def test_fresh_deletes_what_was_made_of_the_old_results(copied: Path, small_config: str) -> None:
    """Beside it are a user's own files, which stay."""
    figure = dict.fromkeys(FIGURE_KEYS) | {"series": []}
    (copied / "figures").mkdir()
    (copied / "figures" / "energy-cor-0.8.json").write_text(json.dumps(figure))
    for name in (FAILURES, "figures/energy-cor-0.8.svg"):
        (copied / name).write_text("[]")
    theirs = {"figures/mine.svg", "figures/mine.json", "figures/energy.svg", "mine.json"}
    for name in theirs:
        (copied / name).write_text("{}")
    run = made(copied, small_config)
    assert {path.name for path in run.figures()} == {
        "energy-cor-0.8.json",
        "energy-cor-0.8.svg",
    }
    other = run_of(copied, small_config, "seed=2")
    runs.create(other, fresh=True)
    assert set(files(copied)) == {MANIFEST, *theirs}
    assert runs.open_run(copied) == other


# Lock and clear away


def test_a_folder_is_locked_once_at_a_time(tmp_path: Path) -> None:
    with runs.locked(tmp_path / "run"):
        with pytest.raises(RunError) as caught, runs.locked(tmp_path / "run"):
            pytest.fail("locked twice")
        assert caught.value.code == "locked"
        with runs.locked(tmp_path / "other"):
            pass
    with runs.locked(tmp_path / "run"):
        pass


def test_only_what_this_machine_left_is_deleted(finished_one_each: RunFolder, copied: Path) -> None:
    """Another machine, on the same disk, may still be writing."""
    run = runs.open_run(copied)
    for path in (run.path(0, [1]), run.path(1, [2]), copied / FAILURES):
        temporary_path(path).write_text("left by a kill")
    other = copied / "point-0000" / "repeats-0000-0000.h5.elsewhere-0123456789abcdef.part"
    other.write_text("being written")
    with runs.locked(copied):
        left = {*files(finished_one_each.directory), str(other.relative_to(copied))}
        assert set(files(copied)) == left


def test_a_lost_manifest_is_made_again(
    copied: Path, finished_one_each: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = replace(finished_one_each, directory=copied)
    manifest, before = copied / MANIFEST, files(copied)
    manifest.unlink()
    with pytest.raises(RunError, match=r"run\.json is lost; run its config again with out="):
        runs.open_run(copied)
    assert copied in runs.runs_in(copied.parent)
    assert runs.runs_in(copied) == [copied]
    assert runs.planned_change(run).endswith("it is made again, and the repeats are kept")
    runs.create(run)
    assert files(copied) == before
    assert runs.open_run(copied) == run


def test_repeats_of_another_config_are_kept_without_their_manifest(
    copied: Path, one_point: str, finished_one_each: RunFolder
) -> None:
    (copied / MANIFEST).unlink()
    assert refusal(run_of(copied, one_point.replace("cor: 1", "cor: 0.5"))) == "other_config"
    assert refusal(run_of(copied, one_point)) == "other_config"
    other = run_of(copied, one_point)
    assert runs.create(other, fresh=True) == ""
    assert not list(copied.glob("point-*/*.h5"))
