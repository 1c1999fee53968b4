"""Results beyond the source report: saved measurements, and figure 17 past its wall traps."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import setting
from snooker_cli.formatting import counted, short
from snooker_cli.report.source_values import source_value
from snooker_cli.trace import SLIDE, StopReason
from snooker_cli.validation.accuracy_study import error_against_cost, error_growth

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace

Record = Mapping[str, Any]

MEASUREMENTS = ("error", "hard", "billion", "physics")
"""Saved measurements of ``snooker bench``; billion is a hard case of its own."""


@cache
def measurement(name: str) -> dict[str, Any]:
    """A saved measurement."""
    path = files("snooker_cli.report") / "measured" / f"{name}.json"
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def error_figure() -> FigureData:
    """Error against cost, on the stated scene."""
    found = measurement("error")
    return error_against_cost(found, found["scenes"][0])


def growth_figure() -> FigureData:
    """Growth of errors, on the stated scene."""
    found = measurement("error")
    return error_growth(found, found["scenes"][0])


# Figure 17 past its wall traps: each start with collapse: stop and with collapse: slide


def sliding_figure(run: Run, radius_of: str) -> FigureData:
    """Figure 17's axes for the balls of one of its printed radii, each start stopped and sliding.

    Raises ``FigureError`` if the run lacks such pairs, ``StoreError`` if it cannot be read.
    """
    selection = Selection({"balls.radius": source_value(radius_of).radius})
    picture = FIGURES["ideal-ratio"].make(run, selection)
    points = selected(run, selection)
    shown = {
        (point.experiment.cor, point.experiment.collapse): (point, record)
        for point, record in zip(points, picture.numbers["points"], strict=True)
    }
    pairs = [
        _pair(run, stopped, shown[cor, "slide"])
        for (cor, collapse), stopped in shown.items()
        if collapse == "stop" and (cor, "slide") in shown
    ]
    if not pairs:
        raise FigureError(
            f"{run.name} needs points with collapse stop and slide. Run its config again."
        )
    ratios = [one[which]["over_ideal_at_mean"] for one in pairs for which in ("stop", "slide")]
    alike, repeats = (sum(one[key] for one in pairs) for key in ("alike", "repeats"))
    caption = (
        "As figure 17, filled at the mean temperature and open at the final one, in a fixed "
        "container, each start twice: with collapse: stop and slide. "
        f"{' '.join(map(_pair_text, pairs))} Up to the trap both have the same collisions to the "
        f"bit in {alike} of {repeats} starts. The mean ratios at the mean temperature are "
        f"{min(ratios):.3f} to {max(ratios):.3f}. {setting(run, points, selection)}"
    )
    return replace(
        picture,
        title="Simulated over ideal pressure, up to wall traps and past them",
        caption=caption,
        numbers={**picture.numbers, "pairs": pairs},
    )


def _pair(run: Run, stopped: tuple[Point, Record], slid: tuple[Point, Record]) -> dict[str, Any]:
    """When the traps of a point come, and what the same starts do with sliding balls."""
    both = list(zip(run.traces(stopped[0]), run.traces(slid[0]), strict=True))
    trapped = [one for one, _ in both if one.stop.reason is StopReason.WALL_TRAP]
    ended = [other for _, other in both]
    return {
        "cor": stopped[0].experiment.cor,
        "radius": float(both[0][0].start.radii[0]),
        "repeats": len(both),
        "trapped": len(trapped),
        "trap_time": _mean([trace.stop.time for trace in trapped]),
        "trap_collisions": _mean([trace.collisions for trace in trapped]),
        "alike": sum(_alike(one, other) for one, other in both),
        "sliding_balls": _mean([_number_of_sliding_balls(trace) for trace in ended]),
        "complete": sum(trace.stop.reason.complete for trace in ended),
        "end_time": _mean([trace.stop.time for trace in ended]),
        "end_collisions": _mean([trace.collisions for trace in ended]),
        "stop": stopped[1],
        "slide": slid[1],
    }


def _mean(values: Sequence[float]) -> float:
    """The mean; nan of nothing."""
    return float(np.mean(values)) if values else math.nan


def _number_of_sliding_balls(trace: Trace) -> int:
    """How many balls slide at some time."""
    assert trace.events is not None
    return len(np.unique(trace.events.i[trace.events.j == SLIDE]))


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


def _pair_text(pair: Record) -> str:
    """The sentences of a caption on one CoR."""
    stop, slide = pair["stop"], pair["slide"]
    return (
        f"CoR {pair['cor']:g}: with stop, {pair['trapped']} of "
        f"{counted(pair['repeats'], 'repeat')} end in a wall trap, on average after "
        f"{short(pair['trap_time'])} s and {pair['trap_collisions']:.0f} collisions. With slide, "
        f"they reach {pair['end_collisions']:.0f} collisions after {short(pair['end_time'])} s; "
        f"{short(pair['sliding_balls'], 2)} balls slide in each. The final temperature is "
        f"{short(slide['final_temperature'])} J instead of {short(stop['final_temperature'])} J, "
        f"and the ratio there {slide['over_ideal_at_end']:.2f} instead of "
        f"{stop['over_ideal_at_end']:.2f}."
    )


def sliding_values(pictures: Mapping[str, FigureData]) -> dict[str, Any]:
    """When traps come, and what is different past them; details for the caption's radius."""
    first = pictures["sliding"].numbers["pairs"]
    every = [*first, *pictures["sliding-text"].numbers["pairs"]]
    off = max(abs(pair["slide"]["over_ideal_at_mean"] - 1) for pair in every)
    return {
        **{key: sum(pair[key] for pair in every) for key in ("trapped", "repeats", "complete")},
        "radius": first[0]["radius"],
        "traps": [f"{short(pair['trap_time'], 2)} s at CoR {pair['cor']:g}" for pair in first],
        "ratios": [
            f"{pair['slide']['over_ideal_at_end']:.2f} instead of "
            f"{pair['stop']['over_ideal_at_end']:.2f} at CoR {pair['cor']:g}"
            for pair in first
        ],
        "off": f"{math.ceil(1000 * off) / 10:g}",
    }
