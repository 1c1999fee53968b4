"""The hard cases: which endings each may have, and what is known exactly of it.

Each is a config of its name in ``configs/hard/``, whose title says why it is hard.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from snooker_cli.bench import hard_facts as facts
from snooker_cli.trace import StopReason

if TYPE_CHECKING:
    from snooker_cli.bench.hard_checks import Check
    from snooker_cli.trace import Trace

COLLISIONS, TIME = StopReason.COLLISIONS, StopReason.TIME
NOTHING_LEFT, WALL_TRAP = StopReason.NOTHING_LEFT, StopReason.WALL_TRAP
COLLAPSE = StopReason.COLLAPSE


@dataclass(frozen=True)
class Hard:
    """A case.

    endings : how a run of it may end; which of them it is may depend on roundings
    fact : what is known exactly of a whole run
    lengthy : takes more than a second; for ``by_name_only`` it is minutes
    """

    name: str
    endings: tuple[StopReason, ...]
    fact: Callable[[Trace], Iterator[Check]] | None = None
    lengthy: bool = False
    by_name_only: bool = False


CASES = (
    Hard("grazing-offset", (TIME,), facts.grazing),
    Hard("grazing-angle", (TIME,), facts.grazing),
    Hard("touching", (TIME,), facts.touching),
    Hard("touching-wall", (TIME,), facts.touching_wall),
    Hard("along-the-wall", (WALL_TRAP, COLLAPSE), facts.along_the_wall),
    Hard("ring", (COLLISIONS,), facts.ring),
    Hard("rack", (COLLISIONS, COLLAPSE, WALL_TRAP)),
    Hard("newton-row", (TIME,), facts.newton_row),
    Hard("cor-extremes", (COLLISIONS, COLLAPSE)),
    Hard("whispering-1e-6", (COLLISIONS,), facts.whispering),
    Hard("whispering-1e-9", (COLLISIONS,), facts.whispering),
    Hard("wall-trap", (WALL_TRAP,), facts.wall_trap_told),
    Hard("wall-trap-sums", (TIME,), facts.wall_trap_sums),
    Hard("collapse-two", (COLLAPSE, TIME), facts.collapse_below(3 - 2 * math.sqrt(2))),
    Hard("collapse-three", (COLLAPSE, TIME), facts.collapse_below(7 - 4 * math.sqrt(3))),
    Hard("cluster", (COLLAPSE,), lengthy=True),
    Hard("cluster-circle", (COLLAPSE, WALL_TRAP)),
    Hard("galperin", (TIME,), facts.galperin, lengthy=True),
    Hard("galperin-1e12", (TIME,), facts.galperin, lengthy=True),
    Hard("mass-ratios", (COLLISIONS, COLLAPSE, WALL_TRAP)),
    Hard("container-masses", (COLLISIONS, COLLAPSE, WALL_TRAP)),
    Hard("radii-1e-9", (COLLISIONS,), facts.needles),
    Hard("radii-apart", (COLLISIONS, WALL_TRAP)),
    Hard("full", (COLLISIONS,), facts.full),
    Hard("speeds", (COLLISIONS, WALL_TRAP)),
    Hard("speeds-mixed", (COLLISIONS, WALL_TRAP), lengthy=True),
    Hard("packing", (COLLISIONS,), lengthy=True),
    Hard("corner", (TIME,), facts.corner),
    Hard("clock-slow", (TIME,)),
    Hard("clock-far", (TIME,), facts.late_row),
    Hard("at-rest", (NOTHING_LEFT,), facts.nothing_happens),
    Hard("at-rest-periodic", (NOTHING_LEFT,), facts.nothing_happens),
    Hard("billion", (COLLISIONS,), facts.random_walk, lengthy=True, by_name_only=True),
)
