"""Runs of boxes and of warm gases for several tests of figures."""

from __future__ import annotations

import pytest
from figure_runs import BOX, DRIVEN, HEATED, MIXTURE, PERIODIC, made

from snooker_cli.runs import RunFolder


@pytest.fixture(scope="session")
def box(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return made(tmp_path_factory.mktemp("box") / "run", text=BOX)


@pytest.fixture(scope="session")
def periodic(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return made(tmp_path_factory.mktemp("periodic") / "run", text=PERIODIC)


@pytest.fixture(scope="session")
def heated(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """Elastic balls between two walls: at one temperature, then at two."""
    return made(tmp_path_factory.mktemp("heated") / "run", text=HEATED)


@pytest.fixture(scope="session")
def driven(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """Balls of two sizes at two CoR in a circle whose wall drives them."""
    return made(tmp_path_factory.mktemp("driven") / "run", text=DRIVEN)


@pytest.fixture(scope="session")
def mixture(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """Heavy and light balls in a periodic box."""
    return made(tmp_path_factory.mktemp("mixture") / "run", text=MIXTURE)
