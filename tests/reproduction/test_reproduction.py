"""From the configs in configs/, shortened, to the pages of the reproduction."""

from __future__ import annotations

import html
import io
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typst
from PIL import Image
from pypdf import PdfReader
from repeating import done, made

from snooker_cli.config import load, parse
from snooker_cli.errors import RunError, UserError
from snooker_cli.figures.figure_data import Line, Points
from snooker_cli.report.document import Document, document, layout
from snooker_cli.reproduction import reproduce
from snooker_cli.reproduction.printed import OVERVIEWS, READ, overview
from snooker_cli.reproduction.reproduce import (
    REPORT_FIGURES,
    RUNS,
    build,
    measurement,
    text_of_file,
    values,
)
from snooker_cli.reproduction.source_values import SOURCE_VALUES, TITLE
from snooker_cli.runs import open_run
from snooker_cli.runs.plan import scene_classes
from snooker_cli.trace import StopReason

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "golden" / "reproduction.json"

REPEATS = 2
"""At most this many repeats of a config: the fewest with a spread."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The configs, run with few repeats; a law is judged on three repeats or more."""
    folder = tmp_path_factory.mktemp("runs")
    for name in RUNS:
        text = (ROOT / "configs" / f"{name}.yaml").read_text(encoding="utf-8")
        given = parse(text).config
        judged = name in ("decay", "restitution", "audit")
        overrides = [f"repeats={3 if judged else min(given.repeats, REPEATS)}"]
        if given.collisions and given.collisions > 500:
            overrides.append("collisions=500")
        assert not any(result.error for result in done(made(folder / name, text, *overrides)))
    return folder


@pytest.fixture(scope="module")
def report(runs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages built from them, whatever the sentences say."""
    folder = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(reproduce, "check", lambda found: None)
        build(runs, folder / "report", lambda message: None)
    return folder / "report"


@pytest.fixture(scope="module")
def numbers(report: Path) -> dict[str, Any]:
    """Its numbers."""
    found: dict[str, Any] = json.loads((report / "numbers.json").read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def text(report: Path) -> str:
    """The text of both HTML pages with single spaces, without the players."""
    pages = [(report / f"{name}.html").read_text("utf-8") for name in reproduce.DOCUMENTS]
    shown = html.unescape(
        re.sub(r"<style>.*?</style>|<[^>]*>", " ", "".join(pages), flags=re.DOTALL)
    )
    return " ".join(shown.replace("\u2060", "").split())


def test_every_config_is_valid_and_every_run_of_the_report_has_its_target() -> None:
    for config in (ROOT / "configs").glob("*.yaml"):
        scene_classes(load(config).points())
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    listed = re.search(r"^RUNS := (.*)$", makefile, flags=re.MULTILINE)
    assert listed is not None
    assert sorted(listed.group(1).split()) == sorted(RUNS)


def test_few_repeats_stop_the_report_with_the_name_of_a_sentence(
    runs: Path, report: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved = json.loads((report / "numbers.json").read_text(encoding="utf-8"))
    monkeypatch.setattr(reproduce, "REPORT_FIGURES", {})
    monkeypatch.setattr(reproduce, "all_results", lambda *_: saved)
    with pytest.raises(UserError, match=r"the results do not support the sentence “.+”"):
        build(runs, tmp_path / "report", lambda message: None)
    assert not (tmp_path / "report" / "report.pdf").exists()


def test_every_figure_has_its_files_and_is_in_one_document(report: Path) -> None:
    titles, documents = [], []
    for file in (*REPORT_FIGURES, *OVERVIEWS):
        for ending in ("svg", "png", "json"):
            assert (report / "figures" / f"{file}.{ending}").stat().st_size > 500
        saved = json.loads((report / "figures" / f"{file}.json").read_text(encoding="utf-8"))
        titles.append(saved["title"])
    assert len(set(titles)) == len(titles)
    for template in reproduce.DOCUMENTS.values():
        grids = re.findall(r"^@grid (.*)$", text_of_file(f"templates/{template}"), re.MULTILINE)
        documents.append([file for line in grids for file in line.split()])
    paper, tables = documents
    assert paper[:2] == [*OVERVIEWS]
    assert sorted([*paper[2:], *tables]) == sorted(REPORT_FIGURES)
    labels = [[REPORT_FIGURES[file]["label"] for file in files] for files in (paper[2:], tables)]
    moved = (4, 5, 8, 9)
    assert labels[0] == [f"Figure {n}" for n in range(1, 27) if n not in moved]
    assert labels[1] == [f"Figure {n}" for n in (*moved, "A1", "A2", "A3", "A4")]


def test_numbers_have_six_digits(report: Path) -> None:
    """So they are the same on a processor with other code for exp, log and pow."""
    found: list[str] = []
    text = (report / "numbers.json").read_text(encoding="utf-8")
    json.loads(text, parse_float=found.append)
    assert len(found) > 1000
    assert all(float(f"{float(number):.6g}") == float(number) for number in found)


def test_traps_have_the_times_of_their_repeats(runs: Path, numbers: dict[str, Any]) -> None:
    """Each start stopped and sliding."""
    run = open_run(runs / "sliding")
    assert len(numbers["traps"]) == 4
    for row in numbers["traps"]:
        stopped, slid = (
            list(run.traces(point))
            for collapse in ("stop", "slide")
            for point in run.points
            if point.config.cor == row["cor"]
            and point.config.balls.radius == row["radius"]
            and point.config.collapse == collapse
        )
        times = [t.stop.time for t in stopped if t.stop.reason is StopReason.WALL_TRAP]
        assert row["trapped"] == len(times) > 0
        assert row["time"] == pytest.approx(sum(times) / len(times), rel=5e-6)
        assert row["repeats"] == row["complete"] == len(slid) == REPEATS
        assert row["end"] == pytest.approx(np.mean([t.stop.time for t in slid]), rel=5e-6)


def test_pages_are_self_contained_and_have_one_notation(report: Path, text: str) -> None:
    page = (report / "report.html").read_text(encoding="utf-8")
    outside = re.sub(r'srcdoc="[^"]*"', "", page)
    addresses = re.findall(r'(?:src|href)="([^"]*)"', outside)
    beside = [address for address in addresses if not address.startswith(("data:", "#"))]
    assert beside == ["live.html"]
    assert "37 balls of 1 m" in (report / "live.html").read_text(encoding="utf-8")
    assert not re.search(r"<(?:script|link)\b", outside)
    players = re.findall(r'<iframe[^>]*sandbox="allow-scripts"[^>]*srcdoc="([^"]*)"', page)
    assert len(players) == page.count("<iframe") == 3
    assert all("default-src 'none'" in html.unescape(player) for player in players)
    assert "<iframe" not in (report / "report-tables.html").read_text(encoding="utf-8")
    assert TITLE in text[: text.index("Question")]
    for number in SOURCE_VALUES.values():
        assert number.what in text, number.name
        assert number.printed in text, number.name
    assert "nan" not in re.findall(r"\b[a-z]+\b", text)
    for other in (r"\bPa m\b", r"\b1/s\b", r"\ba[23]\b", r"\bE0\b", "sqrt", r" [\d.]+e-?\d", "R²"):
        assert not re.search(other, text), other


@pytest.fixture(scope="module")
def paper(report: Path) -> Document:
    """The paper with the saved results of all repeats, and the figures of the short runs."""
    found = json.loads(GOLDEN.read_text(encoding="utf-8"))
    experiments = {name: load(ROOT / "configs" / f"{name}.yaml").config for name in RUNS}
    figures = {
        file: {"label": entry["label"], "alt": "a figure", "caption": entry["caption"]}
        for file, entry in REPORT_FIGURES.items()
    }
    for number, file in enumerate(OVERVIEWS, 1):
        figures[file] = {"label": f"Overview {number}", "alt": "a figure", "caption": READ}
    return document(text_of_file("templates/paper.md.j2"), values(found, experiments), figures)


def test_the_paper_has_at_most_nine_pages_without_large_gaps(paper: Document, report: Path) -> None:
    """No empty part of a page is above a quarter, but after the end."""
    source, settings = layout(paper, report)
    pages = typst.compile(source, format="png", ppi=30, **settings)
    assert 4 <= len(pages) <= 9
    for page in pages[:-1]:
        rows = np.asarray(Image.open(io.BytesIO(page)).convert("L")).min(axis=1) < 200
        inked = np.flatnonzero(rows)
        assert np.diff(inked).max() < 0.25 * len(rows)
    for block in paper["blocks"]:
        if block["kind"] == "table":
            assert len(block["rows"]) <= 20, block["label"]


def test_all_printed_numbers_over_ours_are_on_the_first_page(paper: Document) -> None:
    """Each is one marker of one figure, filled if it agrees, with its interval."""
    assert [block["file"] for block in paper["blocks"][:2]] == [*OVERVIEWS]
    printed = json.loads(GOLDEN.read_text(encoding="utf-8"))["printed"]
    figures = [overview(file, printed) for file in OVERVIEWS]
    layers = [layer for figure in figures for layer in figure.layers]
    markers = [layer for layer in layers if isinstance(layer, Points)]
    intervals = [layer.x for layer in layers if isinstance(layer, Line)]
    over = {row["name"]: row["value"] / row["ours"]["value"] for row in printed}
    assert len(printed) == len(SOURCE_VALUES) == len(intervals)
    assert sorted(float(marker.x[0]) for marker in markers) == pytest.approx(sorted(over.values()))
    filled = sorted(float(marker.x[0]) for marker in markers if marker.filled)
    assert filled == pytest.approx(sorted(over[row["name"]] for row in printed if row["agrees"]))
    for marker, (low, high) in zip(markers, intervals, strict=True):
        assert low <= marker.x[0] <= high
        assert low * high == pytest.approx(marker.x[0] ** 2)
    lines = {
        (number, round(float(layer.y[0])))
        for number, figure in enumerate(figures)
        for layer in figure.layers
        if isinstance(layer, Points)
    }
    assert {figures[number].y_names[place] for number, place in lines} == {
        re.sub(r", CoR 0\.[89]$", "", row["what"]) for row in printed
    }


def test_figures_follow_the_text_that_names_them(paper: Document) -> None:
    before = ""
    for block in paper["blocks"]:
        if block["kind"] == "paragraph":
            before += block["text"]
        if block["kind"] == "figure" and not block["label"].startswith("Overview"):
            assert int(block["label"].split()[1]) in named(before), block["label"]


def named(text: str) -> set[int]:
    """The numbers of the figures that a text names: ``figures 3 and 4``, ``figures 6 to 9``."""
    found = set[int]()
    for words in re.findall(r"figures? ((?:\d+(?:, | and | to )?)+)", text.replace("\u00a0", " ")):
        for first, last in re.findall(r"(\d+)(?: to (\d+))?", words):
            found |= set(range(int(first), int(last or first) + 1))
    return found


def test_both_documents_are_tagged_pdf(report: Path) -> None:
    for name in reproduce.DOCUMENTS:
        metadata = PdfReader(report / f"{name}.pdf").trailer["/Root"]["/Metadata"]
        assert "<pdfuaid:part>1</pdfuaid:part>" in metadata.get_data().decode()


def test_a_missing_run_is_an_error(runs: Path, tmp_path: Path) -> None:
    partly = tmp_path / "runs"
    partly.mkdir()
    for name in RUNS[1:]:
        shutil.copytree(runs / name, partly / name)
    with pytest.raises(RunError, match=RUNS[0]):
        build(partly, tmp_path / "out", lambda message: None)


def test_saved_hard_cases_have_the_titles_of_their_configs() -> None:
    """The tables print the saved title; a changed title needs the same change there."""
    for name in ("hard", "billion"):
        for case in measurement(name)["cases"]:
            config = load(ROOT / "configs" / "hard" / f"{case['name']}.yaml")
            assert case["why"] == config.config.title
