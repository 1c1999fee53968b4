"""Finished runs -> the reproduction: figures, numbers.json, report.html, report.pdf."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from snooker_cli.analysis.run_analysis import fits
from snooker_cli.files import write_json
from snooker_cli.report.audit import audit
from snooker_cli.report.content import REPORT_FIGURES, RUNS, figure_data, values
from snooker_cli.report.pages import Pages
from snooker_cli.report.setting_search import search
from snooker_cli.runs import open_run


def build(runs: Path, out: Path, report_progress: Callable[[str], None]) -> list[Path]:
    """Write the report and return the files that a reader opens.

    Raises ``RunError`` or ``StoreError`` for a run that is missing or cannot be read,
    ``FigureError`` for one without the data of its figure, and ``UserError``.
    """
    opened = {name: open_run(runs / name) for name in RUNS}
    # The other process searches, then draws the figures. This one has all other fits, made once.
    with Pages(out) as pages:
        searching = pages.other.submit(search, opened["audit"], opened["temperature"])
        pictures = {}
        for file, entry in REPORT_FIGURES.items():
            report_progress(entry["label"])
            picture = figure_data(opened, **entry)
            pictures[file] = pages.add_figure(file, picture, entry["label"])
        decays = fits(opened["decay"]).rows
        report_progress("audit: every printed number compared with ours")
        judged = audit(opened, searching.result())
        for point in opened["decay"].points:
            pages.add_player(opened["decay"], point)
        numbers = {
            "figures": {name: picture.numbers for name, picture in pictures.items()},
            "audit": judged.as_json(),
            "fits": decays,
        }
        write_json(out / "numbers.json", rounded(numbers))
        report_progress("pages")
        content = values(opened, pictures, judged, decays)
        return [*pages.write("report.md.j2", content), out / "numbers.json"]


def rounded(content: Any) -> Any:
    """JSON content with six significant digits.

    exp, log and pow differ in their last bits between processors, fits in their seventh digit.
    """
    if isinstance(content, dict):
        return {key: rounded(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [rounded(value) for value in content]
    return float(f"{content:.6g}") if isinstance(content, float) else content
