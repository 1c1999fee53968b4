"""A run's files -> the selected repeats that are there, and what a caption says of each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import store
from snooker_cli.gallery.selection import there

if TYPE_CHECKING:
    from pathlib import Path

    from snooker_cli.config import Point
    from snooker_cli.gallery.selection import Selection
    from snooker_cli.results import Run
    from snooker_cli.store import Stored
    from snooker_cli.trace import StopReason, Trace

REMEMBERED_SIZE = 100_000
"""Repeats whose file is at most this long (bytes) stay in memory for the next picture."""


@dataclass(frozen=True)
class Facts:
    """What a caption needs to know of a repeat.

    motion : start, finish and number of collisions in units of the fastest ball's speed at the
        start; equal if two repeats are one motion at two paces, to the bit
    """

    reason: StopReason
    collisions: int
    motion: bytes


def repeats(run: Run, point: Point, selection: Selection) -> Iterator[Trace]:
    """The selected repeats of a point that are there. Raises ``StoreError``."""
    for number in there(run, point, selection):
        yield _read(run, point, number)


def one_repeat(run: Run, point: Point, selection: Selection) -> Trace:
    """The selected repeat of a point, the first if none is chosen. Raises ``StoreError``."""
    return _read(run, point, there(run, point, selection)[0])


def facts(run: Run, point: Point, selection: Selection, *, single: bool) -> list[Facts]:
    """What a caption needs of the repeats; of the first alone if ``single``."""
    numbers = there(run, point, selection)[: 1 if single else None]
    paths = [run.path(point.index, number) for number in numbers]
    return [_facts(path, _modified(path)) for path in paths]


def _read(run: Run, point: Point, number: int) -> Trace:
    """A repeat of this run from its file, or from memory, see ``_stored``."""
    stored = _stored(run.path(point.index, number))
    run.accept(point, number, stored.told)
    return stored.trace


def _stored(path: Path) -> Stored:
    """What is in a file, or in memory if the file is small and unchanged."""
    about = store.about(path)
    if about is None or about.bytes > REMEMBERED_SIZE:
        return store.read(path)
    return _remembered(path, about.modified)


def _modified(path: Path) -> int:
    """When a repeat's file was put in its place, ns since 1970; 0 if it is gone."""
    about = store.about(path)
    return 0 if about is None else about.modified


@lru_cache(maxsize=8192)
def _remembered(path: Path, modified: int) -> Stored:
    """What is in a file as it was at one time."""
    return store.read(path)


@lru_cache(maxsize=65536)
def _facts(path: Path, modified: int) -> Facts:
    """The facts of a repeat as its file was at one time."""
    trace = _stored(path).trace
    start, finish = trace.start, trace.finish
    # Doubling all speeds changes no rounding, so that the quotients stay the same to the bit.
    speed = float(np.sqrt(np.max(np.sum(start.velocities**2, axis=1)))) or 1.0
    numbers = np.array([trace.stop.time * speed, trace.wall_events, trace.pair_events])
    parts = (start.positions, start.velocities / speed, finish.positions, finish.velocities / speed)
    motion = b"".join(np.ascontiguousarray(part).tobytes() for part in (*parts, numbers))
    return Facts(trace.stop.reason, trace.collisions, motion)
