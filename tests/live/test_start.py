"""Starts of the page: no overlaps, the same bits everywhere, and configs that give them."""

from __future__ import annotations

import hashlib
import json
import math
import random
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from javascript import JavaScript, bits_of

from snooker_cli import config as configs
from snooker_cli.config import to_json, validated
from snooker_cli.config.problems import ConfigError
from snooker_cli.live_page.page import live_page
from snooker_cli.placement.starting_scene import starting_scene


@pytest.fixture(scope="module")
def engine() -> Iterator[JavaScript]:
    with JavaScript() as engine:
        yield engine


def drawn_config(dice: random.Random) -> dict[str, Any]:
    """A config of any way to give balls, in any shape; it may be impossible."""
    way = dice.choice(["rings", "list", "count", "count", "species", "species"])
    shape = "circle" if way == "rings" else dice.choice(["circle", "box", "periodic", "channel"])
    radius = 10 * 10 ** dice.uniform(-3, 3)
    size = {"radius": radius}
    if shape != "circle":
        size = {"width": 2 * radius, "height": radius * dice.uniform(1, 3)}
    config: dict[str, Any] = {
        "container": {"shape": shape, **size},
        "cor": round(dice.random(), 3),
        "collisions": 10,
        "seed": dice.randrange(10**6),
        "common_random": dice.random() < 0.2,
    }
    if way == "rings":
        config["balls"] = {
            "rings": dice.randint(0, 7),
            "radius": radius * dice.uniform(0.01, 0.12),
            "speed": dice.uniform(0, 20),
            "ring_extent": round(dice.uniform(0.5, 0.95), 2),
        }
    elif way == "list":
        config["balls"] = {"list": [ball(dice, radius) for _ in range(dice.randint(1, 5))]}
    else:
        species = [
            {
                "count": dice.randint(1, 60),
                "radius": radius / 20 * dice.uniform(0.3, 1),
                "mass": 10 ** dice.uniform(-9, 9),
                "speed": dice.uniform(0, 9),
                "speeds": dice.choice(["equal", "maxwell"]),
            }
            for _ in range(1 if way == "count" else dice.randint(1, 3))
        ]
        if dice.random() < 0.6:
            species[0]["start"] = "random"
        if dice.random() < 0.5:
            config["container"] = {"shape": shape, "packing": dice.uniform(0.01, 0.8)}
        elif way == "species":
            species.insert(0, ball(dice, radius))
        config["balls"] = species if way == "species" else species[0]
    if way != "list" and shape == "circle" and dice.random() < 0.5:
        groups = config["balls"] if way == "species" else [config["balls"]]
        groups[-1]["common_rotation"] = dice.random() < 0.2
    if dice.random() < 0.3 and shape != "periodic":
        config["wall_temperature"] = dice.uniform(1, 50)
    if dice.random() < 0.3:
        config["collapse"] = {"tc": 10 ** dice.uniform(-9, 0)}
    return config


def ball(dice: random.Random, size: float) -> dict[str, Any]:
    position, velocity = ([size * dice.uniform(-0.7, 0.7) for _ in "xy"] for _ in range(2))
    return {"position": position, "velocity": velocity, "radius": size * dice.uniform(0.01, 0.2)}


def test_the_program_has_the_start_of_the_page(engine: JavaScript) -> None:
    """From the config that the page writes, which the program checks: nothing overlaps."""
    dice, started, refused = random.Random(7), 0, 0
    while started < 150:
        try:
            config = validated(drawn_config(dice))
        except ConfigError:  # such as one ball without walls
            continue
        question = f"startOfRepeat({to_json(config)}, {dice.randrange(1000)})"
        answer = engine.answer(question)
        assert answer == engine.answer(question)
        refused += "error" in answer
        if "error" in answer:
            continue
        started += 1
        scene = starting_scene(configs.load(answer["config"]).config, 0)
        columns = scene.positions, scene.velocities, scene.radii, scene.masses, scene.container.size
        assert answer["bits"] == bits_of(*columns)
        assert answer["key"] == (None if scene.wall_key is None else str(scene.wall_key))
        for group in config.species:
            chosen = scene.radii == scene.radii[-1]
            speeds = np.hypot(*scene.velocities[chosen].T)
            if len(config.species) == 1 and config.common_rotation:
                assert math.sqrt(np.mean(speeds**2)) == pytest.approx(group.speed, rel=1e-9)
    assert 15 < refused < 300


ROUGH: dict[str, Any] = {
    "container": {"radius": 10.0},
    "balls": [
        {"position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 1.0, "spin": -7.0},
        {"count": 200, "radius": 0.2, "mass": 3.0, "speed": 3.0, "spin": {"temperature": 2.0}},
        {"count": 10, "radius": 0.3, "speed": 3.0, "spin": 5.0},
        {"count": 10, "radius": 0.3, "speed": 3.0},
    ],
    "cor": 1.0,
    "tangential_cor": 0.5,
    "time": 1.0,
}


def test_rough_balls_begin_with_their_spins(engine: JavaScript) -> None:
    """Given ones, and random ones with a temperature, of 200 balls within four standard errors."""
    answer = engine.answer(f"startOfRepeat({to_json(validated(ROUGH))}, 0)")
    scene = starting_scene(configs.load(answer["config"]).config, 0)
    columns = scene.positions, scene.velocities, scene.radii, scene.masses, scene.container.size
    assert answer["bits"] == bits_of(*columns, scene.spins)
    assert [*scene.spins[[0, -11, -1]]] == [-7.0, 5.0, 0.0]
    energies = 0.5 * 3.0 * 0.2**2 * scene.spins[1:201] ** 2
    assert np.mean(energies) == pytest.approx(2.0, abs=4 * 2.0 * math.sqrt(2 / 200))


def test_the_first_start_has_the_spins_of_the_program(engine: JavaScript) -> None:
    loaded = configs.load(ROUGH)
    data = live_page(loaded).partition('id="data">')[2].partition("</script>")[0]
    scene = starting_scene(loaded.config, 0)
    columns = scene.positions, scene.velocities, scene.radii, scene.masses, scene.container.size
    answer = engine.answer(f"{OWN}({data}, {{}})")
    assert answer["bits"] == bits_of(*columns, scene.spins)
    assert answer["given"]


def test_a_dense_gas_fits(engine: JavaScript) -> None:
    """Random places, up to a packing of .7."""
    gas = {"count": 150, "radius": 1.0, "speed": 1.0, "start": "random"}
    config = {"container": {"shape": "box", "packing": 0.7}, "balls": gas, "cor": 1.0, "time": 1.0}
    answer = engine.answer(f"startOfRepeat({to_json(validated(config))}, 0)")
    assert starting_scene(configs.load(answer["config"]).config, 0).number == 150


START = {
    "container": {"radius": 10.0},
    "balls": [
        {"count": 30, "radius": 0.5, "speed": 3.0, "speeds": "maxwell", "start": "random"},
        {"count": 10, "radius": 0.9, "speed": 3.0},
    ],
    "cor": 1.0,
    "time": 1.0,
}


def test_a_start_is_the_same_in_every_browser(engine: JavaScript) -> None:
    """Its bits, as V8 has them; ``make_browser_check.py`` compares those of other browsers."""
    answer = engine.answer(f"startOfRepeat({to_json(validated(START))}, 0)")
    assert hashlib.sha256(answer["bits"].encode()).hexdigest()[:16] == "33dc9af39170a98d"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"balls": {"rings": 3, "radius": 2.0, "speed": 1.0}}, "radius can be at most 1.333 m"),
        ({"balls": {"count": 5, "radius": 1.0, "speed": 1e-160}}, "nearer to 1"),
        (
            {"balls": {"list": [{"position": [0, 0], "velocity": [0, 0], "radius": 10.0}]}},
            "cannot move",
        ),
        (
            {
                "container": {"shape": "periodic", "width": 9.0},
                "balls": {"count": 4, "radius": 1.0, "speed": 1.0},
            },
            "under 5 diameters",
        ),
        ({"balls": {"count": 2001, "radius": 0.1, "speed": 1.0}}, "at most 2,000 balls, not 2,001"),
    ],
)
def test_what_does_not_fit_is_refused(engine: JavaScript, changes: Any, sentence: str) -> None:
    config = {"container": {"radius": 10.0}, "cor": 1.0, "collisions": 10} | changes
    answer = engine.answer(f"startOfRepeat({to_json(validated(config))}, 0)")
    assert sentence in answer["error"]


def test_a_slider_that_leaves_one_ball_is_refused_as_a_config_is(engine: JavaScript) -> None:
    balls = {"rings": 2, "radius": 0.1, "speed": 1.0, "common_rotation": False}
    config = {"container": {"radius": 10.0}, "balls": balls, "cor": 1.0, "collisions": 10}
    moved = to_json(validated(config)).replace('"rings": 2', '"rings": 0')
    with pytest.raises(ConfigError) as refused:
        validated(config | {"balls": balls | {"rings": 0}})
    (problem,) = refused.value.problems
    answer = engine.answer(f"startOfRepeat({moved}, 0)")
    fact, _ = problem.sentence.split(";")
    assert answer["error"] == f"{fact}, which this scene starts without: take more balls"


OWN = """((data, changes) => {
  const config = { ...data.defaults, ...data.scenes[0].config };
  const own = ownStart(data.start, config);
  const changed = { ...config, ...changes };
  return startOfScene(startingScene(changed, 0, own), changed);
})"""


@pytest.mark.parametrize("common_random", [False, True])
def test_the_first_start_is_that_of_the_program(engine: JavaScript, common_random: bool) -> None:
    """Also with another law; then the config has the start, unless it is common to all points."""
    config = {
        "container": {"shape": "box", "packing": 0.3},
        "balls": {"count": 60, "radius": 1 / 3, "speed": 10.0, "start": "random"},
        "cor": 0.9,
        "wall_temperature": 50.0,
        "time": 1.0,
        "common_random": common_random,
    }
    loaded = configs.load(config)
    page = live_page(loaded)
    data = page.partition('id="data">')[2].partition("</script>")[0]
    scene = starting_scene(loaded.config, 0)
    columns = scene.positions, scene.velocities, scene.radii, scene.masses, scene.container.size
    for changes, same in (({}, True), ({"cor": 0.5}, common_random)):
        answer = engine.answer(f"{OWN}({data}, {json.dumps(changes)})")
        assert answer["bits"] == bits_of(*columns)
        assert answer["given"] is same
        if same:
            assert answer["key"] == str(scene.wall_key)
        else:
            other = starting_scene(configs.load(answer["config"]).config, 0)
            assert bits_of(other.positions, other.velocities) == bits_of(*columns[:2])
            assert answer["key"] == str(other.wall_key)
    answer = engine.answer(f"{OWN}({data}, {{ seed: 2 }})")
    assert answer["bits"] != bits_of(*columns)


def test_a_wall_that_becomes_warm_has_a_key_in_the_config(engine: JavaScript) -> None:
    """Also with common_random, although the program's start has no key; and the other way round."""
    gas = {"count": 20, "radius": 0.5, "speed": 10.0}
    passive = {"container": {"radius": 10.0}, "balls": gas, "cor": 0.9, "time": 1.0}
    passive["common_random"] = True
    warm = passive | {"wall_temperature": 50.0, "wall_key": 5}
    for config, changes in (
        (passive, {"wall_temperature": 50.0}),
        (warm, {"wall_temperature": None}),
    ):
        page = live_page(configs.load(config))
        data = page.partition('id="data">')[2].partition("</script>")[0]
        answer = engine.answer(f"{OWN}({data}, {json.dumps(changes)})")
        scene = starting_scene(configs.load(answer["config"]).config, 0)
        assert answer["key"] == (None if scene.wall_key is None else str(scene.wall_key))
        assert (answer["key"] is None) == (changes["wall_temperature"] is None)


@pytest.mark.parametrize("size", [0, 5, 8])
def test_hash_of_events(engine: JavaScript, size: int) -> None:
    """SHA-256 of 24 bytes of each event of smooth balls, and of 32 of rough ones."""
    rows = np.zeros(size, dtype="<f8,<i4,<i4,<f8")
    rows["f0"], rows["f1"], rows["f2"], rows["f3"] = np.arange(size) / 3, 5, -1, 1e300
    rough = np.zeros(size, dtype="<f8,<i4,<i4,<f8,<f8")
    for name in rows.dtype.names:
        rough[name] = rows[name]
    rough["f4"] = -0.5
    answer = engine.answer(f"""(() => {{
      const scenes = [{{ positions: [] }}, {{ positions: [], surface: {{}} }}];
      const hashes = scenes.map((scene) => new EventHash(wordsOf(scene)));
      for (let k = 0; k < {size}; k += 1) {{
        const words = new Int32Array(EVENT_WORDS), numbers = new Float64Array(words.buffer);
        numbers.set([k / 3, 0, 1e300, -0.5]);
        words.set([5, -1], 2);
        hashes.forEach((hash) => hash.add(words, 0));
      }}
      return JSON.stringify(hashes.map((hash) => hash.digest()));
    }})()""")
    assert answer == [hashlib.sha256(kept.tobytes()).hexdigest() for kept in (rows, rough)]
