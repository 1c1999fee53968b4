"""``fit.json`` and ``compare.json`` are read while they are of the repeats that are there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from figure_runs import made
from repeating import batches_of, file_of

from snooker_cli.analysis import run_analysis
from snooker_cli.errors import RunError
from snooker_cli.files import user_key
from snooker_cli.runs import Run

ANALYSES = {"fit.json": run_analysis.fits, "compare.json": run_analysis.comparisons}


@pytest.fixture
def run(tmp_path: Path) -> Run:
    with batches_of(1):
        return made(tmp_path / "run", "cor=0.9,1.0", "repeats=2")


def no_analysis(*_: Any) -> Any:
    raise AssertionError("this analysis is in the file")


@pytest.mark.parametrize("name", ANALYSES)
def test_a_saved_analysis_is_read_and_not_made_again(
    name: str, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = ANALYSES[name](run)
    assert first.unsaved
    assert {row["parameters"]["cor"] for row in first.rows} == {0.9, 1.0}
    first.save()
    written = (run.directory / name).stat().st_mtime_ns
    for module, function in ((run_analysis.decay, "decays"), (run_analysis.comparison, "compare")):
        monkeypatch.setattr(module, function, no_analysis)
    again = ANALYSES[name](run)
    assert not again.unsaved
    assert (again.rows, again.notes) == (first.rows, first.notes)
    again.save()
    assert (run.directory / name).stat().st_mtime_ns == written


def test_only_chosen_points_are_analysed_and_all_are_kept(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, (first, second) = run_analysis.fits(run), run.points
    for point in (first, second):
        one = run_analysis.fits(run, points=[point])
        assert one.rows == [row for row in whole.rows if row["parameters"] == point.as_json()]
        one.save()
    monkeypatch.setattr(run_analysis.decay, "decays", no_analysis)
    assert run_analysis.fits(run).rows == whole.rows


def test_other_repeats_or_other_code_make_a_new_analysis(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_analysis.fits(run).save()
    one, other = file_of(run, 0, 0), file_of(run, 0, 1)
    whole = one.read_bytes()
    one.unlink()
    fewer = run_analysis.fits(run)
    assert fewer.unsaved
    assert {row["repeats"] + row["failed"] for row in fewer.rows} == {1, 2}
    assert [note["note"] for note in fewer.notes if "1 of 2" in note["note"]]
    fewer.save()
    one.write_bytes(whole)
    assert run_analysis.fits(run).unsaved
    run_analysis.fits(run).save()
    assert not run_analysis.fits(run).unsaved
    monkeypatch.setattr(run_analysis, "sources_hash", lambda *_: "other code")
    assert run_analysis.fits(run).unsaved
    for path in (one, other, file_of(run, 1, 0), file_of(run, 1, 1)):
        path.unlink()
    with pytest.raises(RunError):
        run_analysis.fits(run)


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"0": 5}', '{"0": {"made_from": ""}}'])
def test_a_file_that_is_no_analysis_is_replaced(content: str, run: Run) -> None:
    (run.directory / "compare.json").write_text(content)
    found = run_analysis.comparisons(run)
    assert found.unsaved
    found.save()
    kept = json.loads(found.path.read_text())
    assert kept["0"]["rows"] + kept["1"]["rows"] == found.rows


def test_an_analysis_may_be_made_by_another_user(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It counts as long as it names the same repeats and the same code."""
    run_analysis.fits(run).save()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "other"))
    user_key.cache_clear()
    assert not run_analysis.fits(run).unsaved
    user_key.cache_clear()
