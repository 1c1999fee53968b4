"""Laws of walls that are more than a ``kick``: sides that differ, and a wall with a temperature.

Kernels have these classes in place of those of the same laws in ``laws``.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.collision import hit_side
from snooker_cli.engine.jit import helper, inlined
from snooker_cli.engine.kernel_state import KEY, PAIR_EVENTS, WALL_EVENTS, State, U, V, X, Y


class SideLaws(NamedTuple):
    """The law of each straight wall, see ``laws.Sides``."""

    left: Any
    right: Any
    bottom: Any
    top: Any

    def may_stay(self) -> bool:
        return False

    def hit_side(self, i: int, across: bool, state: State, elastic: bool) -> float:
        if across:
            if state.balls[U, i] > 0.0:
                return hit_side(self.right, i, across, state, elastic)
            return hit_side(self.left, i, across, state, elastic)
        if state.balls[V, i] > 0.0:
            return hit_side(self.top, i, across, state, elastic)
        return hit_side(self.bottom, i, across, state, elastic)


class ThermalWall(NamedTuple):
    """A wall with a temperature, J, see ``laws.Thermal``."""

    temperature: float

    def may_stay(self) -> bool:
        return False

    def hit_circle(self, i: int, state: State, _elastic: bool) -> float:
        return leave(i, state.balls[X, i], state.balls[Y, i], self.temperature, state)

    def hit_side(self, i: int, across: bool, state: State, _elastic: bool) -> float:
        x = math.copysign(1.0, state.balls[U, i]) if across else 0.0
        y = 0.0 if across else math.copysign(1.0, state.balls[V, i])
        return leave(i, x, y, self.temperature, state)


@helper
def leave(i: int, x: float, y: float, temperature: float, state: State) -> float:
    """Give ball i a random velocity away from a wall towards (x, y); its impulse, kg m/s.

    Maxwell's law of the flux: the normal speed is sqrt(-2 (T/m) ln u), the tangential one normal
    with variance T/m. Both numbers follow from the key of the repeat and the number of the event.
    """
    balls, counts, m = state.balls, state.counts, ks.mass_of(state.sizes, i)
    event = np.uint64(counts[WALL_EVENTS] + counts[PAIR_EVENTS])
    seed = mixed(np.uint64(counts[KEY]) + mixed(event))
    spread = math.sqrt(temperature / m)
    inwards = spread * math.sqrt(-2.0 * logarithm(uniform(seed, 0)))
    # Marsaglia's polar method, doi:10.1137/1006063.
    across, square, tried = 0.0, 0.0, 0
    while not 0.0 < square <= 1.0:
        across = 2.0 * uniform(seed, 2 * tried + 1) - 1.0
        up = 2.0 * uniform(seed, 2 * tried + 2) - 1.0
        square = across * across + up * up
        tried += 1
    along = spread * (across * math.sqrt(-2.0 * logarithm(square) / square))
    length = math.sqrt(x * x + y * y)
    x, y = x / length, y / length
    outwards = balls[U, i] * x + balls[V, i] * y
    balls[U, i] = -inwards * x - along * y
    balls[V, i] = -inwards * y + along * x
    return float(m * max(outwards + inwards, 0.0))


# Random numbers from a counter: the same bits in any order, engine, chunk or replay


@inlined
def mixed(bits: np.uint64) -> np.uint64:
    """SplitMix64 of 64 bits (Steele, Lea & Flood, doi:10.1145/2714064.2660195)."""
    z = bits + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@inlined
def uniform(seed: np.uint64, place: int) -> float:
    """The number at a place of a sequence, from 2^-53 to 1."""
    bits = mixed(seed + np.uint64(place)) >> np.uint64(11)
    return (float(bits) + 1.0) * 2.0**-53


@helper
def logarithm(value: float) -> float:
    """Natural logarithm of a number from 2^-106 to 1; as ``placement.random_numbers``."""
    exponent = 0
    while value < 2.0**-32:
        value *= 2.0**32
        exponent -= 32
    while value < 0.7071067811865476:
        value *= 2.0
        exponent -= 1
    z = (value - 1.0) / (value + 1.0)
    square = z * z
    series = 1.0 / 23.0
    for odd in range(21, 0, -2):
        series = series * square + 1.0 / odd
    return exponent * 0.6931471805599453 + 2.0 * z * series
