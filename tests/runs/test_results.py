"""A run's folder: its manifest, whose results it may hold, and how it is found again."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from repeating import done, made

from snooker_cli import runs, store
from snooker_cli.config import Experiment, digest, parse
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import RunError, StoreError
from snooker_cli.files import temporary_path, write_json
from snooker_cli.runs import MANIFEST, Run


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
        assert runs.open_run(name) == finished_run


def test_a_run_is_found_by_its_name_under_runs(
    copied_run: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shutil.move(copied_run, tmp_path / "runs" / "cooling")
    monkeypatch.chdir(tmp_path)
    run = runs.open_run("cooling")
    assert run.directory == Path("runs/cooling")
    assert run.name == "cooling"


def test_traces_come_in_the_order_of_the_repeats(finished_run: Run) -> None:
    for point in finished_run.points:
        hashes = [store.content_hash(trace) for trace in finished_run.traces(point)]
        expected = [
            store.content_hash(store.read(finished_run.path(point.index, repeat))[0])
            for repeat in range(3)
        ]
        assert hashes == expected
        assert len(set(hashes)) == 3


def test_the_repeats_of_an_interrupted_run_are_those_present(copied_run: Path) -> None:
    run = runs.open_run(copied_run)
    first, second = run.points
    whole = [store.content_hash(trace) for trace in run.traces(first)]
    run.path(0, 1).unlink()
    assert (len(run.present(first)), len(run.present(second))) == (2, 3)
    assert [store.content_hash(trace) for trace in run.traces(first)] == [whole[0], whole[2]]


def test_a_point_without_repeats_is_said(copied_run: Path) -> None:
    run = runs.open_run(copied_run)
    shutil.rmtree(copied_run / "point-0001")
    assert run.present(run.points[1]) == []
    with pytest.raises(RunError, match=r"copied: no repeat of the point cor=1\.0 is there yet"):
        list(run.traces(run.points[1]))


def test_a_repeat_that_cannot_be_read_is_no_missing_one(copied_run: Path) -> None:
    run = runs.open_run(copied_run)
    run.path(0, 1).write_text("not HDF5")
    assert run.present(run.points[0]) == [0, 1, 2]
    traces = run.traces(run.points[0])
    assert next(traces).collisions > 0
    with pytest.raises(StoreError, match=r"repeat-0001\.h5: not a readable result"):
        next(traces)


def test_making_a_run_again_changes_nothing(copied_run: Path, experiment: Experiment) -> None:
    before = files(copied_run)
    assert runs.create(copied_run, experiment) == runs.open_run(copied_run)
    assert files(copied_run) == before


@pytest.mark.parametrize("override", ["repeats=9", "repeats=1", "title='another'"])
def test_what_is_no_physics_shares_the_results(
    override: str, copied_run: Path, small_config: str
) -> None:
    before = files(copied_run)
    changed = parse(small_config, overrides=[override]).experiment
    runs.create(copied_run, changed)
    assert runs.open_run(copied_run).experiment == changed
    after = files(copied_run)
    assert before.pop(MANIFEST) != after.pop(MANIFEST)
    assert after == before


@pytest.mark.parametrize(
    "override",
    ["seed=2", "balls.speed=11", "cor=0.85", "cor=1.0,0.85", "record=summary"],
)
def test_another_experiment_is_refused(override: str, copied_run: Path, small_config: str) -> None:
    before = files(copied_run)
    other = parse(small_config, overrides=[override, "collisions=151"]).experiment
    with pytest.raises(RunError, match=r"copied: holds results of another config .* --fresh") as no:
        runs.create(copied_run, other)
    key = override.partition("=")[0].partition(".")[0]
    assert key in str(no.value).replace("sweep", "cor")
    assert runs.extension(runs.planned(copied_run, other, fresh=True)) == ""
    assert files(copied_run) == before


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (("collisions=151",), "collisions from 150 to 151"),
        (("repeats=4",), "repeats from 3 to 4"),
        (("collisions=200", "repeats=5"), "collisions from 150 to 200, repeats from 3 to 5"),
        (("title=other",), ""),
    ],
)
def test_more_of_the_same_extends_a_run(
    overrides: tuple[str, ...], said: str, copied_run: Path, small_config: str
) -> None:
    before = files(copied_run)
    more = parse(small_config, overrides=overrides).experiment
    run = runs.planned(copied_run, more)
    assert files(copied_run) == before
    sentence = runs.extension(run)
    assert sentence.partition(";")[0] == (f"this extends {copied_run}: {said}" if said else "")
    assert runs.create(copied_run, more) == run == runs.open_run(copied_run)
    assert runs.extension(run) == ""


def test_fewer_repeats_are_said_and_lose_no_file(copied_run: Path, small_config: str) -> None:
    fewer = parse(small_config, overrides=("repeats=2",)).experiment
    sentence = runs.extension(runs.planned(copied_run, fewer))
    assert sentence.startswith(f"{copied_run} has 3 repeats, of which this config takes 2; ")
    repeats = set(copied_run.glob("*/*.h5"))
    runs.create(copied_run, fewer)
    assert set(copied_run.glob("*/*.h5")) == repeats
    assert runs.extension(runs.planned(copied_run, fewer)) == ""


@pytest.mark.parametrize(
    ("before", "after", "cut"),
    [
        (["collisions=150"], ["collisions=149"], "collisions from 150 to 149"),
        (["collisions=150"], ["collisions=300", "time=1"], "time from null to 1.0"),
        (["collisions=150", "time=9"], ["time=8"], "time from 9.0 to 8.0"),
        (["collisions=150", "time=9"], ["time=9"], ""),
        (["collisions=150", "time=9"], ["collisions=150"], ""),
        (["collisions=150", "time=9"], ["collisions=151", "time=9.5"], ""),
        (["time=9"], ["collisions=150", "time=10"], "collisions from null to 150"),
        (["collisions=100,200"], ["collisions=150,200"], ""),
        (
            ["collisions=100,200"],
            ["collisions=300,100"],
            "collisions from .100, 200. to .300, 100.",
        ),
    ],
)
def test_nothing_is_cut_off(
    before: list[str], after: list[str], cut: str, tmp_path: Path, small_config: str
) -> None:
    swept = "," in before[0]
    bare = small_config if swept else small_config.replace("collisions: 150\n", "")
    bare = bare.replace("repeats: 3", "repeats: 1")
    done(runs.create(tmp_path, parse(bare, overrides=before).experiment))
    changed = parse(bare, overrides=after).experiment
    if cut:
        with pytest.raises(RunError, match=rf"may go on longer .*\({cut}\), .* --fresh"):
            runs.create(tmp_path, changed)
    else:
        runs.create(tmp_path, changed)
        assert runs.open_run(tmp_path).experiment == changed


def test_an_old_manifest_whose_digests_are_others_is_no_run_to_extend(
    copied_run: Path, small_config: str
) -> None:
    manifest = json.loads((copied_run / MANIFEST).read_text())
    manifest["points"][0]["digest"] = "0" * 64
    write_json(copied_run / MANIFEST, manifest)
    longer = parse(small_config, overrides=["collisions=151"]).experiment
    with pytest.raises(RunError, match="holds results of another config"):
        runs.create(copied_run, longer)


def test_an_engine_that_is_forced_is_part_of_what_a_run_is(
    copied_run: Path, experiment: Experiment, tmp_path: Path
) -> None:
    before = files(copied_run)
    with pytest.raises(RunError, match=r"copied: holds results of another --engine, .* --fresh"):
        runs.create(copied_run, experiment, engine="cells")
    assert files(copied_run) == before
    forced = runs.create(tmp_path / "forced", experiment, engine="cells")
    assert runs.open_run(tmp_path / "forced") == forced
    assert runs.create(tmp_path / "forced", experiment, engine="cells") == forced
    for other in (None, "allpairs"):
        with pytest.raises(RunError, match="another --engine"):
            runs.create(tmp_path / "forced", experiment, engine=other)


def test_a_plan_is_the_run_and_writes_nothing(
    copied_run: Path, experiment: Experiment, small_config: str, tmp_path: Path
) -> None:
    before = files(tmp_path)
    assert runs.planned(copied_run, experiment) == runs.open_run(copied_run)
    assert runs.planned(tmp_path / "new", experiment).directory == tmp_path / "new"
    other = parse(small_config, overrides=["seed=2"]).experiment
    with pytest.raises(RunError, match="another config"):
        runs.planned(copied_run, other)
    assert runs.planned(copied_run, other, fresh=True).experiment == other
    with pytest.raises(RunError, match="not a run of snooker"):
        runs.planned(tmp_path, experiment)
    assert files(tmp_path) == before
    assert not (tmp_path / "new").exists()


def test_another_engines_results_are_refused(copied_run: Path, experiment: Experiment) -> None:
    manifest = json.loads((copied_run / MANIFEST).read_text())
    manifest["engine_version"] += 1
    write_json(copied_run / MANIFEST, manifest)
    with pytest.raises(RunError, match=r"of engine version .* may give other bits; give --fresh"):
        runs.create(copied_run, experiment)


def test_fresh_replaces_another_experiments_results(copied_run: Path, small_config: str) -> None:
    (copied_run / "notes.txt").write_text("mine")
    other = parse(small_config, overrides=["seed=2"]).experiment
    run = runs.create(copied_run, other, fresh=True)
    assert sorted(files(copied_run)) == ["notes.txt", MANIFEST]
    assert runs.open_run(copied_run) == run
    assert run.experiment == other


def analysed(directory: Path) -> list[str]:
    """What snooker would have written of a run, beside a user's own files; the former's names."""
    (directory / "figures").mkdir()
    figure = dict.fromkeys(runs.FIGURE_KEYS) | {"series": []}
    (directory / "figures" / "energy-cor-0.8.json").write_text(json.dumps(figure))
    for name in ("fit.json", "compare.json", "figures/energy-cor-0.8.svg"):
        (directory / name).write_text("[]")
    for name in ("figures/mine.svg", "figures/mine.json", "figures/energy.svg", "mine.json"):
        (directory / name).write_text("{}")
    return ["compare.json", "figures/energy-cor-0.8.json", "figures/energy-cor-0.8.svg", "fit.json"]


def test_fresh_removes_what_was_made_of_the_old_results(
    copied_run: Path, experiment: Experiment
) -> None:
    before = set(files(copied_run))
    ours = analysed(copied_run)
    theirs = set(files(copied_run)) - before - set(ours)
    run = runs.create(copied_run, experiment)
    assert sorted(str(path.relative_to(copied_run)) for path in run.analyses() + run.figures()) == (
        ours
    )
    runs.create(copied_run, experiment, fresh=True)
    assert set(files(copied_run)) == {MANIFEST, *theirs}


def test_fewer_repeats_remove_the_fits_of_all(copied_run: Path, small_config: str) -> None:
    def made(repeats: int) -> list[str]:
        override = f"repeats={repeats}"
        run = runs.create(copied_run, parse(small_config, overrides=[override]).experiment)
        return [path.name for path in run.analyses()]

    analysed(copied_run)
    assert made(3) == ["fit.json", "compare.json"]
    assert made(2) == []


@pytest.mark.parametrize("fresh", [False, True])
def test_a_folder_that_is_no_run_is_refused(
    fresh: bool, tmp_path: Path, experiment: Experiment
) -> None:
    (tmp_path / "thesis.tex").write_text("irreplaceable")
    with pytest.raises(RunError, match="is not empty and not a run of snooker; give --out"):
        runs.create(tmp_path, experiment, fresh=fresh)
    assert files(tmp_path) == {"thesis.tex": b"irreplaceable"}


def test_a_run_killed_while_it_was_made_can_be_made_again(
    tmp_path: Path, experiment: Experiment
) -> None:
    temporary_path(tmp_path / MANIFEST).write_text('{"schema_ver')
    with runs.held(tmp_path):
        runs.create(tmp_path, experiment)
    assert list(files(tmp_path)) == [MANIFEST]


def test_only_what_this_machine_left_is_cleared_away(finished_run: Run, copied_run: Path) -> None:
    """Another machine, on the same disk, may still be writing its own."""
    run = runs.open_run(copied_run)
    for path in (run.path(0, 1), run.path(1, 2), copied_run / "fit.json"):
        temporary_path(path).write_text("left behind by a kill")
    other = copied_run / "point-0000" / "repeat-0000.h5.elsewhere-0123456789abcdef.part"
    other.write_text("under way")
    with runs.held(copied_run):
        assert set(files(copied_run)) == {
            *files(finished_run.directory),
            str(other.relative_to(copied_run)),
        }


def test_two_parts_of_one_file_have_names_of_their_own(tmp_path: Path) -> None:
    names = {temporary_path(tmp_path / "one.h5") for _ in range(1000)}
    assert len(names) == 1000
    assert {name.parent for name in names} == {tmp_path}


def test_a_folder_is_held_once_at_a_time(tmp_path: Path) -> None:
    with runs.held(tmp_path / "run"):
        with (
            pytest.raises(RunError, match=r"run: another `snooker run` is writing here; .* --out"),
            runs.held(tmp_path / "run"),
        ):
            pytest.fail("held twice")
        with runs.held(tmp_path / "other"):
            pass
    with runs.held(tmp_path / "run"):
        pass


def test_an_empty_folder_will_do(tmp_path: Path, experiment: Experiment) -> None:
    run = runs.create(tmp_path, experiment)
    assert list(files(tmp_path)) == [MANIFEST]
    assert run.path(12, 345) == tmp_path / "point-0012" / "repeat-0345.h5"


def test_a_file_in_the_folders_place_is_said(tmp_path: Path, experiment: Experiment) -> None:
    (tmp_path / "plain").write_text("x")
    for place in (tmp_path / "plain", tmp_path / "plain" / "inside"):
        for fresh in (False, True):
            with pytest.raises(RunError, match=r"plain.*: cannot be written .* --out"):
                runs.create(place, experiment, fresh=fresh)
        with pytest.raises(RunError, match="cannot be written"), runs.held(place):
            pytest.fail("held a file")


@pytest.mark.parametrize(
    "content",
    ["", "{", "[]", "{}", '{"experiment": {}}', '{"experiment": {"cor": 2}}', "null", "\ufffe"],
)
def test_a_damaged_manifest_is_said(content: str, copied_run: Path, experiment: Experiment) -> None:
    (copied_run / MANIFEST).write_bytes(
        content.encode("utf-16" if content == "\ufffe" else "utf-8")
    )
    with pytest.raises(RunError, match=r"run\.json: cannot be read .*; put a copy of it back, or"):
        runs.open_run(copied_run)
    with pytest.raises(RunError, match="--fresh"):
        runs.create(copied_run, experiment)
    runs.create(copied_run, experiment, fresh=True)
    assert runs.open_run(copied_run).experiment == experiment


def test_nothing_there_is_said(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for place in (tmp_path / "empty", tmp_path / "absent", "absent"):
        with pytest.raises(RunError, match=r"there is no run here .* `snooker run CONFIG`"):
            runs.open_run(place)


def test_a_fixed_and_a_free_container_can_be_swept(tmp_path: Path, small_config: str) -> None:
    """JSON has no infinity, and a manifest is JSON."""
    swept = parse(small_config, overrides=["container.mass=1e7,.inf"]).experiment
    run = runs.create(tmp_path, swept)
    json.loads((tmp_path / MANIFEST).read_text(), parse_constant=pytest.fail)
    opened = runs.open_run(tmp_path)
    assert opened == run
    masses = {point.experiment.container.mass for point in opened.points}
    assert masses == {1e7, np.inf}
    runs.create(tmp_path, swept)


def test_json_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "numbers.json"
    write_json(path, {"k": 0.1 + 0.2})
    with pytest.raises(ValueError, match="nan"):
        write_json(path, {"k": float("nan")})
    assert json.loads(path.read_text()) == {"k": 0.1 + 0.2}


@pytest.mark.parametrize("change", ['"cor": 9', '"cor": "x"'])
def test_a_manifest_with_a_bad_value_is_no_fault(
    change: str, copied_run: Path, small_config: str
) -> None:
    """Its points are known all the same, and the run's config is at hand."""
    manifest = copied_run / "run.json"
    manifest.write_text(re.sub(r'"cor": 0.85', change, manifest.read_text(), count=1))
    run = made(copied_run, small_config)
    assert json.loads(manifest.read_text()) == json.loads(json.dumps(run.manifest()))
