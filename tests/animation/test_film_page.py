"""The page of films in a browser: it simulates what is stored, with the same bits."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, opened_up
from moving_pictures import SHAPES, films, slack, sliding, sliding_films, times_of

from snooker_cli.analysis import diffusion
from snooker_cli.animation import Film, film, page
from snooker_cli.animation.film import FIRST_COLLISIONS
from snooker_cli.animation.movie import BIN, BINS, EDGE, FLASH, GREEN, MOST_FLASHES, MOST_SHARE
from snooker_cli.engine import replay
from snooker_cli.pages.html_page import text_of
from snooker_cli.trace import SLIDE

Opened = Callable[..., Browser]


def test_movies_and_the_page_have_the_same_constants() -> None:
    script = text_of("snooker_cli.pages", "arena.js", "panels.js")
    assert f"const FLASH = {FLASH};" in script
    assert f"const MOST_FLASHES = {MOST_FLASHES};" in script
    assert f"--contact: {GREEN};" in text_of("snooker_cli.pages", "page.css")
    assert f"const BIN = {BIN}, BINS = {BINS};" in script
    assert f"const MOST_SHARE = {MOST_SHARE};" in script
    assert f"const EDGE = {EDGE:.0e};".replace("e-09", "e-9") in script
    charts = text_of("snooker_cli.live_page", "charts.js")
    assert f"const FIRST_COLLISIONS = {FIRST_COLLISIONS};" in charts


AT = """
globalThis.at = (screen, time) => {
  screen.playhead.goToTime(time);
  screen.show();
  return screen.gas;
}, 0
"""
"""A function that lets the gas of a screen be at a time, s."""


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Iterator[Opened]:
    """Open the page of films, 20 s long, at a link and in a window; it must not complain."""

    def show(
        *shown: Film, link: str = "", width: int = 1160, height: int = 900, dark: bool = False
    ) -> Browser:
        made = opened_up(page(*shown, seconds=20.0))
        (tmp_path / "film.html").write_text(made, encoding="utf-8")
        browser.look(width, dark, height)
        browser.open(tmp_path / "film.html", link)
        browser.value("started")
        browser.value(AT)
        return browser

    yield show
    assert browser.complaints == []


TRIAL = """
(async () => {
  const [screen] = player.screens, states = TIMES.map((time) => {
    const gas = at(screen, time), pressure = gas.means()?.pressure ?? 0;
    const places = Array.from({ length: gas.number + 1 }, (_, ball) => gas.place(ball, time));
    return [places, pressure, gas.meter.energy];
  });
  const found = { states, stored: screen.isStored, refused: !find("refusal").hidden };
  find("play").click();
  found.playing = player.playing;
  document.dispatchEvent(new KeyboardEvent("keydown", { key: "End" }));
  for (let k = 0; k < 2; k++) await new Promise((drawn) => requestAnimationFrame(drawn));
  found.end = [player.playheads[0].time, player.playheads[0].done, find("count").textContent];
  return found;
})()
"""


@pytest.mark.parametrize("name", SHAPES)
def test_the_page_shows_the_trace(name: str, opened: Opened) -> None:
    """At some times, back and forth, and after a button and a key."""
    made = films()[name]
    times = times_of(made.trace)
    times += times[::-2]
    seen = opened(made).value(TRIAL.replace("TIMES", json.dumps(times)))
    order = np.argsort(times, kind="stable")
    states = replay(made.trace, np.array(times)[order])
    places, pressures, energies = zip(*(seen["states"][k] for k in order), strict=True)
    np.testing.assert_array_equal(np.array(places)[:, :-1], states.positions)
    np.testing.assert_array_equal(np.array(places)[:, -1], states.container_position)
    known = made.pressure(states.time)
    np.testing.assert_allclose(pressures, np.where(states.time > 0, known, 0), rtol=1e-12)
    rows = np.searchsorted(made.time, states.time, side="right")
    np.testing.assert_allclose(energies, made.kinetic_energy[rows], rtol=1e-12)
    assert (seen["stored"], seen["refused"], seen["playing"]) == (True, False, True)
    assert seen["end"][:2] == [made.end, len(made)]
    assert seen["end"][2].endswith(f"collision {len(made)} of {len(made)}")


def test_other_collisions_than_those_stored_are_no_secret(opened: Opened) -> None:
    """A run of another version of the engine has other events."""
    made = films()["fixed"]
    assert made.trace.events is not None
    events = replace(made.trace.events, impulse=made.trace.events.impulse * (1 + 1e-15))
    browser = opened(replace(made, trace=replace(made.trace, events=events), subtitle="old"))
    said, playable = browser.value("[find('refusal').textContent, player.ended]")
    assert said.startswith("These are not the stored collisions: another version")
    assert "old" in said
    assert not playable


def test_a_film_of_a_part_begins_and_ends_there(opened: Opened) -> None:
    whole = films()["fixed"]
    part = film(whole.trace, "part", since=float(whole.time[99]), most=50)
    script = "player.goTo(PLACE), [player.screens[0].show(), player.screens[0].gas.collisions]"
    browser = opened(part)
    ends = [browser.value(script.replace("PLACE", place))[1] for place in ("0", "1", "0")]
    assert ends == [100, 150, 100]
    assert browser.value("player.screens[0].isStored")
    assert browser.value("player.screens[0].count") == "collision 100 of 150"


TAG = """
(() => {
  const [screen] = player.screens, { arena: { canvas: arena } } = screen;
  const ball = screen.gas.number - 1, box = arena.getBoundingClientRect();
  player.goTo(1);
  player.draw();
  const click = () => {
    const [, x, y] = screen.arena.drawn.find(([one]) => one === ball);
    const at = { clientX: box.left + x, clientY: box.top + y, bubbles: true };
    arena.dispatchEvent(new MouseEvent("click", at));
    player.draw();
    const said = find("said").textContent;
    return [screen.gas.tagged, find("tagged").value, player.playing, screen.gas.course, said];
  };
  const found = { tagged: click(), cleared: click() };
  arena.dispatchEvent(new MouseEvent("click", { clientX: box.left, clientY: box.top }));
  return { ...found, beside: [player.playing, find("said").textContent] };
})()
"""
"""Click on the last ball twice, and beside the balls: the path, and what a screen reader reads."""


def test_a_click_on_a_ball_draws_its_path(opened: Opened) -> None:
    made = films()["periodic"]
    ball = made.trace.start.number - 1
    seen = opened(made).value(TAG)
    tagged, shown, playing, course, said = seen["tagged"]
    assert (tagged, shown, playing) == (ball, str(ball), False)
    assert said == f"The path of ball {ball} is shown."
    time, *places, _, _ = np.array(course).T
    own = (made.i == ball) | (made.j == ball)
    assert time.tolist() == [made.start, *made.time[own].tolist()]
    known, _ = diffusion.path(made.trace, ball, time)
    moved = np.transpose(places) - known
    assert np.max(np.abs(moved - moved[0])) < slack(made.trace)
    assert seen["cleared"] == [None, "", False, None, "No path is shown."]
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
            f"(() => {{ const times = {json.dumps(times)}, [screen] = player.screens;"
            "const seen = (time) => { const gas = at(screen, time);"
            "  return Array.from(gas.radii, (_, ball) => gas.place(ball, time)); };"
            "times.forEach(seen); return times.reverse().map(seen).reverse(); })()"
        )
        # The whole continues as the part does.
        np.testing.assert_array_equal(places, replay(sliding(), times).positions, err_msg=name)
        assert browser.value("player.screens[0].isStored"), name


DRAWN = """
(async () => {
  find("log").checked = LOG;
  find("log").onchange();
  player.tag(BALL);
  player.goTo(1);
  for (let k = 0; k < 3; k++) await new Promise((drawn) => requestAnimationFrame(drawn));
  player.screens[0].arena.canvas.id = "arena";
  const [{ low, top }] = player.charts.panels;
  return [low, top];
})()
"""
FIRST, SECOND = "#2871b3", "#bd1f01"


@pytest.mark.parametrize("width", [390, 768, 1024, 1400])
@pytest.mark.parametrize("name", ["fixed", "periodic"])
def test_the_window_shows_what_is_drawn(name: str, width: int, opened: Opened) -> None:
    """A path, and charts that are not empty, also with a logarithmic axis of energy."""
    browser = opened(films()[name], width=width)
    script = DRAWN.replace("LOG", "false")
    browser.value(script.replace("BALL", '""'))
    without = browser.part("arena")
    even = browser.value(script.replace("BALL", "0"))
    assert np.count_nonzero(np.any(browser.part("arena") != without, axis=2)) > 100
    assert min(browser.painted("charts", FIRST, SECOND)) > 200
    decades = browser.value(DRAWN.replace("LOG", "true").replace("BALL", "0"))
    assert min(browser.painted("charts", FIRST, SECOND)) > 200
    assert even[0] == 0 < decades[0] < decades[1]
    assert browser.value("document.documentElement.scrollWidth - innerWidth") <= 0


STEPPED = """
(() => {
  const texts = [];
  player.setPace("events");
  for (let step = 1; step <= player.playheads[0].times.length; step++) {
    player.goToStep(step);
    player.write();
    texts.push(find("now").textContent);
  }
  return texts;
})()
"""


@pytest.mark.parametrize("name", SHAPES)
def test_a_step_is_seen_in_the_time(name: str, opened: Opened) -> None:
    """Of each twenty, one may be too short."""
    texts = opened(films()[name]).value(STEPPED)
    seen = [first != second for first, second in pairwise(texts)]
    assert sum(seen) >= 0.95 * len(seen) - 1
    made = films()[name]
    assert texts == [f"t = {made.time_text(time)} s" for time in made.time.tolist()]


SLOW = """
(() => {
  const said = () => find("slow").textContent;
  player.refresh = () => {};
  const frames = (milliseconds) => {
    player.goTo(0);
    player.play(true);
    for (let now = 0; now < 1500; now += milliseconds) player.frame(now);
    return said();
  };
  return ["1", "real"].flatMap((speed) => {
    find("speed").value = speed;
    find("speed").onchange();
    return [frames(20), frames(300)];
  });
})()
"""


def test_a_film_that_is_slower_than_chosen_is_said_to_be(opened: Opened) -> None:
    """Of a frame that took 0.3 s the page plays 0.1 s."""
    slow, real = "slower than chosen", "slower than real time"
    assert opened(films()["free"]).value(SLOW) == ["", slow, "", real]


LINKED = """
(async () => {
  const first = [player.playheads[0].time, player.screens[0].gas.tagged, player.playing];
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
    said = browser.value("[player.playheads[0].time, find('said').textContent]")
    assert said == [0, "There is no ball 99: give a number from 0 to 36."]


TOGETHER = """
(() => {
  const now = () => player.playheads.map(({ time, step }) => [time, step]);
  const dim = () => player.screens.map(({ arena }) => arena.canvas.style.opacity);
  const all = (time) => { player.goToTime(time); player.draw(); return now(); };
  const found = { both: all(TIME), late: all(player.end - 1e-3), dim: dim() };
  found.places = player.screens.map((screen) => at(screen, TIME).place(0, TIME));
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


@pytest.mark.parametrize(
    "text",
    [
        "<img src=x onerror=\"document.title = 'broken'\">",
        "{{film}} $x$ $\\frac %s & \"R\" 'é' 😀\n\u202e\x00\udcff",
    ],
)
def test_texts_are_shown_as_they_are_and_never_run(text: str, opened: Opened) -> None:
    trace = films()["fixed"].trace
    browser = opened(film(trace, text, text), film(trace, text, f"{text} 2"))
    shown = film(trace, text, text).title
    browser.value("player.draw()")
    assert browser.value("find('title').textContent") == shown
    assert browser.value("player.screens[0].caption.textContent").startswith(shown)
    title, images = browser.value("[document.title, document.images.length]")
    assert (title, images) == (" ".join(shown.split()), 0)
