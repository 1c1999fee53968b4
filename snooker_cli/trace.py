"""What a simulation leaves behind: its start, its events or its summary, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from snooker_cli.scene import Scene


CONTAINER = -1
"""The partner's number in an event of a ball with the container."""


SLIDE = -2
"""Instead, in an event that stands for all the bounces of a ball before it slides along the wall,
or for its pressing against the wall as it slid, since its event before."""


class StopReason(StrEnum):
    """Why a repeat ended."""

    COLLISIONS = "collisions"  # the wanted number of collisions is reached
    TIME = "time"  # the wanted time is reached
    NOTHING_LEFT = "nothing_left"  # no collision lies ahead
    WALL_TRAP = "wall_trap"  # a ball's wall hits become infinitely many in finite time
    COLLAPSE = "collapse"  # collisions go on while the clock stands still
    INTERRUPTED = "interrupted"  # the user asked to stop

    @property
    def collapsed(self) -> bool:
        """Whether collisions became infinitely many in finite time."""
        return self in (StopReason.WALL_TRAP, StopReason.COLLAPSE)

    @property
    def complete(self) -> bool:
        """Whether everything that was asked for, or all that can happen, is there."""
        return self in (StopReason.COLLISIONS, StopReason.TIME, StopReason.NOTHING_LEFT)


@dataclass(frozen=True)
class Stop:
    """How a repeat ended: the reason, when (s), which balls, and a sentence for people."""

    reason: StopReason
    time: float
    balls: tuple[int, ...]
    message: str


@dataclass(frozen=True)
class Events:
    """Collisions in order of time, a column a quantity.

    time : (*n*,) ``numpy.float64``, s; never decreases
    i, j : (*n*,) ``numpy.int32``; i < j for two balls, j = -1 for the container, or -2 where the
        ball slides: it begins to after infinitely many bounces, or has done so since its last event
    impulse : (*n*,) ``numpy.float64``, kg m/s, not negative, along the line of centres; of all the
        bounces, or what the ball has pressed as it slid
    residual : (*n*,) ``numpy.float64``, s, what rounding has left out of the time; see
        ``engine.epochs``. Or ``None``: nothing, as in a run that is not long
    """

    time: NDArray[np.float64]
    i: NDArray[np.int32]
    j: NDArray[np.int32]
    impulse: NDArray[np.float64]
    residual: NDArray[np.float64] | None = None

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, rows: slice) -> Events:
        """Some of them, without copying."""
        return Events(
            self.time[rows],
            self.i[rows],
            self.j[rows],
            self.impulse[rows],
            None if self.residual is None else self.residual[rows],
        )

    @property
    def at_wall(self) -> NDArray[np.bool_]:
        """(*n*,) Which are with the container, not between balls."""
        return self.j < 0


def joined(parts: Sequence[Events]) -> Events:
    """Events one after the other, without copying a single part."""
    if len(parts) == 1:
        return parts[0]
    residual = None
    if any(part.residual is not None for part in parts):
        residual = np.concatenate(
            [np.zeros_like(part.time) if part.residual is None else part.residual for part in parts]
        )
    return Events(
        np.concatenate([part.time for part in parts]),
        np.concatenate([part.i for part in parts]),
        np.concatenate([part.j for part in parts]),
        np.concatenate([part.impulse for part in parts]),
        residual,
    )


@dataclass(frozen=True)
class Series:
    """Observables over time, from time zero: after each collision, or on a grid.

    A grid is even but for its beginning, where it is finer if the repeat was long, and for its last
    row, which is at the end of the repeat.

    Every column is (*g*,) ``numpy.float64``.

    time : s
    kinetic_energy, container_energy : J, of the balls and of the container
    wall_impulse : impulse given to the wall since the start, kg m/s
    pair_virial : sum over ball-ball collisions of impulse times contact distance, kg m^2/s
    wall_events, pair_events : collisions since the start
    mean_speed : mean over the balls, m/s
    energy_moment : <k^2>/<k>^2 of the balls' kinetic energies k; for equal masses this is the
        kurtosis <v^4>/<v^2>^2
    """

    time: NDArray[np.float64]
    kinetic_energy: NDArray[np.float64]
    container_energy: NDArray[np.float64]
    wall_impulse: NDArray[np.float64]
    pair_virial: NDArray[np.float64]
    wall_events: NDArray[np.float64]
    pair_events: NDArray[np.float64]
    mean_speed: NDArray[np.float64]
    energy_moment: NDArray[np.float64]


SERIES_UNITS = {
    "time": "s",
    "kinetic_energy": "J",
    "container_energy": "J",
    "wall_impulse": "kg m s-1",
    "pair_virial": "kg m2 s-1",
    "wall_events": "1",
    "pair_events": "1",
    "mean_speed": "m s-1",
    "energy_moment": "1",
}
"""The columns of ``Series``, in order, and their units."""


@dataclass(frozen=True)
class Summary:
    """What is kept of a run that stores no events.

    series : observables on a grid of times
    speed_histogram : (*g*, *b*) ``numpy.int64``, balls by reduced speed v sqrt(m/2T) at the times
        of the grid, in bins of ``SPEED_BIN``; faster ones are in the last
    """

    series: Series
    speed_histogram: NDArray[np.int64]


SPEED_BIN = 0.125
"""Width of a bin of reduced speed."""

SPEED_BINS = 32


@dataclass(frozen=True)
class Work:
    """What a simulation took; counted by the kernel, told of by a run, not stored.

    predictions : pairs of balls that were looked at
    crossings : of balls from one cell into another
    queue_updates : balls whose next event was entered anew: those of each collision and crossing,
        and those whose contact came up after its partner had had another event
    """

    predictions: int
    crossings: int
    queue_updates: int


@dataclass(frozen=True)
class Trace:
    """One finished repeat.

    start, finish : the scene at time 0 and at ``stop.time``
    events : every collision, or ``None`` if only a summary was recorded or a sink took them
    summary : observables on a grid, or ``None`` if events were recorded
    wall_events, pair_events : collisions with the wall and between balls
    work : what it took; ``None`` if it was read from a file
    """

    start: Scene
    finish: Scene
    stop: Stop
    wall_events: int
    pair_events: int
    events: Events | None
    summary: Summary | None
    work: Work | None = None

    @property
    def collisions(self) -> int:
        """All collisions of the repeat."""
        return self.wall_events + self.pair_events
