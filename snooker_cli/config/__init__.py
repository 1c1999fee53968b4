"""Configurations: YAML -> a frozen, valid Config -> the points of its sweep and their digests.

Everything that a user can get wrong is raised as ConfigError, all problems at once.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from snooker_cli.config.axes import overridden, unzipped
from snooker_cli.config.messages import config_error
from snooker_cli.config.models import BallCount, BallList, Config, Rings, Start
from snooker_cli.config.points import (
    LIMITS,
    Point,
    PointConfig,
    digest,
    extends,
    points,
    to_json,
    unit_of,
    validated,
    with_values,
)
from snooker_cli.config.problems import (
    NOWHERE,
    ConfigError,
    KeyPath,
    Problem,
    excerpt,
    in_words,
    key_path,
)
from snooker_cli.config.yaml_document import Mark, YamlDocument, document, text_of
from snooker_cli.errors import SceneError
from snooker_cli.formatting import plain

__all__ = ["LIMITS", "BallCount", "BallList", "Rings"]
__all__ += ["Config", "ConfigError", "Loaded", "Point", "PointConfig", "Start", "StateReader"]
__all__ += ["digest", "extends", "load", "parse", "points", "to_json", "unit_of", "validated"]
__all__ += ["with_values"]

StateReader = Callable[[Start], Mapping[str, Any]]
"""A state that a config starts from -> its ``balls``, ``container`` and ``start``, as a config has
them. Raises ``SceneError`` with the key that is wrong."""


@dataclass(frozen=True)
class Loaded:
    """A valid experiment and the document from which it was read."""

    config: Config
    document: YamlDocument

    def points(self) -> tuple[Point, ...]:
        """The points of the experiment."""
        return points(self.config)

    def error(self, key: str, sentence: str) -> ConfigError:
        """The error about a key such as ``balls.radius``, for a fault found after loading.

        The position of a swept key is that in the sweep.
        """
        swept = any(key in dict(axis) for axis in self.config.sweep)
        place = ("sweep", key) if swept else key_path(key)
        position = self.document.position(place)
        return ConfigError([Problem(key_path(key), sentence, position=position)])


def load(
    config: str | PathLike[str] | Mapping[str, Any],
    overrides: Iterable[str] = (),
    states: StateReader | None = None,
) -> Loaded:
    """The experiment in a YAML file or a mapping, after KEY=VALUE overrides. Raises ConfigError.

    states : reads the state to start from
    """
    if isinstance(config, Mapping):
        source = YamlDocument(plain(config), {(): Mark(NOWHERE, NOWHERE)})
        return _loaded(source, overrides, states)
    name = excerpt(str(config), 200)
    return parse(text_of(Path(config), name), name, overrides, states)


def parse(
    text: str,
    name: str = "config",
    overrides: Iterable[str] = (),
    states: StateReader | None = None,
) -> Loaded:
    """The experiment written in `text`, which messages call `name`. Raises ConfigError.

    An override replaces what the file or an earlier override of an outer key gives.
    """
    source = document(text, name)
    if not isinstance(source.data, dict):
        needs = "keys and values are needed; start with a line such as cor: 0.8"
        sentence = f"{in_words(source.data)} is given where {needs}"
        raise ConfigError([Problem((), sentence, position=source.marks[()].value)])
    return _loaded(source, overrides, states)


def _loaded(source: YamlDocument, overrides: Iterable[str], states: StateReader | None) -> Loaded:
    """The experiment of a document. Raises ConfigError."""
    zipped = {unzipped(path): mark for path, mark in source.marks.items()}
    source = replace(source, marks={**zipped, **source.marks})
    source = overridden(source, overrides)
    try:
        source = _with_state(source, states)
        return Loaded(validated(source.data), source)
    except ConfigError as error:
        raise ConfigError(
            replace(problem, position=source.position(problem.path, problem.about_key))
            for problem in error.problems
        ) from None


def _with_state(source: YamlDocument, states: StateReader | None) -> YamlDocument:
    """The document with balls and container of the state that it starts from, if it has one.

    Keys of the container that are given replace those of the state, or with a shape all of them. A
    state that snooker has written has its balls already. Raises ConfigError.
    """
    data, marks = source.data, source.marks
    given = data.get("start")
    if states is None or given is None or (isinstance(given, Mapping) and "content" in given):
        return source
    try:
        start = Start.model_validate(given)
    except ValidationError as error:
        raise config_error(error, ("start",)) from None
    if data.get("balls") is not None:
        sentence = "start gives the balls, their places and velocities; remove balls, or start"
        raise ConfigError([Problem(("balls",), sentence, about_key=True)])
    try:
        state = states(start)
    except SceneError as error:
        raise ConfigError([Problem(key_path(error.key), str(error))]) from None
    own = data.get("container")
    container = own if own is not None else state["container"]
    if isinstance(own, Mapping) and "shape" not in own:
        container = {**state["container"], **own}
    of_balls: dict[KeyPath, Mark] = {("balls",): marks.get(("start",), marks[()])}
    data = {**data, **state, "container": container}
    return replace(source, data=data, marks=of_balls | marks)
