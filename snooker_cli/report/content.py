"""Results -> the figures, the tables and the values in the text of this report."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import yaml

from snooker_cli.figures import FIGURES, FigureData, Selection
from snooker_cli.figures.selection import distinct
from snooker_cli.formatting import listed, short, with_error
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.audit import (
    ALONE,
    EXPLAINED,
    FOLLOWS,
    REPRODUCED,
    UNEXPLAINED,
    Audit,
    AuditRow,
)
from snooker_cli.report.setting_search import LIKELY, TARGETS, Candidate
from snooker_cli.report.source_values import (
    COEFFICIENTS,
    LORD,
    TITLE,
    OurValue,
    SourceValue,
    source_value,
)
from snooker_cli.report.supplements import (
    MEASUREMENTS,
    error_figure,
    growth_figure,
    measurement,
    sliding_figure,
    sliding_values,
)
from snooker_cli.validation.physics_study import values as physics_values
from snooker_cli.validation.study import machine

if TYPE_CHECKING:
    from snooker_cli.runs import Run

Runs = Mapping[str, "Run"]
Record = Mapping[str, Any]


@dataclass(frozen=True)
class ReportFigure:
    """A figure: its label and a function that makes it from the runs."""

    label: str
    make: Callable[[Runs], FigureData]


def _figure(label: str, run: str, figure: str, where: Record | None = None) -> ReportFigure:
    """A figure of the registry, see figures.yaml."""
    selection = Selection(where or {})
    return ReportFigure(label, lambda runs: FIGURES[figure].make(runs[run], selection))


_OF_RUNS: dict[str, dict[str, Any]] = yaml.safe_load(
    (files("snooker_cli.report") / "figures.yaml").read_text(encoding="utf-8")
)
REPORT_FIGURES: dict[str, ReportFigure] = {
    **{file: _figure(**fields) for file, fields in _OF_RUNS.items()},
    "error-against-cost": ReportFigure("Figure 23", lambda runs: error_figure()),
    "error-growth": ReportFigure("Figure 24", lambda runs: growth_figure()),
    "sliding": ReportFigure(
        "Figure 25", lambda runs: sliding_figure(runs["sliding"], "ratio_caption")
    ),
    "sliding-text": ReportFigure(
        "Figure 26", lambda runs: sliding_figure(runs["sliding"], "ratio_text")
    ),
}
"""All figures by file."""

RUNS = (*dict.fromkeys(fields["run"] for fields in _OF_RUNS.values()), "sliding", "audit")
"""The runs of this report: those of the configs with these names."""


# Values in the text

_GROUPS: dict[str, str] = {
    "central distance": "distances",
    "pair distance": "distances",
    "momentum x": "momentum",
    "momentum y": "momentum",
    "mean speed": "mean speeds",
    "temperature ratio": "the ideal gas in the limit of small balls",
    "pressure ratio": "the ideal gas in the limit of small balls",
}
"""Names of properties in a list; without a name, the property itself."""

_PARTS = {
    "radius": "ball radius",
    "slip": "slip",
    "window": "fitted collisions",
    "elastic_wall": "wall",
    "fixed_amplitude": "amplitude",
    "extent": "rings",
}
"""The parts of a setting, in words."""


@dataclass(frozen=True)
class Results:
    """Everything that this report is made from.

    pictures : figure data by file
    fits : rows of the fits of the decay run
    """

    runs: Runs
    pictures: Mapping[str, FigureData]
    audit: Audit
    fits: Sequence[Record]

    def points(self, file: str) -> list[Any]:
        """The numbers of a figure's points."""
        points: list[Any] = self.pictures[file].numbers["points"]
        return points

    def fit(self, cor: float, quantity: str, law: str = "exponential") -> Record:
        """A row of the fits."""
        return next(
            one
            for one in self.fits
            if (one["parameters"]["cor"], one["quantity"], one["model"]) == (cor, quantity, law)
        )

    def ours(self, name: str) -> str:
        """Our value of a printed number for the stated scene."""
        return _text(self.audit.row(name).ours)


def _text(ours: OurValue | None) -> str:
    return "" if ours is None else with_error(ours.value, ours.error)


def values(results: Results) -> dict[str, Any]:
    """What templates/report.md.j2 refers to: results, and functions for text."""
    audit, runs = results.audit, results.runs
    counts = Counter(row.verdict for row in audit.rows)
    reproduced = [
        _GROUPS.get(row.number.quantity, row.number.quantity)
        for row in audit.rows
        if row.verdict == REPRODUCED
    ]
    targets = [source_value(name) for name in TARGETS]
    decays = [number for number in targets if "decay" in number.quantity]
    ratios = [audit.row(number.name).ours.value / number.value for number in decays]
    scene = runs["decay"].experiment
    below_1 = [one for one in results.fits if one["parameters"]["cor"] < 1]
    return {
        "title": TITLE,
        "audit": audit,
        "counts": {
            "reproduced": counts[REPRODUCED],
            "follows": counts[FOLLOWS],
            "explained": counts[EXPLAINED] + counts[ALONE],
            "unexplained": counts[UNEXPLAINED],
        },
        "reproduced": list(dict.fromkeys(reproduced)),
        "too_small": f"{min(ratios):.1f} to {max(ratios):.1f}",
        "best_decays": listed(
            [
                f"{short(ours.value, 3)} where it prints {number.printed}"
                for number in decays
                if (ours := audit.best.our_value(number)) is not None
            ]
        ),
        "path": source_value("mean_free_path"),
        "targets": targets,
        "likely": LIKELY,
        "lord": 2 * LORD,
        "scene": {**dict(scene), "number": starting_scene(scene, 0).number},
        "decay": {
            "k": [_fitted(results.fit(cor, "kinetic_energy")) for cor in COEFFICIENTS],
            "r_squared": [
                f"{results.fit(cor, 'kinetic_energy', 'haff')['r_squared']:.3f} instead of "
                f"{results.fit(cor, 'kinetic_energy')['r_squared']:.3f}"
                for cor in COEFFICIENTS
            ],
            "local": results.fit(COEFFICIENTS[0], "local_pressure"),
            "pressure": results.fit(COEFFICIENTS[0], "pressure"),
            "pairs": [
                (one, results.fit(one["parameters"]["cor"], one["quantity"], "haff"))
                for one in below_1
                if one["model"] == "exponential"
            ],
        },
        "copies": [
            f"those at {listed([f'{speed:g}' for speed in group])} m/s (figure {figure})"
            for figure, name in ((13, "temperature"), (18, "speeds"))
            for group in scaled_copies(_swept(runs[name], "balls.speed"))
        ],
        "search": _search_values(audit, runs["audit"]),
        "numbers": {file: picture.numbers for file, picture in results.pictures.items()},
        "restitution": runs["restitution"].experiment,
        "elastic_wall": runs["elastic-wall"].experiment,
        "zip": zip,
        "conclusion": {
            "holding": sum(one.holds for one in audit.claims),
            "found": [results.ours(f"energy_mean_{cor}") for cor in COEFFICIENTS],
            "theory": [results.ours(f"theory_{cor}") for cor in COEFFICIENTS],
            "alpha": [
                with_error(one["alpha"], one["alpha_error"])
                for one in results.points("decay-against-cor")
                if one["parameters"]["cor"] in COEFFICIENTS
            ],
        },
        "sliding": sliding_values(results.pictures),
        "measured": {name: measurement(name) for name in MEASUREMENTS},
        "machine": machine,
        "physics": physics_values(measurement("physics")),
        "at_each": _at_each,
        "ours": results.ours,
        "value": _text,
        "exact": _exact,
        "explanation": _explanation,
        "decimals": lambda one: [_decimals(one, number) for number in targets],
        "worst": _worst,
    }


def _fitted(row: Record) -> str:
    return with_error(row["value"], row["error"])


def _at_each(texts: Sequence[str]) -> str:
    """``a at CoR 0.8 and b at CoR 0.9``."""
    return listed([f"{text} at CoR {cor:g}" for text, cor in zip(texts, COEFFICIENTS, strict=True)])


def _swept(run: Run, key: str) -> list[float]:
    """The values of a swept key."""
    return [float(value) for value in distinct(run.points, key)]


def scaled_copies(speeds: Sequence[float]) -> list[list[float]]:
    """Groups of speeds with ratios that are powers of two, by which doubles scale exactly."""
    groups: dict[float, list[float]] = {}
    for speed in speeds:
        groups.setdefault(math.frexp(speed)[0], []).append(speed)
    return [sorted(group) for group in groups.values() if len(group) > 1]


def _search_values(audit: Audit, run: Run) -> dict[str, Any]:
    """What was searched, and how far that decides."""
    candidates = audit.search.candidates
    slips = dict.fromkeys(one.setting.slip.text for one in candidates)
    costs = {part: _cost(audit, part) for part in _PARTS}
    # Three and five standard deviations of one number.
    limits = (
        ("more than 25 for {}", 25.0, math.inf),
        ("9 to 25 for {}", 9.0, 25.0),
        ("less than 9 for {}", -math.inf, 9.0),
    )
    ranges = [
        (text, [_PARTS[part] for part, cost in costs.items() if low < cost <= high])
        for text, low, high in limits
    ]
    return {
        "radii": _alternatives(_swept(run, "balls.radius")),
        "extents": _alternatives(_swept(run, "balls.ring_extent")),
        "windows": _alternatives(sorted({one.setting.window for one in candidates})),
        "slips": [text.format(factor=f"{audit.search.factor:g}") for text in slips if text],
        "unranked": len(candidates) - len(audit.search.ranked),
        "repeats": len(run.points) * run.experiment.repeats,
        "costs": [text.format(listed(parts)) for text, parts in ranges if parts],
        "free": _text(audit.free),
    }


def _alternatives(numbers: Sequence[float]) -> str:
    """``0.1, 0.5 or 1``."""
    *others, last = [f"{one:g}" for one in numbers]
    return f"{', '.join(others)} or {last}" if others else last


def _cost(audit: Audit, part: str) -> float:
    """Difference in χ² between the best setting and the best with another choice of one part."""
    best = getattr(audit.best.setting, part)
    others = [one.score for one in audit.profile if getattr(one.setting, part) != best]
    return min(others, default=math.inf) - audit.best.score


def _exact(row: AuditRow) -> str:
    """Our value of an exact number: the number and our difference from it."""
    if row.ours.error > 0:
        return _text(row.ours)
    off = row.ours.value - row.number.value
    return row.number.digits + (f" {'+' if off > 0 else '−'} {short(abs(off), 1)}" if off else "")


def _explanation(row: AuditRow) -> str:
    """The best explanation of a number alone, and its value."""
    if row.explained is None or row.verdict == FOLLOWS:
        return row.explanation
    value = _text(row.explained) if row.explained.error > 0 else short(row.explained.value, 6)
    nearest = "" if row.explained.agrees(row.number) else "nearest: "
    return f"{nearest}{row.explanation}: {value}"


def _decimals(one: Candidate, number: SourceValue) -> str:
    """A setting's value with the printed decimals, at least one."""
    ours = one.our_value(number)
    return "–" if ours is None else f"{ours.value:.{max(number.decimals, 1)}f}"


def _worst(case: Record, name: str) -> str:
    """The largest error in an invariant of a hard case."""
    found = case["worst"].get(name)
    return short(found["error"], 2) if found else "–"
