"""docs/live.md has the numbers that the live page measures, and its picture the page's buttons."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from browser import Browser, opened_up
from live_scripts import LiveScripts
from PIL import Image
from PIL.PngImagePlugin import PngInfo

import snooker_cli as snooker

PAGE = Path(__file__).parents[2] / "docs" / "live.md"

TABLE = re.compile(r"<!-- (measure|speeds) (\{.*\}) -->\n(\|.*\n\|[-|]*\n)((?:\|.*\n)*)")
"""How a table is measured, its head, and its rows."""

MEASURED = """
values.map((value) => {
  const config = JSON.parse(JSON.stringify(configOf(scene)));
  controlsOf(config).find(({ id }) => id === control).write(config, value, configOf(scene));
  config.collisions = collisions;
  const results = Array.from({ length: starts }, (_, repeat) => measureRepeat(config, repeat));
  const row = tableRow(config, results), last = columns[columns.length - 1];
  const law = Object.values(THEORIES[last]).find(({ model }) => model === theory);
  const cells = columns.map((key) => valueWithError(row[key], row[`${key}Error`]));
  return [String(value), ...cells, short(valueAtRow(law, row), 4)];
})
"""

SPEEDS = """
rings.map((number) => {
  const config = JSON.parse(JSON.stringify(configOf(scene)));
  Object.assign(config, { cor: 1, wall_cor: 1 });
  config.balls.rings = number;
  const gas = new Gas(config, own); // the first scene of the page
  const percent = (share) => `${short(100 * share, 2)} %`;
  gas.advance(Infinity, collisions);
  const fixed = (1 - above ** 2 / gas.number) ** (gas.number - 1);
  const shares = [gas.shareAbove(above), fixed, Math.exp(-(above ** 2))];
  return [String(gas.number), ...shares.map(percent)];
})
"""


def rows_of(scripts: LiveScripts, how: str, given: dict[str, Any]) -> str:
    rows = scripts.value(MEASURED if how == "measure" else SPEEDS, **given)
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def test_the_lesson_has_the_numbers_of_the_page(request: pytest.FixtureRequest) -> None:
    text = PAGE.read_text(encoding="utf-8")
    tables = TABLE.findall(text)
    assert len(tables) == 5
    with LiveScripts() as scripts:
        for how, given, head, shown in tables:
            rows = rows_of(scripts, how, json.loads(given))
            if request.config.getoption("--write-goldens"):
                text = text.replace(head + shown, head + rows)
            else:
                assert shown == rows
    if request.config.getoption("--write-goldens"):
        PAGE.write_text(text, encoding="utf-8")


PICTURE = PAGE.with_name("live.png")

PICTURED = """
(async () => {
  document.querySelector("input[name=pace][value=events]").click();
  find("speed").value = 1000;
  find("speed").onchange();
  live.gas.advance(Infinity, 3500);
  live.redraw();
  await new Promise((done) => setTimeout(done, 200));
  const named = [...document.querySelectorAll("h1, button, label")];
  const shown = named.filter((at) => at.checkVisibility());
  return shown.map((at) => at.getAttribute("aria-label") ?? at.textContent);
})()
"""


def test_the_picture_shows_the_page_as_it_is(
    browser: Browser, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """All buttons and labels are those that the page had when it was taken, which the file has."""
    (tmp_path / "gas.html").write_text(opened_up(snooker.live().html), encoding="utf-8")
    browser.look(1280, False, 800)
    browser.open(tmp_path / "gas.html", "#scene=crowded")
    browser.value("started")
    names = json.dumps(browser.value(PICTURED))
    if request.config.getoption("--write-goldens"):
        kept = PngInfo()
        kept.add_itxt("names", names)
        picture = Image.fromarray(browser.picture()).quantize(dither=Image.Dither.NONE)
        picture.save(PICTURE, pnginfo=kept, optimize=True)
    with Image.open(PICTURE) as picture:
        assert picture.info.get("names") == names
