"""Points, digests and the JSON of experiments, and what follows from the collapse of a config."""

import hashlib
import math
import pickle
from pathlib import Path

import pytest
from config_texts import BASE, PAIR, config

from snooker_cli.config import (
    BallList,
    Config,
    ConfigError,
    digest,
    extends,
    load,
    parse,
    points,
    to_json,
    unit_of,
)
from snooker_cli.config.points import stream_seed
from snooker_cli.config.template_configs import EXAMPLES
from snooker_cli.placement.starting_scene import starting_scene


def test_point_is_the_experiment_with_the_values_written_in() -> None:
    grid = points(config(BASE + "sweep: {balls.rings: [1.0, 2]}\n"))
    for rings, point in zip((1, 2), grid, strict=True):
        assert point.config == config(BASE.replace("rings: 3", f"rings: {rings}"))
        assert type(point.parameters[0][1]) is int


def test_sweep_over_a_coordinate_a_pair_and_an_absent_key() -> None:
    sweep = """
sweep:
  balls.list[0].position[1]: [0.1, 0.2]
  balls.list[1].velocity: [[0, 1]]
  wall_cor: [null]
"""
    first, second = points(config(PAIR + sweep))
    assert first.parameters == (
        ("balls.list[0].position[1]", 0.1),
        ("balls.list[1].velocity", (0.0, 1.0)),
        ("wall_cor", None),
    )
    assert isinstance(second.config.balls, BallList)
    assert [ball.position for ball in second.config.balls.list] == [(-1.0, 0.2), (1.0, 0.25)]
    assert [ball.velocity for ball in second.config.balls.list] == [(2.0, 0.5), (0.0, 1.0)]


def test_points_of_a_hand_made_experiment_are_checked() -> None:
    made = Config.model_validate(dict(config()) | {"sweep": {"cor": [0.8, 2.0]}})
    with pytest.raises(ConfigError, match=r"^sweep\.cor\[1\]: 2.0 is given "):
        points(made)


CHANGES = """
container.radius=10.000000000000002 container.mass=.inf balls.rings=2 balls.radius=0.9 balls.mass=2
balls.speed=9 balls.ring_extent=0.7 cor=0.9 wall_cor=0.9 collapse={"tc":0.1} collisions=501 time=10
seed=2 record=summary common_random=true cor_speed=1 wall_cor_speed=1 balls.common_rotation=false
container.velocity=[1,0]
"""


def test_a_digest_depends_on_what_matters_and_on_nothing_else() -> None:
    for text in (
        BASE.replace("1.0e7", "10000000"),
        BASE.replace("500", "5e2"),
        BASE.replace("mass: 1.0, ", "common_rotation: true, "),
        BASE + "title: another\nrepeats: 9\ncommon_random: false\nwall_cor: 0.8\n",
        BASE + "sweep: {cor: [0.1]}\n",
        "".join(sorted(BASE.splitlines(keepends=True))),
    ):
        assert digest(config(text)) == digest(config())
    assert digest(config(PAIR.replace("[0, 0]", "[-0.0, 0]"))) == digest(config(PAIR))
    changes = CHANGES.split()
    digests = {digest(config(BASE, change)) for change in ("title=a", *changes)}
    assert len(digests) == 1 + len(changes)
    fixed = BASE.replace("1.0e7", ".inf")
    walls = [("wall_speed=1",), ("wall_speed=2",), ("wall_temperature=1",), ()]
    assert len({digest(config(fixed, *change)) for change in walls}) == len(walls)
    times = ["[1, 2]", "[1, 3]", "{per_decade: 5}"]
    stored = [config(BASE, "record=snapshots", f"snapshots={at}") for at in times]
    assert len({digest(one) for one in (*stored, config(BASE, "record=snapshots"))}) == 4
    assert len({stream_seed(one) for one in (*stored, config())}) == 1
    rough = ["friction=1", "wall_tangential_cor=1", "wall_friction=1", "inertia=1", "balls.spin=1"]
    surfaces = [("tangential_cor=0",), *(("tangential_cor=0", change) for change in rough)]
    assert len({digest(config(BASE, *change)) for change in ((), *surfaces)}) == 7


def test_digests_and_random_numbers_stay_the_same_between_releases() -> None:
    """Both follow from this JSON, typed by hand; a change orphans every stored result."""
    text = (
        '{"balls":{"mass":1.0,"radius":1.0,"ring_extent":0.8,"rings":3,"speed":10.0},'
        '"collisions":500,"container":{"mass":10000000.0,"radius":10.0},"cor":0.8,'
        '"record":"events","seed":1,"time":null,"wall_cor":0.8}'
    )
    assert digest(config()) == hashlib.sha256(text.encode()).hexdigest()
    text = text.replace('"collisions":500,', "").replace('"time":null,', "")
    text = text.replace('"record":"events","seed":1,', "")
    physics = int(hashlib.sha256(text.encode()).hexdigest(), 16)
    for override in ("title=other", "repeats=9", "collisions=9", "time=9", "record=summary"):
        assert stream_seed(config(BASE, override, "seed=5")) == (physics << 64) + 5
    assert stream_seed(config(BASE, "common_random=true", "seed=5")) == 5


def test_a_point_extends_another_of_the_same_physics_that_ends_no_later() -> None:
    both = config(BASE, "time=5")
    assert extends(config(BASE, "time=6"), both)
    assert extends(config(), both)  # without a time, the later end
    assert not extends(both, config())
    assert not extends(config(BASE, "collisions=501", "time=4"), both)
    assert not extends(config(BASE, "collisions=501", "cor=0.9"), config())


CONFIGS = sorted(EXAMPLES.glob("**/*.yaml"))


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_examples_can_be_written_and_read_back_and_have_distinct_points(path: Path) -> None:
    read = load(path).config
    copy = parse(to_json(read)).config
    assert digest(copy) == digest(read)
    grid = points(read)
    assert points(copy) == pickle.loads(pickle.dumps(grid)) == grid
    assert len(grid) == math.prod(len(axis[0][1]) for axis in read.sweep)
    assert len({point.config for point in grid}) == len(grid)
    for point in grid:
        assert points(point.config)[0].config == point.config


def test_a_title_that_yaml_reads_otherwise_is_written_and_read_back() -> None:
    for title in ("no", "1e6", "null", "~", "- x", "a: b", "'", 'µ "ü"'):
        named = config(BASE).model_copy(update={"title": title})
        assert parse(to_json(named)).config == named


COLLAPSE = "container: {radius: 10}\nballs: {rings: 1, radius: 1, speed: 10}\ncor: 0.85\n"
CHOICES = {
    "stop": (0.0, 0.0, False),
    "slide": (0.0, 0.0, True),
    "{tc: 0.01}": (0.01, 0.0, False),
    "{elastic_below: 0.5}": (0.0, 0.5, False),
}


def collapsing(collapse: str, *overrides: str) -> Config:
    return config(f"{COLLAPSE}collisions: 150\ncollapse: {collapse}\n", *overrides)


def test_the_scene_has_the_collapse_of_the_config() -> None:
    """The digest of the default is that from before there was a choice."""
    for choice, expected in CHOICES.items():
        scene = starting_scene(collapsing(choice), 0)
        assert (scene.contact_duration, scene.elastic_below, scene.slides) == expected
    assert len({digest(collapsing(choice)) for choice in [*CHOICES, "{tc: 0.02}"]}) == 5
    known = "24ccedfa978d7d7284f163eef6f870b35b4f393fe5f81c22314e1340a51eefe7"
    assert digest(config(f"{COLLAPSE}collisions: 150\n")) == known
    assert digest(collapsing("stop")) == known


def test_other_values_of_collapse_are_refused() -> None:
    balls = "balls={count: 1, radius: 1, speed: 1}"
    for collapse, override in (
        *((value, "cor=1") for value in ("go", "{}", "{tc: 1, elastic_below: 1}", "{tc: 2}")),
        ("slide", "container.mass=5"),
        ("slide", "container={shape: box, width: 20}"),
        ("slide", "wall_cor=0.999999999999"),  # the engine would add up 1e13 bounces
    ):
        with pytest.raises(ConfigError) as error:
            collapsing(collapse, balls, override)
        (problem,) = error.value.problems
        assert str(problem).startswith("run.yaml:5:11: collapse: ")


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("balls.radius", "m"),
        ("balls.mass", "kg"),
        ("balls.speed", "m/s"),
        ("balls.spin", "rad/s"),
        ("balls.rings", ""),
        ("balls.ring_extent", ""),
        ("container.radius", "m"),
        ("container.packing", ""),
        ("cor", ""),
        ("cor_speed", "m/s"),
        ("wall_cor_speed", "m/s"),
        ("wall_speed", "m/s"),
        ("wall_temperature.left", "J"),
        ("friction", ""),
        ("inertia", ""),
        ("collapse.tc", ""),
        ("collapse.elastic_below", "m/s"),
        ("collisions", ""),
        ("time", "s"),
    ],
)
def test_a_key_has_the_unit_of_its_description(key: str, unit: str) -> None:
    how = {"collapse": "collapse={tc: 0.1}", "wall_temperature": "wall_temperature={left: 3}"}
    box = ["container={shape: box, width: 20}", "balls={count: 9, radius: 1, speed: 1}"]
    first = key.partition(".")[0]
    overrides = box if first == "wall_temperature" else []
    overrides = [*overrides, *([how[first]] if first in how else [])]
    assert unit_of(config(BASE, *overrides), key) == unit
