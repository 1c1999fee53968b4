"""Data -> a valid Config; its points; the digest that identifies a point's physics."""

import functools
import hashlib
import itertools
import json
import math
import operator
import re
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NewType, TypeAlias, cast

from pydantic import BaseModel, ValidationError

from snooker_cli.config.axes import Value, axes
from snooker_cli.config.models import Config
from snooker_cli.config.problems import (
    MOST_SHOWN,
    ConfigError,
    KeyPath,
    PathError,
    Problem,
    key_path,
    substituted,
    value_at,
)
from snooker_cli.formatting import point_label

LIMITS = ("collisions", "time")  # the keys that end a repeat; a later end changes nothing before it

_NOT_IN_STREAMS = (*LIMITS, "seed", "common_random", "record", "snapshots")
"""Keys that random numbers do not depend on, or not through the digest."""

_ALWAYS = ("container", "balls", "cor", "wall_cor", *LIMITS, "seed", "record")
"""Keys that are as old as digests. Later ones are left out at their defaults: old digests stay."""

MAX_REPEATS = 1_000_000  # repeats of all points of a run, which are as many files

PointConfig = NewType("PointConfig", Config)
"""The config of one point alone, with an empty ``sweep``."""

_Step: TypeAlias = tuple[str, int, Value]  # a swept key, the place of a value, and this value


@dataclass(frozen=True)
class Point:
    """One combination of a sweep's values."""

    index: int
    """Its number in a run. It is the place in the grid, from 0, with the last axis fastest, unless
    the sweep of a stored run has changed since."""
    parameters: tuple[tuple[str, Value], ...]
    """The swept keys and their values here, in the order written; () without a sweep."""
    config: PointConfig

    def __repr__(self) -> str:
        return f"<point {self.index}: {point_label(self.as_json())}>"

    def as_json(self) -> dict[str, Any]:
        """The swept keys and values as JSON; the infinite mass of a fixed container is null."""
        return {key: None if value == math.inf else value for key, value in self.parameters}


def validated(data: Mapping[str, Any]) -> Config:
    """The experiment of a configuration's data, with every point checked. Raises ConfigError."""
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        unset = _unset(data)
        if not unset:
            raise _in_sentences(error) from None
        config = _point(0, data, unset).config
    total = len(points(config)) * config.repeats
    if total > MAX_REPEATS:
        sentence = f"the points have {total:,} repeats in all; at most {MAX_REPEATS:,} are allowed"
        raise ConfigError([Problem(("repeats",), f"{sentence}, so give fewer")])
    return config


def _in_sentences(error: ValidationError) -> ConfigError:
    """The problems of a validation error, in sentences."""
    from snooker_cli.config.messages import config_error  # loaded when there is a problem

    return config_error(error)


def _unset(data: object) -> list[_Step]:
    """The first value of each swept key that has no value of its own; none of a bad sweep."""
    steps: list[_Step] = []
    if not isinstance(data, Mapping):
        return steps
    with suppress(ConfigError):
        for key, values in itertools.chain(*axes(data.get("sweep"))):
            try:
                functools.reduce(operator.getitem, key_path(key), cast(Any, data))
            except (KeyError, IndexError, TypeError):
                steps.append((key, 0, values[0]))
    return steps


@functools.lru_cache(maxsize=2)  # several stages of a command ask for the same points
def points(config: Config) -> tuple[Point, ...]:
    """Every point of the grid; one if nothing is swept.

    Raises ConfigError for a bad value, and for one that is given twice.
    """
    base = dict(config) | {"sweep": ()}
    grid = [
        [[(key, index, values[index]) for key, values in axis] for index in range(len(axis[0][1]))]
        for axis in config.sweep
    ]
    distinct: dict[Any, tuple[Point, list[_Step]]] = {}
    problems: dict[KeyPath, Problem] = {}
    for index, combined in enumerate(itertools.product(*grid)):
        steps = list(itertools.chain(*combined))
        try:
            point = _point(index, base, steps)
            _, same = distinct.setdefault(point.parameters, (point, steps))
            if same is not steps:
                both = zip(steps, same, strict=True)
                key, place = next(new[:2] for new, old in both if new[1] != old[1])
                sentence = f"this value of {key} is given twice; remove one"
                raise ConfigError([Problem(("sweep", key, place), sentence)])
        except ConfigError as error:
            # Points that share a value have its problem.
            problems = {problem.path: problem for problem in error.problems} | problems
            if len(problems) > MOST_SHOWN:
                break
    if problems:
        raise ConfigError(problems.values())
    return tuple(point for point, _ in distinct.values())


def _point(index: int, base: Mapping[str, Any], steps: Iterable[_Step]) -> Point:
    """The point at which keys have these values. Raises ConfigError."""
    data: Any = base
    for key, _, value in steps:
        try:
            data = substituted(data, key_path(key), value)
        except PathError as error:
            raise ConfigError([Problem(("sweep", key), str(error), about_key=True)]) from None
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        problems = _in_sentences(error).problems
        raise ConfigError(_in_sweep(problem, steps) for problem in problems) from None
    # As the model reads them: 1.0 for a written 1.
    parameters = tuple((key, value_at(config, key_path(key))) for key, *_ in steps)
    return Point(index, parameters, PointConfig(config))


def _in_sweep(problem: Problem, steps: Iterable[_Step]) -> Problem:
    """A point's problem, placed at the swept key that causes it; else with all swept values."""
    for key, index, _ in steps:
        outer, path = key_path(key), problem.path
        if all(map(operator.eq, outer, path)):
            inner = () if problem.about_key else (index, *path[len(outer) :])
            return Problem(("sweep", key, *inner), problem.sentence, problem.about_key)
    at = ", ".join(f"{key}={'null' if value is None else value}" for key, _, value in steps)
    return Problem(problem.path, f"{problem.sentence} (at the point {at})", problem.about_key)


def to_json(config: Config) -> str:
    """The experiment as one line of JSON (and so of YAML); an infinite mass is null."""
    data = json.loads(config.model_dump_json())  # so that Python writes the numbers
    return json.dumps(data, allow_nan=False, ensure_ascii=False)


def digest(config: Config, *, without: Collection[str] = ()) -> str:
    """SHA-256, in hexadecimal, of what determines the physics of a point.

    It is of JSON with sorted keys and shortest decimals. It covers all keys except title, repeats
    and sweep, and of a state to start from its balls. wall_cor, the balls' start and
    common_rotation are resolved. All but `_ALWAYS` are left out at their defaults.

    without : more keys to leave out
    """
    left_out = {"title", "repeats", "sweep", "start", *without}
    data = json.loads(to_json(config))
    physics = {key: value for key, value in data.items() if key not in left_out}
    physics["wall_cor"] = config.effective_wall_cor
    for key in physics.keys() - {*_ALWAYS}:
        if getattr(config, key) == Config.model_fields[key].default:
            del physics[key]
    if config.species:
        for_all = {"start": None, "common_rotation": None}
        species = [kind.model_copy(update=for_all) for kind in config.species]
        physics["balls"] = [group.model_dump() for group in (*config.placed, *species)]
        physics["start"] = config.arrangement
        if not config.common_rotation:
            physics["common_rotation"] = False
    text = json.dumps(physics, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def single_values(part: BaseModel, prefix: str = "") -> dict[str, Any]:
    """The values of an experiment that are no lists and no mappings, by key: ``balls.radius``."""
    values: dict[str, Any] = {}
    for key in type(part).model_fields:
        value = getattr(part, key)
        if isinstance(value, BaseModel):
            values |= single_values(value, f"{prefix}{key}.")
        elif value is None or isinstance(value, bool | int | float | str):
            values[f"{prefix}{key}"] = value
    return values


_UNIT = re.compile(r", (m/s|rad/s|m|s|kg|J)(?=[:;,. ]|$)")


def unit_of(part: Any, key: str) -> str:
    """The unit of a key's values, by its description: ``m/s``; empty for a number or a word.

    part : an experiment that has the key
    """
    unit = ""
    for name in key_path(key):
        if isinstance(name, int):
            part = part[name]
            continue
        field = getattr(type(part), "model_fields", {}).get(name)
        if field is not None and (found := _UNIT.search(field.description or "")):
            unit = found[1]  # of one side of a wall it is that of the whole wall
        part = getattr(part, name, None)
    return unit


def with_values(config: Config, parameters: Mapping[str, Value]) -> Config:
    """The experiment of the point of a sweep at which keys have these values.

    Raises ConfigError for a key or a value that it cannot have.
    """
    base = dict(config) | {"sweep": ()}
    return _point(0, base, [(key, 0, value) for key, value in parameters.items()]).config


def stream_seed(config: Config) -> int:
    """The seed of a point's random numbers: of its own, or with common_random of all points.

    It has ``seed`` below bit 64 and above it the digest of the physics. The digest covers no
    collisions and time, so that a longer repeat begins alike.
    """
    if config.common_random:
        return config.seed
    return config.seed | int(digest(config, without=_NOT_IN_STREAMS), 16) << 64


def extends(longer: Config, shorter: Config) -> bool:
    """Whether a point has the same physics as another and ends no earlier."""
    for limit in LIMITS:
        end, other = getattr(longer, limit), getattr(shorter, limit)
        if end is not None and (other is None or end < other):
            return False
    return same_physics(longer, shorter)


def same_physics(config: Config, other: Config) -> bool:
    """Whether two points differ in nothing but their ends."""
    return digest(config, without=LIMITS) == digest(other, without=LIMITS)
