"""Points, digests and the JSON of experiments, also of random ones."""

import hashlib
import json
import math
import pickle
from pathlib import Path

import pytest
from config_texts import BASE, PAIR, experiment

from snooker_cli.config import (
    EXAMPLES,
    BallList,
    ConfigError,
    Experiment,
    digest,
    extends,
    load,
    parse,
    points,
    to_json,
)
from snooker_cli.config.points import stream_seed

# Points


def test_without_a_sweep_there_is_one_point() -> None:
    (point,) = points(experiment())
    assert (point.index, point.parameters, point.experiment) == (0, (), experiment())


def test_point_is_the_experiment_with_the_values_written_in() -> None:
    grid = points(experiment(BASE + "sweep: {balls.rings: [1.0, 2]}\n"))
    for index, (rings, point) in enumerate(zip((1, 2), grid, strict=True)):
        assert point.index == index
        assert point.experiment == experiment(BASE.replace("rings: 3", f"rings: {rings}"))
        assert type(point.parameters[0][1]) is int


def test_sweep_over_a_coordinate_a_pair_and_an_absent_key() -> None:
    sweep = """
sweep:
  balls.list[0].position[1]: [0.1, 0.2]
  balls.list[1].velocity: [[0, 1]]
  wall_cor: [null]
"""
    first, second = points(experiment(PAIR + sweep))
    assert first.parameters == (
        ("balls.list[0].position[1]", 0.1),
        ("balls.list[1].velocity", (0.0, 1.0)),
        ("wall_cor", None),
    )
    assert isinstance(second.experiment.balls, BallList)
    assert [ball.position for ball in second.experiment.balls.list] == [(-1.0, 0.2), (1.0, 0.25)]
    assert [ball.velocity for ball in second.experiment.balls.list] == [(2.0, 0.5), (0.0, 1.0)]


def test_points_of_a_hand_made_experiment_are_checked() -> None:
    made = Experiment.model_validate(dict(experiment()) | {"sweep": {"cor": [0.8, 2.0]}})
    with pytest.raises(ConfigError, match=r"^sweep\.cor\[1\]: 2.0 is given "):
        points(made)


def test_points_are_made_once_and_can_be_sent_to_other_processes() -> None:
    loaded = parse(BASE + "sweep: {cor: [0.8, 1]}\n")
    assert points(loaded.experiment) is loaded.points()
    assert pickle.loads(pickle.dumps(loaded.points())) == loaded.points()


# JSON


def test_written_json_is_strict() -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    sweep = "sweep: {container.mass: [1.0e7, .inf], wall_cor: [null, 1], balls.rings: [1, 2.0]}\n"
    swept = experiment(BASE + sweep)
    written = json.loads(to_json(swept), parse_constant=refuse)
    assert written["sweep"]["container.mass"] == [1e7, None]
    assert [point.as_json()["container.mass"] for point in points(swept)] == 4 * [1e7] + 4 * [None]


# Digests


@pytest.mark.parametrize(
    "text",
    [
        BASE.replace("1.0e7", "10000000"),
        BASE.replace("cor: 0.8", "cor: 80e-2"),
        BASE.replace("500", "5e2"),
        BASE.replace("mass: 1.0, ", ""),
        BASE + "title: another\n",
        BASE + "repeats: 9\n",
        BASE + "common_random: false\n",
        BASE + "wall_cor: 0.8\n",
        BASE + "sweep: {cor: [0.1]}\n",
        "".join(sorted(BASE.splitlines(keepends=True))),
    ],
)
def test_digest_ignores_what_does_not_matter(text: str) -> None:
    assert digest(experiment(text)) == digest(experiment())
    assert digest(experiment(PAIR.replace("[0, 0]", "[-0.0, 0]"))) == digest(experiment(PAIR))


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
        "collapse={tc: 0.1}",
        "collisions=501",
        "time=10",
        "seed=2",
        "record=summary",
        "common_random=true",
    ],
)
def test_digest_depends_on_what_matters(override: str) -> None:
    assert digest(experiment(BASE, override)) != digest(experiment())


def test_digest_stays_the_same_between_releases() -> None:
    """It is the SHA-256 of this JSON, typed by hand; a change orphans every stored result."""
    text = (
        '{"balls":{"mass":1.0,"radius":1.0,"ring_extent":0.8,"rings":3,"speed":10.0},'
        '"collisions":500,"container":{"mass":10000000.0,"radius":10.0},"cor":0.8,'
        '"record":"events","seed":1,"time":null,"wall_cor":0.8}'
    )
    assert digest(experiment()) == hashlib.sha256(text.encode()).hexdigest()


def test_random_numbers_follow_from_the_seed_and_this_json() -> None:
    text = (
        '{"balls":{"mass":1.0,"radius":1.0,"ring_extent":0.8,"rings":3,"speed":10.0},'
        '"container":{"mass":10000000.0,"radius":10.0},"cor":0.8,"wall_cor":0.8}'
    )
    physics = int(hashlib.sha256(text.encode()).hexdigest(), 16)
    for override in ("title=other", "repeats=9", "collisions=9", "time=9", "record=summary"):
        assert stream_seed(experiment(BASE, override, "seed=5")) == (physics << 64) + 5
    assert stream_seed(experiment(BASE, "common_random=true", "seed=5")) == 5


def test_a_point_extends_another_of_the_same_physics_that_ends_no_later() -> None:
    both = experiment(BASE, "time=5")
    assert extends(experiment(BASE, "time=6"), both)
    assert extends(experiment(), both)  # without a time, the later end
    assert not extends(both, experiment())
    assert not extends(experiment(BASE, "collisions=501", "time=4"), both)
    assert not extends(experiment(BASE, "collisions=501", "cor=0.9"), experiment())


# Round trips


CONFIGS = sorted(EXAMPLES.glob("**/*.yaml"))


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_examples_can_be_written_and_read_back_and_have_distinct_points(path: Path) -> None:
    read = load(path).experiment
    copy = parse(to_json(read)).experiment
    assert digest(copy) == digest(read)
    grid = points(read)
    assert [point.experiment for point in points(copy)] == [point.experiment for point in grid]
    assert len(grid) == math.prod(len(axis[0][1]) for axis in read.sweep)
    assert len({point.experiment for point in grid}) == len(grid)
    for point in grid:
        assert points(point.experiment)[0].experiment == point.experiment


@pytest.mark.parametrize("title", ["no", "1e6", "null", "0o7", "~", "- x", "a: b", "'", 'µ "ü"'])
def test_a_title_that_yaml_reads_otherwise_is_written_and_read_back(title: str) -> None:
    named = experiment(BASE).model_copy(update={"title": title})
    assert parse(to_json(named)).experiment == named
