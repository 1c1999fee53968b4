"""States of a trace -> momentum, distances and speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.engine import States, replay
from snooker_cli.observables.course import gained, series
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

    Array = NDArray[np.float64]

MOST_BALLS = 2**22
"""Balls times states that are held at once, some hundred megabytes."""


def at_collisions(trace: Trace, most: int = 2000) -> States:
    """The states at time zero and after each collision; evenly thinned to at most ``most``.

    Of many balls to fewer, so that they fit in memory. Raises ``ValueError`` if the trace has no
    events.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no states to show")
    most = max(2, min(most, MOST_BALLS // trace.start.number))
    rows = np.unique(np.linspace(0, len(trace.events), most).astype(int))
    if len(trace.events) < most:
        rows = np.arange(len(trace.events) + 1)
    return replay(trace, np.concatenate([[0.0], trace.events.time])[rows])


def momentum(states: States, scene: Scene) -> Array:
    """Total momentum of balls and container, from the states; (*t*, 2), kg m/s.

    A fixed container's momentum is not a number, and is left out; a periodic box has none.
    """
    total = np.einsum("tic,i->tc", states.velocities, scene.masses)
    if scene.free:
        total = total + scene.container_mass * states.container_velocities
    return np.asarray(total)


def central_distances(states: States) -> Array:
    """Distances of the balls from the container's centre; (*t* *N*,), m."""
    offsets = states.positions - states.container_positions[:, None]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def pair_distances(states: States, scene: Scene) -> Array:
    """Distances of the centres of all pairs of balls; (*t* *N*(*N*-1)/2,), m.

    In a periodic box they are those of the nearest images.
    """
    first, second = np.triu_indices(states.positions.shape[1], k=1)
    offsets = states.positions[:, first] - states.positions[:, second]
    if scene.shape == "periodic":
        offsets -= scene.size * np.rint(offsets / scene.size)
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def sampling_times(trace: Trace, collisions_between: float = 5.0, since: float = 0.0) -> Array:
    """Fixed times, apart by some collisions a ball, at which speeds are nearly independent.

    They count from ``since`` (s), which is not among them: there is none before balls have met so
    often. Never at events: those are biased towards fast balls.
    """
    length, pairs = trace.stop.time - since, float(trace.pair_events)
    if since > 0:
        pairs = gained(trace, series(trace).pair_events, since)
    if not (pairs > 0 and length > 0):
        return np.empty(0)
    interval = length * (collisions_between * trace.start.number / 2) / pairs
    times = since + np.arange(1, int(length / interval) + 1, dtype=np.float64) * interval
    return np.asarray(np.minimum(times, trace.stop.time))


def speeds(trace: Trace, times: Array) -> Array:
    """Speeds of all balls at given times; (*t*, *N*), m/s."""
    velocities = replay(trace, times).velocities
    return np.asarray(np.hypot(velocities[..., 0], velocities[..., 1]))


def reduced_speed_counts(trace: Trace, since: float = 0.0) -> NDArray[np.int64]:
    """Balls by reduced speed v sqrt(m/2T), over the sampling times, in bins of ``SPEED_BIN``."""
    times = sampling_times(trace, since=since)
    if trace.summary is not None:
        rows = np.searchsorted(trace.summary.series.time, times, side="right") - 1
        return np.asarray(trace.summary.speed_histogram[np.unique(rows)].sum(axis=0))
    velocities = replay(trace, times).velocities
    energies = 0.5 * trace.start.masses * np.sum(velocities**2, axis=2)
    means = energies.mean(axis=1, keepdims=True)
    reduced = np.sqrt(energies / np.where(means > 0, means, 1.0))
    bins = np.minimum((reduced / SPEED_BIN).astype(int), SPEED_BINS - 1)
    return np.bincount(bins.ravel(), minlength=SPEED_BINS)
