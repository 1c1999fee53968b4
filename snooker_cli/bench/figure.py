"""A saved measurement of ``error`` -> pictures: error against cost, and how errors grow."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from snooker_cli.bench.origin import machine
from snooker_cli.gallery import NEUTRAL, Layer, Line, Picture, Points, Reference
from snooker_cli.scene import EPSILON
from snooker_cli.words import short

Record = dict[str, Any]

COMPARED_AFTER = 100
"""Errors are compared after so many events, or the last before: later, chaos levels them."""


def pictures(measurement: Record) -> list[tuple[str, Picture]]:
    """Two pictures for each scene of a measurement, each with a name for its files."""
    exponents = {each["name"]: each["exponent"] for each in measurement["horizons"]}
    found = []
    for scene in measurement["scenes"]:
        name, exponent = scene["name"], exponents.get(scene["name"])
        found.append((f"error-against-cost-{name}", against_cost(measurement, scene)))
        found.append((f"error-growth-{name}", growing(measurement, scene, exponent)))
    return found


def against_cost(measurement: Record, scene: Record) -> Picture:
    """The error of place after some events over the processor time of one event."""
    checkpoints = scene["checkpoints"]
    place = max(k for k, events in enumerate(checkpoints) if events <= COMPARED_AFTER)
    events = checkpoints[place]
    layers: list[Layer] = []
    records = []
    for series, (label, results) in enumerate(_ways(scene)):
        cost = np.array([1e6 * one["seconds"] / scene["collisions"] for one in results])
        error = np.array([one["place_errors"][place] for one in results])
        if len(results) > 1:
            layers.append(Line(cost, error, None, series))
        layers.append(Points(cost, error, label=label, series=series))
        records += [
            {"method": one["method"], "microseconds_per_event": c, "place_error": e}
            for one, c, e in zip(results, cost.tolist(), error.tolist(), strict=True)
        ]
    ours, *others = records
    nearest = min(others, key=lambda one: float(one["place_error"]))
    return Picture(
        kind="error-against-cost",
        title=f"Error against cost, {scene['what']}",
        x_label="processor time per event (µs)",
        y_label=f"error of place after {events} events (m)",
        layers=tuple(layers),
        caption=f"Root mean square over {scene['balls']} balls, against the exact twin. After "
        f"{events} events snooker is off by {short(ours['place_error'], 2)} m at "
        f"{short(ours['microseconds_per_event'])} µs an event, start and end of a run of "
        f"{scene['collisions']} events included; of the others, {nearest['method']} comes nearest, "
        f"with {short(nearest['place_error'], 2)} m at "
        f"{short(nearest['microseconds_per_event'])} µs. {_origin(measurement)}",
        numbers={"scene": scene["name"], "events": events, "methods": records},
        x_log=True,
        y_log=True,
    )


def growing(measurement: Record, scene: Record, exponent: float | None) -> Picture:
    """The error of place over the number of events."""
    events = np.array(scene["checkpoints"], dtype=np.float64)
    shown = [
        one
        for _, results in _ways(scene)
        for one in results[:: max(1, len(results) - 1)]  # of many steps, the longest and shortest
    ]
    layers: list[Layer] = [
        Line(events, np.array(one["place_errors"]), one["method"], series)
        for series, one in enumerate(shown)
    ]
    said = ""
    if exponent is not None:
        # From the rounding of a number near 1 up to the balls' own distances.
        end = min(float(events[-1]), math.log(1 / EPSILON) / exponent)
        x = np.linspace(1.0, end, 50)
        y = EPSILON * np.exp(exponent * x)
        layers.append(Line(x, y, f"one rounding, times exp({exponent:g} n)", NEUTRAL, "dashed"))
        said = f"Chaos multiplies an error by exp({exponent:g}) an event. "
    return Picture(
        kind="error-growth",
        title=f"How errors grow, {scene['what']}",
        x_label="event",
        y_label="error of place (m)",
        layers=(*layers, Reference("y", EPSILON)),
        caption=f"Root mean square over {scene['balls']} balls, against the exact twin, at its "
        f"events. {said}The line across is one rounding of 1 m. {_origin(measurement)}",
        numbers={"scene": scene["name"], "exponent": exponent},
        y_log=True,
    )


def _ways(scene: Record) -> Iterator[tuple[str, Sequence[Record]]]:
    """The methods, with all steps of time stepping as one, from the longest step on."""
    results = scene["results"]
    for one in results:
        if one["step"] is None:
            yield one["method"], [one]
    stepped = sorted((one for one in results if one["step"]), key=lambda one: -one["step"])
    if stepped:
        first, last = stepped[0]["step"], stepped[-1]["step"]
        yield f"time steps of {short(first)} to {short(last)} s", stepped


def _origin(measurement: Record) -> str:
    """Where and when it was measured."""
    return (
        f"Measured on {measurement['date'][:10]} with snooker {measurement['snooker']} on one "
        f"processor: {machine(measurement)}."
    )
