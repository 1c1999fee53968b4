"""Figures of the reproduction alone: past wall traps, and with the source report's formula.

Also saved measurements.
"""

import json
import math
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.decay import reported_constant
from snooker_cli.analysis.observables import mean_and_error, meeting_temperature
from snooker_cli.analysis.predictions import scene_rates
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import setting
from snooker_cli.figures.figure_data import Line
from snooker_cli.report.document import rendered
from snooker_cli.report.packaged import packaged
from snooker_cli.runs import Run
from snooker_cli.trace import SLIDE, StopReason, Trace

MEASUREMENTS = ("error", "hard", "billion", "physics")
"""Saved measurements of ``snooker bench``; billion is a hard case of its own."""


@cache
def measurement(name: str) -> dict[str, Any]:
    """A saved measurement."""
    return dict(json.loads(packaged(f"measured/{name}.json")))


def sliding_figure(run: Run, selection: Selection) -> FigureData:
    """Figure 17's axes for balls that start twice, with ``collapse: stop`` and ``slide``.

    Raises ``FigureError`` if the run lacks such pairs, ``StoreError`` if it cannot be read.
    """
    picture = FIGURES["ideal-ratio"].make(run, selection)
    points = selected(run, selection)
    shown = {
        (point.experiment.cor, point.experiment.collapse): (point, record)
        for point, record in zip(points, picture.numbers["points"], strict=True)
    }
    pairs = [
        _pair(run, stopped[0], shown[cor, "slide"][0])
        | {"stop": stopped[1], "slide": shown[cor, "slide"][1]}
        for (cor, collapse), stopped in shown.items()
        if collapse == "stop" and (cor, "slide") in shown
    ]
    if not pairs:
        raise FigureError(
            f"{run.name} needs points with collapse stop and slide. Run its config again."
        )
    values = {"pairs": pairs, "setting": setting(run, points, selection)}
    return replace(
        picture,
        title=picture.title.replace(
            "Simulated over ideal pressure", "Pressure ratio past wall traps"
        ),
        caption=" ".join(rendered("sliding.txt.j2", values).split()),
        numbers={**picture.numbers, "pairs": pairs},
    )


def decay_figure(run: Run, selection: Selection) -> FigureData:
    """The decay constants against the CoR, with the source report's k: as it is, and with χ.

    Raises ``FigureError`` and ``StoreError`` as the figure without k.
    """
    picture = FIGURES["decay-against-cor"].make(run, selection)
    points = {point.experiment.cor: point for point in selected(run, selection)}
    shown = [dict(record) for record in picture.numbers["points"]]
    for one in shown:
        found = [reported_constant(trace) for trace in run.traces(points[one["parameters"]["cor"]])]
        one["report_k"], one["report_k_error"] = mean_and_error(np.array(found))
    cors = np.array([one["parameters"]["cor"] for one in shown])
    scene = run.read(points[cors[0]], 0).start
    rates = scene_rates(scene, meeting_temperature(scene.kinetic_energy, scene))
    assert rates is not None
    grid = np.linspace(cors[0], cors[-1], 100)
    enskog = [
        theory.source_decay_constant(e, rates.mean_free_path, rates.mean_speed)
        for e in map(float, grid)
    ]
    report_k = np.array([one["report_k"] for one in shown])
    lines = (
        Line(cors, report_k, "k by the source report", 1, "dashed"),
        Line(grid, np.array(enskog), "k, mean free path after Enskog", 1, "dotted"),
    )
    caption = (
        "Dashed: the source report's k = −2 ln(CoR)⟨v⟩/λ, ⟨v⟩ of complete repeats and "
        "λ = 1/(√2 n 2πr). Dotted: k with ⟨v⟩ at the start and Enskog's λ = 1/(√2 n 4rχ), χ for "
        "the size of the balls."
    )
    return replace(
        picture,
        layers=(*lines, *picture.layers),
        caption=f"{caption} {picture.caption}",
        numbers={**picture.numbers, "points": shown},
    )


def _pair(run: Run, stopped: Point, slid: Point) -> dict[str, Any]:
    """When the traps of a point come, and what the same starts do with sliding balls."""
    both = list(zip(run.traces(stopped), run.traces(slid), strict=True))
    trapped = [one for one, _ in both if one.stop.reason is StopReason.WALL_TRAP]
    ended = [other for _, other in both]
    events = [trace.events for trace in ended if trace.events is not None]
    return {
        "cor": stopped.experiment.cor,
        "radius": float(both[0][0].start.radii[0]),
        "repeats": len(both),
        "trapped": len(trapped),
        "trap_time": _mean(trace.stop.time for trace in trapped),
        "trap_collisions": _mean(trace.collisions for trace in trapped),
        "alike": sum(_alike(one, other) for one, other in both),
        "sliding_balls": _mean(len(np.unique(each.i[each.j == SLIDE])) for each in events),
        "complete": sum(trace.stop.reason.complete for trace in ended),
        "end_time": _mean(trace.stop.time for trace in ended),
        "end_collisions": _mean(trace.collisions for trace in ended),
    }


def _mean(values: Iterable[float]) -> float:
    """The mean; nan of nothing."""
    return float(np.mean(list(values) or [math.nan]))


def _alike(one: Trace, other: Trace) -> bool:
    """Whether two have the same collisions, to the bit, until one ends or the other slides."""
    assert one.events is not None
    assert other.events is not None
    slides = np.flatnonzero(other.events.j == SLIDE)
    count = min([len(one.events), len(other.events), *slides[:1].tolist()])
    return all(
        np.array_equal(getattr(one.events, name)[:count], getattr(other.events, name)[:count])
        for name in ("time", "i", "j", "impulse")
    )
