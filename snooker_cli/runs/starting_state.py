"""Configs that start from a state of a stored run.

The state becomes part of the config: single balls and a container. So a run that has begun needs
its source no more, and its digest is that of the state.
"""

from collections.abc import Iterable, Mapping
from os import PathLike
from typing import Any

import numpy as np

from snooker_cli import config as configs
from snooker_cli.config import Loaded, Start
from snooker_cli.engine import state_at
from snooker_cli.errors import SceneError, SnookerError
from snooker_cli.fields import moving_fields
from snooker_cli.formatting import spans
from snooker_cli.runs.folder import open_run
from snooker_cli.runs.run import RepeatState
from snooker_cli.scene import Scene, place_rounding
from snooker_cli.trace import StopReason, Trace

MOST_BALLS = 100_000  # of a state: as single balls they take 15 MB in each file of results


def load(config: str | PathLike[str] | Mapping[str, Any], overrides: Iterable[str] = ()) -> Loaded:
    """``config.load``, with the state of a run that the config starts from. Raises ConfigError."""
    return configs.load(config, overrides, state_of)


def state_of(start: Start) -> dict[str, Any]:
    """The keys ``balls``, ``container`` and ``start`` of a config that starts from a state.

    Raises ``SceneError`` with the key that is wrong.
    """
    trace, content = _read(start)
    scene = trace.start
    if scene.number > MOST_BALLS:
        limit = f"a run can start from a state of {MOST_BALLS:,} balls, not {scene.number:,}"
        raise SceneError("start.run", f"{limit}; take a smaller run")
    time = trace.stop.time if start.time is None else start.time
    state = _state_at(trace, time, start)
    moving = [field for field in moving_fields(state) if not field.of_container]
    columns = {field.key: getattr(state, field.name) for field in moving}
    places = state.positions - state.container_position
    if scene.container.period is not None:
        places = scene.container.nearest_image(places)
    columns |= {"position": places, "radius": scene.radii, "mass": scene.masses}
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    container = {"shape": scene.container.name, **scene.container.lengths}
    if scene.free:
        container |= {"mass": scene.container_mass}
        container |= {"velocity": state.container_velocity.tolist()}
    return {
        "start": {
            **start.model_dump(),
            "time": time,
            "content": content,
            "rounding": _rounding(trace, time, state),
        },
        "container": container,
        "balls": {"list": [dict(zip(columns, row, strict=True)) for row in rows]},
    }


def _read(start: Start) -> tuple[Trace, str]:
    """The repeat of a state, and the hash of it. Raises ``SceneError``."""
    try:
        run = open_run(start.run)
    except SnookerError as error:
        raise SceneError("start.run", str(error)) from None
    for key, number, numbers in (
        ("point", start.point, run.by_number),
        ("repeat", start.repeat, range(run.config.repeats)),
    ):
        if number not in numbers:
            there = f"{run.name} has {key}s {spans(numbers)}"
            raise SceneError(f"start.{key}", f"there is no {key} {number}; {there}")
    status, which = run.status_of(start.point, start.repeat), f"repeat {start.repeat} of {run.name}"
    if status.header is None or status.state is RepeatState.MISSING:
        raise SceneError("start.repeat", f"{which} is not there yet; run its config first")
    if start.time is None and status.header.stop.reason is StopReason.INTERRUPTED:
        finish = "run its config again to finish it, or give a time"
        raise SceneError("start.repeat", f"{which} was interrupted; {finish}")
    try:
        return run.read(run.by_number[start.point], start.repeat), status.header.fingerprint
    except SnookerError as error:
        raise SceneError("start.run", str(error)) from None


def _state_at(trace: Trace, time: float, start: Start) -> Scene:
    """The state of a repeat at a time, s. Raises ``SceneError``."""
    end = trace.stop.time
    if time > end:
        problem = f"repeat {start.repeat} of {start.run} ends at {end!r} s, before {time!r} s"
        raise SceneError("start.time", f"{problem}; give a time up to its end, or none for the end")
    stored, scene = state_at(trace, time)
    if stored != time:
        problem = f"the nearest stored state is at {stored!r} s"
        raise SceneError("start.time", f"{problem}; give this time, or none for the end")
    return scene


def _rounding(trace: Trace, time: float, state: Scene) -> float:
    """How far balls of a state may overlap or stick out by rounding, m; see docs/accuracy.md."""
    scene = trace.start
    velocities = np.vstack([state.velocities, state.container_velocity])
    fastest = float(np.max(np.hypot(*velocities.T)))
    bound = place_rounding(scene.container, 2 * float(np.max(scene.radii)), fastest * time)
    hits = trace.wall_events
    if trace.events is not None:
        events = trace.events[: int(np.searchsorted(trace.events.time, time, side="right"))]
        hits = _most_hits_in_a_row(events.i, events.j, scene.number)
    return bound * (1 + hits)


def _most_hits_in_a_row(i: Any, j: Any, number: int) -> int:
    """The most hits of the wall of a ball since it last met another: it keeps their errors."""
    met, order = np.full(number, -1), np.arange(len(i))
    pairs = j >= 0
    for balls in (i, j):
        np.maximum.at(met, balls[pairs], order[pairs])
    hits = i[~pairs][order[~pairs] > met[i[~pairs]]]
    return int(np.max(np.bincount(hits, minlength=1)))
