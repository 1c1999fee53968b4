"""What is wrong with a configuration, said in plain sentences with a position."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from pydantic_core import PydanticCustomError

from snooker_cli.config.paths import KeyPath, rendered, shown


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


class ConfigError(Exception):
    """A configuration that cannot be used; `problems` holds everything found, in file order."""

    problems: tuple[Problem, ...]

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda problem: problem.position))
        super().__init__(self.problems)

    def __str__(self) -> str:
        lines = [str(problem) for problem in self.problems[:MOST_SHOWN]]
        if (more := len(self.problems) - MOST_SHOWN) > 0:
            lines.append(f"... and {more:,} more; put these right first")
        return "\n".join(lines)
