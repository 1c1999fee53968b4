"""A measured mean beside what is known of it, and how many standard errors lie between."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

ALLOWED = 4.0
"""Standard errors that are let pass: a few dozen rows exceed three by chance, not four."""


PUBLISHED, EXACT, OWN = "published", "exact", "own"
"""Whose a value is: somebody's simulation or theory, by its source; a law without an error; or a
simulation by independent code of this project, which is a check and no authority."""


@dataclass(frozen=True)
class Setting:
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
class Row:
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
    setting: Setting
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
