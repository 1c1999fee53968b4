"""``snooker report``: the pages on a user's own runs."""

from __future__ import annotations

import html
import json
import re
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import pytest
from browser import CHROMIUM, Browser
from command_line import Ended
from pypdf import PdfReader

from snooker_cli.analysis.run_analysis import fits
from snooker_cli.analysis.tables import fit_cells, share_complete
from snooker_cli.config import digest, load
from snooker_cli.errors import FigureError
from snooker_cli.formatting import point_label
from snooker_cli.report import run_report as module
from snooker_cli.report.pages import Pages
from snooker_cli.report.run_report import MOST_POINTS, MOST_ROWS, run_report
from snooker_cli.runs import Run, open_run

ROW = re.compile(r"<tr>(.*?)</tr>", re.DOTALL)


def made(folder: Path, *runs: Run) -> Path:
    """The report on runs."""
    run_report(runs, folder, lambda message: None)
    return folder


def page(folder: Path) -> str:
    """The HTML page without players and images."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    return re.sub(r'srcdoc="[^"]*"|src="[^"]*"', "", text)


def words(folder: Path) -> str:
    """The text of the HTML page with single spaces."""
    text = re.sub(r"<style>.*?</style>|<[^>]*>", " ", page(folder), flags=re.DOTALL)
    return " ".join(html.unescape(text).split())


@pytest.fixture(scope="module")
def small(finished_run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on the small run: two points, some repeats of which end in a wall trap."""
    return made(tmp_path_factory.mktemp("small"), finished_run)


@pytest.fixture(scope="module")
def both(decaying: Run, warm: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on a run of collisions and one of summaries."""
    folder = tmp_path_factory.mktemp("both")
    shutil.copytree(decaying.directory, folder / "decaying")
    shutil.copytree(warm.directory, folder / "warm")
    return made(folder / "report", open_run(folder / "decaying"), open_run(folder / "warm"))


def test_a_report_has_the_same_bytes_when_repeated(
    small: Path, finished_run: Run, tmp_path: Path
) -> None:
    """Also of a copy of the run in another folder, as on another machine."""
    copy = shutil.copytree(finished_run.directory, tmp_path / "elsewhere" / finished_run.name)
    again = made(tmp_path / "again", open_run(copy))
    files = sorted(path.relative_to(small) for path in small.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(again) for path in again.rglob("*") if path.is_file())
    assert len(files) > 30
    for file in files:
        assert (small / file).read_bytes() == (again / file).read_bytes(), file


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_its_second_process_leaves_interrupts_to_the_first(tmp_path: Path) -> None:
    with Pages(tmp_path) as pages:
        for number in (signal.SIGINT, signal.SIGTERM):
            asked = pages.other.submit(signal.getsignal, number)
            assert asked.result() == signal.SIG_IGN


def test_it_counts_how_repeats_ended(small: Path, finished_run: Run) -> None:
    complete = [
        sum(trace.stop.reason.complete for trace in finished_run.traces(point))
        for point in finished_run.points
    ]
    early = 6 - sum(complete)
    assert 0 < early < 6
    counts = f"{sum(complete)} of 6 repeats reached the requested end; {early} ended early."
    assert counts in words(small)
    (cell,) = re.findall(r"cor=0.85 7 \S+ \S+ 3 of 3 (.*?) \d+ cor=1.0", words(small))
    parts = (complete[0], "complete"), (3 - complete[0], "wall trap")
    assert sorted(cell.split(", ")) == sorted(f"{n} {ending}" for n, ending in parts if n)


def test_its_config_makes_the_same_points(small: Path, finished_run: Run) -> None:
    loaded = load(small / "small.yaml")
    assert tuple(digest(point.experiment) for point in loaded.points()) == finished_run.digests
    assert loaded.experiment == finished_run.experiment
    assert f"The digest of the config is {finished_run.identity}." in words(small)
    assert "snooker run small.yaml" in words(small)


def test_its_tables_are_the_rows_of_the_commands(small: Path, finished_run: Run) -> None:
    rows = [
        [html.unescape(cell).strip() for cell in re.findall(r"<td[^>]*>(.*?)</td>", row)]
        for row in ROW.findall(page(small))
    ]
    expected = [row for row in fits(finished_run).rows if not row["elastic"]]
    assert len(expected) > 3
    for row in expected:
        assert [point_label(row["parameters"]), *fit_cells(row), share_complete(row)] in rows


def test_every_image_has_an_alt_text_of_title_and_axes(small: Path) -> None:
    alts = [html.unescape(text) for text in re.findall(r'<img alt="([^"]*)"', page(small))]
    pictures = [
        json.loads(path.read_text(encoding="utf-8")) for path in small.glob("figures/*.json")
    ]
    assert len(alts) == len(pictures) > 8
    for picture in pictures:
        (alt,) = [text for text in alts if text.startswith(f"{picture['title']}. ")]
        assert picture["y_label"] in alt
        assert f"against {picture['x_label']}" in alt


def test_the_pdf_is_tagged(small: Path) -> None:
    """PDF/UA-1: a title, a language, tags, and an alt text of each figure."""
    reader = PdfReader(small / "report.pdf")
    root = reader.trailer["/Root"]
    assert root["/MarkInfo"]["/Marked"]
    assert root["/Lang"] == "en"
    assert reader.metadata is not None
    assert reader.metadata.title == "small"
    assert "<pdfuaid:part>1</pdfuaid:part>" in root["/Metadata"].get_data().decode()
    found = [each for each in elements(root["/StructTreeRoot"]) if each.get("/S") == "/Figure"]
    assert len(found) == len(list(small.glob("figures/*.svg")))
    assert all(each["/Alt"] for each in found)


def elements(element: Any) -> Iterator[Any]:
    """A PDF's structure elements, at any depth."""
    yield element
    inner = element.get("/K", [])
    for each in inner if isinstance(inner, list) else [inner]:
        if isinstance(found := each.get_object(), dict):
            yield from elements(found)


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_the_page_fits_a_phone_and_has_white_figures(
    dark: bool, small: Path, tmp_path: Path
) -> None:
    looks = """[document.documentElement.scrollWidth <= innerWidth,
      ...[document.querySelector("figure img"), document.body].map(
        (one) => getComputedStyle(one).backgroundColor)]"""
    with Browser(tmp_path) as browser:
        browser.look(390, dark)
        browser.open(small / "report.html")
        fits, figure, paper = browser.value(looks)
    assert fits
    assert figure == "rgb(255, 255, 255)"
    assert (paper != figure) == dark


def test_two_runs_have_chapters(both: Path) -> None:
    text = page(both)
    assert re.findall(r"<h2 [^>]*>(.*?)</h2>", text)[:2] == ["decaying", "warm"]
    assert len(re.findall(r"<h3 [^>]*>How to reproduce this run</h3>", text)) == 2
    labels = re.findall(r"<b>(Figure|Table) (\d+)\.", text)
    for noun in ("Figure", "Table"):
        numbers = [int(number) for name, number in labels if name == noun]
        assert numbers == list(range(1, len(numbers) + 1))


def test_a_summary_has_no_player_and_a_sentence_why(both: Path) -> None:
    players = re.findall(r'<iframe class="player" title="([^"]*)"', page(both))
    assert len(players) == MOST_POINTS
    assert all("decaying" in title for title in players)
    assert "no player here: repeat 0 was recorded as a summary" in words(both)


def test_figures_of_single_points_are_those_of_two(both: Path, decaying: Run) -> None:
    assert len(decaying.points) > MOST_POINTS
    assert len(list(both.glob("figures/1-energy-fit-*.svg"))) == MOST_POINTS
    assert "Figures of a single point are shown for few of them" in words(both)


def test_figures_of_all_points_need_no_sentence(both: Path) -> None:
    """The second run has three elastic points, and no figure of a single one."""
    assert words(both).count("Figures of a single point") == 1


def test_an_unfinished_run_says_so(finished_one_each: Run, tmp_path: Path) -> None:
    copy = shutil.copytree(finished_one_each.directory, tmp_path / "small")
    for path in copy.glob("point-0001/*.h5"):
        path.unlink()
    found = words(made(tmp_path / "report", open_run(copy)))
    assert "The run is unfinished; missing: 3 repeats." in found
    assert "cor=1.0 – – – 0 of 3" in found


def test_a_run_without_repeats_is_refused(finished_run: Run, tmp_path: Path) -> None:
    (tmp_path / "small").mkdir()
    shutil.copy(finished_run.directory / "run.json", tmp_path / "small")
    with pytest.raises(FigureError, match="no repeat is there yet"):
        made(tmp_path / "report", open_run(tmp_path / "small"))


def test_long_tables_show_an_even_choice_of_points() -> None:
    rows = [{"parameters": {"cor": k / 10}, "row": n} for k in range(11) for n in range(20)]
    few, fewer = module._few(rows)
    assert len(few) <= MOST_ROWS
    assert fewer == "3 of 11 points"
    assert list(dict.fromkeys(point_label(row["parameters"]) for row in few)) == [
        "cor=0.0",
        "cor=0.5",
        "cor=1.0",
    ]
    assert module._few(rows[:40]) == (rows[:40], "")


def test_an_error_ends_the_figures_of_the_other_process(tmp_path: Path) -> None:
    """It does not finish the figure that it is at, and begins no further one."""
    pages = Pages(tmp_path)
    made = [pages.other.submit(time.sleep, 100) for _ in range(3)]
    pages.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert all(isinstance(each.exception(), BrokenProcessPool) for each in made)


def test_the_command_prints_its_files(
    finished: Path, snooker: Callable[..., Ended], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_figures", lambda run, points: iter(()))
    ended = snooker("report", "small")
    assert ended.code == 0, ended.err
    assert ended.out.splitlines() == [
        "runs/small/report/report.html",
        "runs/small/report/report.pdf",
    ]
    assert (finished / "report" / "small.yaml").exists()
