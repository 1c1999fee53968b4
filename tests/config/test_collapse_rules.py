"""The config key ``collapse``: what it accepts, its digests, and the scene that follows."""

import pytest

from snooker_cli.config import ConfigError, Experiment, digest, parse, to_json
from snooker_cli.placement.starting_scene import starting_scene

BASE = """\
container: {radius: 10.0}
balls: {rings: 1, radius: 1.0, speed: 10.0}
cor: 0.85
collisions: 150
"""
CHOICES = ["stop", "slide", "{tc: 0.01}", "{tc: 0.02}", "{elastic_below: 1.0e-06}"]


def written(collapse: str, container: str = "{radius: 10.0}") -> Experiment:
    text = BASE.replace("{radius: 10.0}", container)
    return parse(f"{text}collapse: {collapse}\n").experiment


def test_stop_is_the_default_and_leaves_the_digest_as_it_was() -> None:
    """The digest of this config from before there was a choice."""
    known = "24ccedfa978d7d7284f163eef6f870b35b4f393fe5f81c22314e1340a51eefe7"
    assert digest(parse(BASE).experiment) == digest(written("stop")) == known


def test_every_choice_has_a_digest_of_its_own() -> None:
    assert len({digest(written(choice)) for choice in CHOICES}) == len(CHOICES)


@pytest.mark.parametrize("choice", CHOICES)
def test_a_config_comes_back(choice: str) -> None:
    experiment = written(choice)
    assert parse(to_json(experiment)).experiment == experiment


@pytest.mark.parametrize(
    ("choice", "expected"),
    [
        ("stop", (0.0, 0.0, False)),
        ("slide", (0.0, 0.0, True)),
        ("{tc: 0.01}", (0.01, 0.0, False)),
        ("{elastic_below: 0.5}", (0.0, 0.5, False)),
    ],
)
def test_the_scene_has_what_the_config_asks_for(choice: str, expected: tuple[float, ...]) -> None:
    scene = starting_scene(written(choice), 0)
    assert (scene.contact_duration, scene.elastic_below, scene.slides) == expected


@pytest.mark.parametrize(
    ("collapse", "key"),
    [
        *((value, "collapse") for value in ("go", "3", "null", "{}", "{tc: 1, elastic_below: 1}")),
        ("{tc: 2}", "collapse.tc"),
        ("{elastic_below: 0}", "collapse.elastic_below"),
    ],
)
def test_other_values_are_refused(collapse: str, key: str) -> None:
    with pytest.raises(ConfigError) as error:
        written(collapse)
    (problem,) = error.value.problems
    assert str(problem).startswith("config:5:")
    assert f" {key}: " in str(problem)


@pytest.mark.parametrize(
    "container",
    ["{radius: 10.0, mass: 5}", "{shape: box, width: 20}", "{shape: periodic, width: 20}"],
)
def test_balls_slide_along_a_fixed_circle_only(container: str) -> None:
    with pytest.raises(ConfigError) as error:
        written("slide", container)
    assert " collapse: " in str(error.value)
