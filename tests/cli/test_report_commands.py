"""``snooker reproduce`` simulates the runs that are missing."""

from __future__ import annotations

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
