"""After an early ending `run` says what in the config has repeats go on, where something has."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from snooker_cli.cli.app import app

HARD = Path(__file__).parents[2] / "configs" / "hard"


@pytest.mark.parametrize(
    ("config", "overrides", "said"),
    [
        ("along-the-wall", ["wall_cor=0.5"], ["collapse: slide"]),
        (
            "along-the-wall",
            ["wall_cor=0.5", "container.mass=1e7"],
            ["collapse: slide", "collapse: {tc: 0.01}"],
        ),
        ("along-the-wall", ["wall_cor=0.5", "collapse=slide"], []),
        ("along-the-wall", ["wall_cor=1.0"], []),  # nothing is lost that could be kept
        ("collapse-three", ["cor=0.05"], ["collapse: {tc: 0.01}"]),
    ],
)
def test_the_way_on_is_said(
    config: str, overrides: list[str], said: list[str], tmp_path: Path
) -> None:
    given = [word for override in overrides for word in ("-o", override)]
    out = ("--out", str(tmp_path / "run"), "--no-progress")
    ended = CliRunner().invoke(app, ["run", str(HARD / f"{config}.yaml"), *given, *out])
    assert ended.exit_code == 0, ended.output
    lines = ended.stdout.splitlines()
    hints = [line for line in lines if line.startswith("To continue such repeats")]
    assert [way for hint in hints for way in re.findall("`(.*?)`", hint)] == said


@pytest.mark.parametrize(
    ("config", "way"),
    [("along-the-wall", "collapse=slide"), ("collapse-three", "collapse.tc=0.01")],
)
def test_the_way_on_goes_on(config: str, way: str, tmp_path: Path) -> None:
    """What is advised leaves no repeat of the case that ends early."""
    point = "wall_cor=0.5" if config == "along-the-wall" else "cor=0.05"
    given = ["-o", point, "-o", way, "--out", str(tmp_path / "run"), "--no-progress"]
    ended = CliRunner().invoke(app, ["run", str(HARD / f"{config}.yaml"), *given])
    assert ended.exit_code == 0, ended.output
    assert "wall_trap" not in ended.stdout
    assert " collapse" not in ended.stdout
