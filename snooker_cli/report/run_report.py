"""Runs of a user -> the folder of their report: figures, configs, report.html, report.pdf."""

import json
import shlex
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import yaml

from snooker_cli import __version__
from snooker_cli.analysis import tables
from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING
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
from snooker_cli.runs import Run
from snooker_cli.runs.status import ended, run_status

MOST_ROWS = 100  # rows of a table; of more, it has fewer models and points
MOST_POINTS = 2  # points that have players, and figures of their own: the first and the last


def run_report(
    runs: Sequence[Run], out: Path, report_progress: Callable[[str], None]
) -> list[Path]:
    """Write the report on runs, a chapter each, and return the files that a reader opens.

    The same runs give the same bytes. Raises ``FigureError`` for a run without repeats, and
    ``StoreError`` for one that cannot be read.
    """
    with Pages(out) as pages:
        chapters = []
        configs = [_config(run, out) for run in runs]  # before the work: the folder may be refused
        for number, (run, config) in enumerate(zip(runs, configs, strict=True), 1):
            report_progress(f"writing the chapter on {printable(run.name)}")
            chapters.append({"config": config, **_chapter(run, number, pages)})
        compared = tables.COMPARE_COLUMNS.replace("in errors", "difference / error")
        values = {
            "chapters": chapters,
            "version": __version__,
            "columns": (tables.FIT_COLUMNS, compared),
            "notes": (f"{SAMPLING} {JUDGEMENT}", tables.PAIRED),
        }
        return pages.write("run.md.j2", values)


def _chapter(run: Run, number: int, pages: Pages) -> dict[str, Any]:
    """What templates/run.md.j2 prints of a run."""
    points = selected(run, Selection())
    # The other process makes figures while this one makes the analyses.
    made = {
        f"{number}-{file}": (name, pages.other.submit(_figure, run, name, selection))
        for file, name, selection in _figures(run, points)
    }
    status, found, compared = run_status(run), fits(run), comparisons(run)
    title = printable(run.experiment.title or "")
    scene = setting(run, points, Selection())
    figures, left_out = dict[str, str](), dict[str, str]()
    for file, (name, each) in made.items():
        if isinstance(picture := each.result(), FigureData):
            figures[file] = pages.add_figure(file, picture, known=scene).kind
        else:
            left_out[name] = picture
    drawn = set(figures.values())
    both = zip(status["ledger"], run.points, strict=True)
    rows, fewer = _few([row | {"point": point} for row, point in both])
    return {
        "run": run,
        "status": status,
        "title": title[:1].upper() + title[1:] or printable(run.name),
        "name": printable(run.name),
        "file": shlex.quote(run.name),
        "scene": scene,
        "swept": {key: distinct(run.points, key) for key in varying(run.points)},
        "points": [_point_cells(run, row) for row in rows],
        "fewer_points": fewer,
        "figures": list(figures),
        "left_out": [(name, why) for name, why in left_out.items() if name not in drawn],
        "few_points": len(points) > MOST_POINTS and any(FIGURES[one].each_point for one in drawn),
        "analyses": [
            _cells(run, found, tables.fit_cells),
            _cells(run, compared, tables.compare_cells),
        ],
        "no_players": filter(None, [pages.add_player(run, p) for p in spread(points, MOST_POINTS)]),
    }


def _figures(run: Run, points: Sequence[Point]) -> Iterator[tuple[str, str, Selection]]:
    """The files of figures, their names, and what they show: all points, or the first and last."""
    for spec in FIGURES.values():
        if not spec.each_point:
            yield spec.name, spec.name, Selection()
        else:
            fit = [each for each in points if spec.lossy in (None, not elastic(each))]
            for point in spread(fit, MOST_POINTS):
                yield f"{spec.name}-{point.index}", spec.name, Selection(dict(point.parameters))


def _figure(run: Run, name: str, selection: Selection) -> FigureData | str:
    """A figure if the run can give it, or else the reason."""
    try:
        return FIGURES[name].make(run, selection)
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


def _point_cells(run: Run, row: dict[str, Any]) -> list[str]:
    balls = ["–"] * 3
    for repeat in run.present(row["point"])[:1]:
        scene = run.read(row["point"], repeat).start
        rates = scene_rates(scene, 1.0)
        path = short(rates.mean_free_path if rates else None)
        balls = [f"{scene.number:,}", short(scene.packing_fraction), path]
    done = f"{row['done']} of {run.experiment.repeats}"
    cells = [point_label(row["parameters"]), *balls, done, ended(row), f"{row['collisions']:,}"]
    return cells[len(run.points) == 1 :]


def _config(run: Run, out: Path) -> str:
    """Write the run's config, with overrides applied, beside the report; its text."""
    data = json.loads(to_json(run.experiment))
    given = {key: value for key, value in data.items() if value not in (None, [], {})}
    style: dict[str, Any] = {"sort_keys": False, "allow_unicode": True, "default_flow_style": None}
    text: str = yaml.safe_dump(given, **style)
    write_text(out / f"{run.name}.yaml", text)
    return "\n".join(filter(str.strip, text.splitlines()))
