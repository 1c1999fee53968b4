"""``snooker animate`` writes films; the rest of ``snooker plot`` is tested with the figures."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Snooker

from snooker_cli.cli import figure_commands


def content(page: str) -> dict[str, Any]:
    """The data of a page and of its first film."""
    data: dict[str, Any] = json.loads(
        page.partition('<script type="application/json" id="film">')[2].partition("</script>")[0]
    )
    data |= data["films"][0]
    return data | {"time": np.frombuffer(base64.b64decode(data["time"]))}


def test_animate_writes_a_page_and_prints_that_it_leaves_out_collisions(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = snooker("animate", "small", "--point", "1", "--repeat", "2", "--out", "new/film.html")
    assert (ended.code, ended.out) == (0, "new/film.html\n")
    data = content(Path("new/film.html").read_text(encoding="utf-8"))
    assert data["subtitle"] == "cor=1.0, 7 balls, repeat 2"
    assert data["title"] == "small"
    assert len(data["time"]) == 150
    monkeypatch.setattr(figure_commands, "MOST_COLLISIONS", 100)
    short = ("animate", "small", "--point", "1", "--out", "film.html", "--pace", "events")
    assert "after 100 collisions" in snooker(*short).err
    ended = snooker(*short, "--collisions", "20", "--from", "0.5", "--seconds", "5")
    assert ended.err == ""
    data = content(Path("film.html").read_text(encoding="utf-8"))
    assert (data["pace"], data["seconds"], len(data["time"])) == ("events", 5.0, 20)


def test_animate_opens_the_film(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(figure_commands.webbrowser, "open", lambda page: asked.append(page))
    ended = snooker("animate", "small", "--open")
    assert asked == [Path("runs/small/film-cor-0.85.html").resolve().as_uri()]
    assert "no browser could be started" in ended.err
    assert content(Path("runs/small/film-cor-0.85.html").read_text("utf-8"))["title"] == "small"
