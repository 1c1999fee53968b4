"""Which part of the plane a film shows, and by how much the container's motion can be enlarged."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.animation.film import Film

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
    width, height = film.trace.start.size
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
