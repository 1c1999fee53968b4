"""Runs of a user -> the folder of their report: figures, configs, report.html, report.pdf."""

import json
import math
import shlex
from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import yaml

from snooker_cli import __version__
from snooker_cli.analysis import tables
from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING
from snooker_cli.analysis.findings import finding, overview
from snooker_cli.analysis.fitting import LEAST_PROBABILITY
from snooker_cli.analysis.predictions import scene_rates
from snooker_cli.analysis.run_analysis import Records, RunAnalysis, comparisons, fits
from snooker_cli.config import Point, to_json
from snooker_cli.errors import FigureError
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import setting
from snooker_cli.figures.selection import distinct, elastic, spread, varying
from snooker_cli.files import write_text
from snooker_cli.formatting import point_label, printable, short
from snooker_cli.report.pages import Pages
from snooker_cli.report.relevance import KEY_FIGURES, ORDER, trivial
from snooker_cli.runs import Run
from snooker_cli.runs.status import ended, run_status
from snooker_cli.scene import Scene

MOST_ROWS = 100  # rows of a table; of more, it has fewer models and points


def run_report(
    runs: Sequence[Run],
    out: Path,
    report_progress: Callable[[str], None],
    asked: Collection[str] = (),
) -> list[Path]:
    """Write the report on runs, a chapter each, and return the files that a reader opens.

    asked : names of figures that are shown although ``trivial`` leaves them out

    The same runs give the same bytes. Raises ``FigureError`` for a run without repeats, and
    ``StoreError`` for one that cannot be read.
    """
    with Pages(out) as pages:
        chapters = []
        configs = [_config(run, out) for run in runs]  # before the work: the folder may be refused
        for number, (run, config) in enumerate(zip(runs, configs, strict=True), 1):
            report_progress(f"writing the chapter on {printable(run.name)}")
            chapters.append({"config": config, **_chapter(run, number, pages, asked)})
        compared = tables.COMPARE_COLUMNS.replace("in errors", "difference / error")
        values = {
            "chapters": chapters,
            "version": __version__,
            "columns": (tables.FIT_COLUMNS, compared),
            "notes": (f"{SAMPLING} {JUDGEMENT}", tables.PAIRED),
            "refused": LEAST_PROBABILITY,
        }
        return pages.write("run.md.j2", values)


def _chapter(run: Run, number: int, pages: Pages, asked: Collection[str]) -> dict[str, Any]:
    """What templates/run.md.j2 prints of a run."""
    points = selected(run, Selection())
    starts = {p.index: run.read(p, run.present(p)[0]).start for p in spread(points, MOST_ROWS)}
    left_out = trivial(points, list(starts.values()))
    left_out = {name: why for name, why in left_out.items() if name not in asked}
    # The other process makes figures while this one makes the analyses.
    order = [*ORDER, *(name for name in FIGURES if name not in ORDER)]
    single = _typical(points)
    made = {
        name: pages.other.submit(_figure, run, name, single)
        for name in order
        if name not in left_out
    }
    status, found, compared = run_status(run), fits(run), comparisons(run)
    scene, files = setting(run, points, Selection()), list[str]()
    for name, each in made.items():
        if isinstance(picture := each.result(), FigureData):
            files.append(f"{number}-{name}")
            pages.add_figure(files[-1], picture, known=scene)
        else:
            left_out[name] = picture
    both = zip(status["ledger"], run.points, strict=True)
    rows, fewer = _few([row | {"point": point} for row, point in both])
    holding = [_finding(point, found.rows, compared.rows) for point in spread(points, MOST_ROWS)]
    return {
        "run": run,
        "status": status,
        "title": printable(run.experiment.title or ""),
        "name": printable(run.name),
        "file": shlex.quote(run.name),
        "scene": scene,
        "swept": {key: distinct(run.points, key) for key in varying(run.points)},
        "points": [_point_cells(run, row, starts) for row in rows],
        "fewer_points": fewer,
        "finding": (overview if points[1:] else finding)(found.rows, compared.rows),
        "findings": holding if points[1:] else [],
        "key_figures": files[:KEY_FIGURES],
        "figures": files[KEY_FIGURES:],
        "left_out": sorted(left_out.items(), key=lambda one: order.index(one[0])),
        "single": point_label(single.as_json()) if points[1:] else "",
        "analyses": [
            _cells(run, found, tables.fit_cells),
            _cells(run, compared, tables.compare_cells),
        ],
        "film": len(pages.players),
        "repeat": run.present(single)[0],
        "no_film": pages.add_player(run, single),
    }


def _typical(points: Sequence[Point]) -> Point:
    """The point that figures of one point and the film show: amid those that cool, or of all."""
    fit = [point for point in points if not elastic(point)] or points
    return fit[len(fit) // 2]


def _finding(point: Point, fitted: Records, compared: Records) -> list[str]:
    """A point and what holds there."""
    of = point.as_json()
    rows = ([one for one in found if one["parameters"] == of] for found in (fitted, compared))
    return [point_label(of), finding(*rows) or "–"]


def _figure(run: Run, name: str, single: Point) -> FigureData | str:
    """A figure of all points or, if it shows one, of this one; or else the reason."""
    try:
        where = single.parameters if FIGURES[name].each_point else ()
        return FIGURES[name].make(run, Selection(dict(where)))
    except FigureError as error:
        return str(error)


def _few(rows: Records) -> tuple[Records, str]:
    """The rows, or those of fewer models and of an even choice of points, and what is left out."""
    if len(rows) <= MOST_ROWS:
        return rows, ""
    last = {(point_label(row["parameters"]), row.get("quantity")): row for row in rows}
    groups: dict[str, Records] = {}
    for (label, _), row in last.items():
        groups.setdefault(label, []).append(row)
    chosen = spread(list(groups), max(1, MOST_ROWS // max(map(len, groups.values()))))
    fewer = f"{len(chosen)} of {len(groups)} points" if len(chosen) < len(groups) else "all points"
    models = ", with the last model of each quantity" if len(last) < len(rows) else ""
    return [row for label in chosen for row in groups[label]], fewer + models


def _cells(
    run: Run, found: RunAnalysis, cells: Callable[[dict[str, Any]], list[str]]
) -> dict[str, Any]:
    """Rows of an analysis below a heading of each point, and its notes."""
    few, fewer = _few([row for row in tables.usual(found.rows) if not row.get("elastic")])
    table: list[list[str]] = []
    for label, group in groupby(few, tables.point_heading):
        table += [[label]] * (len(run.points) > 1) + [cells(row) for row in group]
    notes = [one["note"] for one in tables.usual(found.notes)]
    return {"rows": table, "fewer": fewer, "found_notes": notes}


def _point_cells(run: Run, row: dict[str, Any], starts: Mapping[int, Scene]) -> list[str]:
    balls = ["–"] * 3
    if scene := starts.get(row["point"].index):
        rates = scene_rates(scene, 1.0)
        path = short(rates.mean_free_path if rates else None)
        balls = [f"{scene.number:,}", short(scene.packing_fraction), path]
    done = f"{row['done']} of {run.experiment.repeats}"
    cells = [point_label(row["parameters"]), *balls, done, ended(row), f"{row['collisions']:,}"]
    return cells[len(run.points) == 1 :]


def _config(run: Run, out: Path) -> str:
    """Write the run's config, with overrides applied, beside the report; its text."""
    data = json.loads(to_json(run.experiment), object_hook=_with_fixed_walls)
    given = {key: value for key, value in data.items() if value not in (None, [], {})}
    style: dict[str, Any] = {"sort_keys": False, "allow_unicode": True, "default_flow_style": None}
    text: str = yaml.safe_dump(given, **style)
    write_text(out / f"{run.name}.yaml", text)
    return "\n".join(filter(str.strip, text.splitlines()))


def _with_fixed_walls(entry: dict[str, Any]) -> dict[str, Any]:
    """A mapping of a config as users write it: the mass of a fixed wall is .inf, not null."""
    for key in entry.keys() & {"mass", "container.mass"}:
        values = entry[key] if isinstance(entry[key], list) else [entry[key]]
        values = [math.inf if value is None else value for value in values]
        entry[key] = values if isinstance(entry[key], list) else values[0]
    return entry
