"""The player in a browser: the places are those of the trace."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from moving_pictures import SHAPES, apart, slack, sliding, sliding_films, times_of

from snooker_cli import animation
from snooker_cli.analysis import diffusion
from snooker_cli.animation import Film, page
from snooker_cli.animation.frames import FLASH, MOST_FLASHES
from snooker_cli.animation.movie import GREEN
from snooker_cli.engine import replay
from snooker_cli.trace import SLIDE


def test_flashes_are_the_same_in_the_player() -> None:
    script = (Path(animation.__file__).parent / "player" / "arena.js").read_text(encoding="utf-8")
    assert f"const FLASH = {FLASH};" in script
    assert f"const MOST_FLASHES = {MOST_FLASHES};" in script
    assert f'const GREEN = "{GREEN}";' in script


TRIAL = """
(async () => {
  const count = (time) => player.screens[0].motion.count(time);
  const found = {
    places: TIMES.map((time) => player.screens[0].motion.places(time)),
    pressure: TIMES.map((time) => player.charts.courses[0].pressure(count(time), time)),
    energy: TIMES.map((time) => player.charts.courses[0].energy[count(time)]),
  };
  find("play").click();
  found.playing = player.playing;
  document.dispatchEvent(new KeyboardEvent("keydown", { key: "End" }));
  for (let k = 0; k < 2; k++) await new Promise((drawn) => requestAnimationFrame(drawn));
  found.end = [player.reels[0].time, player.reels[0].done, find("count").textContent];
  return found;
})()
"""
"""What the page shows at some times, and what a button and a key do."""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser without a window."""
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here")
    with Browser(tmp_path_factory.mktemp("profile")) as started:
        yield started


@pytest.mark.parametrize("name", SHAPES)
def test_the_player_shows_the_trace(
    name: str, browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    made = films[name]
    path, times = tmp_path / "film.html", times_of(made.trace)
    path.write_text(page(made, seconds=20.0), encoding="utf-8")
    browser.open(path)
    found = browser.value(TRIAL.replace("TIMES", json.dumps(times)))
    states = replay(made.trace, times)
    places = np.array(found["places"])
    assert apart(made.trace, places[:, :-1], states.positions) < slack(made.trace)
    assert apart(made.trace, places[:, -1], states.container_positions) < slack(made.trace)
    np.testing.assert_allclose(found["pressure"], made.pressure(np.array(times)), rtol=1e-13)
    rows = np.searchsorted(made.time, times, side="right")
    assert found["energy"] == made.kinetic_energy[rows].tolist()
    assert found["playing"]
    assert found["end"][:2] == [made.end, len(made)]
    assert found["end"][2].endswith(f"collision {len(made)} of {len(made)}")
    assert browser.complaints == []


MENU = """
(() => {
  const found = {};
  for (const menu of document.querySelectorAll("select:not([hidden] *)")) {
    const press = (key) => document.activeElement.dispatchEvent(
      new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
    menu.focus();
    menu.selectedIndex = (menu.selectedIndex + 1) % menu.options.length;
    menu.dispatchEvent(new Event("change", { bubbles: true }));
    const chosen = menu.selectedIndex;
    player.play(false);
    player.goTo(0);
    press("ArrowRight");
    const done = player.reels[0].done;
    press(" ");
    found[menu.id] = [done, player.playing, menu.selectedIndex === chosen];
  }
  return found;
})()
"""
"""Choose from each menu, then press keys of the film."""


def test_keys_return_to_the_film_after_a_menu(
    browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    path = tmp_path / "film.html"
    path.write_text(page(films[SHAPES[0]], seconds=20.0), encoding="utf-8")
    browser.open(path)
    found = browser.value(MENU)
    assert {"speed", "colours"} <= set(found)
    assert all(each == [1, True, True] for each in found.values()), found
    assert browser.complaints == []


TAG = """
(() => {
  const [screen] = player.screens, { arena: { canvas: arena } } = screen;
  const ball = screen.motion.number - 1, box = arena.getBoundingClientRect();
  player.goTo(1);
  player.draw();
  const click = () => {
    const [, x, y] = screen.arena.drawn.find(([one]) => one === ball);
    const at = { clientX: box.left + x, clientY: box.top + y, bubbles: true };
    arena.dispatchEvent(new MouseEvent("click", at));
    player.draw();
    return [screen.arena.tagged, find("tagged").value, player.playing, screen.arena.path];
  };
  const coloured = () => {
    const { data } = arena.getContext("2d").getImageData(0, 0, arena.width, arena.height);
    let found = 0;
    for (let k = 0; k < data.length; k += 4) {
      found += data[k] === 123 && data[k + 1] === 44 && data[k + 2] === 191;
    }
    return found;
  };
  return { tagged: click(), drawn: coloured(), cleared: click() };
})()
"""
"""Click on the last ball twice: its path, and how many points of the picture have its colour."""


@pytest.mark.parametrize("name", SHAPES)
def test_a_click_on_a_ball_draws_its_path(
    name: str, browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    made = films[name]
    path, ball = tmp_path / "film.html", made.trace.start.number - 1
    path.write_text(page(made, seconds=20.0), encoding="utf-8")
    browser.open(path)
    found = browser.value(TAG)
    tagged, shown, playing, course = found["tagged"]
    assert (tagged, shown, playing) == (ball, str(ball), False)
    time, *places = np.array(course).T
    own = (made.i == ball) | (made.j == ball)
    assert time.tolist() == [made.start, *made.time[own].tolist()]
    known, _ = diffusion.path(made.trace, ball, time)
    moved = np.transpose(places) - known
    assert np.max(np.abs(moved - moved[0])) < slack(made.trace)
    assert found["drawn"] > 20
    assert found["cleared"] == [None, "", False, []]
    assert browser.complaints == []


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
            f"(() => {{ const times = {json.dumps(times)}, at = (time) => player.screens[0].motion"
            ".places(time); times.forEach(at); return times.reverse().map(at).reverse(); })()"
        )
        # The whole continues as the part does.
        states = replay(sliding(), times)
        apart = np.abs(np.array(found)[:, :-1] - states.positions)
        assert np.max(apart) < 1e-9, name
        pressures = browser.value(
            f"{json.dumps(times)}.map((time) => player.charts.courses[0]"
            ".pressure(player.screens[0].motion.count(time), time))"
        )
        np.testing.assert_allclose(pressures, made.pressure(np.array(times)), rtol=1e-12)
    assert browser.complaints == []


OVERFLOWING = """
(() => {
  const { charts } = player, panel = charts.panels[1], [course] = charts.courses;
  panel.top = 0.2 * Math.max(...course.rows.map((time, row) => panel.at(course, row, time)));
  panel.colour = "warn";  // which no other panel and no text has
  charts.made = "";
  player.goTo(1);
  player.draw();
  const pen = charts.canvas.getContext("2d"), half = (panel.right - charts.left) / 2;
  const strip = pen.getImageData(charts.left, panel.head + charts.gap - 20, half, 40);
  const hue = [1, 3, 5].map((at) => parseInt(paint("warn").trim().slice(at, at + 2), 16));
  const found = [0, 0];
  for (let k = 0; k < strip.data.length; k += 4) {
    const inside = k >= strip.data.length * 19 / 40;
    found[inside ? 1 : 0] += hue.every((part, c) => strip.data[k + c] === part);
  }
  return found;
})()
"""
"""Points with a curve's colour above and in its panel, where most of it is above the limit."""


def test_a_curve_stays_in_its_panel(browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "film.html").write_text(page(sliding_films()["whole"]), encoding="utf-8")
    browser.look(1160, dark=False)
    browser.open(tmp_path / "film.html")
    above, inside = browser.value(OVERFLOWING)
    assert above == 0
    assert inside > 0


LOOKS = """
(() => {
  const rounded = (name) => {
    const box = find(name).getBoundingClientRect();
    return box.width === box.height && getComputedStyle(find(name)).borderRadius === "50%";
  };
  return {
    fits: document.documentElement.scrollWidth <= innerWidth,
    round: ["back", "play", "forth"].every(rounded),
    paper: getComputedStyle(document.body).backgroundColor,
    ink: paint("ink"),
    top: player.charts.panels[1].top,
  };
})()
"""


@pytest.mark.parametrize("width", [390, 1160])
@pytest.mark.parametrize("dark", [False, True])
def test_the_page_fits_a_phone_and_follows_the_dark_mode(
    width: int, dark: bool, browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    made = films["free"]
    (tmp_path / "film.html").write_text(page(made), encoding="utf-8")
    browser.look(width, dark)
    browser.open(tmp_path / "film.html")
    found = browser.value(LOOKS)
    browser.look(1160, dark=False)
    assert found["fits"]
    assert found["round"]
    assert found["paper"] == ("rgb(20, 24, 30)" if dark else "rgb(255, 255, 255)")
    assert found["ink"].strip() == ("#e6eaf0" if dark else "#1c2430")
    assert found["top"] == pytest.approx(1.08 * made.pressure_top)
    assert not browser.complaints
