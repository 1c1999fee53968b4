"""Collisions per second of one thread, for scenes that ask for different things."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass

from snooker_cli.arrange import arrange
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.scene import Scene

EVENTS = 400_000
TEMPLATE = """
container: {{radius: 10.0, mass: {mass}}}
balls: {{rings: {rings}, radius: {radius}, speed: 10.0}}
cor: {cor}
collisions: 1
"""


@dataclass(frozen=True)
class Case:
    """A scene to time."""

    name: str
    rings: int
    radius: float
    mass: str
    cor: float

    def scene(self) -> Scene:
        """Its start."""
        values = {"rings": self.rings, "radius": self.radius, "mass": self.mass, "cor": self.cor}
        return arrange(parse(TEMPLATE.format(**values)).experiment, 0)


CASES = (
    Case("the report's scene", 3, 1.0, "1e7", 1.0),
    Case("fixed container", 3, 1.0, ".inf", 1.0),
    Case("dilute", 3, 0.1, "1e7", 1.0),
    Case("dilute, fixed container", 3, 0.1, ".inf", 1.0),
    Case("CoR 0.999", 3, 1.0, "1e7", 0.999),
    Case("91 balls", 5, 0.6, ".inf", 1.0),
)


@dataclass(frozen=True)
class Timing:
    """Collisions per second over the repeats of a measurement."""

    case: str
    balls: int
    packing_fraction: float
    median: float
    lowest: float
    highest: float
    repeats: int


def measure(case: Case, repeats: int = 5) -> Timing:
    """Time a case: processor seconds of one thread, after a run that is not counted."""
    scene = case.scene()
    simulate(scene, collisions=EVENTS // 10)
    rates = []
    for _ in range(repeats):
        clock = time.process_time()
        trace = simulate(scene, collisions=EVENTS)
        rates.append(trace.collisions / (time.process_time() - clock))
    return Timing(
        case=case.name,
        balls=scene.number,
        packing_fraction=scene.packing_fraction,
        median=statistics.median(rates),
        lowest=min(rates),
        highest=max(rates),
        repeats=repeats,
    )
