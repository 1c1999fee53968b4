"""The axes of a sweep: which keys take which values; ranges, and overrides of the command line.

A sweep is a grid. Each of its keys is an axis. The keys of a group under `zip` are one axis
together, at the place of `zip`; the groups of a list under `zip` are consecutive axes.
"""

import copy
import functools
import math
import operator
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from itertools import chain
from typing import Any, TypeAlias

from snooker_cli.config.problems import (
    Complaint,
    ConfigError,
    Data,
    KeyPath,
    PathError,
    Position,
    Problem,
    given,
    key_path,
    refusal,
    rendered,
    shown,
    substituted,
)
from snooker_cli.config.yaml_document import Mark, YamlDocument, resolved, snippet

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
_INTEGER = re.compile(r"\s*[-+]?[0-9]{1,18}\s*")

_GROUP = (
    "a mapping of keys to lists of equal length is needed, such as {cor: [0.8, 0.9], "
    "balls.radius: [0.1, 0.2]}"
)


# Ranges: range(1, 6), and 0.5:1.0:11 with both ends.


def range_values(text: str) -> list[int] | list[float] | None:
    """The values of a range, or None if the text is none. Raises PathError."""
    if match := _RANGE.fullmatch(text):
        return _whole_numbers(match[1])
    if match := _SPACED.fullmatch(text):
        return _evenly_spaced(*match.groups())
    return None


def _whole_numbers(arguments: str) -> list[int]:
    """The integers of Python's range(arguments)."""
    numbers = arguments.split(",")
    if len(numbers) > 3 or not all(_INTEGER.fullmatch(number) for number in numbers):
        raise PathError("range needs one to three whole numbers: range(start, stop, step)")
    limits = [int(number) for number in numbers]
    if len(limits) == 3 and limits[2] == 0:
        raise PathError("the step of a range cannot be 0; choose another")
    values = range(*limits)
    if not values:
        raise PathError("this range is empty; it stops before its second limit, as in Python")
    # len() of a range longer than a machine word raises.
    _check_number((values[-1] - values[0]) // values.step + 1)
    return list(values)


def _evenly_spaced(start: str, stop: str, count: str) -> list[float]:
    """`count` numbers from start to stop, each the double nearest to its decimal."""
    try:
        ends = [resolved(start), resolved(stop)]
    except ValueError as error:
        raise PathError(str(error)) from None
    number = int(count) if _INTEGER.fullmatch(count) else 0
    if number < 2 or not all(isinstance(end, int | float) for end in ends):
        raise PathError(
            "start:stop:count needs two numbers and a whole count of 2 or more, such as 0.5:1.0:11"
        )
    _check_number(number)
    # repr gives the shortest decimal of a double: 0.1 here is exactly one tenth.
    first, last = (Fraction(repr(float(end))) for end in ends if isinstance(end, int | float))
    return [float(first + (last - first) * step / (number - 1)) for step in range(number)]


def _check_number(count: int) -> None:
    if count > MAX_POINTS:
        raise PathError(f"these are {count:,} values, of at most {MAX_POINTS:,}; take fewer")


# The sweep of a configuration.


def axes(sweep: object) -> Axes:
    """The axes of a `sweep:` mapping (or of axes already made); none if it is null.

    Raises PydanticCustomError of type "complaints", with every Complaint in its context.
    """
    sound, complaints = sound_axes(sweep)
    if complaints:
        raise refusal(complaints)
    return sound


def sound_axes(sweep: object) -> tuple[Axes, list[Complaint]]:
    """The axes of a `sweep:` mapping that have no fault, and the faults of the others."""
    if sweep is None:
        return (), []
    if isinstance(sweep, tuple):
        sweep = written(sweep)
    if not isinstance(sweep, Mapping):
        needs = "a mapping of keys to lists is needed, such as {cor: [0.8, 0.9]}"
        return (), [Complaint(("sweep",), f"{given(sweep)} is given where {needs}")]
    complaints: list[Complaint] = []
    homes: dict[KeyPath, KeyPath] = {}
    groups: list[dict[KeyPath, tuple[Value, ...]]] = []
    for where, group in _groups(sweep):
        try:
            groups.append(_group(where, group, homes, complaints))
        except PathError as error:
            complaints.append(Complaint(where, str(error), about_key=True))
    for path, home in homes.items():
        if outer := next((path[:k] for k in range(1, len(path)) if path[:k] in homes), None):
            sentence = f"{rendered(homes[outer])} already replaces this key; sweep one of the two"
            complaints.append(Complaint(home, sentence, about_key=True))
            groups = [group for group in groups if path not in group]
    found = tuple(
        tuple((rendered(path), values) for path, values in group.items())
        for group in groups
        if group
    )
    if (count := number_of_points(found)) > MAX_POINTS:
        sentence = f"the grid has {count:,} points, of at most {MAX_POINTS:,}; sweep fewer values"
        return (), [*complaints, Complaint(("sweep",), sentence)]
    return found, complaints


def number_of_points(sweep: Axes) -> int:
    """Number of combinations of the axes' values."""
    return math.prod(len(axis[0][1]) for axis in sweep)


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


def _groups(sweep: Mapping[Any, Any]) -> Iterator[tuple[KeyPath, object]]:
    """The path of each axis of a sweep, and the mapping of its keys to values."""
    for key, values in sweep.items():
        if key != ZIP:
            yield ("sweep",), {key: values}
        elif isinstance(values, list | tuple):
            yield from ((("sweep", ZIP, number), group) for number, group in enumerate(values))
        else:
            yield ("sweep", ZIP), {} if values is None else values


def _group(
    where: KeyPath, group: object, homes: dict[KeyPath, KeyPath], complaints: list[Complaint]
) -> dict[KeyPath, tuple[Value, ...]]:
    """The values of each key of one axis, or none if one of its keys has a fault.

    homes : where each swept key is written; those of the axis are added

    Raises PathError for a fault of the whole axis.
    """
    if not isinstance(group, Mapping):
        several = ", or a list of these" if len(where) == 2 else ""
        raise PathError(f"{given(group)} is given where {_GROUP}{several}")
    found: dict[KeyPath, tuple[Value, ...]] = {}
    for key, values in group.items():
        here = (*where, key)
        try:
            path = _swept_path(key)
            if path in homes:
                raise PathError(f"{rendered(homes[path])} sweeps this key already; keep one")
            homes[path] = here
            found[path] = _values(values)
        except PathError as error:
            complaints.append(Complaint(here, str(error), about_key=True))
    if len(found) < len(group):
        return {}
    if len({len(values) for values in found.values()}) > 1:
        counts = ", ".join(f"{len(values):,} of {rendered(path)}" for path, values in found.items())
        raise PathError(
            f"the keys of a zip need equally many values, but there are {counts}; add some"
        )
    return found


def _swept_path(key: object) -> KeyPath:
    """The path of a key that may be swept. Raises PathError."""
    path = key_path(str(key))
    if path[0] in WHOLE_RUN:
        quotes = ", in quotes if it holds commas or colons" if path[0] == "title" else ""
        raise PathError(
            f"{path[0]} belongs to the whole run and cannot be swept; give it one value{quotes}"
        )
    return path


def _values(values: object) -> tuple[Value, ...]:
    """The values of one key. Raises PathError."""
    if isinstance(values, str):
        try:
            values = range_values(values) or values
        except PathError as error:
            raise PathError(f"{given(values)} is given, but {error}") from None
    if isinstance(values, str) and values.startswith("range("):
        raise PathError(f"'{shown(values)}' is no range; between braces put it in quotes")
    if not isinstance(values, list | tuple):
        needs = "a list of values is needed, such as [0.8, 0.9] or 0.5:1.0:11"
        raise PathError(f"{given(values)} is given where {needs}")
    if not values:
        raise PathError("an empty list is given; give at least one value or remove the key")
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
    """The document with one KEY=VALUE applied.

    A single value replaces the value and removes every sweep of that key or of keys inside it.
    Several values replace the sweep of that key at its place. A faulty override changes nothing
    and adds to `YamlDocument.problems`.
    """
    label = Position(source=f"-o {shown(override)}")
    key, equals, text = override.partition("=")
    key = key.strip()
    try:
        if not equals:
            raise PathError("an override is written KEY=VALUE; add = and a value")
        path = key_path(key)
        if path[0] == "sweep" and path[1:] not in ((), (ZIP,)):
            raise PathError(
                f"a sweep is set by the key itself; write -o {rendered(path[1:])}=VALUE,VALUE"
            )
        values, marks = _override_values(text)
        return _replaced(document, path, values, marks, label)
    except PathError as error:
        problems = [Problem(label, shown(key), str(error))]
    except ConfigError as error:
        problems = [Problem(label, shown(key), each.sentence) for each in error.problems]
    return replace(document, problems=(*document.problems, *problems))


def _override_values(text: str) -> tuple[list[Data], dict[KeyPath, Mark]]:
    """The values to the right of the equals sign, with marks by index.

    Raises PathError or ConfigError.
    """
    if (spaced := range_values(text)) is not None:
        return [*spaced], {}
    # The line break ends a comment, which would hide the bracket.
    data, marks = snippet(f"[{text}\n]")
    if not isinstance(data, list) or not data:
        raise PathError("there is no value; write null to mean none, or a value")
    return data, marks


def _replaced(
    document: YamlDocument,
    path: KeyPath,
    values: list[Data],
    marks: dict[KeyPath, Mark],
    label: Position,
) -> YamlDocument:
    """The document with the values of an override at a path. Raises PathError."""
    sweep = document.data.get("sweep")
    swept = list(_swept(sweep)) if isinstance(sweep, dict) else []
    key = rendered(path)
    target, value = path, values[0]
    origin: KeyPath = (0,)
    ended: list[KeyPath] = []
    if len(values) > 1:
        if sweep and not isinstance(sweep, dict):
            return document  # the sweep has its own problem
        target, value, origin = dict(swept).get(key, ("sweep", key)), values, ()
    elif path[0] != "sweep":
        inside = (f"{key}.", f"{key}[")
        ended = [home for each, home in swept if each == key or each.startswith(inside)]
    data: Any = copy.deepcopy(document.data)
    for *home, last in ended:
        del functools.reduce(operator.getitem, home, data)[last]
    ancestors = {target[:end]: Mark(label, label) for end in range(1, len(target) + 1)}
    kept = {
        each: mark
        for each, mark in document.marks.items()
        if not any(each[: len(gone)] == gone for gone in (target, *ended))
    }
    moved = {
        target + each[len(origin) :]: Mark(label, label, mark.written)
        for each, mark in marks.items()
        if each[: len(origin)] == origin
    }
    return replace(
        document, data=substituted(data, target, value), marks={**ancestors, **kept, **moved}
    )


def _swept(sweep: dict[str, Data]) -> Iterator[tuple[str, KeyPath]]:
    """Each key of a sweep, and where it is written."""
    for where, group in _groups(sweep):
        if isinstance(group, Mapping):
            yield from ((str(key), (*where, key)) for key in group)
