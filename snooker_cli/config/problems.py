"""Problems of a configuration: position, key path and sentence, and values inside a sentence."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, NamedTuple, TypeAlias

from pydantic import BaseModel
from pydantic_core import PydanticCustomError

from snooker_cli.errors import ExitCode, SnookerError

KeyPath: TypeAlias = tuple[str | int, ...]
"""Mapping keys (str) and list indices (int), outermost first; () is the whole document."""

Data: TypeAlias = "bool | int | float | str | list[Data] | dict[str, Data] | None"
"""What a configuration file can hold."""

MOST_SHOWN = 20
"""Problems that a message lists; more have few causes in common."""

_NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_INDEX = r"\[(?:0|[1-9][0-9]{0,8})\]"
_PATH = re.compile(rf"{_NAME}(?:{_INDEX})*(?:\.{_NAME}(?:{_INDEX})*)*")
_SEGMENT = re.compile(rf"({_NAME})|\[([0-9]+)\]")

_MOST_ITEMS = 30
"""Items of a list or mapping in a sentence, before it is cut to its length."""


class PathError(Exception):
    """A path that cannot be read or that leads nowhere; its text is one sentence."""


def key_path(text: str) -> KeyPath:
    """The path written as `text`. Raises PathError."""
    if not _PATH.fullmatch(text):
        raise PathError(
            f"'{shown(text)}' is not a key; write names joined by dots, such as balls.radius "
            "or balls.list[0].position"
        )
    return tuple(name or int(index) for name, index in _SEGMENT.findall(text))


def rendered(path: KeyPath) -> str:
    """The path as a user writes it."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


def value_at(node: Any, path: KeyPath) -> Any:
    """The value at a path of a model (attributes for keys, tuples for lists)."""
    for part in path:
        node = node[part] if isinstance(part, int) else getattr(node, part)
    return node


def substituted(node: Any, path: KeyPath, value: Any, depth: int = 0) -> Any:
    """A copy of `node` with the value at `path` replaced or added.

    Nodes are mappings, lists, tuples and models; those along the path become dicts and lists.
    Raises PathError if the path runs into a single value or past the end of a list.
    """
    if depth == len(path):
        return value
    part, here = path[depth], rendered(path[:depth])
    if isinstance(part, int):
        if not isinstance(node, list | tuple):
            raise PathError(f"{here} is not a list, so it has no item [{part}]")
        if part >= len(node):
            end = f"its items end at [{len(node) - 1}]" if node else "the list is empty"
            raise PathError(f"{here} has no item [{part}]; {end}")
        inner = substituted(node[part], path, value, depth + 1)
        return [*node[:part], inner, *node[part + 1 :]]
    if not isinstance(node, Mapping | BaseModel | None):
        raise PathError(f"{here} is not a mapping, so it has no key {part}")
    fields = dict(node or {})
    return {**fields, part: substituted(fields.get(part), path, value, depth + 1)}


def shown(text: str, limit: int = 60) -> str:
    """User text made safe to print inside a sentence: one line, printable, short."""
    safe = "".join(
        character if character.isprintable() else ascii(character)[1:-1]
        for character in text[: limit + 1]
    )
    return safe if len(safe) <= limit else safe[: limit - 1] + "…"


def given(value: Any, written: str = "") -> str:
    """What a sentence calls a value.

    written : a scalar as its author wrote it, if that is known
    """
    match value:
        case None:
            return "nothing (null)"
        case bool():
            return f"the truth value {str(value).lower()}"
        case str():
            quoted = written if written[:1] in ("'", '"') else value
            return f"the text {shown(quoted)}" if quoted else "an empty text"
        case Mapping():
            return f"the mapping {shown(_flow(value))}" if value else "an empty mapping"
        case list() | tuple():
            return f"the list {shown(_flow(value))}" if value else "an empty list"
    return shown(written or _flow(value))


def _flow(value: Any) -> str:
    """A value as YAML on one line, with the first items of lists and mappings."""
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case str():
            return f"'{value}'"
        case float() if not math.isfinite(value):
            return str(value).replace("inf", ".inf").replace("nan", ".nan")
        case Mapping():
            items = (f"{key}: {_flow(item)}" for key, item in islice(value.items(), _MOST_ITEMS))
            return f"{{{', '.join(items)}}}"
        case list() | tuple():
            return f"[{', '.join(map(_flow, islice(value, _MOST_ITEMS)))}]"
    return str(value)


class Position(NamedTuple):
    """A place in a file (line and column from 1), or an override."""

    line: int = 0
    column: int = 0
    source: str = ""

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}" if self.line else self.source


@dataclass(frozen=True)
class Problem:
    """One thing to correct, printed as ``file:line:column: key.path: sentence``."""

    position: Position
    key: str
    sentence: str

    def __str__(self) -> str:
        key = shown(self.key, 200)
        return ": ".join(part for part in (str(self.position), key, self.sentence) if part)


@dataclass(frozen=True)
class Complaint:
    """A problem with the path of its key, before its position is looked up.

    about_key : the position is that of the key (an unknown one, say), not of its value
    missing : keys of which at least one must be given
    """

    path: KeyPath
    sentence: str
    about_key: bool = False
    missing: tuple[str, ...] = ()


def refusal(complaints: Iterable[Complaint]) -> PydanticCustomError:
    """The error that carries a validator's complaints through pydantic."""
    found = tuple(complaints)
    sentences = " ".join(f"{rendered(each.path)}: {each.sentence}." for each in found)
    return PydanticCustomError(
        "complaints", "{sentences}", {"sentences": sentences, "complaints": found}
    )


class ConfigError(SnookerError):
    """A configuration that cannot be used; `problems` holds all that was found, in file order."""

    exit_code = ExitCode.CONFIG
    problems: tuple[Problem, ...]

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda problem: problem.position))
        lines = [str(problem) for problem in self.problems[:MOST_SHOWN]]
        if (more := len(self.problems) - MOST_SHOWN) > 0:
            lines.append(f"... and {more:,} more; correct these first")
        super().__init__("\n".join(lines))

    @classmethod
    def at(cls, position: Position, sentence: str) -> "ConfigError":
        """The error of a single problem that has no key."""
        return cls([Problem(position, "", sentence)])
