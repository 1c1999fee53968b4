"""``snooker animate`` writes films; the rest of ``snooker plot`` is tested with the figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from command_line import Snooker

from snooker_cli import runs
from snooker_cli.api import drawings
from snooker_cli.cli import figure_commands
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.figures.registry import figures_of
from snooker_cli.files import write_json
from snooker_cli.runs import open_run
from snooker_cli.runs.selection import Selection


def content(page: str) -> dict[str, Any]:
    """The data of a page and of its first film."""
    data: dict[str, Any] = json.loads(
        page.partition('<script type="application/json" id="data">')[2].partition("</script>")[0]
    )
    return data | data["films"][0]


def test_animate_writes_a_page_and_prints_that_it_leaves_out_collisions(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = snooker("animate", "small", "--point", "1", "--repeat", "2", "--out", "new/film.html")
    assert (ended.code, ended.out) == (0, "new/film.html\n")
    data = content(Path("new/film.html").read_text(encoding="utf-8"))
    assert data["subtitle"] == "cor=1.0, 7 balls, repeat 2"
    assert data["title"] == "small"
    assert (data["before"], data["collisions"]) == (0, 150)
    monkeypatch.setattr("snooker_cli.animation.MOST_COLLISIONS", 100)
    short = ("animate", "small", "--point", "1", "--out", "film.html", "--pace", "events")
    assert "after 100 collisions" in snooker(*short).err
    ended = snooker(*short, "--collisions", "20", "--from", "0.5", "--seconds", "5")
    assert ended.err == ""
    data = content(Path("film.html").read_text(encoding="utf-8"))
    assert (data["pace"], data["seconds"]) == ("events", 5.0)
    assert data["collisions"] - data["before"] == 20 < data["collisions"]


def test_a_page_is_refused_where_this_engine_has_other_collisions(
    finished: Path, snooker: Snooker
) -> None:
    manifest = json.loads((finished / runs.MANIFEST).read_text())
    write_json(finished / runs.MANIFEST, manifest | {"engine_version": ENGINE_VERSION - 1})
    ended = snooker("animate", "small", "--out", "film.html")
    assert ended.code == 2
    assert "cannot simulate again; give a name that ends in .gif or .mp4" in ended.err
    assert not Path("film.html").exists()


def test_animate_opens_the_film(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(figure_commands.webbrowser, "open", lambda page: asked.append(page))
    ended = snooker("animate", "small", "--open")
    assert asked == [Path("runs/small/film-cor-0.85.html").resolve().as_uri()]
    assert "no browser could be started" in ended.err
    assert content(Path("runs/small/film-cor-0.85.html").read_text("utf-8"))["title"] == "small"


def test_the_list_of_figures_opens_no_result(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With 5,000 points it gave nothing in 250 s, when it made all figures."""
    before = snooker("plot", "small", "--list")
    for path in Path("runs/small").glob("point-*/*.h5"):
        path.write_bytes(b"")
    monkeypatch.setattr("snooker_cli.runs.run.RunFolder.statuses", None)
    after = snooker("plot", "small", "--list")
    assert (after.code, after.out, after.err) == (0, before.out, "")
    assert "cooling left out at 1 of 2 points: nothing decays" in " ".join(after.out.split())
    ended = snooker("plot", "small", "--list", "--repeat", "3")
    assert "there is no repeat 3" in ended.err


def test_without_names_figures_of_single_points_are_few(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drawings, "MOST_SERIES", 1)
    monkeypatch.setattr(drawings, "own_figures", lambda: ("tagged-path",))
    few = snooker("plot", "small", "--format", "svg")
    assert few.out.split() == [
        f"runs/small/figures/tagged-path-cor-0.85.{ending}" for ending in ("svg", "json")
    ]
    assert "tagged-path: drawn for 1 of 2 points, evenly chosen; --where" in few.err
    for chosen in (("tagged-path",), ("--where", "cor>0.1")):
        ended = snooker("plot", "small", *chosen, "--format", "svg")
        assert len(ended.out.split(".svg")) == 3
        assert "evenly chosen" not in ended.err


def test_plot_shows_what_it_reads(finished: Path) -> None:
    texts: list[str] = []
    drawn = list(figures_of(open_run("small"), ["energy"], Selection(), texts.append))
    assert len(drawn) == 1
    assert "energy: point 2 of 2, repeat 3 of 3" in texts


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (("animate", "small", "--until", "0.1"), "notes.html"),
        (("export", "small"), "notes.csv"),
    ],
)
def test_a_file_of_the_user_is_replaced_on_request_only(
    command: tuple[str, ...], name: str, finished: Path, snooker: Snooker
) -> None:
    Path(name).write_text("mine")
    ended = snooker(*command, "--out", name)
    assert (ended.code, ended.out) == (2, "")
    assert ended.err == (
        f"snooker: {name}: exists already; give --replace, or --out for another name\n"
    )
    assert Path(name).read_text() == "mine"
    assert snooker(*command, "--out", name, "--replace").code == 0
    assert Path(name).read_text() != "mine"
    again = snooker(*command, "--out", name)  # a page of snooker is no loss
    assert again.code == (0 if name.endswith(".html") else 2)
