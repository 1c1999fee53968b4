"""The axes of a sweep: which keys take which values, before the values are tried out."""

import math
from collections.abc import Collection, Mapping
from typing import TypeAlias

from snooker_cli.config.paths import KeyPath, PathError, key_path, rendered
from snooker_cli.config.problems import Complaint, refusal

Scalar: TypeAlias = bool | int | float | str | None
Value: TypeAlias = Scalar | tuple[Scalar, ...]
"""What one key can be given by a sweep: a scalar, or a list of them (a position, say)."""

Axes: TypeAlias = tuple[tuple[str, tuple[Value, ...]], ...]
"""Pairs of (key, values) in the order written; the last one runs fastest."""

MAX_POINTS = 1_000_000

WHOLE_RUN = ("repeats", "seed", "record", "title", "sweep")
"""Keys that cannot be swept."""


def axes(sweep: object) -> Axes:
    """The axes of a `sweep:` mapping (or of axes already made); none if it is null.

    Raises PydanticCustomError of type "complaints", whose context holds every Complaint and the
    axes that nothing is wrong with.
    """
    if sweep is None:
        return ()
    if isinstance(sweep, tuple):
        sweep = dict(sweep)
    if not isinstance(sweep, Mapping):
        sentence = "a mapping of keys to lists is needed, such as {cor: [0.8, 0.9]}"
        raise refusal([Complaint(("sweep",), sentence)], axes=())
    complaints: list[Complaint] = []
    found: dict[KeyPath, tuple[str, tuple[Value, ...]]] = {}
    for key, values in sweep.items():
        try:
            path = _swept_path(key)
            found[path] = rendered(path), _values(values)
        except PathError as error:
            complaints.append(Complaint(("sweep", key), str(error), about_key=True))
    for inner, outer in _overlaps(found).items():
        sentence = f"sweep.{rendered(outer)} already replaces this key; sweep one of the two"
        complaints.append(Complaint(("sweep", found.pop(inner)[0]), sentence, about_key=True))
    count = math.prod(len(values) for _, values in found.values())
    if count > MAX_POINTS:
        sentence = f"the grid has {count:,} points, of at most {MAX_POINTS:,}; sweep fewer values"
        complaints.append(Complaint(("sweep",), sentence))
        found.clear()
    if complaints:
        raise refusal(complaints, axes=tuple(found.values()))
    return tuple(found.values())


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
    if not isinstance(values, list | tuple):
        raise PathError("a list of values is needed, such as [0.8, 0.9]")
    if not values:
        raise PathError("the list is empty; give at least one value or remove the key")
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
        "a sweep replaces single values and pairs, nothing larger; sweep the keys inside one by one"
    )
