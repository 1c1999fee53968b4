"""A film at a pace -> its frames: the states and flashes at evenly spaced moments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.engine import replay

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.animation.film import Film
    from snooker_cli.animation.reel import Reel

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
