"""Cooling beyond one exponential: how the rate falls with time, and the energy with collisions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from snooker_cli import kinetic, theory
from snooker_cli.decay import curve, fit_curve
from snooker_cli.fit import ensemble
from snooker_cli.gallery.caption import setting
from snooker_cli.gallery.picture import (
    NEUTRAL,
    Array,
    Layer,
    Line,
    Picture,
    PictureError,
    Points,
    Reference,
)
from snooker_cli.gallery.repeats import repeats
from snooker_cli.gallery.selection import (
    Selection,
    evenly,
    inelastic_points,
    label,
    require_motion,
)
from snooker_cli.observables import (
    before_collapse,
    energy_ratio,
    mean_and_error,
    meeting_temperature,
    series,
    so_far,
)
from snooker_cli.words import listed, short, with_error

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Series, Trace

MOST_COOLING = 4
"""Series of markers and laws each; more cannot be told apart."""

WINDOWS = 14
"""Windows of time in which the local decay rate is taken."""

LEAST_COLLISIONS = 10
"""Of all repeats, in a window: from n collisions a rate is known to about 1/√n of it."""

COUNTS = 14
"""Steps of the collision count at which the energy is averaged over the repeats."""

FLOOR_MATTERS = 0.1
"""The floor is drawn where it is at least this share of the energy that is left."""

SAME_FLOOR = 0.01
"""Floors that differ by less are one line."""

SPARSE = f"Windows with fewer than {LEAST_COLLISIONS} collisions are left out. "

_FLOORS = {
    "L": "The wall leaves the balls their angular momentum L about the container's centre, and "
    "with it at least the energy L²/(2mNa²), a = R − r. ",
    "p": "Without walls the balls keep their momentum p, and with it the energy p²/(2Nm). ",
}
"""What a circle, and a periodic box, leaves the balls."""

_Style: TypeAlias = Literal["solid", "dashed", "dashdot", "dotted"]

_HAFF: dict[str, tuple[str, str, _Style]] = {
    "fitted": ("with α fitted", "Haff's law 2α/(1 + αt), α fitted", "solid"),
    "theory": ("with α of theory", "the same, α of kinetic theory", "dashed"),
    "floor": ("above the floor", "the same above the floor of {}", "dashdot"),
}
"""The forms of Haff's law: in a caption, in the legend, and how they are drawn."""

_ENDS = {"first": 0, "last": -1}


def haff_time(run: Run, selection: Selection) -> Picture:
    """The local decay rate −d ln E/dt against time, beside Haff's law and one constant."""
    points = evenly(inelastic_points(run, selection), MOST_COOLING)
    layers: list[Layer] = []
    records, said = [], []
    for index, point in enumerate(points):
        name = label(point, points)
        traces = list(repeats(run, point, selection))
        record, drawn = _rates_over_time(traces, index, name or "simulation")
        records.append({"parameters": point.as_json(), **record})
        layers += drawn
        ends = [with_error(record[f"{k}_rate"], record[f"{k}_rate_error"]) for k in _ENDS]
        laws = [
            f"{short(record[f'{law}_last_rate'])} {text}"
            for law, (text, _, _) in _HAFF.items()
            if f"{law}_last_rate" in record
        ]
        text = f"from {ends[0]} to {ends[1]} s⁻¹, where Haff's law has {listed(laws)}"
        said.append(text + (f" ({name})" if name else ""))
    kept = _kept(points)
    keys = [
        _key(text.format(kept), style)
        for law, (_, text, style) in _HAFF.items()
        if any(f"{law}_last_rate" in record for record in records)
    ]
    return Picture(
        kind="haff-time",
        title="The decay rate falls with time",
        x_label="time (s)",
        y_label="−d ln E / dt (s⁻¹)",
        layers=(*layers, *keys, _key("one constant k, fitted", "dotted")),
        caption=f"From the first to the last window the rate goes {'; '.join(said)}. Markers: "
        f"mean energy of the repeats in {WINDOWS} windows of time up to the end of the shortest, "
        "with standard errors. "
        + (SPARSE if any(record["windows"] < WINDOWS for record in records) else "")
        + (_FLOORS[kept] if any("floor_last_rate" in record for record in records) else "")
        + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_log=True,
    )


def event_decay(run: Run, selection: Selection) -> Picture:
    """The energy against collisions, where kinetic theory has an exponential at any density."""
    points = evenly(inelastic_points(run, selection))
    layers: list[Layer] = []
    records, said = [], []
    for index, point in enumerate(points):
        name = label(point, points)
        traces = list(repeats(run, point, selection))
        record, drawn = _energy_over_counts(traces, index, name or "simulation")
        records.append({"parameters": point.as_json(), **record})
        layers += drawn
        text = with_error(record["final_ratio"], record["final_ratio_error"])
        text += f" where the counted collisions leave {short(record['theory'])}"
        if "theory_above_floor" in record:
            text += f", above the floor {short(record['theory_above_floor'])}"
        said.append(text + (f" ({name})" if name else ""))
    kept = _kept(points)
    floored = [record for record in records if "theory_above_floor" in record]
    keys: list[Layer] = [_key("expected from the counted collisions", "solid")]
    if floored:
        keys.append(_key(f"the same above the floor of {kept}", "dashed"))
        floors = [record["floor"] for record in floored]
        if max(floors) - min(floors) < SAME_FLOOR * max(floors):
            mean = float(np.mean(floors))
            keys.append(Reference("y", mean, f"floor of {kept}, {short(mean, 2)} E(0)"))
    return Picture(
        kind="event-decay",
        title="Energy against collisions",
        x_label="collisions / number of balls",
        y_label="E / E(0)",
        layers=(*layers, *keys),
        caption=f"In the end E/E(0) is {'; '.join(said)}. Markers: mean of the repeats; lines: "
        f"each of c collisions between balls takes (1 − e²)E/N{_at_walls(points)}. "
        + (_FLOORS[kept] if floored else "")
        + setting(run, points, selection),
        numbers={"points": records},
        x_limits=(0.0, None),
        y_log=True,
    )


def _rates_over_time(
    traces: Sequence[Trace], index: int, name: str
) -> tuple[dict[str, Any], list[Layer]]:
    """A point's local rates beside the laws: numbers as JSON, and what is drawn."""
    require_motion(traces[0].start)
    edges, rates, errors, left = _local_rates(traces)
    curves = [curve(trace, "kinetic_energy") for trace in traces]
    k = ensemble(fit_curve(each, "exponential") for each in curves).mean
    alpha = ensemble(fit_curve(each, "haff") for each in curves).mean
    if not (math.isfinite(k) and math.isfinite(alpha)):
        raise PictureError("a point's repeats are too short to be fitted; run longer")
    floor = float(np.mean([kinetic.floor(trace.start) for trace in traces]))
    scene = traces[0].start
    start = kinetic.rates(scene, meeting_temperature(scene.kinetic_energy, scene))
    laws: dict[str, tuple[float, float]] = {"fitted": (alpha, 0.0)}
    if start is not None:
        losses = scene.restitution, start.ball_ball, scene.wall_restitution, start.wall
        expected = theory.haff_rate(theory.cooling_rate(*losses))
        laws["theory"] = (expected, 0.0)
        if floor >= FLOOR_MATTERS * left:
            laws["floor"] = (expected, floor)
    fine = np.linspace(0.0, edges[-1, 1], 200)
    middles = edges.mean(axis=1)
    layers: list[Layer] = [
        Line(fine, _haff_rate(fine, *law), None, index, _HAFF[name][2])
        for name, law in laws.items()
    ]
    layers += [
        Line(fine[[0, -1]], np.array([k, k]), None, index, "dotted"),
        Points(middles, rates, None, errors if len(traces) > 1 else None, name, index),
    ]
    record: dict[str, Any] = {"k": k, "alpha": alpha, "floor": floor, "repeats": len(traces)}
    record["windows"] = len(rates)
    if start is not None:
        record["theory_alpha"] = laws["theory"][0]
    for end, which in _ENDS.items():
        record |= {f"{end}_rate": float(rates[which]), f"{end}_rate_error": float(errors[which])}
    for law, values in laws.items():
        before, after = np.log(_haff_energy(edges[-1], *values))
        record[f"{law}_last_rate"] = float(before - after) / float(np.ptp(edges[-1]))
    return record, layers


def _energy_over_counts(
    traces: Sequence[Trace], index: int, name: str
) -> tuple[dict[str, Any], list[Layer]]:
    """A point's energies by collision count: numbers as JSON, and what is drawn."""
    scene = traces[0].start
    require_motion(scene)
    if scene.number < 2:
        raise PictureError("kinetic theory has no word on one ball; it needs two or more")
    calm = [before_collapse(trace) for trace in traces]
    shortest = min(trace.collisions for trace in calm)
    if shortest == 0:
        raise PictureError("a repeat has no collisions; run longer")
    counts = np.unique(np.linspace(0.0, shortest, COUNTS + 1).round())
    rows = np.array([_against_counts(series(trace), scene, counts) for trace in calm])
    energies, expected = rows[:, 0], rows[:, 1]
    floors = np.array([kinetic.floor(trace.start) for trace in traces])[:, None]
    final, error = mean_and_error(energies[:, -1])
    spread = None
    if len(traces) > 1:
        spread = energies.std(axis=0, ddof=1) / math.sqrt(len(traces))
    x = counts / scene.number
    floor, alone = float(floors.mean()), expected.mean(axis=0)
    record: dict[str, Any] = {
        "collisions_per_ball": float(x[-1]),
        "final_ratio": final,
        "final_ratio_error": error,
        "theory": float(alone[-1]),
        "floor": floor,
        "repeats": len(traces),
    }
    layers: list[Layer] = [Line(x, alone, None, index, "solid")]
    if floor >= FLOOR_MATTERS * final:
        above = (floors + (1 - floors) * expected).mean(axis=0)
        layers.append(Line(x, above, None, index, "dashed"))
        record["theory_above_floor"] = float(above[-1])
    layers.append(Points(x, energies.mean(axis=0), None, spread, name, index))
    return record, layers


def _haff_energy(time: Array, alpha: float, floor: float) -> Array:
    """Energy over its start where Haff's law holds for what is above the floor."""
    return np.asarray(floor + (1 - floor) * theory.haff_ratio(time, alpha))


def _haff_rate(time: Array, alpha: float, floor: float) -> Array:
    """The decay rate −d ln E/dt of that energy, s⁻¹."""
    slope = 2 * alpha * (1 - floor) / (1 + alpha * time) ** 3
    return np.asarray(slope / _haff_energy(time, alpha, floor))


def _local_rates(traces: Sequence[Trace]) -> tuple[Array, Array, Array, float]:
    """Edges of windows (*w*, 2), −d ln of the mean energy/dt there, its standard error (s⁻¹).

    At last, the mean energy ratio in the end. Windows with too few collisions are left out.
    """
    end = min(trace.stop.time for trace in traces)
    if end == 0:
        raise PictureError("a repeat has no length; run longer")
    edges = np.linspace(0.0, end, WINDOWS + 1)
    table, collisions = [], np.zeros(WINDOWS)
    for trace in traces:
        found = series(trace)
        table.append(so_far(trace, energy_ratio(found), edges))
        counted = so_far(trace, found.wall_events + found.pair_events, edges)
        collisions += np.diff(np.minimum(counted, before_collapse(trace).collisions))
    energies = np.array(table)
    if np.any(energies <= 0):
        raise PictureError("a repeat loses all of its energy, so that it has no decay rate")
    good = collisions >= LEAST_COLLISIONS
    if np.count_nonzero(good) < 2:
        raise PictureError(
            f"its windows of time have fewer than {LEAST_COLLISIONS} collisions, too few for a "
            "rate; run longer or more repeats"
        )
    width = end / WINDOWS
    rates = -np.diff(np.log(energies.mean(axis=0))) / width
    # Each repeat's own rate spreads as much around the mean.
    own = -np.diff(np.log(energies), axis=1) / width
    errors = np.full(WINDOWS, math.nan)
    if len(traces) > 1:
        errors = own.std(axis=0, ddof=1) / math.sqrt(len(traces))
    windows = np.column_stack([edges[:-1], edges[1:]])
    return windows[good], rates[good], errors[good], float(energies[:, -1].mean())


def _against_counts(found: Series, scene: Scene, counts: Array) -> tuple[Array, Array]:
    """A repeat's energy ratio after so many collisions, and what theory makes of them."""
    events = found.wall_events + found.pair_events
    # A summary's rows may share a count: the last of them stands for it.
    last = np.append(events[1:] > events[:-1], True)
    ratio = np.interp(counts, events[last], energy_ratio(found)[last])
    wall = np.interp(counts, events[last], found.wall_events[last])
    pairs = np.interp(counts, events[last], found.pair_events[last])
    expected = theory.energy_ratio_by_events(
        scene.number, scene.restitution, pairs, scene.wall_restitution, wall
    )
    return ratio, np.asarray(expected)


def _kept(points: Sequence[Point]) -> str:
    """The letter of what the balls keep: angular momentum in a circle, momentum without walls."""
    return "p" if points[0].experiment.container.shape == "periodic" else "L"


def _at_walls(points: Sequence[Point]) -> str:
    """What collisions at walls take, where there are any."""
    walls = any(point.experiment.container.shape != "periodic" for point in points)
    return " and each of c_w at the wall (1 − e_w²)E/N" if walls else ""


def _key(text: str, style: _Style) -> Line:
    """A legend's entry for a style that all series share."""
    return Line(np.empty(0), np.empty(0), text, NEUTRAL, style)
