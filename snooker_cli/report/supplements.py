"""Results beyond the source report: saved measurements, and figure 17 past its wall traps."""

import json
import math
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import setting
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
