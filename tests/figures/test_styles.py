"""What the dashes of lines mean: the same in every figure."""

from __future__ import annotations

import ast
from importlib.resources import files
from typing import get_args

import pytest
from figure_runs import layers, shown

from snooker_cli.figures.figure_data import (
    BY_THEORY,
    EXTRAPOLATED,
    MEASURED,
    SECOND,
    Line,
    LineStyle,
    Reference,
)
from snooker_cli.runs import RunFolder
from snooker_cli.theory import FINITE

DECLARED = "figure_data.py"


def test_figures_use_the_declared_styles() -> None:
    """No figure names a dash pattern of its own."""
    patterns = set(get_args(LineStyle))
    assert {MEASURED, SECOND, BY_THEORY, EXTRAPOLATED} == patterns
    for path in files("snooker_cli.figures").iterdir():
        if not path.name.endswith(".py") or path.name in (DECLARED, "state_pictures.py"):
            continue
        words = [
            n.value for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Constant)
        ]
        assert not patterns & {word for word in words if isinstance(word, str)}, path.name


@pytest.mark.parametrize("name", ["pressure", "gas-law", "wall-impulses"])
def test_theory_of_the_gas_is_dashed(name: str, warm: RunFolder, decaying: RunFolder) -> None:
    run, where = (warm, {}) if name == "gas-law" else (decaying, {"cor": 1.0})
    found = shown(run, name, **where)
    lines = [*layers(found, Line), *layers(found, Reference)]
    assert {line.style for line in lines if line.label == FINITE} == {BY_THEORY}
    assert BY_THEORY not in {
        line.style for line in lines if line.label in ("ideal gas", "simulation")
    }
