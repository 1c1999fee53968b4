"""Runs of a user -> the folder of their report: figures, configs, report.html, report.pdf."""

import json
import shlex
from collections.abc import Callable, Iterator, Sequence
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
    fit_cells,
    note_lines,
    share_complete,
    usual,
)
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

MOST_ROWS = 60  # rows of a table; more are those of an even choice of points
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
        for number, run in enumerate(runs, 1):
            report_progress(printable(run.name))
            chapters.append(_chapter(run, number, pages))
        return pages.write("run.md.j2", {"chapters": chapters, "version": __version__})


def _chapter(run: Run, number: int, pages: Pages) -> dict[str, Any]:
    """What templates/run.md.j2 prints of a run."""
    points = selected(run, Selection())
    # The other process makes figures while this one makes the analyses.
    made = {
        f"{number}-{file}": pages.other.submit(_figure, run, name, selection)
        for file, name, selection in _figures(run, points)
    }
    status, found, compared = run_status(run), fits(run), comparisons(run)
    figures = {file: picture for file, each in made.items() if (picture := each.result())}
    alone = any(FIGURES[picture.kind].each_point for picture in figures.values())
    for file, picture in figures.items():
        pages.add_figure(file, picture)
    both = zip(status["ledger"], run.points, strict=True)
    rows, fewer = _few([row | {"point": point} for row, point in both])
    return {
        "run": run,
        "status": status,
        "title": printable(run.experiment.title or run.name),
        "name": printable(run.name),
        "file": shlex.quote(run.name),
        "config": _config(run, pages.out),
        "scene": setting(run, points, Selection()),
        "swept": {key: distinct(run.points, key) for key in varying(run.points)},
        "points": [_point_cells(run, row) for row in rows],
        "fewer_points": fewer,
        "figures": list(figures),
        "few_points": len(points) > MOST_POINTS and alone,
        "analyses": [
            {
                "title": "Decay constants",
                "command": "fit",
                "columns": FIT_COLUMNS,
                "notes": f"{SAMPLING} {JUDGEMENT}",
                **_cells(run, found, [row for row in found.rows if not row["elastic"]], fit_cells),
            },
            {
                "title": "Comparison with theory",
                "command": "compare",
                "columns": COMPARE_COLUMNS,
                "notes": PAIRED,
                **_cells(run, compared, usual(compared.rows), compare_cells),
            },
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


def _figure(run: Run, name: str, selection: Selection) -> FigureData | None:
    """A figure if the run can give it; `snooker plot` gives the reasons for others."""
    try:
        return FIGURES[name].make(run, selection)
    except FigureError:
        return None


def _few(rows: Records) -> tuple[Records, str]:
    """The rows of an even choice of points, and how many of the points these are if not all."""
    groups: dict[str, Records] = {}
    for row in rows:
        groups.setdefault(point_label(row["parameters"]), []).append(row)
    most = max(1, MOST_ROWS // max(map(len, groups.values()), default=1))
    chosen = spread(list(groups), most)
    fewer = f"{len(chosen)} of {len(groups)} points" if len(chosen) < len(groups) else ""
    return [row for label in chosen for row in groups[label]], fewer


def _cells(
    run: Run, found: RunAnalysis, rows: Records, cells: Callable[[dict[str, Any]], list[str]]
) -> dict[str, Any]:
    """Rows of an analysis with their points and numbers of complete repeats, and its notes."""
    few, fewer = _few(rows)
    whole = [[point_label(row["parameters"]), *cells(row), share_complete(row)] for row in few]
    found_notes = "; ".join(note_lines(found.notes, len(run.points))).rstrip(".")
    return {"rows": whole, "fewer": fewer, "found_notes": found_notes}


def _point_cells(run: Run, row: dict[str, Any]) -> list[str]:
    balls = ["–"] * 3
    for repeat in run.present(row["point"])[:1]:
        scene = run.read(row["point"], repeat).start
        rates = scene_rates(scene, 1.0)
        path = short(rates.mean_free_path if rates else None)
        balls = [f"{scene.number:,}", short(scene.packing_fraction), path]
    done = f"{row['done']} of {run.experiment.repeats}"
    return [point_label(row["parameters"]), *balls, done, ended(row), f"{row['collisions']:,}"]


def _config(run: Run, out: Path) -> str:
    """Write the run's config, with overrides applied, beside the report; its text."""
    data = json.loads(to_json(run.experiment))
    given = {key: value for key, value in data.items() if value not in (None, [], {})}
    style: dict[str, Any] = {"sort_keys": False, "allow_unicode": True, "default_flow_style": None}
    text: str = yaml.safe_dump(given, **style)
    write_text(out / f"{run.name}.yaml", text)
    return "\n".join(filter(str.strip, text.splitlines()))
