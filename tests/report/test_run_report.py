"""``snooker report``: the pages on a user's own runs."""

from __future__ import annotations

import html
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import pytest
from figure_runs import BASE, BOX
from figure_runs import made as made_run
from gas_kinds import KINDS, scene_of
from pypdf import PdfReader

import snooker_cli as snooker
from snooker_cli.analysis.decay import NO_LOSSES
from snooker_cli.analysis.theories import gas_kinds
from snooker_cli.config import digest, load, parse
from snooker_cli.errors import FigureError
from snooker_cli.figures.caption_text import setting
from snooker_cli.figures.registry import FIGURES, own_figures
from snooker_cli.figures.style import styled
from snooker_cli.formatting import printable
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report import run_report as module
from snooker_cli.report.document import unbroken
from snooker_cli.report.run_report import (
    GROUPS,
    RELEVANCE,
    _config,
    by_agreement,
    by_relevance,
    run_report,
    shown,
    trivial,
)
from snooker_cli.runs import RunFolder, open_run
from snooker_cli.runs.selection import Selection


def made(folder: Path, *runs: RunFolder) -> Path:
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
    return spaced(html.unescape(text))


def spaced(text: str) -> str:
    """A text as the pages print it, with single spaces that may break."""
    return " ".join(unbroken(text).replace("\u2060", "").split())


@pytest.fixture(scope="module")
def small(finished_run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on the small run: two points, some repeats of which end in a wall trap."""
    return made(tmp_path_factory.mktemp("small"), finished_run)


@pytest.fixture(scope="module")
def both(decaying: RunFolder, warm: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on a run of collisions and one of summaries."""
    folder = tmp_path_factory.mktemp("both")
    shutil.copytree(decaying.directory, folder / "decaying")
    shutil.copytree(warm.directory, folder / "warm")
    return made(folder / "report", open_run(folder / "decaying"), open_run(folder / "warm"))


def test_a_report_has_the_same_bytes_when_repeated(
    small: Path, finished_run: RunFolder, tmp_path: Path
) -> None:
    """Also of a copy of the run in another folder, as on another machine."""
    copy = shutil.copytree(finished_run.directory, tmp_path / "elsewhere" / finished_run.name)
    again = made(tmp_path / "again", open_run(copy))
    files = sorted(path.relative_to(small) for path in small.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(again) for path in again.rglob("*") if path.is_file())
    assert len(files) > 20
    for file in files:
        assert (small / file).read_bytes() == (again / file).read_bytes(), file


def test_its_config_makes_the_same_points(
    small: Path, finished_run: RunFolder, tmp_path: Path
) -> None:
    loaded = load(small / "small.yaml")
    assert tuple(digest(point.config) for point in loaded.points()) == tuple(
        finished_run.digests.values()
    )
    assert loaded.config == finished_run.config
    assert f"The digest of the config is {finished_run.identity}." in words(small)
    assert "snooker run small.yaml" in words(small)
    # Only a circle has a mass, and one that does not move is written as in a config.
    run = made_run(tmp_path / "circle", "container.mass=.inf")
    assert "mass: .inf}" in _config(run, tmp_path).splitlines()[0]
    run = made_run(tmp_path / "box", text=BOX)
    assert "mass" not in _config(run, tmp_path).splitlines()[0]
    points = load(tmp_path / "box.yaml").points()
    assert tuple(digest(point.config) for point in points) == tuple(run.digests.values())


@pytest.mark.parametrize(
    ("overrides", "left_out"),
    [
        (["cor=1"], {"energy", "a2", "hexatic-order", "cluster-growth"}),
        (["cor=0.9"], {"hexatic-order", "cluster-growth"}),
        (["balls.radius=1.9"], set()),
        # L/L_c is 2.7: clusters are dense in a dilute gas.
        (["cor=0.5", "balls.rings=9", "balls.radius=0.3"], set()),
    ],
)
def test_a_figure_is_trivial_where_its_physics_is(overrides: list[str], left_out: set[str]) -> None:
    """At a radius of 1.9 m the balls fill 0.69 of the circle."""
    points = parse(BASE, overrides=["wall_cor=null", *overrides]).points()
    starts = [starting_scene(point.config, 0) for point in points]
    found = trivial(points, starts, ())
    sometimes = {name for name, reasons in RELEVANCE.items() if reasons and "always" not in reasons}
    kept = {"energy", "pressure", "a2", "cluster-growth", "hexatic-order"} - left_out
    assert left_out <= found.keys() & sometimes
    assert not kept & found.keys()
    assert RELEVANCE.keys() == set(own_figures())
    asked = trivial(points, starts, ["wall-impulses"])
    assert asked.keys() == found.keys() - {"wall-impulses"}


def test_figures_of_the_main_quantities_come_first() -> None:
    """Each type of gas begins with its own subject."""

    def order(kind: str) -> list[str]:
        return by_relevance(FIGURES, gas_kinds(scene_of(kind)))

    assert module.ABOUT.keys() <= FIGURES.keys()
    assert order("rough")[0] == "rotation"
    assert shown(order("mixture")[0]) == "T₁/T₂"
    assert order("two temperatures")[:2] == ["profiles", "heat-flux"]
    assert order("thermal, inelastic")[0] == "profiles"
    assert shown(order("thermal")[0]) == shown(order("driven")[0]) == "temperature"
    assert shown(order("cooling")[0]) == "Haff's α"
    assert shown(order("elastic")[0]) == "PV/NT"
    clusters = by_relevance(module.ordered(), ["cooling", "clusters"])
    assert clusters[:3] == ["snapshot", "cluster-growth", "cluster-sizes"]
    assert shown(clusters[3]) == "Haff's α"
    for kind in KINDS:
        assert sorted(order(kind)) == sorted(FIGURES)


def test_what_disagrees_with_the_best_theory_is_the_first_of_a_table() -> None:
    def row(quantity: str, model: str, errors: float | None, cor: float = 0.8) -> dict[str, Any]:
        known = {"quantity": quantity, "model": model, "difference_in_errors": errors}
        return known | {"parameters": {"cor": cor}, "repeats": 30}

    rows = [
        *(row("PV/NT", "ideal gas law", 50.0), row("PV/NT", "hard disks, N → ∞", 7.0)),
        *(row("PV/NT", "hard disks, finite N", 4.0), row("pressure", "hard disks, finite N", 2.0)),
        *(row("mean speed", "fixed energy", -9.0), row("L/L_c", "critical length", None)),
        row("PV/NT", "hard disks, finite N", 90.0, cor=0.9),
    ]
    far, others, ideal = GROUPS
    assert by_agreement(rows) == [
        *((far, rows[4]), (far, rows[2]), (far, rows[6])),
        *((others, rows[1]), (others, rows[3]), (others, rows[5]), (ideal, rows[0])),
    ]


def test_letters_of_figures_have_seven_points_or_more(small: Path) -> None:
    """By the scales at which the PDF has its pictures."""
    with styled():
        sizes = [
            matplotlib.rcParams[name]
            for name in ("font.size", "xtick.labelsize", "legend.fontsize")
        ]
    scales = list[float]()

    def see(operator: bytes, operands: list[Any], *_: Any) -> None:
        if operator == b"cm" and operands[0] == -operands[3] != 1:
            scales.append(float(operands[0]))

    for page in PdfReader(small / "report.pdf").pages:
        page.extract_text(visitor_operand_before=see)
    assert len(scales) > 100
    assert min(scales) * min(sizes) >= 7


def test_the_pdf_is_tagged_and_captions_have_the_scene_once(
    small: Path, finished_run: RunFolder, both: Path
) -> None:
    reader = PdfReader(small / "report.pdf")
    assert reader.trailer["/Root"]["/MarkInfo"]["/Marked"]
    metadata = reader.trailer["/Root"]["/Metadata"].get_data().decode()
    assert "<pdfuaid:part>1</pdfuaid:part>" in metadata
    scene = setting(finished_run, finished_run.points, Selection())
    assert words(small).count(scene) == 1
    single = json.loads((both / "figures" / "1-snapshot.json").read_text(encoding="utf-8"))
    assert "CoR 0.9," in single["caption"]


def test_a_report_begins_with_a_plain_sentence(small: Path, finished_run: RunFolder) -> None:
    """The title is that of the config; the finding with its numbers is next."""
    title = finished_run.config.title or finished_run.name
    assert f"<h1>{title}</h1>" in page(small)
    begun = words(small).partition(f"{title} A gas of ")[2]
    assert begun.startswith("7 balls in a circle loses energy in collisions or keeps its energy: ")


def test_a_report_has_the_finding_of_its_run(small: Path, finished_run: RunFolder) -> None:
    found = snooker.open(finished_run.directory)
    assert spaced(found.finding().replace("1/s", "s⁻¹")) in words(small)
    lines = found.compare().text(brief=True).splitlines()
    assert [line.partition(":")[0] for line in lines] == ["2 points", "cor=0.85", "cor=1.0"]


def test_two_runs_have_chapters_and_what_is_left_out_has_a_reason(small: Path, both: Path) -> None:
    assert "gas-law it needs points at two or more values of balls.speed" in words(small)
    assert "van-der-waals it needs" in words(both)
    assert f"Notes: cor=1.0: {NO_LOSSES}" in words(small)
    (title,) = re.findall(r'<iframe class="player" title="([^"]*)"', page(both))
    assert title == "Player, decaying, cor=0.9, repeat 0"
    assert "no film of warm: repeat 0 was recorded as a summary" in words(both)
    text = page(both)
    assert re.findall(r"<h2 [^>]*>(.*?)</h2>", text) == [
        *("Side by side", "decaying", "warm", "Appendix")
    ]
    assert "<h1>decaying and warm</h1>" in text
    labels = re.findall(r"<b>(Figure|Table) (\d+)\.", text)
    for noun in ("Figure", "Table"):
        numbers = [int(number) for name, number in labels if name == noun]
        assert numbers == list(range(1, len(numbers) + 1))


def test_figures_of_one_point_show_a_gas_that_is_stationary() -> None:
    points = parse(BASE, overrides=["cor=0.8,0.9", "container.mass=.inf", "wall_speed=1"]).points()
    parts = [{"found": True, "sentence": ""}, {"found": False, "sentence": ""}]
    states = [
        {"parameters": point.as_json(), "stationary": stationary}
        for point, stationary in zip(points, parts, strict=True)
    ]
    assert module._settled(points, states) == [points[0]]
    assert module._settled(points, []) == [*points]


def no_figures(*_: Any) -> dict[str, str]:
    return dict.fromkeys(FIGURES, "none are made in this test")


HOSTILE = ("<script>alert(1)<b>", "@film 0", "a|b # $x$ {{ 7*7 }}", "two\n\n## lines\x1b[2J\u202e")


def test_names_and_titles_are_text(
    decaying: RunFolder, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """No mark of HTML, Typst, the template or a terminal in them has an effect."""
    monkeypatch.setattr(module, "trivial", lambda *_: dict.fromkeys(FIGURES, "a | b"))
    runs = []
    for name in HOSTILE:
        copy = shutil.copytree(decaying.directory, tmp_path / name)
        titled = decaying.config.model_copy(update={"title": f"#panic() {name}"})
        runs.append(replace(open_run(copy), config=titled))
    made(tmp_path / "report", *runs)
    text, plain = page(tmp_path / "report"), words(tmp_path / "report")
    names = [printable(name) for name in HOSTILE]
    headings = re.findall(r"<h2 [^>]*>(.*?)</h2>", text)
    assert [html.unescape(heading) for heading in headings] == [
        *("Side by side", *map(unbroken, names), "Appendix")
    ]
    assert "<script" not in text
    shown = PdfReader(tmp_path / "report" / "report.pdf").pages
    pdf = spaced("".join(page.extract_text() for page in shown))
    for name in names:
        assert f"Title: #panic() {spaced(name)}." in plain
        assert spaced(name).replace(" ", "") in pdf.replace(" ", "")
    assert "a | b" in plain


def test_an_unfinished_run_says_so(
    finished_one_each: RunFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "trivial", no_figures)
    copy = shutil.copytree(finished_one_each.directory, tmp_path / "small")
    for path in copy.glob("point-0001/*.h5"):
        path.unlink()
    found = words(made(tmp_path / "report", open_run(copy)))
    assert "The run is unfinished: 3 of 6 repeats are there, of 1 of 2 points." in found
    assert "cor=1.0 – – 0 of 3" in found
    other = shutil.copytree(finished_one_each.directory, tmp_path / "other" / "small")
    for path in other.glob("point-0000/*.h5"):
        path.unlink()
    with monkeypatch.context() as patched:
        patched.setattr(module, "MOST_POINTS", 1)  # the shown point has no repeats
        found = words(made(tmp_path / "report", open_run(other)))
    assert "A gas of 7 balls in a circle keeps its energy" in found
    for path in copy.glob("point-*/*.h5"):
        path.unlink()
    with pytest.raises(FigureError, match="no repeat is there yet"):
        made(tmp_path / "report", open_run(copy))
