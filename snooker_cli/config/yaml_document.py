"""YAML text -> plain data, with the position of every key and value.

Read are mappings, lists and the scalars of the YAML 1.2 core schema. Duplicate keys, anchors,
aliases, merge keys and tags are refused.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from snooker_cli.config.problems import (
    ConfigError,
    Data,
    KeyPath,
    Position,
    Problem,
    given,
    rendered,
    shown,
)

MAX_BYTES = 1 << 20
MAX_DEPTH = 20
"""Levels of nested lists and mappings; a configuration needs 5."""

# https://yaml.org/spec/1.2.2/#103-core-schema, table 10.3
_CORE_SCHEMA = {
    "null": r"(~|null|Null|NULL)?",
    "bool": r"true|True|TRUE|false|False|FALSE",
    "int": r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+",
    "float": r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?",
    "special": r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
}

_SYNTAX = (
    ("'\\t'", "a tab stands where YAML allows only spaces; replace it by spaces"),
    ("mapping values", "a second colon or a wrong indentation; give every key its own line"),
    ("could not find expected ':'", "a key without a colon; write key: value"),
    ("<stream end>", "a bracket, brace or quote is never closed; close it"),
    ("end of stream", "a bracket, brace or quote is never closed; close it"),
    ("<block end>", "the indentation does not fit the lines above; align keys of the same level"),
    ("<document start>", "there is something after the end of the configuration; remove it"),
    ("another document", "a second document starts here; keep one in a file"),
    (
        "expected ',' or",
        "a comma or a closing bracket is missing; add it, or quote a key that has brackets",
    ),
)
"""Parts of PyYAML's messages, and what they mean to the author of a configuration."""


@dataclass(frozen=True)
class Mark:
    """Positions of a key and of its value, and the value as it was written (scalars only)."""

    key: Position
    value: Position
    written: str = ""


@dataclass(frozen=True)
class YamlDocument:
    """The data of a file, a mark for every key path in it, and what was wrong with its YAML."""

    data: dict[str, Data]
    marks: dict[KeyPath, Mark]
    problems: tuple[Problem, ...] = ()

    def position(self, path: KeyPath, about_key: bool = False) -> Position:
        """The position of `path`; of an absent key, that of the mapping it is missing from."""
        if path in self.marks:
            mark = self.marks[path]
            return mark.key if about_key else mark.value
        while path and path not in self.marks:
            path = path[:-1]
        return self.marks[path].key

    def written(self, path: KeyPath) -> str:
        """The scalar at `path` as its author wrote it, or an empty string."""
        return self.marks[path].written if path in self.marks else ""


def text_of(path: Path, name: str) -> str:
    """The text of a file, which messages call `name`. Raises ConfigError."""
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            sentence = "this is a pipe or a device; name a YAML file"
            raise ConfigError.at(Position(source=name), sentence)
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) <= MAX_BYTES:
            return content.decode("utf-8-sig")
        sentence = "the file is over 1 MiB; a configuration is smaller, so check the path"
    except UnicodeDecodeError as error:
        sentence = f"byte {error.start + 1} is not UTF-8 text; save the file with UTF-8 encoding"
    except FileNotFoundError:
        sentence = "there is no such file; check the path"
    except IsADirectoryError:
        sentence = "this is a directory; name a YAML file in it"
    except PermissionError:
        sentence = "the file may not be read; check its permissions"
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        sentence = f"the file cannot be read ({reason}); check the path"
    raise ConfigError.at(Position(source=name), sentence)


def document(text: str, name: str) -> YamlDocument:
    """The document written in `text`. Raises ConfigError if no mapping can be read from it.

    Smaller faults (a duplicate key, an alias) are listed in `YamlDocument.problems`, so that they
    can be shown together with others.
    """
    if len(text) > MAX_BYTES:
        sentence = "the text is over 1 MiB; a configuration is smaller"
        raise ConfigError.at(Position(source=name), sentence)
    reader = _Reader(text, name)
    if not isinstance(reader.data, dict):
        top = reader.marks[()]
        sentence = (
            f"{given(reader.data, top.written)} is given where keys and values are needed; "
            "start with a line such as cor: 0.8"
        )
        raise ConfigError([*reader.problems, Problem(top.value, "", sentence)])
    return YamlDocument(reader.data, reader.marks, tuple(reader.problems))


def snippet(text: str) -> tuple[Data, dict[KeyPath, Mark]]:
    """The data and marks of a piece of YAML outside a file. Raises ConfigError."""
    reader = _Reader(text, "")
    if reader.problems:
        raise ConfigError(reader.problems)
    return reader.data, reader.marks


def resolved(text: str) -> bool | int | float | str | None:
    """The value of an unquoted scalar.

    Raises ValueError, with a sentence, for a number that is too large for a double.
    """
    return _value(_tag(text), text)


def is_number(text: str) -> bool:
    """Whether an unquoted scalar would be read as a number, infinity and NaN included."""
    return _tag(text) in ("int", "float", "special")


def _tag(text: str) -> Any:
    """The tag of an unquoted scalar, one of the core schema's or that of text."""
    return _RESOLVER.resolve(yaml.ScalarNode, text, (True, False))


def _value(tag: str, text: str) -> bool | int | float | str | None:
    """The value of a scalar that has a tag of the core schema, or another tag if it is text."""
    match tag:
        case "null":
            return None
        case "bool":
            return text.lower() == "true"
        case "special":
            return float(text.replace(".", ""))
        case "int" | "float":
            base = {"0o": 8, "0x": 16}.get(text[:2], 10)
            try:
                number = int(text, base) if tag == "int" else float(text)
                if math.isfinite(number):
                    return number
            except (OverflowError, ValueError):  # no double, or over 4300 digits
                pass
            raise ValueError(
                f"the number {shown(text)} is too large; give one below 1.8e308, or .inf where "
                "infinity is allowed"
            )
    return text


class _Composer(yaml.SafeLoader):
    """PyYAML's composer for YAML 1.2.

    refused : the nodes with an anchor or a tag, and those in place of an alias, with sentences
    """

    def __init__(self, text: str, name: str = "") -> None:
        super().__init__(text)
        self.name = name
        self.depth = 0
        self.refused: dict[yaml.Node, list[str]] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """The next node. Raises ConfigError if it is nested too deep."""
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        if self.depth > MAX_DEPTH:
            sentence = f"more than {MAX_DEPTH} levels of nesting; a configuration needs 5"
            raise ConfigError.at(_position(event.start_mark), sentence)
        if self.check_event(yaml.AliasEvent):
            self.get_event()  # type: ignore[no-untyped-call]
            alias = yaml.ScalarNode("null", "", event.start_mark)
            self.refused[alias] = ["aliases (*name) are not supported; write the value out"]
            return alias
        sentences = []
        if event.anchor is not None:
            sentences.append("anchors (&name) are not supported; remove the anchor")
        if event.tag is not None:
            sentences.append("tags (!name) are not supported; remove the tag")
        event.anchor = event.tag = None
        if isinstance(event, yaml.ScalarEvent):
            event.implicit = (event.style is None, True)
        self.depth += 1
        node = super().compose_node(parent, index)
        assert node is not None
        self.depth -= 1
        self.refused[node] = sentences
        return node


_Composer.yaml_implicit_resolvers = {
    None: [(tag, re.compile(rf"(?:{text})\Z")) for tag, text in _CORE_SCHEMA.items()]
}
_RESOLVER: Any = _Composer("")


class _Reader:
    """The data of a YAML text, with the marks and problems found in it. Raises ConfigError."""

    def __init__(self, text: str, name: str) -> None:
        self.marks: dict[KeyPath, Mark] = {}
        self.problems: list[Problem] = []
        node, self.refused = _composed(text, name)
        self.data = self._data(node, (), None)

    def _complain(self, node: yaml.Node, path: KeyPath, sentence: str) -> None:
        self.problems.append(Problem(_position(node.start_mark), rendered(path), sentence))

    def _data(self, node: yaml.Node, path: KeyPath, key: Position | None) -> Data:
        """The data of a node; `key` is the position of its key, if it has one."""
        for sentence in self.refused[node]:
            self._complain(node, path, sentence)
        here, written = _position(node.start_mark), ""
        if isinstance(node, yaml.ScalarNode):
            quote = node.style if node.style in ("'", '"') else ""
            written = f"{quote}{node.value}{quote}"
        elif key and isinstance(node, yaml.CollectionNode) and not node.flow_style:
            here = key  # of a block of lines, its key on the line above is found more easily
        self.marks[path] = Mark(key or here, here, written)
        if isinstance(node, yaml.SequenceNode):
            return [self._data(item, (*path, k), None) for k, item in enumerate(node.value)]
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, path)
        try:
            node.value.encode()
            return _value(node.tag, node.value)
        except UnicodeEncodeError:
            sentence = "the text holds half a surrogate pair; write whole characters"
        except ValueError as error:
            sentence = str(error)
        self._complain(node, path, sentence)
        return None

    def _mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Data]:
        values: dict[str, Data] = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or self.refused[key]:
                sentence = "this cannot be a key; a key is a plain word followed by a colon"
                self._complain(key, path, sentence)
                continue
            position, here = _position(key.start_mark), (*path, key.value)
            if key.value == "<<":
                sentence = "merge keys (<<) are not supported; write the keys out"
                self._complain(key, here, sentence)
                self._data(value, here, position)
            elif key.value in values:
                again = (*path, f"{key.value} (again)")
                second = given(self._data(value, again, position), self.marks[again].written)
                first = given(values[key.value], self.marks[here].written)
                sentence = (
                    f"the key is given twice, with {second} here and {first} at "
                    f"{self.marks[here].key}; keep one of them"
                )
                self._complain(key, here, sentence)
            else:
                values[key.value] = self._data(value, here, position)
        return values


def _composed(text: str, name: str) -> tuple[yaml.Node, dict[yaml.Node, list[str]]]:
    """The root node of a text, and what its nodes have that is refused. Raises ConfigError."""
    try:
        composer = _Composer(text, name)
        if node := composer.get_single_node():
            return node, composer.refused
        position = _position(composer.get_mark())
        sentence = "the file is empty; write at least container, balls and cor"
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        position = _position(mark) if mark else Position(source=name)
        sentence = _syntax_sentence(error.problem or "")
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        column = len(before) - before.rfind("\n")
        position = Position(before.count("\n") + 1, column, name)
        sentence = f"the character {text[error.position]!a} is not allowed in YAML; remove it"
    except ValueError:  # of PyYAML's chr() or int(), for an escape or a version of YAML
        position = Position(source=name)
        sentence = "an escape or a directive has a number out of range; correct or remove it"
    raise ConfigError.at(position, sentence)


def _position(mark: yaml.Mark) -> Position:
    return Position(mark.line + 1, mark.column + 1, mark.name)


def _syntax_sentence(problem: str) -> str:
    """PyYAML's message about a syntax error, in the words of a configuration's author."""
    for part, sentence in _SYNTAX:
        if part in problem:
            return sentence
    if "cannot start any token" in problem:
        return f"a value cannot start with {problem.split()[2]}; put it in quotes if it is text"
    return f"this is not valid YAML ({shown(problem)}); correct it"
