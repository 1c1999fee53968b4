"""Which setting do the report's decay constants come from: a search over what it may have used."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.decay import Quantity, curve
from snooker_cli.fit import fit
from snooker_cli.observables import series
from snooker_cli.report.published import published

if TYPE_CHECKING:
    from collections.abc import Iterable

    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.trace import Trace

WINDOWS = (100, 200, 500)
"""Collisions up to which a curve is fitted."""

SLIPS = (1.0, 10.0)
"""Seconds that the report's second may have been: at 1 m/s instead of 10 all takes ten times as
long, and a time axis in tenths of a second does the same."""

TARGETS: dict[str, tuple[Quantity, float]] = {
    "energy_mean_0.8": ("kinetic_energy", 0.8),
    "energy_mean_0.9": ("kinetic_energy", 0.9),
    "pressure_mean_0.8": ("pressure", 0.8),
    "pressure_mean_0.9": ("pressure", 0.9),
}
"""The printed means that a setting has to explain together, and what they are of."""


@dataclass(frozen=True)
class Setting:
    """One way the report may have been made.

    radius : of a ball, m
    elastic_wall : whether the container's CoR was 1 instead of the balls'
    extent : radius of the outermost ring over the container's
    window : collisions that were fitted
    held : whether the fitted curve was held to the data's start
    slip : seconds of ours in a second of the report
    """

    radius: float
    elastic_wall: bool
    extent: float
    window: int
    held: bool
    slip: float

    def words(self) -> str:
        """The setting in words, only what differs from the scene as stated."""
        parts = []
        if self.radius != 1.0:
            parts.append(f"r = {self.radius:g} m")
        if self.elastic_wall:
            parts.append("elastic wall")
        parts.append(f"rings to {self.extent:g} R")
        if self.window != 500:
            parts.append(f"first {self.window} collisions")
        if not self.held:
            parts.append("amplitude free")
        if self.slip != 1.0:
            parts.append(f"time or speed out by {self.slip:g}")
        return ", ".join(parts)

    @property
    def deviations(self) -> int:
        """How many statements of the report it goes against; it states no ring extent."""
        return (
            (self.radius != 1.0)
            + self.elastic_wall
            + (self.window != 500)
            + (not self.held)
            + (self.slip != 1.0)
        )


@dataclass(frozen=True)
class Candidate:
    """A setting, and the constants it gives: mean and standard deviation of one repeat, 1/s."""

    setting: Setting
    values: dict[str, tuple[float, float]]

    def distance(self, target: str) -> float:
        """Difference from a printed mean of five runs, in its and our uncertainty together."""
        number = published(target)
        mean, deviation = self.values[target]
        return abs(mean - number.value) / math.hypot(number.tolerance, deviation / math.sqrt(5))

    def score(self, targets: Iterable[str]) -> float:
        """Sum of squared distances; smaller is better."""
        return sum(self.distance(target) ** 2 for target in targets)


def search(run: Run) -> list[Candidate]:
    """All candidates that the audit's run offers."""
    fitted: dict[tuple[Any, ...], list[float]] = {}
    scenes = set()
    for point in run.points:
        scene = _scene_of(point)
        scenes.add(scene)
        for trace in run.traces(point):
            for key, value in _constants(trace).items():
                fitted.setdefault((*scene, point.experiment.cor, *key), []).append(value)
    candidates = []
    for (radius, elastic, extent), window, held, slip in itertools.product(
        sorted(scenes), WINDOWS, (True, False), SLIPS
    ):
        setting = Setting(radius, elastic, extent, window, held, slip)
        values: dict[str, tuple[float, float]] = {}
        for target, (quantity, cor) in TARGETS.items():
            found = fitted.get((radius, elastic, extent, cor, quantity, window, held), [])
            if len(found) > 1:
                mean, deviation = float(np.mean(found)), float(np.std(found, ddof=1))
                values[target] = mean / slip, deviation / slip
        if len(values) == len(TARGETS):
            candidates.append(Candidate(setting, values))
    return candidates


def best(candidates: list[Candidate], targets: Iterable[str]) -> Candidate:
    """The candidate nearest to the targets; of equals, the one that deviates least."""
    wanted = tuple(targets)
    return min(candidates, key=lambda one: (one.score(wanted), one.setting.deviations))


def _scene_of(point: Point) -> tuple[float, bool, float]:
    """Radius, whether the wall is elastic, ring extent."""
    balls: Any = point.experiment.balls
    elastic = point.experiment.effective_wall_cor == 1.0
    return balls.radius, elastic, balls.ring_extent


def _constants(trace: Trace) -> dict[tuple[Quantity, int, bool], float]:
    """Exponential decay constants by quantity, fitted collisions and whether held to the start."""
    found: dict[tuple[Quantity, int, bool], float] = {}
    times = series(trace).time
    quantities: tuple[Quantity, ...] = ("kinetic_energy", "pressure")
    for quantity in quantities:
        whole = curve(trace, quantity)
        for window in WINDOWS:
            kept = whole.time <= times[min(window, len(times) - 1)]
            time, value = whole.time[kept], whole.value[kept]
            for held in (True, False):
                amplitude = 1.0 if held else None
                result = fit(time, value, amplitude=amplitude)
                if result.converged:
                    found[quantity, window, held] = result.value
    return found
