"""YAML text -> plain data, with the position of every key and value.

Only the part of YAML a configuration needs: mappings, lists and scalars by the YAML 1.2 core
schema. Duplicate keys, anchors, aliases, merge keys and tags are refused.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from snooker_cli.config.problems import (
    ConfigError,
    Data,
    KeyPath,
    Position,
    Problem,
    rendered,
    shown,
)

# Plain YAML scalars by the YAML 1.2 core schema: which are numbers, truth values or null.

_NULL = frozenset({"", "~", "null", "Null", "NULL"})
_TRUE = frozenset({"true", "True", "TRUE"})
_FALSE = frozenset({"false", "False", "FALSE"})
_INTEGER = re.compile(r"[-+]?[0-9]+")
_OCTAL = re.compile(r"0o[0-7]+")
_HEXADECIMAL = re.compile(r"0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITY = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NAN = frozenset({".nan", ".NaN", ".NAN"})

MAX_DIGITS = 400
"""Longest integer read: the largest double has 309 digits."""


def resolved(text: str) -> bool | int | float | str | None:
    """The value of an unquoted scalar.

    Raises ValueError with one sentence when a number is too large to be represented.
    https://yaml.org/spec/1.2.2/#103-core-schema, table 10.3
    """
    if text in _NULL:
        return None
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if text in _NAN:
        return math.nan
    if _INFINITY.fullmatch(text):
        return -math.inf if text.startswith("-") else math.inf
    for pattern, base in ((_INTEGER, 10), (_OCTAL, 8), (_HEXADECIMAL, 16)):
        if pattern.fullmatch(text):
            return _integer(text, base)
    if _FLOAT.fullmatch(text):
        return _finite(text)
    return text


def is_number(text: str) -> bool:
    """Whether an unquoted scalar would be read as a number, infinity and NaN included."""
    try:
        value = resolved(text)
    except ValueError:
        return True
    return isinstance(value, int | float) and not isinstance(value, bool)


def _integer(text: str, base: int) -> int:
    if len(text) > MAX_DIGITS:
        raise _too_large(text)
    value = int(text, base)
    try:
        float(value)
    except OverflowError:
        raise _too_large(text) from None
    return value


def _finite(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise _too_large(text)
    return value


def _too_large(text: str) -> ValueError:
    return ValueError(
        f"the number {shown(text)} is too large; give one below 1.8e308, or .inf where infinity is "
        "allowed"
    )


# A value -> what a message calls it, short enough for a sentence.

_MOST_ITEMS = 30
"""More fill a sentence's room for a value, whatever they are."""


def given(value: Any, written: str = "") -> str:
    """A value, named so that its author recognises it.

    written : a scalar as its author wrote it, if that is known
    """
    if value is None:
        return "nothing (null)"
    if isinstance(value, bool):
        return f"the truth value {str(value).lower()}"
    if isinstance(value, str):
        quoted = written if written[:1] in ("'", '"') else value
        return f"the text {shown(quoted)}" if quoted else "an empty text"
    if isinstance(value, Mapping):
        return f"the mapping {shown(_flow(value))}" if value else "an empty mapping"
    if isinstance(value, tuple | list):
        return f"the list {shown(_flow(value))}" if value else "an empty list"
    return shown(written or _flow(value))


def _flow(value: Any) -> str:
    """A value on one line as YAML has it, of lists and mappings the first items."""
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case str():
            return value if _is_plain(value) else f"'{value}'"
        case float() if math.isnan(value):
            return ".nan"
        case float() if math.isinf(value):
            return ".inf" if value > 0 else "-.inf"
        case Mapping():
            items = (f"{key}: {_flow(item)}" for key, item in islice(value.items(), _MOST_ITEMS))
            return f"{{{', '.join(items)}}}"
        case list() | tuple():
            return f"[{', '.join(map(_flow, islice(value, _MOST_ITEMS)))}]"
        case _:
            return str(value)


def _is_plain(text: str) -> bool:
    """Whether a text without quotes would be read as that text."""
    try:
        return isinstance(resolved(text), str)
    except ValueError:
        return False


MAX_BYTES = 1 << 20
MAX_DEPTH = 20
"""Lists and mappings inside one another; a configuration needs 5."""


@dataclass(frozen=True)
class Mark:
    """Where a key and its value stand, and the value as it was written (scalars only)."""

    key: Position
    value: Position
    written: str = ""


@dataclass(frozen=True)
class YamlDocument:
    """The data of a file, a mark for every key path in it, and what was wrong with its YAML."""

    name: str
    data: dict[str, Data]
    marks: dict[KeyPath, Mark]
    problems: tuple[Problem, ...] = ()

    def position(self, path: KeyPath, about_key: bool = False) -> Position:
        """Where `path` stands; an absent key has the position of the mapping it is missing from."""
        if path in self.marks:
            mark = self.marks[path]
            return mark.key if about_key else mark.value
        while path and path not in self.marks:
            path = path[:-1]
        return self.marks[path].key

    def written(self, path: KeyPath) -> str:
        """The scalar at `path` as its author wrote it, or nothing."""
        return self.marks[path].written if path in self.marks else ""


def text_of(path: Path, name: str) -> str:
    """The text of the file that messages call `name`; raises ConfigError if it cannot be read."""

    def refusal(sentence: str) -> ConfigError:
        return ConfigError([Problem(Position(source=name), "", sentence)])

    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise refusal("this is a pipe or a device; name a YAML file")
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise refusal("there is no such file; check the path") from None
    except IsADirectoryError:
        raise refusal("this is a directory; name a YAML file in it") from None
    except PermissionError:
        raise refusal("the file may not be read; check its permissions") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise refusal(f"the file cannot be read ({reason}); check the path") from None
    if len(content) > MAX_BYTES:
        raise refusal("the file is over 1 MiB; a configuration is smaller, so check the path")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise refusal(
            f"byte {error.start + 1} is not UTF-8 text; save the file with UTF-8 encoding"
        ) from None


def document(text: str, name: str) -> YamlDocument:
    """The document written in `text`; raises ConfigError when no mapping can be read from it.

    Smaller faults (a duplicate key, an alias) are left in `Document.problems`, so that they can
    be shown together with whatever else is wrong.
    """
    if len(text) > MAX_BYTES:
        sentence = "the text is over 1 MiB; a configuration is smaller"
        raise ConfigError([Problem(Position(source=name), "", sentence)])
    reader = _Reader(text, name)
    data = reader.document()
    if not isinstance(data, dict):
        found = given(data, reader.marks[()].written)
        raise ConfigError(
            [
                *reader.problems,
                Problem(
                    reader.marks[()].value,
                    "",
                    f"{found} is given where keys and values are needed; "
                    "start with a line such as cor: 0.8",
                ),
            ]
        )
    return YamlDocument(name, data, reader.marks, tuple(reader.problems))


def snippet(text: str) -> tuple[Data, dict[KeyPath, Mark]]:
    """The data and marks of a piece of YAML that stands in no file; raises ConfigError."""
    reader = _Reader(text, "")
    data = reader.document()
    if reader.problems:
        raise ConfigError(reader.problems)
    return data, reader.marks


class _Reader:
    """Builds data from parser events, depth first, noting marks and problems on the way."""

    def __init__(self, text: str, name: str) -> None:
        self.text = text
        self.name = name
        self.marks: dict[KeyPath, Mark] = {}
        self.problems: list[Problem] = []
        self.events = self._events()

    def document(self) -> Data:
        """The single document of the text."""
        event = next(self.events)
        if isinstance(event, yaml.StreamEndEvent):
            raise self._fatal(
                event, "", "the file is empty; write at least container, balls and cor"
            )
        data = self._node(next(self.events), (), None)
        next(self.events)
        event = next(self.events)
        if not isinstance(event, yaml.StreamEndEvent):
            raise self._fatal(event, "", "a second document starts here; keep one in a file")
        return data

    def _events(self) -> Iterator[yaml.Event]:
        """The parser's events from the first document on; its errors become ConfigError."""
        try:
            events = yaml.parse(self.text, Loader=yaml.SafeLoader)
            next(events)
            yield from events
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            position = Position(mark.line + 1, mark.column + 1, self.name) if mark else Position()
            raise ConfigError([Problem(position, "", _syntax_sentence(error))]) from None
        except yaml.reader.ReaderError as error:
            before = self.text[: error.position]
            line = before.count("\n") + 1
            column = len(before) - before.rfind("\n")
            character = self.text[error.position]
            sentence = f"the character {character!a} is not allowed in YAML; remove it"
            raise ConfigError([Problem(Position(line, column, self.name), "", sentence)]) from None
        except ValueError:
            # PyYAML lets chr() and int() refuse an escape or a version number out of range.
            sentence = "an escape or a directive has a number out of range; correct or remove it"
            raise ConfigError([Problem(Position(source=self.name), "", sentence)]) from None

    def _position(self, event: yaml.Event) -> Position:
        mark = event.start_mark
        return Position(mark.line + 1, mark.column + 1, self.name) if mark else Position()

    def _fatal(self, event: yaml.Event, key: str, sentence: str) -> ConfigError:
        return ConfigError([*self.problems, Problem(self._position(event), key, sentence)])

    def _complain(self, event: yaml.Event, path: KeyPath, sentence: str) -> None:
        self.problems.append(Problem(self._position(event), rendered(path), sentence))

    def _node(self, event: yaml.Event, path: KeyPath, key: Position | None) -> Data:
        """The value that starts with `event`; `key` is where its key stands, if it has one."""
        position = self._position(event)
        written = _written(event) if isinstance(event, yaml.ScalarEvent) else ""
        # A block of lines is found more easily by its key, on the line above.
        is_block = isinstance(event, yaml.CollectionStartEvent) and not event.flow_style
        value = key if key and is_block else position
        self.marks[path] = Mark(key or position, value, written)
        if len(path) > MAX_DEPTH:
            sentence = f"more than {MAX_DEPTH} levels of nesting; a configuration needs 5"
            raise self._fatal(event, "", sentence)
        if isinstance(event, yaml.AliasEvent):
            self._complain(event, path, "aliases (*name) are not supported; write the value out")
            return None
        assert isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent)
        if event.anchor is not None:
            self._complain(event, path, "anchors (&name) are not supported; remove the anchor")
        if event.tag is not None:
            self._complain(event, path, "tags (!name) are not supported; remove the tag")
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(path)
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event, path)
        return self._mapping(path)

    def _scalar(self, event: yaml.ScalarEvent, path: KeyPath) -> Data:
        if event.style is None:
            try:
                return resolved(event.value)
            except ValueError as error:
                self._complain(event, path, str(error))
                return None
        if not event.value.isascii() and any(0xD800 <= ord(c) <= 0xDFFF for c in event.value):
            self._complain(
                event, path, "the text holds half a surrogate pair; write whole characters"
            )
            return None
        return str(event.value)

    def _sequence(self, path: KeyPath) -> list[Data]:
        items: list[Data] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            items.append(self._node(event, (*path, len(items)), None))
        return items

    def _mapping(self, path: KeyPath) -> dict[str, Data]:
        values: dict[str, Data] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            position = self._position(event)
            if not isinstance(event, yaml.ScalarEvent) or event.anchor or event.tag:
                sentence = "this cannot be a key; a key is a plain word followed by a colon"
                raise self._fatal(event, rendered(path), sentence)
            key = event.value
            here = (*path, key)
            if key == "<<":
                self._complain(event, here, "merge keys (<<) are not supported; write the keys out")
                self._node(next(self.events), here, position)
            elif key in values:
                again = (*path, f"{key} (again)")
                second = self._node(next(self.events), again, position)
                first = self.marks[here]
                self._complain(
                    event,
                    here,
                    f"the key is given twice, with {given(second, self.marks[again].written)} here "
                    f"and {given(values[key], first.written)} at {first.key}; keep one of them",
                )
            else:
                values[key] = self._node(next(self.events), here, position)
        return values


def _written(event: yaml.ScalarEvent) -> str:
    """A scalar as its author wrote it, near enough to be recognised."""
    quote = event.style if event.style in ("'", '"') else ""
    return f"{quote}{event.value}{quote}"


def _syntax_sentence(error: yaml.MarkedYAMLError) -> str:
    """PyYAML's syntax errors in a configuration author's words."""
    problem = error.problem or ""
    if "'\\t'" in problem:
        return "a tab stands where YAML allows only spaces; replace it by spaces"
    if problem == "mapping values are not allowed here":
        return "a second colon or a wrong indentation; give every key its own line"
    if problem == "could not find expected ':'":
        return "a key without a colon; write key: value"
    if "<stream end>" in problem or "end of stream" in problem:
        return "a bracket, brace or quote is never closed; close it"
    if "<block end>" in problem:
        return "the indentation does not fit the lines above; align keys of the same level"
    if "<document start>" in problem:
        return "there is something after the end of the configuration; remove it"
    if problem.startswith("expected ',' or"):
        return "a comma or a closing bracket is missing; add it, or quote a key that has brackets"
    if "cannot start any token" in problem:
        return f"a value cannot start with {problem.split()[2]}; put it in quotes if it is text"
    return f"this is not valid YAML ({shown(problem)}); correct it"
