"""The axes of a sweep: which keys take which values, before the values are tried out.

A sweep is a grid. Each of its keys is an axis; the keys of a group under `zip` are one axis
together, in the place where `zip` stands, and groups of a list are axes one after the other.
"""

import math
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from decimal import Context, Decimal
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
    key_path,
    refusal,
    rendered,
    shown,
    substituted,
)
from snooker_cli.config.yaml_document import Mark, YamlDocument, given, resolved, snippet

# Evenly spaced values in a few characters: ``range(1, 6)`` and ``0.5:1.0:11``, both ends in.

MAX_POINTS = 100_000
"""Points of a sweep, and so values of a key. More take minutes to try and gigabytes to hold."""

_RANGE = re.compile(r"\s*range\s*\((.*)\)\s*", re.DOTALL)
_SPACED = re.compile(r"\s*([-+.0-9eE]+)\s*:\s*([-+.0-9eE]+)\s*:\s*([-+.0-9eE]+)\s*")
_INTEGER = re.compile(r"\s*[-+]?[0-9]{1,18}\s*")

_DECIMAL = Context(prec=60)
"""Enough digits that rounding to the nearest double is the only rounding that shows."""


def values_of(text: str) -> list[int] | list[float] | None:
    """The values that a text stands for; none if it is no range. Raises PathError."""
    if match := _RANGE.fullmatch(text):
        return _range(match[1])
    if match := _SPACED.fullmatch(text):
        return _spaced(match[1], match[2], match[3])
    return None


def _range(arguments: str) -> list[int]:
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
    if (count := (values[-1] - values[0]) // values.step + 1) > MAX_POINTS:
        raise _too_many(count)
    return list(values)


def _spaced(start: str, stop: str, count: str) -> list[float]:
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
        raise _too_many(number)
    # repr of a double is the shortest decimal that means it: 0.1 here is exactly one tenth.
    first, last = (Decimal(repr(float(end))) for end in ends if isinstance(end, int | float))
    width = _DECIMAL.subtract(last, first)
    return [
        float(_DECIMAL.add(first, _DECIMAL.divide(_DECIMAL.multiply(width, step), number - 1)))
        for step in map(Decimal, range(number))
    ]


def _too_many(count: int) -> PathError:
    return PathError(f"these are {count:,} values, of at most {MAX_POINTS:,}; take fewer")


Scalar: TypeAlias = bool | int | float | str | None
Value: TypeAlias = Scalar | tuple[Scalar, ...]
"""What one key can be given by a sweep: a scalar, or a list of them (a position, say)."""

Axis: TypeAlias = tuple[tuple[str, tuple[Value, ...]], ...]
"""Pairs of (key, values) whose values walk together; most axes have one key."""

Axes: TypeAlias = tuple[Axis, ...]
"""In the order written; the last one runs fastest."""

ZIP = "zip"

WHOLE_RUN = ("repeats", "seed", "record", "title", "sweep")
"""Keys that cannot be swept."""

_GROUP = (
    "a mapping of keys to lists of as many values is needed, such as {cor: [0.8, 0.9], "
    "balls.radius: [0.1, 0.2]}"
)


def axes(sweep: object) -> Axes:
    """The axes of a `sweep:` mapping (or of axes already made); none if it is null.

    Raises PydanticCustomError of type "complaints", whose context holds every Complaint and the
    axes that nothing is wrong with.
    """
    if sweep is None:
        return ()
    if isinstance(sweep, tuple):
        sweep = written(sweep)
    if not isinstance(sweep, Mapping):
        needs = "a mapping of keys to lists is needed, such as {cor: [0.8, 0.9]}"
        sentence = f"{given(sweep)} is given where {needs}"
        raise refusal([Complaint(("sweep",), sentence)], axes=())
    complaints: list[Complaint] = []
    homes: dict[KeyPath, KeyPath] = {}
    found: list[dict[KeyPath, tuple[Value, ...]]] = []
    for where, group in _groups(sweep):
        try:
            found.append(_group(where, group, homes, complaints))
        except PathError as error:
            complaints.append(Complaint(where, str(error), about_key=True))
    for inner, outer in _overlaps(homes).items():
        sentence = f"{rendered(homes[outer])} already replaces this key; sweep one of the two"
        complaints.append(Complaint(homes[inner], sentence, about_key=True))
        found = [group for group in found if inner not in group]
    made = tuple(
        tuple((rendered(path), values) for path, values in group.items())
        for group in found
        if group
    )
    count = math.prod(_length(axis) for axis in made)
    if count > MAX_POINTS:
        sentence = f"the grid has {count:,} points, of at most {MAX_POINTS:,}; sweep fewer values"
        complaints.append(Complaint(("sweep",), sentence))
        made = ()
    if complaints:
        raise refusal(complaints, axes=made)
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
    """A path into `sweep.zip` as if its key were swept by itself; others as they are."""
    if path[:2] != ("sweep", ZIP):
        return path
    return ("sweep", *(part for part in path[2:3] if isinstance(part, str)), *path[3:])


def _length(axis: Axis) -> int:
    """How many values each key of an axis takes."""
    return len(axis[0][1])


def _groups(sweep: Mapping[Any, Any]) -> Iterator[tuple[KeyPath, object]]:
    """Where each axis is written, and its keys with what is given for them."""
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
    """The values of each key of one axis, none if anything is wrong with it.

    homes : where each swept key is written; those of the axis are added

    Raises PathError for what is wrong with the axis as a whole.
    """
    if not isinstance(group, Mapping):
        such = ", or a list of such" if len(where) == 2 else ""
        raise PathError(f"{given(group)} is given where {_GROUP}{such}")
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
        raise PathError(f"values in a zip walk together, but there are {counts}; give as many each")
    return found


def _overlaps(paths: Collection[KeyPath]) -> dict[KeyPath, KeyPath]:
    """The paths that lie inside another one of `paths`, each with that one."""
    return {
        path: path[:end] for path in paths for end in range(1, len(path)) if path[:end] in paths
    }


def _swept_path(key: object) -> KeyPath:
    """The path of a key that may be swept; raises PathError."""
    path = key_path(str(key))
    if path[0] in WHOLE_RUN:
        quotes = ", in quotes if it holds commas or colons" if path[0] == "title" else ""
        raise PathError(
            f"{path[0]} belongs to the whole run and cannot be swept; give it one value{quotes}"
        )
    return path


def _values(values: object) -> tuple[Value, ...]:
    """The values of one axis; raises PathError."""
    if isinstance(values, str):
        try:
            spaced = values_of(values)
        except PathError as error:
            raise PathError(f"{given(values)} is given, but {error}") from None
        if spaced is not None:
            return tuple(spaced)
        if values.startswith("range("):
            raise PathError(f"'{shown(values)}' is no range; between braces put it in quotes")
    if not isinstance(values, list | tuple):
        needs = "a list of values is needed, such as [0.8, 0.9] or 0.5:1.0:11"
        raise PathError(f"{given(values)} is given where {needs}")
    if not values:
        raise PathError("an empty list is given; give at least one value or remove the key")
    return tuple(_value(value) for value in values)


def _value(value: object) -> Value:
    """One value of an axis, made immutable; raises PathError."""
    if isinstance(value, list | tuple):
        return tuple(_scalar(item) for item in value)
    return _scalar(value)


def _scalar(value: object) -> Scalar:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise PathError(
        f"{given(value)} is given where single values or pairs are needed; sweep the keys inside "
        "one by one"
    )


# Command-line overrides: KEY=VALUE, or KEY=several values for a sweep over that key.


def overridden(document: YamlDocument, override: str) -> YamlDocument:
    """The document with one KEY=VALUE applied.

    A single value replaces the value and removes every sweep of that key or of keys inside it;
    several values replace that key's sweep, where it stands. A faulty override changes nothing and
    adds to `Document.problems`.
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
        if len(values) == 1:
            return _with_value(document, path, values[0], marks, label)
        return _with_axis(document, path, values, marks, label)
    except PathError as error:
        problems = [Problem(label, shown(key), str(error))]
    except ConfigError as error:
        problems = [Problem(label, shown(key), each.sentence) for each in error.problems]
    return replace(document, problems=(*document.problems, *problems))


def _override_values(text: str) -> tuple[list[Data], dict[KeyPath, Mark]]:
    """The value or values right of the equals sign, with marks by index.

    Raises PathError or ConfigError.
    """
    if (spaced := values_of(text)) is not None:
        return [*spaced], {}
    # The line break ends a comment, which would hide the bracket.
    data, marks = snippet(f"[{text}\n]")
    if not isinstance(data, list) or not data:
        raise PathError("there is no value; write null to mean none, or a value")
    return data, marks


def _with_value(
    document: YamlDocument, path: KeyPath, value: Data, marks: dict[KeyPath, Mark], label: Position
) -> YamlDocument:
    data = substituted(document.data, path, value)
    kept = {key: mark for key, mark in document.marks.items() if key[: len(path)] != path}
    if isinstance(sweep := data.get("sweep"), dict) and path[0] != "sweep":
        ended = {key for _, key in _swept(sweep) if _is_inside(key, path)}
        data = {**data, "sweep": _without(sweep, ended)}
        kept = {
            key: mark
            for key, mark in kept.items()
            if key[:1] != ("sweep",) or not ended & {*unzipped(key)[1:2]}
        }
    return replace(document, data=data, marks=_merged(kept, marks, (0,), path, label))


def _with_axis(
    document: YamlDocument,
    path: KeyPath,
    values: list[Data],
    marks: dict[KeyPath, Mark],
    label: Position,
) -> YamlDocument:
    sweep = document.data.get("sweep") or {}
    if not isinstance(sweep, dict):
        return document
    swept = rendered(path)
    axis = next((home for home, key in _swept(sweep) if key == swept), ("sweep", swept))
    data = substituted({**document.data, "sweep": sweep}, axis, values)
    kept = {key: mark for key, mark in document.marks.items() if key[: len(axis)] != axis}
    return replace(document, data=data, marks=_merged(kept, marks, (), axis, label))


def _swept(sweep: dict[str, Data]) -> Iterator[tuple[KeyPath, str]]:
    """Where each key of a sweep is written, and the key."""
    for key, values in sweep.items():
        if key != ZIP:
            yield ("sweep", key), key
        elif isinstance(values, dict):
            yield from ((("sweep", ZIP, inner), inner) for inner in values)
        elif isinstance(values, list):
            for number, group in enumerate(values):
                if isinstance(group, dict):
                    yield from ((("sweep", ZIP, number, inner), inner) for inner in group)


def _without(node: Data, ended: set[str]) -> Data:
    """A sweep, or the groups of its zip, without some keys."""
    if isinstance(node, list):
        return [_without(group, ended) for group in node]
    if not isinstance(node, dict):
        return node
    return {
        key: _without(values, ended) if key == ZIP else values
        for key, values in node.items()
        if key not in ended
    }


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
