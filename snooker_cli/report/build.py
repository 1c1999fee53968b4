"""Finished runs -> the report's folder: figures, numbers.json, report.html and report.pdf."""

from __future__ import annotations

import signal
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli.analysis import run_analysis
from snooker_cli.animation import embedded, film, page
from snooker_cli.errors import RunError
from snooker_cli.figures import FIGURES, FigureData, Selection
from snooker_cli.figures.drawing import save
from snooker_cli.files import write_json
from snooker_cli.report import content, supplements
from snooker_cli.report.audit import Audit, AuditRow, audit
from snooker_cli.report.content import PLATES, RUNS
from snooker_cli.report.document import write_html, write_pdf
from snooker_cli.report.setting_search import TARGETS
from snooker_cli.report.source_values import OurValue, published
from snooker_cli.runs import Run, open_run

if TYPE_CHECKING:
    from collections.abc import Callable


MEASURED = ("error", "hard", "billion", "physics")
"""The measurements that are kept with the report: of ``snooker bench`` and a name.

And once of ``snooker bench hard billion``, which writes its JSON as hard.json.
"""

LABELS = supplements.ACCURACY_LABELS | supplements.SLIDING_LABELS
"""The figures that are no plates, by file."""


def build(runs: Path, out: Path, say: Callable[[str], None]) -> list[Path]:
    """Write the report; the files a reader opens.

    Raises ``RunError`` or ``StoreError`` for a run that is missing or cannot be read,
    ``FigureError`` for one that cannot give its figure, and ``UserError``.
    """
    opened = {name: open_run(runs / name) for name in RUNS}
    out.mkdir(parents=True, exist_ok=True)
    # A second process audits and then draws what this one has read and fitted meanwhile.
    with ProcessPoolExecutor(
        max_workers=1,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    ) as other:
        judging = other.submit(audit, runs)
        pictures: dict[str, FigureData] = {}
        drawing = []
        for plate in PLATES:
            say(f"{plate.label}: {FIGURES[plate.kind].title}")
            picture = FIGURES[plate.kind].make(opened[plate.run], Selection(where=plate.where))
            drawing.append(other.submit(save, picture, out / "figures" / plate.file))
            pictures[plate.file] = picture
        saved = {name: supplements.saved(name) for name in MEASURED}
        ours = supplements.accuracy_pictures(saved["error"]) | supplements.sliding_pictures(
            opened["sliding"]
        )
        for file, picture in ours.items():
            say(f"{LABELS[file]}: {picture.title}")
            drawing.append(other.submit(save, picture, out / "figures" / file))
            pictures[file] = picture
        fitted = run_analysis.fits(opened["decay"])
        with suppress(RunError):  # The report needs no copy in the run's folder.
            fitted.save()
        say("the audit: every printed number beside ours")
        judged = judging.result()
        for each in drawing:
            each.result()
    write_json(out / "numbers.json", rounded(_numbers(pictures, judged, fitted.rows)))
    document = content.document(pictures, judged, fitted.rows, opened, saved)
    say("the pages")
    return [
        write_html(document, _players(opened["decay"]), out),
        write_pdf(document, out),
        out / "numbers.json",
    ]


def _players(run: Run) -> list[str]:
    """The first repeat of each point, to be played."""
    found = []
    for point in run.points:
        title = f"CoR {point.experiment.cor:g}"
        shown = film(next(iter(run.traces(point))), title, "the first repeat")
        found.append(embedded(page(shown), f"Player, {title}"))
    return found


def _numbers(
    pictures: dict[str, FigureData], judged: Audit, fits: list[dict[str, Any]]
) -> dict[str, Any]:
    """Everything the report says, as numbers."""
    return {
        "figures": {name: picture.numbers for name, picture in pictures.items()},
        "audit": {
            "settings": len(judged.search.candidates),
            "ranked": len(judged.search.ranked),
            "near": judged.near,
            "slip": judged.search.factor,
            "free_slip": asdict(judged.free),
            "profile": [
                {
                    "setting": one.setting.words(),
                    "score": one.score,
                    "values": {name: _value(one.beside(published(name))) for name in TARGETS},
                }
                for one in judged.profile
            ],
            "numbers": [_row(row) for row in judged.rows],
            "claims": [asdict(claim) for claim in judged.claims],
        },
        "fits": fits,
    }


def rounded(content: Any) -> Any:
    """JSON's numbers with six significant digits.

    exp, log and pow differ in their last bits between processors, and so do fits in their seventh
    digit.
    """
    if isinstance(content, dict):
        return {key: rounded(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [rounded(value) for value in content]
    return float(f"{content:.6g}") if isinstance(content, float) else content


def _row(row: AuditRow) -> dict[str, Any]:
    """A row of the audit as JSON."""
    return {
        "name": row.number.name,
        "where": row.number.where,
        "what": row.number.what,
        "unit": row.number.unit,
        "printed": {
            "text": row.number.printed,
            "value": row.number.value,
            "error": row.number.error,
            "half_digit": row.number.half_digit,
            "standard_error": row.number.standard_error,
        },
        "ours": asdict(row.ours),
        "common": _value(row.common),
        "explanation": row.alone,
        "explained": _value(row.value),
        "verdict": row.verdict,
    }


def _value(ours: OurValue | None) -> dict[str, float] | None:
    """A value of ours as JSON."""
    return None if ours is None else asdict(ours)
