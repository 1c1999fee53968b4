"""The points of a sweep, and the digest that identifies a point's physics."""

import hashlib
import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from snooker_cli.config.axes import Axes, Axis, Value
from snooker_cli.config.dump import plain
from snooker_cli.config.models import Experiment
from snooker_cli.config.naming import given
from snooker_cli.config.paths import KeyPath, PathError, key_path, rendered, substituted, value_at
from snooker_cli.config.problems import Complaint, ConfigError, Position, Problem
from snooker_cli.config.translation import complaints

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
