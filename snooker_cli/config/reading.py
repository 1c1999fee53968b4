"""A YAML text or a mapping, with overrides -> a valid config, and where its keys are written."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from snooker_cli.config.axes import ZIP, groups_of, is_inside, range_values, unzipped
from snooker_cli.config.messages import config_error
from snooker_cli.config.models import Config, Start
from snooker_cli.config.points import Point, points, validated
from snooker_cli.config.problems import (
    NOWHERE,
    ConfigError,
    Data,
    KeyPath,
    PathError,
    Position,
    Problem,
    excerpt,
    in_words,
    key_path,
    rendered,
    substituted,
)
from snooker_cli.config.yaml_document import Mark, YamlDocument, document, text_of
from snooker_cli.errors import SceneError
from snooker_cli.formatting import plain

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


# Overrides: KEY=VALUE, or KEY=several values for a sweep over that key.


def overridden(source: YamlDocument, overrides: Iterable[str]) -> YamlDocument:
    """The document with KEY=VALUE texts applied in order. Raises ConfigError.

    A single value replaces the value and removes every sweep of that key or of keys inside it.
    Several values replace the sweep of that key at its place.
    """
    earlier: dict[str, str] = {}
    for override in overrides:
        label = Position(source=f"-o {excerpt(override)}")
        key, _, text = override.partition("=")
        key = key.strip()
        try:
            path = key_path(key)
            if key in earlier:
                raise PathError(
                    f"the key is given twice, here and in -o {earlier[key]}; keep one of them, or "
                    f"write -o {key}=VALUE,VALUE to sweep it"
                )
            if path[0] == "sweep" and len(path) > 1:
                raise PathError("sweep is set as a whole, or by its keys: -o KEY=VALUE,VALUE")
            values = option_values(text, label.source)
            if not values:
                advice = "add a value, or null to mean none"
                raise PathError(f"an override is written KEY=VALUE; {advice}")
            source = _replaced(source, path, values, Mark(label, label))
        except PathError as error:
            raise ConfigError([Problem((key,), str(error), position=label)]) from None
        earlier[key] = excerpt(override)
    return source


def option_values(text: str, name: str) -> list[Data]:
    """The values that an option such as -o lists, or those of its range; `name` is the option.

    Raises ConfigError and PathError.
    """
    try:
        # The line break ends a comment, which would hide the bracket.
        return range_values(text) or document(f"[{text}\n]", name).data
    except ConfigError as error:
        here = Position(source=name)
        raise ConfigError(replace(problem, position=here) for problem in error.problems) from None


def _replaced(source: YamlDocument, path: KeyPath, values: list[Data], mark: Mark) -> YamlDocument:
    """The document with the values of an override at a path. Raises PathError."""
    key, swept = rendered(path), len(values) > 1
    target: KeyPath = ("sweep", key) if swept else path
    data = source.data if swept else substituted(source.data, path, values[0])
    groups: list[Any] = []
    for group in groups_of(data.get("sweep")):
        if isinstance(group, Mapping):
            group = {
                other: values if other == key else old
                for other, old in group.items()
                if swept or not (other == key or is_inside(other, key))
            }
        groups.append(group)
    if swept and not any(key in group for group in groups):
        groups.append({key: values})
    marks = {place: old for place, old in source.marks.items() if place[: len(target)] != target}
    above = {target[:end]: mark for end in range(1, len(target))}
    return YamlDocument({**data, "sweep": {ZIP: groups}}, {**above, **marks, target: mark})
