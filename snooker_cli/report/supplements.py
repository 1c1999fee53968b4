"""Sections beyond the source report: errors, wall traps, hard cases and known physics.

Errors, hard cases and physics come from saved measurements of ``snooker bench``, which need long.
"""

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
from snooker_cli.formatting import counted, short, with_error
from snooker_cli.report.document import Table, TableColumn
from snooker_cli.report.source_values import source_value
from snooker_cli.trace import SLIDE, StopReason
from snooker_cli.validation.accuracy_study import against_cost, growing
from snooker_cli.validation.physics_study import sentence
from snooker_cli.validation.study import machine

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace

Record = Mapping[str, Any]

AFTER = 100
"""Number of events after which the text compares errors."""


@cache
def measurement(name: str) -> dict[str, Any]:
    """A saved measurement: error, hard, billion (a hard case of its own), or physics."""
    path = files("snooker_cli.report") / "measured" / f"{name}.json"
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def values(pictures: Mapping[str, FigureData]) -> dict[str, Any]:
    """What the template refers to in these sections."""
    return {
        "accuracy": accuracy_values(),
        "sliding": _sliding_values(pictures),
        "hard": _hard_values(),
        "billion": _billion_values(),
        "physics": {
            "sentence": sentence(measurement("physics")),
            "notes": measurement("physics")["notes"],
        },
    }


def tables() -> dict[str, Table]:
    """The tables of these sections by name."""
    return {
        "methods": _methods(),
        "biases": _biases(),
        "hard_cases": _hard_cases(),
        "physics": _known_physics(),
    }


# Errors and costs of this and other methods


def error_figure() -> FigureData:
    """Error against cost, on the stated scene."""
    found = measurement("error")
    return against_cost(found, found["scenes"][0])


def growth_figure() -> FigureData:
    """Growth of errors, on the stated scene."""
    found = measurement("error")
    return growing(found, found["scenes"][0], found["horizons"][0]["exponent"])


def accuracy_values() -> dict[str, Any]:
    """The comparison of methods on the stated scene, as texts."""
    found = measurement("error")
    scene, elastic = found["scenes"][0], found["ensembles"][0]
    place = scene["checkpoints"].index(AFTER)
    ours, source, *steps = scene["results"]
    wrong = source["first_different"] < scene["certain"]
    longest = max((one for one in elastic["methods"] if one["step"]), key=lambda one: one["step"])
    change = longest["biases"][0]["difference"] / elastic["methods"][0]["biases"][0]["mean"]

    def method(result: Record) -> dict[str, str]:
        return {
            "error": short(result["place_errors"][place], 2),
            "rate": _rate(result),
            "step": short(result["step"]),
        }

    return {
        "after": AFTER,
        "scene": scene["what"],
        "collisions": scene["collisions"],
        "ours": method(ours),
        "source": method(source),
        "coarse": method(max(steps, key=lambda one: float(one["step"]))),
        "fine": method(min(steps, key=lambda one: float(one["step"]))),
        "wrong_event": source["first_different"] + 1 if wrong else None,
        "overlap": short(source["overlap"], 2),
        "certain": scene["certain"],
        "digits": scene["digits"],
        "date": found["date"][:10],
        "machine": machine(found),
        "dropped": [
            f"{counted(one['overlapping'], 'repeat')} of {ensemble['repeats']} of "
            f"{ensemble['what']}"
            for ensemble in found["ensembles"]
            for one in ensemble["methods"]
            if one["method"] == source["method"]
        ],
        "longest_step": short(longest["step"]),
        "pressure_change": short(100 * change, 2),
        "horizons": [
            f"{short(each['median'], 4)} events ({each['what']}; exponent {each['exponent']:g} per "
            f"event, estimate {each['estimate']:.0f})"
            for each in found["horizons"]
        ],
        "repeats": elastic["repeats"],
        "time": elastic["time"],
    }


def _rate(result: Record) -> str:
    """Events per second to two digits."""
    digits = float(f"{result['events_per_second']:.2g}")
    return f"{digits:,.0f}"


def _methods() -> Table:
    """The methods on the stated scene."""
    scene = measurement("error")["scenes"][0]
    place = scene["checkpoints"].index(AFTER)
    columns = [
        TableColumn("method", 2.1, right=False),
        TableColumn("events/s", 1.0),
        TableColumn("error, m", 1.2),
        TableColumn("right", 0.6),
        TableColumn("events", 0.7),
        TableColumn("overlap, m", 1.2),
        TableColumn("energy", 1.2),
    ]
    rows = [
        [
            one["method"],
            _rate(one),
            short(one["place_errors"][place], 2),
            str(one["first_different"]),
            str(one["collisions"]),
            short(one["overlap"], 2),
            short(one["ledger"]["energy"], 2),
        ]
        for one in scene["results"]
    ]
    return Table(columns, rows)


def _biases() -> Table:
    """Averages over repeats, and their differences from ours."""
    columns = [
        TableColumn("scene", 1.7, right=False),
        TableColumn("quantity", 1.4, right=False),
        TableColumn("method", 1.7, right=False),
        TableColumn("mean", 1.1),
        TableColumn("difference", 1.2),
    ]
    rows = []
    for ensemble in measurement("error")["ensembles"]:
        for of_quantity in zip(*(one["biases"] for one in ensemble["methods"]), strict=True):
            for one, bias in zip(ensemble["methods"], of_quantity, strict=True):
                difference = with_error(bias["difference"], bias["difference_error"])
                rows.append(
                    [
                        ensemble["what"],
                        bias["quantity"],
                        one["method"],
                        with_error(bias["mean"], bias["error"]),
                        "" if one is ensemble["methods"][0] else difference,
                    ]
                )
    return Table(columns, rows)


# Hard cases and known physics


def _hard_values() -> dict[str, Any]:
    """The number of hard cases, and whether they hold."""
    found = measurement("hard")
    failed = [case["name"] for case in found["cases"] if not case["holds"]]
    return {
        "count": len(found["cases"]),
        "runs": sum(ending["runs"] for case in found["cases"] for ending in case["endings"]),
        "verdict": f"These fail: {', '.join(failed)}." if failed else "All of them hold.",
        "snooker": found["snooker"],
        "date": found["date"][:10],
    }


def _billion_values() -> dict[str, Any]:
    """The errors after very many collisions."""
    found = measurement("billion")
    (case,) = found["cases"]
    drift = case["worst"]["drift of energy, of a ball's"]
    return {
        "name": case["name"],
        "date": found["date"][:10],
        "machine": machine(found),
        "events": f"{case['runs'][0]['events']:,}",
        "energy": short(case["worst"]["energy"]["error"], 2),
        "drift": short(drift["error"], 2),
        "bound": short(drift["bound"], 2),
    }


def _hard_cases() -> Table:
    """A row for each hard case."""
    columns = [
        TableColumn("case", 1.3, right=False),
        TableColumn("why it is hard", 3.2, right=False),
        TableColumn("events", 0.9),
        TableColumn("ended", 1.6, right=False),
        TableColumn("energy", 1.0),
        TableColumn("angular momentum", 1.0),
        TableColumn("overlap, m", 1.0),
        TableColumn("verdict", 0.7, right=False),
    ]
    rows = []
    for case in [*measurement("hard")["cases"], *measurement("billion")["cases"]]:
        endings = [f"{one['runs']} {one['reason'].replace('_', ' ')}" for one in case["endings"]]
        worst = [case["worst"].get(name) for name in ("energy", "angular momentum", "overlap")]
        rows.append(
            [
                case["name"],
                case["why"],
                f"{case['events']:,}",
                ", ".join(endings),
                *(short(one["error"], 2) if one else "–" for one in worst),
                "holds" if case["holds"] else "fails",
            ]
        )
    return Table(columns, rows)


def _known_physics() -> Table:
    """A row for each known value."""
    columns = [
        TableColumn("quantity", 1.9, right=False),
        TableColumn("N", 0.6),
        TableColumn("packing", 0.8),
        TableColumn("CoR", 0.5),
        TableColumn("measured", 1.8),
        TableColumn("expected", 1.0),
        TableColumn("left", 0.5),
        TableColumn("open", 0.8),
        TableColumn("source", 2.2, right=False),
    ]
    rows = [
        [
            row["quantity"],
            f"{row['setting']['balls']:,}",
            f"{row['setting']['packing']:.4g}",
            f"{row['setting']['cor']:g}",
            with_error(row["measured"], row["error"]),
            short(row["expected"], 6),
            f"{row['left_in_errors']:+.1f}".replace("-", "−"),
            short(row["systematic"], 2) if row["systematic"] else "–",
            row["source"],
        ]
        for row in measurement("physics")["rows"]
    ]
    return Table(columns, rows)


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


def _sliding_values(pictures: Mapping[str, FigureData]) -> dict[str, Any]:
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
