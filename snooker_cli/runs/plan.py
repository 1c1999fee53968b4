"""The kinds of scenes that points ask for: tried before a run, and told by a dry one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from snooker_cli.config import BallList, Experiment, Point
from snooker_cli.engine import specialisation
from snooker_cli.errors import SceneError
from snooker_cli.placement.starting_scene import starting_scene
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
        starts.update((point.index, (scene.shape, scene.number, kernel)) for point in same)
    found: dict[Any, list[Point]] = {}
    for point in points:
        shape, _, kernel = starts[point.index]
        models = kernel | _losses(point.experiment, shape)
        found.setdefault((shape, tuple(models.items())), []).append(point)
    return [
        SceneClass(
            shape, tuple(same), tuple(starts[point.index][1] for point in same), dict(models)
        )
        for (shape, models), same in found.items()
    ]


def _losses(experiment: Experiment, shape: str) -> dict[str, bool]:
    """What losses there are, and what is watched for because of them."""
    at_wall = experiment.effective_wall_cor < 1.0 and shape != "periodic"
    stops = experiment.collapse == "stop"
    return {
        "losses between balls": experiment.cor < 1.0,
        "losses at the wall": at_wall,
        "wall traps": stops and at_wall and shape == "circle",
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
