"""Valid configurations: what is read, located, written back, digested and put in the schema."""

import hashlib
import json
import math
import pickle
import re
from pathlib import Path

import pytest
from config_texts import BASE, PAIR, experiment
from pydantic import ValidationError

from snooker_cli.config import (
    Ball,
    BallList,
    ContainerConfig,
    Experiment,
    Rings,
    digest,
    load,
    parse,
    schema,
    to_json,
)

# Reading


def test_rings_with_defaults() -> None:
    read = experiment(
        "container: {radius: 10}\nballs: {rings: 0, radius: 1, speed: 0}\ncor: 0\ntime: 1\n"
    )
    assert read == Experiment(
        title=None,
        container=ContainerConfig(radius=10.0, mass=math.inf),
        balls=Rings(rings=0, radius=1.0, mass=1.0, speed=0.0, ring_extent=0.8),
        cor=0.0,
        wall_cor=None,
        collisions=None,
        time=1.0,
        repeats=1,
        seed=1,
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


def test_wall_restitution_follows_the_balls_unless_given() -> None:
    assert experiment().effective_wall_cor == 0.8
    assert experiment(BASE + "wall_cor: null\n").effective_wall_cor == 0.8
    assert experiment(BASE + "wall_cor:\n").effective_wall_cor == 0.8
    assert experiment(BASE + "wall_cor: 0\n").effective_wall_cor == 0.0


@pytest.mark.parametrize(
    ("written", "mass"),
    [
        ("1e7", 1e7),
        ("1E+7", 1e7),
        (".5", 0.5),
        ("5.", 5.0),
        ("+3", 3.0),
        ("010", 10.0),
        ("0o10", 8.0),
        ("0x1F", 31.0),
        (".inf", math.inf),
        ("+.INF", math.inf),
        ("null", math.inf),
        ("~", math.inf),
    ],
)
def test_numbers_are_those_of_yaml_1_2(written: str, mass: float) -> None:
    text = f"container: {{radius: 10, mass: {written}}}\n"
    assert experiment(text + BASE.partition("\n")[2].partition("\n")[2]).container.mass == mass


@pytest.mark.parametrize("word", ["no", "yes", "on", "off", "y", "1:30", "1_000", "2020-01-01"])
def test_words_that_yaml_1_1_changes_stay_text(word: str) -> None:
    assert experiment(BASE + f"title: {word}\n").title == word


@pytest.mark.parametrize("count", ["1000", "1e3", "1000.0", "0x3e8"])
def test_whole_numbers_may_be_written_as_floats(count: str) -> None:
    collisions = experiment(BASE.replace("500", count)).collisions
    assert collisions == 1000
    assert type(collisions) is int


def test_byte_order_mark_windows_line_ends_and_markers_are_harmless(tmp_path: Path) -> None:
    path = tmp_path / "run.yaml"
    path.write_bytes(b"\xef\xbb\xbf---\r\n" + BASE.replace("\n", "\r\n").encode() + b"...\r\n")
    assert load(path).experiment == experiment()


def test_json_is_read_too() -> None:
    text = """{
        "container":{"radius":10.0,"mass":1.0e7},
        "balls": {"rings": 3, "radius": 1, "speed": 10},
        "cor": 0.8, "collisions": 500, "wall_cor": null
    }"""
    assert experiment(text) == experiment()


def test_load_reads_what_parse_reads(tmp_path: Path) -> None:
    path = tmp_path / "run.yaml"
    path.write_text(BASE, encoding="utf-8")
    assert load(path, ["seed=3"]).experiment == experiment(BASE, "seed=3")
    assert load(str(path)).name == str(path)


def test_models_are_frozen_and_hashable() -> None:
    read = experiment(BASE + "sweep: {cor: [0.8, 0.9]}\n")
    with pytest.raises(ValidationError, match="frozen"):
        read.cor = 0.5
    assert hash(read) == hash(pickle.loads(pickle.dumps(read)))


# Positions


def test_locate_gives_the_place_of_a_value() -> None:
    loaded = parse(BASE + "sweep:\n  balls.radius: [0.1, 1.0]\n", "run.yaml", ["cor=0.5"])
    assert str(loaded.locate("container.radius")) == "run.yaml:2:21"
    assert str(loaded.locate("balls.radius")) == "run.yaml:7:17"
    assert str(loaded.locate("sweep.balls.radius[1]")) == "run.yaml:7:23"
    assert str(loaded.locate("cor")) == "-o cor=0.5"
    assert str(loaded.locate("wall_cor")) == "run.yaml:2:1"
    plain = parse(BASE + "sweep: {cor: [0.1, 0.2]}\n", "run.yaml", ["cor=0.5"])
    assert str(plain.locate("cor")) == "-o cor=0.5"


def test_locate_finds_balls_of_a_list() -> None:
    loaded = parse(PAIR, "run.yaml")
    assert str(loaded.locate("balls.list[1]")) == "run.yaml:5:7"
    assert str(loaded.locate("balls.list[1].position[1]")) == "run.yaml:5:23"
    assert str(loaded.locate("balls.list[0].mass")) == "run.yaml:4:7"
    assert str(loaded.locate("balls")) == "run.yaml:2:1"


# Writing back

SWEPT = """
title: "1e6"
sweep:
  container.mass: [1.0e7, .inf]
  wall_cor: [null, 1]
  balls.rings: [1, 2.0]
"""


@pytest.mark.parametrize(
    "text",
    [
        BASE,
        PAIR,
        BASE + SWEPT,
        BASE + "title: 'no'\n",
        BASE + "title: 🎱 37 balls\n",
        BASE + "title: null and void, «α» #1: yes\n",
        PAIR + "sweep:\n  balls.list[0].position[1]: [0.1, 0.2]\n",
        PAIR + "sweep:\n  balls.list[1].velocity: [[0, 1], [1, 0]]\n",
        PAIR.replace("0.25", "0.1234567890123456789")
        .replace("2.5", "1e-300")
        .replace("-1,", "-1e22,"),
    ],
)
def test_round_trip(text: str) -> None:
    original = experiment(text)
    assert experiment(to_json(original)) == original


def test_written_json_is_strict() -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    written = json.loads(to_json(experiment(BASE + SWEPT)), parse_constant=refuse)
    assert written["sweep"]["container.mass"] == [1e7, None]


# Digests


@pytest.mark.parametrize(
    "text",
    [
        BASE.replace("1.0e7", "10000000.0"),
        BASE.replace("1.0e7", "10000000"),
        BASE.replace("cor: 0.8", "cor: 80e-2"),
        BASE.replace("500", "5e2"),
        BASE.replace("mass: 1.0, ", ""),
        BASE + "title: another\n",
        BASE + "repeats: 9\n",
        BASE + "wall_cor: null\n",
        BASE + "wall_cor: 0.8\n",
        BASE + "sweep: {cor: [0.1]}\n",
        "".join(sorted(BASE.splitlines(keepends=True))),
    ],
)
def test_digest_ignores_what_does_not_matter(text: str) -> None:
    assert digest(experiment(text)) == digest(experiment())


@pytest.mark.parametrize(
    "override",
    [
        "container.radius=10.000000000000002",
        "container.mass=.inf",
        "balls.rings=2",
        "balls.radius=0.9",
        "balls.mass=2",
        "balls.speed=9",
        "balls.ring_extent=0.7",
        "cor=0.9",
        "wall_cor=0.9",
        "collisions=501",
        "time=10",
        "seed=2",
        "record=summary",
    ],
)
def test_digest_tells_what_matters(override: str) -> None:
    assert digest(experiment(BASE, override)) != digest(experiment())


def test_digest_ignores_the_sign_of_zero() -> None:
    assert digest(experiment(PAIR.replace("[0, 0]", "[-0.0, 0]"))) == digest(experiment(PAIR))


def test_digest_stays_the_same_between_releases() -> None:
    """It is the SHA-256 of this JSON, typed by hand; a change orphans every stored result."""
    text = (
        '{"balls":{"mass":1.0,"radius":1.0,"ring_extent":0.8,"rings":3,"speed":10.0},'
        '"collisions":500,"container":{"mass":10000000.0,"radius":10.0},"cor":0.8,'
        '"record":"events","seed":1,"time":null,"wall_cor":0.8}'
    )
    assert digest(experiment()) == hashlib.sha256(text.encode()).hexdigest()


# The JSON schema


def test_schema_is_strict_json_and_describes_every_key() -> None:
    document = json.loads(json.dumps(schema(), allow_nan=False))
    assert document["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert list(document["properties"]) == list(Experiment.model_fields)
    homes = [document, *document["$defs"].values()]
    for home in homes:
        assert home["additionalProperties"] is False
        for entry in home["properties"].values():
            assert entry["description"]


def test_schema_knows_what_can_be_swept() -> None:
    swept = schema()["properties"]["sweep"]["properties"]
    keys = [
        "container.shape",
        "container.radius",
        "container.width",
        "container.height",
        "container.packing",
        "container.mass",
        "balls.rings",
        "balls.radius",
        "balls.mass",
        "balls.speed",
        "balls.ring_extent",
        "balls.count",
        "balls.speeds",
        "balls.start",
        "balls.packing",
        "cor",
        "wall_cor",
        "collapse.tc",
        "collapse.elastic_below",
        "collapse",
        "collisions",
        "time",
    ]
    assert list(swept) == [*keys, "zip"]
    group, groups = swept["zip"]["anyOf"]
    assert list(group["properties"]) == keys
    assert groups["items"] == group
    assert swept["cor"]["items"] == {"type": "number", "minimum": 0, "maximum": 1}
    assert {"type": "number", "exclusiveMinimum": 0} in swept["balls.radius"]["items"]["anyOf"]
    patterns = schema()["properties"]["sweep"]["patternProperties"]
    for key in ("balls[0].radius", "balls.list[1].position[0]"):
        assert sum(bool(re.match(pattern, key)) for pattern in patterns) == 1


def test_schema_knows_what_is_required() -> None:
    document = schema()
    assert document["required"] == ["container", "balls", "cor"]
    assert document["anyOf"] == [{"required": ["collisions"]}, {"required": ["time"]}]
    assert document["$defs"]["Rings"]["required"] == ["rings", "radius", "speed"]
    assert document["$defs"]["BallCount"]["required"] == ["count", "speed"]
    assert document["$defs"]["Species"]["required"] == ["count", "speed"]
    assert document["$defs"]["ContainerConfig"]["properties"]["mass"]["default"] is None
