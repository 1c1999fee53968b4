"""A film at a pace -> its frames: the states and flashes at evenly spaced moments."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from snooker_cli.engine import replay

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.animation.film import Film


# The scale of colours from slow to fast that the player and the pictures share.

SPEED_COLOURS = (
    "#0d0887",
    "#41049d",
    "#6a00a8",
    "#8f0da4",
    "#b12a90",
    "#cc4778",
    "#e16462",
    "#f2844b",
    "#fca636",
    "#fcce25",
)
"""Even steps of perceived lightness, also to the colour-blind: matplotlib's plasma up to 0.9, as
its last, yellow part is too light on white.
"""


# Which part of the plane a film shows, and by how much the container's motion can be enlarged.

MARGIN = 0.03
"""Of the container's size, round about it."""

STRAY = 0.5
"""Of its size: a container that goes farther is followed, a nearer one moves in a resting view."""

VISIBLE = 0.1
"""Of its size: to this a small motion is enlarged at most."""


@dataclass(frozen=True)
class View:
    """What is seen.

    extent : left, right, bottom and top, m; from the container's centre if that is followed
    follow : whether the view moves with the container
    farthest : how far the container gets from where it was at the film's start, m
    magnifications : by how much its motion can be enlarged, from 1 on
    """

    extent: tuple[float, float, float, float]
    follow: bool
    farthest: float
    magnifications: tuple[float, ...]


def view(film: Film, magnify: float = 1.0) -> View:
    """The view of a film whose container's motion is enlarged so many times at first."""
    width, height = film.trace.start.container.size
    path = container_path(film)
    low, high = path.min(axis=0), path.max(axis=0)
    farthest = float(np.max(np.hypot(*(path - path[0]).T)))
    size = max(width, height)
    follow = bool(np.any(high - low > STRAY * np.array([width, height])))
    if follow:
        low = high = np.zeros(2)
    half, margin = np.array([width, height]) / 2, MARGIN * size
    left, bottom = (low - half - margin).tolist()
    right, top = (high + half + margin).tolist()
    found = {1.0, magnify}
    if farthest > 0 and not follow:
        powers = math.floor(math.log10(VISIBLE * size / farthest))
        found |= {10.0**power for power in range(1, powers + 1)}
    return View((left, right, bottom, top), follow, farthest, tuple(sorted(found)))


def container_path(film: Film) -> NDArray[np.float64]:
    """(*n* + 2, 2) m: the container's centre at the start, at each collision and at the end."""
    place, motion = film.opening.container_positions[0], film.opening.container_velocities[0]
    at_wall = np.flatnonzero(film.j < 0)
    motions = np.vstack([motion, film.after[at_wall, 2:]])
    turned = np.append(film.start, film.time[at_wall])
    steps = motions * np.diff(turned, append=film.end)[:, None]
    places = np.vstack([place, place + np.cumsum(steps, axis=0)])
    times = np.concatenate([[film.start], film.time, [film.end]])
    turned = np.append(turned, film.end)
    return np.column_stack([np.interp(times, turned, places[:, axis]) for axis in (0, 1)])


# How a film's time passes while it is shown: evenly, or one collision after the other.

Pace = Literal["time", "events"]


@dataclass(frozen=True)
class Reel:
    """A film's time at each moment of showing.

    Moments run from 0 to 1. With the pace "events" each collision takes the same part of them,
    and so does what is after the last.

    knots : (*n* + 2,) s: the start, the collisions, the end
    """

    pace: Pace
    knots: NDArray[np.float64]

    def time(self, moments: NDArray[np.float64]) -> NDArray[np.float64]:
        """The film's time at moments, s."""
        return np.interp(moments, self._moments(), self.knots)

    def collision_moments(self) -> NDArray[np.float64]:
        """(*n*,) the moments of the collisions."""
        return self._moments()[1:-1]

    def _moments(self) -> NDArray[np.float64]:
        """(*n* + 2,) the moments of the knots."""
        if self.pace == "events":
            return np.linspace(0.0, 1.0, len(self.knots))
        start, end = self.knots[0], self.knots[-1]
        return np.asarray((self.knots - start) / (end - start))


def reel(film: Film, pace: Pace) -> Reel:
    """A film's reel at a pace."""
    return Reel(pace, np.concatenate([[film.start], film.time, [film.end]]))


FLASH = 0.3
"""For how long a contact flashes, s of showing; the player's script has the same."""

MOST_FLASHES = 60
"""At a time, the latest: more would hide the balls; the player's script has the same."""

AT_ONCE = 2_000_000
"""Balls times frames whose states are kept at a time; 64 MB."""


@dataclass(frozen=True)
class Frame:
    """One picture of a film.

    time : s
    collisions : how many of the film's there have been
    positions : (*N*, 2) m; in a periodic box, inside it
    speeds : (*N*,) m/s
    container : (2,) m, its centre
    flashes : (*f*,) which of the film's collisions flash, at most ``MOST_FLASHES``
    ages : (*f*,) from 0, at the contact, to 1, when the flash is over
    """

    time: float
    collisions: int
    positions: NDArray[np.float64]
    speeds: NDArray[np.float64]
    container: NDArray[np.float64]
    flashes: NDArray[np.intp]
    ages: NDArray[np.float64]


def frames(film: Film, reel: Reel, count: int, seconds: float) -> Iterator[Frame]:
    """So many frames (at least 2), the first at the start and the last at the end of the film.

    seconds : how long they are shown all together; a contact flashes for ``FLASH`` of it
    """
    moments = np.linspace(0.0, 1.0, count)
    # The last moment is the film's end whatever the rounding.
    times = np.clip(reel.time(moments), film.start, film.end)
    collisions = np.searchsorted(film.time, times, side="right")
    hit = reel.collision_moments()
    flash = FLASH / seconds
    step = max(1, AT_ONCE // film.trace.start.number)
    for first in range(0, count, step):
        states = replay(film.trace, times[first : first + step])
        for row in range(len(states.time)):
            frame = first + row
            done = collisions[frame]
            recent = int(np.searchsorted(hit, moments[frame] - flash, side="right"))
            flashes = np.arange(max(min(recent, done), done - MOST_FLASHES), done)
            yield Frame(
                time=float(times[frame]),
                collisions=int(done),
                positions=states.positions[row],
                speeds=np.hypot(*states.velocities[row].T),
                container=states.container_positions[row],
                flashes=flashes,
                ages=np.clip((moments[frame] - hit[flashes]) / flash, 0.0, 1.0),
            )
