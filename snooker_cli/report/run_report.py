"""Runs of a user -> the folder of their report: figures, configs, and pages or a text."""

import math
import shlex
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from snooker_cli import __version__, facts
from snooker_cli.analysis import tables
from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING
from snooker_cli.analysis.findings import (
    Findings,
    cools,
    errors_from_theory,
    few_repeats,
    has_theory,
    main_quantity_rows,
)
from snooker_cli.analysis.goodness import MOST_ERRORS
from snooker_cli.analysis.quantities import CRITICAL_RATIO, GasKind, main_quantities
from snooker_cli.analysis.run_analysis import JsonRows, RunAnalysis, comparisons, fits
from snooker_cli.analysis.theories import CRITICAL, gas_kinds, value_of
from snooker_cli.analysis.trend import trends
from snooker_cli.config import Point, unit_of
from snooker_cli.errors import FigureError
from snooker_cli.figures.caption_text import setting
from snooker_cli.figures.figure_data import FigureData
from snooker_cli.figures.registry import FIGURES, own_figures
from snooker_cli.figures.series import gas_type_of, spread, swept_number
from snooker_cli.files import write_text
from snooker_cli.formatting import counted, point_label, printable
from snooker_cli.report.document import Pages, packaged
from snooker_cli.runs import RunFolder
from snooker_cli.runs.progress import counting
from snooker_cli.runs.run import RUN
from snooker_cli.runs.selection import Selection, selected
from snooker_cli.runs.side_by_side import FoldersSideBySide
from snooker_cli.runs.status import early_warning, ended, run_status
from snooker_cli.scene import Scene
from snooker_cli.theory import IDEAL

RELEVANCE: dict[str, dict[str, str]] = yaml.safe_load(packaged("relevance.yaml"))
"""Figures by relevance; relevance.yaml explains their conditions. Others come last."""

ABOUT = {"profiles": "heat flux", "snapshot": "balls in a ball's cluster"}
"""The quantities of figures whose result is another one, or none."""

DOES: Mapping[GasKind, str] = {
    "cooling": "loses energy in collisions",
    "elastic": "keeps its energy",
    "warm": "gets energy from the walls",
}
"""What a gas does with its energy, in the first sentence of a report."""

GROUPS = (
    f"more than {MOST_ERRORS:g} errors from the best theory",
    "other comparisons",
    "the ideal gas law, from which hard disks must differ",
)
"""Rows of comparisons, the most important first."""

MOST_TRENDS = 3  # sentences on how a result changes along the swept key
MOST_TOGETHER = 6  # figures that show several runs
KEY_FIGURES = 2  # figures before all others, on the first page
MOST_POINTS = 30  # points in tables
DENSE = 0.5  # packing from which neighbours have an order that a figure shows


def run_report(
    runs: Sequence[RunFolder],
    out: Path,
    report_progress: Callable[[str], None],
    asked: Collection[str] = (),
    markdown: bool = False,
) -> list[Path]:
    """Write the report on runs, a chapter each, and return the files that a reader opens.

    asked : names of figures that are shown although ``trivial`` leaves them out
    markdown : whether it is report.md instead of report.html and report.pdf

    The same runs give the same bytes. Raises ``FigureError`` for a run without repeats, and
    ``StoreError`` for one that cannot be read.
    """
    with Pages(out, markdown) as pages:
        chapters, together = [], {}
        configs = [_config(run, out) for run in runs]  # before the work: the folder may be refused
        if len(runs) > 1:
            report_progress("comparing the runs")
            together = _side_by_side(runs, pages)
        for number, (run, config) in enumerate(zip(runs, configs, strict=True), 1):
            report_progress(f"writing the chapter on {printable(run.name)}")
            chapter = _chapter(run, number, pages, asked)
            chapters.append({"config": config, **chapter})
            for name in set(asked) & chapter["left_out"].keys():
                why = chapter["left_out"][name]
                report_progress(f"{printable(run.name)} cannot give {name}: {why}")
        compared = tables.COMPARE_COLUMNS.replace("in errors", "difference / error")
        values = {
            "chapters": chapters,
            "together": together,
            "version": __version__,
            "columns": (tables.FIT_COLUMNS, compared),
            "notes": (f"{SAMPLING} {JUDGEMENT}", tables.PAIRED),
            "ended": ended,
            "label": point_label,
            "markdown": markdown,
        }
        return pages.write(packaged("templates/run.md.j2"), values)


def _chapter(run: RunFolder, number: int, pages: Pages, asked: Collection[str]) -> dict[str, Any]:
    """What templates/run.md.j2 prints of a run."""
    points, shown = selected(run, Selection()), spread(run.points, MOST_POINTS)
    begun = [p for p in (*points[:1], *shown) if run.present(p)]  # of many points none may be shown
    starts = {p.index: run.read(p, run.present(p)[0]).start for p in begun}
    left_out = trivial(points, starts.values(), asked)
    lively = [point for point in points if gas_type_of(point) != "elastic"] or points
    compared = comparisons(run, counting=counting) if gas_type_of(lively[0]) == "warm" else None
    steady = _settled(lively, compared.states if compared else []) or lively
    single = steady[len(steady) // 2]  # figures of one point and the film show it
    kinds = list(dict.fromkeys(kind for scene in starts.values() for kind in gas_kinds(scene)))
    # The other process makes figures while this one makes the analyses.
    drawings = {
        name: pages.other.submit(_figure, run, name, single)
        for name in by_relevance(dict.fromkeys((*ordered(), *asked)), kinds)
        if name not in left_out
    }
    status, fitted = run_status(run), fits(run, counting=counting)
    compared = compared or comparisons(run, counting=counting)
    scene, files = setting(run, points, Selection()), list[str]()
    for name, future in drawings.items():
        if isinstance(picture := future.result(), FigureData):
            files.append(f"{number}-{name}")
            pages.add_figure(files[-1], picture, known=scene)
        else:
            left_out[name] = picture
    of_point = {row["point"]: row for row in status["ledger"]}
    findings = Findings(fitted.rows, compared.rows, compared.states)
    what = {label: findings.at_point(label) for label in (point_label(p.as_json()) for p in shown)}
    return {
        "run": run,
        "status": status,
        "title": printable(run.config.title or ""),
        "name": printable(run.name),
        "file": printable(shlex.quote(run.name)),
        "scene": scene,
        "points": [(of_point[p.index], starts.get(p.index)) for p in shown],
        "plainly": _plainly(starts.values(), kinds, findings.verdict),
        "finding": _overview(points, findings) if shown[1:] else next(iter(what.values())),
        "few": " ".join(few_repeats([row for row in fitted.rows if cools(row)])),
        "warning": early_warning(run, points),
        "findings": [(label, text or "–") for label, text in what.items()],
        "key_figures": files[:KEY_FIGURES],
        "figures": files[KEY_FIGURES:],
        "left_out": left_out,
        "single": point_label(single.as_json()) if points[1:] else "",
        "analyses": [
            _cells(run, shown, fitted, tables.fit_cells),
            _cells(run, shown, compared, tables.compare_cells, by_agreement),
        ],
        "film": len(pages.players),
        "no_film": pages.add_player(run, single),
    }


def _side_by_side(runs: Sequence[RunFolder], pages: Pages) -> dict[str, Any]:
    """What templates/run.md.j2 prints of runs side by side: figures that show several, and results.

    The figures are those that tell most of the points of all runs.
    """
    joined = FoldersSideBySide.of(runs)
    points = selected(joined, Selection())
    left_out = trivial(points, [joined.read(p, joined.present(p)[0]).start for p in points], ())
    names = [name for name in ordered() if name not in left_out and not FIGURES[name].each_point]
    files, scene = list[str](), setting(joined, points, Selection())
    for name in names:
        picture = _figure(joined, name, points[0])
        if isinstance(picture, FigureData) and len(files) < MOST_TOGETHER:
            shown = {row["parameters"][RUN] for row in picture.numbers.get("points", ())}
            if len(shown) > 1:
                files.append(f"together-{name}")
                pages.add_figure(files[-1], picture, known=scene)
    rows = main_quantity_rows(comparisons(joined, counting=counting).rows)
    cells = [(point_label(row["parameters"]), tables.compare_cells(row)) for row in rows]
    return {"figures": files, "rows": cells[:MOST_POINTS], "scene": scene}


def trivial(
    points: Sequence[Point], starts: Collection[Scene], asked: Collection[str]
) -> dict[str, str]:
    """The figures that say little of these points, without those asked for, and the reasons."""
    given = (p.config.placed or getattr(p.config.balls, "list", ()) for p in points)
    known = [facts.traits_of(point.config) for point in points]
    lossy_starts = [scene for scene in starts if facts.hold(scene, "lossy_pairs")]
    ratios = [value_of(scene, CRITICAL_RATIO, CRITICAL) for scene in lossy_starts]
    clusters = any(ratio is not None and ratio > 1 for ratio in ratios)
    conditions = {
        "always": True,
        "untagged": not any(given),
        "dilute": not clusters and all(scene.packing_fraction < DENSE for scene in starts),
        "calm": all(ratio is not None and ratio <= 1 for ratio in ratios),
    }
    conditions |= {
        name: all(facts.FACTS[name].holds(gas_traits) for gas_traits in known)
        for given in RELEVANCE.values()
        for name in given.keys() - conditions.keys()
    }
    reasons = ((name, *reason) for name, given in RELEVANCE.items() for reason in given.items())
    return {name: why for name, when, why in reasons if conditions[when] and name not in asked}


def ordered() -> list[str]:
    """The figures of own runs by relevance; those that relevance.yaml does not have come last."""
    return [*dict.fromkeys((*RELEVANCE, *own_figures()))]


def shown(name: str) -> str | None:
    """The quantity that a figure is about; ``None`` without one."""
    result = FIGURES[name].result
    return ABOUT.get(name, result.quantity if result else None)


def by_relevance(names: Iterable[str], kinds: Collection[GasKind]) -> list[str]:
    """Figures of main quantities of a gas first, in the order of these; others as they are."""
    main = [quantity.name for quantity in main_quantities(*kinds)]
    places = {name: place for place, name in enumerate(main)}
    return sorted(names, key=lambda name: places.get(shown(name) or "", len(main)))


def by_agreement(rows: JsonRows) -> list[tuple[str, dict[str, Any]]]:
    """Rows of a comparison with their group of ``GROUPS``, in this order.

    In the first one, the largest disagreement of a point in errors comes first. The best theory of
    a quantity is the last one of a point: its rows go from simple ones to better ones.
    """
    places = {point_label(row["parameters"]): number for number, row in enumerate(rows)}

    def place(row: Mapping[str, Any]) -> int:
        return places[point_label(row["parameters"])]

    best = {(place(row), row["quantity"]): row["model"] for row in rows if has_theory(row)}

    def rank(row: Mapping[str, Any]) -> tuple[float, ...]:
        if row["model"].startswith(IDEAL):
            return 2, place(row)
        errors = errors_from_theory(row)
        is_best = best.get((place(row), row["quantity"])) == row["model"]
        if is_best and errors is not None and abs(errors) > MOST_ERRORS:
            return 0, place(row), -abs(errors)
        return 1, place(row)

    return [(GROUPS[int(rank(row)[0])], row) for row in sorted(rows, key=rank)]


def _as_they_are(rows: JsonRows) -> list[tuple[str, dict[str, Any]]]:
    """Rows that have no groups."""
    return [("", row) for row in rows]


def _plainly(starts: Collection[Scene], kinds: Collection[GasKind], verdict: str) -> str:
    """What the gas is and does, and what follows: the first sentence of a report."""
    numbers = sorted({scene.number for scene in starts})
    number = "".join(f"{least:,} to " for least in numbers[:-1][:1])
    balls = counted(numbers[-1], "rough ball" if "rough" in kinds else "ball")
    titles = " or ".join(dict.fromkeys(scene.container.title for scene in starts))
    does = " or ".join(DOES[kind] for kind in kinds if kind in DOES)
    return f"A gas of {number}{balls} in a {titles} {does}{f': {verdict}' * bool(verdict)}"


def _figure(run: RunFolder, name: str, single: Point) -> FigureData | str:
    """A figure of all points or, if it shows one, of this one; or else the reason."""
    try:
        where = single.parameters if FIGURES[name].each_point else ()
        return FIGURES[name].make(run, Selection(dict(where)))
    except FigureError as error:
        return str(error)


def _settled(points: Sequence[Point], states: JsonRows) -> list[Point]:
    """The points without those that walls keep warm and that have no stationary part."""
    changing = [
        state["parameters"]
        for state in states
        if state["stationary"] and not state["stationary"]["found"]
    ]
    return [point for point in points if point.as_json() not in changing]


def _overview(points: Sequence[Point], findings: Findings) -> str:
    """What holds for a sweep: how the main result changes with the swept key, then the rest."""
    try:
        key = swept_number(points)
        along = trends(findings.compared, key, unit_of(points[0].config, key))
    except FigureError:
        along = {}
    sentences = [
        f"{label}: {trend.change}" if label else trend.change
        for label, trend in list(along.items())[:MOST_TRENDS]
    ]
    return ". ".join(filter(None, [*sentences, findings.overview]))


def _of(points: Sequence[Point], rows: JsonRows) -> JsonRows:
    parameters = [point.as_json() for point in points]
    return [row for row in rows if row["parameters"] in parameters]


def _cells(
    run: RunFolder,
    shown: Sequence[Point],
    analysis: RunAnalysis,
    cells: Callable[..., list[str]],
    order: Callable[[JsonRows], list[tuple[str, dict[str, Any]]]] = _as_they_are,
) -> dict[str, Any]:
    """The rows of an analysis at the points that are shown, with their headings, and its notes."""
    rows = [row for row in _of(shown, tables.main_rows(analysis.rows)) if not row.get("elastic")]
    notes = [note for note in tables.main_rows(analysis.notes) if "ended early" not in note["note"]]
    lines = tables.note_lines(notes, len(run.points))
    several, table = len(run.points) > 1, list[tuple[str, list[str]]]()
    for group, row in order(rows):
        heading = f"{group[:1].upper()}{group[1:]}"
        if several:
            heading = "; ".join(filter(None, [tables.point_heading(row), group]))
        table.append((heading, cells(row)))
    return {"rows": table, "notes": [line.rstrip(".") for line in lines]}


def _config(run: RunFolder, out: Path) -> str:
    """Write the run's config, with overrides applied, beside the report; its text."""
    given = run.config.model_dump(exclude_none=True)
    if run.config.container.mass == math.inf and "shape" in given["container"]:
        del given["container"]["mass"]  # only a circle has one
    style: dict[str, Any] = {"sort_keys": False, "allow_unicode": True, "default_flow_style": None}
    text = yaml.safe_dump({key: given[key] for key in given if given[key] not in ({}, ())}, **style)
    write_text(out / f"{run.name}.yaml", text)
    return "\n".join(filter(str.strip, text.splitlines()))
