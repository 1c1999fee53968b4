"""Gases to measure: their scenes, their repeats in threads, and the means over seeds."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.arrange import arrange
from snooker_cli.bench.physics_rows import Setting
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.observables import mean_and_error
from snooker_cli.trace import Series, Summary

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene

    Array = NDArray[np.float64]

TEMPLATE = """
container: {{shape: {shape}}}
balls: {{count: {balls}, radius: 1.0, packing: {packing!r}, speed: 10.0, speeds: {speeds}}}
cor: {cor!r}
collisions: 1
seed: 1
"""


@dataclass(frozen=True)
class Gas:
    """Equal balls of 1 m and 1 kg that start on a lattice with a temperature of 50 J.

    settling, collisions : a ball's with others, in a periodic box, before measuring and meanwhile
    seeds : repeats
    """

    balls: int
    packing: float
    settling: float
    collisions: float
    seeds: int
    cor: float = 1.0
    shape: str = "periodic"
    speeds: str = "maxwell"

    def scene(self, seed: int) -> Scene:
        """The start of a repeat."""
        text = TEMPLATE.format(
            shape=self.shape,
            balls=self.balls,
            packing=self.packing,
            speeds=self.speeds,
            cor=self.cor,
        )
        return arrange(parse(text).experiment, seed)

    @property
    def settling_events(self) -> int:
        """Collisions of all balls together until measuring begins: two balls share one."""
        return round(self.settling * self.balls / 2)

    @property
    def measured_events(self) -> int:
        """The same while it goes on."""
        return round(self.collisions * self.balls / 2)

    @property
    def free(self) -> int:
        """Balls that the law of speeds counts: a periodic box without momentum has one less."""
        return self.balls - (self.shape == "periodic")

    def setting(self) -> Setting:
        """What a row tells of it."""
        return Setting(
            shape=self.shape,
            balls=self.balls,
            packing=self.packing,
            cor=self.cor,
            settling=self.settling_events,
            collisions=self.measured_events,
            seeds=self.seeds,
        )


def over_seeds(gas: Gas, measure: Callable[[Scene, Summary], tuple[float, ...]]) -> Array:
    """What is measured of each repeat, a row each; the same for any number of threads."""

    def one(seed: int) -> tuple[float, ...]:
        scene = gas.scene(seed)
        events = gas.settling_events + gas.measured_events
        summary = simulate(scene, collisions=events, summary=True, engine="cells").summary
        assert summary is not None
        return measure(scene, evenly(summary))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return np.array(list(pool.map(one, range(gas.seeds))))


def evenly(summary: Summary) -> Summary:
    """A summary with the last row and those of the even grid, for means over its rows."""
    time = summary.series.time
    rows = np.append(time[:-1] % (time[-2] - time[-3]) == 0, True)
    series = Series(*(column[rows] for column in vars(summary.series).values()))
    return Summary(series, summary.speed_histogram[rows])


def means(rows: Array) -> list[tuple[float, float]]:
    """Mean and standard error of each column over the repeats."""
    return [mean_and_error(column) for column in rows.T]
