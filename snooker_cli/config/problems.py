"""Problems of a config: position, key path and sentence. Also reads and changes key paths."""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, NamedTuple, TypeAlias

from pydantic import BaseModel

from snooker_cli.errors import ExitCode, SnookerError
from snooker_cli.formatting import printable
from snooker_cli.laws import PackageLaw

KeyPath: TypeAlias = tuple[str | int, ...]
"""Mapping keys (str) and list indices (int), outermost first; () is the whole document."""

Data: TypeAlias = "bool | int | float | str | list[Data] | dict[str, Data] | None"
"""What a configuration file can hold."""

MOST_SHOWN = 20  # problems that a message lists; more have few causes in common
MOST_FOUND = 50  # problems after which the reading of a configuration ends

_NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_INDEX = r"\[(?:0|[1-9][0-9]{0,8})\]"
_PATH = re.compile(rf"{_NAME}(?:{_INDEX})*(?:\.{_NAME}(?:{_INDEX})*)*")
_SEGMENT = re.compile(rf"({_NAME})|\[([0-9]+)\]")


class PathError(Exception):
    """A path that cannot be read or that leads nowhere; its text is one sentence."""


def key_path(text: str) -> KeyPath:
    """The path written as `text`. Raises PathError."""
    if not _PATH.fullmatch(text):
        raise PathError(
            f"'{excerpt(text)}' is not a key; write names joined by dots, such as balls.radius "
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
    if isinstance(node, PackageLaw):
        node = node.in_config()
    if isinstance(part, int):
        if not isinstance(node, list | tuple) or part >= len(node):
            raise PathError(f"{here} has no item [{part}]")
        inner = substituted(node[part], path, value, depth + 1)
        return [*node[:part], inner, *node[part + 1 :]]
    if not isinstance(node, Mapping | BaseModel | None):
        raise PathError(f"{here} has no keys, and so no {part}")
    fields = dict(node or {})
    return {**fields, part: substituted(fields.get(part), path, value, depth + 1)}


def excerpt(text: str, limit: int = 60) -> str:
    """User text made safe to print inside a sentence: one line, printable, short."""
    safe = printable(text[: limit + 1])
    return safe if len(safe) <= limit else safe[: limit - 1] + "…"


def in_words(value: Any) -> str:
    """What a sentence calls a value."""
    match value:
        case None:
            return "nothing (null)"
        case bool():
            return f"the truth value {str(value).lower()}"
        case str():
            return f"the text {excerpt(value)}" if value else "an empty text"
    written = json.dumps(value, ensure_ascii=False, default=str)
    text = excerpt(written.replace("Infinity", ".inf").replace("NaN", ".nan"))
    for name, classes in (("mapping", Mapping), ("list", list | tuple)):
        if isinstance(value, classes):
            return f"the {name} {text}" if value else f"an empty {name}"
    return text


class Position(NamedTuple):
    """A place in a file (line and column from 1), or an override."""

    line: int = 0
    column: int = 0
    source: str = ""

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}" if self.line else self.source


NOWHERE = Position()


@dataclass(frozen=True)
class Problem:
    """One thing to correct, printed as ``file:line:column: key.path: sentence``.

    about_key : the position is that of the key (an unknown one, say), not of its value
    position : empty until the key is looked up in the file
    """

    path: KeyPath
    sentence: str
    about_key: bool = False
    position: Position = NOWHERE

    def __str__(self) -> str:
        key = excerpt(rendered(self.path), 200)
        return ": ".join(part for part in (str(self.position), key, self.sentence) if part)


class ConfigError(SnookerError, ValueError):
    """A configuration that cannot be used; `problems` holds the first `MOST_FOUND` in file order.

    It is a ValueError, so that validators of pydantic can raise it.
    """

    exit_code = ExitCode.CONFIG
    problems: tuple[Problem, ...]

    def __init__(self, problems: Iterable[Problem]) -> None:
        first = islice(problems, MOST_FOUND)
        self.problems = tuple(sorted(first, key=lambda problem: problem.position))
        lines = [str(problem) for problem in self.problems[:MOST_SHOWN]]
        if (more := len(self.problems) - MOST_SHOWN) > 0:
            number = "" if len(self.problems) == MOST_FOUND else f"{more:,} "
            lines.append(f"... and {number}more; correct these first")
        super().__init__("\n".join(lines))
