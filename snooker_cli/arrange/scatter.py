"""Random places without overlaps: balls inserted one after the other, and grown where that jams."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from snooker_cli.arrange.streams import points_in_disc, uniforms
from snooker_cli.neighbours import near, near_pairs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from snooker_cli.scene import Shape

    Floats = NDArray[np.float64]
    Indices = NDArray[np.int64]

INSERTED = 0.4
"""Packing up to which balls are inserted at their size. Insertion jams at 0.547 (Feder 1980,
doi:10.1016/0022-5193(80)90358-6), and needs ever more attempts on the way."""

ATTEMPTS = 100
"""A ball, after which inserting has jammed; at a packing of 0.4 there are 5 or so."""

JAMMED = 0.84
"""Random close packing of disks (Berryman 1983, doi:10.1103/PhysRevA.27.1053)."""

GROWN = 0.82
"""Packing beyond which growth is not tried: it takes ever longer towards jamming."""

SWEEPS = 2000
"""Pushes of all balls after which growth has failed; to a packing of 0.82 there are 800 or so."""

PUSH, MEMORY = 0.3, 0.9
"""Of an overlap, how much a push takes away; of a ball's last step, how much goes into its next."""

SKIN = 0.6
"""Beyond touching, up to which gap pairs are kept in sight, in mean radii."""


class Room(NamedTuple):
    """A container at rest with its middle at the origin; width and height in m."""

    shape: Shape
    size: tuple[float, float]

    @property
    def period(self) -> tuple[float, float] | None:
        """Width and height of a periodic box, m."""
        return self.size if self.shape == "periodic" else None

    def places(self, generator: np.random.PCG64, number: int, radius: float) -> Floats:
        """Uniform places for the centres of balls of a radius (m), (*number*, 2)."""
        if self.shape == "circle":
            return (self.size[0] / 2 - radius) * points_in_disc(generator, number, 0.0)
        margin = 2 * radius if self.shape == "box" else 0.0
        return np.asarray((uniforms(generator, number) - 0.5) * (np.array(self.size) - margin))

    def between(self, points: Floats, others: Floats) -> tuple[Floats, Floats]:
        """x and y of points seen from others, or from their nearest images, (*n*,) each, m."""
        x, y = points[:, 0] - others[:, 0], points[:, 1] - others[:, 1]
        if self.period is not None:
            x -= self.period[0] * np.rint(x / self.period[0])
            y -= self.period[1] * np.rint(y / self.period[1])
        return x, y

    def put_inside(self, positions: Floats, radii: Floats) -> None:
        """Move back what has left the room, and in a periodic box in by the other side."""
        if self.shape == "circle":
            farthest = self.size[0] / 2 - radii
            distances = np.sqrt(positions[:, 0] ** 2 + positions[:, 1] ** 2)
            out = distances > farthest
            positions[out] *= (farthest[out] / distances[out])[:, None]
        elif self.shape == "box":
            corners = np.array(self.size) / 2 - radii[:, None]
            np.clip(positions, -corners, corners, out=positions)
        else:
            positions -= np.array(self.size) * np.rint(positions / np.array(self.size))


class JammedError(Exception):
    """Balls that found no room; ``packing`` is what they reached."""

    def __init__(self, packing: float) -> None:
        super().__init__(packing)
        self.packing = packing


def scattered(
    room: Room, radii: Sequence[float], counts: Sequence[int], generator: np.random.PCG64
) -> Floats:
    """Random places for so many balls of each radius (m), in that order; (*N*, 2), m.

    Raises ``JammedError`` where they find none.
    """
    each = np.repeat(np.asarray(radii, dtype=np.float64), counts)
    packing = packing_of(room, each)
    if packing > GROWN * (1 + 1e-9):
        raise JammedError(GROWN)
    wide = 2 * max(radii) / min(room.size)
    if wide > 1:
        raise JammedError(packing / (wide * wide))
    inserted = min(packing, INSERTED)
    while True:
        scale = math.sqrt(inserted / packing)
        positions = _inserted(room, radii, counts, generator, scale)
        if positions is not None:
            break
        inserted /= 2
    if scale < 1:
        # In strips, what is near is near in memory too.
        strips = np.floor(positions[:, 1] / (4 * _mean(each)))
        order = np.lexsort((positions[:, 0], strips))
        positions[order] = _grown(room, positions[order], each[order], packing)
    return positions


def packing_of(room: Room, radii: Floats) -> float:
    """Area of balls over that of the room."""
    squares = math.fsum((radii * radii).tolist())
    if room.shape == "circle":
        return 4 * squares / (room.size[0] * room.size[0])
    return math.pi * squares / (room.size[0] * room.size[1])


def _inserted(
    room: Room,
    radii: Sequence[float],
    counts: Sequence[int],
    generator: np.random.PCG64,
    scale: float,
) -> Floats | None:
    """Places of balls whose radii are ``scale`` of theirs, the largest first; None if jammed."""
    found: dict[int, Floats] = {}
    for k in sorted(range(len(radii)), key=lambda k: -radii[k]):
        found[k] = np.empty((0, 2))
        attempts, accepted = 0, 1.0
        while (missing := counts[k] - len(found[k])) > 0:
            if attempts > ATTEMPTS * counts[k]:
                return None
            number = int(missing / accepted) + 8
            tried = room.places(generator, number, radii[k])
            attempts += number
            for other, places in found.items():
                tried = tried[~_blocked(room, tried, places, scale * (radii[k] + radii[other]))]
            tried = tried[~_blocked(room, tried, tried, scale * 2 * radii[k])]
            accepted = max(len(tried) / number, 0.05)
            found[k] = np.concatenate([found[k], tried[:missing]])
    return np.concatenate([found[k] for k in range(len(radii))])


def _blocked(room: Room, tried: Floats, places: Floats, reach: float) -> NDArray[np.bool_]:
    """Which places are within reach (m) of others, or of earlier ones among themselves."""
    blocked = np.zeros(len(tried), dtype=np.bool_)
    for a, b, distances in near(tried, places, reach, room.period):
        close = distances < reach
        if tried is places:
            close &= b < a
        blocked[a[close]] = True
    return blocked


def _grown(room: Room, positions: Floats, radii: Floats, packing: float) -> Floats:
    """The positions of balls pushed apart until none overlap. Raises ``JammedError``.

    They are pushed as if they were larger by a quarter of what jamming leaves room for, so that
    all are free soon, and keep going as if they had mass.
    """
    wanted = radii * (1 + max(0.25 * (math.sqrt(JAMMED / packing) - 1), 1e-4))
    skin = SKIN * _mean(radii)
    steps, moved = np.zeros_like(positions), np.full(len(radii), math.inf)
    for _ in range(SWEEPS):
        if 2 * np.max(moved) > skin:
            room.put_inside(positions, radii)
            pairs = list(near_pairs(positions, wanted, skin, room.period))
            i, j, _ = (np.concatenate(one) for one in zip(*pairs, strict=True))
            seen = positions.copy()
        x, y = room.between(positions[i], positions[j])
        distances = np.sqrt(x * x + y * y)
        close = np.flatnonzero(distances < wanted[i] + wanted[j])
        a, b, apart = i[close], j[close], distances[close]
        if np.all(apart >= radii[a] + radii[b]):
            room.put_inside(positions, radii)
            return positions
        part = PUSH / 2 * (wanted[a] + wanted[b] - apart) / apart
        for axis, offsets in enumerate((x, y)):
            push = part * offsets[close]
            steps[:, axis] *= MEMORY
            steps[:, axis] += np.bincount(a, push, len(radii)) - np.bincount(b, push, len(radii))
        positions += steps
        if room.period is None:
            room.put_inside(positions, radii)
        moved = np.sqrt(np.sum((positions - seen) ** 2, axis=1))
    ratio = float(np.min(apart / (radii[a] + radii[b])))
    raise JammedError(packing * ratio * ratio)


def _mean(values: Floats) -> float:
    """Correctly rounded, and so the same on every machine."""
    return math.fsum(values.tolist()) / len(values)
