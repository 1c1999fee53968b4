"""Finished runs -> the reproduction: its figures, the values in its text, and its files."""

import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from snooker_cli import theory
from snooker_cli.analysis.decay import decays, number_complete, range_held
from snooker_cli.analysis.fitting import (
    ENOUGH_REPEATS,
    FEW_REPEATS,
    LAWS,
    LEAST_PROBABILITY,
    holding,
)
from snooker_cli.analysis.observables import complete_repeats
from snooker_cli.analysis.predictions import (
    finite_haff_rate,
    haff_rate,
    scene_rates,
    scene_state,
)
from snooker_cli.analysis.run_analysis import fits
from snooker_cli.config import Experiment, Point, load
from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import setting
from snooker_cli.figures.cooling import decay_against_cor
from snooker_cli.files import write_json, write_text
from snooker_cli.formatting import listed, probability, short, with_error
from snooker_cli.live_page import live_page, report_scene
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.audit import (
    REPRODUCED,
    SETTLED,
    WINDOWS,
    Audit,
    AuditRow,
    InWindows,
    audit,
    in_windows,
)
from snooker_cli.report.document import Pages, packaged
from snooker_cli.report.explanations import COMBINATIONS, DRAWS, GROUP, chi_square_limit, explain
from snooker_cli.report.source_values import (
    AGREES,
    COEFFICIENTS,
    LORD,
    SOURCE_VALUES,
    TARGETS,
    TITLE,
    Sample,
    at_each_coefficient,
    value_text,
)
from snooker_cli.runs import Run, open_run
from snooker_cli.runs.progress import counting
from snooker_cli.trace import SLIDE, StopReason
from snooker_cli.validation.accuracy_study import error_against_cost, error_growth
from snooker_cli.validation.physics_study import walls
from snooker_cli.validation.study import machine

Runs = Mapping[str, "Run"]
Record = Mapping[str, Any]

REPORT_FIGURES: dict[str, dict[str, Any]] = yaml.safe_load(packaged("figures.yaml"))
"""All figures by file; figures.yaml explains their keys."""

RUNS = (
    *dict.fromkeys(entry["run"] for entry in REPORT_FIGURES.values() if "run" in entry),
    *("mixed", "audit", "ring-extent", "tiny-rings", "tiny-mixed"),
)
"""The runs of the reproduction: those of the configs with these names."""


def figure_data(
    runs: Runs, figure: str, run: str = "", where: Record | None = None, label: str = ""
) -> FigureData:
    """A figure by its entry in figures.yaml."""
    if not run:
        draw = {"error-against-cost": error_against_cost, "error-growth": error_growth}[figure]
        record = measurement("error")
        return draw(record, record["scenes"][0])
    if figure == "sliding":
        return sliding_figure(runs[run], Selection(where or {}))
    spec = FIGURES[figure]
    if figure == "decay-against-cor":
        spec = replace(spec, draw=partial(decay_against_cor, source=True))
    return spec.make(runs[run], Selection(where or {}))


def values(
    runs: Runs, pictures: Mapping[str, FigureData], audit: Audit, fits: Sequence[Record]
) -> dict[str, Any]:
    """What templates/report.md.j2 refers to: results, and functions that choose among them.

    pictures : figure data by file
    fits : rows of the fits of the decay run
    """
    experiments = {name: run.experiment for name, run in runs.items()}
    chosen = {(row["parameters"]["cor"], row["quantity"], row["model"]): row for row in fits}
    tiny = tiny_balls_in_windows(runs)
    return {
        "title": TITLE,
        "audit": audit,
        "verdicts": Counter(row.verdict for row in audit.rows),
        "source": SOURCE_VALUES,
        "coefficients": COEFFICIENTS,
        "targets": TARGETS,
        "reproduced": reproduced(audit),
        "refused": LEAST_PROBABILITY,
        "few": {law: [chosen[cor, "kinetic_energy", law] for cor in COEFFICIENTS] for law in LAWS},
        "many": [
            {"parameters": {"cor": cor}, **laws["kinetic_energy", "haff"].as_json()}
            for cor, laws in audit.stated.laws.items()
        ],
        "fit_cells": _fit_cells,
        "holding": holding,
        "enough": ENOUGH_REPEATS,
        "few_repeats": FEW_REPEATS,
        "group": GROUP,
        "draws": DRAWS,
        "chi_square": chi_square_limit(len(TARGETS)),
        "agrees": AGREES,
        "combinations": len(COMBINATIONS),
        "factors": _source_factors(audit),
        "two_digits": _two_digits,
        "slower": slower_pressure(audit),
        "slopes": [value_text(one) for one in audit.stated.mean_pressure_slopes.values()],
        "slope_shares": [
            f"{100 * abs(2 * one.value - 1):.0f} %"
            for one in audit.stated.mean_pressure_slopes.values()
        ],
        "settled": SETTLED,
        "not_exponential": max(
            laws[quantity, "exponential"].goodness.probability
            for laws in audit.stated.laws.values()
            for quantity in ("kinetic_energy", "pressure")
        ),
        "windows": WINDOWS,
        "tiny_windows": tiny,
        "tiny_off": partial(_largest_deviations, tiny),
        "mixed": mixed_starts(runs["mixed"]),
        "stated_rates": scene_rates(audit.stated.scene, 1.0),
        "kinetic_theory": {
            entry["run"]: kinetic_theory(runs[entry["run"]], pictures[file].numbers["points"])
            for file, entry in REPORT_FIGURES.items()
            if entry["figure"] == "decay-against-cor"
        },
        "steady": steady_pressures(pictures["steady"].numbers["points"]),
        "bulk_share": _bulk_share(experiments["profiles"]),
        "last_rates": last_rates(pictures["haff-time"].numbers["points"]),
        "lord": 2 * LORD,
        "experiments": experiments,
        "scene": experiments["decay"],
        "balls": starting_scene(experiments["decay"], 0).number,
        "fits": fits,
        "fitted": lambda quantity: [
            with_error(row["value"], row["error"])
            for row in (chosen[cor, quantity, "exponential"] for cor in COEFFICIENTS)
        ],
        "fit": lambda cor, quantity, law="exponential": chosen.get((cor, quantity, law)),
        "figures": REPORT_FIGURES,
        "rounding": rounding_differences(),
        "numbers": {file: picture.numbers for file, picture in pictures.items()},
        "measured": {name: measurement(name) for name in MEASUREMENTS},
        "machine": machine,
        "walls": walls,
        "at_each": at_each_coefficient,
        "ours": lambda name: audit.row(name).ours,
        "value": value_text,
        "zip": zip,
    }


def _two_digits(values: Sequence[float]) -> list[str]:
    """Factors as text."""
    return [f"{value:.2f}" for value in values]


_GROUPS = {
    "central distance": "distances",
    "pair distance": "distances",
    "momentum x": "components of the momentum",
    "momentum y": "components of the momentum",
    "mean speed": "mean speeds",
    "temperature ratio": "ratios to the ideal gas in the limit of small balls",
    "pressure ratio": "ratios to the ideal gas in the limit of small balls",
}
"""Quantities of which the source report prints several numbers that are named together."""


def reproduced(audit: Audit) -> str:
    """The printed numbers that agree with the stated scene, in words: "density, both distances"."""
    groups: dict[str, list[AuditRow]] = {}
    for row in audit.rows:
        groups.setdefault(_GROUPS.get(row.number.quantity, row.number.quantity), []).append(row)
    words = ["no", "one", "two", "three", "four"]
    texts = []
    for name, rows in groups.items():
        agree = sum(row.verdict == REPRODUCED for row in rows)
        if agree == len(rows):
            texts.append(f"{words[agree]} {name}" if name in _GROUPS.values() else name)
        elif agree:
            off = [
                f"at CoR {row.number.cor:g} it is {row.number.digits} {row.number.unit}, "
                f"ours {value_text(row.ours)} {row.number.unit}"
                for row in rows
                if row.verdict != REPRODUCED
            ]
            texts.append(f"{words[agree]} of {words[len(rows)]} {name} ({listed(off)})")
    return listed(texts)


def _fit_cells(row: Record | None) -> list[str]:
    """The cells of a fit in table 1; dashes without one."""
    if row is None:
        return ["–"] * 4
    value, spread = with_error(row["value"], row["error"]), short(row["max_min_half_range"], 2)
    return [value, spread, probability(row["probability"]), range_held(row)]


def source_factors(
    restitution: float,
    contact_value: float,
    ball_ball_rate: float,
    wall_restitution: float,
    wall_rate: float,
    speed_ratio: float,
) -> dict[str, float]:
    """The mistakes of equations 6 and 7 of the source report in words, and their factors of k.

    The product is −2 ln(e) u √2 n 2πr over ζ of `theory.cooling_rate`, with the mean speed u over
    the collisions: a ball loses −ln(e²) instead of (1 − e²)(1 + 3a2/16)/2 in a collision, and has
    ω = √2 n 4r χ⟨v⟩ of them per second at the start, ⟨v⟩ = √(πT/2m). χ is the contact value, u/⟨v⟩
    the speed ratio; the rates (1/s) are those of `theory.cooling_rate`.
    """
    pairs = theory.cooling_rate(restitution, ball_ball_rate)
    both = theory.cooling_rate(restitution, ball_ball_rate, wall_restitution, wall_rate)
    loss = -2 * math.log(restitution) * ball_ball_rate / pairs
    return {
        "all energy falls to e² in a collision; only the normal motion loses that much": loss,
        "the cross-section is 2πr; that of disks is 4r": math.pi / 2,
        "balls are points between collisions; their size makes collisions more frequent": 1
        / contact_value,
        "the wall takes no energy": pairs / both,
        "the speed is the mean over all collisions; that at the start is higher": speed_ratio,
    }


def _source_factors(audit: Audit) -> list[tuple[str, list[float]]]:
    """The mistakes of the source report's formula for k and what they do to it, by CoR.

    Three rows follow: their product, the formula's k over the loss ζ of kinetic theory at the
    start; the fitted k over that loss; and the formula's k over the fitted one.
    """
    scene = audit.stated.scene
    warm = scene.kinetic_energy / scene.number
    rates = scene_rates(scene, warm)
    assert rates is not None
    contact = theory.contact_value(scene.packing_fraction)
    factors, left = [], []
    for cor in COEFFICIENTS:
        speed = audit.row(f"speed_{cor}").ours.value / theory.maxwell_mean_speed(warm)
        losses = rates.ball_ball, cor, rates.wall
        factors.append(source_factors(cor, contact, *losses, speed))
        formula, fitted = audit.row(f"theory_{cor}").ours, audit.row(f"energy_mean_{cor}").ours
        left.append(formula.value / fitted.value)
    products = [math.prod(by_mistake.values()) for by_mistake in factors]
    return [
        *((text, [by_mistake[text] for by_mistake in factors]) for text in factors[0]),
        ("product: k of the formula over the loss at the start", products),
        ("fitted k over the loss at the start", list(np.divide(products, left))),
        ("k of the formula over the fitted k", left),
    ]


def slower_pressure(audit: Audit) -> list[str]:
    """The fitted rate of the mean pressure over that of the energy, over the repeats, by CoR."""
    texts = []
    for laws in audit.stated.laws.values():
        names = "pressure_amplitude_1", "kinetic_energy"
        pairs = zip(*(laws[name, "exponential"].fits for name in names), strict=True)
        texts.append(
            value_text(Sample(pressure.value / energy.value for pressure, energy in pairs))
        )
    return texts


def mixed_starts(run: Run) -> list[dict[str, Any]]:
    """Haff's α of repeats that start mixed, beside kinetic theory's; a row for each CoR.

    Keys: ``cor``; ``stated`` and ``elastic``, for the wall: α and its error, 1/s, and what Enskog's
    rates (``enskog``) and those of N balls in the container (``finite``) exceed it by, as shares;
    ``share`` is the error as a share of α.
    """
    rows: dict[float, dict[str, Any]] = {}
    for point in run.points:
        scene = starting_scene(point.experiment, 0)
        (haff,) = (
            decay for decay in decays(run.traces(point), ("kinetic_energy",)) if decay.law == "haff"
        )
        alpha, error = haff.over_repeats.value, haff.over_repeats.error
        enskog, finite = haff_rate(scene), finite_haff_rate(scene)
        assert enskog is not None
        assert finite is not None
        wall = "elastic" if scene.wall_restitution == 1.0 else "stated"
        row = {"alpha": alpha, "error": error, "complete": number_complete(haff.ended)}
        row |= {"enskog": enskog / alpha - 1, "finite": finite / alpha - 1, "share": error / alpha}
        rows.setdefault(scene.restitution, {"cor": scene.restitution})[wall] = row
    return [*rows.values()]


def tiny_balls_in_windows(runs: Runs) -> list[tuple[str, float, InWindows]]:
    """Tiny balls from rings and from mixed starts in windows of time: start, CoR, result."""
    found = []
    for start in ("rings", "mixed"):
        run = runs[f"tiny-{start}"]
        for point in run.points:
            traces = complete_repeats(run.traces(point))
            found.append((start, float(point.experiment.cor), in_windows(traces)))
    return found


def _largest_deviations(found: Sequence[tuple[str, float, InWindows]], start: str) -> str:
    """The largest deviation of PV/(NT) from theory for a start, by CoR, in words."""
    texts = []
    for cor, one in ((cor, one) for name, cor, one in found if name == start):
        most = max(one.ratios, key=lambda ratio: abs(ratio.value - one.theory))
        percent = with_error(100 * abs(most.value - one.theory), 100 * most.error)
        texts.append(f"{percent} % at CoR {cor:g}")
    return listed(texts)


def rounding_differences() -> list[dict[str, Any]]:
    """What averages differ by if starts differ by one rounding, for each scene and quantity.

    Keys: ``quantity``, ``unit``, ``what`` (the scene); ``difference`` and ``error``; ``share``, the
    error over the mean; ``in_errors``, the absolute difference in errors.
    """
    rows = []
    for scene in measurement("certain")["rounding"]:
        for bias in scene["methods"][1]["biases"]:
            quantity, unit = bias["quantity"].split(", ")
            difference, error = bias["difference"], bias["difference_error"]
            row = {"quantity": quantity, "unit": unit, "what": scene["what"]}
            row |= {"difference": difference, "error": error}
            rows.append(row | {"share": error / bias["mean"], "in_errors": abs(difference) / error})
    return rows


def kinetic_theory(run: Run, points: Sequence[Record]) -> list[dict[str, Any]]:
    """Kinetic theory's α beside the fitted one, by CoR, for the points of a figure over the CoR.

    Keys: ``cor``; ``theory``, 1/s; ``excess`` of theory, as a share; ``size``, its absolute value;
    ``in_errors``, the excess in standard errors of the fitted mean.
    """
    rows = []
    scenes = {point.experiment.cor: starting_scene(point.experiment, 0) for point in run.points}
    for record in points:
        scene = scenes[record["parameters"]["cor"]]
        alpha = haff_rate(scene)
        assert alpha is not None
        excess = alpha - record["alpha"]
        share, in_errors = excess / record["alpha"], excess / record["alpha_error"]
        row = {"cor": scene.restitution, "theory": alpha, "excess": share, "in_errors": in_errors}
        rows.append(row | {"size": abs(share)})
    return rows


def last_rates(points: Sequence[Record]) -> list[dict[str, Any]]:
    """Figure 21's last decay rates less Haff's with the fitted α, in standard errors, by CoR."""
    rows = []
    for record in points:
        less = record["last_rate"] - record["fitted_last_rate"]
        errors = less / record["last_rate_error"]
        rows.append({"cor": record["parameters"]["cor"], "in_errors": errors})
    return rows


# Beyond the source report: saved measurements, figure 17 past its wall traps, and in a warm gas


def steady_pressures(points: Sequence[Record]) -> list[dict[str, Any]]:
    """The points of figure 27 by radius, with falling CoR.

    Keys: those of a point; ``cor``, ``radius``; ``colder`` and ``weaker`` with their errors, what T
    and PV/NT of elastic balls of this radius exceed its own by, as factors; ``excess`` of PV/NT
    over theory for N disks, its error and its ``size``, as shares.
    """
    rows: list[dict[str, Any]] = []
    for record in reversed(points):
        cor, radius = (record["parameters"][key] for key in ("cor", "balls.radius"))
        row = {**record, "cor": cor, "radius": radius}
        elastic = row if cor == 1 else next(other for other in rows if other["radius"] == radius)
        for name, column in (("colder", "temperature"), ("weaker", "virial")):
            row[name], row[f"{name}_error"] = _factor(column, elastic, row)
        row["excess"] = row["virial"] / row["theory_here"] - 1
        row["excess_error"] = row["virial_error"] / row["theory_here"]
        row["size"] = abs(row["excess"])
        rows.append(row)
    return sorted(rows, key=lambda row: float(row["radius"]))


def _factor(column: str, above: Record, below: Record) -> tuple[float, float]:
    """The ratio of a column of two points, whose repeats are independent, and its error."""
    ratio = above[column] / below[column]
    shares = [one[f"{column}_error"] / one[column] for one in (above, below)]
    return ratio, ratio * math.hypot(*shares)


def _bulk_share(experiment: Experiment) -> float:
    """Density of elastic disks far from the wall, over the mean one of their centres, by theory."""
    scene = starting_scene(experiment, 0)
    state, radius = scene_state(scene, 1.0), float(scene.radii[0])
    assert state is not None
    covered = scene.number * math.pi * radius**2
    return state.bulk_packing * scene.container.accessible(radius).area / covered


MEASUREMENTS = ("error", "hard", "billion", "physics", "certain")
"""Saved measurements of ``snooker bench``, and of ``tests/make_certain.py``; billion is a hard case
of its own."""


@cache
def measurement(name: str) -> dict[str, Any]:
    """A saved measurement."""
    return dict(json.loads(packaged(f"measured/{name}.json")))


def sliding_figure(run: Run, selection: Selection) -> FigureData:
    """Figure 17's axes for balls that start twice, with ``collapse: stop`` and ``slide``.

    Raises ``FigureError`` if the run lacks such pairs.
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
    return replace(
        picture,
        title=picture.title.replace(
            "Simulated over ideal pressure", "Pressure ratio past wall traps"
        ),
        caption="As figure 17, in a fixed container, each start with collapse: stop and slide. "
        "Filled: at the mean temperature; open: at the final one. Table 11 has the numbers. "
        + setting(run, points, selection),
        numbers={**picture.numbers, "pairs": pairs},
    )


def _pair(run: Run, stopped: Point, slid: Point) -> dict[str, Any]:
    """When the traps of a point come, and what the same starts do with sliding balls."""
    stopping, sliding = list(run.traces(stopped)), list(run.traces(slid))
    trapped = [trace for trace in stopping if trace.stop.reason is StopReason.WALL_TRAP]
    events = [trace.events for trace in sliding if trace.events is not None]
    return {
        "cor": stopped.experiment.cor,
        "radius": float(stopping[0].start.radii[0]),
        "repeats": len(stopping),
        "trapped": len(trapped),
        "trap_time": _mean(trace.stop.time for trace in trapped),
        "trap_collisions": _mean(trace.collisions for trace in trapped),
        "sliding_balls": _mean(len(np.unique(columns.i[columns.j == SLIDE])) for columns in events),
        "complete": sum(trace.stop.reason.complete for trace in sliding),
        "end_time": _mean(trace.stop.time for trace in sliding),
        "end_collisions": _mean(trace.collisions for trace in sliding),
    }


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values) or [math.nan]))


def build(runs: Path, out: Path, report_progress: Callable[[str], None]) -> list[Path]:
    """Write the report and return the files that a reader opens.

    Raises ``RunError``, ``StoreError``, ``FigureError`` or ``UserError``.
    """
    opened = {name: open_run(runs / name) for name in RUNS}
    # The other process makes the explanations, then draws. This one has all other fits, made once.
    with Pages(out) as pages:
        audited = [opened["audit"], opened["ring-extent"]]
        explaining = pages.other.submit(explain, audited, opened["temperature"])
        pictures = {}
        for file, entry in REPORT_FIGURES.items():
            report_progress(entry["label"])
            picture = figure_data(opened, **entry)
            pictures[file] = pages.add_figure(file, picture, entry["label"])
        decays = fits(opened["decay"], counting=counting).rows
        report_progress("audit: every printed number compared with ours")
        judged = audit(opened, explaining.result())
        for point in opened["decay"].points:
            pages.add_player(opened["decay"], point)
        numbers = {
            "figures": {name: picture.numbers for name, picture in pictures.items()},
            "audit": judged.as_json(),
            "fits": decays,
        }
        # exp, log and pow differ in their last bits between processors, fits in the seventh digit.
        six_digits = json.loads(json.dumps(numbers), parse_float=lambda x: float(f"{float(x):.6g}"))
        write_json(out / "numbers.json", six_digits)
        report_progress("pages")
        content = values(opened, pictures, judged, decays)
        write_text(out / "live.html", live_page(load(report_scene())))
        written = pages.write("report.md.j2", content)
        return [*written, out / "numbers.json", out / "live.html"]
