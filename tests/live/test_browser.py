"""The live page in a browser: controls, worker, table, looks; no message and no request."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Iterator
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import NEARLY, Browser, opened_up, with_more_script
from live_scripts import LiveScripts

import snooker_cli as snooker
from snooker_cli.live_page.page import presets, words_of

Opened = Callable[..., Browser]

SCENES = [scene["name"] for scene in presets()]


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Iterator[Opened]:
    """Open the page in a window; it must not complain, nor ask for anything."""

    def show(
        width: int = 1400, height: int = 900, dark: bool = False, link: str = "", **choices: Any
    ) -> Browser:
        page = opened_up(snooker.live(**choices).html)
        (tmp_path / "gas.html").write_text(page, encoding="utf-8")
        browser.look(width, dark, height)
        browser.open(tmp_path / "gas.html", link)
        browser.value("globalThis.wait = (ms) => new Promise((done) => setTimeout(done, ms)), 0")
        browser.value("started")
        return browser

    yield show
    assert browser.value("performance.getEntriesByType('resource').length") == 0
    assert browser.complaints == []


RUN = """
(async () => {
  live.open(content.scenes.find(({ name }) => name === NAME));
  live.setPace("events");
  live.speeds.events = 1000;
  live.play(true);
  while (!live.gas.stop && (NAME === "trap" || live.gas.collisions < 2)) await wait(20);
  const seen = [live.gas.collisions, live.gas.stop?.message ?? "", find("ending").hidden];
  live.play(false);
  live.step();
  await wait(50);
  return [...seen, find("title").textContent, find("charts").getAttribute("aria-label")];
})()
"""


@pytest.mark.parametrize("name", SCENES)
def test_each_scene_runs(name: str, opened: Opened) -> None:
    ran, message, hidden, title, sentence = opened().value(RUN.replace("NAME", json.dumps(name)))
    assert ran >= 2
    assert bool(message) == (not hidden)
    assert title == next(scene["title"] for scene in presets() if scene["name"] == name)
    assert sentence.startswith("Now: kinetic energy")
    if name == "trap":
        assert message.startswith("wall trap: from 1.62")


CONTROL = """
(async () => {
  const text = (name) => find(name).textContent, field = (name) => find(`set-${name}`);
  const type = (name, value) => { const at = field(name); at.value = value; at.onchange(); };
  const seen = { exact: [text("exactness"), live.gas.changed] };
  live.gas.advance(Infinity, 200);
  type("cor", 0.5);
  const state = () => [live.gas.collisions, live.gas.scene.pairLaw.cor, live.gas.changed];
  seen.moved = [...state(), text("exactness")];
  type("radius", 0.9);
  seen.again = [...state(), live.gas.radii[0]];
  seen.yaml = text("yaml");
  type("radius", "");
  seen.emptied = [field("radius").value, live.gas.radii[0]];
  type("radius", 5);
  seen.error = [text("refusal"), find("refusal").hidden, live.gas.radii[0], field("radius").value];
  const slider = field("speed").previousSibling;
  slider.value = 1;
  slider.oninput();
  seen.slider = [live.config.balls.speed, find("refusal").hidden];
  type("container-mass", "");
  seen.fixed = [live.config.container.mass, field("wall").value];
  type("container-mass", 1e7);
  live.gas.advance(Infinity, 10);
  type("wall", "warm");
  seen.closed = [live.config.container.mass, live.gas.collisions, live.gas.changed];
  const { name } = live.gas.scene.wallLaw;
  seen.warm = [live.config.wall_temperature, name, Boolean(find("set-wall-cor"))];
  find("seed").value = 7;
  find("seed").onchange();
  seen.seed = live.config.seed;
  document.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
  document.dispatchEvent(new KeyboardEvent("keydown", { key: " " }));
  seen.keys = [live.gas.collisions, live.playing];
  live.play(false);
  field("cor").focus();
  seen.hint = text("hint");
  seen.helped = [...document.querySelectorAll("#controls input[type=number], #controls select")]
    .every((at) => document.getElementById(at.getAttribute("aria-describedby"))?.textContent);
  await new Promise(requestAnimationFrame); // charts have their name from the first drawing on
  const named = (at) => at.labels?.length || at.getAttribute("aria-label") || at.textContent.trim();
  seen.named = [...document.querySelectorAll("input, select, button, canvas")]
    .filter((at) => at.offsetParent && !named(at)).map((at) => at.id);
  return seen;
})()
"""


def test_sliders_change_the_gas(opened: Opened) -> None:
    seen = opened().value(CONTROL)
    assert seen["exact"] == [
        "This config describes what runs now. The program gives the same collisions to the last"
        " bit.",
        False,
    ]
    assert seen["moved"][:3] == [200, 0.5, True]
    assert "no config describes this run" in seen["moved"][3]
    assert seen["again"] == [0, 0.5, False, 0.9]
    assert "cor: 0.5" in seen["yaml"]
    assert "radius: 0.9" in seen["yaml"]
    assert seen["emptied"] == ["0.9", 0.9]
    assert seen["error"][0] == (
        "With “rings” 3, the radius can be at most 1.333 m:"
        " lower “rings” or “radius”, or raise “container’s radius”."
    )
    assert seen["error"][1:] == [False, 0.9, "0.9"]
    assert seen["slider"] == [100, True]
    assert seen["fixed"] == [None, "passive"]
    assert seen["closed"] == [None, 0, False]
    assert seen["warm"] == [5000, "thermal", False]
    assert seen["seed"] == 7
    assert seen["keys"] == [1, True]
    assert seen["hint"].startswith("Coefficient of restitution between balls")
    assert seen["helped"]
    assert seen["named"] == []


MEASURE = """
(async () => {
  find("starts").value = 4;
  find("measure").click();
  const refused = find("measured").textContent;
  find("starts").value = 5;
  find("length").value = 600;
  find("measure").click();
  const busy = [find("measure").disabled, find("cancel").hidden];
  while (!find("cancel").hidden) await wait(20);
  const [row] = live.table.rows, text = live.table.text(",");
  find("starts").value = 500;
  find("length").value = 100000;
  find("measure").click();
  await wait(50);
  find("cancel").click();
  const said = find("measured").textContent;
  const cancelled = [said, find("measure").disabled, live.table.rows.length];
  find("plot-y").value = "pressure";
  find("plot-y").onchange();
  const config = { ...live.config, collisions: 600 };
  return { refused, busy, row, text, cancelled, config,
    plot: find("plot").getAttribute("aria-label"), cells: find("table").rows.length };
})()
"""


MEANS = 1e-12
"""Versions of a browser round sums of some hundred numbers in their own way, by 1e-16 each."""


def test_a_worker_measures(opened: Opened, javascript: LiveScripts) -> None:
    """The table has the numbers of the same scripts in V8, and the CSV all of their digits."""
    seen = opened().value(MEASURE)
    row: dict[str, Any] = javascript.value(
        "tableRow(config, [0, 1, 2, 3, 4].map((k) => measureRepeat(config, k, own)),"
        " startingScene(config, 0, own))",
        config=seen["config"],
    )
    assert seen["refused"] == "Give 5 to 500 starts."
    assert seen["busy"] == [True, False]
    for name in ("N", "starts"):
        assert seen["row"][name] == row[name]
    for name in ("temperature", "pressure", "ratio"):
        assert seen["row"][name] == pytest.approx(row[name], rel=MEANS, abs=0)
    head, line = csv.reader(seen["text"].splitlines())
    assert head[:6] == ["starts", "N", "r (m)", "R (m)", "CoR", "packing"]
    assert "PV/NT, hard disks, finite N" in head
    assert len(line) == len(head)
    assert float(line[head.index("T (J)")]) == seen["row"]["temperature"]
    assert seen["cancelled"] == ["Cancelled.", False, 1]
    assert seen["plot"].startswith("P (Pa m) against packing: ")
    assert seen["cells"] == 2


DIFFERENT = """
(() => {
  const heads = () => Array.from(find("table").rows[0].cells, (cell) => cell.textContent);
  const add = (more) => {
    const config = { ...live.config, ...more, collisions: 20 };
    live.table.add(tableRow(config, [measureRepeat(config, 0), measureRepeat(config, 1)]));
  };
  const container = { ...live.config.container, mass: null };
  const warm = { container, wall_cor: null, wall_temperature: 50 };
  add(warm);
  const alone = heads();
  add({ ...warm, wall_temperature: 100, cor: 0.8 });
  add({ ...warm, seed: 2 });
  const text = live.table.text(",");
  const more = heads().slice(alone.length);
  const box = { shape: "box", width: 20, height: 20, mass: null };
  const balls = { count: 5, radius: 0.5, mass: 1, speed: 10 };
  const sides = { ...warm, container: box, balls, wall_temperature: { left: 20 } };
  add({ ...sides, title: "another scene" });
  return [alone, more, text, heads()[0], heads().includes("left wall T, J")];
})()
"""


def test_the_table_shows_in_what_rows_differ(opened: Opened) -> None:
    alone, more, text, first, side = opened().value(DIFFERENT)
    lines = list(csv.reader(text.splitlines()))
    assert alone[0] == "starts"
    assert more == ["wall T, J", "seed"]
    assert lines[0][-2:] == ["wall T (J)", "seed"]
    assert [len(line) for line in lines] == 4 * [len(lines[0])]
    assert (first, side) == ("scene", True)


LOOKS = """
(async () => {
  await wait(100);
  const bottom = (name) => find(name).getBoundingClientRect().bottom;
  return {
    wide: document.documentElement.scrollWidth - innerWidth,
    bottom: Math.max(bottom("play"), bottom("arena")),
    top: find("arena").getBoundingClientRect().top,
    paper: getComputedStyle(document.body).backgroundColor,
    sliders: find("sliders").open,
  };
})()
"""


@pytest.mark.parametrize(("width", "height", "dark"), [(390, 750, False), (1400, 900, True)])
def test_the_page_fits_a_phone_and_follows_the_dark_mode(
    width: int, height: int, dark: bool, opened: Opened
) -> None:
    """The arena and the buttons are visible together."""
    seen = opened(width, height, dark).value(LOOKS)
    assert seen["wide"] <= 0
    assert 0 <= seen["top"] < seen["bottom"] <= height
    assert seen["sliders"] == (width > 700)  # a phone shows the charts first
    assert seen["paper"] == ("rgb(20, 24, 30)" if dark else "rgb(255, 255, 255)")


BELOW_ZERO = """
(async () => {
  live.open(content.scenes.find(({ name }) => name === "rough"));
  for (const beta of [-0.9, -0.3, 0.3]) {
    const config = { ...live.config, tangential_cor: beta, collisions: 3000 };
    live.table.add(tableRow(config, [0, 1].map((repeat) => measureRepeat(config, repeat))));
  }
  for (const [menu, key] of [["plot-x", X], ["plot-y", Y]]) {
    find(menu).value = key;
    find(menu).onchange();
  }
  await wait(100);
})()
"""


@pytest.mark.parametrize(
    ("across", "up"),
    [("surface_tangential_cor", "ratio"), ("ratio", "surface_tangential_cor"), ("ratio", "ratio")],
)
def test_the_plot_has_room_for_all_rows_and_their_errors(
    across: str, up: str, opened: Opened
) -> None:
    """Also below zero, and no line of an error leaves the axes."""
    page = opened(768)
    page.value(BELOW_ZERO.replace("X]", f"'{across}']").replace("Y]", f"'{up}']"))
    (dots,) = page.painted("plot", SECOND)
    assert dots >= 3 * DOT
    beyond = page.part("plot").astype(int)[:, -8:]
    assert not np.any(beyond[..., 0] > beyond[..., 1] + NEARLY)  # nothing red


def test_a_plot_without_rows_says_so(opened: Opened) -> None:
    """The means of a short measurement are missing."""
    page = opened(language="de")
    seen = page.value(ADD_ROWS.replace("100", "20") + ";" + FILLED)
    assert "keine Zeile hat beide Größen" in seen


BESIDE = """
(async () => {
  await wait(100);
  const home = find("sliders"), controls = [...home.querySelectorAll(".control")];
  const last = controls.pop().getBoundingClientRect();
  const page = document.documentElement, cut = home.scrollHeight - home.clientHeight;
  return [cut, page.scrollWidth - innerWidth, last.bottom + scrollY <= page.scrollHeight];
})()
"""


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize(("width", "height"), [(768, 1024), (1024, 768)])
def test_a_tablet_shows_all_controls(
    width: int, height: int, language: str, opened: Opened
) -> None:
    """The scene with most of them; no part of the page scrolls by itself."""
    page = opened(width, height, link="#scene=rough", language=language)
    cut, wide, below = page.value(BESIDE)
    assert cut <= 0
    assert wide <= 0
    assert below


def test_a_shade_shows_that_more_controls_are_below(opened: Opened) -> None:
    """In a low window; at the end it is gone."""
    page = opened(1400, 600, link="#scene=rough")
    box = page.value("find('sliders').getBoundingClientRect().toJSON()")
    edge = round(box["bottom"]) - 2, slice(round(box["left"]) + 20, round(box["left"]) + 200)
    assert np.median(page.picture()[edge]) < 200
    page.value("find('sliders').scrollTo(0, 1e6)")
    assert np.median(page.picture()[edge]) > 250


LINK = """
(async () => {
  const address = async (change) => {
    change();
    await wait(2 * LINK_AFTER);
    return location.hash;
  };
  const slider = find("set-cor").previousSibling, said = () => find("refusal").textContent;
  const dragged = await address(() => {
    for (let part = 1; part > 0.5; part -= 0.001) { slider.value = part; slider.oninput(); }
  });
  find("seed").value = 3;
  const seeded = await address(() => find("seed").onchange());
  const seen = [];
  for (const link of ["scene=galperin&mass=100", "scene=none", "scene=trap&cor=2"]) {
    const change = new Promise((done) => addEventListener("hashchange", done, { once: true }));
    location.hash = link;
    await change;
    live.gas.advance(Infinity);
    seen.push([live.scene.name, live.gas.collisions, said()]);
  }
  return { dragged, seeded, seen, last: location.hash };
})()
"""


def test_the_address_holds_the_scene(opened: Opened) -> None:
    """It follows sliders and the seed; another link opens its scene, or says why it does not."""
    seen = opened().value(LINK)
    assert seen["dragged"] == "#scene=report&cor=0.5"
    assert seen["seeded"] == "#scene=report&cor=0.5&seed=3"
    followed, unknown, refused = seen["seen"]
    assert followed == ["galperin", 31, ""]
    no_scene = "The link has a mistake: this page has no scene none; choose one above."
    assert (unknown[0], unknown[2]) == ("report", no_scene)
    no_number = "The link has a mistake: cor=2 needs a number from 0 to 1."
    assert (refused[0], refused[2]) == ("trap", no_number)


DRAWN = """
(async () => {
  live.open(content.scenes.find(({ name }) => name === "rough"));
  live.gas.advance(Infinity, 3000);
  for (const count of [50, 100, 150]) {
    const config = { ...live.config, balls: { ...live.config.balls, count }, collisions: 1500 };
    live.table.add(tableRow(config, [0, 1].map((repeat) => measureRepeat(config, repeat))));
  }
  find("plot-y").value = "pressure";
  find("plot-y").onchange();
  live.redraw();
  await wait(100);
})()
"""

TAG = "(async () => { live.choose(0); await wait(100); })()"
HALVES = """
(() => {
  find("arena").scrollIntoView({ block: "nearest" });
  const { gas, arena } = live, { left, top } = find("arena").getBoundingClientRect();
  return arena.drawn.map(([ball, x, y, r]) => {
    const angle = gas.simulation.angleOf(ball, gas.time);
    const [u, v] = [Math.cos(angle), -Math.sin(angle)];
    return [0.6, -0.6].map((part) => [left + x + part * r * u, top + y + part * r * v]);
  });
})()
"""
"""Of each ball, a place on its mark and the opposite one, px."""

FIRST, SECOND, THIRD, SOFT = "#2871b3", "#bd1f01", "#832db6", "#5b6675"
DOT = 30
"""Pixels of a dot in the plot, or more."""


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("width", [390, 768, 1024, 1400])
def test_the_window_shows_what_is_drawn(width: int, language: str, opened: Opened) -> None:
    """The path of a ball, marks of all balls, three charts, and in the plot a dot of each row."""
    page = opened(width, language=language)
    page.value(DRAWN)
    places, green = page.value(HALVES), page.picture()[..., 1]  # of which slow balls have little
    around = [[green[round(y) - 1 :, round(x) - 1 :][:3, :3] for x, y in pair] for pair in places]
    marked, opposite = np.max(around, axis=(2, 3)).T.astype(int)
    assert len(marked) == 200
    assert np.mean(marked > opposite + 40) > 0.8  # others are fast, or have a contact there
    without = page.part("arena")
    page.value(TAG)
    assert np.count_nonzero(np.any(page.part("arena") != without, axis=2)) > 100
    assert min(page.painted("charts", FIRST, SECOND, THIRD, SOFT)) > 200
    dots, theory = page.painted("plot", SECOND, SOFT)
    assert dots >= 3 * DOT
    assert theory > 500  # and the axes


FILLED = """
(() => {
  const seen = [], { fillText } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.fillText = (text) => seen.push(text);
  live.table.draw();
  CanvasRenderingContext2D.prototype.fillText = fillText;
  return seen;
})()
"""

ADD_ROWS = """
(() => {
  for (const seed of [1, 2]) {
    const config = { ...live.config, seed, collisions: 100 };
    live.table.add(tableRow(config, [0, 1].map((repeat) => measureRepeat(config, repeat))));
  }
  find("plot-y").value = "pressure";
  find("plot-y").onchange();
})()
"""
TABLE = """[live.table.text(","), live.table.rows.map((row) => Object.values(row).map(String)),
  find("results").hidden, find("plot-y").value]"""


def test_a_reload_keeps_the_table(opened: Opened) -> None:
    """Also what JSON has no numbers for; *Clear* removes it for good."""
    page = opened()
    page.value(ADD_ROWS)
    table = page.value(TABLE)
    values = {value for row in table[1] for value in row}
    assert {"NaN", "null"} <= values
    assert table[2:] == [False, "pressure"]
    page.reload()
    page.value("started")
    assert page.value(TABLE) == table
    page.value("find('clear-table').click()")
    page.reload()
    page.value("started")
    assert page.value("[live.table.rows.length, find('results').hidden]") == [0, True]


def test_only_chosen_controls_are_shown(opened: Opened) -> None:
    page = opened(controls=["cor", "radius"])
    shown = (
        "Array.from(find('controls').querySelectorAll('input[type=number], select'), at => at.id)"
    )
    assert page.value(shown) == ["set-cor", "set-radius"]
    page.value("live.open(content.scenes.find(({ name }) => name === 'trap'))")
    assert page.value(shown) == ["set-cor"]
    assert page.value("[find('seed'), find('restart')].every((at) => at.checkVisibility())")


SEEN = """
(async () => {
  live.gas.advance(Infinity, 200);
  live.redraw();
  await wait(100);
  const parts = ["yaml", "hashes", "charts", "measure"];
  const visible = parts.filter((name) => find(name).checkVisibility());
  const numbers = Array.from(document.querySelectorAll("#numbers dt"), (at) => at.textContent);
  return [visible, numbers.includes("momentum"), find("charts").ariaLabel.includes("virial"),
    numbers.includes("PV/NT"), live.link];
})()
"""


@pytest.mark.parametrize("made_for_beginners", [True, False])
@pytest.mark.parametrize("link", ["", "#view=beginner", "#view=full"])
def test_a_beginners_view_leaves_things_out(
    made_for_beginners: bool, link: str, opened: Opened
) -> None:
    """A page is made with it, or a link chooses it."""
    visible, *rest = opened(link=link, beginner=made_for_beginners).value(SEEN)
    is_brief = made_for_beginners if link == "" else link == "#view=beginner"
    assert visible == (
        ["charts", "measure"] if is_brief else ["yaml", "hashes", "charts", "measure"]
    )
    differs = is_brief != made_for_beginners
    kept = "scene=report" + (f"&{link[1:]}" if differs else "")
    assert rest == [not is_brief, not is_brief, True, kept]


IN_A_FRAME = """
started.then(async () => {
  const said = () => find("said").textContent;
  find("copy-link").click();
  const link = said();
  find("save-config").click();
  const seen = [said()];
  find("charts-image").click();
  find("measure").click();
  for (let k = 0; k < 200 && (!seen[1] || said() === seen[0]); k++) {
    await new Promise((done) => setTimeout(done, 20));
    seen[1] = find("measured").textContent;
  }
  parent.postMessage([...seen, said(), link], "*");
});
"""


@pytest.mark.parametrize(
    ("rights", "saved"),
    [
        ("allow-scripts allow-same-origin", "This frame forbids downloads: "),
        ("allow-scripts", "If no file appears, this frame forbids downloads: "),
    ],
)
def test_a_frame_that_forbids_something_says_so(
    rights: str, saved: str, browser: Browser, tmp_path: Path
) -> None:
    """The frame of another site cannot be read; its host forbids workers."""
    page = escape(with_more_script(snooker.live().html, IN_A_FRAME))
    policy = '<meta http-equiv="Content-Security-Policy" content="worker-src \'none\'">'
    listen = "<script>heard = new Promise((done) => onmessage = ({ data }) => done(data))</script>"
    frame = f'<iframe sandbox="{rights}" srcdoc="{page}"></iframe>'
    (tmp_path / "host.html").write_text(f"{policy}{listen}{frame}", encoding="utf-8")
    browser.open(tmp_path / "host.html")
    config, measured, picture, link = browser.value("heard")
    browser.complaints.clear()  # about the frame
    assert link == "A link needs the page by itself: save the page, and open its file."
    assert config == f"{saved}use Copy, or open the page by itself."
    assert measured == (
        "This site forbids scripts in the background, which measure:"
        " save the page, and open the file."
    )
    assert picture == f"{saved}open the page by itself."


SHAPES = {
    "circle": {"radius": 10.0},
    "box": {"shape": "box", "width": 20.0},
    "channel": {"shape": "channel", "width": 20.0},
    "periodic": {"shape": "periodic", "width": 20.0},
}
NUMBERS = "Array.from(document.querySelectorAll('#numbers dt'), (at) => at.textContent)"


@pytest.mark.parametrize("shape", SHAPES)
def test_where_a_container_repeats_there_is_no_angular_momentum(shape: str, opened: Opened) -> None:
    """Each image of a ball has another one."""
    balls = {"count": 10, "radius": 0.5, "speed": 10.0}
    page = opened(config={"container": SHAPES[shape], "balls": balls, "cor": 1, "collisions": 100})
    page.value("wait(100)")
    shown = page.value(NUMBERS)
    assert "momentum" in shown
    assert ("angular momentum" in shown) == (shape in {"circle", "box"})


STEPPED = """
(() => {
  const texts = [];
  for (let step = 0; step < 500; step++) {
    live.gas.advance(Infinity, 1);
    live.draw(0);
    texts.push(find("now").textContent);
  }
  return texts;
})()
"""


@pytest.mark.parametrize("scene", ["report", "crowded", "brownian", "rough"])
def test_a_step_is_seen_in_the_time(scene: str, opened: Opened) -> None:
    """Steps shorter than a twentieth of the mean may not be, 5 % of them."""
    texts = opened(link=f"#scene={scene}").value(STEPPED)
    seen = [first != second for first, second in pairwise(texts)]
    assert sum(seen) > 0.9 * len(seen)
    assert max(map(len, texts)) < 20


SLOW = """
(() => {
  const said = () => find("slow").textContent, seen = [];
  live.refresh = () => {};
  const frames = (milliseconds) => {
    live.play(true);
    for (let now = 0; now < 3000; now += milliseconds) live.frame(now);
    return said();
  };
  const choose = (speed) => { find("speed").value = speed; find("speed").onchange(); };
  for (const speed of ["1", "real"]) {
    choose(speed);
    seen.push(frames(10), frames(500), frames(10), frames(500));
    live.play(false);
    live.frame(0);
    seen.push(said());
  }
  return seen;
})()
"""


def test_a_gas_that_is_slower_than_chosen_is_said_to_be(opened: Opened) -> None:
    """Only while it is. Of a frame that took 0.5 s the page plays 0.1 s; one ball is no work."""
    balls = {"list": [{"position": [0, 0], "velocity": [1, 0], "radius": 1}]}
    page = opened(config={"container": {"radius": 10}, "balls": balls, "cor": 1, "collisions": 100})
    slow, real = "slower than chosen", "slower than real time"
    assert page.value(SLOW) == ["", slow, "", slow, "", "", real, "", real, ""]


BACK = """
(async () => {
  const press = (key) => document.dispatchEvent(new KeyboardEvent("keydown", { key }));
  const now = () => [live.gas.collisions, live.gas.time, live.gas.place(0, live.gas.time)];
  const before = now(), seen = [];
  await wait(100);
  const isDisabled = find("back").disabled;
  for (let k = 0; k < 3; k++) { press("ArrowRight"); seen.push(now()); }
  press("ArrowLeft");
  const back = now();
  live.gas.advance(Infinity);
  press("ArrowLeft");
  await wait(100);
  return { before, isDisabled, seen, back, ended: [live.gas.stop, find("ending").hidden] };
})()
"""


def test_a_key_goes_back_to_the_collision_before(opened: Opened) -> None:
    """Also from the end of a gas."""
    seen = opened(link="#scene=trap").value(BACK)
    assert seen["before"][0] == 0
    assert seen["isDisabled"]
    assert seen["back"] == seen["seen"][0]
    assert seen["ended"] == [None, True]


SHOWN = """
(async () => {
  const seen = new Set(), { fillText } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.fillText = function (text, ...more) {
    seen.add(text);
    fillText.call(this, text, ...more);
  };
  const look = async () => {
    live.redraw();
    await wait(50);
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
      const { data, parentElement } = texts.currentNode;
      if (!parentElement.closest("script, pre, code")) seen.add(data.trim());
    }
    for (const name of ["title", "aria-label", "placeholder", "aria-valuetext"]) {
      for (const at of document.querySelectorAll(`[${name}]`)) seen.add(at.getAttribute(name));
    }
  };
  const type = (name, value) => { find(name).value = value; find(name).onchange?.(); };
  for (const scene of content.scenes) {
    live.open(scene);
    live.pressWatch();
    live.setPace(live.pace === "time" ? "events" : "time");
    live.gas.advance(Infinity, 200);
    if (live.gas.stop) live.ended();
    await look();
    const wall = find("set-wall");
    for (const { value } of [...wall?.options ?? []]) {
      type("set-wall", value);
      await look();
    }
    live.step();
    const config = { ...live.config, collisions: 20 };
    live.table.add(tableRow(config, [0, 1].map((repeat) => measureRepeat(config, repeat))));
    const mistakes = [["set-radius", 1e10], ["set-radius", -1], ["tagged", 5000], ["seed", -1]];
    for (const [name, value] of mistakes) {
      if (find(name)) type(name, value);
      await look();
    }
    find("starts").value = 1;
    live.measure();
    await look();
  }
  for (const link of ["scene=none", "balls.rings=x", "cor=2", "view=some"]) {
    history.replaceState(null, "", `#${link}`);
    live.openLink();
    await look();
  }
  sessionStorage.clear();
  return [...seen].map((text) => text.replace(/^[-—· ]+/, ""));
})()
"""


def test_a_page_in_german_has_no_english(opened: Opened) -> None:
    """All that it shows, also on its canvases, differs from what the English page shows."""
    english, german = (set(opened(language=name).value(SHOWN)) for name in ("en", "de"))
    words = words_of("de")
    same = {text for text, other in words.items() if text == other} | {"snooker live"}
    assert len(german) > 300
    shared = {text for text in english & german if re.search(r"\b[a-z]{3,}\b", text, re.I)}
    assert shared - same == set()
    assert "Jetzt: kinetische Energie" in "\n".join(german)
