"""``analysis.json`` is read while it is of the repeats that are there, and of this code."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from figure_runs import made
from repeating import batches_of, file_of

from snooker_cli.analysis import run_analysis
from snooker_cli.errors import RunError
from snooker_cli.figures import FIGURES, Selection
from snooker_cli.files import user_key
from snooker_cli.runs import Run
from snooker_cli.runs.run import ANALYSIS

KINDS = {
    "fits": run_analysis.fits,
    "comparisons": run_analysis.comparisons,
    "table": lambda run: run_analysis.table_columns(run, run.points),
}


@pytest.fixture
def run(tmp_path: Path) -> Run:
    with batches_of(1):
        return made(tmp_path / "run", "cor=0.9,1.0", "repeats=2")


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of repeats of each measurement from now on."""
    numbers: list[int] = []

    def counted(traces: Any, *span: float, **more: float) -> Any:
        found = measure(traces, *span, **more)
        numbers.append(len(found.time))
        return found

    measure = run_analysis.measure
    monkeypatch.setattr(run_analysis, "measure", counted)
    # No measurement stays in memory, as in another command.
    forgetful = SimpleNamespace(find=lambda *_: None, get=lambda _key, make, _owner: make())
    monkeypatch.setattr(run_analysis, "MEMORY", forgetful)
    return numbers


def test_fits_and_figures_measure_a_point_once(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    run_analysis.fits(run)
    monkeypatch.setattr(run_analysis, "measure", None)
    assert FIGURES["energy"].make(run, Selection()).numbers["points"]


def test_any_analysis_makes_all(run: Run, measured: list[int]) -> None:
    KINDS["fits"](run)
    assert measured == [2, 2]
    written = (run.directory / ANALYSIS).stat().st_mtime_ns
    made_first = [analyse(run) for analyse in KINDS.values()]
    assert (measured, (run.directory / ANALYSIS).stat().st_mtime_ns) == ([2, 2], written)
    (run.directory / ANALYSIS).unlink()
    assert [analyse(run) for analyse in KINDS.values()] == made_first
    fits, compared, tables = made_first
    assert {row["parameters"]["cor"] for row in fits.rows} == {0.9, 1.0}
    assert len(fits.rows) == 22
    assert {row["simulated"] for row in compared.rows} == {2}
    assert [table["complete"] for table in tables] == [[True, True]] * 2


def test_only_chosen_points_are_analysed_and_all_are_kept(run: Run, measured: list[int]) -> None:
    first, second = run.points
    parts = [run_analysis.fits(run, points=[point]) for point in (first, second)]
    whole = run_analysis.fits(run)
    assert measured == [2, 2]
    assert whole.rows == parts[0].rows + parts[1].rows
    assert {row["parameters"]["cor"] for row in parts[0].rows} == {0.9}


def test_other_repeats_or_other_code_make_a_new_analysis(
    run: Run, measured: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    run_analysis.fits(run)
    path = file_of(run, 0, 0)
    whole = path.read_bytes()
    path.unlink()
    fewer = run_analysis.fits(run)
    assert measured == [2, 2, 1]
    assert {row["repeats"] + row["failed"] for row in fewer.rows} == {1, 2}
    assert [note["note"] for note in fewer.notes if "1 of 2" in note["note"]]
    path.write_bytes(whole)
    run_analysis.fits(run)
    assert measured == [2, 2, 1, 2]
    monkeypatch.setattr(run_analysis, "sources_hash", lambda *_: "other code")
    run_analysis.fits(run)
    assert measured == [2, 2, 1, 2, 2, 2]
    for number in range(4):
        file_of(run, *divmod(number, 2)).unlink()
    with pytest.raises(RunError):
        run_analysis.fits(run)


def damages(content: dict[str, Any]) -> list[Any]:
    """Contents that are not what was written, also with a hash that anyone can make."""
    changed = json.loads(json.dumps(content))
    for row in changed["0"]["results"]["fits"]["rows"]:
        row["value"] = 7 * (row["value"] or 1)
    forged = json.loads(json.dumps(changed))
    forged["0"]["hash"] = sha256(json.dumps(forged["0"]["results"]).encode()).hexdigest()
    unsigned = {"0": {"results": {}, "hash": ""}}
    return ["[]", {"0": 5}, unsigned, changed, forged]


def test_a_file_that_is_no_analysis_is_replaced(
    run: Run, measured: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    compared, path = run_analysis.comparisons(run), run.directory / ANALYSIS
    whole = path.read_text()
    for content in damages(json.loads(whole)):
        measured.clear()
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        assert run_analysis.comparisons(run) == compared
        assert measured
        assert path.read_text() == whole


def test_only_results_of_this_user_are_believed(
    run: Run,
    measured: list[int],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Another user has another key. One without a key keeps nothing, and reads the reason."""
    fits, path = run_analysis.fits(run), run.directory / ANALYSIS
    whole = path.read_text()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "other"))
    user_key.cache_clear()
    assert run_analysis.fits(run) == fits
    assert measured == [2, 2, 2, 2]
    others = path.read_text()
    assert others != whole
    key = tmp_path / "other" / "snooker" / "key"
    key.write_bytes(b"short")
    user_key.cache_clear()
    assert run_analysis.fits(run) == fits
    user_key.cache_clear()
    assert measured == [2] * 6
    assert path.read_text() == others
    assert f"{key} has 5 bytes, but a key has 32; delete it" in caplog.text
