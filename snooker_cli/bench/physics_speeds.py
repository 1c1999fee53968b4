"""Speeds of few balls at fixed energy, beside the Beta law, which is exact for them.

In a box, which conserves energy alone, v²/(N⟨v²⟩) has the law Beta(1, N − 1); in a periodic box
without momentum that of N − 1 balls. A circle conserves angular momentum too, so that there the law
holds on average over that only. Speeds are read at fixed times, at least ``APART`` collisions of a
ball apart. Those of one time share one energy and are not independent: what chance makes of χ² is
found by drawing whole sets of velocities from the exact law.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.bench.physics_gas import Gas, means, over_seeds
from snooker_cli.bench.physics_rows import EXACT, Row
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Series, Summary

    Array = NDArray[np.float64]

SPEEDS = "speeds at fixed energy"

BETA = "Beta law, exact"

APART = 5.0
"""Collisions of a ball between two readings; ⟨v⁴⟩ has by then forgotten nine tenths."""

LEAST_SHARE = 2e-3
"""Of the balls in a bin of χ², faster ones being in the last; so that no bin is nearly empty."""

DRAWS, DRAWN_TIMES = 300, 200
"""Values of χ² that are drawn, each of so many readings: its law does not depend on how many."""


def rows(gas: Gas) -> list[Row]:
    """Mean speed, kurtosis and χ² of the speeds of a gas."""
    temperature = gas.scene(0).kinetic_energy / gas.balls
    found = over_seeds(gas, partial(speeds, gas))
    (speed, speed_error), (kurtosis, kurtosis_error) = means(found[:, :2])
    counts = found[:, 2:].sum(axis=0)
    shares = expected_shares(gas.free, temperature)
    drawn = np.array([chi_square(each, shares) for each in drawn_counts(gas)])
    bins = len(shares)
    times = round(float(counts.sum()) / gas.balls)
    row = partial(
        Row, group=SPEEDS, setting=gas.setting(), expected_error=0.0, whose=EXACT, source=BETA
    )
    read = f"read at {times:,} times, {APART:g} collisions of a ball apart or more"
    return [
        row(
            quantity="mean speed, m/s",
            measured=speed,
            error=speed_error,
            expected=theory.fixed_energy_mean_speed(gas.free, temperature),
            note=read,
        ),
        row(
            quantity="⟨v⁴⟩/⟨v²⟩²",
            measured=kurtosis,
            error=kurtosis_error,
            expected=theory.fixed_energy_kurtosis(gas.free),
        ),
        row(
            quantity=f"χ² of {bins} bins",
            measured=chi_square(counts, shares),
            error=float(np.std(drawn, ddof=1)),
            expected=float(np.mean(drawn)),
            note=f"± is its spread in {DRAWS} draws from that law",
        ),
    ]


def speeds(gas: Gas, _: Scene, summary: Summary) -> tuple[float, ...]:
    """Mean speed and kurtosis over the readings of a repeat, and balls by reduced speed."""
    series, readings = summary.series, reading_rows(gas, summary.series)
    return (
        float(np.mean(series.mean_speed[readings])),
        float(np.mean(series.energy_moment[readings])),
        *summary.speed_histogram[readings].sum(axis=0).tolist(),
    )


def reading_rows(gas: Gas, series: Series) -> NDArray[np.intp]:
    """Rows of the even grid once a repeat has settled, so many apart that balls have collided.

    By the mean rate. The last row, which is off the grid, is not among them.
    """
    first = int(np.searchsorted(series.pair_events, gas.settling_events))
    rows = np.arange(first, len(series.time) - 1)
    collisions = 2 * (series.pair_events[rows[-1]] - series.pair_events[first]) / gas.balls
    return rows[:: max(1, math.ceil(APART * (len(rows) - 1) / collisions))]


def expected_shares(free: int, temperature: float) -> Array:
    """Shares of balls in the bins of reduced speed by the exact law, the fast ones merged."""
    edges = math.sqrt(2 * temperature) * SPEED_BIN * np.arange(SPEED_BINS, dtype=np.float64)
    above = 1.0 - theory.fixed_energy_speed_cdf(edges, free, temperature)
    kept = above[above >= LEAST_SHARE]
    return np.append(-np.diff(kept), kept[-1])


def chi_square(counts: Array, shares: Array) -> float:
    """χ² of counts by reduced speed against shares whose last bin has all faster ones."""
    last = len(shares) - 1
    merged = np.append(counts[:last], counts[last:].sum())
    expected = merged.sum() * shares
    return float(np.sum((merged - expected) ** 2 / expected))


def drawn_counts(gas: Gas) -> Array:
    """Balls by reduced speed, as chance makes them in some readings; a row each."""
    generator = np.random.default_rng(1)
    found = []
    for _ in range(DRAWS):
        velocities = generator.normal(size=(DRAWN_TIMES, gas.balls, 2))
        if gas.shape == "periodic":
            velocities -= velocities.mean(axis=1, keepdims=True)
        squares = np.sum(velocities**2, axis=2)
        reduced = np.sqrt(squares / squares.mean(axis=1, keepdims=True))
        bins = np.minimum((reduced / SPEED_BIN).astype(int), SPEED_BINS - 1)
        found.append(np.bincount(bins.ravel(), minlength=SPEED_BINS))
    return np.array(found)
