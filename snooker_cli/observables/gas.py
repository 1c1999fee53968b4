"""A trace -> energy, temperature and pressure, over time and as means.

The pressure is the force on the wall over its length. A periodic box has no wall: there it follows
from Clausius's virial theorem. Σ m x·v of all balls changes by 2 E_kin + Σ x·F a second, over a
long time by nothing on average. Of the forces, collisions of two balls give Σ J d/t, with their
impulses J in a time t at centres d apart, and what holds the balls in an area V gives −2 P V in two
dimensions. So::

    P V = N <T> + Σ J d/(2 t)        <T> = mean kinetic energy of a ball

The right side over N <T> needs no wall and is offered for every shape as `virial_ratio`. In a
circle or a box it is less than P V/(N T) of the wall, which the centres do not reach: a fixed
circle's is a/R of it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from snooker_cli.observables.course import (
    gained,
    integrals,
    series,
    so_far,
    time_mean,
    time_means,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Series, Trace

    Array = NDArray[np.float64]

Real = TypeVar("Real", float, "NDArray[np.float64]")

ROUNDING = 1e-12
"""Relative spread below which repeats differ by nothing but rounding."""


def temperature(found: Series, number: int) -> Array:
    """Temperature by equipartition in two dimensions, T = <KE>, J (k_B = 1)."""
    return found.kinetic_energy / number


def drift_energy(scene: Scene) -> float:
    """Kinetic energy of the balls' centre of mass, p^2/(2 sum m), J; a periodic box keeps it."""
    momentum = scene.masses @ scene.velocities
    return float(momentum @ momentum / (2 * np.sum(scene.masses)))


def meeting_temperature(kinetic_energy: Real, scene: Scene) -> Real:
    """Temperature at which balls meet each other, J.

    In a periodic box the centre of mass keeps its motion, and the rest of the kinetic energy is
    that of N - 1 free velocities; with walls it is `temperature`.
    """
    if scene.shape != "periodic" or scene.number == 1:
        return kinetic_energy / scene.number
    return (kinetic_energy - drift_energy(scene)) / (scene.number - 1)


def energy_ratio(found: Series) -> Array:
    """Kinetic energy of balls and container over that at the start; 0 if all is at rest."""
    return over_first(found.kinetic_energy + found.container_energy)


def over_first(values: Array) -> Array:
    """Values over the first of them that is not zero; as they are if all of them are."""
    positive = values[values > 0]
    return np.asarray(values / positive[0] if len(positive) else values)


def equal_balls(scene: Scene) -> bool:
    """Whether all balls have one radius and one mass, as the theories want."""
    return bool(np.all(scene.radii == scene.radii[0]) and np.all(scene.masses == scene.masses[0]))


def elastic(scene: Scene) -> bool:
    """Whether no collision loses energy; a periodic box has none with a wall."""
    walls = scene.shape == "periodic" or scene.wall_restitution == 1.0
    return scene.restitution == 1.0 and walls


def mean_and_error(values: Array) -> tuple[float, float]:
    """Mean over repeats and its standard error.

    The error is nan for fewer than two of them, and if they differ by rounding alone: that is no
    measure of their spread.
    """
    mean = float(values.mean())
    deviation = float(values.std(ddof=1)) if len(values) > 1 else 0.0
    if deviation <= ROUNDING * abs(mean):
        return mean, math.nan
    return mean, deviation / math.sqrt(len(values))


def cumulative_pressure(trace: Trace, found: Series) -> tuple[Array, Array]:
    """Times and the mean pressure since the start, s and Pa m, at the rows of a series.

    The wall's impulse over its length and the time, or what the virial gives in a periodic box.
    Time zero, where it is not defined, is left out.
    """
    scene, later = trace.start, found.time > 0
    time = found.time[later]
    if scene.shape != "periodic":
        return time, found.wall_impulse[later] / (scene.wall_length * time)
    moving = integrals(trace, series(trace).kinetic_energy, time)
    return time, (moving + found.pair_virial[later] / 2) / (scene.area * time)


def window_pressure(trace: Trace, windows: int) -> tuple[Array, Array]:
    """Middles and pressures of equal windows of time over the whole repeat; s and Pa m."""
    edges = _edges(trace, windows)
    found, scene = series(trace), trace.start
    middles, widths = (edges[:-1] + edges[1:]) / 2, np.diff(edges)
    periodic = scene.shape == "periodic"
    column = found.pair_virial if periodic else found.wall_impulse
    gains = np.diff(so_far(trace, column, edges[1:]), prepend=0.0)
    if not periodic:
        return middles, gains / (scene.wall_length * widths)
    moving = time_means(trace, found.kinetic_energy, edges)
    return middles, (moving + gains / (2 * widths)) / scene.area


def window_energy(trace: Trace, windows: int) -> tuple[Array, Array]:
    """Middles (s) of equal windows of time, and the mean of ``energy_ratio`` in each."""
    edges = _edges(trace, windows)
    middles = (edges[:-1] + edges[1:]) / 2
    return middles, time_means(trace, energy_ratio(series(trace)), edges)


def _edges(trace: Trace, windows: int) -> Array:
    """The edges of equal windows of time, s; none for a repeat without length."""
    end = trace.stop.time
    return np.linspace(0.0, end, windows + 1) if end > 0 else np.empty(0)


def mean_pressure(trace: Trace, since: float = 0.0) -> float:
    """Pressure from a time (s) to the end, Pa m; 0 if there is nothing between.

    That on the wall, or what the virial gives in a periodic box.
    """
    end, scene = trace.stop.time, trace.start
    if not end > since:
        return 0.0
    if scene.shape == "periodic":
        moving = scene.number * mean_temperature(trace, since)
        return (moving + _mean_virial(trace, since) / 2) / scene.area
    impulse = gained(trace, series(trace).wall_impulse, since)
    return impulse / (scene.wall_length * (end - since))


def mean_temperature(trace: Trace, since: float = 0.0) -> float:
    """Temperature from a time (s) to the end, J; nan if there is nothing between."""
    return time_mean(trace, temperature(series(trace), trace.start.number), since)


def ideal_gas_ratio(trace: Trace, since: float = 0.0) -> float:
    """P V / (N T) from a time (s) to the end, with the temperature's mean; 1 for an ideal gas."""
    scene, warm = trace.start, mean_temperature(trace, since)
    if not warm > 0:
        return math.nan
    return mean_pressure(trace, since) * scene.area / (scene.number * warm)


def virial_ratio(trace: Trace, since: float = 0.0) -> float:
    """1 + sum J d / (2 N T t) from a time (s) to the end: Z of the balls, whatever the walls do."""
    moving = trace.start.number * mean_temperature(trace, since)
    return 1 + _mean_virial(trace, since) / (2 * moving) if moving > 0 else math.nan


def _mean_virial(trace: Trace, since: float) -> float:
    """Sum of impulse times distance over pair collisions from a time (s) to the end, per s, J."""
    return gained(trace, series(trace).pair_virial, since) / (trace.stop.time - since)
