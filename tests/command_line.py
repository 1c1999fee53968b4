"""A small config, how a command ends, and Python processes: what tests import beside fixtures."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

SMALL = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 1, radius: 1.0, speed: 10.0}
cor: 0.85
collisions: 150
repeats: 3
seed: 22
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


def output_of(program: str, **environment: str) -> str:
    """What a Python process of its own prints; there, every warning is an error."""
    tests = Path(__file__).parent
    path = os.pathsep.join(map(str, (tests, tests / "engine", tests.parent)))
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=tests,
        env=os.environ | {"PYTHONPATH": path} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
