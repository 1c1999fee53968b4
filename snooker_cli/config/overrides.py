"""Command-line overrides: KEY=VALUE, or KEY=several values for a sweep over that key.

Several values are a comma list (``cor=0.8,0.9``), Python's range (``balls.rings=range(1,6)``) or
start:stop:count, both ends included (``cor=0.5:1.0:11``).
"""

import re
from dataclasses import replace
from decimal import Context, Decimal

from snooker_cli.config.axes import MAX_POINTS
from snooker_cli.config.document import Document, Mark, snippet
from snooker_cli.config.paths import (
    Data,
    KeyPath,
    PathError,
    key_path,
    rendered,
    shown,
    substituted,
)
from snooker_cli.config.problems import ConfigError, Position, Problem
from snooker_cli.config.scalars import resolved

_RANGE = re.compile(r"\s*range\s*\((.*)\)\s*", re.DOTALL)
_SPACED = re.compile(r"\s*([-+.0-9eE]+)\s*:\s*([-+.0-9eE]+)\s*:\s*([-+.0-9eE]+)\s*")
_INTEGER = re.compile(r"\s*[-+]?[0-9]{1,18}\s*")

_DECIMAL = Context(prec=60)
"""Enough digits that rounding to the nearest double is the only rounding that shows."""


def overridden(document: Document, override: str) -> Document:
    """The document with one KEY=VALUE applied.

    A single value replaces the value and removes every sweep of that key or of keys inside it;
    several values replace that key's sweep. A faulty override changes nothing and adds to
    `Document.problems`.
    """
    label = Position(source=f"-o {shown(override)}")
    key, equals, text = override.partition("=")
    key = key.strip()
    try:
        if not equals:
            raise PathError("an override is written KEY=VALUE; add = and a value")
        path = key_path(key)
        if path[0] == "sweep" and len(path) > 1:
            raise PathError(
                f"a sweep is set by the key itself; write -o {rendered(path[1:])}=VALUE,VALUE"
            )
        values, marks = _values(text)
        if len(values) == 1:
            return _with_value(document, path, values[0], marks, label)
        return _with_axis(document, path, values, marks, label)
    except PathError as error:
        problems = [Problem(label, shown(key), str(error))]
    except ConfigError as error:
        problems = [Problem(label, shown(key), each.sentence) for each in error.problems]
    return replace(document, problems=(*document.problems, *problems))


def _values(text: str) -> tuple[list[Data], dict[KeyPath, Mark]]:
    """The value or values right of the equals sign, with marks by index.

    Raises PathError or ConfigError.
    """
    if match := _RANGE.fullmatch(text):
        return _range(match[1]), {}
    if match := _SPACED.fullmatch(text):
        return _spaced(match[1], match[2], match[3]), {}
    # The line break ends a comment, which would hide the bracket.
    data, marks = snippet(f"[{text}\n]")
    if not isinstance(data, list) or not data:
        raise PathError("there is no value; write null to mean none, or a value")
    return data, marks


def _range(arguments: str) -> list[Data]:
    """The integers of Python's range(arguments)."""
    numbers = arguments.split(",")
    if len(numbers) > 3 or not all(_INTEGER.fullmatch(number) for number in numbers):
        raise PathError("range needs one to three whole numbers: range(start, stop, step)")
    limits = [int(number) for number in numbers]
    if len(limits) == 3 and limits[2] == 0:
        raise PathError("the step of a range cannot be 0; choose another")
    values = range(*limits)
    # len() of a range longer than a machine word raises.
    if not values:
        raise PathError("this range is empty; it stops before its second limit, as in Python")
    if (values[-1] - values[0]) // values.step >= MAX_POINTS:
        raise PathError(f"this range has over {MAX_POINTS:,} values; take fewer")
    return list(values)


def _spaced(start: str, stop: str, count: str) -> list[Data]:
    """`count` evenly spaced numbers from start to stop, each the double nearest to its decimal."""
    usage = "start:stop:count needs two numbers and a whole count of 2 or more, such as 0.5:1.0:11"
    try:
        ends = [resolved(start), resolved(stop)]
    except ValueError as error:
        raise PathError(str(error)) from None
    if not all(isinstance(end, int | float) for end in ends) or not _INTEGER.fullmatch(count):
        raise PathError(usage)
    number = int(count)
    if number < 2:
        raise PathError(usage)
    if number > MAX_POINTS:
        raise PathError(f"these are over {MAX_POINTS:,} values; take fewer")
    # repr of a double is the shortest decimal that means it: 0.1 here is exactly one tenth.
    first, last = (Decimal(repr(float(end))) for end in ends if isinstance(end, int | float))
    width = _DECIMAL.subtract(last, first)
    return [
        float(_DECIMAL.add(first, _DECIMAL.divide(_DECIMAL.multiply(width, step), number - 1)))
        for step in map(Decimal, range(number))
    ]


def _with_value(
    document: Document, path: KeyPath, value: Data, marks: dict[KeyPath, Mark], label: Position
) -> Document:
    data = substituted(document.data, path, value)
    kept = {key: mark for key, mark in document.marks.items() if key[: len(path)] != path}
    sweep = data.get("sweep")
    if isinstance(sweep, dict) and path != ("sweep",):
        ended = {key for key in sweep if _is_inside(key, path)}
        data = {**data, "sweep": {key: sweep[key] for key in sweep if key not in ended}}
        kept = {
            key: mark
            for key, mark in kept.items()
            if key[:1] != ("sweep",) or not ended & {*key[1:2]}
        }
    return replace(document, data=data, marks=_merged(kept, marks, (0,), path, label))


def _with_axis(
    document: Document,
    path: KeyPath,
    values: list[Data],
    marks: dict[KeyPath, Mark],
    label: Position,
) -> Document:
    sweep = document.data.get("sweep") or {}
    if not isinstance(sweep, dict):
        return document
    axis: KeyPath = ("sweep", rendered(path))
    data = {**document.data, "sweep": {**sweep, rendered(path): values}}
    kept = {key: mark for key, mark in document.marks.items() if key[:2] != axis}
    return replace(document, data=data, marks=_merged(kept, marks, (), axis, label))


def _is_inside(key: str, path: KeyPath) -> bool:
    """Whether a sweep's key is `path` or a key inside it."""
    try:
        return key_path(key)[: len(path)] == path
    except PathError:
        return False


def _merged(
    kept: dict[KeyPath, Mark],
    marks: dict[KeyPath, Mark],
    old: KeyPath,
    new: KeyPath,
    label: Position,
) -> dict[KeyPath, Mark]:
    """`kept`, with the marks below `old` moved to `new` and said to stand in the override."""
    moved = {
        new + path[len(old) :]: Mark(label, label, mark.written)
        for path, mark in marks.items()
        if path[: len(old)] == old
    }
    ancestors = {new[:end]: Mark(label, label) for end in range(1, len(new) + 1)}
    return {**ancestors, **kept, **moved}
