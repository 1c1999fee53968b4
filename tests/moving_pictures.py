"""Films of each kind of container, and what their tests read off pages and traces."""

from __future__ import annotations

import base64
import json
import math
import re
from functools import cache
from typing import Any

import numpy as np
from scenes import EPSILON, gas

from snooker_cli.animation import Film, film
from snooker_cli.engine import simulate
from snooker_cli.trace import Trace

SHAPES = ("fixed", "free", "box", "periodic")


@cache
def shown() -> dict[str, Trace]:
    """Two hundred collisions in each kind of container; balls are mixed where there are sides."""
    scenes = {
        "fixed": gas("circle", 37, 0.3, cor=0.9),
        "free": gas("circle", 37, 0.3, cor=0.9, container_mass=200.0),
        "box": gas("box", 60, 0.3, mixed=True, aspect=2.0),
        "periodic": gas("periodic", 60, 0.3, mixed=True, cor=0.9),
    }
    return {
        name: simulate(scene, collisions=200, engine="allpairs" if "f" in name else "cells")
        for name, scene in scenes.items()
    }


@cache
def films() -> dict[str, Film]:
    """The whole of each."""
    return {name: film(trace, name) for name, trace in shown().items()}


def content(text: str) -> dict[str, Any]:
    """What a page gives its player, its arrays unpacked."""
    found = re.search(r'<script type="application/json" id="film">(.*?)</script>', text, re.DOTALL)
    assert found
    data = json.loads(found[1])
    kinds = {"i": "<i4", "j": "<i4", "contacts": "<f4"}
    rows = ("kineticEnergy", "pressureSum", "pressureGain")
    for name in ("balls", "time", "i", "j", "after", "contacts", *rows):
        data[name] = np.frombuffer(base64.b64decode(data[name]), kinds.get(name, "<f8"))
    return data


def slack(trace: Trace) -> float:
    """By how much places may differ that are found by the same moves in other roundings, m.

    Each collision moves two bodies, whose coordinates are rounded twice, to half an epsilon of
    what they may be: the container's size and, as the page does not wrap them, the way gone. No
    ball is faster than the lightest with all the energy.
    """
    assert trace.events is not None
    fastest = math.sqrt(2 * trace.start.kinetic_energy / float(np.min(trace.start.masses)))
    reach = max(trace.start.size) + fastest * trace.stop.time
    return len(trace.events) * 2 * EPSILON * reach


def apart(trace: Trace, found: Any, wanted: Any) -> float:
    """The largest difference of places, m; in a periodic box that of the nearest images."""
    difference = np.asarray(found) - wanted
    if trace.start.period is not None:
        difference -= trace.start.period * np.rint(difference / trace.start.period)
    return float(np.max(np.abs(difference)))


def times_of(trace: Trace) -> list[float]:
    """The start, the end, times of collisions, and some in between; s."""
    assert trace.events is not None
    hits = trace.events.time[[0, 5, 100, 198]]
    return sorted([*np.linspace(0, trace.stop.time, 7).tolist(), *hits.tolist()])
