"""The player in a browser: the places are those of the trace, and keys and buttons work."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from moving_pictures import SHAPES, apart, slack, sliding, sliding_films, times_of

from snooker_cli import animation
from snooker_cli.animation import Film, embedded, page
from snooker_cli.animation.frames import FLASH, MOST_FLASHES
from snooker_cli.engine import replay
from snooker_cli.trace import SLIDE

PLAYER = Path(animation.__file__).parent / "player"


def test_flashes_are_the_same_in_the_player() -> None:
    script = (PLAYER / "arena.js").read_text(encoding="utf-8")
    assert f"const FLASH = {FLASH};" in script
    assert f"const MOST_FLASHES = {MOST_FLASHES};" in script


# Places, keys and buttons, tried in the page.
TRIAL = """
(async () => {
  const found = {};
  const frames = async (number) => {
    for (let k = 0; k < number; k++) await new Promise((drawn) => requestAnimationFrame(drawn));
  };
  const press = (key) => document.dispatchEvent(new KeyboardEvent("keydown", { key }));
  const now = () => {
    const { time, done } = player.reel;
    return { time, done, playing: player.playing };
  };
  await frames(2);
  found.places = TIMES.map((time) => player.motion.places(time));
  found.pressure = TIMES.map((time) => player.charts.pressure(player.motion.count(time), time));
  found.energy = TIMES.map((time) => player.charts.energy[player.motion.count(time)]);
  for (let k = 0; k < 3; k++) press("ArrowRight");
  found.forth = now();
  press("ArrowLeft");
  found.back = now();
  press(" ");
  await frames(5);
  found.played = now();
  press(" ");
  found.paused = now();
  find("play").click();
  found.clicked = now();
  find("scrub").value = "0.5";
  find("scrub").dispatchEvent(new Event("input"));
  find("play").click();
  found.scrubbed = now();
  press("ArrowUp");
  found.speed = player.speed;
  press("e");
  found.pace = player.pace;
  press("End");
  found.end = now();
  await frames(2);
  found.shown = find("now").textContent + ", " + find("count").textContent;
  found.drawn = ["arena", "charts"].map((name) => {
    const canvas = find(name);
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return pixels.filter((value, k) => k % 4 === 3 && value > 0).length;
  });
  return found;
})()
"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser without a window."""
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here")
    with Browser(tmp_path_factory.mktemp("profile")) as started:
        yield started


@pytest.fixture(scope="module")
def played(
    browser: Browser, films: dict[str, Film], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """What the player did for each shape."""
    folder, found = tmp_path_factory.mktemp("pages"), {}
    for name, made in films.items():
        path = folder / f"{name}.html"
        path.write_text(page(made, seconds=20.0), encoding="utf-8")
        browser.open(path)
        found[name] = browser.value(TRIAL.replace("TIMES", json.dumps(times_of(made.trace))))
    return found


def test_the_player_writes_nothing_to_the_console(browser: Browser, played: dict[str, Any]) -> None:
    assert browser.complaints == []
    assert set(played) == set(SHAPES)


def test_an_error_in_the_console_would_be_noticed(browser: Browser, tmp_path: Path) -> None:
    broken = tmp_path / "broken.html"
    broken.write_text("<!doctype html><script>lost()</script>", encoding="utf-8")
    browser.open(broken)
    heard, browser.complaints = browser.complaints, []
    assert "lost is not defined" in json.dumps(heard)


def test_an_embedded_player_plays(browser: Browser, films: dict[str, Film], tmp_path: Path) -> None:
    """In a frame that may only run its script, as in a report."""
    found = (
        "<script>player.play(); (function look() { player.reel.time > 0 ? "
        "parent.postMessage(player.reel.time, '*') : requestAnimationFrame(look); })()"
        "</script></body>"
    )
    fragment = embedded(page(films["fixed"]).replace("</body>", found), "fixed")
    path = tmp_path / "report.html"
    path.write_text(
        "<!doctype html><meta charset=utf-8><script>const heard = new Promise((found) => "
        f"{{ onmessage = (event) => found(event.data); }});</script>{fragment}",
        encoding="utf-8",
    )
    browser.open(path)
    assert browser.value("heard") > 0
    assert browser.complaints == []


@pytest.mark.parametrize("name", SHAPES)
def test_the_places_are_those_of_the_trace(
    name: str, films: dict[str, Film], played: dict[str, Any]
) -> None:
    found, made = played[name], films[name]
    times = times_of(made.trace)
    states = replay(made.trace, times)
    places = np.array(found["places"])
    assert apart(made.trace, places[:, :-1], states.positions) < slack(made.trace)
    assert apart(made.trace, places[:, -1], states.container_positions) < slack(made.trace)
    np.testing.assert_allclose(found["pressure"], made.pressure(np.array(times)), rtol=1e-13)
    rows = np.searchsorted(made.time, times, side="right")
    assert found["energy"] == made.kinetic_energy[rows].tolist()


def moments(made: Film) -> list[float]:
    """Even times, and some in each interval between a slide's collisions and those before."""
    time = np.concatenate([[made.start], made.time, [made.end]])
    near = np.flatnonzero(made.j == SLIDE)[:, None] + np.arange(2)
    parts = np.linspace(0, 0.999, 7)
    within = time[near][..., None] + (time[near + 1] - time[near])[..., None] * parts
    return sorted([*np.linspace(made.start, made.end, 400).tolist(), *within.ravel().tolist()])


def test_balls_that_slide_are_where_the_trace_has_them(browser: Browser, tmp_path: Path) -> None:
    """In bounces without events, in slides and after them; forwards and backwards in time."""
    for name, made in sliding_films().items():
        path = tmp_path / "film.html"
        path.write_text(page(made), encoding="utf-8")
        browser.open(path)
        times = moments(made)
        found = browser.value(
            f"(() => {{ const times = {json.dumps(times)}, at = (time) => player.motion"
            ".places(time); times.forEach(at); return times.reverse().map(at).reverse(); })()"
        )
        # The whole continues as the part does.
        states = replay(sliding(), times)
        apart = np.abs(np.array(found)[:, :-1] - states.positions)
        assert np.max(apart) < 1e-9, name
        pressures = browser.value(
            f"{json.dumps(times)}.map((time) => player.charts"
            ".pressure(player.motion.count(time), time))"
        )
        np.testing.assert_allclose(pressures, made.pressure(np.array(times)), rtol=1e-12)
    assert browser.complaints == []


@pytest.mark.parametrize("name", SHAPES)
def test_keys_and_buttons_work(name: str, films: dict[str, Film], played: dict[str, Any]) -> None:
    found, made = played[name], films[name]
    assert found["forth"] == {"time": made.time[2], "done": 3, "playing": False}
    assert found["back"] == {"time": made.time[1], "done": 2, "playing": False}
    assert found["played"]["playing"]
    # 20 s for all of it, and a frame lasts 0.1 s at most: five by a fortieth.
    gone = found["played"]["time"] - found["back"]["time"]
    assert 0 < gone <= made.end / 40 * (1 + 1e-9)
    assert not found["paused"]["playing"]
    assert found["clicked"]["playing"]
    assert not found["scrubbed"]["playing"]
    assert found["scrubbed"]["time"] == pytest.approx(made.end / 2, rel=1e-12)
    assert (found["speed"], found["pace"]) == (2, "events")
    assert found["end"] == {"time": made.end, "done": len(made), "playing": False}
    assert found["shown"].endswith(f"collision {len(made)} of {len(made)}")
    assert all(pixels > 2000 for pixels in found["drawn"])
