"""Saved measurements of error and cost -> the report's section on them: read, never taken here.

A measurement depends on the machine and the day. It is kept with its machine and date beside this
module, so that the report's bytes stay and no number is typed: ``snooker bench error --out DIR``
takes another.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli.bench.figure import against_cost, growing
from snooker_cli.bench.origin import machine
from snooker_cli.report.document import Block, Figure, Heading, Paragraph, Table
from snooker_cli.words import counted, listed, short, with_error

if TYPE_CHECKING:
    from snooker_cli.gallery import Picture

Record = Mapping[str, Any]

FOLDER = Path(__file__).with_name("measured")

LABELS = {"error-against-cost": "Figure 23", "error-growth": "Figure 24"}

AFTER = 100
"""Events after which errors are compared in words."""


def saved(name: str) -> dict[str, Any]:
    """A measurement of ``snooker bench``, as it was saved."""
    found: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return found


def pictures(measurement: dict[str, Any]) -> dict[str, Picture]:
    """The section's figures, by file."""
    scene = measurement["scenes"][0]
    exponent = measurement["horizons"][0]["exponent"]
    return {
        "error-against-cost": against_cost(measurement, scene),
        "error-growth": growing(measurement, scene, exponent),
    }


def blocks(measurement: Record, shown: Mapping[str, Picture]) -> list[Block]:
    """The section: text, figures, tables; ``shown`` has its pictures by file."""
    return [
        Heading("Speed against error", after_figures=True),
        Paragraph(finding(measurement)),
        Paragraph(_averages_text(measurement)),
        Paragraph(_horizon_text(measurement)),
        *(Figure(label, f"figures/{name}", shown[name].caption) for name, label in LABELS.items()),
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


def _methods(label: str, measurement: Record) -> Table:
    """The methods on the report's scene."""
    scene = measurement["scenes"][0]
    place = scene["checkpoints"].index(AFTER)
    return Table(
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


def _biases(label: str, measurement: Record) -> Table:
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
    return Table(
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
