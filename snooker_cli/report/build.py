"""Finished runs -> the report's folder: figures, numbers.json, report.html and report.pdf."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli.decay import decays, record
from snooker_cli.figures import save
from snooker_cli.gallery import KINDS, Picture, Selection
from snooker_cli.report import content
from snooker_cli.report.audit import Audit, Row, Runs, audit
from snooker_cli.report.plates import PLATES, RUNS
from snooker_cli.report.rendering import write_html, write_pdf
from snooker_cli.results import Run, open_run, write_json

if TYPE_CHECKING:
    from collections.abc import Callable


def build(runs: Path, out: Path, say: Callable[[str], None]) -> list[Path]:
    """Write the report; the files a reader opens.

    Raises ``RunError`` or ``StoreError`` for a run that is missing or cannot be read,
    ``PictureError`` for one that cannot give its figure, and ``RenderingError``.
    """
    opened = {name: open_run(runs / name) for name in RUNS}
    out.mkdir(parents=True, exist_ok=True)
    pictures: dict[str, Picture] = {}
    for plate in PLATES:
        say(f"{plate.label}: {KINDS[plate.kind].title}")
        picture = KINDS[plate.kind].make(opened[plate.run], Selection(where=plate.where))
        save(picture, out / "figures" / plate.file)
        pictures[plate.file] = picture
    say("the audit: every printed number beside ours")
    judged = audit(
        Runs(
            decay=opened["decay"],
            radius=opened["radius"],
            dilute=opened["dilute"],
            audit=opened["audit"],
        )
    )
    fits = _fits(opened["decay"])
    write_json(out / "numbers.json", _numbers(pictures, judged, fits))
    document = content.document(pictures, judged, fits, opened)
    say("the pages")
    return [write_html(document, out), write_pdf(document, out), out / "numbers.json"]


def _fits(run: Run) -> list[dict[str, Any]]:
    """The decay constants of a run."""
    return [
        record(decay, point.as_json())
        for point in run.points
        for decay in decays(run.traces(point))
    ]


def _numbers(
    pictures: dict[str, Picture], judged: Audit, fits: list[dict[str, Any]]
) -> dict[str, Any]:
    """Everything the report says, as numbers."""
    return {
        "figures": {name: picture.numbers for name, picture in pictures.items()},
        "audit": {
            "finding": {
                "setting": judged.finding.setting.words(),
                "values": judged.finding.values,
                "score": judged.score,
                "candidates": judged.candidates,
                "near": judged.near,
            },
            "numbers": [_row(row) for row in judged.rows],
            "claims": [asdict(claim) for claim in judged.claims],
        },
        "fits": fits,
    }


def _row(row: Row) -> dict[str, Any]:
    """A row of the audit as JSON."""
    return {
        "name": row.number.name,
        "where": row.number.where,
        "what": row.number.what,
        "unit": row.number.unit,
        "printed": {"value": row.number.value, "error": row.number.error},
        "ours": asdict(row.ours),
        "explanation": row.explanation,
        "explained": None if row.explained is None else asdict(row.explained),
        "verdict": row.verdict,
    }
