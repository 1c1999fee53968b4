"""Finished runs -> the reproduction of the source report: figures, numbers, paper and tables."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import yaml

import snooker_cli as snooker
from snooker_cli import Run
from snooker_cli.figures.figure_data import FigureData
from snooker_cli.figures.registry import FIGURES
from snooker_cli.files import write_json
from snooker_cli.formatting import plain, range_held, short, with_error
from snooker_cli.report.document import Pages
from snooker_cli.reproduction.claims import CLAIMS, check, decay_factors, tiny_path
from snooker_cli.reproduction.explanations import explain
from snooker_cli.reproduction.printed import (
    KEYS,
    OVERVIEWS,
    REFUSED,
    comparison,
    overview,
    statements,
)
from snooker_cli.reproduction.run_results import SETTLED, WINDOWS, NumbersOfRun, results
from snooker_cli.reproduction.source_values import LORD, TARGETS, TITLE, text_of_file
from snooker_cli.runs.selection import Selection
from snooker_cli.validation import accuracy_study
from snooker_cli.validation.physics_study import walls

REPORT_FIGURES: dict[str, dict[str, Any]] = yaml.safe_load(text_of_file("figures.yaml"))
"""All figures by file; figures.yaml explains their keys."""

RUNS = (
    *dict.fromkeys(entry["run"] for entry in REPORT_FIGURES.values() if "run" in entry),
    *("mixed", "audit"),
)
"""The runs of the reproduction: those of the configs with these names."""

MEASUREMENTS = ("error", "hard", "billion", "physics", "certain")
"""Saved measurements of ``snooker bench``, and of ``tests/make_certain.py``; billion is a hard case
of its own."""

DOCUMENTS = {"report": "paper.md.j2", "report-tables": "tables.md.j2"}
"""The names of both documents, and their templates."""


@cache
def measurement(name: str) -> dict[str, Any]:
    """A saved measurement."""
    return dict(json.loads(text_of_file(f"measured/{name}.json")))


def figure_data(runs: Mapping[str, Run], file: str) -> FigureData:
    """A figure by its file in figures.yaml. Raises ``FigureError`` or ``StoreError``."""
    entry = REPORT_FIGURES[file]
    if "run" not in entry:
        picture = accuracy_study.figures(measurement("error"))[f"{file}-report"]
        return replace(picture, caption=entry["caption"])
    run, selection = runs[entry["run"]], Selection(entry.get("where", {}))
    picture = FIGURES[entry["figure"]].make(run, selection, source=True)
    if entry.get("linear"):
        zero = 0.0, None
        picture = replace(picture, x_log=False, y_log=False, x_limits=zero, y_limits=zero)
    title = entry.get("title", picture.title)
    caption = entry["caption"].format(repeats=run.config.repeats)
    return replace(picture, title=title, caption=caption)


def build(folder: Path, out: Path, report_progress: Callable[[str], None]) -> list[Path]:
    """Write the reproduction from the runs in a folder; the files that a reader opens.

    Raises ``RunError``, ``StoreError``, ``FigureError``, and ``UserError`` without the report's
    libraries or where the results do not support a sentence.
    """
    runs = {name: snooker.open(folder / name) for name in RUNS}
    with Pages(out) as pages:
        pictures = {}
        for file, entry in REPORT_FIGURES.items():
            report_progress(entry["label"])
            pictures[file] = pages.add_figure(file, figure_data(runs, file), entry["label"])
        report_progress("results, and what the text says about them")
        found = all_results(runs, pictures)
        check(found | {"measured": {name: measurement(name) for name in MEASUREMENTS}})
        for number, file in enumerate(OVERVIEWS, 1):
            pages.add_figure(file, overview(file, found["printed"]), f"Overview {number}")
        write_json(out / "numbers.json", six_digits(found))
        for point in runs["decay"].points:
            pages.add_player(runs["decay"], point)
        report_progress("pages")
        page = snooker.live().save(out / "live.html")
        content = values(found, {name: run.config for name, run in runs.items()})
        written = [
            path
            for name, template in DOCUMENTS.items()
            for path in pages.write(text_of_file(f"templates/{template}"), content, name)
        ]
        return [*written, out / "numbers.json", page]


def all_results(runs: Mapping[str, Run], pictures: Mapping[str, FigureData]) -> NumbersOfRun:
    """Results, explanations, printed numbers and sentences: what the text refers to."""
    found = results(runs, pictures)
    found["explanations"] = explain(runs["audit"], found["elastic"]["pressure"])
    return dict(plain(found | {"printed": comparison(found), "statements": statements(found)}))


def six_digits(found: NumbersOfRun) -> NumbersOfRun:
    """Results as files have them.

    exp, log and pow differ in their last bits between processors, fits in the seventh digit.
    """
    rounded = json.loads(json.dumps(found), parse_float=lambda x: float(f"{float(x):.6g}"))
    return dict(rounded)


def holds(name: str) -> str:
    """Marks a sentence that ``claims.check`` has tested; raises ``KeyError`` for an unknown one."""
    CLAIMS[name]
    return ""


def values(found: NumbersOfRun, experiments: Mapping[str, Any]) -> dict[str, Any]:
    """What the templates refer to: results, saved measurements, and words for numbers."""
    return {
        **found,
        "measured": {name: measurement(name) for name in MEASUREMENTS},
        # They do not follow from others, are printed once, and are no single run of a mean.
        "independent": [
            row
            for row in found["printed"]
            if not (row["follows"] or row["repeats"] or "_one_" in row["name"])
        ],
        "experiments": experiments,
        "scene": experiments["decay"],
        "title": TITLE,
        "targets": TARGETS,
        "lord": 2 * LORD,
        "windows": WINDOWS,
        "settled": SETTLED,
        "refused": REFUSED,
        "tiny_path": tiny_path(found),
        "factors": decay_factors(found),
        "holds": holds,
        "held": range_held,
        "ours": _ours,
        "walls": walls,
        "zip": zip,
        "percents": lambda rows, name: [100 * row[name] for row in rows],
        "pm": lambda known, unit="": with_error(known["value"], known["error"], unit),
        "both": lambda texts: " and ".join(
            f"{text} at CoR {cor}" for text, cor in zip(texts, KEYS, strict=True)
        ),
    }


def _ours(row: Mapping[str, Any]) -> str:
    """Our value of a printed number: with its error, or as the printed one and a rounding."""
    ours = row["ours"]
    if ours["error"] or not row["exact"]:
        return with_error(ours["value"], ours["error"])
    off = ours["value"] - row["value"]
    return f"{row['digits']} {'+' if off > 0 else '−'} {short(abs(off), 1)}"
