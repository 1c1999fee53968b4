"""The models: defaults, immutability, rules about collapse, and the JSON schema made from them."""

import json
import math
import pickle
import re
from typing import Any

import pytest
from config_texts import BASE, PAIR, experiment
from make_schema import made_schema
from pydantic import ValidationError

from snooker_cli.config import BallList, ConfigError, Experiment, Rings, digest
from snooker_cli.config.models import Ball, ContainerConfig
from snooker_cli.containers import SHAPES
from snooker_cli.placement.starting_scene import starting_scene


def test_rings_with_defaults() -> None:
    text = "container: {radius: 10}\nballs: {rings: 0, radius: 1, speed: 0}\ncor: 0\ntime: 1\n"
    assert experiment(text) == Experiment(
        title=None,
        container=ContainerConfig(radius=10.0, mass=math.inf),
        balls=Rings(rings=0, radius=1.0, mass=1.0, speed=0.0, ring_extent=0.8),
        cor=0.0,
        wall_cor=None,
        collapse="stop",
        collisions=None,
        time=1.0,
        repeats=1,
        seed=1,
        common_random=False,
        record="events",
        sweep=(),
    )


def test_list_of_balls() -> None:
    assert experiment(PAIR).balls == BallList(
        list=(
            Ball(position=(-1.0, 0.0), velocity=(2.0, 0.5), radius=0.1, mass=1.0),
            Ball(position=(1.0, 0.25), velocity=(0.0, 0.0), radius=0.2, mass=3.0),
        )
    )


def test_models_are_frozen_and_hashable() -> None:
    assert [experiment(BASE + f"wall_cor: {e}\n").effective_wall_cor for e in ("", 0)] == [0.8, 0]
    read = experiment(BASE + "sweep: {cor: [0.8, 0.9]}\n")
    with pytest.raises(ValidationError, match="frozen"):
        read.cor = 0.5
    assert hash(read) == hash(pickle.loads(pickle.dumps(read)))


# Collapse

COLLAPSE = "container: {radius: 10}\nballs: {rings: 1, radius: 1, speed: 10}\ncor: 0.85\n"
CHOICES = {
    "stop": (0.0, 0.0, False),
    "slide": (0.0, 0.0, True),
    "{tc: 0.01}": (0.01, 0.0, False),
    "{elastic_below: 0.5}": (0.0, 0.5, False),
}


def collapsing(collapse: str, *overrides: str) -> Experiment:
    return experiment(f"{COLLAPSE}collisions: 150\ncollapse: {collapse}\n", *overrides)


@pytest.mark.parametrize(
    ("limit", "kept"), [("collisions: 999", True), ("collisions: 1000", False), ("time: 1", False)]
)
def test_the_events_of_few_collisions_are_stored(limit: str, kept: bool) -> None:
    """They take less space than a summary."""
    text = "container: {radius: 10}\nballs: {count: 9, radius: 1, speed: 1}\ncor: 1\n"
    assert experiment(f"{text}{limit}\nrecord: summary\n").keeps_events == kept
    assert experiment(f"{text}{limit}\n").keeps_events


def test_the_scene_has_the_collapse_of_the_config() -> None:
    for choice, expected in CHOICES.items():
        scene = starting_scene(collapsing(choice), 0)
        assert (scene.contact_duration, scene.elastic_below, scene.slides) == expected
    assert len({digest(collapsing(choice)) for choice in [*CHOICES, "{tc: 0.02}"]}) == 5


def test_stop_is_the_default_and_leaves_the_digest_as_it_was() -> None:
    """The digest of this config from before there was a choice."""
    known = "24ccedfa978d7d7284f163eef6f870b35b4f393fe5f81c22314e1340a51eefe7"
    assert digest(experiment(f"{COLLAPSE}collisions: 150\n")) == known
    assert digest(collapsing("stop")) == known


@pytest.mark.parametrize(
    ("collapse", "override"),
    [
        *((value, "cor=1") for value in ("go", "3", "null", "{}", "{tc: 1, elastic_below: 1}")),
        *((value, "cor=1") for value in ("{tc: 2}", "{elastic_below: 0}")),
        ("slide", "container.mass=5"),
        ("slide", "container={shape: box, width: 20}"),
        ("slide", "wall_cor=0.999999999999"),  # the engine would add up 1e13 bounces
    ],
)
def test_other_values_of_collapse_are_refused(collapse: str, override: str) -> None:
    balls = "balls={count: 1, radius: 1, speed: 1}"
    with pytest.raises(ConfigError) as error:
        collapsing(collapse, balls, override)
    (problem,) = error.value.problems
    assert str(problem).startswith("run.yaml:5:11: collapse: ")


# The JSON schema

LENGTHS = dict.fromkeys(key for shape in SHAPES.values() for key in shape.keys)
SWEPT = f"""
container.shape {" ".join(f"container.{key}" for key in LENGTHS)} container.packing container.mass
balls.rings balls.radius balls.mass balls.speed balls.ring_extent balls.count balls.speeds
balls.start balls.packing cor wall_cor collapse.tc collapse.elastic_below collapse collisions time
"""


def test_schema_is_strict_json_and_describes_every_key() -> None:
    document = json.loads(json.dumps(made_schema(), allow_nan=False))
    assert document["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert list(document["properties"]) == list(Experiment.model_fields)
    for home in (document, *document["$defs"].values()):
        assert home["additionalProperties"] is False
        for entry in home["properties"].values():
            assert entry["description"]
    assert document["required"] == ["container", "balls", "cor"]
    assert document["anyOf"] == [{"required": ["collisions"]}, {"required": ["time"]}]
    assert document["$defs"]["BallCount"]["required"] == ["count", "speed"]
    assert document["$defs"]["ContainerConfig"]["properties"]["mass"]["default"] is None


def test_schema_knows_what_can_be_swept() -> None:
    document = made_schema()
    sweep = document["properties"]["sweep"]
    assert list(sweep["properties"]) == [*SWEPT.split(), "zip"]
    for key, types in {"cor": "'maximum': 1", "balls.radius": "'minimum': 1e-50"}.items():
        entry: Any = document
        for part in sweep["properties"][key]["items"]["$ref"].split("/")[1:]:
            entry = entry[part]
        assert types in str(entry)
    for key in ("balls[0].radius", "balls.list[1].position[0]"):
        assert sum(bool(re.match(pattern, key)) for pattern in sweep["patternProperties"]) == 1
