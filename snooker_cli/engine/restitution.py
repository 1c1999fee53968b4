"""What a hit does to the normal speed, for each law of collision; and hits of a thermal wall.

A law is data: a row of ``Setup.laws`` with its number and its own numbers, see ``laws``. So
one kernel has all laws, and each hit takes one branch, which the processor foresees.
"""

import math
from collections.abc import Sequence

import numpy as np

from snooker_cli.engine.frames import laboratory_velocity
from snooker_cli.engine.jit import helper, inlined
from snooker_cli.engine.kernel_state import (
    KEY,
    PAIR_EVENTS,
    WALL_EVENTS,
    Floats,
    Setup,
    State,
    U,
    V,
)
from snooker_cli.engine.package_laws import FIRST_KIND, kinds_of
from snooker_cli.laws import Constant, Driven, Law, Thermal, Viscoelastic

# Rows of ``Setup.laws``: the law of two balls, and that of each straight wall. The wall of a circle
# has the first of these.
PAIR, LEFT, RIGHT, BOTTOM, TOP, LAWS = range(6)
WALL = LEFT

# Columns: which law it is; e; its other number: v0 or V, m/s, or T, J.
KIND, COR, SPEED, COLUMNS = range(4)
TEMPERATURE = SPEED

CONSTANT, VISCOELASTIC, DRIVEN, THERMAL = range(4)
KINDS = {
    Constant.name: CONSTANT,
    Viscoelastic.name: VISCOELASTIC,
    Driven.name: DRIVEN,
    Thermal.name: THERMAL,
}
"""The numbers of laws by their names."""

TRAPPING = Constant, Viscoelastic
"""The laws that `bounce_sums` has: with others that lose energy a circle would need other sums."""

ENDLESS = 1 << 20
"""Hits in a row after which a ball with a ``Viscoelastic`` law ends a repeat, trapped or not.

Speeds fall as k^(-4/3) in k hits, and the time that is left only as k^(-1/3).
"""


def laws_of_rows(pair: Law, wall: Law) -> list[Law]:
    """The law of each row of ``Setup.laws``."""
    walls = wall.parts if wall.parts[1:] else [wall] * 4
    return [pair, *walls]


def law_rows(laws: Sequence[Law]) -> Floats:
    """``Setup.laws``, (LAWS, COLUMNS). Those of packages have their numbers elsewhere."""
    kinds = KINDS | kinds_of(laws)
    rows = np.zeros((LAWS, COLUMNS))
    for row, law in zip(rows, laws, strict=True):
        if law.name not in kinds:
            advice = "add it to KINDS and `kick` in engine/restitution.py"
            raise ValueError(f"the engine has no {law.name} law; {advice}")
        row[KIND], row[COR] = kinds[law.name], law.cor
        if law.name in KINDS:
            row[SPEED] = sum(value for key, value in vars(law).items() if key != "cor")
    return rows


@inlined
def kick(which: int, normal: float, length: float, elastic: bool, setup: Setup) -> float:
    """The change of the normal speed in a hit, in the unit of ``normal``.

    which : the row of ``Setup.laws``
    normal : the speed of approach over ``length``; negative only by rounding
    length : m, of the vector along which it is measured; 1 if ``normal`` is a speed, m/s
    elastic : whether a rule of ``collapse`` makes the hit elastic; walls that give energy need none
    """
    law = setup.laws[which]
    kind, factor = law[KIND], 1.0 + law[COR]
    if kind == DRIVEN:
        normal += law[SPEED] / length
    elif elastic:
        factor = 2.0
    elif kind == VISCOELASTIC:
        root = math.sqrt(min(abs(normal) * length / law[SPEED], 1.0))
        factor = 2.0 - (1.0 - law[COR]) * (root * math.sqrt(root))
    elif kind >= FIRST_KIND:
        factor = 1.0 + setup.package_laws.restitution(kind, which, abs(normal) * length)
    return float(factor * normal)


@inlined
def bounce_sums(law: Floats, normal: float, length: float) -> tuple[float, float]:
    """What infinitely many hits of a circle after one with this normal speed add up to, at most.

    Two numbers: the normal speed over the sum of all normal speeds, and the sum of all changes over
    the normal speed. The law is ``CONSTANT`` or ``VISCOELASTIC``: others trap no ball.

    The speeds of the latter add up to at most G(v) = 4 v0/(1 - e) (v/v0)^(1/4), above v0 to
    (v + 3 v0)/(1 - e). G is concave, and its derivative times what a hit takes is v. So a hit
    lowers it by v or more.
    """
    e = law[COR]
    if law[KIND] == CONSTANT:
        return 1.0 - e, (1.0 + e) / (1.0 - e)
    part = normal * length / law[SPEED]
    if part == 0.0:
        return 1.0, 2.0
    root = math.sqrt(min(part, 1.0))
    share = 0.25 * root * math.sqrt(root) if part < 1.0 else part / (3.0 + part)
    loss = (1.0 - e) * share
    return loss, 2.0 / loss


@inlined
def may_stay(law: Floats) -> bool:
    """Whether a ball may stay at the wall of a circle after its first hit."""
    return bool(law[COR] == 0.0)


@inlined
def is_endless(law: Floats, hits: int) -> bool:
    """Whether a repeat ends after this many hits of a ball in a row, trapped or not."""
    return bool(hits >= ENDLESS and law[KIND] == VISCOELASTIC)


# A wall with a temperature


@helper
def leave(i: int, x: float, y: float, temperature: float, state: State) -> float:
    """Give ball i a random velocity away from a wall towards (x, y); its impulse, kg m/s.

    Maxwell's law of the flux: the normal speed is sqrt(-2 (T/m) ln u), the tangential one normal
    with variance T/m. Both numbers follow from the key of the repeat and the number of the event.
    """
    balls, counts, m = state.balls, state.counts, state.sizes.mass_of(i)
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
    u, v = laboratory_velocity(0.0, 0.0, state)  # of the frame: the wall rests
    balls[U, i] = -inwards * x - along * y - u
    balls[V, i] = -inwards * y + along * x - v
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
