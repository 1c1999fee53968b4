"""A film -> its view of the plane and its frames: states at evenly spaced moments."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from snooker_cli.animation.film import BATCH, Film
from snooker_cli.engine import replay

SPEED_COLOURS = (
    *("#0d0887", "#41049d", "#6a00a8", "#8f0da4", "#b12a90"),
    *("#cc4778", "#e16462", "#f2844b", "#fca636", "#fcce25"),
)
"""From slow to fast, for the player and the movies: matplotlib's plasma up to 0.9.

The steps of lightness are even, also for colour-blind people. The yellow end is too light on white.
"""

MARGIN = 0.03  # around the container, as a part of its size

STRAY = 0.5
"""Part of its size: the view follows a container that moves farther, and otherwise rests."""

VISIBLE = 0.1  # part of its size: a small motion is enlarged to this at most


@dataclass(frozen=True)
class View:
    """The part of the plane that a film shows.

    extent : left, right, bottom and top, m; relative to the container's centre with ``follow``
    follow : whether the view moves with the container
    farthest : largest distance of the container from its place at the start, m
    magnifications : factors, from 1 on, by which its motion can be enlarged
    """

    extent: tuple[float, float, float, float]
    follow: bool
    farthest: float
    magnifications: tuple[float, ...]


def view(film: Film) -> View:
    """The view of a film."""
    width, height = film.trace.start.container.size
    size, path = max(width, height), film.container_path
    low, high = path.min(axis=0), path.max(axis=0)
    farthest = float(np.max(np.hypot(*(path - path[0]).T)))
    follow = bool(np.any(high - low > STRAY * np.array([width, height])))
    if follow:
        low = high = np.zeros(2)
    reach = np.array([width, height]) / 2 + MARGIN * size
    (left, bottom), (right, top) = (low - reach).tolist(), (high + reach).tolist()
    powers = 0
    if farthest > 0 and not follow:
        powers = max(0, math.floor(math.log10(VISIBLE * size / farthest)))
    magnifications = tuple(10.0**power for power in range(powers + 1))
    return View((left, right, bottom, top), follow, farthest, magnifications)


Pace = Literal["time", "events"]
"""What passes evenly while a film is shown: its time, or its collisions."""

FLASH = 0.3  # how long a contact flashes, s of showing; as in the player's script
MOST_FLASHES = 60  # the latest ones: more would hide the balls; as in the player's script


@dataclass(frozen=True)
class Frame:
    """What a film shows at a time (s), after this number of its collisions.

    positions, speeds : (*N*, 2) m, in a periodic box inside it; (*N*,) m/s
    container : (2,) m, its centre
    flashes, ages : the collisions that flash, at most ``MOST_FLASHES``; 0 at the contact, 1 in
        the end
    """

    time: float
    collisions: int
    positions: NDArray[np.float64]
    speeds: NDArray[np.float64]
    container: NDArray[np.float64]
    flashes: NDArray[np.intp]
    ages: NDArray[np.float64]


def frames(film: Film, pace: Pace, count: int, seconds: float) -> Iterator[Frame]:
    """Frames of a film, the first at its start and the last at its end.

    pace : with "events" each collision takes the same part, and so does the time after the last
    count : number of frames, at least 2
    seconds : length of the showing; a contact flashes for ``FLASH`` of it
    """
    # From 0 to 1: when frames are shown, and the start, the collisions and the end of the film.
    shown, knots = np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, len(film.knots))
    if pace == "time":
        knots = (film.knots - film.start) / (film.end - film.start)
    # Rounding must not move the last frame beyond the end.
    times = np.clip(np.interp(shown, knots, film.knots), film.start, film.end)
    collisions = np.searchsorted(film.time, times, side="right")
    hit, flash = knots[1:-1], FLASH / seconds
    recent = np.searchsorted(hit, shown - flash, side="right")
    step = max(1, BATCH // film.trace.start.number)
    for first in range(0, count, step):
        states = replay(film.trace, times[first : first + step])
        for row, frame in enumerate(range(first, first + len(states.time))):
            done = collisions[frame]
            flashes = np.arange(max(min(recent[frame], done), done - MOST_FLASHES), done)
            yield Frame(
                time=float(times[frame]),
                collisions=int(done),
                positions=states.positions[row],
                speeds=np.hypot(*states.velocities[row].T),
                container=states.container_positions[row],
                flashes=flashes,
                ages=np.clip((shown[frame] - hit[flashes]) / flash, 0.0, 1.0),
            )
