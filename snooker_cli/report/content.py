"""Results -> the figures of this report, and the values in its text."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import yaml

from snooker_cli.figures import FIGURES, FigureData, Selection
from snooker_cli.figures.selection import distinct
from snooker_cli.formatting import listed, with_error
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.audit import Audit
from snooker_cli.report.setting_search import LIKELY, TARGETS
from snooker_cli.report.source_values import (
    COEFFICIENTS,
    LORD,
    SOURCE_VALUES,
    TITLE,
    OurValue,
)
from snooker_cli.report.supplements import MEASUREMENTS, measurement, sliding_figure
from snooker_cli.validation.accuracy_study import error_against_cost, error_growth
from snooker_cli.validation.physics_study import values as physics_values
from snooker_cli.validation.study import machine

if TYPE_CHECKING:
    from snooker_cli.runs import Run

Runs = Mapping[str, "Run"]
Record = Mapping[str, Any]

REPORT_FIGURES: dict[str, dict[str, Any]] = yaml.safe_load(
    (files("snooker_cli.report") / "figures.yaml").read_text(encoding="utf-8")
)
"""All figures by file; figures.yaml explains their keys."""

RUNS = (*dict.fromkeys(one["run"] for one in REPORT_FIGURES.values() if "run" in one), "audit")
"""The runs of this report: those of the configs with these names."""

PARTS = {
    "radius": "ball radius",
    "slip": "slip",
    "window": "fitted collisions",
    "elastic_wall": "wall",
    "fixed_amplitude": "amplitude",
    "extent": "rings",
}
"""The parts of a setting, in words."""


def figure_data(
    runs: Runs, figure: str, run: str = "", where: Record | None = None, label: str = ""
) -> FigureData:
    """A figure by its entry in figures.yaml."""
    if not run:
        draw = {"error-against-cost": error_against_cost, "error-growth": error_growth}[figure]
        found = measurement("error")
        return draw(found, found["scenes"][0])
    make = sliding_figure if figure == "sliding" else FIGURES[figure].make
    return make(runs[run], Selection(where or {}))


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
        "lord": 2 * LORD,
        "experiments": experiments,
        "scene": experiments["decay"],
        "balls": starting_scene(experiments["decay"], 0).number,
        "fits": fits,
        "fitted": lambda quantity: [
            with_error(one["value"], one["error"])
            for one in (chosen[cor, quantity, "exponential"] for cor in COEFFICIENTS)
        ],
        "fit": lambda cor, quantity, law="exponential": chosen[cor, quantity, law],
        "numbers": {file: picture.numbers for file, picture in pictures.items()},
        "measured": {name: measurement(name) for name in MEASUREMENTS},
        "swept": lambda name, key: [float(value) for value in distinct(runs[name].points, key)],
        "repeats_of": lambda name: len(runs[name].points) * experiments[name].repeats,
        "costs": _costs(audit),
        "scaled_copies": scaled_copies,
        "machine": machine,
        "physics": physics_values(measurement("physics")),
        "at_each": _at_each,
        "ours": lambda name: audit.row(name).ours,
        "value": _text,
        "zip": zip,
    }


def _text(ours: OurValue | None) -> str:
    return "" if ours is None else with_error(ours.value, ours.error)


def _at_each(texts: Sequence[str]) -> str:
    """``a at CoR 0.8 and b at CoR 0.9``."""
    return listed([f"{text} at CoR {cor:g}" for text, cor in zip(texts, COEFFICIENTS, strict=True)])


def scaled_copies(speeds: Sequence[float]) -> list[list[float]]:
    """Groups of speeds with ratios that are powers of two, by which doubles scale exactly."""
    groups: dict[float, list[float]] = {}
    for speed in speeds:
        groups.setdefault(math.frexp(speed)[0], []).append(speed)
    return [sorted(group) for group in groups.values() if len(group) > 1]


def _costs(audit: Audit) -> list[str]:
    """How much χ² another choice of each part of the best setting adds, in words."""
    # Three and five standard deviations of one number.
    found: dict[str, list[str]] = {"more than 25": [], "9 to 25": [], "less than 9": []}
    for part, words in PARTS.items():
        best = getattr(audit.best, part)
        others = [one.score for one in audit.search.profile if getattr(one, part) != best]
        cost = min(others, default=math.inf) - audit.best.score
        found["more than 25" if cost > 25 else "9 to 25" if cost > 9 else "less than 9"].append(
            words
        )
    return [f"{size} for {listed(parts)}" for size, parts in found.items() if parts]
