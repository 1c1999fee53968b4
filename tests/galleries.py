"""Small runs for the pictures' tests, and what is read off pictures again and again."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import pytest
import repeating

from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, FigureData, Layer, Selection
from snooker_cli.runs import Run
from snooker_cli.trace import Trace

BASE = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 2, radius: 1.0, speed: 10.0}
cor: 0.9
wall_cor: 1.0
collisions: 200
repeats: 3
"""

ELASTIC = ("cor=1", "record=summary", "container.mass=.inf")

DECAYING = ("cor=0.8,0.9,1.0",)
"""Nineteen balls at three CoR, every collision recorded."""

WARM = (*ELASTIC, "balls.radius=0.2,1.0", "balls.speed=5,10,20")
"""Elastic balls of two sizes at three speeds in a fixed wall, recorded as summaries."""

Kept = TypeVar("Kept", bound=Layer)


def made(directory: Path, *overrides: str, text: str = BASE) -> Run:
    """A finished run of a config."""
    run = repeating.made(directory, text, *overrides)
    assert not any(result.error for result in repeating.done(run))
    return run


def traces(run: Run, index: int) -> list[Trace]:
    return list(run.traces(run.points[index]))


def layers(picture: FigureData, kind: type[Kept]) -> list[Kept]:
    return [layer for layer in picture.layers if isinstance(layer, kind)]


def shown(run: Run, kind: str, repeat: int | None = None, **where: Any) -> FigureData:
    keys = {key.replace("__", "."): value for key, value in where.items()}
    return FIGURES[kind].make(run, Selection(keys, repeat))


def why_not(run: Run, kind: str, repeat: int | None = None, **where: Any) -> str:
    with pytest.raises(FigureError) as caught:
        shown(run, kind, repeat, **where)
    return str(caught.value)
