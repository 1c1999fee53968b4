"""A small config, and how a command ends: what tests import beside the fixtures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

SMALL = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 1, radius: 1.0, speed: 10.0}
cor: 0.85
collisions: 150
repeats: 3
sweep: {cor: [0.85, 1.0]}
"""


@dataclass(frozen=True)
class Ended:
    """Exit code, stdout and stderr of a command."""

    code: int
    out: str
    err: str


Snooker = Callable[..., Ended]
"""The fixture of that name: arguments in, an end back."""
