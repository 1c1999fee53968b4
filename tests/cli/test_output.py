"""Lists are wrapped to the terminal."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Snooker

from snooker_cli.cli.config_commands import examples
from snooker_cli.figures import FIGURES


@pytest.mark.parametrize(("columns", "widest"), [(60, 60), (300, 100)])
@pytest.mark.parametrize("command", ["init --list", "plot --list", "plot small --list"])
def test_lists_fit_the_terminal_and_have_whole_names(
    command: str,
    columns: int,
    widest: int,
    finished: Path,
    snooker: Snooker,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    ended = snooker(*command.split())
    assert ended.code == 0
    lines = ended.out.splitlines()
    assert widest - 8 < max(map(len, lines)) <= widest
    first = {line.split()[0].rstrip(":") for line in lines if not line.startswith(" ")}
    assert first >= set(examples() if command.startswith("init") else FIGURES)
