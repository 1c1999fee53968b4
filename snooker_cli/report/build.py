"""Finished runs -> the folder of this report: figures, numbers.json, report.html, report.pdf."""

from __future__ import annotations

import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli.analysis import run_analysis
from snooker_cli.animation import embedded, film, page
from snooker_cli.errors import RunError
from snooker_cli.figures.drawing import save
from snooker_cli.files import write_json
from snooker_cli.report.audit import AuditRow, audit
from snooker_cli.report.content import REPORT_FIGURES, RUNS, Results, values
from snooker_cli.report.document import document, require_libraries, write_html, write_pdf
from snooker_cli.report.setting_search import TARGETS
from snooker_cli.report.source_values import OurValue, source_value
from snooker_cli.runs import Run, open_run

if TYPE_CHECKING:
    from snooker_cli.figures import FigureData


def build(runs: Path, out: Path, report_progress: Callable[[str], None]) -> list[Path]:
    """Write the report and return the files that a reader opens.

    Raises ``RunError`` or ``StoreError`` for a run that is missing or cannot be read,
    ``FigureError`` for one without the data of its figure, and ``UserError``.
    """
    require_libraries()
    opened = {name: open_run(runs / name) for name in RUNS}
    out.mkdir(parents=True, exist_ok=True)
    # A second process audits, then draws the figures whose data this one has computed.
    with ProcessPoolExecutor(
        max_workers=1,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    ) as other:
        judging = other.submit(audit, runs)
        pictures: dict[str, FigureData] = {}
        drawing = []
        for file, figure in REPORT_FIGURES.items():
            report_progress(figure.label)
            pictures[file] = figure.make(opened)
            drawing.append(other.submit(save, pictures[file], out / "figures" / file))
        fits = run_analysis.fits(opened["decay"])
        with suppress(RunError):  # a run's folder may be read-only
            fits.save()
        report_progress("audit: every printed number compared with ours")
        judged = judging.result()
        for each in drawing:
            each.result()
    results = Results(opened, pictures, judged, fits.rows)
    write_json(out / "numbers.json", rounded(_numbers(results)))
    captions = {
        file: (figure.label, pictures[file].caption) for file, figure in REPORT_FIGURES.items()
    }
    content = document(values(results), captions)
    report_progress("pages")
    return [
        write_html(content, _players(opened["decay"]), out),
        write_pdf(content, out),
        out / "numbers.json",
    ]


def _players(run: Run) -> list[str]:
    """HTML players of the first repeat of each point."""
    found = []
    for point in run.points:
        title = f"CoR {point.experiment.cor:g}"
        shown = film(next(iter(run.traces(point))), title, "the first repeat")
        found.append(embedded(page(shown), f"Player, {title}"))
    return found


def _numbers(results: Results) -> dict[str, Any]:
    """Every number in this report."""
    judged = results.audit
    return {
        "figures": {name: picture.numbers for name, picture in results.pictures.items()},
        "audit": {
            "settings": len(judged.search.candidates),
            "ranked": len(judged.search.ranked),
            "near": judged.near,
            "slip": judged.search.factor,
            "free_slip": asdict(judged.free),
            "profile": [
                {
                    "setting": one.setting.description,
                    "score": one.score,
                    "values": {name: _value(one.our_value(source_value(name))) for name in TARGETS},
                }
                for one in judged.profile
            ],
            "numbers": [_row(row) for row in judged.rows],
            "claims": [asdict(claim) for claim in judged.claims],
        },
        "fits": results.fits,
    }


def rounded(content: Any) -> Any:
    """JSON content with six significant digits.

    exp, log and pow differ in their last bits between processors, fits in their seventh digit.
    """
    if isinstance(content, dict):
        return {key: rounded(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [rounded(value) for value in content]
    return float(f"{content:.6g}") if isinstance(content, float) else content


def _row(row: AuditRow) -> dict[str, Any]:
    """A row of the audit as JSON."""
    number = row.number
    return {
        "name": number.name,
        "where": number.where,
        "what": number.what,
        "unit": number.unit,
        "printed": {
            "text": number.printed,
            "value": number.value,
            "error": number.error,
            "half_digit": number.half_digit,
            "standard_error": number.standard_error,
        },
        "ours": asdict(row.ours),
        "common": _value(row.common),
        "explanation": row.explanation,
        "explained": _value(row.explained),
        "verdict": row.verdict,
    }


def _value(ours: OurValue | None) -> dict[str, float] | None:
    return None if ours is None else asdict(ours)
