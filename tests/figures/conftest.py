"""Runs of boxes for several tests of figures."""

from __future__ import annotations

import pytest
from figure_runs import BOX, PERIODIC, made

from snooker_cli.runs import Run


@pytest.fixture(scope="session")
def box(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("box") / "run", text=BOX)


@pytest.fixture(scope="session")
def periodic(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("periodic") / "run", text=PERIODIC)
