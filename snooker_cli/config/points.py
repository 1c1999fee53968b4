"""Data -> a valid Experiment; its points; the digest that identifies a point's physics."""

import functools
import hashlib
import itertools
import json
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError

from snooker_cli.config.axes import Axes, Axis, Value, number_of_points, sound_axes
from snooker_cli.config.messages import complaints
from snooker_cli.config.models import Experiment
from snooker_cli.config.problems import (
    Complaint,
    ConfigError,
    KeyPath,
    PathError,
    Position,
    Problem,
    given,
    key_path,
    rendered,
    substituted,
    value_at,
)
from snooker_cli.config.yaml_document import YamlDocument

LIMITS = ("collisions", "time")
"""The keys that end a repeat; a later end changes nothing before it."""

MAX_REPEATS = 1_000_000
"""Repeats of all points of a run, which are as many files."""

BYTES_A_FILE = 12_000
"""The size of a file with one ball and one collision."""

_NOT_PHYSICS = ("title", "repeats", "sweep")

_Place = Callable[[KeyPath], KeyPath | None]

_Step = tuple[tuple[str, Value], ...]
"""The keys of an axis with one value each."""


@dataclass(frozen=True)
class Point:
    """One combination of a sweep's values."""

    index: int
    """Place in the grid, from 0; the last axis runs fastest."""
    parameters: tuple[tuple[str, Value], ...]
    """The swept keys and their values here, in the order written; () without a sweep."""
    experiment: Experiment
    """The experiment of this point alone, with an empty `sweep`."""

    def as_json(self) -> dict[str, Any]:
        """The swept keys and values as JSON; the infinite mass of a fixed container is null."""
        return {key: None if value == math.inf else value for key, value in self.parameters}


def validated(document: YamlDocument) -> Experiment:
    """The experiment of a document, with every swept value checked. Raises ConfigError."""
    sweep, faults = sound_axes(document.data.get("sweep"))
    data: dict[str, Any] = {**document.data, "sweep": None}
    known: tuple[Complaint, ...] = ()
    try:
        experiment = Experiment.model_validate(data)
        data = dict(experiment)
    except ValidationError as error:
        known = complaints(error, document.written)
    read = [_read_axis(data, axis, document.written, known) for axis in sweep]
    found = [*_noted(known, sweep), *faults, *itertools.chain(*(unfit for _, unfit in read))]
    if not found:
        experiment = experiment.model_copy(update={"sweep": tuple(axis for axis, _ in read)})
        found += _too_many(experiment)
        if not found and not document.problems:
            return experiment
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


def _noted(found: tuple[Complaint, ...], sweep: Axes) -> Iterator[Complaint]:
    """The complaints, with a note at each key that is missing although it is swept."""
    swept = {key for axis in sweep for key, _ in axis}
    for each in found:
        if keys := swept.intersection(each.missing):
            note = f"; that {min(keys)} is swept is not enough, it needs a value too"
            each = replace(each, sentence=each.sentence + note)
        yield each


def _too_many(experiment: Experiment) -> Iterator[Complaint]:
    """The complaint about more repeats of all points than a run can have."""
    points = number_of_points(experiment.sweep)
    total = points * experiment.repeats
    if total > MAX_REPEATS:
        of = f"of {points:,} points are {total:,}" if points > 1 else "are as many"
        sentence = (
            f"{experiment.repeats:,} repeats {of} files, {total * BYTES_A_FILE / 1e9:,.0f} GB or "
            f"more; a run has at most {MAX_REPEATS:,}, so give fewer"
        )
        yield Complaint(("repeats",), sentence)


def _read_axis(
    data: Mapping[str, Any],
    axis: Axis,
    written: Callable[[KeyPath], str],
    known: tuple[Complaint, ...],
) -> tuple[Axis, list[Complaint]]:
    """One axis as the models read it, and what is wrong with it.

    Each value is tried in place of the one in `data`; values that change together are tried
    together. `known` is what is wrong with `data` itself.
    """
    paths = {key: key_path(key) for key, _ in axis}
    read: dict[tuple[Value, ...], int] = {}
    found: list[Complaint] = []
    for index, step in enumerate(_steps(axis)):
        place = functools.partial(_place_in_sweep, paths, index)

        def as_written(path: KeyPath, place: _Place = place) -> str:
            return written(place(path) or path)

        replaced: Any = data
        try:
            for key, value in step:
                replaced = substituted(replaced, paths[key], value)
            experiment = Experiment.model_validate(replaced)
        except PathError as error:
            return (), [Complaint(("sweep", key), str(error), about_key=True)]
        except ValidationError as error:
            for each in complaints(error, as_written):
                here = place(each.path)
                if here and not each.about_key:
                    found.append(Complaint(here, each.sentence))
                elif here:
                    return (), [Complaint(here[:2], each.sentence, about_key=True)]
                elif each not in known:
                    sentence = f"{rendered(each.path)} then goes wrong: {each.sentence}"
                    return (), [Complaint(("sweep", axis[0][0]), sentence, about_key=True)]
            continue
        values = tuple(value_at(experiment, path) for path in paths.values())
        if values in read:
            first = rendered(("sweep", axis[0][0], read[values]))
            named = [given(value, written(("sweep", key, index))) for key, value in step]
            stand = "stands" if len(named) == 1 else "stand together"
            sentence = f"{', '.join(named)} {stand} at {first} already; remove one of the two"
            found.append(Complaint(("sweep", axis[0][0], index), sentence))
        read.setdefault(values, index)
    return tuple(zip(paths, zip(*read, strict=True), strict=True)) if read else (), found


def _place_in_sweep(paths: Mapping[str, KeyPath], index: int, path: KeyPath) -> KeyPath | None:
    """Where a sweep gives the value at a path, or None if it is not among the swept `paths`."""
    for key, outer in paths.items():
        if path[: len(outer)] == outer:
            return ("sweep", key, index, *path[len(outer) :])
    return None


def _steps(axis: Axis) -> Iterator[_Step]:
    """The keys of an axis with their values, step by step."""
    return zip(*([(key, value) for value in values] for key, values in axis), strict=True)


@functools.lru_cache(maxsize=2)  # several stages of a command ask for the same points
def points(experiment: Experiment) -> tuple[Point, ...]:
    """Every point of the grid; one if nothing is swept. Raises ConfigError for a bad value."""
    base = dict(experiment) | {"sweep": ()}
    grid = itertools.product(*map(_steps, experiment.sweep))
    return tuple(
        _point(index, base, tuple(itertools.chain(*steps))) for index, steps in enumerate(grid)
    )


def _point(index: int, base: Mapping[str, Any], step: _Step) -> Point:
    data: Any = base
    for key, value in step:
        data = substituted(data, key_path(key), value)
    try:
        experiment = Experiment.model_validate(data)
    except ValidationError as error:
        setting = ", ".join(f"{key}={'null' if value is None else value}" for key, value in step)
        raise ConfigError(
            Problem(Position(), rendered(each.path), f"{each.sentence} (at the point {setting})")
            for each in complaints(error)
        ) from None
    # As the model reads them: 1.0 for a written 1.
    parameters = tuple((key, value_at(experiment, key_path(key))) for key, _ in step)
    return Point(index, parameters, experiment)


def to_json(experiment: Experiment) -> str:
    """The experiment as one line of JSON (and so of YAML); an infinite mass is null."""
    return json.dumps(_plain(experiment), allow_nan=False, ensure_ascii=False)


def _plain(experiment: Experiment) -> dict[str, Any]:
    """The experiment as dicts, lists and scalars, with null for infinity."""
    data: dict[str, Any] = json.loads(experiment.model_dump_json())
    return data


def digest(experiment: Experiment, *, limits: bool = True) -> str:
    """SHA-256, in hexadecimal, of what determines the physics of a point.

    It is of JSON with sorted keys and shortest decimals. It covers all keys except title, repeats
    and sweep. wall_cor and start are resolved, and a collapse of stop is left out.

    limits : whether it covers collisions and time too
    """
    left_out = _NOT_PHYSICS if limits else (*_NOT_PHYSICS, *LIMITS)
    physics = {key: value for key, value in _plain(experiment).items() if key not in left_out}
    physics["wall_cor"] = experiment.effective_wall_cor
    if experiment.collapse == "stop":
        del physics["collapse"]  # digests are older than this key
    if experiment.species:
        unplaced = [each.model_copy(update={"start": None}) for each in experiment.species]
        physics["balls"] = [each.model_dump() for each in unplaced]
        physics["start"] = experiment.start
    text = json.dumps(physics, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def extends(longer: Experiment, shorter: Experiment) -> bool:
    """Whether a point has the same physics as another and ends no earlier."""
    ends = [
        [math.inf if (end := getattr(each, name)) is None else end for name in LIMITS]
        for each in (longer, shorter)
    ]
    return digest(longer, limits=False) == digest(shorter, limits=False) and all(
        map(operator.ge, *ends)
    )
