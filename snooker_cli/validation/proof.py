"""The proof of a repeat: how many of its events are certain, and bounds of their errors.

A certificate has the scene, the true events, and intervals of their times that any program can
check; docs/accuracy.md explains its format.
"""

import json
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from importlib.metadata import version
from itertools import islice
from typing import Any, TypeAlias

import numpy as np

from snooker_cli import __version__
from snooker_cli.engine import ENGINE_VERSION, replay, simulate
from snooker_cli.errors import UNREADABLE, UserError
from snooker_cli.files import sources_hash, user_hash, write_text
from snooker_cli.formatting import counted, duration
from snooker_cli.laws import Sides, WallLaw, word_of
from snooker_cli.runs import Run
from snooker_cli.runs.progress import notice
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import CONTAINER, SLIDE, StopReason, Trace
from snooker_cli.validation.exact_twin import (
    Collision,
    Floats,
    Interval,
    Twin,
    UndecidedError,
    above,
    follow,
    unsupported_key,
)

Record: TypeAlias = dict[str, Any]
Counting: TypeAlias = Callable[[Iterable[Any], str, int], Iterable[Any]]

ROUNDINGS = 64
"""As many roundings of places and times may decide what the next event of the engine is."""

SECONDS, SECONDS_PER_BALL = 3e-4, 1e-6  # of an event, s; dilute gases take more

CHUNK = 1000  # events that are carried out again at a time

SOURCES = ("validation/exact_twin.py", "validation/proof.py", "containers.py", "laws.py")


def uncounted(items: Iterable[Any], _label: str, _total: int) -> Iterable[Any]:
    """The items; nothing shows how many there were."""
    return items


def prove(trace: Trace, collisions: int, counting: Counting = uncounted) -> Record:
    """The certificate of a repeat's first collisions: its events beside those of the exact twin.

    It ends at the first event that is different. Its ``verdict`` is "all"; "rounding" if rounding
    errors make the next event another one; "wrong" if they cannot; "undecided" if no precision
    decides what is next; "slide", which the twin does not have; or "interrupted".

    Raises ``ValueError`` for a scene that has no exact twin.
    """
    events, end, began = trace.events, trace.stop, time.process_time()
    assert events is not None
    compared = min(len(events), collisions)
    # Up to the end of such a repeat there must be no further event.
    whole = compared == len(events) and end.reason in (StopReason.TIME, StopReason.NOTHING_LEFT)
    until = end.time if end.reason is StopReason.TIME else np.inf
    verdict, reason = "all", ""
    twin, worst, places = Twin(trace.start), np.zeros(2), np.empty(0)
    bounds: list[list[float]] = []
    rows: list[list[Any]] = []
    try:
        truth = counting(islice(follow(trace.start, until), compared + whole), "", compared)
        for done, (twin, collision) in enumerate(truth):
            if done == compared and not collision.time < until:
                break
            if done < compared and events.j[done] == SLIDE:
                verdict, reason = "slide", f"event {done + 1} is a slide, which has no twin"
                break
            if done == compared or (events.i[done], events.j[done]) != collision[1:3]:
                verdict, reason = difference(trace, done, collision)
                break
            if done % CHUNK == 0:
                places = replay(trace, events.time[done : done + CHUNK]).positions
            worst = np.maximum(worst, errors(trace, done, twin, places[done % CHUNK], collision))
            rows.append([collision.i, collision.j, *exactly(collision.time)])
            if len(rows) in (1, 10, 100, 1000, 10_000):
                bounds.append([len(rows), *worst.tolist()])
        else:
            if len(rows) < compared:
                verdict, reason = difference(trace, len(rows), None)
    except UndecidedError as question:
        verdict, reason = "undecided", f"event {len(rows) + 1} is not decided: {question}"
    except KeyboardInterrupt:
        verdict, reason = "interrupted", f"event {len(rows) + 1} was not computed"
    if rows and bounds[-1][0] < len(rows):
        bounds.append([len(rows), *worst.tolist()])
    return {
        "certain": len(rows),
        "compared": compared,
        "verdict": verdict,
        "reason": reason,
        "bounds": [dict(zip(("events", "time", "place"), row, strict=True)) for row in bounds],
        "bits": twin.bits,
        "seconds": round(time.process_time() - began, 2),
        "versions": {
            "snooker": __version__,
            "engine": ENGINE_VERSION,
            "python-flint": version("python-flint"),
        },
        "scene": scene_record(trace.start),
        "events": rows,
    }


def errors(
    trace: Trace, done: int, twin: Twin, places: Floats, collision: Collision
) -> tuple[float, float]:
    """Bounds of the errors of an event's time, s, and of the places of its balls then, m."""
    events = trace.events
    assert events is not None
    moment = twin.number(float(events.time[done]))
    if events.residual is not None:
        moment += float(events.residual[done])
    balls = [collision.i] if collision.j == CONTAINER else [collision.i, collision.j]
    apart = [
        abs(twin.nearest(twin.balls[k].position(collision.time) - twin.vector(*places[k].tolist())))
        for k in balls
    ]
    return above(abs(moment - collision.time)), max(map(above, apart))


def difference(trace: Trace, done: int, truth: Collision | None) -> tuple[str, str]:
    """The verdict "rounding" or "wrong", and a sentence, where the next event is not the true one.

    A twin begins at the engine's own, rounded, places after the events before. Rounding explains
    the difference if the engine's event is as early as this twin's, or if the earlier of both is so
    weak that the balls would overlap by less than rounding errors without it.
    """
    events, start = trace.events, trace.start
    assert events is not None
    before = float(events.time[done - 1]) if done else 0.0
    if done:
        state = replay(replace(trace, events=events[:done]), [before])
        start = replace(
            start,
            positions=state.positions[0],
            velocities=state.velocities[0],
            container_position=state.container_positions[0],
            container_velocity=state.container_velocities[0],
        )
    # Time and bodies of the engine's event and of the one that follows from its places, and their
    # speed along the line of centres, or a little more.
    late = trace.stop.time if trace.stop.reason is StopReason.TIME else np.inf
    own: tuple[float, int, int, float] = (late, -1, -1, 0.0)
    follows = (np.inf, -1, -1, 0.0)
    if done < len(events):
        i, j = int(events.i[done]), int(events.j[done])
        masses = np.append(start.masses, start.container_mass)
        speed = float(events.impulse[done]) * (1 / masses[i] + 1 / masses[j])
        own = float(events.time[done]), i, j, speed
    sentence = f"event {done + 1} is {_named(own)}, in truth "
    sentence += "none" if truth is None else _named((float(truth.time), truth.i, truth.j))
    try:
        for _, near in islice(follow(start), 1):
            follows = before + float(near.time), near.i, near.j, float(near.speed)
    except UndecidedError as question:
        return "undecided", f"{sentence}; from the engine's places it is not decided: {question}"
    _, i, j, speed = min(own, follows)
    speeds = np.hypot(*start.velocities.T)
    size = np.max(abs(start.positions)) + max(start.container.size) + np.max(speeds) * before
    rounding = ROUNDINGS * EPSILON * size
    overlap = np.inf
    if j != CONTAINER:
        sine = speed / np.hypot(*(start.velocities[i] - start.velocities[j]))
        overlap = (start.radii[i] + start.radii[j]) * sine**2 / 2
    if abs(own[0] - follows[0]) * speed <= rounding or overlap <= rounding or own[1] < 0:
        return (
            "rounding",
            f"{sentence}; rounding errors of the events before, and chaos, explain it",
        )
    return "wrong", f"{sentence}; from the engine's own places, {_named(follows)} follows"


def _named(event: tuple[float, ...]) -> str:
    moment, i, j = event[:3]
    if i < 0:
        return "none"
    return (
        f"ball {i} and the wall at {moment:.10g} s"
        if j < 0
        else f"balls {i} and {j} at {moment:.10g} s"
    )


def exactly(interval: Interval) -> list[Any]:
    """An interval as [m, r, e]: from (m - r) 2^e to (m + r) 2^e; m and r hexadecimal texts."""
    (middle, first), (radius, second) = interval.mid().man_exp(), interval.rad().man_exp()
    exponent = min(int(first), int(second)) if radius else int(first)
    radius = int(radius) << max(int(second) - exponent, 0)
    return [hex(int(middle) << (int(first) - exponent)), hex(radius), exponent]


def scene_record(scene: Scene) -> Record:
    """A scene as JSON has it; doubles are read back to the bit, an infinite mass is null."""
    arrays = ("positions", "velocities", "radii", "masses")
    centre = ("container_position", "container_velocity")
    return {
        **{name: getattr(scene, name).tolist() for name in (*arrays, *centre)},
        "container": {"shape": scene.container.name, **scene.container.lengths},
        "container_mass": scene.container_mass if scene.free else None,
        "pair_law": _law_record(scene.pair_law),
        "wall_law": _law_record(scene.wall_law),
        "elastic_below": scene.elastic_below,
    }


def _law_record(law: WallLaw) -> Record:
    parts: Record = law._asdict()  # numbers, or the laws of sides
    if isinstance(law, Sides):
        parts = {name: _law_record(part) for name, part in parts.items()}
    return {"law": word_of(law), **parts}


def proven(
    run: Run, point: int, repeat: int, collisions: int, counting: Counting = uncounted
) -> Record:
    """The certificate of a repeat of a run: the one kept beside its file, or a new one.

    It is made again after a change of the repeat, of the number of collisions, or of this code.

    Raises ``UserError`` if there is no such repeat, no exact twin of its scene, or no python-flint,
    and ``StoreError`` for a file that cannot be used.
    """
    chosen = run.chosen(point, repeat)
    trace, status = run.read(chosen, repeat), run.status(point, repeat)
    if key := unsupported_key(trace.start):
        raise UserError(f"{run.name}: --exact cannot follow a scene with {key}")
    try:
        flint = version("python-flint")
    except ModuleNotFoundError:
        advice = "install it with `pip install 'snooker-cli[reference]'`"
        raise UserError("python-flint is not installed", advice) from None
    path = status.path.with_name(f"exact-{repeat:04d}.json")
    fingerprint = status.header.fingerprint if status.header else ""
    origin = json.dumps([fingerprint, collisions, sources_hash(*SOURCES), flint])
    with suppress(*UNREADABLE, KeyError, TypeError):
        kept = json.loads(path.read_text(encoding="utf-8"))
        if kept["hash"] == user_hash(origin + json.dumps(kept["proof"])).hexdigest():
            return dict(kept["proof"])
    if trace.events is None:
        limits, most = chosen.experiment, chosen.experiment.collisions or collisions
        trace = simulate(
            trace.start, collisions=min(most, collisions), time=limits.time, engine=run.engine
        )
    number = min(len(trace.events or ()), collisions)
    seconds = number * (SECONDS + SECONDS_PER_BALL * trace.start.number)
    notice(f"computing up to {counted(number, 'event')}; this takes about {duration(seconds)}")
    proof = {"point": point, "repeat": repeat, **prove(trace, collisions, counting)}
    if proof["verdict"] != "interrupted":
        with suppress(OSError):  # a run that another user owns
            text = user_hash(origin + json.dumps(proof)).hexdigest()
            write_text(path, json.dumps({"hash": text, "proof": proof}) + "\n")
    return proof
