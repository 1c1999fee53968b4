"""Measurements of the studies with quick plans, as the commands write them."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from snooker_cli.cli.app import app

Bench = Callable[[str], tuple[Path, dict[str, Any]]]


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """The folder that ``snooker bench NAME --quick`` writes, and the record that it prints."""

    @cache
    def run(name: str) -> tuple[Path, dict[str, Any]]:
        folder = tmp_path_factory.mktemp("bench") / "measured"
        command = ["bench", name, "--quick", "--json", "--out", str(folder)]
        ended = CliRunner().invoke(app, command)
        assert ended.exit_code == 0, ended.output
        return folder, json.loads(ended.stdout)

    return run
