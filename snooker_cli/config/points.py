"""The points of a sweep, and the digest that identifies a point's physics."""

import hashlib
import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from snooker_cli.config.axes import Axes, Axis, Value, axes
from snooker_cli.config.messages import complaints
from snooker_cli.config.models import Experiment
from snooker_cli.config.problems import (
    Complaint,
    ConfigError,
    Data,
    KeyPath,
    PathError,
    Position,
    Problem,
    key_path,
    rendered,
    substituted,
    value_at,
)
from snooker_cli.config.yaml_document import YamlDocument, given

# An experiment -> canonical JSON text, which loads back to an equal experiment.


def to_json(experiment: Experiment) -> str:
    """The experiment as one line of JSON (and so of YAML); an infinite mass is null."""
    return json.dumps(plain(experiment), allow_nan=False, ensure_ascii=False)


def plain(experiment: Experiment) -> dict[str, Any]:
    """The experiment as dicts, lists and scalars that JSON can hold; null for infinity."""
    data: dict[str, Any] = _finite_numbers(experiment.model_dump())
    return data


def _finite_numbers(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite_numbers(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite_numbers(item) for item in value]
    return None if isinstance(value, float) and math.isinf(value) else value


# Document -> Experiment, or everything that is wrong with it at once.

MAX_REPEATS = 1_000_000
"""Repeats of all points of a run: as many files, in as many steps of whatever reads a run."""

BYTES_A_FILE = 12_000
"""As large as that of one ball and one collision."""


def validated(document: YamlDocument) -> Experiment:
    """The experiment a document describes, every swept value tried; raises ConfigError."""
    found: tuple[Complaint, ...]
    try:
        experiment = Experiment.model_validate(document.data)
    except ValidationError as error:
        wrong = complaints(error, document.written)
        data = {**document.data, "sweep": None}
        sweep = _sound_axes(document.data.get("sweep"))
        _, unfit = tried(data, sweep, document.written, wrong)
        found = (*_of_swept_keys(wrong, sweep), *unfit)
    else:
        sweep, unfit = tried(unswept(experiment), experiment.sweep, document.written)
        found = (*unfit, *_too_many(experiment))
        if not found and not document.problems:
            return experiment.model_copy(update={"sweep": sweep})
    # A key whose YAML is at fault has no value yet that could be judged.
    unreadable = {problem.key for problem in document.problems}
    raise ConfigError(
        (
            *document.problems,
            *(
                Problem(document.position(each.path, each.about_key), key, each.sentence)
                for each in found
                if (key := rendered(each.path)) not in unreadable
            ),
        )
    )


def _of_swept_keys(found: tuple[Complaint, ...], sweep: Axes) -> Iterator[Complaint]:
    """The complaints; about a key that is missing but swept they say that this is not enough."""
    swept = {key for axis in sweep for key, _ in axis}
    for each in found:
        key = rendered(each.path)
        keys = ("collisions", "time") if each.sentence.startswith("neither") else (key,)
        absent = each.sentence.startswith(("the key is missing", "neither"))
        if absent and (which := swept.intersection(keys)):
            sentence = (
                f"{each.sentence}; that {min(which)} is swept is not enough, it needs a value too"
            )
            each = replace(each, sentence=sentence)
        yield each


def _too_many(experiment: Experiment) -> Iterator[Complaint]:
    """What is wrong with the number of repeats of all points."""
    points = math.prod(len(axis[0][1]) for axis in experiment.sweep)
    total = points * experiment.repeats
    if total > MAX_REPEATS:
        of = f" of {points:,} points are {total:,}" if points > 1 else " are as many"
        sentence = (
            f"{experiment.repeats:,} repeats{of} files, {total * BYTES_A_FILE / 1e9:,.0f} GB or "
            f"more; a run has at most {MAX_REPEATS:,}, so give fewer"
        )
        yield Complaint(("repeats",), sentence)


def _sound_axes(sweep: Data) -> Axes:
    """The axes of a sweep whose values can be tried; the others have been complained about."""
    try:
        return axes(sweep)
    except PydanticCustomError as error:
        sound: Axes = (error.context or {})["axes"]
        return sound


_NOT_PHYSICS = ("title", "repeats", "sweep")

LIMITS = ("collisions", "time")
"""Where a repeat ends: it goes on from there as it would have anyway."""


@dataclass(frozen=True)
class Point:
    """One combination of a sweep's values."""

    index: int
    """Place in the grid, from 0; the last axis written runs fastest."""
    parameters: tuple[tuple[str, Value], ...]
    """The swept keys and their values here, in the order written; () without a sweep."""
    experiment: Experiment
    """The experiment of this point alone: its `sweep` is empty."""

    def as_json(self) -> dict[str, Any]:
        """The swept keys and values as JSON; the infinite mass of a fixed container is null."""
        return {
            key: None if isinstance(value, float) and math.isinf(value) else value
            for key, value in self.parameters
        }


def points(experiment: Experiment) -> tuple[Point, ...]:
    """Every point of the grid; one when nothing is swept. Raises ConfigError for a bad value."""
    base = unswept(experiment)
    sweep, found = tried(base, experiment.sweep)
    if found:
        raise ConfigError(Problem(Position(), rendered(each.path), each.sentence) for each in found)
    grid = itertools.product(*(_steps(axis) for axis in sweep))
    return tuple(
        _point(index, base, tuple(itertools.chain(*steps))) for index, steps in enumerate(grid)
    )


def _steps(axis: Axis) -> Iterator[tuple[tuple[str, Value], ...]]:
    """The keys of an axis with their values, step by step."""
    keys = tuple(key for key, _ in axis)
    for values in zip(*(values for _, values in axis), strict=True):
        yield tuple(zip(keys, values, strict=True))


def unswept(experiment: Experiment) -> dict[str, Any]:
    """The experiment's keys and values without its sweep, ready to have values replaced."""
    return dict(experiment) | {"sweep": ()}


def _point(index: int, base: Mapping[str, Any], parameters: tuple[tuple[str, Value], ...]) -> Point:
    data: Any = base
    for key, value in parameters:
        data = substituted(data, key_path(key), value)
    try:
        return Point(index, parameters, Experiment.model_validate(data))
    except ValidationError as error:
        setting = ", ".join(
            f"{key}={'null' if value is None else value}" for key, value in parameters
        )
        raise ConfigError(
            Problem(Position(), rendered(each.path), f"{each.sentence} (at the point {setting})")
            for each in complaints(error)
        ) from None


def tried(
    data: Mapping[str, Any],
    sweep: Axes,
    written: Callable[[KeyPath], str] = lambda path: "",
    base: tuple[Complaint, ...] = (),
) -> tuple[Axes, tuple[Complaint, ...]]:
    """The axes with every value as the models read it, and what is wrong with them.

    Each value is tried alone, in place of the one in `data`; those that walk together are tried
    together. `base` is what is already wrong with `data`; it is not repeated.
    """
    axes: list[Axis] = []
    found: list[Complaint] = []
    for axis in sweep:
        read, wrong = _tried(data, axis, written, base)
        axes.append(read)
        found.extend(wrong)
    return tuple(axes), tuple(found)


def _tried(
    data: Mapping[str, Any],
    axis: Axis,
    written: Callable[[KeyPath], str],
    base: tuple[Complaint, ...],
) -> tuple[Axis, list[Complaint]]:
    """One axis as the models read it, and what is wrong with it."""
    paths = {key: key_path(key) for key, _ in axis}
    read: dict[tuple[Value, ...], int] = {}
    found: list[Complaint] = []
    for index, step in enumerate(_steps(axis)):

        def swept(path: KeyPath, index: int = index) -> KeyPath | None:
            """The place in the sweep of what a path leads to; none if it is not swept here."""
            for key, outer in paths.items():
                if path[: len(outer)] == outer:
                    return ("sweep", key, index, *path[len(outer) :])
            return None

        replaced: Any = data
        try:
            for key, value in step:
                replaced = substituted(replaced, paths[key], value)
        except PathError as error:
            return (), [Complaint(("sweep", key), str(error), about_key=True)]
        try:
            experiment = Experiment.model_validate(replaced)
        except ValidationError as error:
            for each in complaints(error, lambda path: written(swept(path) or path)):
                here = swept(each.path)
                if here and not each.about_key:
                    found.append(Complaint(here, each.sentence))
                elif here:
                    return (), [Complaint(here[:2], each.sentence, about_key=True)]
                elif each not in base:
                    sentence = f"{rendered(each.path)} then goes wrong: {each.sentence}"
                    return (), [Complaint(("sweep", axis[0][0]), sentence, about_key=True)]
        else:
            values = tuple(value_at(experiment, path) for path in paths.values())
            if values in read:
                first = rendered(("sweep", axis[0][0], read[values]))
                named = [given(value, written(("sweep", key, index))) for key, value in step]
                stand = "stands" if len(named) == 1 else "stand together"
                sentence = f"{', '.join(named)} {stand} at {first} already; remove one of the two"
                found.append(Complaint(("sweep", axis[0][0], index), sentence))
            read.setdefault(values, index)
    return tuple(zip(paths, zip(*read, strict=True), strict=True)) if read else (), found


def digest(experiment: Experiment, *, limits: bool = True) -> str:
    """SHA-256, in hexadecimal, of what determines the physics of a point.

    That is every key but title, repeats and sweep, with wall_cor and start resolved and without
    collapse if it is stop, as JSON with sorted keys and the shortest decimals that mean the same
    doubles.

    limits : with where it ends; without, it is that of all points with the same collisions as far
        as they go
    """
    left_out = _NOT_PHYSICS if limits else (*_NOT_PHYSICS, *LIMITS)
    document = plain(experiment)
    physics = {key: value for key, value in document.items() if key not in left_out}
    physics["wall_cor"] = experiment.effective_wall_cor
    if experiment.collapse == "stop":
        del physics["collapse"]  # as before there were others
    if experiment.species:
        unplaced = [each.model_copy(update={"start": None}) for each in experiment.species]
        physics["balls"] = [each.model_dump() for each in unplaced]
        physics["start"] = experiment.start
    text = json.dumps(physics, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def extends(longer: Experiment, shorter: Experiment) -> bool:
    """Whether a point is another one, or goes on where that ends: same physics, no limit lower."""
    return digest(longer, limits=False) == digest(shorter, limits=False) and all(
        _limit(longer, name) >= _limit(shorter, name) for name in LIMITS
    )


def _limit(experiment: Experiment, name: str) -> float:
    """Where a point ends; never, without a limit."""
    value = getattr(experiment, name)
    return math.inf if value is None else value
