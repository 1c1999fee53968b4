"""The page of a film has the trace in it and stands alone, and `animate` writes films."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving_pictures import SHAPES, apart, content, slack, times_of
from PIL import Image
from scenes import gas

from snooker_cli.animation import Film, embedded, film, page
from snooker_cli.cli.figure_commands import ENDINGS
from snooker_cli.engine import replay, simulate
from snooker_cli.trace import Trace


@pytest.mark.parametrize("name", SHAPES)
def test_the_page_has_the_trace_in_it(name: str, films: dict[str, Film]) -> None:
    trace = films[name].trace
    data = content(page(films[name]))
    assert trace.events is not None
    np.testing.assert_array_equal(data["time"], trace.events.time)
    np.testing.assert_array_equal(data["i"], trace.events.i)
    np.testing.assert_array_equal(data["j"], trace.events.j)
    balls = data["balls"].reshape(5, -1)
    np.testing.assert_array_equal(balls[:2].T, trace.start.positions)
    np.testing.assert_array_equal(balls[2:4].T, trace.start.velocities)
    np.testing.assert_array_equal(balls[4], trace.start.radii)
    container = trace.start.container
    assert (data["outline"], tuple(data["size"])) == (container.outline.tolist(), container.size)
    assert (data["start"], data["end"]) == (0.0, trace.stop.time)


@pytest.mark.parametrize("name", SHAPES)
def test_moving_straight_between_the_pages_collisions_gives_the_trace(
    name: str, films: dict[str, Film]
) -> None:
    """The player's way, in Python: a body moves only when it collides."""
    trace, data = films[name].trace, content(page(films[name]))
    times = times_of(trace)
    place = np.vstack([data["balls"].reshape(5, -1)[:2].T, data["container"][:2]])
    motion = np.vstack([data["balls"].reshape(5, -1)[2:4].T, data["container"][2:]])
    clock = np.zeros(len(place))
    after = data["after"].reshape(-1, 2, 2)
    done, found = 0, []
    for time in times:
        while done < len(data["time"]) and data["time"][done] <= time:
            bodies = [data["i"][done], data["j"][done]]  # the container, -1, is the last
            ages = data["time"][done] - clock[bodies]
            place[bodies] += motion[bodies] * ages[:, None]
            motion[bodies], clock[bodies] = after[done], data["time"][done]
            done += 1
        found.append(place + motion * (time - clock)[:, None])
    states = replay(trace, times)
    assert apart(trace, np.array(found)[:, :-1], states.positions) < slack(trace)
    assert apart(trace, np.array(found)[:, -1], states.container_positions) < slack(trace)
    assert slack(trace) < 1e-6


class Loaded(HTMLParser):
    """What a page would load from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [f"{tag} {name}" for name, _ in attrs if name in ("src", "href", "data")]
        assert tag not in ("link", "iframe", "img")


def test_a_page_stands_alone_is_small_and_always_the_same() -> None:
    trace = simulate(gas("circle", 37, 0.3), collisions=500)
    text = page(film(trace, "of the report’s size"))
    assert len(text.encode()) < 300_000
    assert page(film(trace, "of the report’s size")) == text
    loaded = Loaded()
    loaded.feed(text)
    assert loaded.found == []
    assert "default-src 'none'" in text
    assert not re.search(r"https?:|@import|url\(|fetch\(|XMLHttp|import\(", text)


def test_a_pages_words_cannot_break_it(shown: dict[str, Trace]) -> None:
    said = "</script><script>alert(1)</script> {{film}} & \"R\" 'é'"
    text = page(film(shown["fixed"], said, said))
    assert (content(text)["title"], content(text)["subtitle"]) == (said, said)
    assert f"<title>{html.escape(said)}</title>" in text
    assert text.count("</script>") == 2


def test_an_embedded_page_is_one_quoted_attribute(shown: dict[str, Trace]) -> None:
    text = page(film(shown["fixed"], 'a "title"'))
    fragment = embedded(text, 'CoR 0.9 & "more"')
    assert fragment.count("<") == 2  # an iframe and its end
    attributes = dict(re.findall(r'(\w+)="([^"]*)"', fragment))
    assert html.unescape(attributes["srcdoc"]) == text
    assert html.unescape(attributes["title"]) == 'CoR 0.9 & "more"'
    assert attributes["sandbox"] == "allow-scripts"


Snooker = Callable[..., Any]


def test_animate_writes_a_page(finished: Path, snooker: Snooker) -> None:
    ended = snooker("animate", "small", "--point", "1", "--repeat", "2", "--out", "new/film.html")
    assert (ended.code, ended.out) == (0, "new/film.html\n")
    data = content(Path("new/film.html").read_text(encoding="utf-8"))
    assert data["subtitle"] == "cor=1.0, 7 balls, repeat 2"
    assert data["title"] == "small"
    assert len(data["time"]) == 150
    told = snooker(
        *("animate", "small", "--point", "1", "--out", "film.html", "--json", "--pace", "events"),
        *("--collisions", "20", "--from", "0.5", "--seconds", "5", "--magnify", "100"),
    )
    found = json.loads(told.out)
    data = content(Path("film.html").read_text(encoding="utf-8"))
    assert (data["pace"], data["seconds"], data["magnify"]) == ("events", 5.0, 100.0)
    assert found == {
        "file": "film.html",
        "bytes": Path("film.html").stat().st_size,
        "point": 1,
        "repeat": 0,
        "from": 0.5,
        "to": data["time"][-1],
        "collisions": 20,
        "frames": None,
    }


def test_animate_writes_a_gif(finished: Path, snooker: Snooker) -> None:
    asked = ("--seconds", "0.3", "--fps", "10", "--collisions", "30")
    ended = snooker("animate", "small", "--out", "film.GIF", *asked)
    assert (ended.code, ended.out) == (0, "film.GIF\n")
    with Image.open("film.GIF") as image:
        assert image.n_frames == 3


def test_animate_says_that_it_leaves_out_collisions(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(import_module("snooker_cli.animation.film"), "MOST_COLLISIONS", 100)
    ended = snooker("animate", "small", "--point", "1", "--out", "film.html")
    assert ended.code == 0
    assert "snooker: the film ends after 100 collisions, at " in ended.err
    assert snooker("animate", "small", "--out", "film.html", "--collisions", "100").err == ""


MISTAKES = {
    "no run": (["animate", "absent", "--out", "a.html"], r"absent: there is no run here"),
    "no point": (["--out", "a.html", "--point", "2"], r"--point 2: small has points 0 to 1"),
    "no repeat": (["--out", "a.html", "--repeat", "9"], r"--repeat 9: .* repeats 0 to 2"),
    "other kind": (["--out", "a.webm"], r"--out a\.webm: give a name that ends in \.html, \.gif"),
    "frames of a page": (["--out", "a.html", "--fps", "5"], r"--fps is for a GIF or an MP4"),
    "span": (["--out", "a.html", "--to", "1e9"], r"repeat 0 of small cannot be shown from 0.0 s"),
    "seconds": (["--out", "a.gif", "--seconds", "nan"], r"--seconds nan: give a number from"),
    "magnify": (["--out", "a.gif", "--magnify", "0.5"], r"--magnify 0\.5: give a number from 1"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_told_in_a_sentence(name: str, finished: Path, snooker: Snooker) -> None:
    arguments, sentence = MISTAKES[name]
    ended = snooker(*([] if arguments[0] == "animate" else ["animate", "small"]), *arguments)
    assert (ended.code, ended.out) == (2, "")
    assert re.match(f"snooker: {sentence}", ended.err), ended.err
    assert not [path for ending in ENDINGS for path in Path().glob(f"*{ending}")]


def test_a_summary_cannot_be_shown(here: Path, snooker: Snooker) -> None:
    assert snooker("run", "small.yaml", "-o", "record=summary", "--no-progress").code == 0
    ended = snooker("animate", "small", "--out", "a.html")
    assert (ended.code, ended.out) == (2, "")
    assert ended.err == (
        "snooker: repeat 0 of small was recorded as a summary, which has no collisions to show; "
        "run it with `record: events`\n"
    )
