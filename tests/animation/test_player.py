"""The player in a browser: the places are those of the trace."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from moving_pictures import SHAPES, apart, films, slack, sliding, sliding_films, times_of
from scenes import gas

from snooker_cli import animation
from snooker_cli.analysis import diffusion
from snooker_cli.animation import Film, film, page
from snooker_cli.animation.movie import BIN, BINS, FLASH, GREEN, MOST_FLASHES, MOST_SHARE
from snooker_cli.engine import replay, simulate
from snooker_cli.trace import SLIDE

Opened = Callable[..., Browser]


def test_movies_and_the_player_have_the_same_constants() -> None:
    folder = Path(animation.__file__).parent / "player"
    script = "".join((folder / name).read_text("utf-8") for name in ("arena.js", "charts.js"))
    assert f"const FLASH = {FLASH};" in script
    assert f"const MOST_FLASHES = {MOST_FLASHES};" in script
    assert f'const GREEN = "{GREEN}";' in script
    assert f"const BIN = {BIN}, BINS = {BINS};" in script
    assert f"const MOST_SHARE = {MOST_SHARE};" in script


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser without a window."""
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here")
    with Browser(tmp_path_factory.mktemp("profile")) as started:
        yield started


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Iterator[Opened]:
    """Open the page of films, 20 s long, at a link and in a window; it must not complain."""

    def show(
        *shown: Film, link: str = "", width: int = 1160, height: int = 900, dark: bool = False
    ) -> Browser:
        (tmp_path / "film.html").write_text(page(*shown, seconds=20.0), encoding="utf-8")
        browser.look(width, dark, height)
        browser.open(tmp_path / "film.html", link)
        return browser

    yield show
    assert browser.complaints == []


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


@pytest.mark.parametrize("name", SHAPES)
def test_the_player_shows_the_trace(name: str, opened: Opened) -> None:
    """At some times, and after a button and a key."""
    made = films()[name]
    times = times_of(made.trace)
    seen = opened(made).value(TRIAL.replace("TIMES", json.dumps(times)))
    states = replay(made.trace, times)
    places = np.array(seen["places"])
    assert apart(made.trace, places[:, :-1], states.positions) < slack(made.trace)
    assert apart(made.trace, places[:, -1], states.container_positions) < slack(made.trace)
    np.testing.assert_allclose(seen["pressure"], made.pressure(np.array(times)), rtol=1e-13)
    rows = np.searchsorted(made.time, times, side="right")
    assert seen["energy"] == made.kinetic_energy[rows].tolist()
    assert seen["playing"]
    assert seen["end"][:2] == [made.end, len(made)]
    assert seen["end"][2].endswith(f"collision {len(made)} of {len(made)}")


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


def test_keys_return_to_the_film_after_a_menu(opened: Opened) -> None:
    menus = opened(films()["fixed"]).value(MENU)
    assert {"speed", "colours"} <= set(menus)
    assert all(state == [1, True, True] for state in menus.values()), menus


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
def test_a_click_on_a_ball_draws_its_path(name: str, opened: Opened) -> None:
    made = films()[name]
    ball = made.trace.start.number - 1
    seen = opened(made).value(TAG)
    tagged, shown, playing, course, said = seen["tagged"]
    assert (tagged, shown, playing) == (ball, str(ball), False)
    assert said == f"The path of ball {ball} is shown."
    time, *places = np.array(course).T
    own = (made.i == ball) | (made.j == ball)
    assert time.tolist() == [made.start, *made.time[own].tolist()]
    known, _ = diffusion.path(made.trace, ball, time)
    moved = np.transpose(places) - known
    assert np.max(np.abs(moved - moved[0])) < slack(made.trace)
    assert seen["drawn"] > 20
    assert seen["cleared"] == [None, "", False, [], "No path is shown."]
    assert seen["beside"] == [True, "The film plays."]


def moments(made: Film) -> list[float]:
    """Even times, and some in each interval between a slide's collisions and those before."""
    time = np.concatenate([[made.start], made.time, [made.end]])
    near = np.flatnonzero(made.j == SLIDE)[:, None] + np.arange(2)
    parts = np.linspace(0, 0.999, 7)
    within = time[near][..., None] + (time[near + 1] - time[near])[..., None] * parts
    return sorted([*np.linspace(made.start, made.end, 400).tolist(), *within.ravel().tolist()])


def test_balls_that_slide_are_where_the_trace_has_them(opened: Opened) -> None:
    """In bounces without events, in slides and after them; forwards and backwards in time."""
    for name, made in sliding_films().items():
        browser, times = opened(made), moments(made)
        places = browser.value(
            f"(() => {{ const times = {json.dumps(times)}, at = (time) => player.screens[0].motion"
            ".places(time); times.forEach(at); return times.reverse().map(at).reverse(); })()"
        )
        # The whole continues as the part does.
        states = replay(sliding(), times)
        assert np.max(np.abs(np.array(places)[:, :-1] - states.positions)) < 1e-9, name
        pressures = browser.value(
            f"{json.dumps(times)}.map((time) => player.charts.courses[0]"
            ".pressure(player.screens[0].motion.count(time), time))"
        )
        np.testing.assert_allclose(pressures, made.pressure(np.array(times)), rtol=1e-12)


LOOKS = """
(() => {
  const bottom = (name) => find(name).getBoundingClientRect().bottom;
  return {
    fits: document.documentElement.scrollWidth <= innerWidth,
    lowest: Math.max(...["play", "scrub", "said"].map(bottom)),
    highest: player.screens[0].arena.canvas.getBoundingClientRect().top,
    paper: getComputedStyle(document.body).backgroundColor,
    ink: paint("ink").trim(),
  };
})()
"""


@pytest.mark.parametrize(("width", "height"), [(390, 664), (1160, 900)])
@pytest.mark.parametrize("dark", [False, True])
def test_the_page_fits_a_phone_and_follows_the_dark_mode(
    width: int, height: int, dark: bool, opened: Opened
) -> None:
    """The arena and the buttons are visible together."""
    seen = opened(films()["free"], width=width, height=height, dark=dark).value(LOOKS)
    assert seen["fits"]
    assert 0 <= seen["highest"] < seen["lowest"] <= height
    assert seen["paper"] == ("rgb(20, 24, 30)" if dark else "rgb(255, 255, 255)")
    assert seen["ink"] == ("#e6eaf0" if dark else "#1c2430")


THINNED = """
(() => {
  const kept = [], pen = { beginPath() {}, stroke() {}, lineTo(x, y) { kept.push([x, y]); } };
  const line = new ThinLine(pen);
  for (const [x, y] of POINTS) line.add(x, y);
  line.stroke();
  return kept;
})()
"""


def test_a_thin_line_keeps_what_one_can_see(opened: Opened) -> None:
    """Of each half pixel the first, the lowest, the highest and the last value."""
    points = [[k / 700, (7919 * k % 1009) / 10] for k in range(3000)]
    kept = opened(films()["fixed"]).value(THINNED.replace("POINTS", json.dumps(points)))
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


def test_a_frame_of_a_long_film_draws_no_more_than_one_of_a_short_film(opened: Opened) -> None:
    trace = simulate(gas("circle", 37, 0.3), collisions=10_000)
    first, next_frame, at_end = opened(film(trace, "")).value(DRAWING)
    assert first < 2 * 4 * 2 * 1160 + 1000  # two curves, four points of each half pixel
    assert next_frame == at_end < 1000  # the container's outline and the bars


LABELS = """
(async () => {
  await new Promise(requestAnimationFrame);  // the first frame is drawn
  const pen = player.charts.axes.getContext("2d");
  const ticks = player.charts.panels.flatMap(({ ticks }) => ticks);
  return [
    player.charts.left,
    Math.max(...ticks.map(([, text]) => pen.measureText(text).width)),
    [[1.6e6, 2e5], [1.0002e6, 100], [3e5, 1e5], [20, 5], [0.3, 0.1], [3e-4, 5e-5]].map(
      ([top, step]) => [0, 1, 2, 3].map((k) => tickLabel(top - k * step, step))),
  ];
})()
"""


def test_labels_of_large_values_fit_and_differ(opened: Opened) -> None:
    """From 100,000 on they were cut off, and neighbours were equal."""
    scene = gas("circle", 37, 0.3)
    hot = replace(scene, velocities=scene.velocities * 1e3)
    left, widest, labels = opened(film(simulate(hot, collisions=50), "")).value(LABELS)
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


def test_the_speed_is_a_number_with_its_unit(opened: Opened) -> None:
    text, rate, real, by_step, collisions = opened(films()["fixed"]).value(SPEEDS)
    assert (text, real) == (f"1 ({rate:.2g} s per second)", pytest.approx(1.0))
    assert by_step == f"1 ({collisions:.2g} collisions per second)"


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


def test_full_screen_has_text_for_a_projector(opened: Opened) -> None:
    browser = opened(films()["fixed"], width=1920, height=1080)
    small, large, pressed, again, released = browser.value(FULL)
    assert (pressed, released, again) == (True, True, small)
    assert (small[0], large[0]) == (14, pytest.approx(0.012 * 1920))
    assert large[1] / small[1] == pytest.approx(large[0] / small[0])


LINKED = """
(async () => {
  const first = [player.reels[0].time, player.screens[0].arena.tagged, player.playing];
  player.goToTime(0.5);
  player.tag("");
  await new Promise((done) => setTimeout(done, 3 * LINK_AFTER));
  return [first, location.hash];
})()
"""


def test_a_link_goes_to_a_time_and_a_ball(opened: Opened) -> None:
    linked = opened(films()["fixed"], link="#t=1.25&ball=5").value(LINKED)
    assert linked == [[1.25, 5, False], "#t=0.5"]
    browser = opened(films()["fixed"], link="?again#t=x&ball=99")
    said = browser.value("[player.reels[0].time, find('said').textContent]")
    assert said == [0, "There is no ball 99: give a number from 0 to 36."]


SHARES = """
(() => {
  player.goTo(0.7);
  player.draw();
  return [...player.charts.courses[0].speeds(player.reels[0].done)];
})()
"""


def test_the_histogram_has_the_balls_by_speed(opened: Opened) -> None:
    made = films()["box"]  # of unequal masses
    shares = opened(made).value(SHARES)
    states, scene = replay(made.trace, [0.7 * made.end]), made.trace.start
    energies = scene.masses * np.sum(states.velocities[0] ** 2, axis=1) / 2
    edges = np.append(BIN * np.arange(BINS), np.inf)
    counts = np.histogram(np.sqrt(energies / energies.mean()), edges)[0]
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


def test_repeats_side_by_side_are_in_step(opened: Opened) -> None:
    long = replace(films()["fixed"], subtitle="long")
    brief = film(long.trace, "", "brief", most=80)
    time = brief.end / 2
    seen = opened(brief, long).value(TOGETHER.replace("TIME", repr(time)))
    assert [at for at, _ in seen["both"]] == [time, time]
    assert [at for at, _ in seen["late"]] == [brief.end, pytest.approx(long.end, abs=2e-3)]
    assert seen["dim"] == ["0.4", "1"]  # the brief film waits at its end
    assert seen["places"][0] == seen["places"][1]
    assert seen["steps"] == [18, 18]
    assert [text.split("t = ")[0] for text in seen["captions"]] == ["brief", "long"]
    assert seen["captions"][0].endswith("collision 18 of 80")


HOSTILE = [
    "</script><script>document.title = 'broken'</script>",
    "<img src=x onerror=\"document.title = 'broken'\">",
    "{{film}} $x$ $\\frac %s & \"R\" 'é' 😀\n\u202e\x00\udcff",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_texts_are_shown_as_they_are_and_never_run(text: str, opened: Opened) -> None:
    trace = films()["fixed"].trace
    browser = opened(film(trace, text, text), film(trace, text, f"{text} 2"))
    shown = film(trace, text, text).title
    assert browser.value("find('title').textContent") == shown
    assert browser.value("player.screens[0].caption.textContent").startswith(shown)
    assert browser.value("[document.title, document.images.length]") == [
        " ".join(shown.split()),
        0,
    ]
