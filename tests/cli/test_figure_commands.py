"""``snooker animate`` writes films; the rest of ``snooker plot`` is tested with the figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import Snooker
from moving_pictures import content

from snooker_cli.cli import figure_commands
from snooker_cli.runs import RepeatStatus, Run
from snooker_cli.trace import Trace


def test_animate_writes_a_page(finished: Path, snooker: Snooker) -> None:
    ended = snooker("animate", "small", "--point", "1", "--repeat", "2", "--out", "new/film.html")
    assert (ended.code, ended.out) == (0, "new/film.html\n")
    data = content(Path("new/film.html").read_text(encoding="utf-8"))
    assert data["subtitle"] == "cor=1.0, 7 balls, repeat 2"
    assert data["title"] == "small"
    assert len(data["time"]) == 150
    ended = snooker(
        *("animate", "small", "--point", "1", "--out", "film.html", "--pace", "events"),
        *("--collisions", "20", "--from", "0.5", "--seconds", "5"),
    )
    data = content(Path("film.html").read_text(encoding="utf-8"))
    assert (data["pace"], data["seconds"]) == ("events", 5.0)
    assert len(data["time"]) == 20


def test_animate_prints_that_it_leaves_out_collisions(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figure_commands, "MOST_COLLISIONS", 100)
    ended = snooker("animate", "small", "--point", "1", "--out", "film.html")
    assert ended.code == 0
    assert "after 100 collisions" in ended.err
    assert snooker("animate", "small", "--out", "film.html", "--collisions", "100").err == ""


def test_animate_opens_the_film(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(figure_commands.webbrowser, "open", lambda page: asked.append(page))
    ended = snooker("animate", "small", "--open")
    assert asked == [Path("runs/small/film-cor-0.85.html").resolve().as_uri()]
    assert "no browser could be started" in ended.err
    assert content(Path("runs/small/film-cor-0.85.html").read_text("utf-8"))["title"] == "small"


def test_a_summary_is_shown_as_its_events(finished: Path, snooker: Snooker) -> None:
    """Also a later part, by the engine of the run."""
    for record in ("events", "summary"):
        given = "-o", f"record={record}", "-o", "title=gas", "--engine", "cells", "--out", record
        assert snooker("run", "small.yaml", *given).code == 0
        for part, span in {"whole": (), "part": ("--from", "2", "--collisions", "20")}.items():
            out = f"{record}-{part}.html"
            assert snooker("animate", record, "--repeat", "1", "--out", out, *span).code == 0
    for part, number in {"whole": 150, "part": 20}.items():
        events, summary = (
            content(Path(f"{record}-{part}.html").read_text("utf-8"))
            for record in ("events", "summary")
        )
        assert len(summary["time"]) == number
        for name in ("balls", "time", "after", "kineticEnergy", "pressureSum"):
            np.testing.assert_array_equal(summary[name], events[name])


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> set[int]:
    """The repeats that have been read from files. More than 5 collisions are a large run."""
    found, one_file = set[int](), Run._read

    def noted(self: Run, path: Path, statuses: list[RepeatStatus]) -> list[Trace]:
        found.update(status.repeat for status in statuses)
        return one_file(self, path, statuses)

    monkeypatch.setattr(Run, "_read", noted)
    monkeypatch.setattr(figure_commands, "MOST_TO_LIST", 5)
    return found


def test_the_list_of_a_large_run_reads_one_repeat_of_each_point(
    finished: Path, snooker: Snooker, read: set[int]
) -> None:
    """For hundreds of long repeats, all figures take many minutes."""
    listed = snooker("plot", "small", "--list")
    assert (listed.code, read) == (0, {0})
    assert "energy: Kinetic energy over time" in listed.out


def test_the_list_reads_all_repeats_if_a_first_one_has_no_collisions(
    here: Path, snooker: Snooker, read: set[int]
) -> None:
    """The first repeat alone would have no pressure."""
    given = ("collisions=null", "time=0.15", "sweep={}", "seed=3")
    assert snooker("run", "small.yaml", *(f"--override={each}" for each in given)).code == 0
    assert snooker("export", "small", "--out", "events.csv").code == 0
    assert len(Path("events.csv").read_text().splitlines()) == 1
    read.clear()
    assert snooker("plot", "small", "--list").code == 0
    assert read == {0, 1, 2}


def test_tables_of_figures_have_what_differs_and_fit_the_terminal(
    tmp_path: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert snooker("init", "haff").code == 0
    small = ["balls.count=40", "collisions=800", "repeats=3", "cor=0.7,0.9"]
    assert snooker("run", "haff.yaml", *(f"--override={key}" for key in small)).code == 0
    printed = snooker("plot", "haff", "haff-time", "--format", "svg").out.splitlines()
    heads = [line for line in printed if line.startswith("point ")]
    assert len(heads) == 2  # one table is too wide
    assert max(map(len, printed)) <= 100
    assert [line.split()[0] for line in printed[-2:]] == ["cor=0.7", "cor=0.9"]
    names = " ".join(heads)
    assert all(name in names for name in ("theory alpha", "first rate", "fitted last rate"))
