"""Direct simulation Monte Carlo (Bird 1994) of the homogeneous cooling state of inelastic disks.

`python tests/validation/direct_simulation.py` prints a2 of the coefficients of restitution that
`snooker bench physics` measures, and T_rot/T_tr of rough disks, with 16 times 100,000 particles; it
takes some minutes.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

A2, RATIO, SPIN_KURTOSIS, CORRELATION = range(4)


@numba.njit
def moments_of_one(
    rng: np.random.Generator,
    number: int,
    restitution: float,
    tangential: float,
    inertia: float,
    settling: int,
    measuring: int,
) -> NDArray[np.float64]:
    """Means over times one collision per particle apart, after settling; (4,).

    ⟨v⁴⟩/(2⟨v²⟩²) − 1; for rough disks also T_rot/T_tr, ⟨ω⁴⟩/(3⟨ω²⟩²) − 1 and
    ⟨v²ω²⟩/(⟨v²⟩⟨ω²⟩) − 1.

    Random pairs with a random direction collide with a probability proportional to their relative
    normal speed. After each collision per particle the mean velocity is set to 0 and T_tr to 1.
    Spins are those times the radius, of disks of 1 kg.
    """
    velocities = rng.normal(0.0, 1.0, (number, 2))
    spins = np.zeros(number)
    if tangential > -1.0:
        spins = rng.normal(0.0, 1.0, number)
    totals = np.zeros(4)
    for step in range(settling + measuring):
        fastest, done = 6.0, 0
        while 2 * done < number:
            i, j = int(number * rng.random()), int(number * rng.random())
            angle = 2 * math.pi * rng.random()
            x, y = math.cos(angle), math.sin(angle)
            u = velocities[i, 0] - velocities[j, 0]
            v = velocities[i, 1] - velocities[j, 1]
            normal = u * x + v * y
            fastest = max(fastest, normal)
            if i == j or normal <= rng.random() * fastest:
                continue
            push = (1 + restitution) / 2 * normal
            slip = v * x - u * y + spins[i] + spins[j]
            rub = inertia / (1 + inertia) * (1 + tangential) / 2 * slip
            velocities[i, 0] -= push * x - rub * y
            velocities[i, 1] -= push * y + rub * x
            velocities[j, 0] += push * x - rub * y
            velocities[j, 1] += push * y + rub * x
            spins[i] -= rub / inertia
            spins[j] -= rub / inertia
            done += 1
        velocities[:, 0] -= velocities[:, 0].mean()
        velocities[:, 1] -= velocities[:, 1].mean()
        squares, turning = velocities[:, 0] ** 2 + velocities[:, 1] ** 2, spins**2
        moving, warm = np.mean(squares), np.mean(turning)
        if step >= settling:
            totals[A2] += np.mean(squares**2) / (2 * moving**2) - 1
            if warm > 0.0:
                totals[RATIO] += 2 * inertia * warm / moving
                totals[SPIN_KURTOSIS] += np.mean(turning**2) / (3 * warm**2) - 1
                totals[CORRELATION] += np.mean(squares * turning) / (moving * warm) - 1
        factor = math.sqrt(2 / moving)
        velocities *= factor
        spins *= factor
    return totals / measuring


def moments(
    restitution: float, tangential: float, number: int, seeds: int, settling: int = 30
) -> NDArray[np.float64]:
    """`moments_of_one` of uniform disks and their standard errors over seeds; (2, 4)."""
    rngs = map(np.random.default_rng, range(seeds))
    settings = number, restitution, tangential, 0.5, settling, 40
    found = np.array([moments_of_one(rng, *settings) for rng in rngs])
    return np.array([found.mean(axis=0), found.std(axis=0, ddof=1) / math.sqrt(seeds)])


def a2(restitution: float, number: int, seeds: int) -> tuple[float, float]:
    """a2 of smooth disks and its standard error over seeds."""
    mean, error = moments(restitution, -1.0, number, seeds)[:, A2].tolist()
    return mean, error


if __name__ == "__main__":
    for cor in (0.5, 0.6, 0.7, 0.8, 0.9, 0.95):
        print(f"CoR {cor:g}: {a2(cor, 100_000, 16)}", flush=True)
    for beta in (-0.9, -0.5, 0.0, 0.5, 0.9):
        # The ratio relaxes slowly where few spins change.
        values, errors = moments(0.9, beta, 100_000, 16, 300 if beta < -0.8 else 100)
        print(f"CoR 0.9, tangential CoR {beta:g}:", flush=True)
        names = "a2", "T_rot/T_tr", "kurtosis of spins", "correlation of squares"
        for name, value, error in zip(names, values, errors, strict=True):
            print(f"  {name}: {value:.5f} ± {error:.5f}", flush=True)
