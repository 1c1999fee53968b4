"""Random numbers with the same bits on every machine: places, directions, Maxwell's velocities.

NumPy guarantees the raw 64-bit output of PCG64. From it all follows by +, -, *, / and square roots,
which every machine rounds correctly. The library's sin, cos and log are not used: they differ.
"""

import math
from collections.abc import Sequence

import numpy as np

from snooker_cli.neighbours import Floats, Indices

PLACES, MAXWELL, WALL, SPIN = 1, 2, 3, 4  # streams of a repeat besides that of its directions

LOG_2 = 0.6931471805599453
TERMS = 11  # terms of the logarithm's series; the next is below 2e-19 of the first for |z| < 0.1716


def stream(seed: int, repeat: int, *purpose: int) -> np.random.PCG64:
    """The random bits of a repeat for a purpose."""
    return np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(repeat, *purpose)))


def wall_key(seed: int, repeat: int) -> int:
    """The key of the random numbers of a repeat's thermal wall, below 2^63."""
    return int(stream(seed, repeat, WALL).random_raw()) >> 1


def random_directions(number: int, seed: int, repeats: Sequence[int]) -> Floats:
    """Random unit vectors, (*repeats*, *number*, 2): points of an annulus, normalised."""
    streams = [stream(seed, repeat) for repeat in repeats]
    inside = points_in_disc(streams, number, 0.0625)
    return np.asarray(inside / np.sqrt(inside[..., :1] ** 2 + inside[..., 1:] ** 2))


def random_normals(
    number: int, seed: int, repeats: Sequence[int], purpose: int = MAXWELL
) -> Floats:
    """Pairs of independent normal deviates of variance 1, (*repeats*, *number*, 2).

    Marsaglia's polar method: doi:10.1137/1006063.
    """
    streams = [stream(seed, repeat, purpose) for repeat in repeats]
    inside = points_in_disc(streams, number, 0.0)
    squares = inside[..., 0] ** 2 + inside[..., 1] ** 2
    return np.asarray(inside * np.sqrt(-2.0 * logarithm(squares) / squares)[..., None])


def points_in_disc(streams: Sequence[np.random.PCG64], number: int, least: float) -> Floats:
    """Uniform points of the unit disk from each stream, (*streams*, *number*, 2).

    least : their squared radius is larger
    """
    chosen = np.empty((len(streams), number, 2))
    points = 2.0 * uniforms(streams, number + number // 2 + 8) - 1.0
    squares = points[..., 0] ** 2 + points[..., 1] ** 2
    inside = (squares > least) & (squares <= 1.0)
    numbers = np.cumsum(inside, axis=1)
    enough = numbers[:, -1] >= number
    chosen[enough] = points[inside & (numbers <= number) & enough[:, None]].reshape(-1, number, 2)
    for k in np.flatnonzero(~enough).tolist():
        first = points[k, inside[k]]
        rest = points_in_disc([streams[k]], number - len(first), least)[0]
        chosen[k] = np.concatenate([first, rest])
    return chosen


def uniforms(streams: Sequence[np.random.PCG64], number: int) -> Floats:
    """Uniform points of the unit square, (*streams*, *number*, 2), in multiples of 2^-53."""
    raw = np.stack([bits.random_raw(2 * number) for bits in streams])
    points = (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return np.asarray(points).reshape(len(streams), number, 2)


def shuffled(generator: np.random.PCG64, number: int) -> Indices:
    """The whole numbers below ``number`` in random order."""
    return np.argsort(generator.random_raw(number), kind="stable")


def logarithm(values: Floats) -> Floats:
    """Natural logarithm to a few units in the last place, the same bits on every machine.

    ln(m 2^k) = k ln 2 + 2 (z + z^3/3 + z^5/5 + ...) with z = (m - 1)/(m + 1).
    """
    mantissa, exponent = np.frexp(values)
    low = mantissa < math.sqrt(0.5)
    mantissa, exponent = np.where(low, 2.0 * mantissa, mantissa), exponent - low
    z = (mantissa - 1.0) / (mantissa + 1.0)
    square = z * z
    series = np.full_like(z, 1.0 / (2 * TERMS + 1))
    for odd in range(2 * TERMS - 1, 0, -2):
        series = series * square + 1.0 / odd
    return np.asarray(exponent * LOG_2 + 2.0 * z * series)
