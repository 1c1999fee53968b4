"""Command-line overrides: KEY=VALUE, or KEY=several values for a sweep over that key.

Several values are a comma list (``cor=0.8,0.9``), Python's range (``balls.rings=range(1,6)``) or
start:stop:count, both ends included (``cor=0.5:1.0:11``). ``sweep.zip={…}`` has keys walk together.
"""

from collections.abc import Iterator
from dataclasses import replace

from snooker_cli.config.axes import ZIP, unzipped
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
from snooker_cli.config.ranges import values_of


def overridden(document: Document, override: str) -> Document:
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
    if (spaced := values_of(text)) is not None:
        return [*spaced], {}
    # The line break ends a comment, which would hide the bracket.
    data, marks = snippet(f"[{text}\n]")
    if not isinstance(data, list) or not data:
        raise PathError("there is no value; write null to mean none, or a value")
    return data, marks


def _with_value(
    document: Document, path: KeyPath, value: Data, marks: dict[KeyPath, Mark], label: Position
) -> Document:
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
    document: Document,
    path: KeyPath,
    values: list[Data],
    marks: dict[KeyPath, Mark],
    label: Position,
) -> Document:
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
