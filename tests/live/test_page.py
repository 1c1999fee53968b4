"""``snooker live`` and ``snooker.live``: what is on the page, and what is refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from live_scripts import LiveScripts

import snooker_cli as snooker
from snooker_cli import config as configs
from snooker_cli.config import Experiment
from snooker_cli.engine import simulate
from snooker_cli.live_page.page import MOST_BYTES, presets
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import event_hashes

SCENES = presets()
GAS: dict[str, Any] = {
    "container": {"radius": 10.0},
    "balls": {"count": 20, "radius": 0.5, "speed": 10.0},
    "cor": 0.9,
    "collisions": 100,
}


def data_of(page: str) -> dict[str, Any]:
    """What the page knows from Python."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found
    return dict(json.loads(found[1]))


def test_a_page_is_small_and_has_no_network() -> None:
    page = snooker.live().html
    row = [
        {"position": [0.01 * k, -2 / 3], "velocity": [1 / 3, -1e-7], "radius": 1e-3 / 3}
        for k in range(-100, 100)
    ]
    largest = snooker.live(GAS | {"balls": {"list": row}}).html
    assert max(len(page.encode()), len(largest.encode())) <= MOST_BYTES
    assert "default-src 'none'" in page
    assert not re.search(r"(?:src|href)=|@import|url\(|fetch\(|XMLHttpRequest", page)
    assert page == snooker.live().html
    assert [scene["name"] for scene in data_of(page)["scenes"]] == [s["name"] for s in SCENES]


def test_the_scripts_of_a_page_share_one_scope(javascript: LiveScripts) -> None:
    """They have no syntax error, and no name twice; without a browser they cannot run."""
    scripts = re.findall(r"<script(?: id=\"engine\")?>(.*?)</script>", snooker.live().html, re.S)
    assert len(scripts) == 2
    assert javascript.value("typeof new Function(text)", text="".join(scripts)) == "function"


def test_the_first_scene_is_that_of_the_config() -> None:
    """Of a sweep it is the first point. Its title cannot break the page."""
    title = "</script><b>{{data}}"
    page = snooker.live(GAS | {"title": title}, {"cor": [0.7, 0.8]}).html
    own, *others = data_of(page)["scenes"]
    assert (own["config"]["cor"], own["title"]) == (0.7, title)
    assert [scene["name"] for scene in others] == [scene["name"] for scene in SCENES]
    assert page.count("</script>") == 3


@pytest.mark.parametrize(
    ("change", "key", "needs"),
    [
        ({"balls.count": 201}, "balls", "at most 200 balls"),
        ({"seed": 2**53}, "seed", "seeds up to 9007199254740991"),
        ({"balls.radius": 9.0}, "balls.radius", "packing"),
    ],
)
def test_what_a_page_cannot_show_is_refused(change: Any, key: str, needs: str) -> None:
    with pytest.raises(snooker.ConfigError, match=f"{key}.*{needs}"):
        snooker.live(GAS, change)


def test_a_notebook_shows_the_page(tmp_path: Path) -> None:
    page = snooker.live(GAS)
    assert "<iframe" in page._repr_html_()
    assert page.save(tmp_path / "gas.html").read_text(encoding="utf-8") == page.html


@pytest.mark.parametrize("name", [scene["name"] for scene in SCENES])
def test_the_program_gives_the_hash_of_the_page(name: str, javascript: LiveScripts) -> None:
    """Of the first 1,000 collisions, or of all, from the text of the config on the page."""
    config = next(scene["config"] for scene in SCENES if scene["name"] == name)
    defaults = data_of(snooker.live().html)["defaults"]
    text, shown = javascript.value(
        """(() => {
          const gas = new Gas(config);
          gas.advance(Infinity, 1000);
          return [yamlOf(config, defaults), gas.simulation.eventHash()];
        })()""",
        config=config,
        defaults=defaults,
    )
    experiment = configs.parse(text, overrides=["collisions=1000"]).experiment
    events = simulate(starting_scene(experiment, 0), collisions=1000, time=experiment.time).events
    assert events is not None
    assert event_hashes([events])[-1][1] == shown


@pytest.mark.parametrize("name", [scene["name"] for scene in SCENES])
def test_the_config_on_the_page_is_that_of_the_scene(name: str, javascript: LiveScripts) -> None:
    """Read by `snooker run`, its text gives the same digest; also with numbers of all sizes."""
    config = next(scene["config"] for scene in SCENES if scene["name"] == name)
    config |= {"cor": 1e-7, "seed": 2**53 - 1, "time": 1e22}
    defaults = data_of(snooker.live().html)["defaults"]
    text = javascript.value("yamlOf(config, defaults)", config=config, defaults=defaults)
    known = Experiment.model_validate_json(json.dumps(config))
    assert configs.digest(configs.parse(text).experiment) == configs.digest(known)
