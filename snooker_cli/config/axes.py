"""The axes of a sweep: which keys take which values, before the values are tried out.

A sweep is a grid. Each of its keys is an axis; the keys of a group under `zip` are one axis
together, in the place where `zip` stands, and groups of a list are axes one after the other.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from itertools import chain
from typing import Any, TypeAlias

from snooker_cli.config.naming import given
from snooker_cli.config.paths import KeyPath, PathError, key_path, rendered, shown
from snooker_cli.config.problems import Complaint, refusal
from snooker_cli.config.ranges import MAX_POINTS, values_of

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
