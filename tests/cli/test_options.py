"""Conditions of ``--where``: values, choices and ranges of numbers."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Snooker
from config_texts import BASE

from snooker_cli.cli.options import conditions
from snooker_cli.config import parse
from snooker_cli.runs import Run


@pytest.mark.parametrize(
    ("text", "chosen"),
    [
        ("cor=0.8", 0.8),
        ("cor = 0.7,0.9", (0.7, 0.9)),
        ("cor=0.7:0.8:2", (0.7, 0.8)),
        ("cor=0.7:0.8", (0.7, 0.75, 0.8)),
        ("cor>0.8", 0.9),
        ("cor>=0.8", (0.8, 0.9)),
        ("cor < 0.75", 0.7),
        ("cor<=7.5e-1", (0.7, 0.75)),
        ("wall_cor>0", (0.5, 1.0)),
    ],
)
def test_values_that_fulfil_a_condition(text: str, chosen: object) -> None:
    """Of a range, those of the run's points that are numbers."""
    loaded = parse(BASE, "run.yaml", ["cor=0.7,0.75,0.8,0.9", "wall_cor=null,0,0.5,1"])
    ((_, found),) = conditions([text], Run(Path(), loaded.experiment, loaded.points())).items()
    assert found == chosen


@pytest.mark.parametrize("command", ["fit", "compare", "plot", "export"])
def test_every_command_takes_ranges(command: str, finished: object, snooker: Snooker) -> None:
    names = ("energy",) if command == "plot" else ()
    options = ("--table",) if command == "export" else ()
    ended = snooker(command, "small", *names, *options, "--where", "cor>0.9")
    assert ended.code == 0
    assert "0.85" not in ended.out
