"""From the configs in configs/, shortened, to the pages of the report."""

from __future__ import annotations

import html
import json
import math
import re
import shutil
import textwrap
from pathlib import Path
from typing import Any

import pytest
from repeating import done, made

from snooker_cli.analysis.decay import range_held
from snooker_cli.config import load, parse
from snooker_cli.errors import RunError
from snooker_cli.formatting import probability
from snooker_cli.report.audit import FOLLOWS, FORMULA, REPRODUCED, UNEXPLAINED
from snooker_cli.report.content import (
    REPORT_FIGURES,
    RUNS,
    build,
    measurement,
    steady_pressures,
)
from snooker_cli.report.source_values import CLAIMS, SOURCE_VALUES, TITLE
from snooker_cli.runs import open_run
from snooker_cli.runs.plan import scene_classes
from snooker_cli.trace import StopReason

ROOT = Path(__file__).parents[2]

CAPTION_WIDTH = 80
"""Characters of a caption in a line of the PDF."""


REPEATS = 2
"""At most this many repeats of a config: the fewest with a spread."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report's configs, run with few repeats; a law is judged on three repeats or more."""
    folder = tmp_path_factory.mktemp("runs")
    for name in RUNS:
        text = (ROOT / "configs" / f"{name}.yaml").read_text(encoding="utf-8")
        given = parse(text).experiment
        overrides = [f"repeats={3 if name == 'decay' else min(given.repeats, REPEATS)}"]
        if given.collisions and given.collisions > 500:
            overrides.append("collisions=500")
        assert not any(result.error for result in done(made(folder / name, text, *overrides)))
    return folder


@pytest.fixture(scope="module")
def report(runs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report built from them."""
    folder = tmp_path_factory.mktemp("report")
    build(runs, folder / "report", lambda message: None)
    return folder / "report"


def test_factors_of_the_steady_gas_have_the_errors_of_both_points() -> None:
    """T falls from 50 to 20 J, with 1 % and 2 %; PV/NT is 10 % above a theory of 1.5."""
    shared = {"theory_here": 1.5, "theory": 1.4, "virial_error": 0.03, "wall": 1.8}
    points = [
        {**shared, "parameters": {"cor": cor, "balls.radius": 1.0}, "virial": virial}
        | {"temperature": warm, "temperature_error": error}
        for cor, warm, error, virial in ((0.8, 20.0, 0.4, 1.65), (1.0, 50.0, 0.5, 1.8))
    ]
    elastic, row = steady_pressures(points)
    assert (elastic["cor"], elastic["colder"], row["cor"]) == (1.0, 1.0, 0.8)
    assert (row["colder"], row["colder_error"]) == pytest.approx(
        (2.5, 2.5 * math.hypot(0.01, 0.02))
    )
    assert row["weaker"] == pytest.approx(1.8 / 1.65)
    assert row["weaker_error"] == pytest.approx(1.8 / 1.65 * math.hypot(0.03 / 1.8, 0.03 / 1.65))
    assert (row["excess"], row["excess_error"]) == pytest.approx((0.1, 0.02))


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


def test_every_config_is_valid_and_every_run_of_the_report_has_its_target() -> None:
    for config in (ROOT / "configs").glob("*.yaml"):
        scene_classes(load(config).points())
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    listed = re.search(r"^RUNS := (.*)$", makefile, flags=re.MULTILINE)
    assert listed is not None
    assert sorted(listed.group(1).split()) == sorted(RUNS)


def test_every_figure_and_the_pdf_have_their_files(report: Path) -> None:
    assert len(REPORT_FIGURES) == 30
    titles = []
    for file in REPORT_FIGURES:
        for ending in ("svg", "png", "json"):
            assert (report / "figures" / f"{file}.{ending}").stat().st_size > 500
        shown = json.loads((report / "figures" / f"{file}.json").read_text(encoding="utf-8"))
        titles.append(shown["title"])
        caption = f"{REPORT_FIGURES[file]['label']}. {shown['caption']}"
        assert len(textwrap.wrap(caption, CAPTION_WIDTH)) <= 5, caption
    assert len(set(titles)) == len(titles)
    assert len((report / "report.pdf").read_bytes()) > 100_000


def test_the_text_judges_laws_by_probabilities_and_has_one_notation(
    numbers: dict[str, Any], text: str
) -> None:
    energies = [row for row in numbers["fits"] if row["quantity"] == "kinetic_energy"]
    for one in (row for row in energies if row["parameters"]["cor"] < 1):
        p = probability(one["probability"])
        shown = p if p.startswith("<") else f"= {p}"
        assert f"(p {shown}) at CoR {one['parameters']['cor']:g}" in text
        assert f"{p} {range_held(one)}" in text
    assert "R²" not in text
    for other in (r"\bPa m\b", r"\b1/s\b", r"\ba[23]\b", r"\bE0\b", "sqrt", r" [\d.]+e-?\d"):
        assert not re.search(other, text), other


def test_numbers_have_six_digits(report: Path) -> None:
    """So they are the same on a processor with other code for exp, log and pow."""
    numbers: list[str] = []
    text = (report / "numbers.json").read_text(encoding="utf-8")
    json.loads(text, parse_float=numbers.append)
    assert len(numbers) > 1000
    assert all(float(f"{float(number):.6g}") == float(number) for number in numbers)


def test_every_printed_number_and_every_claim_has_a_verdict(numbers: dict[str, Any]) -> None:
    rows = {row["number"]["name"]: row for row in numbers["audit"]["numbers"]}
    assert list(rows) == list(SOURCE_VALUES)
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

    assert numbers["audit"]["slip"] == 10.0
    holds = {one["name"]: one["holds"] for one in numbers["audit"]["claims"]}
    assert list(holds) == list(CLAIMS)
    assert holds["energy_conserved"]
    # The source report contradicts these itself.
    for name in ("mean_free_path", "errors_of_theory", "divergence"):
        assert holds[name] is False, name
    for name in ("radius_of_figure_17", "pressure_constant"):
        assert holds[name] is None, name


def test_figure_17_past_its_wall_traps(runs: Path, numbers: dict[str, Any]) -> None:
    """Each start stopped and sliding: when the traps came, from the traces, and what follows."""
    run = open_run(runs / "sliding")
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
            traps = [trace for trace in stopped if trace.stop.reason is StopReason.WALL_TRAP]
            assert pair["trapped"] == len(traps) > 0
            times = [trace.stop.time for trace in traps]
            assert pair["trap_time"] == pytest.approx(sum(times) / len(times), rel=5e-6)
            assert pair["repeats"] == pair["complete"] == len(slid) == REPEATS
            assert pair["end_time"] > pair["trap_time"]
            # The gas cools further, and its mean over more time is as ideal as before; single
            # repeats scatter by 0.02.
            assert pair["slide"]["final_temperature"] < pair["stop"]["final_temperature"]
            assert pair["slide"]["over_ideal_at_mean"] == pytest.approx(1, abs=0.05)


def test_page_is_self_contained_and_cites_the_source_report(report: Path, text: str) -> None:
    page = (report / "report.html").read_text(encoding="utf-8")
    outside = re.sub(r'srcdoc="[^"]*"', "", page)
    addresses = re.findall(r'(?:src|href)="([^"]*)"', outside)
    beside = [address for address in addresses if not address.startswith(("data:", "#"))]
    assert beside == ["live.html"]
    assert "37 balls of 1 m" in (report / "live.html").read_text(encoding="utf-8")
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
