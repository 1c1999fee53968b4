"""Collisions per second of one thread, for gases that ask for different things of the engine."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from snooker_cli.arrange import arrange
from snooker_cli.config import parse
from snooker_cli.engine import engines, layout, sampling
from snooker_cli.engine.endings import FULL
from snooker_cli.engine.simulate import CHUNK
from snooker_cli.scene import Scene

MASS = 1e7
"""Of a free container, kg; balls have 1 kg."""

TEMPLATE = """
container: {{radius: 10.0, mass: {mass}}}
balls: {{count: {balls}, packing: {packing}, speed: 10.0, speeds: maxwell}}
cor: 1
collisions: 1
seed: {seed}
"""

SPAN = 50
"""Collisions a ball for which a gas with losses goes on; then it starts anew."""


@dataclass(frozen=True)
class Case:
    """A gas in a circle to time: a lattice with Maxwell's speeds, stirred without losses first.

    free : whether the container moves
    engine : "allpairs" or "cells" instead of what suits it
    """

    balls: int
    packing: float
    free: bool = False
    cor: float = 1.0
    engine: str | None = None

    def scene(self, seed: int = 1) -> Scene:
        """Its start, without losses."""
        mass = MASS if self.free else ".inf"
        text = TEMPLATE.format(balls=self.balls, packing=self.packing, mass=mass, seed=seed)
        return arrange(parse(text).experiment, 0)


@dataclass(frozen=True)
class Effort:
    """How long to measure.

    events : collisions in a repeat; more if many balls would not be sorted by cells in any
    stirring : collisions a ball before anything is measured
    """

    events: int = 200_000
    repeats: int = 5
    stirring: int = 10

    def events_of(self, balls: int) -> int:
        """Collisions in a repeat for so many balls."""
        sorting = engines.REORDER_AFTER * balls if balls >= engines.REORDERED else 0
        return max(self.events, sorting // self.repeats)


QUICK = Effort(events=2000, repeats=2, stirring=2)
"""Shows that it works, and nothing else."""

LIKE_THE_REPORT = [
    Case(37, packing, free, cor)
    for cor in (1.0, 0.9)
    for packing in (0.37, 0.0037)
    for free in (True, False)
]
MANY = [
    *(Case(1000, packing) for packing in (0.004, 0.04, 0.2, 0.4, 0.55, 0.7)),
    *(Case(37, packing) for packing in (0.04, 0.2)),
    Case(1000, 0.4, free=True),
    Case(1000, 0.4, cor=0.9),
    Case(100_000, 0.4),
]
MOST = [Case(1_000_000, 0.4)]
BOTH = [
    Case(balls, packing, free, engine=engine)
    for packing in (0.4, 0.004)
    for free in (False, True)
    for balls in (19, 37, 61, 127, 217, 397)
    for engine in ("allpairs", "cells")
]
CASES = [*LIKE_THE_REPORT, *MANY, *BOTH]
QUICK_CASES = [*LIKE_THE_REPORT[2:5], *BOTH[:6], Case(100, 0.4)]


@dataclass(frozen=True)
class Timing:
    """Collisions per second over the repeats of a measurement.

    engine : the one that was used
    events : collisions in a repeat
    """

    case: Case
    engine: str
    median: float
    lowest: float
    highest: float
    repeats: int
    events: int

    def as_json(self) -> dict[str, Any]:
        """Without the case in it: all its keys beside the others."""
        return vars(self.case) | {key: value for key, value in vars(self).items() if key != "case"}


def measure(case: Case, effort: Effort) -> Timing:
    """Time a case: processor seconds of the kernel, which records into memory."""
    events = effort.events_of(case.balls)
    stirred = Kernel(case.scene(), case.engine)
    stirred.advance(effort.stirring * case.balls)
    again = _anew(stirred, case) if case.cor < 1.0 else _on(stirred)
    rates = [_rate(again, events, case) for _ in range(effort.repeats)]
    return Timing(
        case=case,
        engine="cells" if isinstance(stirred.engine, engines.InCells) else "allpairs",
        median=statistics.median(rates),
        lowest=min(rates),
        highest=max(rates),
        repeats=effort.repeats,
        events=events,
    )


def _rate(again: Iterator[Callable[[int], tuple[int, float]]], events: int, case: Case) -> float:
    """Collisions per second over so many, in one piece or several."""
    done, seconds = 0, 0.0
    while done < events:
        more, took = next(again)(events - done)
        if more == 0:
            raise ValueError(f"no collision lies ahead in {case}")
        done, seconds = done + more, seconds + took
    return done / seconds


def _on(stirred: Kernel) -> Iterator[Callable[[int], tuple[int, float]]]:
    """The same gas, again and again."""
    while True:
        yield stirred.advance


def _anew(stirred: Kernel, case: Case) -> Iterator[Callable[[int], tuple[int, float]]]:
    """A gas with losses in the same places, each time with new speeds and for a span."""
    generator = np.random.default_rng(1)
    places = stirred.places()
    while True:
        kernel = Kernel(with_losses(places, case.cor, case.cor, generator), case.engine)
        yield partial(_for_a_span, kernel, SPAN * case.balls)


def _for_a_span(kernel: Kernel, span: int, collisions: int) -> tuple[int, float]:
    """Go on for so many collisions, but for no longer than a span."""
    return kernel.advance(min(collisions, span))


def with_losses(
    places: Scene, cor: float, wall_cor: float, generator: np.random.Generator
) -> Scene:
    """The balls of a scene where they are, with new velocities from Maxwell's distribution."""
    velocities = generator.normal(scale=10.0 / math.sqrt(2.0), size=places.velocities.shape)
    return replace(places, velocities=velocities, restitution=cor, wall_restitution=wall_cor)


class Kernel:
    """An engine that goes on and on, without the chunks and files around it."""

    def __init__(self, scene: Scene, kind: str | None = None) -> None:
        self.scene = scene
        self.engine = engines.engine_for(scene, kind)(scene, layout.Setup.of(scene))
        self._recorded, self._grid = layout.room_for(CHUNK), sampling.no_grid()

    def advance(self, collisions: int) -> tuple[int, float]:
        """Go on for so many collisions, or to an end; how many they were, and the time they took.

        The time is that of the processor, s.
        """
        before, answer = self.collisions, FULL
        wanted = before + collisions
        clock = time.process_time()
        while answer == FULL and self.collisions < wanted:
            room = min(CHUNK, wanted - self.collisions)
            answer = self.engine.advance(self._recorded, self._grid, room)
        return self.collisions - before, time.process_time() - clock

    @property
    def collisions(self) -> int:
        """Collisions so far."""
        return int(self.engine.counts[layout.WALL_EVENTS] + self.engine.counts[layout.PAIR_EVENTS])

    @property
    def energy(self) -> float:
        """Kinetic energy of the balls over that of the start."""
        speeds = self.engine.balls()[[layout.U, layout.V]].T
        return replace(self.scene, velocities=speeds).kinetic_energy / self.scene.kinetic_energy

    def places(self) -> Scene:
        """The scene with the balls where they are now, in a container at rest."""
        balls, now = self.engine.balls(), float(self.engine.sums[layout.NOW])
        ages = now - balls[layout.CLOCK]
        motions = balls[[layout.U, layout.V]]
        positions = (balls[[layout.X, layout.Y]] + motions * ages).T
        container = self.engine.container
        centre = self.scene.container_position
        if container is not None:
            centre = container[:2] + container[2:4] * (now - container[layout.CLOCK])
        return replace(self.scene, positions=positions.copy(), container_position=np.array(centre))


def crossover(timings: Sequence[Timing]) -> list[dict[str, Any]]:
    """How many times as fast all pairs are as cells where both were timed, all in one container.

    few : balls up to which the engine would be all pairs
    """
    found: dict[tuple[float, bool, int], dict[str, float]] = {}
    for timing in timings:
        case = timing.case
        if case.engine is not None:
            rates = found.setdefault((case.packing, case.free, case.balls), {})
            rates[timing.engine] = timing.median
    return [
        {
            "packing": packing,
            "free": free,
            "balls": balls,
            "ratio": rates["allpairs"] / rates["cells"],
            "few": engines.few_at(packing, free=free),
        }
        for (packing, free, balls), rates in found.items()
        if len(rates) == 2
    ]
