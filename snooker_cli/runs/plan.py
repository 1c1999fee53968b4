"""What a run will do: its types of scenes, each tried, and estimates of time and disk."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from snooker_cli.config import BallList, Experiment, Point
from snooker_cli.containers import Circle
from snooker_cli.engine import specialisation
from snooker_cli.errors import SceneError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs.run import Run, State
from snooker_cli.runs.status import entry, jobs
from snooker_cli.scene import Scene

arranged = lru_cache(maxsize=1)(starting_scene)
"""Keeps the last start: of a million balls it takes seconds, and is checked before it is run."""


@dataclass(frozen=True)
class SceneClass:
    """Points whose scenes ask for the same of the engine.

    balls : how many each of them has
    models : what is modelled, and what is not as the scenes do not need it
    """

    shape: str
    points: tuple[Point, ...]
    balls: tuple[int, ...]
    models: dict[str, bool]


def scene_classes(points: Sequence[Point], engine: str | None = None) -> list[SceneClass]:
    """The kinds of scenes of some points; every start that differs is tried.

    Raises ``SceneError``, telling the point, for one that cannot exist or be repeated, or not by
    the engine that is wanted.
    """
    starts: dict[int, tuple[str, int, dict[str, bool]]] = {}
    for same in alike(points).values():
        experiment = same[0].experiment
        try:
            _check_repeats(experiment)
            scene = arranged(experiment, 0)
            kernel = _kernel(scene, experiment, engine)
        except SceneError as error:
            setting = ", ".join(f"{key}={value}" for key, value in same[0].parameters)
            where = f" (at the point {setting})" if setting else ""
            raise SceneError(error.key, f"{error}{where}") from None
        starts.update((point.index, (scene.container.name, scene.number, kernel)) for point in same)
    found: dict[Any, list[Point]] = {}
    for point in points:
        shape, _, kernel = starts[point.index]
        models = kernel | _losses(point.experiment)
        found.setdefault((shape, tuple(models.items())), []).append(point)
    return [
        SceneClass(
            shape, tuple(same), tuple(starts[point.index][1] for point in same), dict(models)
        )
        for (shape, models), same in found.items()
    ]


def _losses(experiment: Experiment) -> dict[str, bool]:
    """What losses there are, and what is watched for because of them."""
    shape = experiment.container.shape_class
    at_wall = experiment.effective_wall_cor < 1.0 and shape.has_wall
    stops = experiment.collapse == "stop"
    return {
        "losses between balls": experiment.cor < 1.0,
        "losses at the wall": at_wall,
        "wall traps": stops and at_wall and issubclass(shape, Circle),
        "collapse": True,
        "lasting contacts": experiment.contact_duration > 0.0,
        "slow collisions elastic": experiment.elastic_below > 0.0,
    }


def _kernel(scene: Scene, experiment: Experiment, engine: str | None) -> dict[str, bool]:
    """What the engine models and records. Raises ``SceneError`` for an engine that cannot do it."""
    try:
        return specialisation(scene, engine=engine) | {"events": experiment.record == "events"}
    except ValueError as error:
        raise SceneError("container.shape", str(error)) from None


def _check_repeats(experiment: Experiment) -> None:
    """Raise ``SceneError`` for repeats that would all be the same bits."""
    if experiment.repeats > 1 and isinstance(experiment.balls, BallList):
        raise SceneError(
            "repeats",
            f"{experiment.repeats} repeats of balls.list would be {experiment.repeats} copies of "
            "the same bits, since its velocities are given; set repeats: 1, or give balls.rings or "
            "balls.count, whose directions are random",
        )


def alike(points: Iterable[Point]) -> dict[Experiment, list[Point]]:
    """Points by what they start from and record: they differ in losses and in their end."""
    found: dict[Experiment, list[Point]] = {}
    plain = {
        "cor": 1.0,
        "wall_cor": None,
        "collisions": 1,
        "time": None,
        "title": None,
    }
    for point in points:
        collapse = "slide" if point.experiment.collapse == "slide" else "stop"
        like = point.experiment.model_copy(update={**plain, "collapse": collapse})
        found.setdefault(like, []).append(point)
    return found


# About how long a run takes, and how much disk.

BYTES_AN_EVENT = 14.5
SHORT, BYTES_A_SHORT_EVENT = 4096, 32
"""Shorter repeats are not compressed."""

BYTES_A_BALL = 80
BYTES_A_REPEAT = 16_000
BYTES_A_SUMMARY = 60_000

COLD = 2.0**-104
"""Of the energy: the part at which speeds are those of rounding, ε times what they were."""

MOST_SECONDS = 7 * 86400.0
"""A run whose estimate is longer needs ``--yes``."""


def run_plan(
    run: Run, kinds: Sequence[SceneClass], workers: int, fresh: bool = False
) -> dict[str, Any]:
    """What ``--json`` prints: repeats that are there and to do, kinds of scenes, time and disk.

    Estimates are ``None`` where the number of collisions is not known beforehand; where a gas may
    cool until it drifts as a whole, the one of time is too low, and ``cools_out`` says so.
    """
    to_do = _to_do(run, fresh=fresh)
    shown = [_kind(kind, to_do, run.engine) for kind in kinds]
    missing = sum(to_do.values())
    seconds = _total(shown, "processor_seconds")
    threads = max(1, min(workers, missing))
    return {
        "run": str(run.directory),
        "points": len(run.points),
        "repeats": run.experiment.repeats,
        "cached": len(run.points) * run.experiment.repeats - missing,
        "to_do": missing,
        "kinds": shown,
        "collisions": _total(shown, "collisions"),
        "threads": threads,
        "seconds": None if seconds is None else seconds / threads,
        "cools_out": any(
            to_do[point.index] > 0 and _cools_out(kind, point, number)
            for kind in kinds
            for point, number in zip(kind.points, kind.balls, strict=True)
        ),
        "bytes": _total(shown, "bytes"),
        "free_bytes": _free(run.directory),
    }


def is_excessive(content: dict[str, Any]) -> bool:
    """Whether a run needs more disk than is free, or over ``MOST_SECONDS``."""
    seconds, free = content["seconds"] or 0.0, content["free_bytes"]
    return seconds > MOST_SECONDS or (free is not None and (content["bytes"] or 0.0) > free)


def _free(directory: Path) -> int | None:
    """Bytes that are free where a folder is or will be; none if the system does not tell."""
    there = next((each for each in (directory, *directory.parents) if each.exists()), directory)
    try:
        disk = shutil.disk_usage(there)
    except OSError:
        return None
    return disk.free if disk.total else None


def _to_do(run: Run, *, fresh: bool) -> dict[int, int]:
    """The number of repeats that each point lacks; those that are there are checked."""
    found = dict.fromkeys((point.index for point in run.points), run.experiment.repeats)
    if fresh or not run.directory.is_dir():
        return found
    for job in jobs(run):
        found[job.point.index] -= entry(run, job).state is State.DONE
    return found


def _kind(kind: SceneClass, to_do: dict[int, int], engine: str | None) -> dict[str, Any]:
    """One kind of scenes, and what its repeats ask for."""
    numbers = dict(zip((point.index for point in kind.points), kind.balls, strict=True))
    estimates = [
        {
            "collisions": _times(to_do[point.index], point.experiment.collisions),
            "processor_seconds": _times(to_do[point.index], _seconds(kind, point, numbers)),
            "bytes": _times(to_do[point.index], _bytes(point, numbers)),
        }
        for point in kind.points
    ]
    return {
        "points": [point.as_json() for point in kind.points],
        "balls": sorted(set(kind.balls)),
        "shape": kind.shape,
        "engine": "cells" if kind.models["cells"] else "allpairs",
        "because": _because(kind, engine),
        "to_do": sum(to_do[point.index] for point in kind.points),
        "models": kind.models,
        **{name: _total(estimates, name) for name in estimates[0]},
    }


def _because(kind: SceneClass, engine: str | None) -> str:
    """Why the kind's engine is what it is."""
    if engine is not None:
        return f"as --engine {engine} says"
    if kind.shape != "circle":
        return f"a {kind.shape} container" if kind.shape == "periodic" else "a box"
    if kind.models["sliding along the wall"]:
        return "balls slide"
    return f"{'many' if kind.models['cells'] else 'few'} balls in a circle"


def _seconds(kind: SceneClass, point: Point, numbers: dict[int, int]) -> float | None:
    """About how long one thread takes for a repeat, s; dilute gases among cells take longer.

    Rates as of `snooker bench speed`: for all pairs a constant and so much a ball, for cells a
    power of the number, as the memory that more balls lie in is slower.
    """
    number, collisions = numbers[point.index], point.experiment.collisions
    if collisions is None:
        return None
    setting_up = 3e-3 + 5e-6 * number
    if not kind.models["cells"]:
        return setting_up + collisions * (1.5e-7 + 5e-9 * number)
    return float(setting_up + collisions * 6e-7 * max(1.0, number / 1000) ** 0.3)


def _cools_out(kind: SceneClass, point: Point, number: int) -> bool:
    """Whether balls without walls cool until they drift together, all but at rest to each other.

    Between two collisions they then cross ever more cells. A collision of equal balls takes
    (1 - CoR²) / N of the energy, on average over directions and speeds (Haff's law by collisions),
    unless they cluster.
    """
    experiment = point.experiment
    lost = (experiment.collisions or 0) * (1.0 - experiment.cor**2) / number
    lasting = kind.shape == "periodic" and experiment.elastic_below == 0.0
    return lasting and lost > -math.log(COLD)


def _bytes(point: Point, numbers: dict[int, int]) -> float | None:
    """About how large a repeat's file becomes."""
    experiment = point.experiment
    frame = BYTES_A_REPEAT + BYTES_A_BALL * numbers[point.index]
    if experiment.record == "summary":
        return frame + BYTES_A_SUMMARY
    if experiment.collisions is None:
        return None
    short = experiment.collisions < SHORT
    return frame + experiment.collisions * (BYTES_A_SHORT_EVENT if short else BYTES_AN_EVENT)


def _times(repeats: int, each: float | None) -> float | None:
    """So many times a value that may not be known."""
    return 0 if repeats == 0 else None if each is None else repeats * each


def _total(parts: Sequence[dict[str, Any]], name: str) -> float | None:
    """A sum, unless one of its parts is not known."""
    values = [part[name] for part in parts]
    return None if None in values else sum(values)
