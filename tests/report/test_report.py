"""From the configs in configs/, shortened, to the pages of the report."""

from __future__ import annotations

import html
import json
import math
import re
import shutil
import textwrap
import threading
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from command_line import Snooker
from pypdf import PdfReader
from repeating import created

from snooker_cli.analysis.decay import range_held
from snooker_cli.analysis.observables import series
from snooker_cli.config import load
from snooker_cli.errors import RunError
from snooker_cli.formatting import probability
from snooker_cli.report.audit import EXPLAINED, FOLLOWS, FORMULA, REPRODUCED, UNEXPLAINED
from snooker_cli.report.content import REPORT_FIGURES, RUNS, build, measurement
from snooker_cli.report.explanations import LIKELY, TARGETS
from snooker_cli.report.source_values import CLAIMS, SOURCE_VALUES, TITLE
from snooker_cli.runs import open_run
from snooker_cli.runs.execution import Watcher, execute
from snooker_cli.runs.plan import scene_classes
from snooker_cli.trace import StopReason

ROOT = Path(__file__).parents[2]
CONFIGS = sorted((ROOT / "configs").glob("*.yaml"))

CAPTION_WIDTH = 80
"""Characters of a caption in a line of the PDF."""

MARGIN = 40.0
"""Below this height of a page is its number only, in points."""

REPEATS = 2
"""At most this many repeats of a config: the fewest with a spread."""


def quick(config: Path, folder: Path) -> None:
    """Run a config with few repeats and collisions. A law is judged on three repeats or more."""
    given = load(config).experiment
    overrides = [f"repeats={3 if config.stem == 'decay' else min(given.repeats, REPEATS)}"]
    if given.collisions and given.collisions > 500:
        overrides.append("collisions=500")
    experiment = load(config, overrides).experiment
    run = created(folder / config.stem, experiment)
    outcomes = execute(run, workers=1, watcher=Watcher(), cancelled=threading.Event())
    assert [outcome.error for outcome in outcomes if outcome.error] == []


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report's configs, run with few repeats."""
    folder = tmp_path_factory.mktemp("runs")
    for name in RUNS:
        quick(ROOT / "configs" / f"{name}.yaml", folder)
    return folder


@pytest.fixture(scope="module")
def report(runs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report built from them."""
    folder = tmp_path_factory.mktemp("report")
    build(runs, folder / "report", lambda message: None)
    return folder / "report"


@pytest.fixture(scope="module")
def numbers(report: Path) -> dict[str, Any]:
    """The report's numbers."""
    found: dict[str, Any] = json.loads((report / "numbers.json").read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def text(report: Path) -> str:
    """The text of the HTML page with single spaces, without the players."""
    page = (report / "report.html").read_text(encoding="utf-8")
    shown = html.unescape(re.sub(r"<style>.*?</style>|<[^>]*>", " ", page))
    return " ".join(shown.replace("\u2060", "").split())


@pytest.mark.parametrize("config", CONFIGS, ids=lambda path: path.stem)
def test_every_config_is_valid(config: Path) -> None:
    scene_classes(load(config).points())


def test_every_run_of_the_report_has_its_config_and_target() -> None:
    assert set(RUNS) <= {path.stem for path in CONFIGS}
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    listed = re.search(r"^RUNS := (.*)$", makefile, flags=re.MULTILINE)
    assert listed is not None
    assert sorted(listed.group(1).split()) == sorted(RUNS)


@pytest.mark.parametrize("command", ["fit", "compare"])
def test_tables_fit_100_columns(command: str, runs: Path, snooker: Snooker) -> None:
    for name in ("decay", "dilute"):
        lines = snooker(command, runs / name).out.splitlines()
        widths = [len(line) for line in lines if "  " in line]
        assert len(widths) > 10
        assert max(widths) <= 100, name


def test_every_figure_and_the_pdf_have_their_files(report: Path) -> None:
    assert len(REPORT_FIGURES) == 28
    titles = []
    for file in REPORT_FIGURES:
        for ending in ("svg", "png", "json"):
            assert (report / "figures" / f"{file}.{ending}").stat().st_size > 500
        shown = json.loads((report / "figures" / f"{file}.json").read_text(encoding="utf-8"))
        titles.append(shown["title"])
        caption = f"{REPORT_FIGURES[file]['label']}. {shown['caption']}"
        assert len(textwrap.wrap(caption, CAPTION_WIDTH)) <= 5, caption
    assert len(set(titles)) == len(titles)
    content = (report / "report.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert len(content) > 100_000


class Page(NamedTuple):
    """A page of the PDF.

    text : without spaces and hyphens
    lowest : height of the last line above the page number over the foot, 0 to 1
    """

    text: str
    lowest: float


def squeezed(text: str) -> str:
    """Without what depends on where lines end."""
    return re.sub(r"[\s\u2060\u00ad\u2010-]", "", html.unescape(text))


@pytest.fixture(scope="module")
def pages(report: Path) -> list[Page]:
    """The pages of the PDF."""
    found = []
    for page in PdfReader(report / "report.pdf").pages:
        heights: list[float] = []

        def seen(
            text: str, matrix: Any, place: Any, *_: Any, heights: list[float] = heights
        ) -> None:
            if text.strip():
                heights.append(place[4] * matrix[1] + place[5] * matrix[3] + matrix[5])

        text = squeezed(page.extract_text(visitor_text=seen))
        lowest = min(height for height in heights if height > MARGIN)
        found.append(Page(text, lowest / float(page.mediabox.height)))
    return found


def test_pages_are_full_and_figures_near_their_text(report: Path, pages: list[Page]) -> None:
    """At most a fifth of a page is empty, and a figure is on its text's page or the next."""
    assert [page.lowest for page in pages[:-1] if page.lowest > 0.2] == []
    content = (report / "report.html").read_text(encoding="utf-8").split('class="players"')[0]
    blocks = re.findall(r"<p>(.*?)</p>|<figcaption><b>(Figure .*?)</b>(.*?)</fig", content, re.S)
    place, checked = 0, 0
    for paragraph, label, caption in blocks:
        shown = squeezed(label + caption)[:60] if label else squeezed(paragraph)[-30:]
        at = next(n for n, page in enumerate(pages) if n >= place and shown in page.text)
        if label:
            assert at - place in (0, 1), label
            checked += 1
        else:
            place = at
    assert checked == len(REPORT_FIGURES)


def test_laws_are_judged_on_logarithms(numbers: dict[str, Any], text: str) -> None:
    """The probability of their deviations, and until when a law holds, not R²."""
    judged = [
        one
        for one in numbers["fits"]
        if one["quantity"] == "kinetic_energy" and one["parameters"]["cor"] < 1
    ]
    assert len(judged) == 4
    for one in judged:
        p = probability(one["probability"])
        shown = p if p.startswith("<") else f"= {p}"
        assert f"(p {shown}) at CoR {one['parameters']['cor']:g}" in text
        assert f"{p} {range_held(one)}" in text
    assert "R²" not in text


def test_the_text_has_one_notation(text: str) -> None:
    for other in (r"\bPa m\b", r"\b1/s\b", r"\ba[23]\b", r"\bE0\b", "sqrt", r" [\d.]+e-?\d"):
        assert not re.search(other, text), other


def test_numbers_have_six_digits(report: Path) -> None:
    """So they are the same on a processor with other code for exp, log and pow."""
    numbers: list[str] = []
    text = (report / "numbers.json").read_text(encoding="utf-8")
    json.loads(text, parse_float=numbers.append)
    assert len(numbers) > 1000
    assert all(float(f"{float(each):.6g}") == float(each) for each in numbers)


def test_every_printed_number_has_a_verdict(numbers: dict[str, Any]) -> None:
    rows = {row["number"]["name"]: row for row in numbers["audit"]["numbers"]}
    assert list(rows) == list(SOURCE_VALUES)
    verdicts = {REPRODUCED, FOLLOWS, FORMULA, EXPLAINED, UNEXPLAINED}
    assert {row["verdict"] for row in rows.values()} <= verdicts
    # These need no statistics, so short runs give the same verdicts.
    expected = {
        REPRODUCED: "largest_distance smallest_distance momentum_x momentum_y density",
        FOLLOWS: "tau_0.8 tau_0.9 theory_0.8 theory_0.9 doubled_0.8 doubled_0.9 "
        "energy_abstract_0.8",
        FORMULA: "mean_free_path",
        UNEXPLAINED: "cross_section",
    }
    for verdict, names in expected.items():
        for name in names.split():
            assert rows[name]["verdict"] == verdict, name
    assert rows["cross_section"]["ours"]["value"] == pytest.approx(6.2832, abs=1e-4)
    assert rows["cross_section"]["explained"]["value"] == pytest.approx(0.4, abs=1e-4)


def test_explanations_are_judged_by_all_targets_together(numbers: dict[str, Any]) -> None:
    audit = numbers["audit"]
    assert len(audit["explanations"]) == 8
    for one in audit["explanations"]:
        assert set(one["values"]) == {each.name for each in TARGETS}
        assert one["whole"] == (None not in one["values"].values())
        assert one["rejected"] == (one["score"] > LIKELY)
    assert audit["slip"] == 10.0


def test_every_claim_is_checked(numbers: dict[str, Any]) -> None:
    holds = {one["name"]: one["holds"] for one in numbers["audit"]["claims"]}
    assert list(holds) == list(CLAIMS)
    assert holds["energy_conserved"]
    # The source report contradicts these itself.
    for name in ("radius_of_figure_17", "pressure_constant", "errors_of_theory", "divergence"):
        assert not holds[name], name


def test_what_survives_is_stated_with_its_numbers(numbers: dict[str, Any], text: str) -> None:
    found = numbers["audit"]["explanations"]
    rejected = [one["rejected"] for one in found]
    assert ("None fits within the errors" in text) == all(rejected)
    assert f"{sum(rejected)} of {len(found)} rows" in text
    assert f"best combination has χ² = {found[-1]['score']:.0f}" in text
    assert "The numbers do not decide between the two" in text


def test_conclusions_state_what_was_measured(numbers: dict[str, Any], text: str) -> None:
    """Tiny balls in windows of time, the pressure in them, and all factors with their product."""
    (claim,) = (c for c in numbers["audit"]["claims"] if c["name"] == "pressure_excess")
    assert re.search(r"in 8 windows of time 0\.\d\d to 1\.\d\d at CoR 0\.8", claim["check"])
    for no in ("at any CoR", "the origin of", "nearly cancel", "do not explain the rest"):
        assert no not in text
    assert text.count("in the first to") == 2
    factors = text[text.index("Table 13. ") :]
    rows = re.findall(r"([\d.]+) ([\d.]+)(?= |$)", factors)
    values = np.array(rows[:6], dtype=float)
    assert np.prod(values[:5], axis=0) == pytest.approx(values[5], abs=0.02)
    assert np.all(values[4] < 0.9)


def test_event_averages_leave_out_repeats_that_ended_early(
    runs: Path, numbers: dict[str, Any], text: str
) -> None:
    run = open_run(runs / "restitution")
    for cor in (0.8, 0.9):
        (point,) = (one for one in run.points if one.experiment.cor == cor)
        speeds = [
            series(trace).mean_speed[1:].mean()
            for trace in run.traces(point)
            if trace.stop.reason.complete
        ]
        rows = {row["number"]["name"]: row for row in numbers["audit"]["numbers"]}
        assert rows[f"speed_{cor}"]["ours"]["value"] == pytest.approx(np.mean(speeds), rel=1e-5)
    assert f"{numbers['audit']['complete']} of its {2 * REPEATS} repeats below CoR 1" in text
    assert text.count(": all complete.") > 10


def test_figure_17_past_its_wall_traps(runs: Path, numbers: dict[str, Any]) -> None:
    """Each start stopped and sliding: when the traps came, from the traces, and what follows."""
    run = open_run(runs / "sliding")
    assert {each.experiment.collapse for each in run.points} == {"stop", "slide"}
    assert math.isinf(run.points[0].experiment.container.mass)
    for name, radius_of in (("sliding", "ratio_caption"), ("sliding-text", "ratio_text")):
        pairs = numbers["figures"][name]["pairs"]
        assert [pair["cor"] for pair in pairs] == [0.8, 0.9]
        for pair in pairs:
            stopped, slid = (
                list(run.traces(point))
                for collapse in ("stop", "slide")
                for point in run.points
                if point.experiment.cor == pair["cor"]
                and point.experiment.balls.radius == SOURCE_VALUES[radius_of].radius
                and point.experiment.collapse == collapse
            )
            traps = [each for each in stopped if each.stop.reason is StopReason.WALL_TRAP]
            assert pair["trapped"] == len(traps) > 0
            times = [each.stop.time for each in traps]
            assert pair["trap_time"] == pytest.approx(sum(times) / len(times), rel=5e-6)
            assert pair["repeats"] == pair["complete"] == len(slid) == REPEATS
            assert pair["end_collisions"] == 500
            assert pair["end_time"] > pair["trap_time"]
            assert pair["sliding_balls"] >= 1
            # The gas cools further, and its mean over more time is as ideal as before; single
            # repeats scatter by 0.02.
            assert pair["slide"]["final_temperature"] < pair["stop"]["final_temperature"]
            assert pair["slide"]["over_ideal_at_mean"] == pytest.approx(1, abs=0.05)


def test_page_is_self_contained_and_cites_the_source_report(report: Path, text: str) -> None:
    page = (report / "report.html").read_text(encoding="utf-8")
    outside = re.sub(r'srcdoc="[^"]*"', "", page)
    addresses = re.findall(r'(?:src|href)="([^"]*)"', outside)
    assert all(address.startswith(("data:", "#")) for address in addresses)
    assert outside.count("<img ") == len(REPORT_FIGURES)
    assert not re.search(r"<(?:script|link)\b", outside)
    players = re.findall(r'<iframe[^>]*sandbox="allow-scripts"[^>]*srcdoc="([^"]*)"', page)
    assert len(players) == page.count("<iframe") == 3
    assert all("default-src 'none'" in html.unescape(player) for player in players)
    assert TITLE in text[: text.index("Theory and algorithm")]
    for number in SOURCE_VALUES.values():
        assert number.what in text, number.name
        assert number.printed in text, number.name
    assert "nan" not in re.findall(r"\b[a-z]+\b", text)


@pytest.mark.long
def test_second_build_gives_the_same_bytes(runs: Path, report: Path, tmp_path: Path) -> None:
    build(runs, tmp_path, lambda message: None)
    files = sorted(path.relative_to(report) for path in report.rglob("*") if path.is_file())
    assert len(files) == 3 * len(REPORT_FIGURES) + 3
    for name in files:
        assert (tmp_path / name).read_bytes() == (report / name).read_bytes(), name


def test_a_missing_run_is_an_error(runs: Path, tmp_path: Path) -> None:
    partly = tmp_path / "runs"
    partly.mkdir()
    for name in RUNS[1:]:
        shutil.copytree(runs / name, partly / name)
    with pytest.raises(RunError, match=RUNS[0]):
        build(partly, tmp_path / "out", lambda message: None)


def test_saved_hard_cases_have_the_titles_of_their_configs() -> None:
    """The report prints the saved title; a changed title needs the same change there."""
    for name in ("hard", "billion"):
        for case in measurement(name)["cases"]:
            config = load(ROOT / "configs" / "hard" / f"{case['name']}.yaml")
            assert case["why"] == config.experiment.title
