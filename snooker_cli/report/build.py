"""Finished runs -> the folder of this report: figures, numbers.json, report.html, report.pdf."""

from __future__ import annotations

import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli.analysis.decay import decays
from snooker_cli.animation import embedded, film, page
from snooker_cli.figures import Selection
from snooker_cli.figures.drawing import save
from snooker_cli.figures.selection import repeats
from snooker_cli.files import write_json
from snooker_cli.report.audit import audit
from snooker_cli.report.content import REPORT_FIGURES, RUNS, figure_data, values
from snooker_cli.report.document import document, require_libraries, write_html, write_pdf
from snooker_cli.report.setting_search import search
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
    # A second process searches, then draws the figures. This one has all other fits, made once.
    with second_process() as other:
        searching = other.submit(search, opened["audit"], opened["temperature"])
        pictures: dict[str, FigureData] = {}
        captions: dict[str, dict[str, str]] = {}
        drawing = []
        for file, entry in REPORT_FIGURES.items():
            report_progress(entry["label"])
            pictures[file] = figure_data(opened, **entry)
            captions[file] = shown(entry["label"], pictures[file])
            drawing.append(other.submit(save, pictures[file], out / "figures" / file))
        fits = _fits(opened["decay"])
        report_progress("audit: every printed number compared with ours")
        judged = audit(opened, searching.result())
        for each in drawing:
            each.result()
    numbers = {
        "figures": {name: picture.numbers for name, picture in pictures.items()},
        "audit": judged.as_json(),
        "fits": fits,
    }
    write_json(out / "numbers.json", rounded(numbers))
    content = document("report.md.j2", values(opened, pictures, judged, fits), captions)
    report_progress("pages")
    return [
        write_html(content, _players(opened["decay"]), out),
        write_pdf(content, out),
        out / "numbers.json",
    ]


def second_process() -> ProcessPoolExecutor:
    """A process that draws while this one computes; Ctrl-C ends this one only."""
    return ProcessPoolExecutor(
        max_workers=1,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )


def shown(label: str, picture: FigureData) -> dict[str, str]:
    """What a document prints of a figure."""
    return {"label": label, "caption": picture.caption, "alt": picture.alt}


def _fits(run: Run) -> list[dict[str, Any]]:
    """The decay constants of a run by point, quantity and law, as JSON."""
    return [
        {"parameters": point.as_json(), **one.as_json()}
        for point in run.points
        for one in decays(repeats(run, point, Selection()))
    ]


def _players(run: Run) -> list[str]:
    """HTML players of the first repeat of each point."""
    found = []
    for point in run.points:
        title = f"CoR {point.experiment.cor:g}"
        shown = film(next(iter(run.traces(point))), title, "the first repeat")
        found.append(embedded(page(shown), f"Player, {title}"))
    return found


def rounded(content: Any) -> Any:
    """JSON content with six significant digits.

    exp, log and pow differ in their last bits between processors, fits in their seventh digit.
    """
    if isinstance(content, dict):
        return {key: rounded(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [rounded(value) for value in content]
    return float(f"{content:.6g}") if isinstance(content, float) else content
