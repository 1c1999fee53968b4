"""What a run will do: classes of its scenes, a check of each, batch size, time and disk."""

import math
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from snooker_cli import facts, store, theory
from snooker_cli.config import BallList, Config, Loaded, Point
from snooker_cli.containers import Container
from snooker_cli.engine import specialisation
from snooker_cli.engine.conversion import setup_of
from snooker_cli.errors import DeniedError, SceneError
from snooker_cli.formatting import point_label
from snooker_cli.laws import PackageLaw
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.results_cache import MEMORY
from snooker_cli.runs.run import RepeatState, RunFolder
from snooker_cli.scene import Scene

MOST_SECONDS = 7 * 86400.0  # a run whose estimate is longer needs ``--yes``
BATCH_SECONDS, BATCH_BYTES = 1.0, 16e6  # about the time and memory of a batch of short repeats

BYTES_OF_REPEAT = 500
BYTES_OF_BALL = 80
BYTES_OF_SUMMARY = 30_000
BYTES_OF_EVENT = 14.5
BYTES_OF_STATE = 32  # of a ball in a snapshot
BYTES_OF_ROUGH = 8  # more of each of both, if balls are rough
EVENT_IN_MEMORY = 24

LAW = "law: "  # before the word of a law that is not one CoR, among what is modelled

ESTIMATES = ("collisions", "processor_seconds", "bytes")
MOST_COLLISIONS = 1e18  # of an estimate
LAST_TIME = 1e250  # s, after which there are no snapshots


@dataclass(frozen=True)
class SceneClass:
    """Points for which the same is modelled.

    balls : the number of balls of each point
    rates : collisions of each point, see `theory.starting_rates`
    models : what is modelled or recorded, and what is left out because the scenes do not need it
    """

    shape: type[Container]
    points: tuple[Point, ...]
    balls: tuple[int, ...]
    rates: tuple[tuple[float, float], ...]
    models: dict[str, bool]


def first_scene(config: Config, repeat: int) -> Scene:
    """A starting scene, which is kept: a million balls take seconds, and a run needs it twice."""
    key = "scene", config, repeat
    return MEMORY.get(key, lambda: starting_scene(config, repeat))


def unseen(_text: str) -> None:
    """Show nothing."""


def points_and_classes(
    loaded: Loaded, show: Callable[[str], None] = unseen
) -> tuple[tuple[Point, ...], list[SceneClass]]:
    """The points of a loaded config and the classes of their scenes.

    show : called with texts that say how far this is

    Raises ``ConfigError``, also for a scene that cannot exist.
    """
    try:
        show("checking the config")
        points = loaded.points()
        return points, scene_classes(points, show)
    except SceneError as error:
        raise loaded.error(error.key, str(error)) from None


def scene_classes(
    points: Sequence[Point], show: Callable[[str], None] = unseen
) -> list[SceneClass]:
    """The classes of the points' scenes. Places the balls of each scene once.

    show : as of ``points_and_classes``

    Raises ``SceneError``, naming the point, for a scene that cannot exist or be repeated.
    """
    groups: dict[Any, list[tuple[Point, int, tuple[float, float]]]] = {}
    # Points that differ in losses or limits alone have the same first scene, which is made once.
    scenes = alike(points).values()
    for number, same in enumerate(scenes, 1):
        show(f"placing balls: scene {number:,} of {len(scenes):,}")
        config = same[0].config
        try:
            repeats, listed = config.repeats, "start" if config.start else "balls.list"
            random_walls = config.collision_rules.wall_law.is_random
            given = isinstance(config.balls, BallList) and not random_walls
            if repeats > 1 and given:
                raise SceneError(
                    "repeats",
                    f"{repeats} repeats of {listed} would be {repeats} copies of the same bits, "
                    "since its velocities are given; set repeats: 1, or give balls.rings or "
                    "balls.count, whose directions are random",
                )
            scene = first_scene(config, 0)
            models = specialisation(scene)
            for rules in {point.config.collision_rules for point in same}:
                if any(isinstance(law, PackageLaw) for law in rules.laws):
                    setup_of(replace(scene, **vars(rules)))  # refuses what the engine lacks
        except (SceneError, ValueError) as error:
            label = point_label(same[0].as_json())
            where = f" (at the point {label})" if same[0].parameters else ""
            wrong = error.key if isinstance(error, SceneError) else "container.shape"
            raise SceneError(wrong, f"{error}{where}") from None
        models["events"] = config.keeps_events
        models |= {"snapshots": True} if config.stored_times else {}
        rates = theory.starting_rates(scene)
        for point in same:
            needed = models | _loss_models(point.config)
            key = type(scene.container), tuple(needed.items())
            groups.setdefault(key, []).append((point, scene.number, rates))
    classes = []
    for (shape, modelled), members in groups.items():
        members.sort(key=lambda member: member[0].index)
        ordered, balls, starting_rates = zip(*members, strict=True)
        classes.append(SceneClass(shape, ordered, balls, starting_rates, dict(modelled)))
    return sorted(classes, key=lambda scene_class: scene_class.points[0].index)


def _collisions(config: Config, balls: int, rates: tuple[float, float]) -> int:
    """The most collisions of a repeat, or about how many it has in its time by Haff's law."""
    most = config.collisions
    if config.time is None:
        return most or 0
    pairs, wall = rates
    zeta = theory.cooling_rate(config.cor, pairs, config.effective_wall_cor, wall)
    if facts.hold(config, "warm_walls"):  # the gas stays about as warm as it starts
        zeta = 0.0
    time = theory.time_without_cooling(config.time, theory.haff_rate(zeta))
    number = min(balls * (pairs / 2 + wall) * time, MOST_COLLISIONS)  # else it may be infinite
    return round(number if most is None else min(number, most))


def _end(config: Config, balls: int, rates: tuple[float, float]) -> float:
    """About when a repeat ends, s, by Haff's law."""
    pairs, wall = rates
    rate = balls * (pairs / 2 + wall)
    if config.collisions is None or not rate > 0:
        return LAST_TIME
    elastic = config.collisions / rate
    zeta = theory.cooling_rate(config.cor, pairs, config.effective_wall_cor, wall)
    alpha = 0.0 if facts.hold(config, "warm_walls") else theory.haff_rate(zeta)
    if alpha * elastic > math.log(LAST_TIME):
        return LAST_TIME
    return math.expm1(alpha * elastic) / alpha if alpha else elastic


def _loss_models(config: Config) -> dict[str, bool]:
    """Which losses a point has, what ends its repeats because of them, and what prevents that."""
    traits, shape = facts.traits_of(config), config.container.shape_class
    at_wall = facts.hold(traits, "walls") and config.effective_wall_cor < 1.0
    traps = at_wall and facts.hold(traits, "cold") and shape.traps
    rules = config.collision_rules
    laws = rules.pair_law, *rules.wall_law.parts
    words = dict.fromkeys(law.name for law in laws if law.name != "constant")
    words |= {"rough": None} if facts.hold(traits, "rough") else {}
    return {f"{LAW}{word}": True for word in words} | {
        "losses between balls": facts.hold(traits, "lossy_cor"),
        "losses at the wall": at_wall,
        "wall traps": traps and config.collapse == "stop",
        "collapse": True,
        "lasting contacts": rules.contact_duration > 0.0,
        "slow collisions elastic": rules.elastic_below > 0.0,
    }


def alike(points: Iterable[Point]) -> dict[Config, list[Point]]:
    """Points by scene and record; they differ in losses, limits and random numbers."""
    common = {"cor": 1.0, "wall_cor": None, "collisions": 1, "time": None, "title": None}
    groups: dict[Config, list[Point]] = {}
    for point in points:
        collapse = "slide" if point.config.collapse == "slide" else "stop"
        record = "events" if point.config.keeps_events else "summary"
        changes = {**common, "collapse": collapse, "record": record}
        same = point.config.model_copy(update=changes)
        groups.setdefault(same, []).append(point)
    return groups


def scenes_of(points: Iterable[Point]) -> list[Scene]:
    """The first scene of each point, with its own rules. They were made for `scene_classes`."""
    scenes = {
        point.index: replace(first_scene(same[0].config, 0), **vars(rules))
        for same in alike(points).values()
        for point in same
        for rules in [point.config.collision_rules]
    }
    return [scenes[point.index] for point in points]


def snapshot_times(config: Config, scene: Scene, end: float = LAST_TIME) -> tuple[float, ...]:
    """The times at which states of a repeat are stored, s, up to an end; () without snapshots.

    scene : its start

    Those per decade are rounded to four digits, so that they are the same on every machine. They
    begin at the power of ten below the time in which a ball moves the mean distance between balls.
    """
    times, end = config.stored_times, min(end, config.time or end)
    if isinstance(times, tuple):
        return times
    speed = math.sqrt(2 * scene.kinetic_energy / float(np.sum(scene.masses)))
    way = math.sqrt(scene.container.area / scene.number)
    decade = math.floor(math.log10(way / speed)) if speed > 0 else 0
    n, decades = times.per_decade, math.floor(math.log10(end)) + 1
    rounded = (
        float(f"{10 ** (k / n):.4g}e{ten}") for ten in range(decade, decades) for k in range(n)
    )
    return tuple(time for time in rounded if time <= end)


def batch_size(config: Config) -> int:
    """How many repeats of a point are simulated and stored together; the same on every machine.

    A file with snapshots has one repeat.
    """
    if config.stored_times:
        return 1
    scene = first_scene(config, 0)
    collisions = _most_collisions(config, scene)
    seconds = _seconds(scene.number, specialisation(scene)["cells"], collisions)
    stored = EVENT_IN_MEMORY * collisions if config.keeps_events else BYTES_OF_SUMMARY
    size = stored + BYTES_OF_REPEAT + BYTES_OF_BALL * scene.number
    return max(1, int(min(BATCH_SECONDS / seconds, BATCH_BYTES / size)))


def _most_collisions(config: Config, scene: Scene) -> float:
    """About the largest number of collisions of a repeat: that of elastic balls."""
    limits = [] if config.collisions is None else [float(config.collisions)]
    if config.time is not None and scene.number:
        squares = math.fsum((scene.velocities * scene.velocities).ravel().tolist())
        speed = math.sqrt(squares / scene.number)
        limits.append(config.time * speed * scene.number / scene.mean_free_path)
    return min(limits)


def _seconds(balls: int, in_cells: bool, collisions: float) -> float:
    """The time of a repeat on one thread, s.

    Those in cells are for random places and a packing of 0.1. A lattice and a dense gas take about
    half, a very dilute gas twice as long. More balls in cells need slower memory.
    """
    time_of_ball, time_of_event = 5e-6, 1.5e-7 + 5e-9 * balls
    if in_cells:
        time_of_ball, time_of_event = 1e-5, 1.2e-6 * max(1.0, balls / 1000) ** 0.3
    return 3e-4 + balls * time_of_ball + collisions * time_of_event


def run_plan(
    run: RunFolder,
    classes: Sequence[SceneClass],
    workers: int,
    fresh: bool = False,
    share: Set[tuple[int, int]] | None = None,
) -> dict[str, Any]:
    """What ``run --dry-run --json`` prints: repeats to do, classes of scenes, time and disk.

    workers : threads that simulate
    fresh : as if the folder were empty
    share : the point and number of each repeat of a part [all]

    ``by_time`` is whether repeats end at a time, so that their collisions are only an estimate.
    Raises ``DeniedError`` for a file that cannot be read.
    """
    to_do = Counter({point.index: run.config.repeats for point in run.points})
    if share is not None:
        to_do = Counter(point for point, _ in share)
    total = to_do.total()
    if not fresh and run.directory.is_dir():
        for point in run.points:
            for status in run.statuses(point.index, check=store.check):
                if isinstance(status.error, DeniedError):
                    raise status.error
                mine = share is None or (status.point, status.repeat) in share
                to_do[status.point] -= mine and status.state is RepeatState.DONE
    missing = to_do.total()
    # More threads than repeats do not help.
    threads = max(1, min(workers, missing))
    kinds = [_class_plan(scene_class, to_do) for scene_class in classes]
    totals = {name: sum(kind[name] for kind in kinds) for name in ESTIMATES}
    return {
        "run": str(run.directory),
        "points": len(run.points),
        "repeats": run.config.repeats,
        "cached": total - missing,
        "to_do": missing,
        "kinds": kinds,
        "collisions": totals["collisions"],
        "by_time": any(point.config.time is not None for point in run.points),
        "threads": threads,
        "seconds": totals["processor_seconds"] / threads,
        "bytes": totals["bytes"],
        "common_random": run.config.common_random,
        "free_bytes": _free_bytes(run.directory),
    }


def is_excessive(plan: dict[str, Any]) -> bool:
    """Whether a run needs more disk than is free, or over ``MOST_SECONDS``."""
    free = plan["free_bytes"]
    return plan["seconds"] > MOST_SECONDS or (free is not None and plan["bytes"] > free)


def _class_plan(scene_class: SceneClass, to_do: Mapping[int, int]) -> dict[str, Any]:
    estimates = [
        _estimates(scene_class, point.config, balls, rates, to_do[point.index])
        for point, balls, rates in zip(
            scene_class.points, scene_class.balls, scene_class.rates, strict=True
        )
    ]
    return {
        "points": [point.as_json() for point in scene_class.points],
        "balls": sorted(set(scene_class.balls)),
        "shape": scene_class.shape.name,
        "search": "neighbours" if scene_class.models["cells"] else "everyone",
        "to_do": sum(to_do[point.index] for point in scene_class.points),
        "models": scene_class.models,
        **dict(zip(ESTIMATES, map(sum, zip(*estimates, strict=True)), strict=True)),
    }


def _estimates(
    scene_class: SceneClass,
    config: Config,
    balls: int,
    rates: tuple[float, float],
    repeats: int,
) -> tuple[int, float, int]:
    """Collisions, time on one thread (s) and disk for some repeats."""
    collisions, events = _collisions(config, balls, rates), scene_class.models["events"]
    stored, recording = float(BYTES_OF_SUMMARY), 1.5e-6 * min(collisions, 20_000)
    more = BYTES_OF_ROUGH if facts.hold(config, "rough") else 0
    if config.stored_times:
        times = snapshot_times(config, first_scene(config, 0), _end(config, balls, rates))
        stored += len(times) * (BYTES_OF_STATE + more) * balls
    if events:
        stored, recording = collisions * (BYTES_OF_EVENT + more), 8e-7 * collisions
    seconds = _seconds(balls, scene_class.models["cells"], collisions) + recording
    size = BYTES_OF_REPEAT + BYTES_OF_BALL * balls + stored
    return repeats * collisions, repeats * seconds, round(repeats * size)


def _free_bytes(directory: Path) -> int | None:
    """The free space where a folder is or will be; None if the system does not report it."""
    existing = (folder for folder in (directory, *directory.parents) if folder.exists())
    try:
        disk = shutil.disk_usage(next(existing, directory))
    except OSError:
        return None
    return disk.free if disk.total else None
