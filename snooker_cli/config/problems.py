"""What is wrong with a configuration, said in plain sentences with a position."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

from pydantic_core import PydanticCustomError

from snooker_cli.errors import ExitCode, SnookerError

# Key paths: naming, reading and replacing one value inside nested data.

KeyPath: TypeAlias = tuple[str | int, ...]
"""Mapping keys (str) and list indices (int), outermost first; () is the whole document."""

Data: TypeAlias = "bool | int | float | str | list[Data] | dict[str, Data] | None"
"""What a configuration file can hold."""

_NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_INDEX = r"\[(?:0|[1-9][0-9]{0,8})\]"
_PATH = re.compile(rf"{_NAME}(?:{_INDEX})*(?:\.{_NAME}(?:{_INDEX})*)*")
_SEGMENT = re.compile(rf"({_NAME})|\[([0-9]+)\]")


class PathError(Exception):
    """A path that cannot be read, or leads nowhere; its text is one sentence."""


def key_path(text: str) -> KeyPath:
    """The path written as `text`; raises PathError when it is not one."""
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


def shown(text: str, limit: int = 60) -> str:
    """User text made safe to print inside a sentence: one line, printable, short."""
    safe = "".join(
        character if character.isprintable() else ascii(character)[1:-1]
        for character in text[: limit + 1]
    )
    return safe if len(safe) <= limit else safe[: limit - 1] + "…"


def value_at(node: Any, path: KeyPath) -> Any:
    """The value a path leads to in a model (attributes for keys, tuples for lists)."""
    for part in path:
        node = node[part] if isinstance(part, int) else getattr(node, part)
    return node


def substituted(node: Any, path: KeyPath, value: Any) -> Any:
    """`node` with the value at `path` replaced or added; nothing is changed in place.

    Nodes are mappings, lists, tuples and models; those on the way become plain dicts and lists.
    Raises PathError when the path runs into a single value or past the end of a list.
    """
    return _substituted(node, path, 0, value)


def _substituted(node: Any, path: KeyPath, depth: int, value: Any) -> Any:
    if depth == len(path):
        return value
    part, here = path[depth], rendered(path[:depth])
    if isinstance(part, int):
        if not isinstance(node, list | tuple):
            raise PathError(f"{here} is not a list, so it has no item [{part}]")
        if part >= len(node):
            end = f"its items end at [{len(node) - 1}]" if node else "the list is empty"
            raise PathError(f"{here} has no item [{part}]; {end}")
        return [*node[:part], _substituted(node[part], path, depth + 1, value), *node[part + 1 :]]
    fields = _fields(node)
    if fields is None:
        raise PathError(f"{here} is not a mapping, so it has no key {part}")
    return {**fields, part: _substituted(fields.get(part), path, depth + 1, value)}


def _fields(node: Any) -> dict[str, Any] | None:
    """The keys and values of a mapping or model, none for an absent one, else None."""
    if node is None:
        return {}
    if isinstance(node, Mapping):
        return dict(node)
    if hasattr(type(node), "model_fields"):
        return {name: getattr(node, name) for name in type(node).model_fields}
    return None


class Position(NamedTuple):
    """Where something was written: a file and the place in it (from 1), or an override."""

    line: int = 0
    column: int = 0
    source: str = ""

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}" if self.line else self.source


@dataclass(frozen=True)
class Problem:
    """One thing to put right, rendered as ``file:line:column: key.path: sentence``."""

    position: Position
    key: str
    sentence: str

    def __str__(self) -> str:
        key = shown(self.key, 200)
        return ": ".join(part for part in (str(self.position), key, self.sentence) if part)


@dataclass(frozen=True)
class Complaint:
    """A problem that knows its key but not yet its position.

    `about_key` points at the key rather than at its value (an unknown key, say).
    """

    path: KeyPath
    sentence: str
    about_key: bool = False


def refusal(complaints: Iterable[Complaint], **context: Any) -> PydanticCustomError:
    """The error by which a validator tells pydantic all that it has found."""
    found = tuple(complaints)
    sentences = " ".join(f"{rendered(each.path)}: {each.sentence}." for each in found)
    return PydanticCustomError(
        "complaints", "{sentences}", {"sentences": sentences, "complaints": found, **context}
    )


MOST_SHOWN = 20
"""Problems that are worth a line; a file with more has one cause for many of them."""


class ConfigError(SnookerError):
    """A configuration that cannot be used; `problems` holds everything found, in file order."""

    exit_code = ExitCode.CONFIG
    problems: tuple[Problem, ...]

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda problem: problem.position))
        lines = [str(problem) for problem in self.problems[:MOST_SHOWN]]
        if (more := len(self.problems) - MOST_SHOWN) > 0:
            lines.append(f"... and {more:,} more; put these right first")
        super().__init__("\n".join(lines))
