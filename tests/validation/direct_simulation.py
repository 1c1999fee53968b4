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

from snooker_cli.validation import spinning_gases

A2, RATIO, SPIN_KURTOSIS, CORRELATION = range(4)

ROUGH_MOMENTS = {
    -0.9: (0.60026, 0.06759),
    -0.5: (0.14658, 0.05085),
    0.0: (0.11339, 0.10150),
    0.5: (0.07395, 0.04407),
    0.9: (0.00422, -0.03286),
}
"""Excess kurtosis of spins over that of Maxwell's law, and correlation of squares, at CoR 0.9
by tangential CoR; errors below 0.006."""


@numba.njit
def collide(
    rng: np.random.Generator,
    velocities: NDArray[np.float64],
    spins: NDArray[np.float64],
    collisions: float,
    restitution: float,
    tangential: float,
    inertia: float,
) -> None:
    """Carry out numbers of collisions of a particle; spins are those times the radius, m/s.

    Random pairs with a random direction collide with a probability proportional to their relative
    normal speed.
    """
    number, fastest, done = len(spins), 6.0, 0
    while 2 * done < collisions * number:
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

    After each collision per particle the mean velocity is set to 0 and T_tr to 1.
    """
    velocities = rng.normal(0.0, 1.0, (number, 2))
    spins = np.zeros(number)
    if tangential > -1.0:
        spins = rng.normal(0.0, 1.0, number)
    totals = np.zeros(4)
    for step in range(settling + measuring):
        collide(rng, velocities, spins, 1.0, restitution, tangential, inertia)
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


@numba.njit
def temperatures_of_one(
    rng: np.random.Generator,
    number: int,
    restitution: float,
    tangential: float,
    inertia: float,
    collisions: float,
) -> NDArray[np.float64]:
    """T_tr and T_rot over T_tr at the start, where no particle spins, after collisions; (2,)."""
    velocities, spins = rng.normal(0.0, 1.0, (number, 2)), np.zeros(number)
    first, left, cooled = np.mean(velocities**2), collisions, 1.0
    while left > 0.0:
        collide(rng, velocities, spins, min(left, 1.0), restitution, tangential, inertia)
        left -= 1.0
        factor = math.sqrt(first / np.mean(velocities**2))
        velocities *= factor
        spins *= factor
        cooled /= factor * factor
    return cooled * np.array([1.0, inertia * np.mean(spins**2) / first])


def moments(
    restitution: float, tangential: float, number: int, seeds: int, settling: int = 30
) -> NDArray[np.float64]:
    """`moments_of_one` of uniform disks and their standard errors over seeds; (2, 4)."""
    settings = number, restitution, tangential, 0.5, settling, 40
    rngs = map(np.random.default_rng, range(seeds))
    return over_seeds([moments_of_one(rng, *settings) for rng in rngs])


def temperatures(
    restitution: float, tangential: float, collisions: float, number: int, seeds: int
) -> NDArray[np.float64]:
    """`temperatures_of_one` of uniform disks and their standard errors over seeds; (2, 2)."""
    settings = number, restitution, tangential, 0.5, collisions
    rngs = map(np.random.default_rng, range(seeds))
    return over_seeds([temperatures_of_one(rng, *settings) for rng in rngs])


def over_seeds(values: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Means and standard errors."""
    found = np.array(values)
    return np.array([found.mean(axis=0), found.std(axis=0, ddof=1) / math.sqrt(len(found))])


def a2(restitution: float, number: int, seeds: int) -> tuple[float, float]:
    """a2 of smooth disks and its standard error over seeds."""
    mean, error = moments(restitution, -1.0, number, seeds)[:, A2].tolist()
    return mean, error


if __name__ == "__main__":
    for cor in (0.5, 0.6, 0.7, 0.8, 0.9, 0.95):
        print(f"CoR {cor:g}: {a2(cor, 100_000, 16)}", flush=True)
    for beta in (-0.9, -0.5, 0.0, 0.5, 0.9):
        # The ratio relaxes slowly where few spins change.
        found = moments(0.9, beta, 100_000, 16, 300 if beta < -0.8 else 100)
        print(f"CoR 0.9, tangential CoR {beta:g}:", flush=True)
        collisions = spinning_gases.cooled_after(0.9, beta)
        ends = temperatures(0.9, beta, collisions, 100_000, 16)
        names = (
            "a2",
            "T_rot/T_tr",
            "excess kurtosis of spins",
            "correlation of squares",
            "T_tr",
            "T_rot",
        )
        rows = np.hstack([found, ends]).T.tolist()
        for name, (value, error) in zip(names, rows, strict=True):
            print(f"  {name}: {value:.6f} ± {error:.6f}", flush=True)
