"""A run's folder: its manifest, whose results it may hold, and how it is found again."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from snooker_cli import results, store
from snooker_cli.config import Experiment, digest, parse
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.results import MANIFEST, Run, RunError
from snooker_cli.store import StoreError


@pytest.fixture
def experiment(small_config: str) -> Experiment:
    return parse(small_config).experiment


@pytest.fixture
def copied_run(finished_run: Run, tmp_path: Path) -> Path:
    """A copy of the finished run's folder, to be changed."""
    return Path(shutil.copytree(finished_run.directory, tmp_path / "copied"))


def files(directory: Path) -> dict[str, bytes]:
    """The content of every file below a folder."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.rglob("*")
        if path.is_file()
    }


def test_manifest_says_what_identifies_the_points(finished_run: Run) -> None:
    manifest = json.loads((finished_run.directory / MANIFEST).read_text(encoding="utf-8"))
    assert manifest["engine_version"] == ENGINE_VERSION
    assert [point["parameters"] for point in manifest["points"]] == [{"cor": 0.85}, {"cor": 1.0}]
    assert [point["index"] for point in manifest["points"]] == [0, 1]
    assert [point["digest"] for point in manifest["points"]] == [
        digest(point.experiment) for point in finished_run.points
    ]
    assert parse(json.dumps(manifest["experiment"])).experiment == finished_run.experiment


def test_a_run_is_found_by_its_folder(finished_run: Run) -> None:
    for name in (finished_run.directory, str(finished_run.directory)):
        assert results.open_run(name) == finished_run


def test_a_run_is_found_by_its_name_under_runs(
    copied_run: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shutil.move(copied_run, tmp_path / "runs" / "cooling")
    monkeypatch.chdir(tmp_path)
    run = results.open_run("cooling")
    assert run.directory == Path("runs/cooling")
    assert run.name == "cooling"


def test_traces_come_in_the_order_of_the_repeats(finished_run: Run) -> None:
    for point in finished_run.points:
        hashes = [store.content_hash(trace) for trace in finished_run.traces(point)]
        expected = [
            store.content_hash(store.read(finished_run.path(point.index, repeat)).trace)
            for repeat in range(3)
        ]
        assert hashes == expected
        assert len(set(hashes)) == 3


def test_a_missing_repeat_is_said_when_its_turn_comes(copied_run: Path) -> None:
    run = results.open_run(copied_run)
    run.path(0, 1).unlink()
    traces = run.traces(run.points[0])
    assert next(traces).collisions > 0
    with pytest.raises(StoreError, match=r"repeat-0001\.h5: there is no such result"):
        next(traces)


def test_making_a_run_again_changes_nothing(copied_run: Path, experiment: Experiment) -> None:
    before = files(copied_run)
    assert results.create(copied_run, experiment) == results.open_run(copied_run)
    assert files(copied_run) == before


@pytest.mark.parametrize("override", ["repeats=9", "repeats=1", "title='another'"])
def test_what_is_no_physics_shares_the_results(
    override: str, copied_run: Path, small_config: str
) -> None:
    before = files(copied_run)
    changed = parse(small_config, overrides=[override]).experiment
    results.create(copied_run, changed)
    assert results.open_run(copied_run).experiment == changed
    after = files(copied_run)
    assert before.pop(MANIFEST) != after.pop(MANIFEST)
    assert after == before


@pytest.mark.parametrize(
    "override",
    ["seed=2", "collisions=151", "balls.speed=11", "cor=0.85", "cor=1.0,0.85", "record=summary"],
)
def test_another_experiment_is_refused(override: str, copied_run: Path, small_config: str) -> None:
    before = files(copied_run)
    other = parse(small_config, overrides=[override]).experiment
    with pytest.raises(RunError, match=r"copied: holds results of another config .* --fresh"):
        results.create(copied_run, other)
    assert files(copied_run) == before


def test_another_engines_results_are_refused(copied_run: Path, experiment: Experiment) -> None:
    manifest = json.loads((copied_run / MANIFEST).read_text())
    manifest["engine_version"] += 1
    results.write_json(copied_run / MANIFEST, manifest)
    with pytest.raises(RunError, match="another config or engine version"):
        results.create(copied_run, experiment)


def test_fresh_replaces_another_experiments_results(copied_run: Path, small_config: str) -> None:
    (copied_run / "point-0000" / "repeat-0009.h5.part").write_text("left behind by a kill")
    (copied_run / "notes.txt").write_text("mine")
    other = parse(small_config, overrides=["seed=2"]).experiment
    run = results.create(copied_run, other, fresh=True)
    assert sorted(files(copied_run)) == ["notes.txt", MANIFEST]
    assert results.open_run(copied_run) == run
    assert run.experiment == other


@pytest.mark.parametrize("fresh", [False, True])
def test_a_folder_that_is_no_run_is_refused(
    fresh: bool, tmp_path: Path, experiment: Experiment
) -> None:
    (tmp_path / "thesis.tex").write_text("irreplaceable")
    with pytest.raises(RunError, match="is not empty and not a run of snooker; give --out"):
        results.create(tmp_path, experiment, fresh=fresh)
    assert files(tmp_path) == {"thesis.tex": b"irreplaceable"}


def test_a_run_killed_while_it_was_made_can_be_made_again(
    tmp_path: Path, experiment: Experiment
) -> None:
    (tmp_path / f"{MANIFEST}.part").write_text('{"schema_ver')
    results.create(tmp_path, experiment)
    assert list(files(tmp_path)) == [MANIFEST]


def test_an_empty_folder_will_do(tmp_path: Path, experiment: Experiment) -> None:
    run = results.create(tmp_path, experiment)
    assert list(files(tmp_path)) == [MANIFEST]
    assert run.path(12, 345) == tmp_path / "point-0012" / "repeat-0345.h5"


def test_a_file_in_the_folders_place_is_said(tmp_path: Path, experiment: Experiment) -> None:
    (tmp_path / "plain").write_text("x")
    for place in (tmp_path / "plain", tmp_path / "plain" / "inside"):
        for fresh in (False, True):
            with pytest.raises(RunError, match=r"plain.*: cannot be written .* --out"):
                results.create(place, experiment, fresh=fresh)


@pytest.mark.parametrize(
    "content",
    ["", "{", "[]", "{}", '{"experiment": {}}', '{"experiment": {"cor": 2}}', "null", "\ufffe"],
)
def test_a_damaged_manifest_is_said(content: str, copied_run: Path, experiment: Experiment) -> None:
    (copied_run / MANIFEST).write_bytes(
        content.encode("utf-16" if content == "\ufffe" else "utf-8")
    )
    with pytest.raises(RunError, match=r"run\.json: cannot be read .*; run the config again"):
        results.open_run(copied_run)
    with pytest.raises(RunError, match="--fresh"):
        results.create(copied_run, experiment)
    results.create(copied_run, experiment, fresh=True)
    assert results.open_run(copied_run).experiment == experiment


def test_nothing_there_is_said(tmp_path: Path) -> None:
    for place in (tmp_path, tmp_path / "absent", "absent"):
        with pytest.raises(RunError, match=r"there is no run here .* `snooker run CONFIG`"):
            results.open_run(place)


def test_a_fixed_and_a_free_container_can_be_swept(tmp_path: Path, small_config: str) -> None:
    """JSON has no infinity, and a manifest is JSON."""
    swept = parse(small_config, overrides=["container.mass=1e7,.inf"]).experiment
    run = results.create(tmp_path, swept)
    json.loads((tmp_path / MANIFEST).read_text(), parse_constant=pytest.fail)
    opened = results.open_run(tmp_path)
    assert opened == run
    masses = {point.experiment.container.mass for point in opened.points}
    assert masses == {1e7, np.inf}
    results.create(tmp_path, swept)


def test_json_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "numbers.json"
    results.write_json(path, {"k": 0.1 + 0.2})
    with pytest.raises(ValueError, match="nan"):
        results.write_json(path, {"k": float("nan")})
    assert json.loads(path.read_text()) == {"k": 0.1 + 0.2}
