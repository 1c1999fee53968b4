"""The wheel works alone: it has all data, and commands find them far from a checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the wheel installs."""
    folder = tmp_path_factory.mktemp("wheel")
    builder = WheelBuilder(str(ROOT))
    (wheel,) = builder.build(directory=str(folder), versions=["standard"])
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def snooker(installed: Path, here: Path, *arguments: str) -> list[str]:
    """The lines that the installed command prints in another folder."""
    done = subprocess.run(
        [sys.executable, "-m", "snooker_cli", *arguments],
        cwd=here,
        env=os.environ | {"PYTHONPATH": str(installed)},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_the_wheel_has_every_file_of_the_package_and_all_configs(installed: Path) -> None:
    sources = {
        Path("snooker_cli", path.relative_to(base)): path
        for base in (ROOT / "snooker_cli", ROOT)
        for path in (base if base != ROOT else ROOT / "configs").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert Path("snooker_cli/configs/hard/ring.yaml") in sources
    for name, source in sources.items():
        assert (installed / name).read_bytes() == source.read_bytes(), name
    (info,) = installed.glob("*.dist-info")
    assert "Requires-Python" in (info / "METADATA").read_text("utf-8")
    assert "snooker = snooker_cli.cli:main" in (info / "entry_points.txt").read_text("utf-8")


def test_the_wheel_works_in_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    listed = [line.split()[0] for line in snooker(installed, tmp_path, "init", "--list")[1:]]
    configs = (ROOT / "configs").rglob("*.yaml")
    examples = {path.relative_to(ROOT).with_suffix("").as_posix() for path in configs}
    assert {"sweep", "configs/hard/wall-trap", *examples} < set(listed)
    snooker(installed, tmp_path, "init", "configs/hard/wall-trap", "--out", "trap.yaml")
    snooker(installed, tmp_path, "validate", "trap.yaml")
