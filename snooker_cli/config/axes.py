"""The axes of a sweep: which keys take which values; ranges, and overrides of the command line.

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
    Position,
    Problem,
    given,
    key_path,
    rendered,
    shown,
    substituted,
)
from snooker_cli.config.yaml_document import Mark, YamlDocument, read

Scalar: TypeAlias = bool | int | float | str | None
Value: TypeAlias = Scalar | tuple[Scalar, ...]
"""What a sweep can give to a key: a scalar, or a list of them (a position, say)."""

Axis: TypeAlias = tuple[tuple[str, tuple[Value, ...]], ...]
"""Pairs of (key, values) whose values change together; most axes have one key."""

Axes: TypeAlias = tuple[Axis, ...]
"""In the order written; the last one runs fastest."""

ZIP = "zip"

WHOLE_RUN = ("repeats", "seed", "record", "title", "sweep")
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
    found: list[Data] = list(islice(values, MAX_POINTS + 1))
    if not found:
        raise PathError("this range is empty; it stops before its second limit, as in Python")
    if len(found) > MAX_POINTS:
        raise PathError(f"these are more than {MAX_POINTS:,} values; take fewer")
    return found


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
    found: list[Axis] = []
    problems: list[Problem] = []
    homes: dict[str, KeyPath] = {}
    for where, group in _groups(sweep):
        try:
            found.append(_axis(where, group, homes, problems))
        except PathError as error:
            problems.append(Problem(where, str(error), about_key=True))
    for key, home in homes.items():
        for outer in homes:
            if is_inside(key, outer):
                sentence = (
                    f"{rendered(homes[outer])} already replaces this key; sweep one of the two"
                )
                problems.append(Problem(home, sentence, about_key=True))
    made = tuple(filter(None, found))
    if (count := math.prod(len(axis[0][1]) for axis in made)) > MAX_POINTS:
        sentence = f"the grid has {count:,} points, of at most {MAX_POINTS:,}; sweep fewer values"
        problems.append(Problem(("sweep",), sentence))
    if problems:
        raise ConfigError(problems)
    return made


def written(sweep: Axes) -> dict[str, Any]:
    """The mapping that `axes` reads as this sweep."""
    zipped = [place for place, axis in enumerate(sweep) if len(axis) > 1]
    if not zipped:
        return dict(chain(*sweep))
    first, end = zipped[0], zipped[-1] + 1
    groups = [dict(axis) for axis in sweep[first:end]]
    return {
        **dict(chain(*sweep[:first])),
        ZIP: groups[0] if len(groups) == 1 else groups,
        **dict(chain(*sweep[end:])),
    }


def unzipped(path: KeyPath) -> KeyPath:
    """A path into `sweep.zip` without its zip; other paths are unchanged."""
    if path[:2] != ("sweep", ZIP):
        return path
    return ("sweep", *(part for part in path[2:3] if isinstance(part, str)), *path[3:])


def is_inside(key: str, outer: str) -> bool:
    """Whether a key is one of those inside another, such as balls.radius of balls."""
    return key.startswith((f"{outer}.", f"{outer}["))


def _groups(sweep: object) -> Iterator[tuple[KeyPath, object]]:
    """The path of each axis of a sweep, and the mapping of its keys to values."""
    if not isinstance(sweep, Mapping | None):
        yield ("sweep",), sweep
        return
    for key, values in (sweep or {}).items():
        if key != ZIP:
            yield ("sweep",), {key: values}
        elif isinstance(values, list):
            yield from ((("sweep", ZIP, number), group) for number, group in enumerate(values))
        else:
            yield ("sweep", ZIP), {} if values is None else values


def _axis(
    where: KeyPath, group: object, homes: dict[str, KeyPath], problems: list[Problem]
) -> Axis:
    """One axis of a sweep. Adds its keys to `homes`, and faults of its keys to `problems`.

    Raises PathError for a fault of the whole axis.
    """
    if not isinstance(group, Mapping):
        example = "{cor: [0.8, 0.9], balls.radius: [0.1, 0.2]}"
        raise PathError(f"{given(group)} is given where a mapping is needed, such as {example}")
    found: dict[str, tuple[Value, ...]] = {}
    for key, values in group.items():
        here = (*where, key)
        try:
            if (top := key_path(str(key))[0]) in WHOLE_RUN:
                raise PathError(
                    f"{top} belongs to the whole run and cannot be swept; give one value"
                )
            if key in homes:
                raise PathError(f"{rendered(homes[key])} sweeps this key already; keep one")
            homes[key] = here
            found[key] = _values(values)
        except PathError as error:
            problems.append(Problem(here, str(error), about_key=True))
    if len({len(values) for values in found.values()}) > 1:
        counts = ", ".join(f"{len(values):,} of {key}" for key, values in found.items())
        raise PathError(f"a zip needs equally many values of each key, but there are {counts}")
    return tuple(found.items())


def _values(values: object) -> tuple[Value, ...]:
    """The values of one key. Raises PathError."""
    if isinstance(values, str):
        try:
            values = range_values(values) or values
        except PathError as error:
            raise PathError(f"{given(values)} is given, but {error}") from None
    if not isinstance(values, list | tuple) or not values:
        needs = "a list of values is needed, such as [0.8, 0.9] or 0.5:1.0:11"
        advice = "; quote range(…) in braces" if str(values).startswith("range(") else ""
        raise PathError(f"{given(values)} is given where {needs}{advice}")
    return tuple(
        tuple(map(_scalar, value)) if isinstance(value, list | tuple) else _scalar(value)
        for value in values
    )


def _scalar(value: object) -> Scalar:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise PathError(
        f"{given(value)} is given where single values or pairs are needed; sweep the keys inside "
        "one by one"
    )


# Overrides: KEY=VALUE, or KEY=several values for a sweep over that key.


def overridden(document: YamlDocument, override: str) -> YamlDocument:
    """The document with one KEY=VALUE applied. Raises ConfigError.

    A single value replaces the value and removes every sweep of that key or of keys inside it.
    Several values replace the sweep of that key at its place.
    """
    label = Position(source=f"-o {shown(override)}")
    key, _, text = override.partition("=")
    key = key.strip()
    try:
        path = key_path(key)
        if path[0] == "sweep" and len(path) > 1:
            raise PathError("sweep is set as a whole, or by its keys: -o KEY=VALUE,VALUE")
        values = range_values(text)
        if values is None:
            # The line break ends a comment, which would hide the bracket.
            data, _ = read(f"[{text}\n]", label.source, in_file=False)
            values = data if isinstance(data, list) else []
        if not values:
            raise PathError("an override is written KEY=VALUE; add a value, or null to mean none")
        return _replaced(document, path, values, Mark(label, label))
    except PathError as error:
        raise ConfigError([Problem((key,), str(error), position=label)]) from None


def _replaced(
    document: YamlDocument, path: KeyPath, values: list[Data], mark: Mark
) -> YamlDocument:
    """The document with the values of an override at a path. Raises PathError."""
    data, key, sweep = document.data, rendered(path), document.data.get("sweep")
    target: KeyPath = ("sweep", key) if len(values) > 1 else path
    if isinstance(sweep, dict | None):
        new = values if target != path else None
        groups = (group for _, group in _groups(sweep) if isinstance(group, Mapping))
        if new and not any(key in group for group in groups):
            data = {**data, "sweep": {**(sweep or {}), key: new}}
        else:
            data = {**data, "sweep": _reswept(sweep, key, new)}
    if target == path:
        data = substituted(data, path, values[0])
    above = {target[:end]: mark for end in range(1, len(target))}
    kept = {each: old for each, old in document.marks.items() if each[: len(target)] != target}
    return YamlDocument(data, {**above, **kept, target: mark})


def _reswept(sweep: Data, key: str, values: list[Data] | None) -> Data:
    """A sweep with other values of a key, or without it and the keys inside it."""
    if isinstance(sweep, list):
        return [_reswept(group, key, values) for group in sweep]
    if not isinstance(sweep, dict):
        return sweep
    found: dict[str, Data] = {}
    for each, old in sweep.items():
        if each == ZIP:
            found[each] = _reswept(old, key, values)
        elif values or not (each == key or is_inside(each, key)):
            found[each] = values if each == key else old
    return found
