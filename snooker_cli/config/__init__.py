"""Configurations: YAML -> a frozen, valid Experiment -> the points of its sweep and their digests.

Everything that a user can get wrong is raised as ConfigError, all problems at once.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from snooker_cli.config.axes import overridden, unzipped
from snooker_cli.config.models import (
    Ball,
    BallCount,
    BallList,
    ContainerConfig,
    Experiment,
    Rings,
    Species,
    schema,
)
from snooker_cli.config.points import LIMITS, Point, digest, extends, points, to_json, validated
from snooker_cli.config.problems import ConfigError, Position, Problem, rendered, shown
from snooker_cli.config.yaml_document import document, text_of

__all__ = [
    "LIMITS",
    "Ball",
    "BallCount",
    "BallList",
    "ConfigError",
    "ContainerConfig",
    "Experiment",
    "Loaded",
    "Point",
    "Rings",
    "Species",
    "digest",
    "extends",
    "load",
    "parse",
    "points",
    "schema",
    "to_json",
]


@dataclass(frozen=True)
class Loaded:
    """A valid experiment and the positions of its keys."""

    experiment: Experiment
    name: str
    """The file's name, as shown in messages."""
    positions: Mapping[str, Position]
    """The position of each value, by its key as a user writes it."""

    def locate(self, key: str) -> Position:
        """The position of the value of a key such as ``balls.radius``.

        For a swept key it is that in the sweep, for an absent one that of the mapping around it.
        """
        while key:
            for written in (f"sweep.{key}", key):
                if written in self.positions:
                    return self.positions[written]
            key = key.rpartition("[" if key.endswith("]") else ".")[0]
        return self.positions[""]

    def points(self) -> tuple[Point, ...]:
        """As the function `points`, with positions in its ConfigError."""
        try:
            return points(self.experiment)
        except ConfigError as error:
            raise ConfigError(
                replace(each, position=self.locate(each.key)) for each in error.problems
            ) from None

    def error(self, key: str, sentence: str) -> ConfigError:
        """The error about a key, for a fault found after loading."""
        return ConfigError([Problem(self.locate(key), key, sentence)])


def load(path: str | PathLike[str], overrides: Iterable[str] = ()) -> Loaded:
    """The experiment in a YAML file, after KEY=VALUE overrides. Raises ConfigError."""
    name = shown(str(path), 200)
    return parse(text_of(Path(path), name), name, overrides)


def parse(text: str, name: str = "config", overrides: Iterable[str] = ()) -> Loaded:
    """The experiment written in `text`, which messages call `name`. Raises ConfigError."""
    source = document(text, name)
    for override in overrides:
        source = overridden(source, override)
    zipped = {unzipped(path): mark for path, mark in source.marks.items()}
    source = replace(source, marks={**zipped, **source.marks})
    positions = {rendered(path): mark.value for path, mark in source.marks.items()}
    return Loaded(validated(source), name, positions)
