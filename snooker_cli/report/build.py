"""Finished runs -> files of the reproduction: figures, numbers.json, report.html, report.pdf."""

import json
from collections.abc import Callable
from pathlib import Path

from snooker_cli.analysis.run_analysis import fits
from snooker_cli.files import write_json
from snooker_cli.report.audit import audit
from snooker_cli.report.content import REPORT_FIGURES, RUNS, figure_data, values
from snooker_cli.report.explanations import explain
from snooker_cli.report.pages import Pages
from snooker_cli.runs import open_run
from snooker_cli.runs.progress import counting


def build(runs: Path, out: Path, report_progress: Callable[[str], None]) -> list[Path]:
    """Write the report and return the files that a reader opens.

    Raises ``RunError`` or ``StoreError`` for a run that is missing or cannot be read,
    ``FigureError`` for one without the data of its figure, and ``UserError``.
    """
    opened = {name: open_run(runs / name) for name in RUNS}
    # The other process makes the explanations, then draws. This one has all other fits, made once.
    with Pages(out) as pages:
        explaining = pages.other.submit(explain, opened["audit"], opened["temperature"])
        pictures = {}
        for file, entry in REPORT_FIGURES.items():
            report_progress(entry["label"])
            picture = figure_data(opened, **entry)
            pictures[file] = pages.add_figure(file, picture, entry["label"])
        decays = fits(opened["decay"], counting=counting).rows
        report_progress("audit: every printed number compared with ours")
        judged = audit(opened, explaining.result())
        for point in opened["decay"].points:
            pages.add_player(opened["decay"], point)
        numbers = {
            "figures": {name: picture.numbers for name, picture in pictures.items()},
            "audit": judged.as_json(),
            "fits": decays,
        }
        # exp, log and pow differ in their last bits between processors, fits in the seventh digit.
        six_digits = json.loads(json.dumps(numbers), parse_float=lambda x: float(f"{float(x):.6g}"))
        write_json(out / "numbers.json", six_digits)
        report_progress("pages")
        content = values(opened, pictures, judged, decays)
        return [*pages.write("report.md.j2", content), out / "numbers.json"]
