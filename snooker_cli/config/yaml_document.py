"""YAML text -> plain data, with the position of every key and value.

Read are mappings, lists and the scalars of the YAML 1.2 core schema. Duplicate keys, anchors,
aliases, merge keys and tags are refused.
"""

import difflib
import math
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from snooker_cli.config.problems import ConfigError, Data, KeyPath, Position, Problem, excerpt

MAX_BYTES = 1 << 19  # of a configuration: reading it takes at most some seconds
LARGE = 1 << 15  # characters of a text that takes PyYAML over a second
MAX_DEPTH = 20  # levels of nested lists and mappings; a configuration needs 5

# https://yaml.org/spec/1.2.2/#103-core-schema, table 10.3
_CORE_SCHEMA = {
    "null": r"(~|null|Null|NULL)?",
    "bool": r"true|True|TRUE|false|False|FALSE",
    "int": r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+",
    "float": r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?",
    "special": r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
}

_RESOLVERS = [(tag, re.compile(rf"(?:{text})\Z")) for tag, text in _CORE_SCHEMA.items()]

_SYNTAX = (
    ("'\\t'", "a tab is where YAML allows only spaces; replace it by spaces"),
    ("mapping values", "a second colon or a wrong indentation; give every key its own line"),
    ("could not find expected ':'", "a key without a colon and a space; write key: value"),
    ("stream", "a bracket, brace or quote is never closed; close it"),
    ("<block end>", "the indentation does not fit the lines above; align keys of the same level"),
    ("<document start>", "there is something after the end of the configuration; remove it"),
    ("another document", "a second document starts here; keep one in a file"),
    (
        "expected ',' or",
        "a comma or a closing bracket is missing; add it, or quote a key that has brackets",
    ),
)
"""Parts of PyYAML's messages, and what they mean to the author of a configuration."""


class Mark(NamedTuple):
    """Positions of a key and of its value."""

    key: Position
    value: Position


@dataclass(frozen=True)
class YamlDocument:
    """The data of a file, and a mark for every key path in it."""

    data: Any
    marks: dict[KeyPath, Mark]

    def position(self, path: KeyPath, about_key: bool = False) -> Position:
        """The position of `path`; of an absent key, that of the mapping it is missing from."""
        if path in self.marks and not about_key:
            return self.marks[path].value
        while path not in self.marks:
            path = path[:-1]
        return self.marks[path].key


def text_of(path: Path, name: str) -> str:
    """The text of a file, which messages call `name`. Raises ConfigError."""
    try:
        if not path.is_file():
            raise _error(Position(source=name), _no_file(path))
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) <= MAX_BYTES:
            return content.decode("utf-8-sig")
        sentence = "the file is over 512 KiB; a configuration is smaller, so check the path"
    except UnicodeDecodeError as error:
        sentence = f"byte {error.start + 1} is not UTF-8 text; save the file with UTF-8 encoding"
    except OSError as error:
        sentence = f"the file cannot be read ({error.strerror}); check the path and its permissions"
    raise _error(Position(source=name), sentence)


def _no_file(path: Path) -> str:
    """The sentence about a path without a file, with a config that it may mean.

    It has the same or nearly the same name, or is the only one in this folder.
    """
    name = f"{path.name.removesuffix('.yaml')}.yaml"
    near = [path.with_name(name), Path(name), Path("configs", name)] if path.name else []
    beside = {config.stem: config for config in path.parent.glob("*.yaml")}
    near += [beside[stem] for stem in difflib.get_close_matches(path.stem, beside, n=1)]
    inside = list(path.glob("*.yaml"))
    near += inside if len(inside) == 1 else []
    meant = next((config for config in near if config.is_file()), None)
    advice = f"did you mean {excerpt(str(meant), 200)}?" if meant else "name a config file (YAML)"
    if path.is_dir():
        return f"this is a folder, not a config file; {advice}"
    return f"there is no file at this path; {advice}"


def document(text: str, name: str) -> YamlDocument:
    """The document written in `text`. Raises ConfigError, with all faults of its YAML."""
    try:
        reader = _Reader(text, name)
        if node := reader.get_single_node():
            data = reader.data(node, ())
            if reader.problems:
                raise ConfigError(reader.problems)
            return YamlDocument(data, reader.places)
        position = reader.position(reader.get_mark())
        sentence = "the file is empty; write at least container, balls and cor"
    except ConfigError:
        raise
    except yaml.MarkedYAMLError as error:
        position = reader.position(error.problem_mark or error.context_mark)
        problem = error.problem or ""
        unknown = f"this is not valid YAML ({excerpt(problem)}); correct it"
        if "cannot start any token" in problem:
            start = problem.split()[2]
            unknown = f"a value cannot start with {start}; put it in quotes if it is text"
        sentence = next((meaning for part, meaning in _SYNTAX if part in problem), unknown)
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        column = len(before) - before.rfind("\n")
        position = Position(before.count("\n") + 1, column, name)
        sentence = f"the character {text[error.position]!a} is not allowed in YAML; remove it"
    except (ValueError, OverflowError):  # PyYAML's chr() or int(), of an escape or a directive
        position = reader.position(reader.get_mark())
        sentence = "an escape or a directive has a number out of range; correct or remove it"
    raise _error(position, sentence)


def is_number(text: str) -> bool:
    """Whether an unquoted scalar would be read as a number, infinity and NaN included."""
    return any(re.fullmatch(_CORE_SCHEMA[tag], text) for tag in ("int", "float", "special"))


class _Reader(yaml.SafeLoader):
    """PyYAML's composer for YAML 1.2, which also makes data from its nodes.

    Large texts are read by libyaml, ten times as fast; it differs on tabs, and in its sentences.

    places, problems : what `data` has read so far
    """

    def __init__(self, text: str, name: str) -> None:
        super().__init__(text)
        if len(text) > LARGE and "\t" not in text and hasattr(yaml, "CSafeLoader"):
            events = yaml.CSafeLoader(text)
            for method in ("check_event", "peek_event", "get_event"):
                setattr(self, method, getattr(events, method))
        self.yaml_implicit_resolvers = {None: _RESOLVERS}
        self.source, self.depth = name, 0
        self.places: dict[KeyPath, Mark] = {}
        self.problems: list[Problem] = []

    def position(self, mark: Any) -> Position:
        return Position(mark.line + 1, mark.column + 1, self.source)

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """The next node. Raises ConfigError for a node that configurations do not have."""
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        sentence = ""
        if self.depth > MAX_DEPTH:
            sentence = f"more than {MAX_DEPTH} levels of nesting; a configuration needs 5"
        elif isinstance(event, yaml.AliasEvent):
            sentence = "aliases (*name) are not supported; write the value out"
        elif event.anchor is not None:
            sentence = "anchors (&name) are not supported; remove the anchor"
        elif event.tag is not None:
            sentence = "tags (!name) are not supported; remove the tag"
        if sentence:
            raise _error(self.position(event.start_mark), sentence)
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def data(self, node: yaml.Node, path: KeyPath, key: Position | None = None) -> Data:
        """The data of a node; `key` is the position of its key, if it has one."""
        here = self.position(node.start_mark)
        if key and isinstance(node, yaml.CollectionNode) and not node.flow_style:
            here = key  # of a block of lines, its key on the line above is found more easily
        self.places[path] = Mark(key or here, here)
        if isinstance(node, yaml.SequenceNode):
            return [self.data(item, (*path, k)) for k, item in enumerate(node.value)]
        if isinstance(node, yaml.MappingNode):
            return dict(self._items(node, path))
        try:
            return _value(node.tag, node.value)
        except ValueError as error:
            self.problems.append(Problem(path, str(error), position=here))
            return None

    def _items(self, mapping: yaml.MappingNode, path: KeyPath) -> Iterator[tuple[str, Data]]:
        """The keys and values of a mapping. Its keys must be unique and plain words."""
        for key, value in mapping.value:
            position, here, sentence = self.position(key.start_mark), (*path, key.value), ""
            if not isinstance(key, yaml.ScalarNode):
                here, sentence = path, "this cannot be a key; a key is a word followed by a colon"
            elif key.value == "<<":
                sentence = "merge keys (<<) are not supported; write the keys out"
            elif here in self.places:
                first = self.places[here].key
                sentence = f"the key is given twice, here and at {first}; keep one of them"
            if sentence:
                self.problems.append(Problem(here, sentence, position=position))
            else:
                yield key.value, self.data(value, here, position)


def _value(tag: str, text: str) -> bool | int | float | str | None:
    """The value of a scalar that has a tag of the core schema, or another tag if it is text.

    Raises ValueError, with a sentence, for a number that is too large for a double.
    """
    if tag == "null":
        return None
    if tag == "bool":
        return text.lower() == "true"
    if tag == "special":
        return float(text.replace(".", ""))
    if tag not in ("int", "float"):
        return text
    with suppress(OverflowError, ValueError):  # no double, or over 4300 digits
        number = int(text, {"0o": 8, "0x": 16}.get(text[:2], 10)) if tag == "int" else float(text)
        if math.isfinite(number):
            return number
    advice = "give one below 1.8e308, or .inf where infinity is allowed"
    raise ValueError(f"the number {excerpt(text)} is too large; {advice}")


def _error(position: Position, sentence: str) -> ConfigError:
    return ConfigError([Problem((), sentence, position=position)])
