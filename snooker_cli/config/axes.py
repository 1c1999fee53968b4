"""The axes of a sweep: which keys take which values; ranges.

A sweep is a grid. Each of its keys is an axis. The keys of a group under `zip` are one axis
together, at the place of `zip`; the groups of a list under `zip` are consecutive axes.
"""

import math
import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import chain, islice
from typing import Any, TypeAlias

from snooker_cli.config.problems import (
    ConfigError,
    Data,
    KeyPath,
    PathError,
    Problem,
    excerpt,
    in_words,
    key_path,
)

Scalar: TypeAlias = bool | int | float | str | None
Value: TypeAlias = Scalar | tuple[Scalar, ...]
"""What a sweep can give to a key: a scalar, or a list of them (a position, say)."""

Axis: TypeAlias = tuple[tuple[str, tuple[Value, ...]], ...]
"""Pairs of (key, values) whose values change together; most axes have one key."""

Axes: TypeAlias = tuple[Axis, ...]  # in the order written; the last one runs fastest

ZIP = "zip"

WHOLE_RUN = ("repeats", "seed", "common_random", "record", "snapshots", "title", "start", "sweep")
"""Keys that cannot be swept."""

MAX_POINTS = 100_000
"""Points of a sweep, and values of a key. More take minutes to check and gigabytes to hold."""

_RANGE = re.compile(r"\s*range\s*\((.*)\)\s*", re.DOTALL)
_SPACED = re.compile(r"\s*([-+.0-9eE]+)\s*:\s*([-+.0-9eE]+)\s*:\s*([-+.0-9eE]+)\s*")


# Ranges: range(1, 6), and 0.5:1.0:11 with both ends.


def range_values(text: str) -> list[Data] | None:
    """The values of a range, or None if the text is none. Raises PathError."""
    values: Iterator[int | float]
    if match := _RANGE.fullmatch(text):
        try:
            values = iter(range(*map(int, match[1].split(","))))
        except (TypeError, ValueError):
            needs = "up to three whole numbers, the third not 0: range(start, stop, step)"
            raise PathError(f"a range needs {needs}") from None
    elif match := _SPACED.fullmatch(text):
        values = _evenly_spaced(*match.groups())
    else:
        return None
    first: list[Data] = list(islice(values, MAX_POINTS + 1))
    if not first:
        raise PathError("this range is empty; it stops before its second limit, as in Python")
    if len(first) > MAX_POINTS:
        raise PathError(f"this range has more than {MAX_POINTS:,} values; take fewer")
    return first


def _evenly_spaced(start: str, stop: str, count: str) -> Iterator[float]:
    """`count` numbers from start to stop, each the double nearest to its decimal."""
    try:
        # repr gives the shortest decimal of a double: 0.1 here is exactly one tenth.
        first, last = (Fraction(repr(float(end))) for end in (start, stop))
        steps = int(count) - 1
    except ValueError:
        steps = 0
    if steps < 1:
        needs = "two numbers and a whole count of 2 or more, such as 0.5:1.0:11"
        raise PathError(f"start:stop:count needs {needs}")
    return (float(first + (last - first) * step / steps) for step in range(steps + 1))


# The sweep of a configuration.


def axes(sweep: object) -> Axes:
    """The axes of a `sweep:` mapping; none if it is null. Axes already made are returned.

    Raises ConfigError.
    """
    if isinstance(sweep, tuple):
        return sweep
    problems: list[Problem] = []
    grid = tuple(axis for group in groups_of(sweep) if (axis := _axis(group, problems)))
    keys = [key for axis in grid for key, _ in axis]
    problems += [
        _fault(key, "the sweep sets this key twice; keep one of the two")
        for key in dict.fromkeys(keys)
        if keys.count(key) > 1 or any(is_inside(key, outer) for outer in keys)
    ]
    if (count := math.prod(len(axis[0][1]) for axis in grid)) > MAX_POINTS:
        sentence = f"the grid has {count:,} points; at most {MAX_POINTS:,} are allowed"
        problems.append(Problem(("sweep",), f"{sentence}, so sweep fewer values"))
    if problems:
        raise ConfigError(problems)
    return grid


def written(sweep: Axes) -> dict[str, Any]:
    """The mapping that `axes` reads as this sweep."""
    groups = [dict(axis) for axis in sweep]
    return {ZIP: groups} if any(len(group) > 1 for group in groups) else dict(chain(*sweep))


def unzipped(path: KeyPath) -> KeyPath:
    """A path into `sweep.zip` without its zip; other paths are unchanged."""
    if path[:2] != ("sweep", ZIP):
        return path
    return ("sweep", *(part for part in path[2:3] if isinstance(part, str)), *path[3:])


def is_inside(key: str, outer: str) -> bool:
    """Whether a key is one of those inside another, such as balls.radius of balls."""
    return key.startswith((f"{outer}.", f"{outer}["))


def groups_of(sweep: object) -> list[object]:
    """The mapping of keys to values of each axis of a sweep."""
    if not isinstance(sweep, Mapping | None):
        return [sweep]
    groups: list[object] = []
    for key, values in (sweep or {}).items():
        if key != ZIP:
            groups.append({key: values})
        else:
            groups += values if isinstance(values, list) else [{} if values is None else values]
    return groups


def _axis(group: object, problems: list[Problem]) -> Axis:
    """One axis of a sweep, without the keys that have problems, which are added to a list."""
    if not isinstance(group, Mapping):
        example = "{cor: [0.8, 0.9], balls.radius: [0.1, 0.2]}"
        sentence = f"{in_words(group)} is given where a mapping is needed, such as {example}"
        problems.append(Problem(("sweep",), sentence, about_key=True))
        return ()
    values_of_key: dict[str, tuple[Value, ...]] = {}
    for key, values in group.items():
        try:
            if (top := key_path(str(key))[0]) in WHOLE_RUN:
                sentence = "belongs to the whole run and cannot be swept; give one value"
                raise PathError(f"{top} {sentence}")
            values_of_key[key] = _values(str(key), values)
        except PathError as error:
            problems.append(_fault(key, str(error)))
    if len({len(values) for values in values_of_key.values()}) > 1:
        counts = ", ".join(f"{len(values):,} of {key}" for key, values in values_of_key.items())
        sentence = f"a zip needs equally many values of each key, but there are {counts}"
        problems.append(_fault(next(iter(values_of_key)), sentence))
    return tuple(values_of_key.items())


def _fault(key: str, sentence: str) -> Problem:
    return Problem(("sweep", key), sentence, about_key=True)


def _values(key: str, values: object) -> tuple[Value, ...]:
    """The values of one key. Raises PathError."""
    if isinstance(values, str):
        try:
            values = range_values(values) or values
        except PathError as error:
            raise PathError(f"{in_words(values)} is given, but {error}") from None
    if not isinstance(values, list | tuple) or not values:
        needs = "a list of values is needed, such as [0.8, 0.9] or 0.5:1.0:11"
        advice = ""
        if str(values).startswith("range("):
            advice = "; quote range(…) in braces"
        elif type(values) in (str, int, float) and values != "":
            value = excerpt(values) if isinstance(values, str) else in_words(values)
            advice = f"; write {key}: [{value}], or set {key} outside the sweep"
        raise PathError(f"{in_words(values)} is given where {needs}{advice}")
    for value in values:
        for part in value if isinstance(value, list | tuple) else [value]:
            if isinstance(part, Mapping | list | tuple):
                needs = "single values or pairs are needed; sweep the keys inside one by one"
                raise PathError(f"{in_words(part)} is given where {needs}")
    return tuple(tuple(value) if isinstance(value, list) else value for value in values)
