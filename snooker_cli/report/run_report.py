"""Runs of a user -> the folder of their report: figures, configs, report.html, report.pdf."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from snooker_cli import __version__
from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING
from snooker_cli.analysis.predictions import scene_rates
from snooker_cli.analysis.run_analysis import Records, RunAnalysis, comparisons, fits
from snooker_cli.analysis.tables import (
    COMPARE_COLUMNS,
    FIT_COLUMNS,
    PAIRED,
    compare_cells,
    complete,
    fit_cells,
    note_lines,
    usual,
)
from snooker_cli.animation import embedded, film, page
from snooker_cli.config import Point, to_json
from snooker_cli.errors import FigureError, UserError
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import setting
from snooker_cli.figures.drawing import save
from snooker_cli.figures.selection import distinct, elastic, spread, varying
from snooker_cli.files import write_text
from snooker_cli.formatting import point_label, printable, short
from snooker_cli.report.build import second_process, shown
from snooker_cli.report.document import document, require_libraries, write_html, write_pdf
from snooker_cli.runs import Run
from snooker_cli.runs.status import ended, run_status

MOST_ROWS = 60
"""Rows of a table; more are those of an even choice of points."""

MOST_POINTS = 2
"""Points that have players, and figures of their own: the first and the last."""


@dataclass
class _Pages:
    """What all chapters add to, and the process that draws."""

    out: Path
    drawer: ProcessPoolExecutor
    report_progress: Callable[[str], None]
    figures: dict[str, dict[str, str]] = field(default_factory=dict)
    drawing: list[Future[list[Path]]] = field(default_factory=list)
    code: dict[str, str] = field(default_factory=dict)
    players: list[str] = field(default_factory=list)

    def add_figure(self, file: str, picture: FigureData) -> None:
        """Give a figure its number, and let it be drawn."""
        self.figures[file] = shown(f"Figure {len(self.figures) + 1}", picture)
        self.drawing.append(self.drawer.submit(save, picture, self.out / "figures" / file))


def run_report(
    runs: Sequence[Run], out: Path, report_progress: Callable[[str], None]
) -> list[Path]:
    """Write the report on runs, a chapter each, and return the files that a reader opens.

    The same runs give the same bytes. Raises ``UserError`` for a run without repeats, and
    ``StoreError`` for one that cannot be read.
    """
    require_libraries()
    with second_process() as drawer:
        pages = _Pages(out, drawer, report_progress)
        chapters = [_chapter(run, f"{number}", pages) for number, run in enumerate(runs, 1)]
        for each in pages.drawing:
            each.result()
    content = document("run.md.j2", {"chapters": chapters}, pages.figures, pages.code)
    report_progress("pages")
    return [write_html(content, pages.players, out), write_pdf(content, out)]


def _chapter(run: Run, number: str, pages: _Pages) -> dict[str, Any]:
    """What templates/run.md.j2 prints of a run."""
    try:
        points = selected(run, Selection())
    except FigureError as error:
        raise UserError(f"{run.name}: {error}") from None
    pages.report_progress(f"{run.name}: figures")
    files, few_points = [], False
    for name, point, picture in _figures(run, points):
        files.append(f"{number}-{name}" if point is None else f"{number}-{name}-{point.index}")
        pages.add_figure(files[-1], picture)
        few_points |= point is not None and len(points) > MOST_POINTS
    pages.report_progress(f"{run.name}: fits and comparison with theory")
    config = _config(run, pages.out)
    pages.code[f"{number}-config"] = config.read_text(encoding="utf-8").rstrip()
    pages.code[f"{number}-commands"] = _commands(run, config.name)
    status, found, compared = run_status(run), fits(run), comparisons(run)
    ledger = status["ledger"]
    point_rows, fewer_points = _few(ledger)
    fit_rows, fewer_fits = _few([row for row in found.rows if not row["elastic"]])
    compare_rows, fewer_compared = _few(usual(compared.rows))
    return {
        "number": number,
        "title": printable(run.experiment.title or run.name),
        "name": printable(run.name),
        "status": status,
        "run": run,
        "scene": setting(run, points, Selection()),
        "swept": [
            f"{key}: {', '.join(map(str, distinct(run.points, key)))}"
            for key in varying(run.points)
        ],
        "points": [_point_cells(run, run.points[ledger.index(row)], row) for row in point_rows],
        "files": files,
        "few_points": few_points,
        "fit_columns": f"point | {FIT_COLUMNS} | >complete",
        "fits": [_whole(row, fit_cells(row)) for row in fit_rows],
        "fit_notes": [SAMPLING, JUDGEMENT, *_sentences(found, run)],
        "compare_columns": f"point | {COMPARE_COLUMNS} | >complete",
        "compared": [_whole(row, compare_cells(row)) for row in compare_rows],
        "compare_notes": [PAIRED, *_sentences(compared, run)],
        "fewer": {"points": fewer_points, "fits": fewer_fits, "compared": fewer_compared},
        "no_players": _add_players(run, points, pages),
        "version": __version__,
    }


def _figures(run: Run, points: Sequence[Point]) -> Iterator[tuple[str, Point | None, FigureData]]:
    """The figures that a run can give; those of a single point for the first and last ones."""
    for spec in FIGURES.values():
        own: list[Point | None] = [None]
        if spec.each_point:
            fit = [each for each in points if spec.lossy in (None, not elastic(each))]
            own = [*spread(fit, MOST_POINTS)]
        for point in own:
            try:
                where = dict(point.parameters) if point else {}
                yield spec.name, point, spec.make(run, Selection(where))
            except FigureError:
                continue  # as `snooker plot`, which gives the reasons


def _whole(row: dict[str, Any], cells: Sequence[str]) -> list[str]:
    """A row with its point and how many repeats of it are complete."""
    return [point_label(row["parameters"]), *cells, complete(row)]


def _sentences(found: RunAnalysis, run: Run) -> list[str]:
    """The notes of an analysis as one sentence; none without notes."""
    notes = "; ".join(note_lines(found.notes, len(run.points)))
    return [f"Notes: {notes}."] if notes else []


def _few(rows: Records) -> tuple[Records, str]:
    """The rows of an even choice of points, and how many of the points these are if not all."""
    groups: dict[str, Records] = {}
    for row in rows:
        groups.setdefault(point_label(row["parameters"]), []).append(row)
    most = max(1, MOST_ROWS // max(map(len, groups.values()), default=1))
    chosen = spread(list(groups), most)
    fewer = f"{len(chosen)} of {len(groups)} points" if len(chosen) < len(groups) else ""
    return [row for label in chosen for row in groups[label]], fewer


def _point_cells(run: Run, point: Point, row: dict[str, Any]) -> list[str]:
    """A row of the table of points."""
    balls = ["–"] * 3
    for repeat in run.present(point)[:1]:
        scene = run.read(point, repeat).start
        rates = scene_rates(scene, 1.0)
        path = short(rates.mean_free_path) if rates else "–"
        balls = [f"{scene.number:,}", short(scene.packing_fraction), path]
    done = f"{row['done']} of {run.experiment.repeats}"
    return [point_label(row["parameters"]), *balls, done, ended(row), f"{row['collisions']:,}"]


def _config(run: Run, out: Path) -> Path:
    """Write the run's config, with overrides applied, beside the report."""
    data = json.loads(to_json(run.experiment))
    given = {key: value for key, value in data.items() if value not in (None, [], {})}
    path = out / f"{run.name}.yaml"
    style: dict[str, Any] = {"sort_keys": False, "allow_unicode": True, "default_flow_style": None}
    write_text(path, yaml.safe_dump(given, **style))
    return path


def _commands(run: Run, config: str) -> str:
    """The commands that make the run and its report again."""
    engine = f" --engine {run.engine}" if run.engine else ""
    name = shlex.quote(run.name)
    return "\n".join(
        [
            f"snooker run {shlex.quote(config)}{engine}",
            f"snooker verify {name} --replay",
            f"snooker fit {name}",
            f"snooker compare {name}",
            f"snooker report {name}",
        ]
    )


def _add_players(run: Run, points: Sequence[Point], pages: _Pages) -> list[str]:
    """Add players of a repeat of the first and last point; sentences on those that cannot be."""
    missing: dict[str, None] = {}
    for point in spread(points, MOST_POINTS):
        repeat = run.present(point)[0]
        trace = run.read(point, repeat)
        where = f"{point_label(point.as_json())}, repeat {repeat}"
        try:
            shown = film(trace, printable(run.experiment.title or run.name), where)
        except FigureError as error:
            missing[f"repeat {repeat} {error}"] = None
            continue
        pages.players.append(embedded(page(shown), f"Player, {run.name}, {where}"))
    return list(missing)
