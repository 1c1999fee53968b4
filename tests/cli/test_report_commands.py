"""``snooker reproduce`` simulates the runs that are missing."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from command_line import Snooker

from snooker_cli.cli import analysis_commands
from snooker_cli.report.content import RUNS


def test_missing_runs_are_simulated_and_finished_ones_kept(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the first config is there, so the command ends at the second one."""
    first, second = RUNS[:2]
    monkeypatch.setattr(analysis_commands, "EXAMPLES", here)
    (here / "small.yaml").rename(here / f"{first}.yaml")
    ended = snooker("reproduce")
    assert ended.code == 3
    assert f"results in {Path('runs', first)}" in ended.out
    assert f"{second}.yaml: there is no file" in ended.err
    assert snooker("reproduce").out == ""


def test_without_its_libraries_nothing_is_simulated(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "typst", None)
    ended = snooker("reproduce")
    assert (ended.code, ended.out) == (2, "")
    assert "typst is not installed; install it with" in ended.err
    assert not (here / "runs" / RUNS[0]).exists()


def test_a_folder_that_cannot_be_written_is_found_before_the_simulations(
    here: Path, snooker: Snooker
) -> None:
    ended = snooker("reproduce", "--out", "small.yaml")
    assert (ended.code, ended.out) == (2, "")
    assert ended.err == (
        "snooker: small.yaml: cannot be written (File exists); give --out for another folder\n"
    )
    assert not (here / "runs").exists()
