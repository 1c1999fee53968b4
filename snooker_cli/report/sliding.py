"""Figure 17 past its wall traps: runs that stop at the first beside runs whose balls slide on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.gallery import KINDS, Picture, PictureError, Selection, selected
from snooker_cli.gallery.caption import setting
from snooker_cli.report.document import Block, Figure, Heading, Paragraph
from snooker_cli.report.published import published
from snooker_cli.trace import SLIDE, StopReason
from snooker_cli.words import counted, listed, short

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.trace import Trace

Record = Mapping[str, Any]

LABELS = {"sliding": "Figure 25", "sliding-text": "Figure 26"}

RADII = {
    "sliding": published("ratio_caption").radius,
    "sliding-text": published("ratio_text").radius,
}
"""Figure 17's balls have one radius in the report's caption and another in its text, m."""


def pictures(run: Run) -> dict[str, Picture]:
    """The section's figures, by file: figure 17's axes, each start stopped and sliding.

    Raises ``PictureError`` if the run has no such pairs, ``StoreError`` if it cannot be read.
    """
    return {name: _picture(run, Selection({"balls.radius": RADII[name]})) for name in LABELS}


def _picture(run: Run, selection: Selection) -> Picture:
    """The picture of the balls of one radius."""
    picture = KINDS["ideal-ratio"].make(run, selection)
    points = selected(run, selection)
    shown = {
        (point.experiment.cor, point.experiment.collapse): (point, record)
        for point, record in zip(points, picture.numbers["points"], strict=True)
    }
    cors = [cor for cor, collapse in shown if collapse == "stop" and (cor, "slide") in shown]
    if not cors:
        raise PictureError(
            f"{run.name} needs points at collapse stop and slide; run its config again"
        )
    pairs = [_compared(run, shown[cor, "stop"], shown[cor, "slide"]) for cor in cors]
    ratios = [one[which]["over_ideal_at_mean"] for one in pairs for which in ("stop", "slide")]
    alike = sum(one["alike"] for one in pairs)
    repeats = sum(one["repeats"] for one in pairs)
    caption = (
        "As figure 17, filled at the mean temperature and open at the final one, in a fixed "
        "container, each start twice: with collapse: stop and slide. "
        f"{' '.join(_pair_text(one) for one in pairs)} Up to the trap both have the same "
        f"collisions to the bit in {alike} of {repeats} starts. At the mean temperature the means "
        f"are {min(ratios):.3f} to {max(ratios):.3f}. {setting(run, points, selection)}"
    )
    return replace(
        picture,
        title="Simulated over ideal pressure, up to wall traps and past them",
        caption=caption,
        numbers={**picture.numbers, "pairs": pairs},
    )


def _compared(
    run: Run, stopped: tuple[Point, Record], slid: tuple[Point, Record]
) -> dict[str, Any]:
    """When the traps of a point come, and what the same starts do with balls that slide."""
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
        "sliding_balls": _mean([len(_sliding(trace)) for trace in ended]),
        "complete": sum(trace.stop.reason.complete for trace in ended),
        "end_time": _mean([trace.stop.time for trace in ended]),
        "end_collisions": _mean([trace.collisions for trace in ended]),
        "stop": stopped[1],
        "slide": slid[1],
    }


def _mean(values: list[Any]) -> float:
    """The mean, nan of nothing."""
    return float(np.mean(values)) if values else float("nan")


def _sliding(trace: Trace) -> set[int]:
    """The balls that slide at some time."""
    assert trace.events is not None
    return set(trace.events.i[trace.events.j == SLIDE].tolist())


def _alike(one: Trace, other: Trace) -> bool:
    """Whether two have the same collisions, to the bit, until one ends or the other slides."""
    assert one.events is not None
    assert other.events is not None
    slides = np.flatnonzero(other.events.j == SLIDE)
    count = min([len(one.events), len(other.events), *slides[:1].tolist()])
    names = ("time", "i", "j", "impulse")
    columns = ((getattr(each.events, name) for each in (one, other)) for name in names)
    return all(np.array_equal(a[:count], b[:count]) for a, b in columns)


def _pair_text(pair: Record) -> str:
    """What a caption says of one CoR."""
    stop, slide = pair["stop"], pair["slide"]
    return (
        f"CoR {pair['cor']:g}: with stop {pair['trapped']} of {counted(pair['repeats'], 'repeat')} "
        f"end in a wall trap, on average after {short(pair['trap_time'])} s and "
        f"{pair['trap_collisions']:.0f} collisions; with slide they reach "
        f"{pair['end_collisions']:.0f} after {short(pair['end_time'])} s, in each "
        f"{short(pair['sliding_balls'], 2)} balls slide, and the final temperature is "
        f"{short(slide['final_temperature'])} J instead of {short(stop['final_temperature'])} J, "
        f"the ratio there {slide['over_ideal_at_end']:.2f} instead of "
        f"{stop['over_ideal_at_end']:.2f}."
    )


def blocks(shown: Mapping[str, Picture]) -> list[Block]:
    """The section: text and figures; ``shown`` has its pictures by file."""
    return [
        Heading("Past the wall traps", after_figures=True),
        Paragraph(_text({name: shown[name].numbers["pairs"] for name in LABELS})),
        *(Figure(label, f"figures/{name}", shown[name].caption) for name, label in LABELS.items()),
    ]


def _text(pairs: Mapping[str, list[Record]]) -> str:
    """When traps come, and what is different past them, of the first figure."""
    every = [pair for found in pairs.values() for pair in found]
    trapped, repeats, complete = (
        sum(pair[key] for pair in every) for key in ("trapped", "repeats", "complete")
    )
    first = pairs["sliding"]
    traps = listed([f"{short(pair['trap_time'], 2)} s at CoR {pair['cor']:g}" for pair in first])
    ends = listed(
        [
            f"{pair['slide']['over_ideal_at_end']:.2f} instead of "
            f"{pair['stop']['over_ideal_at_end']:.2f} at CoR {pair['cor']:g}"
            for pair in first
        ]
    )
    off = max(abs(pair["slide"]["over_ideal_at_mean"] - 1) for pair in every)
    return (
        "By default, collapse: stop, a wall trap ends a repeat. With collapse: slide the trapped "
        "ball slides along the wall until another hits it, which is exact, has no parameter, and "
        "needs a fixed wall. Figures 25 and 26 have the balls of figure 17 in a fixed container, "
        f"each start with both: {trapped} of {repeats} end in a trap with stop, those of "
        f"{first[0]['radius']:g} m on average after {traps}; with slide {complete} of {repeats} "
        "have all their collisions. The gas then cools on, and the ratio that the report plots, "
        f"at the final temperature, is {ends}: it depends on when a run ends. That at the mean "
        f"temperature stays within {math.ceil(1000 * off) / 10:g} % of 1, for a ball that slides "
        "on a circle of radius a presses with mv²/a, as the virial theorem asks of its energy."
    )
