"""A run and a selection -> points, their repeats, and words for them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import store
from snooker_cli.containers import SHAPES
from snooker_cli.errors import FigureError
from snooker_cli.formatting import listed, short

if TYPE_CHECKING:
    from pathlib import Path

    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene
    from snooker_cli.store import RepeatHeader
    from snooker_cli.trace import StopReason, Trace


# A run's files -> the selected repeats, and what a caption needs of each.

REMEMBERED_SIZE = 100_000
"""Repeats whose file is at most this long (bytes) stay in memory for the next figure."""


@dataclass(frozen=True)
class Facts:
    """What a caption needs of a repeat.

    motion : start, finish and number of collisions in units of the fastest ball's speed at the
        start; equal if two repeats are one motion at two paces, to the bit
    """

    reason: StopReason
    collisions: int
    motion: bytes


def repeats(run: Run, point: Point, selection: Selection) -> Iterator[Trace]:
    """The selected repeats of a point that are there. Raises ``StoreError``."""
    for number in present(run, point, selection):
        yield _read(run, point, number)


def one_repeat(run: Run, point: Point, selection: Selection) -> Trace:
    """The selected repeat of a point, the first if none is chosen. Raises ``StoreError``."""
    return _read(run, point, present(run, point, selection)[0])


def facts(run: Run, point: Point, selection: Selection, *, single: bool) -> list[Facts]:
    """What a caption needs of the repeats; of the first alone if ``single``."""
    numbers = present(run, point, selection)[: 1 if single else None]
    paths = [run.path(point.index, number) for number in numbers]
    infos = [store.file_info(path) for path in paths]
    return [
        _facts(path, info.modified if info else 0) for path, info in zip(paths, infos, strict=True)
    ]


def _read(run: Run, point: Point, number: int) -> Trace:
    """A repeat of this run from its file, or from memory, see ``_stored``."""
    trace, header = _stored(run.path(point.index, number))
    run.accept(point, number, header)
    return trace


def _stored(path: Path) -> tuple[Trace, RepeatHeader]:
    """A file's content, from memory if the file is small and unchanged."""
    info = store.file_info(path)
    if info is None or info.size > REMEMBERED_SIZE:
        return store.read(path)
    return _remembered(path, info.modified)


@lru_cache(maxsize=8192)
def _remembered(path: Path, modified: int) -> tuple[Trace, RepeatHeader]:
    """A file's content at one time."""
    return store.read(path)


@lru_cache(maxsize=65536)
def _facts(path: Path, modified: int) -> Facts:
    """The facts of a repeat, from its file at one time."""
    trace = _stored(path)[0]
    start, finish = trace.start, trace.finish
    # Doubling all speeds changes no rounding, so that the quotients stay the same to the bit.
    speed = float(np.sqrt(np.max(np.sum(start.velocities**2, axis=1)))) or 1.0
    numbers = np.array([trace.stop.time * speed, trace.wall_events, trace.pair_events])
    parts = (start.positions, start.velocities / speed, finish.positions, finish.velocities / speed)
    motion = b"".join(np.ascontiguousarray(part).tobytes() for part in (*parts, numbers))
    return Facts(trace.stop.reason, trace.collisions, motion)


MOST_SERIES = 6
"""More than this many series cannot be told apart in one figure."""

_WORDS = {
    "balls.rings": "N = {}",
    "balls.count": "N = {}",
    "balls.packing": "packing {}",
    "balls.radius": "r = {} m",
    "balls.mass": "m = {} kg",
    "balls.speed": "v₀ = {} m/s",
    "balls.ring_extent": "ring extent {}",
    "container.radius": "R = {} m",
    "container.width": "width {} m",
    "container.height": "height {} m",
    "container.packing": "packing {}",
    "container.mass": "M = {} kg",
    "cor": "CoR {}",
    "wall_cor": "wall CoR {}",
    "collapse": "collapse: {}",
    "collisions": "{} collisions",
    "time": "{} s",
}

_ABSENT = {"wall_cor": "wall as balls", "container.mass": "fixed wall"}
"""The meaning of a key that is null or infinite."""


@dataclass(frozen=True)
class Selection:
    """The points and repeats to show.

    where : keys of the config and the value that a point must have there; a tuple is a choice
    repeat : one repeat, from 0; ``None`` is the first where one is shown, else all of them
    """

    where: Mapping[str, Any] = field(default_factory=dict)
    repeat: int | None = None


def selected(run: Run, selection: Selection) -> tuple[Point, ...]:
    """The selected points of which a repeat is there, at least one. Raises ``FigureError``."""
    points = tuple(point for point in matching(run, selection) if present(run, point, selection))
    if not points:
        what = "no repeat is" if selection.repeat is None else f"repeat {selection.repeat} is not"
        raise FigureError(f"{what} there yet; run the config again")
    return points


def matching(run: Run, selection: Selection) -> tuple[Point, ...]:
    """The points that are selected, simulated or not, at least one. Raises ``FigureError``."""
    repeats = run.experiment.repeats
    if selection.repeat is not None and not 0 <= selection.repeat < repeats:
        raise FigureError(
            f"there is no repeat {selection.repeat}: {run.name} has repeats 0 to {repeats - 1}"
        )
    points = run.points
    for key, wanted in selection.where.items():
        # A list of coordinates is itself a tuple, and may be the one value that is wanted.
        values = (wanted, *wanted) if isinstance(wanted, tuple) else (wanted,)
        chosen = tuple(point for point in points if value_at(point, key) in values)
        if not chosen:
            present = listed([str(value) for value in distinct(points, key)])
            raise FigureError(f"no point has {key} = {wanted}: there it is {present}")
        points = chosen
    return points


def present(run: Run, point: Point, selection: Selection) -> list[int]:
    """The selected repeats of a point that have a file; all of them if none is chosen."""
    numbers = range(run.experiment.repeats) if selection.repeat is None else [selection.repeat]
    return [number for number in numbers if run.holds(point, number)]


def value_at(point: Point, key: str) -> Any:
    """A point's value of a key such as ``balls.radius``. Raises ``FigureError``."""
    parameters = dict(point.parameters)
    if key in parameters:
        return parameters[key]
    value: Any = point.experiment
    for name in key.split("."):
        if name not in getattr(type(value), "model_fields", ()):
            raise FigureError(f"the experiment has no key {key}; name one that its config has")
        value = getattr(value, name)
    return value


def distinct(points: Sequence[Point], key: str) -> list[Any]:
    """The values of a key over points, each once, in order."""
    return list(dict.fromkeys(value_at(point, key) for point in points))


def varying(points: Sequence[Point]) -> list[str]:
    """The swept keys that have more than one value over the points."""
    return [key for key, _ in points[0].parameters if len(distinct(points, key)) > 1]


def series_of_points(run: Run, selection: Selection) -> list[Point]:
    """The selected points as series of one figure, see ``evenly``."""
    return evenly(selected(run, selection))


def evenly(points: Sequence[Point], most: int = MOST_SERIES) -> list[Point]:
    """Points as series of one figure; of too many along one key, an even choice.

    Raises ``FigureError`` for too many points over several keys.
    """
    if len(points) <= most:
        return list(points)
    keys = varying(points)
    if len(keys) > 1:
        raise FigureError(
            f"{len(points)} points over {listed(keys)} are too many for one figure; choose at "
            f"most {most} with --where"
        )
    return [points[k] for k in np.linspace(0, len(points) - 1, most).round().astype(int)]


def single_point(run: Run, selection: Selection) -> Point:
    """The one selected point. Raises ``FigureError`` if there are several."""
    points = selected(run, selection)
    if len(points) > 1:
        keys = listed(varying(points))
        raise FigureError(
            f"it shows one point and {len(points)} are there; choose one by {keys} with --where"
        )
    return points[0]


def along(points: Sequence[Point], *xs: str, series: str | None = None) -> list[list[Point]]:
    """Points in order of one of the keys ``xs``, a list for each value of the key ``series``.

    Raises ``FigureError`` if each of ``xs`` has one value only, or if other keys have several.
    """
    keys = varying(points)
    x = next((key for key in xs if key in keys), None)
    if x is None:
        raise FigureError(
            f"it needs points at two or more values of {' or '.join(xs)}; sweep that key"
        )
    others = [key for key in keys if key not in (x, series)]
    if others:
        raise FigureError(f"it needs one value of {listed(others)}; choose it with --where")
    values = [None] if series is None or series not in keys else distinct(points, series)
    if len(values) > MOST_SERIES:
        raise FigureError(
            f"{len(values)} values of {series} are too many for one figure; choose at most "
            f"{MOST_SERIES} with --where"
        )
    groups = [
        [point for point in points if value is None or value_at(point, str(series)) == value]
        for value in values
    ]
    return [sorted(group, key=lambda point: float(value_at(point, x))) for group in groups]


def elastic(point: Point) -> bool:
    """Whether no collision of a point loses energy; a periodic box has none with a wall."""
    experiment = point.experiment
    walls = not experiment.container.shape_class.has_wall or experiment.effective_wall_cor == 1.0
    return experiment.cor == 1.0 and walls


def elastic_points(run: Run, selection: Selection) -> list[Point]:
    """The selected points without any loss. Raises ``FigureError`` if there are none."""
    points = [point for point in selected(run, selection) if elastic(point)]
    if not points:
        raise FigureError("it is about the equilibrium of elastic balls; run it at cor 1")
    return points


def inelastic_points(run: Run, selection: Selection) -> list[Point]:
    """The selected points that lose energy. Raises ``FigureError`` if there are none."""
    points = [point for point in selected(run, selection) if not elastic(point)]
    if not points:
        raise FigureError("nothing decays where all collisions are elastic; run it at cor below 1")
    return points


def require_motion(scene: Scene) -> None:
    """Raise ``FigureError`` where nothing moves at the start, so that no ratio to it exists."""
    if scene.kinetic_energy == 0:
        raise FigureError("nothing moves at the start, so there is no ratio to it")


def label(point: Point, points: Sequence[Point]) -> str | None:
    """A point's text in the legend: the keys that vary; ``None`` if it is alone."""
    return ", ".join(described(point, key) for key in varying(points)) or None


def described(point: Point, key: str) -> str:
    """A key and its value in words: ``CoR 0.8``, ``r = 0.1 m``."""
    value = value_at(point, key)
    if key == "balls.rings":
        value = 1 + 3 * value * (value + 1)
    if key == "container.shape":
        return SHAPES[value].title
    if key in _ABSENT and value in (None, math.inf):
        return _ABSENT[key]
    shown = short(value, 6) if isinstance(value, float) else str(value)
    return _WORDS.get(key, f"{key} = {{}}").format(shown)
