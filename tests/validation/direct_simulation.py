"""Direct simulation Monte Carlo (Bird 1994) of the homogeneous cooling state of inelastic disks.

`python tests/validation/direct_simulation.py` prints a2 of the coefficients of restitution that
`snooker bench physics` measures, with 16 million particles in all; it takes some minutes.
"""

from __future__ import annotations

import math
import sys

import numba
import numpy as np


@numba.njit
def a2_of_one(
    rng: np.random.Generator, number: int, restitution: float, settling: int, measuring: int
) -> float:
    """Mean of ⟨v⁴⟩/(2⟨v²⟩²) − 1 over times one collision per particle apart, after settling.

    Random pairs with a random direction collide with a probability proportional to their relative
    normal speed. After each collision per particle the mean velocity is set to 0 and T to 1.
    """
    velocities = rng.normal(0.0, 1.0, (number, 2))
    total = 0.0
    for step in range(settling + measuring):
        fastest, done = 6.0, 0
        while 2 * done < number:
            i, j = int(number * rng.random()), int(number * rng.random())
            angle = 2 * math.pi * rng.random()
            x, y = math.cos(angle), math.sin(angle)
            normal = (velocities[i, 0] - velocities[j, 0]) * x
            normal += (velocities[i, 1] - velocities[j, 1]) * y
            fastest = max(fastest, normal)
            if i == j or normal <= rng.random() * fastest:
                continue
            push = (1 + restitution) / 2 * normal
            velocities[i, 0] -= push * x
            velocities[i, 1] -= push * y
            velocities[j, 0] += push * x
            velocities[j, 1] += push * y
            done += 1
        velocities[:, 0] -= velocities[:, 0].mean()
        velocities[:, 1] -= velocities[:, 1].mean()
        squares = velocities[:, 0] ** 2 + velocities[:, 1] ** 2
        if step >= settling:
            total += np.mean(squares**2) / (2 * np.mean(squares) ** 2) - 1
        velocities *= math.sqrt(2 / np.mean(squares))
    return total / measuring


def a2(restitution: float, number: int, seeds: int) -> tuple[float, float]:
    """a2 and its standard error over seeds."""
    rngs = map(np.random.default_rng, range(seeds))
    found = [a2_of_one(rng, number, restitution, 30, 40) for rng in rngs]
    return float(np.mean(found)), float(np.std(found, ddof=1)) / math.sqrt(seeds)


if __name__ == "__main__":
    for cor in map(float, sys.argv[1:] or ("0.5", "0.6", "0.7", "0.8", "0.9", "0.95")):
        print(f"{cor:g}: {a2(cor, 100_000, 16)}", flush=True)
