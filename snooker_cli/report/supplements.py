"""Figure 17 past its wall traps: runs that stop at the first beside runs whose balls slide on."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import setting
from snooker_cli.formatting import counted, listed, short, with_error
from snooker_cli.report.document import Block, Figure, Heading, Paragraph, ReportTable
from snooker_cli.report.source_values import published
from snooker_cli.trace import SLIDE, StopReason
from snooker_cli.validation.accuracy_study import against_cost, growing
from snooker_cli.validation.hard_cases import INVARIANTS
from snooker_cli.validation.physics_study import sentence
from snooker_cli.validation.study import machine

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.figures import FigureData
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace


# Saved measurements of error and cost -> the report's section on them: read, never taken here.

Record = Mapping[str, Any]

FOLDER = Path(__file__).with_name("measured")

ACCURACY_LABELS = {"error-against-cost": "Figure 23", "error-growth": "Figure 24"}

AFTER = 100
"""Events after which errors are compared in words."""


def saved(name: str) -> dict[str, Any]:
    """A measurement of ``snooker bench``, as it was saved."""
    found: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return found


def accuracy_pictures(measurement: dict[str, Any]) -> dict[str, FigureData]:
    """The section's figures, by file."""
    scene = measurement["scenes"][0]
    exponent = measurement["horizons"][0]["exponent"]
    return {
        "error-against-cost": against_cost(measurement, scene),
        "error-growth": growing(measurement, scene, exponent),
    }


def accuracy_blocks(measurement: Record, shown: Mapping[str, FigureData]) -> list[Block]:
    """The section: text, figures, tables; ``shown`` has its pictures by file."""
    return [
        Heading("Speed against error", after_figures=True),
        Paragraph(finding(measurement)),
        Paragraph(_averages_text(measurement)),
        Paragraph(_horizon_text(measurement)),
        *(
            Figure(label, f"figures/{name}", shown[name].caption)
            for name, label in ACCURACY_LABELS.items()
        ),
        _methods("Table 6", measurement),
        _biases("Table 7", measurement),
    ]


def finding(measurement: Record) -> str:
    """What the study comes to, in the README's words too."""
    scene = measurement["scenes"][0]
    place = scene["checkpoints"].index(AFTER)
    ours, report, *steps = scene["results"]
    finest = min(steps, key=lambda one: float(one["step"]))
    coarsest = max(steps, key=lambda one: float(one["step"]))
    return (
        f"After {AFTER} events of {scene['what']}, snooker is off by "
        f"{short(ours['place_errors'][place], 2)} m, at {_rate(ours)} events a second from the "
        f"start to the end of a run of {scene['collisions']}; the report's own algorithm by "
        f"{short(report['place_errors'][place], 2)} m at {_rate(report)}; time steps of "
        f"{short(coarsest['step'])} s by {short(coarsest['place_errors'][place], 2)} m at "
        f"{_rate(coarsest)}, and of {short(finest['step'])} s by "
        f"{short(finest['place_errors'][place], 2)} m at {_rate(finest)}. "
        f"{_first_misses(scene, report)} The truth is an exact twin with {scene['digits']} digits, "
        f"measured on {measurement['date'][:10]} on one processor: {machine(measurement)}."
    )


def _rate(result: Record) -> str:
    """Events a second in two digits."""
    digits = float(f"{result['events_per_second']:.2g}")
    return f"{digits:,.0f}"


def _first_misses(scene: Record, report: Record) -> str:
    """Where the report's algorithm leaves the truth, if it does."""
    if report["first_different"] >= scene["certain"]:
        return f"Both have all {scene['certain']} events right."
    return (
        f"The report's algorithm has event {report['first_different'] + 1} wrong, for it drops "
        f"collisions that follow another within its tolerance of time: its balls end "
        f"{short(report['overlap'], 2)} m inside one another."
    )


def _averages_text(measurement: Record) -> str:
    """What it does to averages."""
    dropped = [
        f"{counted(one['overlapping'], 'repeat')} of {ensemble['repeats']} of {ensemble['what']}"
        for ensemble in measurement["ensembles"]
        for one in ensemble["methods"]
        if one["method"] == measurement["scenes"][0]["results"][1]["method"]
    ]
    elastic = measurement["ensembles"][0]
    longest = max((one for one in elastic["methods"] if one["step"]), key=lambda one: one["step"])
    pressure = longest["biases"][0]
    parts = 100 * pressure["difference"] / elastic["methods"][0]["biases"][0]["mean"]
    return (
        f"In averages such errors count only where collisions are lost (Table 7): the report's "
        f"algorithm leaves balls inside one another in {listed(dropped)}. Time steps of "
        f"{short(longest['step'])} s change the pressure by {short(parts, 2)} %."
    )


def _horizon_text(measurement: Record) -> str:
    """How far trajectories can be predicted."""
    said = [
        f"{short(each['median'], 4)} events ({each['what']}), where the Lyapunov exponent of "
        f"{each['exponent']:g} an event lets one rounding grow to the balls' distances in "
        f"{each['estimate']:.0f}"
        for each in measurement["horizons"]
    ]
    return (
        f"No program in double precision can say more of single balls than chaos allows. snooker "
        f"and the exact twin part after {listed(said)}. What is said of later times is true of "
        "averages alone."
    )


def _methods(label: str, measurement: Record) -> ReportTable:
    """The methods on the report's scene."""
    scene = measurement["scenes"][0]
    place = scene["checkpoints"].index(AFTER)
    return ReportTable(
        label,
        f"{scene['what'].capitalize()}, {scene['collisions']} events, by each method: events a "
        f"second of processor time; error of place after {AFTER} events, root mean square; events "
        "before the first that is another one; events until the same time; the deepest overlap; "
        "what is missing in the energy's books as a part of it.",
        ("method", "events/s", "error, m", "right", "events", "overlap, m", "energy"),
        tuple(
            (
                one["method"],
                _rate(one),
                short(one["place_errors"][place], 2),
                str(one["first_different"]),
                str(one["collisions"]),
                short(one["overlap"], 2),
                short(one["ledger"]["energy"], 2),
            )
            for one in scene["results"]
        ),
        (False, *(True,) * 6),
        (2.1, 1.0, 1.2, 0.6, 0.7, 1.2, 1.2),
    )


def _biases(label: str, measurement: Record) -> ReportTable:
    """Averages over repeats, and how far other methods are from snooker's."""
    rows = [
        (
            ensemble["what"],
            bias["quantity"],
            one["method"],
            with_error(bias["mean"], bias["error"]),
            "" if one is ensemble["methods"][0] else _difference(bias),
        )
        for ensemble in measurement["ensembles"]
        for k in range(len(ensemble["methods"][0]["biases"]))
        for one in ensemble["methods"]
        for bias in [one["biases"][k]]
    ]
    repeats, time = measurement["ensembles"][0]["repeats"], measurement["ensembles"][0]["time"]
    return ReportTable(
        label,
        f"Averages over {repeats} repeats of {time:g} s by each method, and their differences from "
        "snooker's on the same starts; ± is the standard error.",
        ("scene", "quantity", "method", "mean", "difference"),
        tuple(rows),
        (False, False, False, True, True),
        (1.7, 1.4, 1.7, 1.1, 1.2),
    )


def _difference(bias: Record) -> str:
    """A difference with its error."""
    return with_error(bias["difference"], bias["difference_error"])


# Saved measurements of hard cases and of known physics -> the report's section on them.


def trial_blocks(
    hard: dict[str, Any], billion: dict[str, Any], physics: dict[str, Any]
) -> list[Block]:
    """The section: a sentence and a table for each; ``billion`` is the hard case of that name."""
    return [
        Heading("Hard cases and known physics", after_figures=True),
        Paragraph(f"{_hard_text(hard)} {_billion_text(billion)}"),
        _cases("Table 8", [*hard["cases"], *billion["cases"]]),
        Paragraph(f"{sentence(physics)} Table 9 has them all."),
        _known("Table 9", physics),
    ]


def _hard_text(hard: Record) -> str:
    """How many cases there are, and whether they hold."""
    cases = hard["cases"]
    failed = [case["name"] for case in cases if not case["holds"]]
    verdict = f"These fail: {', '.join(failed)}." if failed else "All of them hold."
    runs = sum(ending["runs"] for case in cases for ending in case["endings"])
    return (
        f"{len(cases)} scenes are made to break an engine (Table 8). Both engines simulate them, "
        f"in {runs} runs; what must stay true is measured beside a bound on what rounding alone "
        f"could do, known facts included. {verdict} (snooker {hard['snooker']}, "
        f"{hard['date'][:10]}.)"
    )


def _billion_text(billion: Record) -> str:
    """What is left of the books after very many collisions."""
    (case,) = billion["cases"]
    energy, walk = case["worst"]["energy"], case["worst"]["drift of energy, of a ball's"]
    return (
        f"One more, {case['name']}, takes minutes and was run once, on {billion['date'][:10]} "
        f"({machine(billion)}): after {case['runs'][0]['events']:,} collisions by each engine the "
        f"energy is off by {short(energy['error'], 2)} of it at most. Of one ball's energy that is "
        f"{short(walk['error'], 2)}, where roundings to either side may add up to "
        f"{short(walk['bound'], 2)}."
    )


def _cases(label: str, cases: Sequence[Record]) -> ReportTable:
    """A row a case."""
    return ReportTable(
        label,
        "Hard cases: collisions of all runs, how they ended, the worst of what is missing in the "
        "books of energy and angular momentum as a part of the whole, the deepest overlap of two "
        "balls, and the verdict.",
        ("case", "why it is hard", "events", "ended", "energy", "angular", "overlap, m", "verdict"),
        tuple(
            (
                case["name"],
                case["why"],
                f"{case['events']:,}",
                ", ".join(
                    f"{one['runs']} {one['reason'].replace('_', ' ')}" for one in case["endings"]
                ),
                *(_worst(case, name) for name in INVARIANTS if name in SHOWN),
                "holds" if case["holds"] else "fails",
            )
            for case in cases
        ),
        (False, False, True, False, True, True, True, False),
        (1.3, 3.2, 0.9, 1.6, 1.0, 1.0, 1.0, 0.7),
    )


SHOWN = ("energy", "angular momentum", "overlap")


def _worst(case: Record, name: str) -> str:
    """The worst error in an invariant, if the case has it."""
    found = case["worst"].get(name)
    return short(found["error"], 2) if found else "–"


def _known(label: str, physics: Record) -> ReportTable:
    """A row for each known value."""
    return ReportTable(
        label,
        "What was measured beside expected values. Known is what the number of balls alone "
        "changes; what is left of the difference is in standard errors; open is what the expected "
        f"value leaves open itself. {' '.join(physics['notes'])}",
        ("quantity", "N", "packing", "CoR", "measured", "expected", "left", "open", "source"),
        tuple(
            (
                row["quantity"],
                f"{row['setting']['balls']:,}",
                f"{row['setting']['packing']:.4g}",
                f"{row['setting']['cor']:g}",
                with_error(row["measured"], row["error"]),
                short(row["expected"], 6),
                f"{row['left_in_errors']:+.1f}".replace("-", "−"),
                short(row["systematic"], 2) if row["systematic"] else "–",
                row["source"],
            )
            for row in physics["rows"]
        ),
        (False, True, True, True, True, True, True, True, False),
        (1.9, 0.6, 0.8, 0.5, 1.8, 1.0, 0.5, 0.8, 2.2),
    )


SLIDING_LABELS = {"sliding": "Figure 25", "sliding-text": "Figure 26"}

RADII = {
    "sliding": published("ratio_caption").radius,
    "sliding-text": published("ratio_text").radius,
}
"""Figure 17's balls have one radius in the report's caption and another in its text, m."""


def sliding_pictures(run: Run) -> dict[str, FigureData]:
    """The section's figures, by file: figure 17's axes, each start stopped and sliding.

    Raises ``FigureError`` if the run has no such pairs, ``StoreError`` if it cannot be read.
    """
    return {
        name: _picture(run, Selection({"balls.radius": RADII[name]})) for name in SLIDING_LABELS
    }


def _picture(run: Run, selection: Selection) -> FigureData:
    """The picture of the balls of one radius."""
    picture = FIGURES["ideal-ratio"].make(run, selection)
    points = selected(run, selection)
    shown = {
        (point.experiment.cor, point.experiment.collapse): (point, record)
        for point, record in zip(points, picture.numbers["points"], strict=True)
    }
    cors = [cor for cor, collapse in shown if collapse == "stop" and (cor, "slide") in shown]
    if not cors:
        raise FigureError(
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


def sliding_blocks(shown: Mapping[str, FigureData]) -> list[Block]:
    """The section: text and figures; ``shown`` has its pictures by file."""
    return [
        Heading("Past the wall traps", after_figures=True),
        Paragraph(_text({name: shown[name].numbers["pairs"] for name in SLIDING_LABELS})),
        *(
            Figure(label, f"figures/{name}", shown[name].caption)
            for name, label in SLIDING_LABELS.items()
        ),
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
