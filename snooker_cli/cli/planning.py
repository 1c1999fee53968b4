"""``snooker run --dry-run``: what a run would do, what it models, and about how long it takes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from snooker_cli.cli.tables import tell

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from snooker_cli.config import Point
    from snooker_cli.results import Run
    from snooker_cli.runner import Kind

BYTES_AN_EVENT = 14.5
SHORT, BYTES_A_SHORT_EVENT = 4096, 32
"""Shorter repeats are not compressed."""

BYTES_A_BALL = 80
BYTES_A_REPEAT = 16_000
BYTES_A_SUMMARY = 60_000

COLD = 2.0**-104
"""Of the energy: the part at which speeds are those of rounding, ε times what they were."""

PATIENCE = 7 * 86400.0
"""Seconds that a run may take, by its estimate, without being asked for twice."""


def show(content: dict[str, Any], *, as_json: bool) -> None:
    """Print a plan."""
    import json

    if as_json:
        tell(json.dumps(content, allow_nan=False))
        return
    for line in _lines(content):
        tell(line)


def plan(run: Run, kinds: Sequence[Kind], workers: int, fresh: bool = False) -> dict[str, Any]:
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


def refuse_excess(run: Run, kinds: Sequence[Kind], workers: int, fresh: bool = False) -> None:
    """Raise ``UserError`` for what may take very long or more disk than is free."""
    from snooker_cli.cli.endings import UserError

    # The files that are there are checked only if all of them anew would be too much.
    if not _is_excessive(plan(run, kinds, workers, fresh=True)):
        return
    content = plan(run, kinds, workers, fresh)
    if _is_excessive(content):
        raise UserError(
            f"{_estimate(content)}; give fewer collisions or repeats, or record: summary to take "
            "less disk, or --yes if it is meant"
        )


def _is_excessive(content: dict[str, Any]) -> bool:
    """Whether a plan needs more disk than is free, or very long."""
    seconds, free = content["seconds"] or 0.0, content["free_bytes"]
    return seconds > PATIENCE or (free is not None and (content["bytes"] or 0.0) > free)


def _free(directory: Path) -> int | None:
    """Bytes that are free where a folder is or will be; none if the system does not tell."""
    import shutil

    there = next((each for each in (directory, *directory.parents) if each.exists()), directory)
    try:
        disk = shutil.disk_usage(there)
    except OSError:
        return None
    return disk.free if disk.total else None


def _to_do(run: Run, *, fresh: bool) -> dict[int, int]:
    """The number of repeats that each point lacks; those that are there are checked."""
    from snooker_cli.results import State
    from snooker_cli.runner import entry, jobs

    found = dict.fromkeys((point.index for point in run.points), run.experiment.repeats)
    if fresh or not run.directory.is_dir():
        return found
    for job in jobs(run):
        found[job.point.index] -= entry(run, job).state is State.DONE
    return found


def _kind(kind: Kind, to_do: dict[int, int], engine: str | None) -> dict[str, Any]:
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


def _because(kind: Kind, engine: str | None) -> str:
    """Why the kind's engine is what it is."""
    if engine is not None:
        return f"as --engine {engine} says"
    if kind.shape != "circle":
        return f"a {kind.shape} container" if kind.shape == "periodic" else "a box"
    if kind.models["sliding along the wall"]:
        return "balls slide"
    return f"{'many' if kind.models['cells'] else 'few'} balls in a circle"


def _seconds(kind: Kind, point: Point, numbers: dict[int, int]) -> float | None:
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


def _cools_out(kind: Kind, point: Point, number: int) -> bool:
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


def _lines(content: dict[str, Any]) -> Iterator[str]:
    """The plan for people."""
    from snooker_cli.words import counted, listed

    there = "is" if content["cached"] == 1 else "are"
    yield (
        f"{counted(content['points'], 'point')}, {counted(content['repeats'], 'repeat')} each: "
        f"{content['cached']:,} {there} in {content['run']} already, {content['to_do']:,} to do"
    )
    for kind in content["kinds"]:
        balls = kind["balls"]
        numbers = f"{balls[0]:,}" if len(balls) == 1 else f"{balls[0]:,} to {balls[-1]:,}"
        noun = "ball" if balls == [1] else "balls"
        yield ""
        yield f"{_where(kind)}: {numbers} {noun}, {kind['to_do']:,} to do"
        models = dict(kind["models"])
        yield f"  engine    {kind['engine']}: {kind['because']}"
        yield f"  records   {'events' if models.pop('events') else 'a summary'}"
        for heading, wanted in (("modelled", True), ("left out", False)):
            names = [name for name, is_so in models.items() if is_so is wanted]
            yield f"  {heading}  {listed(names) if names else 'nothing'}"
    yield ""
    yield _estimate(content)


def _where(kind: dict[str, Any]) -> str:
    """The points of a kind."""
    from snooker_cli.cli.tables import point_label
    from snooker_cli.words import counted

    points = kind["points"]
    if len(points) == 1:
        return point_label(points[0])
    return f"{counted(len(points), 'point')}, {point_label(points[0])} to {point_label(points[-1])}"


def _estimate(content: dict[str, Any]) -> str:
    """The sentence about time and disk."""
    from snooker_cli.words import counted, size

    if content["to_do"] == 0:
        return "nothing is left to do"
    disk, free = "", content["free_bytes"]
    if content["bytes"] is not None:
        disk = f", and about {size(content['bytes'])}"
        if free is not None and content["bytes"] > free:
            disk += f", where {size(free)} are free"
    if content["collisions"] is None:
        return (
            "a repeat that ends at a time, not after so many collisions, may take any time" + disk
        )
    longer = ", or far longer if balls cool until they hardly meet" if content["cools_out"] else ""
    return (
        f"at most {content['collisions']:,} collisions: about {_duration(content['seconds'])} on "
        f"{counted(content['threads'], 'thread')}{longer}{disk}"
    )


def _duration(seconds: float) -> str:
    """A time to two digits, which is more than is known of it."""
    from snooker_cli.words import rough

    if seconds < 1.0:
        return "a second"
    for unit, size in (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * size:
            return f"{rough(seconds / size)} {unit}"
    return f"{rough(seconds)} s"
