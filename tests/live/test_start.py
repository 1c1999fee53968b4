"""Starts in JavaScript have the program's bits, and what does not fit has the same sentence."""

from __future__ import annotations

import hashlib
import math
import random
from collections.abc import Iterator
from typing import Any

import pytest
from javascript import JavaScript, bits_of

from snooker_cli.config import to_json, validated
from snooker_cli.config.problems import ConfigError
from snooker_cli.errors import SceneError
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


def expected(experiment: Any, repeat: int) -> dict[str, Any]:
    """The bits of a start, or the sentence of its error."""
    try:
        scene = starting_scene(experiment, repeat)
    except SceneError as error:
        return {"error": str(error)}
    columns = scene.positions, scene.velocities, scene.radii, scene.masses, scene.container.size
    key = None if scene.wall_key is None else str(scene.wall_key)
    return {"bits": bits_of(*columns), "key": key}


def test_starts_have_the_same_bits(engine):
    dice, started, refused = random.Random(7), 0, 0
    while started < 150:
        try:
            experiment = validated(drawn_config(dice))
        except ConfigError:  # such as one ball without walls
            continue
        repeat = dice.randrange(1000)
        answer = engine.answer(f"startOfRepeat({to_json(experiment)}, {repeat})")
        assert answer == expected(experiment, repeat), to_json(experiment)
        started += "bits" in answer
        refused += "error" in answer
    assert refused > 15


CIRCLE = {"radius": 10.0}


@pytest.mark.parametrize(
    "changes",
    [
        {"balls": {"rings": 3, "radius": 2.0, "speed": 1.0}},
        {"balls": {"rings": 1, "radius": 6.0, "speed": 1.0}},
        {"balls": {"count": 100, "radius": 1.0, "speed": 1.0}},
        {"balls": {"count": 5, "radius": 1.0, "speed": 1e-160}},
        {"balls": {"list": [{"position": [9.5, 0], "velocity": [0, 0], "radius": 1.0}]}},
        {"balls": {"list": [{"position": [0, 0], "velocity": [0, 0], "radius": 10.0}]}},
        {
            "container": {"shape": "periodic", "width": 9.0},
            "balls": {"count": 4, "radius": 1.0, "speed": 1.0},
        },
        {
            "container": {"packing": 0.83},
            "balls": {"count": 50, "radius": 1.0, "speed": 1.0, "start": "random"},
        },
    ],
)
def test_what_does_not_fit_is_refused_with_the_same_sentence(engine, changes):
    experiment = validated({"container": CIRCLE, "cor": 1.0, "collisions": 10} | changes)
    answer = engine.answer(f"startOfRepeat({to_json(experiment)}, 0)")
    assert answer == expected(experiment, 0)
    assert "error" in answer


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"balls": {"count": 201, "radius": 0.1, "speed": 1.0}}, "at most 200 balls, not 201"),
        ({"seed": 2**60}, "seeds up to 9007199254740991"),
    ],
)
def test_what_only_the_program_can_do_is_refused(engine, changes, sentence):
    balls = {"count": 20, "radius": 0.1, "speed": 1.0}
    config = {"container": CIRCLE, "balls": balls, "cor": 1.0, "collisions": 10} | changes
    answer = engine.answer(f"startOfRepeat({to_json(validated(config))}, 0)")
    assert sentence in answer["error"]


def test_a_slider_that_leaves_one_ball_is_refused_as_in_a_config(engine):
    balls = {"rings": 2, "radius": 0.1, "speed": 1.0, "common_rotation": False}
    config = {"container": CIRCLE, "balls": balls, "cor": 1.0, "collisions": 10}
    moved = to_json(validated(config)).replace('"rings": 2', '"rings": 0')
    with pytest.raises(ConfigError) as refused:
        validated(config | {"balls": balls | {"rings": 0}})
    (problem,) = refused.value.problems
    assert engine.answer(f"startOfRepeat({moved}, 0)")["error"] == problem.sentence


@pytest.mark.parametrize("size", [0, 3, 55, 56, 63, 64, 65, 119, 120, 1000])
def test_sha_256(engine, size):
    text = "snooker ä→😀" * size
    text = text[:size]
    answer = engine.answer(f"JSON.stringify(hashOfText({text!r}))")
    assert answer == hashlib.sha256(text.encode()).hexdigest()


def test_sums_are_correctly_rounded(engine):
    dice = random.Random(3)
    for _ in range(100):
        values = [dice.gauss(0, 1) * 10 ** dice.uniform(-20, 20) for _ in range(50)]
        values += [-value * (1 + dice.choice([0, 2**-52])) for value in values[:40]]
        dice.shuffle(values)
        assert float(engine.answer(f"String(preciseSum({values}))")) == math.fsum(values)
