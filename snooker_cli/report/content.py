"""Results -> the figures, the tables and the values in the text of this report."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from snooker_cli.figures import FIGURES, FigureData, Selection
from snooker_cli.figures.selection import distinct
from snooker_cli.formatting import listed, short, with_error
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report import supplements
from snooker_cli.report.audit import (
    ALONE,
    EXPLAINED,
    FOLLOWS,
    REPRODUCED,
    UNEXPLAINED,
    Audit,
    AuditRow,
)
from snooker_cli.report.document import Table, TableColumn
from snooker_cli.report.setting_search import LIKELY, TARGETS, Candidate
from snooker_cli.report.source_values import (
    COEFFICIENTS,
    LORD,
    TITLE,
    OurValue,
    SourceQuantity,
    SourceValue,
    source_value,
)

if TYPE_CHECKING:
    from snooker_cli.runs import Run

Runs = Mapping[str, "Run"]
Record = Mapping[str, Any]

RUNS = (
    "decay",
    "temperature",
    "area",
    "number",
    "radius",
    "dilute",
    "speeds",
    "restitution",
    "elastic-wall",
    "sliding",
    "audit",
)
"""The runs of this report: those of the configs with these names."""


# Figures


@dataclass(frozen=True)
class ReportFigure:
    """A figure: its label and a function that makes it from the runs."""

    label: str
    make: Callable[[Runs], FigureData]


def _figure(label: str, run: str, name: str, **where: Any) -> ReportFigure:
    """A figure of the registry; ``__`` in a key of ``where`` stands for a dot."""
    selection = Selection({key.replace("__", "."): value for key, value in where.items()})
    return ReportFigure(label, lambda runs: FIGURES[name].make(runs[run], selection))


def _source_figures() -> Iterator[tuple[str, ReportFigure]]:
    """The figures of the source report, by file."""
    shown: tuple[tuple[str, str, dict[str, Any]], ...] = (
        ("decay", "central-distances", {"cor": 1.0}),
        ("decay", "pair-distances", {"cor": 1.0}),
        ("decay", "energy", {}),
        ("decay", "momentum-x", {}),
        ("decay", "momentum-y", {}),
        ("decay", "energy-fit", {"cor": 0.8}),
        ("decay", "energy-fit", {"cor": 0.9}),
        ("decay", "temperature-fit", {"cor": 0.8}),
        ("decay", "temperature-fit", {"cor": 0.9}),
        ("decay", "pressure", {}),
        ("decay", "pressure-fit", {"cor": 0.8}),
        ("decay", "pressure-fit", {"cor": 0.9}),
        ("temperature", "pressure-temperature", {}),
        ("area", "pressure-area", {}),
        ("number", "pressure-number", {}),
        ("radius", "temperature-ratio", {}),
        ("dilute", "ideal-ratio", {"balls__radius": source_value("ratio_caption").radius}),
        ("speeds", "speeds", {}),
    )
    for number, (run, name, where) in enumerate(shown, start=1):
        yield f"fig{number:02d}", _figure(f"Figure {number}", run, name, **where)


REPORT_FIGURES: dict[str, ReportFigure] = {
    **dict(_source_figures()),
    "fig17-text": _figure(
        "Figure 17, text",
        "dilute",
        "ideal-ratio",
        balls__radius=source_value("ratio_text").radius,
    ),
    "decay-against-cor": _figure("Figure 19", "restitution", "decay-against-cor"),
    "decay-elastic-wall": _figure("Figure 20", "elastic-wall", "decay-against-cor"),
    "haff-time": _figure("Figure 21", "elastic-wall", "haff-time"),
    "event-decay": _figure("Figure 22", "elastic-wall", "event-decay"),
    "error-against-cost": ReportFigure("Figure 23", lambda runs: supplements.error_figure()),
    "error-growth": ReportFigure("Figure 24", lambda runs: supplements.growth_figure()),
    "sliding": ReportFigure(
        "Figure 25", lambda runs: supplements.sliding_figure(runs["sliding"], "ratio_caption")
    ),
    "sliding-text": ReportFigure(
        "Figure 26", lambda runs: supplements.sliding_figure(runs["sliding"], "ratio_text")
    ),
}
"""All figures by file. The source report has 1 to 18; 17 twice, for its two radii."""


# Values in the text

_GROUPS: dict[SourceQuantity, str] = {
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


def _text(ours: OurValue) -> str:
    return with_error(ours.value, ours.error)


def values(results: Results) -> dict[str, Any]:
    """What templates/report.md.j2 refers to."""
    audit, runs = results.audit, results.runs
    counts = Counter(row.verdict for row in audit.rows)
    reproduced = [
        _GROUPS.get(row.number.quantity, row.number.quantity)
        for row in audit.rows
        if row.verdict == REPRODUCED
    ]
    decays = [source_value(name) for name in TARGETS if "decay" in source_value(name).quantity]
    ratios = [audit.row(number.name).ours.value / number.value for number in decays]
    scene = runs["decay"].experiment
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
        "at_each": _at_each,
        "targets": TARGETS,
        "likely": LIKELY,
        "lord": 2 * LORD,
        "scene": {**dict(scene), "number": starting_scene(scene, 0).number},
        "energy": {
            "k": [_fitted(results.fit(cor, "kinetic_energy")) for cor in COEFFICIENTS],
            "repeats": scene.repeats,
            "r_squared": [
                f"{results.fit(cor, 'kinetic_energy', 'haff')['r_squared']:.3f} instead of "
                f"{results.fit(cor, 'kinetic_energy')['r_squared']:.3f}"
                for cor in COEFFICIENTS
            ],
        },
        "pressure": {
            "cor": COEFFICIENTS[0],
            "elastic": results.ours("pressure"),
            "local": _fitted(results.fit(COEFFICIENTS[0], "local_pressure")),
            "mean": _fitted(results.fit(COEFFICIENTS[0], "pressure")),
        },
        "ideal": {
            "early": sum(
                results.pictures[file].numbers["ended_early"] for file in ("fig17", "fig17-text")
            ),
            "repeats": sum(
                point["repeats"]
                for file in ("fig17", "fig17-text")
                for point in results.points(file)
                if point["parameters"]["cor"] < 1
            ),
        },
        "copies": [
            f"those at {listed([f'{speed:g}' for speed in group])} m/s (figure {figure})"
            for figure, name in ((13, "temperature"), (18, "speeds"))
            for group in scaled_copies(_swept(runs[name], "balls.speed"))
        ],
        "search": _search_values(audit, runs["audit"]),
        "beyond": _beyond_values(results),
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
        **supplements.values(results.pictures),
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


def _beyond_values(results: Results) -> dict[str, Any]:
    """Results for many coefficients."""
    points = results.points("decay-against-cor")
    rates = results.points("haff-time")
    return {
        "stated": results.runs["restitution"].experiment,
        "elastic": results.runs["elastic-wall"].experiment,
        "cors": [point.experiment.cor for point in results.runs["restitution"].points],
        "early": sum(one["ended_early"] for one in points),
        "total": sum(one["repeats"] for one in points),
        "lowest": results.points("event-decay")[0],
        "rates": [
            f"from {short(one['first_rate'], 2)} to {short(one['last_rate'], 2)} 1/s at CoR "
            f"{one['parameters']['cor']:g}"
            for one in (rates[0], rates[-1])
        ],
    }


# Tables


def tables(results: Results) -> dict[str, Table]:
    """All tables by name."""
    return {
        "decay_constants": _decay_constants(results.fits),
        "audit": _audit_rows(results.audit),
        "settings": _settings(results.audit),
        "claims": _claims(results.audit),
        "coefficients": _coefficients(results),
        **supplements.tables(),
    }


def _decay_constants(fits: Sequence[Record]) -> Table:
    """The fits to the stated scene."""
    found = {(one["parameters"]["cor"], one["quantity"], one["model"]): one for one in fits}
    rows = []
    for cor, quantity, model in found:
        if cor < 1.0 and model == "exponential":
            cells = [f"{cor:g}", quantity.replace("_", " ")]
            for law in ("exponential", "haff"):
                one = found[cor, quantity, law]
                half_range, r_squared = one["max_min_half_range"], one["r_squared"]
                cells += [_fitted(one), short(half_range, 2), f"{r_squared:.3f}"]
            rows.append(cells)
    columns = [
        TableColumn("CoR", 0.5),
        TableColumn("quantity", 1.4, right=False),
        TableColumn("k, 1/s", 1.3),
        TableColumn("half range, 1/s", 1.1),
        TableColumn("R²", 0.7),
        TableColumn("α, 1/s", 1.3),
        TableColumn("half range, 1/s", 1.1),
        TableColumn("R²", 0.7),
    ]
    return Table(columns, rows)


def _audit_rows(audit: Audit) -> Table:
    """Every printed number."""
    columns = [
        TableColumn("where", 1.2, right=False),
        TableColumn("what", 2.7, right=False),
        TableColumn("unit", 0.65, right=False),
        TableColumn("printed", 1.45),
        TableColumn("as stated", 1.65),
        TableColumn("common setting", 1.6),
        TableColumn("best by itself", 2.8, right=False),
        TableColumn("verdict", 1.35, right=False),
    ]
    rows = [
        [
            row.number.where,
            row.number.what,
            "" if row.number.unit == "1" else row.number.unit,
            row.number.printed,
            _exact(row) if row.number.exact else _text(row.ours),
            "" if row.common is None else _text(row.common),
            _explanation(row),
            row.verdict,
        ]
        for row in audit.rows
    ]
    return Table(columns, rows)


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


def _settings(audit: Audit) -> Table:
    """The best settings, and the cost of each other choice."""
    numbers = [source_value(name) for name in TARGETS]
    symbols = {"energy decay": "k", "pressure decay": "κ", "mean speed": "⟨v⟩", "pressure": "P"}
    columns = [TableColumn("setting", 3.2, right=False)]
    for number in numbers:
        place = "" if number.cor is None else f" at {number.cor:g}"
        columns.append(TableColumn(f"{symbols[number.quantity]}{place}, {number.unit}", 1.1))
    rows = [["printed", *(number.printed for number in numbers), ""]]
    rows += [
        [
            one.setting.description,
            *(_printed_decimals(one, number) for number in numbers),
            f"{one.score:.1f}" if one.score < 100 else f"{one.score:.0f}",
        ]
        for one in audit.profile
    ]
    return Table([*columns, TableColumn("χ²", 0.65)], rows)


def _printed_decimals(one: Candidate, number: SourceValue) -> str:
    """A setting's value with the printed decimals, at least one."""
    ours = one.our_value(number)
    return "–" if ours is None else f"{ours.value:.{max(number.decimals, 1)}f}"


def _claims(audit: Audit) -> Table:
    """The sentences of the source report that can be checked."""
    columns = [
        TableColumn("where", 1.0, right=False),
        TableColumn("sentence", 2.2, right=False),
        TableColumn("check", 4.0, right=False),
        TableColumn("holds", 0.45, right=False),
    ]
    rows = [[one.where, one.claim, one.check, "yes" if one.holds else "no"] for one in audit.claims]
    return Table(columns, rows)


def _coefficients(results: Results) -> Table:
    """The decay constants of the energy over all CoR, with both walls."""
    columns = [
        TableColumn("CoR", 0.5),
        TableColumn("k, 1/s", 1.3),
        TableColumn("α, 1/s", 1.3),
        TableColumn("early", 0.6),
        TableColumn("elastic wall: k, 1/s", 1.3),
        TableColumn("α, 1/s", 1.3),
        TableColumn("early", 0.6),
    ]
    rows = []
    files = ("decay-against-cor", "decay-elastic-wall")
    for both in zip(*(results.points(file) for file in files), strict=True):
        cells = [f"{both[0]['parameters']['cor']:g}"]
        for one in both:
            k, alpha = ((one[name], one[f"{name}_error"]) for name in ("k", "alpha"))
            cells += [with_error(*k), with_error(*alpha), str(one["ended_early"])]
        rows.append(cells)
    return Table(columns, rows)
