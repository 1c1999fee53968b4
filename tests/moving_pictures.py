"""Films of each container shape, and what their tests read from pages and traces."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from scenes import EPSILON, EVERYONE, NEIGHBOURS, gas, report_scene

from snooker_cli.animation import Film, film
from snooker_cli.engine import simulate
from snooker_cli.trace import SLIDE, Trace

SHAPES = ("fixed", "free", "box", "periodic")


@cache
def shown() -> dict[str, Trace]:
    """Two hundred collisions in each container; the box has a mixture."""
    scenes = {
        "fixed": gas("circle", 37, 0.3, cor=0.9),
        "free": gas("circle", 37, 0.3, cor=0.9, container_mass=200.0),
        "box": gas("box", 60, 0.3, mixed=True, aspect=2.0),
        "periodic": gas("periodic", 60, 0.3, cor=0.9),
    }
    return {
        name: simulate(scene, collisions=200, search=EVERYONE if "f" in name else NEIGHBOURS)
        for name, scene in scenes.items()
    }


@cache
def films() -> dict[str, Film]:
    """The whole of each."""
    return {name: film(trace, name) for name, trace in shown().items()}


@cache
def sliding() -> Trace:
    """Balls that bounce without events, slide, are hit and slide again."""
    scene = report_scene(0, radius=0.1, cor=0.8)
    return simulate(replace(scene, slides=True), collisions=800)


@cache
def sliding_films() -> dict[str, Film]:
    """The whole film, and parts that start or end in a slide or in bounces without events."""
    trace = sliding()
    assert trace.events is not None
    time, begins = trace.events.time, slide_begins(trace)
    # The longest bounces without events, and the slide after them.
    k = max(begins, key=lambda event: time[event] - time[event - 1])
    bouncing = float(time[k - 1] + 0.6 * (time[k] - time[k - 1]))
    after = float(time[k] + 0.3 * (time[k + 1] - time[k]))
    return {
        "whole": film(trace, "whole"),
        "from unseen bounces": film(trace, "", since=bouncing, until=time[-1]),
        "from a slide": film(trace, "", since=after, most=100),
        "to unseen bounces": film(trace, "", until=bouncing),
    }


def slide_begins(trace: Trace) -> list[int]:
    """Events at which balls begin to slide: their last event was not a slide."""
    assert trace.events is not None
    last: dict[int, int] = {}
    found = []
    for k, (i, j) in enumerate(zip(trace.events.i.tolist(), trace.events.j.tolist(), strict=True)):
        if j == SLIDE and last[i] != SLIDE:
            found.append(k)
        last[i] = j
        if j >= 0:
            last[j] = i
    return found


def slack(trace: Trace) -> float:
    """Largest difference between places from the same motion with other rounding, m.

    Each collision rounds the coordinates of two bodies twice, by half an epsilon of the container's
    size plus the distance travelled. No ball is faster than the lightest one with all the energy.
    """
    assert trace.events is not None
    fastest = math.sqrt(2 * trace.start.kinetic_energy / float(np.min(trace.start.masses)))
    reach = max(trace.start.container.size) + fastest * trace.stop.time
    return len(trace.events) * 2 * EPSILON * reach


def times_of(trace: Trace) -> list[float]:
    """The start, the end, times of collisions, and some in between; s."""
    assert trace.events is not None
    hits = trace.events.time[[0, 5, 100, 198]]
    return sorted([*np.linspace(0, trace.stop.time, 7).tolist(), *hits.tolist()])
