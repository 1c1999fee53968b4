"""Results are kept while they are of the repeats that are there, and of this code."""

from __future__ import annotations

import os
import subprocess
import sys
import traceback
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from command_line import Snooker
from figure_runs import made
from repeating import batches_of, file_of

from snooker_cli.analysis import run_analysis
from snooker_cli.errors import RunError
from snooker_cli.figures.registry import FIGURES
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection

KINDS = {
    "fits": run_analysis.fits,
    "comparisons": run_analysis.comparisons,
    "table": lambda run: run_analysis.table_columns(run, run.points),
}


@pytest.fixture
def run(tmp_path: Path) -> RunFolder:
    with batches_of(1):
        return made(tmp_path / "run", "cor=0.9,1.0", "repeats=2")


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[int]:
    """The number of repeats of each measurement from now on; nothing is kept yet."""
    monkeypatch.setenv("SNOOKER_CACHE_DIR", str(tmp_path / "kept"))
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


def test_fits_and_figures_measure_a_point_once(
    run: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_analysis.fits(run)
    monkeypatch.setattr(run_analysis, "measure", None)
    assert FIGURES["energy"].make(run, Selection()).numbers["points"]


def test_any_analysis_makes_all(run: RunFolder, measured: list[int], tmp_path: Path) -> None:
    KINDS["fits"](run)
    made_first = [analyse(run) for analyse in KINDS.values()]
    assert measured == [2, 2]
    assert [path for path in run.directory.rglob("*") if path.suffix == ".json"] == [
        run.directory / "run.json"
    ]
    for path in tmp_path.glob("kept/analyses/*.json"):
        path.write_text('{"fits": ')  # as after a loss of power
    assert [analyse(run) for analyse in KINDS.values()] == made_first
    assert measured == [2, 2, 2, 2]
    fits, compared, tables = made_first
    assert {row["parameters"]["cor"] for row in fits.rows} == {0.9, 1.0}
    assert len(fits.rows) == 22
    assert {row["simulated"] for row in compared.rows} == {2}
    assert [table["complete"] for table in tables] == [[True, True]] * 2


def test_only_chosen_points_are_analysed_and_all_are_kept(
    run: RunFolder, measured: list[int]
) -> None:
    first, second = run.points
    parts = [run_analysis.fits(run, points=[point]) for point in (first, second)]
    whole = run_analysis.fits(run)
    assert measured == [2, 2]
    assert whole.rows == parts[0].rows + parts[1].rows
    assert {row["parameters"]["cor"] for row in parts[0].rows} == {0.9}


def test_other_repeats_or_other_code_make_a_new_analysis(
    run: RunFolder, measured: list[int], monkeypatch: pytest.MonkeyPatch
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
    assert measured == [2, 2, 1]
    monkeypatch.setattr(run_analysis, "sources_hash", lambda *_: "other code")
    run_analysis.fits(run)
    assert measured == [2, 2, 1, 2, 2]
    for number in range(4):
        file_of(run, *divmod(number, 2)).unlink()
    with pytest.raises(RunError):
        run_analysis.fits(run)


@pytest.mark.parametrize("command", ["fit small", "compare small", "plot small energy"])
def test_few_calls_lead_from_a_command_to_its_analysis(
    command: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever looks for where a number comes from can follow them."""
    called: list[str] = []

    def counted(*arguments: Any, **keywords: Any) -> Any:
        stack = [frame for frame in traceback.extract_stack() if "snooker_cli" in frame.filename]
        called[:] = called or [frame.name for frame in stack]
        return measure(*arguments, **keywords)

    measure = run_analysis.measure
    monkeypatch.setattr(run_analysis, "measure", counted)
    assert snooker(*command.split()).code == 0
    assert called[0] == "main"
    assert len(called) <= 15, called


FILES_LOADED = """
import os
import sys

from snooker_cli.cli import main


def notice(frame, event, _):
    code = frame.f_code
    place = os.path.basename(code.co_filename), code.co_name
    if (event, *place) == ("call", "measurement.py", "measure"):
        files = [name for name in sys.modules if name.partition(".")[0] == "snooker_cli"]
        print(len(files), *sorted(files), flush=True)
        os._exit(0)


sys.setprofile(notice)
main()
"""


@pytest.mark.parametrize(("command", "most"), [("fit small", 80), ("plot small energy", 92)])
def test_a_command_loads_few_files_before_its_analysis(
    command: str, most: int, finished: Path, tmp_path: Path
) -> None:
    """Of figures only those that are drawn, of the engine what replays events."""
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}  # no kept results
    call = [sys.executable, "-c", FILES_LOADED, *command.split()]
    done = subprocess.run(call, env=environment, capture_output=True, text=True, check=True)
    number, *files = done.stdout.split()
    assert int(number) <= most, files
