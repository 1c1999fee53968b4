"""The config room: YAML -> a frozen, validated Experiment; its sweep -> points; a digest.

Everything a user can get wrong is raised as ConfigError, all of it at once.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from snooker_cli.config.axes import Value, overridden, unzipped
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
    "Position",
    "Problem",
    "Rings",
    "Species",
    "Value",
    "digest",
    "document",
    "extends",
    "load",
    "overridden",
    "parse",
    "points",
    "rendered",
    "schema",
    "shown",
    "text_of",
    "to_json",
    "unzipped",
    "validated",
]


@dataclass(frozen=True)
class Loaded:
    """A valid experiment and where its keys were written."""

    experiment: Experiment
    name: str
    """The file's name, as shown in messages."""
    _positions: tuple[tuple[str, Position], ...]

    def locate(self, key: str) -> Position:
        """Where a key such as ``balls.radius`` gets its value; str() gives ``file:line:column``.

        A swept key stands where its sweep does, an absent one where the mapping around it starts.
        """
        positions = dict(self._positions)
        while key:
            for written in (f"sweep.{key}", key):
                if written in positions:
                    return positions[written]
            key = key.rpartition("[" if key.endswith("]") else ".")[0]
        return positions[""]

    def points(self) -> tuple[Point, ...]:
        """As the function `points`, with positions in its ConfigError."""
        try:
            return points(self.experiment)
        except ConfigError as error:
            raise ConfigError(
                Problem(self.locate(problem.key), problem.key, problem.sentence)
                for problem in error.problems
            ) from None

    def error(self, key: str, sentence: str) -> ConfigError:
        """The error that says `sentence` about a key, for faults found after loading."""
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
    positions = tuple((rendered(path), mark.value) for path, mark in source.marks.items())
    return Loaded(validated(source), name, positions)
