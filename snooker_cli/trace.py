"""The result of a simulation: start, events or summary, and the reason for the end."""

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli.fields import record_type
from snooker_cli.scene import Scene

CONTAINER = -1  # the number of the partner in a collision of a ball with the container

SLIDE = -2
"""The same in an event that sums up a motion along the wall: all bounces of a ball before it
slides, or its pressing on the wall since its last event."""


class StopReason(StrEnum):
    """Why a repeat ended."""

    COLLISIONS = "collisions"  # the number of collisions is reached
    TIME = "time"  # the time is reached
    NOTHING_LEFT = "nothing_left"  # no further collision can happen
    WALL_TRAP = "wall_trap"  # a ball hits the wall infinitely often in finite time
    COLLAPSE = "collapse"  # collisions follow without any time between them
    IDLE = "idle"  # very many crossings without a collision
    REST = "rest"  # the balls are too slow for double precision
    FAR = "far"  # a free container is too far away for double precision
    INTERRUPTED = "interrupted"  # the user asked to stop
    OUT_OF_RANGE = "out_of_range"  # the next collision gives a number that no result can have

    @property
    def collapsed(self) -> bool:
        """Whether infinitely many collisions happen in finite time."""
        return self in (StopReason.WALL_TRAP, StopReason.COLLAPSE)

    @property
    def complete(self) -> bool:
        """Whether the repeat has reached its limit, or all collisions that can happen."""
        return self in (StopReason.COLLISIONS, StopReason.TIME, StopReason.NOTHING_LEFT)


class Stop(NamedTuple):
    """The end of a repeat: reason, time (s), the balls that caused it, and a message.

    accumulation_time : s, when the infinitely many bounces of a wall trap end; otherwise ``None``
    impulse_to_come : kg m/s, of these bounces on the wall; otherwise ``None``
    """

    reason: StopReason
    time: float
    balls: tuple[int, ...]
    message: str
    accumulation_time: float | None = None
    impulse_to_come: float | None = None

    def known(self) -> dict[str, Any]:
        """The fields by name, without those that are ``None``."""
        return {name: value for name, value in self._asdict().items() if value is not None}


@dataclass(frozen=True)
class Events:
    """Collisions in order of time, one column for each quantity.

    time : (*n*,) ``numpy.float64``, s; never decreases
    i, j : (*n*,) ``numpy.int32``; i < j for two balls, j = ``CONTAINER``, or j = ``SLIDE``
    impulse : (*n*,) ``numpy.float64``, kg m/s, not negative, along the line of centres; for
        ``SLIDE`` the sum of all bounces or of the pressing
    tangential : (*n*,) ``numpy.float64``, kg m/s, the impulse to the left of the line of centres,
        on j; ``None`` of smooth balls
    residual : (*n*,) ``numpy.float64``, s, the part of the time that rounding cuts off, see
        ``engine.clock``; ``None`` in runs that are not long, where it is zero
    """

    time: NDArray[np.float64]
    i: NDArray[np.int32]
    j: NDArray[np.int32]
    impulse: NDArray[np.float64]
    tangential: NDArray[np.float64] | None = None
    residual: NDArray[np.float64] | None = None

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, rows: slice | NDArray[np.bool_]) -> "Events":
        """The events of some rows; of a slice without a copy."""
        return Events(**{name: values[rows] for name, values in self.columns.items()})

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns that are there, in the order of hashes."""
        return {name: values for name, values in vars(self).items() if values is not None}

    @property
    def at_wall(self) -> NDArray[np.bool_]:
        """(*n*,) Whether each is a collision with the container."""
        return self.j < 0


def joined(parts: Sequence[Events]) -> Events:
    """The parts one after the other; a single part is not copied."""
    if len(parts) == 1:
        return parts[0]
    columns = [part.columns for part in parts]
    names = {name for part in columns for name in part}
    # Residuals that a part does not have are zero.
    return Events(
        **{
            name: np.concatenate(
                [part[name] if name in part else np.zeros(len(part["time"])) for part in columns]
            )
            for name in names
        }
    )


def records_of(events: Events) -> NDArray[np.void]:
    """The events as the engine records and hashes them, see `record_type`; without residuals."""
    columns = events.columns
    records = np.empty(len(events), record_type(columns))
    for name in records.dtype.names or ():
        records[name] = columns[name]
    return records


class Simultaneous:
    """Counts collisions that have exactly the time of another of the same ball; given in pieces.

    In a gas with random starts there are none. The engine resolves them one after the other.
    """

    def __init__(self) -> None:
        self._number = 0
        self._last: Events | None = None  # those at the latest time: more of them may follow

    def add(self, events: Events) -> None:
        """Count the next events of the repeat."""
        if np.any(slides := events.j == SLIDE):
            events = events[~slides]
        if len(events) == 0:
            return
        if self._last is not None and _repeats(joined([self._last[-1:], events[:1]])).any():
            events = joined([self._last, events])
        else:
            self._number = self.number
        self._last, repeats = events[-1:], _repeats(events)
        if repeats.any():
            later = np.flatnonzero(~repeats)
            last = int(later[-1]) + 1 if len(later) else 0
            self._number += _of_same_time(events[:last])
            self._last = events[last:]

    @property
    def number(self) -> int:
        """All collisions so far that have the time of another of the same ball."""
        return self._number + (0 if self._last is None else _of_same_time(self._last))


def _repeats(events: Events) -> NDArray[np.bool_]:
    """(*n* - 1,) Whether each event but the first has the time of the one before."""
    same: NDArray[np.bool_] = events.time[1:] == events.time[:-1]
    if events.residual is not None:
        same &= events.residual[1:] == events.residual[:-1]
    return same


def _of_same_time(events: Events) -> int:
    """The number of events that have the time of another of the same ball."""
    same = _repeats(events)
    if not same.any():
        return 0
    within = np.append(same, False) | np.append(False, same)
    instant = np.append(0, np.cumsum(~same))[within]
    i, j = events.i[within], events.j[within]
    most = int(max(i.max(), j.max())) + 1
    keys = instant * most + i, np.where(j >= 0, instant * most + j, -1 - np.arange(len(j)))
    _, which, counts = np.unique(np.concatenate(keys), return_inverse=True, return_counts=True)
    shared = (counts > 1)[which].reshape(2, -1)
    return int(np.count_nonzero(shared.any(axis=0)))


def event_hashes(pieces: Iterable[Events]) -> list[tuple[int, str]]:
    """Numbers of events, and the hash of as many: of the first 1,000, 10,000 … and of all.

    SHA-256, in hexadecimal, of time, i, j and impulse of each event as little-endian numbers of
    64, 32, 32 and 64 bits; of rough balls then the tangential impulse, of 64. ``EventHash`` of the
    live page computes the same.

    pieces : the events of a repeat, in order
    """
    sha, count, following = hashlib.sha256(), 0, 1000
    hashes: dict[int, str] = {}
    for events in pieces:
        rows = records_of(events)
        while count + len(rows) >= following:
            first, rows = rows[: following - count], rows[following - count :]
            sha.update(first.tobytes())
            count = following
            hashes[count] = sha.hexdigest()
            following *= 10
        sha.update(rows.tobytes())
        count += len(rows)
    return list((hashes | {count: sha.hexdigest()}).items())


@dataclass(frozen=True)
class Series:
    """Observables over time, from time zero: after each collision, or on a grid.

    The grid is even, except for a finer beginning in long repeats and a last row at the end of the
    repeat. Every column is (*g*,) ``numpy.float64``.

    time : s
    kinetic_energy, container_energy : J, of the balls and of the container
    wall_impulse : impulse given to the wall since the start, kg m/s
    pair_virial : sum over ball-ball collisions of impulse times contact distance, kg m^2/s
    wall_events, pair_events : collisions since the start
    mean_speed : mean over the balls, m/s
    energy_moment : <k^2>/<k>^2 of the balls' kinetic energies k; for equal masses this is the
        kurtosis <v^4>/<v^2>^2
    wall_energy, lost_energy : energy that hits of the wall gave to the balls, and that collisions
        between them took, since the start, J; ``None`` unless walls give energy
    spin_energy : J, of the balls' rotation; ``None`` of smooth balls
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
    wall_energy: NDArray[np.float64] | None = None
    lost_energy: NDArray[np.float64] | None = None
    spin_energy: NDArray[np.float64] | None = None

    @property
    def columns(self) -> dict[str, NDArray[np.float64]]:
        """The columns that are there, in order."""
        return {name: column for name, column in vars(self).items() if column is not None}

    def __getitem__(self, rows: Any) -> "Series":
        """Some of the rows."""
        return Series(**{name: column[rows] for name, column in self.columns.items()})


def series_units(scene: Scene) -> dict[str, str]:
    """The columns of the ``Series`` of a scene, in order, and their units."""
    units = ("s", "J", "J", "kg m s-1", "kg m2 s-1", "1", "1", "m s-1", "1", "J", "J", "J")
    columns = dict(zip(Series.__dataclass_fields__, units, strict=True))
    if not scene.wall_law.adds_energy:
        del columns["wall_energy"], columns["lost_energy"]
    if scene.surface is None:
        del columns["spin_energy"]
    return columns


def series_of(scene: Scene, time: NDArray[np.float64], columns: NDArray[np.float64]) -> Series:
    """The ``Series`` of a scene, of its times and its other columns (*columns*, *g*) in order."""
    return Series(**dict(zip(series_units(scene), (time, *columns), strict=True)))


@dataclass(frozen=True)
class Summary:
    """The record of a repeat without events.

    series : observables on a grid of times
    speed_histogram : (*g*, *b*) ``numpy.int64``, numbers of balls by reduced speed v sqrt(m/2T) at
        each time of the grid, in bins of ``SPEED_BIN``; the last bin has all faster balls
    """

    series: Series
    speed_histogram: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Stored states of a repeat, which are read one by one: all of them may fill the memory.

    time : (*s*,) ``numpy.float64``, s, ascending
    read : the scene at the k-th of these times; of a file it raises ``StoreError``
    """

    time: NDArray[np.float64]
    read: Callable[[int], Scene]

    def __len__(self) -> int:
        return len(self.time)


def even_choice(count: int, most: int) -> NDArray[np.int64]:
    """At most ``most`` of ``count`` rows at even distances, with the first and the last."""
    return np.linspace(0, count - 1, min(count, most)).round().astype(np.int64)


SPEED_BIN, SPEED_BINS = 0.125, 32  # width of a bin of reduced speed, and number of bins


@dataclass(frozen=True, eq=False)
class Trace:
    """One finished repeat.

    start, finish : the scene at time 0 and at ``stop.time``
    events : every collision; ``None`` with a summary, or if a sink took the events
    summary : observables on a grid, or ``None`` if events were recorded
    wall_events, pair_events : collisions with the wall and between balls
    snapshots : stored states between start and finish; ``None`` without, or if a sink took them
    checkpoint : the engine's arrays by name, with which ``simulate`` continues; of a repeat that
        was interrupted
    """

    start: Scene
    finish: Scene
    stop: Stop
    wall_events: int
    pair_events: int
    events: Events | None
    summary: Summary | None
    checkpoint: dict[str, NDArray[Any]] | None = None
    snapshots: Snapshots | None = None

    @property
    def collisions(self) -> int:
        """All collisions of the repeat."""
        return self.wall_events + self.pair_events
