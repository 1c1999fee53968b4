"""The player in a browser: the places are those of the trace."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from moving_pictures import SHAPES, apart, slack, sliding, sliding_films, times_of
from scenes import gas

from snooker_cli import animation
from snooker_cli.analysis import diffusion
from snooker_cli.animation import Film, film, page
from snooker_cli.animation.film import FLASH, MOST_FLASHES
from snooker_cli.animation.movie import GREEN
from snooker_cli.engine import replay, simulate
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
    const said = find("said").textContent;
    return [screen.arena.tagged, find("tagged").value, player.playing, screen.arena.path, said];
  };
  const coloured = () => {
    const { data } = arena.getContext("2d").getImageData(0, 0, arena.width, arena.height);
    let found = 0;
    for (let k = 0; k < data.length; k += 4) {
      found += data[k] === 123 && data[k + 1] === 44 && data[k + 2] === 191;
    }
    return found;
  };
  const found = { tagged: click(), drawn: coloured(), cleared: click() };
  arena.dispatchEvent(new MouseEvent("click", { clientX: box.left, clientY: box.top }));
  return { ...found, beside: [player.playing, find("said").textContent] };
})()
"""
"""Click on the last ball twice, and beside the balls: the path, the number of points in its colour,
and what a screen reader reads."""


@pytest.mark.parametrize("name", SHAPES)
def test_a_click_on_a_ball_draws_its_path(
    name: str, browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    made = films[name]
    path, ball = tmp_path / "film.html", made.trace.start.number - 1
    path.write_text(page(made, seconds=20.0), encoding="utf-8")
    browser.open(path)
    found = browser.value(TAG)
    tagged, shown, playing, course, said = found["tagged"]
    assert (tagged, shown, playing) == (ball, str(ball), False)
    assert said == f"The path of ball {ball} is shown."
    time, *places = np.array(course).T
    own = (made.i == ball) | (made.j == ball)
    assert time.tolist() == [made.start, *made.time[own].tolist()]
    known, _ = diffusion.path(made.trace, ball, time)
    moved = np.transpose(places) - known
    assert np.max(np.abs(moved - moved[0])) < slack(made.trace)
    assert found["drawn"] > 20
    assert found["cleared"] == [None, "", False, [], "No path is shown."]
    assert found["beside"] == [True, "The film plays."]
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


THINNED = """
(() => {
  const kept = [], pen = { beginPath() {}, stroke() {}, lineTo(x, y) { kept.push([x, y]); } };
  const line = new ThinLine(pen);
  for (const [x, y] of POINTS) line.add(x, y);
  line.stroke();
  return kept;
})()
"""


def test_a_thin_line_keeps_what_one_can_see(browser: Browser, films: dict[str, Film]) -> None:
    """Of each half pixel the first, the lowest, the highest and the last value."""
    points = [[k / 700, (7919 * k % 1009) / 10] for k in range(3000)]
    kept = browser.value(THINNED.replace("POINTS", json.dumps(points)))
    given, left = np.array(points), np.array(kept)
    columns = np.floor(2 * given[:, 0])
    for column in np.unique(columns):
        own, seen = given[columns == column][:, 1], left[np.floor(2 * left[:, 0]) == column][:, 1]
        assert seen.tolist() == [own[0], own.min(), own.max(), own[-1]]


DRAWING = """
(() => {
  let lines = 0;
  const draws = CanvasRenderingContext2D.prototype.lineTo;
  CanvasRenderingContext2D.prototype.lineTo = function (...at) { lines++; draws.apply(this, at); };
  const count = (place) => { lines = 0; player.goTo(place); player.draw(); return lines; };
  player.charts.made = "";
  return [count(0.5), count(0.5), count(1)];
})()
"""
"""Lines that are drawn with the axes and curves, without them, and with twice the collisions."""


def test_a_frame_of_a_long_film_draws_no_more_than_one_of_a_short_film(
    browser: Browser, tmp_path: Path
) -> None:
    trace = simulate(gas("circle", 37, 0.3), collisions=10_000)
    (tmp_path / "film.html").write_text(page(film(trace, "")), encoding="utf-8")
    browser.look(1160, dark=False)
    browser.open(tmp_path / "film.html")
    first, next_frame, at_end = browser.value(DRAWING)
    assert first < 2 * 4 * 2 * 1160 + 1000  # two curves, four points of each half pixel
    assert next_frame == at_end < 1000  # the container's outline and the bars


LABELS = """
[[1.6e6, 2e5], [1.0002e6, 100], [3e5, 1e5], [20, 5], [0.3, 0.1], [3e-4, 5e-5]].map((axis) => {
  const [top, step] = axis;
  const values = [0, 1, 2, 3].map((k) => top - k * step);
  return values.map((value) => tickLabel(value, step));
})
"""


def test_labels_of_large_values_fit_and_differ(browser: Browser, tmp_path: Path) -> None:
    """From 100,000 on they were cut off, and neighbours were equal."""
    scene = gas("circle", 37, 0.3)
    hot = replace(scene, velocities=scene.velocities * 1e3)
    (tmp_path / "film.html").write_text(page(film(simulate(hot, collisions=50), "")), "utf-8")
    browser.look(1160, dark=False)
    browser.open(tmp_path / "film.html")
    browser.value("new Promise(requestAnimationFrame)")  # the first frame is drawn
    left, widest, labels = browser.value(
        f"[player.charts.left, Math.max(...player.charts.panels.flatMap(({{ ticks }}) => ticks.map("
        f"([, text]) => player.charts.axes.getContext('2d').measureText(text).width))), {LABELS}]"
    )
    assert 50 < widest < left
    assert all(len(set(texts)) == 4 for texts in labels), labels
    assert labels[0] == ["1.6 × 10⁶", "1.4 × 10⁶", "1.2 × 10⁶", "1.0 × 10⁶"]


SPEEDS = """
(() => {
  const menu = find("speed"), text = () => menu.selectedOptions[0].textContent;
  const found = [text(), player.rate.time];
  menu.value = "real";
  menu.onchange();
  found.push(player.speed * player.rate.time);
  player.setPace("events");
  return [...found, text(), player.rate.events];
})()
"""


def test_the_speed_is_a_number_with_its_unit(
    browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    (tmp_path / "film.html").write_text(page(films["fixed"], seconds=20.0), encoding="utf-8")
    browser.open(tmp_path / "film.html")
    text, rate, real, by_step, collisions = browser.value(SPEEDS)
    assert (text, real) == (f"1 ({rate:.2g} s per second)", pytest.approx(1.0))
    assert by_step == f"1 ({collisions:.2g} collisions per second)"


SEEN = """
["play", "scrub", "said"].map((name) => find(name).getBoundingClientRect().bottom)
  .concat(player.screens[0].arena.canvas.getBoundingClientRect().top)
"""


def test_a_phone_shows_the_arena_and_the_buttons_together(
    browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    (tmp_path / "film.html").write_text(page(films["fixed"]), encoding="utf-8")
    browser.look(390, dark=False, height=664)
    browser.open(tmp_path / "film.html")
    *bottoms, top = browser.value(SEEN)
    browser.look(1160, dark=False)
    assert top >= 0
    assert max(bottoms) <= 664


FULL = """
(async () => {
  const size = (part) => parseFloat(getComputedStyle(part).fontSize);
  const sizes = () => [size(document.body), size(find("charts"))];
  const found = [sizes()];
  for (const pressed of ["true", "false"]) {
    await new Promise((done) => {
      document.addEventListener("fullscreenchange", done, { once: true });
      find("full").click();
    });
    found.push(sizes(), find("full").getAttribute("aria-pressed") === pressed);
  }
  return found;
})()
"""


def test_full_screen_has_text_for_a_projector(
    browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    (tmp_path / "film.html").write_text(page(films["fixed"]), encoding="utf-8")
    browser.look(1920, dark=False, height=1080)
    browser.open(tmp_path / "film.html")
    small, large, pressed, again, released = browser.value(FULL)
    browser.look(1160, dark=False)
    assert (pressed, released, again) == (True, True, small)
    assert (small[0], large[0]) == (14, pytest.approx(0.012 * 1920))
    assert large[1] / small[1] == pytest.approx(large[0] / small[0])
    assert browser.complaints == []


LINKED = """
(async () => {
  const first = [player.reels[0].time, player.screens[0].arena.tagged, player.playing];
  player.goToTime(0.5);
  player.tag("");
  await new Promise((done) => setTimeout(done, 3 * LINK_AFTER));
  return [first, location.hash];
})()
"""


def test_a_link_goes_to_a_time_and_a_ball(
    browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    (tmp_path / "film.html").write_text(page(films["fixed"]), encoding="utf-8")
    browser.open(tmp_path / "film.html", "#t=1.25&ball=5")
    assert browser.value(LINKED) == [[1.25, 5, False], "#t=0.5"]
    browser.open(tmp_path / "film.html", "?again#t=x&ball=99")
    said = browser.value("[player.reels[0].time, find('said').textContent]")
    assert said == [0, "There is no ball 99: give a number from 0 to 36."]
    assert browser.complaints == []


@pytest.mark.parametrize("name", SHAPES)
def test_the_histogram_has_the_balls_by_speed(
    name: str, browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    made = films[name]
    (tmp_path / "film.html").write_text(page(made), encoding="utf-8")
    browser.open(tmp_path / "film.html")
    width, shares = browser.value(
        "(() => { player.goTo(0.7); player.draw(); const [course] = player.charts.courses;"
        "return [BIN, [...course.speeds(player.reels[0].done)]]; })()"
    )
    states, scene = replay(made.trace, [0.7 * made.end]), made.trace.start
    squares = np.sum(states.velocities[0] ** 2, axis=1)
    temperature = scene.masses @ squares / (2 * scene.number)
    reduced = np.sqrt(squares * scene.masses / (2 * temperature))
    bins = np.minimum((reduced / width).astype(int), len(shares) - 1)
    counts = np.bincount(bins, minlength=len(shares))
    np.testing.assert_allclose(shares, counts / scene.number, atol=1e-12)


TOGETHER = """
(() => {
  const now = () => player.reels.map(({ time, step }) => [time, step]);
  const dim = () => player.screens.map(({ arena }) => arena.canvas.style.opacity);
  const at = (time) => { player.goToTime(time); player.draw(); return now(); };
  const found = { both: at(TIME), late: at(player.end - 1e-3), dim: dim(), places: player.screens
    .map(({ motion }) => motion.places(TIME)) };
  player.setPace("events");
  player.goToStep(17);
  player.stepBy(1);
  player.draw();
  const captions = player.screens.map(({ caption }) => caption.textContent);
  return { ...found, steps: now().map(([, step]) => step), captions };
})()
"""


def test_repeats_side_by_side_are_in_step(
    browser: Browser, films: dict[str, Film], tmp_path: Path
) -> None:
    long, brief = (
        replace(films["fixed"], subtitle="long"),
        film(films["fixed"].trace, "", "brief", most=80),
    )
    (tmp_path / "film.html").write_text(page(brief, long), encoding="utf-8")
    browser.open(tmp_path / "film.html")
    time = brief.end / 2
    found = browser.value(TOGETHER.replace("TIME", repr(time)))
    assert [at for at, _ in found["both"]] == [time, time]
    assert [at for at, _ in found["late"]] == [brief.end, pytest.approx(long.end, abs=2e-3)]
    assert found["dim"] == ["0.4", "1"]  # the brief film waits at its end
    assert found["places"][0] == found["places"][1]
    assert found["steps"] == [18, 18]
    assert [text.split("t = ")[0] for text in found["captions"]] == ["brief", "long"]
    assert found["captions"][0].endswith("collision 18 of 80")
    assert browser.complaints == []
