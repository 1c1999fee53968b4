"""Results -> the figures of the reproduction, and the values in its text."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import yaml

from snooker_cli import theory
from snooker_cli.analysis.decay import range_held
from snooker_cli.analysis.fitting import LAWS, LEAST_PROBABILITY
from snooker_cli.analysis.predictions import haff_rate, scene_rates
from snooker_cli.figures import FIGURES, FigureData, Selection
from snooker_cli.figures.cooling import decay_against_cor
from snooker_cli.figures.selection import distinct
from snooker_cli.formatting import listed, with_error
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.audit import Audit
from snooker_cli.report.packaged import packaged
from snooker_cli.report.setting_search import DECIDED, FREEDOM, LIKELY, PARTS, RESAMPLES, TARGETS
from snooker_cli.report.source_values import COEFFICIENTS, LORD, SOURCE_VALUES, TITLE, value_text
from snooker_cli.report.supplements import MEASUREMENTS, measurement, sliding_figure
from snooker_cli.runs import Run
from snooker_cli.validation.accuracy_study import error_against_cost, error_growth
from snooker_cli.validation.study import machine

Runs = Mapping[str, "Run"]
Record = Mapping[str, Any]

REPORT_FIGURES: dict[str, dict[str, Any]] = yaml.safe_load(packaged("figures.yaml"))
"""All figures by file; figures.yaml explains their keys."""

RUNS = (*dict.fromkeys(one["run"] for one in REPORT_FIGURES.values() if "run" in one), "audit")
"""The runs of the reproduction: those of the configs with these names."""


def figure_data(
    runs: Runs, figure: str, run: str = "", where: Record | None = None, label: str = ""
) -> FigureData:
    """A figure by its entry in figures.yaml."""
    if not run:
        draw = {"error-against-cost": error_against_cost, "error-growth": error_growth}[figure]
        found = measurement("error")
        return draw(found, found["scenes"][0])
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
    chosen = {(one["parameters"]["cor"], one["quantity"], one["model"]): one for one in fits}
    return {
        "title": TITLE,
        "audit": audit,
        "verdicts": Counter(row.verdict for row in audit.rows),
        "source": SOURCE_VALUES,
        "coefficients": COEFFICIENTS,
        "targets": TARGETS,
        "likely": LIKELY,
        "refused": LEAST_PROBABILITY,
        "few": {law: [chosen[cor, "kinetic_energy", law] for cor in COEFFICIENTS] for law in LAWS},
        "many": [
            {"parameters": {"cor": cor}, **laws["kinetic_energy", "haff"].as_json()}
            for cor, laws in audit.stated.laws.items()
        ],
        "range_held": range_held,
        "freedom": FREEDOM,
        "parts": PARTS,
        "resamples": RESAMPLES,
        "decided": DECIDED,
        "factors": _source_factors(audit),
        "stated_rates": scene_rates(audit.stated.scene, 1.0),
        "kinetic_theory": {
            entry["run"]: kinetic_theory(runs[entry["run"]], pictures[file].numbers["points"])
            for file, entry in REPORT_FIGURES.items()
            if entry["figure"] == "decay-against-cor"
        },
        "last_rates": last_rates(pictures["haff-time"].numbers["points"]),
        "lord": 2 * LORD,
        "experiments": experiments,
        "scene": experiments["decay"],
        "balls": starting_scene(experiments["decay"], 0).number,
        "fits": fits,
        "fitted": lambda quantity: [
            with_error(one["value"], one["error"])
            for one in (chosen[cor, quantity, "exponential"] for cor in COEFFICIENTS)
        ],
        "fit": lambda cor, quantity, law="exponential": chosen.get((cor, quantity, law)),
        "numbers": {file: picture.numbers for file, picture in pictures.items()},
        "measured": {name: measurement(name) for name in MEASUREMENTS},
        "swept": lambda name, key: [float(value) for value in distinct(runs[name].points, key)],
        "repeats_of": lambda name: len(runs[name].points) * experiments[name].repeats,
        "machine": machine,
        "at_each": _at_each,
        "ours": lambda name: audit.row(name).ours,
        "value": value_text,
        "zip": zip,
    }


def _at_each(texts: Sequence[str]) -> str:
    """``a at CoR 0.8 and b at CoR 0.9``."""
    return listed([f"{text} at CoR {cor:g}" for text, cor in zip(texts, COEFFICIENTS, strict=True)])


def _source_factors(audit: Audit) -> dict[str, Any]:
    """The mistakes of the source report's formula for k, in words, and what is left of them."""
    scene = audit.stated.scene
    rates = scene_rates(scene, scene.kinetic_energy / scene.number)
    assert rates is not None
    contact = theory.contact_value(scene.packing_fraction)
    each = [
        theory.source_factors(cor, contact, rates.ball_ball, cor, rates.wall)
        for cor in COEFFICIENTS
    ]
    left = [
        audit.row(f"theory_{cor}").ours.value / audit.row(f"energy_mean_{cor}").ours.value
        for cor in COEFFICIENTS
    ]
    texts: dict[str, Any] = {"left": _at_each([f"{one:.2f}" for one in left])}
    for name in theory.SourceFactors._fields:
        values = [f"{max(one, 1 / one):.2f}" for one in (getattr(row, name) for row in each)]
        texts[name] = values[0] if len(set(values)) == 1 else _at_each(values)
    # Less than half of the least mistake in the logarithm.
    return texts | {"cancel": all(abs(math.log(one)) < math.log(math.pi / 2) / 2 for one in left)}


def kinetic_theory(run: Run, points: Sequence[Record]) -> list[dict[str, Any]]:
    """Kinetic theory's α beside the fitted one, by CoR, for the points of a figure over the CoR.

    Keys: ``cor``; ``theory``, 1/s; ``excess`` of theory, as a share; ``size``, its absolute value;
    ``in_errors``, the excess in standard errors of the fitted mean.
    """
    rows = []
    scenes = {point.experiment.cor: starting_scene(point.experiment, 0) for point in run.points}
    for one in points:
        scene = scenes[one["parameters"]["cor"]]
        alpha = haff_rate(scene)
        assert alpha is not None
        share, in_errors = ((alpha - one["alpha"]) / one[key] for key in ("alpha", "alpha_error"))
        row = {"cor": scene.restitution, "theory": alpha, "excess": share, "in_errors": in_errors}
        rows.append(row | {"size": abs(share)})
    return rows


def last_rates(points: Sequence[Record]) -> list[dict[str, Any]]:
    """Figure 21's last decay rates less Haff's with the fitted α, in standard errors, by CoR."""
    return [
        {
            "cor": one["parameters"]["cor"],
            "in_errors": (one["last_rate"] - one["fitted_last_rate"]) / one["last_rate_error"],
        }
        for one in points
    ]
