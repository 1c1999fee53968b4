"""A measured mean beside what is known of it, and how many standard errors lie between."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from snooker_cli import __version__
from snooker_cli.engine import ENGINE_VERSION

# Where, when and with what something was measured, the same way in every measurement.

PROCESSORS = Path("/proc/cpuinfo")


def origin(what: str, began: datetime, *libraries: str) -> dict[str, Any]:
    """The head of a measurement's record.

    what : what was measured
    began : when
    libraries : whose versions matter, beside Python's
    """
    return {
        "measurement": what,
        "snooker": __version__,
        "engine_version": ENGINE_VERSION,
        "date": began.isoformat(timespec="seconds"),
        "machine": {
            "platform": platform.platform(),
            "processor": processor(),
            "processors": os.cpu_count(),
        },
        "versions": {"python": platform.python_version()}
        | {name: version(name) for name in libraries},
    }


def machine(measurement: Mapping[str, Any]) -> str:
    """What a measurement holds for, in words: processor and system."""
    said = measurement["machine"]
    return f"{said['processor']}, {said['platform']}"


def processor() -> str:
    """The processor's name, or at least its kind."""
    if PROCESSORS.exists():
        for line in PROCESSORS.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


ALLOWED = 4.0
"""Standard errors that are let pass: a few dozen rows exceed three by chance, not four."""


PUBLISHED, EXACT, OWN = "published", "exact", "own"
"""Whose a value is: somebody's simulation or theory, by its source; a law without an error; or a
simulation by independent code of this project, which is a check and no authority."""


@dataclass(frozen=True)
class Parameters:
    """What was simulated for a row.

    settling, collisions : of all balls together in each repeat, before measuring and meanwhile
    seeds : repeats, each from a seed of its own
    """

    shape: str
    balls: int
    packing: float
    cor: float
    settling: int
    collisions: int
    seeds: int


@dataclass(frozen=True)
class KnownValue:
    """A quantity's mean over seeds beside an expected value.

    error : standard error of the mean over independent seeds
    expected_error : of the expected value, as far as it is known
    whose : ``PUBLISHED``, ``EXACT`` or ``OWN``, of the expected value
    source : of the expected value, by author and year
    known : what finite N adds to the expected value, by theory
    systematic : by how much the expected value may be off for another reason, by bound or estimate
    reason : for that, in words
    note : what else there is to know
    """

    group: str
    quantity: str
    setting: Parameters
    measured: float
    error: float
    expected: float
    expected_error: float
    whose: str
    source: str
    known: float = 0.0
    systematic: float = 0.0
    reason: str = ""
    note: str = ""

    @property
    def difference(self) -> float:
        """Measured less expected, as they are."""
        return self.measured - self.expected

    @property
    def both_errors(self) -> float:
        """Standard error of the difference."""
        return math.hypot(self.error, self.expected_error)

    @property
    def in_errors(self) -> float:
        """The difference in standard errors."""
        return self.difference / self.both_errors

    @property
    def left_in_errors(self) -> float:
        """What is left of that once the known part is taken off."""
        return (self.difference - self.known) / self.both_errors

    @property
    def agrees(self) -> bool:
        """Whether what is left is within the errors that are allowed and what is systematic."""
        left = abs(self.difference - self.known)
        return left <= ALLOWED * self.both_errors + self.systematic

    def as_json(self) -> dict[str, Any]:
        """Everything, with what follows from it."""
        names = ("difference", "both_errors", "in_errors", "left_in_errors", "agrees")
        return asdict(self) | {name: getattr(self, name) for name in names}
