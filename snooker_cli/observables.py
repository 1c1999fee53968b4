"""A trace -> temperature, pressure, momentum, distances and speeds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.engine import States, replay, series
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Series, Trace

    Array = NDArray[np.float64]

__all__ = [
    "at_collisions",
    "central_distances",
    "cumulative_pressure",
    "energy_ratio",
    "momentum",
    "over_first",
    "pair_distances",
    "reduced_speed_counts",
    "sampling_times",
    "series",
    "speeds",
    "temperature",
    "time_mean",
    "window_pressure",
]


def temperature(found: Series, number: int) -> Array:
    """Temperature by equipartition in two dimensions, T = <KE>, J (k_B = 1)."""
    return found.kinetic_energy / number


def energy_ratio(found: Series) -> Array:
    """Kinetic energy of balls and container over that at the start; nan if all was at rest."""
    return over_first(found.kinetic_energy + found.container_energy)


def over_first(values: Array) -> Array:
    """Values over the first of them; nan if that is zero."""
    return np.asarray(values / (values[0] if values[0] > 0 else np.nan))


def cumulative_pressure(found: Series, container_radius: float) -> tuple[Array, Array]:
    """Times and the wall's mean pressure since the start, sum J / (2 pi R t), Pa m.

    Time zero, where it is not defined, is left out.
    """
    later = found.time > 0
    time = found.time[later]
    return time, found.wall_impulse[later] / (2 * math.pi * container_radius * time)


def window_pressure(
    found: Series, container_radius: float, windows: int, end: float
) -> tuple[Array, Array]:
    """Middles and pressures of equal windows of time between 0 and ``end``; s and Pa m."""
    if end <= 0:
        return np.empty(0), np.empty(0)
    edges = np.linspace(0.0, end, windows + 1)
    # The impulse is a staircase: at an edge it is that of the last row at or before it.
    rows = np.searchsorted(found.time, edges, side="right") - 1
    impulse = np.diff(found.wall_impulse[rows])
    width = end / windows
    return (edges[:-1] + edges[1:]) / 2, impulse / (2 * math.pi * container_radius * width)


def time_mean(time: Array, values: Array, end: float) -> float:
    """Mean over time up to ``end`` of what stays as it is between its times."""
    if end <= time[0]:
        return float(values[-1])
    return float(np.sum(values * np.diff(np.append(time, end))) / (end - time[0]))


def at_collisions(trace: Trace, most: int = 2000) -> States:
    """The states at time zero and after each collision; evenly thinned to at most ``most``.

    Raises ``ValueError`` if the trace has no events.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no states to show")
    rows = np.unique(np.linspace(0, len(trace.events), most).astype(int))
    if len(trace.events) < most:
        rows = np.arange(len(trace.events) + 1)
    return replay(trace, np.concatenate([[0.0], trace.events.time])[rows])


def momentum(states: States, scene: Scene) -> Array:
    """Total momentum of balls and container, from the states; (*t*, 2), kg m/s.

    A fixed container's momentum is not a number, and is left out.
    """
    total = np.einsum("tic,i->tc", states.velocities, scene.masses)
    if scene.free:
        total = total + scene.container_mass * states.container_velocities
    return np.asarray(total)


def central_distances(states: States) -> Array:
    """Distances of the balls from the container's centre; (*t* *N*,), m."""
    offsets = states.positions - states.container_positions[:, None]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def pair_distances(states: States) -> Array:
    """Distances of the centres of all pairs of balls; (*t* *N*(*N*-1)/2,), m."""
    first, second = np.triu_indices(states.positions.shape[1], k=1)
    offsets = states.positions[:, first] - states.positions[:, second]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def sampling_times(trace: Trace, collisions_between: float = 5.0) -> Array:
    """Fixed times, apart by some collisions a ball, at which speeds are nearly independent.

    Never at events: those are biased towards fast balls.
    """
    interval = trace.stop.time
    if trace.pair_events > 0:
        between = collisions_between * trace.start.number / 2
        interval = trace.stop.time * between / trace.pair_events
    samples = int(trace.stop.time / interval) if interval > 0 else 0
    times = np.arange(1, samples + 1, dtype=np.float64) * interval
    return np.asarray(np.minimum(times, trace.stop.time))


def speeds(trace: Trace, times: Array) -> Array:
    """Speeds of all balls at given times; (*t*, *N*), m/s."""
    velocities = replay(trace, times).velocities
    return np.asarray(np.hypot(velocities[..., 0], velocities[..., 1]))


def reduced_speed_counts(trace: Trace) -> NDArray[np.int64]:
    """Balls by reduced speed v sqrt(m/2T), over the sampling times, in bins of ``SPEED_BIN``."""
    if trace.summary is not None:
        found = trace.summary.series
        times = sampling_times(trace)
        rows = np.searchsorted(found.time, times, side="right") - 1
        return np.asarray(trace.summary.speed_histogram[np.unique(rows)].sum(axis=0))
    velocities = replay(trace, sampling_times(trace)).velocities
    energies = 0.5 * trace.start.masses * np.sum(velocities**2, axis=2)
    means = energies.mean(axis=1, keepdims=True)
    reduced = np.sqrt(energies / np.where(means > 0, means, 1.0))
    bins = np.minimum((reduced / SPEED_BIN).astype(int), SPEED_BINS - 1)
    return np.bincount(bins.ravel(), minlength=SPEED_BINS)
